//! The commands beside rendering: their words, helps, pages and completions; several scenes checked at once.

use std::fs::File;
use std::process::{Command, Stdio};

use crate::room::{Room, Run, ball, ball_without_its_mesh};

const COMMANDS: [&str; 8] = [
    "render",
    "check",
    "cat",
    "compare",
    "bench",
    "completions",
    "man",
    "help",
];

#[test]
fn render_is_a_word_for_what_is_done_without_one() {
    let room = Room::new();
    room.run("--quiet --spp 2 ball.pbrt --outfile a.exr")
        .ends_with(0);
    for line in [
        "render --quiet --spp 2 ball.pbrt --outfile b.exr",
        "-quiet render -spp=2 ball.pbrt --outfile b.exr",
    ] {
        room.run(line).ends_with(0).says_nothing();
        assert_eq!(room.read("a.exr"), room.read("b.exr"));
        std::fs::remove_file(room.path("b.exr")).expect("a file");
    }
}

#[test]
fn cat_is_a_command_and_an_option() {
    let room = Room::new();
    let printed = room.run("--cat ball.pbrt").ends_with(0).stdout;
    for line in [
        "cat ball.pbrt",
        "--quiet cat ball.pbrt",
        "cat --toply ball.pbrt",
    ] {
        assert_eq!(room.run(line).ends_with(0).stdout, printed);
    }
    room.run("cat ball.pbrt --json r.json").ends_with(0);
    let report: serde_json::Value = serde_json::from_slice(&room.read("r.json")).expect("JSON");
    assert_eq!(report["task"], "cat");
}

#[test]
fn every_command_has_help_and_statuses() {
    let room = Room::new();
    for command in COMMANDS.iter().filter(|command| **command != "help") {
        let help = room.run(&format!("{command} --help")).ends_with(0).stdout;
        assert_eq!(
            room.run(&format!("help {command}")).ends_with(0).stdout,
            help
        );
        assert!(help.contains(&format!("tyndall {command}")), "{help}");
        if !["completions", "man"].contains(command) {
            assert!(
                help.contains("--json") && help.contains("  130  "),
                "{help}"
            );
        }
    }
    // What means nothing to a command is not offered.
    let help = room.run("check --help").stdout;
    assert!(
        !help.contains("--outfile") && help.contains("--spp"),
        "{help}"
    );
    assert!(room.run("--help").stdout.contains("Commands:"));
    for word in COMMANDS {
        assert!(
            room.run("--help").stdout.contains(&format!("  {word} ")),
            "{word}"
        );
    }
}

#[test]
fn misspelt_commands_are_told_with_the_nearest() {
    let room = Room::new();
    room.run("chekc ball.pbrt")
        .ends_with(2)
        .says("did you mean \"check\"?");
    room.run("--quick comapre a b")
        .ends_with(2)
        .says("did you mean \"compare\"?");
    room.run("help chekc").ends_with(2);
    // A file is a file.
    room.put("chekc", &ball("ball.exr", "a.exr"));
    room.run("chekc").ends_with(0);
    // What is near nothing is a file that is not there.
    room.run("nowhere")
        .ends_with(1)
        .says("cannot read \"nowhere\"");
}

#[test]
fn shells_are_taught_every_command_and_option() {
    let room = Room::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = room
            .run(&format!("completions {shell}"))
            .ends_with(0)
            .stdout;
        for word in ["compare", "outfile", "max-relmse", "completions"] {
            assert!(script.contains(word), "{shell}: no {word}");
        }
    }
    room.run("completions csh").ends_with(2).says("bash");
}

#[test]
fn manual_pages_are_printed_and_written() {
    let room = Room::new();
    let page = room.run("man").ends_with(0).stdout;
    assert!(
        page.contains(".TH tyndall 1") && page.contains("cropwindow"),
        "{page}"
    );
    room.put("pages/x", "");
    room.run("man pages").ends_with(0).says_nothing();
    for command in COMMANDS {
        let page = room.read(&format!("pages/tyndall-{command}.1"));
        let page = String::from_utf8(page).expect("text");
        assert!(page.contains(&format!("tyndall\\-{command}")), "{page}");
    }
    assert!(room.path("pages/tyndall.1").exists());
    room.run("man nowhere")
        .ends_with(1)
        .says("there is no directory \"nowhere\"");
}

