//! Building the hierarchy: binned surface-area heuristic, top down, eight children at a time (Wald 2007; Wald, Benthin,
//! Boulos 2008), in parallel for large inputs.

use arrayvec::ArrayVec;
use glam::{BVec3A, Mat3A, Vec3, Vec3A, Vec4};
use rayon::iter::{
    IndexedParallelIterator, IntoParallelIterator, IntoParallelRefIterator, ParallelIterator,
};

use crate::accel::lanes::{Lanes, Level, N_LANES, Portable};
use crate::accel::node::{Child, Key, Node, Packet, Target};
use crate::math::{Bounds3, Point3};

const MAX_BINS: usize = 32;
/// Most items of a part that are looked at to find a plane.
const MAX_BINNED: usize = 1 << 15;
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

/// A box as eight numbers: its smallest corner and its largest one negated, so that a box around two takes one
/// instruction. The fourth and the last number mean nothing.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
struct Corners([f32; N_LANES]);

impl Corners {
    const EMPTY: Self = Self([f32::INFINITY; N_LANES]);

    /// The smallest corner, and the largest one negated.
    #[inline(always)]
    fn halves(&self) -> [Vec3A; 2] {
        let [lo, hi] = *self.0.as_chunks().0 else {
            unreachable!("eight numbers are twice four");
        };
        [lo, hi].map(|half| Vec3A::from_vec4(Vec4::from_array(half)))
    }

    #[inline(always)]
    fn bounds(&self) -> Bounds3 {
        let [lo, hi] = self.halves();
        Bounds3 {
            min: Point3(lo),
            max: Point3(-hi),
        }
    }

    #[inline(always)]
    fn add<L: Lanes>(&mut self, lanes: L, other: &Self) {
        self.0 = lanes.store(lanes.min(lanes.load(&self.0), lanes.load(&other.0)));
    }

    /// Edge lengths; −∞ where nothing is inside.
    #[inline(always)]
    fn extent(&self) -> Vec3A {
        let [lo, hi] = self.halves();
        -(lo + hi)
    }
}

/// Something in a hierarchy: its box, its key, and whether it is a slot or how many triangles.
#[derive(Clone, Copy, Debug)]
pub struct Item {
    /// The box, and the key in the numbers that mean nothing there. Its topmost bit marks slots; of triangles the next
    /// ones count those behind the first.
    corners: Corners,
}

impl Item {
    const IS_SLOT: u32 = 1 << 31;
    const RUN_SHIFT: u32 = 29;
    /// The bits of a triangle's key itself.
    const GROUP: u32 = (1 << Self::RUN_SHIFT) - 1;
    /// Most triangles of an item.
    const MAX_RUN: usize = 1 << (31 - Self::RUN_SHIFT);

    fn new(bounds: &Bounds3, key: Key) -> Self {
        let [lo, hi] = [bounds.min.0, -bounds.max.0].map(|half| half.to_array());
        let [first, second] = key.map(f32::from_bits);
        Self {
            corners: Corners([lo[0], lo[1], lo[2], first, hi[0], hi[1], hi[2], second]),
        }
    }

    /// A triangle in a box. The first half of the key is below 2²⁹.
    pub fn triangle(bounds: &Bounds3, key: Key) -> Self {
        assert!(key[0] < 1 << Self::RUN_SHIFT, "callers have fewer meshes");
        Self::new(bounds, key)
    }

    /// A slot with a box. The first half of the key is below 2³¹.
    pub fn slot(bounds: &Bounds3, key: Key) -> Self {
        debug_assert!(key[0] < Self::IS_SLOT);
        Self::new(bounds, [key[0] | Self::IS_SLOT, key[1]])
    }

    #[inline]
    fn is_slot(&self) -> bool {
        self.corners.0[3].to_bits() & Self::IS_SLOT != 0
    }

