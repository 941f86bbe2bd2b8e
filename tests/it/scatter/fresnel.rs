//! Fresnel equations against a second way to write them.

use tyndall::scatter::fresnel::{Fresnel, conductor, dielectric};
use tyndall_test_support::assert_close;

/// Reflectance with a complex index n + ik, in double precision, by complex arithmetic.
fn reflectance(cos: f64, n: f64, k: f64) -> f64 {
    type Complex = [f64; 2];
    let mul = |a: Complex, b: Complex| [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]];
    let norm = |a: Complex| a[0] * a[0] + a[1] * a[1];
    let index = [n, k];
    let square = mul(index, index);
    // The index times the cosine inside: √(index² − sin²).
    let [re, im] = [square[0] - (1.0 - cos * cos), square[1]];
    let length = re.hypot(im);
    let root = [
        (0.5 * (length + re)).max(0.0).sqrt(),
        (0.5 * (length - re)).max(0.0).sqrt(),
    ];
    let perpendicular = norm([cos - root[0], -root[1]]) / norm([cos + root[0], root[1]]);
    let scaled = [square[0] * cos, square[1] * cos];
    let parallel = norm([scaled[0] - root[0], scaled[1] - root[1]])
        / norm([scaled[0] + root[0], scaled[1] + root[1]]);
    0.5 * (perpendicular + parallel)
}

#[test]
fn conductors_reflect_as_complex_arithmetic_says() {
    for (n, k) in [
        (0.2, 3.9),
        (1.1, 2.1),
        (1.5, 0.0),
        (2.0, 0.1),
        (0.05, 10.0),
        (5.0, 5.0),
    ] {
        for step in 1..=100 {
            let cos = step as f32 / 100.0;
            let expected = reflectance(cos.into(), n, k);
            let actual = f64::from(conductor(cos, n as f32, k as f32));
            assert!(
                (actual - expected).abs() < 3e-6,
                "{n} + {k}i at {cos}: {actual}, {expected}"
            );
        }
    }
}

#[test]
fn without_absorption_a_conductor_is_a_dielectric() {
    for step in 1..=50 {
        let cos = step as f32 / 50.0;
        assert_close(
            conductor(cos, 1.5, 0.0).into(),
            dielectric(cos, 1.0, 1.5).into(),
            1e-4,
        );
    }
}

#[test]
fn extreme_conductors_reflect_between_nothing_and_all() {
    for n in [0.0, 1e-20, 1.0, 1e5, 1e20, f32::MAX, -1.0] {
        for k in [0.0, 1e-20, 1.0, 1e5, 1e20, f32::MAX, -1.0] {
            for cos in [0.0, 1e-30, 1e-4, 0.5, 1.0] {
                let r = conductor(cos, n, k);
                assert!((0.0..=1.0).contains(&r), "{n} + {k}i at {cos}: {r}");
            }
        }
    }
    assert_eq!(conductor(1.0, 0.0, 1.0), 1.0);
    assert_close(conductor(1.0, f32::MAX, 0.0).into(), 1.0, 1e-4);
}

#[test]
fn plastic_reflects_totally_from_the_side_of_its_normal() {
    let coat = Fresnel::Dielectric {
        eta_outside: 1.5,
        eta_inside: 1.0,
    };
    let at = |degrees: f32| f64::from(coat.evaluate(degrees.to_radians().cos()).g());
    assert_close(at(0.0), 0.04, 1e-4);
    assert_close(at(40.0), 0.245, 5e-3);
    assert_eq!(at(42.0), 1.0);
    // Its back is ordinary.
    let back = f64::from(coat.evaluate(-(60f32.to_radians().cos())).g());
    assert_close(back, f64::from(dielectric(0.5, 1.0, 1.5)), 1e-5);
}
