//! Shapes as scenes ask for them: sides, findings, and what an emitter lights.

use std::f64::consts::PI;

use tyndall::camera::CameraSample;
use tyndall::compile::{CompileOptions, Compiled, NoAssets, compile};
use tyndall::describe::describe;
use tyndall::light::Wanted;
use tyndall::math::{Normal3, Vec3};
use tyndall::render::Job;
use tyndall::shape::SurfacePoint;
use tyndall::world::Receiver;
use tyndall_parser::diagnostic::Style;
use tyndall_parser::source::Sources;
use tyndall_parser::{NoIncludes, parse};
use tyndall_test_support::Uniform;
use tyndall_test_support::z_test::Mean;

use super::copies::{direction, ray};

/// Compiles a world seen by an `eye` that looks at the origin. The codes of the findings in order.
fn compiled(eye: [f64; 3], world: &str) -> (Compiled, Vec<&'static str>) {
    let [x, y, z] = eye;
    let sky = if world.contains("AreaLightSource") {
        ""
    } else {
        "LightSource \"infinite\"\n"
    };
    let text = format!(
        "LookAt {x} {y} {z} 0 0 0 0.1 0.2 1\nCamera \"perspective\"\n\
         Film \"image\" \"integer xresolution\" 1 \"integer yresolution\" 1\n\
         WorldBegin\n{sky}{world}\nWorldEnd\n"
    );
    let mut sources = Sources::new();
    let root = sources.add_text("scene", text.into_bytes());
    let (file, mut findings) = parse(&mut sources, root, &NoIncludes);
    let (scene, more) = describe(file);
    findings.extend(more);
    let frame = scene.frames.into_iter().next().expect("a frame");
    let (compiled, more) = compile(frame, &CompileOptions::default(), &NoAssets);
    findings.extend(more);
    let codes = findings.list.iter().map(|found| found.code).collect();
    for found in &findings.list {
        assert!(found.span.is_some(), "{} has no place", found.message);
    }
    (compiled.expect("something to render"), codes)
}

/// What the eye sees in the middle: the surface, and whether its normal is on this side.
fn seen(eye: [f64; 3], world: &str) -> Option<(SurfacePoint, bool)> {
    seen_beside(&[], eye, world)
}

/// The same in a world about which there are these findings.
fn seen_beside(expected: &[&str], eye: [f64; 3], world: &str) -> Option<(SurfacePoint, bool)> {
    let (compiled, findings) = compiled(eye, world);
    assert_eq!(findings, expected, "{world}");
    let middle = CameraSample {
        raster: [0.5, 0.5],
        time: 0.0,
        lens: [0.5, 0.5],
    };
    let Job { world, camera, .. } = &compiled.job;
    let ray = camera.ray(&middle).expect("a pinhole").ray;
    let hit = world.closest(&ray, f32::INFINITY)?;
    let surface = world.surface(&ray, &hit);
    let faces = surface.ng.dot(ray.d) < 0.0;
    Some((surface, faces))
}

const SQUARE: &str = "\"point P\" [-1 -1 0  1 -1 0  1 1 0  -1 1 0] \
                      \"integer indices\" [0 1 2  0 2 3]";

/// A quarter of a cylinder of radius 1 about the x axis, over z > 0, as a rational patch, u along y.
const VAULT: &str = "\"integer nu\" 3 \"integer nv\" 2 \"integer uorder\" 3 \"integer vorder\" 2 \
    \"float uknots\" [2 2 2 4 4 4] \"float vknots\" [0 0 1 1]";

fn vault() -> String {
    // (x, y, z, w) with the weights multiplied in: the middle one is cos 45 degrees.
    let s = std::f64::consts::FRAC_1_SQRT_2;
    let row = |x: f64| format!("{x} {} {s} 1  {} 0 1 {s}  {x} {s} {s} 1  ", -s, x * s);
    format!(
        "Shape \"nurbs\" {VAULT} \"float Pw\" [{}{}]",
        row(1.0),
        row(-1.0)
    )
}

