//! The hierarchy and its traversal.
//!
//! A node holds eight boxes, a leaf packets of eight triangles; one pass of SIMD instructions decides about all
//! (Wald, Benthin, Boulos 2008, *Getting rid of packets*). What is hit, and where, is what [`RayShear::intersect`] says,
//! to the last bit.

use arrayvec::ArrayVec;

use crate::accel::build::{self, Built, Item};
use crate::accel::lanes::{Lanes, Level, N_LANES, Portable};
use crate::accel::node::{Child, Key, Node, Packet, RayBoxes, RayPackets, STRETCH, Target};
use crate::accel::{RayShear, TriangleHit};
use crate::math::{Bounds3, Ray};

/// Most nodes that wait during traversal: seven siblings on each level.
const STACK: usize = 7 * build::MAX_DEPTH + 1;

/// A bounding volume hierarchy over triangles and *slots*, which stand for anything that has a box.
#[derive(Clone, Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    packets: Vec<Packet>,
    slots: Vec<Key>,
    bounds: Bounds3,
    level: Level,
}

/// The nearest hit so far.
struct Nearest<H> {
    /// Only what is nearer than this can still count; just beyond `t` once there is a hit, as a smaller key may lie at
    /// the same distance.
    limit: f32,
    /// How far boxes are looked at: `limit` and a little more, as distances to boxes and to what is in them are rounded
    /// differently.
    reach: f32,
    found: Option<(f32, Key, H)>,
}

impl<H> Nearest<H> {
    /// Whether a hit at `t` < `limit` comes before what was found.
    #[inline(always)]
    fn is_before(&self, t: f32, key: Key) -> bool {
        self.found
            .as_ref()
            .is_none_or(|(best, best_key, _)| t < *best || t == *best && key < *best_key)
    }

    #[inline(always)]
    fn set(&mut self, t: f32, key: Key, hit: H) {
        self.limit = t.next_up();
        self.reach = self.limit * STRETCH;
        self.found = Some((t, key, hit));
    }
}

impl Bvh {
    /// Most items of a hierarchy.
    pub const MAX_ITEMS: usize = Child::MAX_INDEX;

    /// Builds over items, [`Bvh::MAX_ITEMS`] at most; `corners` tells those of a triangle by its key. Items with empty
    /// boxes are left out. Terminates and stays shallow for any input. The result does not depend on the number of
    /// threads.
    pub fn build(items: Vec<Item>, corners: impl Fn(Key) -> [[f32; 3]; 3] + Sync) -> Self {
        let level = Level::detect();
        let Built {
            nodes,
            packets,
            slots,
            bounds,
        } = build::build(level, items, corners);
        Self {
            nodes,
            packets,
            slots,
            bounds,
            level,
        }
    }

    /// The box around everything; empty if there is nothing.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// The nearest hit in (0, `t_max`); of several at one distance that of the smallest key.
    ///
    /// `triangle(key, hit)` says what a triangle is where it is met nearer than all before, and nothing if it does not
    /// count. `slot(key, limit, shear)` finds the nearest hit of a slot in (0, `limit`).
    #[inline]
    pub fn closest<H>(
        &self,
        ray: &Ray,
        t_max: f32,
        triangle: impl FnMut(Key, &TriangleHit) -> Option<H>,
        slot: impl FnMut(Key, f32, &RayShear) -> Option<(f32, H)>,
    ) -> Option<(f32, H)> {
        match self.level {
            Level::Portable => self.closest_with(Portable, ray, t_max, triangle, slot),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2(avx2) => pulp::Simd::vectorize(
                avx2,
                #[inline(always)]
                || self.closest_with(avx2, ray, t_max, triangle, slot),
            ),
        }
    }

