//! Building the hierarchy: binned surface-area heuristic, top down, eight children at a time (Wald 2007; Wald, Benthin,
//! Boulos 2008), in parallel for large inputs.

use arrayvec::ArrayVec;
use glam::{Vec3A, Vec4};
use rayon::iter::{
    IndexedParallelIterator, IntoParallelIterator, IntoParallelRefIterator, ParallelIterator,
};

use crate::accel::lanes::N_LANES;
use crate::accel::node::{Child, Key, Node, Packet, Target};
use crate::math::{Bounds3, Point3};

const MAX_BINS: usize = 32;
/// Most slots of a leaf.
const MAX_SLOTS: usize = Child::MAX_COUNT;
/// Most triangles of a leaf.
const MAX_TRIANGLES: usize = 2 * N_LANES;
/// Cost of visiting a node relative to testing a packet or a slot.
const NODE_COST: f32 = 1.0;
/// Below this many items a subtree is built on one thread.
const PARALLEL_ITEMS: usize = 1 << 13;
/// From this depth on, splits halve the count, so that 2³² items stay within [`MAX_DEPTH`].
const BALANCED_DEPTH: usize = 24;
/// Deepest hierarchy the builder makes; bounds the traversal stack.
pub(super) const MAX_DEPTH: usize = BALANCED_DEPTH + 12;

/// Something in a hierarchy: its box, its key, and whether it is a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Item {
    /// Smallest corner, and the first half of the key in the last component. Its topmost bit marks slots.
    lo: Vec4,
    /// Largest corner, and the second half of the key.
    hi: Vec4,
}

impl Item {
    const IS_SLOT: u32 = 1 << 31;

    fn new(bounds: &Bounds3, key: Key) -> Self {
        Self {
            lo: bounds.min.0.extend(f32::from_bits(key[0])),
            hi: bounds.max.0.extend(f32::from_bits(key[1])),
        }
    }

    /// A triangle in a box. The first half of the key is below 2³¹.
    pub fn triangle(bounds: &Bounds3, key: Key) -> Self {
        debug_assert!(key[0] < Self::IS_SLOT);
        Self::new(bounds, key)
    }

    /// A slot with a box. The first half of the key is below 2³¹.
    pub fn slot(bounds: &Bounds3, key: Key) -> Self {
        debug_assert!(key[0] < Self::IS_SLOT);
        Self::new(bounds, [key[0] | Self::IS_SLOT, key[1]])
    }

    #[inline]
    fn is_slot(&self) -> bool {
        self.lo.w.to_bits() & Self::IS_SLOT != 0
    }

    #[inline]
    fn key(&self) -> Key {
        [self.lo.w.to_bits() & !Self::IS_SLOT, self.hi.w.to_bits()]
    }

    #[inline]
    fn bounds(&self) -> Bounds3 {
        Bounds3 {
            min: Point3(Vec3A::from_vec4(self.lo)),
            max: Point3(Vec3A::from_vec4(self.hi)),
        }
    }

    /// Twice the centre.
    #[inline]
    fn center(&self) -> Vec3A {
        let sum = self.lo + self.hi;
        // Without the sum of the keys: as numbers they are subnormal, which some processors compute slowly.
        Vec3A::new(sum.x, sum.y, sum.z)
    }
}

pub(super) struct Built {
    pub(super) nodes: Vec<Node>,
    pub(super) packets: Vec<Packet>,
    pub(super) slots: Vec<Key>,
    pub(super) bounds: Bounds3,
}

/// A range of items.
#[derive(Clone, Copy)]
struct Part {
    start: usize,
    len: usize,
    n_slots: usize,
    bounds: Bounds3,
    centers: Bounds3,
}

impl Part {
    fn empty(start: usize) -> Self {
        Self {
            start,
            len: 0,
            n_slots: 0,
            bounds: Bounds3::EMPTY,
            centers: Bounds3::EMPTY,
        }
    }

    fn of(items: &[Item], start: usize) -> Self {
        let mut part = Self::empty(start);
        items.iter().for_each(|item| part.add(item));
        part
    }

    #[inline]
    fn add(&mut self, item: &Item) {
        self.len += 1;
        self.n_slots += usize::from(item.is_slot());
        self.bounds = self.bounds.union(item.bounds());
        self.centers = self.centers.with_point(Point3(item.center()));
    }

    /// Whether one packet or one slot holds it.
    fn is_one(&self) -> bool {
        self.len == 1 || self.n_slots == 0 && self.len <= N_LANES
    }

    fn fits_leaf(&self) -> bool {
        self.n_slots == 0 && self.len <= MAX_TRIANGLES
            || self.n_slots == self.len && self.len <= MAX_SLOTS
    }
}

