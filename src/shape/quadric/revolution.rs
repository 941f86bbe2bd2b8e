//! What surfaces of revolution about the z axis have in common.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec2, DVec3};

/// Parameters at which a line enters and leaves a box. `None` if the line passes beside the box.
pub(super) fn within_box(o: DVec3, d: DVec3, [low, high]: [DVec3; 2]) -> Option<[f64; 2]> {
    let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let (a, b) = (
            (low[axis] - o[axis]) / d[axis],
            (high[axis] - o[axis]) / d[axis],
        );
        // A line within a face gives 0 / 0, which `min` and `max` pass over.
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    // What only touches the box may seem to miss it.
    if near > far + (near.abs() + far.abs()) * (8.0 * f64::EPSILON) {
        return None;
    }
    Some([near, far])
}

/// Parameter of the middle of a line's way through a box. `None` if the line passes beside the box, where the roots of
/// a flat surface would be rounding alone.
pub(super) fn middle_of_box(o: DVec3, d: DVec3, bounds: [DVec3; 2]) -> Option<f64> {
    let [near, far] = within_box(o, d, bounds)?;
    let middle = near + 0.5 * (far - near);
    middle.is_finite().then_some(middle)
}

/// Where a line meets the surface ρ² = `profile`\[0\] + 2 `profile`\[1\] (z − o.z) + `profile`\[2\] (z − o.z)², in order;
/// what does not exist is not finite.
pub(super) fn roots(o: DVec3, d: DVec3, profile: [f64; 3]) -> [f64; 2] {
    let a = d.x * d.x + d.y * d.y - profile[2] * d.z * d.z;
    let b = o.x * d.x + o.y * d.y - profile[1] * d.z;
    let c = o.x * o.x + o.y * o.y - profile[0];
    let discriminant = b * b - a * c;
    if !(discriminant >= 0.0) {
        return [f64::NAN; 2];
    }
    // Nothing cancels in q; a = 0 sends one root to infinity.
    let q = -(b + discriminant.sqrt().copysign(b));
    let (t0, t1) = (q / a, c / q);
    if t1 < t0 { [t1, t0] } else { [t0, t1] }
}

/// The angle in [0, 2π) by which `from` must turn to point to `to`; 0 if either is 0.
pub(super) fn turn(from: DVec2, to: DVec2) -> f64 {
    let phi = from.perp_dot(to).atan2(from.dot(to));
    if phi < 0.0 {
        (phi + TAU).min(TAU.next_down())
    } else {
        phi
    }
}

/// `phi` as a fraction of `phi_max`. An angle outside, which comes from rounding, counts as the nearer end.
pub(super) fn fraction_of_turn(phi: f64, phi_max: f64) -> f64 {
    if phi <= phi_max {
        phi / phi_max
    } else if phi - phi_max < TAU - phi {
        1.0
    } else {
        0.0
    }
}

/// Where an increasing function takes a value, by Newton's method within a shrinking interval, halved where a step would
/// leave it. Where the derivative has no inflection a few rounds do; the bound only makes sure of an end.
pub(super) fn solve_increasing(
    target: f64,
    [mut low, mut high]: [f64; 2],
    start: f64,
    value: impl Fn(f64) -> f64,
    derivative: impl Fn(f64) -> f64,
) -> f64 {
    let mut x = start;
    for _ in 0..100 {
        let excess = value(x) - target;
        if excess > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let newton = x - excess / derivative(x);
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        let moved = (next - x).abs();
        x = next;
        if moved <= 4.0 * f64::EPSILON * x.abs().max(high - low) {
            break;
        }
    }
    x
}

/// Derivative of the unit vector along `n`, given that of `n`; 0 where `n` is 0.
pub(super) fn unit_derivative(n: DVec3, derivative: DVec3) -> DVec3 {
    let Some(unit) = n.try_normalize() else {
        return DVec3::ZERO;
    };
    (derivative - unit * unit.dot(derivative)) / n.length()
}

/// Part of space in cylinder coordinates.
pub(super) struct Ring {
    /// Smallest and largest distance from the axis.
    pub(super) rho: [f64; 2],
    /// Smallest and largest z.
    pub(super) z: [f64; 2],
    /// First and last azimuth, any number of turns from 0.
    pub(super) phi: [f64; 2],
}

impl Ring {
    /// Smallest and largest coordinates.
    pub(super) fn bounds(&self) -> [DVec3; 2] {
        const AXES: [DVec2; 4] = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y];
        let [first, last] = self.phi;
        let mut directions = [DVec2::from_angle(first); 6];
        directions[1] = DVec2::from_angle(last);
        // The axes in between: four make a full turn.
        let first_quarter = (first / FRAC_PI_2).ceil();
        for (k, direction) in directions[2..].iter_mut().enumerate() {
            let quarter = first_quarter + k as f64;
            if quarter * FRAC_PI_2 <= last {
                *direction = AXES[quarter.rem_euclid(4.0) as usize];
            }
        }
        let [mut low, mut high] = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for rho in self.rho {
            for direction in directions {
                low = low.min(direction * rho);
                high = high.max(direction * rho);
            }
        }
        [low.extend(self.z[0]), high.extend(self.z[1])]
    }
}
