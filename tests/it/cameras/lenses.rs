//! Lens systems: refraction, focus, pupils and weights of the realistic camera.

use std::f64::consts::FRAC_PI_4;
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};
use tyndall::camera::lens::{Interface, Lens, LensError};
use tyndall::camera::pupil::ExitPupil;
use tyndall::camera::{Camera, LocalRay};
use tyndall::compile::CompileOptions;
use tyndall::render::{Unwatched, render};
use tyndall_test_support::Uniform;
use tyndall_test_support::z_test::Mean;

use super::{RESOLUTION, compiled, sample};
use crate::common::scene::compile_scene;

/// The lens of the scenes of our own.
const TRIPLET: &str = include_str!("../../../assets/pbrt-v3-scenes-subset/cameras/triplet.dat");

fn interface(curvature_radius: f64, thickness: f64, eta: f64, diameter: f64) -> Interface {
    Interface {
        curvature_radius,
        thickness,
        eta,
        aperture_radius: diameter / 2.0,
    }
}

/// The table of a lens file, in metres.
fn table(text: &str) -> Vec<Interface> {
    let file = tyndall::spectrum::float_file::read(text.as_bytes()).expect("numbers");
    let (rows, _) = file.values.as_chunks::<4>();
    let row = |&[r, t, eta, d]: &[f64; 4]| interface(r * 1e-3, t * 1e-3, eta.max(1.0), d * 1e-3);
    rows.iter().map(row).collect()
}

/// A biconvex lens: radii of 100 mm, 1 mm thick, 16 mm wide.
fn biconvex() -> Vec<Interface> {
    vec![
        interface(0.1, 1e-3, 1.5, 0.016),
        interface(-0.1, 0.05, 1.0, 0.016),
    ]
}

/// Lenses whose pupils differ: whole, stopped down far, and cut by the rims.
fn lenses() -> Vec<(&'static str, Lens, f64)> {
    let stopped = |diameter: f64| {
        let mut rows = table(TRIPLET);
        for row in rows.iter_mut().filter(|row| row.curvature_radius == 0.0) {
            row.aperture_radius = diameter / 2.0;
        }
        Lens::new(&rows).focused(2.0).expect("a focus")
    };
    vec![
        ("triplet, wide open", stopped(0.0095), 0.0433),
        ("triplet, pinhole", stopped(0.0001), 0.0433),
        ("triplet, large film", stopped(0.005), 0.08),
        (
            "biconvex",
            Lens::new(&biconvex()).focused(1.0).expect("a focus"),
            0.0433,
        ),
        (
            "fast biconvex",
            Lens::new(&[
                interface(0.04, 0.02, 1.5, 0.04),
                interface(-0.04, 0.01, 1.0, 0.04),
            ])
            .focused(0.3)
            .expect("a focus"),
            0.0433,
        ),
    ]
}

fn from_film(film: DVec2, rear: DVec2, lens: &Lens) -> LocalRay {
    LocalRay {
        o: film.extend(0.0),
        d: (rear - film).extend(lens.rear_z()),
    }
}

/// The same lens seen from the scene: rows reversed, the other sides of the glass.
fn reversed(rows: &[Interface]) -> Vec<Interface> {
    let n = rows.len();
    (0..n)
        .rev()
        .map(|k| Interface {
            curvature_radius: -rows[k].curvature_radius,
            thickness: if k > 0 { rows[k - 1].thickness } else { 0.05 },
            eta: if k > 0 { rows[k - 1].eta } else { 1.0 },
            aperture_radius: rows[k].aperture_radius,
        })
        .collect()
}

#[test]
fn rays_go_through_a_lens_and_back_the_same_way() {
    for rows in [table(TRIPLET), biconvex()] {
        let (lens, back) = (Lens::new(&rows), Lens::new(&reversed(&rows)));
        // z of the scene side's vertex in each of the two frames.
        let length: f64 = rows.iter().map(|row| row.thickness).sum();
        let mut random = Uniform::new(7);
        let mut n_through = 0;
        for _ in 0..2000 {
            let mut point = |r: f64| {
                let [x, y] = random.unit2().map(|u| 2.0 * f64::from(u) - 1.0);
                DVec2::new(x, y) * r
            };
            let start = from_film(point(0.02), point(0.01), &lens);
            let Some(out) = lens.trace(start) else {
                continue;
            };
            n_through += 1;
            // Seen from the other end, z runs the other way.
            let turn = |p: DVec3| DVec3::new(p.x, p.y, length + 0.05 - p.z);
            let flip = |d: DVec3| DVec3::new(-d.x, -d.y, d.z);
            let outside = out.o + out.d * 0.04 / out.d.z;
            let returned = back
                .trace(LocalRay {
                    o: turn(outside),
                    d: flip(out.d),
                })
                .expect("light takes the same way back");
            let d = flip(returned.d);
            let error = (d - start.d.normalize()).length();
            assert!(error < 1e-12, "direction off by {error}");
            let o = turn(returned.o);
            let at_film = o - d * (o.z / d.z);
            assert!(
                (at_film - start.o).length() < 1e-12,
                "{at_film} is not {}",
                start.o
            );
        }
        assert!(n_through > 200, "{n_through}");
    }
}

