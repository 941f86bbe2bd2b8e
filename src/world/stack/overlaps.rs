//! Opaque surfaces in one place: which of them is seen is a question of their content alone.
//!
//! Looked for are flat shapes of few triangles in one plane, quadrics and meshes that are the same: what modellers lay on
//! top of each other, or export twice.

use std::collections::HashMap;

use glam::DVec3;

use super::find::set;
use super::pairs::{Form, Piece, boxes_touch, flat_overlap};
use crate::ids::{GeometryId, InstanceId};
use crate::math::Bounds3;
use crate::math::error::EPSILON;
use crate::shape::Shape;
use crate::world::items;
use crate::world::{ElementRef, Geometry, World};

/// Most triangles of a flat shape that is looked at.
const FEW: usize = 64;

/// A flat shape: everything on one plane, within rounding.
struct Sheet {
    geometry: usize,
    normal: DVec3,
    height: f64,
    error: f64,
    bounds: Bounds3,
}

impl World {
    /// Marks the elements of opaque shapes that look different and lie in one place.
    pub(super) fn find_overlaps(
        &self,
        elements: &mut [Vec<u64>],
        error: &mut f64,
    ) -> Vec<[GeometryId; 2]> {
        let mut pairs = self.same_shapes();
        pairs.extend(self.sheets_in_one_plane());
        pairs.retain(|[a, b]| self.appearance(*a) != self.appearance(*b));
        if pairs.is_empty() {
            return Vec::new();
        }
        let mut members: Vec<usize> = pairs.iter().flatten().copied().collect();
        members.sort_unstable();
        members.dedup();
        for &index in &members {
            for element in 0..self.geometries[index].shape.n_elements() {
                set(&mut elements[index], element);
                let target = element_of(index, element);
                if let Some(piece) = self.piece(target, InstanceId::NONE) {
                    *error = error.max(piece.error);
                }
            }
        }
        let pairs = pairs.into_iter().map(|pair| pair.map(GeometryId::new));
        pairs.collect()
    }

    /// The order of shapes, of which those count whose elements are marked, by content.
    pub(super) fn order_by_content(&self, elements: &[Vec<u64>]) -> Vec<u32> {
        let mut members: Vec<usize> = (0..elements.len())
            .filter(|&index| !elements[index].is_empty())
            .collect();
        members.sort_by_cached_key(|&index| {
            (outline(&self.geometries[index]), self.appearance(index))
        });
        let mut order = vec![0; elements.len()];
        for (rank, index) in (0..).zip(members) {
            order[index] = rank;
        }
        order
    }

    fn is_opaque(&self, geometry: &Geometry) -> bool {
        geometry.material.is_some()
            && !geometry.first_light.is_some()
            && geometry.cutout.alpha.is_none()
            && !geometry.object.is_some()
    }

    /// What a surface looks like, as text.
    fn appearance(&self, index: usize) -> String {
        let geometry = &self.geometries[index];
        format!("{:?}", self.materials.list.get(geometry.material.index()))
    }

    /// Quadrics and meshes that are the same.
    fn same_shapes(&self) -> Vec<[usize; 2]> {
        let mut first_of: HashMap<Vec<u32>, usize> = HashMap::new();
        let mut pairs = Vec::new();
        for (index, geometry) in self.geometries.iter().enumerate() {
            if !self.is_opaque(geometry) {
                continue;
            }
            let key: Vec<u32> = match &geometry.shape {
                Shape::Quadric(quadric) => {
                    let bounds = quadric.bounds();
                    let corners = [bounds.min.0.to_array(), bounds.max.0.to_array()];
                    corners.iter().flatten().map(|c| c.to_bits()).collect()
                }
                Shape::Mesh(mesh) if mesh.n_triangles() > 0 => {
                    let corners = mesh.corners(0);
                    let size = mesh.n_triangles() as u32;
                    let corners = corners.iter().flatten().map(|c| c.to_bits());
                    corners.chain([size]).collect()
                }
                Shape::Mesh(_) | Shape::Curves(_) => continue,
            };
            let Some(&first) = first_of.get(&key) else {
                first_of.insert(key, index);
                continue;
            };
            let is_same = match (&self.geometries[first].shape, &geometry.shape) {
                (Shape::Mesh(a), Shape::Mesh(b)) => {
                    let n = a.n_triangles() as u32;
                    (0..n).all(|i| a.corners(i) == b.corners(i))
                }
                (Shape::Quadric(a), Shape::Quadric(b)) => a.is_same_form(b),
                _ => false,
            };
            if is_same {
                pairs.push([first, index]);
            }
        }
        pairs
    }

