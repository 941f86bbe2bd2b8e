//! A fresh directory to run the real program in.

use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;
use tyndall::image::codec::{Attribute, ImageFile, decode};

/// A scene that is rendered without a word.
pub(crate) const BALL: &str = include_str!("ball.pbrt");

/// A directory that is removed at the end of the test.
pub(crate) struct Room {
    directory: TempDir,
}

/// What a run of the program left behind.
pub(crate) struct Run {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Room {
    /// With the ball in it.
    pub(crate) fn new() -> Self {
        let directory = TempDir::new().expect("temporary directories can be made");
        let room = Self { directory };
        room.put("ball.pbrt", BALL);
        room
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// Writes a file, and the directories above it.
    pub(crate) fn put(&self, name: &str, text: &str) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a parent")).expect("a directory");
        fs::write(path, text).expect("a file");
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Names of everything in the directory, sorted.
    pub(crate) fn list(&self) -> Vec<String> {
        let entries = fs::read_dir(self.directory.path()).expect("the directory is there");
        let mut names: Vec<String> = entries
            .map(|entry| {
                entry
                    .expect("an entry")
                    .file_name()
                    .into_string()
                    .expect("text")
            })
            .collect();
        names.sort();
        names
    }

    pub(crate) fn picture(&self, name: &str) -> ImageFile {
        let extension = name.rsplit('.').next().expect("an extension");
        decode(&self.read(name), extension).expect("a picture")
    }

    /// An attribute of an EXR file as text.
    pub(crate) fn attribute(&self, name: &str, attribute: &str) -> Option<String> {
        let attributes = self.picture(name).attributes;
        let found = attributes.into_iter().find(|(name, _)| name == attribute);
        found.map(|(_, value)| match value {
            Attribute::Text(text) => text,
            Attribute::Float(number) => number.to_string(),
            Attribute::Int(number) => number.to_string(),
        })
    }

    /// The program in this directory, with these arguments.
    pub(crate) fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tyndall"));
        command
            .args(line.split_whitespace())
            .current_dir(self.directory.path())
            .stdin(Stdio::null())
            .env_remove("RAYON_NUM_THREADS");
        command
    }

    pub(crate) fn run(&self, line: &str) -> Run {
        let output = self.command(line).output();
        Run::new(output.expect("the program starts"))
    }

    /// Runs with `input` on standard input.
    pub(crate) fn feed(&self, line: &str, input: &str) -> Run {
        let mut command = self.command(line);
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = command.spawn().expect("the program starts");
        let mut stdin = child.stdin.take().expect("a pipe");
        stdin.write_all(input.as_bytes()).expect("it is read");
        drop(stdin);
        Run::new(child.wait_with_output().expect("it ends"))
    }

    /// Runs with `--json` and returns the report.
    pub(crate) fn report(&self, line: &str) -> Value {
        let run = self.run(&format!("--json - {line}"));
        let report: Value = serde_json::from_str(&run.stdout).expect("a report");
        assert_eq!(report["exit_code"].as_i64(), run.code.map(i64::from));
        report
    }
}

impl Run {
    pub(crate) fn new(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).expect("the program writes UTF-8");
        Self {
            code: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }

    /// Asserts the exit status, showing what was said if it is another.
    #[track_caller]
    pub(crate) fn ends_with(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "standard error:\n{}", self.stderr);
        self
    }

    #[track_caller]
    pub(crate) fn says(self, text: &str) -> Self {
        let Self { stderr, .. } = &self;
        assert!(stderr.contains(text), "no {text:?} in:\n{stderr}");
        self
    }

    #[track_caller]
    pub(crate) fn says_nothing(self) -> Self {
        assert_eq!(self.stderr, "");
        assert_eq!(self.stdout, "");
        self
    }
}

/// The ball with one change.
pub(crate) fn ball(from: &str, to: &str) -> String {
    assert!(BALL.contains(from), "the ball has no {from}");
    BALL.replace(from, to)
}

/// A scene with a mesh that is not there.
pub(crate) fn ball_without_its_mesh() -> String {
    ball(
        "Shape \"sphere\"",
        "Shape \"sphere\"\nShape \"plymesh\" \"string filename\" \"gone.ply\"",
    )
}
