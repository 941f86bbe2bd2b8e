//! Where and how the tests look at textures.

use glam::DAffine3;
use tyndall::math::{Point3, Vec3};
use tyndall::spectrum::Rgb;
use tyndall::texture::{Mapping2, Mapping3, Source, Texture, TextureContext, Textures, UvMapping};

/// (s, t) = (u, v).
pub(crate) const UV: Mapping2 = Mapping2::Uv(UvMapping::IDENTITY);

/// Texture space is render space.
pub(crate) const SOLID: Mapping3 = Mapping3 {
    texture_from_render: DAffine3::IDENTITY,
};

/// The point of a surface with the given parameters, without a footprint.
pub(crate) fn uv(u: f32, v: f32) -> TextureContext {
    TextureContext {
        p: Point3::ZERO,
        uv: [u, v],
        duv_dx: [0.0; 2],
        duv_dy: [0.0; 2],
        dp_dx: Vec3::ZERO,
        dp_dy: Vec3::ZERO,
        face: 0,
    }
}

/// A point in space, without a footprint.
pub(crate) fn point(p: [f32; 3]) -> TextureContext {
    TextureContext {
        p: p.into(),
        ..uv(0.0, 0.0)
    }
}

/// The value of a lone scalar texture.
pub(crate) fn float(texture: Texture<f32>, ctx: &TextureContext) -> f32 {
    let mut textures = Textures::default();
    let source = textures.add(texture);
    textures.float(source, ctx)
}

/// The value of a lone colour texture.
pub(crate) fn rgb(texture: Texture<Rgb>, ctx: &TextureContext) -> Rgb {
    let mut textures = Textures::default();
    let source = textures.add(texture);
    textures.spectrum(source, ctx)
}

/// A texture that is the same everywhere.
pub(crate) fn constant<V>(value: V) -> Source<V> {
    Source::Constant(value)
}

/// The two are equal up to rounding.
#[track_caller]
pub(crate) fn assert_close(actual: f32, expected: f64, what: &str) {
    let error = (f64::from(actual) - expected).abs();
    assert!(
        error <= 2e-6 * (1.0 + expected.abs()),
        "{what}: {actual} is not {expected}"
    );
}
