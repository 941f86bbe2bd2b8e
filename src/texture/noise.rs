//! Gradient noise and its sums over octaves (Perlin, *Improving Noise*, SIGGRAPH 2002; pbrt 3e §10.6).
//!
//! Any finite input gives a finite value.

use glam::DVec3;

use crate::texture::mapping::TexturePoint3;
use crate::texture::permutation::PERMUTATION;

/// Factor of the frequency from one octave to the next.
const LACUNARITY: f64 = 1.99;

/// Mean of the absolute value of noise, as octaves too fine for the footprint are taken to be.
const MEAN_ABSOLUTE_NOISE: f32 = 0.2;

/// Noise at a point: 0 at whole coordinates, mostly within ±1, period 256 along each axis.
pub fn noise(p: DVec3) -> f32 {
    let cell = p.floor();
    // Casts saturate; beyond 2⁶³ all cells are the same, and fractions are 0 long before.
    let [x, y, z] = cell.to_array().map(|c| (c as i64 & 255) as usize);
    let [dx, dy, dz] = (p - cell).as_vec3().to_array();
    // The four columns of lattice points along z around the point.
    let column = |ix: usize, iy: usize| {
        let xy = usize::from(PERMUTATION[(x + ix) & 255]) + y + iy;
        usize::from(PERMUTATION[xy & 255]) + z
    };
    let gradient = |column: usize, ix: usize, iy: usize, iz: usize| {
        let hash = PERMUTATION[(column + iz) & 255];
        along_gradient(hash, dx - ix as f32, dy - iy as f32, dz - iz as f32)
    };
    let (wx, wy, wz) = (fade(dx), fade(dy), fade(dz));
    let (c00, c10, c01, c11) = (column(0, 0), column(1, 0), column(0, 1), column(1, 1));
    let layer = |iz: usize| {
        let y0 = lerp(wx, gradient(c00, 0, 0, iz), gradient(c10, 1, 0, iz));
        let y1 = lerp(wx, gradient(c01, 0, 1, iz), gradient(c11, 1, 1, iz));
        lerp(wy, y0, y1)
    };
    lerp(wz, layer(0), layer(1))
}

/// Product of an offset with one of the twelve directions to the edges of a cube. Four of sixteen hashes repeat others;
/// for two of these, 13 and 14, pbrt-v3 picks other directions than Perlin.
#[inline]
fn along_gradient(hash: u8, x: f32, y: f32, z: f32) -> f32 {
    let h = hash & 15;
    let u = if h < 8 || h == 12 || h == 13 { x } else { y };
    let v = if h < 4 || h == 12 || h == 13 { y } else { z };
    (if h & 1 == 0 { u } else { -u }) + (if h & 2 == 0 { v } else { -v })
}

/// 6t⁵ − 15t⁴ + 10t³.
#[inline]
fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

#[inline]
fn lerp(t: f32, a: f32, b: f32) -> f32 {
    (1.0 - t) * a + t * b
}

/// Layers of noise, each finer by 1.99 and weaker by `roughness` than the one before.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Octaves {
    /// Most layers.
    pub count: u32,
    /// Strength of a layer relative to the one before.
    pub roughness: f32,
}

impl Octaves {
    /// How many layers the footprint leaves visible: whole ones, and the share of the next.
    fn visible(self, at: &TexturePoint3) -> (u32, f32) {
        let square = at.dp_dx.length_squared().max(at.dp_dy.length_squared());
        // A point has no footprint: the logarithm is -∞, and all layers are visible.
        let n = (-1.0 - 0.5 * square.log2()).clamp(0.0, f64::from(self.count));
        let x = ((n.fract() - 0.3) / (0.7 - 0.3)).clamp(0.0, 1.0);
        (n as u32, (x * x * (3.0 - 2.0 * x)) as f32)
    }

    /// Sum of the layers that the footprint does not blur.
    pub fn fbm(self, at: &TexturePoint3) -> f32 {
        let (whole, part) = self.visible(at);
        let mut layers = Layers::new(self, at.p);
        let mut sum = 0.0;
        for _ in 0..whole {
            sum += layers.strength * noise(layers.p);
            layers.advance();
        }
        if part > 0.0 {
            sum += layers.strength * part * noise(layers.p);
        }
        finite(sum)
    }

    /// Sum of the absolute values of the layers; those that the footprint blurs count with their mean. As in pbrt-v3,
    /// the layer that is partly visible counts twice.
    pub fn turbulence(self, at: &TexturePoint3) -> f32 {
        let (whole, part) = self.visible(at);
        let mut layers = Layers::new(self, at.p);
        let mut sum = 0.0;
        for _ in 0..whole {
            sum += layers.strength * noise(layers.p).abs();
            layers.advance();
        }
        sum += layers.strength * lerp(part, MEAN_ABSOLUTE_NOISE, noise(layers.p).abs());
        for _ in whole..self.count {
            sum += layers.strength * MEAN_ABSOLUTE_NOISE;
            layers.advance();
        }
        finite(sum)
    }
}

/// Where the current layer looks and how much it counts.
struct Layers {
    p: DVec3,
    strength: f32,
    roughness: f32,
}

impl Layers {
    fn new(octaves: Octaves, p: DVec3) -> Self {
        Self {
            p,
            strength: 1.0,
            roughness: octaves.roughness,
        }
    }

    fn advance(&mut self) {
        self.p *= LACUNARITY;
        self.strength *= self.roughness;
    }
}

/// Absurd roughnesses overflow.
fn finite(sum: f32) -> f32 {
    if sum.is_nan() {
        0.0
    } else {
        sum.clamp(f32::MIN, f32::MAX)
    }
}
