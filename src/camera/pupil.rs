//! The exit pupil: where on the plane behind the rear interface rays from the film have a chance to get through.
//!
//! By symmetry only the distance of the film point from the axis matters: for a point on the positive x axis the pupil
//! is symmetric in y. Pupils are intersections of slightly bent disks: what is searched here are the extremes of
//! such a set. The bounds are a sampling domain only; they must hold the whole pupil and may be larger.

use glam::{DVec2, DVec3};

use crate::camera::LocalRay;
use crate::camera::lens::Lens;

/// Rings of the film, each of which has bounds of its own.
const RINGS: usize = 64;

/// Points of the axis at which the search for the pupil starts.
const SCAN: usize = 256;

/// Steps of a golden-section search: the interval shrinks by 10⁻⁸.
const GOLDEN_STEPS: usize = 40;

/// Halvings of an interval that holds an edge: it shrinks by 10⁻¹².
const HALVINGS: usize = 40;

/// Bounds grow by this part of their size on every side, for pupils that are not quite convex.
const MARGIN: f64 = 1.0 / 512.0;

/// A rectangle of the rear plane for a film point on the positive x axis; it is symmetric in y.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PupilBounds {
    /// Least and greatest x.
    pub x: [f64; 2],
    /// Greatest y.
    pub y: f64,
}

impl PupilBounds {
    /// Area in m².
    pub fn area(&self) -> f64 {
        (self.x[1] - self.x[0]) * 2.0 * self.y
    }

    /// The point of the unit square's point `u`.
    pub fn at(&self, u: [f32; 2]) -> DVec2 {
        let [u, v] = u.map(f64::from);
        DVec2::new(
            self.x[0] + (self.x[1] - self.x[0]) * u,
            self.y * (2.0 * v - 1.0),
        )
    }

    fn union(&self, other: &Self) -> Self {
        Self {
            x: [self.x[0].min(other.x[0]), self.x[1].max(other.x[1])],
            y: self.y.max(other.y),
        }
    }

    /// The pupil of the film point on the other side of the axis.
    fn mirrored(&self) -> Self {
        Self {
            x: [-self.x[1], -self.x[0]],
            y: self.y,
        }
    }

    /// Greatest second difference of the edges of three bounds at equal distances.
    fn bend(&self, middle: &Self, last: &Self) -> f64 {
        let bend = |a: f64, b: f64, c: f64| (a - b - (b - c)).abs();
        bend(self.x[0], middle.x[0], last.x[0])
            .max(bend(self.x[1], middle.x[1], last.x[1]))
            .max(bend(self.y, middle.y, last.y))
    }

    /// Grown by a distance on every side.
    fn grown(&self, by: f64) -> Self {
        Self {
            x: [self.x[0] - by, self.x[1] + by],
            y: self.y + by,
        }
    }
}

/// Bounds of the pupil for every point of the film.
#[derive(Clone, Debug)]
pub struct ExitPupil {
    rings: Vec<PupilBounds>,
    /// Radius of the outermost ring.
    reach: f64,
    reference_area: f64,
}

impl ExitPupil {
    /// Searches the pupils for a film of radius `reach`. `None` if nothing gets through the lens at its centre.
    pub fn new(lens: &Lens, reach: f64) -> Option<Self> {
        let radius = |k: usize| reach * k as f64 / RINGS as f64;
        let edges: Vec<Option<PupilBounds>> =
            (0..RINGS + 2).map(|k| bounds_at(lens, radius(k))).collect();
        let center = edges[0]?;
        let ring = |k: usize| {
            let whole = || whole_rear(lens, radius(k)).union(&whole_rear(lens, radius(k + 1)));
            let (Some(inner), Some(outer)) = (edges[k], edges[k + 1]) else {
                // The pupil vanishes somewhere in the ring, or there is none.
                return whole();
            };
            // Beyond the axis everything is mirrored.
            let before = k.checked_sub(1).map_or_else(
                || edges[1].map(|outer| outer.mirrored()),
                |before| edges[before],
            );
            let (Some(before), Some(after)) = (before, edges[k + 2]) else {
                return whole();
            };
            // Within a ring the edges run between where they are at its ends, up to how much their run bends.
            let bend = before.bend(&inner, &outer).max(inner.bend(&outer, &after));
            let hull = inner.union(&outer);
            let size = (hull.x[1] - hull.x[0]).max(2.0 * hull.y);
            hull.grown(bend + MARGIN * size)
        };
        let rings: Vec<PupilBounds> = (0..RINGS).map(ring).collect();
        Some(Self {
            reference_area: reference_area(lens, radius(1), &rings[0].union(&center)),
            rings,
            reach,
        })
    }

    /// The bounds for film points at a distance from the axis.
    #[inline]
    pub fn bounds(&self, lens: &Lens, film_radius: f64) -> PupilBounds {
        let ring = (film_radius / self.reach * RINGS as f64) as usize;
        // Filters reach beyond the film.
        let known = self.rings.get(ring).copied();
        known.unwrap_or_else(|| whole_rear(lens, film_radius))
    }

    /// Area in m² of the largest bounds on the film.
    pub fn greatest_area(&self) -> f64 {
        let areas = self.rings.iter().map(PupilBounds::area);
        areas.fold(0.0, |greatest, area| {
            // What is no number must not get lost.
            if area <= greatest { greatest } else { area }
        })
    }

    /// Area in m² of the bounds that pbrt-v3 has for the film's centre.
    pub fn reference_area(&self) -> f64 {
        self.reference_area
    }
}

