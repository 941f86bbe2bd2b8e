//! What a hierarchy is made of in memory: nodes of eight boxes, and leaves of eight triangles.

use crate::accel::lanes::{Lanes, N_LANES};
use crate::accel::triangle::{Meeting, edges, sheared};
use crate::accel::{RayShear, TriangleHit};
use crate::math::error::gamma;
use crate::math::{Bounds3, Ray};

/// Names a triangle or a slot for the caller. Of two hits at one distance the one of the smaller key counts.
pub type Key = [u32; 2];

/// Where a child is: the index of a node, or of the first packet or slot of a leaf, and how many there are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Child(u32);

/// What a child is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Target {
    /// A node.
    Node(usize),
    /// Packets of triangles: the first, and how many.
    Triangles(usize, usize),
    /// Slots: the first, and how many.
    Slots(usize, usize),
}

impl Child {
    const LEAF: u32 = 1 << 31;
    const IS_SLOTS: u32 = 1 << 30;
    const INDEX_BITS: u32 = 27;
    /// Most packets or slots of a leaf.
    pub(super) const MAX_COUNT: usize = 7;
    /// Most packets or slots of a hierarchy.
    pub(super) const MAX_INDEX: usize = 1 << Self::INDEX_BITS;
    /// A leaf that holds nothing.
    pub(super) const NONE: Self = Self(Self::LEAF);
    /// The first node.
    pub(super) const ROOT: Self = Self(0);

    pub(super) fn new(target: Target) -> Self {
        let leaf = |first: usize, count: usize| {
            debug_assert!(first < Self::MAX_INDEX && count <= Self::MAX_COUNT);
            Self::LEAF | (count as u32) << Self::INDEX_BITS | first as u32
        };
        match target {
            Target::Node(index) => Self(index as u32),
            Target::Triangles(first, count) => Self(leaf(first, count)),
            Target::Slots(first, count) => Self(leaf(first, count) | Self::IS_SLOTS),
        }
    }

    #[inline(always)]
    pub(super) fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    #[inline(always)]
    pub(super) fn to_bits(self) -> u32 {
        self.0
    }

    #[inline(always)]
    pub(super) fn target(self) -> Target {
        let first = (self.0 & ((1 << Self::INDEX_BITS) - 1)) as usize;
        let count = (self.0 >> Self::INDEX_BITS & 7) as usize;
        if self.0 & Self::LEAF == 0 {
            Target::Node(self.0 as usize)
        } else if self.0 & Self::IS_SLOTS == 0 {
            Target::Triangles(first, count)
        } else {
            Target::Slots(first, count)
        }
    }
}

/// Eight boxes and what is in them.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Lower bounds of x, y, z, then upper bounds.
    planes: [[f32; N_LANES]; 6],
    children: [Child; N_LANES],
}

impl Node {
    pub(super) const EMPTY: Self = Self {
        planes: [
            [f32::INFINITY; N_LANES],
            [f32::INFINITY; N_LANES],
            [f32::INFINITY; N_LANES],
            [f32::NEG_INFINITY; N_LANES],
            [f32::NEG_INFINITY; N_LANES],
            [f32::NEG_INFINITY; N_LANES],
        ],
        children: [Child::NONE; N_LANES],
    };

    pub(super) fn set(&mut self, lane: usize, bounds: &Bounds3, child: Child) {
        let (lo, hi) = (bounds.min.0.to_array(), bounds.max.0.to_array());
        for axis in 0..3 {
            self.planes[axis][lane] = lo[axis];
            self.planes[axis + 3][lane] = hi[axis];
        }
        self.children[lane] = child;
    }

    #[inline(always)]
    pub(super) fn child(&self, lane: usize) -> Child {
        self.children[lane % N_LANES]
    }

    /// Whether the box of a child, which is not empty, touches another.
    pub(super) fn touches(&self, lane: usize, bounds: &Bounds3) -> bool {
        let (lo, hi) = (bounds.min.0.to_array(), bounds.max.0.to_array());
        (0..3).all(|axis| {
            self.planes[axis][lane] <= hi[axis] && lo[axis] <= self.planes[axis + 3][lane]
        })
    }

    /// Passes every child through `f`.
    pub(super) fn map_children(&mut self, f: impl Fn(Child) -> Child) {
        self.children = self.children.map(f);
    }
}

/// By how much distances to the far sides of boxes are stretched: more than the rounding errors of both sides, so
/// that no box that is really touched is skipped (Ize 2013, JCGT 2:2).
pub(super) const STRETCH: f32 = 1.0 + 2.0 * gamma(4);

