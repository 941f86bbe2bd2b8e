//! Building the hierarchy: binned surface-area heuristic, top down, in parallel for large inputs.

use glam::Vec3A;

use crate::accel::bvh::{MAX_DEPTH, Node};
use crate::math::{Bounds3, Point3};

const BINS: usize = 16;
/// Slots a leaf may hold when splitting it does not pay.
const MAX_LEAF: usize = 8;
/// Cost of visiting a node relative to testing one primitive.
const NODE_COST: f32 = 1.0;
/// Below this many boxes a subtree is built on one thread.
const PARALLEL_BOXES: usize = 1 << 14;
/// From this depth on, splits halve the count, so that 2³² boxes stay within [`MAX_DEPTH`].
const BALANCED_DEPTH: usize = MAX_DEPTH - 33;

pub(super) struct Built {
    pub(super) nodes: Vec<Node>,
    pub(super) order: Vec<u32>,
    pub(super) bounds: Bounds3,
}

#[derive(Clone, Copy)]
struct Item {
    bounds: Bounds3,
    center: Vec3A,
    index: u32,
}

/// Either slots `first..first + count` (relative to the subtree) or node 0 of a subtree.
enum Subtree {
    Leaf,
    Inner(Vec<Node>),
}

pub(super) fn build(boxes: &[Bounds3]) -> Built {
    let mut items: Vec<Item> = boxes
        .iter()
        .enumerate()
        .filter(|(_, b)| !b.is_empty())
        .map(|(index, b)| Item {
            bounds: *b,
            center: b.center().0,
            index: index as u32,
        })
        .collect();
    let bounds = items
        .iter()
        .fold(Bounds3::EMPTY, |b, item| b.union(item.bounds));
    let nodes = if items.is_empty() {
        Vec::new()
    } else {
        match subtree(&mut items, &bounds, 0, 0) {
            Subtree::Inner(nodes) => nodes,
            Subtree::Leaf => {
                let mut root = Node::EMPTY;
                root.set_child(0, &bounds, 0, items.len() as u32);
                vec![root]
            }
        }
    };
    Built {
        nodes,
        order: items.iter().map(|item| item.index).collect(),
        bounds,
    }
}

/// Builds a subtree over `items`, whose first slot is `first`. Node indices are relative to the subtree.
fn subtree(items: &mut [Item], bounds: &Bounds3, first: usize, depth: usize) -> Subtree {
    let Some(split) = split(items, bounds, depth) else {
        return Subtree::Leaf;
    };
    let (left, right) = items.split_at_mut(split);
    let around = |items: &[Item]| {
        items
            .iter()
            .fold(Bounds3::EMPTY, |b, item| b.union(item.bounds))
    };
    let (left_bounds, right_bounds) = (around(left), around(right));
    let (left_len, right_len) = (left.len(), right.len());
    let mut build_left = || subtree(left, &left_bounds, first, depth + 1);
    let mut build_right = || subtree(right, &right_bounds, first + split, depth + 1);
    let (l, r) = if left_len + right_len >= PARALLEL_BOXES {
        rayon::join(build_left, build_right)
    } else {
        (build_left(), build_right())
    };
    let mut nodes = vec![Node::EMPTY];
    for (side, child, child_bounds, child_first, len) in [
        (0, l, left_bounds, first, left_len),
        (1, r, right_bounds, first + split, right_len),
    ] {
        match child {
            Subtree::Leaf => {
                nodes[0].set_child(side, &child_bounds, child_first as u32, len as u32)
            }
            Subtree::Inner(child_nodes) => {
                let base = nodes.len() as u32;
                nodes[0].set_child(side, &child_bounds, base, 0);
                nodes.extend(child_nodes.into_iter().map(|mut node| {
                    for side in 0..2 {
                        if node.count[side] == 0 {
                            node.child[side] += base;
                        }
                    }
                    node
                }));
            }
        }
    }
    Subtree::Inner(nodes)
}

