//! The camera of the options block.

use glam::DVec3;
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema::Family;

use crate::camera::{Camera, Environment, Orthographic, Perspective, Projection, Screen, ThinLens};
use crate::compile::assets::Assets;
use crate::compile::options::FilmOptions;
use crate::compile::placement::{Placement, placement};
use crate::compile::reader::ParamReader;
use crate::compile::space::{RenderSpace, View};
use crate::compile::{lens, lookup};
use crate::describe::description::Frame;
use crate::math::{Motion, MotionChain, Transform};

/// A camera that waits for its place in render space.
pub(super) struct CameraOptions {
    world_from_camera: Placement,
    projection: Projection,
    shutter: [f32; 2],
}

impl CameraOptions {
    /// What the camera sees, as it stands at first. Where rays are not straight from the film on, that is not asked.
    pub(super) fn view(&self, resolution: [u32; 2]) -> View {
        let [world_from_camera, _] = self.world_from_camera.ends();
        let eye = world_from_camera.point(DVec3::ZERO);
        let [width, height] = resolution.map(f64::from);
        let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
        let ray = |raster: [f64; 2]| {
            let ray = self.projection.chief_ray(raster)?;
            let o = world_from_camera.point(ray.o);
            Some((o, o + world_from_camera.vector(ray.d)))
        };
        let planes = || {
            let (mut rays, mut planes) = ([(eye, eye); 4], [(eye, eye); 4]);
            for (ray_there, raster) in rays.iter_mut().zip(corners) {
                *ray_there = ray(raster)?;
            }
            let inside = rays.iter().map(|(_, to)| *to).sum::<DVec3>() * 0.25;
            for (k, plane) in planes.iter_mut().enumerate() {
                let ((o, to), (_, next)) = (rays[k], rays[(k + 1) % 4]);
                let n = (to - o).cross(next - to);
                *plane = (o, if n.dot(inside - o) < 0.0 { -n } else { n });
            }
            let [a, b, c, d] = planes;
            let ahead = (eye, world_from_camera.vector(DVec3::Z));
            Some([a, b, c, d, ahead])
        };
        let planes = planes();
        View { eye, planes }
    }

    /// Times in which rays exist.
    pub(super) fn shutter(&self) -> [f64; 2] {
        self.shutter.map(f64::from)
    }

    pub(super) fn place(self, space: &RenderSpace) -> Camera {
        let render_from_camera = match self.world_from_camera {
            Placement::Still(transform) => Motion::Still(space.place(&transform)),
            Placement::Moving(moving) => Motion::Moving(Box::new(MotionChain {
                outer: space.place(&Transform::IDENTITY),
                links: vec![*moving],
                inner: Transform::IDENTITY,
            })),
        };
        Camera::new(self.projection, render_from_camera, self.shutter)
    }
}

/// Reads the camera. Without one nothing is rendered; the diagnostics then say why.
pub(super) fn camera(
    frame: &Frame,
    film: Option<&FilmOptions>,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<CameraOptions> {
    let entity = &frame.camera.entity;
    let plugin = lookup(
        Family::Camera,
        &entity.kind,
        "nothing is rendered",
        diagnostics,
    )?;
    let pair = frame.camera.world_from_camera;
    let world_from_camera = placement(pair, frame.transform_times, entity.span, diagnostics);
    let mut p = ParamReader::new(plugin, entity, diagnostics);
    let shutter = shutter(&mut p);
    // Read the camera even without a film, so that all faults are reported at once.
    let resolution = film.map_or([1, 1], |film| film.desc.resolution);
    let projection = match plugin.schema.name {
        "perspective" => perspective(&mut p, resolution).map(Projection::Perspective),
        "orthographic" => {
            let (window, lens) = (screen_window(&mut p, resolution), thin_lens(&mut p));
            Some(Projection::Orthographic(Orthographic::new(
                window, resolution, lens,
            )))
        }
        "environment" => Some(Projection::Environment(Environment::new(resolution))),
        _ => {
            // A table without a film has no camera: the film's own fault is reported.
            let diagonal = film.map(|film| film.diagonal);
            diagonal
                .and_then(|diagonal| lens::realistic(&mut p, diagonal, resolution, shutter, assets))
                .map(|camera| Projection::Realistic(Box::new(camera)))
        }
    };
    p.finish();
    Some(CameraOptions {
        world_from_camera: world_from_camera?,
        projection: projection?,
        shutter,
    })
}

fn perspective(p: &mut ParamReader<'_>, resolution: [u32; 2]) -> Option<Perspective> {
    let window = screen_window(p, resolution);
    let lens = thin_lens(p);
    let half_fov = p.optional_float("halffov").filter(|half| *half > 0.0);
    let fov = half_fov.map_or_else(|| p.float("fov") as f64, |half| 2.0 * half as f64);
    if !(fov > 0.0 && fov < 180.0) {
        let message = format!("a field of view of {fov} degrees cannot be drawn");
        let span = p.span(if half_fov.is_some() { "halffov" } else { "fov" });
        p.report(
            Diagnostic::fatal("bad-camera", span, message)
                .with_help("it must be between 0 and 180 degrees"),
        );
        return None;
    }
    Some(Perspective::new(fov.to_radians(), window, resolution, lens))
}

fn shutter(p: &mut ParamReader<'_>) -> [f32; 2] {
    let mut shutter = [p.float("shutteropen"), p.float("shutterclose")];
    if shutter[0] > shutter[1] {
        let span = p.span("shutterclose");
        let message = "the shutter closes before it opens: the times are swapped";
        p.report(Diagnostic::warning("swapped-shutter", span, message));
        shutter.swap(0, 1);
    }
    shutter
}

/// x0, x1, y0, y1 of the screen window.
fn screen_window(p: &mut ParamReader<'_>, resolution: [u32; 2]) -> [f64; 4] {
    let [width, height] = resolution.map(f64::from);
    let aspect = p
        .optional_float("frameaspectratio")
        .map_or(width / height, f64::from);
    p.floats::<4>("screenwindow").map_or_else(
        || Screen::default_window(aspect),
        |window| window.map(f64::from),
    )
}

fn thin_lens(p: &mut ParamReader<'_>) -> ThinLens {
    ThinLens {
        radius: f64::from(p.float("lensradius")),
        focal_distance: f64::from(p.float("focaldistance")),
    }
}
