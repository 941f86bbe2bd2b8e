//! Bump mapping against closed forms.

use glam::{DAffine3, DMat3, DVec3, Vec2};
use tyndall::compile::CompileOptions;
use tyndall::ids::GeometryId;
use tyndall::material::bump::bumped;
use tyndall::math::{Normal3, Point3, Vec3};
use tyndall::shape::{Shape, SurfacePoint};
use tyndall::texture::{
    Bilerp, FloatSource, Mapping2, Source, Texture, TextureContext, Textures, UvMapping,
};

use crate::common::scene::compile_scene;
use crate::textures::at::{constant, uv};

/// The plane z = 0 where (u, v) = (x / 2, y / 4), seen at (0.6, 1.2).
fn plane() -> SurfacePoint {
    SurfacePoint {
        p: Point3::new(0.6, 1.2, 0.0),
        p_err: Vec3::ZERO,
        ng: Normal3::new(0.0, 0.0, 1.0),
        n_surface: Normal3::new(0.0, 0.0, 1.0),
        ns: Normal3::new(0.0, 0.0, 1.0),
        uv: [0.3, 0.3],
        dpdu: Vec3::new(2.0, 0.0, 0.0),
        dpdv: Vec3::new(0.0, 4.0, 0.0),
        tangent: Vec3::new(2.0, 0.0, 0.0),
        bitangent: Vec3::new(0.0, 4.0, 0.0),
        dndu: Vec3::ZERO,
        dndv: Vec3::ZERO,
        face: 0,
        dn_scale: 1.0,
    }
}

fn at(surface: &SurfacePoint) -> TextureContext {
    let [u, v] = surface.uv;
    TextureContext {
        p: surface.p,
        ..uv(u, v)
    }
}

/// Heights a u + b v.
fn slope(textures: &mut Textures, a: f32, b: f32) -> FloatSource {
    textures.add(Texture::Bilerp(Bilerp {
        mapping: Mapping2::Uv(UvMapping::IDENTITY),
        corners: [0.0, b, a, a + b],
    }))
}

/// Heights a x + b y + c z of the position.
fn slope_in_space(textures: &mut Textures, [a, b, c]: [f64; 3]) -> FloatSource {
    let rows = DMat3::from_cols(DVec3::new(a, b, c), DVec3::ZERO, DVec3::ZERO);
    textures.add(Texture::Bilerp(Bilerp {
        mapping: Mapping2::Planar {
            st_from_render: DAffine3::from_mat3(rows.transpose()),
        },
        corners: [0.0, 0.0, 1.0, 1.0],
    }))
}

#[track_caller]
fn assert_normal(actual: Normal3, expected: [f64; 3], what: &str) {
    let expected = DVec3::from(expected).normalize();
    let error = actual.to_f64().distance(expected);
    assert!(error < 2e-3, "{what}: {actual:?} is not {expected}");
}

#[test]
fn a_slope_tilts_the_normal_of_a_plane() {
    let surface = plane();
    let mut textures = Textures::default();
    let source = slope(&mut textures, 1.0, 2.0);
    // Height x/2 + y/2.
    let bumped_point = bumped(&surface, source, &at(&surface), &textures);
    assert_normal(bumped_point.ns, [-0.5, -0.5, 1.0], "by parameters");
    // The tangent follows the displaced surface, and the rest stays.
    let tangent = bumped_point.tangent;
    assert!((tangent.z() / tangent.x() - 0.5).abs() < 2e-3);
    assert_eq!(bumped_point.ng, surface.ng);
    assert_eq!(bumped_point.p, surface.p);
    let source = slope_in_space(&mut textures, [0.25, -1.0, 3.0]);
    let bumped_point = bumped(&surface, source, &at(&surface), &textures);
    assert_normal(bumped_point.ns, [-0.25, 1.0, 1.0], "by position");
}

