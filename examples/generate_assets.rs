//! Writes the generated data of `assets/pbrt-v3-scenes-subset/`: run from the repository's root.
//!
//! - `cloud/density.pbrt`: a cumulus, spheres of vapour eroded by fractal noise.
//! - `cloud/sky.exr`: a clear sky with a low sun, in latitude and longitude.
//! - `spheres/sky.exr`: the same sky without its sun.
//! - `smoke/density.pbrt`: a plume bent by the wind.
//! - `amber/knot.ply`: a torus knot.
//! - `hair/tuft.pbrt`: wavy strands that hang from a bar.
//! - `textures/sign.png`: an arrow that tells up from down and left from right.
//! - `textures/cube.ptx`: a cube for Ptex, each side of another resolution and colour.
//! - `curves/grass.pbrt`: a tuft of blades.
//! - `leaves/leaf.png`: the outline of a leaf, 0 outside.
//! - `lights/slide.png`: a picture that tells its sides apart.
//! - `lights/lamp.exr`: the directions in which a lamp with a shade shines.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec3, IVec3};
use tyndall::image::Image;
use tyndall::image::codec::{ImageFile, Precision, encode};
use tyndall::sampling::rng::mix_bits;
use tyndall_test_support::ptex::{self, DataType, PtexWriter};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = Path::new("assets/pbrt-v3-scenes-subset");
    std::fs::write(folder.join("cloud/density.pbrt"), cloud()?)?;
    std::fs::write(folder.join("cloud/sky.exr"), sky(420.0)?)?;
    std::fs::write(folder.join("spheres/sky.exr"), sky(0.0)?)?;
    std::fs::write(folder.join("smoke/density.pbrt"), smoke()?)?;
    std::fs::write(folder.join("amber/knot.ply"), knot()?)?;
    std::fs::write(folder.join("hair/tuft.pbrt"), tuft()?)?;
    std::fs::write(folder.join("textures/sign.png"), sign()?)?;
    std::fs::write(folder.join("textures/cube.ptx"), painted_cube())?;
    std::fs::write(folder.join("curves/grass.pbrt"), grass()?)?;
    std::fs::write(folder.join("leaves/leaf.png"), leaf()?)?;
    std::fs::write(folder.join("lights/slide.png"), slide()?)?;
    std::fs::write(folder.join("lights/lamp.exr"), lamp()?)?;
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

/// A grid of densities in a box, as the text of a `MakeNamedMedium` whose parameter list stays open.
fn grid(
    name: &str,
    n: [usize; 3],
    size: DVec3,
    density: impl Fn(DVec3) -> f64,
) -> Result<String, std::fmt::Error> {
    let mut text = String::from("# Made by examples/generate_assets.rs.\n");
    writeln!(
        text,
        "MakeNamedMedium \"{name}\" \"string type\" \"heterogeneous\""
    )?;
    writeln!(
        text,
        "  \"integer nx\" {} \"integer ny\" {} \"integer nz\" {}",
        n[0], n[1], n[2]
    )?;
    writeln!(
        text,
        "  \"point p0\" [0 0 0] \"point p1\" [{} {} {}]",
        size.x, size.y, size.z
    )?;
    writeln!(text, "  \"float density\" [")?;
    for z in 0..n[2] {
        for y in 0..n[1] {
            for x in 0..n[0] {
                let cell = DVec3::new(x as f64, y as f64, z as f64) + 0.5;
                let p = cell / DVec3::new(n[0] as f64, n[1] as f64, n[2] as f64) * size;
                let hundredths = (density(p).clamp(0.0, 1.0) * 100.0).round() as u32;
                match hundredths {
                    0 => text.push_str("0 "),
                    100 => text.push_str("1 "),
                    h if h % 10 == 0 => write!(text, ".{} ", h / 10)?,
                    h => write!(text, ".{h:02} ")?,
                }
            }
            text.push('\n');
        }
    }
    text.push_str("  ]\n");
    Ok(text)
}

