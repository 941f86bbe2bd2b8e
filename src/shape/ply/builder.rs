//! What every reader feeds: collects vertices and faces, cuts faces into triangles, and checks the whole at the end.

use std::collections::HashMap;

use glam::DVec3;

use super::header::Header;
use super::{PlyMesh, PlyWarning};

/// A mesh in the making.
pub(super) struct Builder {
    /// What there is so far.
    pub(super) mesh: PlyMesh,
    n_vertices: u32,
    has_normals: bool,
    has_uvs: bool,
    has_faces: bool,
    has_face_indices: bool,
    /// Faces read so far.
    n_faces: usize,
    short_faces: Tally,
    /// Faces of five or more corners: face, first triangle, number of triangles.
    polygons: Vec<(usize, usize, usize)>,
    /// Scratch of [`Builder::face_of_numbers`].
    corners: Vec<u32>,
    /// Whether faces carry texture coordinates; they are handed in as such.
    pub(super) has_corner_uvs: bool,
    has_idle_corner_uvs: bool,
    /// Texture coordinates of the corners of each triangle, where faces carry them.
    corner_uvs: Vec<[[f32; 2]; 3]>,
    /// Faces whose texture coordinates are not two for each corner.
    misfit_uvs: Tally,
}

/// How many, and which was the first.
#[derive(Default)]
struct Tally {
    count: usize,
    first: usize,
}

impl Tally {
    fn add(&mut self, index: usize) {
        if self.count == 0 {
            self.first = index;
        }
        self.count += 1;
    }

    /// Counts the items for which `is_odd`.
    fn of<T>(items: &[T], is_odd: impl Fn(&T) -> bool) -> Self {
        let mut tally = Self::default();
        let odd = items.iter().enumerate().filter(|(_, item)| is_odd(item));
        odd.for_each(|(index, _)| tally.add(index));
        tally
    }

    fn warning(self, warning: impl Fn(usize, usize) -> PlyWarning) -> Option<PlyWarning> {
        (self.count > 0).then(|| warning(self.count, self.first))
    }
}

impl Builder {
    /// An empty mesh for what the header declares. Reserves nothing: counts are not to be trusted.
    pub(super) fn new(header: &Header) -> Self {
        Self {
            mesh: PlyMesh::default(),
            n_vertices: header.n_vertices,
            has_normals: header.has_normals,
            has_uvs: header.has_uvs,
            has_faces: header.has_faces,
            has_face_indices: header.has_face_indices,
            n_faces: 0,
            short_faces: Tally::default(),
            polygons: Vec::new(),
            corners: Vec::new(),
            has_corner_uvs: header.has_corner_uvs,
            has_idle_corner_uvs: header.has_idle_corner_uvs,
            corner_uvs: Vec::new(),
            misfit_uvs: Tally::default(),
        }
    }

    /// Adds a vertex: x y z, nx ny nz, u v.
    pub(super) fn vertex(&mut self, [x, y, z, nx, ny, nz, u, v]: [f32; 8]) {
        self.mesh.positions.push([x, y, z]);
        if self.has_normals {
            self.mesh.normals.push([nx, ny, nz]);
        }
        if self.has_uvs {
            self.mesh.uvs.push([u, v]);
        }
    }

    /// Adds a face whose corners may be anything; `uvs` are the texture coordinates of all of them.
    pub(super) fn face_of_numbers(
        &mut self,
        numbers: &[f64],
        face_index: f64,
        uvs: &[f32],
    ) -> Result<(), String> {
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        for &number in numbers {
            if number.fract() != 0.0 || number < 0.0 || number > f64::from(u32::MAX) {
                return Err(self.no_vertex(number));
            }
            corners.push(number as u32);
        }
        let added = self.face(&corners, face_index as i32);
        if self.has_corner_uvs && added.is_ok() {
            self.add_corner_uvs(corners.len(), uvs);
        }
        self.corners = corners;
        added.map_err(|corner| self.no_vertex(f64::from(corner)))
    }

