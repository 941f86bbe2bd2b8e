//! Choosing one of many lights by what each may bring to a receiver.
//!
//! A binary hierarchy over lights with a place (Conty Estevez and Kulla, *Importance Sampling of Many Lights with
//! Adaptive Tree Splitting*, 2018; pbrt 4th ed., section 12.6.3). Each node bounds the places of its lights by a sphere
//! and their directions by a cone, and a choice walks down from the root, at each node in proportion to a bound of what
//! arrives from either child. Bounds are conservative: a child that can contribute is never out of reach. Visibility
//! is not known here.
//!
//! The probability of a light repeats the walk from its leaf upward, so that it is the one with which it was chosen.

use std::f32::consts::FRAC_PI_2;

use glam::Vec3A;

use crate::math::{Bounds3, Normal3, Point3, Vec3};

/// Where a light is and whereto it shines.
#[derive(Clone, Copy, Debug)]
pub struct Emitter {
    /// Box around its points.
    pub bounds: Bounds3,
    /// Unit axis of the cone that holds its normals.
    pub axis: Vec3,
    /// Half angle of that cone in radians; π holds all directions.
    pub spread: f32,
    /// Angle from a normal up to which it emits, in radians.
    pub reach: f32,
    /// It shines along the opposite directions as well.
    pub two_sided: bool,
    /// Radiant intensity in render-space units, the largest or a typical one; not negative. Choices are in proportion
    /// to it.
    pub intensity: f64,
}

/// The hierarchy. The two children of a node follow each other.
#[derive(Clone, Debug)]
pub struct LightTree {
    nodes: Vec<Node>,
    /// The parent of each node; of the root itself.
    parents: Vec<u32>,
    /// The leaf of each emitter.
    leaves: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    center: [f32; 3],
    radius: f32,
    axis: [f32; 3],
    /// Relative to the sum over all lights.
    intensity: f32,
    cos_spread: f32,
    sin_spread: f32,
    cos_reach: f32,
    /// [`LEAF`] and [`TWO_SIDED`], and the first child or the emitter.
    bits: u32,
}

const LEAF: u32 = 1 << 31;
const TWO_SIDED: u32 = 1 << 30;
const INDEX: u32 = TWO_SIDED - 1;

/// Most emitters a tree may have: two nodes for each are numbered in 30 bits.
const MAX_EMITTERS: usize = 1 << 29;
/// Cosine below which the angle under which light leaves or arrives no longer counts: angles are bounds and rounded,
/// and shading normals deviate from geometric ones.
const MIN_COSINE: f32 = 0.02;
/// Width of the range in which rounding may put an angle of emission, in radians, or its cosine.
const ROUNDING: f32 = 1e-4;
/// Range of importances, whatever the unit of length: sums of two keep to the normal numbers of f32.
const IMPORTANCES: [f32; 2] = [1e-37, 1e37];
/// Least share of all intensity that counts: less is counted as this.
const MIN_SHARE: f64 = 1e-12;
/// Least probability of a child that can contribute: bounds are no promise, and 1 minus a probability keeps its digits.
const MIN_CHANCE: f32 = 1e-6;
/// Least random number that a choice is made by.
const LEAST_U: f64 = 0.25 * f64::EPSILON;
/// Bins of the search for a split.
const N_BINS: usize = 12;
/// Level from which on lights are halved by number. Above, a split may leave all but a few of them on one side; so the
/// tree is no deeper than this and the logarithm of their number.
const HALVED_FROM: u32 = 64;

/// Cosine and sine of max(0, a − b), from those of `a` and `b` in [0, π].
#[inline]
fn minus_clamped(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    if a[0] > b[0] {
        [1.0, 0.0]
    } else {
        [a[0] * b[0] + a[1] * b[1], a[1] * b[0] - a[0] * b[1]]
    }
}

/// With its sine, that of an angle in [0, π].
#[inline]
fn with_sine(cos: f32) -> [f32; 2] {
    [cos, ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt()]
}

