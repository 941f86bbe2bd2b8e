//! The command line: the real program, run in fresh directories.

#[path = "cli/room.rs"]
mod room;

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use room::{BALL, Room, Run};

/// The ball with one change.
fn ball(from: &str, to: &str) -> String {
    assert!(BALL.contains(from), "the ball has no {from}");
    BALL.replace(from, to)
}

/// A scene with a mesh that is not there.
fn ball_without_its_mesh() -> String {
    ball(
        "Shape \"sphere\"",
        "Shape \"sphere\"\nShape \"plymesh\" \"string filename\" \"gone.ply\"",
    )
}

// --- what is rendered ---

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

// --- options ---

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
    let manual = include_str!("../docs/cli.md");
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

// --- findings and exit status ---

#[test]
fn a_missing_file_is_shown_at_its_place_and_changes_the_exit_status() {
    let room = Room::new();
    room.put("ball.pbrt", &ball_without_its_mesh());
    let run = room.run("ball.pbrt").ends_with(3);
    let (finding, rest) = run.stderr.split_once("\n\n").expect("a finding");
    assert_eq!(
        finding,
        "error[missing-file]: cannot read \"gone.ply\": No such file or directory
  --> ball.pbrt:10:35
   |
10 | Shape \"plymesh\" \"string filename\" \"gone.ply\"
   |                                   ^^^^^^^^^^ the shape is left out"
    );
    let (wrote, sum) = rest.split_once('\n').expect("two lines");
    assert!(wrote.starts_with("wrote ball.exr"));
    assert_eq!(
        sum,
        "tyndall: 1 error; parts of the scene were left out or replaced (exit status 3)\n"
    );
    assert!(room.attribute("ball.exr", "tyndall/incomplete").is_some());
}

#[test]
fn a_misspelt_parameter_is_shown_with_the_nearest_name() {
    let room = Room::new();
    room.put("ball.pbrt", &ball("\"float fov\"", "\"float fow\""));
    let run = room.run("ball.pbrt").ends_with(0);
    let (finding, _) = run.stderr.split_once("\n\n").expect("a finding");
    assert_eq!(
        finding,
        "warning[unused-parameter]: \"fow\" has no effect on camera \"perspective\"
 --> ball.pbrt:3:22
  |
3 | Camera \"perspective\" \"float fow\" 40
  |                      ^^^^^^^^^^^
  |
  = help: did you mean \"fov\"?"
    );
    run.says("tyndall: 1 warning; complete (exit status 0)\n");
}

#[test]
fn quiet_hides_warnings_and_shows_errors() {
    let room = Room::new();
    room.put("warned.pbrt", &ball("\"float fov\"", "\"float fow\""));
    room.run("--quiet warned.pbrt").ends_with(0).says_nothing();
    room.put("wrong.pbrt", &ball_without_its_mesh());
    let run = room.run("--quiet wrong.pbrt").ends_with(3);
    run.says("error[missing-file]").says("tyndall: 1 error");
}

#[test]
fn strict_renders_nothing_if_there_is_a_single_warning_anywhere() {
    let room = Room::new();
    let scene = ball("\"float fov\"", "\"float fow\"").replace("ball.exr", "warned.exr");
    room.put("warned.pbrt", &scene);
    // The first picture is without fault.
    let run = room.run("--strict ball.pbrt warned.pbrt").ends_with(1);
    run.says("error[unused-parameter]")
        .says("tyndall: 1 error; failed (exit status 1)");
    assert_eq!(room.list(), ["ball.pbrt", "warned.pbrt"]);
    // What is said about the command line is no fault of the scene.
    let run = room.run("--strict --outfile x.exr ball.pbrt").ends_with(0);
    run.says("warning[filename-overridden]");
}

#[test]
fn strict_reports_the_faults_of_all_phases_at_once() {
    let room = Room::new();
    let scene = ball_without_its_mesh().replace("Material \"matte\"", "Identity 3\nReverse");
    let scene = format!("{scene}\nAttributeEnd");
    room.put(
        "ball.pbrt",
        &scene.replace("Identity 3\nReverse", "Material \"mattte\""),
    );
    let run = room.run("--strict ball.pbrt").ends_with(1);
    run.says("there is no material")
        .says("AttributeEnd")
        .says("missing-file");
}

