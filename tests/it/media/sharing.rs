//! Paths in a cloud that share what they find: the same pictures as by paths alone, with less noise.

use std::sync::atomic::AtomicBool;

use tyndall::compile::CompileOptions;
use tyndall::image::Image;
use tyndall::integrator::trace::Unobserved;
use tyndall::render::{Job, Unwatched, render, retake};

use crate::common::scene::compile_scene;
use crate::common::seen::{environment, seen_by};
use crate::common::solids::{V, null_box};
use crate::media::nebula::Nebula;
use crate::media::skies::{SKY, map};

const SIZE: usize = 12;
const SPP: u32 = 4;
const EYE: V = [0.13, 0.21, -3.0];

/// What differs from case to case.
struct Case {
    what: &'static str,
    sky: String,
    sigma_a: V,
    sigma_s: V,
    max_depth: u32,
    eye: V,
    fov: f64,
    /// The medium around the camera.
    around: &'static str,
    sampler: &'static str,
    spp: u32,
}

impl Case {
    /// A cloud that scatters most of its light, under a map.
    fn new(what: &'static str) -> Self {
        Self {
            what,
            sky: SKY.to_owned(),
            sigma_a: [0.2; 3],
            sigma_s: [4.0; 3],
            max_depth: 6,
            eye: EYE,
            fov: 12.0,
            around: "",
            sampler: "02sequence",
            spp: SPP,
        }
    }

    /// The cloud in a box above a floor; `film` goes on with the film's directive.
    fn job(&self, film: &str) -> Job {
        let Self {
            sky,
            fov,
            around,
            sampler,
            spp,
            ..
        } = self;
        let cloud = Nebula::ragged([9, 8, 10], [-1.0; 3], [1.0; 3]);
        let cloud = cloud.medium("cloud", self.sigma_a, self.sigma_s, 0.0);
        let wall = null_box([-1.0; 3], [1.0; 3], "cloud", "");
        let floor = "AttributeBegin Translate 0 -2 0 Rotate 90 1 0 0 Shape \"disk\" \"float radius\" 4 AttributeEnd\n";
        // What is in force at the end is what the camera is in.
        let world = format!("{sky}{cloud}{wall}{floor}MediumInterface \"\" \"{around}\"");
        let seen = seen_by("volpath", self.max_depth, self.eye, [0.0, 0.0, 1.0], &world);
        let lens = format!("Camera \"perspective\" \"float fov\" {fov}");
        let seen = seen.replace("Camera \"perspective\"", &lens);
        let text = format!(
            "Sampler \"{sampler}\" \"integer pixelsamples\" {spp}\n\
             Film \"image\" \"integer xresolution\" {SIZE} \"integer yresolution\" {SIZE} {film}\n{seen}"
        );
        let read = |name: &str| (name == "sky.pfm").then(map);
        compile_scene(text, &CompileOptions::default(), read).job
    }
}

fn picture(job: &Job) -> Image {
    render(job, &Unwatched, &AtomicBool::new(false)).image
}

/// By paths that do not know of each other. The film's filter is a box.
fn alone(job: &Job) -> Vec<f64> {
    let pixels = (0..SIZE as i32).flat_map(|y| (0..SIZE as i32).map(move |x| [x, y]));
    let mean = |pixel: [i32; 2]| {
        let mut sum = [0.0; 3];
        for sample in 0..job.spp {
            let taken = retake(job, pixel, sample, &mut Unobserved);
            for (sum, c) in sum.iter_mut().zip(taken.radiance.to_array()) {
                *sum += f64::from(c) * f64::from(taken.weight) / f64::from(job.spp);
            }
        }
        sum
    };
    pixels.flat_map(mean).collect()
}

/// Mean over standard error, and variance.
fn standardised(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    let variance = values.map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean / (variance / n).sqrt(), variance)
}

/// Pictures of a job by paths that share, and by the same paths alone, for so many seeds.
fn pairs(mut job: Job, n_seeds: u64) -> Vec<[Vec<f64>; 2]> {
    let of_seed = |seed: u64| {
        job.seed = seed;
        let shared = picture(&job).data().iter().map(|&c| f64::from(c)).collect();
        [shared, alone(&job)]
    };
    (0..n_seeds).map(of_seed).collect()
}

