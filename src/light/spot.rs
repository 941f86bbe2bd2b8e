//! A point that shines into a cone. Scene-file manual (`LightSource "spot"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum I` | 1 | radiant intensity on the axis, W/sr |
//! | `spectrum scale` | 1 | multiplies it |
//! | `point from`, `to` | 0 0 0, 0 0 1 | position, and a point on the axis; light space |
//! | `float coneangle` | 30 | half angle of the cone in degrees |
//! | `float conedeltaangle` | 5 | width of the soft edge inside the cone in degrees |
//!
//! In the edge the intensity falls off as δ⁴, δ linear in the cosine. Angles are measured in light space, so a
//! transform that stretches makes an elliptic cone.
//!
//! Cosines are held as their distance to 1, *heights* 1 − cos θ of spherical caps, so that cones of a thousandth of a
//! degree keep their digits. A cap of height h has the solid angle 2π h.

use std::f64::consts::TAU;

use glam::{DMat3, Vec3A};

use crate::light::placed_map::Placement;
use crate::math::{Point3, Vec3};
use crate::spectrum::Rgb;

/// A spot light.
#[derive(Clone, Debug)]
pub struct SpotLight {
    p: Point3,
    intensity: Rgb,
    placement: Placement,
    /// 1 − cos where light ends.
    height: f32,
    /// 1 − cos where the edge begins.
    plateau: f32,
    /// Their difference.
    edge: f32,
}

impl SpotLight {
    /// At `p` with an `intensity` in render-space units (W/sr times the squared length scale). `render_from_light` is
    /// the invertible linear part of the light's transform, whose +z is the axis; angles are in degrees,
    /// 0 < `cone` ≤ 180.
    pub fn new(
        p: Point3,
        intensity: Rgb,
        render_from_light: DMat3,
        cone: f32,
        cone_delta: f32,
    ) -> Self {
        let cone = f64::from(cone).to_radians();
        // A negative start is the start on the other side of the axis.
        let start = (cone - f64::from(cone_delta).to_radians()).abs().min(cone);
        let height = |angle: f64| (2.0 * (0.5 * angle).sin().powi(2)) as f32;
        Self {
            p,
            intensity,
            placement: Placement::new(render_from_light),
            height: height(cone),
            plateau: height(start),
            edge: (2.0 * (0.5 * (cone + start)).sin() * (0.5 * (cone - start)).sin()) as f32,
        }
    }

    /// Intensity on the axis.
    pub(super) fn strength(&self) -> Rgb {
        self.intensity
    }

    /// Position.
    pub fn position(&self) -> Point3 {
        self.p
    }

    /// Share of the intensity at a height: 1 on the plateau, 0 outside.
    #[inline]
    fn falloff(&self, height: f32) -> f32 {
        if height > self.height {
            0.0
        } else if height <= self.plateau {
            1.0
        } else {
            ((self.height - height) / self.edge).powi(4)
        }
    }

    /// Solid angle weighted by the falloff, light space.
    fn weighted_solid_angle(&self) -> f64 {
        TAU * (f64::from(self.plateau) + f64::from(self.edge) / 5.0)
    }

    /// Radiant intensity in the unit direction `w` of render space, away from the light.
    #[inline]
    pub fn intensity(&self, w: Vec3) -> Rgb {
        self.intensity * self.falloff(height_of(self.placement.light_direction(w)))
    }

    /// Power in light space: exact for transforms that keep angles.
    pub fn power(&self) -> f64 {
        self.weighted_solid_angle() * f64::from(self.intensity.luminance())
    }

    /// Draws a unit direction in proportion to the intensity; with the intensity there and the density in sr⁻¹.
    pub fn sample_direction(&self, u: [f32; 2]) -> Option<(Vec3, Rgb, f32)> {
        let (plateau, edge) = (f64::from(self.plateau), f64::from(self.edge) / 5.0);
        let x = f64::from(u[0]) * (plateau + edge);
        let height = if x < plateau {
            x
        } else {
            // The edge holds (1 − δ⁵) of its weight between where it begins and δ.
            let delta = (1.0 - ((x - plateau) / edge).min(1.0)).powf(0.2);
            f64::from(self.height) - delta * f64::from(self.edge)
        };
        let (sin_phi, cos_phi) = (TAU * f64::from(u[1])).sin_cos();
        let r = (height * (2.0 - height)).max(0.0).sqrt();
        let in_light = Vec3A::new(
            (r * cos_phi) as f32,
            (r * sin_phi) as f32,
            (1.0 - height) as f32,
        );
        let (w, jacobian) = self.placement.render_direction(in_light);
        let falloff = self.falloff(height as f32);
        let pdf_w = falloff * jacobian / self.weighted_solid_angle() as f32;
        (pdf_w > 0.0).then(|| (w, self.intensity * falloff, pdf_w))
    }

    /// Density of [`SpotLight::sample_direction`] in sr⁻¹.
    pub fn pdf_direction(&self, w: Vec3) -> f32 {
        let in_light = self.placement.light_direction(w);
        let falloff = self.falloff(height_of(in_light));
        falloff * self.placement.jacobian(in_light) / self.weighted_solid_angle() as f32
    }

    /// Luminance of the intensity on the axis.
    pub fn axis_intensity(&self) -> f64 {
        f64::from(self.intensity.map(f32::abs).luminance())
    }

    /// Unit axis in render space, and the half angle of a cone around it that holds all light, in radians.
    pub fn cone(&self) -> (Vec3, f32) {
        let (axis, _) = self.placement.render_direction(Vec3A::Z);
        let half_angle = 2.0 * (0.5 * self.height).min(1.0).sqrt().asin();
        (axis, self.placement.widen(half_angle))
    }
}

/// 1 − cos of the angle between a unit vector and +z.
#[inline]
fn height_of(w: Vec3A) -> f32 {
    if w.z > 0.0 {
        (w.x * w.x + w.y * w.y) / (1.0 + w.z)
    } else {
        1.0 - w.z
    }
}
