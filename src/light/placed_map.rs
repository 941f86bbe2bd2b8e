//! How a light is turned and stretched, and maps of directions that are.

use glam::{DMat3, Mat3A, Vec3A};

use crate::image::Image;
use crate::light::Wanted;
use crate::light::environment::EnvironmentMap;
use crate::light::regions::Purpose;
use crate::math::{Normal3, Vec3};
use crate::spectrum::Rgb;

/// Directions between the space of a light and render space. Directions have no length: the size of the transform
/// does not matter.
#[derive(Clone, Debug)]
pub(super) struct Placement {
    light_from_render: Mat3A,
    render_from_light: Mat3A,
    /// |det| of `render_from_light`.
    determinant: f32,
    keeps_angles: bool,
}

/// Relative stretch up to which a transform counts as one that keeps angles.
const SIMILAR: f64 = 1e-5;

impl Placement {
    /// From the invertible linear part of the light's transform.
    pub(super) fn new(render_from_light: DMat3) -> Self {
        // Normalised, so that f32 holds it at any scale.
        let size = render_from_light.determinant().abs().cbrt();
        let render_from_light = render_from_light * (1.0 / size);
        let squared = render_from_light.transpose() * render_from_light;
        Self {
            keeps_angles: squared.abs_diff_eq(DMat3::IDENTITY, SIMILAR),
            light_from_render: render_from_light.inverse().as_mat3().into(),
            render_from_light: render_from_light.as_mat3().into(),
            determinant: render_from_light.determinant().abs() as f32,
        }
    }

    /// The unit direction of light space.
    #[inline]
    pub(super) fn light_direction(&self, w: Vec3) -> Vec3A {
        (self.light_from_render * w.0).normalize()
    }

    /// The unit vector of light space that has the cosines, but for their size, that a normal has in render space.
    #[inline]
    fn light_normal(&self, n: Normal3) -> Vec3A {
        (self.render_from_light.transpose() * n.0).normalize()
    }

    /// dω(light) / dω(render) at a unit direction of light space: what densities are multiplied by; 1 for a rotation.
    #[inline]
    pub(super) fn jacobian(&self, in_light: Vec3A) -> f32 {
        self.render_direction(in_light).1
    }

    /// A bound in render space, in radians, of angles up to `angle` from an axis of light space.
    pub(super) fn widen(&self, angle: f32) -> f32 {
        if self.keeps_angles {
            angle
        } else {
            std::f32::consts::PI
        }
    }

    /// The unit direction of render space, and dω(light) / dω(render) there.
    #[inline]
    pub(super) fn render_direction(&self, in_light: Vec3A) -> (Vec3, f32) {
        let stretched = self.render_from_light * in_light;
        let length2 = stretched.length_squared();
        let jacobian = length2 * length2.sqrt() / self.determinant;
        (Vec3(stretched).normalize(), jacobian)
    }
}

/// A map in latitude and longitude, placed.
#[derive(Clone, Debug)]
pub(super) struct PlacedMap {
    map: EnvironmentMap,
    placement: Placement,
}

impl PlacedMap {
    /// From a map with non-negative finite values, top row first. `None` if it is black everywhere. Unless it
    /// `heeds_normals`, samples ask for all light alike whatever they face.
    pub(super) fn new(map: Image, render_from_map: DMat3, heeds_normals: bool) -> Option<Self> {
        Some(Self {
            map: EnvironmentMap::new(map, heeds_normals)?,
            placement: Placement::new(render_from_map),
        })
    }

    /// Value in the unit direction `w` of render space.
    #[inline]
    pub(super) fn value(&self, w: Vec3) -> Rgb {
        self.map.radiance(self.placement.light_direction(w))
    }

    /// An estimate of the value in the unit direction `w`, and the density of [`PlacedMap::sample`] there in sr⁻¹.
    #[inline]
    pub(super) fn value_and_pdf(&self, w: Vec3, wanted: Wanted) -> (Rgb, f32) {
        let in_map = self.placement.light_direction(w);
        let (value, pdf_w) = self.map.radiance_and_pdf(in_map, self.purpose(wanted));
        (value, pdf_w * self.placement.jacobian(in_map))
    }

    /// Draws a unit direction in proportion to luminance, or rather what is wanted; with an estimate
    /// of the value there and the density in sr⁻¹, positive.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2], wanted: Wanted) -> Option<(Vec3, Rgb, f32)> {
        let drawn = self.map.sample(u, self.purpose(wanted))?;
        let (w, jacobian) = self.placement.render_direction(drawn.direction);
        let pdf_w = drawn.pdf_w * jacobian;
        (pdf_w > 0.0).then_some((w, drawn.radiance, pdf_w))
    }

    #[inline]
    fn purpose(&self, wanted: Wanted) -> Purpose {
        match wanted {
            Wanted::All => Purpose::Whole,
            Wanted::Facing(normal) => Purpose::Facing(self.placement.light_normal(normal)),
            Wanted::Within(block) => Purpose::Within(block),
        }
    }

    /// Draws for blocks of media from now on: `transmittances` of a unit direction of render space are in [0, 1], one for
    /// each block.
    pub(super) fn heed_blocks(&mut self, transmittances: impl Fn(Vec3) -> Vec<f32> + Sync) {
        let placement = &self.placement;
        self.map
            .heed_blocks(|in_map| transmittances(placement.render_direction(in_map).0));
    }

    /// How it is placed.
    pub(super) fn placement(&self) -> &Placement {
        &self.placement
    }

    /// Luminances of the map times `strength`.
    pub(super) fn luminances(&self, strength: Rgb) -> Image {
        self.map.luminances(strength)
    }

    /// Mean over the sphere of map space.
    pub(super) fn mean(&self) -> Rgb {
        self.map.mean()
    }
}