#[test]
fn sides_follow_orientation_and_mirrors_as_in_pbrt() {
    let above = [0.3, 0.2, 5.0];
    let aside = [5.0, 0.1, 0.2];
    let vault = vault();
    let loops = format!("Shape \"loopsubdiv\" {SQUARE}");
    let field = "Translate -.5 -.5 0 Shape \"heightfield\" \"integer nu\" 2 \"integer nv\" 2 \
                 \"float Pz\" [0 0 0 0]";
    let hyperboloid = "Shape \"hyperboloid\" \"point3 p1\" [1 0 -1] \"point3 p2\" [0.5 1 1]";
    let downward = "Shape \"hyperboloid\" \"point3 p1\" [0.5 1 1] \"point3 p2\" [1 0 -1]";
    let ending_at_0 =
        "Translate 0 0 -.5 Shape \"hyperboloid\" \"point3 p1\" [1 0 1] \"point3 p2\" [1 0 0]";
    // Name, eye, shape, whether its normal faces the eye, whether mirrors turn it.
    let cases = [
        (aside, "Shape \"cylinder\"", true, true),
        (aside, "Translate 0 0 -.5 Shape \"cone\"", true, true),
        (aside, "Translate 0 0 -.5 Shape \"paraboloid\"", true, true),
        (aside, hyperboloid, true, true),
        (aside, downward, false, true),
        (aside, ending_at_0, true, true),
        (above, "Shape \"disk\"", true, true),
        (above, field, true, false),
        (above, &loops, false, false),
        (above, &vault, true, false),
    ];
    for (eye, shape, faces, mirrors_turn) in cases {
        for reverse in [false, true] {
            for mirror in [false, true] {
                let mut world = String::from("Material \"matte\"\n");
                if reverse {
                    world += "ReverseOrientation\n";
                }
                if mirror {
                    world += "Scale 1 -1 1\n";
                }
                world += shape;
                let Some((surface, is_facing)) = seen(eye, &world) else {
                    panic!("{world}: nothing there");
                };
                let expected = (faces != reverse) != (mirror && mirrors_turn);
                assert_eq!(is_facing, expected, "{world}: {:?}", surface.ng);
            }
        }
    }
}

#[test]
fn the_scene_of_all_shapes_is_without_findings() {
    let text = include_str!("../../../assets/pbrt-v3-scenes-subset/shapes/shapes.pbrt");
    let mut sources = Sources::new();
    let root = sources.add_text("shapes.pbrt", text.as_bytes().to_vec());
    let (file, mut findings) = parse(&mut sources, root, &NoIncludes);
    let (scene, more) = describe(file);
    findings.extend(more);
    for frame in scene.frames {
        findings.extend(compile(frame, &CompileOptions::default(), &NoAssets).1);
    }
    assert!(
        findings.is_empty(),
        "{}",
        findings.render(&sources, Style::Plain)
    );
}

#[test]
fn a_rational_patch_is_an_exact_cylinder_with_raw_parameters() {
    for x in [-0.5, 0.0, 0.4] {
        let eye = [x, 0.3, 5.0];
        let (surface, _) = seen(eye, &vault()).expect("the vault is there");
        assert!((2.0..=4.0).contains(&surface.uv[0]), "{:?}", surface.uv);
        assert!((0.0..=1.0).contains(&surface.uv[1]), "{:?}", surface.uv);
        // The normal of a cylinder about x has no x and points to or from the axis.
        assert!(
            surface
                .ns
                .dot(tyndall::math::Vec3::new(1.0, 0.0, 0.0))
                .abs()
                < 1e-3
        );
    }
}

#[test]
fn g09_triangles_without_area_are_left_out_with_one_warning() {
    let mesh = |indices: &str| {
        let points = "\"point P\" [-2 -2 0  2 -2 0  0 2 0  0 -2 0  1e-30 -2 0  0 -2 1e-30]";
        format!("Shape \"trianglemesh\" {points} \"integer indices\" [{indices}]")
    };
    let eye = [0.1, 0.2, 5.0];
    // Equal corners, a repeated index, a line, a sliver that single precision holds.
    let (with, findings) = compiled(eye, &mesh("0 1 2  3 3 3  0 0 1  0 3 1  3 4 5"));
    assert_eq!(findings, ["no-area"]);
    let (without, findings) = compiled(eye, &mesh("0 1 2"));
    assert!(findings.is_empty());
    let mut random = Uniform::new(1);
    for _ in 0..10_000 {
        let target = direction(&mut random);
        let ray = ray(glam::DVec3::new(0.0, 0.0, 0.9), target);
        let [a, b] = [&with, &without].map(|scene| scene.job.world.closest(&ray, f32::INFINITY));
        assert_eq!(a.map(|hit| hit.at), b.map(|hit| hit.at));
    }
}

