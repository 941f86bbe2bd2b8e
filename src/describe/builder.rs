//! Follows the directives one by one.

use super::description::{
    AreaLightRef, CameraEntity, Entity, Frame, InstanceEntity, LightEntity, MaterialEntity,
    MaterialRef, MediumEntity, MediumPair, MediumRef, ObjectEntity, ObjectRef, SceneDescription,
    ShapeEntity, TextureBinding, TextureEntity, TextureRef, TextureType, TransformPair,
};
use super::names::Suggester;
use super::state::{Block, Draft, Interface, default_entity};
use super::transform::{self, Refused};
use glam::DMat4;
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics, Severity};
use tyndall_parser::directive::{Directive, Plugin};
use tyndall_parser::params::{ParamList, ParamValue};
use tyndall_parser::schema::{self, Family};
use tyndall_parser::source::{Span, Spanned};

/// The frames finished so far and the one in the making.
#[derive(Debug, Default)]
pub(super) struct Builder {
    diagnostics: Diagnostics,
    suggester: Suggester,
    frames: Vec<Frame>,
    draft: Draft,
    /// The last directive met.
    last: Option<Span>,
}

impl Builder {
    /// Follows one directive.
    pub(super) fn directive(&mut self, directive: Spanned<Directive>) {
        let Spanned {
            value: directive,
            span,
        } = directive;
        self.last = Some(span);
        if !self.may_stand_here(&directive, span) {
            return;
        }
        match directive {
            Directive::Identity => self.change_ctm("Identity", span, |_| DMat4::IDENTITY),
            Directive::Translate(delta) => {
                self.multiply("Translate", span, transform::translate(delta, span))
            }
            Directive::Scale(factors) => {
                self.multiply("Scale", span, transform::scale(factors, span))
            }
            Directive::Rotate { degrees, axis } => {
                self.multiply("Rotate", span, transform::rotate(degrees, axis, span));
            }
            Directive::LookAt { eye, target, up } => {
                let matrix = self.warned(transform::look_at(eye, target, up, span));
                self.multiply("LookAt", span, matrix);
            }
            Directive::Transform(numbers) => {
                match self.warned(transform::matrix(numbers, "Transform", span)) {
                    Ok(matrix) => self.change_ctm("Transform", span, |_| matrix),
                    Err(refused) => self.diagnostics.push(*refused),
                }
            }
            Directive::ConcatTransform(numbers) => {
                let matrix = self.warned(transform::matrix(numbers, "ConcatTransform", span));
                self.multiply("ConcatTransform", span, matrix);
            }
            Directive::CoordinateSystem(name) => {
                self.draft
                    .coordinate_systems
                    .insert(name.value, (self.draft.ctm.pair, name.span));
            }
            Directive::CoordSysTransform(name) => self.coord_sys_transform(&name),
            Directive::ActiveTransform(active) => self.draft.ctm.active = active,
            Directive::TransformTimes(times) => {
                match transform::finite(&times, "TransformTimes", span) {
                    Ok(()) => self.draft.options.transform_times = Some(times),
                    Err(refused) => self.diagnostics.push(*refused),
                }
            }
            Directive::PixelFilter(plugin) => {
                self.draft.options.filter = Some(self.entity(plugin, span))
            }
            Directive::Film(plugin) => self.draft.options.film = Some(self.entity(plugin, span)),
            Directive::Sampler(plugin) => {
                self.draft.options.sampler = Some(self.entity(plugin, span))
            }
            Directive::Accelerator(plugin) => {
                self.draft.options.accelerator = Some(self.entity(plugin, span))
            }
            Directive::Integrator(plugin) => {
                self.draft.options.integrator = Some(self.entity(plugin, span))
            }
            Directive::Camera(plugin) => self.camera(plugin, span),
            Directive::MakeNamedMedium(plugin) => self.make_named_medium(plugin, span),
            Directive::MediumInterface { inside, outside } => {
                let outside = outside.unwrap_or_else(|| inside.clone());
                self.draft.graphics.interface = Some(self.draft.interfaces.len());
                self.draft.interfaces.push(Interface { inside, outside });
            }
            Directive::WorldBegin => self.world_begin(span),
            Directive::WorldEnd => self.world_end(span),
            Directive::AttributeBegin => self.draft.push_graphics(Block::Attribute, span),
            Directive::AttributeEnd => self.end_attributes(Block::Attribute, span),
            Directive::TransformBegin => self.draft.push_ctm(Block::Transform, span),
            Directive::TransformEnd => self.transform_end(span),
            Directive::Texture {
                name,
                value_type,
                class,
            } => self.texture(name, &value_type, class, span),
            Directive::Material(plugin) => {
                let material = self.material(None, plugin, span);
                self.draft.graphics.material = material;
            }
            Directive::MakeNamedMaterial(plugin) => self.make_named_material(plugin, span),
            Directive::NamedMaterial(plugin) => self.named_material(&plugin),
            Directive::LightSource(plugin) => self.light_source(plugin, span),
            Directive::AreaLightSource(plugin) => self.area_light_source(plugin, span),
            Directive::Shape(plugin) => self.shape(plugin, span),
            Directive::ReverseOrientation => {
                self.draft.graphics.reverse_orientation = !self.draft.graphics.reverse_orientation;
            }
            Directive::ObjectBegin(name) => self.object_begin(name, span),
            Directive::ObjectEnd => self.object_end(span),
            Directive::ObjectInstance(name) => self.object_instance(&name, span),
        }
    }

