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

use glam::{Affine3A, Vec3A};

use crate::math::{Ray, Transform};
use crate::medium::homogeneous::beer_lambert;
use crate::medium::majorant::{CELL, MajorantGrid, Segment};
use crate::medium::{MediumEvent, channel_weights};
use crate::sampling::rng::Rng;
use crate::scatter::HenyeyGreenstein;
use crate::spectrum::Rgb;

/// A density field on a grid, in *voxel space*: cell (i, j, k) covers [i, i+1) × [j, j+1) × [k, k+1).
#[derive(Clone, Debug)]
pub struct DensityGrid {
    /// Values with a border of zeros, x fastest.
    padded: Vec<f32>,
    n: [usize; 3],
    /// From a value to the next along y and along z.
    strides: [usize; 2],
    /// Largest padded coordinate.
    limit: Vec3A,
    majorants: MajorantGrid,
}

/// From here to twice as much, numbers of f32 are whole, and their last digits count them.
const WHOLE: f32 = 8_388_608.0;
const WHOLE_DIGITS: u32 = (1 << 23) - 1;

/// Most voxels along an axis: places between them are numbers of f32.
pub const MAX_VOXELS: usize = 1 << 22;

impl DensityGrid {
    /// `values` holds nx·ny·nz finite, non-negative densities, x fastest; none of n is above [`MAX_VOXELS`].
    pub fn new(n: [usize; 3], values: &[f32]) -> Self {
        assert_eq!(values.len(), n[0] * n[1] * n[2], "loading checks the count");
        assert!(n.into_iter().all(|n| n <= MAX_VOXELS), "and the sizes");
        let [px, py, pz] = n.map(|n| n + 2);
        let mut padded = vec![0.0; px * py * pz];
        for (row, line) in values.chunks_exact(n[0]).enumerate() {
            let (y, z) = (row % n[1], row / n[1]);
            let start = ((z + 1) * py + y + 1) * px + 1;
            padded[start..start + n[0]].copy_from_slice(line);
        }
        // Within lo..=hi interpolation reads the values around lo − ½ … hi + ½, which are these padded entries. The
        // bound holds up to half a voxel beyond the box, more than any rounding along a ray.
        let majorants = MajorantGrid::new(n, |lo, hi| {
            let mut bound = 0f32;
            for z in lo[2]..=hi[2] + 1 {
                for y in lo[1]..=hi[1] + 1 {
                    let line = (z * py + y) * px;
                    bound = padded[line + lo[0]..=line + hi[0] + 1]
                        .iter()
                        .copied()
                        .fold(bound, f32::max);
                }
            }
            // Interpolation may round up.
            bound * (1.0 + 8.0 * f32::EPSILON)
        });
        Self {
            padded,
            n,
            strides: [px, px * py],
            limit: Vec3A::from(n.map(|n| n as f32)) + 0.5,
            majorants,
        }
    }

    /// Interpolated density at a point of voxel space inside the grid's box.
    #[inline]
    pub fn density(&self, p: Vec3A) -> f32 {
        // Padded coordinate: value i sits at i + 1, its cell centre at i + ½.
        let q = (p + 0.5).clamp(Vec3A::splat(0.5), self.limit);
        // The number below q ≥ ½ is the last digits of q − ½ + 2²³, rounded; at whole numbers it may be the one before,
        // with the same interpolation.
        let rounded = q + (WHOLE - 0.5);
        let f = q - (rounded - WHOLE);
        let [x, y, z] = rounded
            .to_array()
            .map(|c| (c.to_bits() & WHOLE_DIGITS) as usize);
        let base = z * self.strides[1] + y * self.strides[0] + x;
        let line = |offset: usize| {
            let v = &self.padded[base + offset..][..2];
            v[0] + f.x * (v[1] - v[0])
        };
        let lerp = |a: f32, b: f32, t: f32| a + t * (b - a);
        let [row, plane] = self.strides;
        let low = lerp(line(0), line(row), f.y);
        let high = lerp(line(plane), line(plane + row), f.y);
        lerp(low, high, f.z)
    }

    /// Integral of the density along o + t d, t in (0, `t_max`), o and d in voxel space. Between the planes through the
    /// centres of voxels the interpolated density is a cubic polynomial of t, which two points integrate exactly (Gauss
    /// and Legendre).
    fn column(&self, o: Vec3A, d: Vec3A, t_max: f32) -> f64 {
        // Distance of the points from the middle, over half the length.
        const POINT: f32 = 0.577_350_26;
        let inverse_d = d.recip();
        let mut column = 0.0;
        for Segment { t0, t1, .. } in self.majorants.walk(o, d, t_max) {
            let start = o + d * t0 + 0.5;
            let mut plane = Vec3A::select(
                d.cmpgt(Vec3A::ZERO),
                start.floor() + 1.0,
                start.ceil() - 1.0,
            );
            let mut t = t0;
            // A segment lies in a cell of the majorants, which so many planes cut.
            for _ in 0..3 * (CELL + 2) {
                let crossings = (plane - 0.5 - o) * inverse_d;
                let mut end = t1;
                for axis in 0..3 {
                    if d[axis] != 0.0 && crossings[axis] <= end {
                        end = crossings[axis];
                    }
                }
                for axis in 0..3 {
                    if d[axis] != 0.0 && crossings[axis] <= end {
                        plane[axis] += d[axis].signum();
                    }
                }
                if end > t {
                    let (middle, half) = (0.5 * (t + end), 0.5 * (end - t));
                    let at = |t: f32| f64::from(self.density(o + d * t));
                    column +=
                        f64::from(half) * (at(middle - POINT * half) + at(middle + POINT * half));
                    t = end;
                }
                if t >= t1 {
                    break;
                }
            }
        }
        column
    }