#[test]
fn g10_triangles_without_area_are_never_chosen_as_lights() {
    let world = "AreaLightSource \"diffuse\" Shape \"trianglemesh\" \"point P\" [-2 -2 0  2 -2 0  0 2 0] \
                 \"integer indices\" [0 0 0  0 1 2  1 1 2]";
    let (compiled, findings) = compiled([0.1, 0.2, 5.0], world);
    assert_eq!(findings, ["no-area"]);
    let at = Receiver {
        p: tyndall::math::Point3::new(0.1, 0.1, 0.5),
        p_err: Vec3::ZERO,
        ng: Normal3::ZERO,
        wanted: Wanted::All,
        time: 0.0,
    };
    let mut random = Uniform::new(1);
    for _ in 0..10_000 {
        let u_light = f64::from(random.unit());
        let sample = compiled
            .job
            .world
            .sample_light(&at, u_light, random.unit2());
        let sample = sample.expect("the one triangle that is there");
        assert!(sample.pdf.is_finite() && sample.pdf > 0.0);
    }
    // Nothing else there: nothing emits, and nothing panics.
    let world = world.replace("0 0 0  0 1 2  1 1 2", "0 0 0");
    let (compiled, _) = self::compiled([0.1, 0.2, 5.0], &world);
    for k in 0..100 {
        let u = f64::from(k) / 100.0;
        assert!(compiled.job.world.sample_light(&at, u, [0.5; 2]).is_none());
    }
}

#[test]
fn g11_g12_vertices_that_are_no_numbers_take_their_triangles_with_them() {
    for bad in ["1e400", "-1e400", "1e39"] {
        let world = format!(
            "Shape \"trianglemesh\" \"point P\" [-2 -2 0  2 -2 0  0 2 0  0 3 {bad}] \
             \"integer indices\" [0 1 2  1 2 3]"
        );
        let (compiled, findings) = compiled([0.1, 0.2, 5.0], &world);
        assert!(!findings.is_empty(), "{bad}");
        let bounds = compiled.job.world.bounds();
        assert!(bounds.min.is_finite() && bounds.max.is_finite(), "{bad}");
        assert_eq!(
            compiled.job.world.n_elements(),
            1,
            "{bad}: the other one is there"
        );
    }
}

#[test]
fn g12_g18_g19_transforms_that_cannot_be_are_located_and_left_out() {
    for (directive, code) in [
        ("Translate nan 0 0", "not-finite"),
        ("Translate 1e400 0 0", "not-finite"),
        ("Scale 0 1 1", "singular-transform"),
        ("Scale 1 1 0", "singular-transform"),
        ("Rotate 30 0 0 0", "zero-axis"),
        ("LookAt 1 2 3 1 2 3 0 1 0", "degenerate-look-at"),
        ("LookAt 0 0 0 0 0 1 0 0 1", "degenerate-look-at"),
    ] {
        for shape in [
            "\"sphere\"",
            "\"trianglemesh\" \"point P\" [-2 -2 0  2 -2 0  0 2 0] \"integer indices\" [0 1 2]",
        ] {
            let (compiled, findings) =
                compiled([0.1, 0.2, 5.0], &format!("{directive} Shape {shape}"));
            assert!(findings.contains(&code), "{directive}: {findings:?}");
            let bounds = compiled.job.world.bounds();
            assert!(bounds.is_empty() || bounds.extent().is_finite());
        }
    }
    let light = "\"distant\" \"point from\" [1 2 3] \"point to\" [1 2 3]";
    let world = format!("LightSource {light} Shape \"sphere\"");
    assert_eq!(compiled([0.1, 0.2, 5.0], &world).1, ["bad-light"]);
}