/// Area in m² of the bounds that pbrt-v3 finds for the innermost ring, of radius `ring`, to which the brightness of its
/// pictures is relative. It looks at 2²⁰ points of a square of 1.5 rear apertures, each from a film point of its own,
/// and widens the bounds of those that get through by twice the square's diagonal over 2¹⁰: a small pupil holds few of
/// them, which shows. Points beside `pupil`, which no light passes, need not be followed.
fn reference_area(lens: &Lens, ring: f64, pupil: &PupilBounds) -> f64 {
    const N_POINTS: u32 = 1 << 20;
    let half = 1.5 * lens.rear_aperture_radius();
    let at = |u: f64| half * (2.0 * u - 1.0);
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for i in 0..N_POINTS {
        let x = at(f64::from(i.reverse_bits()) / 2f64.powi(32));
        if !(x >= pupil.x[0] && x <= pupil.x[1]) {
            continue;
        }
        let rear = DVec2::new(x, at(radical_inverse_3(i)));
        let is_known = rear.cmpge(low).all() && rear.cmple(high).all();
        if rear.y.abs() > pupil.y || is_known {
            continue;
        }
        let o = DVec3::new((f64::from(i) + 0.5) / f64::from(N_POINTS) * ring, 0.0, 0.0);
        let d = rear.extend(lens.rear_z()) - o;
        if lens.fill(LocalRay { o, d }) <= 1.0 {
            (low, high) = (low.min(rear), high.max(rear));
        }
    }
    let widened = if low.x <= high.x {
        2.0 * (2.0 * half * std::f64::consts::SQRT_2) / f64::from(N_POINTS).sqrt()
    } else {
        // Nothing gets through: the whole square counts.
        (low, high) = (DVec2::splat(-half), DVec2::splat(half));
        0.0
    };
    let size = high - low + DVec2::splat(2.0 * widened);
    size.x * size.y
}

/// The digits of a number in base 3, mirrored at the point.
fn radical_inverse_3(mut i: u32) -> f64 {
    let (mut mirrored, mut place) = (0u64, 1u64);
    while i > 0 {
        mirrored = mirrored * 3 + u64::from(i % 3);
        place *= 3;
        i /= 3;
    }
    mirrored as f64 / place as f64
}

/// A rectangle of the rear plane that every ray crosses which hits the opening of the rear interface.
fn whole_rear(lens: &Lens, film_radius: f64) -> PupilBounds {
    let r = lens.rear_aperture_radius();
    let mut bounds = PupilBounds {
        x: [f64::INFINITY, f64::NEG_INFINITY],
        y: 0.0,
    };
    for z in lens.rear_extent() {
        let shrink = lens.rear_z() / z;
        let at = |x: f64| film_radius + (x - film_radius) * shrink;
        bounds = bounds.union(&PupilBounds {
            x: [at(-r), at(r)],
            y: r * shrink,
        });
    }
    bounds
}

/// The tight bounds of the pupil as one film point sees it; `None` if it sees none.
fn bounds_at(lens: &Lens, film_radius: f64) -> Option<PupilBounds> {
    let o = DVec3::new(film_radius, 0.0, 0.0);
    let fill = |x: f64, y: f64| {
        let d = DVec3::new(x, y, lens.rear_z()) - o;
        lens.fill(LocalRay { o, d })
    };
    let whole = whole_rear(lens, film_radius);
    let [x0, x1] = whole.x;
    // The point of the axis farthest from all edges: a scan for where to look, then a search for small pupils.
    let step = (x1 - x0) / SCAN as f64;
    let scanned = (0..SCAN).map(|k| x0 + step * (k as f64 + 0.5));
    let start = scanned.min_by(|a, b| fill(*a, 0.0).total_cmp(&fill(*b, 0.0)))?;
    let refined = golden_section([start - step, start + step], |x| fill(x, 0.0));
    let inside = [start, refined]
        .into_iter()
        .find(|x| fill(*x, 0.0) <= 1.0)?;
    let x = [
        edge(inside, x0, |x| fill(x, 0.0) <= 1.0),
        edge(inside, x1, |x| fill(x, 0.0) <= 1.0),
    ];
    let height = |x: f64| {
        if fill(x, 0.0) <= 1.0 {
            edge(0.0, whole.y, |y| fill(x, y) <= 1.0)
        } else {
            0.0
        }
    };
    let tallest = golden_section(x, |x| -height(x));
    Some(PupilBounds {
        x,
        y: height(tallest).max(height(inside)),
    })
}

/// Where a function with one minimum has it.
fn golden_section([mut a, mut b]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let mut inner = [b - RATIO * (b - a), a + RATIO * (b - a)];
    let mut values = inner.map(&f);
    for _ in 0..GOLDEN_STEPS {
        if values[0] <= values[1] {
            b = inner[1];
            inner = [b - RATIO * (b - a), inner[0]];
            values = [f(inner[0]), values[0]];
        } else {
            a = inner[0];
            inner = [inner[1], a + RATIO * (b - a)];
            values = [values[1], f(inner[1])];
        }
    }
    if values[0] <= values[1] {
        inner[0]
    } else {
        inner[1]
    }
}

/// The first point toward `end` that is not inside, or `end`.
fn edge(mut inside: f64, end: f64, is_inside: impl Fn(f64) -> bool) -> f64 {
    let mut outside = end;
    if is_inside(end) {
        return end;
    }
    for _ in 0..HALVINGS {
        let middle = inside + (outside - inside) * 0.5;
        if is_inside(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    outside
}
