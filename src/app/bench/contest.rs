//! All runs of a suite: every renderer in turn on every scene, compared with the reference.

use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde::Serialize;
use serde_json::Value;
use tempfile::TempDir;

use super::run::{self, Ended};
use super::suite::{OURS, Peer, Scene, Suite};
use crate::app::console::Console;
use crate::app::files::{Bounds, reason};
use crate::app::interrupt::Interrupt;
use crate::app::outcome::Outcome;

/// One run: a row of the table.
#[derive(Serialize, Clone, PartialEq, Debug)]
pub(super) struct Run {
    pub(super) scene: String,
    pub(super) renderer: String,
    pub(super) spp: u32,
    pub(super) seed: u32,
    pub(super) wall_seconds: Option<f64>,
    pub(super) cpu_seconds: Option<f64>,
    /// From the start to the first ray, where the renderer reports it: ours does.
    pub(super) load_seconds: Option<f64>,
    pub(super) peak_memory_bytes: Option<u64>,
    pub(super) mse: Option<f64>,
    pub(super) relmse: Option<f64>,
    /// Of every other seed: half of the mean squared difference to the picture of the seed before, where they differ. That
    /// is the mean variance of a pixel, which knows no reference.
    pub(super) variance: Option<f64>,
    /// Mean of the picture over that of the reference, averaged over the channels.
    pub(super) mean_ratio: Option<f64>,
    /// Why there are no measures.
    pub(super) failure: Option<String>,
    /// What the renderer left out of the picture that was measured.
    pub(super) remark: Option<String>,
}

/// What the runs are made with.
pub(super) struct Contest<'a> {
    suite: &'a Suite,
    /// Where our own program may read and write.
    bounds: &'a Bounds,
    program: PathBuf,
    workshop: TempDir,
    console: &'a Console,
    interrupt: &'a Interrupt,
    runs: Vec<Run>,
}

/// Who renders.
#[derive(Clone, Copy)]
enum Renderer<'a> {
    Ours,
    Peer(&'a Peer),
}

impl<'a> Contest<'a> {
    /// With a directory of its own for pictures.
    ///
    /// # Errors
    /// One sentence.
    pub(super) fn new(
        suite: &'a Suite,
        bounds: &'a Bounds,
        console: &'a Console,
        interrupt: &'a Interrupt,
    ) -> Result<Self, String> {
        let program = std::env::current_exe()
            .map_err(|error| format!("cannot find this program: {}", reason(&error)))?;
        let mut workshop = tempfile::Builder::new();
        let workshop = workshop.prefix("tyndall-bench-");
        let workshop = match bounds.directory() {
            Some(directory) => workshop.tempdir_in(directory),
            None => workshop.tempdir(),
        };
        let workshop = workshop
            .map_err(|error| format!("cannot make a temporary directory: {}", reason(&error)))?;
        Ok(Self {
            suite,
            bounds,
            program,
            workshop,
            console,
            interrupt,
            runs: Vec::new(),
        })
    }

