//! Light sources other than emitting shapes.

use glam::{DMat3, DVec3};
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema::{Family, PluginRef};
use tyndall_parser::source::Span;

use crate::compile::assets::Assets;
use crate::compile::media::Media;
use crate::compile::reader::ParamReader;
use crate::compile::space::{self, RenderSpace};
use crate::compile::textures::read_image;
use crate::compile::{lookup, spectra};
use crate::describe::description::{Entity, Frame, LightEntity};
use crate::ids::{LightId, MediumId};
use crate::image::Image;
use crate::image::mip::Wrap;
use crate::image::repair::Samples;
use crate::image::resample::to_powers_of_two;
use crate::light::{
    DistantLight, GoniometricLight, InfiniteLight, Light, PointLight, ProjectionLight, SpotLight,
};
use crate::math::{Point3, Vec3};
use crate::spectrum::Rgb;
use crate::world::WorldParts;

/// Adds the lights of a frame, and says where they stand in it. Black ones are left out, unless a map could not be used.
pub(super) fn build(
    frame: &Frame,
    space: &RenderSpace,
    assets: &dyn Assets,
    media: &mut Media,
    parts: &mut WorldParts,
    diagnostics: &mut Diagnostics,
) -> Vec<(LightId, Span)> {
    let mut places = Vec::new();
    for entity in &frame.lights {
        let Some(light) = light(entity, space, assets, diagnostics) else {
            continue;
        };
        let n_samples = match &light {
            Light::Infinite(_) => n_samples(Family::Light, &entity.entity, diagnostics),
            _ => 1,
        };
        places.push((LightId::new(parts.lights.len()), entity.entity.span));
        parts.lights.push(light);
        parts.light_samples.resize(parts.lights.len(), n_samples);
        let medium = entity
            .medium
            .map_or(MediumId::NONE, |medium| media.id(medium, diagnostics));
        parts.light_media.resize(parts.lights.len(), medium);
    }
    places
}

