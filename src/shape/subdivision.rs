//! Loop subdivision of triangle meshes, with vertices and normals of the limit surface.
//!
//! The rules are those of Loop (1987, *Smooth Subdivision Surfaces Based on Triangles*) with the weights of Warren;
//! boundaries are cubic B-splines, and limit tangents are those of Hoppe et al. (1994, *Piecewise Smooth Surface
//! Reconstruction*).

use std::f64::consts::{PI, TAU};
use std::fmt;

use glam::DVec3;

use crate::shape::Mesh;

/// Why a mesh cannot be subdivided. Vertices are numbered as given.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SubdivisionError {
    /// More than two triangles share the edge between two vertices.
    CrowdedEdge([u32; 2]),
    /// Two triangles run through the edge between two vertices in the same direction.
    TurnedEdge([u32; 2]),
    /// A triangle uses a vertex twice.
    RepeatedVertex {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex.
        vertex: u32,
    },
}

impl fmt::Display for SubdivisionError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::CrowdedEdge([a, b]) => {
                write!(
                    f,
                    "more than two triangles share the edge between vertices {a} and {b}"
                )
            }
            Self::TurnedEdge([a, b]) => write!(
                f,
                "the triangles at the edge between vertices {a} and {b} have opposite windings"
            ),
            Self::RepeatedVertex { triangle, vertex } => {
                write!(f, "triangle {triangle} uses vertex {vertex} twice")
            }
        }
    }
}

/// Subdivides a mesh `levels` times and moves its vertices to the limit surface. The result has 4^`levels` times as
/// many triangles, in object space.
///
/// All indices in `triangles` must be below `positions.len()`. Vertices at which several fans of triangles touch are
/// split, one for each fan; unused ones are left out. Normals are cross products of limit tangents, not normalised,
/// which weighs them in interpolation; as in pbrt-v3 they point to the side from which triangles wind clockwise.
///
/// # Errors
///
/// The triangles do not form a surface with two sides.
pub fn loop_limit(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    levels: u32,
) -> Result<Mesh, SubdivisionError> {
    let mut surface = Surface::new(positions, triangles)?;
    for _ in 0..levels {
        surface = surface.refined();
    }
    let fans = surface.fans();
    surface.move_to_limit(&fans);
    let normals = surface.normals(&fans);
    let narrow = |v: &DVec3| v.as_vec3().to_array();
    Ok(Mesh {
        positions: surface.positions.iter().map(narrow).collect(),
        normals: normals.iter().map(narrow).collect(),
        triangles: surface.triangles,
        ..Mesh::default()
    })
}

/// Weight of each neighbour of a vertex inside the surface.
fn beta(valence: usize) -> f64 {
    if valence == 3 {
        3.0 / 16.0
    } else {
        3.0 / (8.0 * valence as f64)
    }
}

/// Half edge `3 t + k` of triangle t runs from its corner k to the next one.
const fn next(half: u32) -> u32 {
    if half % 3 == 2 { half - 2 } else { half + 1 }
}

const fn previous(half: u32) -> u32 {
    if half.is_multiple_of(3) {
        half + 2
    } else {
        half - 1
    }
}

/// No half edge.
const NONE: u32 = u32::MAX;

/// A surface of triangles: every edge has one or two of them, every vertex one fan.
struct Surface {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// The half edge on the other side of each, or `NONE` on the boundary.
    twins: Vec<u32>,
}

/// The half edge on the other side of each; an error names the edge by the given vertices.
fn twins_of(triangles: &[[u32; 3]]) -> Result<Vec<u32>, SubdivisionError> {
    let ends = |half: u32| {
        let triangle = triangles[half as usize / 3];
        [
            triangle[half as usize % 3],
            triangle[next(half) as usize % 3],
        ]
    };
    let key = |half: u32| {
        let [a, b] = ends(half);
        [a.min(b), a.max(b)]
    };
    let mut halves: Vec<([u32; 2], u32)> = (0..3 * triangles.len() as u32)
        .map(|half| (key(half), half))
        .collect();
    // As numbers they are compared at once.
    halves.sort_unstable_by_key(|&([a, b], half)| {
        (u128::from(a) << 64) | (u128::from(b) << 32) | u128::from(half)
    });
    let mut twins = vec![NONE; halves.len()];
    for shared in halves.chunk_by(|(a, _), (b, _)| a == b) {
        match *shared {
            [_] => {}
            [(_, a), (_, b)] if ends(a)[0] == ends(b)[1] => {
                (twins[a as usize], twins[b as usize]) = (b, a);
            }
            [(edge, _), _] => return Err(SubdivisionError::TurnedEdge(edge)),
            _ => return Err(SubdivisionError::CrowdedEdge(shared[0].0)),
        }
    }
    Ok(twins)
}

