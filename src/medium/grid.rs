//! Heterogeneous medium: density on a grid. Scene-file manual (`"string type" "heterogeneous"`), beside the
//! parameters of the homogeneous medium:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer nx`, `ny`, `nz` | 1 | grid resolution |
//! | `float density` | required | nx·ny·nz values, x fastest; multiply the coefficients |
//! | `point p0`, `p1` | (0,0,0), (1,1,1) | corners of the grid's box in medium space |
//!
//! Values sit at cell centres and are interpolated trilinearly; beyond the grid the density is 0, so that it fades
//! out over the outer half cell, as in pbrt-v3.

use glam::{Affine3A, DAffine3, DVec3, Vec3A};

use crate::math::{Point3, Ray, Transform};
use crate::medium::homogeneous::{ColumnFlight, beer_lambert};
pub use crate::medium::lattice::MAX_VOXELS;
use crate::medium::lattice::{Lattice, LatticeRay, March, Piece};
use crate::medium::majorant::{MajorantGrid, Segment};
use crate::medium::veil::Veil;
use crate::medium::{MediumEvent, channel_weights};
use crate::sampling::rng::Rng;
use crate::scatter::HenyeyGreenstein;
use crate::spectrum::Rgb;

/// A density field on a grid, in *voxel space*: cell (i, j, k) covers [i, i+1) × [j, j+1) × [k, k+1).
#[derive(Clone, Debug)]
pub struct DensityGrid {
    lattice: Lattice,
    n: [usize; 3],
    /// Mean of the values that are not 0.
    mean_inside: f32,
    majorants: MajorantGrid,
}

impl DensityGrid {
    /// `values` holds nx·ny·nz finite, non-negative densities, x fastest; none of n is above [`MAX_VOXELS`].
    pub fn new(n: [usize; 3], values: &[f32]) -> Self {
        let lattice = Lattice::new(n, values);
        let majorants = MajorantGrid::new(n, |lo, hi| lattice.bound(lo, hi));
        let inside = values.iter().filter(|&&value| value > 0.0);
        let sum: f64 = inside.clone().map(|&value| f64::from(value)).sum();
        Self {
            lattice,
            n,
            mean_inside: (sum / inside.count().max(1) as f64) as f32,
            majorants,
        }
    }

    /// Interpolated density at a point of voxel space inside the grid's box.
    #[inline]
    pub fn density(&self, p: Vec3A) -> f32 {
        self.lattice.density(p + 0.5)
    }

    /// Integral of the density along a ray in the lattice, t in (0, `t_max`), if it is below `limit`.
    #[inline]
    fn column(&self, ray: &LatticeRay, t_max: f32, limit: f64) -> Column {
        let mut column = 0.0;
        let mut march: Option<March> = None;
        let [o, d] = ray.line();
        for Segment { t0, t1, .. } in self.majorants.walk(o, d, t_max) {
            // Empty cells are left out.
            let march = match march {
                Some(ref mut march) if march.t() == t0 => march,
                ref mut march => march.insert(March::new(&self.lattice, ray, t0)),
            };
            let reached = self.lattice.integrate(ray, march, t1, &mut column, limit);
            if let Some(piece) = reached {
                let left = limit - column;
                return Column::Reached { piece, left };
            }
        }
        Column::Below(column)
    }

    /// Largest density anywhere.
    pub fn max(&self) -> f32 {
        self.majorants.max()
    }
}

/// What a ray meets of a density field.
enum Column {
    /// All in all, which is below what was asked for.
    Below(f64),
    /// What was asked for, where it comes to so much more than before a stretch.
    Reached { piece: Piece, left: f64 },
}

/// A ray in the lattice: o + t d, t in (0, `t_max`).
struct Flight {
    o: Vec3A,
    d: Vec3A,
    /// Distance along the ray at which t is 0.
    begin: f64,
    t_max: f32,
}

impl Flight {
    /// It meets nothing.
    const NOWHERE: Self = Self {
        o: Vec3A::ZERO,
        d: Vec3A::ZERO,
        begin: 0.0,
        t_max: 0.0,
    };

    /// The distance along the ray at which t has this value.
    #[inline]
    fn along_ray(&self, t: f32) -> f32 {
        (self.begin + f64::from(t)) as f32
    }
}

