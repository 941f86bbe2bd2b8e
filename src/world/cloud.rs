//! Whether the world's medium is a cloud in a box: then rays need not ask for its walls.
//!
//! Published clouds stand in a box along the axes of their grid. What light loses in them is what the part of the grid in
//! the box takes, and a path that scatters in the box meets no wall before it leaves.

use std::collections::HashMap;

use glam::DVec3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::ids::MediumId;
use crate::math::animated::corners_of;
use crate::math::error::EPSILON;
use crate::math::{Bounds3, Point3, Ray};
use crate::medium::{GridMedium, Medium};
use crate::sampling::rng::Rng;
use crate::shape::{Mesh, Shape};
use crate::spectrum::Rgb;
use crate::world::{Geometry, Hit, LightSample, Segment, ShadowTally, World};

/// Rounding of places along rays, over what one operation adds to them.
const OPERATIONS: f64 = 16.0;
/// Largest such rounding, over the shortest edge of the box.
const PRECISE: f64 = 1e-3;

/// The only medium of a world: a grid in a closed box along its axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Cloud {
    pub(super) medium: MediumId,
    /// Nothing but its walls meets the box.
    pub(super) is_clear: bool,
}

/// A box along the axes of a grid, in units of voxels.
struct GridBox<'a> {
    grid: &'a GridMedium,
    low: DVec3,
    high: DVec3,
    /// How far apart places may lie that are meant to be the same.
    rounding: f64,
}

impl World {
    /// The cloud, if there is one: its grid then ends at its walls.
    pub(super) fn find_cloud(&mut self) -> Option<Cloud> {
        let [Medium::Grid(grid)] = &self.media[..] else {
            return None;
        };
        let walls: Option<Vec<&Mesh>> = self.geometries.iter().filter_map(wall).collect();
        let walls = walls?;
        let around = GridBox::around(grid, &walls)?;
        let medium = MediumId::new(0);
        // Who says to be in the medium may be beside its box, and must find all of the grid there.
        if around.cuts() && (self.camera_medium == medium || self.light_media.contains(&medium)) {
            return None;
        }
        let said = self.said_around(around.center(), 0.0);
        if !said.into_iter().all(|said| said == Some(medium)) {
            return None;
        }
        let others = |geometry: &&Geometry| wall(geometry).is_none() && !geometry.object.is_some();
        let is_clear = self
            .geometries
            .iter()
            .filter(others)
            .all(|geometry| around.keeps_out(&geometry.shape))
            && self.instances.iter().all(|instance| {
                let object = &self.objects[instance.object.index()];
                around.keeps_out_box(instance.bounds(object, self.shutter))
            });
        let GridBox {
            low,
            high,
            rounding,
            ..
        } = around;
        if let [Medium::Grid(grid)] = &mut self.media[..] {
            grid.confine(low, high, rounding);
        }
        Some(Cloud { medium, is_clear })
    }
}

/// The mesh of a geometry that separates media: `Some(None)` if it does, but is more than a plain null surface.
fn wall(geometry: &Geometry) -> Option<Option<&Mesh>> {
    geometry.media.as_ref()?;
    let is_plain = !geometry.material.is_some()
        && !geometry.first_light.is_some()
        && !geometry.object.is_some()
        && geometry.cutout.alpha.is_none();
    Some(match &geometry.shape {
        Shape::Mesh(mesh) if is_plain => Some(mesh),
        _ => None,
    })
}

impl World {
    /// The medium of a path, wherever it is, that begins at `p` in the medium `declared`: if it is that of a cloud, whose
    /// walls the path then need not ask for. `None` where the declaration and the place contradict each other, too: there
    /// walls decide.
    #[inline]
    pub fn cloud_around(&self, p: Point3, declared: MediumId) -> Option<MediumId> {
        let Cloud { medium, .. } = self.cloud?;
        let Medium::Grid(grid) = self.medium(medium) else {
            return None;
        };
        (grid.holds(p) == Some(declared == medium)).then_some(medium)
    }

