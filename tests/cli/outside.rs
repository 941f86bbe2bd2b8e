//! Signals, pipes and terminals.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::time::Duration;

use crate::room::{Room, Run, ball, ball_without_its_mesh};

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

/// Starts the program and waits until it renders.
#[cfg(unix)]
#[track_caller]
fn start(room: &Room, line: &str) -> (Child, BufReader<ChildStderr>) {
    let mut child = room
        .command(line)
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
    (child, stderr)
}

#[cfg(unix)]
fn send(child: &Child, signals: &[&str]) {
    let id = child.id();
    let lines: Vec<String> = signals
        .iter()
        .map(|signal| format!("kill -{signal} {id}"))
        .collect();
    let kill = Command::new("sh").args(["-c", &lines.join("; ")]).status();
    assert!(kill.expect("a shell").success());
}

/// More than anyone waits for.
#[cfg(unix)]
fn endless() -> String {
    let spp = "\"integer pixelsamples\" 100000000";
    ball("\"integer pixelsamples\" 4", spp)
}

/// Renders `ball.pbrt` until a signal comes, shortly after it has started, and asserts that what it leaves says so.
#[cfg(unix)]
#[track_caller]
fn interrupt(room: &Room, signal: &str) {
    let (mut child, stderr) = start(room, "--verbose --json r.json ball.pbrt");
    // Some blocks are to be finished: the picture must hold them.
    std::thread::sleep(Duration::from_millis(300));
    send(&child, &[signal]);
    let rest: Vec<String> = stderr.lines().map(|line| line.expect("text")).collect();
    let code = child.wait().expect("it ends").code();
    assert_eq!(code, Some(130), "{rest:#?}");
    assert_eq!(
        rest.last().map(String::as_str),
        Some("tyndall: no findings; interrupted (exit status 130)")
    );
    assert!(!room.path("ball.exr").exists(), "it is not finished");
    let why = room.attribute("ball.partial.exr", "tyndall/incomplete");
    assert_eq!(why.as_deref(), Some("interrupted"));
    let report: serde_json::Value = serde_json::from_slice(&room.read("r.json")).expect("JSON");
    assert_eq!(report["outcome"], "interrupted");
    assert_eq!(report["pictures"][0]["render"]["interrupted"], true);
}

#[test]
#[cfg(unix)]
fn a_signal_leaves_a_partial_picture_that_says_so() {
    let room = Room::new();
    room.put("ball.pbrt", &endless());
    for signal in ["INT", "TERM"] {
        interrupt(&room, signal);
        assert_eq!(
            room.picture("ball.partial.exr").image.pixel(0, 0),
            [1.0, 1.0, 1.0]
        );
    }
}

#[test]
#[cfg(unix)]
fn a_signal_stops_metropolis_while_it_looks_for_light_and_in_a_chain() {
    let room = Room::new();
    for parameters in [
        "\"integer bootstrapsamples\" 11000000",
        "\"integer bootstrapsamples\" 100 \"integer chains\" 1 \"integer mutationsperpixel\" 10000",
    ] {
        let mlt = format!("Integrator \"mlt\" {parameters}\nWorldBegin");
        room.put("ball.pbrt", &ball("WorldBegin", &mlt));
        interrupt(&room, "INT");
        let picture = room.picture("ball.partial.exr").image;
        assert_eq!((picture.width(), picture.height()), (64, 48));
    }
}

#[test]
#[cfg(unix)]
fn a_program_that_is_killed_leaves_the_old_picture_and_nothing_else() {
    let room = Room::new();
    room.put("ball.pbrt", &endless());
    room.put("ball.exr", "the old picture");
    let (mut child, _stderr) = start(&room, "--verbose ball.pbrt");
    send(&child, &["KILL"]);
    assert_eq!(child.wait().expect("it ends").code(), None);
    assert_eq!(room.read("ball.exr"), b"the old picture");
    assert_eq!(room.list(), ["ball.exr", "ball.pbrt"]);
}