/// `name` times `scale`. `None` for a light without any positive channel, and, with an error, for one that is not
/// finite.
pub(super) fn radiance(
    plugin: PluginRef,
    entity: &Entity,
    name: &str,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<Rgb> {
    let mut p = ParamReader::new(plugin, entity, diagnostics);
    let values = [p.spectrum(name), p.spectrum("scale")];
    let [emission, scale] = [0, 1].map(|k| spectra::to_rgb(&values[k], assets, diagnostics));
    let product = emission * scale;
    if !product.is_finite() {
        let message = "the emission of a light must be finite";
        diagnostics.push(
            Diagnostic::error("bad-light", values[0].span, message)
                .with_label("the light is left out"),
        );
        return None;
    }
    // Negative channels of saturated spectra stay: they are part of the light until the pixel is cut at 0.
    Some(product).filter(|rgb| rgb.max_component() > 0.0)
}

/// How often `directlighting` samples a light that has an extent.
pub(super) fn n_samples(family: Family, entity: &Entity, diagnostics: &mut Diagnostics) -> u32 {
    let plugin = family.lookup(&entity.kind).ok();
    let count = plugin.map(|plugin| ParamReader::new(plugin, entity, diagnostics).int("samples"));
    count.map_or(1, |n| u32::try_from(n).unwrap_or(1).max(1))
}

fn light(
    light: &LightEntity,
    space: &RenderSpace,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<Light> {
    let entity = &light.entity;
    const INSTEAD: &str = "the light is left out";
    let plugin = lookup(Family::Light, &entity.kind, INSTEAD, diagnostics)?;
    let name = plugin.schema.name;
    let has_position = matches!(name, "point" | "spot" | "projection" | "goniometric");
    let quantity = if has_position { "I" } else { "L" };
    let emission = radiance(plugin, entity, quantity, assets, diagnostics);
    let start = light.world_from_light.start;
    let world_from_light = space::transform(start, entity.span, diagnostics)?;
    let render_from_light = space.place(&world_from_light);
    let point = |p: [f32; 3]| DVec3::from(p.map(f64::from));
    let linear = render_from_light.affine().matrix3;
    let scale2 = space.scale() * space.scale();
    // In render space: W/sr times the squared length scale.
    let intensity = emission.map(|rgb| rgb.map(|c| (c as f64 * scale2) as f32));
    let origin = Point3::from_f64(render_from_light.point(DVec3::ZERO));
    let mut p = ParamReader::new(plugin, entity, diagnostics);
    match name {
        "point" => {
            // pbrt-v3 adds "from" in world space, after the transform.
            let world = world_from_light.point(DVec3::ZERO) + point(p.point3("from"));
            p.finish();
            let position = space.place(&crate::math::Transform::IDENTITY).point(world);
            Some(Light::Point(PointLight {
                p: Point3::from_f64(position),
                intensity: intensity?,
            }))
        }
        "spot" => {
            let (from, to) = (point(p.point3("from")), point(p.point3("to")));
            let span = p.span("from");
            let (cone, delta) = (p.float("coneangle"), p.float("conedeltaangle"));
            p.finish();
            let Some(axis) = (to - from).try_normalize() else {
                let message = "a spot light needs two different points, \"from\" and \"to\"";
                diagnostics.push(Diagnostic::error("bad-light", span, message).with_label(INSTEAD));
                return None;
            };
            let (s, t) = axis.any_orthonormal_pair();
            let linear = linear * DMat3::from_cols(s, t, axis);
            let position = Point3::from_f64(render_from_light.point(from));
            let spot = SpotLight::new(position, intensity?, linear, cone, delta);
            Some(Light::Spot(Box::new(spot)))
        }
        "projection" => {
            let (fov, file) = (p.float("fov"), p.file("mapname"));
            p.finish();
            let intensity = intensity?;
            let image = file.and_then(|file| {
                const INSTEAD: &str = "a white square is used";
                read_image(&file, Samples::NonNegative, assets, INSTEAD, diagnostics)
            });
            let image = image.unwrap_or_else(|| Image::constant(1.0));
            let aspect = image.width() as f64 / image.height() as f64;
            let map = to_powers_of_two(image, Wrap::Repeat);
            let light = ProjectionLight::new(origin, intensity, map, aspect, fov, linear)?;
            Some(Light::Projection(Box::new(light)))
        }
        "goniometric" => {
            let file = p.file("mapname");
            p.finish();
            let intensity = intensity?;
            let image = file.and_then(|file| {
                const INSTEAD: &str = "a point light is used";
                read_image(&file, Samples::NonNegative, assets, INSTEAD, diagnostics)
            });
            match image {
                None => Some(Light::Point(PointLight {
                    p: origin,
                    intensity,
                })),
                Some(image) => {
                    let map = to_powers_of_two(image, Wrap::Repeat);
                    let light = GoniometricLight::new(origin, intensity, &map, linear)?;
                    Some(Light::Goniometric(Box::new(light)))
                }
            }
        }
        "distant" => {
            let (from, to) = (point(p.point3("from")), point(p.point3("to")));
            let span = p.span("from");
            p.finish();
            let Some(direction) = render_from_light.vector(from - to).try_normalize() else {
                let message = "a distant light needs two different points, \"from\" and \"to\"";
                diagnostics.push(Diagnostic::error("bad-light", span, message).with_label(INSTEAD));
                return None;
            };
            let direction = Vec3::from_f64(direction);
            Some(Light::Distant(DistantLight {
                direction,
                radiance: emission?,
            }))
        }
        _ => {
            let file = p.file("mapname");
            p.finish();
            let emission = emission?;
            let image = file.and_then(|file| {
                const INSTEAD: &str = "a constant light is used";
                read_image(&file, Samples::NonNegative, assets, INSTEAD, diagnostics)
            });
            let light = match image {
                None => InfiniteLight::constant(emission),
                Some(image) => {
                    // Up-sampled to powers of two, as pbrt-v3 looks maps up.
                    let map = to_powers_of_two(image, Wrap::Repeat);
                    InfiniteLight::with_map(emission, &map, linear)?
                }
            };
            Some(Light::Infinite(Box::new(light)))
        }
    }
}
