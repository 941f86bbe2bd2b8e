//! What the runs say: figures for each renderer and scene, ratios pair by pair, and what follows from ratios that
//! others measured.

use serde::Serialize;

use super::contest::Run;
use super::fit::{Convergence, Point, geometric_mean, mean, median};
use super::suite::{KnownFigures, OURS, Scene, Suite};

/// One scene.
#[derive(Serialize, Clone, PartialEq, Debug)]
pub(super) struct SceneSummary {
    pub(super) scene: String,
    pub(super) reference_noise: Option<f64>,
    pub(super) renderers: Vec<RendererSummary>,
    pub(super) ratios: Vec<SceneRatios>,
}

/// One renderer on one scene.
#[derive(Serialize, Clone, PartialEq, Debug)]
pub(super) struct RendererSummary {
    pub(super) renderer: String,
    /// By growing number of samples; without those that failed.
    pub(super) figures: Vec<Figures>,
    /// `None` if there is one sample count.
    pub(super) convergence: Option<Convergence>,
    /// Why runs failed, each reason once.
    pub(super) failures: Vec<String>,
    /// What was left out of the pictures, each once.
    pub(super) remarks: Vec<String>,
}

/// The runs of one renderer on one scene at one sample count.
#[derive(Serialize, Clone, Copy, PartialEq, Debug)]
pub(super) struct Figures {
    pub(super) spp: u32,
    pub(super) n_runs: usize,
    /// Medians.
    pub(super) wall_seconds: Option<f64>,
    pub(super) cpu_seconds: Option<f64>,
    pub(super) load_seconds: Option<f64>,
    pub(super) peak_memory_bytes: Option<f64>,
    /// Means.
    pub(super) mse: f64,
    pub(super) relmse: Option<f64>,
    pub(super) mean_ratio: Option<f64>,
    /// 1 / (CPU seconds x MSE).
    pub(super) efficiency: Option<f64>,
    /// The same of relMSE.
    pub(super) relative_efficiency: Option<f64>,
}

/// Whom we are compared with.
#[derive(Serialize, Clone, PartialEq, Eq, Debug)]
pub(super) struct Rival {
    pub(super) over: String,
    /// The peer that the known renderer was measured beside; `None` if it ran here.
    pub(super) derived_via: Option<String>,
}

/// Ours over theirs. For time, memory and error less than 1 is better; for efficiencies more.
#[derive(Serialize, Clone, Copy, PartialEq, Debug)]
pub(super) struct Ratios {
    pub(super) cpu: Option<f64>,
    pub(super) memory: Option<f64>,
    pub(super) mse: Option<f64>,
    pub(super) relmse: Option<f64>,
    pub(super) efficiency: Option<f64>,
    pub(super) relative_efficiency: Option<f64>,
}

/// Those of one scene.
#[derive(Serialize, Clone, PartialEq, Debug)]
pub(super) struct SceneRatios {
    #[serde(flatten)]
    pub(super) rival: Rival,
    /// The sample count of the comparison: the greatest that both have.
    pub(super) spp: u32,
    #[serde(flatten)]
    pub(super) ratios: Ratios,
}

/// Geometric means over the scenes that have the ratio.
#[derive(Serialize, Clone, PartialEq, Debug)]
pub(super) struct MeanRatios {
    #[serde(flatten)]
    pub(super) rival: Rival,
    pub(super) n_scenes: usize,
    #[serde(flatten)]
    pub(super) ratios: Ratios,
}

/// Sums up each scene.
pub(super) fn summarize(suite: &Suite, scenes: &[&Scene], runs: &[Run]) -> Vec<SceneSummary> {
    let summary = |scene: &&Scene| {
        let names = suite.peers.iter().map(|peer| peer.name.as_str());
        let renderers: Vec<RendererSummary> = std::iter::once(OURS)
            .chain(names)
            .map(|name| RendererSummary::new(name, scene, runs))
            .collect();
        let ratios = ratios(suite, scene, &renderers);
        SceneSummary {
            scene: scene.name.clone(),
            reference_noise: scene.reference_noise,
            renderers,
            ratios,
        }
    };
    scenes.iter().map(summary).collect()
}

/// Geometric means of the ratios over each renderer, in the order in which they first come up.
pub(super) fn means(scenes: &[SceneSummary]) -> Vec<MeanRatios> {
    let all = || scenes.iter().flat_map(|scene| &scene.ratios);
    let mut rivals: Vec<&Rival> = Vec::new();
    for row in all() {
        if !rivals.contains(&&row.rival) {
            rivals.push(&row.rival);
        }
    }
    let mean_ratios = |rival: &Rival| {
        let rows = || all().filter(move |row| row.rival == *rival);
        let of = |ratio: fn(&Ratios) -> Option<f64>| {
            geometric_mean(rows().filter_map(|row| ratio(&row.ratios)))
        };
        MeanRatios {
            rival: rival.clone(),
            n_scenes: rows().count(),
            ratios: Ratios::each(of),
        }
    };
    rivals.into_iter().map(mean_ratios).collect()
}