/// A medium whose coefficients are multiplied by a density field.
#[derive(Clone, Debug)]
pub struct GridMedium {
    density: DensityGrid,
    lattice_from_render: Affine3A,
    precise_lattice_from_render: DAffine3,
    /// Places of rays' origins in the lattice up to which f32 is precise, along each axis.
    near: Vec3A,
    sigma_t: Rgb,
    sigma_s: Rgb,
    /// Phase function.
    pub phase: HenyeyGreenstein,
    /// Extinction is the same in every channel.
    is_grey: bool,
    /// Rays meet so few voxels that integrals over them are worth their time: they leave the noise to the path.
    integrates: bool,
    /// Dice would be thrown without an end in voxels as dense as this: every flight is an integral.
    is_dense: bool,
    /// A little less, and a little more, than the box of [`GridMedium::confine`].
    inner: [Vec3A; 2],
    outer: [Vec3A; 2],
}

/// Transmittance below which Russian roulette is played.
const ROULETTE_BELOW: f32 = 0.1;
/// Optical depth of a voxel, on average over those with density, from which on few of them are passed.
const THICK: f64 = 0.05;
/// Length of a grid, in voxels, up to which few are passed however thin they are. Measured on the grid of a cloud, 100
/// voxels long: with integrals pictures are 1.1 to 1.5 times as efficient at optical depths of 0.02 to 0.3 a voxel.
const SHORT: usize = 128;
/// Distance, in lengths of the grid, from which on rays begin at the grid: up to there places within lose no more than
/// the last six of their 24 digits.
const NEAR: f32 = 64.0;
/// The same in voxels: up to there numbers of f32 tell halves of voxels apart.
const NEAR_VOXELS: f32 = 4_194_304.0;
/// Voxels per unit of render space whose sums might not be numbers of f32 any more.
const LARGEST_SCALE: f64 = 1e37;
/// Largest optical depth of a voxel in which collisions are drawn by dice.
const DENSE: f64 = 100.0;

