//! A picture that is built: rendered and written, or one of its paths followed, and what is to be said about it.

use std::time::Instant;

use tyndall_parser::diagnostic::{Diagnostic, Severity};
use tyndall_parser::source::Span;

use super::{Outputs, Picture, Session, seconds_since};
use crate::app::console;
use crate::app::outcome::Outcome;
use crate::app::output::Output;
use crate::app::plan::Task;
use crate::app::progress::Bar;
use crate::app::report::{PictureReport, RenderFacts};
use crate::app::trace;
use crate::compile::Compiled;
use crate::image::Image;
use crate::image::codec::Attribute;
use crate::integrator::Counters;
use crate::render::{Progress, Rendered, Unwatched, render};

impl Session<'_> {
    /// Renders and writes a picture, unless it is only checked.
    pub(super) fn finish(&mut self, picture: Picture) {
        if self.interrupt.is_wanted() {
            // The signal came while an earlier picture was being written.
            return self.raise(Outcome::Interrupted);
        }
        let Picture {
            compiled,
            integrator,
            output,
            mut report,
        } = picture;
        let interrupt = self.interrupt;
        interrupt.busy(|| {
            if let Some(job) = &report.job {
                self.console.detail(&job.text());
            }
            if let Task::Trace { pixel, sample } = self.plan.task {
                self.trace(&compiled, integrator, pixel, sample, &mut report);
            }
            if let Some(output) = output {
                self.render(&compiled, output, &mut report);
            }
        });
        self.add(report);
    }

    /// Follows one path and prints what happens to it.
    fn trace(
        &mut self,
        compiled: &Compiled,
        integrator: Span,
        pixel: [i32; 2],
        sample: u32,
        report: &mut PictureReport,
    ) {
        let job = &compiled.job;
        let ([x, y], spp) = (pixel, job.spp);
        let why = if !job.integrator.is_observable() {
            let name = compiled.integrator;
            Some(format!(
                "\"{name}\" cannot tell what happens along its paths"
            ))
        } else if sample >= spp {
            Some(format!(
                "there is no sample {sample} among {spp}, counted from 0"
            ))
        } else if !job.film.is_sampled(pixel) {
            let [width, height] = job.film.resolution;
            let frame = format!("a frame of {width} x {height}");
            Some(format!("no sample of pixel ({x}, {y}) counts in {frame}"))
        } else {
            None
        };
        if let Some(why) = why {
            self.stop("no-trace", Some(integrator), why);
            report.outcome = Outcome::Failed;
            return;
        }
        let (text, is_good) = trace::follow(compiled, pixel, sample);
        if !is_good {
            report.outcome = report.outcome.max(Outcome::LostSamples);
        }
        if let Err(why) = console::print(&text) {
            self.stop("unwritable-output", None, why);
            report.outcome = Outcome::Failed;
        }
    }

    fn render(&mut self, compiled: &Compiled, outputs: Outputs, report: &mut PictureReport) {
        let name = outputs.picture.place.name().display().to_string();
        let start = Instant::now();
        let rendered = {
            let bar = self.console.shows_progress().then(|| Bar::new(&name));
            let progress: &dyn Progress = match &bar {
                Some(bar) => bar,
                None => &Unwatched,
            };
            render(&compiled.job, progress, self.interrupt.flag())
        };
        report.seconds.render = seconds_since(start);
        let facts = RenderFacts::new(&rendered.report, report.seconds.render);
        self.console.detail(&facts.text());
        report.render = Some(facts);

        if rendered.report.found_no_light {
            let message = format!("no path that carries light was found: {name} is black");
            self.tell(Diagnostic::new(
                Severity::Warning,
                "no-light",
                None,
                message,
            ));
        }
        self.tell_of_media(&name, compiled, &rendered.report.counters);
        let lost = self.lost_samples(&name, compiled, &rendered);
        report.outcome = report.outcome.max(lost);
        if self.interrupt.is_wanted() && rendered.report.cancelled {
            report.outcome = Outcome::Interrupted;
        }
        let incomplete = match report.outcome {
            Outcome::Complete => None,
            outcome => Some((
                "tyndall/incomplete".to_owned(),
                Attribute::Text(outcome.explanation().to_owned()),
            )),
        };

        let start = Instant::now();
        let seconds = report.seconds.render;
        let how = if rendered.report.cancelled {
            ", partial"
        } else {
            ""
        };
        if let Some(name) = self.write(outputs.picture, rendered.image, &incomplete, report) {
            self.console
                .note(&format!("wrote {name} ({seconds:.2} s of rendering{how})"));
            report.file = Some(name);
        }
        for (output, image) in outputs.strategies.into_iter().zip(rendered.strategies) {
            let written = self.write(output, image, &incomplete, report);
            report.strategy_files.extend(written);
        }
        if let [first, .., last] = &report.strategy_files[..] {
            self.console.note(&format!(
                "wrote what single strategies find: {first} to {last}"
            ));
        }
        report.seconds.write = seconds_since(start);
    }

    /// Writes a picture and returns its name, or reports why it cannot.
    fn write(
        &mut self,
        mut output: Output,
        image: Image,
        incomplete: &Option<(String, Attribute)>,
        report: &mut PictureReport,
    ) -> Option<String> {
        output.attributes.extend(incomplete.clone());
        match output.write(image) {
            Ok(()) => Some(output.place.name().display().to_string()),
            Err(why) => {
                self.stop("unwritable-output", None, why);
                report.outcome = report.outcome.max(Outcome::Failed);
                None
            }
        }
    }

    /// Reports samples that are missing from a picture.
    fn lost_samples(&mut self, name: &str, compiled: &Compiled, rendered: &Rendered) -> Outcome {
        let Rendered {
            report,
            image,
            strategies,
        } = rendered;
        let plan = self.plan;
        let mut outcome = Outcome::Complete;
        let mut lost = |code, message, help: Option<String>| {
            let mut diagnostic = Diagnostic::new(Severity::Error, code, None, message);
            diagnostic.help = help;
            self.tell(diagnostic);
            outcome = Outcome::LostSamples;
        };
        if report.bad_samples > 0 {
            let first = report.first_bad_sample.map(|([x, y], sample)| {
                format!("; the first is sample {sample} of pixel ({x}, {y})")
            });
            let message = format!(
                "{} of {} samples of {name} are not finite or negative and were left out{}",
                report.bad_samples,
                report.samples,
                first.unwrap_or_default()
            );
            let command = report
                .first_bad_sample
                .filter(|_| compiled.job.integrator.is_observable())
                .map(|(pixel, sample)| plan.replay_command(pixel, sample));
            let help = command.map(|command| format!("to see how it comes about: {command}"));
            lost("bad-samples", message, help);
        }
        let n_stuck = report.counters.stuck_paths;
        if n_stuck > 0 {
            let message = format!(
                "{n_stuck} paths of {name} passed more surfaces in a row than there are and were given up"
            );
            lost("stuck-paths", message, None);
        }
        let n_stuck = report.counters.shadow.stuck;
        if n_stuck > 0 {
            let message = format!(
                "{n_stuck} rays toward lights of {name} passed more surfaces than there are and count as shadow"
            );
            lost("stuck-shadow-rays", message, None);
        }
        // Finite samples can still exceed single precision after the film's scale.
        let values = strategies.iter().chain([image]).flat_map(Image::data);
        let n_overflown = values.filter(|c| !c.is_finite()).count();
        if n_overflown > 0 {
            let message = format!("{n_overflown} numbers of {name} are not finite");
            lost("bad-pixels", message, None);
        }
        outcome
    }

    /// Reports boundaries of media that contradict each other. The picture is that of the declarations.
    fn tell_of_media(&mut self, name: &str, compiled: &Compiled, counters: &Counters) {
        let n_one_sided = counters.one_sided;
        if n_one_sided > 0 {
            let first = counters.first_one_sided;
            let span = first.and_then(|geometry| compiled.origins.of(geometry));
            let message = format!(
                "{n_one_sided} paths of {name} met a surface from a medium that is not declared on that side of it"
            );
            let mut diagnostic =
                Diagnostic::new(Severity::Warning, "one-sided-media", span, message);
            diagnostic.label =
                "this is the first: what it scatters back is in another medium".to_owned();
            diagnostic.help = Some(
                "where a surface does not end a medium, declare it on both sides: \
                 MediumInterface \"fog\" \"fog\""
                    .to_owned(),
            );
            self.tell(diagnostic);
        }
        let mut warn = |code, message| {
            self.tell(Diagnostic::new(Severity::Warning, code, None, message));
        };
        let n_mismatched = counters.mismatched();
        if n_mismatched > 0 {
            let message = format!(
                "{n_mismatched} boundaries in {name} were crossed from a medium that they do not border on: media \
                 overlap, or the one around the camera is declared wrongly"
            );
            warn("mismatched-media", message);
        }
        let n_leaked = counters.leaked_paths;
        if n_leaked > 0 {
            let message = format!(
                "{n_leaked} rays of {name} left the scene in a medium that has boundaries: one is open"
            );
            warn("leaked-paths", message);
        }
    }
}
