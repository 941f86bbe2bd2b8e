//! Rays per second on one thread: the nearest hit and any hit, of rays of a camera and of rays that have little to do
//! with each other. `docs/bench/rays.md` has figures.

mod common;

use common::{MODELS, Model, hierarchy};
use divan::Bencher;
use divan::counter::ItemsCount;
use tyndall::accel::Bvh;
use tyndall::math::{Bounds3, Ray, Vec3};
use tyndall::sampling::rng::Rng;
use tyndall::sampling::warp::uniform_sphere;

const N_SIDE: usize = 500;

fn main() {
    divan::main();
}

fn run(bencher: Bencher<'_, '_>, rays: &[Ray], is_hit: impl Fn(&Ray) -> bool + Sync) {
    bencher
        .counter(ItemsCount::new(rays.len()))
        .bench_local(|| rays.iter().filter(|ray| is_hit(ray)).count());
}

fn closest(bvh: &Bvh, ray: &Ray) -> bool {
    bvh.closest(ray, f32::INFINITY, |_, hit| Some(*hit), |_, _, _| None)
        .is_some()
}

fn any(bvh: &Bvh, ray: &Ray) -> bool {
    bvh.any(ray, f32::INFINITY, |_, _| true, |_, _| false)
}

#[divan::bench(args = MODELS)]
fn coherent_closest(bencher: Bencher<'_, '_>, model: &Model) {
    let bvh = hierarchy(&model.triangles());
    let rays = coherent_rays(bvh.bounds(), N_SIDE);
    run(bencher, &rays, |ray| closest(&bvh, ray));
}

#[divan::bench(args = MODELS)]
fn incoherent_closest(bencher: Bencher<'_, '_>, model: &Model) {
    let bvh = hierarchy(&model.triangles());
    let rays = incoherent_rays(&bvh, N_SIDE * N_SIDE);
    run(bencher, &rays, |ray| closest(&bvh, ray));
}

#[divan::bench(args = MODELS)]
fn coherent_any(bencher: Bencher<'_, '_>, model: &Model) {
    let bvh = hierarchy(&model.triangles());
    let rays = coherent_rays(bvh.bounds(), N_SIDE);
    run(bencher, &rays, |ray| any(&bvh, ray));
}

#[divan::bench(args = MODELS)]
fn incoherent_any(bencher: Bencher<'_, '_>, model: &Model) {
    let bvh = hierarchy(&model.triangles());
    let rays = incoherent_rays(&bvh, N_SIDE * N_SIDE);
    run(bencher, &rays, |ray| any(&bvh, ray));
}

/// Rays of a pinhole camera before the middle of the box, line by line.
fn coherent_rays(bounds: Bounds3, n_side: usize) -> Vec<Ray> {
    let center = bounds.center();
    let radius = bounds.extent().length() * 0.5;
    let o = center + Vec3::new(0.7, -0.9, 0.6).normalize() * (1.5 * radius);
    let forward = (center - o).normalize();
    let right = forward.cross(Vec3::new(0.0, 0.0, 1.0)).normalize();
    let up = right.cross(forward);
    let place = |k: usize| (k as f32 + 0.5) / n_side as f32 - 0.5;
    (0..n_side * n_side)
        .map(|k| {
            let d = forward + right * place(k % n_side) + up * place(k / n_side);
            Ray {
                o,
                d: d.normalize(),
                time: 0.0,
            }
        })
        .collect()
}

/// Rays that start a little off the places that random rays meet, and go anywhere.
fn incoherent_rays(bvh: &Bvh, n: usize) -> Vec<Ray> {
    let camera = coherent_rays(bvh.bounds(), 1000);
    let mut rng = Rng::new(7);
    let mut rays = Vec::with_capacity(n);
    for _ in 0..50 * n {
        if rays.len() == n {
            break;
        }
        let ray = camera[rng.next_u32() as usize % camera.len()];
        let found = bvh.closest(&ray, f32::INFINITY, |_, _| Some(()), |_, _, _| None);
        if let Some((t, ())) = found {
            let d = uniform_sphere(rng.uniform2());
            let o = ray.at(t * 0.9999);
            rays.push(Ray { o, d, time: 0.0 });
        }
    }
    rays
}
