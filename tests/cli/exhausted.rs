//! Memory that is not there, and files that are longer than any memory.

use std::fs::File;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::room::{BALL, Room, Run, ball};

/// Runs with an address space of so many KiB.
fn run_within(room: &Room, kibibytes: u64, line: &str) -> Run {
    let program = env!("CARGO_BIN_EXE_tyndall");
    // Two threads: stacks take address space, too.
    let line = format!("ulimit -v {kibibytes} && '{program}' --nthreads 2 {line}");
    let output = Command::new("sh")
        .args(["-c", &line])
        .current_dir(room.path("."))
        .output();
    Run::new(output.expect("a shell"))
}

/// Asserts that a run ended as it may where memory is short: with a picture, or with a reason and the old one.
#[track_caller]
fn assert_sound(room: &Room, run: &Run, what: &str) {
    let Run { code, stderr, .. } = run;
    assert!(
        matches!(code, Some(0 | 1 | 3)) && !stderr.contains("panicked"),
        "{what}: {code:?}\n{stderr}"
    );
    if *code != Some(1) {
        assert_eq!(room.picture("ball.exr").image.width(), 64, "{what}");
    } else {
        assert_eq!(room.read("ball.exr"), b"the old picture", "{what}");
        let is_named = ["memory", "threads", "too-large"]
            .iter()
            .any(|word| stderr.contains(word));
        assert!(is_named, "{what}: {stderr}");
    }
    assert_eq!(room.list(), ["ball.exr", "ball.pbrt"], "{what}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_program_without_memory_fails_with_a_reason_and_leaves_the_old_picture() {
    let room = Room::new();
    let least = (10..)
        .map(|k| 1000 << k >> 8)
        .find(|&kibibytes| run_within(&room, kibibytes, "--version").code == Some(0));
    let mut kibibytes = least.expect("some memory is enough to start");
    let mut n_failed = 0;
    loop {
        room.put("ball.exr", "the old picture");
        let run = run_within(&room, kibibytes, "ball.pbrt");
        assert_sound(&room, &run, &format!("{kibibytes} KiB"));
        if run.code == Some(0) {
            break;
        }
        n_failed += 1;
        kibibytes += kibibytes / 16 + 1;
    }
    assert!(n_failed > 0, "the least memory was enough");
}

#[cfg(target_os = "linux")]
#[test]
fn scenes_that_need_more_memory_than_there_is_fail_with_a_reason() {
    let room = Room::new();
    let film = "\"integer xresolution\" 64 \"integer yresolution\" 48";
    let gigapixels = "\"integer xresolution\" 32768 \"integer yresolution\" 32768";
    let mesh = "Shape \"loopsubdiv\" \"integer levels\" 12 \"integer indices\" [0 1 2] \
                \"point P\" [0 0 0 1 0 0 0 1 0]";
    let medium = format!(
        "MakeNamedMedium \"smoke\" \"string type\" \"heterogeneous\" \"integer nx\" 100 \"integer ny\" 100 \
         \"integer nz\" 400 \"float density\" [{}]\nMediumInterface \"smoke\" \"\" Shape \"sphere\"",
        "1 ".repeat(4_000_000)
    );
    // A shape without room is left out; without the others there is no picture.
    for (what, code, scene) in [
        ("a film", 1, ball(film, gigapixels)),
        ("a mesh", 3, ball("Shape \"sphere\"", mesh)),
        (
            "a grid",
            1,
            ball("Shape \"sphere\"", &medium)
                .replace("WorldBegin", "Integrator \"volpath\" WorldBegin"),
        ),
    ] {
        room.put("ball.pbrt", &scene);
        room.put("ball.exr", "the old picture");
        let run = run_within(&room, 40_000, "ball.pbrt");
        assert_eq!(run.code, Some(code), "{what}: {}", run.stderr);
        assert_sound(&room, &run, what);
    }
}

/// Makes a file that is all hole.
fn hollow(room: &Room, name: &str, length: u64) {
    let file = File::create(room.path(name)).expect("a file");
    file.set_len(length).expect("a file system with holes");
}

#[cfg(target_os = "linux")]
#[test]
fn files_longer_than_memory_are_refused_before_they_are_read() {
    let room = Room::new();
    let quickly = |line: &str| {
        let started = Instant::now();
        let run = room.run(line);
        let spent = started.elapsed();
        assert!(spent < Duration::from_secs(10), "{line}: {spent:?}");
        run
    };
    const TERABYTE: u64 = 1 << 40;
    let told = "it is 1048576 MiB long: there is not so much memory";
    hollow(&room, "long.pbrt", TERABYTE);
    let run = quickly("long.pbrt").ends_with(1);
    run.says("cannot read \"long.pbrt\": it is 1048576 MiB long: a scene file may have 4 GiB");
    room.put(
        "ball.pbrt",
        &ball("WorldEnd", "Include \"long.pbrt\"\nWorldEnd"),
    );
    quickly("ball.pbrt")
        .says(" --> ball.pbrt:10:1\n")
        .says("4 GiB");
    let sky = |name: &str| format!("LightSource \"infinite\" \"string mapname\" \"{name}\"");
    let mesh = |name: &str| format!("Shape \"plymesh\" \"string filename\" \"{name}\"");
    let metal =
        |name: &str| format!("Material \"metal\" \"spectrum eta\" \"{name}\" Shape \"sphere\"");
    let table = |name: &str| {
        format!("Material \"fourier\" \"string bsdffile\" \"{name}\" Shape \"sphere\"")
    };
    for (name, what) in [
        ("long.exr", &sky as &dyn Fn(&str) -> String),
        ("long.png", &sky),
        ("long.tga", &sky),
        ("long.pfm", &sky),
        ("long.hdr", &sky),
        ("long.jpg", &sky),
        ("long.ply", &mesh),
        ("long.spd", &metal),
        ("long.bsdf", &table),
    ] {
        hollow(&room, name, TERABYTE);
        room.put(
            "ball.pbrt",
            &ball("WorldEnd", &format!("{}\nWorldEnd", what(name))),
        );
        let run = quickly("ball.pbrt").ends_with(3);
        run.says(told).says(" --> ball.pbrt:10:");
    }
    let lens = "Camera \"realistic\" \"string lensfile\" \"long.dat\" #";
    hollow(&room, "long.dat", TERABYTE);
    room.put("ball.pbrt", &BALL.replace("Camera \"perspective\"", lens));
    quickly("ball.pbrt").ends_with(1).says(told);
    hollow(&room, "long.png", TERABYTE);
    quickly("compare long.png long.png").says(told);
}

#[cfg(target_os = "linux")]
#[test]
fn pictures_that_fit_in_memory_as_files_but_not_as_pixels_are_no_crash() {
    let room = Room::new();
    const HEADER: &[u8] = b"PF\n8192 4096\n-1.0\n";
    let length = HEADER.len() as u64 + 8192 * 4096 * 12;
    hollow(&room, "sky.pfm", length);
    let mut header = File::options()
        .write(true)
        .open(room.path("sky.pfm"))
        .expect("the file");
    std::io::Write::write_all(&mut header, HEADER).expect("a header");
    let sky = "LightSource \"infinite\" \"string mapname\" \"sky.pfm\"\nWorldEnd";
    room.put("ball.pbrt", &ball("WorldEnd", sky));
    // Room for the file, not for the pixels.
    let run = run_within(&room, 700_000, "ball.pbrt").ends_with(3);
    run.says("8192x4096 pixels take 384 MiB of memory, more than the");
}
