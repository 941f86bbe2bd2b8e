//! The Disney material: every slider at its ends, by χ², by two estimators of its energy, and in closed form.

use std::f32::consts::PI;

use tyndall::ids::MaterialId;
use tyndall::material::disney::{Disney, Interior};
use tyndall::material::{Material, Materials, Model};
use tyndall::math::{Normal3, Point3, Vec3};
use tyndall::sampling::warp::uniform_sphere;
use tyndall::scatter::disney::Clearcoat;
use tyndall::scatter::{Bsdf, TransportMode};
use tyndall::shape::SurfacePoint;
use tyndall::spectrum::Rgb;
use tyndall::texture::{FloatSource, SpectrumSource, TextureContext, Textures};
use tyndall_test_support::Uniform;
use tyndall_test_support::chi2::{Chi2, Hemisphere, Sphere};
use tyndall_test_support::z_test::Mean;

use crate::common::probe::Probe;
use crate::scatter_measured::lit;

use TransportMode::Radiance;

const COLOR: Rgb = Rgb::new(0.8, 0.4, 0.1);

fn constant(value: f32) -> FloatSource {
    FloatSource::Constant(value)
}

fn thin(flatness: f32, transmission: f32) -> Interior {
    Interior::Thin(constant(flatness), constant(transmission))
}

/// The defaults of scene files, in colour.
fn plain() -> Disney {
    Disney {
        color: SpectrumSource::Constant(COLOR),
        metallic: constant(0.0),
        eta: constant(1.5),
        roughness: constant(0.5),
        specular_tint: constant(0.0),
        anisotropic: constant(0.0),
        sheen: constant(0.0),
        sheen_tint: constant(0.5),
        clearcoat: constant(0.0),
        clearcoat_gloss: constant(1.0),
        specular_transmission: constant(0.0),
        interior: Interior::Solid(SpectrumSource::Constant(Rgb::BLACK), 1.0),
    }
}

/// Sliders at their ends. Highlights are wide enough for the cells of χ².
fn sheets() -> Vec<(&'static str, Disney)> {
    let one = constant(1.0);
    vec![
        ("plain", plain()),
        (
            "metal, stretched",
            Disney {
                metallic: one,
                anisotropic: one,
                roughness: constant(0.8),
                ..plain()
            },
        ),
        (
            "cloth",
            Disney {
                sheen: one,
                sheen_tint: one,
                roughness: one,
                ..plain()
            },
        ),
        (
            "satin coat",
            Disney {
                clearcoat: one,
                clearcoat_gloss: constant(0.0),
                specular_tint: one,
                ..plain()
            },
        ),
        (
            "frosted",
            Disney {
                specular_transmission: constant(0.7),
                ..plain()
            },
        ),
        (
            "leaf",
            Disney {
                interior: thin(0.6, 1.2),
                ..plain()
            },
        ),
        (
            "frosted sheet",
            Disney {
                interior: thin(1.0, 0.0),
                specular_transmission: constant(0.5),
                roughness: constant(0.9),
                ..plain()
            },
        ),
    ]
}

/// What lies in the plane z = 0.
struct Sheet {
    materials: Materials,
    textures: Textures,
}

impl Sheet {
    fn new(disney: &Disney) -> Self {
        let model = Model::Disney(disney.clone());
        Self {
            materials: Materials {
                list: vec![Material { model, bump: None }],
                ..Materials::default()
            },
            textures: Textures::default(),
        }
    }

    fn bsdf(&self) -> Bsdf<'_> {
        let (x, y) = (Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0));
        let n = Normal3::new(0.0, 0.0, 1.0);
        let surface = SurfacePoint {
            p: Point3::ZERO,
            p_err: Vec3::ZERO,
            ng: n,
            n_surface: n,
            ns: n,
            uv: [0.5; 2],
            dpdu: x,
            dpdv: y,
            tangent: x,
            bitangent: y,
            dndu: Vec3::ZERO,
            dndv: Vec3::ZERO,
            face: 0,
            dn_scale: 1.0,
        };
        let ctx = TextureContext {
            p: Point3::ZERO,
            uv: [0.5; 2],
            duv_dx: [0.0; 2],
            duv_dy: [0.0; 2],
            dp_dx: Vec3::ZERO,
            dp_dy: Vec3::ZERO,
            face: 0,
        };
        self.materials
            .bsdf(MaterialId::new(0), &surface, &ctx, &self.textures)
    }
}

/// From above, from below, and grazing.
fn viewers() -> [Vec3; 4] {
    [
        Vec3::new(0.0, 0.0, 1.0),
        Vec3::new(0.5, 0.4, 0.6),
        Vec3::new(-0.3, 0.5, -0.5),
        Vec3::new(1.0, -0.4, 0.02),
    ]
    .map(Vec3::normalize)
}

