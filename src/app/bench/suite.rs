//! The suite: which scenes, which references, how many samples, who else takes part. `docs/bench/README.md` describes
//! every key.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

use toml::Spanned;
use toml::de::DeValue;
use tyndall_parser::diagnostic::Diagnostics;
use tyndall_parser::schema;
use tyndall_parser::source::Sources;

use super::keys::{Reader, Table};
use crate::app::args::MAX_THREADS;
use crate::app::files::{self, Bounds};

/// The name of our own runs; no peer may have it.
pub(super) const OURS: &str = "tyndall";

/// What a run may take if the suite does not say.
const TIMEOUT_SECONDS: u32 = 3600;
/// Sample counts if the suite does not say.
const SPP: [u32; 3] = [4, 16, 64];
/// More than any plot can show; it bounds the number of runs.
const MAX_SEEDS: u32 = 1000;

/// What is written between braces in a peer's command.
pub(super) const PLACEHOLDERS: [&str; 7] = [
    "{scene}",
    "{out}",
    "{spp}",
    "{seed}",
    "{threads}",
    "{quick}",
    "{suite}",
];

/// A benchmark, decided.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Suite {
    /// What the reports are headed with.
    pub(super) title: String,
    /// Where the suite's file is, absolute.
    pub(super) directory: PathBuf,
    /// Samples per pixel, growing.
    pub(super) spp: Vec<u32>,
    /// Our runs at each sample count; their seeds count from 0.
    pub(super) seeds: u32,
    /// Threads of each renderer.
    pub(super) threads: u32,
    /// What a run may take.
    pub(super) timeout: Duration,
    pub(super) scenes: Vec<Scene>,
    pub(super) peers: Vec<Peer>,
}

/// A scene and what it should look like.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Scene {
    pub(super) name: String,
    pub(super) file: PathBuf,
    pub(super) reference: PathBuf,
    /// The mean squared error of the reference itself, if stated.
    pub(super) reference_noise: Option<f64>,
    /// Rendered with `--quick`, as its reference was.
    pub(super) quick: bool,
    /// Sample counts instead of the suite's.
    pub(super) spp: Option<Vec<u32>>,
}

/// Another renderer.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Peer {
    pub(super) name: String,
    /// The words of its command, with placeholders.
    pub(super) command: Vec<String>,
    /// The words of a command that prints its version.
    pub(super) version: Option<Vec<String>>,
    /// Sample counts instead of the suite's.
    pub(super) spp: Option<Vec<u32>>,
    /// Runs at each sample count.
    pub(super) seeds: u32,
    /// What was measured before, beside this one.
    pub(super) known: Vec<Known>,
}

/// A renderer that is not run: somebody else measured it side by side with a peer.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Known {
    pub(super) name: String,
    /// Who measured, on what.
    pub(super) source: String,
    /// By scene.
    pub(super) figures: BTreeMap<String, KnownFigures>,
}

/// Figures of the third renderer and of the peer, in that order and in the same unit.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct KnownFigures {
    pub(super) cpu: Option<[f64; 2]>,
    pub(super) memory: Option<[f64; 2]>,
    pub(super) mse: Option<[f64; 2]>,
}

/// Directories that the command line gives.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Directories {
    pub(super) scenes: Option<PathBuf>,
    pub(super) references: Option<PathBuf>,
}

impl Suite {
    /// Reads a suite. `None` if there were errors; the findings say which.
    ///
    /// # Errors
    /// One sentence, if the file cannot be read at all.
    pub(super) fn read(
        path: &Path,
        bounds: &Bounds,
        directories: &Directories,
        sources: &mut Sources,
    ) -> Result<(Option<Self>, Diagnostics), String> {
        let refusal = |why: String| format!("cannot read \"{}\": {why}", path.display());
        let bytes = files::read(path, bounds).map_err(refusal)?;
        let absolute = std::path::absolute(path).map_err(|error| refusal(error.to_string()))?;
        let directory = absolute.parent().map(Path::to_owned).unwrap_or_default();
        let text =
            std::str::from_utf8(&bytes).map_err(|_| refusal("it is not UTF-8 text".to_owned()))?;
        let file = sources.add_text(path.display().to_string(), text);
        let mut reader = Reader::new(file);
        let suite = reader.suite(text, &directory, directories);
        let found = reader.found;
        Ok((suite.filter(|_| !found.has_errors()), found))
    }
}

impl Reader {
    fn suite(&mut self, text: &str, directory: &Path, given: &Directories) -> Option<Suite> {
        let mut table = self.document(text, "a suite")?;
        let title = self.string(&mut table, "title").unwrap_or_default();
        let spp = self.counts(&mut table, "spp").unwrap_or(SPP.to_vec());
        let seeds = self.count(&mut table, "seeds", MAX_SEEDS).unwrap_or(1);
        let threads = self.count(&mut table, "threads", MAX_THREADS.into());
        let timeout = self.count(&mut table, "timeout", u32::MAX);
        let mut place = |key, given: &Option<PathBuf>, reader: &mut Self| {
            let named = reader.string(&mut table, key).unwrap_or_default();
            let named = directory.join(named);
            match given {
                Some(given) => std::path::absolute(given).unwrap_or_else(|_| given.clone()),
                None => named,
            }
        };
        let scene_directory = place("scenes", &given.scenes, self);
        let reference_directory = place("references", &given.references, self);
        let mut scenes: Vec<Scene> = Vec::new();
        for scene in self.tables(&mut table, "scene") {
            let is_taken = |name: &str| scenes.iter().any(|scene| scene.name == name);
            scenes.extend(self.scene(scene, &scene_directory, &reference_directory, is_taken));
        }
        let peers = self.named_tables(&mut table, "peer", "a peer");
        let peers = peers
            .into_iter()
            .filter_map(|(name, peer)| self.peer(name, peer, directory, &scenes));
        let peers = peers.collect();
        self.finish(table);
        if scenes.is_empty() {
            self.error("no-scenes", 0..0, "the suite has no [[scene]]".to_owned());
        }
        Some(Suite {
            title,
            directory: directory.to_owned(),
            spp,
            seeds,
            threads: threads.unwrap_or_else(|| {
                let cores = std::thread::available_parallelism().map_or(1, usize::from);
                cores.min(MAX_THREADS.into()) as u32
            }),
            timeout: Duration::from_secs(timeout.unwrap_or(TIMEOUT_SECONDS).into()),
            scenes,
            peers,
        })
    }