#[test]
fn one_interface_obeys_snells_law() {
    for (radius, eta) in [(0.05, 1.5), (-0.03, 1.8), (0.02, 0.7)] {
        let lens = Lens::new(&[interface(radius, 0.02, eta, 0.02)]);
        let center = DVec3::new(0.0, 0.0, 0.02 - radius);
        for k in 0..50 {
            let rear = DVec2::from_angle(f64::from(k)) * 2e-4 * f64::from(k % 40);
            let ray = from_film(DVec2::new(0.003, -0.001), rear, &lens);
            let Some(out) = lens.trace(ray) else { continue };
            let normal = (out.o - center) / radius;
            assert!((normal.length() - 1.0).abs() < 1e-13, "on the sphere");
            let (i, t) = (ray.d.normalize().cross(normal), out.d.cross(normal));
            assert!((i * eta - t).length() < 1e-14, "{i} {t}");
            assert!((out.d.length() - 1.0).abs() < 1e-14);
            let along = (out.o - ray.o).normalize();
            assert!(
                (along - ray.d.normalize()).length() < 1e-13,
                "straight before"
            );
        }
    }
}

#[test]
fn total_reflection_is_no_ray() {
    // From glass into air at 45 degrees.
    let lens = Lens::new(&[interface(1e6, 0.02, 1.5, 1.0)]);
    let ray = |x: f64| from_film(DVec2::ZERO, DVec2::new(x, 0.0), &lens);
    assert_eq!(lens.trace(ray(0.02)), None);
    assert!(lens.trace(ray(0.01)).is_some());
}

#[test]
fn the_focal_length_is_the_lensmakers() {
    for (r1, r2, thickness, eta) in [
        (0.1, -0.1, 1e-3, 1.5),
        (0.05, -0.2, 0.01, 1.7),
        (0.03, 0.08, 0.004, 1.6),
    ] {
        let lens = Lens::new(&[
            interface(r1, thickness, eta, 0.01),
            interface(r2, 0.05, 1.0, 0.01),
        ]);
        let n = eta - 1.0;
        let expected = 1.0 / (n * (1.0 / r1 - 1.0 / r2 + n * thickness / (eta * r1 * r2)));
        let found = lens.cardinal_points().expect("a lens that gathers");
        assert!(
            (found.focal_length / expected - 1.0).abs() < 1e-12,
            "{found:?}, {expected}"
        );
        // Distances of the principal planes from their vertices (Born and Wolf, section 4.4).
        let from_front = expected * n * thickness / (eta * r2);
        let from_rear = expected * n * thickness / (eta * r1);
        assert!((found.scene_side - (0.05 + thickness + from_front)).abs() < 1e-12);
        assert!((found.film_side - (0.05 + from_rear)).abs() < 1e-12);
    }
}

#[test]
fn paraxial_rays_meet_in_the_plane_in_focus() {
    for rows in [table(TRIPLET), biconvex()] {
        for distance in [0.41, 1.0, 7.0, 1e3] {
            let lens = Lens::new(&rows).focused(distance).expect("a focus");
            for film in [DVec2::ZERO, DVec2::new(1e-4, 0.0)] {
                let at = |rear: f64| {
                    let ray = lens
                        .trace(from_film(film, DVec2::new(0.0, rear), &lens))
                        .expect("near the axis");
                    ray.o + ray.d * ((distance - ray.o.z) / ray.d.z)
                };
                // A tenth of a millimetre off the axis; how far apart without focus: the same angle at the distance.
                let spread = (at(1e-4) - at(0.0)).length();
                let unfocused = 1e-4 / 0.05 * distance;
                assert!(
                    spread < 1e-4 * unfocused,
                    "{distance}: {spread} of {unfocused}"
                );
            }
        }
    }
}

