//! Light from all around. Scene-file manual (`LightSource "infinite"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum L` | 1 | radiance; multiplies the map |
//! | `spectrum scale` | 1 | multiplies as well |
//! | `string mapname` | none | latitude–longitude map; z is up, the top row is +z, s = 0 is +x |

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{Mat3A, Vec2, Vec3A};

use crate::image::Image;
use crate::math::Vec3;
use crate::sampling::distribution::Distribution2D;
use crate::sampling::warp::{UNIFORM_SPHERE_PDF, uniform_sphere};
use crate::spectrum::Rgb;

/// An environment, constant or with a map.
#[derive(Clone, Debug)]
pub struct InfiniteLight {
    radiance: Rgb,
    map: Option<EnvironmentMap>,
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
struct EnvironmentMap {
    texels: Texels,
    distribution: Distribution2D,
    light_from_render: Mat3A,
    render_from_light: Mat3A,
    /// |det| of `render_from_light`, for the density of directions under a transform that stretches.
    determinant: f32,
    mean: Rgb,
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
    /// `render_from_light` is the invertible linear part of the light's transform.
    ///
    /// `None` for a map that is black everywhere.
    pub fn with_map(radiance: Rgb, map: &Image, render_from_light: glam::DMat3) -> Option<Self> {
        let texels = Texels::new(map);
        // Directions have no length: normalise the matrix so that f32 holds it at any scale.
        let size = render_from_light.determinant().abs().cbrt();
        let render_from_light = render_from_light * (1.0 / size);
        let (weights, mean) = texels.tabulate();
        let map = EnvironmentMap {
            distribution: Distribution2D::new(&weights, 2 * texels.width)?,
            texels,
            light_from_render: render_from_light.inverse().as_mat3().into(),
            render_from_light: render_from_light.as_mat3().into(),
            determinant: render_from_light.determinant().abs() as f32,
            mean,
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
            Some(map) => self.radiance * map.texels.look_up(coordinates(map.to_light(w))),
        }
    }

    /// Draws a direction: by the map's brightness, or uniformly where there is none.
    pub fn sample(&self, u: [f32; 2]) -> Option<EnvironmentSample> {
        let Some(map) = &self.map else {
            let wi = uniform_sphere(u);
            return Some(EnvironmentSample {
                wi,
                radiance: self.radiance,
                pdf_w: UNIFORM_SPHERE_PDF,
            });
        };
        let drawn = map.distribution.sample(Vec2::from(u));
        let st = drawn.uv.to_array();
        let (sin_theta, cos_theta) = (st[1] * PI).sin_cos();
        if sin_theta <= 0.0 {
            return None; // A pole: no solid angle.
        }
        let (sin_phi, cos_phi) = (st[0] * TAU).sin_cos();
        let in_light = Vec3A::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta);
        let stretched = map.render_from_light * in_light;
        let pdf_w = drawn.pdf / (2.0 * PI * PI * sin_theta) * map.jacobian(stretched);
        (pdf_w > 0.0).then(|| EnvironmentSample {
            wi: Vec3(stretched).normalize(),
            radiance: self.radiance * map.texels.look_up(st),
            pdf_w,
        })
    }

    /// Density of [`InfiniteLight::sample`] in sr⁻¹.
    pub fn pdf_w(&self, wi: Vec3) -> f32 {
        let Some(map) = &self.map else {
            return UNIFORM_SPHERE_PDF;
        };
        let in_light = map.to_light(wi);
        let sin_theta = (in_light.x * in_light.x + in_light.y * in_light.y).sqrt();
        if sin_theta == 0.0 {
            return 0.0;
        }
        let pdf_st = map.distribution.pdf(Vec2::from(coordinates(in_light)));
        pdf_st / (2.0 * PI * PI * sin_theta) * map.jacobian(map.render_from_light * in_light)
    }