    fn scene(
        &mut self,
        mut table: Table<'_>,
        scenes: &Path,
        references: &Path,
        is_taken: impl Fn(&str) -> bool,
    ) -> Option<Scene> {
        let name = self.needed_value(&mut table, "name");
        let name = name.and_then(|name| {
            let span = name.span();
            let name = self.text(name, "name")?;
            if is_taken(&name) {
                let message = format!("there is a scene \"{name}\" already");
                self.error("same-name", span, message);
            }
            Some(name)
        });
        let file = self.needed(&mut table, "file");
        let reference = self.needed(&mut table, "reference");
        let reference_noise = self.number(&mut table, "reference_noise");
        let quick = self.flag(&mut table, "quick");
        let spp = self.counts(&mut table, "spp");
        self.finish(table);
        Some(Scene {
            name: name?,
            file: scenes.join(file?),
            reference: references.join(reference?),
            reference_noise,
            quick,
            spp,
        })
    }

    fn peer(
        &mut self,
        name: Spanned<String>,
        mut table: Table<'_>,
        directory: &Path,
        scenes: &[Scene],
    ) -> Option<Peer> {
        if name.get_ref() == OURS {
            let message = format!("\"{OURS}\" is the name of our own runs");
            self.error("bad-peer", name.span(), message);
        }
        let command = self.needed_value(&mut table, "command");
        let command = command.and_then(|value| self.command(value, "command", directory));
        let version = table.take("version");
        let version = version.and_then(|value| self.command(value, "version", directory));
        let spp = self.counts(&mut table, "spp");
        let seeds = self.count(&mut table, "seeds", MAX_SEEDS).unwrap_or(1);
        let known = self.named_tables(&mut table, "known", "a known renderer");
        let known = known
            .into_iter()
            .filter_map(|(third, known)| self.known(third, known, scenes));
        let known = known.collect();
        self.finish(table);
        Some(Peer {
            name: name.into_inner(),
            command: command?,
            version,
            spp,
            seeds,
            known,
        })
    }

    fn known(
        &mut self,
        name: Spanned<String>,
        mut table: Table<'_>,
        scenes: &[Scene],
    ) -> Option<Known> {
        let source = self.needed(&mut table, "source");
        let mut figures = BTreeMap::new();
        for (scene, mut table) in self.named_tables(&mut table, "scene", "known figures") {
            let names = || scenes.iter().map(|scene| scene.name.as_str());
            if !names().any(|name| name == scene.get_ref()) {
                let message = format!("the suite has no scene \"{}\"", scene.get_ref());
                let help = schema::did_you_mean(scene.get_ref(), names());
                self.push("unknown-scene", scene.span(), message, help);
            }
            let known = KnownFigures {
                cpu: self.pair(&mut table, "cpu"),
                memory: self.pair(&mut table, "memory"),
                mse: self.pair(&mut table, "mse"),
            };
            self.finish(table);
            figures.insert(scene.into_inner(), known);
        }
        self.finish(table);
        Some(Known {
            name: name.into_inner(),
            source: source?,
            figures,
        })
    }

    /// The words of a command. A program with a directory in its name is looked for beside the suite.
    fn command(
        &mut self,
        value: Spanned<DeValue<'_>>,
        key: &str,
        directory: &Path,
    ) -> Option<Vec<String>> {
        let span = value.span();
        let text = self.text(value, key)?;
        let mut words = shlex::split(&text).unwrap_or_default();
        let Some(program) = words.first_mut() else {
            let message = format!("\"{key}\" is no command: it is empty or a quote is open");
            self.error("bad-command", span, message);
            return None;
        };
        if program.contains(std::path::is_separator) {
            *program = directory.join(&*program).display().to_string();
        }
        for word in &words {
            self.check_placeholders(word, &span);
        }
        Some(words)
    }

    fn check_placeholders(&mut self, word: &str, span: &Range<usize>) {
        for (start, _) in word.match_indices('{') {
            let Some(length) = word[start..].find('}') else {
                continue;
            };
            let placeholder = &word[start..=start + length];
            if !PLACEHOLDERS.contains(&placeholder) {
                let message = format!("{placeholder} is no placeholder");
                let help = schema::nearest(placeholder, PLACEHOLDERS).map_or_else(
                    || format!("there are {}", PLACEHOLDERS.join(", ")),
                    |name| format!("did you mean {name}?"),
                );
                self.push("unknown-placeholder", span.clone(), message, Some(help));
            }
        }
    }
}