    /// Whether a path in the medium of a cloud meets no surface between two collisions.
    #[inline]
    pub fn is_clear_within(&self, medium: MediumId) -> bool {
        self.cloud
            .is_some_and(|cloud| cloud.is_clear && cloud.medium == medium)
    }

    /// The cloud, if what a path finds beyond a collision in it depends on the place of that alone: it scatters evenly, no
    /// surface and no moment makes a difference, and what comes through between two places is known.
    #[inline]
    pub fn shared_cloud(&self) -> Option<&GridMedium> {
        let cloud = self.cloud.filter(|cloud| cloud.is_clear)?;
        match self.medium(cloud.medium) {
            Medium::Grid(grid) if !self.facts().has_motion && grid.is_evenly_shared() => Some(grid),
            _ => None,
        }
    }

    /// The nearest surface that is no wall.
    #[inline]
    pub fn closest_past_walls(&self, ray: &Ray) -> Option<Hit> {
        self.first_where(ray, f32::INFINITY, |hit| {
            self.geometry(hit.target.geometry).media.is_none()
        })
    }

    /// Whether a ray passes a wall before `t_max`.
    pub fn passes_wall(&self, ray: &Ray, t_max: f32) -> bool {
        self.any_where(ray, t_max, |hit| {
            self.geometry(hit.target.geometry).media.is_some()
        })
    }

    /// As [`World::transmittance`] in the medium of a cloud, past its walls.
    pub fn transmittance_past_walls(
        &self,
        sample: &LightSample,
        medium: MediumId,
        rng: &mut Rng,
        tally: &mut ShadowTally,
    ) -> Rgb {
        self.dimmed_past_walls(sample.segment(), medium, rng, tally)
    }

    /// The same along a segment.
    pub(super) fn dimmed_past_walls(
        &self,
        segment: &Segment,
        medium: MediumId,
        rng: &mut Rng,
        tally: &mut ShadowTally,
    ) -> Rgb {
        let Segment { ray, t_max, .. } = segment;
        tally.rays += 1;
        let is_blocked = || {
            self.any_where(ray, *t_max, |hit| {
                let geometry = self.geometry(hit.target.geometry);
                geometry.material.is_some() && self.stands_between(segment, hit)
            })
        };
        // First what is more likely to stop it.
        let is_within =
            matches!(self.medium(medium), Medium::Grid(grid) if grid.holds(ray.o) == Some(true));
        if !is_within && is_blocked() {
            return Rgb::BLACK;
        }
        let tr = self.medium(medium).transmittance(ray, *t_max, rng);
        if is_within && !tr.is_black() && is_blocked() {
            return Rgb::BLACK;
        }
        tr
    }
}

impl<'a> GridBox<'a> {
    /// The box that the walls are, each of their triangles on one of its sides, if some of the grid is in it.
    fn around(grid: &'a GridMedium, walls: &[&Mesh]) -> Option<Self> {
        let triangles = || walls.iter().flat_map(|mesh| triangles(mesh));
        let corners = || triangles().flatten().map(to_f64);
        let farthest = corners().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let matrix = grid.lattice_from_render().matrix3.to_cols_array();
        let voxels_per_unit = matrix.into_iter().map(f64::abs).fold(0.0, f64::max);
        let lattice = || corners().map(|p| grid.lattice_from_render().transform_point3(p));
        let low = lattice().fold(DVec3::INFINITY, DVec3::min);
        let high = lattice().fold(DVec3::NEG_INFINITY, DVec3::max);
        // Of places in render space, and of those in the grid.
        let largest = farthest * voxels_per_unit + low.abs().max(high.abs()).max_element();
        let this = Self {
            grid,
            low,
            high,
            rounding: OPERATIONS * f64::from(EPSILON) * largest,
        };
        // In this order, so that what is no number is no box.
        let is_precise = this.rounding < PRECISE * (this.high - this.low).min_element();
        let is_box = triangles().all(|triangle| this.is_on_a_side(triangle));
        let [begin, end] = grid.extent();
        let holds_some = (this.low.cmplt(end) & this.high.cmpgt(begin)).all();
        (is_precise && is_box && holds_some && is_closed(triangles())).then_some(this)
    }

