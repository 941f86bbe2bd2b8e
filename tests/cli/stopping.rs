//! Signals at any moment: the program ends within a second, tears nothing, and keeps what is finished.
//!
//! `STOPPING_SIGNALS=200 cargo test --test cli stopping -- --nocapture` sends more of them, and says how it went.

#![cfg(unix)]

use std::fs;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::room::{Room, ball};

/// By then it surely listens, and has read its options.
const SOON: Duration = Duration::from_millis(300);

/// What the program may take to end. The promise is a second; here others want the processors, too.
const PATIENCE: Duration = Duration::from_secs(5);

/// A mirror around the camera, and one within: no path ever ends.
fn mirrors(integrator: &str) -> String {
    format!(
        "LookAt 0 -6 2 0 0 0 0 0 1\nCamera \"perspective\"\n\
         Film \"image\" \"integer xresolution\" 32 \"integer yresolution\" 32 \"string filename\" \"out.exr\"\n\
         Sampler \"02sequence\" \"integer pixelsamples\" 64\nIntegrator {integrator}\nWorldBegin\n\
         LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"mirror\" \"rgb Kr\" [1 1 1]\n\
         Shape \"sphere\" \"float radius\" 50\nShape \"sphere\"\nWorldEnd\n"
    )
}

/// Light that is 1 from everywhere on a mirror ball and a dark one, for longer than anyone waits.
fn endless(integrator: &str) -> String {
    for_long(&ball(
        "WorldBegin",
        &format!("Integrator {integrator}\nWorldBegin"),
    ))
}

/// The same scene with more samples than anyone waits for: it does not end by itself, however fast the machine is.
fn for_long(scene: &str) -> String {
    let (head, rest) = scene
        .split_once("\"integer pixelsamples\" ")
        .expect("a number of samples");
    let (_, rest) = rest.split_once('\n').expect("a line");
    format!("{head}\"integer pixelsamples\" 100000000\n{rest}")
}

fn send(child: &Child, signal: Signal) {
    let id = i32::try_from(child.id()).expect("an id");
    kill(Pid::from_raw(id), signal).expect("it runs");
}

