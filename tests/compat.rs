//! What `docs/compat.md` promises beside the pictures: where pbrt-v3's own light sampling is biased, loading says so.

#[path = "common/findings.rs"]
mod findings;

use findings::findings;

fn lamp(shape: &str) -> String {
    format!("WorldBegin AttributeBegin AreaLightSource \"diffuse\" {shape} AttributeEnd WorldEnd")
}

#[track_caller]
fn assert_warns(shape: &str, reason: &str) {
    let found = findings(&lamp(shape));
    let warned = found
        .iter()
        .any(|(code, message)| code == "biased-in-pbrt" && message.contains(reason));
    assert!(warned, "{shape}: {found:?}");
}

#[test]
fn row_19_mirrored_quadric_lights_are_announced() {
    assert_warns("Scale 1 1 -1 Shape \"sphere\"", "mirrored quadric");
}

#[test]
fn row_20_reversed_mesh_lights_with_normals_are_announced() {
    let mesh = "ReverseOrientation Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \
        \"normal N\" [0 0 1 0 0 1 0 0 1] \"integer indices\" [0 1 2]";
    assert_warns(mesh, "reversed mesh");
}

#[test]
fn row_24_scaled_sphere_lights_are_announced() {
    assert_warns("Scale .1 .1 .1 Shape \"sphere\"", "unscaled size");
}

#[test]
fn row_25_partial_quadric_lights_are_announced() {
    assert_warns("Shape \"sphere\" \"float phimax\" 180", "as the whole");
    assert_warns("Shape \"disk\" \"float innerradius\" 0.5", "as the whole");
}

#[test]
fn row_28_shapes_that_cast_no_shadow_are_announced_where_light_sampling_heeds_that() {
    let mesh = "Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2] \
        \"float shadowalpha\" 0";
    let announced = |integrator: &str| {
        let scene = format!("Integrator \"{integrator}\" WorldBegin {mesh} WorldEnd");
        let found = findings(&scene);
        let told = |(code, message): &(String, String)| {
            code == "biased-in-pbrt" && message.contains("shadow of this shape")
        };
        found.iter().any(told)
    };
    assert!(announced("path") && announced("directlighting"));
    assert!(!announced("volpath"), "it has no effect there");
}

#[test]
fn row_29_emitters_with_masks_are_announced() {
    let mesh = |alpha: &str| {
        format!(
            "Texture \"mask\" \"float\" \"checkerboard\" \"float tex1\" 0 \"float tex2\" 1 \
             Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2] {alpha}"
        )
    };
    assert_warns(&mesh("\"float alpha\" 0"), "alpha mask");
    assert_warns(&mesh("\"texture alpha\" \"mask\""), "alpha mask");
    let opaque = findings(&lamp(&mesh("\"float alpha\" 1")));
    assert!(opaque.iter().all(|(code, _)| code != "biased-in-pbrt"));
}

#[test]
fn row_58_emitters_without_a_material_are_announced() {
    assert_warns("Material \"none\" Shape \"sphere\"", "without a material");
}

#[test]
fn lights_that_pbrt_renders_right_are_not_announced() {
    for shape in [
        "Shape \"sphere\"",
        "Rotate 33 1 2 3 Translate 5 5 5 Shape \"disk\"",
    ] {
        let found = findings(&lamp(shape));
        assert!(
            found.iter().all(|(code, _)| code != "biased-in-pbrt"),
            "{found:?}"
        );
    }
}

/// Parameters of a material that only a shape names are checked like the material's own.
#[test]
fn a_bad_parameter_that_a_shape_overrides_is_reported_where_it_stands_and_once() {
    let codes = |world: &str| -> Vec<String> {
        let world = format!("WorldBegin LightSource \"infinite\" {world} WorldEnd");
        findings(&world).into_iter().map(|(code, _)| code).collect()
    };
    let metal = "Material \"metal\" \"bool remaproughness\" \"false\"";
    let shape = "Shape \"sphere\" \"float roughness\" 1e-6";
    assert_eq!(codes(&format!("{metal} {shape}")), ["clamped-roughness"]);
    let own =
        format!("{metal} \"float roughness\" 1e-6 Shape \"sphere\" Shape \"sphere\" \"float u\" 1");
    let roughness = codes(&own)
        .iter()
        .filter(|code| *code == "clamped-roughness")
        .count();
    assert_eq!(roughness, 1);
}

#[test]
fn integrators_tell_of_media_and_of_light_below_surfaces_that_they_leave_out() {
    let told = |integrator: &str, world: &str| {
        let scene = format!(
            "Integrator \"{integrator}\" WorldBegin LightSource \"infinite\" {world} WorldEnd"
        );
        let found = findings(&scene).into_iter();
        let told: Vec<String> = found
            .filter(|(code, _)| code == "ignored-scattering")
            .map(|(_, message)| message)
            .collect();
        assert!(
            told.iter().all(|message| message.contains(integrator)),
            "{told:?}"
        );
        told.len()
    };
    let fog = "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \
        MediumInterface \"fog\" \"\" Material \"\" Shape \"sphere\"";
    let bodies = [
        "\"subsurface\"",
        "\"kdsubsurface\"",
        "\"disney\" \"rgb scatterdistance\" [.1 .1 .1]",
    ]
    .map(|material| format!("Material {material} Shape \"sphere\""));
    let solid = "Material \"disney\" Shape \"sphere\"";
    for (integrator, ignores_media, ignores_depth) in [
        ("path", 1, 0),
        ("volpath", 0, 0),
        ("bdpt", 0, 1),
        ("mlt", 0, 1),
        ("sppm", 1, 1),
        ("directlighting", 1, 1),
        ("whitted", 1, 1),
        ("ambientocclusion", 1, 1),
    ] {
        assert_eq!(told(integrator, "Shape \"sphere\""), 0, "{integrator}");
        assert_eq!(told(integrator, solid), 0, "{integrator}: disney");
        assert_eq!(told(integrator, fog), ignores_media, "{integrator}: media");
        for body in &bodies {
            assert_eq!(
                told(integrator, body),
                ignores_depth,
                "{integrator}: {body}"
            );
        }
    }
}