// Closures do not inherit the instructions that their function may use, so there are none around lanes.
#[inline(always)]
fn splat3<L: Lanes>(lanes: L, a: [f32; 3]) -> [L::Floats; 3] {
    [lanes.splat(a[0]), lanes.splat(a[1]), lanes.splat(a[2])]
}

/// A ray prepared for boxes.
pub(super) struct RayBoxes<L: Lanes> {
    lanes: L,
    o: [L::Floats; 3],
    inverse_d: [L::Floats; 3],
    inverse_d_stretched: [L::Floats; 3],
    /// The planes through which the ray enters, then those through which it leaves, per axis.
    first: [usize; 3],
    second: [usize; 3],
}

impl<L: Lanes> RayBoxes<L> {
    #[inline(always)]
    pub(super) fn new(lanes: L, ray: &Ray) -> Self {
        // A component of zero gives ±∞, and 0 · ∞ = NaN exactly when the origin lies in a boundary plane. The smaller
        // or larger of NaN and another is that other, which leaves the plane out: the ray counts as inside the slab.
        let inverse_d = ray.d.0.to_array().map(|c| 1.0 / c);
        let first = [0, 1, 2].map(|axis| {
            if inverse_d[axis] < 0.0 {
                axis + 3
            } else {
                axis
            }
        });
        Self {
            lanes,
            o: splat3(lanes, ray.o.0.to_array()),
            inverse_d: splat3(lanes, inverse_d),
            inverse_d_stretched: splat3(lanes, inverse_d.map(|c| c * STRETCH)),
            first,
            second: [0, 1, 2].map(|axis| 2 * axis + 3 - first[axis]),
        }
    }

    /// The lanes of the boxes that the ray touches up to `reach`, and the distances at which it enters them.
    #[inline(always)]
    pub(super) fn enter(&self, node: &Node, reach: f32) -> (u32, L::Floats) {
        let lanes = self.lanes;
        let mut near = lanes.splat(0.0);
        let mut far = lanes.splat(reach);
        for axis in 0..3 {
            let first = lanes.load(&node.planes[self.first[axis]]);
            let second = lanes.load(&node.planes[self.second[axis]]);
            let t0 = lanes.mul(lanes.sub(first, self.o[axis]), self.inverse_d[axis]);
            let t1 = lanes.mul(
                lanes.sub(second, self.o[axis]),
                self.inverse_d_stretched[axis],
            );
            near = lanes.max(t0, near);
            far = lanes.min(t1, far);
        }
        (lanes.le(near, far), near)
    }
}

/// Eight triangles.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(super) struct Packet {
    /// Coordinates by vertex, axis and triangle; not a number where there is no triangle.
    corners: [[[f32; N_LANES]; 3]; 3],
    keys: [[u32; N_LANES]; 2],
}

impl Packet {
    pub(super) fn new(triangles: impl Iterator<Item = (Key, [[f32; 3]; 3])>) -> Self {
        let mut packet = Self {
            corners: [[[f32::NAN; N_LANES]; 3]; 3],
            keys: [[0; N_LANES]; 2],
        };
        for (lane, (key, corners)) in triangles.enumerate() {
            for (vertex, corner) in corners.into_iter().enumerate() {
                for (axis, c) in corner.into_iter().enumerate() {
                    packet.corners[vertex][axis][lane] = c;
                }
            }
            packet.keys[0][lane] = key[0];
            packet.keys[1][lane] = key[1];
        }
        packet
    }

    #[inline(always)]
    pub(super) fn key(&self, lane: usize) -> Key {
        let lane = lane % N_LANES;
        [self.keys[0][lane], self.keys[1][lane]]
    }

    /// The keys of the triangles whose boxes, widened by so many rounding errors of their coordinates, touch another.
    pub(super) fn keys_touching(
        &self,
        bounds: &Bounds3,
        roundings: f32,
    ) -> impl Iterator<Item = Key> {
        let (lo, hi) = (bounds.min.0.to_array(), bounds.max.0.to_array());
        let touches = move |&lane: &usize| {
            let largest = self.corners.as_flattened().iter();
            let largest = largest.map(|c| c[lane].abs()).fold(0.0, f32::max);
            let error = roundings * f32::EPSILON * largest;
            let is_there = !self.corners[0][0][lane].is_nan();
            is_there
                && (0..3).all(|axis| {
                    let [a, b, c] = [0, 1, 2].map(|vertex| self.corners[vertex][axis][lane]);
                    // An error that is no number leaves nothing out.
                    !(a.min(b).min(c) - error > hi[axis] || a.max(b).max(c) + error < lo[axis])
                })
        };
        (0..N_LANES).filter(touches).map(|lane| self.key(lane))
    }