impl Surface {
    fn new(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<Self, SubdivisionError> {
        for (triangle, &[a, b, c]) in triangles.iter().enumerate() {
            if a == b || b == c || c == a {
                let vertex = if a == b { a } else { c };
                return Err(SubdivisionError::RepeatedVertex { triangle, vertex });
            }
        }
        let twins = twins_of(triangles)?;
        let mut surface = Self {
            positions: Vec::new(),
            triangles: vec![[NONE; 3]; triangles.len()],
            twins,
        };
        // A vertex for each fan.
        let n_halves = surface.twins.len() as u32;
        for half in 0..n_halves {
            let (triangle, corner) = (half as usize / 3, half as usize % 3);
            if surface.triangles[triangle][corner] != NONE {
                continue;
            }
            let vertex = surface.positions.len() as u32;
            let given = triangles[triangle][corner] as usize;
            let position = DVec3::from(positions[given].map(f64::from));
            surface.positions.push(position);
            let fan: Vec<u32> = surface.fan(surface.first_of_fan(half)).collect();
            for half in fan {
                surface.triangles[half as usize / 3][half as usize % 3] = vertex;
            }
        }
        Ok(surface)
    }

    fn start(&self, half: u32) -> u32 {
        self.triangles.as_flattened()[half as usize]
    }

    fn position(&self, half: u32) -> DVec3 {
        self.positions[self.start(half) as usize]
    }

    /// The half edge from the same vertex that comes before, clockwise where triangles wind counter-clockwise.
    fn clockwise(&self, half: u32) -> Option<u32> {
        let twin = self.twins[half as usize];
        (twin != NONE).then(|| next(twin))
    }

    /// The half edge of a vertex to start its fan with: on the boundary, the one nothing comes before.
    fn first_of_fan(&self, half: u32) -> u32 {
        let mut first = half;
        while let Some(before) = self.clockwise(first) {
            first = before;
            if first == half {
                break;
            }
        }
        first
    }

    /// The half edges that leave a vertex, counter-clockwise, one for each triangle.
    fn fan(&self, first: u32) -> impl Iterator<Item = u32> {
        let after = move |&half: &u32| {
            let twin = self.twins[previous(half) as usize];
            (twin != NONE && twin != first).then_some(twin)
        };
        std::iter::successors(Some(first), after)
    }

    /// The neighbours of a vertex, counter-clockwise, into `ring`; true if it is on the boundary.
    fn ring(&self, first: u32, ring: &mut Vec<DVec3>) -> bool {
        ring.clear();
        let mut last = first;
        for half in self.fan(first) {
            ring.push(self.position(next(half)));
            last = half;
        }
        let is_boundary = self.twins[first as usize] == NONE;
        if is_boundary {
            ring.push(self.position(previous(last)));
        }
        is_boundary
    }

    /// For every vertex, where its fan starts.
    fn fans(&self) -> Vec<u32> {
        let mut first = vec![NONE; self.positions.len()];
        for half in 0..self.twins.len() as u32 {
            let vertex = self.start(half) as usize;
            // The start of the fan of a boundary vertex is the only one without a twin.
            if first[vertex] == NONE || self.twins[half as usize] == NONE {
                first[vertex] = half;
            }
        }
        first
    }

    /// Each vertex with its neighbours weighed: by `boundary` on the boundary, by a function of the valence inside.
    fn smoothed(&self, fans: &[u32], boundary: f64, inside: impl Fn(usize) -> f64) -> Vec<DVec3> {
        let mut ring = Vec::new();
        let smooth = |(&first, &p): (&u32, &DVec3)| {
            if self.ring(first, &mut ring) {
                let ends = ring[0] + ring[ring.len() - 1];
                return p * (1.0 - 2.0 * boundary) + ends * boundary;
            }
            let weight = inside(ring.len());
            p * (1.0 - ring.len() as f64 * weight) + ring.iter().sum::<DVec3>() * weight
        };
        fans.iter().zip(&self.positions).map(smooth).collect()
    }

    fn refined(&self) -> Self {
        let mut positions = self.smoothed(&self.fans(), 1.0 / 8.0, beta);
        // A new vertex on every edge: at least one for two half edges.
        positions.reserve(self.twins.len() / 2);
        let mut on_edge = vec![NONE; self.twins.len()];
        for half in 0..self.twins.len() as u32 {
            let twin = self.twins[half as usize];
            if twin != NONE && twin < half {
                on_edge[half as usize] = on_edge[twin as usize];
                continue;
            }
            let ends = self.position(half) + self.position(next(half));
            on_edge[half as usize] = positions.len() as u32;
            positions.push(if twin == NONE {
                ends * 0.5
            } else {
                let tips = self.position(previous(half)) + self.position(previous(twin));
                ends * (3.0 / 8.0) + tips * (1.0 / 8.0)
            });
        }
        // A triangle at each corner, which keeps its place in the triple, and one in the middle. Corner k of a triangle
        // thus owns the halves of both of its edges.
        let mut triangles = Vec::with_capacity(4 * self.triangles.len());
        for (t, &[a, b, c]) in self.triangles.iter().enumerate() {
            let [ab, bc, ca] = [0, 1, 2].map(|k| on_edge[3 * t + k]);
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        let mut twins = vec![NONE; 3 * triangles.len()];
        let mut join = |a: u32, b: u32| {
            twins[a as usize] = b;
            twins[b as usize] = a;
        };
        // Half edge k of child c of triangle t.
        let of_child = |t: u32, c: u32, k: u32| 3 * (4 * t + c) + k;
        for t in 0..self.triangles.len() as u32 {
            for k in 0..3 {
                // The edge of corner k's child that lies inside runs opposite to one of the middle child.
                join(of_child(t, k, (k + 1) % 3), of_child(t, 3, (k + 2) % 3));
                let half = 3 * t + k;
                let twin = self.twins[half as usize];
                if twin != NONE {
                    let (t2, k2) = (twin / 3, twin % 3);
                    // The first half of one is the second half of the other.
                    join(of_child(t, k, k), of_child(t2, (k2 + 1) % 3, k2));
                }
            }
        }
        Self {
            positions,
            triangles,
            twins,
        }
    }

    fn move_to_limit(&mut self, fans: &[u32]) {
        let inside = |valence: usize| 1.0 / (valence as f64 + 3.0 / (8.0 * beta(valence)));
        self.positions = self.smoothed(fans, 1.0 / 5.0, inside);
    }

    /// Cross products of the limit tangents.
    fn normals(&self, fans: &[u32]) -> Vec<DVec3> {
        let mut ring = Vec::new();
        // Every vertex that refining makes has six neighbours.
        let six = circle(6);
        let normal = |(&first, &p): (&u32, &DVec3)| {
            if self.ring(first, &mut ring) {
                boundary_normal(&ring, p)
            } else if ring.len() == six.len() {
                inside_normal(&ring, &six)
            } else {
                inside_normal(&ring, &circle(ring.len()))
            }
        };
        fans.iter().zip(&self.positions).map(normal).collect()
    }
}

/// Sines and cosines of `n` directions evenly around a circle.
fn circle(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|k| (TAU * k as f64 / n as f64).sin_cos())
        .collect()
}

fn inside_normal(ring: &[DVec3], circle: &[(f64, f64)]) -> DVec3 {
    let (mut s, mut t) = (DVec3::ZERO, DVec3::ZERO);
    for (p, &(sin, cos)) in ring.iter().zip(circle) {
        s += *p * cos;
        t += *p * sin;
    }
    t.cross(s)
}

/// `ring` runs counter-clockwise from one neighbour on the boundary to the other.
fn boundary_normal(ring: &[DVec3], p: DVec3) -> DVec3 {
    let last = ring.len() - 1;
    let along = ring[last] - ring[0];
    let across = match *ring {
        [a, b] => a + b - p * 2.0,
        [_, b, _] => b - p,
        [a, b, c, d] => (b + c) * 2.0 - a - d - p * 2.0,
        _ => {
            let theta = PI / last as f64;
            let ends = (ring[0] + ring[last]) * theta.sin();
            let inner = (1..last).map(|k| ring[k] * (k as f64 * theta).sin());
            inner.sum::<DVec3>() * (2.0 - 2.0 * theta.cos()) - ends
        }
    };
    along.cross(across)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OCTAHEDRON: [[f32; 3]; 6] = [
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ];

    /// Wound counter-clockwise seen from outside.
    const FACES: [[u32; 3]; 8] = [
        [0, 2, 4],
        [2, 1, 4],
        [1, 3, 4],
        [3, 0, 4],
        [2, 0, 5],
        [1, 2, 5],
        [3, 1, 5],
        [0, 3, 5],
    ];

    fn wide(v: [f32; 3]) -> DVec3 {
        DVec3::from(v.map(f64::from))
    }

    #[test]
    fn closed_surfaces_stay_closed_and_share_their_limit_at_every_level() {
        let coarse = loop_limit(&OCTAHEDRON, &FACES, 0).expect("a surface");
        for levels in 1..5 {
            let mesh = loop_limit(&OCTAHEDRON, &FACES, levels).expect("a surface");
            let n = mesh.n_triangles();
            assert_eq!(n, 8 << (2 * levels));
            assert_eq!(mesh.positions.len() as i64, 2 + n as i64 / 2, "Euler");
            let twins = twins_of(&mesh.triangles).expect("a surface");
            assert!(twins.iter().all(|&twin| twin != NONE), "closed");
            let surface = Surface::new(&OCTAHEDRON, &FACES).expect("a surface");
            let refined = (0..levels).fold(surface, |surface, _| surface.refined());
            assert_eq!(refined.twins, twins, "twins of children");
            // The given vertices come first, at the same place of the limit surface.
            for (a, b) in coarse.positions.iter().zip(&mesh.positions) {
                assert!(wide(*a).distance(wide(*b)) < 1e-6, "{a:?} {b:?}");
            }
            for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
                let cos = wide(*p).normalize().dot(wide(*n).normalize());
                assert!(
                    cos < -0.95,
                    "away from the side of counter-clockwise winding: {cos}"
                );
            }
        }
    }

