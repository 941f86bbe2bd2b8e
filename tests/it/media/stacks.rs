//! Surfaces in one place, against the same a ten-thousandth apart: random stacks of sheets in a room.

use std::sync::atomic::AtomicBool;

use glam::{DAffine3, DQuat, DVec3};
use tyndall::compile::CompileOptions;
use tyndall::integrator::Counters;
use tyndall::render::{Unwatched, render};
use tyndall_test_support::Uniform;
use tyndall_test_support::z_test::Mean;

use crate::common::scene::compile_scene;
use crate::common::solids::{box_shape, homogeneous};

/// Distance of sheets that are apart.
const GAP: f64 = 1e-4;
/// Pictures of each scene, with seeds of their own.
const SEEDS: u64 = 24;

/// What a sheet is made of.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Sheet {
    Lamp,
    NullLamp,
    Matte,
    Translucent,
    Black,
    /// From the medium above to the one below.
    Null(&'static str, &'static str),
}

/// How a sheet is described.
#[derive(Clone, Copy, Debug)]
enum Form {
    Quad,
    Fan([f64; 2]),
    Disk,
    /// The upper side of a closed box.
    Box,
}

/// How it is placed.
#[derive(Clone, Copy, Debug)]
enum Placed {
    Itself,
    Instance,
    Moving,
}

/// Sheets from top to bottom in a room that they divide.
#[derive(Debug)]
struct Stack {
    sheets: Vec<(Sheet, Form, Placed, bool)>,
    /// The order of the sheets in the file.
    order: Vec<usize>,
    above: &'static str,
    below: &'static str,
    is_seen_from_above: bool,
    /// Lights; a lamp above and one below if it says nothing.
    lights: Option<String>,
    world_from_stack: DAffine3,
}

struct Random(Uniform);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        (f64::from(self.0.unit()) * n as f64) as usize % n
    }

    fn number(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * f64::from(self.0.unit())
    }
}