/// Partitions the items and returns where the second half starts; `None` makes a leaf.
fn split(items: &mut [Item], bounds: &Bounds3, depth: usize) -> Option<usize> {
    if items.len() == 1 {
        return None;
    }
    let centers = items
        .iter()
        .fold(Bounds3::EMPTY, |b, item| b.with_point(Point3(item.center)));
    let found = if depth < BALANCED_DEPTH {
        best_plane(items, &centers)
    } else {
        None
    };
    if let Some(plane) = found {
        let area = bounds.half_area();
        if items.len() > MAX_LEAF || plane.cost + NODE_COST * area < items.len() as f32 * area {
            return Some(partition(items, |item| plane.bin_of(item) < plane.bin));
        }
        return None;
    }
    // No plane separates the centres: split by count.
    (items.len() > MAX_LEAF).then(|| {
        let axis = centers.extent().max_position();
        let middle = items.len() / 2;
        items.select_nth_unstable_by(middle, |a, b| {
            a.center[axis]
                .total_cmp(&b.center[axis])
                .then(a.index.cmp(&b.index))
        });
        middle
    })
}

struct Plane {
    axis: usize,
    /// First bin of the right side.
    bin: usize,
    lo: f32,
    bins_per_unit: f32,
    /// Expected primitive tests times half area of the parent.
    cost: f32,
}

impl Plane {
    #[inline]
    fn bin_of(&self, item: &Item) -> usize {
        bin(item.center[self.axis], self.lo, self.bins_per_unit)
    }
}

#[inline]
fn bin(center: f32, lo: f32, bins_per_unit: f32) -> usize {
    (((center - lo) * bins_per_unit) as usize).min(BINS - 1)
}

/// The plane of least expected cost among the bin borders of the three axes.
fn best_plane(items: &[Item], centers: &Bounds3) -> Option<Plane> {
    let extent = centers.extent();
    let mut best: Option<Plane> = None;
    for axis in 0..3 {
        let bins_per_unit = BINS as f32 / extent[axis];
        if !(extent[axis] > 0.0 && bins_per_unit.is_finite()) {
            continue;
        }
        let lo = centers.min.0[axis];
        let mut bins = [(Bounds3::EMPTY, 0usize); BINS];
        for item in items {
            let b = &mut bins[bin(item.center[axis], lo, bins_per_unit)];
            *b = (b.0.union(item.bounds), b.1 + 1);
        }
        // Costs of everything to the right of each border, then sweep from the left.
        let mut right_cost = [0f32; BINS];
        let mut right = (Bounds3::EMPTY, 0);
        for b in (1..BINS).rev() {
            right = (right.0.union(bins[b].0), right.1 + bins[b].1);
            right_cost[b] = right.0.half_area() * right.1 as f32;
        }
        let mut left = (Bounds3::EMPTY, 0);
        for b in 1..BINS {
            left = (left.0.union(bins[b - 1].0), left.1 + bins[b - 1].1);
            if left.1 == 0 || left.1 == items.len() {
                continue;
            }
            let cost = left.0.half_area() * left.1 as f32 + right_cost[b];
            if best.as_ref().is_none_or(|best| cost < best.cost) {
                best = Some(Plane {
                    axis,
                    bin: b,
                    lo,
                    bins_per_unit,
                    cost,
                });
            }
        }
    }
    best
}

/// Moves the items that satisfy `is_left` to the front and returns their number. Order-preserving, so that the
/// result depends on nothing but the input.
fn partition(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
    let right: Vec<Item> = items
        .iter()
        .filter(|item| !is_left(item))
        .copied()
        .collect();
    let mut next = 0;
    for i in 0..items.len() {
        if is_left(&items[i]) {
            items[next] = items[i];
            next += 1;
        }
    }
    items[next..].copy_from_slice(&right);
    next
}
