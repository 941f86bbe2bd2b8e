//! Footprints behind mirrors and glass: where the rays beside a camera ray meet the same surfaces.

use std::cell::RefCell;

use proptest::prelude::*;
use tyndall::camera::{CameraSample, RayDifferential};
use tyndall::ids::GeometryId;
use tyndall::integrator::footprint::{after_specular, texture_context};
use tyndall::math::{Ray, Vec3};
use tyndall::render::Job;
use tyndall::scatter::{SpecularPart, TransportMode};
use tyndall::shape::SurfacePoint;
use tyndall::world::{Hit, spawn_ray};

use crate::invariance::compared::{for_all, job};
use crate::invariance::scenes::{CURVE, Form, SHAPES, Thing, thing};

/// Surfaces of a chain.
const DEPTH: usize = 4;
/// Pixels between a ray and its neighbours.
const STEP: f64 = 1.0 / 512.0;
/// Part by which differences over one step to either side, and those over two, may differ for a chain to be smooth.
const SMOOTH: f32 = 0.03;
/// Part by which a footprint may be off, and of how many one may be off by more: at the pole of a sphere a chain is less
/// smooth than it looks.
const CLOSE: f32 = 0.05;
const FEW: u32 = 100;
/// Least change of position that single precision shows.
const LEAST: f32 = 1e-4;

/// A surface on a chain, and how the chain goes on from there.
struct Link {
    hit: Hit,
    surface: SurfacePoint,
    wo: Vec3,
    ns: Vec3,
    part: SpecularPart,
}

/// What is met along a ray that is refracted where the bit of `ways` for the surface is set, if it can be, and reflected
/// otherwise.
fn chain(job: &Job, mut ray: Ray, ways: u32) -> Vec<Link> {
    let world = &job.world;
    let mut links = Vec::new();
    for depth in 0..DEPTH {
        let Some(hit) = world.closest(&ray, f32::INFINITY) else {
            break;
        };
        let surface = world.surface(&ray, &hit);
        let material = world.geometry(hit.target.geometry).material;
        let ctx = texture_context(&surface, None);
        let bsdf = (world.materials()).bsdf(material, &surface, &ctx, world.textures());
        let wo = -ray.d;
        let parts = bsdf.specular_parts(wo, TransportMode::Radiance);
        let refracts = ways >> depth & 1 == 1;
        let wanted = (parts.iter()).find(|part| part.refraction.is_some() == refracts);
        let Some(&part) = wanted.or(parts.first()) else {
            break;
        };
        ray = spawn_ray(surface.p, surface.p_err, surface.ng, part.wi, ray.time);
        links.push(Link {
            hit,
            surface,
            wo,
            ns: bsdf.frame().n,
            part,
        });
    }
    links
}

const STRETCHES: [&str; 5] = [
    "",
    "Scale -1 1 1",
    "Scale 2 2 2",
    "Scale 1 1.5 .75 Rotate 40 1 2 3",
    "Rotate 70 3 1 2 Scale .5 -.75 .5",
];
const UNITS: [f64; 3] = [1.0, 100.0, 0.01];

/// Things of glass, or that mirror, within a mirror.
fn text(things: &[(Thing, bool)], form: Form, stretch: &str, unit: f64) -> String {
    let things: String = (things.iter().enumerate())
        .map(|(name, (thing, is_glass))| {
            let text = thing.clear(*is_glass).text(unit, form, name);
            let text = text
                .replace("AttributeBegin", &format!("AttributeBegin {stretch}"))
                .replace("\nObjectInstance", &format!("\n{stretch} ObjectInstance"));
            format!("AttributeBegin {text} AttributeEnd\n")
        })
        .collect();
    let [eye, radius] = [-6.0 * unit, 9.0 * unit];
    format!(
        "Film \"image\" \"integer xresolution\" 12 \"integer yresolution\" 8\n\
         Integrator \"directlighting\"\n\
         LookAt 0 0 {eye:?} 0 0 0 0 1 0\nCamera \"perspective\" \"float fov\" 50\nWorldBegin\n\
         LightSource \"infinite\"\nMaterial \"mirror\" Shape \"sphere\" \"float radius\" {radius:?}\n{things}WorldEnd\n"
    )
}

/// Footprints that were looked at, by the number of surfaces before, and those that are off.
#[derive(Default)]
struct Tally {
    n: [u32; DEPTH],
    off: Vec<String>,
}

