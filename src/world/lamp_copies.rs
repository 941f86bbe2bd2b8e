//! Copies of lamps share what a choice among them asks for: a copy of an object is chosen by what all of its lamps may
//! bring, then a lamp of it by one tree for all copies, in which the receiver is put where the first copy would see it.
//! Lamps and copies multiply, and so do no trees.

use glam::DAffine3;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use crate::ids::LightId;
use crate::light::{Emitter, LightTree};
use crate::math::error::EPSILON;
use crate::math::{Bounds3, Normal3, Point3, Transform, Vec3};
use crate::world::{Receiver, World};

/// Copies of the lamps of an object.
#[derive(Clone, Debug, Default)]
pub struct LampCopies {
    /// Render space from that of the object, for each copy. All have inverses.
    pub render_from_object: Vec<DAffine3>,
    /// The shapes that emit.
    pub shapes: Vec<CopiedLamp>,
}

/// Copies of a shape that emits.
#[derive(Clone, Debug)]
pub struct CopiedLamp {
    /// Number of elements, which are as many lights with ids that follow each other.
    pub n_elements: u32,
    /// The light of the first element for each copy; fewer than there are copies if some were left out.
    pub first_lights: Vec<LightId>,
}

impl LampCopies {
    /// The first light of each copy of each shape.
    pub(super) fn first_lights_mut(&mut self) -> impl Iterator<Item = &mut LightId> {
        let shapes = self.shapes.iter_mut();
        shapes.flat_map(|shape| &mut shape.first_lights)
    }

    fn first_lights(&self) -> impl Iterator<Item = LightId> {
        let shapes = self.shapes.iter();
        shapes.flat_map(|shape| shape.first_lights.iter().copied())
    }

    /// The copies of which nothing was left out, and the shapes, by their lights: in an order that the file does not
    /// decide.
    fn in_order(&self) -> (Vec<usize>, Vec<&CopiedLamp>) {
        let lengths = self.shapes.iter().map(|shape| shape.first_lights.len());
        let n_copies = lengths.min().unwrap_or(0);
        let first_of = |copy: &usize| self.shapes.iter().map(|s| s.first_lights[*copy]).min();
        let mut copies: Vec<usize> = (0..n_copies).collect();
        copies.sort_unstable_by_key(first_of);
        let mut shapes: Vec<&CopiedLamp> = self.shapes.iter().collect();
        if let Some(&first) = copies.first() {
            shapes.sort_unstable_by_key(|shape| shape.first_lights[first]);
        }
        (copies, shapes)
    }
}

/// Angle, in radians, by which a normal may be off from that of the first copy.
const MAX_TURN: f32 = 0.01;
/// Part of the size of a copy by which rounding may move its lamps.
const MAX_SLACK: f64 = 1e-3;
/// What places of copies in a transform's range add up from.
const OPERATIONS: f64 = 8.0;

/// Trees that copies share.
#[derive(Clone, Debug, Default)]
pub(super) struct SharedTrees {
    /// Emitters, and places, that are lamps by themselves; copies follow.
    n_alone: usize,
    trees: Vec<LightTree>,
    copies: Vec<LampCopy>,
}

/// A copy of lamps.
#[derive(Clone, Debug)]
struct LampCopy {
    /// Its first place.
    first: usize,
    tree: usize,
    /// The first copy's surroundings from those of this one.
    first_from_render: DAffine3,
}

impl LampCopy {
    /// A receiver as the first copy sees it. Where copies are not similar, which side of a lamp it is on stays as it is,
    /// and angles serve as a guess.
    #[inline]
    fn receiver(&self, at: &Receiver) -> (Point3, Normal3) {
        let p = self.first_from_render.transform_point3(at.p.to_f64());
        let ng = self.first_from_render.transform_vector3(at.ng.to_f64());
        let ng = Normal3::from_f64(ng.normalize_or_zero());
        (Point3::from_f64(p), ng)
    }
}

impl SharedTrees {
    /// Finds a place among those of an emitter of the tree of all, by what is left of `u`: the place and its probability
    /// there.
    #[inline]
    pub(super) fn choose(&self, emitter: usize, at: &Receiver, u: f64) -> (usize, f32) {
        if emitter < self.n_alone {
            return (emitter, 1.0);
        }
        let copy = &self.copies[emitter - self.n_alone];
        let (p, ng) = copy.receiver(at);
        let (lamp, pmf, _) = self.trees[copy.tree].choose(p, ng, u);
        (copy.first + lamp, pmf)
    }

    /// The emitter of a place, and the probability of the place there.
    #[inline]
    pub(super) fn pmf(&self, place: usize, at: &Receiver) -> (usize, f32) {
        if place < self.n_alone {
            return (place, 1.0);
        }
        let index = self.copies.partition_point(|copy| copy.first <= place) - 1;
        let copy = &self.copies[index];
        let (p, ng) = copy.receiver(at);
        let pmf = self.trees[copy.tree].pmf(p, ng, place - copy.first);
        (self.n_alone + index, pmf)
    }
}

/// Copies in the making.
#[derive(Default)]
pub(super) struct SharedTreesBuilder {
    shared: SharedTrees,
    /// What stands for each copy in the tree of all.
    pub(super) emitters: Vec<Emitter>,
    /// The lights of the copies, with what they emit, roughly.
    pub(super) lights: Vec<(LightId, f64)>,
}

