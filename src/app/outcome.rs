//! How a run ended, and the exit status that says so.

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

/// The exit statuses, for `--help`.
pub(super) const EXIT_STATUS_HELP: &str = "\
Exit status:
  0    every picture is complete and what the scene asks for
  1    a picture was not rendered or not written (fatal errors; with --strict, any finding)
  2    the command line is wrong
  3    rendered, but something was left out or replaced: a missing file, an unknown plugin
  4    rendered, but samples were lost: their radiance was not finite
  130  interrupted; the picture written, if any, is partial and says so

Of several reasons the worst one counts: 130, 1, 3, 4. See docs/cli.md.";
