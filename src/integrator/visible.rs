//! What a ray sees where media do not exist: the nearest surface that has a material.

use crate::integrator::Counters;
use crate::math::Ray;
use crate::shape::SurfacePoint;
use crate::world::{Hit, World, spawn_ray};

/// A surface that is seen.
pub(super) struct Visible {
    pub(super) hit: Hit,
    pub(super) surface: SurfacePoint,
    /// Null surfaces stand before it.
    pub(super) is_behind_null: bool,
}

/// The nearest surface with a material; `ray` goes on behind the null surfaces before it. `None` where there is none.
pub(super) fn nearest_visible(
    world: &World,
    ray: &mut Ray,
    counters: &mut Counters,
) -> Option<Visible> {
    for crossings in 0..=world.max_crossings() {
        if counters.next_ray() {
            return None;
        }
        let hit = world.closest(ray, f32::INFINITY)?;
        let surface = world.surface(ray, &hit);
        if world.geometry(hit.target.geometry).material.is_some() {
            return Some(Visible {
                hit,
                surface,
                is_behind_null: crossings > 0,
            });
        }
        *ray = spawn_ray(surface.p, surface.p_err, surface.n_surface, ray.d, ray.time);
    }
    counters.stuck_paths += 1;
    None
}
