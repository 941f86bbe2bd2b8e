//! What media do with numbers at the ends of their range.

use glam::{DAffine3, DVec3, Vec3A};

use crate::math::{Point3, Ray, Transform, Vec3};
use crate::medium::homogeneous::ColumnFlight;
use crate::medium::lattice::Lattice;
use crate::medium::{DensityGrid, GridMedium, Homogeneous, Medium, MediumEvent};
use crate::sampling::rng::Rng;
use crate::scatter::HenyeyGreenstein;
use crate::spectrum::Rgb;

const PHASE: HenyeyGreenstein = HenyeyGreenstein { g: 0.0 };

/// A medium in the box of `size` at `corner`, whose sigma_s and density are given; `turn` is applied last.
fn boxed(
    n: [usize; 3],
    values: &[f32],
    [corner, size]: [DVec3; 2],
    turn: DAffine3,
    [sigma_a, sigma_s]: [Rgb; 2],
) -> Medium {
    let render_from_unit = turn * DAffine3::from_translation(corner) * DAffine3::from_scale(size);
    let unit_from_render = Transform::from_affine(render_from_unit.inverse()).expect("invertible");
    let grid = DensityGrid::new(n, values);
    Medium::Grid(Box::new(GridMedium::new(
        grid,
        &unit_from_render,
        sigma_a,
        sigma_s,
        PHASE,
    )))
}

fn along(o: Vec3A, d: Vec3A) -> Ray {
    Ray {
        o: Point3(o),
        d: Vec3(d),
        time: 0.0,
    }
}

#[test]
fn what_is_far_away_absorbs_and_scatters_as_it_does_nearby() {
    let n = [16; 3];
    let mut rng = Rng::new(3);
    let values: Vec<f32> = (0..16 * 16 * 16).map(|_| rng.uniform()).collect();
    let size = DVec3::splat(16.0);
    for (k, distance) in (0..60).zip([20, 24, 27, 30, 40].into_iter().cycle()) {
        let d = if k % 2 == 0 {
            Vec3A::Z
        } else {
            Vec3A::new(0.6, 0.0, 0.8)
        };
        let offset = Vec3A::new(4.0 * rng.uniform(), 4.0 * rng.uniform(), 0.0);
        // Where the ray is after so many units, as a whole number and a rest.
        let exact = offset.as_dvec3() + d.as_dvec3() * (1u64 << distance) as f64;
        let (whole, rest) = (exact.round(), exact - exact.round());
        let place = |center: DVec3, sigma: [Rgb; 2]| {
            boxed(n, &values, [center - 8.0, size], DAffine3::IDENTITY, sigma)
        };
        let rays = [
            (whole, along(offset, d), (1u64 << distance) as f32),
            (
                DVec3::ZERO,
                along((rest - 32.0 * d.as_dvec3()).as_vec3a(), d),
                32.0,
            ),
        ];
        // Without dice: absorption, and the flight to a depth.
        let absorbed = rays.map(|(center, ray, _)| {
            let medium = place(center, [Rgb::splat(0.2), Rgb::BLACK]);
            medium
                .transmittance(&ray, f32::INFINITY, &mut Rng::new(0))
                .r()
        });
        let off = (absorbed[0] / absorbed[1] - 1.0).abs();
        assert!(off < 2e-5, "2^{distance}, {d}: {absorbed:?}");
        let flown = rays.map(|(center, ray, middle)| {
            let medium = place(center, [Rgb::BLACK, Rgb::splat(0.4)]);
            match medium.sample(&ray, 1e20, Rgb::ONE, Some(1.0), &mut Rng::new(0)) {
                MediumEvent::Scatter { t, .. } => t - middle,
                MediumEvent::Pass { .. } => panic!("2^{distance}: it is thicker than that"),
            }
        });
        // Distances along the ray are numbers of f32.
        let digit = rays[0].2 * f32::EPSILON;
        assert!((flown[0] - flown[1]).abs() <= digit + 1e-4, "{flown:?}");
        // With dice: every collision is decided alike, up to rounding.
        let passed = rays.map(|(center, ray, _)| {
            let medium = place(center, [Rgb::BLACK, Rgb::splat(0.2)]);
            let mut rng = Rng::new(7);
            let passes = (0..2000).filter(|_| {
                let event = medium.sample(&ray, 1e20, Rgb::ONE, None, &mut rng);
                matches!(event, MediumEvent::Pass { .. })
            });
            passes.count() as f32 / 2000.0
        });
        assert!((passed[0] - absorbed[1]).abs() < 0.05, "{passed:?}");
        // What ends before the medium does not meet it, and what misses it passes.
        let (center, ray, middle) = rays[0];
        let medium = place(center, [Rgb::splat(1e3), Rgb::BLACK]);
        let clear = medium.transmittance(&ray, 0.9 * middle - 20.0, &mut rng);
        assert_eq!(clear, Rgb::ONE);
        let past = along(offset + Vec3A::new(0.0, 20.0, 0.0), d);
        assert_eq!(
            medium.transmittance(&past, f32::INFINITY, &mut rng),
            Rgb::ONE
        );
    }
}