    /// This and the one triangle that comes next, as one item: if it is the next by its key as well, and one box is
    /// looked at no more often than two. Neighbours in a mesh mostly are, end in one packet anyhow, and are divided in
    /// a part of the time.
    #[inline]
    fn joined(&self, next: &Self) -> Option<Self> {
        let [first, second] = self.bits();
        let n_triangles = self.n_triangles();
        let follows = next.bits() == [first & Self::GROUP, second.wrapping_add(n_triangles as u32)];
        if !follows || !(1..Self::MAX_RUN).contains(&n_triangles) {
            return None;
        }
        let (ours, theirs) = (self.bounds(), next.bounds());
        let both = ours.union(theirs);
        let is_worth_it = both.half_area() <= ours.half_area() + theirs.half_area();
        is_worth_it.then(|| Self::new(&both, [first + (1 << Self::RUN_SHIFT), second]))
    }

    /// How many triangles it is; 0 for a slot.
    #[inline]
    fn n_triangles(&self) -> usize {
        if self.is_slot() {
            0
        } else {
            1 + (self.bits()[0] >> Self::RUN_SHIFT) as usize
        }
    }

    /// How much of a test it takes, in parts of a packet.
    #[inline(always)]
    fn weight(&self) -> u32 {
        let [first, _] = self.bits();
        // A slot has no triangles, so that these bits tell either.
        if first & Self::IS_SLOT != 0 {
            N_LANES as u32
        } else {
            1 + (first >> Self::RUN_SHIFT)
        }
    }

    #[inline(always)]
    fn bits(&self) -> [u32; 2] {
        [3, 7].map(|lane| self.corners.0[lane].to_bits())
    }

    /// Of a slot; of triangles the count of the run is in it, which is good enough to order them by.
    #[inline]
    fn key(&self) -> Key {
        let [first, second] = self.bits();
        [first & !Self::IS_SLOT, second]
    }

    /// Of each of its triangles.
    fn triangle_keys(&self) -> impl Iterator<Item = Key> + use<> {
        let [first, second] = self.bits();
        let n_triangles = self.n_triangles() as u32;
        (0..n_triangles).map(move |i| [first & Self::GROUP, second + i])
    }

    #[inline]
    fn bounds(&self) -> Bounds3 {
        self.corners.bounds()
    }