    /// The frames and everything found.
    pub(super) fn finish(mut self) -> (SceneDescription, Diagnostics) {
        if let Some(world_begin) = self.draft.world {
            self.diagnostics.push(
                Diagnostic::error(
                    "missing-world-end",
                    world_begin,
                    "WorldBegin without a WorldEnd",
                )
                .with_label("nothing of this world is rendered"),
            );
        } else if self.frames.is_empty() {
            self.diagnostics.push(
                Diagnostic::new(
                    Severity::Error,
                    "nothing-to-render",
                    self.last,
                    "the scene has no WorldBegin … WorldEnd".to_owned(),
                )
                .with_label("the scene ends here"),
            );
        }
        (
            SceneDescription {
                frames: self.frames,
            },
            self.diagnostics,
        )
    }

    fn may_stand_here(&mut self, directive: &Directive, span: Span) -> bool {
        let keyword = schema::keyword(directive);
        let in_world = self.draft.world.is_some();
        let allowed = schema::directive(keyword).is_some_and(|entry| {
            if in_world {
                entry.in_world
            } else {
                entry.in_options
            }
        });
        if allowed {
            return true;
        }
        let place = if in_world {
            "after WorldBegin"
        } else {
            "before WorldBegin"
        };
        let mut diagnostic = Diagnostic::error(
            "wrong-block",
            span,
            format!("{keyword} is not allowed {place}"),
        )
        .with_label("this directive is left out");
        if let Some(world_begin) = self.draft.world {
            diagnostic = diagnostic
                .with_note(world_begin, "the world begins here")
                .with_help(format!("move {keyword} before WorldBegin"));
        }
        self.diagnostics.push(diagnostic);
        false
    }
}

/// Transforms.
impl Builder {
    /// Records the warning that came with a matrix.
    fn warned(
        &mut self,
        result: Result<(DMat4, Option<Diagnostic>), Refused>,
    ) -> Result<DMat4, Refused> {
        let (matrix, warning) = result?;
        self.diagnostics.list.extend(warning);
        Ok(matrix)
    }

    fn multiply(&mut self, keyword: &str, span: Span, matrix: Result<DMat4, Refused>) {
        match matrix {
            Ok(matrix) => self.change_ctm(keyword, span, |ctm| ctm * matrix),
            Err(refused) => self.diagnostics.push(*refused),
        }
    }

    fn change_ctm(&mut self, keyword: &str, span: Span, change: impl Fn(DMat4) -> DMat4) {
        let pair = self.draft.ctm.changed(change);
        if transform::has_inverse(&pair.start) && transform::has_inverse(&pair.end) {
            self.draft.ctm.pair = pair;
        } else {
            self.diagnostics.push(
                Diagnostic::error(
                    "not-finite",
                    span,
                    format!("{keyword} makes the current transform overflow or collapse"),
                )
                .with_label("this transform is left out"),
            );
        }
    }

