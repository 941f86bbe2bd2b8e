//! How a run ended, and the exit status that says so.

use std::fmt::Write;

use serde::Serialize;

/// How a run ended, from best to worst: the worst thing that happened counts.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Outcome {
    /// Everything asked for was done, and every picture is what the scene asks for.
    #[default]
    Complete,
    /// Every picture was rendered as the scene asks, but some samples were lost on the way.
    LostSamples,
    /// Every picture was rendered, but something that the scene asks for was left out or replaced.
    Substituted,
    /// A picture was not rendered or not written.
    Failed,
    /// The command line makes no sense. Nothing was done.
    Usage,
    /// Stopped by a signal.
    Interrupted,
}

impl Outcome {
    /// All of them, by status.
    pub(super) const ALL: [Self; 6] = [
        Self::Complete,
        Self::Failed,
        Self::Usage,
        Self::Substituted,
        Self::LostSamples,
        Self::Interrupted,
    ];

    /// The exit status.
    pub(super) fn code(self) -> u8 {
        match self {
            Self::Complete => 0,
            Self::Failed => 1,
            Self::Usage => 2,
            Self::Substituted => 3,
            Self::LostSamples => 4,
            // What shells report for a program that Ctrl-C ended.
            Self::Interrupted => 130,
        }
    }

    /// What the summary says about it.
    pub(super) fn explanation(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::LostSamples => "samples were lost",
            Self::Substituted => "parts of the scene were left out or replaced",
            Self::Failed => "failed",
            Self::Usage => "nothing was done",
            Self::Interrupted => "interrupted",
        }
    }
}

/// Commands whose exit statuses mean the same.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Family {
    /// `render`, `check` and `cat`.
    Scene,
    Compare,
    Bench,
    /// `help`, `completions` and `man`.
    Manual,
}

impl Family {
    /// All of them, in the order of the manual.
    pub(super) const ALL: [Self; 4] = [Self::Scene, Self::Compare, Self::Bench, Self::Manual];

    /// Names of its commands.
    pub(super) fn commands(self) -> &'static [&'static str] {
        match self {
            Self::Scene => &["render", "check", "cat"],
            Self::Compare => &["compare"],
            Self::Bench => &["bench"],
            Self::Manual => &["help", "completions", "man"],
        }
    }

    /// What the exit status of an outcome means; `None` if nothing ends so.
    pub(super) fn meaning(self, outcome: Outcome) -> Option<&'static str> {
        let meaning = match (self, outcome) {
            (_, Outcome::Usage) => "the command line is wrong; nothing was done",
            (Self::Scene, Outcome::Complete) => {
                "every picture is complete and what the scene asks for (check: would be)"
            }
            (Self::Scene, Outcome::Failed) => {
                "a picture was not rendered or not written: a fatal error in the scene, a file that cannot be read or \
                 written; with --strict, any finding about the scene"
            }
            (Self::Scene, Outcome::Substituted) => {
                "every picture was rendered, but something that the scene asks for was left out or replaced: a missing \
                 file, an unknown plugin"
            }
            (Self::Scene, Outcome::LostSamples) => {
                "every picture was rendered as the scene asks, but samples were lost: their radiance was not finite or \
                 negative, or a path was given up; or pixels exceed single precision"
            }
            (Self::Scene, Outcome::Interrupted) => {
                "stopped by a signal; what there was of the picture is in OUT.partial.EXT"
            }
            (Self::Compare, Outcome::Complete) => "the same: within the limits, or none were given",
            (Self::Compare, Outcome::Failed) => {
                "different: a limit is exceeded, or A has a pixel that is not finite"
            }
            (Self::Compare, Outcome::Substituted) => {
                "could not compare: a picture cannot be read, the two cannot be compared, no pixel of B is finite, or an \
                 output cannot be written"
            }
            (Self::Compare, Outcome::LostSamples) => "cannot tell (nothing ends so yet)",
            (Self::Bench, Outcome::Complete) => "every run was measured",
            (Self::Bench, Outcome::Failed) => {
                "the suite has errors, or the results cannot be written"
            }
            (Self::Bench, Outcome::Substituted) => {
                "a run failed, a picture is not what its scene asks for, or a scene was skipped: the report says which"
            }
            (Self::Bench, Outcome::Interrupted) => {
                "stopped by a signal; the results are those until then"
            }
            (Self::Manual, Outcome::Complete) => "printed or written",
            (Self::Manual, Outcome::Failed) => "it cannot be printed or written",
            (Self::Compare | Self::Manual, Outcome::Interrupted) => "stopped by a signal",
            (Self::Bench, Outcome::LostSamples)
            | (Self::Manual, Outcome::LostSamples | Outcome::Substituted) => return None,
        };
        Some(meaning)
    }

    /// The exit statuses, for `--help`.
    pub(super) fn help(self) -> String {
        let mut text = "Exit status:\n".to_owned();
        for outcome in Outcome::ALL {
            if let Some(meaning) = self.meaning(outcome) {
                let _ = writeln!(text, "  {:<5}{}", outcome.code(), indented(meaning));
            }
        }
        if self == Self::Scene {
            text += "\nOf several reasons the worst one counts: 130, 1, 3, 4. See docs/cli.md.";
        } else {
            text += "\nSee docs/cli.md.";
        }
        text
    }
}

/// Broken into lines of at most 90 characters, the following ones below the first.
fn indented(text: &str) -> String {
    const WIDTH: usize = 90;
    let (mut lines, mut length) = (String::new(), 0);
    for word in text.split(' ') {
        if length > 0 && length + 1 + word.len() > WIDTH {
            lines += "\n       ";
            length = 0;
        } else if length > 0 {
            lines.push(' ');
            length += 1;
        }
        lines += word;
        length += word.len();
    }
    lines
}
