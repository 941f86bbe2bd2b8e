//! Triangle meshes. Vertices are in render space; scene-file manual: `trianglemesh`, `plymesh`.

use glam::{DMat3, DVec3, Vec3A};

use crate::accel::RayShear;
use crate::math::error::{EPSILON, gamma};
use crate::math::{Bounds3, Frame, Normal3, Point3, Vec3};
use crate::sampling::warp::uniform_triangle;
use crate::shape::{AreaSample, ElementHit, Emission, Place, ShapeSample, SurfacePoint};

/// Distance from the edges of a triangle at which rays leave it, in rounding errors of its coordinates: walls behind
/// edges of down to about 10° stay behind.
const EDGE_GAP: f64 = 16.0;

/// An indexed triangle mesh with optional per-vertex attributes.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Vertex indices of each triangle, all below `positions.len()`.
    pub triangles: Vec<[u32; 3]>,
    /// Normal of each vertex, of any length, or nothing.
    pub normals: Vec<[f32; 3]>,
    /// Tangent of each vertex, of any length, or nothing.
    pub tangents: Vec<[f32; 3]>,
    /// Surface parameters of each vertex, or nothing.
    pub uvs: Vec<[f32; 2]>,
    /// Number of each triangle's face among those of a Ptex file, or nothing, which is face 0. Only where such a file
    /// may be looked up.
    pub faces: Vec<u32>,
    /// `ReverseOrientation` was on.
    pub reverse_orientation: bool,
    /// The winding shows the back: the transform from object to render space mirrors where pbrt-v3 heeds it.
    pub flip_face: bool,
    /// Length of the tangents of a mesh with normals or tangents: one unit of the space in which it was defined. Bump
    /// maps are measured by it.
    pub unit: f32,
    /// Length of a normal in the space in which the mesh was defined, over that of the one here.
    pub normal_unit: f32,
    /// What an instance does to directions, where the mesh is a part of the world itself: frames are made in the space
    /// in which it was defined, and moved by it.
    pub instance: Option<Box<Linear>>,
}

/// A linear map that can be inverted.
#[derive(Clone, Copy, Debug)]
pub struct Linear {
    /// The map.
    pub forward: DMat3,
    /// Its inverse.
    pub inverse: DMat3,
}

impl Default for Mesh {
    fn default() -> Self {
        Self {
            positions: Vec::new(),
            triangles: Vec::new(),
            normals: Vec::new(),
            tangents: Vec::new(),
            uvs: Vec::new(),
            faces: Vec::new(),
            reverse_orientation: false,
            flip_face: false,
            unit: 1.0,
            normal_unit: 1.0,
            instance: None,
        }
    }
}

impl Mesh {
    /// Whether another mesh could be part of this one: nothing but vertices and triangles tells them apart.
    pub fn has_room_for(&self, other: &Self) -> bool {
        // All fields are named, so that a new one has to be thought of here.
        let rest = |mesh: &Self| {
            let Self {
                positions: _,
                triangles: _,
                normals,
                tangents,
                uvs,
                faces,
                reverse_orientation,
                flip_face,
                unit,
                normal_unit,
                instance,
            } = mesh;
            let lists = [
                normals.is_empty(),
                tangents.is_empty(),
                uvs.is_empty(),
                faces.is_empty(),
            ];
            let orientation = [*reverse_orientation, *flip_face];
            let units = [*unit, *normal_unit].map(f32::to_bits);
            let moved_by = instance
                .as_ref()
                .map(|map| map.forward.to_cols_array().map(f64::to_bits));
            (lists, orientation, units, moved_by)
        };
        let n_positions = self.positions.len() + other.positions.len();
        rest(self) == rest(other) && u32::try_from(n_positions).is_ok()
    }

    /// Adds the triangles of another mesh behind those of this one; see [`Mesh::has_room_for`].
    pub fn append(&mut self, other: &Self) {
        let first = self.positions.len() as u32;
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        self.tangents.extend_from_slice(&other.tangents);
        self.uvs.extend_from_slice(&other.uvs);
        self.faces.extend_from_slice(&other.faces);
        let moved = other
            .triangles
            .iter()
            .map(|corners| corners.map(|corner| first + corner));
        self.triangles.extend(moved);
    }