#[test]
fn a_constant_height_changes_nothing_on_a_plane() {
    let surface = plane();
    let bumped = bumped(&surface, constant(3.0), &at(&surface), &Textures::default());
    assert_eq!(bumped.ns, surface.ns);
}

#[test]
fn heights_are_in_world_units() {
    // Render space half as large as the world: the same picture as the plane above.
    let mut surface = plane();
    surface.p = surface.p + (Point3::ZERO - surface.p) * 0.5;
    surface.dpdu *= 0.5;
    surface.dpdv *= 0.5;
    (surface.tangent, surface.bitangent) = (surface.dpdu, surface.dpdv);
    let mut textures = Textures::new(0.5);
    let source = slope(&mut textures, 1.0, 2.0);
    let bumped = bumped(&surface, source, &at(&surface), &textures);
    assert_normal(bumped.ns, [-0.5, -0.5, 1.0], "half size");
}

#[test]
fn normals_stay_on_the_side_of_the_surface() {
    for side in [1.0, -1.0] {
        let mut surface = plane();
        surface.ng = Normal3::new(0.0, 0.0, side);
        surface.ns = surface.ng;
        let mut textures = Textures::default();
        let source = slope(&mut textures, 1.0, 2.0);
        let bumped = bumped(&surface, source, &at(&surface), &textures);
        // Displaced toward the normal, whichever side that is.
        let side = f64::from(side);
        assert_normal(bumped.ns, [-0.5, -0.5, side], &format!("side {side}"));
    }
}

#[test]
fn a_curved_surface_bends_by_its_own_height() {
    // A cylinder of radius 2 around y, u the angle from z over 1 rad, at u = 0; height h(u, v) = h0 + a u.
    let (radius, h0, a) = (2.0, 0.5, 0.75);
    let surface = SurfacePoint {
        p: Point3::new(0.0, 0.0, radius),
        uv: [0.0, 0.0],
        dpdu: Vec3::new(radius, 0.0, 0.0),
        dpdv: Vec3::new(0.0, 1.0, 0.0),
        tangent: Vec3::new(radius, 0.0, 0.0),
        bitangent: Vec3::new(0.0, 1.0, 0.0),
        dndu: Vec3::new(1.0, 0.0, 0.0),
        ..plane()
    };
    let mut textures = Textures::default();
    let source = textures.add(Texture::Bilerp(Bilerp {
        mapping: Mapping2::Uv(UvMapping {
            scale: Vec2::ONE,
            delta: Vec2::ZERO,
        }),
        corners: [h0, h0, h0 + a, h0 + a],
    }));
    let bumped = bumped(&surface, source, &at(&surface), &textures);
    // The displaced curve (r + h)(sin u, cos u) runs along (r + h0, a) at u = 0.
    assert_normal(
        bumped.ns,
        [-f64::from(a), 0.0, f64::from(radius + h0)],
        "cylinder",
    );
}

#[test]
fn steps_are_half_the_footprint_so_that_fine_bumps_fade() {
    let surface = plane();
    let mut textures = Textures::default();
    // The difference quotient of a parabola h = u² tells the step: it is 2u + step.
    let ramp = slope(&mut textures, 1.0, 0.0);
    let parabola = textures.add(Texture::Scale(tyndall::texture::Scale {
        factors: [ramp, ramp],
    }));
    for (duv_dx, duv_dy, step) in [
        ([0.2, 0.0], [0.4, 0.0], 0.3),
        ([-0.2, 0.0], [0.0, 0.0], 0.1),
        ([0.0, 0.0], [0.0, 0.0], 0.0005),
    ] {
        let mut ctx = at(&surface);
        (ctx.duv_dx, ctx.duv_dy) = (duv_dx, duv_dy);
        let bumped = bumped(&surface, parabola, &ctx, &textures);
        let slope = 2.0 * 0.3 + step;
        assert_normal(bumped.ns, [-slope / 2.0, 0.0, 1.0], &format!("step {step}"));
    }
}