fn cloud() -> Result<String, std::fmt::Error> {
    // Centres and radii; z is up.
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
    grid("cloud", [112, 100, 48], DVec3::new(3.0, 2.0, 1.667), |p| {
        // A smooth union of the puffs, flat at the base, then eroded.
        let body: f64 = PUFFS
            .iter()
            .map(|&(x, y, z, r)| (1.0 - p.distance(DVec3::new(x, y, z)) / r).max(-1.0))
            .map(|inside| (4.0 * inside).exp())
            .sum::<f64>()
            .ln()
            / 4.0;
        let base = ((p.z - 0.22) / 0.10).clamp(0.0, 1.0);
        ((body + 0.5 * fractal(p * 3.4) - 0.12) * 5.0) * base
    })
}

/// A plume that the wind bends and tears.
fn smoke() -> Result<String, std::fmt::Error> {
    grid("smoke", [100, 40, 100], DVec3::new(2.0, 0.8, 2.0), |p| {
        let rise = p.z / 2.0;
        let sway = 0.10 * rise * (5.0 * rise).sin();
        let center = DVec3::new(0.35 + 0.9 * rise.powf(1.7) + sway, 0.4, p.z);
        let radius = 0.06 + 0.26 * rise;
        let swirl = DVec3::new(
            fractal(p * 2.6),
            fractal(p * 2.6 + 17.0),
            fractal(p * 2.6 + 41.0),
        );
        let q = p + swirl * (0.04 + 0.16 * rise);
        let inside = 1.0 - (q - center).truncate().length() / radius;
        let torn = inside + 0.5 * rise * fractal(q * 6.0);
        let fade = ((p.z - 0.03) / 0.05).clamp(0.0, 1.0) * ((1.95 - p.z) / 0.5).clamp(0.0, 1.0);
        (1.6 * torn).max(0.0) * fade * (1.0 - 0.55 * rise)
    })
}

/// A torus knot: a closed tube, in ASCII.
fn knot() -> Result<String, std::fmt::Error> {
    const ALONG: usize = 220;
    const AROUND: usize = 14;
    let curve = |t: f64| {
        let r = 0.75 + 0.30 * (3.0 * t).cos();
        DVec3::new(
            r * (2.0 * t).cos(),
            r * (2.0 * t).sin(),
            0.38 * (3.0 * t).sin(),
        )
    };
    let mut text = String::from("ply\nformat ascii 1.0\ncomment examples/generate_assets.rs\n");
    writeln!(text, "element vertex {}", ALONG * AROUND)?;
    text.push_str("property float x\nproperty float y\nproperty float z\n");
    writeln!(text, "element face {}", ALONG * AROUND)?;
    text.push_str("property list uchar int vertex_indices\nend_header\n");
    for i in 0..ALONG {
        let t = i as f64 / ALONG as f64 * std::f64::consts::TAU;
        let tangent = (curve(t + 1e-4) - curve(t - 1e-4)).normalize();
        let u = tangent.cross(DVec3::Z).normalize();
        let v = u.cross(tangent);
        for k in 0..AROUND {
            let a = k as f64 / AROUND as f64 * std::f64::consts::TAU;
            let p = curve(t) + (u * a.cos() + v * a.sin()) * 0.17;
            writeln!(text, "{:.5} {:.5} {:.5}", p.x, p.y, p.z)?;
        }
    }
    for i in 0..ALONG {
        for k in 0..AROUND {
            let at = |i: usize, k: usize| i % ALONG * AROUND + k % AROUND;
            // Seen from outside, the corners run counterclockwise: normals point out of the tube.
            writeln!(
                text,
                "4 {} {} {} {}",
                at(i, k),
                at(i + 1, k),
                at(i + 1, k + 1),
                at(i, k + 1)
            )?;
        }
    }
    Ok(text)
}

