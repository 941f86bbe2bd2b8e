//! Where to send light from points, so that it comes to the film.
//!
//! Most light of a spot falls where no camera looks, or where the camera looks for it by itself; what comes to the film
//! from the light's end alone, caustics before all, may start in a thousandth of its directions. A few light paths
//! that are followed before the picture is begun tell which: half of the others start there, in proportion to the root
//! of the squared contributions (Jensen 2001, *Realistic Image Synthesis Using Photon Mapping*, section 5.1, knows the
//! directions toward glass and mirrors; Vorba et al. 2014 learn where to emit).
//!
//! Directions have a density under any guide, and none has density 0 that has light: whatever the guide, pictures
//! converge to the same.

use std::f32::consts::TAU;

use crate::light::Light;
use crate::math::{Frame, Point3, Vec3};
use crate::sampling::cumulative::Cumulative;
use crate::world::World;

/// Cells of a guide along either of its sides.
const SIDE: usize = 64;
const N_CELLS: usize = SIDE * SIDE;
/// Part of the light paths that start as the guide says.
const SHARE: f32 = 0.5;
/// Least height of a cap. In those of less than a quarter of a degree directions are too coarse for cells.
const MIN_HEIGHT: f32 = 1e-5;

/// Directions around an axis, in cells of one size. A place among them is a pair in [0, 1)²: height of the cap that
/// ends there (1 − cos, which keeps the digits of narrow cones), and angle around the axis.
#[derive(Clone, Copy, Debug)]
struct Cap {
    frame: Frame,
    /// 1 − cos of its half angle: its solid angle is 2π times as much.
    height: f32,
}

impl Cap {
    /// Around all directions in which a point sends light to what camera paths get to.
    fn of(light: &Light, p: Point3, world: &World) -> Self {
        let (center, radius) = world.reach();
        let to_center = center - p.to_f64();
        let sine = radius / to_center.length();
        let mut cap = if sine < 1.0 {
            Self {
                frame: Frame::from_z(Vec3::from_f64(to_center.normalize())),
                height: height_of(sine.asin() as f32),
            }
        } else {
            Self {
                frame: Frame::from_z(Vec3::new(0.0, 0.0, 1.0)),
                height: 2.0,
            }
        };
        if let Light::Spot(spot) = light {
            let (axis, half_angle) = spot.cone();
            let height = height_of(half_angle);
            if height < cap.height {
                cap = Self {
                    frame: Frame::from_z(axis),
                    height,
                };
            }
        }
        cap
    }

    fn direction(&self, place: [f32; 2]) -> Vec3 {
        let height = place[0] * self.height;
        let (sin, cos) = (TAU * place[1]).sin_cos();
        let r = (height * (2.0 - height)).max(0.0).sqrt();
        self.frame
            .to_world(Vec3::new(r * cos, r * sin, 1.0 - height))
    }

    /// The cell of a unit direction; `None` outside.
    fn cell(&self, d: Vec3) -> Option<usize> {
        let local = self.frame.to_local(d);
        let from_axis = Vec3::new(local.x(), local.y(), local.z() - 1.0);
        let height = 0.5 * from_axis.length_squared();
        if !(height < self.height) {
            return None;
        }
        let turn = local.y().atan2(local.x()) / TAU;
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        let index = |x: f32| ((x * SIDE as f32) as usize).min(SIDE - 1);
        Some(index(height / self.height) * SIDE + index(turn))
    }
}

fn height_of(half_angle: f32) -> f32 {
    2.0 * (0.5 * half_angle).sin().powi(2)
}

/// Which directions of a point light bring light to the film.
#[derive(Clone, Debug)]
pub struct EmissionGuide {
    cap: Cap,
    /// Which row of cells, and which cell of each.
    rows: Cumulative,
    cells: Vec<Cumulative>,
    /// Density of each cell in sr⁻¹.
    density: Vec<f32>,
}

impl EmissionGuide {
    /// A direction, by `u`, if this half of the square is the guide's; the other half is stretched for the light's own.
    /// `None` where rounding carries it into another cell, whose density may be any.
    pub(super) fn sample(&self, u: [f32; 2]) -> Result<Option<Vec3>, [f32; 2]> {
        if u[0] >= SHARE {
            return Err([(u[0] - SHARE) / (1.0 - SHARE), u[1]]);
        }
        let (row, y) = self.rows.sample(u[0] / SHARE);
        let (column, x) = self.cells[row].sample(u[1]);
        let place = |index: usize, rest: f32| (index as f32 + rest) / SIDE as f32;
        let d = self.cap.direction([place(row, y), place(column, x)]);
        Ok((self.cap.cell(d) == Some(row * SIDE + column)).then_some(d))
    }

    /// Density in sr⁻¹ of a unit direction that the light itself draws with density `own`.
    pub(super) fn pdf(&self, d: Vec3, own: f32) -> f32 {
        let guided = self.cap.cell(d).map_or(0.0, |cell| self.density[cell]);
        SHARE * guided + (1.0 - SHARE) * own
    }
}

/// A guide that learns.
#[derive(Clone, Debug)]
pub struct GuideTraining {
    cap: Cap,
    /// For each cell the sum of squared contributions, each times the density it was drawn with: an integral over the
    /// cell.
    seen: Vec<f64>,
}

impl GuideTraining {
    /// For a light that is a point, and shines into more than a needle.
    pub(super) fn of(light: &Light, world: &World) -> Option<Self> {
        let cap = Cap::of(light, light.position()?, world);
        (cap.height > MIN_HEIGHT).then(|| Self {
            cap,
            seen: vec![0.0; N_CELLS],
        })
    }

