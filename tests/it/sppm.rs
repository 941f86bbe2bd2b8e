//! Photon mapping against closed forms, where the search radius does no harm, and against itself: on other threads,
//! through other windows, without anything to see.

#![expect(clippy::print_stdout, reason = "a skipped test says so")]

use std::f64::consts::PI;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::common::probe::{Probe, assert_exact, assert_mean};
use crate::common::scene::compile_scene;
use tyndall::compile::{CompileOptions, NoAssets, compile};
use tyndall::describe::describe;
use tyndall::image::codec::decode;
use tyndall::image::{Image, PixelRect};
use tyndall::integrator::Integrator;
use tyndall::render::{Job, Progress, Rendered, Unwatched, render};
use tyndall_parser::parse;
use tyndall_parser::source::Sources;
use tyndall_test_support::z_test::Mean;

/// Seeds behind a mean: pixels share photons, pictures do not.
const SEEDS: u64 = 12;

/// A camera that looks from `eye` to `target` onto a square of half width `half`, which parallel rays meet.
fn camera(eye: [f64; 3], target: [f64; 3], half: f64) -> String {
    let [[x, y, z], [a, b, c]] = [eye, target];
    format!(
        "LookAt {x} {y} {z} {a} {b} {c} 0.1 1 0.2\n\
         Camera \"orthographic\" \"float screenwindow\" [-{half} {half} -{half} {half}]\n"
    )
}

/// An integrator of so many iterations, vertices and photons.
fn sppm(iterations: u32, depth: u32, photons: u32, radius: f64) -> String {
    format!(
        "Integrator \"sppm\" \"integer iterations\" {iterations} \"integer maxdepth\" {depth}\n\
         \"integer photonsperiteration\" {photons} \"float radius\" {radius}\n"
    )
}

fn film(side: u32, more: &str) -> String {
    format!("Film \"image\" \"integer xresolution\" {side} \"integer yresolution\" {side} {more}\n")
}

/// A quadrilateral across z, from −`half` to `half`, seen from all sides.
fn square(z: f64, half: f64) -> String {
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" \
         [-{half} -{half} {z} {half} -{half} {z} {half} {half} {z} -{half} {half} {z}]\n"
    )
}

fn job(text: &str) -> Job {
    compile_scene(text, &CompileOptions::default(), |_| None).job
}

fn rendered(job: &Job) -> Rendered {
    let rendered = render(job, &Unwatched, &AtomicBool::new(false));
    assert_eq!(rendered.report.bad_samples, 0);
    assert_eq!(rendered.report.counters.stuck_paths, 0);
    assert!(!rendered.report.cancelled);
    rendered
}

fn picture(text: &str) -> Image {
    rendered(&job(text)).image
}

fn channel_mean(image: &Image, channel: usize) -> f64 {
    let values = image.data().iter().skip(channel).step_by(3);
    let n = values.len() as f64;
    values.map(|&c| f64::from(c)).sum::<f64>() / n
}

/// Means of the picture's channels over seeds.
fn means(text: &str) -> [Mean; 3] {
    let mut job = job(text);
    let pictures: Vec<Image> = (0..SEEDS)
        .map(|seed| {
            job.seed = seed;
            rendered(&job).image
        })
        .collect();
    [0, 1, 2].map(|channel| {
        let mut values = pictures.iter().map(|image| channel_mean(image, channel));
        Mean::of(pictures.len(), || {
            values.next().expect("a value per picture")
        })
    })
}

#[track_caller]
fn assert_picture(text: &str, expected: [f64; 3], what: &str) {
    for (mean, expected) in means(text).iter().zip(expected) {
        mean.agrees_with(expected).assert_accepted(what);
        assert!(
            mean.standard_error < 0.02 * expected,
            "{what}: ± {} proves nothing",
            mean.standard_error
        );
    }
}

const ALBEDO: [f64; 3] = [0.8, 0.5, 0.25];

