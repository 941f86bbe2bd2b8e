//! Generated scenes: shapes, materials, lights and media of many kinds, as scene text in any unit of length.
//!
//! Numbers are multiples of powers of two with few digits, so that scaling by a power of two and writing them out loses
//! nothing in single precision.

use proptest::prelude::*;

use crate::common::solids::{V, null_sphere};

/// A shape at its place.
#[derive(Clone, Debug)]
pub(crate) struct Thing {
    shape: usize,
    material: usize,
    place: [i16; 3],
    size: u8,
    axis: [i8; 3],
    angle: u16,
    /// Hyperboloids are as their segment sweeps them.
    is_swept: bool,
}

/// A light.
#[derive(Clone, Debug)]
pub(crate) struct Lamp {
    kind: usize,
    place: [i16; 3],
    colour: [u8; 3],
}

/// A medium in a ball around the middle.
#[derive(Clone, Debug)]
pub(crate) struct Fog {
    is_grid: bool,
    sigma_a: [u8; 3],
    sigma_s: [u8; 3],
    g: i8,
    density: Vec<u8>,
}

/// A scene seen from a distance of 6 units.
#[derive(Clone, Debug)]
pub(crate) struct Still {
    pub(crate) integrator: &'static str,
    pub(crate) things: Vec<Thing>,
    pub(crate) lamps: Vec<Lamp>,
    fog: Option<Fog>,
    eye: [i16; 2],
}

/// Materials that draw directions from densities alone.
const ROUGH: [&str; 5] = [
    "\"matte\" \"rgb Kd\" [.5 .7 .9]",
    "\"matte\" \"rgb Kd\" [.9 .5 .3] \"float sigma\" 25",
    "\"plastic\" \"rgb Kd\" [.4 .2 .1] \"rgb Ks\" [.3 .3 .3] \"float roughness\" .2",
    "\"metal\" \"float roughness\" .2",
    "\"substrate\" \"float uroughness\" .2 \"float vroughness\" .4",
];
/// And those that mirror or let light through.
const CLEAR: [&str; 5] = [
    "\"mirror\"",
    "\"glass\"",
    "\"glass\" \"float uroughness\" .2 \"float vroughness\" .2",
    "\"uber\" \"rgb Kd\" [.3 .3 .3] \"rgb Kr\" [.2 .2 .2] \"rgb opacity\" [.5 .7 .9]",
    "\"translucent\" \"float roughness\" .3",
];
/// Textures, in any order, and materials that look at them.
pub(crate) const TEXTURES: [&str; 4] = [
    "Texture \"squares\" \"spectrum\" \"checkerboard\" \"float uscale\" 6 \"float vscale\" 4 \"rgb tex1\" [.9 .6 .2] \"rgb tex2\" [.1 .3 .7]\n",
    "Texture \"waves\" \"float\" \"windy\"\n",
    "Texture \"folds\" \"float\" \"wrinkled\" \"integer octaves\" 4\n",
    "Texture \"clouds\" \"spectrum\" \"marble\" \"float scale\" 2\n",
];
const TEXTURED: [&str; 4] = [
    "\"matte\" \"texture Kd\" \"squares\"",
    "\"matte\" \"texture Kd\" \"clouds\" \"texture bumpmap\" \"waves\"",
    "\"plastic\" \"texture Kd\" \"squares\" \"texture bumpmap\" \"folds\"",
    "\"disney\" \"texture color\" \"clouds\" \"float roughness\" .4 \"float metallic\" .3",
];
/// Number of shapes.
pub(crate) const SHAPES: usize = 10;
/// The last of them.
pub(crate) const CURVE: usize = SHAPES - 1;
const N_LAMPS: usize = 6;

fn place() -> impl Strategy<Value = [i16; 3]> {
    // Up to 2 units from the middle, in steps of 1/64.
    [-128i16..=128, -128i16..=128, -128i16..=128]
}

pub(crate) fn thing(n_materials: usize) -> impl Strategy<Value = Thing> {
    (
        0..SHAPES,
        0..n_materials,
        place(),
        4u8..20,
        [-9i8..=9, -9i8..=9, 1i8..=9],
        1u16..360,
    )
        .prop_map(|(shape, material, place, size, axis, angle)| Thing {
            shape,
            material,
            place,
            size,
            axis,
            angle,
            is_swept: false,
        })
}