    /// Twice the centre.
    #[inline(always)]
    fn center(&self) -> Vec3A {
        let [lo, hi] = self.corners.halves();
        let Vec3 { x, y, z } = Vec3::from(lo - hi);
        // Without what came of the keys: as numbers they are subnormal, which some processors compute slowly.
        Vec3A::new(x, y, z)
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
    n_triangles: usize,
    bounds: Bounds3,
    centers: Bounds3,
    /// It was found not to be worth dividing.
    is_leaf: bool,
}

impl Part {
    fn empty(start: usize) -> Self {
        Self {
            start,
            len: 0,
            n_slots: 0,
            n_triangles: 0,
            bounds: Bounds3::EMPTY,
            centers: Bounds3::EMPTY,
            is_leaf: false,
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
        self.n_triangles += item.n_triangles();
        self.bounds = self.bounds.union(item.bounds());
        self.centers = self.centers.with_point(Point3(item.center()));
    }

    /// Whether one packet or one slot holds it.
    fn is_one(&self) -> bool {
        self.len == 1 || self.n_slots == 0 && self.n_triangles <= N_LANES
    }

    /// The sum of the weights.
    fn weight(&self) -> u32 {
        (self.n_triangles + self.n_slots * N_LANES) as u32
    }

    fn fits_leaf(&self) -> bool {
        self.n_slots == 0 && self.n_triangles <= MAX_TRIANGLES
            || self.n_slots == self.len && self.len <= MAX_SLOTS
    }
}

/// Expected tests of a leaf with items of a total weight.
#[inline]
fn tests(weight: u32) -> f32 {
    // Signed numbers are converted by SIMD instructions.
    weight.div_ceil(N_LANES as u32) as i32 as f32
}

/// What goes into a packet: up to eight of the triangles of some items, but for the first ones.
struct PacketRange {
    first_item: u32,
    end_item: u32,
    n_skipped: u32,
}

/// Adds an item to those of a hierarchy: unless it is empty, and with the one before where they can be joined.
pub fn push_item(items: &mut Vec<Item>, item: Item) {
    if item.bounds().is_empty() {
        return;
    }
    match items
        .last_mut()
        .and_then(|last| Some((last.joined(&item)?, last)))
    {
        Some((joined, last)) => *last = joined,
        None => items.push(item),
    }
}

/// Nodes, the ranges of items in packets, and slots; indices start at 0.
struct Subtree {
    level: Level,
    nodes: Vec<Node>,
    packets: Vec<PacketRange>,
    slots: Vec<Key>,
}

/// Builds a hierarchy.
pub(super) fn build(
    level: Level,
    mut items: Vec<Item>,
    corners: impl Fn(Key) -> [[f32; 3]; 3] + Sync,
) -> Built {
    // A leaf holds an item at least: neither packets nor slots nor nodes run out of indices.
    assert!(items.len() <= Child::MAX_INDEX, "callers count their items");
    items.retain(|item| !item.bounds().is_empty());
    let root = Part::of(&items, 0);
    let mut tree = Subtree::new(level, 0);
    if !items.is_empty() {
        let branch = Branch::build(level, &mut items, &root, 0);
        tree.nodes = Vec::with_capacity(branch.n_nodes().max(1));
        let child = tree.append(branch);
        if !matches!(child.target(), Target::Node(_)) {
            let mut node = Node::EMPTY;
            node.set(0, &root.bounds, child);
            tree.nodes.push(node);
        }
    }
    let pack = |range: &PacketRange| {
        let items = &items[range.first_item as usize..range.end_item as usize];
        let keys = items.iter().flat_map(Item::triangle_keys);
        let keys = keys.skip(range.n_skipped as usize).take(N_LANES);
        Packet::new(keys.map(|key| (key, corners(key))))
    };
    let mut packets = Vec::new();
    tree.packets
        .par_iter()
        .with_min_len(256)
        .map(pack)
        .collect_into_vec(&mut packets);
    tree.slots.shrink_to_fit();
    Built {
        nodes: tree.nodes,
        packets,
        slots: tree.slots,
        bounds: root.bounds,
    }
}

impl Subtree {
    /// Nothing, with room for what about so many items become.
    fn new(level: Level, n_items: usize) -> Self {
        Self {
            level,
            // Growing would mean moving; what is never written takes no memory.
            nodes: Vec::with_capacity(n_items / 4 + 1),
            packets: Vec::new(),
            slots: Vec::new(),
        }
    }

    /// Adds what a part of `items` becomes, which starts with the item `part.start` of all.
    fn add(&mut self, items: &mut [Item], part: &Part, depth: usize) -> Child {
        if part.is_leaf {
            return self.add_leaf(items, part);
        }
        let base = part.start;
        let parts = divide(self.level, items, part, depth);
        if parts.len() == 1 {
            return self.add_leaf(items, part);
        }
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let lanes = lanes_of(&parts);
        for (part, lane) in parts.iter().zip(lanes) {
            let items = &mut items[part.start - base..][..part.len];
            let child = self.add(items, part, depth + 1);
            self.nodes[index].set(lane, &part.bounds, child);
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
        for n_skipped in (0..part.n_triangles).step_by(N_LANES) {
            self.packets.push(PacketRange {
                first_item: part.start as u32,
                end_item: (part.start + part.len) as u32,
                n_skipped: n_skipped as u32,
            });
        }
        Child::new(Target::Triangles(first, self.packets.len() - first))
    }

    /// Takes over what was built apart; returns what its root becomes.
    fn append(&mut self, branch: Branch) -> Child {
        let (subtree, root) = match branch {
            Branch::Built(subtree, root) => (subtree, root),
            Branch::Divided(children) => {
                let index = self.nodes.len();
                self.nodes.push(Node::EMPTY);
                for (lane, bounds, branch) in children {
                    let child = self.append(branch);
                    self.nodes[index].set(lane, &bounds, child);
                }
                return Child::new(Target::Node(index));
            }
        };
        let (node, packet, slot) = (self.nodes.len(), self.packets.len(), self.slots.len());
        let moved = |child: Child| {
            Child::new(match child.target() {
                Target::Node(index) => Target::Node(node + index),
                Target::Triangles(first, count) => Target::Triangles(packet + first, count),
                Target::Slots(first, count) => Target::Slots(slot + first, count),
            })
        };
        self.nodes.extend(subtree.nodes.into_iter().map(|mut node| {
            node.map_children(moved);
            node
        }));
        self.packets.extend(subtree.packets);
        self.slots.extend(subtree.slots);
        moved(root)
    }
}

/// A part of a hierarchy, in pieces that were built at the same time.
enum Branch {
    /// A piece, and what its root is.
    Built(Subtree, Child),
    /// The lane of each child of a node, and its box.
    Divided(Vec<(usize, Bounds3, Self)>),
}

impl Branch {
    /// Builds what a part of `items` becomes.
    fn build(level: Level, items: &mut [Item], part: &Part, depth: usize) -> Self {
        let parts = if part.len < PARALLEL_ITEMS {
            ArrayVec::new()
        } else {
            divide(level, items, part, depth)
        };
        if parts.len() < 2 {
            let mut subtree = Subtree::new(level, part.len);
            let root = subtree.add(items, part, depth);
            return Self::Built(subtree, root);
        }
        let mut rest = items;
        let mut jobs = Vec::new();
        for (part, lane) in parts.iter().zip(lanes_of(&parts)) {
            let (items, others) = rest.split_at_mut(part.len);
            jobs.push((lane, items, *part));
            rest = others;
        }
        let children = jobs.into_par_iter().map(|(lane, items, part)| {
            let branch = Self::build(level, items, &part, depth + 1);
            (lane, part.bounds, branch)
        });
        Self::Divided(children.collect())
    }