/// A round room with a light in its middle: every bounce lights all of it alike, and a ball of any radius cuts a cap of
/// area πr² out of it.
fn round_room(iterations: u32, depth: u32) -> String {
    film(4, "")
        + &camera([0.0, 0.0, 0.0], [0.0, 0.0, 2.0], 1.0)
        + &sppm(iterations, depth, 2000, 0.5)
        + "WorldBegin LightSource \"point\" \"rgb I\" [4 4 4]\n\
           Material \"matte\" \"rgb Kd\" [.8 .5 .25] Shape \"sphere\" \"float radius\" 2 WorldEnd"
}

/// Its radiance after at most `depth` bounces.
fn round_room_radiance(depth: i32) -> [f64; 3] {
    ALBEDO.map(|albedo| (1..=depth).map(|k| albedo.powi(k)).sum::<f64>() / PI)
}

#[test]
fn light_in_a_round_room_is_a_geometric_series() {
    for depth in [1, 2, 5] {
        let what = format!("{depth} bounces");
        let expected = round_room_radiance(depth);
        let scene = round_room(16, depth as u32);
        if depth == 1 {
            // Direct light alone, and no dice.
            let image = picture(&scene);
            for (c, expected) in expected.iter().enumerate() {
                assert!((channel_mean(&image, c) / expected - 1.0).abs() < 1e-5);
            }
        } else {
            assert_picture(&scene, expected, &what);
        }
    }
}

#[test]
fn photons_of_asymmetric_lamps_agree() {
    // A ball in the middle of the room; mirrored, its drawn normals point to the wall, and those that are found inward.
    let (lamp, wall, le) = (1.0, 2.0, 4.0f64);
    let sine2 = f64::powi(lamp / wall, 2);
    let one_minus_cos = sine2 / (1.0 + (1.0 - sine2).sqrt());
    let pdf_light = 1.0 / (2.0 * PI * one_minus_cos);
    let n = 10_000;
    let mut drawn = 0.0;
    for i in 0..n {
        let cos = 1.0 - (f64::from(i) + 0.5) / f64::from(n) * one_minus_cos;
        let share = 1.0 / (1.0 + (cos / PI / pdf_light).powi(2));
        drawn += 2.0 * cos * share * one_minus_cos / f64::from(n);
    }
    for (reversed, part) in [("", drawn), ("ReverseOrientation", sine2 - drawn)] {
        let scene = film(4, "")
            + &camera([0.0, 0.0, 1.1], [0.0, 0.0, 2.0], 0.7)
            + &sppm(24, 3, 20_000, 0.5)
            + "WorldBegin AttributeBegin Scale 1 1 -1 Material \"matte\" \"rgb Kd\" [0 0 0]\n\
               AreaLightSource \"diffuse\" \"rgb L\" [4 4 4]\n"
            + reversed
            + " Shape \"sphere\" AttributeEnd\n\
               Material \"matte\" \"rgb Kd\" [.8 .5 .25] Shape \"sphere\" \"float radius\" 2 WorldEnd";
        // What the wall sends on, it receives but for what the ball takes.
        let expected = ALBEDO.map(|albedo| {
            let kept = albedo * (1.0 - sine2);
            le * albedo * part * (1.0 + kept + kept * kept)
        });
        assert_picture(&scene, expected, reversed);
    }
}

#[test]
fn more_photons_than_are_kept_at_once_bring_no_more_light() {
    // 1.2 million photons arrive 2.3 times each, which makes two batches.
    let scene = round_room(1, 5).replace(&sppm(1, 5, 2000, 0.5), &sppm(1, 5, 1_200_000, 0.5));
    let image = picture(&scene);
    for (c, expected) in round_room_radiance(5).into_iter().enumerate() {
        let ratio = channel_mean(&image, c) / expected;
        assert!((ratio - 1.0).abs() < 0.02, "channel {c}: {ratio}");
    }
}

