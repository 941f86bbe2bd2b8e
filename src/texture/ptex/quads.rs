//! The filter on quads: a product of weights along u and along v, cut at the edges of faces. A piece beyond an edge is
//! turned into the frame of the face there.

use arrayvec::ArrayVec;

use crate::image::ptex::{Border, Face, Level, Sample};
use crate::texture::ptex::{Sum, add_texel};

/// Edges of a face, counter-clockwise.
const BOTTOM: usize = 0;
const RIGHT: usize = 1;
const TOP: usize = 2;
const LEFT: usize = 3;

/// Most faces that are looked for around a corner.
const VALENCE_MAX: usize = 10;

/// Weights of texels along one axis.
#[derive(Clone, Debug)]
struct Axis {
    /// Logarithm of the resolution of the face they are for.
    log2: u8,
    /// The first texel.
    first: i32,
    weights: ArrayVec<f32, 10>,
}

/// Weights of texels of a face: those along u times those along v.
#[derive(Clone, Debug)]
struct Kernel {
    axes: [Axis; 2],
    /// Quarter turns since the face that is looked up.
    turns: usize,
}

/// Adds the filter around a point of a face.
pub(super) fn add(sum: &mut Sum, number: u32, face: &Face, uv: [f32; 2], [dx, dy]: [[f32; 2]; 2]) {
    let mut at = uv;
    for (x, border) in at.iter_mut().zip(sum.file.borders()) {
        match border {
            Border::Clamp => *x = x.clamp(0.0, 1.0),
            Border::Periodic => *x -= x.floor(),
            Border::Black if *x > -1.0 && *x < 2.0 => {}
            Border::Black => {
                sum.weight = 1.0;
                return;
            }
        }
    }
    let axis = |k: usize| {
        let width = dx[k].abs() + dy[k].abs();
        if face.is_subface {
            // As a quarter of a whole face.
            let mut axis = Axis::new(0.5 * at[k], 0.5 * width, face.log2[k] + 1);
            axis.make_finer_than_one();
            axis.log2 -= 1;
            axis
        } else {
            Axis::new(at[k], width, face.log2[k])
        }
    };
    let mut kernel = Kernel {
        axes: [axis(0), axis(1)],
        turns: 0,
    };
    for axis in &mut kernel.axes {
        axis.strip_zeros();
    }
    sum.weight = kernel.weight();
    split(sum, kernel, number, face);
}

impl Axis {
    /// Weights around `x` of a filter of a width in parts of the face, which has 2^`log2` texels.
    fn new(x: f32, width: f32, log2: u8) -> Self {
        let width = width.max(1.0 / (1u32 << log2) as f32);
        if width >= 1.0 {
            // One texel a face, blended smoothly with the next.
            let p = x - 0.5;
            let first = p.floor();
            let near = smooth(p - first);
            return Self {
                log2: 0,
                first: first as i32,
                weights: ArrayVec::from_iter([near, 1.0 - near]),
            };
        }
        if width >= 0.5 {
            let p = x * 2.0 - 0.5;
            let first = (x - 0.5).floor() * 2.0;
            let narrower = 1.0 / (width * 1.5 + 0.5);
            let weight = |k: u8| smooth((first - p + f32::from(k)) * narrower);
            return Self {
                log2: 1,
                first: first as i32,
                weights: (0..4).map(weight).collect(),
            };
        }
        if width >= 0.25 {
            let p = x * 4.0 - 0.5;
            let first = (p - 2.0).ceil() as i32 & !1;
            let end = ((p + 2.0).ceil() as i32 + 1) & !1;
            let start = first as f32 - p;
            return Self {
                log2: 2,
                first,
                weights: (0..end - first)
                    .map(|k| b_spline(start + k as f32))
                    .collect(),
            };
        }
        // The resolution at which the filter is one to two texels wide.
        let log2 = (127 - (width.to_bits() >> 23)) as u8;
        let resolution = (1u32 << log2) as f32;
        let (p, width) = (x * resolution - 0.5, width * resolution);
        let first = (p - 2.0 * width).ceil() as i32;
        let end = (p + 2.0 * width).ceil() as i32;
        let (start, step) = ((first as f32 - p) / width, 1.0 / width);
        Self {
            log2,
            first,
            weights: (0..end - first)
                .map(|k| b_spline(start + k as f32 * step))
                .collect(),
        }
    }