#[test]
fn sharing_changes_no_pixel_on_average() {
    let lamp = "LightSource \"point\" \"point from\" [0 3 -1] \"rgb I\" [9 9 9]\n";
    let cases = [
        Case::new("close up"),
        Case {
            fov: 90.0,
            ..Case::new("from afar")
        },
        Case {
            max_depth: 2,
            ..Case::new("two collisions")
        },
        Case {
            sigma_a: [0.2, 3.0, 4.0],
            sigma_s: [4.0, 1.2, 0.2],
            ..Case::new("coloured albedo")
        },
        Case {
            sigma_a: [3.8; 3],
            sigma_s: [0.4; 3],
            ..Case::new("roulette at the second collision")
        },
        Case {
            eye: [0.1, 0.2, -0.3],
            around: "cloud",
            ..Case::new("from within")
        },
        Case {
            sky: lamp.to_owned(),
            ..Case::new("under a point light")
        },
        // With so few samples far from each other, a wrong density would tell.
        Case {
            sky: lamp.to_owned(),
            fov: 90.0,
            spp: 1,
            ..Case::new("far apart")
        },
    ];
    for case in cases {
        let what = case.what;
        let n_seeds = 1600 / u64::from(case.spp);
        let pictures = pairs(case.job("PixelFilter \"box\""), n_seeds);
        let of_pixel = |k: usize| standardised(pictures.iter().map(move |[a, b]| a[k] - b[k])).0;
        // Where the cloud is not, both are the same.
        let off = (0..SIZE * SIZE * 3).map(of_pixel);
        let off: Vec<f64> = off.filter(|t| !t.is_nan()).collect();
        assert!(
            off.len() > SIZE * SIZE / 2,
            "{what}: {} are compared",
            off.len()
        );
        let worst = off.iter().fold(0.0, |worst: f64, t| worst.max(t.abs()));
        assert!(
            worst < 5.0,
            "{what}: a pixel is {worst} standard errors off"
        );
        let squares = off.iter().map(|t| t * t).sum::<f64>() / off.len() as f64;
        assert!(
            squares < 1.5,
            "{what}: pixels are off by {squares} in the mean of squares"
        );
        // Of the whole picture, with an error planted.
        let whole = |planted: f64| {
            let off = |[a, b]: &[Vec<f64>; 2]| -> f64 {
                a.iter().zip(b).map(|(a, b)| a * (1.0 + planted) - b).sum()
            };
            standardised(pictures.iter().map(off)).0.abs()
        };
        assert!(
            whole(0.0) < 4.0,
            "{what}: {} standard errors off",
            whole(0.0)
        );
        assert!(whole(0.05) > 4.0, "{what}: a twentieth would not be seen");
    }
}

#[test]
fn sharing_takes_noise_away_where_paths_scatter_close_to_each_other() {
    let case = Case {
        sky: environment([1.0; 3]),
        ..Case::new("under an even sky")
    };
    let pictures = pairs(case.job("PixelFilter \"box\""), 50);
    let variance = |which: usize| -> f64 {
        let of_pixel = |k: usize| standardised(pictures.iter().map(move |pair| pair[which][k])).1;
        (0..SIZE * SIZE * 3).map(of_pixel).sum()
    };
    let left = variance(0) / variance(1);
    assert!(left < 0.8, "{left} of the noise is left");
}

#[test]
fn who_shares_depends_on_neither_crop_window_nor_pixel_bounds_nor_threads() {
    let case = Case {
        fov: 40.0,
        sampler: "random",
        spp: 20, // A pass, and some of another.
        ..Case::new("with both wall and floor")
    };
    let whole = case.job("PixelFilter \"gaussian\"");
    let picture_of_whole = picture(&whole);
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool");
    assert_eq!(
        one.install(|| picture(&whole)).data(),
        picture_of_whole.data()
    );

    let cropped = case.job("\"float cropwindow\" [.25 .75 .5 1] PixelFilter \"gaussian\"");
    let crop = cropped.film.crop;
    let picture_of_crop = picture(&cropped);
    for y in 0..crop.height {
        let line = |image: &Image, x: usize, y: usize| {
            let first = (y * image.width() + x) * 3;
            image.data()[first..first + 3 * crop.width].to_vec()
        };
        let (x0, y0) = (crop.x0 as usize, crop.y0 as usize);
        assert_eq!(
            line(&picture_of_crop, 0, y),
            line(&picture_of_whole, x0, y0 + y),
            "line {y}"
        );
    }

    let mut bounded = case.job("PixelFilter \"box\"");
    let picture_of_all = picture(&bounded);
    let pixels = tyndall::image::PixelRect {
        x0: 3,
        y0: 5,
        width: 4,
        height: 6,
    };
    bounded.pixel_bounds = Some(pixels);
    let picture_within = picture(&bounded);
    for k in 0..SIZE * SIZE {
        let is_within = pixels.holds([(k % SIZE) as i32, (k / SIZE) as i32]);
        let [all, within] =
            [&picture_of_all, &picture_within].map(|image| &image.data()[3 * k..][..3]);
        assert_eq!(within, if is_within { all } else { &[0.0; 3] }, "pixel {k}");
    }
}