fn lamp() -> impl Strategy<Value = Lamp> {
    (0..N_LAMPS, place(), [1u8..=32, 1u8..=32, 1u8..=32]).prop_map(|(kind, place, colour)| Lamp {
        kind,
        place,
        colour,
    })
}

fn fog() -> impl Strategy<Value = Fog> {
    let colour = || [0u8..=16, 0u8..=16, 0u8..=16];
    (
        any::<bool>(),
        colour(),
        colour(),
        -7i8..=7,
        proptest::collection::vec(0u8..=8, 27),
    )
        .prop_map(|(is_grid, sigma_a, sigma_s, g, density)| Fog {
            is_grid,
            sigma_a,
            sigma_s,
            g,
            density,
        })
}

/// Scenes without a medium and of all materials; those with textures look at [`TEXTURES`]. With `is_calm`, nothing mirrors
/// or refracts.
pub(crate) fn decorated(
    integrators: &'static [&'static str],
    is_calm: bool,
) -> impl Strategy<Value = Still> {
    let n_materials = ROUGH.len() + CLEAR.len() + TEXTURED.len();
    let calm = move |material: usize| {
        if is_calm && (ROUGH.len()..ROUGH.len() + CLEAR.len()).contains(&material) {
            material - ROUGH.len()
        } else {
            material
        }
    };
    (
        proptest::sample::select(integrators),
        proptest::collection::vec(thing(n_materials), 1..7),
        proptest::collection::vec(lamp(), 1..5),
        [-32i16..=32, -32i16..=32],
    )
        .prop_map(move |(integrator, mut things, lamps, eye)| {
            for thing in &mut things {
                thing.material = calm(thing.material);
            }
            Still {
                integrator,
                things,
                lamps,
                fog: None,
                eye,
            }
        })
}

/// Scenes for some integrators. With `is_calm`, nothing mirrors or refracts, so that means have small errors.
pub(crate) fn still(
    integrators: &'static [&'static str],
    is_calm: bool,
) -> impl Strategy<Value = Still> {
    let n_materials = if is_calm {
        ROUGH.len()
    } else {
        ROUGH.len() + CLEAR.len()
    };
    (
        proptest::sample::select(integrators),
        proptest::collection::vec(thing(n_materials), 1..7),
        proptest::collection::vec(lamp(), 1..5),
        proptest::option::of(fog()),
        [-32i16..=32, -32i16..=32],
    )
        .prop_map(|(integrator, mut things, lamps, fog, eye)| {
            if fog.is_some() {
                // Rays leave a curve two widths away from it, as in pbrt-v3, and so may pass the boundary of the fog
                // without having met it.
                for thing in &mut things {
                    thing.shape = thing.shape.min(CURVE - 1);
                }
            }
            Still {
                integrator,
                things,
                lamps,
                fog,
                eye,
            }
        })
}

/// Numbers times a factor; with a point or an exponent, since integers of the format end at 2⁶³.
fn numbers(values: &[f64], factor: f64) -> String {
    let words: Vec<String> = values.iter().map(|x| format!("{:?}", x * factor)).collect();
    words.join(" ")
}

fn in_units(place: [i16; 3]) -> V {
    place.map(|x| f64::from(x) / 64.0)
}

/// How a thing is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Form {
    Plain,
    /// As an object that is placed once.
    Object,
    /// As an object that is placed twice: the second time below, where a ball hides it.
    Twice,
    /// As an object that moves, after the shutter has closed.
    Moving,
    /// Under transforms that undo each other.
    Nested,
    /// With the normals of quadrics and curves turned around, as a mirrored current transform turns them.
    Reversed,
}

/// Where the second copies of [`Form::Twice`] are.
const HIDEOUT: &str = "0 -60 0";
/// What hides them, and what undoes itself.
pub(crate) const HIDING_BALL: &str = "AttributeBegin Material \"matte\" Translate 0 -60 0 Shape \"sphere\" \"float radius\" 8 AttributeEnd\n";
const THERE_AND_BACK: &str = "Translate 3 -2 1 Rotate 30 0 1 0 Scale 2 2 2 Translate .3 .1 .7 \
     Translate -.3 -.1 -.7 Scale .5 .5 .5 Rotate -30 0 1 0 Translate -3 2 -1";

impl Thing {
    /// Its shape, a number below [`SHAPES`].
    pub(crate) fn shape(&self) -> usize {
        self.shape
    }