    fn resolution(&self) -> i32 {
        1 << self.log2
    }

    fn end(&self) -> i32 {
        self.first + self.weights.len() as i32
    }

    fn weight(&self) -> f32 {
        self.weights.iter().sum()
    }

    fn strip_zeros(&mut self) {
        let n = self.weights.iter().take_while(|w| **w == 0.0).count();
        self.weights.drain(..n);
        self.first += n as i32;
        while self.weights.last() == Some(&0.0) {
            self.weights.pop();
        }
    }

    /// How many texels lie beyond the lower end of the face.
    fn n_below(&self) -> usize {
        (-self.first).clamp(0, self.weights.len() as i32) as usize
    }

    /// How many texels lie beyond its upper end.
    fn n_above(&self) -> usize {
        (self.end() - self.resolution()).clamp(0, self.weights.len() as i32) as usize
    }

    /// Cuts off what lies beyond an end, for the face there.
    fn split(&mut self, is_upper: bool) -> Self {
        let mut part = self.clone();
        if is_upper {
            let n = self.weights.len() - self.n_above();
            part.weights.drain(..n);
            part.first += n as i32 - self.resolution();
            self.weights.truncate(n);
        } else {
            let n = self.n_below();
            part.weights.truncate(n);
            part.first += self.resolution();
            self.weights.drain(..n);
            self.first += n as i32;
        }
        part
    }

    /// Gives what lies beyond an end to the last texel before it, or to none.
    fn merge(&mut self, is_upper: bool, border: Border) {
        let beyond = self.split(is_upper).weight();
        let last = if is_upper {
            self.weights.last_mut()
        } else {
            self.weights.first_mut()
        };
        if border == Border::Black {
            return;
        }
        match last {
            Some(last) => *last += beyond,
            None => {
                self.first = if is_upper { self.resolution() - 1 } else { 0 };
                self.weights.push(beyond);
            }
        }
    }

    fn flip(&mut self) {
        self.first = self.resolution() - self.end();
        self.weights.reverse();
    }

    /// For half the resolution: weights of two texels are added.
    fn make_coarser(&mut self) {
        let mut coarse = ArrayVec::<f32, 10>::new();
        for (k, weight) in self.weights.iter().enumerate() {
            let begins_texel = (self.first + k as i32) & 1 == 0;
            match coarse.last_mut() {
                Some(last) if !begins_texel => *last += weight,
                _ => coarse.push(*weight),
            }
        }
        self.weights = coarse;
        self.first >>= 1;
        self.log2 -= 1;
    }

    /// One texel for the face becomes two, so that it can be halved.
    fn make_finer_than_one(&mut self) {
        if self.log2 > 0 {
            return;
        }
        // There are no more than two.
        let halves = self.weights.iter().flat_map(|w| [0.5 * w; 2]).take(10);
        self.weights = halves.collect();
        self.first *= 2;
        self.log2 = 1;
    }
}

impl Kernel {
    fn weight(&self) -> f32 {
        self.axes[0].weight() * self.axes[1].weight()
    }

    /// Cuts off what lies beyond an edge.
    fn split(&mut self, edge: usize) -> Self {
        let (axis, is_upper) = side(edge);
        let mut part = self.clone();
        part.axes[axis] = self.axes[axis].split(is_upper);
        if !self.axes[axis].weights.is_empty() {
            // The library counts anew from here.
            part.turns = 0;
        }
        part
    }

    fn reaches_beyond(&self, edge: usize) -> bool {
        let (axis, is_upper) = side(edge);
        let axis = &self.axes[axis];
        if is_upper {
            axis.end() > axis.resolution()
        } else {
            axis.first < 0
        }
    }