    /// Number of triangles.
    pub fn n_triangles(&self) -> usize {
        self.triangles.len()
    }

    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [[f32; 3]; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// The corners of a triangle, in f64.
    #[inline]
    fn corners_f64(&self, triangle: u32) -> [DVec3; 3] {
        self.corners(triangle)
            .map(|p| DVec3::from(p.map(f64::from)))
    }

    /// Twice the area times the unit normal, in f64: neither tiny nor huge triangles under- or overflow.
    fn area_normal(&self, triangle: u32) -> DVec3 {
        area_normal(self.corners_f64(triangle))
    }

    /// Whether the area of a triangle is not zero and its vertices are finite.
    #[inline]
    pub fn has_area(&self, triangle: u32) -> bool {
        self.spans_area(triangle, self.corners(triangle).map(Vec3A::from))
    }

    /// The same where its corners are known.
    #[inline]
    fn spans_area(&self, triangle: u32, corners: [Vec3A; 3]) -> bool {
        is_surely_solid(corners) || {
            let n = self.area_normal(triangle);
            n != DVec3::ZERO && n.is_finite()
        }
    }

    /// Box around a triangle; empty if it has no area.
    #[inline]
    pub fn bounds(&self, triangle: u32) -> Bounds3 {
        let corners @ [p0, p1, p2] = self.corners(triangle).map(Vec3A::from);
        if !self.spans_area(triangle, corners) {
            return Bounds3::EMPTY;
        }
        Bounds3 {
            min: Point3(p0.min(p1).min(p2)),
            max: Point3(p0.max(p1).max(p2)),
        }
    }

    /// Area of a triangle.
    pub fn area(&self, triangle: u32) -> f64 {
        0.5 * self.area_normal(triangle).length()
    }

    /// See [`RayShear::intersect`].
    #[inline]
    pub fn intersect(&self, triangle: u32, shear: &RayShear, t_max: f32) -> Option<ElementHit> {
        shear
            .intersect(self.corners(triangle), t_max)
            .map(ElementHit::from)
    }

    /// Oriented geometric and shading normal at a point of a triangle.
    ///
    /// Where vertex normals exist they decide the side (negated by `ReverseOrientation`) and a mirroring
    /// transform has no further say; otherwise the winding does. `ReverseOrientation` cancels itself where normals are
    /// missing but tangents exist, or where the interpolated normal vanishes: pbrt-v3 applies it to the face and then
    /// again to the shading frame, which has the last word.
    fn oriented_normals(&self, triangle: u32, corners: [DVec3; 3], b: [f64; 3]) -> (DVec3, DVec3) {
        let face = area_normal(corners).normalize_or_zero();
        if let Some(n) = self
            .interpolate(&self.normals, triangle, b)
            .and_then(DVec3::try_normalize)
        {
            let ns = if self.reverse_orientation { -n } else { n };
            return (if face.dot(ns) < 0.0 { -face } else { face }, ns);
        }
        let reverse = self.reverse_orientation && !self.has_frame();
        let ng = if reverse != self.flip_face {
            -face
        } else {
            face
        };
        (ng, ng)
    }

    /// Whether shading has a frame of its own, apart from the parametrisation.
    fn has_frame(&self) -> bool {
        !self.normals.is_empty() || !self.tangents.is_empty()
    }

    fn interpolate(&self, attribute: &[[f32; 3]], triangle: u32, b: [f64; 3]) -> Option<DVec3> {
        if attribute.is_empty() {
            return None;
        }
        let [a0, a1, a2] = self.triangles[triangle as usize]
            .map(|v| DVec3::from(attribute[v as usize].map(f64::from)));
        Some(a0 * b[0] + a1 * b[1] + a2 * b[2])
    }

    fn corner_uvs(&self, triangle: u32) -> [[f32; 2]; 3] {
        if self.uvs.is_empty() {
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]
        } else {
            self.triangles[triangle as usize].map(|v| self.uvs[v as usize])
        }
    }

    /// Surface parameters at a point of a triangle.
    pub fn uv(&self, triangle: u32, barycentric: [f32; 2]) -> [f32; 2] {
        let [uv0, uv1, uv2] = self.corner_uvs(triangle);
        let [b0, b1] = barycentric;
        let b2 = 1.0 - b0 - b1;
        [0, 1].map(|k| b0 * uv0[k] + b1 * uv1[k] + b2 * uv2[k])
    }