#[test]
fn faces_for_ptex_are_those_of_their_triangles() {
    let ptex = "Texture \"fur\" \"float\" \"ptex\" \"string filename\" \"fur.ptx\"";
    // The first triangle has a corner that is nowhere.
    let points = "\"point P\" [nan 0 0  -2 -2 0  2 -2 0  0 2 0] \"integer indices\" [0 1 2  1 2 3]";
    let corner = &["bad-vertex"][..];
    for (before, faces, face, findings) in [
        (ptex, "5 7", 7, corner),
        ("", "5 7", 0, corner),
        (ptex, "7", 0, &["value-count", "bad-vertex"]),
        (ptex, "5 -7", -7, corner),
    ] {
        let world =
            format!("{before} Shape \"trianglemesh\" {points} \"integer faceIndices\" [{faces}]");
        let (surface, _) = seen_beside(findings, [0.1, 0.2, 5.0], &world).expect("a hit");
        assert_eq!(surface.face as i32, face, "{faces}");
    }
    let points = "\"point P\" [-2 -2 0  2 -2 0  0 2 0] \"integer indices\" [0 1 2]";
    for (faces, codes) in [("7", &[][..]), ("7 8", &["value-count"])] {
        let world = format!("Shape \"trianglemesh\" {points} \"integer faceIndices\" [{faces}]");
        assert_eq!(compiled([0.1, 0.2, 5.0], &world).1, codes, "{faces}");
    }
}

#[test]
fn g22_normals_without_direction_give_way_to_the_face() {
    let mesh = |normals: &str| {
        format!(
            "Shape \"trianglemesh\" \"point P\" [-2 -2 0  2 -2 0  0 2 0] \
             \"integer indices\" [0 1 2] \"normal N\" [{normals}]"
        )
    };
    let (surface, faces) = seen([0.1, 0.2, 5.0], &mesh("0 0 0  0 0 0  0 0 0")).expect("a hit");
    assert!(faces && surface.ns == surface.ng && surface.ns.is_finite());
}

#[test]
fn wrong_curves_are_reported() {
    let points = "\"point P\" [0 0 0  1 0 0  1 1 0  2 1 0]";
    for (rest, codes) in [
        (points, &[][..]),
        ("\"point P\" [0 0 0  1 0 0  1 1 0]", &["value-count"]),
        (
            "\"point P\" [0 0 0  1 0 0  1 1 0] \"integer degree\" 2",
            &[],
        ),
        (
            "\"point P\" [0 0 0  1 0 0  1 1 0  2 2 2  3 3 3] \"string basis\" \"bspline\"",
            &[],
        ),
        (
            "\"point P\" [0 0 0  1 0 0] \"string basis\" \"bspline\" \"integer degree\" 2",
            &["value-count"],
        ),
        ("", &["missing-parameter"]),
        (
            "\"point P\" [0 0 0  1 0 0  1 1 0  2 1e39 0]",
            &["bad-vertex"],
        ),
        ("\"point P\" [1 1 1  1 1 1  1 1 1  1 1 1]", &["no-area"]),
    ] {
        let world = format!("Shape \"curve\" {rest}");
        assert_eq!(compiled([0.1, 0.2, 5.0], &world).1, codes, "{world}");
    }
    for (rest, codes) in [
        ("\"string type\" \"ribbon\"", &["value-count"][..]),
        (
            "\"string type\" \"ribbon\" \"normal N\" [0 0 1  0 1 1]",
            &[],
        ),
        (
            "\"string type\" \"ribbon\" \"normal N\" [0 0 1  0 0 0]",
            &["value-count"],
        ),
        ("\"normal N\" [0 0 1  0 1 1]", &["unused-parameter"]),
        ("\"string type\" \"round\"", &["unknown-choice"]),
        ("\"string basis\" \"nurbs\"", &["unknown-choice"]),
        ("\"integer degree\" 4", &["unknown-choice"]),
        ("\"float width\" 0", &["no-area"]),
        ("\"float width0\" -1", &["out-of-range"]),
        ("\"integer splitdepth\" 30", &["out-of-range"]),
        ("\"float splitdepth\" 1", &[]),
    ] {
        let world = format!("Shape \"curve\" {points} {rest}");
        assert_eq!(compiled([0.1, 0.2, 5.0], &world).1, codes, "{world}");
    }
}

