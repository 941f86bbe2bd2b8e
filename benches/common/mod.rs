//! Meshes of the benchmarks of ray queries: waves made here, and the car of the bmw-m6 example scene where it is there.

use std::fmt::{Display, Formatter};

use tyndall::accel::{Bvh, Item, Key, push_item};
use tyndall::math::{Bounds3, Point3};
use tyndall::shape::ply::decode;

/// Three corners.
pub(crate) type Triangle = [[f32; 3]; 3];

/// Which mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Model {
    /// A wavy grid of 400 000 triangles.
    Waves,
    /// 0.8 million triangles in 114 files.
    BmwM6,
}

pub(crate) const MODELS: [Model; 2] = [Model::Waves, Model::BmwM6];

impl Display for Model {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Waves => "waves",
            Self::BmwM6 => "bmw-m6",
        })
    }
}

impl Model {
    /// Its triangles; none where the files are missing.
    pub(crate) fn triangles(self) -> Vec<Triangle> {
        match self {
            Self::Waves => waves(447),
            Self::BmwM6 => bmw_m6(),
        }
    }
}

fn waves(side: u32) -> Vec<Triangle> {
    let vertex = |x: u32, y: u32| {
        let (x, y) = (x as f32 / side as f32, y as f32 / side as f32);
        let height = (20.0 * x).sin() * (30.0 * y).cos() + 0.3 * (200.0 * x * y).sin();
        [x, y, 0.05 * height]
    };
    let cells = (0..side * side).map(|i| (i % side, i / side));
    cells
        .flat_map(|(x, y)| {
            let [a, b] = [vertex(x, y), vertex(x + 1, y)];
            let [c, d] = [vertex(x, y + 1), vertex(x + 1, y + 1)];
            [[a, b, c], [b, d, c]]
        })
        .collect()
}

fn bmw_m6() -> Vec<Triangle> {
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../shared/scenes/bmw-m6/geometry"
    );
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<_> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    let files = paths.iter().filter_map(|path| std::fs::read(path).ok());
    let meshes = files.filter_map(|bytes| decode(&bytes).ok());
    meshes
        .flat_map(|mesh| {
            let positions = mesh.positions;
            let corners = move |t: [u32; 3]| t.map(|v| positions[v as usize]);
            mesh.triangles.into_iter().map(corners)
        })
        .collect()
}

/// The hierarchy over triangles.
pub(crate) fn hierarchy(triangles: &[Triangle]) -> Bvh {
    let mut items = Vec::new();
    for (triangle, i) in triangles.iter().zip(0..) {
        let corners = triangle.iter().map(|&p| Point3::from(p));
        let bounds = corners.fold(Bounds3::EMPTY, Bounds3::with_point);
        push_item(&mut items, Item::triangle(&bounds, [0, i]));
    }
    Bvh::build(items, |key: Key| triangles[key[1] as usize])
}
