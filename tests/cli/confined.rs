//! Files that are read and must not be written over, files that are no files, and where anything may be at all.

#![cfg(unix)]

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::time::{Duration, Instant};

use tyndall::image::Image;
use tyndall::image::codec::{ImageFile, Precision, encode};

use crate::room::{Room, ball};

/// A room with a file of every kind that a scene reads.
fn furnished() -> Room {
    let room = Room::new();
    let image = Image::new(2, 2, 3, vec![1.0; 12]).expect("4 pixels");
    let sky = encode(&ImageFile::new(image), "exr", Precision::Float).expect("a picture");
    fs::write(room.path("sky.exr"), sky).expect("a file");
    room.put("inc.pbrt", "Shape \"sphere\"\n");
    room.put("mesh.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 9\n1 0 9\n0 1 9\n3 0 1 2\n");
    room.put("eta.spd", "400 1.5\n700 1.5\n");
    room.put("lens.dat", "35.98738 1.21638 1.54 23.716\n11.69718 9.9957 1 17.996\n13.08714 5.12622 1.77 12.364\n-22.63294 1.76924 1.617 9.812\n71.05802 0.8184 1 9.152\n0 2.27766 0 8.756\n-9.58584 2.43254 1.617 8.184\n-11.28864 0.11506 1 9.152\n-166.7765 3.09606 1.713 10.648\n-7.5911 1.32682 1.805 11.44\n-16.7662 3.98068 1 12.276\n-7.70286 1.21638 1.617 13.42\n-11.97328 0 1 17.996\n");
    let scene = ball(
        "Shape \"sphere\"",
        "Include \"inc.pbrt\"\nShape \"plymesh\" \"string filename\" \"mesh.ply\"\n\
         Material \"metal\" \"spectrum eta\" \"eta.spd\"\nShape \"sphere\" \"float radius\" .1",
    );
    let scene = scene.replace("\"rgb L\" [1 1 1]", "\"string mapname\" \"sky.exr\"");
    let lens = "Camera \"realistic\" \"string lensfile\" \"lens.dat\" #";
    room.put("scene.pbrt", &scene.replace("Camera \"perspective\"", lens));
    room
}

/// Everything in a room but the scenes, to be compared.
fn contents(room: &Room) -> Vec<(String, Vec<u8>)> {
    let names = room
        .list()
        .into_iter()
        .filter(|name| room.path(name).is_file());
    names.map(|name| (name.clone(), room.read(&name))).collect()
}

const INPUTS: [&str; 6] = [
    "scene.pbrt",
    "inc.pbrt",
    "sky.exr",
    "mesh.ply",
    "eta.spd",
    "lens.dat",
];

#[test]
fn no_report_replaces_what_a_scene_reads() {
    let room = furnished();
    room.run("--quick scene.pbrt --outfile o.exr --quiet")
        .ends_with(0);
    for input in INPUTS {
        fs::hard_link(room.path(input), room.path("hard")).expect("a link");
        symlink(input, room.path("soft")).expect("a link");
        room.put("deep/x", "");
        let before = contents(&room);
        for name in [input, &format!("./deep/../{input}"), "hard", "soft"] {
            for command in ["", "check "] {
                let line = format!("{command}--quick scene.pbrt --outfile o.exr --json {name}");
                let run = room.run(&line);
                let expected = if input == "scene.pbrt" { 2 } else { 1 };
                let run = run.ends_with(expected);
                if expected == 1 {
                    run.says(&format!("cannot write \"{name}\": it is read as"))
                        .says(input);
                }
                assert!(contents(&room) == before, "{line}");
            }
        }
        fs::remove_file(room.path("hard")).expect("a link");
        fs::remove_file(room.path("soft")).expect("a link");
    }
}

#[test]
fn no_picture_replaces_what_a_scene_reads() {
    let room = furnished();
    for input in INPUTS {
        for (make, name) in [("hard", "hard.exr"), ("soft", "soft.exr")] {
            match make {
                "hard" => fs::hard_link(room.path(input), room.path(name)).expect("a link"),
                _ => symlink(input, room.path(name)).expect("a link"),
            }
            let before = contents(&room);
            let run = room
                .run(&format!("--quick scene.pbrt --outfile {name}"))
                .ends_with(1);
            run.says(&format!("cannot write \"{name}\": it is read as"))
                .says(input);
            let film = room.read("scene.pbrt");
            let film = String::from_utf8(film)
                .expect("text")
                .replace("ball.exr", name);
            room.put("film.pbrt", &film);
            if input != "scene.pbrt" {
                room.run("--quick film.pbrt")
                    .ends_with(1)
                    .says(" --> film.pbrt:4:82\n");
            }
            fs::remove_file(room.path("film.pbrt")).expect("a file");
            assert!(contents(&room) == before, "{name} for {input}");
            fs::remove_file(room.path(name)).expect("a link");
        }
    }
}