    fn merge(&mut self, edge: usize, borders: [Border; 2]) {
        let (axis, is_upper) = side(edge);
        self.axes[axis].merge(is_upper, borders[axis]);
    }

    /// Turns counter-clockwise by quarters.
    fn rotate(&mut self, turns: i32) {
        let turns = turns.rem_euclid(4);
        let [u, v] = &mut self.axes;
        if turns == 1 || turns == 2 {
            u.flip();
        }
        if turns == 2 || turns == 3 {
            v.flip();
        }
        if turns % 2 == 1 {
            self.axes.swap(0, 1);
        }
        self.turns = (self.turns + turns as usize) % 4;
    }

    /// From the frame of a whole face beyond an edge to that of one of the two subfaces there; whether it is the one
    /// that the whole face knows.
    fn enter_subface(&mut self, edge: usize) -> bool {
        for axis in &mut self.axes {
            axis.make_finer_than_one();
            axis.log2 -= 1;
        }
        let [u, v] = &mut self.axes;
        let (nu, nv) = (u.resolution(), v.resolution());
        match edge {
            BOTTOM => {
                let is_first = u.first < nu;
                v.first -= nv;
                u.first -= if is_first { 0 } else { nu };
                is_first
            }
            RIGHT => {
                let is_first = v.first < nv;
                v.first -= if is_first { 0 } else { nv };
                is_first
            }
            TOP => {
                let is_first = u.first >= nu;
                u.first -= if is_first { nu } else { 0 };
                is_first
            }
            _ => {
                let is_first = v.first >= nv;
                u.first -= nu;
                v.first -= if is_first { nv } else { 0 };
                is_first
            }
        }
    }

    /// From the frame of a subface to that of the whole face beyond an edge.
    fn leave_subface(&mut self, edge: i32) {
        let edge = edge.rem_euclid(4) as usize;
        let [u, v] = &mut self.axes;
        if edge == TOP || edge == LEFT {
            u.first += u.resolution();
        }
        if edge == BOTTOM || edge == LEFT {
            v.first += v.resolution();
        }
        u.log2 += 1;
        v.log2 += 1;
    }

    /// The same weights along both axes, from a corner at 0; the weight of what comes of it.
    fn make_symmetric(&mut self, weight: f32) -> f32 {
        let [u, v] = &mut self.axes;
        while u.log2 > v.log2 {
            u.make_coarser();
        }
        while v.log2 > u.log2 {
            v.make_coarser();
        }
        let n = u.weights.len().min(v.weights.len());
        u.weights.truncate(n);
        v.weights.truncate(n);
        for (a, b) in u.weights.iter_mut().zip(&mut v.weights) {
            *a += *b;
            *b = *a;
        }
        let total = u.weight();
        let total = total * total;
        // Weights are positive: the square of the sum is more than the product.
        if total > weight {
            for a in &mut u.weights {
                *a *= weight / total;
            }
            return weight;
        }
        total
    }
}

/// Axis across an edge, and whether the edge is at its upper end.
fn side(edge: usize) -> (usize, bool) {
    match edge {
        BOTTOM => (1, false),
        RIGHT => (0, true),
        TOP => (1, true),
        _ => (0, false),
    }
}

/// Cuts a kernel at the edges of a face and adds all parts. Calls itself for what reaches over further edges.
fn split(sum: &mut Sum, mut kernel: Kernel, number: u32, face: &Face) {
    if !sum.is_one_more() {
        return;
    }
    let borders = sum.file.borders();
    let beyond = [BOTTOM, RIGHT, TOP, LEFT].map(|edge| kernel.reaches_beyond(edge));
    // The corner after an edge is named by it: bottom right by the right edge, and so on counter-clockwise.
    for (edge, corners) in [
        (RIGHT, [(TOP, TOP), (BOTTOM, RIGHT)]),
        (LEFT, [(TOP, LEFT), (BOTTOM, BOTTOM)]),
    ] {
        if !beyond[edge] {
            continue;
        }
        if face.neighbours[edge].is_none() {
            kernel.merge(edge, borders);
            continue;
        }
        let mut part = kernel.split(edge);
        for (other, corner) in corners {
            if !beyond[other] {
                continue;
            }
            if face.neighbours[other].is_some() {
                let piece = part.split(other);
                add_corner(sum, piece, number, face, corner);
            } else {
                part.merge(other, borders);
            }
        }
        add_across(sum, part, number, face, edge);
    }
    for edge in [TOP, BOTTOM] {
        if !beyond[edge] {
            continue;
        }
        if face.neighbours[edge].is_some() {
            let part = kernel.split(edge);
            add_across(sum, part, number, face, edge);
        } else {
            kernel.merge(edge, borders);
        }
    }
    add_here(sum, kernel, number, face);
}