    /// The number of nodes.
    fn n_nodes(&self) -> usize {
        match self {
            Self::Built(subtree, _) => subtree.nodes.len(),
            Self::Divided(children) => {
                1 + children
                    .iter()
                    .map(|(.., child)| child.n_nodes())
                    .sum::<usize>()
            }
        }
    }
}

/// The lanes of parts: first come those in which a search for any hit ends the soonest. Large ones are the likeliest to
/// be hit, those that hold little are searched the fastest.
fn lanes_of(parts: &[Part]) -> ArrayVec<usize, N_LANES> {
    // The time grows with what there is to search, but not in proportion.
    let n_searched = |part: &Part| part.n_triangles + part.n_slots;
    let worth = |part: &Part| part.bounds.half_area() / (n_searched(part) as f32).sqrt();
    let worths: ArrayVec<f32, N_LANES> = parts.iter().map(worth).collect();
    let is_before = |i: usize, j: usize| {
        let order = worths[i].total_cmp(&worths[j]);
        order.then(j.cmp(&i)).is_gt()
    };
    let n_before = |j| (0..parts.len()).filter(|&i| is_before(i, j)).count();
    (0..parts.len()).map(n_before).collect()
}

/// Splits a part into up to eight, in the order of their items; one makes a leaf.
fn divide(level: Level, items: &mut [Item], part: &Part, depth: usize) -> ArrayVec<Part, N_LANES> {
    match level {
        Level::Portable => divide_with(Portable, items, part, depth),
        #[cfg(target_arch = "x86_64")]
        Level::Avx2(avx2) => pulp::Simd::vectorize(
            avx2,
            #[inline(always)]
            || {
                // A closure that gives away what it holds is called directly. Any other goes through a shim of the
                // language, which may be compiled elsewhere, without AVX2: then each operation on lanes is a call.
                let items = items;
                divide_with(avx2, items, part, depth)
            },
        ),
    }
}

#[inline(always)]
fn divide_with<L: Lanes>(
    lanes: L,
    items: &mut [Item],
    part: &Part,
    depth: usize,
) -> ArrayVec<Part, N_LANES> {
    let base = part.start;
    let mut parts = ArrayVec::new();
    parts.push(*part);
    while parts.len() < N_LANES {
        let worth = |part: &Part| {
            if depth < BALANCED_DEPTH {
                part.bounds.half_area()
            } else {
                part.len as f32
            }
        };
        let next = (0..parts.len())
            .filter(|&i| !parts[i].is_leaf)
            .max_by(|&i, &j| worth(&parts[i]).total_cmp(&worth(&parts[j])));
        let Some(next) = next else { break };
        let part: Part = parts[next];
        let items = &mut items[part.start - base..][..part.len];
        match split(lanes, items, &part, depth) {
            Some([left, right]) => {
                parts[next] = left;
                parts.push(right);
            }
            None => parts[next].is_leaf = true,
        }
    }
    parts.sort_unstable_by_key(|part| part.start);
    parts
}

/// Splits the items of a part; `None` makes a leaf.
#[inline(always)]
fn split<L: Lanes>(lanes: L, items: &mut [Item], part: &Part, depth: usize) -> Option<[Part; 2]> {
    if part.is_one() {
        return None;
    }
    let plane = if depth < BALANCED_DEPTH {
        best_plane(lanes, items, part)
    } else {
        None
    };
    let area = part.bounds.half_area();
    match plane {
        Some(plane) => {
            let leaf_cost = tests(part.weight()) * area;
            if part.fits_leaf() && leaf_cost <= plane.cost + NODE_COST * area {
                return None;
            }
            Some(plane.divide(lanes, items, part))
        }
        None if part.fits_leaf() => None,
        // No plane separates the centres: split by kind or by count.
        None if part.n_slots > 0 && part.n_slots < part.len => {
            let mut n_left = 0;
            for next in 0..items.len() {
                let is_left = items[next].is_slot();
                sort_in(items, &mut n_left, next, is_left);
            }
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

/// Moves the next item to the `n_left` ones before that are left of something, or leaves it behind these. The order
/// depends on nothing but the input. The item is swapped in any case, be it with itself: nobody can predict on which
/// side it lies.
#[inline(always)]
fn sort_in(items: &mut [Item], n_left: &mut usize, next: usize, is_left: bool) {
    items.swap(*n_left, next);
    *n_left += usize::from(is_left);
}

/// How the centres of a part fall into bins.
#[derive(Clone, Copy)]
struct Binning {
    lo: Vec3A,
    bins_per_unit: Vec3A,
    last: Vec3A,
}

impl Binning {
    /// From 2²³ on the last bit of an f32 counts units: addition rounds to whole numbers.
    const UNITS: f32 = 8_388_608.0;

    fn new(part: &Part, n_bins: usize) -> Self {
        let extent = part.centers.extent();
        let per_unit = Vec3A::splat(n_bins as f32) / extent;
        // Everything falls into the first bin of an axis along which nothing differs.
        let is_usable = extent.cmpgt(Vec3A::ZERO) & per_unit.cmplt(Vec3A::INFINITY);
        Self {
            lo: part.centers.min.0,
            bins_per_unit: Vec3A::select(is_usable, per_unit, Vec3A::ZERO),
            last: Vec3A::splat((n_bins - 1) as f32),
        }
    }

    /// The bins along the axes of what is centred around half of `center`, plus [`Self::UNITS`].
    #[inline]
    fn place(&self, center: Vec3A) -> Vec3A {
        ((center - self.lo) * self.bins_per_unit).min(self.last) + Vec3A::splat(Self::UNITS)
    }
}

/// A border between bins.
struct Plane {
    binning: Binning,
    axis: usize,
    /// What is to the right of it has a place that is not less.
    place: f32,
    /// Expected tests times half area of the parent.
    cost: f32,
    /// Boxes and weights of either side, if all items were looked at.
    sides: Option<[Side; 2]>,
}

/// What is on one side of a plane.
#[derive(Clone, Copy)]
struct Side {
    corners: Corners,
    weight: u32,
}

impl Side {
    const EMPTY: Self = Self {
        corners: Corners::EMPTY,
        weight: 0,
    };

    #[inline(always)]
    fn add<L: Lanes>(&mut self, lanes: L, corners: &Corners, weight: u32) {
        self.corners.add(lanes, corners);
        self.weight += weight;
    }

    #[inline(always)]
    fn of_items<L: Lanes>(lanes: L, items: &[Item]) -> Self {
        let mut side = Self::EMPTY;
        for item in items {
            side.add(lanes, &item.corners, item.weight());
        }
        side
    }

    #[inline(always)]
    fn of_bins<L: Lanes>(lanes: L, bins: &[Bins], axis: usize) -> Self {
        let mut side = Self::EMPTY;
        for bin in bins {
            side.add(lanes, &bin.corners[axis], bin.weights[axis]);
        }
        side
    }
}

impl Plane {
    /// Divides the items.
    #[inline(always)]
    fn divide<L: Lanes>(&self, lanes: L, items: &mut [Item], part: &Part) -> [Part; 2] {
        let mut n_left = 0;
        for next in 0..items.len() {
            let place = self.binning.place(items[next].center());
            let is_left = place.cmplt(Vec3A::splat(self.place)).bitmask() >> self.axis & 1 != 0;
            sort_in(items, &mut n_left, next, is_left);
        }
        let (left, right) = items.split_at(n_left);
        let sides = match self.sides {
            Some(sides) => sides,
            None => [Side::of_items(lanes, left), Side::of_items(lanes, right)],
        };
        let n_slots = if part.n_slots == 0 {
            0
        } else {
            left.iter().filter(|item| item.is_slot()).count()
        };
        let starts = [part.start, part.start + n_left];
        let lens = [left.len(), right.len()];
        let slots = [n_slots, part.n_slots - n_slots];
        let centers = [centers(left), centers(right)];
        [0, 1].map(|side| Part {
            start: starts[side],
            len: lens[side],
            n_slots: slots[side],
            n_triangles: sides[side].weight as usize - slots[side] * N_LANES,
            bounds: sides[side].corners.bounds(),
            centers: centers[side],
            is_leaf: false,
        })
    }
}

/// Box around twice the centres.
#[inline(always)]
fn centers(items: &[Item]) -> Bounds3 {
    let Bounds3 { mut min, mut max } = Bounds3::EMPTY;
    for item in items {
        let center = item.center();
        // What is no number leaves the box as it is.
        min.0 = center.min(min.0);
        max.0 = center.max(max.0);
    }
    Bounds3 { min, max }
}

/// What falls into a bin of each axis.
#[derive(Clone, Copy)]
struct Bins {
    corners: [Corners; 3],
    weights: [u32; 3],
}

impl Bins {
    const EMPTY: Self = Self {
        corners: [Corners::EMPTY; 3],
        weights: [0; 3],
    };

    #[inline(always)]
    fn add<L: Lanes>(&mut self, lanes: L, other: &Self) {
        for axis in 0..3 {
            self.corners[axis].add(lanes, &other.corners[axis]);
            self.weights[axis] += other.weights[axis];
        }
    }

    /// Expected tests times half areas.
    #[inline(always)]
    fn costs(&self) -> Vec3A {
        // Where nothing is, there are edges of −∞.
        let [x, y, z] = self
            .corners
            .map(|corners| corners.extent().max(Vec3A::ZERO));
        // From three lengths of each box to the lengths along each axis of all boxes.
        let Mat3A {
            x_axis: x,
            y_axis: y,
            z_axis: z,
        } = Mat3A::from_cols(x, y, z).transpose();
        (x * y + y * z + z * x) * Vec3A::from(self.weights.map(tests))
    }
}

/// The plane of least expected cost among the bin borders of the three axes.
#[inline(always)]
fn best_plane<L: Lanes>(lanes: L, items: &[Item], part: &Part) -> Option<Plane> {
    // Most parts are small, and need few bins to be cleared.
    const FEW: usize = 8;
    let n_bins = (4 + part.len / 32).min(MAX_BINS);
    if n_bins <= FEW {
        best_border::<FEW, L>(lanes, items, part, n_bins)
    } else {
        best_border::<MAX_BINS, L>(lanes, items, part, n_bins)
    }
}

/// The plane of least expected cost among the borders of `n_bins` ≤ `N` bins; `N` is a power of two.
#[inline(always)]
fn best_border<const N: usize, L: Lanes>(
    lanes: L,
    items: &[Item],
    part: &Part,
    n_bins: usize,
) -> Option<Plane> {
    let binning = Binning::new(part, n_bins);
    let mut bins = [Bins::EMPTY; N];
    let stride = items.len().div_ceil(MAX_BINNED);
    let mut all = 0;
    for item in items.iter().step_by(stride) {
        let place = binning.place(item.center());
        let weight = item.weight();
        for axis in 0..3 {
            let bin = &mut bins[place[axis].to_bits() as usize % N];
            bin.corners[axis].add(lanes, &item.corners);
            bin.weights[axis] += weight;
        }
        all += weight;
    }
    // Costs of everything to the right of each border, along all axes at once, then a sweep from the left.
    let mut right_costs = [Vec3A::ZERO; N];
    let mut right = Bins::EMPTY;
    for bin in (1..n_bins).rev() {
        right.add(lanes, &bins[bin]);
        right_costs[bin] = right.costs();
    }
    let mut left = Bins::EMPTY;
    let (mut least, mut first) = (Vec3A::INFINITY, Vec3A::ZERO);
    for bin in 1..n_bins {
        left.add(lanes, &bins[bin - 1]);
        let separates = left.weights.map(|weight| weight != 0 && weight != all);
        let cost = left.costs() + right_costs[bin];
        let is_less = BVec3A::from_array(separates) & cost.cmplt(least);
        least = Vec3A::select(is_less, cost, least);
        first = Vec3A::select(is_less, Vec3A::splat(bin as f32), first);
    }
    let axis = least.min_position();
    let cost = least[axis];
    if !(cost < f32::INFINITY) {
        return None;
    }
    let (left, right) = bins[..n_bins].split_at(first[axis] as usize);
    let sides = [
        Side::of_bins(lanes, left, axis),
        Side::of_bins(lanes, right, axis),
    ];
    Some(Plane {
        binning,
        axis,
        place: first[axis] + Binning::UNITS,
        cost: cost * stride as f32,
        sides: (stride == 1).then_some(sides),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Point3;

    fn cube(at: f32, side: f32) -> Bounds3 {
        let corner = Point3::new(at, 0.0, 0.0);
        Bounds3 {
            min: corner,
            max: Point3::new(at + side, side, side),
        }
    }

    fn pushed(items: impl IntoIterator<Item = Item>) -> Vec<Vec<Key>> {
        let mut all = Vec::new();
        for item in items {
            push_item(&mut all, item);
        }
        all.iter()
            .map(|item| {
                if item.is_slot() {
                    vec![item.key()]
                } else {
                    item.triangle_keys().collect()
                }
            })
            .collect()
    }

    #[test]
    fn neighbours_of_a_mesh_are_divided_four_at_a_time_and_keep_their_keys() {
        let triangles = (0..10).map(|i| Item::triangle(&cube(0.1 * i as f32, 1.0), [7, 5 + i]));
        let runs = pushed(triangles);
        assert_eq!(runs.iter().map(Vec::len).collect::<Vec<_>>(), [4, 4, 2]);
        let keys: Vec<Key> = runs.concat();
        assert_eq!(keys, (5..15).map(|i| [7, i]).collect::<Vec<_>>());
    }

    #[test]
    fn nothing_is_joined_that_does_not_belong_together() {
        let near = cube(0.0, 1.0);
        for (what, second) in [
            ("far away", Item::triangle(&cube(5.0, 1.0), [7, 1])),
            ("of another mesh", Item::triangle(&near, [8, 1])),
            ("not the next", Item::triangle(&near, [7, 2])),
            ("the same again", Item::triangle(&near, [7, 0])),
            ("no triangle", Item::slot(&near, [7, 1])),
        ] {
            let runs = pushed([Item::triangle(&near, [7, 0]), second]);
            assert_eq!(runs.len(), 2, "{what}");
            let slot_first = pushed([Item::slot(&near, [7, 0]), second]);
            assert_eq!(slot_first.len(), 2, "{what}");
        }
        assert!(pushed([Item::triangle(&Bounds3::EMPTY, [7, 0])]).is_empty());
    }

    #[test]
    fn a_joined_box_holds_both() {
        let mut items = Vec::new();
        push_item(&mut items, Item::triangle(&cube(0.0, 1.0), [0, 0]));
        push_item(&mut items, Item::triangle(&cube(0.5, 1.0), [0, 1]));
        let bounds = items[0].bounds();
        assert_eq!((items.len(), bounds.max.0.x), (1, 1.5));
        assert_eq!(bounds.min.0.x, 0.0);
    }
}