/// Strands that hang from a bar along x: Bézier curves of two pieces each, thinner toward their ends.
fn tuft() -> Result<String, std::fmt::Error> {
    const STRANDS: u32 = 420;
    let mut text = String::from("# Made by examples/generate_assets.rs.\n");
    for strand in 0..STRANDS {
        let random = |k: u32| lattice(IVec3::new(strand as i32, k as i32, 77));
        let (x, y) = (0.40 * random(0), 0.10 * random(1));
        // Neighbours wave together, each strand a little by itself.
        let phase = 4.0 * x + 0.7 * random(2);
        let (amplitude, length) = (0.06 + 0.02 * random(3), 1.5 + 0.18 * random(4));
        let spread = 1.0 + 0.25 * random(5);
        write!(
            text,
            "Shape \"curve\" \"float width0\" .009 \"float width1\" .004 \"point P\" ["
        )?;
        for k in 0..7 {
            let t = f64::from(k) / 6.0;
            let wave = amplitude * t * (5.0 * t + phase).sin();
            let p = DVec3::new(
                x * (1.0 + 0.5 * spread * t * t) + wave,
                y * (1.0 + 1.5 * spread * t) + amplitude * t * (6.0 * t + phase).cos(),
                -length * t,
            );
            write!(text, " {:.3} {:.3} {:.3}", p.x, p.y, p.z)?;
        }
        writeln!(text, " ]")?;
    }
    Ok(text)
}

/// A clear sky in latitude and longitude; `sun` is the radiance of its disk.
fn sky(sun_radiance: f64) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
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
                rgb += DVec3::new(1.0, 0.82, 0.6) * sun_radiance;
            }
            data.extend(rgb.to_array().map(|c| c as f32));
        }
    }
    let file = ImageFile::new(Image::new(WIDTH, HEIGHT, 3, data)?);
    Ok(encode(&file, "exr", Precision::Half)?)
}

/// Rings and spokes on the sides of a cube, which go on over its edges where they can.
fn painted_cube() -> Vec<u8> {
    let mut faces = ptex::faces(&ptex::cube(), false);
    for (k, face) in faces.iter_mut().enumerate() {
        face.log2 = [[5, 5], [4, 4], [3, 3], [5, 4], [2, 5], [6, 6]][k];
        let [columns, rows] = face.log2.map(|l| 1u32 << l);
        let colour = DVec3::from(
            [
                [0.9, 0.3, 0.2],
                [0.9, 0.8, 0.2],
                [0.3, 0.8, 0.3],
                [0.2, 0.7, 0.8],
                [0.3, 0.3, 0.9],
                [0.8, 0.3, 0.8],
            ][k],
        );
        face.samples.clear();
        for y in 0..rows {
            for x in 0..columns {
                let u = (f64::from(x) + 0.5) / f64::from(columns) - 0.5;
                let v = (f64::from(y) + 0.5) / f64::from(rows) - 0.5;
                let rings = (u.abs().max(v.abs()) * 8.0) as u32 % 2;
                let shade = if rings == 0 {
                    colour
                } else {
                    DVec3::splat(0.85)
                };
                face.samples.extend(shade.as_vec3().to_array());
            }
        }
    }
    let cube = PtexWriter::new(false, DataType::U8, 3, faces);
    let (differences, tile_log2) = (true, Some(5));
    PtexWriter {
        differences,
        tile_log2,
        ..cube
    }
    .encode()
}

/// An arrow up with a flag on its right, orange on a ground that grows lighter to the right.
fn sign() -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    const SIDE: usize = 64;
    let mut data = Vec::with_capacity(3 * SIDE * SIDE);
    for y in 0..SIDE {
        for x in 0..SIDE {
            // From the middle of the foot, y up.
            let (right, up) = (x as f32 - 31.5, 63.5 - y as f32);
            let shaft = right.abs() < 5.0 && (8.0..44.0).contains(&up);
            let head = (44.0..58.0).contains(&up) && right.abs() < (58.0 - up) * 1.2;
            let flag = (5.0..20.0).contains(&right) && (14.0..24.0).contains(&up);
            let ground = 0.1 + 0.5 * x as f32 / SIDE as f32;
            data.extend(if shaft || head || flag {
                [0.85, 0.35, 0.05]
            } else {
                [0.4 * ground, 0.8 * ground, ground]
            });
        }
    }
    let image = ImageFile::new(Image::new(SIDE, SIDE, 3, data)?);
    Ok(encode(&image, "png", Precision::Float)?)
}

