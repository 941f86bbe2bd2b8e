//! A point whose intensity follows a picture of directions. Scene-file manual (`LightSource "goniometric"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum I` | 1 | radiant intensity, W/sr; multiplies the map |
//! | `spectrum scale` | 1 | multiplies as well |
//! | `string mapname` | none | latitude–longitude map; the top row is +y, s = 0 is +x, s = ¼ is +z |
//!
//! The light is at the origin of light space. Without a map it is a point light.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use crate::image::Image;
use crate::light::Wanted;
use crate::light::placed_map::PlacedMap;
use crate::math::{Point3, Vec3};
use crate::spectrum::Rgb;

/// A goniometric light.
#[derive(Clone, Debug)]
pub struct GoniometricLight {
    p: Point3,
    intensity: Rgb,
    map: PlacedMap,
}

impl GoniometricLight {
    /// At `p`; `intensity`, in render-space units (W/sr times the squared length scale), multiplies a map with
    /// non-negative finite values, top row first. `render_from_light` is the invertible linear part of the light's
    /// transform.
    ///
    /// `None` for a map that is black everywhere.
    pub fn new(p: Point3, intensity: Rgb, map: Image, render_from_light: DMat3) -> Option<Self> {
        // Maps of directions have their pole on +z, this light has it on +y.
        let light_from_map = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y);
        Some(Self {
            p,
            intensity,
            map: PlacedMap::new(map, render_from_light * light_from_map, false)?,
        })
    }

    /// What multiplies the map.
    pub(super) fn strength(&self) -> Rgb {
        self.intensity
    }

    /// Position.
    pub fn position(&self) -> Point3 {
        self.p
    }

    /// Radiant intensity in the unit direction `w` of render space, away from the light.
    #[inline]
    pub fn intensity(&self, w: Vec3) -> Rgb {
        self.intensity * self.map.value(w)
    }

    /// Power in light space: exact for transforms that keep angles.
    pub fn power(&self) -> f64 {
        4.0 * PI * f64::from((self.intensity * self.map.mean()).luminance())
    }

    /// Draws a unit direction in proportion to the map; with the intensity there and the density in sr⁻¹.
    pub fn sample_direction(&self, u: [f32; 2]) -> Option<(Vec3, Rgb, f32)> {
        let (w, value, pdf_w) = self.map.sample(u, Wanted::All)?;
        Some((w, self.intensity * value, pdf_w))
    }

    /// Density of [`GoniometricLight::sample_direction`] in sr⁻¹.
    pub fn pdf_direction(&self, w: Vec3) -> f32 {
        self.map.value_and_pdf(w, Wanted::All).1
    }
}