#[test]
fn meshes_with_frames_of_their_own_are_bumped_inward_by_their_unit() {
    // Tangents as meshes with normals have them: against u, one unit long.
    let mut surface = plane();
    surface.tangent = Vec3::new(-1.0, 0.0, 0.0);
    surface.bitangent = Vec3::new(0.0, -1.0, 0.0);
    let mut textures = Textures::default();
    let source = slope(&mut textures, 1.0, 2.0);
    let bumped = bumped(&surface, source, &at(&surface), &textures);
    assert_normal(bumped.ns, [1.0, 2.0, 1.0], "against u and v");
}

/// A square 6 wide and 3 high in the plane z = 0, (u, v) from 0 to 1.
fn square(normals: &str) -> String {
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [0 0 0 6 0 0 6 3 0 0 3 0] \
         \"float uv\" [0 0 1 0 1 1 0 1] {normals}"
    )
}

#[test]
fn frames_of_meshes_with_normals_are_one_unit_of_their_own_space_long() {
    const NORMALS: &str = "\"normal N\" [0 0 1 0 0 1 0 0 1 0 0 1]";
    // Width of the square in the space it was defined in, the side of v, and what an instance stretches.
    for (before, shape, frame) in [
        ("", square(""), None),
        ("", square(NORMALS), Some((6.0, 1.0, 1.0))),
        (
            "ReverseOrientation",
            square(NORMALS),
            Some((6.0, -1.0, 1.0)),
        ),
        ("Scale 8 8 8", square(NORMALS), Some((48.0, 1.0, 1.0))),
        (
            "",
            format!(
                "ObjectBegin \"o\" {} ObjectEnd Scale 4 4 4 ObjectInstance \"o\"",
                square(NORMALS)
            ),
            Some((6.0, 1.0, 4.0)),
        ),
        // An instance mirrors the frame, it does not make another.
        (
            "",
            format!(
                "ObjectBegin \"o\" {} ObjectEnd Scale -1 1 1 ObjectInstance \"o\"",
                square(NORMALS)
            ),
            Some((6.0, 1.0, 1.0)),
        ),
    ] {
        let scene = format!("WorldBegin LightSource \"infinite\" {before} {shape} WorldEnd");
        let job = compile_scene(scene, &CompileOptions::default(), |_| None).job;
        let geometry = job.world.geometry(GeometryId::new(0));
        let Shape::Mesh(mesh) = &geometry.shape else {
            panic!("a mesh");
        };
        let surface = mesh.surface(0, [0.2, 0.3]);
        let [dpdu, dpdv] = [surface.tangent, surface.bitangent];
        let Some((width, side, stretched)) = frame else {
            assert_eq!([dpdu, dpdv], [surface.dpdu, surface.dpdv]);
            continue;
        };
        let what = format!("{before}, {stretched}");
        let unit = surface.dpdu.to_f64().length() / width;
        let expected = [-surface.dpdu.to_f64(), -surface.dpdv.to_f64() * side];
        for (actual, expected) in [dpdu, dpdv].into_iter().zip(expected) {
            let expected = expected.normalize() * unit;
            let error = actual.to_f64().distance(expected);
            assert!(error < 1e-5 * unit, "{what}: {actual:?} is not {expected}");
        }
        // World units, as seen from render space, times what the instance does.
        let world = f64::from(job.world.textures().height(constant(1.0), &at(&surface)));
        assert!((unit - world * stretched).abs() < 1e-6 * unit, "{what}");
    }
}

