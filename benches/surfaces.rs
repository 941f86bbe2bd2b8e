//! What happens at a surface point: textures looked up, a material turned into lobes, directions drawn and judged.

#[path = "../tests/it/common/scene.rs"]
mod scene;

use divan::Bencher;
use scene::compile_scene;
use tyndall::camera::CameraSample;
use tyndall::compile::{CompileOptions, Compiled};
use tyndall::ids::MaterialId;
use tyndall::image::Image;
use tyndall::image::codec::{ImageFile, Precision, encode};
use tyndall::math::Vec3;
use tyndall::sampling::rng::Rng;
use tyndall::scatter::{Bsdf, TransportMode};
use tyndall::shape::SurfacePoint;
use tyndall::texture::TextureContext;

const DIRECTIONS: usize = 256;
const PICTURE_SIDE: usize = 256;

const MATERIALS: [&str; 8] = [
    "\"matte\"",
    "\"matte\" \"float sigma\" 20",
    "\"plastic\" \"float roughness\" 0.1",
    "\"metal\" \"float roughness\" 0.1",
    "\"glass\" \"float uroughness\" 0.1 \"float vroughness\" 0.1",
    "\"uber\" \"rgb opacity\" [0.5 0.5 0.5]",
    "\"disney\" \"float clearcoat\" 1 \"float sheen\" 1",
    "\"hair\"",
];

/// Kinds of textures and their parameters.
const TEXTURES: [&str; 6] = [
    "\"constant\"",
    "\"checkerboard\"",
    "\"fbm\"",
    "\"marble\"",
    "\"imagemap\" \"string filename\" \"noise.exr\" \"bool trilinear\" \"true\"",
    "\"imagemap\" \"string filename\" \"noise.exr\"",
];

fn main() {
    divan::main();
}

/// A ball before the camera, of this material, which may read the texture `t`.
fn ball(texture: &str, material: &str) -> Compiled {
    let class = if texture.starts_with("\"fbm\"") {
        "float"
    } else {
        "spectrum"
    };
    let text = format!(
        "LookAt 0 0 -5  0.3 0.2 0  0 1 0\nCamera \"perspective\"\nWorldBegin\n\
         LightSource \"infinite\"\nTexture \"t\" \"{class}\" {texture}\n\
         Material {material}\nShape \"sphere\"\nWorldEnd\n"
    );
    compile_scene(text, &CompileOptions::default(), |_| Some(noise()))
}

/// A picture without a pattern.
fn noise() -> Vec<u8> {
    let mut rng = Rng::new(5);
    let data = (0..3 * PICTURE_SIDE * PICTURE_SIDE).map(|_| rng.uniform());
    let image = Image::new(PICTURE_SIDE, PICTURE_SIDE, 3, data.collect()).expect("it is square");
    encode(&ImageFile::new(image), "exr", Precision::Half).expect("it is small")
}

/// A place on the ball.
struct Place {
    surface: SurfacePoint,
    material: MaterialId,
    context: TextureContext,
    /// Back to the camera.
    wo: Vec3,
}

/// Where the middle of the picture meets the ball, with a footprint of some texels.
fn place(compiled: &Compiled) -> Place {
    let [width, height] = compiled.job.film.resolution;
    let sample = CameraSample {
        raster: [width as f64 / 2.0, height as f64 / 2.0],
        time: 0.0,
        lens: [0.5; 2],
    };
    let ray = compiled.job.camera.ray(&sample).expect("a pinhole").ray;
    let world = &compiled.job.world;
    let hit = world
        .closest(&ray, f32::INFINITY)
        .expect("the ball is there");
    let surface = world.surface(&ray, &hit);
    let mut context = TextureContext::at_point(surface.p, surface.uv);
    context.duv_dx = [0.02, 0.0];
    context.duv_dy = [0.0, 0.005];
    Place {
        surface,
        material: world.geometry(hit.target.geometry).material,
        context,
        wo: -ray.d,
    }
}

impl Place {
    /// What the ball scatters there.
    fn bsdf<'a>(&self, compiled: &'a Compiled) -> Bsdf<'a> {
        let world = &compiled.job.world;
        let materials = world.materials();
        materials.bsdf(
            self.material,
            &self.surface,
            &self.context,
            world.textures(),
        )
    }
}

#[divan::bench(args = TEXTURES)]
fn texture(bencher: Bencher<'_, '_>, texture: &str) {
    let material = if texture.starts_with("\"fbm\"") {
        "\"matte\" \"texture sigma\" \"t\""
    } else {
        "\"matte\" \"texture Kd\" \"t\""
    };
    let compiled = ball(texture, material);
    let mut place = place(&compiled);
    let mut rng = Rng::new(6);
    bencher.counter(1usize).bench_local(|| {
        place.context.uv = rng.uniform2();
        divan::black_box(place.bsdf(&compiled));
    });
}

#[divan::bench(args = MATERIALS)]
fn draw(bencher: Bencher<'_, '_>, material: &str) {
    let compiled = ball("\"constant\"", material);
    let place = place(&compiled);
    let (bsdf, wo) = (place.bsdf(&compiled), place.wo);
    bencher.counter(DIRECTIONS).bench(|| {
        let mut rng = Rng::new(7);
        for _ in 0..DIRECTIONS {
            let (u_lobe, u) = (rng.uniform(), rng.uniform2());
            divan::black_box(bsdf.sample(wo, u_lobe, u, TransportMode::Radiance));
        }
    });
}

#[divan::bench(args = MATERIALS)]
fn judge(bencher: Bencher<'_, '_>, material: &str) {
    let compiled = ball("\"constant\"", material);
    let place = place(&compiled);
    let (bsdf, wo) = (place.bsdf(&compiled), place.wo);
    let mut rng = Rng::new(8);
    let directions: Vec<Vec3> = (0..DIRECTIONS)
        .map(|_| {
            let [a, b] = [rng.uniform2(), rng.uniform2()];
            Vec3::new(a[0] - 0.5, a[1] - 0.5, b[0] - 0.5).normalize()
        })
        .collect();
    bencher.counter(DIRECTIONS).bench(|| {
        for &wi in &directions {
            divan::black_box((bsdf.f(wo, wi, TransportMode::Radiance), bsdf.pdf(wo, wi)));
        }
    });
}