#[test]
fn the_judge_misses_no_bounce() {
    let means = means(&round_room(16, 5));
    for (mean, (few, many)) in means.iter().zip(
        round_room_radiance(4)
            .into_iter()
            .zip(round_room_radiance(6)),
    ) {
        // A quarter of the light of the last bounce is left in blue, a third of it in red.
        assert!(!mean.agrees_with(few).accepted() || few > 0.99 * mean.value);
        assert!(!mean.agrees_with(many).accepted() || many < 1.01 * mean.value);
    }
    assert!(!means[0].agrees_with(round_room_radiance(4)[0]).accepted());
    assert!(!means[0].agrees_with(round_room_radiance(6)[0]).accepted());
}

#[test]
fn walls_that_shine_find_each_other_whatever_the_light_is_chosen_by() {
    // A cube whose inside shines: Le (1 + ρ + ρ² + ρ³), seen where the search stays on one wall.
    let cube = "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] \"bool twosided\" \"true\"\n\
        Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n\
        Shape \"trianglemesh\" \"integer indices\" [0 1 2 1 3 2 4 6 5 5 6 7 0 4 1 1 4 5 2 3 6 3 7 6 0 2 4 2 6 4 1 5 3 3 5 7]\n\
        \"point P\" [-1 -1 -1 1 -1 -1 -1 1 -1 1 1 -1 -1 -1 1 1 -1 1 -1 1 1 1 1 1]\n";
    let scene = film(4, "")
        + &camera([0.0; 3], [0.0, 0.0, 1.0], 0.3)
        + &sppm(8, 3, 4000, 0.4)
        + "WorldBegin "
        + cube
        + "WorldEnd";
    // The outside shines too, and sends half of the photons away.
    assert_picture(&scene, [1.875, 3.75, 5.625], "a shining cube");
}

/// A pane of glass above a floor, in light from straight above.
fn pane(depth: u32, floor: &str, eye: [f64; 3]) -> String {
    film(4, "")
        + &camera(eye, [eye[0], eye[1], 0.0], 0.25)
        + &sppm(16, depth, 4000, 0.3)
        + "WorldBegin LightSource \"distant\" \"point from\" [0 0 1] \"point to\" [0 0 0] \"rgb L\" [3 2 1]\n\
           Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n"
        + floor
        + "AttributeBegin Material \"glass\"\n"
        + &square(0.6, 2.0)
        + "ReverseOrientation\n"
        + &square(0.5, 2.0)
        + "AttributeEnd WorldEnd"
}

/// Share of light that passes both sides of the pane at once.
const PASSES: f64 = 0.96 * 0.96;

#[test]
fn the_flux_of_a_caustic_is_what_the_glass_lets_through() {
    let expected = [3.0, 2.0, 1.0].map(|e| PASSES * 0.5 * e / PI);
    let scene = pane(3, &square(0.0, 2.0), [0.0, 0.0, 0.3]);
    assert_picture(&scene, expected, "under a pane");
    // Seen through the pane, by camera paths of three vertices.
    let through = expected.map(|l| PASSES * l);
    let scene = pane(3, &square(0.0, 2.0), [0.0, 0.0, 2.0]);
    assert_picture(&scene, through, "through the pane");
}

#[test]
fn photons_heed_shading_normals_as_light_does() {
    // Normals 60° off the light: half of it counts.
    let n = "0 0.8660254 0.5 ".repeat(4);
    let floor = square(0.0, 2.0).replace("\"point P\"", &format!("\"normal N\" [{n}] \"point P\""));
    let expected = [3.0, 2.0, 1.0].map(|e| PASSES * 0.5 * 0.5 * e / PI);
    let scene = pane(3, &floor, [0.0, 0.0, 0.3]);
    assert_picture(&scene, expected, "under a pane");
}

