//! Points of space, sorted so that those near a place are found without a look at the others: a balanced k-d tree
//! (Bentley 1975) whose nodes are the middles of ranges of one array.

use crate::math::Point3;

/// Points of a range that are looked at one by one.
const LEAF: usize = 8;
/// Points of a range that are worth a second thread.
const WORTH_A_THREAD: usize = 1 << 14;

/// Points, sorted. The caller stores what belongs to them in the same order.
#[derive(Clone, Debug, Default)]
pub struct PointTree {
    points: Vec<Point3>,
    /// The axis across which the middle of a range splits it.
    axes: Vec<u8>,
}

/// A point and its place in the input.
#[derive(Clone, Copy)]
struct Entry {
    p: Point3,
    index: u32,
}

impl PointTree {
    /// Sorts points, fewer than 2³². Returns the tree and its order: place `i` of the tree holds point `order[i]`.
    pub fn build(points: &[Point3]) -> (Self, Vec<u32>) {
        let mut entries: Vec<Entry> = points
            .iter()
            .zip(0..)
            .map(|(&p, index)| Entry { p, index })
            .collect();
        let mut axes = vec![0; points.len()];
        split(&mut entries, &mut axes);
        let tree = Self {
            points: entries.iter().map(|entry| entry.p).collect(),
            axes,
        };
        (tree, entries.iter().map(|entry| entry.index).collect())
    }

    /// Visits the places of all points no farther than `radius` from `p`, always from the first to the last: the order
    /// of two points does not depend on what is asked.
    #[inline]
    pub fn visit_within(&self, p: Point3, radius: f32, mut visit: impl FnMut(usize)) {
        self.visit_range(0, self.points.len(), p, radius, &mut visit);
    }

    fn visit_range(
        &self,
        start: usize,
        end: usize,
        p: Point3,
        radius: f32,
        visit: &mut impl FnMut(usize),
    ) {
        let is_near = |place: &usize| (self.points[*place] - p).length_squared() <= radius * radius;
        if end - start <= LEAF {
            (start..end).filter(is_near).for_each(visit);
            return;
        }
        let middle = start + (end - start) / 2;
        let axis = usize::from(self.axes[middle]);
        let split = self.points[middle].0[axis];
        if p.0[axis] - radius <= split {
            self.visit_range(start, middle, p, radius, visit);
        }
        if is_near(&middle) {
            visit(middle);
        }
        if p.0[axis] + radius >= split {
            self.visit_range(middle + 1, end, p, radius, visit);
        }
    }
}

/// Sorts a range: its middle splits the rest across the axis in which it is longest.
fn split(entries: &mut [Entry], axes: &mut [u8]) {
    if entries.len() <= LEAF {
        return;
    }
    let first = entries[0].p.0;
    let (min, max) = entries.iter().fold((first, first), |(min, max), entry| {
        (min.min(entry.p.0), max.max(entry.p.0))
    });
    let extent = max - min;
    let axis = if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    };
    let middle = entries.len() / 2;
    // Points in one plane keep the order of the input.
    entries.select_nth_unstable_by(middle, |a, b| {
        let by_place = a.p.0[axis].total_cmp(&b.p.0[axis]);
        by_place.then(a.index.cmp(&b.index))
    });
    axes[middle] = axis as u8;
    let is_large = entries.len() > WORTH_A_THREAD;
    let (left, right) = entries.split_at_mut(middle);
    let (left_axes, right_axes) = axes.split_at_mut(middle);
    let (right, right_axes) = (&mut right[1..], &mut right_axes[1..]);
    if is_large {
        rayon::join(|| split(left, left_axes), || split(right, right_axes));
    } else {
        split(left, left_axes);
        split(right, right_axes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;

    #[test]
    fn all_points_within_a_radius_are_found_in_order_and_no_others() {
        let mut rng = Rng::new(5);
        for n in [0, 1, 8, 9, 100, 3000] {
            // Few places, so that many points share a coordinate.
            let mut coordinate = || (rng.uniform() * 20.0).floor();
            let points: Vec<Point3> = (0..n)
                .map(|_| Point3::new(coordinate(), coordinate(), coordinate()))
                .collect();
            let (tree, order) = PointTree::build(&points);
            for radius in [0.0, 1.0, 3.5, 100.0] {
                let p = Point3::new(rng.uniform() * 20.0, 7.0, 10.0);
                let mut places = Vec::new();
                tree.visit_within(p, radius, |place| places.push(place));
                assert!(places.is_sorted());
                let mut found: Vec<u32> = places.iter().map(|&place| order[place]).collect();
                found.sort_unstable();
                let is_near = |i: &u32| points[*i as usize].distance(p) <= radius;
                let expected: Vec<u32> = (0..n).filter(is_near).collect();
                assert_eq!(found, expected, "{n} points, radius {radius}");
            }
        }
    }
}
