//! Depth of field: how large a point out of focus gets, and what is sharp.

use tyndall::camera::{Camera, CameraSample};

use super::camera;

const RADIUS: f64 = 0.3;
const FOCUS: f64 = 4.0;

fn thin_lens(kind: &str) -> Camera {
    camera(&format!(
        "Camera \"{kind}\" \"float lensradius\" {RADIUS} \"float focaldistance\" {FOCUS}"
    ))
}

/// Where the ray through a point of the lens crosses the plane at a distance.
fn crossing(camera: &Camera, raster: [f64; 2], lens: [f32; 2], z: f64) -> [f64; 2] {
    let sample = CameraSample {
        raster,
        time: 0.0,
        lens,
    };
    let ray = camera.ray(&sample).expect("a thin lens").ray;
    let [o, d] = [ray.o.to_f64(), ray.d.to_f64()];
    assert_eq!(o.z, 0.0, "rays start on the lens");
    let p = o + d * (z / d.z);
    [p.x, p.y]
}

fn lens_points() -> impl Iterator<Item = [f32; 2]> {
    (0..64).map(|k| [(k % 8) as f32 / 7.0, (k / 8) as f32 / 7.0])
}

#[test]
fn row_66_thin_lenses_blur_what_is_out_of_focus_and_nothing_else() {
    for kind in ["perspective", "orthographic"] {
        let (blurred, pinhole) = (thin_lens(kind), camera(&format!("Camera \"{kind}\"")));
        for raster in [[24.0, 16.0], [0.0, 0.0], [40.5, 3.25]] {
            for z in [1.0, FOCUS, 10.0] {
                let center = crossing(&pinhole, raster, [0.5; 2], z);
                let mut greatest = 0f64;
                for lens in lens_points() {
                    let p = crossing(&blurred, raster, lens, z);
                    greatest = greatest.max((p[0] - center[0]).hypot(p[1] - center[1]));
                }
                // Similar triangles: the cone of rays has its tip in the plane in focus.
                let expected = RADIUS * (z - FOCUS).abs() / FOCUS;
                assert!(
                    (greatest - expected).abs() < 2e-6 * z,
                    "{kind} at {z}: {greatest} is not {expected}"
                );
            }
        }
    }
}

#[test]
fn row_66_the_lens_is_a_disk_covered_evenly() {
    for kind in ["perspective", "orthographic"] {
        let camera = thin_lens(kind);
        // Halves of the lens by radius: within 1/√2 of its radius lies half of its area.
        let (mut n_inner, n) = (0, 128);
        for k in 0..n * n {
            let [u, v] = [k % n, k / n].map(|i| (i as f32 + 0.5) / n as f32);
            let at_lens = crossing(&camera, [24.0, 16.0], [u, v], 0.0);
            let r = at_lens[0].hypot(at_lens[1]);
            assert!(r <= RADIUS * (1.0 + 1e-6));
            n_inner += i32::from(r < RADIUS * std::f64::consts::FRAC_1_SQRT_2);
        }
        let share = f64::from(n_inner) / f64::from(n * n);
        assert!((share - 0.5).abs() < 0.01, "{kind}: {share}");
    }
}
