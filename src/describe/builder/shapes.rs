//! Shapes, objects and instances.

use super::Builder;
use super::entities::{bindings, next};
use crate::describe::description::{
    AreaLightRef, CompactPair, InstanceEntity, ObjectEntity, ObjectRef, ShapeEntity,
};
use crate::describe::state::Block;
use tyndall_parser::diagnostic::Diagnostic;
use tyndall_parser::directive::Plugin;
use tyndall_parser::params::{ParamList, ParamValue};
use tyndall_parser::source::{Span, Spanned};

impl Builder {
    pub(super) fn shape(&mut self, plugin: Plugin, span: Span) {
        if self.is_hidden("a shape", span) {
            return;
        }
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
            world_from_object: self.draft.ctm.pair(),
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
    pub(super) fn may_emit(&mut self, light: AreaLightRef, span: Span) -> bool {
        let light_span = self.draft.area_lights[light.0 as usize].span;
        if self.draft.ctm.is_animated() {
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

    pub(super) fn object_begin(&mut self, name: Spanned<String>, span: Span) {
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

    pub(super) fn object_end(&mut self, span: Span) {
        // An unmatched ObjectEnd still restores what the last block saved, as in pbrt-v3.
        if self.draft.object.take().is_none() && !self.draft.saved_graphics.is_empty() {
            self.diagnostics.push(
                Diagnostic::error("unmatched-end", span, "ObjectEnd outside of an object")
                    .with_label("acts as AttributeEnd"),
            );
        }
        self.end_attributes(Block::Object, span);
    }

    pub(super) fn object_instance(&mut self, name: &Spanned<String>, span: Span) {
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
        if self.is_hidden("an instance", span) {
            return;
        }
        let ctm = &self.draft.ctm;
        let world_from_instance = CompactPair::new(&ctm.start, ctm.end.as_deref());
        self.draft.instances.push(InstanceEntity {
            object,
            world_from_instance,
            span,
        });
    }
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
        !exempt && param.value.len() == 1
    })
}