impl Stack {
    /// Up to eight sheets. Where media are not heeded null surfaces keep light out, wherever they lie behind others, and
    /// what is below is not to be seen.
    fn random(seed: u64, is_volumetric: bool) -> Self {
        let mut random = Random(Uniform::new(seed));
        let mut sheets = Vec::new();
        let front: &[Sheet] = match random.below(if is_volumetric { 6 } else { 4 }) {
            0 => &[],
            1 => &[Sheet::Matte],
            2 => &[Sheet::Lamp],
            3 if is_volumetric => &[Sheet::NullLamp, Sheet::Matte],
            3 => &[Sheet::Matte],
            4 => &[Sheet::Translucent],
            _ => &[Sheet::NullLamp],
        };
        let media = ["", "thin", "thick"];
        let above = media[random.below(3)];
        let mut below = above;
        let n_nulls = 1 + random.below(7 - front.len());
        let mut kinds = front.to_vec();
        for _ in 0..n_nulls {
            let next = media[random.below(3)];
            if next != below {
                kinds.push(Sheet::Null(below, next));
                below = next;
            }
        }
        // Where a stack leads back to where it came from, the boundaries around the eye do not say where that is.
        if below == above {
            let next = media[(1 + media.iter().position(|m| *m == below).unwrap_or(0)) % 3];
            kinds.push(Sheet::Null(below, next));
            below = next;
        }
        let n_kinds = kinds.len();
        for (i, sheet) in kinds.into_iter().enumerate() {
            let form = match random.below(4) {
                0 => Form::Quad,
                1 => Form::Fan([random.number(-2.0, 2.0), random.number(-2.0, 2.0)]),
                2 => Form::Disk,
                // What is within the box is what is below all sheets.
                _ if i + 1 == n_kinds && matches!(sheet, Sheet::Null(..)) => Form::Box,
                _ => Form::Quad,
            };
            let may_be_placed = !matches!(sheet, Sheet::Lamp | Sheet::NullLamp);
            let placed = match random.below(4) {
                0 if may_be_placed => Placed::Instance,
                1 if may_be_placed => Placed::Moving,
                _ => Placed::Itself,
            };
            sheets.push((sheet, form, placed, random.below(2) == 0));
        }
        let mut order: Vec<usize> = (0..sheets.len()).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, random.below(i + 1));
        }
        let axis = DVec3::new(1.0, random.number(-1.0, 1.0), random.number(-1.0, 1.0));
        let turn = DQuat::from_axis_angle(axis.normalize(), random.number(0.0, 3.0));
        let place = [0.0, 1.0, 3.0][random.below(3)];
        let world_from_stack = match random.below(3) {
            0 => DAffine3::IDENTITY,
            _ => DAffine3::from_rotation_translation(turn, DVec3::new(place, -place, 0.3 * place)),
        };
        Self {
            sheets,
            order,
            above,
            below,
            // From below a lamp without a material is seen before what lies in its place, and not if it is behind that.
            is_seen_from_above: !is_volumetric || front.len() > 1 || random.below(3) > 0,
            lights: None,
            world_from_stack,
        }
    }

    fn sheet(&self, index: usize, gap: f64) -> String {
        let (sheet, form, placed, flips) = self.sheets[index];
        // Lamps shine up: what lies below one would be lit by it, and is not in its plane.
        let flips = flips && !matches!(sheet, Sheet::Lamp | Sheet::NullLamp);
        let z = -gap * index as f64;
        // What a lamp emits outside the room would go around the sheets.
        let (w, radius) = match sheet {
            Sheet::Lamp | Sheet::NullLamp => (2.5, 2.5),
            _ => (4.0, 6.0),
        };
        let square = format!("-{w} -{w} {z} {w} -{w} {z} {w} {w} {z} -{w} {w} {z}");
        let shape = match form {
            Form::Quad => format!(
                "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [{square}]\n"
            ),
            Form::Fan([x, y]) => format!(
                "Shape \"trianglemesh\" \"integer indices\" [0 1 4 1 2 4 2 3 4 3 0 4] \
                 \"point P\" [{square} {x} {y} {z}]\n"
            ),
            Form::Disk => {
                format!("Shape \"disk\" \"float radius\" {radius} \"float height\" {z}\n")
            }
            Form::Box => box_shape([-4.0, -4.0, -3.0], [4.0, 4.0, z]),
        };
        let media = |above: &str, below: &str| {
            if flips {
                format!("MediumInterface \"{above}\" \"{below}\" ReverseOrientation ")
            } else {
                format!("MediumInterface \"{below}\" \"{above}\" ")
            }
        };
        let lamp = "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] ";
        let looks = match sheet {
            Sheet::Lamp => format!("{lamp}Material \"matte\" "),
            Sheet::NullLamp => format!("{lamp}Material \"\" "),
            Sheet::Matte => "Material \"matte\" \"rgb Kd\" [.7 .5 .3] ".to_owned(),
            Sheet::Black => "Material \"matte\" \"rgb Kd\" [0 0 0] ".to_owned(),
            Sheet::Translucent => "Material \"translucent\" \"rgb Ks\" [0 0 0] ".to_owned(),
            Sheet::Null(..) => "Material \"\" ".to_owned(),
        };
        let interface = match sheet {
            Sheet::Null(above, below) => media(above, below),
            _ => media(self.above, self.above),
        };
        let moves =
            "ActiveTransform EndTime Translate 0.3 -0.2 0 Rotate 5 0 0 1 ActiveTransform All ";
        match placed {
            Placed::Itself => format!("AttributeBegin {looks}{interface}{shape}AttributeEnd\n"),
            Placed::Moving => {
                format!("AttributeBegin {looks}{interface}{moves}{shape}AttributeEnd\n")
            }
            Placed::Instance => format!(
                "AttributeBegin ObjectBegin \"sheet{index}\" Identity {looks}{interface}{shape}ObjectEnd \
                 ObjectInstance \"sheet{index}\" Translate 30 0 0 Scale .01 .01 .01 ObjectInstance \"sheet{index}\" \
                 AttributeEnd\n"
            ),
        }
    }

    fn scene(&self, integrator: &str, gap: f64) -> String {
        let up = if self.is_seen_from_above { 1.0 } else { -1.0 };
        let place = |p: [f64; 3]| {
            let p = self.world_from_stack.transform_point3(DVec3::from(p));
            format!("{} {} {}", p.x, p.y, p.z)
        };
        let (eye, at) = (place([0.3, -2.5, 1.2 * up]), place([0.2, 0.1, 0.0]));
        let up_vector = self.world_from_stack.transform_vector3(DVec3::Z).to_array();
        let around_eye = if self.is_seen_from_above {
            self.above
        } else {
            self.below
        };
        let m = self.world_from_stack.to_cols_array();
        let matrix = format!(
            "Transform [{} {} {} 0 {} {} {} 0 {} {} {} 0 {} {} {} 1]\n",
            m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9], m[10], m[11]
        );
        let sheets: String = self.order.iter().map(|&i| self.sheet(i, gap)).collect();
        let (above, below) = (self.above, self.below);
        let lights = self.lights.clone().unwrap_or_else(|| {
            format!(
                "AttributeBegin MediumInterface \"{above}\" \"{above}\"\n\
                 Translate 1 1 1.5 ReverseOrientation AreaLightSource \"diffuse\" \"rgb L\" [9 8 7] \
                 Shape \"disk\" \"float radius\" 0.5 AttributeEnd\n\
                 AttributeBegin MediumInterface \"{below}\" \"{below}\" Translate -1 0 -1.5\n\
                 AreaLightSource \"diffuse\" \"rgb L\" [4 3 2] Shape \"disk\" AttributeEnd\n"
            )
        });
        format!(
            "Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8\n\
             PixelFilter \"box\"\nSampler \"random\" \"integer pixelsamples\" 4\n{integrator}\n\
             LookAt {eye} {at} {} {} {}\n\
             Camera \"perspective\" \"float fov\" 60\nWorldBegin\n{matrix}{}{}{lights}\
             Material \"matte\" \"rgb Kd\" [.4 .5 .6]\nMediumInterface \"\" \"\"\n{}{sheets}\n\
             MediumInterface \"\" \"{around_eye}\"\nWorldEnd\n",
            up_vector[0],
            up_vector[1],
            up_vector[2],
            homogeneous("thin", [0.02, 0.05, 0.03], [0.1, 0.05, 0.1], 0.0),
            homogeneous("thick", [0.3, 0.2, 0.1], [0.3, 0.5, 0.9], 0.3),
            box_shape([-3.0, -3.0, -2.0], [3.0, 3.0, 2.0]),
        )
    }
}