#[test]
fn samples_follow_their_density() {
    let n_tests = sheets().len() * viewers().len();
    for (k, (name, disney)) in sheets().into_iter().enumerate() {
        let sheet = Sheet::new(&disney);
        let bsdf = sheet.bsdf();
        for wo in viewers() {
            let chi2 = Chi2 {
                n_samples: 40_000,
                seed: k as u64,
                n_tests,
                ..Chi2::default()
            };
            let draw = |u: &mut Uniform| {
                let u_lobe = u.unit();
                Some(bsdf.sample(wo, u_lobe, u.unit2(), Radiance)?.wi.into())
            };
            let pdf = |wi: [f32; 3]| f64::from(bsdf.pdf(wo, wi.into()));
            chi2.check(Sphere, draw, pdf)
                .assert_accepted(&format!("{name} from {wo:?}"));
        }
    }
}

#[test]
fn the_density_of_another_coat_is_rejected() {
    let wo = viewers()[1];
    let judge = |drawn: Clearcoat, claimed: Clearcoat| {
        Chi2::default().check(
            Hemisphere,
            |u| drawn.sample(wo, u.unit2()).map(Into::into),
            |wi| claimed.pdf(wo, wi.into()).into(),
        )
    };
    judge(Clearcoat::new(1.0, 0.0), Clearcoat::new(1.0, 0.0)).assert_accepted("itself");
    assert!(!judge(Clearcoat::new(1.0, 0.0), Clearcoat::new(1.0, 0.1)).accepted());
}

#[test]
fn facets_of_the_coat_cover_the_surface_at_every_gloss() {
    let wo = Vec3::new(0.0, 0.0, 1.0);
    for gloss in [-20.0, 0.0, 0.5, 1.0, 3.0] {
        let coat = Clearcoat::new(1.0, gloss);
        // Over the logarithm of the angle of the light, which mirrors half of it.
        let (low, high, n) = (1e-7f64.ln(), std::f64::consts::FRAC_PI_2.ln(), 20_000);
        let step = (high - low) / f64::from(n);
        let reflected: f64 = (0..n)
            .map(|k| (low + (f64::from(k) + 0.5) * step).exp())
            .map(|angle| {
                let wi = Vec3::new(angle.sin() as f32, 0.0, angle.cos() as f32);
                f64::from(coat.pdf(wo, wi)) * 2.0 * std::f64::consts::PI * angle.sin() * angle
            })
            .sum::<f64>()
            * step;
        // Facets steeper than 45° mirror into the surface.
        let mut random = Uniform::new(1);
        let kept = Mean::of(100_000, || {
            let wi = coat.sample(wo, random.unit2());
            f64::from(u8::from(wi.is_some()))
        });
        kept.agrees_with(reflected)
            .assert_accepted(&format!("gloss {gloss}"));
    }
}

/// Energy toward `wo` by sampling, in luminance.
fn sampled(bsdf: &Bsdf, wo: Vec3, n: usize) -> Mean {
    let mut random = Uniform::new(3);
    Mean::of(n, || {
        let u_lobe = random.unit();
        let Some(sample) = bsdf.sample(wo, u_lobe, random.unit2(), Radiance) else {
            return 0.0;
        };
        let weight = sample.weight;
        assert!(
            weight.is_finite() && weight.min_component() >= 0.0,
            "{sample:?}"
        );
        weight.luminance().into()
    })
}

#[test]
fn m05_energy_by_sampling_is_energy_by_uniform_directions() {
    for (name, disney) in sheets() {
        let sheet = Sheet::new(&disney);
        let bsdf = sheet.bsdf();
        for wo in viewers() {
            let sampled = sampled(&bsdf, wo, 60_000);
            let mut random = Uniform::new(5);
            let uniform = Mean::of(300_000, || {
                let wi = uniform_sphere(random.unit2());
                let f = bsdf.f(wo, wi, Radiance) * (bsdf.abs_cos(wi) * 4.0 * PI);
                assert!(
                    bsdf.pdf(wo, wi) > 0.0 || f.is_black(),
                    "{name} {wo:?} {wi:?}"
                );
                f.luminance().into()
            });
            let error = sampled.standard_error.hypot(uniform.standard_error);
            let difference = sampled.value - uniform.value;
            assert!(
                difference.abs() < 4.5 * error + 1e-4,
                "{name} from {wo:?}: {sampled:?}, {uniform:?}"
            );
        }
    }
}

#[test]
fn m05_sheen_and_coat_add_up_as_they_do_in_pbrt() {
    // More comes back than went in: additive lobes, kept on purpose.
    let white = Disney {
        color: SpectrumSource::Constant(Rgb::ONE),
        sheen: constant(1.0),
        clearcoat: constant(1.0),
        roughness: constant(1.0),
        ..plain()
    };
    let sheet = Sheet::new(&white);
    let grazing = sampled(&sheet.bsdf(), Vec3::new(0.995, 0.0, 0.1), 100_000);
    assert!((1.05..1.7).contains(&grazing.value), "{grazing:?}");
}

