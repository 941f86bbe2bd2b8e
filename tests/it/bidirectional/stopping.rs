//! Metropolis light transport that is stopped: while it looks for light, and within a chain.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use tyndall::render::{Job, Progress, Rendered, render};

use crate::bidirectional::setup::{CAMERA, LIGHTS, ROOM, job};

/// Asks to stop once so many samples are taken, and remembers the most it heard of.
struct StopAfter {
    limit: u64,
    cancel: AtomicBool,
    heard: AtomicU64,
    total: AtomicU64,
}

impl Progress for StopAfter {
    fn samples_done(&self, done: u64, total: u64) {
        assert!(done <= total, "{done} of {total}");
        self.heard.fetch_max(done, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
        if done >= self.limit {
            self.cancel.store(true, Ordering::Relaxed);
        }
    }
}

fn stopped_after(limit: u64, job: &Job) -> (Rendered, StopAfter) {
    let watch = StopAfter {
        limit,
        cancel: AtomicBool::new(false),
        heard: AtomicU64::new(0),
        total: AtomicU64::new(0),
    };
    let rendered = render(job, &watch, &watch.cancel);
    (rendered, watch)
}

fn lit_room(parameters: &str) -> Job {
    let integrator = format!("\"mlt\" \"integer maxdepth\" 4 {parameters}");
    job(&integrator, CAMERA, 1, &format!("{ROOM}{}", LIGHTS[6].1))
}

#[test]
fn the_search_for_light_can_be_stopped_and_leaves_a_black_picture() {
    // Hours of it.
    let job = lit_room("\"integer bootstrapsamples\" 13000000 \"integer chains\" 10");
    let (rendered, watch) = stopped_after(1000, &job);
    assert!(rendered.report.cancelled);
    assert!(!rendered.report.found_no_light, "that is not known");
    assert_eq!(rendered.report.samples, 0);
    assert!(rendered.image.data().iter().all(|&x| x == 0.0));
    let heard = watch.heard.into_inner();
    assert!((1000..100_000).contains(&heard), "{heard}");
}

#[test]
fn a_chain_can_be_stopped_and_leaves_its_part_of_the_picture() {
    let bootstrap = 5 * 500;
    let job = lit_room(
        "\"integer bootstrapsamples\" 500 \"integer chains\" 1 \
         \"integer mutationsperpixel\" 1000000",
    );
    let (rendered, watch) = stopped_after(bootstrap + 20_000, &job);
    assert!(rendered.report.cancelled);
    let n_mutations = rendered.report.samples;
    assert!((20_000..100_000).contains(&n_mutations), "{n_mutations}");
    let heard = watch.heard.into_inner();
    assert_eq!(heard, bootstrap + n_mutations);
    // As bright as a whole one.
    let mean = |rendered: &Rendered| {
        let data = rendered.image.data();
        data.iter().map(|&x| f64::from(x)).sum::<f64>() / data.len() as f64
    };
    let whole = lit_room("\"integer bootstrapsamples\" 500 \"integer mutationsperpixel\" 200");
    let (whole, watch) = stopped_after(u64::MAX, &whole);
    assert!(!whole.report.cancelled);
    assert_eq!(
        watch.heard.into_inner(),
        watch.total.into_inner(),
        "progress ends at its end"
    );
    let ratio = mean(&rendered) / mean(&whole);
    assert!((0.7..1.4).contains(&ratio), "{ratio}");
}
