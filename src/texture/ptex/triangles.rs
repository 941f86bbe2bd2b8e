//! The filter on triangles: a Gaussian over an ellipse (Heckbert 1989, "Fundamentals of Texture Mapping and Image
//! Warping"), cut at the edges of faces. Beyond an edge it is expressed by the parameters of the face there.

use crate::image::ptex::{Face, Level, Sample};
use crate::texture::ptex::Sum;

/// Radius at which the Gaussian is cut off, in standard deviations: widths of the filter.
const RADIUS: f32 = 3.5;
/// Longest ratio of the axes of the ellipse.
const ECCENTRICITY_MAX: f32 = 15.0;

/// An ellipse around a point, and the part of it that is meant. Coordinates are (u, v, w), w = 1 − u − v.
#[derive(Clone, Copy, Debug)]
struct Kernel {
    log2: u8,
    centre: [f32; 3],
    low: [f32; 3],
    high: [f32; 3],
    /// A u² + B u v + C v² is below A C − B²/4 inside.
    form: [f32; 3],
}

/// The same in units of texels, over triangles that stand on a side or on a tip.
struct Texels {
    log2: u8,
    centre: [f32; 2],
    low: [i32; 3],
    high: [i32; 3],
    /// The same form, below 1 inside.
    form: [f32; 3],
    /// Area of a texel.
    area: f32,
}

/// Adds the filter around a point of a face.
pub(super) fn add(sum: &mut Sum, number: u32, face: &Face, uv: [f32; 2], footprint: [[f32; 2]; 2]) {
    let [u, v] = uv.map(|x| x.clamp(0.0, 1.0));
    split(
        sum,
        Kernel::new([u, v], footprint, face.log2[0]),
        number,
        face,
    );
}

impl Kernel {
    fn new([u, v]: [f32; 2], [[u1, v1], [u2, v2]]: [[f32; 2]; 2], log2: u8) -> Self {
        let sqrt3 = 3f32.sqrt();
        let a = 0.25 * (v1 * v1 + v2 * v2);
        let b = -0.5 * (u1 * v1 + u2 * v2);
        let c = 0.25 * (u1 * u1 + u2 * u2);
        // On an equilateral triangle.
        let (mut ac, bc, mut cc) = (0.75 * a, 0.5 * sqrt3 * (b - a), 0.25 * a - 0.5 * b + c);
        let spread = ((ac - cc) * (ac - cc) + bc * bc).sqrt();
        // No longer than the ratio allows, no narrower than a texel.
        let e2 = ECCENTRICITY_MAX * ECCENTRICITY_MAX;
        let rounder = 0.5 * ((e2 + 1.0) / (e2 - 1.0) * spread - (ac + cc));
        let texel = 0.5 / (1u32 << log2) as f32;
        let blur = rounder.max(texel * texel);
        ac += blur;
        cc += blur;
        let minor = (2.0 * (ac * cc - 0.25 * bc * bc) / (ac + cc + spread)).max(0.0);
        let minor = minor.sqrt();
        // The resolution at which the short axis is one to two texels long.
        let coarsest = 127 - ((2.0 * minor).to_bits() >> 23) as i32;
        let scale = RADIUS * RADIUS;
        let a = 4.0 / 3.0 * ac;
        let b = 2.0 / sqrt3 * bc + a;
        let c = -0.25 * a + 0.5 * b + cc;
        let form = [a, b, c].map(|x| x * scale);
        let [a, b, c] = form;
        let reach = [c, a, a - b + c].map(|x| x.max(0.0).sqrt().min(1.0));
        let centre = [u, v, 1.0 - u - v];
        Self {
            log2: coarsest.clamp(0, i32::from(log2)) as u8,
            centre,
            low: [0, 1, 2].map(|k| centre[k] - reach[k]),
            high: [0, 1, 2].map(|k| centre[k] + reach[k]),
            form,
        }
    }

    /// Expresses it by the parameters of the face beyond `edge`, whose own edge is `theirs`.
    fn reorient(&mut self, edge: usize, theirs: usize) {
        let across = coordinate(edge);
        let old = *self;
        for k in 0..3 {
            let to = (k + 3 + theirs - edge) % 3;
            let from = if k == across { 0.0 } else { 1.0 };
            self.centre[to] = from - old.centre[k];
            self.low[to] = from - old.high[k];
            self.high[to] = from - old.low[k];
        }
        let [a, b, c] = old.form;
        self.form = match (3 + theirs - edge) % 3 {
            0 => old.form,
            1 => [c, 2.0 * c - b, a + c - b],
            _ => [a + c - b, 2.0 * a - b, a],
        };
    }

