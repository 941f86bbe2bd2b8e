//! What a path from the camera finds, told apart where other paths may join it.

use crate::integrator::path::state::State;
use crate::integrator::trace::Observer;
use crate::math::Point3;
use crate::spectrum::Rgb;

/// What a path from the camera finds, and where it may be joined by others: if its first collision is in a cloud.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Found {
    /// Radiance it brings along, but for what it finds from a [`Junction::second`] collision on.
    pub radiance: Rgb,
    /// Its first collisions in a cloud that [can be shared](crate::world::World::shared_cloud).
    pub junction: Option<Junction>,
}

/// Where a path scatters in a cloud, coming from the camera.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Junction {
    /// First.
    pub first: Point3,
    /// If again after that: where, and the radiance that it finds from there on.
    pub second: Option<(Point3, Rgb)>,
}

impl Found {
    /// Nothing.
    pub const NOTHING: Self = Self {
        radiance: Rgb::BLACK,
        junction: None,
    };

    /// All that the path finds.
    pub fn total(&self) -> Rgb {
        let beyond = self.junction.and_then(|junction| junction.second);
        self.radiance + beyond.map_or(Rgb::BLACK, |(_, radiance)| radiance)
    }
}

impl<O: Observer> State<'_, O> {
    /// Notes that the path scatters in a cloud at `p`.
    #[inline]
    pub(super) fn note_junction(&mut self, p: Point3) {
        match (self.bounces, &mut self.junction) {
            (0, junction) => {
                *junction = Some(Junction {
                    first: p,
                    second: None,
                });
            }
            (1, Some(junction)) => {
                junction.second = Some((p, Rgb::BLACK));
                self.radiance_before = std::mem::replace(&mut self.radiance, Rgb::BLACK);
            }
            _ => {}
        }
    }

    /// What the path has found.
    pub(super) fn found(&self) -> Found {
        let Some(Junction {
            first,
            second: Some((second, _)),
        }) = self.junction
        else {
            return Found {
                radiance: self.radiance,
                junction: self.junction,
            };
        };
        Found {
            radiance: self.radiance_before,
            junction: Some(Junction {
                first,
                second: Some((second, self.radiance)),
            }),
        }
    }
}
