//! What each option does, and how options are written.

use crate::room::{BALL, Room, ball, ball_without_its_mesh};

#[test]
fn one_dash_two_dashes_and_equal_signs_are_the_same() {
    let room = Room::new();
    room.put("x.pbrt", &ball("\"string filename\" \"ball.exr\"", ""));
    for (i, line) in [
        "-spp 2 -outfile 0.exr",
        "--spp 2 --outfile 1.exr",
        "--spp=2 -outfile=2.exr",
    ]
    .iter()
    .enumerate()
    {
        room.run(&format!("{line} x.pbrt --quiet"))
            .ends_with(0)
            .says_nothing();
        assert_eq!(room.read(&format!("{i}.exr")), room.read("0.exr"));
    }
}

#[test]
fn sample_count_and_seed_are_what_the_line_says() {
    let room = Room::new();
    let report = room.report("--spp 2 --seed 18446744073709551615 ball.pbrt");
    let picture = &report["pictures"][0];
    assert_eq!(picture["job"]["spp"], 2);
    assert_eq!(picture["job"]["seed"], u64::MAX);
    assert_eq!(picture["render"]["samples"], 2 * 64 * 48);
    let with_seed = room.picture("ball.exr").image;
    room.run("--spp 2 ball.pbrt").ends_with(0);
    assert_ne!(room.picture("ball.exr").image, with_seed);
}

#[test]
fn quick_is_a_quarter_of_the_resolution_with_one_sample() {
    let report = Room::new().report("--quick ball.pbrt");
    assert_eq!(
        report["pictures"][0]["job"]["resolution"],
        serde_json::json!([16, 12])
    );
    assert_eq!(report["pictures"][0]["job"]["spp"], 1);
}

#[test]
fn a_crop_window_is_a_piece_of_the_full_picture_bit_for_bit() {
    let room = Room::new();
    // A filter wider than a pixel: neighbours outside the crop contribute.
    let filter = "PixelFilter \"gaussian\" \"float xwidth\" 2 \"float ywidth\" 2\nWorldBegin";
    room.put("ball.pbrt", &ball("WorldBegin", filter));
    room.run("--quiet ball.pbrt").ends_with(0);
    let full = room.picture("ball.exr");
    room.run("--quiet --cropwindow 0.25 0.7 .5 1 ball.pbrt")
        .ends_with(0);
    let part = room.picture("ball.exr");
    let window = part.data_window();
    assert_eq!(
        (window.x0, window.y0, window.width, window.height),
        (16, 24, 29, 24)
    );
    assert_eq!(part.display_window, full.display_window);
    assert_eq!(full.crop(window).as_ref(), Some(&part.image));
}

#[test]
fn a_crop_window_of_the_film_wins_with_a_warning() {
    let room = Room::new();
    let window = "\"float cropwindow\" [0 .5 0 .5] \"string filename\"";
    room.put("ball.pbrt", &ball("\"string filename\"", window));
    room.run("--cropwindow 0 1 0 1 ball.pbrt")
        .ends_with(0)
        .says("warning[cropwindow-overridden]: --cropwindow gives way to the film's cropwindow\n");
    assert_eq!(room.picture("ball.exr").image.width(), 32);
}

#[test]
fn the_number_of_threads_does_not_change_a_byte() {
    let room = Room::new();
    let file = |n: usize| {
        let report = room.report(&format!("--nthreads {n} --spp 40 ball.pbrt"));
        assert_eq!(report["threads"], n);
        room.read("ball.exr")
    };
    let one = file(1);
    assert_eq!(one, file(2));
    assert_eq!(one, file(7));
}

#[test]
fn zero_threads_are_all_there_are() {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    assert_eq!(
        Room::new().report("--nthreads 0 ball.pbrt")["threads"],
        cores
    );
}

#[test]
fn half_stores_sixteen_bits() {
    let room = Room::new();
    room.run("--quiet --spp 64 ball.pbrt").ends_with(0);
    let float = room.picture("ball.exr").image;
    room.run("--quiet --spp 64 --half ball.pbrt").ends_with(0);
    let half = room.picture("ball.exr").image;
    assert_ne!(half, float);
    for (h, f) in half.data().iter().zip(float.data()) {
        assert!(
            (h - f).abs() <= f / 2048.0,
            "{h} is not {f} in half precision"
        );
    }
    room.run("--half --outfile a.png ball.pbrt")
        .ends_with(0)
        .says("warning[half-without-exr]");
}

#[test]
fn cat_prints_a_scene_that_says_the_same() {
    let room = Room::new();
    room.put("top.pbrt", "Include \"ball.pbrt\"");
    let printed = room.run("--cat top.pbrt").ends_with(0).stdout;
    assert!(printed.starts_with("LookAt 0 0 -5 0 0 0 0 1 0\nCamera \"perspective\"\n"));
    assert_eq!(room.feed("--cat", &printed).ends_with(0).stdout, printed);
    assert_eq!(room.run("--toply top.pbrt").ends_with(0).stdout, printed);
    assert_eq!(room.list(), ["ball.pbrt", "top.pbrt"]);
}

