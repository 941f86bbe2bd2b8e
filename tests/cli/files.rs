//! The files that are written.

use std::process::Command;

use crate::room::{BALL, Room, Run, ball};

#[test]
fn outfile_replaces_the_films_filename_without_a_word() {
    let room = Room::new();
    let run = room
        .run("--strict --outfile other.pfm ball.pbrt")
        .ends_with(0);
    assert!(run.stderr.starts_with("wrote other.pfm"), "{}", run.stderr);
    assert_eq!(run.stderr.lines().count(), 1);
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

#[test]
fn reports_replace_neither_the_scene_nor_a_picture() {
    let room = Room::new();
    let scene = room.read("ball.pbrt");
    room.run("--quiet --json ball.pbrt --outfile a.pfm ball.pbrt")
        .ends_with(2)
        .says("--json would replace the scene");
    room.run("--quiet --json ./same.exr --outfile same.exr ball.pbrt")
        .ends_with(2)
        .says("--json and --outfile name one file");
    room.run("--quiet --json ball.exr ball.pbrt")
        .ends_with(1)
        .says("cannot write \"ball.exr\": --json puts the report there");
    assert_eq!(room.read("ball.pbrt"), scene);
    room.run("--quiet --outfile a.pfm ball.pbrt").ends_with(0);
    let picture = room.read("a.pfm");
    for (options, why) in [
        ("--json a.pfm", "--json would replace a picture"),
        ("--json b.png --map b.png", "--json and --map name one file"),
    ] {
        room.run(&format!("compare a.pfm a.pfm {options}"))
            .ends_with(3)
            .says(why);
    }
    assert_eq!(room.read("a.pfm"), picture);
}
