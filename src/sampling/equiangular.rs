//! Distances along a segment by the angle under which a point sees them: in proportion to the inverse square of the
//! distance from it (Kulla and Fajardo, *Importance Sampling Techniques for Path Tracing in Participating Media*, 2012,
//! section 4).

use crate::math::Vec3;

/// The distances of a segment as a point beside it sees them.
#[derive(Clone, Copy, Debug)]
pub struct Equiangular {
    /// Where the perpendicular from the point meets the line of the segment, as a distance from its start.
    foot: f32,
    /// Distance of the point from that line.
    distance: f32,
    /// Angle under which the point sees the segment, in radians.
    angle: f32,
    /// Length of the segment.
    end: f32,
}

impl Equiangular {
    /// For a segment of the unit direction `d` and the finite length `end`, and a point that lies `to_point` from where it
    /// starts. `None` if the point sees nothing of it, as from a place on its line.
    #[inline]
    pub fn new(d: Vec3, end: f32, to_point: Vec3) -> Option<Self> {
        let foot = to_point.dot(d);
        let distance = to_point.cross(d).length();
        // The difference of two arcs by their tangents: what is seen under a small angle keeps its digits.
        let angle = (distance * end).atan2(distance * distance - foot * (end - foot));
        (angle > 0.0 && distance > 0.0).then_some(Self {
            foot,
            distance,
            angle,
            end,
        })
    }

    /// Distance of the point from the nearest place of the segment.
    #[inline]
    pub fn nearest(&self) -> f32 {
        let beside = self.foot - self.foot.clamp(0.0, self.end);
        beside.hypot(self.distance)
    }

    /// Draws a distance in [0, `end`] by `u` in [0, 1).
    #[inline]
    pub fn sample(&self, u: f32) -> f32 {
        let (sin, cos) = (u * self.angle).sin_cos();
        let squared = self.foot * self.foot + self.distance * self.distance;
        let t = squared * sin / (self.distance * cos + self.foot * sin);
        // Beyond either end by rounding, near the far one.
        if (0.0..=self.end).contains(&t) {
            t
        } else {
            self.end
        }
    }

    /// Density per length of the distance `t`, where the squared distance from the point is `squared`: said by the
    /// caller, so that the ratio to an inverse square is exact however close the point.
    #[inline]
    pub fn pdf(&self, t: f32, squared: f32) -> f32 {
        if t <= self.end {
            self.distance / (self.angle * squared)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;

    const D: Vec3 = Vec3::new(0.6, 0.0, 0.8);

    /// Points from next to the line to far from it, before, beside and behind the segment, and its lengths.
    fn cases() -> impl Iterator<Item = (f32, f32, f32)> {
        let distances = [1e-5, 1e-2, 0.3, 1.0, 20.0];
        let feet = [-3.0, -0.1, 0.0, 0.4, 2.0, 50.0];
        let ends = [1e-3, 0.5, 3.0, 1e4];
        distances.into_iter().flat_map(move |distance| {
            feet.into_iter()
                .flat_map(move |foot| ends.into_iter().map(move |end| (distance, foot, end)))
        })
    }

    fn of(distance: f32, foot: f32, end: f32) -> Equiangular {
        let aside = Vec3::new(0.0, distance, 0.0);
        Equiangular::new(D, end, D * foot + aside).expect("a point beside the line")
    }

    /// Integral of the density up to `t`, by the arcs it is made of.
    fn cumulative(distance: f32, foot: f32, end: f32, t: f32) -> f64 {
        let arc = |t: f32| ((f64::from(t) - f64::from(foot)) / f64::from(distance)).atan();
        (arc(t) - arc(0.0)) / (arc(end) - arc(0.0))
    }

    #[test]
    fn distances_are_drawn_by_the_angle_they_are_seen_under() {
        for (distance, foot, end) in cases() {
            let line = of(distance, foot, end);
            for u in [0.0, 1e-6, 0.1, 0.5, 0.9, 1.0f32.next_down()] {
                let t = line.sample(u);
                assert!((0.0..=end).contains(&t), "{distance} {foot} {end}: {t}");
                // A distance is a number of 24 bits, and so is the place of the point.
                let rounding = 4.0 * f32::EPSILON * (foot.abs() + t + distance);
                let slack = rounding * line.pdf(t, distance * distance).max(1.0 / end) + 1e-5;
                let reached = cumulative(distance, foot, end, t);
                assert!(
                    (reached - f64::from(u)).abs() < slack.into(),
                    "{distance} {foot} {end}: {u} is drawn as {t}, which is {reached}"
                );
            }
        }
    }

    #[test]
    fn densities_are_those_of_the_distances_drawn() {
        let mut rng = Rng::new(7);
        for (distance, foot, end) in cases() {
            let line = of(distance, foot, end);
            let t = rng.uniform() * end;
            let (dt, dd) = (f64::from(t - foot), f64::from(distance));
            let squared = dt * dt + dd * dd;
            let h = 1e-4 * squared.sqrt().min(f64::from(end));
            let arc = |t: f64| ((t - f64::from(foot)) / dd).atan();
            let all = arc(end.into()) - arc(0.0);
            let within = arc(f64::from(t) + h) - arc(f64::from(t) - h);
            let expected = within / (2.0 * h * all);
            let pdf = f64::from(line.pdf(t, squared as f32));
            // The distance of a point next to a line from it is known to the rounding of its place.
            let rounding = 8.0 * f32::EPSILON * (1.0 + foot.abs() / distance);
            let cancelled = 1e-15 / within;
            assert!(
                (pdf / expected - 1.0).abs() < 1e-3 + f64::from(rounding) + cancelled,
                "{distance} {foot} {end}: {pdf} at {t} instead of {expected}"
            );
            assert_eq!(line.pdf(2.0 * end, 1.0), 0.0);
        }
    }

    #[test]
    fn the_nearest_place_is_on_the_segment() {
        assert_eq!(of(3.0, -4.0, 1.0).nearest(), 5.0);
        assert_eq!(of(3.0, 0.5, 1.0).nearest(), 3.0);
        assert!((of(3.0, 5.0, 1.0).nearest() - 5.0).abs() < 1e-6);
    }

    #[test]
    fn from_a_place_on_its_line_nothing_is_seen() {
        let ahead = Vec3::new(0.0, 0.0, 2.0);
        assert!(Equiangular::new(Vec3::new(0.0, 0.0, 1.0), 5.0, ahead).is_none());
    }
}