    /// A light path that started in direction `d`, drawn with density `pdf` in sr⁻¹, contributed so much to the film.
    pub fn see(&mut self, d: Vec3, pdf: f32, contribution: f32) {
        if let Some(cell) = self.cap.cell(d) {
            self.seen[cell] += f64::from(contribution).powi(2) * f64::from(pdf);
        }
    }

    /// What it has learnt; `None` where nothing was seen.
    pub fn guide(&self) -> Option<EmissionGuide> {
        // Few paths know little of a single cell: its neighbours count, too.
        let around = |i: usize, j: usize| -> f64 {
            let rows = i.saturating_sub(1)..(i + 2).min(SIDE);
            let of_row = |i: usize| -> f64 {
                let columns = [j + SIDE - 1, j, j + 1];
                columns.map(|j| self.seen[i * SIDE + j % SIDE]).iter().sum()
            };
            rows.map(of_row).sum()
        };
        let weights: Vec<f64> = (0..N_CELLS)
            .map(|cell| around(cell / SIDE, cell % SIDE).sqrt())
            .collect();
        let total: f64 = weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let of_rows: Vec<f64> = weights.chunks(SIDE).map(|row| row.iter().sum()).collect();
        let solid_angle = f64::from(TAU * self.cap.height) / N_CELLS as f64;
        Some(EmissionGuide {
            cap: self.cap,
            rows: Cumulative::new(&of_rows),
            cells: weights.chunks(SIDE).map(Cumulative::new).collect(),
            density: weights
                .iter()
                .map(|weight| (weight / (total * solid_angle)) as f32)
                .collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;

    /// One that has seen light come from a corner of what it knows, and from across the seam of the angle.
    fn taught(axis: Vec3, height: f32) -> GuideTraining {
        let cap = Cap {
            frame: Frame::from_z(axis),
            height,
        };
        let mut training = GuideTraining {
            cap,
            seen: vec![0.0; N_CELLS],
        };
        for (place, contribution) in [([0.3, 0.2], 1.0), ([0.31, 0.22], 3.0), ([0.8, 0.99], 0.5)] {
            training.see(cap.direction(place), 0.1, contribution);
        }
        training
    }

    #[test]
    fn guided_directions_have_the_density_that_is_told() {
        for (axis, height) in [
            (Vec3::new(0.0, 0.0, 1.0), 2.0),
            (Vec3::new(0.6, 0.0, -0.8), 0.3),
            (Vec3::new(0.0, -1.0, 0.0), 1e-5),
        ] {
            let training = taught(axis, height);
            let (cap, guide) = (training.cap, training.guide().expect("light was seen"));
            let mut rng = Rng::new(3);
            let n = 400_000;
            let mut counts = vec![0u32; N_CELLS];
            let mut n_lost = 0;
            for _ in 0..n {
                let [u, v] = rng.uniform2();
                let d = guide.sample([u * SHARE, v]).expect("the guide's half");
                let Some(d) = d else {
                    n_lost += 1;
                    continue;
                };
                assert!((d.length_squared() - 1.0).abs() < 1e-5);
                counts[cap.cell(d).expect("in the cap")] += 1;
            }
            let solid_angle = TAU * height / N_CELLS as f32;
            let mut chi2 = 0.0;
            let mut n_cells = 0;
            for (cell, &count) in counts.iter().enumerate() {
                let place = [cell / SIDE, cell % SIDE].map(|i| (i as f32 + 0.5) / SIDE as f32);
                // Without a density of the light's own, the guide's half is left.
                let p = guide.pdf(cap.direction(place), 0.0) / SHARE * solid_angle;
                let expected = f64::from(p) * f64::from(n);
                if expected == 0.0 {
                    assert_eq!(count, 0, "cell {cell}");
                } else {
                    chi2 += (f64::from(count) - expected).powi(2) / expected;
                    n_cells += 1;
                }
            }
            assert!(
                n_lost < n / 10_000,
                "{height}: {n_lost} carried over borders"
            );
            let limit = f64::from(n_cells) + 6.0 * (2.0 * f64::from(n_cells)).sqrt();
            assert!(n_cells >= 18 && chi2 < limit, "{height}: {chi2}, {n_cells}");
        }
    }

    #[test]
    fn the_half_of_the_light_fills_the_square() {
        let guide = taught(Vec3::new(0.0, 0.0, 1.0), 2.0).guide();
        let guide = guide.expect("light was seen");
        assert_eq!(guide.sample([SHARE, 0.25]), Err([0.0, 0.25]));
        let last = guide.sample([1.0 - f32::EPSILON / 2.0, 0.25]);
        assert!(last.is_err_and(|[x, _]| x < 1.0 && x > 0.999_999));
    }

    #[test]
    fn what_the_light_draws_keeps_a_density_wherever_it_is() {
        let guide = taught(Vec3::new(0.0, 0.0, 1.0), 0.3).guide();
        let guide = guide.expect("light was seen");
        for d in [Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.0, 0.0, 1.0)] {
            assert!(guide.pdf(d, 0.2) >= (1.0 - SHARE) * 0.2);
        }
    }

    #[test]
    fn who_has_seen_nothing_guides_nobody() {
        let mut training = taught(Vec3::new(0.0, 0.0, 1.0), 2.0);
        training.seen.fill(0.0);
        assert!(training.guide().is_none());
        training.seen[7] = f64::INFINITY;
        assert!(training.guide().is_none());
    }
}
