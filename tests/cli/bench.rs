//! `tyndall bench`: suites, peers, figures and what they are taken to mean.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::room::{Room, Run, ball};

/// Independent samples, so that the slope is known.
fn noisy_ball(albedo: f64) -> String {
    let sampler = "Sampler \"random\" \"integer pixelsamples\" 4";
    let scene = ball("Sampler \"halton\" \"integer pixelsamples\" 4", sampler);
    let material = format!("Material \"matte\" \"rgb Kd\" [{albedo} {albedo} {albedo}]");
    assert!(scene.contains("Material \"matte\""));
    scene.replace("Material \"matte\"", &material)
}

/// A room with the ball, a darker one, and the ball's reference.
fn gallery() -> Room {
    let room = Room::new();
    room.put("noisy.pbrt", &noisy_ball(0.5));
    room.put("darker.pbrt", &noisy_ball(0.4));
    room.run("--quiet --spp 4096 --seed 99 --outfile reference.exr noisy.pbrt")
        .ends_with(0);
    room
}

const SCENE: &str =
    "[[scene]]\nname = \"ball\"\nfile = \"noisy.pbrt\"\nreference = \"reference.exr\"\n";

/// A peer that runs this program.
fn peer(name: &str, args: &str) -> String {
    let program = env!("CARGO_BIN_EXE_tyndall");
    format!(
        "[peer.{name}]\nseeds = 2\n\
         command = \"'{program}' {args} --quiet --spp {{spp}} --seed {{seed}} --outfile {{out}}\"\n"
    )
}

/// Runs a suite and returns its report.
#[track_caller]
fn results(room: &Room, suite: &str, code: i32) -> Value {
    room.put("suite.toml", suite);
    room.run("bench suite.toml --outdir out --quiet")
        .ends_with(code);
    serde_json::from_slice(&room.read("out/report.json")).expect("JSON")
}

fn renderer<'a>(report: &'a Value, name: &str) -> &'a Value {
    let renderers = report["scenes"][0]["renderers"].as_array().expect("a list");
    let found = renderers
        .iter()
        .find(|renderer| renderer["renderer"] == name);
    found.unwrap_or_else(|| panic!("no {name} in {report:#}"))
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn an_unbiased_renderer_has_slope_minus_one_and_a_biased_one_flattens() {
    let room = gallery();
    let suite = format!(
        "spp = [4, 16, 64, 256]\nseeds = 2\nthreads = 1\n{SCENE}{}{}",
        peer("same", "{scene} --nthreads {threads}"),
        peer("biased", "{suite}/darker.pbrt"),
    );
    let report = results(&room, &suite, 0);
    let ours = &renderer(&report, "tyndall")["convergence"];
    let slope = number(&ours["slope"]["value"]);
    assert!((slope + 1.0).abs() < 0.1, "{ours:#}");
    assert_eq!(ours["verdict"], "converges");
    let biased = &renderer(&report, "biased")["convergence"];
    assert_eq!(biased["verdict"], "flattens", "{biased:#}");
    assert!(number(&biased["slope"]["value"]) > -0.8, "{biased:#}");
    // Whatever it converges to, it does so as fast.
    for of in [ours, biased] {
        let slope = number(&of["slope_of_variance"]["value"]);
        assert!((slope + 1.0).abs() < 0.1, "{of:#}");
    }
    // Every number of every run is there.
    for run in report["runs"].as_array().expect("a list") {
        for field in [
            "wall_seconds",
            "cpu_seconds",
            "peak_memory_bytes",
            "mse",
            "relmse",
        ] {
            assert!(number(&run[field]) > 0.0, "{field}: {run:#}");
        }
        assert_eq!(run["failure"], Value::Null);
    }
    assert!(number(&renderer(&report, "tyndall")["figures"][0]["load_seconds"]) > 0.0);
    // The same program makes the same pictures.
    let ratios = &report["scenes"][0]["ratios"];
    assert_eq!(
        (&ratios[0]["over"], &ratios[0]["spp"]),
        (&"same".into(), &256.into())
    );
    assert_eq!(number(&ratios[0]["mse"]), 1.0);
    assert!(number(&ratios[1]["mse"]) < 0.5, "{ratios:#}");

    let page = String::from_utf8(room.read("out/report.md")).expect("text");
    assert!(
        page.contains("ball, biased: the error flattens at"),
        "{page}"
    );
    let table = String::from_utf8(room.read("out/runs.csv")).expect("text");
    assert_eq!(table.lines().count(), 1 + 4 * 2 * 3, "{table}");
    for plot in ["out/ball.svg", "out/efficiency.svg"] {
        let svg = String::from_utf8(room.read(plot)).expect("text");
        assert!(
            svg.starts_with("<svg") && svg.contains("biased"),
            "{plot}: {svg}"
        );
    }
}

