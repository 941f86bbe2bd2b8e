//! One path as text: what happened to it, event by event, in world space.

use std::fmt::Write;

use crate::compile::Compiled;
use crate::ids::MediumId;
use crate::integrator::trace::{Event, Log};
use crate::math::{Point3, Transform};
use crate::render::{Taken, retake};
use crate::spectrum::Rgb;

/// The log of a sample, and whether its radiance counts.
pub(super) fn follow(compiled: &Compiled, pixel: [i32; 2], sample: u32) -> (String, bool) {
    let mut log = Log::default();
    let taken = retake(&compiled.job, pixel, sample, &mut log);
    let writer = Writer {
        world_from_render: compiled.world_from_render,
        medium_names: &compiled.medium_names,
    };
    (
        writer.text(compiled, pixel, sample, &log, &taken),
        taken.is_good(&compiled.job),
    )
}

struct Writer<'a> {
    world_from_render: Transform,
    medium_names: &'a [String],
}

impl Writer<'_> {
    fn text(
        &self,
        compiled: &Compiled,
        [x, y]: [i32; 2],
        sample: u32,
        log: &Log,
        taken: &Taken,
    ) -> String {
        let job = &compiled.job;
        let [raster_x, raster_y] = taken.raster;
        let mut text = format!(
            "sample {sample} of {} of pixel ({x}, {y}), seed {}, integrator \"{}\", at ({raster_x}, {raster_y}) on the film\n",
            job.spp, job.seed, compiled.integrator
        );
        let mut n_segments = 0;
        for event in &log.events {
            if matches!(event, Event::Segment { .. }) {
                n_segments += 1;
                let _ = write!(text, "\n{n_segments:4} ");
            } else {
                text += "     ";
            }
            text += &self.line(event);
            text.push('\n');
        }
        let judgement = if taken.is_good(job) {
            "counts"
        } else {
            "is not finite or negative: the sample is left out"
        };
        let _ = writeln!(
            text,
            "\nradiance {}, of weight {}: {judgement}",
            rgb(taken.radiance),
            taken.weight
        );
        text
    }

    fn line(&self, event: &Event) -> String {
        match *event {
            Event::Segment { ray, medium, beta } => {
                let ([x, y, z], medium) = (ray.d.0.to_array(), self.medium(medium));
                let (from, beta) = (self.place(ray.o), rgb(beta));
                format!("ray from {from} toward ({x}, {y}, {z}), in {medium}, throughput {beta}")
            }
            Event::Passed { weight } => format!("passes the medium, weight {}", rgb(weight)),
            Event::Collided { t, weight } => {
                let (distance, weight) = (self.length(t), rgb(weight));
                format!("collides with the medium after {distance}, weight {weight}")
            }
            Event::Lit { t } => {
                format!(
                    "looks at a point light from the fog after {}",
                    self.length(t)
                )
            }
            Event::Met {
                t,
                target,
                instance,
                p,
                ng,
                ns,
                material,
            } => {
                let what = if material.is_some() {
                    format!("material {}", material.0)
                } else {
                    "no material".to_owned()
                };
                let copy = if instance.is_some() {
                    format!(" in instance {}", instance.0)
                } else {
                    String::new()
                };
                let [ng, ns] = [ng, ns].map(|n| n.0.to_array());
                format!(
                    "meets element {} of shape {}{copy} of {what} after {} at {}, normal {ng:?}, shading normal {ns:?}",
                    target.element,
                    target.geometry.0,
                    self.length(t),
                    self.place(p)
                )
            }
            Event::Left => "leaves the scene".to_owned(),
            Event::Found {
                light,
                radiance,
                added,
            } => {
                let what = if light.is_some() {
                    format!("light {}", light.0)
                } else {
                    "light from infinity".to_owned()
                };
                format!(
                    "finds {what}, weighed radiance {}: adds {}",
                    rgb(radiance),
                    rgb(added)
                )
            }
            Event::Crossed { medium } => format!("crosses into {}", self.medium(medium)),
            Event::Sampled {
                wi,
                radiance,
                pdf,
                f,
                weight,
                transmittance,
                added,
            } => {
                let arrives = transmittance.map_or_else(
                    || "not looked at".to_owned(),
                    |tr| format!("of which {} arrives", rgb(tr)),
                );
                let [x, y, z] = wi.0.to_array();
                format!(
                    "samples light toward ({x}, {y}, {z}), radiance {}, {arrives}, density {pdf}, scattered {}, \
                     weight {weight}: adds {}",
                    rgb(radiance),
                    rgb(f),
                    rgb(added)
                )
            }
            Event::Scattered {
                wi,
                pdf_w,
                weight,
                transmitted,
                medium,
            } => {
                let how = match transmitted {
                    Some(true) => "transmits",
                    Some(false) => "reflects",
                    None => "scatters",
                };
                let density =
                    pdf_w.map_or_else(|| "certain".to_owned(), |pdf| format!("density {pdf}"));
                let ([x, y, z], medium) = (wi.0.to_array(), self.medium(medium));
                format!(
                    "{how} toward ({x}, {y}, {z}) into {medium}, {density}, weight {}",
                    rgb(weight)
                )
            }
            Event::Surfaced { p, weight } => {
                format!(
                    "wanders below the surface to {}, weight {}",
                    self.place(p),
                    rgb(weight)
                )
            }
            Event::Survived { p_end } => {
                format!("survives roulette that would end it with {p_end}")
            }
            Event::Forked { n_ways } => format!("goes on in {n_ways} ways, one after the other"),
            Event::Returned { p, beta } => {
                format!(
                    "another way from {}, throughput {}",
                    self.place(p),
                    rgb(beta)
                )
            }
            Event::Ended { why } => format!("ends: {why}"),
        }
    }

    fn medium(&self, medium: MediumId) -> String {
        self.medium_names
            .get(medium.index())
            .map_or_else(|| "vacuum".to_owned(), |name| format!("\"{name}\""))
    }

    fn place(&self, p: Point3) -> String {
        let [x, y, z] = self.world_from_render.point(p.to_f64()).to_array();
        format!("({x}, {y}, {z})")
    }

    /// A length in world units.
    fn length(&self, t: f32) -> f64 {
        f64::from(t) * self.world_from_render.determinant().cbrt()
    }
}

fn rgb(colour: Rgb) -> String {
    let [r, g, b] = colour.to_array();
    format!("[{r} {g} {b}]")
}