/// Means of pictures per channel, and what was counted.
fn means(scene: &str) -> ([Mean; 3], Counters) {
    let mut job = compile_scene(scene, &CompileOptions::default(), |_| None).job;
    let mut counters = Counters::default();
    let pictures: Vec<[f64; 3]> = (0..SEEDS)
        .map(|seed| {
            job.seed = seed;
            let rendered = render(&job, &Unwatched, &AtomicBool::new(false));
            counters.add(&rendered.report.counters);
            let image = rendered.image;
            let n = (image.width() * image.height()) as f64;
            let pixels = image.data().chunks(3);
            pixels.fold([0.0; 3], |sum, pixel| {
                [0, 1, 2].map(|k| sum[k] + f64::from(pixel[k]) / n)
            })
        })
        .collect();
    let of_channel = |k: usize| {
        let mut values = pictures.iter().map(|mean| mean[k]);
        Mean::of(pictures.len(), || values.next().expect("one for each seed"))
    };
    ([0, 1, 2].map(of_channel), counters)
}

fn assert_sound(counters: &Counters, what: &str) {
    let counted = [
        counters.leaked_paths,
        counters.mismatched(),
        counters.stuck_paths,
        counters.shadow.stuck,
        counters.one_sided,
    ];
    assert_eq!(counted, [0; 5], "{what}");
}

