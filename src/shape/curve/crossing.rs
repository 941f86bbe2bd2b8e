//! Where a ray meets a piece of a curve: halving, and the test of a part that is nearly straight.

use glam::{DVec3, Vec3A};

use crate::shape::curve::Segment;

/// Most halvings of a part because it is bent.
const MAX_DEPTH: u32 = 10;
/// A part is halved until it is straight to this part of its width.
const STRAIGHTNESS: f32 = 0.05;

/// A cubic Bézier segment in f32.
pub(super) type Cubic = [Vec3A; 4];

pub(super) fn wide(c: &Cubic) -> [DVec3; 4] {
    c.map(|p| p.as_dvec3())
}

/// Both halves of a cubic (de Casteljau).
#[inline]
pub(super) fn halves([a, b, c, d]: &Cubic) -> [Cubic; 2] {
    let middle = |p: Vec3A, q: Vec3A| (p + q) * 0.5;
    let (ab, bc, cd) = (middle(*a, *b), middle(*b, *c), middle(*c, *d));
    let (abc, bcd) = (middle(ab, bc), middle(bc, cd));
    let m = middle(abc, bcd);
    [[*a, ab, abc, m], [m, bcd, cd, *d]]
}

/// Point and derivative; where the derivative vanishes, the chord stands for it.
#[inline]
pub(super) fn evaluate([a, b, c, d]: &Cubic, u: f32) -> (Vec3A, Vec3A) {
    let (ab, bc, cd) = (a.lerp(*b, u), b.lerp(*c, u), c.lerp(*d, u));
    let (abc, bcd) = (ab.lerp(bc, u), bc.lerp(cd, u));
    let derivative = (bcd - abc) * 3.0;
    let derivative = if derivative == Vec3A::ZERO {
        *d - *a
    } else {
        derivative
    };
    (abc.lerp(bcd, u), derivative)
}

/// What the test of one piece against one ray needs, in a frame whose z axis is the ray.
pub(super) struct Crossing<'a> {
    pub(super) segment: &'a Segment,
    /// Normals at the ends, and the unit direction, in curve space.
    pub(super) ribbon: Option<([DVec3; 2], DVec3)>,
    pub(super) nearest: Option<Nearest>,
    /// Where the ray ends.
    pub(super) z_max: f32,
}

/// The nearest meeting so far.
pub(super) struct Nearest {
    /// Distance in curve space.
    pub(super) z: f32,
    pub(super) uv: [f32; 2],
}

impl Crossing<'_> {
    /// Whether the box around a cubic leaves the ray out.
    #[inline]
    pub(super) fn is_beside(&self, c: &Cubic, width: f32) -> bool {
        let [a, b, c, d] = *c;
        let reach = 0.5 * width;
        let (lo, hi) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        lo.y > reach
            || hi.y < -reach
            || lo.x > reach
            || hi.x < -reach
            || lo.z - reach > self.z_max
            || hi.z + reach < 0.0
    }

    /// Halves a part of a segment `splits` times, then as often as it is bent.
    pub(super) fn split(&mut self, c: &Cubic, range: [f32; 2], splits: u32) {
        if splits == 0 {
            let depth = depth_for(c, self.segment);
            return self.descend(c, range, depth);
        }
        self.halve(c, range, |crossing, half, range| {
            crossing.split(half, range, splits - 1);
        });
    }

    fn descend(&mut self, c: &Cubic, range: [f32; 2], depth: u32) {
        if depth == 0 {
            return self.meet(c, range);
        }
        self.halve(c, range, |crossing, half, range| {
            crossing.descend(half, range, depth - 1);
        });
    }

    /// Looks at the halves that the ray may meet.
    #[inline]
    fn halve(
        &mut self,
        c: &Cubic,
        [u0, u1]: [f32; 2],
        mut look: impl FnMut(&mut Self, &Cubic, [f32; 2]),
    ) {
        let middle = 0.5 * (u0 + u1);
        for (half, range) in halves(c).iter().zip([[u0, middle], [middle, u1]]) {
            if !self.is_beside(half, self.segment.widest(range)) {
                look(self, half, range);
            }
        }
    }

    /// The test of a part that is nearly straight.
    fn meet(&mut self, c: &Cubic, [u0, u1]: [f32; 2]) {
        let flat = c.map(|p| p.truncate());
        // Beyond the lines across the ends another part is met, or nothing.
        if (flat[1] - flat[0]).dot(-flat[0]) < 0.0 || (flat[2] - flat[3]).dot(-flat[3]) < 0.0 {
            return;
        }
        let along = flat[3] - flat[0];
        let w = along.dot(-flat[0]) / along.length_squared();
        if !w.is_finite() {
            return;
        }
        let w = w.clamp(0.0, 1.0);
        let u = u0 + (u1 - u0) * w;
        let mut width = self.segment.width(u);
        if let Some((normals, d)) = &self.ribbon {
            width *= slerp(normals, u.into()).dot(*d).abs() as f32;
        }
        let (center, derivative) = evaluate(c, w);
        let distance = center.truncate().length();
        if !(distance <= 0.5 * width && center.z > 0.0 && center.z < self.z_max) {
            return;
        }
        // On which side of the centre line.
        let side = center.x * derivative.y - derivative.x * center.y;
        let v = 0.5 + (distance / width).copysign(side);
        self.z_max = center.z;
        self.nearest = Some(Nearest {
            z: center.z,
            uv: [u, v],
        });
    }
}

/// pbrt-v3's interpolation of ribbon normals: along the great circle, and as if 90° lay between normals that are
/// farther apart. Not of unit length then.
pub(super) fn slerp([n0, n1]: &[DVec3; 2], u: f64) -> DVec3 {
    let angle = n0.dot(*n1).clamp(0.0, 1.0).acos();
    let sin = angle.sin();
    if sin < 1e-4 {
        return n0.lerp(*n1, u); // The limit, to f32 precision.
    }
    *n0 * (((1.0 - u) * angle).sin() / sin) + *n1 * ((u * angle).sin() / sin)
}

/// Halvings after which a part of a segment counts as straight, as many as pbrt-v3 makes (pbrt 3rd ed., section 3.7:
/// a bound by second differences). How many they are shows in (u, v).
fn depth_for(c: &Cubic, segment: &Segment) -> u32 {
    let bend = |a: Vec3A, b: Vec3A, c: Vec3A| (a - 2.0 * b + c).abs().max_element();
    let bend = bend(c[0], c[1], c[2]).max(bend(c[1], c[2], c[3]));
    let tolerance = STRAIGHTNESS * segment.widths[0].max(segment.widths[1]);
    let ratio = std::f32::consts::SQRT_2 * 6.0 / 8.0 * bend / tolerance;
    if !(ratio >= 1.0) {
        return 0;
    }
    // The binary logarithm, rounded up from 1.5 times a power of two.
    let bits = ratio.to_bits();
    let log2 = (bits >> 23) - 127 + (bits >> 22 & 1);
    (log2 / 2).min(MAX_DEPTH)
}
