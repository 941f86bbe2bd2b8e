//! Worlds in which render space is world space, and receivers in them.

use tyndall::compile::CompileOptions;
use tyndall::ids::LightId;
use tyndall::image::Image;
use tyndall::image::codec::{ImageFile, Precision, encode};
use tyndall::light::Wanted;
use tyndall::math::{Normal3, Point3, Vec3};
use tyndall::spectrum::Rgb;
use tyndall::world::{Receiver, World};

use crate::common::scene::compile_scene;

/// The first light of a scene that has no emitting shape before it.
pub(crate) const FIRST: LightId = LightId(0);

/// A scene around a floor of radius 0.75 at z = 0. Its size, between 1 and 2, and the camera at the origin make render
/// space world space.
pub(crate) fn text(strategy: &str, lights: &str) -> String {
    format!(
        "Integrator \"path\" \"string lightsamplestrategy\" \"{strategy}\"\n\
         LookAt 0 0 0  0 0 1  0 1 0 Camera \"perspective\"\nWorldBegin\n\
         Shape \"disk\" \"float radius\" 0.75\n{lights}\nWorldEnd\n"
    )
}

/// The world of [`text`]; files it names are `map`.
#[track_caller]
pub(crate) fn world_of(strategy: &str, lights: &str, map: Option<&Image>) -> World {
    let bytes = map.map(pfm);
    let read = |_: &str| bytes.clone();
    let options = CompileOptions::default();
    compile_scene(text(strategy, lights), &options, read)
        .job
        .world
}

#[track_caller]
pub(crate) fn world(lights: &str) -> World {
    world_of("spatial", lights, None)
}

fn pfm(image: &Image) -> Vec<u8> {
    encode(&ImageFile::new(image.clone()), "pfm", Precision::Float).expect("a PFM file")
}

/// A grey picture.
pub(crate) fn picture(width: usize, height: usize, pixel: impl Fn(usize, usize) -> f32) -> Image {
    let data = (0..width * height)
        .flat_map(|i| [pixel(i % width, i / width); 3])
        .collect();
    Image::new(width, height, 3, data).expect("a picture")
}

pub(crate) fn receiver(p: [f32; 3], ng: [f32; 3]) -> Receiver {
    Receiver {
        p: Point3::from(p),
        p_err: Vec3::ZERO,
        ng: Normal3::new(ng[0], ng[1], ng[2]),
        wanted: Wanted::All,
        time: 0.0,
    }
}

/// Irradiance of the only light, one without extent, on a surface that faces it, times the squared distance.
pub(crate) fn intensity_toward(world: &World, from: [f32; 3], d: [f32; 3]) -> Rgb {
    const DISTANCE: f32 = 0.25;
    let length = d.iter().map(|x| x * x).sum::<f32>().sqrt();
    let p = [0, 1, 2].map(|k| from[k] + d[k] / length * DISTANCE);
    world
        .sample_light(&receiver(p, [0.0; 3]), 0.5, [0.5; 2])
        .map_or(Rgb::BLACK, |sample| {
            sample.radiance * (DISTANCE * DISTANCE / sample.pdf)
        })
}