#[test]
fn a_floor_that_the_reference_explains_is_no_bias() {
    let room = gallery();
    // As noisy as eight samples are, and it says so.
    room.run("--quiet --spp 8 --seed 98 --outfile reference.exr noisy.pbrt")
        .ends_with(0);
    let suite = |noise: &str| format!("spp = [4, 16, 64, 256]\nseeds = 2\n{SCENE}{noise}");
    let verdict = |suite: &str| {
        let report = results(&room, suite, 0);
        renderer(&report, "tyndall")["convergence"].clone()
    };
    let silent = verdict(&suite(""));
    assert_eq!(silent["verdict"], "flattens");
    let noise = number(&silent["floor"]["value"]);
    let explained = verdict(&suite(&format!("reference_noise = {noise}\n")));
    assert_eq!(explained["verdict"], "reference-noise");
}

#[test]
#[cfg(unix)]
fn a_peer_that_fails_is_a_row_and_no_end() {
    let room = gallery();
    let suite = format!(
        "spp = [4]\ntimeout = 3\n{SCENE}\
         [peer.broken]\ncommand = \"sh -c 'echo no licence; exit 7'\"\n\
         [peer.missing]\ncommand = \"./no-such-renderer {{scene}}\"\n\
         [peer.silent]\ncommand = \"true\"\n\
         [peer.slow]\ncommand = \"sleep 600\"\nversion = \"sh -c 'echo 1; exec sleep 600'\"\n\
         [peer.other]\ncommand = \"cp {{suite}}/ball.exr {{out}}\"\n"
    );
    room.run("--quiet --quick ball.pbrt").ends_with(0);
    let report = results(&room, &suite, 3);
    let why = |name: &str| {
        renderer(&report, name)["failures"][0]
            .as_str()
            .expect("a reason")
            .to_owned()
    };
    assert_eq!(why("broken"), "exit status: 7: no licence");
    assert!(
        why("missing").ends_with("no-such-renderer\": No such file or directory"),
        "{}",
        why("missing")
    );
    assert_eq!(why("silent"), "it wrote no picture");
    assert_eq!(why("slow"), "not done after 3 s");
    let renderers = report["renderers"].as_array().expect("a list");
    let slow = renderers.iter().find(|renderer| renderer["name"] == "slow");
    assert_eq!(slow.expect("it is listed")["version"], Value::Null);
    assert!(
        why("other").contains("no part of the same size"),
        "{}",
        why("other")
    );
    let ours = &renderer(&report, "tyndall")["figures"][0];
    assert!(number(&ours["mse"]) > 0.0);
    assert_eq!(report["scenes"][0]["ratios"], Value::Array(Vec::new()));
    let page = String::from_utf8(room.read("out/report.md")).expect("text");
    assert!(
        page.contains("| ball | broken | failed: exit status: 7: no licence |"),
        "{page}"
    );
}

