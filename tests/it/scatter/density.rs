//! What lobes draw follows the density they state, which covers all they scatter.

use std::f64::consts::PI;

use glam::DVec3;
use tyndall::math::{Frame, Normal3, Vec3};
use tyndall::sampling::warp::uniform_sphere;
use tyndall::scatter::microfacet::mirror;
use tyndall::scatter::{Bsdf, LobeSample, TransportMode};
use tyndall_test_support::chi2::{Chi2, Domain, Hemisphere, Sphere};
use tyndall_test_support::{Uniform, Verdict, assert_close};

use crate::scatter::cases::{
    LOSSLESS, WIDTHS, any_direction, ends, metal, narrow_lobes, smooth_lobes, surface, views,
    widths,
};

/// Unit vectors. Its poles, where cells are coarse, lie in the surface.
#[derive(Clone, Copy)]
struct AroundTangent;

impl Domain for AroundTangent {
    type Point = [f32; 3];
    const CELLS: [usize; 2] = Sphere::CELLS;
    const MEASURE: f64 = Sphere::MEASURE;

    fn point(square: [f64; 2]) -> [f32; 3] {
        let [x, y, z] = Sphere::point(square);
        [z, x, y]
    }

    fn place([z, x, y]: [f32; 3]) -> Option<[f64; 2]> {
        Sphere::place([x, y, z])
    }
}

/// Part of the directions that are drawn evenly, so that the edge of what a lobe reaches cuts no cell in two.
const EVENLY: f64 = 0.05;

/// χ² test of all that a surface draws for one view.
fn check_directions(family: &Chi2, bsdf: &Bsdf, wo: Vec3) -> Verdict {
    let draw = |random: &mut Uniform| {
        if f64::from(random.unit()) < EVENLY {
            return Some(any_direction(random).into());
        }
        let (u_lobe, u) = (random.unit(), random.unit2());
        let sample = bsdf.sample(wo, u_lobe, u, TransportMode::Radiance)?;
        Some(sample.wi.into())
    };
    let pdf = |w: [f32; 3]| {
        let drawn = f64::from(bsdf.pdf(wo, w.into()));
        (1.0 - EVENLY) * drawn + EVENLY / Sphere::MEASURE
    };
    family.check(AroundTangent, draw, pdf)
}

#[test]
fn lobes_draw_what_their_densities_say() {
    // Reflectance does not change what a rough reflection draws.
    let is_drawn_alike = |name: &str| name.starts_with("copper") || name.starts_with("plastic");
    let mut lobes = smooth_lobes();
    lobes.retain(|(name, _)| !is_drawn_alike(name));
    let views = views();
    let family = Chi2 {
        n_samples: 40_000,
        n_tests: lobes.len() * views.len(),
        ..Chi2::default()
    };
    for (name, lobe) in &lobes {
        let bsdf = surface([*lobe]);
        for &wo in &views {
            check_directions(&family, &bsdf, wo).assert_accepted(&format!("{name} from {wo:?}"));
        }
    }
}

#[test]
fn mixtures_draw_what_their_density_says() {
    let lobes = smooth_lobes();
    let views = views();
    let family = Chi2 {
        n_samples: 40_000,
        n_tests: 8 * views.len(),
        ..Chi2::default()
    };
    for k in 0..8 {
        let chosen = [k, 3 + 5 * k, 7 + 4 * k].map(|i| lobes[i % lobes.len()].clone());
        let bsdf = surface(chosen.clone().map(|(_, lobe)| lobe));
        for &wo in &views {
            check_directions(&family, &bsdf, wo)
                .assert_accepted(&format!("{} to {} from {wo:?}", chosen[0].0, chosen[2].0));
        }
    }
}

/// A facet normal in the space where the distribution is that of a sphere, however narrow it is.
fn stretched(h: Vec3, alpha: [f32; 2]) -> [f32; 3] {
    let [x, y, z] = <[f32; 3]>::from(h).map(f64::from);
    let (x, y) = (x / f64::from(alpha[0]), y / f64::from(alpha[1]));
    let scale = 1.0 / (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|c| (c * scale) as f32)
}

/// The normal that is stretched to `m`, and its solid angle per solid angle there.
fn unstretched(m: [f32; 3], alpha: [f32; 2]) -> (Vec3, f64) {
    let [x, y, z] = m.map(f64::from);
    let [ax, ay] = alpha.map(f64::from);
    let (x, y) = (ax * x, ay * y);
    let length = (x * x + y * y + z * z).sqrt();
    let h = [x, y, z].map(|c| (c / length) as f32);
    (Vec3::from(h), ax * ay / length.powi(3))
}

