//! One function for each target: bytes in, and a panic where a promise is broken.

use std::sync::Arc;

use tyndall::compile::{Assets, CompileOptions, compile};
use tyndall::describe::describe;
use tyndall::describe::description::Frame;
use tyndall::image::Image;
use tyndall::image::codec::{self, ImageFile, Precision};
use tyndall::image::ptex::Ptex;
use tyndall::math::{Point3, Vec3};
use tyndall::scatter::{TransportMode, fourier};
use tyndall::shape::ply::{self, Route};
use tyndall::texture::TextureContext;
use tyndall::texture::ptex::filtered;
use tyndall_parser::diagnostic::{Diagnostics, Style};
use tyndall_parser::params::{ParamClass, ParamValue};
use tyndall_parser::source::{SourceBytes, Sources, Spanned};
use tyndall_parser::{LoadError, Loaded, Loader, SceneFile, print};

/// An entry point.
pub type Entry = fn(&[u8]);

/// All entry points, by the names of their targets.
pub const ENTRIES: [(&str, Entry); 14] = [
    ("parse", parse),
    ("describe", describe_scene),
    ("check", check),
    ("ply", ply),
    ("exr", exr),
    ("png", png),
    ("pfm", pfm),
    ("tga", tga),
    ("hdr", hdr),
    ("jpeg", jpeg),
    ("spectrum", spectrum),
    ("fourier", fourier),
    ("lens", lens),
    ("ptex", ptex),
];

/// Scenes that scenes include.
const PARTS: [(&str, &str); 2] = [
    ("part.pbrt", "Shape \"sphere\" Include \"loop.pbrt\""),
    ("loop.pbrt", "AttributeBegin Include \"loop.pbrt\""),
];
const SPECTRUM: &str = "400 1\n500 0.5\n700 2\n";
const LENS: &str = "100 1 1.5 16\n0 1 0 10\n-100 50 1 16\n";
const MESH: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0\n3 0 1 2\n";

/// Levels of subdivision that are tried: each makes four triangles of one.
const MAX_LEVELS: i32 = 4;

/// The files of a scene. All of a kind are the same.
struct Files<'a> {
    /// What takes the place of all other files.
    given: Option<&'a [u8]>,
}

impl Loader for Files<'_> {
    fn load(&self, path: &str, _top_level: &str) -> Result<Loaded, LoadError> {
        let part = PARTS.iter().find(|(name, _)| *name == path);
        let (_, text) = part.ok_or_else(|| LoadError::new("it is not there"))?;
        Ok(Loaded {
            name: path.to_owned(),
            bytes: Arc::new(text.as_bytes().to_vec()),
        })
    }
}

impl Assets for Files<'_> {
    fn read(&self, path: &Spanned<String>) -> Result<SourceBytes, String> {
        if let Some(bytes) = self.given {
            return Ok(Arc::new(bytes.to_vec()));
        }
        let extension = path.value.rsplit('.').next().unwrap_or_default();
        let bytes = match extension {
            "ply" => MESH.into(),
            "spd" => SPECTRUM.into(),
            "dat" => LENS.into(),
            "exr" | "png" | "pfm" | "tga" => picture(extension),
            _ => return Err("it is not there".to_owned()),
        };
        Ok(Arc::new(bytes))
    }
}

fn picture(extension: &str) -> Vec<u8> {
    let data = (0..18).map(|k| k as f32 / 17.0).collect();
    let image = Image::new(3, 2, 3, data).expect("18 samples");
    codec::encode(&ImageFile::new(image), extension, Precision::Float).expect("it is written")
}

fn read(bytes: &[u8], files: &Files<'_>) -> (SceneFile, Diagnostics, Sources) {
    let mut sources = Sources::new();
    let root = sources.add_text("scene", bytes);
    let (scene, found) = tyndall_parser::parse(&mut sources, root, files);
    (scene, found, sources)
}

/// The lexer and the parser; what was understood is printed and means the same.
pub fn parse(bytes: &[u8]) {
    let (scene, found, sources) = read(bytes, &Files { given: None });
    let _ = found.render(&sources, Style::Plain);
    let text = print(&scene);
    let (again, _, _) = read(text.as_bytes(), &Files { given: None });
    assert_eq!(print(&again), text, "a printed scene reads differently");
}

/// The graphics state.
pub fn describe_scene(bytes: &[u8]) {
    let (scene, mut found, sources) = read(bytes, &Files { given: None });
    let (_, more) = describe(scene);
    found.extend(more);
    let _ = found.render(&sources, Style::Plain);
}

/// Everything up to the jobs, but for surfaces that are subdivided often. Every file named is sound.
pub fn check(bytes: &[u8]) {
    compiled(bytes, &Files { given: None }, |frame| !is_deep(frame));
}

/// What is said about a scene whose files are all sound.
pub fn findings(bytes: &[u8]) -> Diagnostics {
    compiled(bytes, &Files { given: None }, |_| true)
}

fn compiled(bytes: &[u8], files: &Files<'_>, is_tried: impl Fn(&Frame) -> bool) -> Diagnostics {
    let (scene, mut found, sources) = read(bytes, files);
    let (scene, more) = describe(scene);
    found.extend(more);
    for frame in scene.frames.into_iter().filter(is_tried) {
        let (_, more) = compile(frame, &CompileOptions::default(), files);
        found.extend(more);
    }
    let _ = found.render(&sources, Style::Plain);
    found
}

