//! Density grids as scene text, and their field in double precision from the format's definition: values at cell
//! centres, trilinear, 0 beyond the grid.

use crate::common::solids::{V, coefficients};
use crate::media::vectors::{along, span_in_box, unit};

/// A grid in the box from `lo` to `hi`.
pub(crate) struct Nebula {
    pub(crate) n: [usize; 3],
    pub(crate) density: Vec<f64>,
    pub(crate) lo: V,
    pub(crate) hi: V,
}

impl Nebula {
    /// The same value in all cells.
    pub(crate) fn uniform(n: [usize; 3], density: f64, lo: V, hi: V) -> Self {
        let density = vec![density; n.iter().product()];
        Self { n, density, lo, hi }
    }

    /// Values between 0 and 2 without a pattern, a fifth of them 0.
    pub(crate) fn ragged(n: [usize; 3], lo: V, hi: V) -> Self {
        let mut random = tyndall_test_support::Uniform::new(17);
        let mut value = || {
            let u = f64::from(random.unit());
            if u < 0.2 { 0.0 } else { 2.5 * (u - 0.2) }
        };
        let density = (0..n.iter().product()).map(|_| value()).collect();
        Self { n, density, lo, hi }
    }

    /// The medium directive.
    pub(crate) fn medium(&self, name: &str, sigma_a: V, sigma_s: V, g: f64) -> String {
        let [nx, ny, nz] = self.n;
        let list = |v: &[f64]| {
            let words: Vec<String> = v.iter().map(f64::to_string).collect();
            words.join(" ")
        };
        format!(
            "MakeNamedMedium \"{name}\" \"string type\" \"heterogeneous\" \"float g\" {g} {} \
             \"integer nx\" {nx} \"integer ny\" {ny} \"integer nz\" {nz} \
             \"point p0\" [{}] \"point p1\" [{}] \"float density\" [{}]\n",
            coefficients(sigma_a, sigma_s),
            list(&self.lo),
            list(&self.hi),
            list(&self.density)
        )
    }

    fn value(&self, index: [i64; 3]) -> f64 {
        let inside = |k: usize| (0..self.n[k] as i64).contains(&index[k]);
        if !(0..3).all(inside) {
            return 0.0;
        }
        let [x, y, z] = index.map(|i| i as usize);
        self.density[(z * self.n[1] + y) * self.n[0] + x]
    }

    /// The field at a point of the world; 0 outside the box.
    pub(crate) fn field(&self, p: V) -> f64 {
        let unit = [0, 1, 2].map(|k| (p[k] - self.lo[k]) / (self.hi[k] - self.lo[k]));
        if unit.iter().any(|x| !(0.0..=1.0).contains(x)) {
            return 0.0;
        }
        let q = [0, 1, 2].map(|k| unit[k] * self.n[k] as f64 - 0.5);
        let mut sum = 0.0;
        for corner in 0..8 {
            let mut weight = 1.0;
            let index = [0, 1, 2].map(|k| {
                let (floor, high) = (q[k].floor(), corner >> k & 1);
                let f = q[k] - floor;
                weight *= if high == 1 { f } else { 1.0 - f };
                floor as i64 + high
            });
            sum += weight * self.value(index);
        }
        sum
    }

    /// Integral of the field along a ray, by the midpoint rule.
    pub(crate) fn column(&self, o: V, d: V) -> f64 {
        const STEPS: usize = 100_000;
        let d = unit(d);
        let [t0, t1] = span_in_box(o, d, self.lo, self.hi);
        let dt = (t1 - t0) / STEPS as f64;
        let at = |i: usize| self.field(along(o, d, t0 + (i as f64 + 0.5) * dt));
        (0..STEPS).map(at).sum::<f64>() * dt
    }
}