#[test]
fn no_picture_replaces_what_a_later_one_reads() {
    let room = furnished();
    let first = ball("ball.exr", "sky.exr");
    let second = String::from_utf8(room.read("scene.pbrt")).expect("text");
    room.put("two.pbrt", &format!("{first}\n{second}"));
    let before = contents(&room);
    room.run("--quick two.pbrt")
        .ends_with(1)
        .says("cannot write \"sky.exr\": it is read as");
    fs::remove_file(room.path("ball.exr")).expect("the other picture");
    assert!(contents(&room) == before);
}

#[test]
fn standard_streams_are_files_like_others() {
    let room = Room::new();
    let program = env!("CARGO_BIN_EXE_tyndall");
    let before = room.read("ball.pbrt");
    for line in [
        "cat ball.pbrt >> ball.pbrt",
        "check --json - ball.pbrt >> ball.pbrt",
        "check --json ball.pbrt < ball.pbrt",
    ] {
        let line = format!("'{program}' {line}");
        let output = std::process::Command::new("sh")
            .args(["-c", &line])
            .current_dir(room.path("."))
            .output();
        let run = crate::room::Run::new(output.expect("a shell")).ends_with(1);
        run.says("it is read as \"");
        assert_eq!(room.read("ball.pbrt"), before, "{line}");
    }
}

#[test]
fn links_to_nothing_yet_are_followed_and_loops_refused() {
    let room = Room::new();
    room.put("far/x", "");
    symlink("far/target.exr", room.path("near.exr")).expect("a link");
    symlink("near.exr", room.path("nearer.exr")).expect("a link");
    room.run("--quick --quiet ball.pbrt --outfile nearer.exr")
        .ends_with(0);
    for link in ["near.exr", "nearer.exr"] {
        let metadata = fs::symlink_metadata(room.path(link)).expect("it is there");
        assert!(metadata.is_symlink(), "{link}");
    }
    assert_eq!(room.picture("far/target.exr").image.width(), 16);
    symlink("b.exr", room.path("a.exr")).expect("a link");
    symlink("a.exr", room.path("b.exr")).expect("a link");
    room.run("--quick ball.pbrt --outfile a.exr")
        .ends_with(1)
        .says("cannot write \"a.exr\": its links lead in circles");
    symlink("no/where.exr", room.path("c.exr")).expect("a link");
    room.run("--quick ball.pbrt --outfile c.exr")
        .ends_with(1)
        .says("there is no directory \"no\"");
}

#[test]
fn permissions_are_kept_and_protected_files_refused() {
    let room = Room::new();
    let set = |name: &str, mode| {
        let permissions = fs::Permissions::from_mode(mode);
        fs::set_permissions(room.path(name), permissions).expect("it is ours");
    };
    for mode in [0o600, 0o640, 0o666] {
        for (name, option) in [("p.exr", "--outfile"), ("r.json", "--json")] {
            room.put(name, "old");
            set(name, mode);
            room.run(&format!("--quick --quiet ball.pbrt {option} {name}"))
                .ends_with(0);
            assert_ne!(room.read(name), b"old");
            let metadata = fs::metadata(room.path(name)).expect("a file");
            assert_eq!(metadata.permissions().mode() & 0o7777, mode, "{name}");
        }
    }
    fs::remove_file(room.path("ball.exr")).expect("a picture");
    room.put("p.exr", "old");
    set("p.exr", 0o444);
    room.run("--quick ball.pbrt --outfile p.exr")
        .ends_with(1)
        .says("cannot write \"p.exr\": it is write-protected");
    set("r.json", 0o400);
    room.run("--quick ball.pbrt --json r.json")
        .ends_with(1)
        .says("write-protected");
    assert_eq!(room.read("p.exr"), b"old");
    assert!(!room.path("ball.exr").exists());
}

#[test]
fn a_file_beyond_the_size_limit_is_an_error_and_no_crash() {
    let room = Room::new();
    room.put("ball.exr", "the old picture");
    let program = env!("CARGO_BIN_EXE_tyndall");
    for line in [
        "ball.pbrt",
        "--quick ball.pbrt --outfile q.pfm --json r.json",
    ] {
        let line = format!("ulimit -f 1; '{program}' {line}");
        let output = std::process::Command::new("sh")
            .args(["-c", &line])
            .current_dir(room.path("."))
            .output();
        let run = crate::room::Run::new(output.expect("a shell")).ends_with(1);
        run.says("File too large");
    }
    assert_eq!(room.read("ball.exr"), b"the old picture");
    assert_eq!(room.list(), ["ball.exr", "ball.pbrt"]);
}

