//! Grid media: looking up a density, and following a ray through 64³ voxels of thin and thick vapour.

use divan::Bencher;
use glam::{DVec3, Vec3A};
use tyndall::math::{Point3, Ray, Transform, Vec3};
use tyndall::medium::{DensityGrid, GridMedium, Medium};
use tyndall::sampling::rng::Rng;
use tyndall::scatter::HenyeyGreenstein;
use tyndall::spectrum::Rgb;

const SIDE: usize = 64;
const RAYS: usize = 1024;

fn main() {
    divan::main();
}

/// A ball of waves, empty outside: half of the voxels hold nothing, as in clouds.
fn grid() -> DensityGrid {
    let mut values = Vec::with_capacity(SIDE.pow(3));
    for i in 0..SIDE.pow(3) {
        let p = [i % SIDE, i / SIDE % SIDE, i / SIDE.pow(2)].map(|c| c as f32 / SIDE as f32 - 0.5);
        let radius = p.iter().map(|c| c * c).sum::<f32>().sqrt();
        let waves = (40.0 * p[0]).sin() * (30.0 * p[1]).cos() * (20.0 * p[2]).sin();
        values.push((0.5 - radius).max(0.0) * (1.0 + waves).max(0.0));
    }
    DensityGrid::new([SIDE; 3], &values)
}

fn medium(sigma: f32) -> Medium {
    Medium::Grid(Box::new(GridMedium::new(
        grid(),
        &Transform::scale_translate(1.0, DVec3::ZERO),
        Rgb::splat(0.1 * sigma),
        Rgb::splat(sigma),
        HenyeyGreenstein { g: 0.5 },
    )))
}

/// Rays from one side of the unit cube to points on the other.
fn rays() -> Vec<(Ray, f32)> {
    let mut rng = Rng::new(1);
    let ray = |_| {
        let [a, b] = [rng.uniform2(), rng.uniform2()];
        let (o, end) = (Vec3::new(a[0], a[1], 0.0), Vec3::new(b[0], b[1], 1.0));
        let d = end - o;
        let ray = Ray {
            o: Point3::new(a[0], a[1], 0.0),
            d: d.normalize(),
            time: 0.0,
        };
        (ray, d.length())
    };
    (0..RAYS).map(ray).collect()
}

#[divan::bench]
fn density(bencher: Bencher<'_, '_>) {
    let grid = grid();
    let mut rng = Rng::new(2);
    let side = SIDE as f32;
    let points: Vec<Vec3A> = (0..RAYS)
        .map(|_| Vec3A::new(rng.uniform(), rng.uniform(), rng.uniform()) * side)
        .collect();
    bencher
        .counter(RAYS)
        .bench(|| points.iter().map(|&p| grid.density(p)).sum::<f32>());
}

#[divan::bench(args = [2.0, 200.0])]
fn sample(bencher: Bencher<'_, '_>, sigma: f32) {
    let (medium, rays) = (medium(sigma), rays());
    bencher.counter(RAYS).bench(|| {
        let mut rng = Rng::new(3);
        for (ray, t_max) in &rays {
            divan::black_box(medium.sample(ray, *t_max, Rgb::ONE, None, &mut rng));
        }
    });
}

#[divan::bench(args = [2.0, 200.0])]
fn transmittance(bencher: Bencher<'_, '_>, sigma: f32) {
    let (medium, rays) = (medium(sigma), rays());
    bencher.counter(RAYS).bench(|| {
        let mut rng = Rng::new(4);
        for (ray, t_max) in &rays {
            divan::black_box(medium.transmittance(ray, *t_max, &mut rng));
        }
    });
}
