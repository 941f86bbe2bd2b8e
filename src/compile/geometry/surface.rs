//! What belongs to the surfaces of shapes: materials, media, masks and emission; and where pbrt-v3 is biased by them.

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema::Family;

use super::load::LocalShape;
use crate::compile::assets::Assets;
use crate::compile::materials::MaterialBuilder;
use crate::compile::media::Media;
use crate::compile::reader::{ParamReader, Textured};
use crate::compile::shapes::{Local, Mask};
use crate::compile::textures::TextureBuilder;
use crate::compile::{lights, lookup};
use crate::describe::description::{AreaLightRef, Entity, Frame};
use crate::ids::{MaterialId, MediumId};
use crate::math::Transform;
use crate::shape::curve::CurveStyle;
use crate::spectrum::Rgb;
use crate::texture::FloatSource;
use crate::world::{Cutout, MediumInterface};

/// What belongs to the surface of a shape, wherever it is placed.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    pub(super) material: MaterialId,
    pub(super) media: Option<MediumInterface>,
    /// Asked for where it emits.
    pub(super) medium_outside: MediumId,
    /// If it emits.
    pub(super) emission: Option<Emission>,
    pub(super) cutout: Cutout,
}

/// What the elements of an emitting shape have in common.
#[derive(Clone, Copy)]
pub(super) struct Emission {
    pub(super) radiance: Rgb,
    pub(super) two_sided: bool,
    /// See [`crate::light::AreaLight::is_turned`].
    pub(super) is_turned: bool,
    /// See [`crate::light::AreaLight::has_holes`].
    pub(super) has_holes: bool,
    pub(super) n_samples: u32,
}

/// The arenas' builders.
pub(in crate::compile) struct Builders<'a> {
    pub(in crate::compile) materials: MaterialBuilder,
    pub(in crate::compile) textures: TextureBuilder<'a>,
    pub(in crate::compile) media: Media<'a>,
    pub(in crate::compile) assets: &'a dyn Assets,
    /// Shadow masks matter to the integrator.
    pub(in crate::compile) heeds_shadow_masks: bool,
}

impl Builders<'_> {
    /// The surface of a shape, which is `in_object` if instances place it. `area_lights` remembers what each
    /// `AreaLightSource` emits, however many shapes share it.
    pub(super) fn surface(
        &mut self,
        shape: &LocalShape,
        frame: &Frame,
        in_object: bool,
        area_lights: &mut [Option<Option<Emission>>],
        diagnostics: &mut Diagnostics,
    ) -> Surface {
        let entity = &shape.entity;
        let material = self.materials.id(entity, &mut self.textures, diagnostics);
        let mut emission = entity.area_light.and_then(|AreaLightRef(index)| {
            let index = index as usize;
            *area_lights[index].get_or_insert_with(|| {
                area_light(&frame.area_lights[index], self.assets, diagnostics)
            })
        });
        let mut side = |medium: Option<_>| {
            medium.map_or(MediumId::NONE, |medium| self.media.id(medium, diagnostics))
        };
        let media = (entity.media.inside != entity.media.outside).then(|| MediumInterface {
            inside: side(entity.media.inside),
            outside: side(entity.media.outside),
        });
        let medium_outside = match &media {
            Some(media) => media.outside,
            None if emission.is_some() => side(entity.media.outside),
            None => MediumId::NONE,
        };
        // What turns to whoever looks at it has no back.
        if let (Some(emission), Local::Curves(source)) = (&mut emission, &shape.local) {
            emission.two_sided |= source.style != CurveStyle::Ribbon;
        }
        let cutout = Cutout {
            alpha: self.mask(shape.masks.alpha, diagnostics),
            shadow_alpha: self.mask(shape.masks.shadow_alpha, diagnostics),
        };
        // pbrt-v3 draws no points on lamps in instances.
        if let Some(emission) = &mut emission
            && !in_object
            && let Some(world_from_object) = shape.still()
        {
            emission.is_turned = turns(shape, world_from_object);
            emission.has_holes = cutout.alpha.is_some();
        }
        let surface = Surface {
            material,
            media,
            medium_outside,
            emission,
            cutout,
        };
        if surface.emission.is_some() {
            warn_of_bias(shape, &surface, diagnostics);
        }
        if self.heeds_shadow_masks && surface.cutout.shadow_alpha.is_some() {
            warn_of_half_shadow(shape, diagnostics);
        }
        surface
    }

    /// A mask, unless it is nowhere 0.
    fn mask(&mut self, mask: Mask, diagnostics: &mut Diagnostics) -> Option<FloatSource> {
        const OPAQUE: f32 = 1.0;
        let source = match mask {
            Mask::None => return None,
            Mask::Everywhere => FloatSource::Constant(0.0),
            Mask::Texture(texture) => {
                let texture = Textured::Texture(texture);
                self.textures.float_source(texture, OPAQUE, diagnostics)
            }
        };
        Some(source)
            .filter(|source| !matches!(source, FloatSource::Constant(alpha) if *alpha != 0.0))
    }
}