#[test]
fn many_findings_of_one_kind_are_cut_on_the_screen_but_not_in_the_report() {
    let room = Room::new();
    let meshes: String = (0..60)
        .map(|i| format!("Shape \"plymesh\" \"string filename\" \"{i}.ply\"\n"))
        .collect();
    room.put("ball.pbrt", &ball("WorldEnd", &format!("{meshes}WorldEnd")));
    let run = room.run("--json r.json ball.pbrt").ends_with(3);
    assert_eq!(run.stderr.matches("error[missing-file]").count(), 50);
    let run = run.says("more of the kind `missing-file` are not shown");
    run.says("tyndall: 60 errors");
    let report: serde_json::Value = serde_json::from_slice(&room.read("r.json")).expect("JSON");
    assert_eq!(report["findings"].as_array().map(Vec::len), Some(60));
}

#[test]
fn scenes_that_cannot_be_understood_are_not_rendered() {
    let room = Room::new();
    room.put("garbage.pbrt", "WorldBegin\nWorldDestroy\nWorldEnd");
    room.put("empty.pbrt", "");
    room.put("loop.pbrt", "Include \"loop.pbrt\"");
    room.put("quote.pbrt", "Film \"image");
    room.put("nowhere.pbrt", &ball("\"perspective\"", "\"perspektive\""));
    let before = room.list();
    for (line, why) in [
        ("garbage.pbrt", "WorldDestroy"),
        ("empty.pbrt", "the scene has no WorldBegin"),
        ("loop.pbrt", "includes itself"),
        ("quote.pbrt", "fatal[unterminated-string]"),
        ("nowhere.pbrt", "did you mean \"perspective\"?"),
        (
            "gone.pbrt",
            "fatal[unreadable-file]: cannot read \"gone.pbrt\": No such file or directory\n",
        ),
        (".", "cannot read \".\": Is a directory"),
        ("ball.pbrt gone.pbrt", "cannot read \"gone.pbrt\""),
    ] {
        room.run(line).ends_with(1).says(why);
    }
    assert_eq!(room.list(), before);
}

#[test]
fn devices_and_directories_that_a_scene_names_are_refused() {
    let room = Room::new();
    for name in ["/dev/zero", "."] {
        let mesh = format!("Shape \"plymesh\" \"string filename\" \"{name}\"\nWorldEnd");
        room.put("ball.pbrt", &ball("WorldEnd", &mesh));
        room.run("ball.pbrt")
            .ends_with(3)
            .says("it is not a regular file");
    }
}

#[test]
fn pictures_beyond_the_machine_are_refused_with_the_memory_they_need() {
    let room = Room::new();
    let size = "\"integer xresolution\" 2000000000 \"integer yresolution\" 2000000000";
    let film = "\"integer xresolution\" 64 \"integer yresolution\" 48";
    room.put("ball.pbrt", &ball(film, size));
    let run = room.run("ball.pbrt").ends_with(1);
    run.says(
        "fatal[too-large]: a picture of 2000000000 x 2000000000 pixels needs 213623046875000 MiB",
    );
}

#[test]
fn bad_samples_are_reported_and_change_the_exit_status() {
    let room = Room::new();
    room.put("lossy.pbrt", include_str!("cli/lossy.pbrt"));
    let run = room.run("--json lossy.json lossy.pbrt").ends_with(4);
    run.says(
        "error[bad-samples]: 256 of 256 samples of lossy.exr are not finite or negative and were left \
         out; the first is sample 0 of pixel (0, 0)\n",
    )
    .says("tyndall: 1 error; samples were lost (exit status 4)\n");
    let report: serde_json::Value = serde_json::from_slice(&room.read("lossy.json")).expect("JSON");
    let render = &report["pictures"][0]["render"];
    assert_eq!(render["bad_samples"], 256);
    assert_eq!(
        render["first_bad_sample"],
        serde_json::json!({"pixel": [0, 0], "sample": 0})
    );
    assert_eq!(report["outcome"], "lost-samples");
    let why = room.attribute("lossy.exr", "tyndall/incomplete");
    assert_eq!(why.as_deref(), Some("samples were lost"));
}

#[test]
fn pixels_that_overflow_are_reported_and_change_the_exit_status() {
    let room = Room::new();
    let film = "\"float scale\" 1e38 \"string filename\"";
    let scene = ball("\"string filename\"", film).replace("[1 1 1]", "[1e38 1e38 1e38]");
    room.put("ball.pbrt", &scene);
    room.run("ball.pbrt").ends_with(4).says("error[bad-pixels]");
}