impl Node {
    /// Bound of the light that may arrive from the node, up to a constant; 0 only if none can.
    #[inline]
    fn importance(&self, p: Point3, ng: Normal3) -> f32 {
        let from_center = p.0 - Vec3A::from(self.center);
        let d2 = from_center.length_squared();
        let r2 = self.radius * self.radius;
        let w = from_center * (1.0 / d2.max(f32::MIN_POSITIVE).sqrt());
        // The angle around the centre under which the receiver sees the sphere.
        let seen = if d2 > r2 {
            let sin2 = r2 / d2;
            [(1.0 - sin2).sqrt(), sin2.sqrt()]
        } else {
            [-1.0, 0.0]
        };
        let mut cos_axis = w.dot(Vec3A::from(self.axis));
        if self.bits & TWO_SIDED != 0 {
            cos_axis = cos_axis.abs();
        }
        let beyond_normals = minus_clamped(with_sine(cos_axis), [self.cos_spread, self.sin_spread]);
        let [cos_emitted, _] = minus_clamped(beyond_normals, seen);
        if cos_emitted < self.cos_reach - ROUNDING {
            return 0.0;
        }
        // Either side of the receiver may scatter; in a medium the normal is zero and every direction does.
        let cos_received = if ng.0 == Vec3A::ZERO {
            1.0
        } else {
            minus_clamped(with_sine(w.dot(ng.0).abs()), seen)[0]
        };
        let cosines = cos_emitted.max(MIN_COSINE) * cos_received.max(MIN_COSINE);
        let importance = self.intensity * cosines / d2.max(r2).max(f32::MIN_POSITIVE);
        importance.clamp(IMPORTANCES[0], IMPORTANCES[1])
    }
}

impl Emitter {
    /// One that stands for all of some; `None` for none.
    pub fn around(emitters: &[Self]) -> Option<Self> {
        let all = emitters.iter().map(Cluster::of).reduce(Cluster::union)?;
        let (axis, spread) = all.cone?;
        Some(Self {
            bounds: all.bounds,
            axis,
            spread,
            reach: all.reach,
            two_sided: all.two_sided,
            intensity: all.intensity,
        })
    }
}

impl LightTree {
    /// Over emitters with finite, non-empty bounds. `None` if there are none, or too many.
    pub fn new(emitters: &[Emitter]) -> Option<Self> {
        if emitters.is_empty() || emitters.len() > MAX_EMITTERS {
            return None;
        }
        let total: f64 = emitters.iter().map(|e| e.intensity).sum();
        let mut builder = Builder {
            emitters,
            total,
            tree: Self {
                nodes: Vec::with_capacity(2 * emitters.len() - 1),
                parents: Vec::with_capacity(2 * emitters.len() - 1),
                leaves: vec![0; emitters.len()],
            },
        };
        let mut order: Vec<u32> = (0..emitters.len() as u32).collect();
        let root = builder.reserve(1, 0);
        builder.build(root, &mut order, 0);
        Some(builder.tree)
    }

    /// Bound of the irradiance from all lights at a receiver of normal `ng`, zero in a medium, over the sum of their
    /// intensities; 0 only if none can reach it.
    #[inline]
    pub fn bound(&self, p: Point3, ng: Normal3) -> f32 {
        self.nodes[0].importance(p, ng)
    }

    /// Probability of the first of two siblings. Where neither contributes it does not matter, but for the sum over
    /// all lights to be 1.
    #[inline]
    fn first_share(&self, first: usize, p: Point3, ng: Normal3) -> f32 {
        let [a, b] = [first, first + 1].map(|node| self.nodes[node].importance(p, ng));
        if a > 0.0 && b > 0.0 {
            (a / (a + b)).clamp(MIN_CHANCE, 1.0 - MIN_CHANCE)
        } else if a + b > 0.0 {
            f32::from(u8::from(a > 0.0))
        } else {
            0.5
        }
    }

    /// Chooses an emitter by `u` in [0, 1): its index and probability, positive, and what is left of `u`, in [0, 1).
    #[inline]
    pub fn choose(&self, p: Point3, ng: Normal3, u: f64) -> (usize, f32, f64) {
        // 0 would lead to where all shares are small, and their product to 0.
        let mut u = u.max(LEAST_U);
        let mut node = &self.nodes[0];
        let mut pmf = 1.0;
        while node.bits & LEAF == 0 {
            let first = (node.bits & INDEX) as usize;
            let share = self.first_share(first, p, ng);
            let split = f64::from(share);
            if u < split {
                u /= split;
                pmf *= share;
                node = &self.nodes[first];
            } else {
                u = (u - split) / (1.0 - split);
                pmf *= 1.0 - share;
                node = &self.nodes[first + 1];
            }
            u = u.min(1.0 - f64::EPSILON);
        }
        ((node.bits & INDEX) as usize, pmf, u)
    }

