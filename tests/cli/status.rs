//! Findings on standard error, and the exit status.

use crate::room::{Room, ball, ball_without_its_mesh};

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
    let film = "\"float cropwindow\" [0 1 0 1] \"string filename\"";
    room.put("ball.pbrt", &ball("\"string filename\"", film));
    let run = room
        .run("--strict --cropwindow 0 1 0 .5 ball.pbrt")
        .ends_with(0);
    run.says("warning[cropwindow-overridden]");
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
fn many_findings_of_one_kind_are_cut_on_the_screen() {
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
        (".", "cannot read \".\": it is not a regular file"),
        ("ball.pbrt gone.pbrt", "cannot read \"gone.pbrt\""),
    ] {
        room.run(line).ends_with(1).says(why);
    }
    assert_eq!(room.list(), before);
}

#[cfg(unix)]
#[test]
fn devices_pipes_and_directories_are_refused_wherever_a_file_is_named() {
    use std::os::unix::fs::symlink;
    use std::process::Command;

    let room = Room::new();
    let pipe = room.path("pipe");
    let made = Command::new("mkfifo").arg(&pipe).status();
    assert!(made.is_ok_and(|status| status.success()), "no pipe");
    symlink("/dev/zero", room.path("link")).expect("a link");
    symlink("ring", room.path("ring")).expect("a link");
    // Readers of pictures and meshes go by the name.
    for extension in ["png", "ply"] {
        symlink("/dev/zero", room.path(&format!("link.{extension}"))).expect("a link");
        symlink("pipe", room.path(&format!("pipe.{extension}"))).expect("a link");
    }
    let refusal = "it is not a regular file";
    for name in ["/dev/zero", ".", "pipe", "link"] {
        room.run(name).ends_with(1).says(refusal);
        let include = format!("Include \"{name}\"\nWorldEnd");
        room.put("ball.pbrt", &ball("WorldEnd", &include));
        room.run("ball.pbrt").says("ball.pbrt:").says(refusal);
    }
    room.run("ring").ends_with(1).says("links lead in circles");
    for name in ["/dev/zero", ".", "pipe.ply", "link.ply"] {
        let mesh = format!("Shape \"plymesh\" \"string filename\" \"{name}\"\nWorldEnd");
        room.put("ball.pbrt", &ball("WorldEnd", &mesh));
        room.run("ball.pbrt").ends_with(3).says(refusal);
    }
    for name in ["/dev/zero", ".", "pipe.png", "link.png"] {
        let sky = format!("LightSource \"infinite\" \"string mapname\" \"{name}\"\nWorldEnd");
        room.put("ball.pbrt", &ball("WorldEnd", &sky));
        room.run("ball.pbrt").ends_with(3).says(refusal);
    }
}

#[test]
fn pictures_beyond_the_machine_are_refused_with_the_memory_they_need() {
    let room = Room::new();
    let size = "\"integer xresolution\" 2000000000 \"integer yresolution\" 2000000000";
    let film = "\"integer xresolution\" 64 \"integer yresolution\" 48";
    room.put("ball.pbrt", &ball(film, size));
    let run = room.run("ball.pbrt").ends_with(1);
    run.says("it would take 160000000000 GB");
}

#[test]
fn what_an_integrator_keeps_counts_as_memory_of_the_picture() {
    let room = Room::new();
    let film = "\"integer xresolution\" 64 \"integer yresolution\" 48";
    let large = "\"integer xresolution\" 8192 \"integer yresolution\" 8192";
    // A chain is kept until it ends.
    let mlt = "Integrator \"mlt\" \"integer chains\" 1 \"integer mutationsperpixel\" 1000000";
    for (n_chains, code) in [("1", 1), ("100000000", 0)] {
        let mlt = mlt.replace("chains\" 1", &format!("chains\" {n_chains}"));
        let scene = ball(film, large).replace("WorldBegin", &format!("{mlt}\nWorldBegin"));
        room.put("ball.pbrt", &scene);
        let run = room.run("check ball.pbrt").ends_with(code);
        if code == 1 {
            run.says("fatal[too-large]: a picture of 8192 x 8192 pixels by \"mlt\" needs");
        }
    }
}

#[test]
fn bad_samples_are_reported_and_change_the_exit_status() {
    let room = Room::new();
    room.put("lossy.pbrt", include_str!("lossy.pbrt"));
    let run = room.run("--json lossy.json lossy.pbrt").ends_with(4);
    run.says(
        "error[bad-samples]: 256 of 256 samples of lossy.exr are not finite or negative and were left \
         out; the first is sample 0 of pixel (0, 0)\n",
    )
    .says("to see how it comes about: tyndall lossy.pbrt --pixel 0,0 --sample 0\n")
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