/// Blades that grow upward and bend, one `Shape` each.
fn grass() -> Result<String, std::fmt::Error> {
    const N_BLADES: i32 = 160;
    let mut out = String::new();
    for blade in 0..N_BLADES {
        let random = |k: i32| lattice(IVec3::new(blade, k, 7));
        let (root, lean) = (
            DVec3::new(0.5 * random(0), 0.5 * random(1), 0.0),
            DVec3::new(random(2), random(3), 0.0),
        );
        let height = 0.9 + 0.35 * random(4);
        write!(
            out,
            "Shape \"curve\" \"float width0\" 0.045 \"float width1\" 0.006"
        )?;
        write!(out, " \"string type\" \"cylinder\" \"point3 P\" [")?;
        for k in 0..4 {
            let t = f64::from(k) / 3.0;
            let p = root + lean * (0.6 * t * t) + DVec3::Z * (height * t * (1.0 - 0.25 * t));
            write!(out, " {:.4} {:.4} {:.4}", p.x, p.y, p.z)?;
        }
        writeln!(out, " ]")?;
    }
    Ok(out)
}

/// A leaf with a stalk, its tip upward.
fn leaf() -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    const SIZE: usize = 128;
    let mut data = Vec::with_capacity(SIZE * SIZE);
    for y in 0..SIZE {
        for x in 0..SIZE {
            let [x, up] = [x, SIZE - 1 - y].map(|k| (k as f64 + 0.5) / SIZE as f64);
            let aside = (x - 0.5).abs();
            // From the stalk at a fifth of the height to the tip.
            let along = ((up - 0.2) / 0.78).clamp(0.0, 1.0);
            let half_width = 0.42 * (std::f64::consts::PI * along.powf(0.7)).sin();
            let serrated = half_width * (1.0 - 0.12 * (40.0 * along).sin().abs());
            let is_leaf = aside < serrated || (up < 0.25 && aside < 0.03);
            data.push(f32::from(u8::from(is_leaf)));
        }
    }
    let file = ImageFile::new(Image::new(SIZE, SIZE, 1, data)?);
    Ok(encode(&file, "png", Precision::Half)?)
}

/// A landscape with a sun at the top left.
fn slide() -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    const WIDTH: usize = 192;
    const HEIGHT: usize = 128;
    let mut data = Vec::with_capacity(WIDTH * HEIGHT * 3);
    for row in 0..HEIGHT {
        for column in 0..WIDTH {
            let x = (column as f64 + 0.5) / HEIGHT as f64;
            let y = 1.0 - (row as f64 + 0.5) / HEIGHT as f64;
            let far = 0.42 + 0.16 * (5.0 * x).sin() * (2.3 * x + 1.0).cos();
            let near = 0.24 + 0.07 * (3.1 * x + 2.0).sin();
            let rgb = if y < near {
                DVec3::new(0.05, 0.16, 0.06)
            } else if y < far {
                DVec3::new(0.10, 0.22, 0.30)
            } else if DVec3::new(x - 0.32, y - 0.78, 0.0).length() < 0.10 {
                DVec3::new(1.0, 0.9, 0.5)
            } else {
                DVec3::new(0.75, 0.45, 0.25).lerp(DVec3::new(0.20, 0.30, 0.60), y)
            };
            data.extend(rgb.to_array().map(|c| c as f32));
        }
    }
    let file = ImageFile::new(Image::new(WIDTH, HEIGHT, 3, data)?);
    Ok(encode(&file, "png", Precision::Float)?)
}

/// Bright upward, less so downward, dark where the shade is; ribs all around.
fn lamp() -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    const WIDTH: usize = 64;
    const HEIGHT: usize = 32;
    let mut data = Vec::with_capacity(WIDTH * HEIGHT * 3);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let theta = (y as f64 + 0.5) / HEIGHT as f64 * std::f64::consts::PI;
            let phi = (x as f64 + 0.5) / WIDTH as f64 * std::f64::consts::TAU;
            let up = theta.cos().max(0.0).powi(3);
            let down = 0.6 * (-theta.cos()).max(0.0).powi(6);
            let ribs = 0.75 + 0.25 * (8.0 * phi).cos() * theta.sin();
            let shade = DVec3::new(0.09, 0.05, 0.02);
            let rgb = DVec3::splat(up + down) * ribs + shade;
            data.extend(rgb.to_array().map(|c| c as f32));
        }
    }
    let file = ImageFile::new(Image::new(WIDTH, HEIGHT, 3, data)?);
    Ok(encode(&file, "exr", Precision::Half)?)
}