    /// Probability with which [`LightTree::choose`] finds an emitter.
    #[inline]
    pub fn pmf(&self, p: Point3, ng: Normal3, emitter: usize) -> f32 {
        let mut node = self.leaves[emitter] as usize;
        let mut pmf = 1.0;
        while node != 0 {
            let parent = self.parents[node] as usize;
            let first = (self.nodes[parent].bits & INDEX) as usize;
            let share = self.first_share(first, p, ng);
            pmf *= if node == first { share } else { 1.0 - share };
            node = parent;
        }
        pmf
    }
}

/// Bounds of the emitters of a node.
#[derive(Clone, Copy)]
struct Cluster {
    bounds: Bounds3,
    /// Axis and half angle; `None` around nothing.
    cone: Option<(Vec3, f32)>,
    reach: f32,
    two_sided: bool,
    intensity: f64,
}

impl Cluster {
    const EMPTY: Self = Self {
        bounds: Bounds3::EMPTY,
        cone: None,
        reach: 0.0,
        two_sided: false,
        intensity: 0.0,
    };

    fn of(emitter: &Emitter) -> Self {
        Self {
            bounds: emitter.bounds,
            cone: Some((emitter.axis, emitter.spread)),
            reach: emitter.reach,
            two_sided: emitter.two_sided,
            intensity: emitter.intensity,
        }
    }

    fn union(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.union(other.bounds),
            cone: match (self.cone, other.cone) {
                (Some(a), Some(b)) => Some(cone_around(a, b, self.two_sided && other.two_sided)),
                (a, b) => a.or(b),
            },
            reach: self.reach.max(other.reach),
            two_sided: self.two_sided || other.two_sided,
            intensity: self.intensity + other.intensity,
        }
    }

    /// Expected light that leaves the cluster for a random place: intensity times the measure of its directions times
    /// the square of its size (Conty Estevez and Kulla 2018, equation 1, with the diagonal in place of the area, which
    /// vanishes for points in a row).
    fn cost(&self) -> f64 {
        let spread = f64::from(self.cone.map_or(0.0, |(_, spread)| spread));
        let end = (spread + f64::from(self.reach)).min(std::f64::consts::PI);
        let solid_angle = 4.0 * (0.5 * spread).sin().powi(2)
            + 0.5
                * (2.0 * end * spread.sin()
                    - (spread - 2.0 * end).cos()
                    - 2.0 * spread * spread.sin()
                    + spread.cos());
        let extent = if self.bounds.is_empty() {
            0.0
        } else {
            f64::from(self.bounds.extent().length_squared())
        };
        self.intensity * solid_angle * extent
    }
}

/// A cone around two. Both may be turned around if they are two-sided.
fn cone_around(a: (Vec3, f32), b: (Vec3, f32), two_sided: bool) -> (Vec3, f32) {
    let (wide, narrow) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let mut axis = narrow.0;
    if two_sided && axis.dot(wide.0) < 0.0 {
        axis = -axis;
    }
    let (w, v) = (wide.0, axis);
    // Between unit vectors, accurate at all angles.
    let between = 2.0 * (w - v).length().atan2((w + v).length());
    if between + narrow.1 <= wide.1 {
        return wide;
    }
    let half = 0.5 * (wide.1 + between + narrow.1);
    if half >= std::f32::consts::PI {
        return (w, std::f32::consts::PI);
    }
    let across = v - w * w.dot(v);
    match across.try_normalize() {
        Some(across) => {
            let (sin, cos) = (half - wide.1).sin_cos();
            ((w * cos + across * sin).normalize(), half)
        }
        None => (w, std::f32::consts::PI), // Opposite: any turn would do.
    }
}

struct Builder<'a> {
    emitters: &'a [Emitter],
    total: f64,
    tree: LightTree,
}