#[test]
fn the_bias_at_an_edge_goes_away_with_iterations() {
    // The floor ends within the search radius: photons are missed, less of them as the radius shrinks.
    let floor = "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" \
        [-2 -2 0 .35 -2 0 .35 2 0 -2 2 0]\n";
    let expected = PASSES * 0.5 * 3.0 / PI;
    let bias = |iterations: u32| {
        let scene = pane(3, floor, [0.0, 0.0, 0.3])
            .replace(
                "\"integer iterations\" 16",
                &format!("\"integer iterations\" {iterations}"),
            )
            .replace("\"float radius\" 0.3", "\"float radius\" 0.6");
        1.0 - means(&scene)[0].value / expected
    };
    let (few, many) = (bias(2), bias(128));
    assert!(few > 0.1, "{few}");
    assert!(many.abs() < 0.3 * few, "{many} after {few}");
}

fn seen(integrator: &str, world: &str) -> String {
    format!(
        "LookAt 0.3 0.2 2 0.1 0 0 0 1 0 Camera \"perspective\" \"float fov\" 30\n\
         {integrator} WorldBegin {world} WorldEnd"
    )
}

#[test]
fn emission_and_light_of_one_direction_need_no_dice() {
    let integrator = sppm(1, 5, 0, 1.0);
    let lamp =
        "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] Material \"matte\" \"rgb Kd\" [0 0 0]\n";
    let scene = seen(&integrator, &(lamp.to_owned() + &square(0.0, 9.0)));
    assert_exact(&scene, [1.0, 2.0, 3.0], "a lamp");
    let mirror = "Material \"mirror\" \"rgb Kr\" [.5 .5 .5]\n".to_owned() + &square(0.0, 9.0);
    let scene = seen(
        &integrator,
        &(mirror.clone() + "LightSource \"infinite\" \"rgb L\" [1 2 3]"),
    );
    assert_exact(&scene, [0.5, 1.0, 1.5], "the sky in a mirror");
    let world = "LightSource \"distant\" \"point from\" [0 0.6 0.8] \"point to\" [0 0 0] \"rgb L\" [1 2 3]\n\
        Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n"
        .to_owned()
        + &square(0.0, 9.0);
    let expected = [1.0, 2.0, 3.0].map(|e| 0.5 / PI * 0.8 * e);
    assert_exact(&seen(&integrator, &world), expected, "a distant light");
}

#[test]
fn direct_light_of_large_and_small_lamps_on_any_surface_is_that_of_paths() {
    let lamps =
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] \"bool twosided\" \"true\"\n"
            .to_owned()
            + &square(1.0, 1.0)
            + "AttributeEnd LightSource \"infinite\" \"rgb L\" [.5 .5 .5]\n\
           LightSource \"point\" \"point from\" [.5 .5 .5] \"rgb I\" [.1 .1 .1]\n";
    for material in [
        "\"matte\"",
        "\"plastic\" \"rgb Ks\" [.5 .5 .5] \"float roughness\" 0.02",
        "\"metal\" \"float roughness\" 0.1",
    ] {
        let world = format!("{lamps} Material {material}\n{}", square(0.0, 9.0));
        // Under the lamp, so that it is not in the way.
        let under = |integrator: &str| {
            seen(integrator, &world).replace("LookAt 0.3 0.2 2 ", "LookAt 0.3 0.2 0.7 ")
        };
        let path = Probe::new(&under("Integrator \"path\" \"integer maxdepth\" 1")).means(40_000);
        let ours = Probe::new(&under(&sppm(1, 1, 0, 1.0))).means(40_000);
        for (ours, path) in ours.iter().zip(path) {
            ours.agrees_with_mean(&path).assert_accepted(material);
        }
    }
}