#[test]
fn rays_from_places_that_overflow_in_a_grid_meet_it_and_give_numbers() {
    // Turned by an eighth, the places of such rays are differences of infinities.
    let (x, y) = (DVec3::new(1.0, 1.0, 0.0), DVec3::new(-1.0, 1.0, 0.0));
    let turn = DAffine3::from_cols(x, y, DVec3::Z, DVec3::ZERO);
    let place = [DVec3::new(-5.0, -5.0, -5.0), DVec3::splat(10.0)];
    let values = [1.0; 1];
    let medium = boxed(
        [1; 3],
        &values,
        place,
        turn * DAffine3::from_scale(DVec3::splat(1e-2)),
        [Rgb::splat(1e3), Rgb::BLACK],
    );
    let diagonal = Vec3A::new(1.0, 1.0, 0.0).normalize();
    let mut rng = Rng::new(1);
    for far in [1e6, 1e10, 1e37, 1e38, 3e38] {
        let ray = along(Vec3A::new(-far, -far, 0.0), diagonal);
        let tr = medium.transmittance(&ray, f32::INFINITY, &mut rng);
        assert!(tr.is_finite() && !tr.has_negative(), "{far}: {tr:?}");
        // As far as f64 tells the sides of the box apart.
        assert!(far > 1e10 || tr.max_component() < 1e-6, "{far}: {tr:?}");
        for _ in 0..1000 {
            let mut number = || far * (2.0 * rng.uniform() - 1.0);
            let o = Vec3A::new(number(), number(), number());
            let ray = along(o, (-o / far).normalize());
            let tr = medium.transmittance(&ray, f32::INFINITY, &mut rng);
            assert!(tr.is_finite() && !tr.has_negative(), "{o}: {tr:?}");
        }
    }
}

