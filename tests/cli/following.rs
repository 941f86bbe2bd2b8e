//! One path, taken again: `--pixel` and `--sample`.

use crate::room::{Room, ball};

/// A foggy ball in a box of fog, with a lamp of each kind of origin.
const FOG: &str = include_str!("fog.pbrt");

/// The three numbers behind a word at the end of a log.
fn radiance(log: &str) -> [f32; 3] {
    let line = log.lines().last().expect("the log is not empty");
    let numbers = line.strip_prefix("radiance [").expect("the last line");
    let (numbers, _) = numbers.split_once(']').expect("a bracket");
    let numbers: Vec<f32> = numbers
        .split(' ')
        .map(|number| number.parse().expect("a number"))
        .collect();
    numbers.try_into().expect("three")
}

/// Sum of everything that was added along a path.
fn added(log: &str) -> [f32; 3] {
    let mut sum = [0f32; 3];
    for line in log.lines() {
        let Some((_, numbers)) = line.split_once(": adds [") else {
            continue;
        };
        let numbers = numbers.trim_end_matches(']').split(' ');
        for (sum, number) in sum.iter_mut().zip(numbers) {
            *sum += number.parse::<f32>().expect("a number");
        }
    }
    sum
}

#[test]
fn a_followed_path_has_the_radiance_of_the_picture_to_the_bit() {
    let room = Room::new();
    room.put("fog.pbrt", FOG);
    for (scene, spp) in [("ball", 1), ("fog", 1)] {
        let options = format!("--spp {spp} --seed 7 {scene}.pbrt");
        room.run(&options).ends_with(0).says("wrote");
        let picture = room.picture(&format!("{scene}.exr")).image;
        let mut n_lit = 0;
        for [x, y] in [[0, 0], [5, 4], [8, 8], [9, 3], [12, 12]] {
            let run = room.run(&format!("{options} --pixel {x},{y}")).ends_with(0);
            let (found, sum) = (radiance(&run.stdout), added(&run.stdout));
            assert_eq!(picture.pixel(x, y), found, "{scene}: {}", run.stdout);
            assert_eq!(found, sum, "{scene}: {}", run.stdout);
            n_lit += usize::from(found[0] > 0.0);
        }
        assert!(n_lit >= 2, "{scene} is black");
    }
}

#[test]
fn a_log_names_media_and_shows_every_kind_of_event() {
    let room = Room::new();
    room.put("fog.pbrt", FOG);
    let mut log = String::new();
    for i in 0..64 {
        let line = format!("fog.pbrt --pixel {},8 --sample {}", i % 16, i / 16);
        log += &room.run(&line).ends_with(0).stdout;
    }
    for words in [
        "ray from (",
        "in vacuum, throughput [1 1 1]",
        "in \"fog\"",
        "meets element",
        "no material",
        "crosses into \"fog\"",
        "collides with the medium",
        "scatters toward",
        "samples light",
        "finds light from infinity",
        "reflects toward",
        "leaves the scene",
        "ends: ",
    ] {
        assert!(log.contains(words), "no {words:?} in:\n{log}");
    }
}

#[test]
fn a_log_tells_all_ways_of_a_split_path() {
    let room = Room::new();
    let bright = "Material \"matte\" \"rgb Kd\" [0.5 0.5 0.5] Shape \"sphere\" \"float radius\" 0.5\n\
                  Material \"matte\" \"rgb Kd\" [9 9 9] Shape \"sphere\" \"float radius\" 9\n";
    let scene = ball("WorldEnd", &format!("{bright}WorldEnd"));
    room.put("bright.pbrt", &scene);
    let options = "--spp 1 bright.pbrt";
    room.run(options).ends_with(0);
    let picture = room.picture("ball.exr").image;
    let mut log = String::new();
    for x in 0..64 {
        let run = room.run(&format!("{options} --pixel {x},24")).ends_with(0);
        assert_eq!(
            picture.pixel(x, 24),
            radiance(&run.stdout),
            "{}",
            run.stdout
        );
        log += &run.stdout;
    }
    assert!(log.contains("ways, one after the other"), "{log}");
    assert!(log.contains("another way from ("), "{log}");
}

#[test]
fn the_command_line_of_a_report_replays_the_bad_sample() {
    let room = Room::new();
    room.put("a b.pbrt", include_str!("lossy.pbrt"));
    let output = room.command("--seed 3 --spp 2").arg("a b.pbrt").output();
    let run = crate::room::Run::new(output.expect("the program starts")).ends_with(4);
    run.says("tyndall --spp 2 --seed 3 'a b.pbrt' --pixel 0,0 --sample 0\n");
    let line = "--spp 2 --seed 3 --pixel 0,0 --sample 0";
    let output = room.command(line).arg("a b.pbrt").output();
    let run = crate::room::Run::new(output.expect("the program starts")).ends_with(4);
    assert!(run.stdout.contains("inf"), "{}", run.stdout);
    assert!(
        run.stdout.contains("the sample is left out"),
        "{}",
        run.stdout
    );
    assert!(!room.path("lossy.exr").exists() || room.read("lossy.exr").len() > 1);
}

#[test]
fn what_cannot_be_followed_is_a_wrong_command_line() {
    let room = Room::new();
    let direct = ball("WorldBegin", "Integrator \"directlighting\"\nWorldBegin");
    room.put("direct.pbrt", &direct);
    room.run("direct.pbrt --pixel 1,1")
        .ends_with(2)
        .says("\"directlighting\" cannot tell what happens along its paths");
    room.run("ball.pbrt --pixel 1,1 --sample 4")
        .ends_with(2)
        .says("there is no sample 4 among 4, counted from 0");
    for pixel in ["64,1", "-1,0", "2147483647,-2147483648"] {
        let run = room.run(&format!("ball.pbrt --pixel {pixel}")).ends_with(2);
        let run = run.says("counts in a frame of 64 x 48");
        assert!(
            !run.stderr.contains("-->"),
            "the scene is innocent: {}",
            run.stderr
        );
    }
    for line in [
        "ball.pbrt --pixel 1",
        "ball.pbrt --sample 1",
        "ball.pbrt --check --pixel 1,1",
        "check ball.pbrt --pixel 1,1",
        "ball.pbrt --json - --pixel 1,1",
    ] {
        room.run(line).ends_with(2);
    }
    assert!(!room.path("ball.exr").exists(), "nothing is rendered");
}

/// Built only to be stopped: `cargo test --features nan-trap --test cli`.
#[cfg(feature = "nan-trap")]
#[test]
fn the_trap_stops_at_the_first_bad_sample() {
    let room = Room::new();
    let large = include_str!("lossy.pbrt").replace("resolution\" 8", "resolution\" 512");
    room.put("lossy.pbrt", &large);
    let report = room.report("--nthreads 1 lossy.pbrt");
    let render = &report["pictures"][0]["render"];
    assert_eq!(report["exit_code"], 4);
    assert_eq!(render["interrupted"], true);
    assert!(render["samples"].as_u64() <= Some(1024), "{render}");
}