#[test]
fn what_others_measured_is_carried_over() {
    let room = gallery();
    let suite = format!(
        "spp = [4]\n{SCENE}{}[peer.same.known.third]\nsource = \"a table\"\n\
         [peer.same.known.third.scene]\nball = {{ cpu = [1, 2], mse = [4, 1.0] }}\n",
        peer("same", "{scene}"),
    );
    let report = results(&room, &suite, 0);
    let ratios = &report["scenes"][0]["ratios"];
    let (measured, derived) = (&ratios[0], &ratios[1]);
    assert_eq!(derived["over"], "third");
    assert_eq!(derived["derived_via"], "same");
    let quotient = |field: &str| number(&derived[field]) / number(&measured[field]);
    assert!((quotient("cpu") - 2.0).abs() < 1e-12);
    assert!((quotient("mse") - 0.25).abs() < 1e-12);
    assert!((quotient("efficiency") - 2.0).abs() < 1e-12);
    assert_eq!(derived["memory"], Value::Null);
    assert_eq!(report["renderers"][1]["known"][0]["source"], "a table");
}

#[test]
fn faults_of_a_suite_are_located_and_nothing_is_run() {
    let room = Room::new();
    let says = |suite: &str, text: &str| {
        room.put("s.toml", suite);
        let run: Run = room.run("bench s.toml --outdir out").ends_with(1);
        run.says(text);
        assert!(!room.path("out").exists(), "{suite}");
    };
    says("spp = [4\nseeds = 1\n", "s.toml:2:1");
    says(
        "spp = [16, 4]\n",
        "error[bad-range]: the sample counts of \"spp\" must grow",
    );
    says("seeds = \"two\"\n", "s.toml:1:9");
    says("title = \"none\"\n", "the suite has no [[scene]]");
    says(&format!("{SCENE}{SCENE}"), "s.toml:6:8");
    let scene = "[[scene]]\nname = \"a\"\nfile = \"a.pbrt\"\nreferense = \"a.exr\"\n";
    says(scene, "did you mean \"reference\"?");
    says(scene, "s.toml:4:1");
    says(scene, "a scene needs a \"reference\"");
    let peer = |command: &str| format!("{SCENE}[peer.x]\ncommand = \"{command}\"\n");
    says(&peer("x {scenes}"), "did you mean {scene}?");
    says(&peer("x 'y"), "a quote is open");
    says(&format!("{SCENE}[peer.x]\n"), "a peer needs a \"command\"");
    says(
        &format!("{SCENE}[peer.tyndall]\ncommand = \"x\"\n"),
        "is the name of our own runs",
    );
    let known = "[peer.x]\ncommand = \"x\"\n[peer.x.known.y]\nsource = \"z\"\nscene.bal = { cpu = [1, 2] }\n";
    says(&format!("{SCENE}{known}"), "did you mean \"ball\"?");
    room.run("bench gone.toml")
        .ends_with(1)
        .says("cannot read \"gone.toml\"");
}

#[test]
fn what_is_not_there_is_skipped_and_directories_may_be_given() {
    let room = gallery();
    let gone = "[[scene]]\nname = \"gone\"\nfile = \"gone.pbrt\"\nreference = \"reference.exr\"\n";
    room.put("suites/suite.toml", &format!("spp = [1]\n{gone}{SCENE}"));
    let run = room
        .run("bench suites/suite.toml --scenes . --references . --outdir out")
        .ends_with(3);
    run.says("gone: skipped: there is no file")
        .says("ball: tyndall at 1 spp, seed 0");
    let run =
        room.run("bench suites/suite.toml --scenes . --references . --outdir out --only ball");
    assert!(run.ends_with(0).stdout.contains("## Figures"));
    room.run("bench suites/suite.toml --only bal")
        .ends_with(1)
        .says("no scene \"bal\"");
}

/// The names of all fields of a value.
fn names(value: &Value, found: &mut BTreeSet<String>) {
    for (name, value) in value.as_object().into_iter().flatten() {
        found.insert(name.clone());
        names(value, found);
    }
    for element in value.as_array().into_iter().flatten() {
        names(element, found);
    }
}