impl RendererSummary {
    fn new(name: &str, scene: &Scene, runs: &[Run]) -> Self {
        let own = || {
            runs.iter()
                .filter(|run| run.renderer == name && run.scene == scene.name)
        };
        let mut counts: Vec<u32> = own().map(|run| run.spp).collect();
        counts.sort_unstable();
        counts.dedup();
        let mut points: Vec<Point> = own()
            .filter_map(|run| {
                Some(Point {
                    spp: run.spp,
                    mse: run.mse?,
                    variance: run.variance,
                })
            })
            .collect();
        // A renderer without seeds makes the same picture again, which makes nothing more certain.
        points.dedup();
        let texts = |text: fn(&Run) -> Option<&String>| {
            let mut texts: Vec<String> = own().filter_map(text).cloned().collect();
            texts.sort();
            texts.dedup();
            texts
        };
        Self {
            renderer: name.to_owned(),
            figures: counts
                .into_iter()
                .filter_map(|spp| Figures::new(spp, own().filter(move |run| run.spp == spp)))
                .collect(),
            convergence: Convergence::of(&points, scene.reference_noise),
            failures: texts(|run| run.failure.as_ref()),
            remarks: texts(|run| run.remark.as_ref()),
        }
    }

    /// The figures at a sample count.
    pub(super) fn at(&self, spp: u32) -> Option<&Figures> {
        self.figures.iter().find(|figures| figures.spp == spp)
    }
}

impl Figures {
    /// `None` if no run was measured.
    fn new<'a>(spp: u32, runs: impl Iterator<Item = &'a Run> + Clone) -> Option<Self> {
        let runs = runs.filter(|run| run.mse.is_some());
        let middle = |value: fn(&Run) -> Option<f64>| median(runs.clone().filter_map(value));
        let average = |value: fn(&Run) -> Option<f64>| mean(runs.clone().filter_map(value));
        let mse = average(|run| run.mse)?;
        let relmse = average(|run| run.relmse);
        let cpu_seconds = middle(|run| run.cpu_seconds);
        let efficiency = |error: f64| {
            let cost = cpu_seconds? * error;
            // Neither a renderer without an error nor one that takes no time is infinitely good.
            (cost > 0.0).then(|| cost.recip())
        };
        Some(Self {
            spp,
            n_runs: runs.clone().count(),
            wall_seconds: middle(|run| run.wall_seconds),
            cpu_seconds,
            load_seconds: middle(|run| run.load_seconds),
            peak_memory_bytes: middle(|run| run.peak_memory_bytes.map(|bytes| bytes as f64)),
            mse,
            relmse,
            mean_ratio: average(|run| run.mean_ratio),
            efficiency: efficiency(mse),
            relative_efficiency: relmse.and_then(efficiency),
        })
    }
}

/// Ours over each peer, and over the renderers known beside it.
fn ratios(suite: &Suite, scene: &Scene, renderers: &[RendererSummary]) -> Vec<SceneRatios> {
    let Some((ours, _)) = renderers.split_first() else {
        return Vec::new();
    };
    let mut all = Vec::new();
    for peer in &suite.peers {
        let theirs = renderers
            .iter()
            .find(|renderer| renderer.renderer == peer.name);
        let common = theirs.and_then(|theirs| {
            let counts = theirs.figures.iter().rev();
            let mut pairs = counts.map(|their| Some((ours.at(their.spp)?, their)));
            pairs.find_map(|pair| pair)
        });
        let Some((our, their)) = common else { continue };
        let mut push = |over: &str, derived_via: Option<&str>, ratios: Ratios| {
            all.push(SceneRatios {
                rival: Rival {
                    over: over.to_owned(),
                    derived_via: derived_via.map(str::to_owned),
                },
                spp: our.spp,
                ratios,
            });
        };
        let measured = Ratios::measured(our, their);
        push(&peer.name, None, measured);
        for known in &peer.known {
            if let Some(figures) = known.figures.get(&scene.name) {
                let derived = measured.over_known(figures);
                push(&known.name, Some(&peer.name), derived);
            }
        }
    }
    all
}

impl Ratios {
    /// What `ratio` makes of each of them, which it is told how to find.
    fn each(ratio: impl Fn(fn(&Self) -> Option<f64>) -> Option<f64>) -> Self {
        Self {
            cpu: ratio(|ratios| ratios.cpu),
            memory: ratio(|ratios| ratios.memory),
            mse: ratio(|ratios| ratios.mse),
            relmse: ratio(|ratios| ratios.relmse),
            efficiency: ratio(|ratios| ratios.efficiency),
            relative_efficiency: ratio(|ratios| ratios.relative_efficiency),
        }
    }

