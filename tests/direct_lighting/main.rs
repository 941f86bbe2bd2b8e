//! `whitted`, `directlighting` and `ambientocclusion` against closed forms and against the path tracer.

#[path = "../common/probe.rs"]
mod probe;
#[path = "../common/scene.rs"]
mod scene;
#[path = "../common/seen.rs"]
mod seen;

mod chains;
mod lights;
mod occlusion;
