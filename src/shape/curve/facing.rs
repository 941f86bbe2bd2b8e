//! The window through which a receiver sees a piece of a curve.

use glam::{DVec2, DVec3};

/// Largest angle off the middle of a window.
const MAX_ANGLE: f64 = 1.4;
/// Growth of the window, for rounding.
const MARGIN: f64 = 1e-5;

/// A rectangle at distance 1 before the receiver, which all rays pass that may meet the piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    axes: [DVec3; 3],
    lo: DVec2,
    hi: DVec2,
}

impl Window {
    /// Around the spheres of the given radius at the control points, which are relative to the receiver. `None` where
    /// the receiver is among them, or sees them at too wide an angle.
    ///
    /// A curve lies in the hull of its control points, and perspective keeps hulls: what bounds the spheres bounds
    /// all that is within `radius` of the curve.
    pub(super) fn around(points: [DVec3; 4], radius: f64) -> Option<Self> {
        let z = (points[0] + points[1] + points[2] + points[3]).try_normalize()?;
        let chord = points[3] - points[0];
        let y = z
            .cross(chord)
            .try_normalize()
            .unwrap_or_else(|| z.any_orthonormal_vector());
        let x = y.cross(z);
        let (mut lo, mut hi) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in points {
            for (axis, k) in [(x, 0), (y, 1)] {
                let (across, ahead) = (p.dot(axis), p.dot(z));
                let sine = radius / across.hypot(ahead);
                let (angle, half) = (across.atan2(ahead), sine.asin());
                if !(angle.abs() + half < MAX_ANGLE) {
                    return None;
                }
                lo[k] = lo[k].min((angle - half).tan());
                hi[k] = hi[k].max((angle + half).tan());
            }
        }
        let margin = (hi - lo) * MARGIN;
        Some(Self {
            axes: [x, y, z],
            lo: lo - margin,
            hi: hi + margin,
        })
    }

    /// A unit direction through the window, uniform over its area.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        let at = self.lo + (self.hi - self.lo) * DVec2::from(u);
        let [x, y, z] = self.axes;
        (x * at.x + y * at.y + z).normalize()
    }

    /// Density of a direction of any length in sr⁻¹; 0 outside.
    pub(super) fn pdf_w(&self, w: DVec3) -> f64 {
        let [x, y, z] = self.axes.map(|axis| axis.dot(w));
        let at = DVec2::new(x, y) / z;
        let inside = z > 0.0 && at.cmpge(self.lo).all() && at.cmple(self.hi).all();
        if !inside {
            return 0.0;
        }
        let size = self.hi - self.lo;
        (1.0 + at.length_squared()).powf(1.5) / (size.x * size.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;
    use crate::sampling::warp::uniform_sphere;

    fn window() -> Window {
        let points = [
            [-0.6, -0.3, 1.0],
            [-0.1, 0.4, 1.3],
            [0.4, 0.1, 0.9],
            [0.9, 0.2, 1.4],
        ];
        Window::around(points.map(DVec3::from), 0.2).expect("the points are ahead")
    }

    #[test]
    fn the_density_is_that_of_the_samples() {
        let (window, mut rng) = (window(), Rng::new(1));
        let mut uniform = |n: usize| -> Vec<DVec3> {
            (0..n)
                .map(|_| uniform_sphere(rng.uniform2()).to_f64().normalize())
                .collect()
        };
        // Over all directions and over half of them, whose share of the samples is counted.
        let directions = uniform(400_000);
        let sphere = 4.0 * std::f64::consts::PI;
        let mean = |keep: &dyn Fn(DVec3) -> bool| {
            let sum: f64 = directions
                .iter()
                .filter(|w| keep(**w))
                .map(|w| window.pdf_w(*w))
                .sum();
            sum * sphere / directions.len() as f64
        };
        assert!((mean(&|_| true) - 1.0).abs() < 0.02);
        let mut rng = Rng::new(2);
        let samples: Vec<DVec3> = (0..100_000)
            .map(|_| window.sample(rng.uniform2().map(f64::from)))
            .collect();
        for axis in [DVec3::X, DVec3::Y, DVec3::new(0.5, -0.7, 0.1)] {
            let keep = |w: DVec3| w.dot(axis) > 0.0;
            let share = samples.iter().filter(|w| keep(**w)).count() as f64 / samples.len() as f64;
            assert!((0.1..0.9).contains(&share), "the half is one of the window");
            assert!((share - mean(&keep)).abs() < 0.02, "{axis}: {share}");
        }
    }

    #[test]
    fn a_receiver_among_the_points_has_no_window() {
        let around = |z: f64| {
            let points = [-1.0, -0.3, 0.3, 1.0].map(|x| DVec3::new(x, 0.0, z));
            Window::around(points, 0.1)
        };
        assert!(around(1.0).is_some());
        for z in [0.0, 0.05, 0.15] {
            assert!(around(z).is_none(), "{z}");
        }
    }
}