    fn coord_sys_transform(&mut self, name: &Spanned<String>) {
        match self.draft.coordinate_systems.get(&name.value) {
            Some((pair, _)) => self.draft.ctm.pair = *pair,
            None => {
                let known = self
                    .draft
                    .coordinate_systems
                    .iter()
                    .map(|(name, (_, span))| (name.as_str(), *span));
                let mut diagnostic = self.suggester.unknown(
                    "unknown-coordinate-system",
                    name,
                    "coordinate system",
                    known,
                );
                diagnostic.severity = Severity::Warning;
                self.diagnostics
                    .push(diagnostic.with_label("the current transform stays as it is"));
            }
        }
    }

    /// Warns that only the start of a motion is used.
    fn warn_if_animated(&mut self, what: &str, span: Span) {
        if self.draft.ctm.pair.is_animated() {
            self.diagnostics.push(
                Diagnostic::warning("animation-ignored", span, format!("{what} cannot move"))
                    .with_label("the transform at the start of the motion is used"),
            );
        }
    }
}

/// Blocks.
impl Builder {
    fn world_begin(&mut self, span: Span) {
        self.draft.world = Some(span);
        self.draft.ctm = Default::default();
        self.draft
            .coordinate_systems
            .insert("world".to_owned(), (self.draft.ctm.pair, span));
    }

    fn world_end(&mut self, span: Span) {
        // What is still open is dropped, not restored: the state at the innermost point stays in force.
        for saved in &self.draft.saved_ctms {
            self.diagnostics.push(
                Diagnostic::warning(
                    "unclosed-block",
                    saved.span,
                    format!("{} without {}", saved.block.begin(), saved.block.end()),
                )
                .with_note(span, "the world ends here"),
            );
        }
        // pbrt-v3 makes the camera here, so it takes the medium from here.
        let camera_medium = self.media().outside;
        let draft = std::mem::take(&mut self.draft);
        let begin = draft.world.unwrap_or(span);
        let or_default = |entity: Option<Entity>, kind: &str| {
            entity.unwrap_or_else(|| default_entity(kind, begin))
        };
        let mut camera = draft.options.camera.unwrap_or_else(|| CameraEntity {
            entity: default_entity("perspective", begin),
            world_from_camera: TransformPair {
                start: DMat4::IDENTITY,
                end: DMat4::IDENTITY,
            },
            medium: None,
        });
        camera.medium = camera_medium;
        self.frames.push(Frame {
            film: or_default(draft.options.film, "image"),
            filter: or_default(draft.options.filter, "box"),
            sampler: or_default(draft.options.sampler, "halton"),
            accelerator: or_default(draft.options.accelerator, "bvh"),
            integrator: or_default(draft.options.integrator, "path"),
            camera,
            transform_times: draft.options.transform_times.unwrap_or([0.0, 1.0]),
            media: draft.media,
            textures: draft.textures,
            materials: draft.materials,
            area_lights: draft.area_lights,
            lights: draft.lights,
            shapes: draft.shapes,
            objects: draft.objects,
            instances: draft.instances,
            span,
        });
    }

    /// `AttributeEnd`, and the half of `ObjectEnd` that is one.
    fn end_attributes(&mut self, block: Block, span: Span) {
        if self.draft.pop_graphics() {
            self.pop_ctm(block, span);
        } else {
            self.unmatched(block, span);
        }
    }

    fn transform_end(&mut self, span: Span) {
        if self.draft.saved_ctms.is_empty() {
            self.unmatched(Block::Transform, span);
        } else {
            self.pop_ctm(Block::Transform, span);
        }
    }

    fn unmatched(&mut self, block: Block, span: Span) {
        let message = format!("{} without {}", block.end(), block.begin());
        self.diagnostics.push(
            Diagnostic::error("unmatched-end", span, message)
                .with_label("this directive is left out"),
        );
    }

    /// Restores the transforms saved last, whichever kind of block saved them.
    fn pop_ctm(&mut self, block: Block, span: Span) {
        let Some(saved) = self.draft.saved_ctms.pop() else {
            // Crossed blocks have used up the transform that belongs here.
            let message = format!("no transform is left for {} to restore", block.end());
            self.diagnostics.push(
                Diagnostic::error("crossed-blocks", span, message)
                    .with_label("the current transform stays as it is"),
            );
            return;
        };
        self.draft.ctm = saved.ctm;
        if saved.block != block {
            self.diagnostics.push(
                Diagnostic::warning(
                    "crossed-blocks",
                    span,
                    format!("{} crosses {}", block.end(), saved.block.begin()),
                )
                .with_label("restores the transform saved last, as pbrt-v3 does")
                .with_note(saved.span, "that transform was saved here"),
            );
        }
    }
}

