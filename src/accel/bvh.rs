//! The hierarchy and its traversal.

use crate::accel::build;
use crate::math::error::gamma;
use crate::math::{Bounds3, Ray};

/// An inner node: the boxes of its two children side by side, so that one cache line decides where to go.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Lower bounds, `[axis][child]`.
    pub(super) lo: [[f32; 2]; 3],
    /// Upper bounds, `[axis][child]`.
    pub(super) hi: [[f32; 2]; 3],
    /// Node index, or first slot of a leaf.
    pub(super) child: [u32; 2],
    /// Number of slots of a leaf; 0 for an inner node.
    pub(super) count: [u32; 2],
}

const _: () = assert!(size_of::<Node>() == 64 && align_of::<Node>() == 64);

impl Node {
    pub(super) const EMPTY: Self = Self {
        lo: [[f32::INFINITY; 2]; 3],
        hi: [[f32::NEG_INFINITY; 2]; 3],
        child: [0; 2],
        count: [0; 2],
    };

    pub(super) fn set_child(&mut self, side: usize, bounds: &Bounds3, child: u32, count: u32) {
        let (lo, hi) = (bounds.min.0.to_array(), bounds.max.0.to_array());
        for axis in 0..3 {
            self.lo[axis][side] = lo[axis];
            self.hi[axis][side] = hi[axis];
        }
        self.child[side] = child;
        self.count[side] = count;
    }
}

/// Deepest hierarchy the builder makes; bounds the traversal stack.
pub(super) const MAX_DEPTH: usize = 64;

/// A binary bounding volume hierarchy over *slots*: the caller stores its primitives in slot order.
#[derive(Clone, Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    bounds: Bounds3,
}

/// What traversal needs of a ray, computed once.
struct RayBox {
    o: [f32; 3],
    inverse_d: [f32; 3],
    /// The child index (0 or 1 bound) through which the ray enters, per axis: 1 when it travels downward.
    down: [bool; 3],
}

impl RayBox {
    fn new(ray: &Ray) -> Self {
        // A component of zero gives ±∞, and 0 · ∞ = NaN exactly when the origin lies in a boundary plane. Every
        // comparison in `enter` is then false, which leaves that plane out: the ray counts as inside the slab.
        let inverse_d = ray.d.0.to_array().map(|c| 1.0 / c);
        Self {
            o: ray.o.0.to_array(),
            inverse_d,
            down: inverse_d.map(|c| c < 0.0),
        }
    }

    /// Entry distance into each child; ∞ where it is missed. The far side is widened by the rounding error of
    /// the slab test, so that no box that is really touched is skipped.
    #[inline]
    fn enter(&self, node: &Node, t_max: f32) -> [f32; 2] {
        let mut near = [0.0f32; 2];
        let mut far = [t_max; 2];
        for axis in 0..3 {
            let (first, second) = if self.down[axis] {
                (&node.hi[axis], &node.lo[axis])
            } else {
                (&node.lo[axis], &node.hi[axis])
            };
            for side in 0..2 {
                let t0 = (first[side] - self.o[axis]) * self.inverse_d[axis];
                let t1 =
                    (second[side] - self.o[axis]) * self.inverse_d[axis] * (1.0 + 2.0 * gamma(3));
                near[side] = if t0 > near[side] { t0 } else { near[side] };
                far[side] = if t1 < far[side] { t1 } else { far[side] };
            }
        }
        [0, 1].map(|side| {
            if near[side] <= far[side] {
                near[side]
            } else {
                f32::INFINITY
            }
        })
    }
}

impl Bvh {
    /// Builds over the given boxes. Returns the hierarchy and the order of the slots: slot `i` holds box
    /// `order[i]`. Empty boxes are left out. Terminates and stays shallow for any input.
    pub fn build(boxes: &[Bounds3]) -> (Self, Vec<u32>) {
        let built = build::build(boxes);
        (
            Self {
                nodes: built.nodes,
                bounds: built.bounds,
            },
            built.order,
        )
    }

    /// The box around everything; empty if there is nothing.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// Bytes on the heap.
    pub fn memory(&self) -> usize {
        self.nodes.len() * size_of::<Node>()
    }

    /// Visits the slots whose boxes the ray meets, roughly near to far. `hit(slot, t_max)` returns the distance
    /// of a hit closer than `t_max`, which then bounds the rest.
    #[inline]
    pub fn closest(&self, ray: &Ray, t_max: f32, mut hit: impl FnMut(u32, f32) -> Option<f32>) {
        if self.nodes.is_empty() {
            return;
        }
        let ray_box = RayBox::new(ray);
        let mut t_max = t_max;
        let mut stack = [(0u32, 0u32, 0f32); MAX_DEPTH];
        let mut depth = 0;
        let (mut node, mut count) = (0u32, 0u32);
        loop {
            if count > 0 {
                for slot in node..node + count {
                    if let Some(t) = hit(slot, t_max) {
                        t_max = t;
                    }
                }
            } else {
                let n = &self.nodes[node as usize];
                let t = ray_box.enter(n, t_max);
                let near = usize::from(t[1] < t[0]);
                if t[near] < f32::INFINITY {
                    let far = 1 - near;
                    if t[far] < f32::INFINITY {
                        stack[depth] = (n.child[far], n.count[far], t[far]);
                        depth += 1;
                    }
                    (node, count) = (n.child[near], n.count[near]);
                    continue;
                }
            }
            loop {
                if depth == 0 {
                    return;
                }
                depth -= 1;
                let entry;
                (node, count, entry) = stack[depth];
                if entry <= t_max {
                    break;
                }
            }
        }
    }