#[test]
#[cfg(unix)]
fn two_signals_leave_the_old_picture_and_nothing_torn() {
    let room = Room::new();
    room.put("ball.pbrt", &endless());
    for _ in 0..8 {
        room.put("ball.exr", "the old picture");
        let (mut child, stderr) = start(&room, "--verbose ball.pbrt");
        send(&child, &["INT", "TERM"]);
        let rest: Vec<String> = stderr.lines().map(|line| line.expect("text")).collect();
        assert_eq!(
            child.wait().expect("it ends").code(),
            Some(130),
            "{rest:#?}"
        );
        assert_eq!(room.read("ball.exr"), b"the old picture");
        if room.path("ball.partial.exr").exists() {
            let why = room.attribute("ball.partial.exr", "tyndall/incomplete");
            assert_eq!(why.as_deref(), Some("interrupted"));
            std::fs::remove_file(room.path("ball.partial.exr")).expect("a file");
        }
        assert_eq!(room.list(), ["ball.exr", "ball.pbrt"]);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_signal_before_there_is_anything_to_save_ends_the_program() {
    let room = Room::new();
    room.put("ball.exr", "the old picture");
    // It waits for the rest of its scene.
    let mut child = room
        .command("-")
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    const TERM: u32 = 15;
    let listens = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id()));
        let status = status.expect("it runs");
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        let caught = u64::from_str_radix(caught.expect("signals").trim(), 16).expect("a mask");
        caught >> (TERM - 1) & 1 == 1
    };
    while !listens() {
        std::thread::sleep(Duration::from_millis(5));
    }
    // Waiting would close it: that is the end of the scene.
    let _stdin = child.stdin.take();
    send(&child, &["TERM"]);
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert_eq!(room.read("ball.exr"), b"the old picture");
}

#[test]
#[cfg(unix)]
fn a_directory_that_vanishes_while_rendering_is_told() {
    let room = Room::new();
    room.put("out/old.txt", "");
    room.put("ball.pbrt", &endless());
    let (mut child, stderr) = start(&room, "--verbose --outfile out/ball.exr ball.pbrt");
    std::fs::remove_dir_all(room.path("out")).expect("a directory");
    send(&child, &["INT"]);
    let rest: Vec<String> = stderr.lines().map(|line| line.expect("text")).collect();
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    let why = "fatal[unwritable-output]: cannot write \"out/ball.partial.exr\": there is no directory \"out\"";
    assert!(rest.iter().any(|line| line.starts_with(why)), "{rest:#?}");
    assert_eq!(room.list(), ["ball.pbrt"]);
}

#[test]
fn a_file_that_vanishes_between_parsing_and_loading_is_told_at_its_place() {
    let room = Room::new();
    let scene = ball_without_its_mesh();
    room.put("gone.ply", "ply");
    let mut child = room
        .command("-")
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    let (start, end) = scene.split_once("WorldEnd").expect("a world");
    stdin.write_all(start.as_bytes()).expect("it is read");
    std::fs::remove_file(room.path("gone.ply")).expect("a file");
    stdin
        .write_all(format!("WorldEnd{end}").as_bytes())
        .expect("it is read");
    drop(stdin);
    let run = Run::new(child.wait_with_output().expect("it ends")).ends_with(3);
    run.says("error[missing-file]").says(" --> <stdin>:10:35\n");
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_told_wherever_something_is_written() {
    let room = Room::new();
    let full = || {
        File::options()
            .write(true)
            .open("/dev/full")
            .expect("a device")
    };
    let no_space = "No space left on device";
    for line in ["--cat ball.pbrt", "--json - ball.pbrt"] {
        let output = room.command(line).stdout(full()).output();
        let run = Run::new(output.expect("the program starts")).ends_with(1);
        run.says("cannot write to standard output").says(no_space);
    }
    let run = room.run("--json /dev/full ball.pbrt").ends_with(1);
    run.says("cannot write \"/dev/full\"").says(no_space);
    // The picture was written before.
    assert_eq!(room.picture("ball.exr").image.width(), 64);
    std::os::unix::fs::symlink("/dev/full", room.path("full.exr")).expect("a link");
    let run = room.run("--outfile full.exr ball.pbrt").ends_with(1);
    run.says("cannot write \"full.exr\"").says(no_space);
    // Nobody can be told where standard error is full; the picture is there all the same.
    std::fs::remove_file(room.path("ball.exr")).expect("a file");
    let status = room.command("ball.pbrt").stderr(full()).status();
    assert_eq!(status.expect("the program starts").code(), Some(0));
    assert_eq!(room.picture("ball.exr").image.width(), 64);
}

#[test]
#[cfg(target_os = "linux")]
fn a_directory_without_room_for_files_is_told_before_rendering() {
    let room = Room::new();
    // Not even who may do anything makes files there.
    let report = room.report("--outfile /proc/ball.exr ball.pbrt");
    assert_eq!(report["exit_code"], 1);
    assert!(report["pictures"][0]["render"].is_null());
    room.run("--outfile /proc/ball.exr ball.pbrt")
        .ends_with(1)
        .says("fatal[unwritable-output]: cannot write \"/proc/ball.exr\": ");
    room.run("--json /proc/r.json ball.pbrt")
        .ends_with(1)
        .says("fatal: cannot write \"/proc/r.json\": ");
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
