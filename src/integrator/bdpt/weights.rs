//! Weights of the strategies that could have found a path (Veach 1997, section 10.2; pbrt 3rd ed., section 16.3.4).
//!
//! A path of n vertices is numbered from the light. Strategy s takes its first s vertices from a path that starts at
//! the light, the others from one that starts at the camera. For s = 1 the point on the light is drawn for the vertex
//! next to it, with a density of its own.
//!
//! Densities are per area at surfaces, per volume in media, and per solid angle at lights infinitely far away. The
//! density of the distance at which a medium scatters is left out everywhere: tracking through a grid has none that
//! could be evaluated, and weights need only be the same function of the path for all strategies.

/// The densities with which a vertex is found from the vertex before it on either side.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Density {
    /// Coming from the light.
    pub light: f64,
    /// Coming from the camera.
    pub camera: f64,
    /// The path goes on specularly here: nothing connects to this vertex, and directions from it have no density.
    pub specular: bool,
    /// Only paths from the camera get here: the surface is [one-way](crate::shape::Shape::is_one_way).
    pub one_way: bool,
}

/// What is particular at the ends of a path.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ends {
    /// Density of the point on the light if drawn for the vertex next to it.
    pub direct: f64,
    /// Density of the point on the light if light paths start there.
    pub emitted: f64,
    /// No path meets the light by chance.
    pub is_delta_light: bool,
    /// The last vertex may be found from the light.
    pub reaches_film: bool,
    /// How much better light sampling does on a path of three vertices than its density says, at least 1: what it finds
    /// in a pixel hardly varies where a light without extent is seen from every point of the pixel. Densities know
    /// nothing of that (Grittmann et al., *Variance-Aware Multiple Importance Sampling*, 2019).
    pub steadiness: f64,
}