/// Waits, and says how long; kills what does not end.
fn wait(child: &mut Child) -> (Option<i32>, Duration) {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().expect("it is ours") {
            return (status.code(), start.elapsed());
        }
        if start.elapsed() > Duration::from_secs(20) {
            child.kill().expect("it runs");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

const MAX: &str = "\"integer maxdepth\" 2147483647";

/// Scenes that keep every integrator, and every kind of loading, busy.
fn scenes() -> Vec<(&'static str, String)> {
    let mut scenes = Vec::new();
    for name in [
        "path",
        "volpath",
        "whitted",
        "directlighting",
        "sppm",
        "bdpt",
    ] {
        let depth = if name == "bdpt" {
            "\"integer maxdepth\" 1000"
        } else {
            MAX
        };
        scenes.push((name, mirrors(&format!("\"{name}\" {depth}"))));
    }
    for name in [
        "path",
        "volpath",
        "directlighting",
        "ambientocclusion",
        "bdpt",
    ] {
        scenes.push((name, endless(&format!("\"{name}\""))));
    }
    scenes.push((
        "sppm",
        endless("\"sppm\" \"integer iterations\" 100000000 \"float radius\" .1"),
    ));
    scenes.push((
        "mlt, bootstrap",
        endless("\"mlt\" \"integer bootstrapsamples\" 11000000"),
    ));
    let chain = "\"mlt\" \"integer bootstrapsamples\" 100 \"integer chains\" 1 \"integer mutationsperpixel\" 10000";
    scenes.push(("mlt, chain", endless(chain)));
    let training = "\"bdpt\" \"integer maxdepth\" 100";
    let lit = "LightSource \"point\" \"rgb I\" [1 1 1]\nWorldEnd";
    let training = mirrors(training).replace("WorldEnd", lit);
    scenes.push(("bdpt, training", for_long(&training)));
    let mesh = "Shape \"loopsubdiv\" \"integer levels\" 10 \"integer indices\" [0 1 2 0 2 3 0 3 1 1 3 2] \
                \"point P\" [0 0 0 1 0 0 0 1 0 0 0 1]";
    scenes.push(("subdivision", for_long(&ball("Shape \"sphere\"", mesh))));
    let lamps = "AreaLightSource \"diffuse\" ".to_owned() + mesh;
    scenes.push(("light tables", for_long(&ball("Shape \"sphere\"", &lamps))));
    scenes.push((
        "parsing",
        for_long(&ball(
            "Shape \"sphere\"",
            &"Shape \"sphere\"\nIdentity\n".repeat(300_000),
        )),
    ));
    scenes
}

/// Asserts that nothing is torn: the old picture stays, and what is new is whole.
fn assert_sound(room: &Room, what: &str) {
    assert_eq!(room.read("out.exr"), b"the old picture", "{what}");
    for name in room.list() {
        match name.as_str() {
            "out.exr" | "scene.pbrt" | "ball.pbrt" => {}
            "out.partial.exr" => {
                let held = room.attribute(&name, "tyndall/samples-per-pixel");
                let held: f64 = held.expect("a number").parse().expect("a number");
                assert!(held >= 0.0, "{what}: {held}");
                let why = room.attribute(&name, "tyndall/incomplete");
                assert_eq!(why.as_deref(), Some("interrupted"), "{what}");
            }
            "r.json" => {
                let report = serde_json::from_slice::<serde_json::Value>(&room.read(&name));
                let report = report.unwrap_or_else(|error| panic!("{what}: {error}"));
                assert_eq!(report["outcome"], "interrupted", "{what}: {report}");
                assert_eq!(report["exit_code"], 130, "{what}");
            }
            _ => panic!("{what}: {name} was left behind"),
        }
    }
}

#[test]
#[expect(clippy::print_stderr, reason = "how close it was is worth reading")]
fn signals_at_any_moment_end_it_soon_and_tear_nothing() {
    let n_signals: u64 = std::env::var("STOPPING_SIGNALS")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(24);
    let scenes = scenes();
    let (mut slowest, mut n_partial, mut n_late) = (Duration::ZERO, 0, 0);
    // Not random, so that a failure comes again: multiples of the golden ratio.
    for i in 0..n_signals {
        let (name, scene) = &scenes[i as usize % scenes.len()];
        let room = Room::new();
        room.put("scene.pbrt", scene);
        room.put("out.exr", "the old picture");
        let signal = [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP][i as usize % 3];
        // Before the program listens, a signal does what the caller has set, such as nothing behind `nohup`.
        let after =
            SOON + Duration::from_secs_f64((i as f64 * 0.618_033_988_749_895).fract() * 1.5);
        let mut child = room
            .command("scene.pbrt --outfile out.exr --json r.json --quiet")
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        std::thread::sleep(after);
        let what = format!("{i}: {name}, {signal} after {after:?}");
        send(&child, signal);
        let (code, spent) = wait(&mut child);
        assert_eq!(code, Some(130), "{what}");
        slowest = slowest.max(spent);
        n_late += u64::from(spent > Duration::from_secs(1));
        assert!(spent < PATIENCE, "{what}: {spent:?}");
        assert!(room.path("r.json").exists(), "{what}: no report");
        n_partial += u64::from(room.path("out.partial.exr").exists());
        assert_sound(&room, &what);
    }
    eprintln!(
        "{n_signals} signals: {n_late} took more than a second, at most {slowest:?}; 0 torn, {n_partial} partial pictures"
    );
    assert!(
        n_partial * 3 > n_signals,
        "{n_partial} of {n_signals} left a picture"
    );
}

/// Stops a rendering once it has begun.
fn stopped(room: &Room, line: &str) -> (Option<i32>, Duration) {
    let mut child = room
        .command(line)
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_millis(1200));
    send(&child, Signal::SIGTERM);
    wait(&mut child)
}

#[test]
fn endless_paths_are_given_up_and_do_not_count() {
    for name in ["path", "volpath", "whitted", "directlighting", "sppm"] {
        let room = Room::new();
        room.put("scene.pbrt", &mirrors(&format!("\"{name}\" {MAX}")));
        room.put("out.exr", "the old picture");
        let (code, spent) = stopped(&room, "scene.pbrt --nthreads 1");
        assert!(
            code == Some(130) && spent < PATIENCE,
            "{name}: {code:?}, {spent:?}"
        );
        assert_sound(&room, name);
        let held = room.attribute("out.partial.exr", "tyndall/samples-per-pixel");
        assert_eq!(held.as_deref(), Some("0"), "{name}");
        let picture = room.picture("out.partial.exr").image;
        assert!(picture.data().iter().all(|&c| c == 0.0), "{name}");
    }
}

#[test]
fn what_a_partial_picture_holds_has_its_right_weight() {
    for (name, file) in [
        ("path", "out.exr"),
        ("bdpt", "out.exr"),
        ("directlighting", "out.pfm"),
    ] {
        let room = Room::new();
        // A mirror in a sky of 1 sends on 1: what is not 1 was not sampled.
        let scene = endless(&format!("\"{name}\"")).replace(
            "Shape \"sphere\"",
            "Material \"mirror\" \"rgb Kr\" [1 1 1] Shape \"sphere\"",
        );
        room.put("scene.pbrt", &scene);
        let (code, _) = stopped(&room, &format!("scene.pbrt --outfile {file}"));
        assert_eq!(code, Some(130), "{name}");
        let partial = file.replace("out.", "out.partial.");
        let picture = room.picture(&partial).image;
        let n_odd = picture
            .data()
            .iter()
            .filter(|&&c| c != 0.0 && (c - 1.0).abs() > 1e-4)
            .count();
        let n_lit = picture.data().iter().filter(|&&c| c != 0.0).count();
        assert!(n_odd == 0 && n_lit > 0, "{name}: {n_odd} of {n_lit}");
        if file.ends_with("exr") {
            let held = room
                .attribute(&partial, "tyndall/samples-per-pixel")
                .expect("a number");
            assert!(
                held.parse::<f64>().expect("a number") > 0.0,
                "{name}: {held}"
            );
        }
        assert!(!room.path(file).exists(), "{name}");
    }
}

#[test]
fn a_signal_while_loading_ends_it_with_a_report() {
    let room = Room::new();
    room.put("out.exr", "the old picture");
    // The scene never comes to its end.
    let mut child = room
        .command("--json r.json --outfile out.exr -")
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_millis(500));
    send(&child, Signal::SIGINT);
    let stdin = child.stdin.take();
    let (code, spent) = wait(&mut child);
    drop(stdin);
    assert!(code == Some(130) && spent < PATIENCE, "{code:?}, {spent:?}");
    assert!(room.path("r.json").exists());
    assert_sound(&room, "loading");
}

