//! Signals, pipes and terminals.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

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

/// Renders `ball.pbrt` until a signal comes, shortly after it has started, and asserts that what it leaves says so.
#[cfg(unix)]
#[track_caller]
fn interrupt(room: &Room, signal: &str) {
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
    let report: serde_json::Value = serde_json::from_slice(&room.read("r.json")).expect("JSON");
    assert_eq!(report["outcome"], "interrupted");
    assert_eq!(report["pictures"][0]["render"]["interrupted"], true);
}

#[test]
#[cfg(unix)]
fn a_signal_leaves_a_partial_picture_that_says_so() {
    let room = Room::new();
    let spp = "\"integer pixelsamples\" 100000000";
    room.put("ball.pbrt", &ball("\"integer pixelsamples\" 4", spp));
    for signal in ["INT", "TERM"] {
        interrupt(&room, signal);
        assert_eq!(room.picture("ball.exr").image.pixel(0, 0), [1.0, 1.0, 1.0]);
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
        let picture = room.picture("ball.exr").image;
        assert_eq!((picture.width(), picture.height()), (64, 48));
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
