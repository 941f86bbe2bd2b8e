//! Family V: participating media.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use tyndall::compile::CompileOptions;
use tyndall::ids::MediumId;
use tyndall::integrator::Counters;
use tyndall::math::{Point3, Ray, Vec3};
use tyndall::medium::{Homogeneous, Medium, MediumEvent};
use tyndall::render::{Job, Rendered, Unwatched, render};
use tyndall::sampling::rng::Rng;
use tyndall::scatter::HenyeyGreenstein;
use tyndall::spectrum::Rgb;

use crate::common::probe::{Probe, assert_exact, assert_mean};
use crate::common::scene::compile_scene;
use crate::common::solids::{
    V, coefficients, environment, homogeneous, null_box, null_sphere, translate, volpath,
};
use crate::hazards::loaded::{load, load_with};

const ONE: V = [1.0; 3];
const NOTHING: V = [0.0; 3];
const EYE: V = [0.13, 0.21, -5.0];
const AHEAD: V = [0.0, 0.0, 1.0];

/// A grid of nx · ny · nz densities in the box from −1 to 1.
fn grid(name: &str, sigma_a: V, sigma_s: V, n: [usize; 3], density: &str) -> String {
    let [nx, ny, nz] = n;
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"heterogeneous\" {} \
         \"integer nx\" {nx} \"integer ny\" {ny} \"integer nz\" {nz} \
         \"point p0\" [-1 -1 -1] \"point p1\" [1 1 1] \"float density\" [{density}]\n",
        coefficients(sigma_a, sigma_s)
    )
}

/// A scene of one pixel, whatever it is.
fn one_pixel(scene: &str) -> String {
    format!("Film \"image\" \"integer xresolution\" 1 \"integer yresolution\" 1\n{scene}")
}

fn rendered(job: &Job) -> Rendered {
    render(job, &Unwatched, &AtomicBool::new(false))
}