impl Builder<'_> {
    /// Room for `n` nodes of one parent; the first of them.
    fn reserve(&mut self, n: usize, parent: usize) -> usize {
        const BLANK: Node = Node {
            center: [0.0; 3],
            radius: 0.0,
            axis: [0.0; 3],
            intensity: 0.0,
            cos_spread: 0.0,
            sin_spread: 0.0,
            cos_reach: 0.0,
            bits: 0,
        };
        let first = self.tree.nodes.len();
        self.tree.nodes.resize(first + n, BLANK);
        self.tree.parents.resize(first + n, parent as u32);
        first
    }

    fn cluster(&self, order: &[u32]) -> Cluster {
        order.iter().fold(Cluster::EMPTY, |all, &i| {
            all.union(Cluster::of(&self.emitters[i as usize]))
        })
    }

    /// Fills `node` with the emitters of `order`. Calls itself for each of some [`HALVED_FROM`] levels, so the stack is
    /// safe.
    fn build(&mut self, node: usize, order: &mut [u32], level: u32) {
        let cluster = self.cluster(order);
        let bits = match *order {
            [emitter] => {
                self.tree.leaves[emitter as usize] = node as u32;
                LEAF | emitter
            }
            _ => {
                let middle = if level < HALVED_FROM {
                    self.split(order, &cluster)
                } else {
                    self.halve(order, &cluster)
                };
                let first = self.reserve(2, node);
                let (left, right) = order.split_at_mut(middle);
                self.build(first, left, level + 1);
                self.build(first + 1, right, level + 1);
                first as u32
            }
        };
        self.tree.nodes[node] = self.node(&cluster, bits);
    }

    fn node(&self, cluster: &Cluster, bits: u32) -> Node {
        let (axis, spread) = cluster.cone.unwrap_or((Vec3::ZERO, std::f32::consts::PI));
        // Unions of cones are rounded: a little wider is always right.
        let spread = (spread + ROUNDING).min(std::f32::consts::PI);
        let center = cluster.bounds.center();
        let half = cluster.bounds.extent() * 0.5;
        let rounding = center.0.abs().max_element() * f32::EPSILON;
        Node {
            center: center.0.to_array(),
            radius: half.length() * (1.0 + f32::EPSILON) + rounding,
            axis: axis.0.to_array(),
            intensity: (cluster.intensity / self.total).max(MIN_SHARE) as f32,
            cos_spread: spread.cos(),
            sin_spread: if spread < std::f32::consts::PI {
                spread.sin()
            } else {
                0.0
            },
            cos_reach: cluster.reach.min(FRAC_PI_2).cos(),
            bits: bits | if cluster.two_sided { TWO_SIDED } else { 0 },
        }
    }

    /// Orders emitters so that the first `n` and the others are the two children; returns `n`, inside the slice.
    fn split(&self, order: &mut [u32], cluster: &Cluster) -> usize {
        let center = |i: u32| self.emitters[i as usize].bounds.center();
        let centers = order
            .iter()
            .fold(Bounds3::EMPTY, |b, &i| b.with_point(center(i)));
        let extent = centers.extent();
        let longest = cluster.bounds.extent().max_element();
        let mut best: Option<(f64, usize, usize)> = None;
        for axis in 0..3 {
            if !(extent[axis] > 0.0) {
                continue;
            }
            let mut bins = [Cluster::EMPTY; N_BINS];
            for &i in order.iter() {
                let bin = bin_of(center(i).0[axis], centers.min.0[axis], extent[axis]);
                bins[bin] = bins[bin].union(Cluster::of(&self.emitters[i as usize]));
            }
            // Thin slices across a long axis are discouraged.
            let thinness = f64::from(longest / cluster.bounds.extent()[axis]);
            let mut below = [0.0; N_BINS];
            let mut sum = Cluster::EMPTY;
            for (cost, bin) in below.iter_mut().zip(&bins) {
                sum = sum.union(*bin);
                *cost = sum.cost();
            }
            let mut sum = Cluster::EMPTY;
            for k in (1..N_BINS).rev() {
                sum = sum.union(bins[k]);
                let cost = thinness * (below[k - 1] + sum.cost());
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, k));
                }
            }
        }
        let half = order.len() / 2;
        let Some((_, axis, k)) = best else {
            return half; // All in one place.
        };
        let is_first = |i: u32| bin_of(center(i).0[axis], centers.min.0[axis], extent[axis]) < k;
        order.sort_by_key(|&i| !is_first(i));
        let middle = order.partition_point(|&i| is_first(i));
        if middle == 0 || middle == order.len() {
            half
        } else {
            middle
        }
    }

    /// Orders emitters so that the first `n` and the others are apart along the longest axis, and as many.
    fn halve(&self, order: &mut [u32], cluster: &Cluster) -> usize {
        let axis = cluster.bounds.extent().max_position();
        let place = |i: u32| self.emitters[i as usize].bounds.center().0[axis];
        let half = order.len() / 2;
        order.select_nth_unstable_by(half, |&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
        half
    }
}

