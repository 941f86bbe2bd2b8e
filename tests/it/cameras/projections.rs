//! Which way the rays of perspective, orthographic and environment cameras go.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use tyndall::camera::{
    Camera, CameraSample, Environment, Orthographic, Perspective, Projection, ThinLens,
};
use tyndall::math::{Motion, Transform};

use super::{RESOLUTION, assert_near, camera, ray};
use crate::common::findings::findings;

fn normalized(d: [f64; 3]) -> [f64; 3] {
    let length = d.iter().map(|x| x * x).sum::<f64>().sqrt();
    d.map(|x| x / length)
}

/// Raster positions and how far right and up they are, each in [-1, 1].
fn places() -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
    let [width, height] = RESOLUTION;
    let grid = (0..=8).flat_map(|i| (0..=8).map(move |k| [f64::from(i) / 8.0, f64::from(k) / 8.0]));
    grid.map(move |[x, y]| ([x * width, y * height], [2.0 * x - 1.0, 1.0 - 2.0 * y]))
}

#[test]
fn perspective_rays_meet_the_screen_window() {
    let aspect = RESOLUTION[0] / RESOLUTION[1];
    for (options, [x0, x1, y0, y1], fov) in [
        ("\"float fov\" 50", [-aspect, aspect, -1.0, 1.0], 50f64),
        (
            "\"float fov\" 10 \"float halffov\" 35",
            [-aspect, aspect, -1.0, 1.0],
            70.0,
        ),
        (
            "\"float frameaspectratio\" 0.5",
            [-1.0, 1.0, -2.0, 2.0],
            90.0,
        ),
        (
            "\"float fov\" 60 \"float screenwindow\" [-0.25 2 0.5 -1]",
            [-0.25, 2.0, 0.5, -1.0],
            60.0,
        ),
    ] {
        let camera = camera(&format!("Camera \"perspective\" {options}"));
        let tan = (fov / 2.0).to_radians().tan();
        for (raster, [right, up]) in places() {
            let x = x0 + (x1 - x0) * (right + 1.0) / 2.0;
            let y = y0 + (y1 - y0) * (up + 1.0) / 2.0;
            let ray = ray(&camera, raster);
            assert_near(ray.o.into(), [0.0; 3], options);
            assert_near(ray.d.into(), normalized([x * tan, y * tan, 1.0]), options);
        }
    }
}

#[test]
fn orthographic_rays_are_parallel_and_start_on_the_screen_window() {
    let aspect = RESOLUTION[0] / RESOLUTION[1];
    for (options, [x0, x1, y0, y1]) in [
        ("", [-aspect, aspect, -1.0, 1.0]),
        ("\"float frameaspectratio\" 0.25", [-1.0, 1.0, -4.0, 4.0]),
        (
            "\"float screenwindow\" [-0.25 2 0.5 -1]",
            [-0.25, 2.0, 0.5, -1.0],
        ),
    ] {
        let camera = camera(&format!("Camera \"orthographic\" {options}"));
        for (raster, [right, up]) in places() {
            let x = x0 + (x1 - x0) * (right + 1.0) / 2.0;
            let y = y0 + (y1 - y0) * (up + 1.0) / 2.0;
            let ray = ray(&camera, raster);
            assert_near(ray.o.into(), [x, y, 0.0], options);
            assert_eq!(<[f32; 3]>::from(ray.d), [0.0, 0.0, 1.0], "{options}");
        }
    }
}

#[test]
fn environment_rays_go_everywhere() {
    // Lens and window have no effect.
    let camera = camera(
        "Camera \"environment\" \"float lensradius\" 3 \"float screenwindow\" [0 1 0 1] \
         \"float frameaspectratio\" 7",
    );
    for (raster, [right, up]) in places() {
        let (theta, phi) = (PI * (1.0 - up) / 2.0, TAU * (1.0 + right) / 2.0);
        let expected = [
            theta.sin() * phi.cos(),
            theta.cos(),
            theta.sin() * phi.sin(),
        ];
        let ray = ray(&camera, raster);
        assert_near(ray.o.into(), [0.0; 3], "origin");
        assert_near(ray.d.into(), expected, "direction");
    }
}

#[test]
fn a_mirror_in_front_of_the_view_swaps_left_and_right() {
    for kind in ["perspective", "orthographic", "environment"] {
        let look = "LookAt 0.1 -0.2 0.3  1 2 3  0 0 1";
        let plain = camera(&format!("{look} Camera \"{kind}\""));
        let mirrored = camera(&format!("Scale -1 1 1 {look} Camera \"{kind}\""));
        for (raster, _) in places() {
            let other_side = if kind == "environment" {
                // x is mirrored: φ becomes π − φ.
                (1.5 * RESOLUTION[0] - raster[0]) % RESOLUTION[0]
            } else {
                RESOLUTION[0] - raster[0]
            };
            let (a, b) = (ray(&plain, raster), ray(&mirrored, [other_side, raster[1]]));
            assert_near(b.d.into(), <[f32; 3]>::from(a.d).map(f64::from), kind);
            assert_near(b.o.into(), <[f32; 3]>::from(a.o).map(f64::from), kind);
        }
    }
}