#[test]
fn a_second_signal_ends_it_even_while_a_report_waits() {
    let room = Room::new();
    // A pipe that nobody reads, of a report that does not fit into it.
    let unused: String = (0..20_000)
        .map(|i| format!("Texture \"t{i}\" \"float\" \"constant\"\n"))
        .collect();
    room.put("long.pbrt", &ball("Shape", &format!("{unused}Shape")));
    let mut child = room
        .command("--json - long.pbrt --spp 100000000")
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_millis(1500));
    send(&child, Signal::SIGTERM);
    std::thread::sleep(Duration::from_millis(1000));
    assert!(
        child.try_wait().expect("it is ours").is_none(),
        "the report waits"
    );
    send(&child, Signal::SIGTERM);
    let (code, spent) = wait(&mut child);
    assert!(code == Some(130) && spent < PATIENCE, "{code:?}, {spent:?}");
    let left: Vec<String> = room
        .list()
        .into_iter()
        .filter(|name| name.starts_with(".tyndall"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn strategies_and_links_get_partial_names_too() {
    let room = Room::new();
    let scene = endless("\"bdpt\" \"integer maxdepth\" 1 \"bool visualizestrategies\" \"true\"");
    room.put("scene.pbrt", &scene);
    room.put("far/x", "");
    std::os::unix::fs::symlink("far/target.exr", room.path("out.exr")).expect("a link");
    let (code, _) = stopped(&room, "scene.pbrt --outfile out.exr");
    assert_eq!(code, Some(130));
    let far: Vec<String> = fs::read_dir(room.path("far"))
        .expect("a directory")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .into_string()
                .expect("text")
        })
        .collect();
    assert!(far.contains(&"target.partial.exr".to_owned()), "{far:?}");
    let list = room.list();
    let strategies: Vec<&String> = list
        .iter()
        .filter(|name| name.starts_with("bdpt_"))
        .collect();
    assert!(
        !strategies.is_empty() && strategies.iter().all(|name| name.ends_with(".partial.exr")),
        "{list:?}"
    );
}