#[test]
fn g26_extreme_displacements_keep_a_normal_on_its_side() {
    let mut textures = Textures::default();
    let good = slope(&mut textures, 1.0, 2.0);
    let infinite: FloatSource = Source::Constant(f32::INFINITY);
    let nan: FloatSource = Source::Constant(f32::NAN);
    let surface = plane();
    for source in [infinite, nan] {
        let bumped = bumped(&surface, source, &at(&surface), &textures);
        assert_eq!((bumped.ns, bumped.tangent), (surface.ns, surface.tangent));
    }
    for steep in [1e20, -1e20, 3e38] {
        let source = slope(&mut textures, steep, -steep);
        let bumped = bumped(&surface, source, &at(&surface), &textures);
        assert!(bumped.ns.is_finite() && bumped.ns.dot(surface.ng) >= 0.0);
        assert!(bumped.tangent.is_finite(), "{steep}");
    }
    let mut flat = plane();
    (flat.dpdu, flat.tangent) = (Vec3::ZERO, Vec3::ZERO);
    (flat.dpdv, flat.bitangent) = (Vec3::ZERO, Vec3::ZERO);
    let bumped_point = bumped(&flat, constant(0.0), &at(&flat), &textures);
    assert_eq!(bumped_point.ns, flat.ns);
    // Parameters without room for the step still give a normal.
    for u in [1e6, -1e12, f32::MAX, f32::NAN, f32::INFINITY] {
        let mut far = plane();
        far.uv = [u, u];
        let bumped = bumped(&far, good, &at(&far), &textures);
        assert!(bumped.ns.is_finite(), "{u}");
    }
}

#[test]
fn steps_far_out_are_what_the_parameters_change_by() {
    // At u = 10000 single precision has steps of a thousandth: 0.0005 would vanish or double.
    let mut surface = plane();
    surface.uv = [10_000.0, 0.0];
    let mut textures = Textures::default();
    let source = slope(&mut textures, 0.5, 0.0);
    let bumped = bumped(&surface, source, &at(&surface), &textures);
    assert_normal(bumped.ns, [-0.25, 0.0, 1.0], "far out");
}

#[test]
fn normals_of_meshes_change_as_pbrt_has_them_in_the_world() {
    // Normals (u, 0, 1) as written; a scale s leaves 1/s of them, and an orientation has no say.
    let shape = square("\"normal N\" [0 0 1 1 0 1 1 0 1 0 0 1]");
    let speck = "Shape \"sphere\" \"float radius\" .01";
    for (before, instance, scale, side) in [
        ("", false, 1.0, 1.0),
        ("ReverseOrientation", false, 1.0, -1.0),
        ("Scale 8 8 8", false, 8.0, 1.0),
        ("Scale 8 8 8", true, 8.0, 1.0),
        ("Translate 900 0 0", false, 1.0, 1.0),
    ] {
        let placed = if instance {
            format!("ObjectBegin \"o\" {shape} ObjectEnd {before} ObjectInstance \"o\"")
        } else {
            format!("AttributeBegin {before} {shape} AttributeEnd {speck}")
        };
        let scene = format!("WorldBegin LightSource \"infinite\" {placed} WorldEnd");
        let job = compile_scene(scene, &CompileOptions::default(), |_| None).job;
        let Shape::Mesh(mesh) = &job.world.geometry(GeometryId::new(0)).shape else {
            panic!("a mesh");
        };
        let surface = mesh.surface(0, [0.2, 0.3]);
        let what = format!("{before}, {instance}");
        assert_near(surface.dndu, [1.0 / scale, 0.0, 0.0], &what);
        assert_near(surface.dndv, [0.0; 3], &what);
        let u = f64::from(surface.uv[0]);
        let cubed = (1.0 + u * u).powf(1.5) * side;
        let [by_u, by_v] = surface.normal_derivatives();
        assert_near(by_u, [1.0 / cubed, 0.0, -u / cubed], &what);
        assert_near(by_v, [0.0; 3], &what);
    }
}

#[track_caller]
fn assert_near(actual: Vec3, expected: [f64; 3], what: &str) {
    let error = actual.to_f64().distance(expected.into());
    assert!(error < 1e-5, "{what}: {actual:?} is not {expected:?}");
}