#[test]
fn g13_vertices_that_do_not_exist_are_reported() {
    for indices in ["0 1 200", "0 1 -5"] {
        let world = format!(
            "Shape \"trianglemesh\" \"point P\" [0 0 0  1 0 0  1 1 0] \"integer indices\" [{indices}] \
             Shape \"loopsubdiv\" \"point P\" [0 0 0  1 0 0  1 1 0  0 1 0] \
             \"integer indices\" [{indices}]"
        );
        assert_eq!(
            compiled([0.0, 0.0, 5.0], &world).1,
            ["bad-index"; 2],
            "{indices}"
        );
    }
}

#[test]
fn g14_what_is_not_a_surface_is_reported() {
    let points = "\"point P\" [0 0 0  1 0 0  0 1 0  0 0 1  0 -1 0]";
    for (indices, codes) in [
        ("0 1 2  1 0 3  0 1 4", &["not-a-surface"][..]),
        ("0 1 2  0 1 3", &["not-a-surface"]),
        ("0 1 1", &["not-a-surface"]),
        ("0 1 2  0 3 4", &[]),
        ("0 1 2  0 2 1", &[]),
        ("0 1 2  3", &["dangling-indices"]),
    ] {
        let world = format!("Shape \"loopsubdiv\" {points} \"integer indices\" [{indices}]");
        assert_eq!(compiled([0.0, 0.0, 5.0], &world).1, codes, "{indices}");
    }
}

#[test]
fn g15_degenerate_quadrics_terminate_and_say_so() {
    for (shape, codes) in [
        // The defaults sweep a cone.
        ("hyperboloid", &[][..]),
        (
            "hyperboloid\" \"point3 p1\" [1 2 3] \"point3 p2\" [1 2 3]",
            &["no-area"],
        ),
        (
            "hyperboloid\" \"point3 p1\" [0 0 1] \"point3 p2\" [0 0 3]",
            &["no-area"],
        ),
        (
            "hyperboloid\" \"point3 p1\" [1 0 0] \"point3 p2\" [-3 0 0]",
            &[],
        ),
        (
            "hyperboloid\" \"point3 p1\" [1 0 0] \"point3 p2\" [0 1 0]",
            &[],
        ),
        (
            "hyperboloid\" \"point3 p1\" [1e30 0 0] \"point3 p2\" [0 1e-30 1e-38]",
            &[],
        ),
        ("hyperboloid\" \"float phimax\" 0", &["no-area"]),
        ("cone\" \"float radius\" 0", &["no-area"]),
        ("cone\" \"float height\" 0", &[]),
        ("cone\" \"float height\" -1", &["no-area"]),
        ("cone\" \"float radius\" -1", &["out-of-range", "no-area"]),
        ("cylinder\" \"float radius\" 0", &["no-area"]),
        ("cylinder\" \"float zmin\" 1", &["no-area"]),
        ("cylinder\" \"float radius\" 1e38", &[]),
        ("paraboloid\" \"float zmax\" 0", &["no-area"]),
        ("paraboloid\" \"float zmin\" 1", &["no-area"]),
        ("paraboloid\" \"float radius\" 0", &["no-area"]),
        ("paraboloid\" \"float zmin\" -2 \"float zmax\" -1", &[]),
        ("sphere\" \"float radius\" 0", &["no-area"]),
        ("disk\" \"float radius\" 0", &["no-area"]),
    ] {
        let shape = if shape.contains('"') {
            shape.to_owned()
        } else {
            format!("{shape}\"")
        };
        let world = format!("Shape \"{shape}");
        assert_eq!(compiled([0.0, 0.0, 5.0], &world).1, codes, "{world}");
    }
}

