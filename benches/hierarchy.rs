//! Triangles per second that the hierarchy is built over, on all threads. `docs/bench/rays.md` has figures.

mod common;

use common::{MODELS, Model, hierarchy};
use divan::Bencher;
use divan::counter::ItemsCount;

fn main() {
    divan::main();
}

#[divan::bench(args = MODELS)]
fn build(bencher: Bencher<'_, '_>, model: &Model) {
    let triangles = model.triangles();
    bencher
        .counter(ItemsCount::new(triangles.len()))
        .bench_local(|| hierarchy(&triangles));
}
