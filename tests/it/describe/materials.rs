//! Textures and materials: where names are looked up, and what shapes make of them.

use tyndall::describe::description::{MaterialRef, TextureRef};
use tyndall_parser::diagnostic::Severity;
use tyndall_parser::directive::Directive;

use crate::describe::scene::{
    bool, codes, float, floats, frame, int, make_material, only, plugin, points, rgb, run, sphere,
    string, texture, texture_param, world,
};

#[test]
fn float_and_spectrum_textures_are_separate_and_resolved_where_they_are_used() {
    let frame = frame(world([
        texture("t", "float", "constant", []),
        texture("t", "color", "constant", []),
        Directive::Material(plugin("matte", [rgb("Ks", 1.0), texture_param("Kd", "t")])),
    ]));
    let binding = &frame.materials[1].entity.textures[0];
    assert_eq!(
        (binding.param, binding.float, binding.spectrum),
        (1, Some(TextureRef(0)), Some(TextureRef(1)))
    );
}

#[test]
fn textures_are_scoped_and_users_keep_the_one_they_were_made_with() {
    let (description, diagnostics) = run(world([
        texture("t", "float", "constant", [float("value", 1.0)]),
        Directive::AttributeBegin,
        Directive::Material(plugin("matte", [texture_param("sigma", "t")])),
        texture("t", "float", "constant", [float("value", 2.0)]),
        Directive::Material(plugin("matte", [texture_param("sigma", "t")])),
        Directive::AttributeEnd,
        Directive::Material(plugin("matte", [texture_param("sigma", "t")])),
    ]));
    let bound: Vec<_> = description.frames[0].materials[1..]
        .iter()
        .map(|m| m.entity.textures[0].float.unwrap().0)
        .collect();
    assert_eq!(bound, [0, 1, 0]);
    let finding = only(&diagnostics, "redefined");
    assert_eq!(
        (
            finding.severity,
            finding.span.unwrap().lo,
            finding.notes[0].0.lo
        ),
        (Severity::Warning, 410, 110)
    );
}

#[test]
fn a_texture_sees_only_earlier_textures() {
    let frame = frame(world([
        texture("a", "float", "scale", [texture_param("tex1", "b")]),
        texture("b", "float", "scale", [texture_param("tex1", "a")]),
    ]));
    assert_eq!(frame.textures[0].entity.textures[0].float, None);
    assert_eq!(
        frame.textures[1].entity.textures[0].float,
        Some(TextureRef(0))
    );
}

#[test]
fn an_unknown_texture_is_no_finding_here_but_leaves_its_near_miss() {
    let (description, diagnostics) = run(world([
        texture("wood", "spectrum", "constant", []),
        Directive::Material(plugin("matte", [texture_param("Kd", "woood")])),
    ]));
    assert_eq!(codes(&diagnostics), [""; 0]);
    let near = description.frames[0].materials[1].entity.textures[0]
        .near_miss
        .as_ref()
        .unwrap();
    assert_eq!((near.value.as_str(), near.span.lo), ("wood", 110));
}

#[test]
fn textures_that_cannot_be_are_reported_and_not_stored() {
    for (value_type, class, code, severity) in [
        ("float", "constnt", "unknown-plugin", Severity::Error),
        (
            "colour",
            "constant",
            "unknown-texture-type",
            Severity::Error,
        ),
        // Quirk 44, where pbrt-v3 is silent.
        ("float", "uv", "unknown-plugin", Severity::Error),
        ("float", "marble", "unknown-plugin", Severity::Error),
    ] {
        let (description, diagnostics) = run(world([texture("t", value_type, class, [])]));
        assert_eq!(only(&diagnostics, code).severity, severity);
        assert!(diagnostics.list[0].help.is_some());
        assert!(description.frames[0].textures.is_empty());
    }
}