#[test]
fn scenes_are_checked_each_by_itself() {
    let room = Room::new();
    room.put("wrong.pbrt", &ball_without_its_mesh());
    room.put("broken.pbrt", "WorldBegin\nShape \"sphere\"\n\"");
    room.put("odd.pbrt", &ball("\"float fov\"", "\"float fow\""));
    let report = room.report("check ball.pbrt broken.pbrt wrong.pbrt gone.pbrt odd.pbrt ball.pbrt");
    assert_eq!(report["exit_code"], 1);
    let findings = report["findings"].as_array().expect("a list");
    let place = |code: &str| {
        let finding = findings.iter().find(|finding| finding["code"] == code);
        finding.unwrap_or_else(|| panic!("no {code} in {findings:?}"))["file"].clone()
    };
    assert_eq!(place("missing-file"), "wrong.pbrt");
    assert_eq!(place("unterminated-string"), "broken.pbrt");
    assert_eq!(place("unused-parameter"), "odd.pbrt");
    assert_eq!(place("unreadable-file"), serde_json::Value::Null);
    // Each scene is a picture, in order: a fault of one is none of the others.
    let outcomes: Vec<&str> = report["pictures"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|picture| picture["outcome"].as_str().expect("a word"))
        .collect();
    assert_eq!(
        outcomes,
        ["complete", "substituted", "complete", "complete"]
    );
    assert_eq!(report["scenes"].as_array().map(Vec::len), Some(5));
    assert_eq!(room.report("check wrong.pbrt ball.pbrt")["exit_code"], 3);
    assert_eq!(room.report("check ball.pbrt odd.pbrt")["exit_code"], 0);
    assert_eq!(
        room.report("check --strict odd.pbrt ball.pbrt")["exit_code"],
        1
    );
}

#[test]
#[cfg(unix)]
fn reports_for_a_closed_or_broken_output_are_failures() {
    let room = Room::new();
    let program = env!("CARGO_BIN_EXE_tyndall");
    let shell = |line: &str| {
        let line = line.replace("tyndall", &format!("'{program}'"));
        let output = Command::new("sh")
            .args(["-c", &line])
            .current_dir(room.path("."))
            .output();
        Run::new(output.expect("a shell"))
    };
    for line in [
        "tyndall check ball.pbrt --json - >&-",
        "tyndall --cat ball.pbrt >&-",
        "tyndall --help >&-",
        "tyndall completions bash >&-",
        "tyndall --cat ball.pbrt 1</dev/null",
    ] {
        shell(line)
            .ends_with(1)
            .says("cannot write to standard output: Bad file descriptor");
    }
    shell("tyndall compare ball.pbrt ball.pbrt --json - >&-").ends_with(3);
    // Nobody reads, or nobody wants to.
    shell("tyndall --cat ball.pbrt | true").ends_with(0);
    shell("tyndall --cat ball.pbrt >/dev/null").ends_with(0);
    shell("tyndall --cat ball.pbrt 1<>/dev/null").ends_with(0);
    // Without a word to standard output, it may be closed.
    shell("tyndall --quiet ball.pbrt >&-").ends_with(0);
}

#[test]
#[cfg(target_os = "linux")]
fn help_for_a_full_disk_is_a_failure() {
    let room = Room::new();
    for line in ["--help", "--version", "man", "completions zsh"] {
        let full = File::options()
            .write(true)
            .open("/dev/full")
            .expect("a device");
        let output = room
            .command(line)
            .stdout(full)
            .stderr(Stdio::piped())
            .output();
        let run = Run::new(output.expect("the program starts")).ends_with(1);
        run.says("No space left on device");
    }
}
