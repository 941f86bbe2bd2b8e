//! Ptex texture. Scene-file manual (`Texture … "ptex"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `string filename` | required | a Ptex file with one or three channels |
//! | `float gamma` | 2.2 | exponent applied to filtered values in [0, 1] |
//!
//! The face is that of `faceIndices`, or 0; there is no mapping: surface parameters run from 0 to 1 over each face.
//! The filter is the one pbrt-v3 asks the Ptex library for: B-splines along u and v on quads, a Gaussian over an
//! ellipse on triangles, both as wide as the footprint and no narrower than a texel, over the edges and corners of
//! faces into those beside them. Values agree with the library's to single precision.

mod quads;
mod triangles;

use crate::ids::PtexId;
use crate::image::ptex::{Level, MeshType, Ptex};
use crate::spectrum::Rgb;
use crate::texture::{TextureContext, Value};

/// Most pieces that a filter is cut into by the edges of faces: only files whose neighbourhoods go in circles need more.
const PIECES_MAX: u32 = 256;
/// Longest footprint, in widths of a face: much longer than any filter is wide.
const FOOTPRINT_MAX: f32 = 1e4;

/// A Ptex file over a surface.
#[derive(Clone, Copy, Debug)]
pub struct PtexTexture {
    /// The file: one or three channels.
    pub file: PtexId,
    /// Exponent.
    pub gamma: f32,
}

impl PtexTexture {
    /// The filtered value at a surface point: of one channel, or the mean of three for numbers. 0 where there is no such
    /// face.
    pub(super) fn evaluate<V: Value>(&self, file: &Ptex, ctx: &TextureContext) -> V {
        let mut value = filtered(file, ctx);
        if self.gamma != 1.0 {
            for x in &mut value {
                if (0.0..=1.0).contains(x) {
                    *x = x.powf(self.gamma);
                }
            }
        }
        if file.channels() == 1 {
            V::splat(value[0])
        } else {
            V::from_mean(Rgb::from_array(value))
        }
    }
}

/// The first three channels, filtered under a footprint. Those that a file does not have are 0.
pub fn filtered(file: &Ptex, ctx: &TextureContext) -> [f32; 3] {
    let Some(face) = file.face(ctx.face) else {
        return [0.0; 3];
    };
    let mut sum = Sum {
        file,
        value: [0.0; 3],
        weight: 0.0,
        pieces: 0,
    };
    if !face.is_neighbourhood_constant {
        let footprint =
            [ctx.duv_dx, ctx.duv_dy].map(|d| d.map(|x| x.clamp(-FOOTPRINT_MAX, FOOTPRINT_MAX)));
        match file.mesh() {
            MeshType::Quad => quads::add(&mut sum, ctx.face, face, ctx.uv, footprint),
            MeshType::Triangle => triangles::add(&mut sum, ctx.face, face, ctx.uv, footprint),
        }
        let scale = 1.0 / (sum.weight * file.one());
        let value = sum.value.map(|x| x * scale);
        if sum.weight > 0.0 && value.iter().all(|x| x.is_finite()) {
            return value;
        }
        sum.value = [0.0; 3];
    }
    add_texel(&mut sum.value, file.mean(ctx.face), 1.0);
    sum.value.map(|x| x / file.one())
}

/// What a filter has gathered.
struct Sum<'a> {
    file: &'a Ptex,
    /// Weighted samples as stored.
    value: [f32; 3],
    /// What to divide by.
    weight: f32,
    pieces: u32,
}

impl Sum<'_> {
    /// Counts a piece of the filter; false if there are too many.
    fn is_one_more(&mut self) -> bool {
        self.pieces += 1;
        self.pieces <= PIECES_MAX
    }
}

/// Adds a texel of up to three channels.
#[inline]
fn add_texel(value: &mut [f32; 3], texel: Level, weight: f32) {
    use crate::image::ptex::Sample;
    fn add<T: Sample>(value: &mut [f32; 3], texel: &[T], weight: f32) {
        for (sum, sample) in value.iter_mut().zip(texel) {
            *sum += sample.to_f32() * weight;
        }
    }
    match texel {
        Level::U8(texel) => add(value, texel, weight),
        Level::U16(texel) => add(value, texel, weight),
        Level::Half(texel) => add(value, texel, weight),
        Level::Float(texel) => add(value, texel, weight),
    }
}