/// Expected tests of a leaf.
#[inline]
fn cost(len: usize, n_slots: usize) -> f32 {
    ((len - n_slots).div_ceil(N_LANES) + n_slots) as f32
}

/// Nodes, the ranges of items in packets, and slots; indices start at 0.
#[derive(Default)]
struct Subtree {
    nodes: Vec<Node>,
    packets: Vec<(u32, u32)>,
    slots: Vec<Key>,
}

/// Builds a hierarchy.
pub(super) fn build(mut items: Vec<Item>, corners: impl Fn(Key) -> [[f32; 3]; 3] + Sync) -> Built {
    // A leaf holds an item at least: neither packets nor slots nor nodes run out of indices.
    assert!(items.len() <= Child::MAX_INDEX, "callers count their items");
    items.retain(|item| !item.bounds().is_empty());
    let root = Part::of(&items, 0);
    let mut tree = Subtree::default();
    if !items.is_empty() {
        let child = tree.add(&mut items, &root, 0);
        if !matches!(child.target(), Target::Node(_)) {
            let mut node = Node::EMPTY;
            node.set(0, &root.bounds, child);
            tree.nodes.push(node);
        }
    }
    let pack = |&(start, len): &(u32, u32)| {
        let items = &items[start as usize..][..len as usize];
        Packet::new(items.iter().map(|item| (item.key(), corners(item.key()))))
    };
    let mut packets = Vec::new();
    tree.packets
        .par_iter()
        .with_min_len(256)
        .map(pack)
        .collect_into_vec(&mut packets);
    tree.nodes.shrink_to_fit();
    tree.slots.shrink_to_fit();
    Built {
        nodes: tree.nodes,
        packets,
        slots: tree.slots,
        bounds: root.bounds,
    }
}

impl Subtree {
    /// Adds what a part of `items` becomes, which starts with the item `part.start` of all.
    fn add(&mut self, items: &mut [Item], part: &Part, depth: usize) -> Child {
        let parts = divide(items, part, depth);
        if parts.len() == 1 {
            return self.add_leaf(items, part);
        }
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let lanes = lanes_of(&parts);
        let base = part.start;
        if part.len < PARALLEL_ITEMS {
            for (part, lane) in parts.iter().zip(lanes) {
                let child = self.add(&mut items[part.start - base..][..part.len], part, depth + 1);
                self.nodes[index].set(lane, &part.bounds, child);
            }
        } else {
            let mut rest = items;
            let mut jobs = Vec::new();
            for part in parts {
                let (items, others) = rest.split_at_mut(part.len);
                jobs.push((items, part));
                rest = others;
            }
            let subtrees: Vec<_> = jobs
                .into_par_iter()
                .map(|(items, part)| {
                    let mut subtree = Self::default();
                    let child = subtree.add(items, &part, depth + 1);
                    (part, child, subtree)
                })
                .collect();
            for ((part, child, subtree), lane) in subtrees.into_iter().zip(lanes) {
                let child = self.append(subtree, child);
                self.nodes[index].set(lane, &part.bounds, child);
            }
        }
        Child::new(Target::Node(index))
    }

    fn add_leaf(&mut self, items: &[Item], part: &Part) -> Child {
        if part.n_slots > 0 {
            let first = self.slots.len();
            self.slots.extend(items.iter().map(Item::key));
            return Child::new(Target::Slots(first, part.len));
        }
        let first = self.packets.len();
        let end = part.start + part.len;
        for start in (part.start..end).step_by(N_LANES) {
            let len = N_LANES.min(end - start);
            self.packets.push((start as u32, len as u32));
        }
        Child::new(Target::Triangles(first, self.packets.len() - first))
    }

    /// Takes over a subtree; returns what its root becomes.
    fn append(&mut self, mut subtree: Self, root: Child) -> Child {
        let (node, packet, slot) = (self.nodes.len(), self.packets.len(), self.slots.len());
        let moved = |child: Child| {
            Child::new(match child.target() {
                Target::Node(index) => Target::Node(node + index),
                Target::Triangles(first, count) => Target::Triangles(packet + first, count),
                Target::Slots(first, count) => Target::Slots(slot + first, count),
            })
        };
        self.nodes.extend(subtree.nodes.drain(..).map(|mut node| {
            node.map_children(moved);
            node
        }));
        self.packets.append(&mut subtree.packets);
        self.slots.append(&mut subtree.slots);
        moved(root)
    }
}