/// Sheets in one place look like sheets apart.
fn assert_alike(stack: &Stack, integrator: &str, what: &str) {
    // So close to each other, a few of them may be met in the wrong order.
    let (apart, _) = means(&stack.scene(integrator, GAP));
    let (together, counters) = means(&stack.scene(integrator, 0.0));
    assert_sound(&counters, what);
    for (a, b) in apart.iter().zip(&together) {
        a.agrees_with_mean(b)
            .assert_accepted(&format!("{what}\n{}", stack.scene(integrator, 0.0)));
    }
}

fn assert_apart_alike(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let stack = Stack::random(seed, true);
        for integrator in ["volpath", "bdpt"] {
            let text = format!("Integrator \"{integrator}\" \"integer maxdepth\" 5");
            assert_alike(&stack, &text, &format!("{seed}, {integrator}: {stack:?}"));
        }
    }
}

#[test]
fn stacks_of_sheets_look_as_if_they_were_apart() {
    assert_apart_alike(0..7);
}

#[test]
#[ignore = "long"]
fn many_stacks_of_sheets_look_as_if_they_were_apart() {
    assert_apart_alike(7..60);
}

fn assert_alike_without_media(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let stack = Stack::random(seed, false);
        for integrator in [
            "\"path\"",
            "\"directlighting\"",
            "\"whitted\"",
            "\"ambientocclusion\" \"integer nsamples\" 4",
            "\"sppm\" \"integer numiterations\" 4 \"integer photonsperiteration\" 500",
        ] {
            let text = format!("Integrator {integrator}");
            assert_alike(&stack, &text, &format!("{seed}, {integrator}: {stack:?}"));
        }
    }
}

#[test]
fn stacks_look_alike_where_media_are_ignored() {
    assert_alike_without_media(100..103);
}

#[test]
#[ignore = "long"]
fn many_stacks_look_alike_where_media_are_ignored() {
    assert_alike_without_media(103..130);
}

/// A box of fog in a room of its size, and one in two parts that meets the walls, in any order.
fn sealed_room(order: usize) -> String {
    let room = format!(
        "AttributeBegin Material \"matte\" \"rgb Kd\" [.7 .6 .5]\n{}AttributeEnd\n",
        box_shape([-1.0; 3], [1.0; 3])
    );
    let part = |lo: f64, hi: f64| {
        format!(
            "AttributeBegin Material \"\" MediumInterface \"fog\" \"\"\n{}AttributeEnd\n",
            box_shape([lo, -1.0, -1.0], [hi, 1.0, 1.0])
        )
    };
    let parts = match order % 4 {
        0 => part(-1.0, 1.0) + &room,
        1 => room + &part(-1.0, 1.0),
        2 => part(-1.0, 0.1) + &room + &part(0.1, 1.0),
        _ => part(0.1, 1.0) + &part(-1.0, 0.1) + &room,
    };
    format!("LightSource \"infinite\" \"rgb L\" [1 1 1]\n{parts}")
}