/// χ² tests of drawn normals in that space.
fn check_normals(
    family: &Chi2,
    alpha: [f32; 2],
    sample: impl Fn([f32; 2]) -> Option<Vec3>,
    pdf: impl Fn(Vec3) -> f32,
) -> Verdict {
    let clamped = alpha.map(|a| a.max(1e-3));
    family.check(
        Hemisphere,
        |random| {
            if f64::from(random.unit()) < EVENLY {
                let [x, y, z] = any_direction(random).into();
                return Some([x, y, z.abs()]);
            }
            Some(stretched(sample(random.unit2())?, clamped))
        },
        |m| {
            let (h, per_solid_angle) = unstretched(m, clamped);
            let drawn = f64::from(pdf(h)) * per_solid_angle;
            (1.0 - EVENLY) * drawn + EVENLY / Hemisphere::MEASURE
        },
    )
}

#[test]
fn visible_normals_and_reflections_follow_their_densities_however_narrow() {
    let views: Vec<_> = views().into_iter().filter(|w| w.z() > 0.0).collect();
    let family = Chi2 {
        n_tests: 2 * WIDTHS.len() * views.len(),
        ..Chi2::default()
    };
    for alpha in WIDTHS {
        let distribution = widths(alpha);
        for &wo in &views {
            let what = format!("{alpha:?} from {wo:?}");
            let sample = |u| Some(distribution.sample_normal(wo, u));
            let pdf = |h| distribution.pdf_normal(wo, h);
            check_normals(&family, alpha, sample, pdf).assert_accepted(&format!("normals {what}"));

            let sample = |u| {
                let wi = distribution.sample_reflection(wo, u)?;
                Some((wo + wi).normalize())
            };
            let pdf = |h: Vec3| {
                let wi = mirror(wo, h);
                if wo.dot(h) > 0.0 {
                    distribution.pdf_reflection(wo, wi) * 4.0 * wo.dot(h)
                } else {
                    0.0
                }
            };
            check_normals(&family, alpha, sample, pdf)
                .assert_accepted(&format!("reflections {what}"));
        }
    }
}

#[test]
fn the_judge_rejects_a_density_for_normals_of_another_width() {
    let wo = views()[2];
    for alpha in [[0.001, 0.001], [0.3, 0.3]] {
        let (drawn, stated) = (widths(alpha), widths(alpha.map(|a| 1.04 * a)));
        let verdict = check_normals(
            &Chi2::default(),
            alpha,
            |u| Some(drawn.sample_normal(wo, u)),
            |h| stated.pdf_normal(wo, h),
        );
        assert!(!verdict.accepted(), "{alpha:?}");
    }
}

/// pbrt-v3's density of facets with normal `h` that are seen from `wo`, by tangents and azimuths as its book has them.
fn facets_in_pbrt(alpha: [f64; 2], wo: DVec3, h: DVec3) -> f64 {
    let slope = |w: DVec3, squared: bool| {
        let sin2 = w.x * w.x + w.y * w.y;
        let (c, s) = (w.x * w.x / sin2, w.y * w.y / sin2);
        let tan2 = sin2 / (w.z * w.z);
        let [x, y] = alpha.map(|a| if squared { a * a } else { 1.0 / (a * a) });
        (c * x + s * y) * tan2
    };
    let d = 1.0 / (PI * alpha[0] * alpha[1] * h.z.powi(4) * (1.0 + slope(h, false)).powi(2));
    let lambda = 0.5 * ((1.0 + slope(wo, true)).sqrt() - 1.0);
    d / (1.0 + lambda) * wo.dot(h).abs() / wo.z.abs()
}