    /// Largest density anywhere.
    pub fn max(&self) -> f32 {
        self.majorants.max()
    }
}

/// A medium whose coefficients are multiplied by a density field.
#[derive(Clone, Debug)]
pub struct GridMedium {
    density: DensityGrid,
    voxel_from_render: Affine3A,
    sigma_t: Rgb,
    sigma_s: Rgb,
    /// Phase function.
    pub phase: HenyeyGreenstein,
    /// Extinction is the same in every channel.
    is_grey: bool,
}

/// Transmittance below which ratio tracking plays Russian roulette.
const ROULETTE_BELOW: f32 = 0.1;

impl GridMedium {
    /// `sigma_a`, `sigma_s` per unit of render space at density 1; `unit_from_render` maps the grid's box to [0, 1]³.
    pub fn new(
        density: DensityGrid,
        unit_from_render: &Transform,
        sigma_a: Rgb,
        sigma_s: Rgb,
        phase: HenyeyGreenstein,
    ) -> Self {
        let n = density.n.map(|n| n as f64);
        let scale = glam::DAffine3::from_scale(glam::DVec3::from(n));
        let affine = scale * *unit_from_render.affine();
        let voxel_from_render =
            Affine3A::from_mat3_translation(affine.matrix3.as_mat3(), affine.translation.as_vec3());
        let sigma_t = sigma_a + sigma_s;
        let is_grey = sigma_t.min_component() == sigma_t.max_component();
        Self {
            density,
            voxel_from_render,
            sigma_t,
            sigma_s,
            phase,
            is_grey,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.sigma_t.is_black() || self.density.max() == 0.0
    }

    #[inline]
    fn voxel_ray(&self, ray: &Ray) -> (Vec3A, Vec3A) {
        (
            self.voxel_from_render.transform_point3a(ray.o.0),
            self.voxel_from_render.transform_vector3a(ray.d.0),
        )
    }

    /// Runs through the tentative collisions of a Poisson process whose rate is the local majorant times
    /// `sigma`. `collide(t, ratio)` receives each one with density / majorant in [0, 1] and ends the run by `Some`.
    #[inline]
    fn track<T>(
        &self,
        ray: &Ray,
        t_max: f32,
        sigma: f32,
        rng: &mut Rng,
        mut collide: impl FnMut(f32, f32, &mut Rng) -> Option<T>,
    ) -> Option<T> {
        let (o, d) = self.voxel_ray(ray);
        let mut depth = rng.exponential();
        for Segment { t0, t1, majorant } in self.density.majorants.walk(o, d, t_max) {
            let rate = sigma * majorant;
            let mut t = t0;
            loop {
                let left = (t1 - t) * rate;
                if depth >= left {
                    depth -= left;
                    break;
                }
                t += depth / rate;
                let ratio = self.density.density(o + d * t) / majorant;
                if let Some(result) = collide(t, ratio, rng) {
                    return Some(result);
                }
                depth = rng.exponential();
            }
        }
        None
    }

    /// Delta tracking (Woodcock 1965) under local majorants; coloured extinction by spectral tracking (Kutz et al.
    /// 2017), where the throughput of the path decides between real and null collisions.
    pub(super) fn sample(&self, ray: &Ray, t_max: f32, beta: Rgb, rng: &mut Rng) -> MediumEvent {
        if self.sigma_s.is_black() {
            return MediumEvent::Pass {
                weight: self.transmittance(ray, t_max, rng),
            };
        }
        let sigma = self.sigma_t.max_component();
        if self.is_grey {
            let albedo = self.sigma_s * (1.0 / sigma);
            return self
                .track(ray, t_max, sigma, rng, |t, ratio, rng| {
                    (rng.uniform() < ratio).then_some(t)
                })
                .map_or(MediumEvent::Pass { weight: Rgb::ONE }, |t| {
                    MediumEvent::Scatter { t, weight: albedo }
                });
        }
        let relative = self.sigma_t * (1.0 / sigma);
        let scattering = self.sigma_s * (1.0 / sigma);
        let mut weight = Rgb::ONE;
        let scattered = self.track(ray, t_max, sigma, rng, |t, ratio, rng| {
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

    /// Ratio tracking (Novák et al. 2014) under local majorants, with Russian roulette once little is left. A medium that
    /// only absorbs needs no dice.
    pub(super) fn transmittance(&self, ray: &Ray, t_max: f32, rng: &mut Rng) -> Rgb {
        if self.sigma_s.is_black() {
            let (o, d) = self.voxel_ray(ray);
            return beer_lambert(self.sigma_t, self.density.column(o, d, t_max) as f32);
        }
        let sigma = self.sigma_t.max_component();
        let relative = self.sigma_t * (1.0 / sigma);
        let mut tr = Rgb::ONE;
        let absorbed = self.track(ray, t_max, sigma, rng, |_, ratio, rng| {
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
}

#[cfg(test)]
mod tests {
    use super::*;

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