#[test]
fn surfaces_that_are_mirrors_and_matte_are_both() {
    let world = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n\
        MakeNamedMaterial \"a\" \"string type\" \"mirror\" \"rgb Kr\" [.75 .75 .75]\n\
        MakeNamedMaterial \"b\" \"string type\" \"matte\" \"rgb Kd\" [.5 .5 .5]\n\
        Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" \"rgb amount\" [.5 .5 .5]\n"
        .to_owned()
        + &square(0.0, 9.0);
    let scene = seen(&sppm(1, 5, 0, 1.0), &world);
    assert_mean(&scene, 20_000, [0.375 + 0.25; 3], "a mixture");
    // And its matte part gets all photons: half of what the floor under the pane shows.
    let expected = [3.0, 2.0, 1.0].map(|e| PASSES * 0.25 * e / PI);
    let mixed = world.split_once('\n').expect("lines").1;
    assert_picture(
        &pane(3, mixed, [0.0, 0.0, 0.3])
            .replace("\"rgb Kr\" [.75 .75 .75]", "\"rgb Kr\" [0 0 0]")
            .replace("\"integer iterations\" 16", "\"integer iterations\" 64"),
        expected,
        "a mixed floor",
    );
}

/// A room full of things, without symmetry.
fn still_life(film: &str, integrator: &str) -> String {
    format!(
        "{film} LookAt 0 1 -4 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 50 {integrator}
        WorldBegin LightSource \"point\" \"point from\" [0 1.5 -1] \"rgb I\" [4 4 4]
        AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [9 6 3] Translate -1 1.5 1 Shape \"sphere\" \"float radius\" .2 AttributeEnd
        Material \"matte\" \"rgb Kd\" [.8 .5 .3] Shape \"sphere\" \"float radius\" 5
        Material \"plastic\" AttributeBegin Translate 0 -1 0 Rotate 90 1 0 0 Shape \"disk\" \"float radius\" 4 AttributeEnd
        Material \"glass\" AttributeBegin Translate .7 -.4 -.3 Shape \"sphere\" \"float radius\" .6 AttributeEnd
        Material \"metal\" AttributeBegin Translate -.8 -.4 0 Shape \"sphere\" \"float radius\" .6 AttributeEnd
        WorldEnd"
    )
}

fn bits(image: &Image) -> Vec<u32> {
    image.data().iter().map(|c| c.to_bits()).collect()
}

#[test]
fn n24_threads_change_no_bit_of_photon_maps() {
    let job = job(&still_life(&film(40, ""), &sppm(4, 6, 20_000, 0.4)));
    let on = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
        bits(&pool.expect("threads").install(|| rendered(&job)).image)
    };
    let one = on(1);
    assert!(one.iter().any(|&c| c != one[0]));
    for n in [2, 5] {
        assert!(on(n) == one, "{n} threads");
    }
}

#[test]
fn a_crop_window_changes_no_bit_of_photon_maps() {
    // The default number of photons is that of the frame's pixels, whatever is shown of it.
    let integrator = sppm(3, 5, 0, 0.4);
    let whole = picture(&still_life(&film(48, ""), &integrator));
    let window = "\"float cropwindow\" [.25 .75 .5 1]";
    let part = picture(&still_life(&film(48, window), &integrator));
    let rect = PixelRect {
        x0: 12,
        y0: 24,
        width: 24,
        height: 24,
    };
    let expected = whole.crop(rect).expect("a part of the picture");
    assert!(bits(&part) == bits(&expected));
}

#[test]
fn the_unit_of_length_changes_nothing() {
    let small = pane(3, &square(0.0, 2.0), [0.0, 0.0, 0.3]);
    let changes = [
        ("LookAt 0 0 0.3 0 0 0 ", "LookAt 0 0 1.2 0 0 0 "),
        ("[-0.25 0.25 -0.25 0.25]", "[-1 1 -1 1]"),
        ("\"float radius\" 0.3", "\"float radius\" 1.2"),
        ("WorldBegin", "WorldBegin Scale 4 4 4"),
    ];
    let large = changes.iter().fold(small.clone(), |scene, (from, to)| {
        assert!(scene.contains(from));
        scene.replace(from, to)
    });
    assert_eq!(bits(&picture(&small)), bits(&picture(&large)));
}