#[test]
fn a_scaled_camera_keeps_directions_and_scales_the_window() {
    let lens = ThinLens {
        radius: 0.0,
        focal_distance: 1.0,
    };
    let (window, resolution) = ([-1.5, 1.5, -1.0, 1.0], [48, 32]);
    for projection in [
        Projection::Perspective(Perspective::new(1.0, window, resolution, lens)),
        Projection::Orthographic(Orthographic::new(window, resolution, lens)),
        Projection::Environment(Environment::new(resolution)),
    ] {
        let [plain, scaled] = [1.0, 0.1].map(|scale| {
            let place = Transform::scale_translate(scale, DVec3::ZERO);
            Camera::new(projection.clone(), Motion::Still(place), [0.0, 1.0])
        });
        for (raster, _) in places() {
            let (a, b) = (ray(&plain, raster), ray(&scaled, raster));
            let what = format!("{projection:?}");
            assert_near(b.d.into(), <[f32; 3]>::from(a.d).map(f64::from), &what);
            let tenth = <[f32; 3]>::from(a.o).map(|x| f64::from(x) / 10.0);
            assert_near(b.o.into(), tenth, &what);
        }
    }
}

#[test]
fn a_moving_camera_is_where_the_time_says() {
    for kind in ["perspective", "orthographic", "environment"] {
        let camera = camera(&format!(
            "TransformTimes 1 3\n\
             ActiveTransform EndTime Rotate -90 0 0 1 ActiveTransform All\n\
             Camera \"{kind}\" \"float shutteropen\" 1 \"float shutterclose\" 3"
        ));
        let middle = RESOLUTION.map(|side| side / 2.0);
        for fraction in [0.0, 0.25, 0.5, 1.0] {
            let sample = CameraSample {
                raster: middle,
                time: fraction as f32,
                lens: [0.5; 2],
            };
            let ray = camera.ray(&sample).expect("a ray").ray;
            assert_eq!(f64::from(ray.time), 1.0 + 2.0 * fraction);
            // The way back from camera to world at the end: turned by 90 degrees.
            let angle = (90.0 * fraction).to_radians();
            let expected = match kind {
                "environment" => [-angle.cos(), -angle.sin(), 0.0],
                _ => [0.0, 0.0, 1.0],
            };
            assert_near(ray.d.into(), expected, kind);
        }
    }
}

#[test]
fn a_reversed_shutter_is_swapped_with_a_warning() {
    for kind in ["perspective", "orthographic", "environment"] {
        let scene = format!(
            "Camera \"{kind}\" \"float shutteropen\" 3 \"float shutterclose\" 1 \
             WorldBegin LightSource \"infinite\" WorldEnd"
        );
        let codes: Vec<String> = findings(&scene).into_iter().map(|(code, _)| code).collect();
        assert_eq!(codes, ["swapped-shutter"], "{kind}");
    }
}

#[test]
fn crop_windows_do_not_move_the_view() {
    for kind in ["perspective", "orthographic", "environment"] {
        let whole = camera(&format!("Camera \"{kind}\""));
        let [width, height] = RESOLUTION;
        let cropped = crate::common::scene::compile_scene(
            format!(
                "Film \"image\" \"integer xresolution\" {width} \"integer yresolution\" {height} \
                 \"float cropwindow\" [0.5 0.75 0.25 1] Camera \"{kind}\" {}",
                super::WORLD
            ),
            &tyndall::compile::CompileOptions::default(),
            |_| None,
        );
        for (raster, _) in places() {
            assert_eq!(
                ray(&whole, raster),
                ray(&cropped.job.camera, raster),
                "{kind}"
            );
        }
    }
}

#[test]
fn differentials_are_the_rays_of_the_neighbouring_pixels() {
    for options in [
        "\"perspective\"",
        "\"perspective\" \"float lensradius\" 0.1 \"float focaldistance\" 3",
        "\"orthographic\"",
        "\"orthographic\" \"float lensradius\" 0.1 \"float focaldistance\" 3",
    ] {
        let camera = camera(&format!("LookAt 0 0 0 1 2 3 0 1 0 Camera {options}"));
        for step in [1.0, 0.25] {
            let at = super::sample([13.5, 7.25], [0.2, 0.7]);
            let found = camera.differential(&at, step).expect("neighbours");
            let right = super::sample([13.5 + step, 7.25], [0.2, 0.7]);
            let below = super::sample([13.5, 7.25 + step], [0.2, 0.7]);
            assert_eq!(Some(found.right), camera.ray(&right).map(|r| r.ray));
            assert_eq!(Some(found.below), camera.ray(&below).map(|r| r.ray));
        }
    }
}

#[test]
fn differentials_along_curved_lines_are_extrapolated_from_the_nearest_surroundings() {
    let camera = camera("Camera \"environment\"");
    let at = super::sample([13.5, 7.25], [0.5; 2]);
    let here = ray(&camera, at.raster).d.to_f64();
    for step in [1.0, 0.25] {
        let found = camera.differential(&at, step).expect("neighbours");
        let (theta, phi) = (7.25 / RESOLUTION[1] * PI, 13.5 / RESOLUTION[0] * TAU);
        let across = DVec3::new(-phi.sin(), 0.0, phi.cos()) * theta.sin();
        let down = DVec3::new(
            theta.cos() * phi.cos(),
            -theta.sin(),
            theta.cos() * phi.sin(),
        );
        for (ray, tangent, angle) in [
            (found.right, across, TAU / RESOLUTION[0]),
            (found.below, down, PI / RESOLUTION[1]),
        ] {
            let expected = (here + tangent * (angle * step)).normalize();
            let error = (ray.d.to_f64() - expected).length();
            // Second differences over a twentieth of a pixel.
            assert!(error < 0.05 * angle * angle * step, "{error}");
        }
    }
}