    /// Flat shapes that overlap in one plane, and are not the same.
    fn sheets_in_one_plane(&self) -> Vec<[usize; 2]> {
        let mut sheets: Vec<Sheet> = (0..self.geometries.len())
            .filter_map(|index| self.sheet(index))
            .collect();
        sheets.sort_by(|a, b| a.height.total_cmp(&b.height));
        let widest = sheets.iter().fold(0.0, |m, sheet| sheet.error.max(m));
        // Most are alone in their plane.
        let is_near = |pair: &[Sheet]| pair[1].height - pair[0].height <= 2.0 * widest;
        let has_neighbour = |i: usize| {
            i > 0 && is_near(&sheets[i - 1..=i])
                || i + 1 < sheets.len() && is_near(&sheets[i..=i + 1])
        };
        let flat: HashMap<usize, &Sheet> = (0..sheets.len())
            .filter(|&i| has_neighbour(i))
            .map(|i| (sheets[i].geometry, &sheets[i]))
            .collect();
        let mut pairs = Vec::new();
        let mut ids: Vec<usize> = flat.keys().copied().collect();
        ids.sort_unstable();
        for id in ids {
            let sheet = flat[&id];
            let mut near = Vec::new();
            self.bvh.touching(
                &sheet.bounds,
                f32::INFINITY,
                |key| near.push(items::element_of(key).geometry.index()),
                |_| {},
            );
            near.sort_unstable();
            near.dedup();
            for other in near.into_iter().filter(|other| *other > id) {
                if let Some(other) = flat.get(&other)
                    && (other.height - sheet.height).abs() <= other.error + sheet.error
                    && other.normal.dot(sheet.normal) > 0.5
                    && self.overlap(id, other.geometry)
                {
                    pairs.push([id, other.geometry]);
                }
            }
        }
        pairs
    }

    fn sheet(&self, index: usize) -> Option<Sheet> {
        let geometry = &self.geometries[index];
        let Shape::Mesh(mesh) = &geometry.shape else {
            return None;
        };
        if !self.is_opaque(geometry) || !(1..=FEW).contains(&mesh.n_triangles()) {
            return None;
        }
        let corners = || {
            (0..mesh.n_triangles() as u32)
                .flat_map(|i| mesh.corners(i))
                .map(|p| DVec3::from(p.map(f64::from)))
        };
        let [a, b, c] = mesh.corners(0).map(|p| DVec3::from(p.map(f64::from)));
        let mut normal = (b - a).cross(c - a).try_normalize()?;
        // One of two normals, by content.
        if normal.to_array().into_iter().find(|c| *c != 0.0) < Some(0.0) {
            normal = -normal;
        }
        let height = normal.dot(a);
        let largest = corners().fold(0.0, |m, p| p.abs().max_element().max(m));
        // The normal is known as well as the first triangle is.
        let thin = (b - a).cross(c - a).length() / (b - a).length().max((c - a).length());
        let spread = corners().fold(0.0, |m: f64, p| m.max(p.distance(a)));
        let error = 4.0 * f64::from(EPSILON) * largest * (1.0 + spread / thin);
        let is_flat = corners().all(|p| (normal.dot(p) - height).abs() <= error);
        is_flat.then_some(Sheet {
            geometry: index,
            normal,
            height,
            error,
            bounds: self.bounds_of(index),
        })
    }

    fn bounds_of(&self, index: usize) -> Bounds3 {
        let n = self.geometries[index].shape.n_elements();
        (0..n)
            .filter_map(|element| self.piece(element_of(index, element), InstanceId::NONE))
            .fold(Bounds3::EMPTY, |bounds, piece| bounds.union(piece.bounds))
    }

    fn overlap(&self, a: usize, b: usize) -> bool {
        let pieces = |index: usize| -> Vec<Piece> {
            let n = self.geometries[index].shape.n_elements();
            (0..n)
                .filter_map(|element| self.piece(element_of(index, element), InstanceId::NONE))
                .collect()
        };
        let of_b = pieces(b);
        pieces(a).iter().any(|a| {
            of_b.iter().any(|b| match (a.form, b.form) {
                (Form::Triangle(p), Form::Triangle(q)) => {
                    boxes_touch(&a.bounds, &b.bounds) && flat_overlap(p, q, a.error + b.error)
                }
                _ => false,
            })
        })
    }

    /// Pairs of opaque shapes that look different and lie in one place.
    pub fn overlaps(&self) -> &[[GeometryId; 2]] {
        match &self.stacks {
            Some(stacks) => &stacks.overlaps,
            None => &[],
        }
    }
}

fn element_of(geometry: usize, element: usize) -> ElementRef {
    ElementRef {
        geometry: GeometryId::new(geometry),
        element: element as u32,
    }
}

/// Something of the form of a shape, as numbers.
fn outline(geometry: &Geometry) -> Vec<u32> {
    let shape = &geometry.shape;
    let bounds = shape.bounds(0);
    let corners = [bounds.min.0.to_array(), bounds.max.0.to_array()];
    let n = shape.n_elements() as u32;
    let numbers = corners.iter().flatten().map(|c| c.to_bits());
    numbers.chain([n]).collect()
}