#[test]
fn named_materials_are_scoped() {
    let (description, diagnostics) = run(world([
        Directive::AttributeBegin,
        make_material("steel", [string("type", "metal")]),
        Directive::NamedMaterial(plugin("steel", [])),
        sphere(),
        Directive::AttributeEnd,
        Directive::NamedMaterial(plugin("steel", [])),
        sphere(),
    ]));
    let shapes = &description.frames[0].shapes;
    assert_eq!(
        (shapes[0].material, shapes[1].material),
        (MaterialRef(1), MaterialRef(0))
    );
    assert_eq!(
        only(&diagnostics, "unknown-material").severity,
        Severity::Error
    );
}

#[test]
fn an_unknown_named_material_keeps_the_current_one_and_suggests() {
    let (description, diagnostics) = run(world([
        make_material("steel", [string("type", "metal")]),
        Directive::Material(plugin("mirror", [])),
        Directive::NamedMaterial(plugin("stel", [])),
        sphere(),
    ]));
    assert_eq!(description.frames[0].shapes[0].material, MaterialRef(2));
    let finding = only(&diagnostics, "unknown-material");
    assert_eq!(finding.span.unwrap().lo, 310);
    assert_eq!(finding.help.as_deref(), Some("did you mean \"steel\"?"));
    assert_eq!(finding.notes[0].0.lo, 110);
}

#[test]
fn redefining_a_named_material_warns_and_shapes_keep_theirs() {
    let (description, diagnostics) = run(world([
        make_material("m", [string("type", "metal")]),
        Directive::NamedMaterial(plugin("m", [])),
        make_material("m", [string("type", "glass")]),
        sphere(),
        Directive::NamedMaterial(plugin("m", [])),
        sphere(),
    ]));
    let shapes = &description.frames[0].shapes;
    assert_eq!(
        (shapes[0].material, shapes[1].material),
        (MaterialRef(1), MaterialRef(2))
    );
    assert_eq!(only(&diagnostics, "redefined").notes[0].0.lo, 110);
}

/// Quirk 9.
#[test]
fn q09_a_named_material_without_type_is_an_error_and_the_null_material() {
    let (description, diagnostics) = run(world([
        make_material("m", [rgb("Kd", 1.0)]),
        Directive::NamedMaterial(plugin("m", [])),
        sphere(),
    ]));
    assert_eq!(
        only(&diagnostics, "missing-parameter").severity,
        Severity::Error
    );
    let frame = &description.frames[0];
    assert_eq!(
        frame.materials[frame.shapes[0].material.0 as usize]
            .entity
            .kind
            .value,
        ""
    );
}

#[test]
fn the_null_material_goes_by_two_names() {
    let (description, diagnostics) = run(world([
        Directive::Material(plugin("", [])),
        Directive::Material(plugin("none", [])),
    ]));
    assert_eq!(codes(&diagnostics), [""; 0]);
    let kinds: Vec<_> = description.frames[0].materials[1..]
        .iter()
        .map(|m| m.entity.kind.value.as_str())
        .collect();
    assert_eq!(kinds, ["", "none"]);
}

#[test]
fn an_unknown_material_is_matte_with_a_suggestion() {
    let (description, diagnostics) = run(world([
        Directive::Material(plugin("gless", [rgb("Kd", 0.2)])),
        sphere(),
    ]));
    let finding = only(&diagnostics, "unknown-plugin");
    assert_eq!(finding.severity, Severity::Error);
    assert_eq!(finding.help.as_deref(), Some("did you mean \"glass\"?"));
    let material = &description.frames[0].materials[1].entity;
    assert_eq!(
        (material.kind.value.as_str(), material.params.params.len()),
        ("matte", 1)
    );
}

