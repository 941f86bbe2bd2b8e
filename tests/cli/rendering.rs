//! What is rendered, from which files.

use crate::room::{BALL, Room, ball};

#[test]
fn a_scene_without_faults_is_rendered_to_the_films_file() {
    let room = Room::new();
    let run = room.run("ball.pbrt").ends_with(0);
    assert!(run.stderr.starts_with("wrote ball.exr ("), "{}", run.stderr);
    assert_eq!(run.stderr.lines().count(), 1);
    assert_eq!(run.stdout, "");
    let picture = room.picture("ball.exr");
    assert_eq!((picture.image.width(), picture.image.height()), (64, 48));
    // The sky is 1 everywhere; the ball reflects half of it.
    assert_eq!(picture.image.pixel(0, 0), [1.0, 1.0, 1.0]);
    assert!((picture.image.pixel(32, 24)[0] - 0.5).abs() < 0.1);
}

#[test]
fn standard_input_is_the_scene_if_no_file_or_a_dash_is_given() {
    let room = Room::new();
    room.run("--quiet ball.pbrt").ends_with(0);
    for line in ["", "-"] {
        let run = room.feed(&format!("--quiet --outfile in.exr {line}"), BALL);
        run.ends_with(0).says_nothing();
        assert_eq!(room.picture("in.exr").image, room.picture("ball.exr").image);
    }
}

#[test]
fn faults_of_standard_input_are_placed_in_it() {
    let scene = ball("Shape \"sphere\"", "Shape \"spher\"");
    Room::new()
        .feed("", &scene)
        .ends_with(3)
        .says(" --> <stdin>:9:7\n");
}

#[test]
fn several_files_are_one_stream_and_each_resolves_its_own_paths() {
    let room = Room::new();
    let (options, world) = BALL.split_once("WorldBegin").expect("a world");
    room.put(
        "a/options.pbrt",
        &format!("{options}\nInclude \"more.pbrt\""),
    );
    room.put(
        "a/more.pbrt",
        "Sampler \"halton\" \"integer pixelsamples\" 3",
    );
    room.put("b/world.pbrt", "WorldBegin\nInclude \"more.pbrt\"");
    room.put("b/more.pbrt", world);
    let report = room.report("a/options.pbrt b/world.pbrt");
    assert_eq!(report["outcome"], "complete");
    assert_eq!(report["pictures"][0]["job"]["spp"], 3);
    assert_eq!(report["scenes"][1], "b/world.pbrt");
}

#[test]
fn every_world_is_a_picture() {
    let room = Room::new();
    room.put("second.pbrt", &ball("ball.exr", "second.pfm"));
    let report = room.report("ball.pbrt second.pbrt");
    assert_eq!(report["pictures"][0]["file"], "ball.exr");
    assert_eq!(report["pictures"][1]["file"], "second.pfm");
    assert_eq!(
        room.picture("second.pfm").image,
        room.picture("ball.exr").image
    );
    room.run("ball.pbrt ball.pbrt")
        .ends_with(0)
        .says("warning[picture-overwritten]: \"ball.exr\" already holds an earlier picture\n");
}

#[test]
fn a_picture_that_cannot_be_made_does_not_stop_the_next() {
    let room = Room::new();
    room.put("bad.pbrt", &ball("ball.exr", "bad.jpg"));
    let report = room.report("bad.pbrt ball.pbrt");
    assert_eq!(report["exit_code"], 1);
    assert_eq!(report["pictures"][0]["outcome"], "failed");
    assert_eq!(report["pictures"][1]["outcome"], "complete");
    assert!(room.path("ball.exr").exists());
}

#[test]
fn pictures_of_single_strategies_are_written_beside_the_picture() {
    let room = Room::new();
    let bdpt = "Integrator \"bdpt\" \"integer maxdepth\" 1 \"bool visualizeweights\" \"true\"";
    room.put(
        "ball.pbrt",
        &ball("WorldBegin", &format!("{bdpt}\nWorldBegin")),
    );
    room.put("out/old.txt", "");
    let report = room.report("--outfile out/ball.png --cropwindow 0 .5 0 1 ball.pbrt");
    assert_eq!(report["outcome"], "complete");
    let names = ["d00_s00_t02", "d01_s00_t03", "d01_s01_t02", "d01_s02_t01"]
        .map(|name| format!("out/bdpt_{name}.exr"));
    assert_eq!(
        report["pictures"][0]["strategy_files"],
        serde_json::json!(names)
    );
    for name in &names {
        let part = room.picture(name);
        assert_eq!((part.image.width(), part.image.height()), (32, 48));
        assert_eq!(part.display_window.width, 64);
    }
    // The sky beside the ball is met by chance alone.
    assert_eq!(room.picture(&names[0]).image.pixel(0, 0), [1.0; 3]);
    assert_eq!(room.picture(&names[2]).image.pixel(0, 0), [0.0; 3]);
    assert!(!room.list().iter().any(|name| name.starts_with("bdpt")));
    // They are like any picture: tried before, and not written over an earlier one without a word.
    let twice = "--outfile out/ball.png ball.pbrt ball.pbrt";
    room.run(twice)
        .ends_with(0)
        .says("bdpt_d00_s00_t02.exr\" already holds");
    std::fs::create_dir(room.path("bdpt_d01_s02_t01.exr")).expect("a directory");
    room.run("ball.pbrt")
        .ends_with(1)
        .says("fatal[unwritable-output]");
    assert!(!room.path("ball.exr").exists(), "it was not even rendered");
}
