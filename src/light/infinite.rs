//! Light from all around. Scene-file manual (`LightSource "infinite"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum L` | 1 | radiance; multiplies the map |
//! | `spectrum scale` | 1 | multiplies as well |
//! | `string mapname` | none | latitude–longitude map; z is up, the top row is +z, s = 0 is +x |

use glam::DMat3;

use crate::image::Image;
use crate::light::Wanted;
use crate::light::pbrt_density::PbrtDensity;
use crate::light::placed_map::{PlacedMap, Placement};
use crate::math::Vec3;
use crate::sampling::warp::{UNIFORM_SPHERE_PDF, uniform_sphere};
use crate::spectrum::Rgb;

/// An environment, constant or with a map.
#[derive(Clone, Debug)]
pub struct InfiniteLight {
    radiance: Rgb,
    map: Option<PlacedMap>,
    /// How it is turned if it has no map: only [`InfiniteLight::pdf_in_pbrt`] tells the difference.
    placement: Option<Placement>,
    pbrt_density: Option<PbrtDensity>,
}

/// A direction drawn toward the environment.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentSample {
    /// Unit direction in render space.
    pub wi: Vec3,
    /// An estimate of the radiance from there, as [`InfiniteLight::le_and_pdf`] gives it.
    pub radiance: Rgb,
    /// Density in sr⁻¹, positive.
    pub pdf_w: f32,
}

impl InfiniteLight {
    /// The same radiance from everywhere.
    pub fn constant(radiance: Rgb) -> Self {
        Self {
            radiance,
            map: None,
            placement: None,
            pbrt_density: None,
        }
    }

    /// The same turned by the invertible linear part of the light's transform.
    pub fn turned(self, render_from_light: DMat3) -> Self {
        Self {
            placement: Some(Placement::new(render_from_light)),
            ..self
        }
    }

    /// The radiance, or what multiplies the map.
    pub(super) fn strength(&self) -> Rgb {
        self.radiance
    }

    /// `radiance` times a map in latitude and longitude, top row first, with non-negative finite values.
    /// `render_from_map` is the invertible linear part of the light's transform. Unless the light `heeds_normals`, which
    /// takes time and memory to prepare, [`InfiniteLight::sample`] takes [`Wanted::Facing`] for [`Wanted::All`].
    ///
    /// `None` for a map that is black everywhere.
    pub fn with_map(
        radiance: Rgb,
        map: Image,
        render_from_map: DMat3,
        heeds_normals: bool,
    ) -> Option<Self> {
        Some(Self {
            radiance,
            map: Some(PlacedMap::new(map, render_from_map, heeds_normals)?),
            placement: None,
            pbrt_density: None,
        })
    }

    /// Radiance that arrives from the unit direction `w` of render space.
    #[inline]
    pub fn le(&self, w: Vec3) -> Rgb {
        match &self.map {
            None => self.radiance,
            Some(placed) => self.radiance * placed.value(w),
        }
    }

    /// An estimate of the radiance from the unit direction `w`, right on average over directions near it and nearly so in
    /// each, and the density of [`InfiniteLight::sample`] there in sr⁻¹.
    #[inline]
    pub fn le_and_pdf(&self, w: Vec3, wanted: Wanted) -> (Rgb, f32) {
        let Some(placed) = &self.map else {
            return (self.radiance, UNIFORM_SPHERE_PDF);
        };
        let (value, pdf_w) = placed.value_and_pdf(w, wanted);
        (self.radiance * value, pdf_w)
    }

    /// Density of [`InfiniteLight::sample`] in sr⁻¹.
    pub fn pdf_w(&self, w: Vec3, wanted: Wanted) -> f32 {
        self.le_and_pdf(w, wanted).1
    }

    /// Draws a direction: by the map's brightness and what is wanted, or uniformly where there is no map.
    #[inline]
    pub fn sample(&self, u: [f32; 2], wanted: Wanted) -> Option<EnvironmentSample> {
        let Some(placed) = &self.map else {
            let wi = uniform_sphere(u);
            return Some(EnvironmentSample {
                wi,
                radiance: self.radiance,
                pdf_w: UNIFORM_SPHERE_PDF,
            });
        };
        let (wi, value, pdf_w) = placed.sample(u, wanted)?;
        Some(EnvironmentSample {
            wi,
            radiance: self.radiance * value,
            pdf_w,
        })
    }

    /// Prepares [`InfiniteLight::pdf_in_pbrt`].
    pub(crate) fn prepare_pbrt_density(&mut self) {
        self.pbrt_density = Some(match &self.map {
            Some(map) => {
                PbrtDensity::of_map(map.luminances(self.radiance), map.placement().clone())
            }
            None => {
                let identity = || Placement::new(DMat3::IDENTITY);
                PbrtDensity::even(self.placement.clone().unwrap_or_else(identity))
            }
        });
    }

    /// Density in sr⁻¹ of light sampling in pbrt-v3 at the unit direction `w`; 0 where it is not prepared, as no picture
    /// depends on it.
    #[inline]
    pub fn pdf_in_pbrt(&self, w: Vec3) -> f32 {
        let density = self.pbrt_density.as_ref();
        density.map_or(0.0, |density| density.pdf_w(w))
    }

    /// Whether its radiance varies by direction.
    pub fn has_map(&self) -> bool {
        self.map.is_some()
    }

    /// Draws for blocks of media from now on, addressed by [`BlockId`](crate::ids::BlockId), of which there are no others:
    /// `transmittances` of a unit direction of render space, toward the light, are in [0, 1], one for each block. They need
    /// not be more than a guess: densities follow them, pictures do not. Nothing happens without a map.
    pub fn heed_blocks(&mut self, transmittances: impl Fn(Vec3) -> Vec<f32> + Sync) {
        if let Some(map) = &mut self.map {
            map.heed_blocks(transmittances);
        }
    }

    /// Luminance of the irradiance from half of an even sky of its mean radiance.
    pub fn irradiance(&self) -> f64 {
        let mean = self.map.as_ref().map_or(Rgb::ONE, PlacedMap::mean);
        std::f64::consts::PI * (self.radiance * mean).luminance() as f64
    }
}