/// The lanes of parts: the largest come first, as they are the likeliest to be hit, and a search for any hit then ends
/// the sooner.
fn lanes_of(parts: &[Part]) -> ArrayVec<usize, N_LANES> {
    let area = |part: &Part| part.bounds.half_area();
    let is_before = |i: usize, j: usize| {
        let order = area(&parts[i]).total_cmp(&area(&parts[j]));
        order.then(j.cmp(&i)).is_gt()
    };
    let n_before = |j| (0..parts.len()).filter(|&i| is_before(i, j)).count();
    (0..parts.len()).map(n_before).collect()
}

/// Splits a part into up to eight, in the order of their items; one makes a leaf.
fn divide(items: &mut [Item], part: &Part, depth: usize) -> ArrayVec<Part, N_LANES> {
    let base = part.start;
    let mut parts = ArrayVec::new();
    parts.push(*part);
    let mut is_done = [false; N_LANES];
    while parts.len() < N_LANES {
        let worth = |part: &Part| {
            if depth < BALANCED_DEPTH {
                part.bounds.half_area()
            } else {
                part.len as f32
            }
        };
        let next = (0..parts.len())
            .filter(|&i| !is_done[i])
            .max_by(|&i, &j| worth(&parts[i]).total_cmp(&worth(&parts[j])));
        let Some(next) = next else { break };
        let part: Part = parts[next];
        let items = &mut items[part.start - base..][..part.len];
        match split(items, &part, depth) {
            Some([left, right]) => {
                parts[next] = left;
                parts.push(right);
            }
            None => is_done[next] = true,
        }
    }
    parts.sort_unstable_by_key(|part| part.start);
    parts
}

/// Splits the items of a part; `None` makes a leaf.
fn split(items: &mut [Item], part: &Part, depth: usize) -> Option<[Part; 2]> {
    if part.is_one() {
        return None;
    }
    let plane = if depth < BALANCED_DEPTH {
        best_plane(items, part)
    } else {
        None
    };
    let area = part.bounds.half_area();
    match plane {
        Some(plane) => {
            let leaf_cost = cost(part.len, part.n_slots) * area;
            if part.fits_leaf() && leaf_cost <= plane.cost + NODE_COST * area {
                return None;
            }
            Some(plane.divide(items, part.start))
        }
        None if part.fits_leaf() => None,
        // No plane separates the centres: split by kind or by count.
        None if part.n_slots > 0 && part.n_slots < part.len => {
            let n_left = partition(items, Item::is_slot);
            Some(parts_of(items, part.start, n_left))
        }
        None => {
            let axis = part.centers.extent().max_position();
            let middle = items.len() / 2;
            items.select_nth_unstable_by(middle, |a, b| {
                let by_place = a.center()[axis].total_cmp(&b.center()[axis]);
                by_place.then(a.key().cmp(&b.key()))
            });
            Some(parts_of(items, part.start, middle))
        }
    }
}

/// The parts of items that are divided already.
fn parts_of(items: &[Item], start: usize, n_left: usize) -> [Part; 2] {
    let (left, right) = items.split_at(n_left);
    [Part::of(left, start), Part::of(right, start + n_left)]
}

/// Moves the items that satisfy `is_left` to the front; returns how many there are. The order of the result depends on
/// nothing but the input. Every item is swapped, be it with itself: nobody can predict on which side it lies.
fn partition(items: &mut [Item], mut is_left: impl FnMut(&Item) -> bool) -> usize {
    let mut n_left = 0;
    for next in 0..items.len() {
        let is_left = is_left(&items[next]);
        items.swap(n_left, next);
        n_left += usize::from(is_left);
    }
    n_left
}

/// How the centres of a part fall into bins.
#[derive(Clone, Copy)]
struct Binning {
    lo: Vec3A,
    bins_per_unit: Vec3A,
    n_bins: usize,
}

impl Binning {
    /// From 2²³ on the last bit of an f32 counts units: addition rounds to whole numbers.
    const UNITS: f32 = 8_388_608.0;

    fn new(part: &Part) -> Self {
        let n_bins = (4 + part.len / 32).min(MAX_BINS);
        let extent = part.centers.extent();
        let per_unit = Vec3A::splat(n_bins as f32) / extent;
        // Everything falls into the first bin of an axis along which nothing differs.
        let is_usable = extent.cmpgt(Vec3A::ZERO) & per_unit.cmplt(Vec3A::INFINITY);
        Self {
            lo: part.centers.min.0,
            bins_per_unit: Vec3A::select(is_usable, per_unit, Vec3A::ZERO),
            n_bins,
        }
    }

