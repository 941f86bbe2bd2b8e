//! Lobes and directions that the tests go through.

use tyndall::math::Vec3;
use tyndall::math::{Frame, Normal3};
use tyndall::scatter::diffuse::{Diffuse, DiffuseTransmission};
use tyndall::scatter::fresnel::Fresnel;
use tyndall::scatter::fresnel_blend::FresnelBlend;
use tyndall::scatter::microfacet::TrowbridgeReitz;
use tyndall::scatter::rough_dielectric::RoughDielectric;
use tyndall::scatter::rough_reflection::RoughReflection;
use tyndall::scatter::{Bsdf, Bxdf};
use tyndall::spectrum::Rgb;
use tyndall_test_support::Uniform;

/// Whatever it meets, it reflects all of it.
pub(crate) const LOSSLESS: Fresnel = Fresnel::Conductor {
    eta: Rgb::BLACK,
    k: Rgb::ONE,
};

/// α along both axes, from the narrowest to slopes beyond 45°, and unequal ones.
pub(crate) const WIDTHS: [[f32; 2]; 10] = [
    [0.0, 0.0],
    [1e-8, 1e-8],
    [0.01, 0.01],
    [0.1, 0.1],
    [0.5, 0.5],
    [1.0, 1.0],
    [1.62, 1.62],
    [0.05, 0.6],
    [1.62, 0.2],
    [0.001, 1.0],
];

pub(crate) fn widths(alpha: [f32; 2]) -> TrowbridgeReitz {
    TrowbridgeReitz::new(alpha[0], alpha[1])
}

/// A unit vector by height and azimuth in degrees.
pub(crate) fn at(z: f32, azimuth: f32) -> Vec3 {
    let r = ((1.0 - z) * (1.0 + z)).sqrt();
    let (sin, cos) = azimuth.to_radians().sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// Straight, oblique, grazing, and from below.
pub(crate) fn views() -> Vec<Vec3> {
    vec![
        Vec3::new(0.0, 0.0, 1.0),
        at(0.8, 20.0),
        at(0.3, -110.0),
        at(0.02, 65.0),
        at(-0.9, 10.0),
        at(-0.25, 200.0),
    ]
}

pub(crate) fn metal(alpha: [f32; 2], fresnel: Fresnel) -> Bxdf<'static> {
    Bxdf::RoughReflection(RoughReflection {
        r: Rgb::ONE,
        distribution: widths(alpha),
        fresnel,
    })
}

pub(crate) fn glass(alpha: [f32; 2], eta: f32) -> Bxdf<'static> {
    RoughDielectric::lobe(Rgb::ONE, Rgb::ONE, widths(alpha), eta)
}

fn copper() -> Fresnel {
    Fresnel::Conductor {
        eta: Rgb::new(0.2, 0.92, 1.1),
        k: Rgb::new(3.9, 2.45, 2.14),
    }
}

fn reversed() -> Fresnel {
    Fresnel::Dielectric {
        eta_outside: 1.5,
        eta_inside: 1.0,
    }
}

/// Lobes with densities, none so narrow that directions in single precision blur it.
pub(crate) fn smooth_lobes() -> Vec<(String, Bxdf<'static>)> {
    let mut lobes = vec![
        (
            "Lambert".into(),
            Bxdf::Diffuse(Diffuse::new(Rgb::splat(0.8), 0.0)),
        ),
        (
            "Oren–Nayar".into(),
            Bxdf::Diffuse(Diffuse::new(Rgb::splat(0.8), 30.0)),
        ),
        (
            "diffuse transmission".into(),
            Bxdf::DiffuseTransmission(DiffuseTransmission {
                kt: Rgb::new(0.2, 0.7, 1.0),
            }),
        ),
    ];
    for alpha in WIDTHS
        .into_iter()
        .filter(|alpha| alpha[0].min(alpha[1]) >= 0.04)
    {
        lobes.push((format!("lossless metal {alpha:?}"), metal(alpha, LOSSLESS)));
        lobes.push((format!("copper {alpha:?}"), metal(alpha, copper())));
        lobes.push((
            format!("plastic's coat {alpha:?}"),
            metal(alpha, reversed()),
        ));
        for eta in [1.5, 1.0 / 1.5, 1.2, 2.4] {
            lobes.push((format!("glass {alpha:?}, index {eta}"), glass(alpha, eta)));
        }
        let one_way = |kr: f32, kt: f32| {
            RoughDielectric::lobe(Rgb::splat(kr), Rgb::splat(kt), widths(alpha), 1.33)
        };
        lobes.push((format!("reflecting glass {alpha:?}"), one_way(0.7, 0.0)));
        lobes.push((format!("refracting glass {alpha:?}"), one_way(0.0, 0.7)));
        lobes.push((
            format!("substrate {alpha:?}"),
            Bxdf::FresnelBlend(FresnelBlend {
                rd: Rgb::new(0.5, 0.3, 0.1),
                rs: Rgb::splat(0.2),
                distribution: widths(alpha),
            }),
        ));
    }
    lobes
}

/// Lobes too narrow for a grid over directions, and those at the limits of their parameters.
pub(crate) fn narrow_lobes() -> Vec<(String, Bxdf<'static>)> {
    let mut lobes = Vec::new();
    for alpha in WIDTHS
        .into_iter()
        .filter(|alpha| alpha[0].min(alpha[1]) < 0.04)
    {
        lobes.push((format!("lossless metal {alpha:?}"), metal(alpha, LOSSLESS)));
        lobes.push((
            format!("plastic's coat {alpha:?}"),
            metal(alpha, reversed()),
        ));
        for eta in [1.5, 1.0 / 1.5, 1.2] {
            lobes.push((format!("glass {alpha:?}, index {eta}"), glass(alpha, eta)));
        }
        lobes.push((
            format!("substrate {alpha:?}"),
            Bxdf::FresnelBlend(FresnelBlend {
                rd: Rgb::splat(0.5),
                rs: Rgb::splat(0.2),
                distribution: widths(alpha),
            }),
        ));
    }
    for eta in [1.05, 1.001, 0.999, 1.0003] {
        lobes.push((format!("glass, index {eta}"), glass([0.5, 0.5], eta)));
    }
    lobes
}

/// A surface of these lobes whose shading frame is the geometric one.
pub(crate) fn surface<'a>(lobes: impl IntoIterator<Item = Bxdf<'a>>) -> Bsdf<'a> {
    let up = [0.0, 0.0, 1.0];
    let frame = Frame::from_normal_tangent(Normal3::from(up), Vec3::new(1.0, 0.0, 0.0));
    let mut bsdf = Bsdf::new(frame, Normal3::from(up));
    lobes.into_iter().for_each(|lobe| bsdf.add(lobe));
    bsdf
}

/// A direction, uniform on the sphere.
pub(crate) fn any_direction(random: &mut Uniform) -> Vec3 {
    tyndall::sampling::warp::uniform_sphere(random.unit2())
}

/// The ends of the unit interval, and places near them.
pub(crate) fn ends() -> [f32; 5] {
    [
        0.0,
        2f32.powi(-24),
        0.5,
        1.0 - 2f32.powi(-12),
        1.0 - 2f32.powi(-24),
    ]
}