#[test]
fn no_light_comes_into_a_sealed_room_full_of_fog() {
    let mist = homogeneous("fog", [0.1; 3], [1.0; 3], 0.0);
    let grid = "MakeNamedMedium \"fog\" \"string type\" \"heterogeneous\" \"integer nx\" 2 \"integer ny\" 1 \
                \"integer nz\" 1 \"point p0\" [-1 -1 -1] \"point p1\" [1 1 1] \"float density\" [1 2] \
                \"rgb sigma_a\" [.1 .1 .1] \"rgb sigma_s\" [1 1 1]\n";
    let kinds = [
        "\"volpath\"",
        "\"bdpt\"",
        "\"path\"",
        "\"directlighting\"",
        "\"ambientocclusion\"",
        "\"sppm\" \"integer numiterations\" 2 \"integer photonsperiteration\" 500",
        "\"mlt\" \"integer bootstrapsamples\" 500 \"integer mutationsperpixel\" 4",
    ];
    for (k, turn) in ["", "Rotate 40 1 2 3\n", "Rotate 77 2 -1 5\n"]
        .iter()
        .enumerate()
    {
        for order in 0..4 {
            for (i, integrator) in kinds.iter().enumerate() {
                let fog = if (i + order) % 2 == 0 { &mist } else { grid };
                let is_open = integrator.contains("ambient");
                // A grid is placed by the transform at its directive.
                let fog = format!("{turn}{fog}Identity\n");
                let scene = format!(
                    "Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 16\n\
                     PixelFilter \"box\" Sampler \"random\" \"integer pixelsamples\" 8\n\
                     Integrator {integrator}\n{fog}MediumInterface \"\" \"fog\"\n\
                     LookAt 0.17 -0.2 0.1  0.3 0.4 -0.1  0 0 1\n\
                     Camera \"perspective\" \"float fov\" 100\nWorldBegin\n{turn}{}WorldEnd\n",
                    sealed_room(order)
                );
                let mut job = compile_scene(scene, &CompileOptions::default(), |_| None).job;
                job.seed = k as u64;
                let rendered = render(&job, &Unwatched, &AtomicBool::new(false));
                let what = format!("{turn}, order {order}, {integrator}");
                assert_sound(&rendered.report.counters, &what);
                let data = rendered.image.data();
                // Between points inside and outside of one wall the cosines of both are rounding errors.
                let most = if integrator.contains("bdpt") || integrator.contains("mlt") {
                    1e-9
                } else {
                    0.0
                };
                assert!(is_open || data.iter().all(|c| *c <= most), "{what}: light");
            }
        }
    }
}

#[test]
fn a_light_on_a_surface_lights_it_from_either_side() {
    let forms = [Form::Quad, Form::Fan([0.4, 0.1]), Form::Disk, Form::Box];
    let placements = [Placed::Itself, Placed::Instance, Placed::Moving];
    for seed in 0..12 {
        let mut random = Random(Uniform::new(200 + seed));
        // Black, as what is below a light that is apart is lit by half of it.
        let sheet = (
            Sheet::Black,
            forms[seed as usize % 4],
            placements[seed as usize / 4 % 3],
            random.below(2) == 0,
        );
        let kind = ["point", "spot", "goniometric"][random.below(3)];
        let [x, y] = [0; 2].map(|_| random.number(-1.0, 1.0));
        let mut stack = Stack {
            sheets: vec![sheet],
            order: vec![0],
            lights: None,
            ..Stack::random(seed, true)
        };
        (stack.above, stack.below) = ("", "");
        let up = if stack.is_seen_from_above { 1.0 } else { -1.0 };
        let light = |z: f64| {
            let target = if kind == "spot" {
                format!(
                    "\"point from\" [{x} {y} {z}] \"point to\" [0 0 {up}] \"float coneangle\" 80"
                )
            } else {
                String::new()
            };
            format!(
                "AttributeBegin Translate {} {} {} LightSource \"{kind}\" {target} \"rgb I\" [3 4 5] AttributeEnd\n",
                if kind == "spot" { 0.0 } else { x },
                if kind == "spot" { 0.0 } else { y },
                if kind == "spot" { 0.0 } else { z }
            )
        };
        for integrator in [
            "\"path\"",
            "\"volpath\"",
            "\"directlighting\"",
            "\"bdpt\"",
            // Wider photons would come through the floor.
            "\"sppm\" \"integer numiterations\" 4 \"integer photonsperiteration\" 500 \"float radius\" 0.02",
        ] {
            let text = format!("Integrator {integrator}");
            let what = format!("{seed}, {kind}, {integrator}: {stack:?}");
            stack.lights = Some(light(GAP * up));
            let (apart, counters) = means(&stack.scene(&text, 0.0));
            assert_sound(&counters, &what);
            stack.lights = Some(light(0.0));
            let (together, counters) = means(&stack.scene(&text, 0.0));
            assert_sound(&counters, &what);
            for (a, b) in apart.iter().zip(&together) {
                assert!(b.value > 0.0, "{what}: dark");
                a.agrees_with_mean(b).assert_accepted(&what);
            }
        }
    }
}