#[test]
fn l10_lenses_without_a_focus_are_errors() {
    let diverging = [
        interface(-0.1, 1e-3, 1.5, 0.02),
        interface(0.1, 0.05, 1.0, 0.02),
    ];
    assert_eq!(
        Lens::new(&diverging).focused(1.0).err(),
        Some(LensError::NotConverging)
    );
    // A window.
    let afocal = [
        interface(0.0, 1e-3, 1.0, 0.02),
        interface(0.0, 0.05, 1.0, 0.02),
    ];
    assert_eq!(
        Lens::new(&afocal).focused(1.0).err(),
        Some(LensError::NotConverging)
    );
    // The image of a plane at twice the focal length is as far behind the lens: nothing is nearer.
    let Some(LensError::TooClose { nearest }) = Lens::new(&biconvex()).focused(0.2).err() else {
        panic!("too close");
    };
    assert!((nearest - 0.4).abs() < 1e-3, "{nearest}");
    assert!(Lens::new(&biconvex()).focused(nearest * 1.0001).is_ok());
    // A ball focuses at n R / (2 (n − 1)) from its centre: within itself for an index of 2.2.
    let ball = [
        interface(0.01, 0.02, 2.2, 0.02),
        interface(-0.01, 0.01, 1.0, 0.02),
    ];
    assert_eq!(
        Lens::new(&ball).focused(10.0).err(),
        Some(LensError::FilmInside)
    );
}

