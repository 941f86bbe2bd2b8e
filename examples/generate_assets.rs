//! Writes the generated data of `assets/pbrt-v3-scenes-subset/`: run from the repository's root.
//!
//! - `cloud/density.pbrt`: a cumulus, spheres of vapour eroded by fractal noise.
//! - `cloud/sky.exr`: a clear sky with a low sun, in latitude and longitude.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec3, IVec3};
use tyndall::image::Image;
use tyndall::image::codec::{ImageFile, Precision, encode};
use tyndall::sampling::rng::mix_bits;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = Path::new("assets/pbrt-v3-scenes-subset/cloud");
    std::fs::write(folder.join("density.pbrt"), cloud()?)?;
    std::fs::write(folder.join("sky.exr"), sky()?)?;
    Ok(())
}

/// A value in [−1, 1] at each lattice point.
fn lattice(p: IVec3) -> f64 {
    let key = (p.x as u32 as u64) << 42 ^ (p.y as u32 as u64) << 21 ^ p.z as u32 as u64;
    (mix_bits(key) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Value noise: the lattice, interpolated smoothly.
fn noise(p: DVec3) -> f64 {
    let corner = p.floor();
    let f = p - corner;
    let w = f * f * (3.0 - 2.0 * f);
    let corner = corner.as_ivec3();
    let mut sum = 0.0;
    for k in 0..8 {
        let bit = |axis: usize| (k >> axis & 1) as f64;
        let weight = |axis: usize| {
            if bit(axis) == 1.0 {
                w[axis]
            } else {
                1.0 - w[axis]
            }
        };
        let offset = IVec3::new(bit(0) as i32, bit(1) as i32, bit(2) as i32);
        sum += weight(0) * weight(1) * weight(2) * lattice(corner + offset);
    }
    sum
}

fn fractal(p: DVec3) -> f64 {
    (0..5)
        .map(|octave| noise(p * 2.1f64.powi(octave)) * 0.55f64.powi(octave))
        .sum()
}

fn cloud() -> Result<String, std::fmt::Error> {
    const N: [usize; 3] = [72, 48, 40];
    // Centres and radii in a box of 3 x 2 x 1.67; z is up.
    const PUFFS: [(f64, f64, f64, f64); 9] = [
        (0.85, 0.95, 0.50, 0.42),
        (1.30, 1.05, 0.60, 0.52),
        (1.75, 0.95, 0.58, 0.50),
        (2.20, 1.05, 0.48, 0.40),
        (1.45, 0.95, 0.98, 0.40),
        (1.85, 1.08, 0.92, 0.34),
        (1.10, 1.10, 0.85, 0.32),
        (1.55, 1.00, 1.25, 0.26),
        (0.55, 1.05, 0.42, 0.26),
    ];
    let mut text = String::from(
        "# Made by examples/generate_assets.rs: a cumulus of spheres eroded by fractal noise.\n",
    );
    writeln!(
        text,
        "MakeNamedMedium \"cloud\" \"string type\" \"heterogeneous\""
    )?;
    writeln!(
        text,
        "  \"integer nx\" {} \"integer ny\" {} \"integer nz\" {}",
        N[0], N[1], N[2]
    )?;
    writeln!(text, "  \"point p0\" [0 0 0] \"point p1\" [3 2 1.667]")?;
    writeln!(text, "  \"float density\" [")?;
    for z in 0..N[2] {
        for y in 0..N[1] {
            for x in 0..N[0] {
                let at = |i: usize, n: usize, length: f64| (i as f64 + 0.5) / n as f64 * length;
                let p = DVec3::new(at(x, N[0], 3.0), at(y, N[1], 2.0), at(z, N[2], 1.667));
                // A smooth union of the puffs, flat at the base, then eroded.
                let body: f64 = PUFFS
                    .iter()
                    .map(|&(x, y, z, r)| (1.0 - p.distance(DVec3::new(x, y, z)) / r).max(-1.0))
                    .map(|inside| (4.0 * inside).exp())
                    .sum::<f64>()
                    .ln()
                    / 4.0;
                let base = ((p.z - 0.22) / 0.10).clamp(0.0, 1.0);
                let density = ((body + 0.5 * fractal(p * 3.4) - 0.12) * 5.0).clamp(0.0, 1.0) * base;
                let hundredths = (density * 100.0).round();
                write!(text, "{} ", hundredths / 100.0)?;
            }
            text.push('\n');
        }
    }
    text.push_str("  ]\n");
    Ok(text)
}

fn sky() -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    const WIDTH: usize = 256;
    const HEIGHT: usize = 128;
    let sun = DVec3::new(-0.80, -0.30, 0.45).normalize();
    let mut data = Vec::with_capacity(WIDTH * HEIGHT * 3);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let theta = (y as f64 + 0.5) / HEIGHT as f64 * std::f64::consts::PI;
            let phi = (x as f64 + 0.5) / WIDTH as f64 * std::f64::consts::TAU;
            let d = DVec3::new(
                theta.sin() * phi.cos(),
                theta.sin() * phi.sin(),
                theta.cos(),
            );
            let zenith = DVec3::new(0.10, 0.22, 0.55);
            let horizon = DVec3::new(0.55, 0.62, 0.70);
            let ground = DVec3::new(0.20, 0.22, 0.19);
            let mut rgb = if d.z > 0.0 {
                horizon.lerp(zenith, d.z.sqrt())
            } else {
                ground
            };
            let cos_sun = d.dot(sun);
            rgb += DVec3::new(1.0, 0.7, 0.4) * 0.6 * cos_sun.max(0.0).powi(24);
            if cos_sun > 0.9986 {
                rgb += DVec3::new(1.0, 0.82, 0.6) * 420.0;
            }
            data.extend(rgb.to_array().map(|c| c as f32));
        }
    }
    let file = ImageFile::new(Image::new(WIDTH, HEIGHT, 3, data)?);
    Ok(encode(&file, "exr", Precision::Half)?)
}