    /// Adds a face, or gives back its first corner that is not a vertex.
    ///
    /// A quad becomes (0, 1, 2) and (3, 0, 2) as in pbrt-v3, which gives each half the corner order, and so the
    /// parametrisation, of the reference. Other polygons become a fan around their first corner.
    #[inline]
    pub(super) fn face(&mut self, corners: &[u32], face_index: i32) -> Result<(), u32> {
        if let Some(&corner) = corners.iter().find(|&&corner| corner >= self.n_vertices) {
            return Err(corner);
        }
        match *corners {
            [a, b, c] => self.mesh.triangles.push([a, b, c]),
            [a, b, c, d] => self.mesh.triangles.extend([[a, b, c], [d, a, c]]),
            _ => self.unusual_face(corners),
        }
        if self.has_face_indices {
            let n = self.mesh.triangles.len();
            self.mesh.face_indices.resize(n, face_index);
        }
        self.n_faces += 1;
        Ok(())
    }

    /// Adds the texture coordinates of the face that was added last, cut as it was.
    fn add_corner_uvs(&mut self, n_corners: usize, uvs: &[f32]) {
        if uvs.len() != 2 * n_corners {
            self.misfit_uvs.add(self.n_faces - 1);
        }
        // What is missing is 0.
        let uv = |corner: usize| {
            let at = |k: usize| uvs.get(2 * corner + k).copied().unwrap_or(0.0);
            [at(0), at(1)]
        };
        match n_corners {
            3 => self.corner_uvs.push([0, 1, 2].map(uv)),
            4 => self
                .corner_uvs
                .extend([[0, 1, 2].map(uv), [3, 0, 2].map(uv)]),
            n => {
                let fan = (1..n.saturating_sub(1)).map(|k| [0, k, k + 1].map(uv));
                self.corner_uvs.extend(fan);
            }
        }
    }

    /// Gives the texture coordinates of corners to vertices: a vertex that has several becomes several.
    fn split_vertices(&mut self) {
        let mesh = &mut self.mesh;
        let mut owners: Vec<Option<[u32; 2]>> = vec![None; mesh.positions.len()];
        let mut copies: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
        mesh.uvs = vec![[0.0; 2]; mesh.positions.len()];
        for (triangle, uvs) in mesh.triangles.iter_mut().zip(&self.corner_uvs) {
            for (corner, uv) in triangle.iter_mut().zip(uvs) {
                let (vertex, key) = (*corner as usize, uv.map(f32::to_bits));
                match owners[vertex] {
                    None => {
                        owners[vertex] = Some(key);
                        mesh.uvs[vertex] = *uv;
                    }
                    Some(owner) if owner == key => {}
                    Some(_) => {
                        *corner = *copies.entry((*corner, key)).or_insert_with(|| {
                            let copy = mesh.positions.len() as u32;
                            mesh.positions.push(mesh.positions[vertex]);
                            if !mesh.normals.is_empty() {
                                mesh.normals.push(mesh.normals[vertex]);
                            }
                            mesh.uvs.push(*uv);
                            copy
                        });
                    }
                }
            }
        }
    }

    /// Adds a face that is neither triangle nor quad.
    fn unusual_face(&mut self, corners: &[u32]) {
        let first = self.mesh.triangles.len();
        match *corners {
            [] | [_] | [_, _] => self.short_faces.add(self.n_faces),
            [a, ref rest @ ..] => {
                let fan = rest.windows(2).map(|edge| [a, edge[0], edge[1]]);
                self.mesh.triangles.extend(fan);
                self.polygons.push((self.n_faces, first, rest.len() - 1));
            }
        }
    }

    /// Says that a corner of the next face is not a vertex.
    pub(super) fn no_vertex(&self, corner: f64) -> String {
        format!(
            "face {} uses vertex {corner}, but there are {} vertices",
            self.n_faces, self.n_vertices
        )
    }