    /// Whether some of the grid is outside.
    fn cuts(&self) -> bool {
        let [begin, end] = self.grid.extent();
        let (low, high) = (self.low - self.rounding, self.high + self.rounding);
        (low.cmpgt(begin) | high.cmplt(end)).any()
    }

    fn center(&self) -> Point3 {
        let render_from_lattice = self.grid.lattice_from_render().inverse();
        Point3::from_f64(render_from_lattice.transform_point3((self.low + self.high) * 0.5))
    }

    fn point(&self, p: DVec3) -> DVec3 {
        self.grid.lattice_from_render().transform_point3(p)
    }

    fn is_on_a_side(&self, triangle: [[f32; 3]; 3]) -> bool {
        let [least, largest] = extent(triangle.map(|p| self.point(to_f64(p))));
        let low = largest.cmple(self.low + self.rounding);
        let high = least.cmpge(self.high - self.rounding);
        (low | high).any()
    }

    /// Whether a shape surely does not meet the box.
    fn keeps_out(&self, shape: &Shape) -> bool {
        (0..shape.n_elements() as u32)
            .into_par_iter()
            .all(|element| {
                self.keeps_out_box(shape.bounds(element))
                    || match shape {
                        Shape::Mesh(mesh) => self.keeps_out_triangle(mesh.corners(element)),
                        Shape::Quadric(_) | Shape::Curves(_) => false,
                    }
            })
    }

    /// The same of a box in render space; one that is empty does not.
    fn keeps_out_box(&self, bounds: Bounds3) -> bool {
        let corners = corners_of([bounds.min.to_f64(), bounds.max.to_f64()]);
        bounds.is_empty() || self.keeps_out_points(corners.map(|p| self.point(p)))
    }

    /// Whether points are beyond one of the sides.
    fn keeps_out_points<const N: usize>(&self, points: [DVec3; N]) -> bool {
        let [least, largest] = extent(points);
        let low = largest.cmplt(self.low - self.rounding);
        let high = least.cmpgt(self.high + self.rounding);
        (low | high).any()
    }

    /// Whether a triangle is, or the box is on one side of its plane.
    fn keeps_out_triangle(&self, triangle: [[f32; 3]; 3]) -> bool {
        let corners = triangle.map(|p| self.point(to_f64(p)));
        if self.keeps_out_points(corners) {
            return true;
        }
        let [a, b, c] = corners;
        let Some(n) = (b - a).cross(c - a).try_normalize() else {
            return false;
        };
        let heights = corners_of([self.low, self.high]).map(|p| n.dot(p - a));
        heights.iter().all(|&height| height > self.rounding)
            || heights.iter().all(|&height| height < -self.rounding)
    }
}

fn to_f64(p: [f32; 3]) -> DVec3 {
    DVec3::from(p.map(f64::from))
}

/// Corners of the box around points.
fn extent<const N: usize>(points: [DVec3; N]) -> [DVec3; 2] {
    [
        points.into_iter().fold(DVec3::INFINITY, DVec3::min),
        points.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max),
    ]
}

/// Those triangles of a mesh that rays can meet.
fn triangles(mesh: &Mesh) -> impl Iterator<Item = [[f32; 3]; 3]> {
    (0..mesh.n_triangles() as u32)
        .filter(|&triangle| !mesh.bounds(triangle).is_empty())
        .map(|triangle| mesh.corners(triangle))
}