/// Whether a surface is subdivided so often that its triangles, of which there may be 16 million, drown all else.
fn is_deep(frame: &Frame) -> bool {
    let in_objects = frame.objects.iter().flat_map(|object| &object.shapes);
    frame.shapes.iter().chain(in_objects).any(|shape| {
        // Both names are read.
        ["levels", "nlevels"].into_iter().any(|name| {
            let levels = shape.entity.params.get(name, ParamClass::Integer);
            matches!(levels.map(|param| &param.value), Some(ParamValue::Integer(n)) if n.iter().any(|&n| n > MAX_LEVELS))
        })
    })
}

/// PLY meshes by both readers, which agree on the triangles.
pub fn ply(bytes: &[u8]) {
    let meshes = [Route::Fastest, Route::General].map(|route| ply::decode_by(bytes, route));
    for mesh in meshes.iter().flatten() {
        let n = mesh.positions.len();
        let inside = |corner: &u32| (*corner as usize) < n;
        assert!(mesh.triangles.iter().flatten().all(inside));
        assert!(mesh.normals.is_empty() || mesh.normals.len() == n);
        assert!(mesh.uvs.is_empty() || mesh.uvs.len() == n);
        assert!(mesh.uvs.iter().flatten().all(|x| x.is_finite()));
    }
    if let [Ok(fast), Ok(general)] = &meshes {
        assert_eq!(fast.triangles, general.triangles);
    }
}

fn image(bytes: &[u8], extension: &str) {
    if let Ok(file) = codec::decode(bytes, extension) {
        let image = file.image;
        let n_samples = image.width() * image.height() * image.channels();
        assert_eq!(image.data().len(), n_samples);
    }
}

/// OpenEXR pictures.
pub fn exr(bytes: &[u8]) {
    image(bytes, "exr");
}

/// PNG pictures.
pub fn png(bytes: &[u8]) {
    image(bytes, "png");
}

/// PFM pictures.
pub fn pfm(bytes: &[u8]) {
    image(bytes, "pfm");
}

/// TGA pictures.
pub fn tga(bytes: &[u8]) {
    image(bytes, "tga");
}

/// Radiance HDR pictures.
pub fn hdr(bytes: &[u8]) {
    image(bytes, "hdr");
}

/// JPEG pictures.
pub fn jpeg(bytes: &[u8]) {
    image(bytes, "jpg");
}

/// Spectra from files, as emission and as reflectance.
pub fn spectrum(bytes: &[u8]) {
    let scene = b"WorldBegin LightSource \"point\" \"spectrum I\" \"a.spd\" \
        Material \"matte\" \"spectrum Kd\" \"a.spd\" Shape \"sphere\" WorldEnd";
    compiled(scene, &Files { given: Some(bytes) }, |_| true);
}

/// Lenses of the realistic camera, with the bounds of their pupils.
pub fn lens(bytes: &[u8]) {
    let scene = b"Film \"image\" \"integer xresolution\" 9 \"integer yresolution\" 6 \
        Camera \"realistic\" \"string lensfile\" \"lens.dat\" \
        WorldBegin LightSource \"point\" Shape \"sphere\" WorldEnd";
    compiled(scene, &Files { given: Some(bytes) }, |_| true);
}

/// Tables of BSDFs, which scatter finite light.
pub fn fourier(bytes: &[u8]) {
    let Ok(table) = fourier::decode(bytes) else {
        return;
    };
    for z in [-1.0, -0.3, 0.01, 0.8, 1.0f32] {
        let wo = Vec3::new((1.0 - z * z).sqrt(), 0.0, z);
        for u in [0.0, 0.2, 0.6, 0.999] {
            let Some(wi) = table.sample(wo, u, [0.3, u]) else {
                continue;
            };
            assert!(wi.is_finite(), "{wi:?}");
            for mode in [TransportMode::Radiance, TransportMode::Importance] {
                let f = table.f(wo, wi, mode);
                assert!(f.is_finite() && f.min_component() >= 0.0, "{f:?}");
            }
            let pdf = table.pdf(wo, wi);
            assert!(pdf.is_finite() && pdf >= 0.0, "{pdf}");
        }
    }
}

/// Ptex files, looked up at corners and inside under short and long footprints.
pub fn ptex(bytes: &[u8]) {
    let Ok(file) = Ptex::decode(bytes, 1 << 24) else {
        return;
    };
    assert!(file.ptex.n_bytes() <= 1 << 24);
    for face in 0..file.ptex.faces().len().min(64) as u32 {
        for uv in [[0.0, 0.0], [1.0, 0.3], [0.4, 0.2], [0.2, 1.0]] {
            for size in [0.0, 0.07, 0.3, 0.7, 1e9] {
                let ctx = TextureContext {
                    duv_dx: [size, 0.0],
                    duv_dy: [0.1 * size, size],
                    face,
                    ..TextureContext::at_point(Point3::ZERO, uv)
                };
                assert!(filtered(&file.ptex, &ctx).iter().all(|x| x.is_finite()));
            }
        }
    }
}
