//! Photon mapping forgets: alone in its process, so that nobody else's memory is counted.

#![expect(clippy::print_stdout, reason = "a skipped test says so")]

#[path = "it/common/scene.rs"]
mod scene;

use std::sync::atomic::AtomicBool;

use tyndall::compile::CompileOptions;
use tyndall::render::{Unwatched, render};

/// Largest amount of memory the process ever had, in kilobytes, where the system tells.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

#[test]
fn l08_memory_does_not_grow_with_iterations() {
    let scene = "Film \"image\" \"integer xresolution\" 32 \"integer yresolution\" 32\n\
        Integrator \"sppm\" \"integer photonsperiteration\" 4000 \"float radius\" .2\n\
        WorldBegin LightSource \"point\" Material \"matte\" \"rgb Kd\" [.8 .8 .8]\n\
        Shape \"sphere\" \"float radius\" 2 WorldEnd";
    let mut job = scene::compile_scene(scene, &CompileOptions::default(), |_| None).job;
    let mut peak_after = |iterations: u32| {
        job.spp = iterations;
        let rendered = render(&job, &Unwatched, &AtomicBool::new(false));
        assert_eq!(rendered.report.samples, u64::from(iterations) * 32 * 32);
        peak()
    };
    let (Some(few), Some(many)) = (peak_after(8), peak_after(300)) else {
        println!("skipped: the system does not tell how much memory was used");
        return;
    };
    // The photons of one iteration take half a megabyte.
    assert!(many < few + 16 * 1024, "{many} kB after {few} kB");
}