    /// Runs everything, until a signal comes.
    pub(super) fn run(mut self, scenes: &[&'a Scene]) -> Vec<Run> {
        let suite = self.suite;
        let peers = || suite.peers.iter().map(Renderer::Peer);
        // The renderers take turns, so that what else the machine does spoils them alike.
        for &scene in scenes {
            for spp in all_counts(suite, scene) {
                for renderer in std::iter::once(Renderer::Ours).chain(peers()) {
                    if !renderer.counts(suite, scene).contains(&spp) {
                        continue;
                    }
                    for seed in 0..renderer.n_seeds(suite) {
                        if self.interrupt.is_wanted() {
                            return self.runs;
                        }
                        self.one(scene, renderer, spp, seed);
                    }
                }
            }
        }
        self.runs
    }

    fn one(&mut self, scene: &Scene, renderer: Renderer<'_>, spp: u32, seed: u32) {
        let mut run = Run::new(scene, renderer, spp, seed);
        let picture = self.workshop.path().join("picture.exr");
        // What an earlier run wrote is not this one's.
        let _ = std::fs::remove_file(&picture);
        let rendered = match renderer {
            Renderer::Ours => self.ours(scene, spp, seed, &picture, &mut run),
            Renderer::Peer(peer) => self.peer(peer, scene, spp, seed, &picture, &mut run),
        };
        let before = self.workshop.path().join("before.exr");
        let measured = rendered.and_then(|()| {
            if picture.is_file() {
                self.compare(&picture, &scene.reference, renderer, &mut run)
            } else {
                Err("it wrote no picture".to_owned())
            }
        });
        if measured.is_ok() {
            // In pairs, which are independent of each other.
            if seed.is_multiple_of(2) {
                let _ = std::fs::rename(&picture, &before);
            } else {
                run.variance = self.variance(&picture, &before);
            }
        }
        run.failure = measured.err();
        if self.interrupt.is_wanted() {
            // The signal that is meant for us may have ended the child too.
            return;
        }
        self.console.note(&run.text());
        self.runs.push(run);
    }

    fn ours(
        &self,
        scene: &Scene,
        spp: u32,
        seed: u32,
        picture: &Path,
        run: &mut Run,
    ) -> Result<(), String> {
        let report = self.workshop.path().join("report.json");
        let mut command = Command::new(&self.program);
        command
            .arg(&scene.file)
            .arg("--outfile")
            .arg(picture)
            .arg("--json")
            .arg(&report)
            .args([
                "--quiet",
                "--spp",
                &spp.to_string(),
                "--seed",
                &seed.to_string(),
            ])
            .args(["--nthreads", &self.suite.threads.to_string()]);
        if scene.quick {
            command.arg("--quick");
        }
        self.confine(&mut command);
        let ended = self.measure(&mut command, run)?;
        let report = std::fs::read(&report).unwrap_or_default();
        let report: Value = serde_json::from_slice(&report).unwrap_or_default();
        let seconds = |phase: &str| report["seconds"][phase].as_f64();
        run.load_seconds = ["parse", "compile"].map(seconds).into_iter().sum();
        let is_a_picture = [Outcome::Substituted, Outcome::LostSamples]
            .iter()
            .any(|outcome| ended.code == Some(outcome.code().into()));
        match ended.failure {
            Some(_) if is_a_picture => {
                run.remark = first_error(&report);
                Ok(())
            }
            Some(failure) => Err(first_error(&report).unwrap_or(failure)),
            None => Ok(()),
        }
    }

    /// Holds our own program to where files may be.
    fn confine(&self, command: &mut Command) {
        if let Some(directory) = self.bounds.directory() {
            command.arg("--confine").arg(directory);
        }
    }

    fn peer(
        &self,
        peer: &Peer,
        scene: &Scene,
        spp: u32,
        seed: u32,
        picture: &Path,
        run: &mut Run,
    ) -> Result<(), String> {
        if scene.quick && !peer.command.iter().any(|word| word.contains("{quick}")) {
            return Err("the scene wants {quick} and its command has none".to_owned());
        }
        let values = HashMap::from([
            ("{scene}", scene.file.clone().into_os_string()),
            ("{out}", picture.as_os_str().to_owned()),
            ("{spp}", spp.to_string().into()),
            ("{seed}", seed.to_string().into()),
            ("{threads}", self.suite.threads.to_string().into()),
            ("{quick}", if scene.quick { "--quick" } else { "" }.into()),
            ("{suite}", self.suite.directory.clone().into_os_string()),
        ]);
        let mut words = peer
            .command
            .iter()
            .filter_map(|word| fill_in(word, &values));
        let program = words.next().unwrap_or_default();
        let mut command = Command::new(program);
        command.args(words);
        match self.measure(&mut command, run)?.failure {
            Some(failure) => Err(failure),
            None => Ok(()),
        }
    }

    /// Runs in the workshop, so that what a renderer writes beside its picture is nobody's litter.
    fn measure(&self, command: &mut Command, run: &mut Run) -> Result<Ended, String> {
        command.current_dir(self.workshop.path());
        let log = self.workshop.path().join("log.txt");
        let ended = run::measure(command, &log, self.suite.timeout, self.interrupt.flag())?;
        run.wall_seconds = Some(ended.usage.wall);
        run.cpu_seconds = ended.usage.cpu;
        run.peak_memory_bytes = ended.usage.peak_memory;
        Ok(ended)
    }

    /// What `tyndall compare` reports. In a process of its own: a child's peak memory starts at what its parent holds, so
    /// that this program opens no pictures.
    fn report_on(&self, picture: &Path, other: &Path, options: &[&str]) -> Result<Value, String> {
        let mut command = Command::new(&self.program);
        command
            .arg("compare")
            .args([picture, other])
            .args(["--json", "-", "--quiet"])
            .args(options);
        self.confine(&mut command);
        let output = command.stdin(Stdio::null()).output();
        let output = output.map_err(|error| format!("cannot compare: {}", reason(&error)))?;
        let report: Value = serde_json::from_slice(&output.stdout)
            .map_err(|error| format!("cannot compare: {error}"))?;
        match report["error"].as_str() {
            Some(why) => Err(why.to_owned()),
            None => Ok(report),
        }
    }

    /// `None` for the same picture again, of a renderer without seeds.
    fn variance(&self, picture: &Path, before: &Path) -> Option<f64> {
        let report = self.report_on(picture, before, &[]).ok()?;
        let mse = report["measures"]["mse"].as_f64()?;
        (mse > 0.0).then_some(0.5 * mse)
    }

    fn compare(
        &self,
        picture: &Path,
        reference: &Path,
        renderer: Renderer<'_>,
        run: &mut Run,
    ) -> Result<(), String> {
        let options: &[&str] = match renderer {
            Renderer::Ours => &[],
            // Not every renderer tells where in the frame a crop window lies.
            Renderer::Peer(_) => &["--same-window"],
        };
        let report = self.report_on(picture, reference, options)?;
        let n_bad = report["test"]["non_finite"].as_u64().unwrap_or_default();
        if n_bad > 0 {
            return Err(format!("{n_bad} pixels are not finite"));
        }
        let measures = &report["measures"];
        run.mse = measures["mse"].as_f64();
        run.relmse = measures["relmse"].as_f64();
        let ratios = measures["mean_ratio"].as_array().into_iter().flatten();
        run.mean_ratio = super::fit::mean(ratios.filter_map(Value::as_f64));
        match run.mse {
            Some(_) => Ok(()),
            None => Err("its error cannot be measured".to_owned()),
        }
    }
}

impl<'a> Renderer<'a> {
    fn name(self) -> &'a str {
        match self {
            Self::Ours => OURS,
            Self::Peer(peer) => &peer.name,
        }
    }