#[test]
fn densities_of_pbrt_are_means_over_its_lobes() {
    use tyndall::scatter::Bxdf;
    use tyndall::scatter::diffuse::Diffuse;
    use tyndall::scatter::disney::DisneyBase;
    use tyndall::scatter::fresnel_blend::FresnelBlend;
    use tyndall::scatter::rough_dielectric::RoughDielectric;
    use tyndall::scatter::specular::Mirror;
    use tyndall::spectrum::Rgb;
    let (alpha, eta) = ([0.3f32, 0.7], 1.5f64);
    let wide = alpha.map(f64::from);
    let grey = Rgb::splat(0.4);
    let cosine = |wo: DVec3, wi: DVec3| {
        if wo.z * wi.z > 0.0 {
            wi.z.abs() / PI
        } else {
            0.0
        }
    };
    let mirrored = |wo: DVec3, wi: DVec3| {
        let h = (wo + wi).normalize();
        let is_there = if wo.z * wi.z > 0.0 { 1.0 } else { 0.0 };
        is_there * facets_in_pbrt(wide, wo, h) / (4.0 * wo.dot(h))
    };
    let refracted = |wo: DVec3, wi: DVec3| {
        let eta = if wo.z > 0.0 { eta } else { 1.0 / eta };
        let h = (wo + wi * eta).normalize();
        if wo.z * wi.z > 0.0 || wo.dot(h) * wi.dot(h) > 0.0 {
            return 0.0;
        }
        let dh_dwi = eta * eta * wi.dot(h).abs() / (wo.dot(h) + eta * wi.dot(h)).powi(2);
        facets_in_pbrt(wide, wo, h) * dh_dwi
    };
    let widths = widths(alpha);
    let glass = |kr: Rgb| RoughDielectric::lobe(kr, grey, widths, eta as f32);
    let blend = Bxdf::FresnelBlend(FresnelBlend {
        rd: grey,
        rs: grey,
        distribution: widths,
    });
    let base = Bxdf::DisneyBase(DisneyBase {
        diffuse: grey,
        flat: grey,
        retro: grey,
        sheen: grey,
        roughness: 0.5,
        n_lobes_in_pbrt: 4,
    });
    let matte = Bxdf::Diffuse(Diffuse::new(grey, 20.0));
    let mirror = Bxdf::Mirror(Mirror { kr: Rgb::ONE });
    let metal = metal(alpha, LOSSLESS);
    // Lobes, and how often each of the three densities counts.
    let cases: [(&[Bxdf], [f64; 3]); 6] = [
        (&[matte, mirror], [1.0, 0.0, 0.0]),
        (&[matte, metal], [1.0, 1.0, 0.0]),
        (&[matte, glass(grey), mirror], [1.0, 1.0, 1.0]),
        (&[glass(Rgb::BLACK), metal], [0.0, 1.0, 1.0]),
        (&[blend, metal], [0.5, 1.5, 0.0]),
        (&[base, metal], [4.0, 1.0, 0.0]),
    ];
    let mut random = Uniform::new(9);
    for (lobes, counts) in cases {
        let mut bsdf = Bsdf::new(
            Frame::from_z(Vec3::new(0.0, 0.0, 1.0)),
            Normal3::new(0.0, 0.0, 1.0),
        );
        lobes.iter().for_each(|&lobe| bsdf.add(lobe));
        for _ in 0..500 {
            let [wo, wi] = [(); 2].map(|()| uniform_sphere(random.unit2()));
            let (o, i) = (local(&bsdf, wo), local(&bsdf, wi));
            let parts = [cosine(o, i), mirrored(o, i), refracted(o, i)];
            let sum: f64 = parts.iter().zip(counts).map(|(part, n)| part * n).sum();
            let expected = sum / counts.iter().sum::<f64>();
            let found = f64::from(bsdf.pdf_in_pbrt(wo, wi));
            let off = (found - expected).abs();
            assert!(
                off <= 1e-3 * expected + 1e-6,
                "{lobes:?} {o} {i}: {found} is not {expected}"
            );
        }
    }
}

fn local(bsdf: &Bsdf, w: Vec3) -> DVec3 {
    bsdf.frame().to_local(w).to_f64()
}

#[test]
fn every_lobe_has_a_density_where_it_scatters() {
    for (name, lobe) in smooth_lobes().into_iter().chain(narrow_lobes()) {
        let mut random = Uniform::new(7);
        for _ in 0..20_000 {
            let (wo, wi) = (any_direction(&mut random), any_direction(&mut random));
            let bsdf = surface([lobe]);
            let (f, pdf) = (bsdf.f(wo, wi, TransportMode::Radiance), bsdf.pdf(wo, wi));
            assert!(f.is_finite() && !f.has_negative(), "{name}: {f:?}");
            assert!(pdf >= 0.0 && pdf.is_finite(), "{name}: {pdf}");
            assert!(
                f.is_black() || pdf > 0.0,
                "{name}: from {wo:?} to {wi:?}, value {f:?} has no density"
            );
        }
    }
}