/// What an area light is; `None` if it is black.
fn area_light(
    entity: &Entity,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<Emission> {
    let plugin = lookup(
        Family::AreaLight,
        &entity.kind,
        "nothing is emitted",
        diagnostics,
    )?;
    let radiance = lights::radiance(plugin, entity, "L", assets, diagnostics);
    let mut p = ParamReader::new(plugin, entity, diagnostics);
    let two_sided = p.bool("twosided");
    p.finish();
    let n_samples = lights::n_samples(Family::AreaLight, entity, diagnostics);
    Some(Emission {
        radiance: radiance?,
        two_sided,
        is_turned: false,
        has_holes: false,
        n_samples,
    })
}

impl Surface {
    /// Whether nothing of it shows or lights.
    pub(super) fn is_nothing(&self) -> bool {
        let is_hole = matches!(self.cutout.alpha, Some(FloatSource::Constant(0.0)));
        is_hole && self.emission.is_none_or(|emission| !emission.has_holes)
    }
}

/// The quadrics on which pbrt-v3 draws points.
const DRAWN_ON: [&str; 3] = ["sphere", "disk", "cylinder"];

/// Whether points that pbrt-v3 draws on a lamp have normals opposite to those that rays find: on quadrics it does not heed
/// that they are mirrored, on meshes with normals that they are reversed. Those with tangents alone are reversed
/// there, and for rays twice, which is not at all.
fn turns(shape: &LocalShape, world_from_object: &Transform) -> bool {
    let entity = &shape.entity;
    match &shape.local {
        Local::Curves(_) => false,
        Local::Form(_) => {
            DRAWN_ON.contains(&entity.entity.kind.value.as_str())
                && world_from_object.swaps_handedness()
        }
        Local::Mesh(mesh) => {
            entity.reverse_orientation && !(mesh.normals.is_empty() && mesh.tangents.is_empty())
        }
    }
}

/// Scales within this of 1 are what composing rotations leaves.
const UNSCALED: f64 = 1e-6;

/// Says where pbrt-v3's light sampling disagrees with its own surfaces, and what is made of that.
fn warn_of_bias(shape: &LocalShape, surface: &Surface, diagnostics: &mut Diagnostics) {
    let [world_from_object, _] = shape.world_from_object.ends();
    let entity = &shape.entity;
    let kind = entity.entity.kind.value.as_str();
    const AS_SEEN: &str = "sampled here as it is seen";
    const TURNED: &str = "kept: one side shows, the other one lights";
    const HOLES: &str = "kept: what is cut out lights without being seen";
    let mut warn_with = |what: &str, label: &str| {
        let message = format!("pbrt-v3 renders this light biased: {what}");
        diagnostics.push(
            Diagnostic::warning("biased-in-pbrt", entity.entity.span, message).with_label(label),
        );
    };
    let emission = surface.emission.as_ref();
    if emission.is_some_and(|emission| emission.is_turned && !emission.two_sided) {
        let what = match &shape.local {
            Local::Mesh(_) => "a reversed mesh with normals or tangents",
            Local::Form(_) | Local::Curves(_) => "a mirrored quadric",
        };
        warn_with(&format!("it samples the other side of {what}"), TURNED);
    }
    if emission.is_some_and(|emission| emission.has_holes) {
        warn_with(
            "what its alpha mask cuts out lights others all the same",
            HOLES,
        );
    }
    let mut warn = |what: &str| warn_with(what, AS_SEEN);
    match &shape.local {
        // What cannot be sampled in pbrt-v3 ends its run.
        Local::Curves(_) | Local::Mesh(_) => {}
        Local::Form(_) if !DRAWN_ON.contains(&kind) => {}
        Local::Form(form) => {
            let scale = world_from_object.uniform_scale(UNSCALED);
            if !scale.is_some_and(|scale| (scale - 1.0).abs() <= UNSCALED) {
                warn("it samples scaled quadrics with their unscaled size");
            }
            if !form.is_whole() && kind != "cylinder" {
                warn("it samples parts of quadrics as the whole");
            }
        }
    }
    if !surface.material.is_some() {
        warn("it leaves out half of the light of surfaces without a material");
    }
}

/// Says that only half of pbrt-v3's light sampling passes what casts no shadow.
fn warn_of_half_shadow(shape: &LocalShape, diagnostics: &mut Diagnostics) {
    let message = "pbrt-v3 renders the shadow of this shape biased: light that is found by chance \
                   stops where its shadow mask lets sampled light pass";
    diagnostics.push(
        Diagnostic::warning("biased-in-pbrt", shape.entity.entity.span, message)
            .with_label("both pass here"),
    );
}