/// Follows a chain and those beside it as long as they are smooth, and looks at the footprints from the first thing on.
fn follow(job: &Job, raster: [f64; 2], ways: u32, around: GeometryId, tally: &mut Tally) {
    let ray = |dx: f64, dy: f64| {
        let sample = CameraSample {
            raster: [raster[0] + dx, raster[1] + dy],
            time: 0.375,
            lens: [0.5; 2],
        };
        job.camera.ray(&sample).expect("a ray").ray
    };
    let here = chain(job, ray(0.0, 0.0), ways);
    let beside = [[1.0, 0.0], [0.0, 1.0]].map(|[x, y]: [f64; 2]| {
        [1.0, -1.0, 2.0, -2.0]
            .map(|n| n * STEP)
            .map(|n| chain(job, ray(n * x, n * y), ways))
    });
    let mut differential = RayDifferential {
        right: ray(STEP, 0.0),
        below: ray(0.0, STEP),
    };
    let mut has_met_thing = false;
    for (depth, link) in here.iter().enumerate() {
        let is_alike = |other: &Vec<Link>| {
            let same = |other: &Link| {
                other.hit.target == link.hit.target && other.part.refraction == link.part.refraction
            };
            other.get(depth).is_some_and(same)
        };
        if !beside.iter().flatten().all(is_alike) {
            break;
        }
        let surface = &link.surface;
        let ctx = texture_context(surface, Some(&differential));
        has_met_thing |= link.hit.target.geometry != around;
        for (axis, dp, duv) in [(0, ctx.dp_dx, ctx.duv_dx), (1, ctx.dp_dy, ctx.duv_dy)] {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| &beside[axis][k][depth].surface);
            // Of the positions, and of the parameters.
            let places = [a, b, c, d].map(|at| at.p - surface.p);
            let parameters = [a, b, c, d].map(|at| {
                let [u, v] = [0, 1].map(|k| at.uv[k] - surface.uv[k]);
                Vec3::new(u, v, 0.0)
            });
            for (of, [a, b, c, d]) in [(dp, places), (Vec3::new(duv[0], duv[1], 0.0), parameters)] {
                let traced = (a - b) * 0.5;
                let size = traced.length();
                let is_smooth = (a + b).length() < SMOOTH * size
                    && ((c - d) * 0.25 - traced).length() < SMOOTH * size;
                if !is_smooth || places[0].length() < LEAST {
                    return;
                }
                let off = (of - traced).length() / size;
                if has_met_thing {
                    tally.n[depth] += 1;
                }
                if !(off < CLOSE) {
                    if has_met_thing {
                        let way: Vec<_> = here.iter().map(|link| link.part.refraction).collect();
                        tally.off.push(format!(
                            "{raster:?}, {depth} of {way:?}: {of:?} instead of {traced:?}, off by {off}"
                        ));
                    }
                    return;
                }
            }
        }
        differential = after_specular(&differential, surface, &ctx, link.ns, link.wo, &link.part);
    }
}

/// A shape: curves turn toward each ray, and have no surface that all of them meet.
fn solid() -> impl Strategy<Value = (Thing, bool)> {
    (thing(1).prop_map(Thing::on_its_segment), any::<bool>())
        .prop_filter("a curve", |(thing, _)| thing.shape() != CURVE)
}

#[test]
fn footprints_are_those_of_traced_neighbours() {
    let forms = [Form::Plain, Form::Object, Form::Moving, Form::Nested];
    let cases = (
        proptest::collection::vec(solid(), 1..4),
        proptest::sample::select(forms.to_vec()),
        0..STRETCHES.len(),
        0..UNITS.len(),
        any::<u32>(),
    );
    // By the shape of the only thing.
    let n_seen = RefCell::new([[0; DEPTH]; SHAPES]);
    for_all(800, false, cases, |(things, form, stretch, unit, ways)| {
        let text = text(&things, form, STRETCHES[stretch], UNITS[unit]);
        let job = job(&text);
        let backward = Ray {
            d: Vec3::new(0.0, 0.0, -1.0),
            ..job
                .camera
                .ray(&CameraSample {
                    raster: [6.0, 4.0],
                    time: 0.0,
                    lens: [0.5; 2],
                })
                .expect("a ray")
                .ray
        };
        let around = job
            .world
            .closest(&backward, f32::INFINITY)
            .expect("the mirror");
        let mut tally = Tally::default();
        for i in 0..96u8 {
            let raster = [f64::from(i % 12) + 0.3, f64::from(i / 12) + 0.6];
            follow(&job, raster, ways, around.target.geometry, &mut tally);
        }
        let Tally { n, off } = tally;
        prop_assert!(
            off.len() as u32 <= 1 + n.iter().sum::<u32>() / FEW,
            "{off:#?} of {n:?} in\n{text}"
        );
        if let [(thing, _)] = &things[..] {
            for (sum, n) in n_seen.borrow_mut()[thing.shape()].iter_mut().zip(n) {
                *sum += n;
            }
        }
        Ok(())
    });
    let n_seen = n_seen.into_inner();
    for of_shape in &n_seen[..CURVE] {
        assert!(of_shape.iter().all(|&n| n >= 20), "{n_seen:?}");
    }
}