#[test]
#[cfg(target_os = "linux")]
fn files_that_the_system_makes_up_are_not_waited_for() {
    let room = Room::new();
    symlink("/proc/kmsg", room.path("kmsg.pbrt")).expect("a link");
    let mut paths = vec!["/proc/kmsg", "/proc/self/maps", "kmsg.pbrt"];
    paths.extend(
        ["/sys/kernel/mm/transparent_hugepage/enabled"]
            .iter()
            .filter(|path| fs::metadata(path).is_ok()),
    );
    for path in paths {
        let scene = ball("WorldEnd", &format!("Include \"{path}\"\nWorldEnd"));
        room.put("ball.pbrt", &scene);
        let start = Instant::now();
        room.run("check ball.pbrt")
            .ends_with(3)
            .says("it is made by the system");
        let mesh = format!("Shape \"plymesh\" \"string filename\" \"{path}\"\nWorldEnd");
        room.put("ball.pbrt", &ball("WorldEnd", &mesh));
        room.run("check ball.pbrt")
            .ends_with(3)
            .says("it is made by the system");
        room.run(&format!("check {path}"))
            .ends_with(1)
            .says("it is made by the system");
        assert!(start.elapsed() < Duration::from_secs(10), "{path}");
    }
}

#[test]
fn nothing_outside_of_a_directory_is_read_or_written() {
    let room = Room::new();
    room.put("secret.pbrt", "Shape \"sphere\" # the secret\n");
    room.put("secret.ply", "ply of the secret");
    room.put("in/ball.pbrt", &ball("ball.exr", "in/ball.exr"));
    symlink("../secret.ply", room.path("in/link.ply")).expect("a link");
    symlink("..", room.path("in/up")).expect("a link");
    symlink("../made.exr", room.path("in/made.exr")).expect("a link");
    room.run("--confine in --quiet in/ball.pbrt --json in/r.json")
        .ends_with(0);
    assert!(room.path("in/ball.exr").exists());
    let secret = room.path("secret.pbrt");
    for path in [
        "../secret.pbrt",
        "up/secret.pbrt",
        "../gone.pbrt",
        &secret.display().to_string(),
    ] {
        let scene = ball("WorldEnd", &format!("Include \"{path}\"\nWorldEnd"));
        room.put("in/bad.pbrt", &scene);
        for command in ["check", "cat"] {
            let run = room
                .run(&format!("{command} --confine in in/bad.pbrt"))
                .ends_with(3);
            let run = run.says("it is outside of \"in\"");
            let said = format!("{}{}", run.stdout, run.stderr);
            assert!(!said.contains("the secret"), "{command}: {said}");
        }
    }
    for path in ["../secret.ply", "link.ply", "up/secret.ply"] {
        let mesh = format!("Shape \"plymesh\" \"string filename\" \"{path}\"\nWorldEnd");
        room.put("in/bad.pbrt", &ball("WorldEnd", &mesh));
        room.run("check --confine in in/bad.pbrt")
            .ends_with(3)
            .says("it is outside of \"in\"");
    }
    for line in [
        "--confine in in/ball.pbrt --outfile out.exr",
        "--confine in in/ball.pbrt --outfile in/../out.exr",
        "--confine in in/ball.pbrt --outfile in/up/out.exr",
        "--confine in in/ball.pbrt --outfile in/made.exr",
        "--confine in in/ball.pbrt --json r.json",
        "--confine in ball.pbrt",
        "--confine in secret.pbrt",
        "cat --confine in secret.pbrt",
        "check --confine in secret.pbrt",
    ] {
        room.run(line).ends_with(1).says("it is outside of \"in\"");
    }
    room.put("in/film.pbrt", &ball("ball.exr", "elsewhere.exr"));
    room.run("--confine in in/film.pbrt")
        .ends_with(1)
        .says("it is outside of \"in\"");
    room.run("compare in/ball.exr in/ball.exr --confine in --quiet")
        .ends_with(0);
    room.run("compare in/ball.exr in/ball.exr --confine in --map m.png")
        .ends_with(3)
        .says("outside");
    room.run("compare in/ball.exr ball.exr --confine in")
        .ends_with(3)
        .says("outside");
    room.run("--confine gone in/ball.pbrt")
        .ends_with(2)
        .says("cannot confine to \"gone\"");
    assert_eq!(
        room.list(),
        ["ball.pbrt", "in", "secret.pbrt", "secret.ply"]
    );
}

#[test]
fn files_that_are_no_scenes_are_not_printed() {
    let room = Room::new();
    room.put("passwd", "root:x:0:0:root:/root:/bin/bash\nmail:x:8:8:mail:/var/mail:/nologin\nuser:\"x:1:2\nShape \"plymesh\"\nlast:x\n");
    room.put(
        "ball.pbrt",
        &ball("WorldEnd", "Include \"passwd\"\nWorldEnd"),
    );
    for line in [
        "check ball.pbrt",
        "check passwd",
        "--cat ball.pbrt",
        "check ball.pbrt --json -",
    ] {
        let run = room.run(line);
        let said = format!("{}{}", run.stderr, run.stdout);
        assert!(
            !said.contains("mail:") && !said.contains("last:") && !said.contains("1:2"),
            "{line}: {said}"
        );
    }
}