    /// Whether `hit(slot)` holds for any slot whose box the ray meets before `t_max`.
    #[inline]
    pub fn any(&self, ray: &Ray, t_max: f32, mut hit: impl FnMut(u32) -> bool) -> bool {
        let mut found = false;
        self.closest(ray, t_max, |slot, _| {
            if !found && hit(slot) {
                found = true;
            }
            // Nothing lies before distance −∞: the traversal ends at the next box.
            found.then_some(f32::NEG_INFINITY)
        });
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point3, Vec3};
    use crate::sampling::rng::Rng;
    use crate::sampling::warp::uniform_sphere;

    fn random_boxes(n: usize, size: f32, seed: u64) -> Vec<Bounds3> {
        let mut rng = Rng::new(seed);
        let mut point = |scale: f32, at: Point3| {
            at + Vec3::new(
                rng.uniform() - 0.5,
                rng.uniform() - 0.5,
                rng.uniform() - 0.5,
            ) * scale
        };
        (0..n)
            .map(|_| {
                let p = point(2.0, Point3::ZERO);
                Bounds3::EMPTY.with_point(p).with_point(point(size, p))
            })
            .collect()
    }

    /// Slots whose own box the ray meets, by a plain slab test in f64.
    fn brute_force(boxes: &[Bounds3], ray: &Ray) -> Vec<u32> {
        let hits = |b: &Bounds3| {
            let (mut near, mut far) = (0f64, f64::INFINITY);
            for axis in 0..3 {
                let (o, d) = (ray.o.0[axis] as f64, ray.d.0[axis] as f64);
                let (lo, hi) = (b.min.0[axis] as f64, b.max.0[axis] as f64);
                if d == 0.0 {
                    if o < lo || o > hi {
                        return false;
                    }
                    continue;
                }
                let (t0, t1) = ((lo - o) / d, (hi - o) / d);
                near = near.max(t0.min(t1));
                far = far.min(t0.max(t1));
            }
            near <= far
        };
        (0..boxes.len() as u32)
            .filter(|&i| hits(&boxes[i as usize]))
            .collect()
    }

    #[test]
    fn every_box_a_ray_touches_is_visited() {
        for (n, size) in [(1, 0.5), (2, 0.5), (100, 0.3), (3000, 0.05), (500, 0.0)] {
            let boxes = random_boxes(n, size, n as u64);
            let (bvh, order) = Bvh::build(&boxes);
            let mut rng = Rng::new(1);
            for k in 0..500 {
                let o = boxes[rng.next_u32() as usize % n].min;
                let mut d = uniform_sphere(rng.uniform2());
                if k % 3 == 0 {
                    d = [Vec3::new(1.0, 0.0, -0.0), Vec3::new(-0.0, -1.0, 0.0)][k % 2];
                }
                let ray = Ray {
                    o: if k % 2 == 0 { o } else { o - d * 3.0 },
                    d,
                    time: 0.0,
                };
                let mut visited = vec![false; n];
                bvh.closest(&ray, f32::INFINITY, |slot, _| {
                    visited[order[slot as usize] as usize] = true;
                    None
                });
                for i in brute_force(&boxes, &ray) {
                    assert!(visited[i as usize], "{n} boxes, ray {ray:?} skips {i}");
                }
            }
        }
    }

    #[test]
    fn any_stops_at_the_first_hit() {
        let boxes = random_boxes(1000, 0.5, 5);
        let (bvh, _) = Bvh::build(&boxes);
        let ray = Ray {
            o: Point3::new(-5.0, 0.0, 0.0),
            d: Vec3::new(1.0, 0.0, 0.0),
            time: 0.0,
        };
        let mut calls = 0;
        assert!(bvh.any(&ray, f32::INFINITY, |_| {
            calls += 1;
            true
        }));
        assert_eq!(calls, 1);
        assert!(!bvh.any(&ray, 1.0, |_| true));
    }

    #[test]
    fn g16_seventy_thousand_boxes_in_one_place_build_a_shallow_tree() {
        let one = Bounds3::EMPTY
            .with_point(Point3::ZERO)
            .with_point(Point3::new(1.0, 1.0, 1.0));
        let (bvh, order) = Bvh::build(&vec![one; 70_000]);
        assert_eq!(order.len(), 70_000);
        let mut seen = 0;
        let ray = Ray {
            o: Point3::new(0.5, 0.5, -1.0),
            d: Vec3::new(0.0, 0.0, 1.0),
            time: 0.0,
        };
        bvh.closest(&ray, f32::INFINITY, |_, _| {
            seen += 1;
            None
        });
        assert_eq!(seen, 70_000);
    }

    #[test]
    fn nothing_is_hit_in_an_empty_hierarchy() {
        let (bvh, order) = Bvh::build(&[Bounds3::EMPTY]);
        assert!(order.is_empty() && bvh.bounds().is_empty());
        let ray = Ray {
            o: Point3::ZERO,
            d: Vec3::new(0.0, 0.0, 1.0),
            time: 0.0,
        };
        assert!(!bvh.any(&ray, f32::INFINITY, |_| true));
    }
}