/// The job of a scene that loading warns of.
fn warned_job(text: &str) -> Job {
    let mut sources = Sources::new();
    let root = sources.add_text("scene", text.as_bytes().to_vec());
    let (file, _) = parse(&mut sources, root, &tyndall_parser::NoIncludes);
    let (description, _) = describe(file);
    let frame = description.frames.into_iter().next().expect("a frame");
    let (compiled, found) = compile(frame, &CompileOptions::default(), &NoAssets);
    assert!(!found.is_empty() && !found.has_errors());
    compiled.expect("a job").job
}

#[test]
fn l07_a_scene_without_surfaces_shows_its_sky_and_one_without_lights_is_black() {
    let sky = seen(
        &sppm(2, 5, 100, 1.0),
        "LightSource \"infinite\" \"rgb L\" [1 2 3]",
    );
    let image = picture(&(film(3, "") + &sky));
    assert!(image.data().chunks(3).all(|pixel| pixel == [1.0, 2.0, 3.0]));
    let dark = film(3, "") + &seen(&sppm(2, 5, 100, 1.0), &square(0.0, 9.0));
    let image = rendered(&warned_job(&dark)).image;
    assert!(image.data().iter().all(|&c| c == 0.0));
}

#[test]
fn l06_light_sealed_in_a_black_ball_leaves_the_picture_black() {
    let world = "AttributeBegin LightSource \"point\" \"rgb I\" [9 9 9]\n\
        Material \"matte\" \"rgb Kd\" [0 0 0] Shape \"sphere\" \"float radius\" .5 AttributeEnd\n"
        .to_owned()
        + &square(-1.0, 9.0);
    let image = picture(&(film(8, "") + &seen(&sppm(4, 5, 1000, 1.0), &world)));
    assert!(image.data().iter().all(|&c| c == 0.0));
}

#[test]
fn no_vertices_or_a_search_beyond_the_scene_do_no_harm() {
    let room = still_life(&film(8, ""), &sppm(2, 0, 100, 1.0));
    assert!(picture(&room).data().iter().all(|&c| c == 0.0));
    for radius in [1e-30, 1e30] {
        let room = still_life(&film(8, ""), &sppm(2, 5, 100, radius));
        assert!(picture(&room).data().iter().all(|c| c.is_finite()));
    }
}

#[test]
fn null_surfaces_are_passed_by_photons_and_block_light_sampling() {
    let scene = pane(3, &square(0.0, 2.0), [0.0, 0.0, 0.3]);
    let veil = format!(
        "AttributeBegin Material \"none\" {} AttributeEnd WorldEnd",
        square(0.8, 3.0)
    );
    let veiled = scene.replace("WorldEnd", &veil);
    let expected = [3.0, 2.0, 1.0].map(|e| PASSES * 0.5 * e / PI);
    assert_picture(&veiled, expected, "under a veil");
    let direct = seen(
        &sppm(1, 1, 0, 1.0),
        &format!(
            "LightSource \"distant\" \"point from\" [0 0 1] \"point to\" [0 0 0] {} Material \"none\" {}",
            square(0.0, 9.0),
            square(3.0, 20.0),
        ),
    );
    assert_exact(&direct, [0.0; 3], "veiled light");
}

/// Counts and, after so many samples, asks to stop.
struct StopAfter<'a>(u64, &'a AtomicBool, AtomicU64);

impl Progress for StopAfter<'_> {
    fn samples_done(&self, done: u64, total: u64) {
        assert!(done <= total);
        self.2.fetch_max(done, Ordering::Relaxed);
        if done >= self.0 {
            self.1.store(true, Ordering::Relaxed);
        }
    }
}