    /// Power that reaches a sphere of radius `scene_radius`.
    pub fn power(&self, scene_radius: f64) -> f64 {
        let mean = self.map.as_ref().map_or(Rgb::ONE, |map| map.mean);
        std::f64::consts::PI
            * scene_radius
            * scene_radius
            * (self.radiance * mean).luminance() as f64
    }
}

impl EnvironmentMap {
    #[inline]
    fn to_light(&self, w: Vec3) -> Vec3A {
        (self.light_from_render * w.0).normalize()
    }

    /// dω(light) / dω(render) where `render_from_light` turns a unit vector into `stretched`.
    #[inline]
    fn jacobian(&self, stretched: Vec3A) -> f32 {
        let length2 = stretched.length_squared();
        length2 * length2.sqrt() / self.determinant
    }
}

/// (s, t) of a unit direction of light space: azimuth / 2π from +x in [0, 1], polar angle / π from +z.
#[inline]
fn coordinates(w: Vec3A) -> [f32; 2] {
    let s = w.y.atan2(w.x) * (0.5 * FRAC_1_PI);
    let t = (w.x * w.x + w.y * w.y).sqrt().atan2(w.z) * FRAC_1_PI;
    [if s < 0.0 { s + 1.0 } else { s }, t]
}

/// The map's pixels, packed.
#[derive(Clone, Debug)]
struct Texels {
    rgb: Vec<[f32; 3]>,
    width: usize,
    height: usize,
}

impl Texels {
    fn new(map: &Image) -> Self {
        let (width, height) = (map.width(), map.height());
        let rgb = (0..width * height)
            .map(|i| map.rgb(i % width, i / width).to_array())
            .collect();
        Self { rgb, width, height }
    }

    /// Bilinear interpolation. Wraps around in both directions: at the poles the top and the bottom row blend, as
    /// in pbrt-v3.
    #[inline]
    fn look_up(&self, st: [f32; 2]) -> Rgb {
        let x = st[0] * self.width as f32 - 0.5;
        let y = st[1] * self.height as f32 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (dx, dy) = (x - x0, y - y0);
        // Coordinates lie in [0, 1], so that an index is at most one off on either side.
        let wrap = |i: f32, n: usize| {
            let i = i as isize;
            if i < 0 {
                n - 1
            } else if i as usize >= n {
                0
            } else {
                i as usize
            }
        };
        let (x0, x1) = (wrap(x0, self.width), wrap(x0 + 1.0, self.width));
        let (y0, y1) = (wrap(y0, self.height), wrap(y0 + 1.0, self.height));
        let texel = |x: usize, y: usize| Rgb::from_array(self.rgb[y * self.width + x]);
        (texel(x0, y0) * (1.0 - dx) + texel(x1, y0) * dx) * (1.0 - dy)
            + (texel(x0, y1) * (1.0 - dx) + texel(x1, y1) * dx) * dy
    }

    /// Luminance times sin θ over half texels, row by row, and the mean over the sphere. Within a half texel the
    /// look-up is one bilinear patch, whose mean is its value in the middle and is zero only where the whole patch
    /// is: no direction with light is left out.
    fn tabulate(&self) -> (Vec<f32>, Rgb) {
        let (nu, nv) = (2 * self.width, 2 * self.height);
        let mut weights = Vec::with_capacity(nu * nv);
        let (mut sum, mut sum_weight) = ([0.0; 3], 0.0);
        for v in 0..nv {
            let t = (v as f64 + 0.5) / nv as f64;
            let sin_theta = (std::f64::consts::PI * t).sin();
            for u in 0..nu {
                let s = (u as f64 + 0.5) / nu as f64;
                let value = self.look_up([s as f32, t as f32]);
                weights.push(value.luminance().max(0.0) * sin_theta as f32);
                for (sum, channel) in sum.iter_mut().zip(value.to_array()) {
                    *sum += channel as f64 * sin_theta;
                }
                sum_weight += sin_theta;
            }
        }
        (
            weights,
            Rgb::from_array(sum.map(|c| (c / sum_weight) as f32)),
        )
    }
}