fn bin_of(x: f32, min: f32, extent: f32) -> usize {
    (((x - min) / extent * N_BINS as f32) as usize).min(N_BINS - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;

    /// Lamps that shine all around.
    fn lamps(n: usize, lamp: impl Fn(usize) -> ([f32; 3], f64)) -> Vec<Emitter> {
        let lamp = |k| {
            let ([x, y, z], intensity) = lamp(k);
            Emitter {
                bounds: Bounds3::EMPTY.with_point(Point3::new(x, y, z)),
                axis: Vec3::new(0.0, 0.0, 1.0),
                spread: std::f32::consts::PI,
                reach: FRAC_PI_2,
                two_sided: false,
                intensity,
            }
        };
        (0..n).map(lamp).collect()
    }

    impl LightTree {
        fn depth_of(&self, emitter: usize) -> usize {
            let mut depth = 0;
            let mut node = self.leaves[emitter] as usize;
            while node != 0 {
                node = self.parents[node] as usize;
                depth += 1;
            }
            depth
        }
    }

    #[test]
    fn trees_of_lights_in_hostile_places_are_shallow_and_choose_by_their_probabilities() {
        const N: usize = 200_000;
        // Eight lamps at each step, down to the least f32, and all others at 0.
        let steps = |ratio: f32, k: usize| ratio.powi((k / 8) as i32);
        let cases = [
            ("in one place", lamps(N, |_| ([0.3, -0.2, 0.1], 1.0))),
            ("in one place, dark", lamps(N, |_| ([0.3, -0.2, 0.1], 0.0))),
            (
                "in a row",
                lamps(N, |k| ([k as f32 / N as f32, 0.0, 0.0], 1.0)),
            ),
            (
                "at powers of two",
                lamps(N, |k| ([0.5f32.powi(k as i32), 0.0, 0.0], 1.0)),
            ),
            (
                "at powers of two, as bright as they are far",
                lamps(N, |k| {
                    ([0.5f32.powi(k as i32), 0.0, 0.0], 0.5f64.powi(k as i32))
                }),
            ),
            (
                "in small steps toward 0, dark",
                lamps(N, |k| {
                    ([steps(0.92, k), steps(0.93, k), steps(0.94, k)], 0.0)
                }),
            ),
            (
                "in small steps toward 0, each far brighter than the next",
                lamps(N, |k| {
                    let x = steps(0.92, k);
                    ([x, -x, 0.0], f64::from(x).powi(30))
                }),
            ),
        ];
        for (name, lamps) in cases {
            let tree = LightTree::new(&lamps).expect("there are lamps");
            let depth = (0..N).map(|lamp| tree.depth_of(lamp)).max();
            let most = HALVED_FROM as usize + N.ilog2() as usize + 1;
            assert!(depth <= Some(most), "{name}: {depth:?}");
            let mut rng = Rng::new(7);
            for p in [[0.0, 0.0, 0.0], [0.3, -0.2, 0.1]] {
                let (p, ng) = (Point3::new(p[0], p[1], p[2]), Normal3::ZERO);
                let sum: f64 = (0..N).map(|lamp| f64::from(tree.pmf(p, ng, lamp))).sum();
                assert!((sum - 1.0).abs() < 1e-4, "{name}, {p:?}: {sum}");
                let edges = [0.0, 1e-300, 0.5, 1.0 - f64::EPSILON / 2.0];
                let random = (0..1000).map(|_| rng.uniform_fine());
                for u in edges.into_iter().chain(random) {
                    let (lamp, chosen, _) = tree.choose(p, ng, u);
                    let known = tree.pmf(p, ng, lamp);
                    assert!(chosen > 0.0, "{name}, {p:?}: {u}");
                    assert!(
                        (chosen - known).abs() <= 1e-4 * known,
                        "{name}, {p:?}: {chosen} {known}"
                    );
                }
            }
        }
    }
}