// --- files ---

#[test]
fn outfile_replaces_the_films_filename_with_a_warning() {
    let room = Room::new();
    room.run("--outfile other.pfm ball.pbrt")
        .ends_with(0)
        .says("warning[filename-overridden]: the film's filename gives way to --outfile\n --> ball.pbrt:4:82\n");
    assert_eq!(room.list(), ["ball.pbrt", "other.pfm"]);
}

#[test]
fn the_films_file_lies_in_the_working_directory_not_beside_the_scene() {
    let room = Room::new();
    room.put("deep/scene.pbrt", BALL);
    room.run("deep/scene.pbrt").ends_with(0);
    assert!(room.path("ball.exr").exists() && !room.path("deep/ball.exr").exists());
}

#[test]
fn every_format_is_written_by_its_extension_in_any_case() {
    let room = Room::new();
    for name in ["a.exr", "a.PFM", "a.png", "a.Tga"] {
        room.run(&format!("--quiet --outfile {name} ball.pbrt"))
            .ends_with(0);
        assert_eq!(room.picture(name).image.width(), 64);
    }
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_rendering() {
    let room = Room::new();
    room.put("folder.exr/x", "");
    let before = room.list();
    for (name, why) in [
        ("no/where/x.exr", "there is no directory \"no/where\""),
        (
            "x.jpg",
            "\"jpg\" files are read, not written; use exr, pfm, png or tga",
        ),
        ("x.tiff", "\"tiff\" is not an image format known here"),
        (
            "picture",
            "its name has no extension; use exr, pfm, png or tga",
        ),
        ("folder.exr", "it is a directory"),
        ("ball.pbrt/x.exr", "there is no directory \"ball.pbrt\""),
    ] {
        let run = room
            .run(&format!("--outfile {name} ball.pbrt"))
            .ends_with(1);
        run.says(&format!(
            "fatal[unwritable-output]: cannot write \"{name}\": {why}"
        ));
        let report = room.report(&format!("--outfile {name} ball.pbrt"));
        assert!(
            report["pictures"][0]["render"].is_null(),
            "{name} was rendered"
        );
    }
    room.put("ball.pbrt", &ball("ball.exr", "no/ball.exr"));
    room.run("ball.pbrt")
        .ends_with(1)
        .says(" --> ball.pbrt:4:82\n");
    assert_eq!(room.list(), before);
}

#[test]
fn a_tga_that_is_too_wide_is_refused_before_rendering() {
    let room = Room::new();
    room.put(
        "ball.pbrt",
        &ball(
            "\"integer xresolution\" 64",
            "\"integer xresolution\" 70000",
        ),
    );
    let report = room.report("--outfile x.tga ball.pbrt");
    assert_eq!(report["exit_code"], 1);
    assert!(report["pictures"][0]["render"].is_null());
}

#[test]
#[cfg(unix)]
fn a_disk_that_fills_up_leaves_the_old_picture_and_nothing_else() {
    let room = Room::new();
    room.put("ball.exr", "the old picture");
    // Files of more than one block of 512 or 1024 bytes cannot be written.
    let line = format!(
        "trap '' XFSZ; ulimit -f 1; '{}' ball.pbrt",
        env!("CARGO_BIN_EXE_tyndall")
    );
    let output = Command::new("sh")
        .args(["-c", &line])
        .current_dir(room.path("."))
        .output()
        .expect("a shell");
    Run::new(output)
        .ends_with(1)
        .says("fatal[unwritable-output]: cannot write \"ball.exr\": File too large\n");
    assert_eq!(room.read("ball.exr"), b"the old picture");
    assert_eq!(room.list(), ["ball.exr", "ball.pbrt"]);
}

#[test]
#[cfg(unix)]
fn links_are_followed_and_new_files_have_the_usual_permissions() {
    use std::os::unix::fs::{PermissionsExt, symlink};

    let room = Room::new();
    room.put("far/target.exr", "old");
    symlink(room.path("far/target.exr"), room.path("ball.exr")).expect("a link");
    room.put("plain", "made as any other file");
    room.run("ball.pbrt").ends_with(0);
    assert!(
        std::fs::symlink_metadata(room.path("ball.exr"))
            .expect("it is there")
            .is_symlink()
    );
    assert_eq!(room.picture("far/target.exr").image.width(), 64);
    let mode = |name| {
        std::fs::metadata(room.path(name))
            .expect("a file")
            .permissions()
            .mode()
    };
    assert_eq!(mode("far/target.exr"), mode("plain"));
}

#[test]
fn exr_files_say_how_they_were_made() {
    let room = Room::new();
    let film = "\"float maxsampleluminance\" 8 \"string filename\"";
    room.put("ball.pbrt", &ball("\"string filename\"", film));
    room.run("--spp 3 --seed 7 ball.pbrt").ends_with(0);
    for (name, value) in [
        ("tyndall/version", Some(env!("CARGO_PKG_VERSION"))),
        ("tyndall/scene", Some("ball.pbrt")),
        ("tyndall/integrator", Some("path")),
        ("tyndall/spp", Some("3")),
        ("tyndall/seed", Some("7")),
        ("tyndall/max-sample-luminance", Some("8")),
        ("tyndall/incomplete", None),
    ] {
        assert_eq!(room.attribute("ball.exr", name).as_deref(), value, "{name}");
    }
}

// --- report ---

/// `a.b`, `list[].c`: the fields of a value, `[]` at the end left out.
fn fields(value: &serde_json::Value, path: &str, found: &mut BTreeSet<String>) {
    found.insert(path.trim_end_matches("[]").to_owned());
    if let Some(object) = value.as_object() {
        for (name, value) in object {
            fields(
                value,
                format!("{path}.{name}").trim_start_matches('.'),
                found,
            );
        }
    }
    for element in value.as_array().into_iter().flatten() {
        fields(element, &format!("{path}[]"), found);
    }
}

/// The same from the tables of the manual, where `.b` behind `a.x` means `a.b`.
fn documented_fields() -> BTreeSet<String> {
    let manual = include_str!("../docs/cli.md");
    let (_, section) = manual
        .split_once("## Report")
        .expect("a section on the report");
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    let mut found = BTreeSet::new();
    for row in rows {
        let cell = row.split('|').nth(1).expect("a first column");
        let mut path = String::new();
        for field in cell.split('`').skip(1).step_by(2) {
            path = match (field.strip_prefix('.'), path.rsplit_once('.')) {
                (Some(last), Some((parent, _))) => format!("{parent}.{last}"),
                _ => field.to_owned(),
            };
            found.insert(path.trim_end_matches("[]").to_owned());
        }
    }
    found
}

#[test]
fn the_report_holds_the_documented_fields_and_no_others() {
    let room = Room::new();
    room.put("ball.pbrt", &ball_without_its_mesh());
    let mut reported = BTreeSet::new();
    fields(&room.report("ball.pbrt"), "", &mut reported);
    let documented = documented_fields();
    let missing: Vec<_> = documented.difference(&reported).collect();
    assert!(missing.is_empty(), "not in the report: {missing:?}");
    let is_group = |field: &String| {
        documented
            .iter()
            .any(|other| other.starts_with(&format!("{field}.")))
    };
    let unknown: Vec<_> = reported
        .difference(&documented)
        .filter(|field| !field.is_empty() && !is_group(field))
        .collect();
    assert!(unknown.is_empty(), "not in docs/cli.md: {unknown:?}");
    assert_eq!(room.report("ball.pbrt")["schema"], 1);
}

#[test]
fn the_report_places_findings_and_counts_them() {
    let room = Room::new();
    room.put("ball.pbrt", &ball_without_its_mesh());
    let report = room.report("ball.pbrt");
    let finding = &report["findings"][0];
    assert_eq!(finding["severity"], "error");
    assert_eq!(finding["code"], "missing-file");
    assert_eq!(finding["file"], "ball.pbrt");
    assert_eq!(
        (&finding["line"], &finding["column"]),
        (&10.into(), &35.into())
    );
    assert_eq!(
        report["counts"],
        serde_json::json!({"fatal": 0, "errors": 1, "warnings": 0})
    );
    assert_eq!(report["outcome"], "substituted");
}

#[test]
fn the_report_adds_up() {
    let report = Room::new().report("--spp 64 ball.pbrt");
    let seconds = |name: &str| report["seconds"][name].as_f64().expect("a number");
    let phases = ["parse", "describe", "compile", "render", "write"].map(seconds);
    assert!(phases.iter().all(|seconds| *seconds > 0.0));
    assert!(phases.iter().sum::<f64>() <= seconds("wall"));
    assert!(seconds("cpu") > 0.0);
    assert!(report["peak_memory_bytes"].as_u64() > Some(1 << 20));
    let render = &report["pictures"][0]["render"];
    assert!(render["rays"].as_u64() >= render["samples"].as_u64());
    assert_eq!(
        report["pictures"][0]["job"]["skipped"]["materials"], 1,
        "the default matte"
    );
}

#[test]
fn the_report_is_written_whatever_happens() {
    let room = Room::new();
    assert_eq!(room.report("gone.pbrt")["outcome"], "failed");
    room.run("--json r.json gone.pbrt").ends_with(1);
    assert_eq!(room.list(), ["ball.pbrt", "r.json"]);
    let run = room.run("--json no/r.json ball.pbrt").ends_with(1);
    run.says("cannot write \"no/r.json\": there is no directory \"no\"");
    assert!(
        !room.path("ball.exr").exists(),
        "rendered before the report was found impossible"
    );
}

#[test]
fn verbose_says_what_was_built_and_where_the_time_went() {
    let run = Room::new().run("--verbose ball.pbrt").ends_with(0);
    let run = run
        .says("64 x 48 pixels")
        .says("4 samples per pixel, seed 0, integrator \"path\"");
    run.says("1 surface elements")
        .says("samples    12288")
        .says("parse ");
}

// --- the world outside ---

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let room = Room::new();
    // More than a pipe holds.
    room.put("long.pbrt", &"Identity\n".repeat(100_000));
    let mut command = room.command("--cat long.pbrt");
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut line = String::new();
    let mut reader = BufReader::with_capacity(16, child.stdout.take().expect("a pipe"));
    reader.read_line(&mut line).expect("a line");
    drop(reader);
    assert_eq!(line, "Identity\n");
    let output = child.wait_with_output().expect("it ends");
    let run = Run::new(output);
    assert!(
        !run.stderr.contains("panic") && !run.stderr.contains("unwritable"),
        "{}",
        run.stderr
    );
}