#[test]
fn check_builds_and_renders_nothing() {
    let room = Room::new();
    for line in [
        "check ball.pbrt",
        "--check ball.pbrt",
        "--quiet check ball.pbrt",
    ] {
        let report = room.report(line);
        assert_eq!(
            (&report["task"], &report["exit_code"]),
            (&"check".into(), &0.into())
        );
        assert_eq!(report["pictures"][0]["job"]["elements"], 1);
        assert!(report["pictures"][0]["render"].is_null());
    }
    assert_eq!(
        room.run("check ball.pbrt").stderr,
        "tyndall: no findings; complete (exit status 0)\n"
    );
    room.put("ball.pbrt", &ball_without_its_mesh());
    room.run("check ball.pbrt").ends_with(3);
    assert_eq!(room.list(), ["ball.pbrt"]);
}

#[test]
fn a_file_of_the_name_check_is_rendered_by_its_path() {
    let room = Room::new();
    room.put("check", BALL);
    room.run("./check").ends_with(0);
    assert!(room.path("ball.exr").exists());
}

#[test]
fn logging_options_are_accepted_with_a_note() {
    let run = Room::new().run("-logdir x --minloglevel=2 -v 3 --logtostderr ball.pbrt");
    let run = run.ends_with(0).says("note: --logdir has no effect\n");
    let run = run.says("note: --minloglevel has no effect\n");
    run.says("note: --v has no effect\n")
        .says("note: --logtostderr has no effect\n");
}

#[test]
fn help_and_version_are_no_errors_and_go_to_standard_output() {
    let room = Room::new();
    for line in ["--help", "-help", "-h"] {
        let run = room.run(line).ends_with(0);
        for option in [
            "compare",
            "completions",
            "--outfile",
            "--cropwindow",
            "--strict",
            "Exit status:\n  0 ",
        ] {
            assert!(
                run.stdout.contains(option),
                "{line} does not mention {option}"
            );
        }
        assert_eq!(run.stderr, "");
    }
    let version = format!("tyndall {}\n", env!("CARGO_PKG_VERSION"));
    assert_eq!(room.run("--version").ends_with(0).stdout, version);
}

#[test]
fn the_manual_names_every_option() {
    let manual = include_str!("../../docs/cli.md");
    let help = Room::new().run("--help").stdout;
    let options = help
        .split_whitespace()
        .filter(|word| word.starts_with("--") && word.len() > 2);
    let mut n_options = 0;
    for option in options.map(|word| word.trim_end_matches([',', ':', ';', '.'])) {
        assert!(
            manual.contains(&format!("`{option}")),
            "docs/cli.md lacks {option}"
        );
        n_options += 1;
    }
    assert!(n_options > 15);
}

#[test]
fn a_crop_window_without_pixels_is_no_fault_of_the_scene() {
    let room = Room::new();
    for window in ["0.5 0.5 0 1", "0 1 0.501 0.502", "2 3 0 1"] {
        let run = room
            .run(&format!("ball.pbrt --cropwindow {window}"))
            .ends_with(2);
        let run = run.says("holds no pixel of a frame of 64 x 48");
        assert!(!run.stderr.contains("-->"), "{}", run.stderr);
    }
    let film = "\"float cropwindow\" [.5 .5 0 1] \"string filename\"";
    room.put("ball.pbrt", &ball("\"string filename\"", film));
    room.run("ball.pbrt").ends_with(1).says(" --> ball.pbrt:4:");
    assert_eq!(room.list(), ["ball.pbrt"]);
}

#[test]
fn a_wrong_command_line_does_nothing_and_says_why() {
    let room = Room::new();
    for (line, why) in [
        (
            "--oufile x.exr ball.pbrt",
            "a similar argument exists: '--outfile'",
        ),
        ("--spp 0 ball.pbrt", "0 is not in 1..="),
        ("--spp -3 ball.pbrt", "'-3'"),
        ("--spp 4294967296 ball.pbrt", "is not in 1..="),
        ("--nthreads 1025 ball.pbrt", "1025 is not in 0..=1024"),
        ("--nthreads few ball.pbrt", "invalid value 'few'"),
        ("--cropwindow 0 1 0", "4 values required"),
        ("--cropwindow 0 1 0 nan ball.pbrt", "it must be finite"),
        ("--quiet --verbose ball.pbrt", "cannot be used with"),
        ("check --cat ball.pbrt", "exclude each other"),
        ("--cat --json - ball.pbrt", "both write to standard output"),
        ("- ball.pbrt -", "only once"),
    ] {
        room.run(line).ends_with(2).says(why);
    }
    assert_eq!(room.list(), ["ball.pbrt"]);
}