/// What there is to know of a copy.
struct Candidate {
    copy: usize,
    first_from_render: Transform,
    whole: Emitter,
    /// Largest angle between its normals and those of the first copy, where that one is.
    turn: f32,
    /// How far its lamps may be from those of the first copy, where that one is.
    slack: f64,
}

impl SharedTreesBuilder {
    /// Shares one tree between copies of lamps, but for those that are too different. `emitter` tells of a light.
    pub(super) fn share(
        &mut self,
        copies: &LampCopies,
        emitter: impl Fn(LightId) -> Option<Emitter> + Sync,
    ) {
        let (order, shapes) = copies.in_order();
        let lights = |copy: usize| {
            shapes.iter().flat_map(move |shape| {
                let first = shape.first_lights[copy].0;
                (first..first + shape.n_elements).map(LightId)
            })
        };
        let Some(&first) = order.first() else {
            return;
        };
        let of_first: Vec<Option<Emitter>> = lights(first).map(&emitter).collect();
        let mut own: Vec<Emitter> = of_first.iter().flatten().copied().collect();
        let Some(all) = Emitter::around(&own) else {
            return;
        };
        if own.len() < 2 || order.len() < 2 {
            return;
        }
        let size = f64::from(all.bounds.extent().length());
        let render_from_object = Transform::from_affine(copies.render_from_object[first]);
        let know = |&copy: &usize| {
            let render_from_copy = Transform::from_affine(copies.render_from_object[copy])?;
            let first_from_render = render_from_object?.compose(&render_from_copy.inverse());
            let mut emitters = Vec::with_capacity(own.len());
            let mut turn = 0f32;
            for (light, first) in lights(copy).zip(&of_first) {
                let own = emitter(light);
                if own.is_some() != first.is_some() {
                    return None;
                }
                let (Some(own), Some(first)) = (own, first) else {
                    continue;
                };
                if first.spread < std::f32::consts::PI {
                    let seen = first_from_render.normal(own.axis.to_f64());
                    let seen = Vec3::from_f64(seen.normalize_or_zero());
                    turn = turn.max(angle_between(seen, first.axis));
                }
                emitters.push(own);
            }
            let whole = Emitter::around(&emitters)?;
            let m = first_from_render.affine().matrix3;
            let stretch = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.length_squared());
            let stretch = stretch.iter().sum::<f64>().sqrt();
            let slack = OPERATIONS
                * f64::from(EPSILON)
                * (farthest(&all.bounds) + stretch * farthest(&whole.bounds));
            (slack <= MAX_SLACK * size && turn <= MAX_TURN).then_some(Candidate {
                copy,
                first_from_render,
                whole,
                turn,
                slack,
            })
        };
        let known: Vec<Option<Candidate>> = order.par_iter().map(know).collect();
        let known: Vec<Candidate> = known.into_iter().flatten().collect();
        let slack = known.iter().map(|known| known.slack).fold(0.0, f64::max);
        let turn = known.iter().map(|known| known.turn).fold(0.0, f32::max);
        for emitter in &mut own {
            let grown = [
                emitter.bounds.min.to_f64() - slack,
                emitter.bounds.max.to_f64() + slack,
            ];
            emitter.bounds = Bounds3::around(grown[0], grown[1]);
            emitter.spread = (emitter.spread + turn).min(std::f32::consts::PI);
        }
        if known.is_empty() {
            return;
        }
        let Some(tree) = LightTree::new(&own) else {
            return;
        };
        self.shared.trees.push(tree);
        for known in known {
            self.shared.copies.push(LampCopy {
                first: self.lights.len(),
                tree: self.shared.trees.len() - 1,
                first_from_render: *known.first_from_render.affine(),
            });
            self.emitters.push(known.whole);
            let of_copy = lights(known.copy).zip(&of_first);
            let of_copy =
                of_copy.filter_map(|(id, emitter)| Some((id, emitter.as_ref()?.intensity)));
            self.lights.extend(of_copy);
        }
    }

    /// What is shared, behind `n_alone` lamps by themselves.
    pub(super) fn behind(mut self, n_alone: usize) -> SharedTrees {
        self.shared.n_alone = n_alone;
        for copy in &mut self.shared.copies {
            copy.first += n_alone;
        }
        self.shared
    }
}

/// Between unit vectors, in radians, accurate at all angles.
fn angle_between(a: Vec3, b: Vec3) -> f32 {
    2.0 * (a - b).length().atan2((a + b).length())
}

/// The largest coordinate in a box.
fn farthest(bounds: &Bounds3) -> f64 {
    let (min, max) = (bounds.min.to_f64(), bounds.max.to_f64());
    min.abs().max(max.abs()).max_element()
}

impl World {
    /// What copies of lamps share.
    pub(super) fn share_lamps(&self, copies: &[LampCopies]) -> SharedTreesBuilder {
        let mut sharing = SharedTreesBuilder::default();
        let mut copies: Vec<&LampCopies> = copies.iter().collect();
        copies.sort_by_cached_key(|copies| copies.first_lights().min());
        for copies in copies {
            sharing.share(copies, |id| self.emitter(self.light(id)));
        }
        sharing
    }
}