    /// Whether any triangle met in (0, `t_max`) satisfies `triangle(key, hit)`, or any slot whose box is met before
    /// `t_max` satisfies `slot(key, shear)`.
    #[inline]
    pub fn any(
        &self,
        ray: &Ray,
        t_max: f32,
        triangle: impl FnMut(Key, &TriangleHit) -> bool,
        slot: impl FnMut(Key, &RayShear) -> bool,
    ) -> bool {
        match self.level {
            Level::Portable => self.any_with(Portable, ray, t_max, triangle, slot),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2(avx2) => pulp::Simd::vectorize(
                avx2,
                #[inline(always)]
                || self.any_with(avx2, ray, t_max, triangle, slot),
            ),
        }
    }

    /// Tells of all triangles and slots that may touch a box: those near it in the hierarchy, some of which do not.
    /// Triangles whose own boxes do not touch it are left out, if these are widened by so many rounding errors of their
    /// coordinates; with infinitely many, none are.
    pub fn touching(
        &self,
        bounds: &Bounds3,
        roundings: f32,
        mut triangle: impl FnMut(Key),
        mut slot: impl FnMut(Key),
    ) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = vec![Child::ROOT];
        while let Some(child) = stack.pop() {
            match child.target() {
                Target::Node(index) => {
                    let node = &self.nodes[index];
                    let touched = (0..N_LANES).filter(|&lane| node.touches(lane, bounds));
                    stack.extend(touched.map(|lane| node.child(lane)));
                }
                Target::Triangles(first, count) => {
                    for packet in &self.packets[first..first + count] {
                        packet
                            .keys_touching(bounds, roundings)
                            .for_each(&mut triangle);
                    }
                }
                Target::Slots(first, count) => {
                    self.slots[first..first + count]
                        .iter()
                        .for_each(|&key| slot(key));
                }
            }
        }
    }

    #[inline(always)]
    fn closest_with<L: Lanes, H>(
        &self,
        lanes: L,
        ray: &Ray,
        t_max: f32,
        mut triangle: impl FnMut(Key, &TriangleHit) -> Option<H>,
        mut slot: impl FnMut(Key, f32, &RayShear) -> Option<(f32, H)>,
    ) -> Option<(f32, H)> {
        if self.nodes.is_empty() {
            return None;
        }
        let boxes = RayBoxes::new(lanes, ray);
        let shear = RayShear::new(ray);
        let packets = RayPackets::new(lanes, &shear);
        let mut nearest = Nearest {
            limit: t_max,
            reach: t_max * STRETCH,
            found: None,
        };
        let mut stack = ArrayVec::<Waiting, STACK>::new();
        let mut child = Child::ROOT;
        loop {
            match child.target() {
                Target::Node(index) => {
                    let node = &self.nodes[index];
                    let (mut mask, near) = boxes.enter(node, nearest.reach);
                    if mask != 0 {
                        let lane = mask.trailing_zeros() as usize;
                        mask &= mask - 1;
                        if mask == 0 {
                            child = node.child(lane);
                            continue;
                        }
                        child =
                            enter_nearest(node, lane, mask, lanes.store(near), &mut stack, |c| {
                                self.prefetch(lanes, c)
                            });
                        continue;
                    }
                }
                Target::Triangles(first, count) => {
                    for packet in &self.packets[first..first + count] {
                        let Some(hits) = packets.intersect(packet, nearest.limit) else {
                            continue;
                        };
                        let mut mask = hits.mask;
                        while mask != 0 {
                            let lane = mask.trailing_zeros() as usize;
                            mask &= mask - 1;
                            let (hit, key) = (hits.get(lane), packet.key(lane));
                            if nearest.is_before(hit.t, key)
                                && let Some(found) = triangle(key, &hit)
                            {
                                nearest.set(hit.t, key, found);
                            }
                        }
                    }
                }
                Target::Slots(first, count) => {
                    for &key in &self.slots[first..first + count] {
                        if let Some((t, found)) = slot(key, nearest.limit, &shear)
                            && nearest.is_before(t, key)
                        {
                            nearest.set(t, key, found);
                        }
                    }
                }
            }
            loop {
                let Some(waiting) = stack.pop() else {
                    return nearest.found.map(|(t, _, hit)| (t, hit));
                };
                if waiting.near() <= nearest.reach {
                    child = waiting.child();
                    break;
                }
            }
        }
    }

    /// Asks for the memory of a child whose turn will come.
    #[inline(always)]
    fn prefetch<L: Lanes>(&self, lanes: L, child: Child) {
        match child.target() {
            Target::Node(index) => lanes.prefetch(&self.nodes[index]),
            Target::Triangles(first, _) => {
                if let Some(packet) = self.packets.get(first) {
                    lanes.prefetch(packet);
                }
            }
            Target::Slots(..) => {}
        }
    }

    #[inline(always)]
    fn any_with<L: Lanes>(
        &self,
        lanes: L,
        ray: &Ray,
        t_max: f32,
        mut triangle: impl FnMut(Key, &TriangleHit) -> bool,
        mut slot: impl FnMut(Key, &RayShear) -> bool,
    ) -> bool {
        if self.nodes.is_empty() {
            return false;
        }
        let boxes = RayBoxes::new(lanes, ray);
        let shear = RayShear::new(ray);
        let packets = RayPackets::new(lanes, &shear);
        let reach = t_max * STRETCH;
        let mut stack = ArrayVec::<Child, STACK>::new();
        let mut child = Child::ROOT;
        loop {
            match child.target() {
                Target::Node(index) => {
                    let node = &self.nodes[index];
                    let (mut mask, _) = boxes.enter(node, reach);
                    if mask != 0 {
                        // The last lane first, so that the first one ends on top.
                        let mut lane = last_lane(mask);
                        mask ^= 1 << lane;
                        while mask != 0 {
                            self.prefetch(lanes, node.child(lane));
                            stack.push(node.child(lane));
                            lane = last_lane(mask);
                            mask ^= 1 << lane;
                        }
                        child = node.child(lane);
                        continue;
                    }
                }
                Target::Triangles(first, count) => {
                    for packet in &self.packets[first..first + count] {
                        let Some(hits) = packets.intersect(packet, t_max) else {
                            continue;
                        };
                        let mut mask = hits.mask;
                        while mask != 0 {
                            let lane = mask.trailing_zeros() as usize;
                            mask &= mask - 1;
                            if triangle(packet.key(lane), &hits.get(lane)) {
                                return true;
                            }
                        }
                    }
                }
                Target::Slots(first, count) => {
                    if self.slots[first..first + count]
                        .iter()
                        .any(|&key| slot(key, &shear))
                    {
                        return true;
                    }
                }
            }
            let Some(next) = stack.pop() else {
                return false;
            };
            child = next;
        }
    }
}