#[test]
fn v03_a_camera_in_a_medium_that_is_not_declared_is_told_and_rendered_as_declared() {
    let fog = homogeneous("fog", [0.2; 3], NOTHING, 0.0) + &environment(ONE);
    let ball = null_sphere([0.0, 0.0, 5.0], 10.0, "fog", "");
    let scene = one_pixel(&volpath(5, NOTHING, AHEAD, &(fog.clone() + &ball)));
    let job = load_with(&scene, None, "surroundings", false)
        .expect("a job")
        .job;
    // The integrand is pbrt-v3's: a path that starts in vacuum leaves the ball without having been in it.
    assert_eq!(rendered(&job).image.pixel(0, 0), [1.0; 3]);
    let (_, found) = load(&scene, None);
    assert!(found[0].message.contains("\"fog\""), "{found:?}");
    // With the declaration, and outside, nothing is found.
    let declared = fog.clone() + "MediumInterface \"\" \"fog\"\n" + &ball;
    for (eye, world) in [
        (NOTHING, &declared),
        (EYE.map(|x| 3.0 * x), &(fog.clone() + &ball)),
    ] {
        let (_, found) = load(&one_pixel(&volpath(5, eye, AHEAD, world)), None);
        assert!(found.is_empty(), "{found:?}");
    }
    // What a mirror or a wall of one side declares counts as much as a boundary; the innermost boundary decides.
    let mist = homogeneous("mist", [0.1; 3], NOTHING, 0.0);
    let nested = mist + &declared + &null_box([-1.0; 3], ONE, "mist", "fog");
    let nested = one_pixel(&volpath(5, NOTHING, AHEAD, &nested));
    let (_, found) = load(&nested, None);
    assert!(found[0].message.contains("\"mist\"") && found[0].message.contains("\"fog\""));
    // A floor in boundless fog, seen from above.
    let floor = fog
        + "MediumInterface \"\" \"fog\" Material \"matte\" Translate 0 0 4 Rotate 180 1 0 0 \
           Shape \"disk\" \"float radius\" 50\n";
    let (_, found) = load(&one_pixel(&volpath(5, NOTHING, AHEAD, &floor)), None);
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn v03_a_lamp_whose_medium_the_boundaries_contradict_is_told_where_paths_start_at_it() {
    let fog = homogeneous("fog", [0.2; 3], NOTHING, 0.0);
    let lamp = "LightSource \"point\" \"point from\" [0 0 5]\n";
    let ball = null_sphere([0.0, 0.0, 5.0], 1.0, "fog", "");
    let found = |integrator: &str, world: &str| {
        let scene = volpath(5, NOTHING, AHEAD, world);
        assert!(scene.contains("\"volpath\""));
        load(&one_pixel(&scene.replace("\"volpath\"", integrator)), None).1
    };
    // Declared outside by the state in force where it stands, and the boundaries say fog.
    let undeclared = fog.clone() + lamp + &ball;
    let declared = fog.clone()
        + "AttributeBegin MediumInterface \"\" \"fog\"\n"
        + lamp
        + "AttributeEnd\n"
        + &ball;
    for integrator in ["\"bdpt\"", "\"mlt\" \"integer bootstrapsamples\" 100"] {
        let findings = found(integrator, &undeclared);
        let [finding] = &findings[..] else {
            panic!("{integrator}: {findings:?}");
        };
        assert_eq!(finding.code, "surroundings");
        assert!(finding.is_located && !finding.is_error, "{finding:?}");
        let message = &finding.message;
        assert!(
            message.contains("the light")
                && message.contains("\"fog\"")
                && message.contains("no medium"),
            "{message}"
        );
        let findings = found(integrator, &declared);
        assert!(findings.is_empty(), "{integrator}: {findings:?}");
    }
    // Paths from the camera arrive at the lamp in the medium that they are in.
    let findings = found("\"volpath\"", &undeclared);
    assert!(findings.is_empty(), "{findings:?}");
    // And the other way round: declared in fog where there is none.
    let nowhere = fog
        + "AttributeBegin MediumInterface \"\" \"fog\"\nLightSource \"point\" \"point from\" [3 0 5]\nAttributeEnd\n"
        + &ball;
    let findings = found("\"bdpt\"", &nowhere);
    assert!(
        findings
            .iter()
            .any(|f| f.code == "surroundings" && f.message.contains("the light")),
        "{findings:?}"
    );
}

#[test]
fn v04_overlapping_media_are_those_of_the_boundaries_crossed_last_and_are_counted() {
    // Two balls of one fog overlap: 1 + 1 + 1 along the axis. Leaving the first, pbrt-v3 is in vacuum.
    let balls = |order: [f64; 2]| {
        let ball = |z: f64| null_sphere([0.0, 0.0, z], 1.0, "fog", "");
        homogeneous("fog", ONE, NOTHING, 0.0)
            + &environment(ONE)
            + &ball(order[0])
            + &ball(order[1])
    };
    for order in [[-0.5, 0.5], [0.5, -0.5]] {
        let scene = one_pixel(&volpath(5, [0.0, 0.0, -5.0], AHEAD, &balls(order))) + "";
        let (job, found) = load(&scene, None);
        assert!(found.is_empty(), "{found:?}");
        let mut job = job.expect("a job").job;
        job.pixel_centers = true;
        let Rendered { image, report, .. } = rendered(&job);
        let expected = (-2f32).exp();
        assert!((image.pixel(0, 0)[0] - expected).abs() < 1e-5, "{image:?}");
        // One is entered from the fog of the other, and left from vacuum.
        assert_eq!(report.counters.mismatched_media, 2 * report.samples);
        assert_eq!(report.counters.leaked_paths, 0);
    }
    // Declared as they lie, the same balls are counted by nobody: the probe asserts that.
    let apart = homogeneous("fog", ONE, NOTHING, 0.0)
        + &environment(ONE)
        + &null_sphere([0.0, 0.0, -2.0], 1.0, "fog", "")
        + &null_sphere([0.0, 0.0, 2.0], 1.0, "fog", "");
    let scene = volpath(5, [0.0, 0.0, -5.0], AHEAD, &apart);
    assert_exact(&scene, [(-4f64).exp(); 3], "apart");
}

#[test]
fn v04_an_open_boundary_is_counted_as_a_leak() {
    // A half ball: what enters leaves by the way that is not there.
    let open = homogeneous("fog", [0.1; 3], NOTHING, 0.0)
        + &environment(ONE)
        + "AttributeBegin Material \"\" MediumInterface \"fog\" \"\" \
           Shape \"sphere\" \"float zmax\" 0 AttributeEnd\n";
    let scene = one_pixel(&volpath(5, [0.0, 0.0, -5.0], AHEAD, &open));
    let mut job = compile_scene(scene, &CompileOptions::default(), |_| None).job;
    job.pixel_centers = true;
    let report = rendered(&job).report;
    assert_eq!(report.counters.leaked_paths, report.samples);
}

#[test]
fn v05_an_infinite_density_is_an_error_and_vacuum() {
    let world = grid("fog", ONE, NOTHING, [2, 1, 1], "1 inf")
        + &environment(ONE)
        + &null_box([-1.0; 3], ONE, "fog", "");
    let scene = one_pixel(&volpath(5, EYE, AHEAD, &world));
    let (job, found) = load(&scene, None);
    assert!(
        found.iter().any(|f| f.is_error && f.is_located),
        "{found:?}"
    );
    assert_eq!(
        rendered(&job.expect("a job").job).image.pixel(0, 0),
        [1.0; 3]
    );
}

#[test]
fn v05_a_grid_with_a_count_of_its_own_or_without_end_is_an_error_and_vacuum() {
    let long = tyndall::medium::grid::MAX_VOXELS + 1;
    for (n, density, told) in [
        ([2, 2, 1], "1 1 1".to_owned(), "needs 4 densities"),
        ([long, 1, 1], "1 ".repeat(long), "along an axis"),
    ] {
        let world = grid("fog", ONE, NOTHING, n, &density)
            + &environment(ONE)
            + &null_box([-1.0; 3], ONE, "fog", "");
        let (job, found) = load(&one_pixel(&volpath(5, EYE, AHEAD, &world)), None);
        let mut errors = found.iter().filter(|f| f.is_error && f.is_located);
        assert!(errors.any(|f| f.message.contains(told)), "{found:?}");
        let image = rendered(&job.expect("a job").job).image;
        assert_eq!(image.pixel(0, 0), [1.0; 3]);
    }
}

#[test]
fn v06_a_huge_voxel_slows_down_only_the_rays_that_pass_it() {
    // 20³ voxels of 1, one of them 10⁷. The shortest of several runs is what the machine can do.
    let seconds = |spike: &str| {
        let mut density = "1 ".repeat(7999);
        density.push_str(spike);
        let world = grid("fog", NOTHING, ONE, [20; 3], &density)
            + &environment(ONE)
            + &null_box([-1.0; 3], ONE, "fog", "");
        let probe = Probe::new(&volpath(0, [-0.5, -0.5, -5.0], AHEAD, &world));
        let run = |_| {
            let start = Instant::now();
            probe.samples(100_000);
            start.elapsed().as_secs_f64()
        };
        (0..5).map(run).fold(f64::INFINITY, f64::min)
    };
    let (even, spiked) = (seconds("1"), seconds("1e7"));
    assert!(spiked < 3.0 * even, "{spiked} s instead of {even} s");
}

#[test]
fn v07_densities_that_are_negative_or_no_numbers_count_as_0() {
    let world = |density: &str| {
        grid("fog", ONE, NOTHING, [2, 2, 1], density)
            + &environment(ONE)
            + &null_box([-1.0; 3], ONE, "fog", "")
    };
    let scene = |density: &str| one_pixel(&volpath(5, EYE, AHEAD, &world(density)));
    let bad = load_with(&scene("1 nan -5 2"), None, "bad-density", false).expect("a job");
    let (_, found) = load(&scene("1 nan -5 2"), None);
    assert!(found[0].message.contains("2 densities"), "{found:?}");
    let good = load(&scene("1 0 0 2"), None).0.expect("a job");
    assert_eq!(rendered(&bad.job).image, rendered(&good.job).image);
}

#[test]
fn v08_media_that_hold_nothing_are_vacuum() {
    for medium in [
        grid("fog", ONE, ONE, [2, 1, 1], "0 0"),
        grid("fog", NOTHING, NOTHING, [2, 1, 1], "1 2"),
        homogeneous("fog", NOTHING, NOTHING, 0.0),
    ] {
        let world = medium + &environment(ONE) + &null_box([-1.0; 3], ONE, "fog", "");
        let scene = volpath(5, EYE, AHEAD, &world);
        assert_exact(&scene, ONE, "an empty medium");
        let job = compile_scene(one_pixel(&scene), &CompileOptions::default(), |_| None);
        assert!(job.medium_names.is_empty(), "it was built");
    }
    // Zeros of one channel, and of one coefficient, at the ends of what random numbers give.
    let fog = grid("fog", [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [2, 1, 1], "0 4");
    let world = fog + &environment(ONE) + &null_box([-1.0; 3], ONE, "fog", "");
    for sample in Probe::new(&volpath(50, EYE, AHEAD, &world)).samples(20_000) {
        assert!(
            sample.iter().all(|c| c.is_finite() && *c >= 0.0),
            "{sample:?}"
        );
    }
}

#[test]
fn v11_grids_of_the_wrong_size_are_errors_and_vacuum() {
    for (n, density) in [
        ([2, 2, 2], "1 1 1 1 1 1 1"),
        ([2, 2, 2], "1 1 1 1 1 1 1 1 1"),
        ([0, 2, 2], "1"),
        ([100_000; 3], "1"),
    ] {
        let world = grid("fog", ONE, NOTHING, n, density)
            + &environment(ONE)
            + &null_box([-1.0; 3], ONE, "fog", "");
        let scene = one_pixel(&volpath(5, EYE, AHEAD, &world));
        let (job, found) = load(&scene, None);
        assert!(
            found.iter().any(|f| f.is_error && f.is_located),
            "{found:?}"
        );
        assert_eq!(
            rendered(&job.expect("a job").job).image.pixel(0, 0),
            [1.0; 3]
        );
    }
}

#[test]
fn v16_absorbers_need_no_dice() {
    // Every sample is the same: from a grid the integral of what is interpolated, piecewise cubic along the ray.
    let sigma = [0.2, 1.0, 3.0];
    let even = homogeneous("fog", sigma, NOTHING, 0.0)
        + &environment(ONE)
        + &null_box([-1.0; 3], ONE, "fog", "");
    let expected = sigma.map(|s: f64| (-2.0 * s).exp());
    assert_exact(&volpath(5, EYE, AHEAD, &even), expected, "homogeneous");
    // Along x the densities 1, 3, 0 at −2/3, 0, 2/3: at x in the first half cell they fade from 0 to 0.5 at the wall.
    let ramp = grid("fog", sigma, NOTHING, [3, 1, 1], "1 3 0")
        + &environment(ONE)
        + &null_box([-2.0; 3], [2.0; 3], "fog", "");
    // By trapezoids between the nodes, the wall included; y and z fade as well, by the tent of a single cell.
    let column =
        (0.5 + 1.0) / 2.0 / 3.0 + (1.0 + 3.0) / 2.0 * 2.0 / 3.0 + (3.0 + 0.0) / 2.0 * 2.0 / 3.0;
    let expected = sigma.map(|s| (-s * column).exp());
    let scene = volpath(5, [-5.0, 0.0, 0.0], [1.0, 0.0, 0.0], &ramp);
    assert_exact(&scene, expected, "a ramp");
    // And askew, through a grid without a pattern: without noise, and the mean of what dice say.
    let mut random = tyndall_test_support::Uniform::new(9);
    let density: Vec<String> = (0..7 * 5 * 9).map(|_| random.unit().to_string()).collect();
    let ragged = |sigma_s: V| {
        grid("fog", sigma, sigma_s, [7, 5, 9], &density.join(" "))
            + &environment(ONE)
            + &null_box([-1.1; 3], [1.1; 3], "fog", "")
    };
    for toward in [[0.02, -0.03, 1.0], [-0.1, 0.1, 1.0], [-0.026, -0.042, 1.0]] {
        let exact = Probe::new(&volpath(5, EYE, toward, &ragged(NOTHING))).samples(8);
        assert!(exact.iter().all(|sample| *sample == exact[0]), "{exact:?}");
        // Next to nothing is scattered, so that the grid is tracked.
        let dice = Probe::new(&volpath(5, EYE, toward, &ragged([1e-7; 3]))).means(100_000);
        for (channel, mean) in dice.iter().enumerate() {
            mean.agrees_with(f64::from(exact[0][channel]))
                .assert_accepted(&format!("toward {toward:?}, channel {channel}"));
        }
    }
}

#[test]
fn v16_light_behind_an_absorber_needs_no_dice() {
    // Of the light at the wall e^-9 arrives, for each sample the same: no path is ended for being dark.
    let sigma = [1.0, 2.0, 3.0];
    let world = homogeneous("air", sigma, NOTHING, 0.0)
        + "MediumInterface \"air\" \"air\"\n\
           LightSource \"point\" \"point from\" [0 0 2] \"rgb I\" [1 1 1]\n\
           AttributeBegin Material \"matte\" \"rgb Kd\" [0.5 0.5 0.5] Translate 0 0 3 Rotate 180 1 0 0\n\
           Shape \"disk\" \"float radius\" 50 AttributeEnd\n";
    let scene = volpath(1, NOTHING, AHEAD, &world).replacen(
        "Camera",
        &(homogeneous("air", sigma, NOTHING, 0.0) + "MediumInterface \"\" \"air\"\nCamera"),
        1,
    );
    let expected = sigma.map(|s: f64| 0.5 / std::f64::consts::PI * (-4.0 * s).exp());
    assert_exact(&scene, expected, "through 3 and 1 units");
}

#[test]
fn v09_light_of_one_channel_that_is_nearly_gone_keeps_to_numbers() {
    for (sigma_a, sigma_s) in [
        ([0.1; 3], [0.0, 0.0, 1.0]),
        ([0.01, 0.02, 0.5], [0.0, 0.0, 1.0]),
        ([1.0, 2.0, 3.0], [1e-10; 3]),
    ] {
        let fog = homogeneous("fog", sigma_a, sigma_s, 0.0);
        for integrator in ["bdpt", "mlt", "volpath"] {
            let scene = format!(
                "Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 16\n\
                 Sampler \"random\" \"integer pixelsamples\" 64 Integrator \"{integrator}\"\n\
                 {fog}MediumInterface \"\" \"fog\" Camera \"perspective\" WorldBegin\n\
                 MediumInterface \"fog\" \"fog\" LightSource \"point\" \"point from\" [0 2 3]\n\
                 Material \"matte\" Translate 0 0 5 Shape \"sphere\" WorldEnd\n"
            );
            let (job, _) = load(&scene, None);
            let report = rendered(&job.expect("a job").job).report;
            assert_eq!(
                report.bad_samples, 0,
                "{integrator}: {sigma_a:?} {sigma_s:?}"
            );
        }
    }
}

#[test]
fn v17_glass_of_index_1_around_a_medium_is_as_bright_as_nothing() {
    let world = |material: &str| {
        homogeneous("fog", [0.2, 0.1, 0.3], [1.0, 0.5, 2.0], 0.5)
            + &environment([1.0, 2.0, 3.0])
            + &format!("AttributeBegin Material {material} MediumInterface \"fog\" \"\"\n")
            + &crate::common::solids::box_shape([-1.0; 3], ONE)
            + "AttributeEnd\n"
    };
    let mean =
        |material: &str| Probe::new(&volpath(100, EYE, AHEAD, &world(material))).means(60_000);
    let (glass, nothing) = (mean("\"glass\" \"float eta\" 1"), mean("\"\""));
    for (glass, nothing) in glass.iter().zip(&nothing) {
        glass.agrees_with_mean(nothing).assert_accepted("glass");
    }
}

#[test]
fn v20_negative_coefficients_are_errors_and_count_as_0() {
    for (sigma_a, sigma_s) in [
        ([-1.0, 1.0, 1.0], NOTHING),
        ([0.0, 1.0, 1.0], [-1.0, 0.0, 0.0]),
    ] {
        let world = homogeneous("fog", sigma_a, sigma_s, 0.0)
            + &environment(ONE)
            + &null_box([-1.0; 3], ONE, "fog", "");
        let scene = one_pixel(&volpath(5, EYE, AHEAD, &world));
        let (job, found) = load(&scene, None);
        assert!(
            found.iter().any(|f| f.is_error && f.is_located),
            "{found:?}"
        );
        let image = rendered(&job.expect("a job").job).image;
        let pixel = image.pixel(0, 0);
        assert_eq!(pixel[0], 1.0);
        assert!(pixel[1] > 0.0 && pixel[1] < 1.0, "{pixel:?}");
    }
}

#[test]
fn v21_an_eye_on_a_boundary_is_on_the_same_side_for_all_directions() {
    // From the boundary of a ball of radius 1 the way through it is 2 cos; seen or not seen, but by all alike.
    for far in [0.0, 1e5] {
        for declared in ["", "fog"] {
            let world = homogeneous("fog", [1.0; 3], NOTHING, 0.0)
                + &environment(ONE)
                + &format!("MediumInterface \"\" \"{declared}\"\n")
                + &null_sphere([far, 0.0, 1.0], 1.0, "fog", "");
            let mut sides = Vec::new();
            for i in 0..64 {
                let (sin, cos) = (f64::from(i) * 0.02).sin_cos();
                let scene = one_pixel(&volpath(5, [far, 0.0, 0.0], [0.0, sin, cos], &world));
                let (job, _) = load(&scene, None);
                let mut job = job.expect("a job").job;
                job.pixel_centers = true;
                let radiance = f64::from(rendered(&job).image.pixel(0, 0)[0]);
                let inside = (-2.0 * cos).exp();
                if (radiance - inside).abs() < 2e-5 {
                    sides.push(true);
                } else {
                    assert!(
                        (radiance - 1.0).abs() < 2e-5,
                        "{radiance} is neither 1 nor {inside}"
                    );
                    sides.push(false);
                }
            }
            sides.dedup();
            assert_eq!(sides.len(), 1, "at {far}, declared \"{declared}\"");
        }
    }
}

#[test]
fn v22_channels_are_chosen_by_chances_that_leave_none_out() {
    let ray = Ray {
        o: Point3::ZERO,
        d: Vec3::new(0.0, 0.0, 1.0),
        time: 0.0,
    };
    let phase = HenyeyGreenstein { g: 0.0 };
    let media = [
        [1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [1e-30, 1.0, 1e30],
        [1e-38, 1e-38, 1e-38],
    ]
    .map(|sigma_s| Homogeneous::new(Rgb::BLACK, Rgb::from_array(sigma_s), phase));
    let mut rng = Rng::new(3);
    for medium in media.map(Medium::Homogeneous) {
        for beta in [
            [1.0, 1.0, 1.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0],
            [1e38, 1e38, 1e38],
            [1e-45, 0.0, 1e-38],
            [0.0, 0.0, 1e-40],
            [1e-45, 0.0, 0.0],
        ] {
            for t_max in [1e-30, 1.0, f32::INFINITY] {
                for _ in 0..2000 {
                    let (MediumEvent::Scatter { weight, .. } | MediumEvent::Pass { weight }) =
                        medium.sample(&ray, t_max, Rgb::from_array(beta), None, &mut rng);
                    let sound = weight.is_finite() && !weight.has_negative();
                    assert!(sound, "{medium:?} {beta:?} {t_max}: {weight:?}");
                }
            }
        }
    }
}

#[test]
fn counters_of_another_worker_are_added() {
    let mut counters = Counters {
        leaked_paths: 1,
        mismatched_media: 2,
        ..Counters::default()
    };
    counters.shadow.mismatched = 3;
    counters.shadow.stuck = 4;
    counters.add(&counters.clone());
    assert_eq!(counters.mismatched(), 10);
    assert_eq!((counters.leaked_paths, counters.shadow.stuck), (2, 8));
}

#[test]
fn surroundings_are_those_of_the_boundary_next_to_a_point() {
    let world = homogeneous("fog", ONE, NOTHING, 0.0)
        + &homogeneous("mist", ONE, NOTHING, 0.0)
        + &environment(ONE)
        + &null_sphere(NOTHING, 2.0, "fog", "")
        + &null_sphere(NOTHING, 1.0, "mist", "fog")
        + &translate([0.0, 0.0, 0.0])
        + "Material \"matte\" Shape \"sphere\" \"float radius\" 0.25\n";
    let scene = volpath(5, [0.0, 0.0, -9.0], AHEAD, &world);
    let compiled = compile_scene(one_pixel(&scene), &CompileOptions::default(), |_| None);
    let names: Vec<&str> = compiled.medium_names.iter().map(String::as_str).collect();
    let to_render = compiled.world_from_render.inverse();
    let at = |z: f64| {
        let p = Point3::from_f64(to_render.point(glam::DVec3::new(0.1, 0.1, z)));
        compiled.job.world.surroundings(p, 0.0)
    };
    let named = |medium: Option<MediumId>| {
        medium.map(|medium| {
            if medium.is_some() {
                names[medium.index()]
            } else {
                "vacuum"
            }
        })
    };
    assert_eq!(named(at(0.0)), Some("mist"), "inside the opaque ball");
    assert_eq!(named(at(0.5)), Some("mist"));
    assert_eq!(named(at(1.5)), Some("fog"));
    assert_eq!(named(at(3.0)), Some("vacuum"));
}

#[test]
fn a_mean_of_a_probe_in_overlapping_media_is_refused() {
    // The counters that other tests of media lean on: a planted overlap must not pass unnoticed.
    let overlap = homogeneous("fog", ONE, NOTHING, 0.0)
        + &environment(ONE)
        + &null_sphere([0.0, 0.0, -0.5], 1.0, "fog", "")
        + &null_sphere([0.0, 0.0, 0.5], 1.0, "fog", "");
    let scene = volpath(5, [0.0, 0.0, -5.0], AHEAD, &overlap);
    let refused = std::panic::catch_unwind(|| assert_mean(&scene, 4, ONE, "overlap"));
    assert!(refused.is_err());
}