    #[test]
    fn flat_sheets_stay_flat_within_their_outline() {
        let points: Vec<[f32; 3]> = (0..12)
            .map(|k| [(k % 4) as f32, (k / 4) as f32, 2.0])
            .collect();
        let triangles = crate::shape::heightfield::grid_triangles(4, 3);
        let mesh = loop_limit(&points, &triangles, 3).expect("a surface");
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            assert_eq!(p[2], 2.0);
            assert!(
                (0.0..=3.0).contains(&p[0]) && (0.0..=2.0).contains(&p[1]),
                "{p:?}"
            );
            assert!(wide(*n).normalize().distance(-DVec3::Z) < 1e-6, "{n:?}");
        }
    }

    #[test]
    fn fans_that_touch_in_a_vertex_are_split() {
        let bow_tie = [[0, 1, 2], [0, 3, 5]];
        let mesh = loop_limit(&OCTAHEDRON, &bow_tie, 0).expect("a surface");
        assert_eq!(mesh.positions.len(), 6);
    }

    #[test]
    fn crowded_and_turned_edges_are_named() {
        let crowded = [[0, 1, 2], [1, 0, 3], [0, 1, 4]];
        let error = loop_limit(&OCTAHEDRON, &crowded, 3).err();
        assert_eq!(error, Some(SubdivisionError::CrowdedEdge([0, 1])));
        let turned = [[0, 1, 2], [0, 1, 3]];
        let error = loop_limit(&OCTAHEDRON, &turned, 3).err();
        assert_eq!(error, Some(SubdivisionError::TurnedEdge([0, 1])));
        let repeated = [[0, 1, 2], [3, 4, 3]];
        let error = loop_limit(&OCTAHEDRON, &repeated, 3).err();
        let expected = SubdivisionError::RepeatedVertex {
            triangle: 1,
            vertex: 3,
        };
        assert_eq!(error, Some(expected));
    }
}