    /// Hyperboloids without a bend: the segment of others does not sweep the surface that is shown, and parameters and
    /// normals are those of the segment.
    pub(crate) fn on_its_segment(mut self) -> Self {
        self.is_swept = true;
        self
    }

    /// The same of glass or as a mirror.
    pub(crate) fn clear(&self, is_glass: bool) -> Self {
        Self {
            material: ROUGH.len() + usize::from(is_glass),
            ..self.clone()
        }
    }

    pub(crate) fn text(&self, s: f64, form: Form, name: usize) -> String {
        let r = f64::from(self.size) / 16.0;
        let n = |values: &[f64]| numbers(values, s);
        let corners = n(&[-r, -r, -r, r, r, -r, r, -r, r, -r, r, r]);
        let sides = "\"integer indices\" [0 1 2  0 3 1  0 2 3  1 3 2]";
        let shape = match self.shape {
            0 => format!("\"sphere\" \"float radius\" {}", n(&[r])),
            1 => format!(
                "\"sphere\" \"float radius\" {} \"float zmin\" {} \"float phimax\" 270",
                n(&[r]),
                n(&[-0.5 * r])
            ),
            2 => format!(
                "\"disk\" \"float radius\" {} \"float innerradius\" {}",
                n(&[r]),
                n(&[0.5 * r])
            ),
            3 => format!(
                "\"cylinder\" \"float radius\" {} \"float zmin\" {} \"float zmax\" {}",
                n(&[0.5 * r]),
                n(&[-r]),
                n(&[r])
            ),
            4 => format!(
                "\"cone\" \"float radius\" {} \"float height\" {}",
                n(&[r]),
                n(&[2.0 * r])
            ),
            5 => format!(
                "\"paraboloid\" \"float radius\" {} \"float zmax\" {}",
                n(&[r]),
                n(&[r])
            ),
            6 => format!(
                "\"hyperboloid\" \"point p1\" [{}] \"point p2\" [{}]",
                n(&[r, 0.0, -r]),
                n(&if self.is_swept {
                    [0.0, r, r]
                } else {
                    [0.5 * r, 0.5 * r, r]
                })
            ),
            7 => format!("\"trianglemesh\" \"point P\" [{corners}] {sides}"),
            8 => format!("\"loopsubdiv\" \"integer levels\" 2 \"point P\" [{corners}] {sides}"),
            _ => format!(
                "\"curve\" \"string type\" \"cylinder\" \"float width\" {} \"point P\" [{corners}]",
                n(&[0.25 * r])
            ),
        };
        let material = ROUGH
            .iter()
            .chain(&CLEAR)
            .chain(&TEXTURED)
            .nth(self.material)
            .expect("a material");
        let [x, y, z] = self.axis;
        let body = format!(
            "Material {material} Translate {} Rotate {} {x} {y} {z} Shape {shape}",
            n(&in_units(self.place)),
            self.angle
        );
        let object = format!("ObjectBegin \"{name}\" {body} ObjectEnd\n");
        let place = format!("ObjectInstance \"{name}\"");
        match form {
            Form::Plain => format!("AttributeBegin {body} AttributeEnd\n"),
            Form::Object => format!("{object}{place}\n"),
            Form::Twice => format!(
                "{object}{place}\nAttributeBegin Translate {HIDEOUT} {place} AttributeEnd\n"
            ),
            Form::Moving => format!(
                "{object}AttributeBegin ActiveTransform EndTime Translate .25 .5 0 ActiveTransform All {place} AttributeEnd\n"
            ),
            Form::Nested => format!("AttributeBegin {THERE_AND_BACK} {body} AttributeEnd\n"),
            Form::Reversed if (7..=8).contains(&self.shape) => {
                format!("AttributeBegin {body} AttributeEnd\n")
            }
            Form::Reversed => format!("AttributeBegin ReverseOrientation {body} AttributeEnd\n"),
        }
    }
}

