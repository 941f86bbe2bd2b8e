//! Light sources other than emitting shapes.

use glam::{DMat3, DVec3};
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema::{Family, PluginRef};
use tyndall_parser::source::{Span, Spanned};

use crate::compile::assets::Assets;
use crate::compile::media::Media;
use crate::compile::reader::ParamReader;
use crate::compile::space::{self, RenderSpace};
use crate::compile::textures::read_image;
use crate::compile::{lookup, ray_count, spectra};
use crate::describe::description::{Entity, Frame, LightEntity};
use crate::ids::{LightId, MediumId};
use crate::image::Image;
use crate::image::mip::Wrap;
use crate::image::repair::Samples;
use crate::image::resample::to_powers_of_two;
use crate::integrator::Integrator;
use crate::light::{
    DistantLight, GoniometricLight, InfiniteLight, Light, PointLight, ProjectionLight, SpotLight,
};
use crate::math::{Point3, Transform, Vec3};
use crate::spectrum::Rgb;
use crate::world::WorldParts;

/// Adds the lights of a frame, and says where they stand in it. Black ones are left out, unless a map could not be used.
pub(super) fn build(
    frame: &Frame,
    space: &RenderSpace,
    assets: &dyn Assets,
    media: &mut Media,
    parts: &mut WorldParts,
    integrator: &Integrator,
    diagnostics: &mut Diagnostics,
) -> Vec<(LightId, Span)> {
    let surfaces_ask = integrator.asks_by_normals()
        && parts
            .geometries
            .iter()
            .any(|geometry| geometry.material.is_some());
    let mut places = Vec::new();
    for entity in &frame.lights {
        let Some(light) = light(entity, space, surfaces_ask, assets, diagnostics) else {
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
    plugin.map_or(1, |plugin| {
        ray_count(
            &mut ParamReader::new(plugin, entity, diagnostics),
            "samples",
        )
    })
}

/// What stands for a light that cannot be had.
const LEFT_OUT: &str = "the light is left out";

fn light(
    light: &LightEntity,
    space: &RenderSpace,
    surfaces_ask: bool,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<Light> {
    let entity = &light.entity;
    let plugin = lookup(Family::Light, &entity.kind, LEFT_OUT, diagnostics)?;
    let name = plugin.schema.name;
    let has_position = matches!(name, "point" | "spot" | "projection" | "goniometric");
    let quantity = if has_position { "I" } else { "L" };
    let emission = radiance(plugin, entity, quantity, assets, diagnostics);
    let start = light.world_from_light.start;
    let world_from_light = space::transform(start, entity.span, diagnostics)?;
    let reader = LightReader {
        plugin,
        entity,
        emission,
        space,
        render_from_light: space.place(&world_from_light),
        world_from_light,
        surfaces_ask,
        assets,
    };
    match name {
        "point" => reader.point(diagnostics),
        "spot" => reader.spot(diagnostics),
        "projection" => reader.projection(diagnostics),
        "goniometric" => reader.goniometric(diagnostics),
        "distant" => reader.distant(diagnostics),
        _ => reader.infinite(diagnostics),
    }
}

/// The parameters of one light. All of them are read and checked even where nothing is emitted.
struct LightReader<'a> {
    plugin: PluginRef,
    entity: &'a Entity,
    /// Intensity or radiance; `None` for a light without.
    emission: Option<Rgb>,
    space: &'a RenderSpace,
    world_from_light: Transform,
    render_from_light: Transform,
    /// Whether light is drawn for surfaces by their normals.
    surfaces_ask: bool,
    assets: &'a dyn Assets,
}

impl LightReader<'_> {
    fn params<'d>(&'d self, diagnostics: &'d mut Diagnostics) -> ParamReader<'d> {
        ParamReader::new(self.plugin, self.entity, diagnostics)
    }

    /// In render space: W/sr times the squared length scale.
    fn intensity(&self) -> Option<Rgb> {
        let scale2 = self.space.scale() * self.space.scale();
        let scaled = |rgb: Rgb| rgb.map(|c| (c as f64 * scale2) as f32);
        self.emission.map(scaled)
    }

    /// Where the light's own space starts.
    fn origin(&self) -> Point3 {
        Point3::from_f64(self.render_from_light.point(DVec3::ZERO))
    }

    fn linear(&self) -> DMat3 {
        self.render_from_light.affine().matrix3
    }

    fn point(&self, diagnostics: &mut Diagnostics) -> Option<Light> {
        let mut p = self.params(diagnostics);
        // pbrt-v3 adds "from" in world space, after the transform.
        let world = self.world_from_light.point(DVec3::ZERO) + position(p.point3("from"));
        p.finish();
        let position = self.space.place(&Transform::IDENTITY).point(world);
        Some(Light::Point(PointLight {
            p: Point3::from_f64(position),
            intensity: self.intensity()?,
        }))
    }

    fn spot(&self, diagnostics: &mut Diagnostics) -> Option<Light> {
        let mut p = self.params(diagnostics);
        let (from, to) = (position(p.point3("from")), position(p.point3("to")));
        let span = p.span("from");
        let (cone, delta) = (p.float("coneangle"), p.float("conedeltaangle"));
        p.finish();
        let Some(axis) = (to - from).try_normalize() else {
            diagnostics.push(same_points("a spot light", span));
            return None;
        };
        let (s, t) = axis.any_orthonormal_pair();
        let linear = self.linear() * DMat3::from_cols(s, t, axis);
        let position = Point3::from_f64(self.render_from_light.point(from));
        let spot = SpotLight::new(position, self.intensity()?, linear, cone, delta);
        Some(Light::Spot(Box::new(spot)))
    }

    fn projection(&self, diagnostics: &mut Diagnostics) -> Option<Light> {
        let mut p = self.params(diagnostics);
        let (fov, file) = (p.float("fov"), p.file("mapname"));
        p.finish();
        let intensity = self.intensity()?;
        let image = self.map(file, "a white square is used", diagnostics);
        let image = image.unwrap_or_else(|| Image::constant(1.0));
        let aspect = image.width() as f64 / image.height() as f64;
        let map = to_powers_of_two(image, Wrap::Repeat);
        let (origin, linear) = (self.origin(), self.linear());
        let light = ProjectionLight::new(origin, intensity, map, aspect, fov, linear)?;
        Some(Light::Projection(Box::new(light)))
    }

    fn goniometric(&self, diagnostics: &mut Diagnostics) -> Option<Light> {
        let mut p = self.params(diagnostics);
        let file = p.file("mapname");
        p.finish();
        let intensity = self.intensity()?;
        match self.map(file, "a point light is used", diagnostics) {
            None => Some(Light::Point(PointLight {
                p: self.origin(),
                intensity,
            })),
            Some(image) => {
                let map = to_powers_of_two(image, Wrap::Repeat);
                let (origin, linear) = (self.origin(), self.linear());
                let light = GoniometricLight::new(origin, intensity, map, linear)?;
                Some(Light::Goniometric(Box::new(light)))
            }
        }
    }

    fn distant(&self, diagnostics: &mut Diagnostics) -> Option<Light> {
        let mut p = self.params(diagnostics);
        let (from, to) = (position(p.point3("from")), position(p.point3("to")));
        let span = p.span("from");
        p.finish();
        let toward = self.render_from_light.vector(from - to);
        let Some(direction) = toward.try_normalize() else {
            diagnostics.push(same_points("a distant light", span));
            return None;
        };
        Some(Light::Distant(DistantLight {
            direction: Vec3::from_f64(direction),
            radiance: self.emission?,
        }))
    }

    fn infinite(&self, diagnostics: &mut Diagnostics) -> Option<Light> {
        let mut p = self.params(diagnostics);
        let file = p.file("mapname");
        p.finish();
        let emission = self.emission?;
        let light = match self.map(file, "a constant light is used", diagnostics) {
            None => InfiniteLight::constant(emission).turned(self.linear()),
            Some(image) => {
                // Up-sampled to powers of two, as pbrt-v3 looks maps up.
                let map = to_powers_of_two(image, Wrap::Repeat);
                InfiniteLight::with_map(emission, map, self.linear(), self.surfaces_ask)?
            }
        };
        Some(Light::Infinite(Box::new(light)))
    }

    /// The image in a file. `None` without a file, and where it cannot be read, which is reported.
    fn map(
        &self,
        file: Option<Spanned<String>>,
        instead: &str,
        diagnostics: &mut Diagnostics,
    ) -> Option<Image> {
        let (file, kind) = (file?, Samples::NonNegative);
        read_image(&file, kind, self.assets, instead, diagnostics)
    }
}

fn position(p: [f32; 3]) -> DVec3 {
    DVec3::from(p.map(f64::from))
}

/// Reports that "from" and "to" give no direction.
fn same_points(what: &str, span: Span) -> Diagnostic {
    let message = format!("{what} needs two different points, \"from\" and \"to\"");
    Diagnostic::error("bad-light", span, message).with_label(LEFT_OUT)
}
