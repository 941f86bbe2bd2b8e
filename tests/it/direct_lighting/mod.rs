//! `whitted`, `directlighting` and `ambientocclusion` against closed forms and against the path tracer.

mod chains;
mod lights;
mod occlusion;