/// Weight of strategy `s` for a path, by the power heuristic with exponent 2. The weights of all strategies that can
/// find the path sum to 1.
pub fn weight(path: &[Density], ends: &Ends, s: usize) -> f64 {
    let n = path.len();
    // A light the camera sees: nothing else is tried.
    if n == 2 {
        return 1.0;
    }
    let is_possible = |s: usize| {
        let connects = |i: usize| !path[i].specular;
        if s == 0 {
            !ends.is_delta_light
        } else if s == n - 1 {
            ends.reaches_film && connects(n - 2)
        } else {
            connects(s) && (s == 1 || connects(s - 1))
        }
    };
    // Densities of strategy i + 1 and of strategy i, but for common factors.
    let step = |i: usize| {
        let from_light = if path[i].one_way {
            0.0
        } else if i > 0 && path[i - 1].specular {
            1.0
        } else {
            path[i].light
        };
        let from_camera = if i + 1 < n && path[i + 1].specular {
            1.0
        } else {
            path[i].camera
        };
        match i {
            0 if n == 3 => (ends.direct * ends.steadiness, from_camera),
            0 => (ends.direct, from_camera),
            1 if n == 3 => (
                ends.emitted * from_light,
                ends.direct * from_camera * ends.steadiness,
            ),
            1 => (ends.emitted * from_light, ends.direct * from_camera),
            _ => (from_light, from_camera),
        }
    };
    let mut sum = 1.0;
    let mut ratio = 1.0;
    for i in s..n - 1 {
        let (next, this) = step(i);
        ratio *= next / this;
        // What cannot be drawn ends all that builds on it; what is no number is 0/0.
        if !(ratio > 0.0) {
            break;
        }
        if is_possible(i + 1) {
            sum += ratio * ratio;
        }
    }
    let mut ratio = 1.0;
    for i in (0..s).rev() {
        let (next, this) = step(i);
        ratio *= this / next;
        if !(ratio > 0.0) {
            break;
        }
        if is_possible(i) {
            sum += ratio * ratio;
        }
    }
    // An overflow is a strategy that is better beyond measure.
    1.0 / sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;

    /// Densities over many orders of magnitude.
    fn random(rng: &mut Rng, reach: f32) -> f64 {
        f64::from(reach * (2.0 * rng.uniform() - 1.0)).exp()
    }

    /// Density with which strategy `s` finds a path as a whole, but for factors that all strategies have: the product
    /// over its vertices, and 0 for what never happens.
    fn density(path: &[Density], ends: &Ends, s: usize) -> f64 {
        let n = path.len();
        // Directions from specular vertices are certain.
        let from_light = |i: usize| match i {
            0 if s == 1 && n == 3 => ends.direct * ends.steadiness,
            0 if s == 1 => ends.direct,
            0 => ends.emitted,
            i if path[i].one_way => 0.0,
            i if path[i - 1].specular => 1.0,
            i => path[i].light,
        };
        let from_camera = |i: usize| match i {
            i if i == n - 1 || path[i + 1].specular => 1.0,
            i => path[i].camera,
        };
        let drawn: f64 =
            (0..s).map(from_light).product::<f64>() * (s..n).map(from_camera).product::<f64>();
        let by_chance = s == 0 && ends.is_delta_light;
        let beside_the_film = s == n - 1 && !ends.reaches_film;
        // The two vertices that are joined must scatter to each other.
        let through_a_mirror = s > 0 && (path[s - 1].specular || path[s].specular);
        if by_chance || beside_the_film || through_a_mirror {
            0.0
        } else {
            drawn
        }
    }

    #[test]
    fn weights_are_the_shares_of_squared_densities() {
        let mut rng = Rng::new(5);
        let (mut n_tested, mut n_impossible) = (0, 0);
        for case in 0..20_000 {
            let n = 3 + (rng.next_u32() % 8) as usize;
            let path: Vec<Density> = (0..n)
                .map(|i| Density {
                    light: random(&mut rng, 30.0),
                    camera: random(&mut rng, 30.0),
                    specular: i > 0 && i + 1 < n && rng.uniform() < 0.2,
                    one_way: i > 0 && i + 1 < n && rng.uniform() < 0.05,
                })
                .collect();
            let ends = Ends {
                direct: random(&mut rng, 30.0),
                emitted: random(&mut rng, 30.0),
                is_delta_light: rng.uniform() < 0.3,
                reaches_film: rng.uniform() < 0.7,
                steadiness: random(&mut rng, 5.0).max(1.0),
            };
            let squares: Vec<f64> = (0..n).map(|s| density(&path, &ends, s).powi(2)).collect();
            let sum: f64 = squares.iter().sum();
            // Strategies that cannot find the path are never asked for its weight.
            for s in (0..n).filter(|&s| squares[s] > 0.0) {
                n_tested += 1;
                let (weight, share) = (weight(&path, &ends, s), squares[s] / sum);
                assert!(
                    (weight - share).abs() <= 1e-12 + 1e-9 * share,
                    "case {case}, strategy {s}: {weight} for {share}"
                );
            }
            n_impossible += squares.iter().filter(|square| **square == 0.0).count();
        }
        assert!(n_tested > 50_000, "{n_tested}");
        assert!(n_impossible > 10_000, "{n_impossible}");
    }

    #[test]
    fn weights_stay_numbers_for_densities_that_overflow_and_vanish() {
        let extremes = [0.0, 1e-300, 1e-45, 1.0, 1e38, 1e300, f64::INFINITY];
        let mut rng = Rng::new(6);
        for _ in 0..20_000 {
            let mut pick = || extremes[(rng.next_u32() % 7) as usize];
            let path: Vec<Density> = (0..6)
                .map(|_| Density {
                    light: pick(),
                    camera: pick(),
                    specular: false,
                    one_way: false,
                })
                .collect();
            let ends = Ends {
                direct: pick(),
                emitted: pick(),
                is_delta_light: false,
                reaches_film: true,
                steadiness: pick().max(1.0),
            };
            for s in 0..6 {
                let weight = weight(&path, &ends, s);
                assert!((0.0..=1.0).contains(&weight), "{weight}");
            }
        }
    }
}
