//! Heights over a grid. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer nu`, `nv` | required | heights along x and y, at least 2 each |
//! | `float Pz` | required | nu · nv heights, x fastest |
//!
//! The grid spans the unit square; (u, v) = (x, y). Faceted; the normal is +z. Cells are cut from (u, v) to
//! (u + 1, v + 1).

use crate::shape::Mesh;

/// The mesh of a field of `heights`, `nu` by `nv` of them, both at least 2, in object space.
pub fn heightfield(heights: &[f32], nu: usize, nv: usize) -> Mesh {
    debug_assert!(nu >= 2 && nv >= 2 && heights.len() == nu * nv);
    let at = |i: usize, n: usize| i as f32 / (n - 1) as f32;
    let uvs: Vec<[f32; 2]> = (0..nu * nv)
        .map(|k| [at(k % nu, nu), at(k / nu, nv)])
        .collect();
    let positions = uvs.iter().zip(heights);
    Mesh {
        positions: positions.map(|([x, y], z)| [*x, *y, *z]).collect(),
        triangles: grid_triangles(nu, nv),
        uvs,
        ..Mesh::default()
    }
}

/// Two triangles for each cell of a grid of `nu` by `nv` vertices, u fastest, with the diagonal (0, 0)–(1, 1).
pub(super) fn grid_triangles(nu: usize, nv: usize) -> Vec<[u32; 3]> {
    let at = |i: usize, j: usize| (i + j * nu) as u32;
    (0..nv - 1)
        .flat_map(|j| (0..nu - 1).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b] = [at(i, j), at(i + 1, j)];
            let [d, c] = [at(i, j + 1), at(i + 1, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}
