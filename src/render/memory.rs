//! What rendering takes in memory, known before it starts.

use crate::film::Film;
use crate::integrator::Integrator;
use crate::render::{Job, mlt, sppm};

impl Job {
    /// An estimate of the bytes that [`render`](crate::render::render) takes on the current rayon thread pool, finished
    /// pictures included. What grows with the number of pixels, photons or mutations is counted; the world, which is
    /// there already, and the blocks in flight are not.
    pub fn bytes_needed(&self) -> u128 {
        let crop = self.film.crop;
        let n_pixels = crop.width as u128 * crop.height as u128;
        // A picture comes after its sums, so that both exist at once.
        let film = Film::BYTES_PER_PIXEL + size_of::<[f32; 3]>();
        let film = n_pixels * film as u128;
        let splats = n_pixels * Film::SPLAT_BYTES_PER_PIXEL as u128;
        match &self.integrator {
            Integrator::Path(_)
            | Integrator::VolPath(_)
            | Integrator::Direct(_)
            | Integrator::AmbientOcclusion(_) => film,
            Integrator::Sppm(sppm) => sppm::bytes_needed(self, sppm),
            Integrator::Mlt(settings) => {
                film + splats + mlt::bytes_needed(self, settings, rayon::current_num_threads())
            }
            Integrator::Bdpt(_) => {
                let strategies = self.visualized_strategies();
                let n_splatted = strategies.iter().filter(|strategy| strategy.t == 1).count();
                film * (1 + strategies.len() as u128) + splats * (1 + n_splatted as u128)
            }
        }
    }
}
