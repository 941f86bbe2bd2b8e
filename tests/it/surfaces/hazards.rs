//! Shapes far away, and emitters that are curves.

use std::f64::consts::PI;

use crate::common::probe::{Probe, assert_mean};
use crate::common::solids::seen_by;

#[test]
fn g07_a_ball_far_from_everything_has_no_rings() {
    // A ball of radius 600 far from the origin, seen from 1000 above its surface, the sun in the camera.
    let (radius, x) = (600.0, 8e5);
    for distance in [1000.0, 1e5] {
        let d = radius + distance;
        let world = format!(
            "LightSource \"distant\" \"point from\" [0 0 1] \"point to\" [0 0 0] \"rgb L\" [{PI} {PI} {PI}]\n\
             Material \"matte\" \"rgb Kd\" [1 1 1] Translate {x} 0 0 Shape \"sphere\" \"float radius\" {radius}\n"
        );
        let mut last = f64::INFINITY;
        for k in 0..60 {
            // The cosine of the angle between axis and normal where the ray at `sin` off the axis meets the ball.
            let ring = f64::from(k) / 60.0 * 0.999;
            let sin = ring * radius / d;
            let cos = (1.0 - sin * sin).sqrt();
            let t = d * cos - (radius * radius - (d * sin).powi(2)).sqrt();
            let expected = (d - t * cos) / radius;
            let scene = seen_by("path", 1, [x, 0.0, d], [0.0, sin, -cos], &world);
            let radiance = f64::from(Probe::new(&scene).samples(1)[0][0]);
            assert!(
                (radiance - expected).abs() < 0.01 * expected.max(0.1),
                "ring {k} from {distance}: {radiance} is not {expected}"
            );
            assert!(radiance < last * 1.01, "ring {k} from {distance}");
            last = radiance;
        }
    }
}

#[test]
fn l03_a_glowing_curve_lights_the_floor_like_a_band() {
    // A straight curve of width w above a floor turns its full width to the point below; for a thin one the
    // irradiance is w L times the integral of cos over distance squared times the sine against the tangent.
    let (width, height, half) = (0.02, 1.0, 3.0f64);
    let floor = "AttributeBegin Material \"matte\" \"rgb Kd\" [1 1 1] Translate 0 0 -1 Shape \"disk\" \"float radius\" 50 AttributeEnd\n";
    for style in ["flat", "cylinder"] {
        let points = [-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0].map(|t| format!("{} 0 0", t * half));
        let curve = format!(
            "AreaLightSource \"diffuse\" \"rgb L\" [10 10 10] Material \"matte\" \"rgb Kd\" [0 0 0]\n\
             Shape \"curve\" \"string type\" \"{style}\" \"point P\" [{}] \"float width\" {width}\n",
            points.join(" ")
        );
        // With r² = h² + x²: ∫ (h / r) (h / r) / r² dx.
        let f = |x: f64| {
            0.5 * (x / (height * (height * height + x * x))
                + (x / height).atan() / (height * height))
        };
        let irradiance = 10.0 * width * height * height * 2.0 * f(half);
        for integrator in ["path", "volpath"] {
            let scene = seen_by(
                integrator,
                1,
                [0.0, 0.3, -0.5],
                [0.0, -0.3, -0.5],
                &format!("{floor}{curve}"),
            );
            // A band of this width is wider than thin by 10⁻⁴ of its light.
            assert_mean(
                &scene,
                40_000,
                [irradiance / PI; 3],
                &format!("{style}, {integrator}"),
            );
        }
    }
}