impl Lamp {
    fn text(&self, s: f64) -> String {
        let colour = self.colour.map(|c| f64::from(c) / 8.0);
        let radiance = numbers(&colour, 1.0);
        let intensity = numbers(&colour, s * s);
        // Above everything, so that lamps hide little.
        let [x, y, z] = in_units(self.place);
        let at = numbers(&[x, y + 4.0, z], s);
        let area = |shape: &str| {
            format!(
                "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [{radiance}] Translate {at} {shape} AttributeEnd\n"
            )
        };
        let n = |values: &[f64]| numbers(values, s);
        match self.kind {
            // Its "from" is added in world space, whatever turns the scene.
            0 => format!(
                "AttributeBegin Translate {at} LightSource \"point\" \"rgb I\" [{intensity}] AttributeEnd\n"
            ),
            1 => format!(
                "LightSource \"spot\" \"rgb I\" [{intensity}] \"point from\" [{at}] \"point to\" [0 0 0]\n"
            ),
            2 => format!(
                "LightSource \"distant\" \"rgb L\" [{radiance}] \"point from\" [{at}] \"point to\" [0 0 0]\n"
            ),
            3 => format!(
                "LightSource \"infinite\" \"rgb L\" [{}]\n",
                numbers(&colour, 0.25)
            ),
            4 => area(&format!("Shape \"sphere\" \"float radius\" {}", n(&[0.5]))),
            _ => area(&format!(
                "Shape \"trianglemesh\" \"point P\" [{}] \"integer indices\" [0 1 2]",
                n(&[-0.5, 0.0, -0.5, 0.5, 0.0, -0.5, 0.0, 0.0, 0.5])
            )),
        }
    }
}

impl Fog {
    fn text(&self, s: f64) -> String {
        let sigma = |c: [u8; 3]| numbers(&c.map(|c| f64::from(c) / 16.0), 1.0 / s);
        let kind = if self.is_grid {
            let density: Vec<f64> = self.density.iter().map(|d| f64::from(*d) / 4.0).collect();
            format!(
                "\"string type\" \"heterogeneous\" \"integer nx\" 3 \"integer ny\" 3 \"integer nz\" 3 \
                 \"point p0\" [{}] \"point p1\" [{}] \"float density\" [{}]",
                numbers(&[-2.5; 3], s),
                numbers(&[2.5; 3], s),
                numbers(&density, 1.0)
            )
        } else {
            "\"string type\" \"homogeneous\"".to_owned()
        };
        format!(
            "MakeNamedMedium \"fog\" {kind} \"float g\" {} \"rgb sigma_a\" [{}] \"rgb sigma_s\" [{}]\n",
            f64::from(self.g) / 8.0,
            sigma(self.sigma_a),
            sigma(self.sigma_s),
        ) + &null_sphere([0.0; 3], 2.75 * s, "fog", "")
    }
}

/// Where a scene stands: directives behind `LookAt`, and the same undone at the beginning of the world.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stand {
    pub(crate) camera: String,
    pub(crate) world: String,
}

impl Still {
    /// Without balls that emit: in pbrt-v3 quadrics that are mirrored shine inward.
    pub(crate) fn without_shining_balls(mut self) -> Self {
        for lamp in &mut self.lamps {
            if lamp.kind == 4 {
                lamp.kind = 5;
            }
        }
        self
    }

    /// The scene in units of `s`, with `before` at the beginning of its world.
    pub(crate) fn text(&self, s: f64, stand: &Stand, before: &str) -> String {
        self.text_with(s, stand, before, Form::Plain)
    }

    /// The same with its things written so.
    pub(crate) fn text_with(&self, s: f64, stand: &Stand, before: &str, form: Form) -> String {
        let [x, y] = self.eye.map(|x| f64::from(x) / 16.0);
        let eye = numbers(&[x, y, -6.0], s);
        let things: String = (self.things.iter().enumerate())
            .map(|(name, thing)| thing.text(s, form, name))
            .collect();
        let lamps: String = self.lamps.iter().map(|lamp| lamp.text(s)).collect();
        let fog = self.fog.as_ref().map(|fog| fog.text(s)).unwrap_or_default();
        let Stand { camera, world } = stand;
        let depth = if self.integrator == "directlighting" {
            2
        } else {
            5
        };
        format!(
            "Film \"image\" \"integer xresolution\" 12 \"integer yresolution\" 8\nPixelFilter \"box\"\n\
             Sampler \"halton\" \"integer pixelsamples\" 4\n\
             Integrator \"{}\" \"integer maxdepth\" {depth}\n\
             LookAt {eye} 0 0 0 0 1 0 {camera}\nCamera \"perspective\" \"float fov\" 50\n\
             WorldBegin {world}\n{before}{fog}{lamps}{things}WorldEnd\n",
            self.integrator
        )
    }
}