    /// Within the face.
    fn clamp(&mut self, log2: u8) {
        self.log2 = self.log2.min(log2);
        for low in &mut self.low {
            *low = low.max(0.0);
        }
        for k in 0..3 {
            let others = self.low[(k + 1) % 3] + self.low[(k + 2) % 3];
            self.high[k] = self.high[k].min(1.0 - others);
        }
    }

    fn texels(&self, is_upright: bool) -> Texels {
        let scale = (1u32 << self.log2) as f32;
        let third = 1.0 / 3.0;
        let [a, b, c] = self.form;
        let inverse = 1.0 / (scale * scale * (a * c - 0.25 * b * b));
        let [a, b, c] = [a, b, c].map(|x| x * inverse);
        let [u, v, _] = self.centre;
        let ([lu, lv, lw], [hu, hv, hw]) = (self.low, self.high);
        let texel = |x: f32| (x * scale - third).ceil() as i32;
        let (centre, low, high, form) = if is_upright {
            ([u, v], self.low, self.high, [a, b, c])
        } else {
            // Mirrored at the diagonal.
            let low = [1.0 - hv, 1.0 - hu, -hw];
            let high = [1.0 - lv, 1.0 - lu, -lw];
            ([1.0 - v, 1.0 - u], low, high, [c, b, a])
        };
        Texels {
            log2: self.log2,
            centre: centre.map(|x| x * scale - third),
            low: low.map(texel),
            high: high.map(texel),
            form,
            area: 1.0 / (scale * scale),
        }
    }
}

/// The coordinate that is 0 on an edge.
fn coordinate(edge: usize) -> usize {
    (edge + 1) % 3
}

/// Cuts a kernel at the edges of a face and adds all parts. Calls itself for what reaches over an edge.
fn split(sum: &mut Sum, mut kernel: Kernel, number: u32, face: &Face) {
    if !sum.is_one_more() {
        return;
    }
    for edge in [2, 0, 1] {
        let k = coordinate(edge);
        if kernel.low[k] < 0.0
            && let Some(there) = face.neighbours[edge]
            && let Some(other) = sum.file.face(there)
        {
            let mut part = kernel;
            kernel.low[k] = 0.0;
            part.high[k] = 0.0;
            part.reorient(edge, usize::from(face.their_edges[edge]));
            split(sum, part, there, other);
        }
    }
    kernel.clamp(face.log2[0]);
    for is_upright in [true, false] {
        let texels = kernel.texels(is_upright);
        if (0..3).any(|k| texels.high[k] <= texels.low[k]) {
            continue;
        }
        let (file, n) = (sum.file, sum.file.channels());
        if face.is_constant || kernel.log2 == 0 {
            match file.mean(number) {
                Level::U8(texel) => texels.add(sum, |_| texel),
                Level::U16(texel) => texels.add(sum, |_| texel),
                Level::Half(texel) => texels.add(sum, |_| texel),
                Level::Float(texel) => texels.add(sum, |_| texel),
            }
        } else {
            match file.level(face, [kernel.log2; 2]) {
                Level::U8(level) => texels.add(sum, |k| &level[k * n..][..n]),
                Level::U16(level) => texels.add(sum, |k| &level[k * n..][..n]),
                Level::Half(level) => texels.add(sum, |k| &level[k * n..][..n]),
                Level::Float(level) => texels.add(sum, |k| &level[k * n..][..n]),
            }
        }
    }
}

impl Texels {
    /// Adds all texels inside, row by row.
    fn add<'a, T: Sample>(&self, sum: &mut Sum, texel: impl Fn(usize) -> &'a [T]) {
        let side = 1 << self.log2;
        let [a, b, c] = self.form;
        let ([lu, lv, lw], [hu, hv, hw]) = (self.low, self.high);
        for row in lv.max(0)..hv.min(side) {
            let rest = side - row;
            let start = lu.max(rest - hw).max(0);
            let end = hu.min(rest - lw).min(side);
            let (u, v) = (start as f32 - self.centre[0], row as f32 - self.centre[1]);
            // The form by differences along the row.
            let mut step = a * (2.0 * u + 1.0) + b * v;
            let mut form = a * u * u + (b * u + c * v) * v;
            for column in start..end {
                if form < 1.0 {
                    let weight = (-0.5 * RADIUS * RADIUS * form).exp() * self.area;
                    sum.weight += weight;
                    let texel = texel((row * side + column) as usize);
                    for (sum, sample) in sum.value.iter_mut().zip(texel) {
                        *sum += sample.to_f32() * weight;
                    }
                }
                form += step;
                step += 2.0 * a;
            }
        }
    }
}