/// Entities.
impl Builder {
    fn entity(&mut self, plugin: Plugin, span: Span) -> Entity {
        let textures = bindings(&plugin.params, &self.draft, &mut self.suggester);
        Entity {
            kind: plugin.name,
            params: plugin.params,
            textures,
            span,
        }
    }

    /// The media in force, looked up now. Unknown ones are vacuum; each place is reported once.
    fn media(&mut self) -> MediumPair {
        let Some(interface) = self.draft.graphics.interface else {
            return MediumPair::default();
        };
        let names = &self.draft.interfaces[interface];
        let mut lookup = |name: &Spanned<String>| {
            if name.value.is_empty() {
                return None;
            }
            let medium = self.draft.named_media.get(&name.value).copied();
            if medium.is_none() && self.draft.reported_media.insert(name.span) {
                let known = self.draft.named_media.iter().map(|(name, medium)| {
                    (name.as_str(), self.draft.media[medium.0 as usize].name.span)
                });
                let diagnostic = self
                    .suggester
                    .unknown("unknown-medium", name, "medium", known);
                self.diagnostics
                    .push(diagnostic.with_label("vacuum is used instead"));
            }
            medium
        };
        MediumPair {
            inside: lookup(&names.inside),
            outside: lookup(&names.outside),
        }
    }

    fn camera(&mut self, plugin: Plugin, span: Span) {
        let ctm = self.draft.ctm.pair;
        let inverse = TransformPair {
            start: ctm.start.inverse(),
            end: ctm.end.inverse(),
        };
        // The limits of pbrt-v3 for a basis vector's squared length.
        let scaled = [inverse.start, inverse.end].iter().any(|matrix| {
            [matrix.x_axis, matrix.y_axis, matrix.z_axis]
                .iter()
                .any(|axis| !(0.999..=1.001).contains(&axis.truncate().length_squared()))
        });
        if scaled {
            self.diagnostics.push(
                Diagnostic::warning(
                    "scaled-camera",
                    span,
                    "the camera's transform contains a scale",
                )
                .with_help("undo it with Scale, or write the camera's distances in its own space"),
            );
        }
        self.draft
            .coordinate_systems
            .insert("camera".to_owned(), (inverse, span));
        let entity = self.entity(plugin, span);
        self.draft.options.camera = Some(CameraEntity {
            entity,
            world_from_camera: inverse,
            medium: None,
        });
    }

    fn make_named_medium(&mut self, plugin: Plugin, span: Span) {
        let Some(kind) = single_string(&plugin.params, "type") else {
            self.diagnostics.push(
                missing_type("MakeNamedMedium", &plugin.name).with_label("no medium is defined"),
            );
            return;
        };
        if let Err(mut diagnostic) = Family::Medium.lookup(&kind) {
            diagnostic.severity = Severity::Warning;
            self.diagnostics
                .push(diagnostic.with_label("no medium is defined"));
            return;
        }
        self.warn_if_animated("a medium", span);
        let name = plugin.name;
        let entity = self.entity(
            Plugin {
                name: kind,
                params: plugin.params,
            },
            span,
        );
        self.draft
            .named_media
            .insert(name.value.clone(), MediumRef(next(&self.draft.media)));
        self.draft.media.push(MediumEntity {
            name,
            entity,
            world_from_medium: self.draft.ctm.pair,
        });
    }