#[test]
fn wrong_heights_and_patches_are_reported() {
    let field = "heightfield\" \"integer nu\" 2 \"integer nv\" 2";
    let knots = "\"float uknots\" [0 0 1 1] \"float vknots\" [0 0 1 1]";
    let size =
        "nurbs\" \"integer nu\" 2 \"integer nv\" 2 \"integer uorder\" 2 \"integer vorder\" 2";
    let points = "\"point P\" [0 0 0  1 0 0  0 1 0  1 1 0]";
    for (shape, codes) in [
        (format!("{field} \"float Pz\" [0 0 0 0]"), &[][..]),
        (format!("{field} \"float Pz\" [0 0 0]"), &["value-count"]),
        (field.to_owned(), &["missing-parameter"]),
        (format!("{size} {knots} {points}"), &[]),
        (
            format!("{size} {knots} {points} \"float u0\" 0.25 \"float u1\" 0.5"),
            &[],
        ),
        (
            format!("{size} {knots} {points} \"float u0\" -1"),
            &["out-of-range"],
        ),
        (format!("{size} {knots}"), &["missing-parameter"]),
        (
            format!("{size} {knots} \"float Pw\" [1 2 3 4 5]"),
            &["value-count"],
        ),
        (
            format!("{size} {knots} \"point P\" [0 0 0]"),
            &["value-count"],
        ),
        (
            format!("{size} {points} \"float uknots\" [0 0 1 1] \"float vknots\" [0 0 1]"),
            &["bad-knots"],
        ),
        (
            format!("{size} {points} \"float uknots\" [0 1 0 1] \"float vknots\" [0 0 1 1]"),
            &["bad-knots"],
        ),
        (
            format!("{size} {points} \"float uknots\" [0 1 1 1] \"float vknots\" [0 0 1 1]"),
            &["bad-knots"],
        ),
    ] {
        let world = format!("Shape \"{shape}");
        assert_eq!(compiled([0.5, 0.5, 5.0], &world).1, codes, "{world}");
    }
}

/// From inside, through an open end, and from the side, light that is sampled must be the light that is seen: a
/// surface hides its own far side, and nothing hides the point aimed at.
#[test]
fn l03_every_quadric_emits_what_is_seen_of_it() {
    let emitter = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" \"true\"\n\
                   Material \"matte\"";
    let mut random = Uniform::new(1);
    for shape in [
        "\"cylinder\"",
        "\"cone\"",
        "\"cone\" \"float phimax\" 200",
        "\"paraboloid\"",
        "\"hyperboloid\" \"point3 p1\" [1 0.1 -1] \"point3 p2\" [-0.6 0.7 1]",
        "\"hyperboloid\" \"point3 p1\" [1 0 -1] \"point3 p2\" [-1 0 1]",
    ] {
        let (compiled, findings) = compiled([0.0, 0.0, 5.0], &format!("{emitter} Shape {shape}"));
        assert!(findings.is_empty(), "{shape}: {findings:?}");
        let world = &compiled.job.world;
        let (center, size) = (world.bounds().center(), world.bounds().extent());
        for place in [
            [0.05, 0.1, 0.0],
            [0.1, 0.2, 1.5],
            [0.1, -0.2, -1.5],
            [1.5, 0.3, 0.4],
        ] {
            let offset = glam::Vec3A::from(place) * size;
            let at = Receiver {
                p: center + Vec3::new(offset.x, offset.y, offset.z),
                p_err: Vec3::ZERO,
                ng: Normal3::ZERO,
                wanted: Wanted::All,
                time: 0.0,
            };
            let n = 100_000;
            let by_samples = Mean::of(n, || {
                let sample = world.sample_light(&at, 0.5, random.unit2());
                let visible = sample.filter(|sample| !world.is_occluded(sample));
                visible.map_or(0.0, |sample| 1.0 / f64::from(sample.pdf))
            });
            let by_rays = Mean::of(n, || {
                let ray = ray(at.p.to_f64(), direction(&mut random));
                let is_hit = world.closest(&ray, f32::INFINITY).is_some();
                4.0 * PI * f64::from(u8::from(is_hit))
            });
            let error = by_samples.standard_error.hypot(by_rays.standard_error);
            assert!(
                (by_samples.value - by_rays.value).abs() < 4.5 * error,
                "{shape} from {place:?}: {by_samples:?} by samples, {by_rays:?} by rays"
            );
        }
    }
}