#[test]
fn flights_in_voxels_of_any_size_end_at_numbers() {
    for size in [1e-44, 1e-40, 1e-36, 1e30, 1e38, 1e40, 1e44, 1e50] {
        for (sigma, value) in [(1e-20, 1e-30), (1.0, 1.0), (1e-40, 1.0), (1e20, 1e10)] {
            for sigma_a in [Rgb::splat(sigma), Rgb::BLACK] {
                let place = [DVec3::splat(-0.5 * size), DVec3::splat(size)];
                let sigma = [sigma_a, Rgb::splat(sigma) - sigma_a];
                let turn = DAffine3::IDENTITY;
                let medium = boxed([2; 3], &[value; 8], place, turn, sigma);
                for d in [Vec3A::X, Vec3A::new(0.6, 0.0, -0.8)] {
                    let ray = along(Vec3A::ZERO, d);
                    let mut rng = Rng::new(6);
                    for t_max in [1.0, f32::INFINITY] {
                        let tr = medium.transmittance(&ray, t_max, &mut rng);
                        assert!(tr.is_finite() && !tr.has_negative(), "{size}: {tr:?}");
                        for depth in [None, Some(0.0), Some(0.1)] {
                            match medium.sample(&ray, t_max, Rgb::ONE, depth, &mut rng) {
                                MediumEvent::Pass { weight } => assert!(weight.is_finite()),
                                MediumEvent::Scatter { t, weight } => {
                                    assert!(t.is_finite() && weight.is_finite(), "{size}: {t}");
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn voxels_of_any_size_dim_alike_where_they_are_as_thick() {
    let transmittance = |size: f64, d: Vec3A| {
        let place = [DVec3::splat(-0.5 * size), DVec3::splat(size)];
        let sigma = [Rgb::BLACK, Rgb::splat((1.0 / size) as f32)];
        let medium = boxed([2; 3], &[1.0; 8], place, DAffine3::IDENTITY, sigma);
        let tr = medium.transmittance(&along(Vec3A::ZERO, d), f32::INFINITY, &mut Rng::new(6));
        f64::from(tr.max_component())
    };
    let slanted = Vec3A::new(0.48, -0.6, 0.64);
    for d in [Vec3A::X, Vec3A::new(0.6, 0.0, -0.8), slanted] {
        let expected = transmittance(1.0, d);
        assert!((0.3..0.9).contains(&expected), "{d}: {expected}");
        for size in [1e-30, 1e-24, 1e-18, 1e18, 1e24, 1e30] {
            let tr = transmittance(size, d);
            assert!(
                (tr / expected - 1.0).abs() < 1e-5,
                "{size}, {d}: {tr} for {expected}"
            );
        }
    }
}

#[test]
fn rates_that_overflow_do_not_throw_dice_without_an_end() {
    // Behind voxels of nothing, within the same bound, collisions at an infinite rate would never get on.
    let edge = 5e-38;
    let place = [DVec3::ZERO, edge * DVec3::new(4.0, 1.0, 1.0)];
    let values = [0.0, 0.0, 0.0, 1e38];
    let sigma = [Rgb::BLACK, Rgb::splat(10.0)];
    let medium = boxed([4, 1, 1], &values, place, DAffine3::IDENTITY, sigma);
    let half = 0.5 * edge as f32;
    let ray = along(Vec3A::new(-2e-37, half, half), Vec3A::X);
    let mut rng = Rng::new(2);
    for _ in 0..100 {
        let MediumEvent::Scatter { t, weight } = medium.sample(&ray, 1.0, Rgb::ONE, None, &mut rng)
        else {
            panic!("nothing passes");
        };
        assert!(t > 3e-37 && t < 4.1e-37, "{t}");
        assert_eq!(weight, Rgb::ONE);
    }
}

#[test]
fn bounds_of_the_largest_numbers_are_numbers() {
    for values in [
        [f32::MAX; 8],
        [0.0, f32::MAX, 0.0, 0.0, 1e32, 0.0, 3.4e38, 0.0],
    ] {
        let lattice = Lattice::new([2; 3], &values);
        let bound = lattice.bound([0; 3], [3; 3]);
        assert!(bound.is_finite() && bound >= f32::MAX * 0.9999, "{bound}");
        let mut rng = Rng::new(9);
        for _ in 0..10_000 {
            let place = Vec3A::from([(); 3].map(|()| 0.5 + 2.0 * rng.uniform()));
            let ratio = lattice.density(place) / bound;
            assert!((0.0..=1.0).contains(&ratio), "{ratio}");
        }
    }
}

#[test]
fn coefficients_next_to_nothing_have_the_weights_of_others() {
    let mut rng = Rng::new(4);
    for small in [1e-39, 1e-42] {
        // With densities that make up for it, dice and integrals, grey and coloured.
        for (colour, edge) in [
            ([1.0, 1.0, 1.0], 1.0),
            ([1.0, 2.0, 3.0], 1.0),
            ([1.0, 2.0, 3.0], 1e3),
        ] {
            let sigma_s = Rgb::from_array(colour) * small;
            let place = [DVec3::ZERO, DVec3::splat(4.0 * edge)];
            let values = [0.1 / small.max(1e-38) * (small / 1e-39).sqrt(); 64];
            let turn = DAffine3::IDENTITY;
            let medium = boxed([4; 3], &values, place, turn, [Rgb::BLACK, sigma_s]);
            let ray = along(Vec3A::new(-1.0, 1.7, 1.9), Vec3A::X);
            let tr = medium.transmittance(&ray, 1e6, &mut rng);
            assert!(tr.is_finite(), "{tr:?}");
            let n = 20_000;
            let mut sum = [0.0; 3];
            for k in 0..n {
                let depth = (k % 2 == 0).then(|| rng.exponential());
                let (MediumEvent::Pass { weight } | MediumEvent::Scatter { weight, .. }) =
                    medium.sample(&ray, 1e6, Rgb::ONE, depth, &mut rng);
                assert!(weight.is_finite() && !weight.has_negative(), "{weight:?}");
                for (sum, weight) in sum.iter_mut().zip(weight.to_array()) {
                    *sum += f64::from(weight) / f64::from(n);
                }
            }
            // All of it scatters: nothing is lost.
            assert!(
                sum.iter().all(|mean| (mean - 1.0).abs() < 0.06),
                "{small}: {sum:?}"
            );
        }
        for colour in [[1.0, 1.0, 1.0], [1.0, 2.0, 3.0]] {
            let fog = Homogeneous::new(Rgb::BLACK, Rgb::from_array(colour) * small, PHASE);
            let fog = Medium::Homogeneous(fog);
            let ray = along(Vec3A::ZERO, Vec3A::X);
            let tr = fog.transmittance(&ray, 1e6, &mut rng);
            assert_eq!(tr, Rgb::ONE);
            for depth in [0.0, 1e-8, 0.01, 1.0, 40.0] {
                let (MediumEvent::Pass { weight } | MediumEvent::Scatter { weight, .. }) =
                    fog.sample(&ray, 3e38, Rgb::ONE, Some(depth), &mut rng);
                assert!(weight.is_finite() && !weight.has_negative(), "{weight:?}");
                let mean = weight.mean();
                assert!((0.5..=3.0).contains(&mean), "{depth}: {weight:?}");
            }
        }
    }
}

#[test]
fn flights_of_no_depth_end_where_density_begins_and_never_in_clear_channels() {
    let red = Rgb::from_array([1.0, 0.0, 0.0]);
    let limit = |beta| ColumnFlight::new(red, red, beta, Some(-0.0), &mut Rng::new(1)).limit();
    assert_eq!(limit(red), 0.0);
    assert_eq!(limit(Rgb::ONE - red), f64::INFINITY);
    // Voxels of which those up to the sixth are empty.
    let values = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let place = [DVec3::ZERO, DVec3::new(8.0, 1.0, 1.0)];
    let sigma = [Rgb::BLACK, Rgb::splat(3.0)];
    let medium = boxed([8, 1, 1], &values, place, DAffine3::IDENTITY, sigma);
    let ray = along(Vec3A::new(-1.0, 0.5, 0.5), Vec3A::X);
    for depth in [0.0, -0.0] {
        let event = medium.sample(&ray, 100.0, Rgb::ONE, Some(depth), &mut Rng::new(1));
        let MediumEvent::Scatter { t, .. } = event else {
            panic!("it ends somewhere");
        };
        // At x = 5.5 the density begins.
        assert!((6.4999..6.51).contains(&t), "{t}");
    }
}
