//! Sample numbers: the dimensions that a path of a few bounces draws, by each kind of sampler.

use divan::Bencher;
use divan::counter::ItemsCount;
use tyndall::sampler::{Sampler, SamplerKind};

/// Paths of one pixel.
const PATHS: u32 = 64;
/// Pairs that a path draws.
const PAIRS: u32 = 16;

fn main() {
    divan::main();
}

fn kinds() -> [SamplerKind; 6] {
    [
        SamplerKind::ZeroTwo,
        SamplerKind::Sobol,
        SamplerKind::Halton,
        SamplerKind::max_min_dist(PATHS),
        SamplerKind::grid(PATHS, true),
        SamplerKind::Random,
    ]
}

#[divan::bench(args = kinds())]
fn pairs(bencher: Bencher<'_, '_>, kind: SamplerKind) {
    bencher.counter(ItemsCount::new(PATHS * PAIRS)).bench(|| {
        let mut sum = 0.0;
        for sample in 0..PATHS {
            let mut sampler = Sampler::of_kind(kind, 0, [17, 4], sample);
            for _ in 0..PAIRS {
                let [x, y] = sampler.get_2d();
                sum += x + y;
            }
        }
        sum
    });
}