#[test]
fn n03_samples_are_sound_at_the_ends_of_the_random_numbers_and_of_the_angles() {
    let grazing =
        [1e-3, 1e-5, 1e-7, 1e-20, -1e-5, -1e-20].map(|z| crate::scatter::cases::at(z, 40.0));
    let views: Vec<_> = views().into_iter().chain(grazing).collect();
    for (name, lobe) in smooth_lobes().into_iter().chain(narrow_lobes()) {
        let bsdf = surface([lobe]);
        for &wo in &views {
            for (a, b, c) in ends()
                .into_iter()
                .flat_map(|a| ends().map(|b| (a, b)))
                .flat_map(|(a, b)| ends().map(|c| (a, b, c)))
            {
                let Some(sample) = bsdf.sample(wo, a, [b, c], TransportMode::Radiance) else {
                    continue;
                };
                let what = format!("{name} from {wo:?} by {:?}: {sample:?}", (a, b, c));
                let length = f64::from(sample.wi.length_squared()).sqrt();
                assert!((length - 1.0).abs() < 1e-4, "{what}");
                assert!(
                    sample.weight.is_finite() && !sample.weight.has_negative(),
                    "{what}"
                );
                assert!(sample.pdf_w > 0.0 && sample.pdf_w.is_finite(), "{what}");
                let stated = f64::from(bsdf.pdf(wo, sample.wi));
                let drawn = f64::from(sample.pdf_w);
                assert!((stated - drawn).abs() <= 1e-3 * drawn, "{what}: {stated}");
            }
        }
    }
}

#[test]
fn weights_are_value_times_cosine_over_density_and_bounded() {
    for (name, lobe) in smooth_lobes().into_iter().chain(narrow_lobes()) {
        let bsdf = surface([lobe]);
        let mut random = Uniform::new(3);
        for _ in 0..2000 {
            let wo = any_direction(&mut random);
            let (u_lobe, u) = (random.unit(), random.unit2());
            let Some(sample) = bsdf.sample(wo, u_lobe, u, TransportMode::Importance) else {
                continue;
            };
            let f = bsdf.f(wo, sample.wi, TransportMode::Importance);
            let expected = f * (bsdf.abs_cos(sample.wi) / bsdf.pdf(wo, sample.wi));
            for channel in 0..3 {
                let (weight, expected) = (sample.weight[channel], expected[channel]);
                assert!(
                    (weight - expected).abs() <= 2e-3 * expected.max(1e-3),
                    "{name}: {sample:?}: {expected}"
                );
                // Nothing but Oren–Nayar and the coat's base, which are drawn by the cosine alone, exceeds 1 by much.
                assert!(weight < 20.0, "{name}: {sample:?}");
            }
        }
    }
}

#[test]
fn directions_drawn_from_a_lobe_keep_to_its_sides() {
    use tyndall::scatter::Sides;
    for (name, lobe) in smooth_lobes() {
        let mut random = Uniform::new(5);
        for _ in 0..2000 {
            let wo = any_direction(&mut random);
            let (u_part, u) = (random.unit(), random.unit2());
            let Some(LobeSample::Smooth(wi)) = lobe.sample(wo, u_part, u, TransportMode::Radiance)
            else {
                continue;
            };
            let reflects = wo.z() * wi.z() > 0.0;
            let keeps = match lobe.sides() {
                Sides::Reflection => reflects,
                Sides::Transmission => !reflects,
                Sides::Both | Sides::Each => true,
            };
            assert!(keeps, "{name}: from {wo:?} to {wi:?}");
        }
    }
}

#[test]
fn the_distribution_projects_to_the_area_of_the_surface() {
    // ∫ D(h) cos θ dω = 1: in stretched space, D cos θ is that of a sphere.
    for alpha in WIDTHS {
        let distribution = widths(alpha);
        let clamped = alpha.map(|a| a.max(1e-3));
        for m in [
            [0.0, 0.0, 1.0],
            [0.6, 0.0, 0.8],
            [0.48, 0.64, 0.6],
            [0.0, -0.8, 0.6],
        ] {
            let (h, per_solid_angle) = unstretched(m, clamped);
            let density = f64::from(distribution.d(h)) * f64::from(h.z()) * per_solid_angle;
            assert_close(density, f64::from(m[2]) / PI, 1e-4);
        }
    }
}