/// Whether triangles leave no edge open: each belongs to an even number of them.
fn is_closed(triangles: impl Iterator<Item = [[f32; 3]; 3]>) -> bool {
    let mut n_triangles: HashMap<[[u32; 3]; 2], usize> = HashMap::new();
    for triangle in triangles {
        // 0 and −0 are the same place.
        let corners = triangle.map(|p| p.map(|c| (c + 0.0).to_bits()));
        for [i, k] in [[0, 1], [1, 2], [2, 0]] {
            let mut edge = [corners[i], corners[k]];
            edge.sort_unstable();
            *n_triangles.entry(edge).or_default() += 1;
        }
    }
    !n_triangles.is_empty() && n_triangles.values().all(|n| n % 2 == 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{LightId, MaterialId, ObjectId};
    use crate::light::{InfiniteLight, Light, Wanted};
    use crate::math::{Motion, Normal3, Transform, Vec3};
    use crate::medium::{DensityGrid, Homogeneous};
    use crate::sampling::warp::uniform_sphere;
    use crate::scatter::HenyeyGreenstein;
    use crate::shape::Quadric;
    use crate::shape::quadric::{Form, Sphere};
    use crate::texture::FloatSource;
    use crate::world::{Cutout, Instance, MediumInterface, Receiver, WorldParts};
    use glam::{DAffine3, DQuat};

    const CLOUD: MediumId = MediumId(0);
    const MATTE: MaterialId = MaterialId(0);

    fn geometry(shape: Shape, material: MaterialId) -> Geometry {
        Geometry {
            shape,
            material,
            media: None,
            cutout: Cutout::default(),
            first_light: LightId::NONE,
            object: ObjectId::NONE,
        }
    }

    fn ball(radius: f64, center: DVec3, material: MaterialId) -> Geometry {
        let sphere = Sphere::new(radius, -radius, radius, std::f64::consts::TAU);
        let place = Transform::scale_translate(1.0, center);
        geometry(
            Shape::Quadric(Quadric::new(Form::Sphere(sphere), place, false)),
            material,
        )
    }

    /// The walls of (−1, 1)³, turned.
    fn walls(turn: DQuat) -> Geometry {
        let corners = corners_of([DVec3::NEG_ONE, DVec3::ONE]);
        let sides = [
            [0, 1, 3, 2],
            [4, 6, 7, 5],
            [0, 4, 5, 1],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 5, 7, 3],
        ];
        let mesh = Mesh {
            positions: corners.map(|p| (turn * p).as_vec3().to_array()).to_vec(),
            // Normals point outward.
            triangles: sides
                .into_iter()
                .flat_map(|[a, b, c, d]| [[a, c, b], [a, d, c]])
                .collect(),
            ..Mesh::default()
        };
        Geometry {
            media: Some(MediumInterface {
                inside: CLOUD,
                outside: MediumId::NONE,
            }),
            ..geometry(Shape::Mesh(mesh), MaterialId::NONE)
        }
    }

    /// A flat panel.
    fn panel(corners: [[f32; 3]; 3]) -> Geometry {
        let mesh = Mesh {
            positions: corners.to_vec(),
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        geometry(Shape::Mesh(mesh), MATTE)
    }

    /// An object that is a small ball, and where it is placed.
    fn add_instance(parts: &mut WorldParts, place: DVec3) {
        parts.n_objects = 1;
        parts.geometries.push(Geometry {
            object: ObjectId::new(0),
            ..ball(0.1, DVec3::ZERO, MATTE)
        });
        parts.instances.push(Instance {
            object: ObjectId::new(0),
            render_from_object: Motion::Still(Transform::scale_translate(1.0, place)),
            growth: 1.0,
        });
    }

    fn fog() -> Medium {
        let phase = HenyeyGreenstein { g: 0.0 };
        Medium::Homogeneous(Homogeneous::new(Rgb::ONE, Rgb::ONE, phase))
    }

    /// A clumpy cloud whose walls cut off some of its grid, and a ball beside it.
    fn parts() -> WorldParts {
        // Its grid reaches from −1.2 to 1.3.
        let unit_from_render = DAffine3::from_scale(DVec3::splat(1.0 / 2.5))
            * DAffine3::from_translation(DVec3::splat(1.2));
        parts_with(unit_from_render)
    }

    /// The same with a grid anywhere.
    fn parts_with(unit_from_render: DAffine3) -> WorldParts {
        let n = [12, 9, 10];
        let mut rng = Rng::new(6);
        let values: Vec<f32> = (0..n.iter().product())
            .map(|_| (2.0 * rng.uniform() - 1.0).max(0.0))
            .collect();
        let grid = GridMedium::new(
            DensityGrid::new(n, &values),
            &Transform::from_affine(unit_from_render).expect("invertible"),
            Rgb::splat(0.1),
            Rgb::splat(0.9),
            HenyeyGreenstein { g: 0.0 },
        );
        WorldParts {
            geometries: vec![
                walls(DQuat::IDENTITY),
                ball(0.5, DVec3::new(0.0, 0.0, -2.5), MATTE),
            ],
            media: vec![Medium::Grid(Box::new(grid))],
            lights: vec![Light::Infinite(Box::new(InfiniteLight::constant(Rgb::ONE)))],
            ..WorldParts::default()
        }
    }

    fn with(change: impl FnOnce(&mut WorldParts)) -> Option<Cloud> {
        let mut parts = parts();
        change(&mut parts);
        World::new(parts).cloud
    }

    #[test]
    fn a_cloud_in_a_box_is_known_and_nothing_else() {
        let clear = Cloud {
            medium: CLOUD,
            is_clear: true,
        };
        let taken = Cloud {
            is_clear: false,
            ..clear
        };
        let first_mesh = |parts: &mut WorldParts, change: fn(&mut Mesh)| {
            let Shape::Mesh(mesh) = &mut parts.geometries[0].shape else {
                panic!("the walls are a mesh");
            };
            change(mesh);
        };
        assert_eq!(with(|_| ()), Some(clear));
        let quarter_turn = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        assert_eq!(
            with(|parts| parts.geometries[0] = walls(quarter_turn)),
            Some(clear)
        );
        let ball_inside = ball(0.1, DVec3::new(0.9, 0.9, 0.9), MATTE);
        assert_eq!(
            with(|parts| parts.geometries.push(ball_inside.clone())),
            Some(taken)
        );

        // Instances in the box, and panels through it, are in the way; those beside it are not, however near.
        for (place, expected) in [
            (DVec3::new(0.9, 0.0, 0.0), taken),
            (DVec3::new(1.11, 0.0, 0.0), clear),
        ] {
            assert_eq!(with(|parts| add_instance(parts, place)), Some(expected));
        }
        for (x, expected) in [(1.9, taken), (2.1, clear)] {
            // From the axis to the edge at (1, 1), or beyond it.
            let tilted = panel([[x, 0.0, -5.0], [0.0, x, -5.0], [0.0, x, 9.0]]);
            assert_eq!(with(|parts| parts.geometries.push(tilted)), Some(expected));
        }
        // A floor in the plane of a wall, whichever of the two is met first.
        for first in [true, false] {
            let floor = panel([[-9.0, -1.0, -9.0], [-9.0, -1.0, 30.0], [30.0, -1.0, -9.0]]);
            let at = |n: usize| if first { 0 } else { n };
            assert_eq!(
                with(|parts| parts.geometries.insert(at(parts.geometries.len()), floor)),
                Some(taken)
            );
        }

        // Walls that are no box along the axes, have a hole, are more than walls, or face the other way.
        let turned = walls(DQuat::from_rotation_z(0.1));
        assert_eq!(with(|parts| parts.geometries[0] = turned), None);
        assert_eq!(
            with(|parts| first_mesh(parts, |mesh| mesh.triangles.truncate(11))),
            None
        );
        assert_eq!(
            with(|parts| first_mesh(parts, |mesh| mesh.positions[3][0] = 0.9)),
            None
        );
        assert_eq!(with(|parts| parts.geometries[0].material = MATTE), None);
        assert_eq!(
            with(|parts| parts.geometries[0].first_light = LightId::new(0)),
            None
        );
        let mask = Some(FloatSource::Constant(1.0));
        assert_eq!(with(|parts| parts.geometries[0].cutout.alpha = mask), None);
        assert_eq!(
            with(|parts| {
                let wall = parts.geometries[0].clone();
                add_instance(parts, DVec3::ZERO);
                parts.geometries[2] = Geometry {
                    object: ObjectId::new(0),
                    ..wall
                };
            }),
            None
        );
        let flip = |mesh: &mut Mesh| mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert_eq!(with(|parts| first_mesh(parts, flip)), None);
        let media = parts().geometries[0].media;
        let shell = Geometry {
            media,
            ..ball(3.0, DVec3::ZERO, MaterialId::NONE)
        };
        assert_eq!(with(|parts| parts.geometries[0] = shell), None);
        // A grid beside the box, and grids and boxes so large or far that places in them are coarse.
        let grid_at = |scale: f64, shift: f64| {
            let unit_from_render = DAffine3::from_scale(DVec3::splat(1.0 / scale))
                * DAffine3::from_translation(DVec3::splat(shift));
            World::new(parts_with(unit_from_render)).cloud
        };
        assert_eq!(grid_at(2.5, 1.2), Some(clear));
        assert_eq!(grid_at(2.5, -1.1), None);
        assert_eq!(grid_at(2.5, 3.6), None);
        assert_eq!(grid_at(250.0, 120.0), Some(clear));
        assert_eq!(grid_at(2.5e4, 1.2e4), None);
        let shift = |mesh: &mut Mesh| mesh.positions.iter_mut().for_each(|p| p[0] += 1e4);
        assert_eq!(
            World::new({
                let mut parts = parts_with(DAffine3::from_translation(DVec3::new(-1e4, 0.5, 0.5)));
                first_mesh(&mut parts, shift);
                parts
            })
            .cloud,
            None
        );
        // Whoever says to be in a cloud of which some is cut off may see that part.
        assert_eq!(with(|parts| parts.camera_medium = CLOUD), None);
        assert_eq!(with(|parts| parts.light_media = vec![CLOUD]), None);
        let mut whole = parts_with(DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.5),
            DQuat::IDENTITY,
            DVec3::splat(0.5),
        ));
        whole.camera_medium = CLOUD;
        assert_eq!(World::new(whole).cloud, Some(clear));
        // Other media.
        assert_eq!(with(|parts| parts.media.push(fog())), None);
        assert_eq!(with(|parts| parts.media[0] = fog()), None);
    }

    #[test]
    fn places_and_declarations_must_agree() {
        let world = World::new(parts());
        let at = |x| Point3::new(x, 0.1, -0.2);
        assert_eq!(world.cloud_around(at(0.5), CLOUD), Some(CLOUD));
        assert_eq!(world.cloud_around(at(1.5), MediumId::NONE), Some(CLOUD));
        assert_eq!(world.cloud_around(at(0.5), MediumId::NONE), None);
        assert_eq!(world.cloud_around(at(1.5), CLOUD), None);
        for declared in [MediumId::NONE, CLOUD] {
            assert_eq!(world.cloud_around(at(1.0), declared), None);
        }
    }

    #[test]
    fn light_passes_a_cloud_as_it_passes_its_walls() {
        let world = World::new(parts());
        let by_walls = World::new({
            let mut parts = parts();
            parts.media.push(fog());
            parts
        });
        assert_eq!((world.cloud.is_some(), by_walls.cloud), (true, None));
        let mut rng = Rng::new(8);
        let (mut tally, mut dimmed, mut blocked) = (ShadowTally::default(), 0, 0);
        for k in 0..20_000 {
            let mut random = || Vec3(uniform_sphere(rng.uniform2()).0 * 3.0 * rng.uniform());
            let (from, to) = (random(), random());
            let (o, to) = (Point3(from.0), Point3(to.0));
            let is_inside = from.0.abs().max_element() < 1.0;
            let declared = if is_inside { CLOUD } else { MediumId::NONE };
            let at = Receiver {
                p: o,
                p_err: Vec3::ZERO,
                ng: Normal3::ZERO,
                wanted: Wanted::All,
                time: 0.0,
            };
            let wi = (to - o).normalize();
            let segment = if k % 2 == 0 {
                Segment::to_infinity(&at, wi)
            } else {
                Segment::new(&at, to, wi, None)
            };
            let mut tr = |world: &World| {
                world
                    .transmittance_along(&segment, &mut { declared }, &mut rng, &mut tally)
                    .g()
            };
            let (ours, expected) = (tr(&world), tr(&by_walls));
            assert!(
                (ours - expected).abs() < 1e-4,
                "{o:?} {wi:?}: {ours} for {expected}"
            );
            dimmed += u32::from((0.1..0.9).contains(&ours));
            blocked += u32::from(ours == 0.0);
        }
        assert!(dimmed > 3000 && blocked > 100, "{dimmed} {blocked}");
    }
}