/// The last lane of a mask that is not empty.
#[inline(always)]
fn last_lane(mask: u32) -> usize {
    (u32::BITS - 1 - mask.leading_zeros()) as usize
}

/// A child that waits for its turn. Ordered by the distance at which the ray enters it, which is not negative.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Waiting(u64);

impl Waiting {
    #[inline(always)]
    fn new(near: f32, child: Child) -> Self {
        Self(u64::from(near.to_bits()) << 32 | u64::from(child.to_bits()))
    }

    #[inline(always)]
    fn near(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline(always)]
    fn child(self) -> Child {
        Child::from_bits(self.0 as u32)
    }
}

/// Chooses the nearest of two or more children; the others wait, the farthest for the longest.
#[inline(always)]
fn enter_nearest(
    node: &Node,
    lane: usize,
    mut mask: u32,
    near: [f32; N_LANES],
    stack: &mut ArrayVec<Waiting, STACK>,
    prefetch: impl Fn(Child),
) -> Child {
    let waiting = |lane: usize| Waiting::new(near[lane % N_LANES], node.child(lane));
    let mut nearest = waiting(lane);
    let start = stack.len();
    while mask != 0 {
        let other = waiting(mask.trailing_zeros() as usize);
        mask &= mask - 1;
        prefetch(other.child());
        let farther = nearest.max(other);
        nearest = nearest.min(other);
        // Insertion: those behind move up.
        stack.push(farther);
        let mut place = stack.len() - 1;
        while place > start && stack[place - 1] < farther {
            stack[place] = stack[place - 1];
            place -= 1;
        }
        stack[place] = farther;
    }
    nearest.child()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::error::gamma;
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

    fn of_boxes(boxes: &[Bounds3]) -> Bvh {
        let items = boxes.iter().zip(0..).map(|(b, i)| Item::slot(b, [0, i]));
        Bvh::build(items.collect(), |_| unreachable!("there are no triangles"))
    }

    fn around(triangle: &[[f32; 3]; 3]) -> Bounds3 {
        let corners = triangle.iter().map(|&p| Point3::from(p));
        corners.fold(Bounds3::EMPTY, Bounds3::with_point)
    }

    fn of_triangles(triangles: &[[[f32; 3]; 3]]) -> Bvh {
        let items = triangles.iter().zip(0..);
        let items = items.map(|(t, i)| Item::triangle(&around(t), [i % 3, i]));
        Bvh::build(items.collect(), |key| triangles[key[1] as usize])
    }

    /// Everything that a hierarchy of slots visits along a ray.
    fn visited(bvh: &Bvh, ray: &Ray, n: usize) -> Vec<bool> {
        let mut visited = vec![false; n];
        let nothing: Option<(f32, ())> = bvh.closest(
            ray,
            f32::INFINITY,
            |_, _| None,
            |key, _, _| {
                visited[key[1] as usize] = true;
                None
            },
        );
        assert!(nothing.is_none());
        visited
    }

    fn closest(bvh: &Bvh, ray: &Ray, t_max: f32) -> Option<(Key, TriangleHit)> {
        let found = bvh.closest(ray, t_max, |key, hit| Some((key, *hit)), |_, _, _| None);
        found.map(|(_, hit)| hit)
    }

    fn any(bvh: &Bvh, ray: &Ray, t_max: f32) -> bool {
        bvh.any(ray, t_max, |_, _| true, |_, _| false)
    }

    /// Slots whose own box the ray meets, by a plain slab test in f64.
    fn brute_force(boxes: &[Bounds3], ray: &Ray) -> Vec<usize> {
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
        (0..boxes.len()).filter(|&i| hits(&boxes[i])).collect()
    }

    #[test]
    fn every_box_a_ray_touches_is_visited() {
        let crowds = [(1, 0.5), (2, 0.5), (100, 0.3), (3000, 0.05), (500, 0.0)];
        // Of the last one only some are looked at to divide it.
        for (n, size) in crowds.into_iter().chain([(100_000, 0.01)]) {
            let boxes = random_boxes(n, size, n as u64);
            let bvh = of_boxes(&boxes);
            let mut rng = Rng::new(1);
            for k in 0..if n > 10_000 { 50 } else { 500 } {
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
                let visited = visited(&bvh, &ray, n);
                for i in brute_force(&boxes, &ray) {
                    assert!(visited[i], "{n} boxes, ray {ray:?} skips {i}");
                }
            }
        }
    }

    #[test]
    fn the_hierarchy_is_the_same_whatever_the_registers_that_build_it() {
        let triangles = random_triangles(50_000, 8);
        let built = |level| {
            let items = triangles.iter().zip(0..);
            let items = items.map(|(t, i)| Item::triangle(&around(t), [i % 3, i]));
            let built = build::build(level, items.collect(), |key| triangles[key[1] as usize]);
            format!("{:?} {:?}", built.nodes, built.packets)
        };
        assert!(built(Level::detect()) == built(Level::Portable));
    }

    #[test]
    fn any_stops_at_the_first_hit() {
        let boxes = random_boxes(1000, 0.5, 5);
        let bvh = of_boxes(&boxes);
        let ray = Ray {
            o: Point3::new(-5.0, 0.0, 0.0),
            d: Vec3::new(1.0, 0.0, 0.0),
            time: 0.0,
        };
        let mut calls = 0;
        assert!(bvh.any(
            &ray,
            f32::INFINITY,
            |_, _| false,
            |_, _| {
                calls += 1;
                true
            }
        ));
        assert_eq!(calls, 1);
        assert!(!bvh.any(&ray, 1.0, |_, _| true, |_, _| true));
    }

    #[test]
    fn g16_seventy_thousand_boxes_in_one_place_build_a_shallow_tree() {
        let one = Bounds3::EMPTY
            .with_point(Point3::ZERO)
            .with_point(Point3::new(1.0, 1.0, 1.0));
        let ray = Ray {
            o: Point3::new(0.25, 0.25, -1.0),
            d: Vec3::new(0.0, 0.0, 1.0),
            time: 0.0,
        };
        let bvh = of_boxes(&vec![one; 70_000]);
        assert!(
            visited(&bvh, &ray, 70_000)
                .iter()
                .all(|&is_visited| is_visited)
        );
        let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]];
        let bvh = of_triangles(&vec![triangle; 70_000]);
        // Of all these hits at one distance the one of the smallest key counts.
        assert_eq!(
            closest(&bvh, &ray, f32::INFINITY).map(|hit| hit.0),
            Some([0, 0])
        );
    }

    #[test]
    fn a_packet_finds_what_the_scalar_test_finds_to_the_last_bit() {
        let mut rng = Rng::new(12);
        let all = random_triangles(4000, 3);
        let (mut n_hits, mut n_near) = (0, 0);
        for (k, triangles) in all.chunks(8).enumerate() {
            // Whole packets and parts of one; runs of one mesh, and not.
            let triangles = &triangles[..1 + k % 8];
            let items = triangles.iter().zip(0..).map(|(t, i)| {
                let key = if k % 2 == 0 { [0, i] } else { [i % 3, i] };
                Item::triangle(&around(t), key)
            });
            let mut joined = Vec::new();
            items.for_each(|item| build::push_item(&mut joined, item));
            let bvh = Bvh::build(joined, |key| triangles[key[1] as usize]);
            for j in 0..60 {
                // From afar, and from a corner, an edge or the inside of a triangle; some along an axis.
                let [a, b, c] = triangles[j % triangles.len()].map(Point3::from);
                let [u, v] = rng.uniform2();
                let target = match j % 4 {
                    0 => a,
                    1 => a + (b - a) * u,
                    _ => a + (b - a) * (u * 0.5) + (c - a) * (v * 0.5),
                };
                let mut d = uniform_sphere(rng.uniform2());
                if j % 5 == 0 {
                    d = [Vec3::new(0.0, 0.0, 1.0), Vec3::new(-1.0, 0.0, 0.0)][k % 2];
                }
                let away = [0.0, 1e-6, 0.5, 3.0][j / 4 % 4];
                let ray = Ray {
                    o: target - d * away,
                    d,
                    time: 0.0,
                };
                let shear = RayShear::new(&ray);
                let plain = |t_max: f32| {
                    let hits = (0..).zip(triangles).filter_map(|(i, t)| {
                        let key = if k % 2 == 0 { [0, i] } else { [i % 3, i] };
                        Some((key, shear.intersect(*t, t_max)?))
                    });
                    hits.min_by(|(i, a), (j, b)| a.t.total_cmp(&b.t).then(i.cmp(j)))
                };
                let nearest = plain(f32::INFINITY);
                let limits = [f32::INFINITY, nearest.map_or(1.0, |(_, hit)| hit.t), 0.5];
                for t_max in limits {
                    let (found, expected) = (closest(&bvh, &ray, t_max), plain(t_max));
                    assert_eq!(found, expected, "{triangles:?} {ray:?} {t_max}");
                    assert_eq!(any(&bvh, &ray, t_max), expected.is_some());
                    n_hits += usize::from(found.is_some());
                    n_near += usize::from(found.is_some_and(|(_, hit)| hit.t < 1e-5));
                }
            }
        }
        assert!(n_hits > 10_000 && n_near > 300, "{n_hits} {n_near}");
    }

    #[test]
    fn nothing_is_hit_in_an_empty_hierarchy() {
        let bvh = of_boxes(&[Bounds3::EMPTY]);
        assert!(bvh.bounds().is_empty());
        let ray = Ray {
            o: Point3::ZERO,
            d: Vec3::new(0.0, 0.0, 1.0),
            time: 0.0,
        };
        assert!(!bvh.any(&ray, f32::INFINITY, |_, _| true, |_, _| true));
    }

    /// Triangles of all sizes, many of them in axis-parallel planes, some copied, some without area.
    fn random_triangles(n: usize, seed: u64) -> Vec<[[f32; 3]; 3]> {
        let mut rng = Rng::new(seed);
        let mut triangles: Vec<[[f32; 3]; 3]> = Vec::new();
        for k in 0..n {
            let size = 10f32.powi(-((k % 5) as i32));
            let at = uniform_sphere(rng.uniform2()) * rng.uniform();
            let mut triangle = [0; 3].map(|_| {
                let p = at + uniform_sphere(rng.uniform2()) * size;
                if k % 3 == 0 {
                    p.0.to_array().map(|c| (c * 8.0).round() / 8.0)
                } else {
                    p.0.to_array()
                }
            });
            if k % 7 == 0 && k > 0 {
                triangle = triangles[rng.next_u32() as usize % k];
            }
            triangles.push(triangle);
        }
        triangles
    }

    /// Rays at random, along axes, from corners, and toward corners.
    fn random_rays(n: usize, triangles: &[[[f32; 3]; 3]], seed: u64) -> Vec<Ray> {
        let mut rng = Rng::new(seed);
        let mut rays = Vec::new();
        for k in 0..n {
            let triangle = triangles[rng.next_u32() as usize % triangles.len()];
            let corner = Point3::from(triangle[k % 3]);
            let mut d = uniform_sphere(rng.uniform2());
            if k % 5 == 0 {
                d = [
                    Vec3::new(1.0, 0.0, -0.0),
                    Vec3::new(-0.0, -1.0, 0.0),
                    Vec3::new(0.0, 0.0, 1.0),
                ][k % 3];
            }
            let o = match k % 4 {
                0 => corner,
                1 => corner - d * 3.0,
                _ => Point3::ZERO + uniform_sphere(rng.uniform2()) * 2.0,
            };
            rays.push(Ray { o, d, time: 0.0 });
        }
        rays
    }

    #[test]
    fn the_nearest_hit_is_that_of_a_plain_loop_whatever_the_registers() {
        for n in [1, 7, 8, 9, 100, 4000] {
            let triangles = random_triangles(n, n as u64);
            let bvh = of_triangles(&triangles);
            let portable = Bvh {
                level: Level::Portable,
                ..bvh.clone()
            };
            let n_rays = if n > 1000 { 2_000 } else { 20_000 };
            for (k, ray) in random_rays(n_rays, &triangles, 3).iter().enumerate() {
                let t_max = [f32::INFINITY, 0.7][k % 2];
                let found = closest(&bvh, ray, t_max);
                let shear = RayShear::new(ray);
                let mut nearest: Option<(Key, TriangleHit)> = None;
                for (triangle, i) in triangles.iter().zip(0..) {
                    let key = [i % 3, i];
                    let hit = shear.intersect(*triangle, t_max);
                    if let Some(hit) = hit
                        && nearest.is_none_or(|(best_key, best)| {
                            hit.t < best.t || hit.t == best.t && key < best_key
                        })
                    {
                        nearest = Some((key, hit));
                    }
                }
                // Both are rounded; only what a box hides by that may differ.
                let t = |hit: &Option<(Key, TriangleHit)>| hit.map(|(_, hit)| hit.t);
                if found != nearest {
                    let (Some(a), Some(b)) = (t(&found), t(&nearest)) else {
                        panic!("{n}: {ray:?}: {found:?}, expected {nearest:?}");
                    };
                    assert!(
                        (a - b).abs() <= 4.0 * gamma(4) * b,
                        "{n}: {ray:?}: {a}, expected {b}"
                    );
                }
                assert_eq!(found, closest(&portable, ray, t_max), "{ray:?}");
                assert_eq!(any(&bvh, ray, t_max), found.is_some(), "{ray:?}");
                assert_eq!(any(&portable, ray, t_max), found.is_some(), "{ray:?}");
            }
        }
    }
}