#[test]
fn l10_the_bounds_of_the_pupil_hold_every_ray_that_gets_through() {
    for (name, lens, diagonal) in lenses() {
        let pupil = ExitPupil::new(&lens, diagonal / 2.0).expect("light");
        let mut n_through = 0;
        let mut needed = 0f64;
        for ring in 0..80 {
            let film_radius = diagonal / 2.0 * (f64::from(ring) + 0.37) / 64.0;
            let bounds = pupil.bounds(&lens, film_radius);
            // Somewhat beyond the rear interface, which is what pbrt-v3 searches, and densely around the bounds.
            let wide = 1.5 * lens.rear_aperture_radius();
            let middle = (bounds.x[0] + bounds.x[1]) / 2.0;
            let half = (bounds.x[1] - bounds.x[0]).max(2.0 * bounds.y);
            for (center, reach, n) in [(0.0, wide, 256), (middle, half, 256)] {
                for k in 0..n * n / 2 {
                    let cell = |i: i32| (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0;
                    let p = DVec2::new(center + cell(k % n) * reach, -cell(k / n) * reach);
                    let ray = from_film(DVec2::new(film_radius, 0.0), p, &lens);
                    if lens.trace(ray).is_none() {
                        continue;
                    }
                    n_through += 1;
                    let inside = (bounds.x[0]..=bounds.x[1]).contains(&p.x) && p.y <= bounds.y;
                    assert!(inside, "{name}, ring {ring}: {p} is outside of {bounds:?}");
                    needed = needed.max(p.y / bounds.y);
                }
            }
        }
        assert!(n_through > 10_000, "{name}: {n_through}");
        // Not much larger than needed, either.
        assert!(needed > 0.9, "{name}: {needed}");
    }
}

#[test]
fn the_pupil_behind_a_bare_stop_is_the_stop() {
    let lens = Lens::new(&[interface(0.0, 0.05, 1.0, 0.02)]);
    let pupil = ExitPupil::new(&lens, 0.02).expect("light");
    let bounds = pupil.bounds(&lens, 0.001);
    for edge in [bounds.x[1], -bounds.x[0], bounds.y] {
        assert!((edge / 0.01 - 1.0).abs() < 0.01, "{bounds:?}");
    }
    // What pbrt-v3's search finds: nearly the disk's square, widened by 2/1024 of the diagonal of a square of 0.03.
    let side = 0.02 + 2.0 * 2.0 * 0.03 * 2f64.sqrt() / 1024.0;
    assert!((pupil.reference_area() / (side * side) - 1.0).abs() < 2e-3);
}

/// The area of the bounds of what gets through the lens among 2²⁰ points of the Halton sequence on a square of 1.5 rear
/// apertures, widened by twice the square's diagonal over 2¹⁰: pbrt-v3's, by its own way.
fn area_by_search(lens: &Lens, reach: f64) -> f64 {
    let half = 1.5 * lens.rear_aperture_radius();
    let n = 1u32 << 20;
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for i in 0..n {
        let inverse = |base: u32| {
            let (mut rest, mut place, mut sum) = (i, 1.0, 0.0);
            while rest > 0 {
                place /= f64::from(base);
                sum += f64::from(rest % base) * place;
                rest /= base;
            }
            sum
        };
        let rear = (DVec2::new(inverse(2), inverse(3)) * 2.0 - DVec2::ONE) * half;
        let film = DVec2::new((f64::from(i) + 0.5) / f64::from(n) * reach / 64.0, 0.0);
        if lens.trace(from_film(film, rear, lens)).is_some() {
            (low, high) = (low.min(rear), high.max(rear));
        }
    }
    let size = high - low + DVec2::splat(2.0 * 2.0 * 2.0 * half * 2f64.sqrt() / 1024.0);
    size.x * size.y
}

#[test]
fn brightness_is_relative_to_what_pbrts_search_finds() {
    for aperture_radius in [0.0001, 0.0005, 0.00475] {
        let mut rows = table(TRIPLET);
        for row in rows.iter_mut().filter(|row| row.curvature_radius == 0.0) {
            row.aperture_radius = aperture_radius;
        }
        let lens = Lens::new(&rows).focused(2.0).expect("a focus");
        for reach in [0.0175, 0.004] {
            let pupil = ExitPupil::new(&lens, reach).expect("light");
            let expected = area_by_search(&lens, reach);
            let found = pupil.reference_area();
            assert!(
                (found / expected - 1.0).abs() < 1e-9,
                "{aperture_radius}, {reach}: {found} is not {expected}"
            );
        }
    }
}

/// The realistic camera with a lens file and more parameters.
fn camera(lens: &str, options: &str) -> Camera {
    compiled(
        &format!("Camera \"realistic\" \"string lensfile\" \"lens.dat\" {options}"),
        lens,
    )
    .job
    .camera
}

const OPEN: &str = "\"float aperturediameter\" 9.5 \"float focusdistance\" 2";

fn weights(camera: &Camera, raster: [f64; 2], n: usize, seed: u64) -> Mean {
    let mut random = Uniform::new(seed);
    Mean::of(n, || {
        let sample = sample(raster, random.unit2());
        camera.ray(&sample).map_or(0.0, |ray| f64::from(ray.weight))
    })
}

/// ∫ cos⁴ θ over the pupil as a film point sees it, by the midpoint rule on n by n points of the rear plane.
fn pupil_integral(lens: &Lens, film: DVec2, n: i32) -> f64 {
    let reach = 1.5 * lens.rear_aperture_radius();
    let mut sum = 0.0;
    for k in 0..n * n {
        let cell = |i: i32| ((f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0) * reach;
        let ray = from_film(film, DVec2::new(cell(k % n), cell(k / n)), lens);
        if lens.trace(ray).is_some() {
            sum += ray.d.normalize().z.powi(4);
        }
    }
    let side = 2.0 * reach / f64::from(n);
    sum * side * side
}

#[test]
fn row_65_weights_are_the_integral_over_the_pupil() {
    let mut rows = table(TRIPLET);
    for row in rows.iter_mut().filter(|row| row.curvature_radius == 0.0) {
        row.aperture_radius = 0.00475;
    }
    let lens = Lens::new(&rows).focused(2.0).expect("a focus");
    let pixel = 0.035 / RESOLUTION[0].hypot(RESOLUTION[1]);
    let reference = ExitPupil::new(&lens, 0.0175)
        .expect("light")
        .reference_area();
    let simple = camera(TRIPLET, OPEN);
    let exposure = camera(
        TRIPLET,
        &format!(
            "{OPEN} \"bool simpleweighting\" \"false\" \"float shutteropen\" 1 \"float shutterclose\" 1.5"
        ),
    );
    for (k, raster) in [[24.0, 16.0], [10.0, 20.0], [47.0, 31.5], [0.0, 16.0]]
        .into_iter()
        .enumerate()
    {
        let film = DVec2::new(
            RESOLUTION[0] / 2.0 - raster[0],
            raster[1] - RESOLUTION[1] / 2.0,
        ) * pixel;
        let integral = pupil_integral(&lens, film, 1000);
        assert!(integral > 0.0, "{raster:?} sees light");
        for (name, camera, gain) in [
            ("simple", &simple, 1.0 / reference),
            ("exposure", &exposure, 0.5 / lens.rear_z().powi(2)),
        ] {
            let found = weights(camera, raster, 200_000, k as u64);
            let expected = integral * gain;
            // The grid knows the pupil's edge to a thousandth of its size.
            let error = found.standard_error.hypot(1e-3 * expected);
            let judged = Mean {
                standard_error: error,
                ..found
            };
            judged
                .agrees_with(expected)
                .assert_accepted(&format!("{name} at {raster:?}"));
            // The judge is awake.
            assert!(
                !judged.agrees_with(expected * 1.02).accepted(),
                "{name} at {raster:?}"
            );
        }
    }
}

#[test]
fn row_65_the_middle_of_the_film_is_as_bright_as_the_disk_in_its_square() {
    // A small pupil far away: cos⁴ is 1, and the disk fills π/4 of the bounds, which pbrt-v3 widens.
    let stop = Lens::new(&[interface(0.0, 0.5, 1.0, 0.01)]);
    let pupil = ExitPupil::new(&stop, 1e-4).expect("light");
    let found = pupil_integral(&stop, DVec2::ZERO, 1000) / pupil.reference_area();
    let widened = 1.0 + 2.0 * 2.0 * 1.5 * 2f64.sqrt() / 1024.0;
    assert!(
        (found / (FRAC_PI_4 / widened.powi(2)) - 1.0).abs() < 2e-3,
        "{found}"
    );
}

#[test]
fn differentials_see_one_pixel_of_the_plane_in_focus() {
    let camera = camera(TRIPLET, OPEN);
    // A paraxial pixel: its size times the magnification between the two principal planes.
    let mut rows = table(TRIPLET);
    rows[4].aperture_radius = 0.00475;
    let lens = Lens::new(&rows).focused(2.0).expect("a focus");
    let points = lens.cardinal_points().expect("a lens that gathers");
    let pixel = 0.035 / RESOLUTION[0].hypot(RESOLUTION[1]);
    let expected = pixel * (2.0 - points.scene_side) / points.film_side;
    for u in [[0.5, 0.5], [0.4, 0.55], [0.5, 0.3]] {
        for step in [1.0, 0.25] {
            let at = sample([24.0, 16.0], u);
            let here = camera.ray(&at).expect("near the axis").ray;
            let found = camera.differential(&at, step).expect("neighbours");
            let in_focus = |ray: &tyndall::math::Ray| {
                let (o, d) = (ray.o.to_f64(), ray.d.to_f64());
                o + d * ((2.0 - o.z) / d.z)
            };
            let right = in_focus(&found.right) - in_focus(&here);
            let below = in_focus(&found.below) - in_focus(&here);
            // The film is cut in single precision; a real lens is not quite Gaussian.
            let tolerance = 0.01 * expected * step + 2e-6;
            for (offset, direction) in [(right, DVec3::X), (below, -DVec3::Y)] {
                let error = (offset - direction * (expected * step)).length();
                assert!(
                    error < tolerance,
                    "{u:?}: {offset} is not {}",
                    expected * step
                );
            }
        }
    }
}

#[test]
fn row_65_a_picture_of_a_uniform_sky_darkens_with_the_pupil() {
    let scene = format!(
        "Film \"image\" \"float diagonal\" 43.3 \"integer xresolution\" 12 \"integer yresolution\" 8\n\
         PixelFilter \"box\" Sampler \"lowdiscrepancy\" \"integer pixelsamples\" 16384\n\
         Camera \"realistic\" \"string lensfile\" \"lens.dat\" {OPEN}\n\
         WorldBegin LightSource \"infinite\" WorldEnd"
    );
    let read = |_: &str| Some(TRIPLET.as_bytes().to_vec());
    let compiled = compile_scene(scene, &CompileOptions::default(), read);
    let rendered = render(&compiled.job, &Unwatched, &AtomicBool::new(false));
    assert_eq!(rendered.report.bad_samples, 0);
    let mut rows = table(TRIPLET);
    rows[4].aperture_radius = 0.00475;
    let lens = Lens::new(&rows).focused(2.0).expect("a focus");
    let reference = ExitPupil::new(&lens, 0.02165)
        .expect("light")
        .reference_area();
    let pixel = 0.0433 / 12f64.hypot(8.0);
    for [x, y] in [[6usize, 4], [2, 3], [10, 6], [11, 0]] {
        let expected = (0..16)
            .map(|k| [k % 4, k / 4].map(|i| (f64::from(i) + 0.5) / 4.0))
            .map(|[u, v]| DVec2::new(6.0 - (x as f64 + u), y as f64 + v - 4.0) * pixel)
            .map(|film| pupil_integral(&lens, film, 300) / reference / 16.0)
            .sum::<f64>();
        let found = f64::from(rendered.image.pixel(x, y)[0]);
        // 16384 samples that pass or not; the grids know the pupil's edge to less than a hundredth.
        let error = (expected / 16384.0).sqrt();
        let tolerance = 4.0 * error + 0.01 * expected;
        assert!(
            (found - expected).abs() < tolerance,
            "{x} {y}: {found}, {expected}"
        );
    }
}