    #[inline]
    fn bins(&self, item: &Item) -> [usize; 3] {
        let place = (item.center() - self.lo) * self.bins_per_unit + Vec3A::splat(Self::UNITS);
        [place.x, place.y, place.z].map(|place| self.bin_at(place))
    }

    /// The bin along one axis.
    #[inline]
    fn bin(&self, item: &Item, axis: usize) -> usize {
        let center = item.lo[axis] + item.hi[axis];
        self.bin_at((center - self.lo[axis]) * self.bins_per_unit[axis] + Self::UNITS)
    }

    #[inline]
    fn bin_at(&self, place: f32) -> usize {
        ((place.to_bits() & 0x7f_ffff) as usize).min(self.n_bins - 1)
    }
}

struct Plane {
    binning: Binning,
    axis: usize,
    /// First bin of the right side.
    bin: usize,
    /// Expected tests times half area of the parent.
    cost: f32,
    /// All that is left of it, and right of it.
    sides: [Bin; 2],
}

impl Plane {
    /// Divides the items. What the bins know of both sides needs no second look.
    fn divide(&self, items: &mut [Item], start: usize) -> [Part; 2] {
        let mut centers = [Bounds3::EMPTY; 2];
        let n_left = partition(items, |item| {
            let is_left = self.binning.bin(item, self.axis) < self.bin;
            let side = &mut centers[usize::from(!is_left)];
            *side = side.with_point(Point3(item.center()));
            is_left
        });
        debug_assert_eq!(n_left, self.sides[0].len as usize);
        let part = |side: usize, start: usize, len: usize| Part {
            start,
            len,
            n_slots: self.sides[side].n_slots as usize,
            bounds: self.sides[side].bounds,
            centers: centers[side],
        };
        let right = start + n_left;
        [part(0, start, n_left), part(1, right, items.len() - n_left)]
    }
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds3,
    len: u32,
    n_slots: u32,
}

impl Bin {
    const EMPTY: Self = Self {
        bounds: Bounds3::EMPTY,
        len: 0,
        n_slots: 0,
    };

    #[inline]
    fn add(&mut self, other: &Self) {
        self.bounds = self.bounds.union(other.bounds);
        self.len += other.len;
        self.n_slots += other.n_slots;
    }

    #[inline]
    fn cost(&self) -> f32 {
        if self.len == 0 {
            return 0.0;
        }
        // Not empty: an item's box is not.
        let e = self.bounds.extent();
        let half_area = e.x * e.y + e.y * e.z + e.z * e.x;
        half_area * cost(self.len as usize, self.n_slots as usize)
    }
}

/// The plane of least expected cost among the bin borders of the three axes.
fn best_plane(items: &[Item], part: &Part) -> Option<Plane> {
    // Most parts are small, and need few bins to be cleared.
    const FEW: usize = 8;
    let binning = Binning::new(part);
    if binning.n_bins <= FEW {
        best_border::<FEW>(items, binning)
    } else {
        best_border::<MAX_BINS>(items, binning)
    }
}

/// The plane of least expected cost among the borders of at most `N` bins.
fn best_border<const N: usize>(items: &[Item], binning: Binning) -> Option<Plane> {
    let n_bins = binning.n_bins;
    let mut bins = [[Bin::EMPTY; N]; 3];
    for item in items {
        let one = Bin {
            bounds: item.bounds(),
            len: 1,
            n_slots: u32::from(item.is_slot()),
        };
        for (bins, bin) in bins.iter_mut().zip(binning.bins(item)) {
            bins[bin].add(&one);
        }
    }
    // Cost, axis, and first bin of the right side.
    let mut best: Option<(f32, usize, usize)> = None;
    for (axis, bins) in bins.iter().enumerate() {
        // Costs of everything to the right of each border, then sweep from the left.
        let mut right_cost = [0f32; N];
        let mut right = Bin::EMPTY;
        for bin in (1..n_bins).rev() {
            right.add(&bins[bin]);
            right_cost[bin] = right.cost();
        }
        let mut left = Bin::EMPTY;
        for bin in 1..n_bins {
            left.add(&bins[bin - 1]);
            if left.len == 0 || left.len as usize == items.len() {
                continue;
            }
            let cost = left.cost() + right_cost[bin];
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, bin));
            }
        }
    }
    let (cost, axis, bin) = best?;
    let sum = |bins: &[Bin]| {
        let mut sum = Bin::EMPTY;
        bins.iter().for_each(|bin| sum.add(bin));
        sum
    };
    let (left, right) = bins[axis][..n_bins].split_at(bin);
    Some(Plane {
        binning,
        axis,
        bin,
        cost,
        sides: [sum(left), sum(right)],
    })
}