    /// Checks what can be checked only now, and hands over the mesh.
    pub(super) fn finish(mut self) -> PlyMesh {
        let mut warnings = Vec::new();
        if !self.has_faces {
            warnings.push(PlyWarning::NoFaces);
        }
        let short_faces = |count, first| PlyWarning::ShortFaces { count, first };
        warnings.extend(std::mem::take(&mut self.short_faces).warning(short_faces));
        warnings.extend(
            folded(&self.mesh, &self.polygons)
                .warning(|count, first| PlyWarning::FoldedPolygons { count, first }),
        );
        warnings.extend(drop_non_finite(&mut self.mesh, &mut self.corner_uvs));
        if self.has_idle_corner_uvs {
            warnings.push(PlyWarning::IdleCornerUvs);
        }
        warnings.extend(
            std::mem::take(&mut self.misfit_uvs)
                .warning(|count, first| PlyWarning::MisfitCornerUvs { count, first }),
        );
        if self.has_corner_uvs {
            self.split_vertices();
        }

        let is_usable = |n: &[f32; 3]| n.iter().all(|x| x.is_finite()) && *n != [0.0; 3];
        let unusable = Tally::of(&self.mesh.normals, |n| !is_usable(n));
        if unusable.count > 0 {
            let normals = self.mesh.normals.iter_mut();
            normals
                .filter(|n| !is_usable(n))
                .for_each(|n| *n = [0.0; 3]);
        }
        warnings
            .extend(unusable.warning(|count, first| PlyWarning::UnusableNormals { count, first }));

        let is_finite = |uv: &[f32; 2]| uv.iter().all(|x| x.is_finite());
        let non_finite = Tally::of(&self.mesh.uvs, |uv| !is_finite(uv));
        if non_finite.count > 0 {
            let uvs = self.mesh.uvs.iter_mut();
            uvs.filter(|uv| !is_finite(uv))
                .for_each(|uv| *uv = [0.0; 2]);
        }
        warnings
            .extend(non_finite.warning(|count, first| PlyWarning::NonFiniteUvs { count, first }));

        self.mesh.warnings = warnings;
        self.mesh
    }
}

/// Drops the triangles that use a vertex that is not finite.
fn drop_non_finite(mesh: &mut PlyMesh, corner_uvs: &mut Vec<[[f32; 2]; 3]>) -> Option<PlyWarning> {
    let is_finite = |p: &[f32; 3]| p.iter().all(|x| x.is_finite());
    let odd = Tally::of(&mesh.positions, |p| !is_finite(p));
    if odd.count == 0 {
        return None;
    }
    let positions = &mesh.positions;
    let is_kept = |t: &[u32; 3]| t.iter().all(|&i| is_finite(&positions[i as usize]));
    let n_before = mesh.triangles.len();
    if !mesh.face_indices.is_empty() {
        let mut triangles = mesh.triangles.iter();
        mesh.face_indices
            .retain(|_| triangles.next().is_some_and(is_kept));
    }
    if !corner_uvs.is_empty() {
        let mut triangles = mesh.triangles.iter();
        corner_uvs.retain(|_| triangles.next().is_some_and(is_kept));
    }
    mesh.triangles.retain(is_kept);
    let dropped = n_before - mesh.triangles.len();
    odd.warning(|count, first| PlyWarning::NonFiniteVertices {
        count,
        first,
        dropped,
    })
}

/// The polygons whose fan folds back on itself: a triangle faces away from the polygon's area vector.
///
/// Convex polygons never do, nor do those that are star-shaped around their first corner, which a fan tiles too.
fn folded(mesh: &PlyMesh, polygons: &[(usize, usize, usize)]) -> Tally {
    let mut tally = Tally::default();
    for &(face, first, n) in polygons {
        let triangles = &mesh.triangles[first..first + n];
        let area_vector = |triangle: &[u32; 3]| {
            let [a, b, c] =
                triangle.map(|i| DVec3::from(mesh.positions[i as usize].map(f64::from)));
            (b - a).cross(c - a)
        };
        let whole: DVec3 = triangles.iter().map(area_vector).sum();
        if triangles.iter().any(|t| area_vector(t).dot(whole) < 0.0) {
            tally.add(face);
        }
    }
    tally
}
