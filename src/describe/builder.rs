//! Follows the directives one by one.

use super::description::{Frame, SceneDescription};
use super::names::Suggester;
use super::state::{Block, Draft};
use super::transform;
use glam::DMat4;
use transforms::Change;
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics, Severity};
use tyndall_parser::directive::Directive;
use tyndall_parser::schema;
use tyndall_parser::source::{Span, Spanned};

mod blocks;
mod entities;
mod shapes;
mod transforms;

/// The frames finished so far and the one in the making: for directives that come one by one, see
/// [`describe`](super::describe) for all at once.
#[derive(Debug, Default)]
pub struct Builder {
    diagnostics: Diagnostics,
    suggester: Suggester,
    frames: Vec<Frame>,
    draft: Draft,
    /// The last directive met.
    last: Option<Span>,
}

impl Builder {
    /// Follows one directive.
    pub fn directive(&mut self, directive: Spanned<Directive>) {
        let Spanned {
            value: directive,
            span,
        } = directive;
        self.last = Some(span);
        // Scenes are long because a few kinds of directives come again and again.
        let kind = std::mem::discriminant(&directive);
        if !self.draft.allowed.contains(&kind) {
            if !self.may_stand_here(&directive, span) {
                return;
            }
            self.draft.allowed.push(kind);
        }
        match directive {
            Directive::Identity => {
                self.change_ctm("Identity", span, Change::Replace(DMat4::IDENTITY));
            }
            Directive::Translate(delta) => {
                self.multiply("Translate", span, transform::translate(delta, span))
            }
            Directive::Scale(factors) => {
                self.multiply("Scale", span, transform::scale(factors, span))
            }
            Directive::Rotate { degrees, axis } => {
                self.multiply("Rotate", span, transform::rotate(degrees, axis, span));
            }
            Directive::LookAt { eye, target, up } => self.look_at(eye, target, up, span),
            Directive::Transform(numbers) => self.transform(numbers, span),
            Directive::ConcatTransform(numbers) => self.concat_transform(numbers, span),
            Directive::CoordinateSystem(name) => self.coordinate_system(name),
            Directive::CoordSysTransform(name) => self.coord_sys_transform(&name),
            Directive::ActiveTransform(active) => self.draft.ctm.active = active,
            Directive::TransformTimes(times) => self.transform_times(times, span),
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
                self.medium_interface(inside, outside);
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
    pub fn finish(mut self) -> (SceneDescription, Diagnostics) {
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
        let keyword = directive.keyword();
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