/// Adds what reaches over an edge.
fn add_across(sum: &mut Sum, mut kernel: Kernel, number: u32, face: &Face, edge: usize) {
    let Some((mut there, mut their_edge, mut other)) = beyond(sum, face, edge) else {
        return;
    };
    let mut turns = edge as i32 - their_edge as i32 + 2;
    let is_subface = other.is_subface;
    if is_subface && !face.is_subface {
        if !kernel.enter_subface(edge) {
            // On to the other one of the two.
            let next = (their_edge + 3) % 4;
            let Some(second) = beyond(sum, other, next) else {
                return;
            };
            (there, their_edge, other) = second;
            turns += next as i32 - their_edge as i32 + 2;
        }
    } else if face.is_subface && !is_subface {
        let is_first = other.neighbours[their_edge] == Some(number);
        kernel.leave_subface(edge as i32 - i32::from(is_first));
    }
    kernel.rotate(turns);
    add_there(sum, kernel, there, other, is_subface);
}

/// Subfaces are so small that a kernel may reach over them.
fn add_there(sum: &mut Sum, kernel: Kernel, number: u32, face: &Face, is_subface: bool) {
    if is_subface {
        split(sum, kernel, number, face);
    } else {
        add_here(sum, kernel, number, face);
    }
}

fn beyond<'a>(sum: &Sum<'a>, face: &Face, edge: usize) -> Option<(u32, usize, &'a Face)> {
    let there = face.neighbours[edge]?;
    let other = sum.file.face(there)?;
    Some((there, usize::from(face.their_edges[edge]), other))
}

/// Adds what reaches over a corner. The faces around it are counted clockwise.
fn add_corner(sum: &mut Sum, mut kernel: Kernel, number: u32, face: &Face, edge: usize) {
    let mut around = ArrayVec::<(u32, usize, &Face), VALENCE_MAX>::new();
    let (mut here, mut their_edge, mut current) = (number, edge, face);
    let mut n_corners = 0;
    for k in 0..VALENCE_MAX {
        let previous = here;
        let was_subface = current.is_subface;
        let next = beyond(sum, current, their_edge);
        let next = next.map(|(there, edge, other)| (there, (edge + 1) % 4, other));
        let Some(next) = next.filter(|n| (n.0, n.1) != (number, edge)) else {
            n_corners = k.saturating_sub(2);
            break;
        };
        (here, their_edge, current) = next;
        around.push(next);
        let back = current.neighbours[(their_edge + 3) % 4];
        if was_subface && !current.is_subface && back == Some(previous) {
            // The corner is in the middle of an edge of a whole face.
            let is_first = i32::from(k == 1);
            kernel.leave_subface(edge as i32 + 2 * is_first);
            kernel.rotate(edge as i32 - their_edge as i32 + 3 - is_first);
            split(sum, kernel, here, current);
            return;
        }
    }
    if n_corners == 1 {
        add_corner_face(sum, kernel, face, edge, around[1]);
    } else if n_corners > 1 {
        // More than four faces meet: they share the corner alike.
        kernel.rotate(edge as i32 + 2);
        let weight = kernel.weight();
        let symmetric = kernel.make_symmetric(weight);
        for corner in &around[1..=n_corners] {
            add_corner_face(sum, kernel.clone(), face, 2, *corner);
        }
        sum.weight += symmetric * n_corners as f32 - weight;
    } else {
        // Two or three: there is no face but those that the edges lead to.
        sum.weight -= kernel.weight();
    }
}