    /// A point of a triangle, and how the surface lies there.
    #[inline]
    pub fn place(&self, triangle: u32, barycentric: [f32; 2]) -> Place {
        self.place_at(triangle, self.corners_f64(triangle), weights(barycentric))
    }

    #[inline]
    fn place_at(&self, triangle: u32, corners: [DVec3; 3], b: [f64; 3]) -> Place {
        let (p, p_err) = point(corners, off_the_edges(corners, b));
        let (ng, ns) = self.oriented_normals(triangle, corners, b);
        let ng = Normal3::from_f64(ng);
        Place {
            p,
            p_err,
            ng,
            n_surface: ng,
            ns: Normal3::from_f64(ns),
        }
    }

    /// The surface at a point of a triangle.
    pub fn surface(&self, triangle: u32, barycentric: [f32; 2]) -> SurfacePoint {
        let (corners, b) = (self.corners_f64(triangle), weights(barycentric));
        let Place {
            p, p_err, ng, ns, ..
        } = self.place_at(triangle, corners, b);

        // Solve for the derivatives by (u, v): dp = dpdu du + dpdv dv along two edges.
        let [uv0, uv1, uv2] = self.corner_uvs(triangle).map(|uv| uv.map(f64::from));
        let (du02, du12) = (uv0[0] - uv2[0], uv1[0] - uv2[0]);
        let (dv02, dv12) = (uv0[1] - uv2[1], uv1[1] - uv2[1]);
        let det = du02 * dv12 - dv02 * du12;
        let inverse_det = 1.0 / det;
        let by_uv = |a: [DVec3; 3]| {
            let (d02, d12) = (a[0] - a[2], a[1] - a[2]);
            (
                (d02 * dv12 - d12 * dv02) * inverse_det,
                (d12 * du02 - d02 * du12) * inverse_det,
            )
        };
        let (mut dpdu, mut dpdv) = by_uv(corners);
        let (mut dndu, mut dndv, mut dn_scale) = (DVec3::ZERO, DVec3::ZERO, 1.0);
        if det == 0.0 || !dpdu.is_finite() || !dpdv.is_finite() || dpdu.cross(dpdv) == DVec3::ZERO {
            (dpdu, dpdv) = self.any_frame(area_normal(corners).normalize_or_zero());
        } else if !self.normals.is_empty() {
            let normals = self.triangles[triangle as usize]
                .map(|v| DVec3::from(self.normals[v as usize].map(f64::from)));
            (dndu, dndv) = by_uv(normals);
            let at = normals[0] * b[0] + normals[1] * b[1] + normals[2] * b[2];
            let length = at.length() * f64::from(self.normal_unit);
            if length > 0.0 {
                let sign = if self.reverse_orientation { -1.0 } else { 1.0 };
                dn_scale = (sign / length) as f32;
            }
        }
        let [tangent, bitangent] = if self.has_frame() {
            self.frame(triangle, b, ns.to_f64(), dpdu)
        } else {
            [dpdu, dpdv]
        };
        let derivative = |dn: DVec3| Vec3::from_f64(dn * f64::from(self.normal_unit));
        SurfacePoint {
            p,
            p_err,
            ng,
            n_surface: ng,
            ns,
            uv: self.uv(triangle, barycentric),
            dpdu: Vec3::from_f64(dpdu),
            dpdv: Vec3::from_f64(dpdv),
            tangent: Vec3::from_f64(tangent),
            face: self.faces.get(triangle as usize).copied().unwrap_or(0),
            bitangent: Vec3::from_f64(bitangent),
            dndu: derivative(dndu),
            dndv: derivative(dndv),
            dn_scale,
        }
    }

    /// Two directions across the face normal `n`, one unit of the space of the definition long, where there is no
    /// parametrisation.
    fn any_frame(&self, n: DVec3) -> (DVec3, DVec3) {
        let [s, t] = self.as_defined(n, |n| {
            let frame = Frame::from_z(Vec3::from_f64(n));
            [frame.s.to_f64(), frame.t.to_f64()]
        });
        (s, t)
    }