#[test]
fn a_fog_cut_in_boxes_is_one_fog() {
    let fog = homogeneous("fog", [0.1; 3], [1.0; 3], 0.0);
    let part = |lo: f64, hi: f64| {
        format!(
            "AttributeBegin Material \"\" MediumInterface \"fog\" \"\"\n{}AttributeEnd\n",
            box_shape([lo, -1.0, -1.0], [hi, 1.0, 1.0])
        )
    };
    for (k, turn) in ["", "Rotate 31 1 2 3\n"].into_iter().enumerate() {
        for integrator in ["volpath", "bdpt"] {
            let scene = |parts: String| {
                format!(
                    "Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8\n\
                     PixelFilter \"box\" Sampler \"random\" \"integer pixelsamples\" 8\n\
                     Integrator \"{integrator}\" \"integer maxdepth\" 8\n\
                     LookAt 0 -4 1  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 30\nWorldBegin\n\
                     LightSource \"distant\" \"point from\" [-3 -2 4] \"point to\" [0 0 0] \"rgb L\" [3 2 1]\n\
                     {turn}{fog}{parts}WorldEnd\n"
                )
            };
            let cuts = [-1.0, -0.3, 0.1, 0.45, 1.0];
            let (one, counters) = means(&scene(part(-1.0, 1.0)));
            assert_sound(&counters, integrator);
            let mut parts: Vec<String> = cuts.windows(2).map(|cut| part(cut[0], cut[1])).collect();
            parts.rotate_left(k + 1);
            let (many, counters) = means(&scene(parts.concat()));
            assert_sound(&counters, &format!("{integrator}, {turn}"));
            for (a, b) in one.iter().zip(&many) {
                a.agrees_with_mean(b).assert_accepted(integrator);
            }
        }
    }
}

/// Skin on which fog lies.
fn skin_under_fog(gap: f64) -> String {
    let (skin, fog) = (
        box_shape([-2.0, -2.0, -0.5], [2.0, 2.0, 0.0]),
        box_shape([-1.0, -1.0, gap], [1.0, 1.0, 1.0]),
    );
    format!(
        "Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8\n\
         PixelFilter \"box\"\nSampler \"random\" \"integer pixelsamples\" 16\n\
         Integrator \"volpath\" \"integer maxdepth\" 6\n\
         LookAt 0 -2 4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 30\nWorldBegin\n\
         LightSource \"infinite\" \"rgb L\" [1 1 1]\n{}\
         AttributeBegin Material \"subsurface\" \"rgb sigma_a\" [.02 .05 .1] \"rgb sigma_s\" [8 6 9] \"float scale\" 1\n{skin} AttributeEnd\n\
         AttributeBegin Material \"\" MediumInterface \"thick\" \"\"\n{fog} AttributeEnd\nWorldEnd\n",
        homogeneous("thick", [0.6, 0.2, 0.1], [0.3, 0.5, 0.9], 0.0),
    )
}

#[test]
fn light_comes_out_of_skin_into_the_fog_on_it() {
    let (apart, _) = means(&skin_under_fog(GAP));
    let (together, counters) = means(&skin_under_fog(0.0));
    assert_sound(&counters, "skin under fog");
    for (a, b) in apart.iter().zip(&together) {
        a.agrees_with_mean(b).assert_accepted("skin under fog");
    }
}
