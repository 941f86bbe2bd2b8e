//! Transforms that change over time, as pbrt-v3 interpolates them.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::math::transform::{Transform, image_of_box};

/// Motion between two key frames: translation and stretch run linearly, rotation along the shorter arc. Before the
/// first and after the last key frame nothing moves.
#[derive(Clone, Copy, Debug)]
pub struct AnimatedTransform {
    times: [f64; 2],
    keys: [Transform; 2],
    parts: [Parts; 2],
}

/// M = T · R · S with a proper rotation R (polar decomposition; Shoemake and Duff 1992).
#[derive(Clone, Copy, Debug)]
struct Parts {
    translation: DVec3,
    rotation: DQuat,
    stretch: DMat3,
}

/// Steps of the iteration of the polar decomposition: it converges quadratically from any invertible matrix.
const POLAR_STEPS: usize = 100;

/// Pieces of the motion whose boxes make up [`AnimatedTransform::bounds`].
const PIECES: usize = 64;

impl Parts {
    fn of(m: &DAffine3) -> Self {
        // Scaling changes nothing about the rotation; near 1 the iteration starts well.
        let size = m.matrix3.determinant().abs().cbrt();
        let mut rotation = m.matrix3 * (1.0 / size);
        for _ in 0..POLAR_STEPS {
            let next = (rotation + rotation.transpose().inverse()) * 0.5;
            let change = (next - rotation)
                .to_cols_array()
                .iter()
                .fold(0.0, |a: f64, c| a.max(c.abs()));
            rotation = next;
            if change <= f64::EPSILON {
                break;
            }
        }
        // A mirror goes into the stretch: a quaternion only turns.
        if rotation.determinant() < 0.0 {
            rotation = -rotation;
        }
        Self {
            translation: m.translation,
            rotation: DQuat::from_mat3(&rotation).normalize(),
            stretch: rotation.transpose() * m.matrix3,
        }
    }

    fn compose(&self) -> DAffine3 {
        DAffine3 {
            matrix3: DMat3::from_quat(self.rotation) * self.stretch,
            translation: self.translation,
        }
    }
}

impl AnimatedTransform {
    /// From two key frames at the given times, in ascending order. `None` if one of them mirrors and the other does
    /// not: in between something would have to be flat.
    pub fn new(keys: [Transform; 2], times: [f64; 2]) -> Option<Self> {
        let mut parts = keys.map(|key| Parts::of(key.affine()));
        if keys[0].swaps_handedness() != keys[1].swaps_handedness() {
            return None;
        }
        if parts[0].rotation.dot(parts[1].rotation) < 0.0 {
            parts[1].rotation = -parts[1].rotation;
        }
        Some(Self { times, keys, parts })
    }

    /// The two key frames.
    pub fn keys(&self) -> [Transform; 2] {
        self.keys
    }

    /// The transform at a time. `None` in the moment in which the stretch between two key frames turns singular.
    pub fn at(&self, time: f64) -> Option<Transform> {
        let [start, end] = self.times;
        if time <= start {
            return Some(self.keys[0]);
        }
        if time >= end {
            return Some(self.keys[1]);
        }
        Transform::from_affine(self.interpolate((time - start) / (end - start)))
    }

    /// Whether it is the same at all times from the first to the second.
    fn is_still_within(&self, [first, last]: [f64; 2]) -> bool {
        first == last || last <= self.times[0] || first >= self.times[1]
    }

    /// The map at a fraction of the way.
    fn interpolate(&self, x: f64) -> DAffine3 {
        let [a, b] = &self.parts;
        Parts {
            translation: a.translation.lerp(b.translation, x),
            rotation: a.rotation.slerp(b.rotation, x),
            stretch: a.stretch * (1.0 - x) + b.stretch * x,
        }
        .compose()
    }

    /// A box that holds every position of the given corners (and of their convex hull) while `time` runs over
    /// `interval`: smallest and largest corner.
    ///
    /// The motion is cut into pieces. Within one, no point strays farther from where it is in the middle than half
    /// the piece times its greatest speed, for which |ΔT| + angle · max |S p| + |ΔS p| is a bound.
    pub fn bounds(&self, corners: &[DVec3], interval: [f64; 2]) -> [DVec3; 2] {
        let [start, end] = self.times;
        let fraction = |time: f64| ((time - start) / (end - start)).clamp(0.0, 1.0);
        // Key frames at one time, or in reverse: the whole sweep is safe.
        let [x0, x1] = if start < end {
            interval.map(fraction)
        } else {
            [0.0, 1.0]
        };
        let [a, b] = &self.parts;
        let angle = 2.0 * a.rotation.dot(b.rotation).abs().min(1.0).acos();
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &p in corners {
            let (pa, pb) = (a.stretch * p, b.stretch * p);
            let speed = (b.translation - a.translation).length()
                + angle * pa.length().max(pb.length())
                + (pb - pa).length();
            let reach = DVec3::splat(speed * (x1 - x0) * 0.5 / PIECES as f64);
            for piece in 0..PIECES {
                let x = x0 + (x1 - x0) * (piece as f64 + 0.5) / PIECES as f64;
                let q = self.interpolate(x).transform_point3(p);
                lo = lo.min(q - reach);
                hi = hi.max(q + reach);
            }
        }
        [lo, hi]
    }
}

