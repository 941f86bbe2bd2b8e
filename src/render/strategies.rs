//! Pictures of single strategies of bidirectional path tracing: films like the main one, to which the same samples
//! bring what one strategy found. Bright samples are not clamped, for that belongs to the sum of all strategies.

use crate::film::{Film, FilmBlock, FilmDesc};
use crate::image::PixelRect;
use crate::integrator::bdpt::{Contribution, Strategy, Visualized};
use crate::render::Job;
use crate::spectrum::Rgb;

/// The films of all strategies of a job, if they are wanted.
pub(super) struct StrategyFilms {
    shown: Visualized,
    desc: FilmDesc,
    n_strategies: usize,
}

/// What the strategies bring to a block.
pub(super) struct StrategyBlocks<'a> {
    films: &'a StrategyFilms,
    blocks: Vec<FilmBlock>,
    /// What they found along the current camera path.
    found: Vec<Rgb>,
}

impl StrategyFilms {
    pub(super) fn new(job: &Job, shown: Visualized) -> Self {
        Self {
            shown,
            desc: FilmDesc {
                max_sample_luminance: f32::INFINITY,
                ..job.film.clone()
            },
            n_strategies: job.visualized_strategies().len(),
        }
    }

    pub(super) fn start(&self) -> Vec<Film> {
        vec![Film::new(self.desc.clone()); self.n_strategies]
    }

    pub(super) fn start_block(&self, block: PixelRect) -> StrategyBlocks<'_> {
        StrategyBlocks {
            films: self,
            blocks: vec![self.desc.start_block(block); self.n_strategies],
            found: vec![Rgb::BLACK; self.n_strategies],
        }
    }
}

impl StrategyBlocks<'_> {
    pub(super) fn count_light_path(&mut self) {
        self.blocks.iter_mut().for_each(FilmBlock::count_light_path);
    }

    /// Adds what a light path brings to the film. False if that is not finite.
    pub(super) fn add_splat(
        &mut self,
        strategy: Strategy,
        raster: [f64; 2],
        found: &Contribution,
    ) -> bool {
        let rgb = self.films.shown.of(found);
        if rgb.is_finite() {
            self.blocks[strategy.index()].add_splat(&self.films.desc, raster, rgb);
        }
        rgb.is_finite()
    }

    /// Notes what a strategy finds along the current camera path, which [`Self::add_sample`] or
    /// [`Self::leave_out_sample`] ends.
    pub(super) fn note(&mut self, strategy: Strategy, found: &Contribution) {
        self.found[strategy.index()] += self.films.shown.of(found);
    }

    /// False if something noted is not finite.
    pub(super) fn add_sample(&mut self, raster: [f64; 2], weight: f32) -> bool {
        let mut is_good = true;
        for (block, found) in self.blocks.iter_mut().zip(&mut self.found) {
            let rgb = std::mem::take(found);
            if rgb.is_finite() {
                block.add_sample(&self.films.desc, raster, rgb, weight);
            } else {
                is_good = false;
            }
        }
        is_good
    }

    pub(super) fn leave_out_sample(&mut self) {
        self.found.fill(Rgb::BLACK);
    }

    pub(super) fn into_blocks(self) -> Vec<FilmBlock> {
        self.blocks
    }
}