#[test]
fn a_cancelled_picture_is_as_bright_as_a_whole_one() {
    let mut job = job(&round_room(64, 5));
    job.spp = 1 << 20;
    let cancel = AtomicBool::new(false);
    let watch = StopAfter(16 * 64, &cancel, AtomicU64::new(0));
    let rendered = render(&job, &watch, &cancel);
    assert!(rendered.report.cancelled);
    assert_eq!(rendered.report.samples, watch.2.load(Ordering::Relaxed));
    let (mean, expected) = (channel_mean(&rendered.image, 0), round_room_radiance(5)[0]);
    assert!((mean / expected - 1.0).abs() < 0.05, "{mean}, {expected}");
}

#[test]
fn parameters_and_options_say_how_many_iterations_there_are() {
    let of = |integrator: &str, options: &CompileOptions| {
        let job = compile_scene(still_life(&film(8, ""), integrator), options, |_| None).job;
        let Integrator::Sppm(sppm) = job.integrator else {
            panic!("{:?}", job.integrator)
        };
        (job.spp, sppm.max_depth, sppm.photons_per_iteration)
    };
    let plain = CompileOptions::default();
    assert_eq!(of("Integrator \"sppm\"", &plain), (64, 5, None));
    assert_eq!(
        of("Integrator \"sppm\" \"integer numiterations\" 7", &plain).0,
        7
    );
    assert_eq!(of(&sppm(9, 3, 77, 1.0), &plain), (9, 3, Some(77)));
    let spp = CompileOptions {
        spp: Some(3),
        ..CompileOptions::default()
    };
    assert_eq!(of(&sppm(9, 3, 77, 1.0), &spp).0, 3);
    let quick = CompileOptions {
        quick: true,
        ..CompileOptions::default()
    };
    assert_eq!(of("Integrator \"sppm\"", &quick).0, 4);
}

#[test]
fn a_published_caustic_is_as_bright_as_pbrt_makes_it() {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let folder = shared.join("scenes/caustic-glass");
    // By 10 000 iterations, so that little bias is left.
    let reference = shared.join("references/caustic-glass/f16-9c.exr");
    let (Ok(scene), Ok(reference)) = (
        std::fs::read_to_string(folder.join("f16-9a.pbrt")),
        std::fs::read(reference),
    ) else {
        println!("skipped: there are no references beside the repository");
        return;
    };
    let reference = decode(&reference, "exr").expect("an EXR").image;
    // A quarter of the resolution, and of the photons one for each pixel: the noise of the mean is a few thousandths.
    let scene = scene.replace("[700]", "[175]").replace("[1000]", "[250]");
    let options = CompileOptions {
        spp: Some(8),
        ..CompileOptions::default()
    };
    let read = |path: &str| std::fs::read(folder.join(path)).ok();
    let image = rendered(&compile_scene(scene, &options, read).job).image;
    assert_eq!((image.width(), image.height()), (175, 250));
    for channel in 0..3 {
        let ratio = channel_mean(&image, channel) / channel_mean(&reference, channel);
        println!("channel {channel}: {ratio}");
        assert!((ratio - 1.0).abs() < 0.01, "channel {channel}: {ratio}");
    }
}

#[test]
fn photons_and_pixels_count_as_memory() {
    let needed = |photons: u32, pixels: u32| {
        let scene = still_life(&film(pixels, ""), &sppm(1, 5, photons, 1.0));
        compile_scene(scene, &CompileOptions::default(), |_| None)
            .job
            .bytes_needed()
    };
    // A place, a direction and a colour, twice while they are sorted.
    let (few, many) = (needed(1, 8), needed(1_000_000, 8));
    assert!(many - few > 2_000_000 * 36, "{few}, {many}");
    assert_eq!(
        needed(1 << 30, 8),
        needed(1 << 29, 8),
        "batches are bounded"
    );
    let large = needed(1, 808);
    assert!(large - few > 800 * 808 * 100, "{few}, {large}");
}