    fn measured(ours: &Figures, theirs: &Figures) -> Self {
        let ratio = |value: fn(&Figures) -> Option<f64>| quotient(value(ours)?, value(theirs)?);
        Self {
            cpu: ratio(|figures| figures.cpu_seconds),
            memory: ratio(|figures| figures.peak_memory_bytes),
            mse: ratio(|figures| Some(figures.mse)),
            relmse: ratio(|figures| figures.relmse),
            efficiency: ratio(|figures| figures.efficiency),
            relative_efficiency: ratio(|figures| figures.relative_efficiency),
        }
    }

    /// Ours over the peer, divided by the known renderer over the peer.
    fn over_known(&self, known: &KnownFigures) -> Self {
        let over = |ours: Option<f64>, known: Option<[f64; 2]>| {
            let [third, peer] = known?;
            quotient(ours?, third / peer)
        };
        let cost = match (known.cpu, known.mse) {
            (Some(cpu), Some(mse)) => Some([cpu[0] * mse[0], cpu[1] * mse[1]]),
            _ => None,
        };
        Self {
            cpu: over(self.cpu, known.cpu),
            memory: over(self.memory, known.memory),
            mse: over(self.mse, known.mse),
            relmse: None,
            // The known efficiency is the inverse of the cost.
            efficiency: over(self.efficiency, cost.map(|[third, peer]| [peer, third])),
            relative_efficiency: None,
        }
    }
}

/// `None` if it is no number above 0.
fn quotient(a: f64, b: f64) -> Option<f64> {
    let quotient = a / b;
    (quotient.is_finite() && quotient > 0.0).then_some(quotient)
}

#[cfg(test)]
mod tests {
    use super::{
        Figures, KnownFigures, MeanRatios, Ratios, Rival, SceneRatios, SceneSummary, means,
    };

    fn figures(cpu: f64, mse: f64, memory: f64) -> Figures {
        Figures {
            spp: 16,
            n_runs: 1,
            wall_seconds: None,
            cpu_seconds: Some(cpu),
            load_seconds: None,
            peak_memory_bytes: Some(memory),
            mse,
            relmse: None,
            mean_ratio: None,
            efficiency: Some(1.0 / (cpu * mse)),
            relative_efficiency: None,
        }
    }

    #[test]
    fn ratios_over_a_known_renderer_follow_from_those_over_the_peer() {
        let measured = Ratios::measured(&figures(2.0, 0.5, 100.0), &figures(8.0, 1.0, 400.0));
        assert_eq!((measured.cpu, measured.mse), (Some(0.25), Some(0.5)));
        assert_eq!(
            (measured.memory, measured.efficiency),
            (Some(0.25), Some(8.0))
        );
        // On another machine the known one takes half the time of the peer, with four times its error.
        let known = KnownFigures {
            cpu: Some([30.0, 60.0]),
            memory: None,
            mse: Some([0.04, 0.01]),
        };
        let derived = measured.over_known(&known);
        assert_eq!((derived.cpu, derived.mse), (Some(0.5), Some(0.125)));
        // Its efficiency is half the peer's.
        assert_eq!((derived.memory, derived.efficiency), (None, Some(16.0)));
    }

    #[test]
    fn means_are_geometric_and_by_renderer() {
        let row = |via: Option<&str>, efficiency: f64| SceneRatios {
            rival: Rival {
                over: "other".to_owned(),
                derived_via: via.map(str::to_owned),
            },
            spp: 16,
            ratios: Ratios {
                efficiency: Some(efficiency),
                ..Ratios::measured(&figures(1.0, 1.0, 1.0), &figures(1.0, 1.0, 1.0))
            },
        };
        let scene = |efficiency: f64| SceneSummary {
            scene: String::new(),
            reference_noise: None,
            renderers: Vec::new(),
            ratios: vec![row(Some("a"), efficiency), row(Some("b"), 3.0)],
        };
        let all = means(&[scene(2.0), scene(8.0)]);
        let of = |mean: &MeanRatios| mean.ratios.efficiency.expect("all scenes have it");
        let [by_a, by_b] = &all[..] else {
            panic!("{all:?}");
        };
        assert_eq!((by_a.n_scenes, by_b.n_scenes), (2, 2));
        assert_eq!(by_a.rival.derived_via.as_deref(), Some("a"));
        assert!((of(by_a) - 4.0).abs() < 1e-12, "{by_a:?}");
        assert!((of(by_b) - 3.0).abs() < 1e-12, "{by_b:?}");
    }
}