fn add_corner_face(
    sum: &mut Sum,
    mut kernel: Kernel,
    face: &Face,
    edge: usize,
    (there, their_edge, other): (u32, usize, &Face),
) {
    let across = edge as i32 + 3;
    if other.is_subface && !face.is_subface {
        kernel.enter_subface(across as usize % 4);
    } else if face.is_subface && !other.is_subface {
        kernel.leave_subface(across);
    }
    kernel.rotate(edge as i32 - their_edge as i32 + 2);
    add_there(sum, kernel, there, other, other.is_subface);
}

/// Adds the texels of a face.
fn add_here(sum: &mut Sum, mut kernel: Kernel, number: u32, face: &Face) {
    if kernel.axes.iter().any(|axis| axis.weights.is_empty()) {
        return;
    }
    for (axis, log2) in kernel.axes.iter_mut().zip(face.log2) {
        while axis.log2 > log2 {
            axis.make_coarser();
        }
    }
    let log2 = [kernel.axes[0].log2, kernel.axes[1].log2];
    let turns = if sum.file.turns_vectors() && sum.file.channels() > 1 {
        kernel.turns
    } else {
        0
    };
    let mut value = if turns == 0 { sum.value } else { [0.0; 3] };
    if face.is_constant || log2 == [0, 0] {
        add_texel(&mut value, sum.file.mean(number), kernel.weight());
        // The library does not turn what is the same all over a face.
        if turns != 0 {
            for (sum, x) in sum.value.iter_mut().zip(value) {
                *sum += x;
            }
            return;
        }
    } else {
        let n = sum.file.channels();
        match sum.file.level(face, log2) {
            Level::U8(texels) => add_rows(&mut value, &kernel, texels, n),
            Level::U16(texels) => add_rows(&mut value, &kernel, texels, n),
            Level::Half(texels) => add_rows(&mut value, &kernel, texels, n),
            Level::Float(texels) => add_rows(&mut value, &kernel, texels, n),
        }
    }
    let [x, y, z] = value;
    let turned = match turns {
        0 => {
            sum.value = value;
            return;
        }
        1 => [-y, x, z],
        2 => [-x, -y, z],
        _ => [y, -x, z],
    };
    for (sum, x) in sum.value.iter_mut().zip(turned) {
        *sum += x;
    }
}

fn add_rows<T: Sample>(value: &mut [f32; 3], kernel: &Kernel, texels: &[T], n_channels: usize) {
    let [u, v] = &kernel.axes;
    // Outside are only kernels that went around in circles.
    let inside = |axis: &Axis, k: usize| {
        let texel = axis.first + k as i32;
        (0..axis.resolution())
            .contains(&texel)
            .then_some(texel as usize)
    };
    for (j, v_weight) in v.weights.iter().enumerate() {
        let Some(row) = inside(v, j) else { continue };
        let mut of_row = [0.0; 3];
        for (i, u_weight) in u.weights.iter().enumerate() {
            let Some(column) = inside(u, i) else { continue };
            let texel = &texels[((row << u.log2) + column) * n_channels..][..n_channels];
            for (sum, sample) in of_row.iter_mut().zip(texel) {
                *sum += sample.to_f32() * u_weight;
            }
        }
        for (sum, x) in value.iter_mut().zip(of_row) {
            *sum += x * v_weight;
        }
    }
}

/// Uniform cubic B-spline: 4 wide, 2/3 at 0.
fn b_spline(x: f32) -> f32 {
    let x = x.abs();
    if x < 1.0 {
        (0.5 * x - 1.0) * x * x + 2.0 / 3.0
    } else if x < 2.0 {
        let y = 2.0 - x;
        y * y * y / 6.0
    } else {
        0.0
    }
}

/// From 1 at 0 to 0 at ±1, by a cubic.
fn smooth(x: f32) -> f32 {
    let x = x.abs();
    if x < 1.0 {
        (2.0 * x - 3.0) * x * x + 1.0
    } else {
        0.0
    }
}