    fn counts<'b>(self, suite: &'b Suite, scene: &'b Scene) -> &'b [u32]
    where
        'a: 'b,
    {
        let own = match self {
            Self::Ours => None,
            Self::Peer(peer) => peer.spp.as_ref(),
        };
        own.or(scene.spp.as_ref()).unwrap_or(&suite.spp)
    }

    fn n_seeds(self, suite: &Suite) -> u32 {
        match self {
            Self::Ours => suite.seeds,
            Self::Peer(peer) => peer.seeds,
        }
    }
}

/// The sample counts that any renderer has, growing.
fn all_counts(suite: &Suite, scene: &Scene) -> Vec<u32> {
    let peers = suite.peers.iter().map(Renderer::Peer);
    let mut counts: Vec<u32> = std::iter::once(Renderer::Ours)
        .chain(peers)
        .flat_map(|renderer| renderer.counts(suite, scene).iter().copied())
        .collect();
    counts.sort_unstable();
    counts.dedup();
    counts
}

/// A word of a command with its placeholders replaced; `None` if nothing is left of a placeholder that was a word of
/// its own. Values are not looked at again: a file called `{out}` is a file.
fn fill_in(word: &str, values: &HashMap<&str, OsString>) -> Option<OsString> {
    let mut filled = OsString::new();
    let mut rest = word;
    while let Some(start) = rest.find('{') {
        filled.push(&rest[..start]);
        rest = &rest[start..];
        let end = rest.find('}').map_or(rest.len(), |end| end + 1);
        match values.get(&rest[..end]) {
            Some(value) => {
                filled.push(value);
                rest = &rest[end..];
            }
            None => {
                filled.push("{");
                rest = &rest[1..];
            }
        }
    }
    filled.push(rest);
    (!filled.is_empty() || word.is_empty()).then_some(filled)
}

/// The first error of our own report.
fn first_error(report: &Value) -> Option<String> {
    let findings = report["findings"].as_array()?;
    let error = findings
        .iter()
        .find(|finding| finding["severity"] != "warning")?;
    error["message"].as_str().map(str::to_owned)
}

impl Run {
    fn new(scene: &Scene, renderer: Renderer<'_>, spp: u32, seed: u32) -> Self {
        Self {
            scene: scene.name.clone(),
            renderer: renderer.name().to_owned(),
            spp,
            seed,
            wall_seconds: None,
            cpu_seconds: None,
            load_seconds: None,
            peak_memory_bytes: None,
            mse: None,
            relmse: None,
            variance: None,
            mean_ratio: None,
            failure: None,
            remark: None,
        }
    }

    /// For people, while they wait.
    fn text(&self) -> String {
        let head = format!(
            "{}: {} at {} spp, seed {}",
            self.scene, self.renderer, self.spp, self.seed
        );
        if let Some(why) = &self.failure {
            return format!("{head}: failed: {why}");
        }
        let cpu = self
            .cpu_seconds
            .map_or("unknown".to_owned(), |cpu| format!("{cpu:.2} s"));
        let mse = self.mse.unwrap_or(f64::NAN);
        format!("{head}: {cpu} of processors, MSE {mse:.3e}")
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;
    use std::ffi::OsString;

    use super::fill_in;

    #[test]
    fn placeholders_are_replaced_once_and_empty_words_vanish() {
        let values: HashMap<&str, OsString> =
            [("{out}", "a {spp}.exr"), ("{spp}", "4"), ("{quick}", "")]
                .map(|(name, value)| (name, value.into()))
                .into();
        let filled = |word| fill_in(word, &values);
        assert_eq!(filled("{out}"), Some("a {spp}.exr".into()));
        assert_eq!(
            filled("--out={out}:{spp}"),
            Some("--out=a {spp}.exr:4".into())
        );
        assert_eq!(filled("{quick}"), None);
        assert_eq!(filled(""), Some("".into()));
        assert_eq!(filled("${HOME} {spp"), Some("${HOME} {spp".into()));
    }
}