    fn texture(
        &mut self,
        name: Spanned<String>,
        value_type: &Spanned<String>,
        class: Plugin,
        span: Span,
    ) {
        let (value_type, family) = match value_type.value.as_str() {
            "float" => (TextureType::Float, Family::FloatTexture),
            "spectrum" | "color" => (TextureType::Spectrum, Family::SpectrumTexture),
            other => {
                let mut diagnostic = Diagnostic::error(
                    "unknown-texture-type",
                    value_type.span,
                    format!("there are no {other} textures"),
                )
                .with_label("no texture is defined");
                diagnostic.help = schema::did_you_mean(other, ["float", "spectrum", "color"])
                    .or_else(|| Some("known: float, spectrum, color".to_owned()));
                self.diagnostics.push(diagnostic);
                return;
            }
        };
        if let Err(mut diagnostic) = family.lookup(&class.name) {
            diagnostic.severity = Severity::Warning;
            if Family::SpectrumTexture.find(&class.name.value).is_some() {
                diagnostic.help = Some("this class has spectrum textures only".to_owned());
            }
            self.diagnostics
                .push(diagnostic.with_label("no texture is defined"));
            return;
        }
        self.warn_if_animated("a texture", span);
        let entity = self.entity(class, span);
        let texture = TextureRef(next(&self.draft.textures));
        let names = match value_type {
            TextureType::Float => &mut self.draft.float_textures,
            TextureType::Spectrum => &mut self.draft.spectrum_textures,
        };
        if let Some(before) = names.define(&name.value, texture) {
            let before = self.draft.textures[before.0 as usize].name.span;
            self.diagnostics.push(redefined("texture", &name, before));
        }
        let world_from_texture = self.draft.ctm.pair;
        self.draft.textures.push(TextureEntity {
            name,
            value_type,
            entity,
            world_from_texture,
        });
    }

    /// Stores a material; `plugin` is named by its kind.
    fn material(
        &mut self,
        name: Option<Spanned<String>>,
        mut plugin: Plugin,
        span: Span,
    ) -> MaterialRef {
        if let Err(mut diagnostic) = Family::Material.lookup(&plugin.name) {
            diagnostic.severity = Severity::Warning;
            self.diagnostics
                .push(diagnostic.with_label("matte is used instead"));
            plugin.name.value = "matte".to_owned();
        }
        let materials = if plugin.name.value == "mix" {
            self.mixed_materials(&plugin)
        } else {
            Vec::new()
        };
        let entity = self.entity(plugin, span);
        let material = MaterialRef(next(&self.draft.materials));
        self.draft.materials.push(MaterialEntity {
            name,
            entity,
            materials,
        });
        material
    }

    /// The materials that a `mix` names.
    fn mixed_materials(&mut self, plugin: &Plugin) -> Vec<(usize, Option<MaterialRef>)> {
        let mut materials = Vec::new();
        for key in ["namedmaterial1", "namedmaterial2"] {
            let index = plugin.params.params.iter().position(|param| {
                param.name == key
                    && matches!(&param.value, ParamValue::String(values) if values.len() == 1)
            });
            match (index, single_string(&plugin.params, key)) {
                (Some(index), Some(name)) => {
                    materials.push((index, self.find_material(&name, "matte is used instead")))
                }
                _ => self.diagnostics.push(
                    Diagnostic::error(
                        "missing-parameter",
                        plugin.name.span,
                        format!("a mix needs \"string {key}\""),
                    )
                    .with_label("matte is used instead"),
                ),
            }
        }
        materials
    }

    /// A named material, or an error that says what is done without it.
    fn find_material(&mut self, name: &Spanned<String>, instead: &str) -> Option<MaterialRef> {
        let material = self.draft.named_materials.get(&name.value);
        if material.is_none() {
            let known = self.draft.named_materials.values().filter_map(|material| {
                let name = self.draft.materials[material.0 as usize].name.as_ref()?;
                Some((name.value.as_str(), name.span))
            });
            let diagnostic =
                self.suggester
                    .unknown("unknown-material", name, "named material", known);
            self.diagnostics.push(diagnostic.with_label(instead));
        }
        material
    }

    fn make_named_material(&mut self, plugin: Plugin, span: Span) {
        let kind = single_string(&plugin.params, "type").unwrap_or_else(|| {
            self.diagnostics.push(
                missing_type("MakeNamedMaterial", &plugin.name)
                    .with_label("this name is a boundary without a surface"),
            );
            Spanned::new(String::new(), plugin.name.span)
        });
        let name = plugin.name;
        let material = self.material(
            Some(name.clone()),
            Plugin {
                name: kind,
                params: plugin.params,
            },
            span,
        );
        if let Some(before) = self.draft.named_materials.define(&name.value, material)
            && let Some(before) = &self.draft.materials[before.0 as usize].name
        {
            self.diagnostics
                .push(redefined("material", &name, before.span));
        }
    }

