//! What media let through of skies, to places in them: roughly, for drawing directions.

use crate::ids::{BlockId, MediumId};
use crate::light::{Light, Wanted};
use crate::math::Point3;
use crate::medium::{Blocks, Medium, Veil};
use crate::world::World;

/// Most blocks that are told apart, in all media and for all skies together: 4 MiB.
const MOST: usize = 8192;

/// The blocks that are told apart.
#[derive(Clone, Debug, Default)]
pub(super) struct Veils {
    /// Of each medium, if any has some; with the id of the first.
    of_media: Vec<Option<(BlockId, Blocks)>>,
}

impl Veils {
    /// Prepares skies for them.
    pub(super) fn new(media: &[Medium], lights: &mut [Light]) -> Self {
        let has_map = |light: &&Light| matches!(light, Light::Infinite(light) if light.has_map());
        let n_skies = lights.iter().filter(has_map).count();
        let n_veiled = media.iter().filter(|medium| medium.veils()).count();
        let n_most = MOST.checked_div(n_veiled * n_skies).unwrap_or(0);
        // One block for all of a grid tells nothing apart.
        if n_most < 2 {
            return Self::default();
        }
        let veils: Vec<Option<Veil>> = media.iter().map(|medium| medium.veil(n_most)).collect();
        for light in lights {
            if let Light::Infinite(light) = light {
                light.heed_blocks(|toward| {
                    let of_veils = veils.iter().flatten();
                    of_veils
                        .flat_map(|veil| veil.transmittances(toward))
                        .collect()
                });
            }
        }
        let mut n_before = 0;
        let of_media = veils.into_iter().map(|veil| {
            let first = BlockId::new(n_before);
            let blocks = veil?.into_blocks();
            n_before += blocks.count();
            Some((first, blocks))
        });
        Self {
            of_media: of_media.collect(),
        }
    }
}

impl World {
    /// What is wanted of skies at a point in a medium.
    #[inline]
    pub fn wanted_in(&self, medium: MediumId, p: Point3) -> Wanted {
        match self.veils.of_media.get(medium.index()) {
            Some(Some((first, blocks))) => {
                Wanted::Within(BlockId::new(first.index() + blocks.index_of(p)))
            }
            _ => Wanted::All,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::LightId;
    use crate::image::Image;
    use crate::light::InfiniteLight;
    use crate::math::{Normal3, Transform, Vec3};
    use crate::medium::{DensityGrid, GridMedium, Homogeneous};
    use crate::sampling::rng::Rng;
    use crate::scatter::HenyeyGreenstein;
    use crate::spectrum::Rgb;
    use crate::world::{Receiver, WorldParts};
    use glam::{DAffine3, DMat3, DQuat, DVec3};

    const PHASE: HenyeyGreenstein = HenyeyGreenstein { g: 0.0 };

    /// Two even clouds, each as large as (−1, 1)³, the second of them turned, in an even sky that is a map.
    fn parts() -> WorldParts {
        let grid = |unit_from_render: DAffine3| {
            let unit_from_render = Transform::from_affine(unit_from_render).expect("invertible");
            Medium::Grid(Box::new(GridMedium::new(
                DensityGrid::new([20, 24, 28], &[1.0; 20 * 24 * 28]),
                &unit_from_render,
                Rgb::ONE,
                Rgb::splat(9.0),
                PHASE,
            )))
        };
        let half = DVec3::splat(0.5);
        let upright = DAffine3::from_scale_rotation_translation(half, DQuat::IDENTITY, half);
        let turned = upright * DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2);
        let map = Image::new(16, 8, 1, vec![1.0; 16 * 8]).expect("a picture");
        let light = InfiniteLight::with_map(Rgb::ONE, map, DMat3::from_rotation_x(0.7), false);
        WorldParts {
            media: vec![
                Medium::Homogeneous(Homogeneous::new(Rgb::ONE, Rgb::ONE, PHASE)),
                grid(upright),
                grid(turned),
            ],
            lights: vec![Light::Infinite(Box::new(light.expect("not black")))],
            draws_light_in_media: true,
            ..WorldParts::default()
        }
    }

    /// The outer normal of a side.
    fn side(i: usize) -> Vec3 {
        let n = DVec3::AXES[i % 3];
        Vec3::from_f64(if i < 3 { n } else { -n })
    }

    /// How many of a hundred directions that are drawn for a point go to the side of `n`.
    fn percent_toward(world: &World, medium: MediumId, p: Vec3, n: Vec3) -> usize {
        let p = Point3(p.0);
        let at = Receiver {
            p,
            p_err: Vec3::ZERO,
            ng: Normal3::ZERO,
            wanted: world.wanted_in(medium, p),
            time: 0.0,
        };
        let mut rng = Rng::new(1);
        let drawn = (0..10_000).filter_map(|_| {
            let u = rng.uniform2();
            world.sample_on_light(LightId::new(0), 1.0, &at, u)
        });
        drawn.filter(|sample| sample.wi.dot(n) > 0.0).count() / 100
    }

    #[test]
    fn light_is_looked_for_where_the_way_out_is_short() {
        let world = World::new(parts());
        for medium in [1, 2].map(MediumId::new) {
            for n in (0..6).map(side) {
                let outside = percent_toward(&world, medium, n * 0.95, n);
                assert!(outside > 80, "{n:?}: {outside}");
                let middle = percent_toward(&world, medium, n * 0.01, n);
                assert!((35..=65).contains(&middle), "{n:?}: {middle}");
            }
        }
    }

    #[test]
    fn places_are_told_apart_only_where_it_serves() {
        let wanted = |parts: WorldParts, medium: usize| {
            World::new(parts).wanted_in(MediumId::new(medium), Point3::ZERO)
        };
        assert!(matches!(wanted(parts(), 1), Wanted::Within(_)));
        assert_ne!(wanted(parts(), 1), wanted(parts(), 2));
        let without_map = || {
            let sky = Light::Infinite(Box::new(InfiniteLight::constant(Rgb::ONE)));
            WorldParts {
                lights: vec![sky],
                ..parts()
            }
        };
        let by_directions_alone = || WorldParts {
            draws_light_in_media: false,
            ..parts()
        };
        assert_eq!(wanted(parts(), 0), Wanted::All, "it is the same everywhere");
        assert_eq!(wanted(without_map(), 1), Wanted::All);
        assert_eq!(wanted(by_directions_alone(), 1), Wanted::All);
    }
}