#[test]
fn narrow_highlights_stay_sound() {
    for roughness in [0.0, 1e-4, 0.03] {
        for anisotropic in [0.0, 1.0] {
            for transmission in [0.0, 1.0] {
                for interior in [plain().interior, thin(0.5, 1.0)] {
                    let sheet = Sheet::new(&Disney {
                        metallic: constant(0.2),
                        roughness: constant(roughness),
                        anisotropic: constant(anisotropic),
                        clearcoat: constant(1.0),
                        specular_transmission: constant(transmission),
                        interior,
                        ..plain()
                    });
                    let bsdf = sheet.bsdf();
                    for wo in viewers() {
                        let energy = sampled(&bsdf, wo, 4000);
                        assert!(energy.value < 3.0, "{roughness} {wo:?}: {energy:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn reflection_is_the_same_both_ways() {
    let mut random = Uniform::new(9);
    for (name, disney) in sheets() {
        let sheet = Sheet::new(&disney);
        let bsdf = sheet.bsdf();
        for _ in 0..2000 {
            let [a, b] = [0, 1].map(|_| uniform_sphere(random.unit2()));
            if a.z() * b.z() > 0.0 {
                let (there, back) = (bsdf.f(a, b, Radiance).g(), bsdf.f(b, a, Radiance).g());
                let difference = (there - back).abs();
                assert!(difference <= 1e-4 * there, "{name}: {there} and {back}");
            }
        }
    }
}

#[track_caller]
fn assert_near(actual: f32, expected: f32, what: &str) {
    assert!(
        (actual / expected - 1.0).abs() < 1e-4,
        "{what}: {actual} is not {expected}"
    );
}

#[test]
fn values_head_on_are_those_of_the_formulas() {
    let n = Vec3::new(0.0, 0.0, 1.0);
    let value = |disney: Disney| Sheet::new(&disney).bsdf().f(n, n, Radiance).r();
    // 0.8/π, and a highlight of α = 1/4: 0.04/(4 π α²).
    let diffuse = 0.8 / PI;
    let highlight = 0.04 / (4.0 * PI * 0.0625);
    assert_near(value(plain()), diffuse + highlight, "plain");
    let metal = Disney {
        metallic: constant(1.0),
        ..plain()
    };
    assert_near(value(metal), 0.8 / (4.0 * PI * 0.0625), "metal");
    let coated = Disney {
        clearcoat: constant(1.0),
        clearcoat_gloss: constant(0.0),
        ..plain()
    };
    // α = 0.1, and a masking of 1/2 either way.
    let facets = 0.99 / (PI * 100f32.ln() * 0.01);
    let coat = 0.25 * facets * 0.04 * 0.25;
    assert_near(value(coated), diffuse + highlight + coat, "coated");
    let leaf = Disney {
        interior: thin(0.5, 0.5),
        ..plain()
    };
    // Both shapes are 1/π and 1.25/(2π) head on; three quarters are reflected.
    let reflected = 0.75 * (0.5 * diffuse + 0.5 * diffuse * 1.25 * 0.5);
    assert_near(value(leaf.clone()), reflected + highlight, "leaf");
    let behind = Sheet::new(&leaf).bsdf().f(n, -n, Radiance).r();
    assert_near(behind, 0.25 * diffuse, "behind the leaf");
}

#[test]
fn sheen_is_that_of_the_formula() {
    // Light and viewer at 60° on opposite sides: the half vector is the normal.
    let (sin, cos) = (PI / 3.0).sin_cos();
    let (wo, wi) = (Vec3::new(sin, 0.0, cos), Vec3::new(-sin, 0.0, cos));
    let value = |sheen: f32| {
        let sheet = Sheet::new(&Disney {
            sheen: constant(sheen),
            sheen_tint: constant(0.0),
            ..plain()
        });
        sheet.bsdf().f(wo, wi, Radiance).r()
    };
    assert!((value(1.0) - value(0.0) - 0.5f32.powi(5)).abs() < 1e-6);
}

#[test]
fn all_sheets_render_from_a_scene_file() {
    let sliders = "\"rgb color\" [0.8 0.4 0.1] \"float metallic\" 0.3 \"float sheen\" 1 \
                   \"float clearcoat\" 1 \"float spectrans\" 0.5 \"float anisotropic\" 0.7";
    for interior in [
        "",
        "\"bool thin\" \"true\" \"float flatness\" 0.5 \"float difftrans\" 1.5",
    ] {
        let scene = lit(&format!(
            "Material \"disney\" {sliders} {interior}\nReverseOrientation Shape \"disk\""
        ));
        let mean = Probe::new(&scene).means(5000)[0].value;
        assert!((0.2..1.5).contains(&mean), "{interior}: {mean}");
    }
}
