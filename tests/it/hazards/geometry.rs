//! Family G: geometry.

use tyndall::camera::CameraSample;
use tyndall::compile::CompileOptions;
use tyndall::render::Job;
use tyndall::scatter::TransportMode;
use tyndall::texture::TextureContext;
use tyndall::world::Receiver;
use tyndall_test_support::Uniform;
use tyndall_test_support::z_test::Mean;

use crate::common::probe::Probe;
use crate::common::scene::compile_scene;
use crate::common::seen::seen_by;

/// An octahedron with the normals of a ball: its shading and its faces disagree by up to 55 degrees.
const BALL: &str = "Shape \"trianglemesh\" \
    \"point P\" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1  0 0 -1] \
    \"normal N\" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1  0 0 -1] \
    \"integer indices\" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5]\n";

/// The ball beside a lamp that grazes it, seen at a height.
fn scene(material: &str, height: f64) -> String {
    let world = format!(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [5 5 5] \"bool twosided\" \"true\"\n\
         Material \"matte\" \"rgb Kd\" [0 0 0] Translate 2 1.5 0.5 Shape \"sphere\" \"float radius\" 0.7 AttributeEnd\n\
         Material {material}\n{BALL}"
    );
    seen_by("path", 1, [0.1, height, 3.0], [0.07, 0.0, -1.0], &world)
}

/// Direct light by light sampling alone.
fn by_light_sampling(job: &Job, n: usize) -> Mean {
    let middle = CameraSample {
        raster: [0.5, 0.5],
        time: 0.0,
        lens: [0.5; 2],
    };
    let world = &job.world;
    let ray = job.camera.ray(&middle).expect("a pinhole").ray;
    let hit = world.closest(&ray, f32::INFINITY).expect("the ball");
    let surface = world.surface(&ray, &hit);
    let material = world.geometry(hit.target.geometry).material;
    let ctx = TextureContext::at_point(surface.p, surface.uv);
    let bsdf = world
        .materials()
        .bsdf(material, &surface, &ctx, world.textures());
    let at = Receiver {
        p: surface.p,
        p_err: surface.p_err,
        ng: surface.ng,
        wanted: tyndall::light::Wanted::All,
        time: 0.0,
    };
    let mut random = Uniform::new(5);
    Mean::of(n, || {
        let Some(sample) = world.sample_light(&at, f64::from(random.unit()), random.unit2()) else {
            return 0.0;
        };
        if world.is_occluded(&sample) {
            return 0.0;
        }
        let f = bsdf.f(-ray.d, sample.wi, TransportMode::Radiance);
        f64::from((f * sample.radiance).g() * bsdf.abs_cos(sample.wi) / sample.pdf)
    })
}

#[test]
fn g23_light_sampling_alone_finds_what_both_find_where_normals_disagree() {
    let mut n_lit = 0;
    for material in [
        "\"matte\" \"rgb Kd\" [1 1 1]",
        "\"plastic\" \"rgb Kd\" [.5 .5 .5] \"rgb Ks\" [.5 .5 .5] \"float roughness\" .2",
        "\"metal\" \"float roughness\" .3",
        "\"substrate\" \"float uroughness\" .3 \"float vroughness\" .3",
        "\"translucent\" \"rgb reflect\" [.5 .5 .5] \"rgb transmit\" [.5 .5 .5]",
    ] {
        for height in [-0.6, -0.3, 0.05, 0.3, 0.6] {
            let text = scene(material, height);
            let film = "Film \"image\" \"integer xresolution\" 1 \"integer yresolution\" 1\n\
                        PixelFilter \"box\"\n";
            let job = compile_scene(film.to_owned() + &text, &CompileOptions::default(), |_| {
                None
            });
            let alone = by_light_sampling(&job.job, 100_000);
            let both = Probe::new(&text).means(100_000)[1];
            both.agrees_with_mean(&alone)
                .assert_accepted(&format!("{material} at {height}"));
            n_lit += usize::from(alone.value > 0.0);
        }
    }
    assert!(n_lit > 15, "{n_lit} places are lit");
}

#[test]
fn g24_flat_normals_and_smooth_ones_share_the_terminator_of_the_faces() {
    // As in pbrt-v3, light that comes from below a face does not reach it, whatever the vertex normals say.
    let sun = "LightSource \"distant\" \"point from\" [1 1 .2] \"point to\" [0 0 0]\n";
    let seen = |normals: bool, height: f64| {
        let ball = if normals {
            BALL.to_owned()
        } else {
            let (start, end) = (
                BALL.find("\"normal").unwrap(),
                BALL.find("\"integer").unwrap(),
            );
            BALL[..start].to_owned() + &BALL[end..]
        };
        let world = format!("{sun} Material \"matte\" \"rgb Kd\" [1 1 1]\n{ball}");
        let scene = seen_by("path", 1, [0.1, height, 3.0], [0.07, 0.0, -1.0], &world);
        Probe::new(&scene).samples(1)[0][0]
    };
    for i in -9..=9 {
        let height = f64::from(i) * 0.09 + 0.013;
        let (flat, smooth) = (seen(false, height), seen(true, height));
        assert!(flat > 0.0 || smooth == 0.0, "at {height}: {flat} {smooth}");
    }
}

#[test]
fn of_two_surfaces_in_one_place_the_order_decides_nothing() {
    let quad = "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \
                \"point P\" [-1 -1 0 1 -1 0 1 1 0 -1 1 0]\n";
    let fan = "Shape \"trianglemesh\" \"integer indices\" [0 1 4 1 2 4 2 3 4 3 0 4] \
               \"point P\" [-2 -1 0 1 -1 0 1 2 0 -2 2 0 0.1 0.2 0]\n";
    let sphere = "Shape \"sphere\"\n";
    for turn in ["", "Rotate 31 1 2 3\n"] {
        for shapes in [[quad, quad], [quad, fan], [sphere, sphere]] {
            let pictures = [[0, 1], [1, 0]].map(|order| {
                let kinds = ["\"rgb Kd\" [.8 .1 .1]", "\"rgb Kd\" [.1 .8 .1]"];
                let sheets: String = order
                    .iter()
                    .map(|&i| format!("Material \"matte\" {}\n{}", kinds[i], shapes[i]))
                    .collect();
                let scene = format!(
                    "Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 16\n\
                     Integrator \"path\"\nLookAt 0.3 -1 4  0 0 0  0 1 0\n\
                     Camera \"perspective\" \"float fov\" 30\nWorldBegin\n\
                     LightSource \"infinite\"\n{turn}{sheets}WorldEnd\n"
                );
                let (job, findings) = crate::hazards::loaded::load(&scene, None);
                let told = findings
                    .iter()
                    .any(|f| f.code == "surfaces-in-one-place" && f.is_located);
                assert!(told, "{findings:?}");
                let job = job.expect("a job").job;
                tyndall::render::render(
                    &job,
                    &tyndall::render::Unwatched,
                    &std::sync::atomic::AtomicBool::new(false),
                )
                .image
                .data()
                .to_vec()
            });
            assert_eq!(pictures[0], pictures[1], "{turn}{shapes:?}");
        }
    }
}