    fn named_material(&mut self, plugin: &Plugin) {
        for param in &plugin.params.params {
            self.diagnostics.push(
                Diagnostic::warning(
                    "unused-parameter",
                    param.decl_span,
                    format!("\"{}\" has no effect", param.name),
                )
                .with_label("NamedMaterial takes no parameters"),
            );
        }
        if let Some(material) = self.find_material(&plugin.name, "the material stays as it is") {
            self.draft.graphics.material = material;
        }
    }

    fn light_source(&mut self, plugin: Plugin, span: Span) {
        self.warn_if_animated("a light", span);
        let medium = self.media().outside;
        let entity = self.entity(plugin, span);
        self.draft.lights.push(LightEntity {
            entity,
            world_from_light: self.draft.ctm.pair,
            medium,
        });
    }

    fn area_light_source(&mut self, plugin: Plugin, span: Span) {
        // pbrt-v3 marks "no area light" by an empty name.
        if plugin.name.value.is_empty() {
            self.draft.graphics.area_light = None;
            return;
        }
        self.draft.graphics.area_light = Some(AreaLightRef(next(&self.draft.area_lights)));
        let entity = self.entity(plugin, span);
        self.draft.area_lights.push(entity);
    }
}

/// Shapes and objects.
impl Builder {
    fn shape(&mut self, plugin: Plugin, span: Span) {
        let graphics = self.draft.graphics;
        let material = &self.draft.materials[graphics.material.0 as usize].entity;
        let has_surface = !matches!(material.kind.value.as_str(), "" | "none");
        let private_material = (has_surface && seems_to_override_material(&plugin.params))
            .then(|| bindings(&material.params, &self.draft, &mut self.suggester));
        let area_light = graphics
            .area_light
            .filter(|light| self.may_emit(*light, span));
        let media = self.media();
        let shape = ShapeEntity {
            entity: self.entity(plugin, span),
            world_from_object: self.draft.ctm.pair,
            reverse_orientation: graphics.reverse_orientation,
            material: graphics.material,
            private_material,
            area_light,
            media,
        };
        match self.draft.object {
            Some(object) => self.draft.objects[object.0 as usize].shapes.push(shape),
            None => self.draft.shapes.push(shape),
        }
    }

    /// Whether a shape here emits; says where pbrt-v3 falls short of what the file asks for.
    fn may_emit(&mut self, light: AreaLightRef, span: Span) -> bool {
        let light_span = self.draft.area_lights[light.0 as usize].span;
        if self.draft.ctm.pair.is_animated() {
            self.diagnostics.push(
                Diagnostic::warning(
                    "animated-area-light",
                    span,
                    "a moving shape cannot be an area light",
                )
                .with_label("it emits nothing")
                .with_note(light_span, "the area light in force"),
            );
            return false;
        }
        if let Some(object) = self.draft.object
            && self.draft.reported_area_lights.insert(light)
        {
            let object = self.draft.objects[object.0 as usize].name.span;
            self.diagnostics.push(
                Diagnostic::warning("instanced-area-light", span, "an area light in an object")
                    .with_label("pbrt-v3 shows it, but lights nothing with it")
                    .with_note(light_span, "the area light in force")
                    .with_note(object, "the object"),
            );
        }
        true
    }

    fn object_begin(&mut self, name: Spanned<String>, span: Span) {
        self.draft.push_graphics(Block::Object, span);
        if let Some(outer) = self.draft.object {
            let outer = &self.draft.objects[outer.0 as usize].name;
            self.diagnostics.push(
                Diagnostic::error(
                    "nested-object",
                    span,
                    format!("ObjectBegin inside of object \"{}\"", outer.value),
                )
                .with_label("later shapes belong to the inner object, as in pbrt-v3")
                .with_note(outer.span, "the outer object begins here"),
            );
        }
        let object = ObjectRef(next(&self.draft.objects));
        self.draft.named_objects.insert(name.value.clone(), object);
        self.draft.objects.push(ObjectEntity {
            name,
            shapes: Vec::new(),
        });
        self.draft.object = Some(object);
    }