#[test]
fn a_mix_names_materials_where_it_is_made() {
    let (description, diagnostics) = run(world([
        make_material("a", [string("type", "metal")]),
        make_material(
            "m",
            [
                string("namedmaterial2", "a"),
                string("type", "mix"),
                string("namedmaterial1", "unknown thing"),
            ],
        ),
        make_material("a", [string("type", "glass")]),
        Directive::Material(plugin("mix", [string("namedmaterial1", "a")])),
    ]));
    let frame = &description.frames[0];
    assert_eq!(
        frame.materials[2].materials,
        [(2, None), (0, Some(MaterialRef(1)))]
    );
    assert_eq!(frame.materials[4].materials, [(0, Some(MaterialRef(3)))]);
    assert_eq!(
        codes(&diagnostics),
        ["unknown-material", "redefined", "missing-parameter"]
    );
}

#[test]
fn parameters_of_named_material_are_reported() {
    let (_, diagnostics) = run(world([
        make_material("m", [string("type", "metal")]),
        Directive::NamedMaterial(plugin("m", [float("roughness", 0.1)])),
    ]));
    assert_eq!(only(&diagnostics, "unused-parameter").span.unwrap().lo, 220);
}

/// Quirk 13.
#[test]
fn q13_a_shape_seems_to_override_its_material_by_what_it_carries() {
    for (params, private) in [
        (vec![], false),
        (vec![float("radius", 2.0)], false),
        (vec![float("zmin", -1.0)], true),
        (vec![floats("zmin", &[1.0, 2.0])], false),
        (
            vec![
                texture_param("alpha", "t"),
                texture_param("shadowalpha", "t"),
            ],
            false,
        ),
        (vec![texture_param("Kd", "t")], true),
        (
            vec![
                string("filename", "a.ply"),
                string("type", "flat"),
                string("scheme", "loop"),
            ],
            false,
        ),
        (vec![string("basis", "bezier")], true),
        (vec![int("levels", 3)], true),
        (vec![bool("remaproughness", true)], true),
        (vec![rgb("Kd", 0.5)], true),
        (vec![points("P", 1)], true),
        (vec![points("P", 3)], false),
    ] {
        let shape = Directive::Shape(plugin("sphere", params.clone()));
        let (description, _) = run(world([shape]));
        assert_eq!(
            description.frames[0].shapes[0].private_material.is_some(),
            private,
            "{params:?}"
        );
    }
}

/// Quirk 13: the textures of the copy are those visible at the shape.
#[test]
fn q13_a_private_material_sees_the_textures_at_the_shape() {
    let (description, _) = run(world([
        texture("t", "float", "constant", []),
        Directive::Material(plugin("matte", [texture_param("sigma", "t")])),
        texture("t", "float", "constant", []),
        Directive::Shape(plugin("sphere", [float("zmin", -0.5)])),
        sphere(),
    ]));
    let frame = &description.frames[0];
    assert_eq!(
        frame.materials[1].entity.textures[0].float,
        Some(TextureRef(0))
    );
    assert_eq!(
        frame.shapes[0].private_material.as_ref().unwrap()[0].float,
        Some(TextureRef(1))
    );
    assert_eq!(frame.shapes[1].private_material, None);
}

#[test]
fn material_parameters_are_stored_once_for_many_shapes() {
    let frame = frame(world([
        Directive::Material(plugin("matte", [rgb("Kd", 0.2)])),
        sphere(),
        sphere(),
        sphere(),
    ]));
    assert_eq!(frame.materials.len(), 2);
    assert!(
        frame
            .shapes
            .iter()
            .all(|shape| shape.material == MaterialRef(1))
    );
}

#[test]
fn meshes_are_moved_not_copied() {
    let mesh = points("P", 1000);
    let address = |value: &tyndall_parser::params::ParamValue| match value {
        tyndall_parser::params::ParamValue::Point3(items) => items.as_ptr(),
        _ => panic!(),
    };
    let before = address(&mesh.value);
    let (description, _) = run(world([Directive::Shape(plugin("trianglemesh", [mesh]))]));
    assert_eq!(
        address(&description.frames[0].shapes[0].entity.params.params[0].value),
        before
    );
}
