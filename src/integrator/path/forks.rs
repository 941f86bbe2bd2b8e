//! Places from where a path goes on in several ways.

use crate::ids::MediumId;
use crate::integrator::path::state::State;
use crate::integrator::trace::{Event, Observer};
use crate::math::Ray;
use crate::scatter::Bsdf;
use crate::spectrum::Rgb;
use crate::world::Hit;

/// Paths are split where they send on more than this many times what they did at first: at surfaces of impossible albedo,
/// as those of `marble`. What conserves energy stays below.
const SPLIT_ABOVE: f32 = 2.0;
/// Most ways in which a path goes on from one place. Measured: 4 are as efficient as 16.
const MAX_WAYS: u32 = 8;
/// Most ways that are added to one path of the camera, so that albedos above 1 at many places do not multiply.
pub(super) const MAX_ADDED_WAYS: u32 = 64;
/// Most places with ways that wait.
pub(super) const MAX_FORKS: usize = 8;

/// A surface from where more ways of a path wait to be followed.
#[derive(Clone, Copy)]
pub(super) struct Fork {
    /// The ray that arrives.
    ray: Ray,
    /// What it meets.
    hit: Hit,
    medium: MediumId,
    /// Throughput of each way.
    beta: Rgb,
    eta_scale: f32,
    bounces: u32,
    /// Ways that wait, at least one.
    n_waiting: u32,
}

impl<O: Observer> State<'_, O> {
    /// Goes on in several ways from a surface that sends on far more than the first one did: few paths meet it, and of
    /// those each would count for as much. All ways scatter by themselves and share the throughput; the others wait.
    #[inline]
    pub(super) fn fork(&mut self, hit: &Hit, bsdf: &Bsdf) {
        let Some(sent_first) = self.sent_first else {
            return;
        };
        let most = (MAX_WAYS - 1).min(self.ways_left);
        if most == 0 || self.forks.is_full() {
            return;
        }
        let sent = self.carried() * bsdf.importance(-self.ray.d);
        let ways = sent / (SPLIT_ABOVE * sent_first.max(1.0));
        if !(ways > 1.0) {
            return;
        }
        // Beyond the range of integers all of `most`.
        let n_waiting = (ways.ceil() as u32 - 1).min(most);
        self.ways_left -= n_waiting;
        self.beta *= 1.0 / (n_waiting + 1) as f32;
        self.forks.push(Fork {
            ray: self.ray,
            hit: *hit,
            medium: self.medium,
            beta: self.beta,
            eta_scale: self.eta_scale,
            bounces: self.bounces,
            n_waiting,
        });
        self.see(|_| Event::Forked {
            n_ways: n_waiting + 1,
        });
    }

    /// Goes back to where a way waits, the latest first: what was met there. `None` if there is none.
    pub(super) fn take_waiting(&mut self) -> Option<Hit> {
        let fork = self.forks.last_mut()?;
        fork.n_waiting -= 1;
        let Fork {
            ray,
            hit,
            medium,
            beta,
            eta_scale,
            bounces,
            n_waiting,
        } = *fork;
        if n_waiting == 0 {
            self.forks.pop();
        }
        (self.ray, self.medium, self.bounces) = (ray, medium, bounces);
        (self.beta, self.eta_scale) = (beta, eta_scale);
        self.see(|state| Event::Returned {
            p: state.ray.at(hit.at.t),
            beta,
        });
        Some(hit)
    }
}