#[test]
#[cfg(unix)]
fn a_signal_leaves_a_partial_picture_that_says_so() {
    let room = Room::new();
    let spp = "\"integer pixelsamples\" 100000000";
    room.put("ball.pbrt", &ball("\"integer pixelsamples\" 4", spp));
    for signal in ["INT", "TERM"] {
        let mut child = room
            .command("--verbose --json r.json ball.pbrt")
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
        let mut line = String::new();
        while !line.starts_with("  frame ") {
            line.clear();
            assert!(
                stderr.read_line(&mut line).expect("text") > 0,
                "it never started to render"
            );
        }
        // Some blocks are to be finished: the picture must hold them.
        std::thread::sleep(std::time::Duration::from_millis(300));
        let kill = Command::new("sh")
            .args(["-c", &format!("kill -{signal} {}", child.id())])
            .status();
        assert!(kill.expect("a shell").success());
        let rest: Vec<String> = stderr.lines().map(|line| line.expect("text")).collect();
        let code = child.wait().expect("it ends").code();
        assert_eq!(code, Some(130), "{rest:#?}");
        assert_eq!(
            rest.last().map(String::as_str),
            Some("tyndall: no findings; interrupted (exit status 130)")
        );
        let why = room.attribute("ball.exr", "tyndall/incomplete");
        assert_eq!(why.as_deref(), Some("interrupted"));
        assert_eq!(room.picture("ball.exr").image.pixel(0, 0), [1.0, 1.0, 1.0]);
        let report: serde_json::Value = serde_json::from_slice(&room.read("r.json")).expect("JSON");
        assert_eq!(report["outcome"], "interrupted");
        assert_eq!(report["pictures"][0]["render"]["interrupted"], true);
    }
}

#[test]
fn no_colours_and_no_bar_where_there_is_no_terminal() {
    let room = Room::new();
    room.put("ball.pbrt", &ball_without_its_mesh());
    let run = room.run("--spp 200 ball.pbrt").ends_with(3);
    assert!(
        !run.stderr.contains('\u{1b}') && !run.stderr.contains("samples/s"),
        "{}",
        run.stderr
    );
}
