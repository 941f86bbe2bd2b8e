//! What a hierarchy is made of in memory: nodes of eight boxes, and leaves of eight triangles.

use crate::accel::RayShear;
use crate::accel::lanes::{Lanes, N_LANES};
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
pub(super) struct RayPackets<L: Lanes> {
    lanes: L,
    o: [L::Floats; 3],
    shear: [L::Floats; 2],
    axes: [usize; 3],
}

impl<L: Lanes> RayPackets<L> {
    #[inline(always)]
    pub(super) fn new(lanes: L, shear: &RayShear) -> Self {
        let axes = shear.axes();
        let [x, y] = shear.xy_shear();
        Self {
            lanes,
            o: splat3(lanes, shear.origin()),
            shear: [lanes.splat(x), lanes.splat(y)],
            axes,
        }
    }

    /// The triangles that [`RayShear::intersect`] may accept. Left out are only those that the ray surely passes by:
    /// edge values of both signs, and none that is 0. The edge values are the same to the last bit.
    #[inline(always)]
    pub(super) fn candidates(&self, packet: &Packet) -> u32 {
        let l = self.lanes;
        let p0 = self.sheared(&packet.corners[0]);
        let p1 = self.sheared(&packet.corners[1]);
        let p2 = self.sheared(&packet.corners[2]);
        let (e0, e1, e2) = (self.edge(p1, p2), self.edge(p2, p0), self.edge(p0, p1));
        let zero = l.splat(0.0);
        let least = l.min(l.min(e0, e1), e2);
        let most = l.max(l.max(e0, e1), e2);
        l.le(zero, least) | l.le(most, zero) | l.eq(e0, zero) | l.eq(e1, zero) | l.eq(e2, zero)
    }

    /// A corner of each triangle relative to the ray, sheared.
    #[inline(always)]
    fn sheared(&self, corner: &[[f32; N_LANES]; 3]) -> [L::Floats; 2] {
        let l = self.lanes;
        let [x, y, z] = self.axes;
        let px = l.sub(l.load(&corner[x]), self.o[0]);
        let py = l.sub(l.load(&corner[y]), self.o[1]);
        let pz = l.sub(l.load(&corner[z]), self.o[2]);
        [
            l.add(px, l.mul(self.shear[0], pz)),
            l.add(py, l.mul(self.shear[1], pz)),
        ]
    }

    #[inline(always)]
    fn edge(&self, a: [L::Floats; 2], b: [L::Floats; 2]) -> L::Floats {
        let l = self.lanes;
        l.sub(l.mul(a[0], b[1]), l.mul(a[1], b[0]))
    }
}