#[test]
fn the_manual_names_every_option_and_every_field_of_the_report() {
    let manual = include_str!("../../docs/cli.md");
    let (options, manual) = manual.split_once("## Benchmarks").expect("a section");
    let (manual, _) = manual.split_once("## Report").expect("the next section");
    let room = gallery();
    let help = room.run("bench --help").ends_with(0).stdout;
    let typed: Vec<&str> = help
        .split_whitespace()
        .filter(|word| word.starts_with("--"))
        .collect();
    assert!(typed.len() >= 8, "{help}");
    for option in typed {
        assert!(
            options.contains(&format!("`{option}")),
            "docs/cli.md lacks {option}"
        );
    }
    let suite = format!(
        "spp = [1, 2]\n{SCENE}{}[peer.same.known.third]\nsource = \"a table\"\n\
         [[scene]]\nname = \"gone\"\nfile = \"gone\"\nreference = \"gone\"\n",
        peer("same", "{scene}"),
    );
    let mut found = BTreeSet::new();
    names(&results(&room, &suite, 3), &mut found);
    assert!(
        found.contains("floor_share") && found.contains("why"),
        "{found:?}"
    );
    for name in found {
        let is_named = ["`", "`.", "`[].", "[].", "`….", "."].iter().any(|before| {
            ["`", "[]`", ".", "[]."]
                .iter()
                .any(|after| manual.contains(&format!("{before}{name}{after}")))
        });
        assert!(is_named, "docs/cli.md lacks {name}");
    }
}

#[test]
fn a_suite_can_be_confined_but_not_other_renderers() {
    let room = Room::new();
    room.put("in/noisy.pbrt", &noisy_ball(0.5));
    room.run("--quiet --outfile in/reference.exr in/noisy.pbrt")
        .ends_with(0);
    room.put("in/suite.toml", &format!("spp = [1, 4]\n{SCENE}"));
    let line = "bench in/suite.toml --confine in --quiet";
    room.run(&format!("{line} --outdir in/out")).ends_with(0);
    assert!(room.path("in/out/report.json").exists());
    let list = room.list();
    room.run(&format!("{line} --outdir out"))
        .ends_with(1)
        .says("cannot write to \"out\": it is outside of \"in\"");
    room.run(&format!("{line} --outdir in/out --json r.json"))
        .ends_with(1)
        .says("it is outside of \"in\"");
    room.put(
        "in/far.toml",
        &format!("spp = [1]\n{}", SCENE.replace("noisy", "../ball")),
    );
    room.run("bench in/far.toml --confine in --outdir in/out")
        .ends_with(1)
        .says("ball.pbrt\": it is outside of \"in\"");
    room.put("far.toml", &format!("spp = [1]\n{SCENE}"));
    room.run("bench far.toml --confine in --outdir in/out")
        .ends_with(1)
        .says("cannot read \"far.toml\": it is outside of \"in\"");
    // What a scene includes is looked at by the program that renders it.
    let reading = noisy_ball(0.5).replace("WorldEnd", "Include \"../x.pbrt\"\nWorldEnd");
    room.put("in/noisy.pbrt", &reading);
    room.put("x.pbrt", "Shape \"sphere\"\n");
    room.run(&format!("{line} --outdir in/out")).ends_with(3);
    let report = String::from_utf8(room.read("in/out/report.json")).expect("text");
    assert!(report.contains("it is outside of"), "{report}");
    let peers = format!("spp = [1]\n{SCENE}{}", peer("other", "noisy.pbrt"));
    room.put("in/suite.toml", &peers);
    room.run(&format!("{line} --outdir in/out"))
        .ends_with(1)
        .says("--confine holds no other renderers: leave them out with --no-peers");
    room.run(&format!("{line} --outdir in/out --no-peers"))
        .ends_with(3);
    assert_eq!(room.list().len(), list.len() + 2);
}