    fn object_end(&mut self, span: Span) {
        // An unmatched ObjectEnd still restores what the last block saved, as in pbrt-v3.
        if self.draft.object.take().is_none() && !self.draft.saved_graphics.is_empty() {
            self.diagnostics.push(
                Diagnostic::error("unmatched-end", span, "ObjectEnd outside of an object")
                    .with_label("acts as AttributeEnd"),
            );
        }
        self.end_attributes(Block::Object, span);
    }

    fn object_instance(&mut self, name: &Spanned<String>, span: Span) {
        if let Some(object) = self.draft.object {
            let object = &self.draft.objects[object.0 as usize].name;
            self.diagnostics.push(
                Diagnostic::error(
                    "nested-instance",
                    span,
                    format!("ObjectInstance inside of object \"{}\"", object.value),
                )
                .with_label("this directive is left out")
                .with_note(object.span, "the object begins here"),
            );
            return;
        }
        let Some(object) = self.draft.named_objects.get(&name.value).copied() else {
            let known = self.draft.named_objects.iter().map(|(name, object)| {
                (
                    name.as_str(),
                    self.draft.objects[object.0 as usize].name.span,
                )
            });
            let diagnostic = self
                .suggester
                .unknown("unknown-object", name, "object", known);
            self.diagnostics
                .push(diagnostic.with_label("nothing is placed"));
            return;
        };
        if self.draft.objects[object.0 as usize].shapes.is_empty() {
            return;
        }
        let world_from_instance = self.draft.ctm.pair;
        self.draft.instances.push(InstanceEntity {
            object,
            world_from_instance,
            span,
        });
    }
}

/// The index of the entry that is pushed next.
fn next<T>(list: &[T]) -> u32 {
    // Each entry took at least one byte of a file whose offsets are u32.
    list.len() as u32
}

/// What the texture parameters of a list refer to at this point.
fn bindings(params: &ParamList, draft: &Draft, suggester: &mut Suggester) -> Vec<TextureBinding> {
    let mut bindings = Vec::new();
    for (index, param) in params.params.iter().enumerate() {
        let ParamValue::Texture(name) = &param.value else {
            continue;
        };
        let float = draft.float_textures.get(name);
        let spectrum = draft.spectrum_textures.get(name);
        let near_miss = if float.is_none() && spectrum.is_none() {
            let names = draft
                .float_textures
                .values()
                .chain(draft.spectrum_textures.values());
            let known = names.map(|texture| {
                let name = &draft.textures[texture.0 as usize].name;
                (name.value.as_str(), name.span)
            });
            suggester
                .nearest(name, known)
                .map(|(name, span)| Box::new(Spanned::new(name.to_owned(), span)))
        } else {
            None
        };
        bindings.push(TextureBinding {
            param: index,
            float,
            spectrum,
            near_miss,
        });
    }
    bindings
}

/// The one value of a string parameter, at its place.
fn single_string(params: &ParamList, name: &str) -> Option<Spanned<String>> {
    params.params.iter().find_map(|param| match &param.value {
        ParamValue::String(values) if param.name == name => match values.as_slice() {
            [value] => Some(Spanned::new(value.clone(), param.value_span)),
            _ => None,
        },
        _ => None,
    })
}

fn missing_type(keyword: &str, name: &Spanned<String>) -> Diagnostic {
    Diagnostic::error(
        "missing-parameter",
        name.span,
        format!("{keyword} needs \"string type\" with one value"),
    )
}

fn redefined(what: &str, name: &Spanned<String>, before: Span) -> Diagnostic {
    Diagnostic::warning(
        "redefined",
        name.span,
        format!("{what} \"{}\" is defined again", name.value),
    )
    .with_label("later uses mean this one")
    .with_note(before, "it is defined here first")
}

/// pbrt-v3's guess whether a shape overrides parameters of its material: it does not know their names.
fn seems_to_override_material(shape: &ParamList) -> bool {
    shape.params.iter().any(|param| {
        let name = param.name.as_str();
        let exempt = match &param.value {
            ParamValue::Texture(_) => matches!(name, "alpha" | "shadowalpha"),
            ParamValue::Float(_) => name == "radius",
            ParamValue::String(_) => matches!(name, "filename" | "type" | "scheme"),
            _ => false,
        };
        !exempt && schema::count_of(&param.value) == 1
    })
}
