//! What happens along one path, told to whoever watches. Nobody does while a picture is rendered: the watcher is a type
//! parameter, so that looking away costs nothing.

use crate::ids::{InstanceId, LightId, MaterialId, MediumId};
use crate::math::{Normal3, Point3, Ray, Vec3};
use crate::shape::Place;
use crate::spectrum::Rgb;
use crate::world::{ElementRef, Hit};

/// Someone who follows a path.
pub trait Observer {
    /// Whether it wants to know anything at all; if not, events are not even put together.
    const LOOKS: bool;

    /// Something happened.
    fn see(&mut self, event: Event);
}

/// Nobody.
#[derive(Clone, Copy, Debug)]
pub struct Unobserved;

impl Observer for Unobserved {
    const LOOKS: bool = false;

    fn see(&mut self, _event: Event) {}
}

/// Remembers everything in order.
#[derive(Clone, Debug, Default)]
pub struct Log {
    /// What happened.
    pub events: Vec<Event>,
}

impl Observer for Log {
    const LOOKS: bool = true;

    fn see(&mut self, event: Event) {
        self.events.push(event);
    }
}

/// Something that happened to a path. Places and lengths are in render space; throughputs are those of the whole path
/// so far. The sum of everything `added` is the radiance of the path.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Event {
    /// The path goes on along a ray.
    Segment {
        /// The ray.
        ray: Ray,
        /// The medium it is in.
        medium: MediumId,
        /// Throughput.
        beta: Rgb,
    },
    /// It reached the end of the segment in a medium.
    Passed {
        /// Factor of the throughput.
        weight: Rgb,
    },
    /// It collided with a medium, and scatters there.
    Collided {
        /// Distance along the segment.
        t: f32,
        /// Factor of the throughput.
        weight: Rgb,
    },
    /// Light of a point is sampled on the segment, apart from where the path goes on.
    Lit {
        /// Distance along the segment.
        t: f32,
    },
    /// It met a surface.
    Met {
        /// Distance along the segment.
        t: f32,
        /// What it met.
        target: ElementRef,
        /// The instance that is part of, if any.
        instance: InstanceId,
        /// Where.
        p: Point3,
        /// Geometric normal.
        ng: Normal3,
        /// Shading normal.
        ns: Normal3,
        /// The material; `NONE` is a null surface.
        material: MaterialId,
    },
    /// It left the scene.
    Left,
    /// It found light.
    Found {
        /// The lamp; `NONE` is all light from infinity.
        light: LightId,
        /// Radiance, weighed against the light sampling at the vertex before.
        radiance: Rgb,
        /// Contribution to the picture.
        added: Rgb,
    },
    /// It crossed a null surface.
    Crossed {
        /// The medium behind it.
        medium: MediumId,
    },
    /// Light was sampled.
    Sampled {
        /// Unit direction toward it.
        wi: Vec3,
        /// Radiance, or irradiance of a light without extent.
        radiance: Rgb,
        /// Density per steradian, or the probability of a light without extent.
        pdf: f32,
        /// What is scattered toward the viewer, cosine included.
        f: Rgb,
        /// Weight against finding it by chance.
        weight: f32,
        /// Part that arrives, if there was anything to lose on the way.
        transmittance: Option<Rgb>,
        /// Contribution to the picture.
        added: Rgb,
    },
    /// It scattered, at a surface or in a medium.
    Scattered {
        /// Unit direction it goes on in.
        wi: Vec3,
        /// Density per steradian; `None` for a direction without alternative.
        pdf_w: Option<f32>,
        /// Factor of the throughput.
        weight: Rgb,
        /// Whether it went through the surface; `None` in a medium.
        transmitted: Option<bool>,
        /// The medium it goes on in.
        medium: MediumId,
    },
    /// It wandered below a surface.
    Surfaced {
        /// Where it came out.
        p: Point3,
        /// Factor of the throughput.
        weight: Rgb,
    },
    /// It survived Russian roulette.
    Survived {
        /// The chance to end it had.
        p_end: f32,
    },
    /// It goes on in several ways, one after the other.
    Forked {
        /// Their number: each has this part of the throughput.
        n_ways: u32,
    },
    /// It returned to where it forked, to scatter there once more.
    Returned {
        /// Where.
        p: Point3,
        /// Throughput.
        beta: Rgb,
    },
    /// It ended.
    Ended {
        /// Why.
        why: &'static str,
    },
}

impl Event {
    /// A surface was met.
    pub fn met(hit: &Hit, place: &Place, material: MaterialId) -> Self {
        Self::Met {
            t: hit.at.t,
            target: hit.target,
            instance: hit.instance,
            p: place.p,
            ng: place.ng,
            ns: place.ns,
            material,
        }
    }
}
