//! Directives that open and close blocks: world, attributes, transforms.

use super::Builder;
use crate::describe::description::{CameraEntity, Entity, Frame, TransformPair};
use crate::describe::state::{Block, CoordinateSystem, Ctm, default_entity};
use glam::DMat4;
use tyndall_parser::diagnostic::Diagnostic;
use tyndall_parser::source::Span;

impl Builder {
    pub(super) fn world_begin(&mut self, span: Span) {
        self.draft.world = Some(span);
        self.draft.allowed.clear();
        self.draft.ctm = Ctm::default();
        let system = CoordinateSystem {
            pair: self.draft.ctm.pair(),
            flaws: None,
            span,
        };
        self.draft
            .coordinate_systems
            .insert("world".to_owned(), system);
    }

    pub(super) fn world_end(&mut self, span: Span) {
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
        self.report_idle_matrices();
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
    pub(super) fn end_attributes(&mut self, block: Block, span: Span) {
        if self.draft.pop_graphics() {
            self.pop_ctm(block, span);
        } else {
            self.unmatched(block, span);
        }
    }

    pub(super) fn transform_end(&mut self, span: Span) {
        if self.draft.saved_ctms.is_empty() {
            self.unmatched(Block::Transform, span);
        } else {
            self.pop_ctm(Block::Transform, span);
        }
    }

    pub(super) fn unmatched(&mut self, block: Block, span: Span) {
        let message = format!("{} without {}", block.end(), block.begin());
        self.diagnostics.push(
            Diagnostic::error("unmatched-end", span, message)
                .with_label("this directive is left out"),
        );
    }

    /// Restores the transforms saved last, whichever kind of block saved them.
    pub(super) fn pop_ctm(&mut self, block: Block, span: Span) {
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
