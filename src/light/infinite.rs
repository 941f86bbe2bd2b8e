//! Light from all around. Scene-file manual (`LightSource "infinite"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum L` | 1 | radiance; multiplies the map |
//! | `spectrum scale` | 1 | multiplies as well |
//! | `string mapname` | none | latitude–longitude map; z is up, the top row is +z, s = 0 is +x |

use glam::{DMat3, Mat3A, Vec3A};

use crate::image::Image;
use crate::light::environment::EnvironmentMap;
use crate::math::Vec3;
use crate::sampling::warp::{UNIFORM_SPHERE_PDF, uniform_sphere};
use crate::spectrum::Rgb;

/// An environment, constant or with a map.
#[derive(Clone, Debug)]
pub struct InfiniteLight {
    radiance: Rgb,
    map: Option<PlacedMap>,
}

/// A direction drawn toward the environment.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentSample {
    /// Unit direction in render space.
    pub wi: Vec3,
    /// Radiance from there.
    pub radiance: Rgb,
    /// Density in sr⁻¹, positive.
    pub pdf_w: f32,
}

#[derive(Clone, Debug)]
struct PlacedMap {
    map: EnvironmentMap,
    map_from_render: Mat3A,
    render_from_map: Mat3A,
    /// |det| of `render_from_map`.
    determinant: f32,
}

impl PlacedMap {
    #[inline]
    fn to_map(&self, w: Vec3) -> Vec3A {
        (self.map_from_render * w.0).normalize()
    }

    /// dω(map) / dω(render) where `render_from_map` turns a unit vector into `stretched`: 1 for a rotation.
    #[inline]
    fn jacobian(&self, stretched: Vec3A) -> f32 {
        let length2 = stretched.length_squared();
        length2 * length2.sqrt() / self.determinant
    }
}

impl InfiniteLight {
    /// The same radiance from everywhere.
    pub fn constant(radiance: Rgb) -> Self {
        Self {
            radiance,
            map: None,
        }
    }

    /// `radiance` times a map in latitude and longitude, top row first, with non-negative finite values.
    /// `render_from_map` is the invertible linear part of the light's transform.
    ///
    /// `None` for a map that is black everywhere.
    pub fn with_map(radiance: Rgb, map: &Image, render_from_map: DMat3) -> Option<Self> {
        // Directions have no length: normalise the matrix so that f32 holds it at any scale.
        let size = render_from_map.determinant().abs().cbrt();
        let render_from_map = render_from_map * (1.0 / size);
        let map = PlacedMap {
            map: EnvironmentMap::new(map)?,
            map_from_render: render_from_map.inverse().as_mat3().into(),
            render_from_map: render_from_map.as_mat3().into(),
            determinant: render_from_map.determinant().abs() as f32,
        };
        Some(Self {
            radiance,
            map: Some(map),
        })
    }

    /// Radiance that arrives from the unit direction `w` of render space.
    #[inline]
    pub fn le(&self, w: Vec3) -> Rgb {
        match &self.map {
            None => self.radiance,
            Some(placed) => self.radiance * placed.map.radiance(placed.to_map(w)),
        }
    }

    /// Radiance from the unit direction `w`, and the density of [`InfiniteLight::sample`] there in sr⁻¹.
    #[inline]
    pub fn le_and_pdf(&self, w: Vec3) -> (Rgb, f32) {
        let Some(placed) = &self.map else {
            return (self.radiance, UNIFORM_SPHERE_PDF);
        };
        let in_map = placed.to_map(w);
        let (value, pdf_w) = placed.map.radiance_and_pdf(in_map);
        (
            self.radiance * value,
            pdf_w * placed.jacobian(placed.render_from_map * in_map),
        )
    }

    /// Density of [`InfiniteLight::sample`] in sr⁻¹.
    pub fn pdf_w(&self, w: Vec3) -> f32 {
        self.le_and_pdf(w).1
    }

    /// Draws a direction: by the map's brightness, or uniformly where there is none.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Option<EnvironmentSample> {
        let Some(placed) = &self.map else {
            let wi = uniform_sphere(u);
            return Some(EnvironmentSample {
                wi,
                radiance: self.radiance,
                pdf_w: UNIFORM_SPHERE_PDF,
            });
        };
        let drawn = placed.map.sample(u)?;
        let stretched = placed.render_from_map * drawn.direction;
        let pdf_w = drawn.pdf_w * placed.jacobian(stretched);
        let radiance = self.radiance * drawn.radiance;
        (pdf_w > 0.0).then(|| EnvironmentSample {
            wi: Vec3(stretched).normalize(),
            radiance,
            pdf_w,
        })
    }

    /// Power that reaches a sphere of radius `scene_radius`.
    pub fn power(&self, scene_radius: f64) -> f64 {
        let mean = self
            .map
            .as_ref()
            .map_or(Rgb::ONE, |placed| placed.map.mean());
        std::f64::consts::PI
            * scene_radius
            * scene_radius
            * (self.radiance * mean).luminance() as f64
    }
}