/// A transform that may change over time.
#[derive(Clone, Debug)]
pub enum Motion {
    /// Nothing moves.
    Still(Transform),
    /// A product of motions.
    Moving(Box<MotionChain>),
}

/// Key-framed motions between fixed transforms: `outer` · `links` · `inner`.
#[derive(Clone, Debug)]
pub struct MotionChain {
    /// Applied last.
    pub outer: Transform,
    /// Motions, the one applied last first.
    pub links: Vec<AnimatedTransform>,
    /// Applied first.
    pub inner: Transform,
}

impl Motion {
    /// Whether it is the same at all times from the first to the second: a motion before or after the shutter moves nothing.
    pub fn is_still_within(&self, times: [f64; 2]) -> bool {
        match self {
            Self::Still(_) => true,
            Self::Moving(chain) => chain.links.iter().all(|link| link.is_still_within(times)),
        }
    }

    /// The transform at a time; `None` where it is singular for a moment.
    #[inline]
    pub fn at(&self, time: f32) -> Option<Transform> {
        match self {
            Self::Still(transform) => Some(*transform),
            Self::Moving(chain) => {
                let MotionChain {
                    outer,
                    links,
                    inner,
                } = &**chain;
                let mut product = *outer;
                for link in links {
                    product = product.compose(&link.at(time as f64)?);
                }
                Some(product.compose(inner))
            }
        }
    }

    /// A box that holds a moving box, given by its smallest and its largest corner, over an interval of time.
    pub fn bounds(&self, of: [DVec3; 2], interval: [f64; 2]) -> [DVec3; 2] {
        match self {
            Self::Still(transform) => image_of_box(transform.affine(), of),
            Self::Moving(chain) => {
                let MotionChain {
                    outer,
                    links,
                    inner,
                } = &**chain;
                // Box by box outward: each holds whatever the one inside it can reach.
                let mut points = corners_of(of).map(|p| inner.point(p));
                for link in links.iter().rev() {
                    points = corners_of(link.bounds(&points, interval));
                }
                points
                    .iter()
                    .map(|p| outer.point(*p))
                    .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[lo, hi], p| {
                        [lo.min(p), hi.max(p)]
                    })
            }
        }
    }
}

/// The eight corners of a box.
pub fn corners_of([lo, hi]: [DVec3; 2]) -> [DVec3; 8] {
    std::array::from_fn(|k| {
        let pick = |axis: usize| {
            if k >> axis & 1 == 0 {
                lo[axis]
            } else {
                hi[axis]
            }
        };
        DVec3::new(pick(0), pick(1), pick(2))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat4;

    fn transform(m: DMat4) -> Transform {
        Transform::from_matrix(m).expect("invertible")
    }

    fn spin(degrees: f64) -> Transform {
        transform(
            DMat4::from_rotation_z(degrees.to_radians())
                * DMat4::from_translation(DVec3::new(3.0, 1.0, -2.0))
                * DMat4::from_scale(DVec3::new(1.0, 2.0, 0.5)),
        )
    }

    #[test]
    fn g20_three_quarters_of_a_turn_go_the_shorter_way() {
        let motion = AnimatedTransform::new(
            [
                Transform::IDENTITY,
                transform(DMat4::from_rotation_z(270f64.to_radians())),
            ],
            [0.0, 1.0],
        )
        .expect("no mirror");
        let half_way = motion.at(0.5).expect("invertible").vector(DVec3::X);
        let expected = DVec3::new(0.5f64.sqrt(), -(0.5f64.sqrt()), 0.0);
        assert!((half_way - expected).length() < 1e-12, "{half_way}");
    }

    #[test]
    fn g20_bounds_hold_every_position() {
        let corners = [
            DVec3::new(-1.0, -1.0, -1.0),
            DVec3::new(2.0, 1.0, 1.0),
            DVec3::new(0.0, 5.0, 0.0),
        ];
        for (keys, interval) in [
            ([spin(0.0), spin(170.0)], [0.0, 1.0]),
            ([spin(10.0), spin(-100.0)], [-1.0, 0.4]),
            ([Transform::IDENTITY, spin(5.0)], [0.3, 2.0]),
        ] {
            let motion = AnimatedTransform::new(keys, [0.0, 1.5]).expect("no mirror");
            let [lo, hi] = motion.bounds(&corners, interval);
            for k in 0..=20_000 {
                let time = interval[0] + (interval[1] - interval[0]) * k as f64 / 20_000.0;
                let at = motion.at(time).expect("invertible");
                for p in corners {
                    let q = at.point(p);
                    assert!(
                        q.cmpge(lo - 1e-12).all() && q.cmple(hi + 1e-12).all(),
                        "{q} at {time}"
                    );
                }
            }
            // Not much larger than the motion itself.
            assert!((hi - lo).max_element() < 20.0);
        }
    }

    #[test]
    fn g21_mirrors_interpolate_among_themselves_only() {
        let mirror = transform(DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)));
        let turned =
            transform(DMat4::from_rotation_y(0.7) * DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)));
        assert!(AnimatedTransform::new([Transform::IDENTITY, mirror], [0.0, 1.0]).is_none());
        let motion = AnimatedTransform::new([mirror, turned], [0.0, 1.0]).expect("both mirror");
        for k in 0..=10 {
            let at = motion.at(k as f64 / 10.0).expect("invertible");
            assert!(at.swaps_handedness() && (at.determinant() + 1.0).abs() < 1e-12);
        }
    }
}
