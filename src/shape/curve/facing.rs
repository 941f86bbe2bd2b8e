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