impl GridMedium {
    /// `sigma_a`, `sigma_s` per unit of render space at density 1; `unit_from_render` maps the grid's box to [0, 1]³.
    pub fn new(
        density: DensityGrid,
        unit_from_render: &Transform,
        sigma_a: Rgb,
        sigma_s: Rgb,
        phase: HenyeyGreenstein,
    ) -> Self {
        let n_longest = density.n.into_iter().max().unwrap_or(0);
        let n = density.n.map(|n| n as f64);
        let scale = DAffine3::from_scale(DVec3::from(n));
        let mut affine = scale * *unit_from_render.affine();
        affine.translation += 0.5;
        let lattice_from_render =
            Affine3A::from_mat3_translation(affine.matrix3.as_mat3(), affine.translation.as_vec3());
        let largest = affine.matrix3.to_cols_array().map(f64::abs).into_iter();
        let near = if largest.fold(0.0, f64::max) < LARGEST_SCALE {
            (density.lattice.size() * NEAR).min(Vec3A::splat(NEAR_VOXELS))
        } else {
            Vec3A::NEG_ONE
        };
        let sigma_t = sigma_a + sigma_s;
        let is_grey = sigma_t.min_component() == sigma_t.max_component();
        let sigma = f64::from(sigma_t.max_component());
        // The edge of a cube as large as a voxel, and the longest edge of a voxel.
        let edge = affine.matrix3.determinant().abs().cbrt().recip();
        let render_from_lattice = affine.matrix3.inverse();
        let longest_edge = [0, 1, 2]
            .map(|axis| render_from_lattice.col(axis).length())
            .into_iter()
            .fold(edge, f64::max);
        let depth = sigma * f64::from(density.mean_inside) * edge;
        let rate = sigma * f64::from(density.max());
        let is_dense = rate * longest_edge > DENSE || rate > f64::from(f32::MAX);
        Self {
            density,
            lattice_from_render,
            precise_lattice_from_render: affine,
            near,
            sigma_t,
            sigma_s,
            phase,
            is_grey,
            integrates: depth >= THICK || n_longest <= SHORT || is_dense,
            is_dense,
            inner: [Vec3A::NEG_INFINITY, Vec3A::INFINITY],
            outer: [Vec3A::NEG_INFINITY, Vec3A::INFINITY],
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.sigma_t.is_black() || self.density.max() == 0.0
    }

    #[inline]
    pub(super) fn scatters(&self) -> bool {
        !self.sigma_s.is_black() && self.density.max() > 0.0
    }

    /// Places in units of voxels; the middle of the first is at (1, 1, 1).
    pub fn lattice_from_render(&self) -> &DAffine3 {
        &self.precise_lattice_from_render
    }

    /// Corners of the voxels' box, in the same units.
    pub fn extent(&self) -> [DVec3; 2] {
        self.density.lattice.extent().map(|p| p.as_dvec3())
    }

    /// Leaves no density outside of a box, given in units of voxels, within which places are known up to `rounding`. Some
    /// of the grid is in the box.
    pub fn confine(&mut self, low: DVec3, high: DVec3, rounding: f64) {
        self.density
            .majorants
            .confine(low.as_vec3a(), high.as_vec3a());
        self.inner = [(low + rounding).as_vec3a(), (high - rounding).as_vec3a()];
        self.outer = [(low - rounding).as_vec3a(), (high + rounding).as_vec3a()];
    }

    /// Whether a point is surely in the box of [`GridMedium::confine`], or surely not; `None` at its walls.
    #[inline]
    pub fn holds(&self, p: Point3) -> Option<bool> {
        let p = self.lattice_from_render.transform_point3a(p.0);
        let is_in = |[low, high]: [Vec3A; 2]| (p.cmpge(low) & p.cmple(high)).all();
        if is_in(self.inner) {
            Some(true)
        } else if is_in(self.outer) {
            None
        } else {
            Some(false)
        }
    }

    /// See [`Medium::veil`](crate::medium::Medium::veil).
    pub(super) fn veil(&self, n_most: usize) -> Veil {
        let mut voxels_from_render = self.lattice_from_render;
        voxels_from_render.translation -= 0.5;
        let DensityGrid { n, lattice, .. } = &self.density;
        let [r, g, b] = self.sigma_t.to_array().map(f64::from);
        let mean = (r + g + b) / 3.0;
        Veil::new(*n, voxels_from_render, n_most, mean, |y, z| {
            lattice.row(y, z)
        })
    }

    #[inline]
    fn flight(&self, ray: &Ray, t_max: f32) -> Flight {
        let o = self.lattice_from_render.transform_point3a(ray.o.0);
        if !o.abs().cmple(self.near).all() {
            return self.flight_from_afar(ray, t_max);
        }
        Flight {
            o,
            d: self.lattice_from_render.transform_vector3a(ray.d.0),
            begin: 0.0,
            t_max,
        }
    }

    /// From far away, or what is no place in f32: begins where it enters the grid's box, so that places within keep their
    /// digits.
    #[cold]
    #[inline(never)]
    fn flight_from_afar(&self, ray: &Ray, t_max: f32) -> Flight {
        let affine = &self.precise_lattice_from_render;
        let o = affine.transform_point3(ray.o.0.as_dvec3());
        let d = affine.transform_vector3(ray.d.0.as_dvec3());
        let (mut begin, mut end) = (0f64, f64::from(t_max));
        let [low, high] = self
            .density
            .lattice
            .extent()
            .map(|corner| corner.as_dvec3());
        for axis in 0..3 {
            if d[axis] == 0.0 {
                if o[axis] < low[axis] || o[axis] > high[axis] {
                    return Flight::NOWHERE;
                }
                continue;
            }
            let (a, b) = (
                (low[axis] - o[axis]) / d[axis],
                (high[axis] - o[axis]) / d[axis],
            );
            begin = begin.max(a.min(b));
            end = end.min(a.max(b));
        }
        let d_rounded = d.as_vec3a();
        // Boxes of which f32 cannot tell the sides apart are not met, either.
        if !(begin < end && d_rounded.is_finite()) {
            return Flight::NOWHERE;
        }
        Flight {
            o: (o + d * begin).clamp(low, high).as_vec3a(),
            d: d_rounded,
            begin,
            t_max: (f64::from(t_max) - begin) as f32,
        }
    }

    /// Runs through the tentative collisions of a Poisson process whose rate is the local majorant times
    /// `sigma`, the first of them at the optical depth `depth`. `collide(t, ratio)` receives each one with
    /// density / majorant in [0, 1] and ends the run by `Some`.
    #[inline]
    fn track<T>(
        &self,
        ray: &Ray,
        t_max: f32,
        sigma: f32,
        mut depth: f32,
        rng: &mut Rng,
        mut collide: impl FnMut(f32, f32, &mut Rng) -> Option<T>,
    ) -> Option<T> {
        let flight = self.flight(ray, t_max);
        let (o, d) = (flight.o, flight.d);
        for Segment { t0, t1, majorant } in self.density.majorants.walk(o, d, flight.t_max) {
            let rate = sigma * majorant;
            let mut t = t0;
            loop {
                let left = (t1 - t) * rate;
                if depth >= left {
                    depth -= left;
                    break;
                }
                t += depth / rate;
                let ratio = self.density.lattice.density(o + d * t) / majorant;
                if let Some(result) = collide(flight.along_ray(t), ratio, rng) {
                    return Some(result);
                }
                depth = rng.exponential();
            }
        }
        None
    }

    /// Coefficients over the largest extinction. Those next to nothing have no reciprocals.
    #[inline]
    fn relative(&self, sigma: Rgb) -> Rgb {
        sigma / self.sigma_t.max_component()
    }

    #[inline]
    fn grey_collision(&self, t: f32) -> MediumEvent {
        MediumEvent::Scatter {
            t,
            weight: self.relative(self.sigma_s),
        }
    }

    /// By delta tracking (Woodcock 1965) under local majorants, or exactly for a given depth if grey voxels are thick:
    /// dice would scatter what the depth keeps apart. Coloured extinction by spectral tracking (Kutz et al. 2017), where
    /// the throughput of the path decides between real and null collisions.
    pub(super) fn sample(
        &self,
        ray: &Ray,
        t_max: f32,
        beta: Rgb,
        depth: Option<f32>,
        rng: &mut Rng,
    ) -> MediumEvent {
        if self.sigma_s.is_black() {
            return MediumEvent::Pass {
                weight: self.transmittance(ray, t_max, rng),
            };
        }
        let sigma = self.sigma_t.max_component();
        if self.is_dense || self.is_grey && self.integrates && depth.is_some() {
            return self.integrated_flight(ray, t_max, beta, depth, rng);
        }
        let depth = depth.unwrap_or_else(|| rng.exponential());
        if self.is_grey {
            return self
                .track(ray, t_max, sigma, depth, rng, |t, ratio, rng| {
                    (rng.uniform() < ratio).then_some(t)
                })
                .map_or(MediumEvent::Pass { weight: Rgb::ONE }, |t| {
                    self.grey_collision(t)
                });
        }
        let relative = self.relative(self.sigma_t);
        let scattering = self.relative(self.sigma_s);
        let mut weight = Rgb::ONE;
        let scattered = self.track(ray, t_max, sigma, depth, rng, |t, ratio, rng| {
            let real = relative * ratio;
            let q = channel_weights(beta * weight);
            let p_real = (q.r() * real.r() + q.g() * real.g() + q.b() * real.b()).min(1.0);
            if rng.uniform() < p_real {
                weight *= scattering * (ratio / p_real);
                return Some(t);
            }
            weight *= (Rgb::ONE - real).clamp_negative() * (1.0 / (1.0 - p_real));
            None
        });
        match scattered {
            Some(t) => MediumEvent::Scatter { t, weight },
            None => MediumEvent::Pass { weight },
        }
    }

    /// As in a homogeneous medium, with the column of density in the place of distance.
    fn integrated_flight(
        &self,
        ray: &Ray,
        t_max: f32,
        beta: Rgb,
        depth: Option<f32>,
        rng: &mut Rng,
    ) -> MediumEvent {
        let length = ColumnFlight::new(self.sigma_t, self.sigma_s, beta, depth, rng);
        let flight = self.flight(ray, t_max);
        let ray = LatticeRay::new(&self.density.lattice, flight.o, flight.d);
        match self.density.column(&ray, flight.t_max, length.limit()) {
            Column::Below(column) => MediumEvent::Pass {
                weight: length.pass(column as f32),
            },
            Column::Reached { piece, left } => MediumEvent::Scatter {
                t: flight.along_ray(self.density.lattice.reach(&ray, &piece, left)),
                weight: length.scatter(length.limit() as f32),
            },
        }
    }

    /// Whether light is scattered alike to all sides and dimmed alike in all channels, and [`GridMedium::depth_between`] is
    /// worth its time.
    pub fn is_evenly_shared(&self) -> bool {
        self.is_grey && self.integrates && self.scatters() && self.phase.g == 0.0
    }

    /// Optical depth between two places in the grid, or in the box it is confined to, in the channel of the largest
    /// extinction.
    pub fn depth_between(&self, a: Point3, b: Point3) -> f64 {
        let [from, to] = [a, b].map(|p| self.lattice_from_render.transform_point3a(p.0));
        let lattice = &self.density.lattice;
        // They are near: cells of majorants would be more to walk through than what they leave out.
        let ray = LatticeRay::new(lattice, from, to - from);
        let mut column = 0.0;
        let mut march = March::new(lattice, &ray, 0.0);
        lattice.integrate(&ray, &mut march, 1.0, &mut column, f64::INFINITY);
        // In clouds that are next to nothing beside their scene, f32 has no squares of lengths.
        let length = (b.0 - a.0).as_dvec3().length();
        column * length * f64::from(self.sigma_t.max_component())
    }

    /// Exactly where voxels are thick or only absorb, by ratio tracking (Novák et al. 2014) under local majorants where
    /// they are thin; with Russian roulette once little is left.
    pub(super) fn transmittance(&self, ray: &Ray, t_max: f32, rng: &mut Rng) -> Rgb {
        let only_absorbs = self.sigma_s.is_black();
        if self.integrates || only_absorbs {
            return self.exact_transmittance(ray, t_max, (!only_absorbs).then_some(rng));
        }
        let sigma = self.sigma_t.max_component();
        let relative = self.relative(self.sigma_t);
        let mut tr = Rgb::ONE;
        let depth = rng.exponential();
        let absorbed = self.track(ray, t_max, sigma, depth, rng, |_, ratio, rng| {
            tr *= (Rgb::ONE - relative * ratio).clamp_negative();
            let left = tr.max_component();
            if left < ROULETTE_BELOW {
                // The chance to go on is what is left, raised so that survivors are not too rare.
                let p_survive = left.max(ROULETTE_BELOW * 0.5);
                if rng.uniform() >= p_survive {
                    return Some(());
                }
                tr *= 1.0 / p_survive;
            }
            None
        });
        if absorbed.is_some() { Rgb::BLACK } else { tr }
    }

    /// By the integral of the density. With dice the end is played for, beyond [`ROULETTE_BELOW`], by what is left in
    /// the channel in which most is.
    #[inline]
    fn exact_transmittance(&self, ray: &Ray, t_max: f32, dice: Option<&mut Rng>) -> Rgb {
        let flight = self.flight(ray, t_max);
        let sigma = self.sigma_t.min_component();
        let certain = f64::from(-ROULETTE_BELOW.ln());
        let limit = match dice {
            Some(rng) if sigma > 0.0 => (certain + f64::from(rng.exponential())) / f64::from(sigma),
            _ => f64::INFINITY,
        };
        let ray = LatticeRay::new(&self.density.lattice, flight.o, flight.d);
        let Column::Below(column) = self.density.column(&ray, flight.t_max, limit) else {
            return Rgb::BLACK;
        };
        if limit == f64::INFINITY {
            return beer_lambert(self.sigma_t, column as f32);
        }
        let depth = column * f64::from(sigma);
        // Survivors carry what the others lost: relative to that channel, which keeps what is certain.
        let excess = self.sigma_t - Rgb::splat(sigma);
        beer_lambert(excess, column as f32) * (-depth.min(certain)).exp() as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::medium::lattice::solve_integral;

    /// The definition, in f64: values at cell centres, 0 beyond the grid.
    fn trilinear(n: [usize; 3], values: &[f32], p: Vec3A) -> f64 {
        let q = p.as_dvec3() - 0.5;
        let floor = q.floor();
        let mut sum = 0.0;
        for corner in 0..8 {
            let [mut weight, mut index, mut stride] = [1.0, 0.0, 1.0];
            let mut is_inside = true;
            for axis in 0..3 {
                let step = f64::from(corner >> axis & 1);
                let fraction = q[axis] - floor[axis];
                weight *= step * fraction + (1.0 - step) * (1.0 - fraction);
                let place = floor[axis] + step;
                is_inside &= (0.0..n[axis] as f64).contains(&place);
                index += place * stride;
                stride *= n[axis] as f64;
            }
            if is_inside {
                sum += weight * f64::from(values[index as usize]);
            }
        }
        sum
    }

    #[test]
    fn density_is_trilinear_between_centres_and_fades_out_at_the_border() {
        for n in [[5, 3, 4], [1, 1, 1], [3000, 1, 2]] {
            let mut rng = Rng::new(n[0] as u64);
            let values: Vec<f32> = (0..n[0] * n[1] * n[2]).map(|_| rng.uniform()).collect();
            let grid = DensityGrid::new(n, &values);
            let size = Vec3A::from(n.map(|n| n as f32));
            for k in 0..20_000 {
                let mut p = size * Vec3A::from([(); 3].map(|()| rng.uniform()));
                if k % 3 == 0 {
                    p = (p * 2.0).round() * 0.5; // Centres, and the planes between cells.
                }
                let (ours, exact) = (f64::from(grid.density(p)), trilinear(n, &values, p));
                // Places round to half a unit of 3000.
                let bound = 4.0 * f64::from(f32::EPSILON) * size.max_element() as f64;
                assert!((ours - exact).abs() <= bound, "{n:?} {p}: {ours} {exact}");
            }
        }
    }

    /// Integral of the definition along a ray of voxel space, by many points.
    fn quadrature(n: [usize; 3], values: &[f32], o: Vec3A, d: Vec3A, t_max: f32) -> f64 {
        let n_points = 40_000;
        let step = f64::from(t_max) / f64::from(n_points);
        let size = Vec3A::from(n.map(|n| n as f32));
        let points = (0..n_points).map(|k| o + d * ((f64::from(k) + 0.5) * step) as f32);
        let inside = points.filter(|p| p.cmpge(Vec3A::ZERO).all() && p.cmple(size).all());
        inside.map(|p| trilinear(n, values, p)).sum::<f64>() * step
    }

    /// A clumpy grid: half of its values are 0.
    fn clumpy(n: [usize; 3], rng: &mut Rng) -> Vec<f32> {
        let value = |u: f32| (2.0 * u - 1.0).max(0.0);
        (0..n[0] * n[1] * n[2])
            .map(|_| value(rng.uniform()))
            .collect()
    }

    #[test]
    fn columns_are_integrals_of_the_density_and_end_where_they_should() {
        let n = [13, 6, 9];
        let mut rng = Rng::new(5);
        let values = clumpy(n, &mut rng);
        let grid = DensityGrid::new(n, &values);
        let size = Vec3A::from(n.map(|n| n as f32));
        for k in 0..300 {
            let mut random = || size * Vec3A::from([(); 3].map(|()| 1.4 * rng.uniform() - 0.2));
            let (mut o, to) = (random(), random());
            let mut d = to - o;
            if k % 3 == 0 {
                d[k % 2] = 0.0;
            }
            if k % 4 == 0 {
                o = (o * 2.0).round() * 0.5; // In the planes between lattice points, and between cells.
            }
            if k % 6 == 0 {
                d = Vec3A::from([[1.0, 0.0, -0.0], [-0.0, -1.0, 0.0], [0.0, 0.0, 1.0]][k / 6 % 3]);
                d *= 3.0;
            }
            let t_max = 0.5 + 2.0 * rng.uniform();
            let expected = quadrature(n, &values, o, d, t_max);
            let ray = LatticeRay::new(&grid.lattice, o + 0.5, d);
            let at = |t_max, limit| grid.column(&ray, t_max, limit);
            let Column::Below(column) = at(t_max, f64::INFINITY) else {
                panic!("nothing reaches infinity");
            };
            let off = (column - expected).abs();
            assert!(off < 2e-4, "{o} {d} {t_max}: {column} for {expected}");
            if column > 1e-3 {
                let limit = column * f64::from(rng.uniform());
                let Column::Reached { piece, left } = at(t_max, limit) else {
                    panic!("{o} {d}: {limit} of {column} is not reached");
                };
                let t = grid.lattice.reach(&ray, &piece, left);
                let Column::Below(reached) = at(t, f64::INFINITY) else {
                    panic!("nothing reaches infinity");
                };
                let bound = 1e-5 * f64::from(d.length() * t_max);
                assert!(
                    (reached - limit).abs() < bound,
                    "{o} {d}: {reached} for {limit}"
                );
            }
        }
    }

    #[test]
    fn places_where_integrals_reach_a_value_have_closed_forms() {
        // Constant, linear and cubic densities.
        for (density, integral) in [
            ([1.0; 4], (|s: f64| s) as fn(f64) -> f64),
            ([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0], |s| 0.5 * s * s),
            ([0.0, 0.0, 0.0, 1.0], |s| 0.25 * s.powi(4)),
            ([1.0, 0.0, 0.0, 0.0], |s| 0.25 * (1.0 - (1.0 - s).powi(4))),
        ] {
            for k in 0..=100 {
                let s = f64::from(k) / 100.0;
                let found = solve_integral(density, integral(s));
                assert!(
                    (integral(found) - integral(s)).abs() < 1e-7,
                    "{density:?} {s}"
                );
            }
        }
        assert_eq!(solve_integral([0.0; 4], 0.0), 1.0);
    }

    /// A medium on the cube from 0 to 1 that integrates for shadows and first flights, and for all, or does not.
    fn medium(
        n: [usize; 3],
        values: &[f32],
        sigma: [[f32; 3]; 2],
        [integrates, is_dense]: [bool; 2],
    ) -> GridMedium {
        let [sigma_a, sigma_s] = sigma.map(Rgb::from_array);
        let grid = DensityGrid::new(n, values);
        let phase = HenyeyGreenstein { g: 0.0 };
        GridMedium {
            integrates,
            is_dense,
            ..GridMedium::new(grid, &Transform::IDENTITY, sigma_a, sigma_s, phase)
        }
    }

    /// Whether the mean of `samples` is `expected` within 5 standard errors.
    fn has_mean(samples: &[f64], expected: f64) -> bool {
        let n = samples.len() as f64;
        let mean = samples.iter().sum::<f64>() / n;
        let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean - expected).abs() <= 5.0 * (variance / n).sqrt() + 1e-5 * expected
    }

    #[test]
    fn dice_and_integrals_are_right_on_average_in_grey_and_in_colour() {
        let n = [7, 5, 6];
        let mut rng = Rng::new(8);
        let values = clumpy(n, &mut rng);
        let ray = Ray {
            o: crate::math::Point3::new(-0.1, 0.2, 0.3),
            d: crate::math::Vec3::new(0.8, 0.36, 0.48),
            time: 0.0,
        };
        let t_max = 1.1;
        let size = Vec3A::from(n.map(|n| n as f32));
        let column = |t: f32| quadrature(n, &values, ray.o.0 * size, ray.d.0 * size, t);
        let (whole, half) = (column(t_max), column(0.5 * t_max));
        for sigma in [
            [[0.5; 3], [3.5; 3]],
            [[10.0; 3], [20.0; 3]],
            [[0.5, 1.0, 0.2], [3.0, 8.0, 1.0]],
        ] {
            for integrates in [[false, false], [true, false], [true, true]] {
                let medium = medium(n, &values, sigma, integrates);
                let what = format!("{sigma:?}, integrates: {integrates:?}");
                let mut rng = Rng::new(9);
                let (mut passes, mut early, mut through) = (vec![], vec![], vec![]);
                for k in 0..40_000 {
                    through.push(medium.transmittance(&ray, t_max, &mut rng).to_array());
                    let depth = (k % 2 == 0).then(|| rng.exponential());
                    let event = medium.sample(&ray, t_max, Rgb::ONE, depth, &mut rng);
                    let (pass, scatter) = match event {
                        MediumEvent::Pass { weight } => (weight, Rgb::BLACK),
                        MediumEvent::Scatter { t, weight } if t < 0.5 * t_max => {
                            (Rgb::BLACK, weight)
                        }
                        MediumEvent::Scatter { .. } => (Rgb::BLACK, Rgb::BLACK),
                    };
                    passes.push(pass.to_array());
                    early.push(scatter.to_array());
                }
                for channel in 0..3 {
                    let sigma_t = f64::from(medium.sigma_t[channel]);
                    let albedo = f64::from(medium.sigma_s[channel]) / sigma_t;
                    let left = (-sigma_t * whole).exp();
                    let of = |samples: &[[f32; 3]]| -> Vec<f64> {
                        samples.iter().map(|s| f64::from(s[channel])).collect()
                    };
                    let scattered = albedo * (1.0 - (-sigma_t * half).exp());
                    for (samples, expected, quantity) in [
                        (of(&through), left, "transmittance"),
                        (of(&passes), left, "passing"),
                        (of(&early), scattered, "scattering"),
                    ] {
                        assert!(has_mean(&samples, expected), "{quantity}, {what}");
                        // The test would notice a bias.
                        assert!(!has_mean(&samples, 1.2 * expected), "{quantity}, {what}");
                    }
                }
            }
        }
    }

    #[test]
    fn flights_in_the_densest_of_voxels_end() {
        // Behind a cube of next to nothing stands a wall.
        let ray = Ray {
            o: crate::math::Point3::new(-5.0, 0.5, 0.5),
            d: crate::math::Vec3::new(1.0, 0.0, 0.0),
            time: 0.0,
        };
        for wall in [1e3, 1e8, 1e12, 1e38, 3e38] {
            for sigma in [[[0.0; 3], [1.0; 3]], [[0.5, 0.0, 1.0], [0.5, 2.0, 3.0]]] {
                let [sigma_a, sigma_s] = sigma.map(Rgb::from_array);
                let grid = DensityGrid::new([4, 1, 1], &[0.0, 0.0, 0.0, wall]);
                let phase = HenyeyGreenstein { g: 0.0 };
                let medium = GridMedium::new(grid, &Transform::IDENTITY, sigma_a, sigma_s, phase);
                let mut rng = Rng::new(4);
                for _ in 0..1000 {
                    let event = medium.sample(&ray, 100.0, Rgb::ONE, None, &mut rng);
                    let MediumEvent::Scatter { t, weight } = event else {
                        panic!("{wall}: nothing passes");
                    };
                    // Density begins at the centre of the last empty voxel.
                    assert!((5.62..5.9).contains(&t), "{wall}: {t}");
                    assert!(weight.is_finite() && !weight.has_negative(), "{weight:?}");
                    assert!(medium.transmittance(&ray, 100.0, &mut rng).max_component() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn columns_that_overflow_leave_clear_channels_clear() {
        let grid = DensityGrid::new([2, 1, 1], &[3e38; 2]);
        let (sigma_a, phase) = (
            Rgb::from_array([0.0, 1.0, 1.0]),
            HenyeyGreenstein { g: 0.0 },
        );
        let medium = GridMedium::new(grid, &Transform::IDENTITY, sigma_a, Rgb::BLACK, phase);
        let ray = Ray {
            o: crate::math::Point3::new(-1.0, 0.5, 0.5),
            d: crate::math::Vec3::new(1.0, 0.0, 0.0),
            time: 0.0,
        };
        let tr = medium.transmittance(&ray, 1e6, &mut Rng::new(1));
        assert_eq!(tr.to_array(), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn columns_do_not_drift_along_the_longest_of_ways() {
        let n = [16_384, 6, 6];
        let grid = DensityGrid::new(n, &vec![1.0; n[0] * n[1] * n[2]]);
        let (o, d) = (Vec3A::new(-90.5, 3.3, 4.1), Vec3A::new(0.93, 1e-5, -2e-5));
        let ray = LatticeRay::new(&grid.lattice, o + 0.5, d);
        let Column::Below(column) = grid.column(&ray, 1e6, f64::INFINITY) else {
            panic!("nothing reaches infinity");
        };
        // At either end the density fades to one half over half a voxel.
        let expected = (n[0] as f64 - 0.25) / 0.93;
        assert!(
            (column / expected - 1.0).abs() < 1e-5,
            "{column} for {expected}"
        );
    }

    #[test]
    fn the_longest_of_grids_is_looked_up_to_its_end() {
        let mut values = vec![0.0; MAX_VOXELS];
        values[MAX_VOXELS - 1] = 1.0;
        let grid = DensityGrid::new([MAX_VOXELS, 1, 1], &values);
        let at = |x: f32| grid.density(Vec3A::new(x, 0.5, 0.5));
        let end = MAX_VOXELS as f32;
        assert_eq!(at(end - 0.5), 1.0);
        assert_eq!([at(end), at(end - 1.0)], [0.5; 2]);
        assert_eq!([at(end + 1.0), at(end + 1e7), at(-1e7)], [0.5, 0.5, 0.0]);
    }
}