    /// What `frame` makes of a unit normal in the space in which the mesh was defined.
    #[inline]
    fn as_defined(&self, n: DVec3, frame: impl FnOnce(DVec3) -> [DVec3; 2]) -> [DVec3; 2] {
        let unit = f64::from(self.unit);
        match &self.instance {
            None => frame(n).map(|v| v * unit),
            Some(instance) => {
                let n = (instance.forward.transpose() * n).normalize_or_zero();
                frame(n).map(|v| instance.forward * v * unit)
            }
        }
    }

    /// Tangent and bitangent of the shading frame at a point: the first opposite to the interpolated tangent, or to
    /// `dpdu`, as pbrt-v3 has it. Only bump maps tell the difference.
    fn frame(&self, triangle: u32, b: [f64; 3], ns: DVec3, dpdu: DVec3) -> [DVec3; 2] {
        let mut along = self
            .interpolate(&self.tangents, triangle, b)
            .filter(|s| *s != DVec3::ZERO && s.is_finite())
            .unwrap_or(dpdu);
        if let Some(instance) = &self.instance {
            along = instance.inverse * along;
        }
        self.as_defined(ns, |ns| {
            let tangent = match ns.cross(along).try_normalize() {
                Some(across) => ns.cross(across),
                None => Frame::from_z(Vec3::from_f64(ns)).s.to_f64(),
            };
            [tangent, ns.cross(tangent)]
        })
    }

    /// See [`crate::shape::Shape::sample_area`].
    pub fn sample_area(&self, triangle: u32, u: [f32; 2]) -> AreaSample {
        let barycentric = uniform_triangle(u);
        let (corners, b) = (self.corners_f64(triangle), weights(barycentric));
        let (p, p_err) = point(corners, b);
        AreaSample {
            p,
            p_err,
            ng: Normal3::from_f64(self.oriented_normals(triangle, corners, b).0),
            pdf_area: 1.0 / self.area(triangle),
            barycentric,
        }
    }

    /// See [`crate::shape::Shape::emission`].
    pub fn emission(&self, triangle: u32) -> Emission {
        let corners = self.corners_f64(triangle);
        let normal = |b: DVec3| self.oriented_normals(triangle, corners, b.to_array()).0;
        let ng = normal(DVec3::splat(1.0 / 3.0));
        // Vertex normals may turn the triangle around within itself.
        let turns = [DVec3::X, DVec3::Y, DVec3::Z]
            .into_iter()
            .any(|b| normal(b).dot(ng) < 0.0);
        if turns {
            Emission::Round
        } else {
            Emission::Flat(Normal3::from_f64(ng))
        }
    }

    /// See [`crate::shape::Shape::sample_toward`]: uniform by area.
    pub fn sample_toward(&self, triangle: u32, from: Point3, u: [f32; 2]) -> Option<ShapeSample> {
        self.sample_area(triangle, u).toward(from)
    }
}

/// Weights of all three corners.
#[inline]
fn weights(barycentric: [f32; 2]) -> [f64; 3] {
    let [b0, b1] = barycentric.map(f64::from);
    [b0, b1, 1.0 - b0 - b1]
}

/// Whether rounding cannot hide that a triangle has no area: most have, and need no f64. False also where numbers do
/// not fit f32.
#[inline]
fn is_surely_solid([p0, p1, p2]: [Vec3A; 3]) -> bool {
    // Squared sine of the angle at the first corner.
    const CLEAR: f32 = 1e-6;
    let (a, b) = (p1 - p0, p2 - p0);
    let n2 = a.cross(b).length_squared();
    n2 > CLEAR * (a.length_squared() * b.length_squared()) && n2 < f32::INFINITY
}

/// See [`Mesh::area_normal`].
#[inline]
fn area_normal([p0, p1, p2]: [DVec3; 3]) -> DVec3 {
    (p0 - p2).cross(p1 - p2)
}