    /// The corners of a triangle, the coordinates in the order of `axes`.
    #[inline(always)]
    pub(super) fn triangle(&self, lane: usize, axes: [usize; 3]) -> [[f32; 3]; 3] {
        let lane = lane % N_LANES;
        let [x, y, z] = axes;
        let [p0, p1, p2] = &self.corners;
        [
            [p0[x][lane], p0[y][lane], p0[z][lane]],
            [p1[x][lane], p1[y][lane], p1[z][lane]],
            [p2[x][lane], p2[y][lane], p2[z][lane]],
        ]
    }
}

/// A ray prepared for packets of triangles.
pub(super) struct RayPackets<'a, L: Lanes> {
    lanes: L,
    ray: &'a RayShear,
    o: [L::Floats; 3],
    shear: [L::Floats; 3],
    axes: [usize; 3],
}

/// Where a ray meets triangles of a packet.
pub(super) struct Hits {
    /// The lanes of the triangles that it meets.
    pub(super) mask: u32,
    t: [f32; N_LANES],
    barycentric: [[f32; N_LANES]; 2],
}

impl Hits {
    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> TriangleHit {
        let lane = lane % N_LANES;
        TriangleHit {
            t: self.t[lane],
            barycentric: [self.barycentric[0][lane], self.barycentric[1][lane]],
        }
    }

    /// Looks at triangles one by one.
    #[cold]
    #[inline(never)]
    fn decide(&mut self, ray: &RayShear, packet: &Packet, mut doubtful: u32, t_max: f32) {
        while doubtful != 0 {
            let lane = doubtful.trailing_zeros() as usize;
            doubtful &= doubtful - 1;
            let corners = packet.triangle(lane, ray.axes());
            if let Some(hit) = ray.intersect_turned(corners, t_max) {
                self.set(lane, &hit);
            }
        }
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, hit: &TriangleHit) {
        let lane = lane % N_LANES;
        self.mask |= 1 << lane;
        self.t[lane] = hit.t;
        self.barycentric[0][lane] = hit.barycentric[0];
        self.barycentric[1][lane] = hit.barycentric[1];
    }
}

impl<'a, L: Lanes> RayPackets<'a, L> {
    #[inline(always)]
    pub(super) fn new(lanes: L, ray: &'a RayShear) -> Self {
        Self {
            lanes,
            ray,
            o: splat3(lanes, ray.origin()),
            shear: splat3(lanes, ray.shear()),
            axes: ray.axes(),
        }
    }

    /// What [`RayShear::intersect`] says about each triangle, to the last bit; `None` if it accepts none.
    #[inline(always)]
    pub(super) fn intersect(&self, packet: &Packet, t_max: f32) -> Option<Hits> {
        let l = self.lanes;
        let p = [
            self.sheared(&packet.corners[0]),
            self.sheared(&packet.corners[1]),
            self.sheared(&packet.corners[2]),
        ];
        let e = edges(l, p);
        let zero = l.splat(0.0);
        let least = l.min(l.min(e[0], e[1]), e[2]);
        let most = l.max(l.max(e[0], e[1]), e[2]);
        let has_zero = l.eq(e[0], zero) | l.eq(e[1], zero) | l.eq(e[2], zero);
        let is_inside = l.le(zero, least) | l.le(most, zero);
        if is_inside | has_zero == 0 {
            return None;
        }
        let Meeting {
            t,
            error,
            inverse_det,
        } = Meeting::new(l, p, e);
        let too_far = l.le(l.splat(t_max), t);
        let behind = l.lt(t, l.sub(zero, error));
        let ahead = l.lt(error, t);
        let accepted = is_inside & ahead & !too_far & !has_zero;
        // Rounding may have decided about these, or what is no number: they are looked at one by one.
        let doubtful = has_zero | is_inside & !(ahead | behind | too_far);
        if accepted | doubtful == 0 {
            return None;
        }
        let mut hits = Hits {
            mask: accepted,
            t: l.store(t),
            barycentric: [
                l.store(l.mul(e[0], inverse_det)),
                l.store(l.mul(e[1], inverse_det)),
            ],
        };
        if doubtful != 0 {
            hits.decide(self.ray, packet, doubtful, t_max);
        }
        Some(hits)
    }

    /// A corner of each triangle relative to the ray, sheared.
    #[inline(always)]
    fn sheared(&self, corner: &[[f32; N_LANES]; 3]) -> [L::Floats; 3] {
        let l = self.lanes;
        let [x, y, z] = self.axes;
        let corner = [l.load(&corner[x]), l.load(&corner[y]), l.load(&corner[z])];
        sheared(l, corner, self.o, self.shear)
    }
}