/// Weights of a point that lies off the edges by [`EDGE_GAP`] of its rounding errors, or in the middle of a
/// triangle that is thinner. A point that is rounded to beyond the wall behind an edge would leave a closed room.
fn off_the_edges(corners: [DVec3; 3], mut b: [f64; 3]) -> [f64; 3] {
    let largest = corners.iter().fold(DVec3::ZERO, |m, p| m.max(p.abs()));
    let gap = EDGE_GAP * f64::from(EPSILON) * largest.max_element();
    let edges = [0, 1, 2].map(|k| corners[(k + 1) % 3] - corners[(k + 2) % 3]);
    let area = edges[0].cross(edges[1]);
    // Far from all edges, as most points are; twice the squares cover the roundings.
    let nearest = b[0].min(b[1]).min(b[2]).max(0.0);
    let longest = edges.iter().fold(0.0, |m, e| e.length_squared().max(m));
    if nearest * nearest * area.length_squared() > 2.0 * gap * gap * longest {
        return b;
    }
    let area = area.length();
    let mut is_near = false;
    for k in 0..3 {
        let least = (gap * edges[k].length() / area).min(1.0 / 3.0);
        if b[k] < least {
            b[k] = least;
            is_near = true;
        }
    }
    if is_near {
        let sum = b[0] + b[1] + b[2];
        b = b.map(|x| x / sum);
    }
    b
}

/// The point with the given weights, and its error bound.
#[inline]
fn point(corners: [DVec3; 3], b: [f64; 3]) -> (Point3, Vec3) {
    let p = corners[0] * b[0] + corners[1] * b[1] + corners[2] * b[2];
    // Whatever rounding made of the weights, they sum to 1, so that p lies in the plane of the triangle but for the
    // rounding to f32 (γ(1)); twice that also covers the f64 terms and the bound itself.
    let spread = corners[0].abs() * b[0] + corners[1].abs() * b[1] + corners[2].abs() * b[2];
    (Point3::from_f64(p), Vec3::from_f64(spread.abs()) * gamma(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Ray;
    use crate::math::error::offset_origin;
    use crate::sampling::rng::Rng;
    use crate::sampling::warp::uniform_sphere;

    #[test]
    fn rays_that_leave_a_triangle_do_not_meet_it_again() {
        let mut rng = Rng::new(1);
        for k in 0..200_000 {
            let (size, distance) = (10f32.powi(k % 7 - 3), 10f32.powi(k / 7 % 7 - 3));
            let at = uniform_sphere(rng.uniform2()) * distance;
            let positions = [0, 1, 2].map(|_| {
                let mut p = (at + uniform_sphere(rng.uniform2()) * size).0.to_array();
                if k % 4 == 0 {
                    p[k as usize % 3] = if k % 8 == 0 { 0.0 } else { distance };
                }
                p
            });
            let mesh = Mesh {
                positions: positions.to_vec(),
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            };
            if mesh.bounds(0).is_empty() {
                continue;
            }
            let surface = mesh.surface(0, uniform_triangle(rng.uniform2()));
            let d = uniform_sphere(rng.uniform2());
            let ray = Ray {
                o: offset_origin(surface.p, surface.p_err, surface.ng, d),
                d,
                time: 0.0,
            };
            let hit = mesh.intersect(0, &RayShear::new(&ray), f32::INFINITY);
            assert_eq!(hit, None, "{positions:?} {ray:?}");
        }
    }

    #[test]
    fn boxes_are_empty_exactly_where_triangles_have_no_area() {
        let mut rng = Rng::new(2);
        let mut n_empty = 0;
        for k in 0..200_000 {
            let scale = 2f32.powi(k % 251 - 125);
            let point = |w: Vec3| (w.0 * scale).to_array();
            let (a, b) = (
                uniform_sphere(rng.uniform2()),
                uniform_sphere(rng.uniform2()),
            );
            let c = match k / 251 % 5 {
                0 => uniform_sphere(rng.uniform2()),
                // On a line with the others, up to rounding.
                1 => a + (b - a) * rng.uniform(),
                2 => a + (b - a) * 2.0,
                3 => b + uniform_sphere(rng.uniform2()) * 10f32.powi(-(k % 9)),
                _ => a,
            };
            let mesh = Mesh {
                positions: [a, b, c].map(point).to_vec(),
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            };
            let n = mesh.area_normal(0);
            let is_empty = n == DVec3::ZERO || !n.is_finite();
            assert_eq!(mesh.bounds(0).is_empty(), is_empty, "{:?}", mesh.positions);
            n_empty += usize::from(is_empty);
        }
        assert!(n_empty > 40_000, "{n_empty}");
    }
}
