//! Curves: thin ribbons and tubes along cubic splines. Scene-file manual (`curve`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `string type` | `flat` | `flat` turns to the ray, `cylinder` does too but is shaded round, `ribbon` has normals |
//! | `string basis` | `bezier` | `bezier` or `bspline` |
//! | `integer degree` | 3 | 2 or 3 |
//! | `point3 P` | | control points of any number of segments |
//! | `float width`, `width0`, `width1` | 1 | diameter, and at both ends of the whole curve |
//! | `normal N` | | of a ribbon, at both ends of each segment |
//! | `integer splitdepth` | 3 | segments are halved so often at least |
//!
//! The model is pbrt-v3's (pbrt 3rd ed., section 3.7): a curve is met where the ray passes its centre line within half
//! the width, in the plane across the ray; (u, v) run along a segment and across it; ∂p/∂v is across the ray (`flat`),
//! turned about the tangent from −90° to 90° over the width (`cylinder`), or across the normal (`ribbon`); the normal
//! is ∂p/∂u × ∂p/∂v, which looks *along* the ray that meets a `flat` curve. Error boxes reach two widths, so that a
//! curve neither meets nor shadows itself where it is left.
//!
//! Segments are kept in *curve space*: render space where the transform is a rotation with a uniform scale, else a
//! space of their own, since a stretched curve is round only there. A segment is cut into up to eight pieces, the
//! elements.

mod crossing;
mod facing;
pub mod spline;

use glam::{DVec3, Vec3A};

use crate::math::animated::corners_of;
use crate::math::error::{EPSILON, gamma};
use crate::math::transform::power_of_two_near;
use crate::math::{Bounds3, Frame, Normal3, Point3, Ray, Transform, Vec3};
use crate::shape::quadric::SIMILARITY_TOLERANCE;
use crate::shape::{ElementHit, ShapeSample, SurfacePoint};
use crossing::{Crossing, Cubic, Nearest, evaluate, halves, slerp, wide};
use facing::Window;

/// How a curve is seen and shaded.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum CurveStyle {
    /// A flat band that turns to every ray.
    Flat,
    /// As wide as a flat one, with the normals of a tube.
    Cylinder,
    /// A flat band with normals of its own.
    Ribbon,
}

/// Curves in object space, before they are placed.
#[derive(Clone, Debug)]
pub struct CurveSource {
    /// How they look.
    pub style: CurveStyle,
    /// Control points of each cubic Bézier segment.
    pub segments: Vec<[DVec3; 4]>,
    /// Widths at the start of the first segment and the end of the last; linear in between.
    pub widths: [f64; 2],
    /// Halvings of each segment that are made in any case, at most [`MAX_SPLIT_DEPTH`].
    pub split_depth: u32,
    /// One normal for each end of a segment, `segments.len() + 1` of them, for a ribbon; else nothing.
    pub normals: Vec<DVec3>,
}

impl CurveSource {
    /// Corners of boxes around the segments, in object space.
    pub fn corners(&self) -> impl Iterator<Item = DVec3> {
        let reach = DVec3::splat(0.5 * self.widths[0].max(self.widths[1]));
        self.segments.iter().flat_map(move |points| {
            let lo = points.iter().fold(points[0], |a, b| a.min(*b)) - reach;
            let hi = points.iter().fold(points[0], |a, b| a.max(*b)) + reach;
            corners_of([lo, hi])
        })
    }
}

/// A segment in curve space.
#[derive(Clone, Copy, Debug)]
struct Segment {
    points: [[f32; 3]; 4],
    /// At its ends.
    widths: [f32; 2],
}

/// An element: a part of a segment.
#[derive(Clone, Copy, Debug)]
struct Piece {
    segment: u32,
    /// Where in the tree of halves: 1 is the whole segment, 2k and 2k + 1 are the halves of k.
    node: u8,
}

/// The curves of one directive.
#[derive(Clone, Debug)]
pub struct Curves {
    style: CurveStyle,
    segments: Box<[Segment]>,
    pieces: Box<[Piece]>,
    /// How often pbrt-v3 halves a segment before it looks how bent the parts are.
    split_depth: u32,
    /// Unit normals at the ends of segments of a ribbon, in curve space.
    normals: Box<[[f32; 3]]>,
    /// Where curve space is not render space.
    render_from_curve: Option<Box<Transform>>,
    /// Half extents in curve space of pbrt-v3's error box, for a curve of width 1.
    error_box: Vec3,
    /// The normal is the negative of ∂p/∂u × ∂p/∂v.
    flip_normal: bool,
}

/// Largest [`CurveSource::split_depth`].
pub const MAX_SPLIT_DEPTH: u32 = 10;
/// Most halvings of a segment into pieces.
const MAX_PIECE_DEPTH: u32 = 3;
/// Halving is worth it if the halves' boxes together have less than this part of the surface.
const WORTHWHILE: f32 = 0.75;
/// Box around a cubic of the given width; empty where there is nothing to see.
fn bounds_of(c: &Cubic, width: f32) -> Bounds3 {
    let is_point = c[1..].iter().all(|p| *p == c[0]);
    if !(width > 0.0) || is_point || !c.iter().all(|p| p.is_finite()) {
        return Bounds3::EMPTY;
    }
    let mut bounds = c
        .iter()
        .fold(Bounds3::EMPTY, |b, p| b.with_point(Point3(*p)));
    // The intersection rounds: to a few units in the last place of the coordinates.
    let largest = bounds.min.0.abs().max(bounds.max.0.abs()).max_element();
    let margin = Vec3A::splat(0.5 * width * (1.0 + gamma(8)) + largest * gamma(8));
    bounds.min.0 -= margin;
    bounds.max.0 += margin;
    bounds
}

impl Segment {
    fn cubic(&self) -> Cubic {
        self.points.map(Vec3A::from_array)
    }

    #[inline]
    fn width(&self, u: f32) -> f32 {
        self.widths[0] + (self.widths[1] - self.widths[0]) * u
    }

    fn widest(&self, [u0, u1]: [f32; 2]) -> f32 {
        self.width(u0).max(self.width(u1))
    }

    /// Adds the pieces of the part `node` of the segment, cut where that makes boxes smaller.
    fn cut(&self, segment: u32, node: u8, c: &Cubic, max_depth: u32, out: &mut Vec<Piece>) {
        let [u0, u1] = range_of(node);
        let parts = halves(c);
        let [first, second] = [0, 1].map(|k| 2 * node + k as u8);
        if node.ilog2() < max_depth {
            let area = |c: &Cubic, range: [f32; 2]| bounds_of(c, self.widest(range)).half_area();
            let apart = area(&parts[0], range_of(first)) + area(&parts[1], range_of(second));
            if apart < WORTHWHILE * area(c, [u0, u1]) {
                self.cut(segment, first, &parts[0], max_depth, out);
                self.cut(segment, second, &parts[1], max_depth, out);
                return;
            }
        }
        out.push(Piece { segment, node });
    }
}

/// Parameters at the ends of a node of the tree of halves.
#[inline]
fn range_of(node: u8) -> [f32; 2] {
    let level = node.ilog2();
    let size = 1.0 / (1u32 << level) as f32;
    let index = u32::from(node) - (1 << level);
    [index as f32 * size, (index + 1) as f32 * size]
}

impl Curves {
    /// Places curves. `flip_normal` turns their normals around in object space.
    pub fn new(source: &CurveSource, render_from_object: &Transform, flip_normal: bool) -> Self {
        let [w0, w1] = source.widths;
        let n_segments = source.segments.len();
        let similarity = render_from_object
            .uniform_scale(SIMILARITY_TOLERANCE)
            .filter(|_| !render_from_object.swaps_handedness());
        // Curve space: render space, or object space moved to the curve and scaled to a size that suits f32.
        let (curve_from_object, scale) = match similarity {
            Some(scale) => (*render_from_object, scale),
            None => {
                let points = || source.segments.iter().flatten();
                let anchor = source.segments.first().map_or(DVec3::ZERO, |s| s[0]);
                let size = points()
                    .map(|p| (*p - anchor).abs().max_element())
                    .fold(w0.max(w1), f64::max);
                let scale = if size > 0.0 && size.is_finite() {
                    1.0 / power_of_two_near(size)
                } else {
                    1.0
                };
                (Transform::scale_translate(scale, -anchor * scale), scale)
            }
        };
        let render_from_curve = match similarity {
            Some(_) => None,
            None => Some(Box::new(
                render_from_object.compose(&curve_from_object.inverse()),
            )),
        };
        let error_box = match similarity {
            Some(scale) => {
                let m = render_from_object.affine().matrix3;
                Vec3::from_f64((m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs()) / scale)
            }
            None => Vec3::new(1.0, 1.0, 1.0),
        };
        let width = |k: usize| (scale * (w0 + (w1 - w0) * k as f64 / n_segments as f64)) as f32;
        let segments: Box<[Segment]> = source
            .segments
            .iter()
            .enumerate()
            .map(|(k, points)| Segment {
                points: points.map(|p| curve_from_object.point(p).as_vec3().to_array()),
                widths: [width(k), width(k + 1)],
            })
            .collect();
        let split_depth = source.split_depth.min(MAX_SPLIT_DEPTH);
        let mut pieces = Vec::with_capacity(n_segments);
        for (k, segment) in segments.iter().enumerate() {
            let max_depth = split_depth.min(MAX_PIECE_DEPTH);
            segment.cut(k as u32, 1, &segment.cubic(), max_depth, &mut pieces);
        }
        let normal = |n: &DVec3| curve_from_object.normal(*n).normalize_or_zero();
        Self {
            style: source.style,
            segments,
            pieces: pieces.into(),
            split_depth,
            normals: source
                .normals
                .iter()
                .map(|n| normal(n).as_vec3().to_array())
                .collect(),
            render_from_curve,
            error_box,
            flip_normal,
        }
    }

    /// Number of pieces.
    pub fn n_pieces(&self) -> usize {
        self.pieces.len()
    }

    /// How they look.
    pub fn style(&self) -> CurveStyle {
        self.style
    }

    /// The segment of a piece, its node there, and its control points relative to `origin`.
    #[inline]
    fn piece(&self, element: u32, origin: Vec3A) -> (&Segment, u8, Cubic) {
        let Piece { segment, node } = self.pieces[element as usize];
        let segment = &self.segments[segment as usize];
        let mut c = segment.cubic().map(|p| p - origin);
        for level in (0..node.ilog2()).rev() {
            let [first, second] = halves(&c);
            c = if node >> level & 1 == 0 {
                first
            } else {
                second
            };
        }
        (segment, node, c)
    }

    /// Box around a piece; empty if it has no width or no length.
    pub fn bounds(&self, element: u32) -> Bounds3 {
        let (segment, node, c) = self.piece(element, Vec3A::ZERO);
        let bounds = bounds_of(&c, segment.widest(range_of(node)));
        match &self.render_from_curve {
            Some(transform) if !bounds.is_empty() => {
                let corners = corners_of([bounds.min.to_f64(), bounds.max.to_f64()])
                    .map(|corner| transform.point(corner));
                let lo = corners.iter().fold(corners[0], |a, b| a.min(*b));
                let hi = corners.iter().fold(corners[0], |a, b| a.max(*b));
                // A ray is rounded once more on its way to curve space.
                let margin = lo.abs().max(hi.abs()) * f64::from(gamma(8));
                Bounds3::around(lo - margin, hi + margin)
            }
            _ => bounds,
        }
    }

    /// Area of a piece spread flat; approximate where the transform stretches.
    pub fn area(&self, element: u32) -> f64 {
        const N: usize = 16;
        let (segment, node, c) = self.piece(element, Vec3A::ZERO);
        let [u0, u1] = range_of(node);
        let [a, b, c, d] = wide(&c);
        let stretch = |v: DVec3| match &self.render_from_curve {
            Some(t) => t.vector(v).length() * t.determinant().abs().cbrt(),
            None => v.length(),
        };
        let slice = |k: usize| {
            let w = (k as f64 + 0.5) / N as f64;
            let derivative = ((b - a) * (1.0 - w) * (1.0 - w)
                + (c - b) * (2.0 * w * (1.0 - w))
                + (d - c) * w * w)
                * 3.0;
            let width = segment.width(u0 + (u1 - u0) * w as f32);
            stretch(derivative) * f64::from(width) / N as f64
        };
        (0..N).map(slice).sum()
    }

    /// Origin and direction of a ray in curve space; distances along it stay what they are.
    #[inline]
    fn curve_ray(&self, ray: &Ray) -> (Vec3A, Vec3A) {
        match &self.render_from_curve {
            None => (ray.o.0, ray.d.0),
            Some(transform) => {
                let curve_from_render = transform.inverse();
                (
                    curve_from_render.point(ray.o.to_f64()).as_vec3a(),
                    curve_from_render.vector(ray.d.to_f64()).as_vec3a(),
                )
            }
        }
    }

    /// The nearest meeting of the ray with a piece in (0, `t_max`); its barycentric weights are (u, v).
    #[inline]
    pub fn intersect(&self, element: u32, ray: &Ray, t_max: f32) -> Option<ElementHit> {
        let (o, d) = self.curve_ray(ray);
        self.meet(element, o, d, t_max)
    }

    fn meet(&self, element: u32, o: Vec3A, d: Vec3A, t_max: f32) -> Option<ElementHit> {
        let (segment, node, c) = self.piece(element, o);
        let (range, level) = (range_of(node), node.ilog2());
        let length = d.length();
        let z = d / length;
        // The y axis is across the chord: most rays that miss are told by it alone.
        let y = z.cross(c[3] - c[0]).try_normalize();
        let y = y.unwrap_or_else(|| Frame::from_z(Vec3(z)).s.0);
        let width = segment.widest(range);
        let across = c.map(|p| p.dot(y));
        let (lo, hi) = (
            across[0].min(across[1]).min(across[2].min(across[3])),
            across[0].max(across[1]).max(across[2].max(across[3])),
        );
        if lo > 0.5 * width || hi < -0.5 * width {
            return None;
        }
        let x = y.cross(z);
        let c = [0, 1, 2, 3].map(|k| Vec3A::new(c[k].dot(x), across[k], c[k].dot(z)));
        let mut crossing = Crossing {
            segment,
            ribbon: self
                .ribbon_normals(element)
                .map(|normals| (normals, z.as_dvec3())),
            nearest: None,
            z_max: length * t_max,
        };
        if crossing.is_beside(&c, width) {
            return None;
        }
        crossing.split(&c, range, self.split_depth - level);
        let Nearest { z, uv } = crossing.nearest?;
        let t = z / length;
        (t > 0.0 && t < t_max).then_some(ElementHit { t, barycentric: uv })
    }

    /// Normals at the ends of the segment of a piece of a ribbon.
    fn ribbon_normals(&self, element: u32) -> Option<[DVec3; 2]> {
        if self.normals.is_empty() {
            return None;
        }
        let first = self.pieces[element as usize].segment as usize;
        Some([first, first + 1].map(|k| DVec3::from(self.normals[k].map(f64::from))))
    }

    /// The surface where `ray` met a piece.
    pub fn surface(&self, element: u32, ray: &Ray, hit: &ElementHit) -> SurfacePoint {
        let (o, d) = self.curve_ray(ray);
        let at = self.surface_in_curve_space(element, o, d, hit);
        match &self.render_from_curve {
            Some(transform) => at.placed(transform, 1.0),
            None => at,
        }
    }

    fn surface_in_curve_space(
        &self,
        element: u32,
        o: Vec3A,
        d: Vec3A,
        hit: &ElementHit,
    ) -> SurfacePoint {
        let [u, v] = hit.barycentric;
        let segment = &self.segments[self.pieces[element as usize].segment as usize];
        let (_, dpdu) = evaluate(&segment.cubic(), u);
        let dpdu = dpdu.as_dvec3();
        let d_unit = d.as_dvec3().normalize();
        let mut width = f64::from(segment.width(u));
        let across = match self.ribbon_normals(element) {
            Some(normals) => {
                let n = slerp(&normals, u.into());
                width *= n.dot(d_unit).abs();
                n.cross(dpdu)
            }
            None => {
                let flat = d_unit.cross(dpdu);
                match self.style {
                    CurveStyle::Cylinder => {
                        // Turned about the tangent, from −90° to 90° across the width.
                        let (sin, cos) = ((f64::from(v) - 0.5) * std::f64::consts::PI).sin_cos();
                        let tangent = dpdu.normalize_or_zero();
                        flat * cos - tangent.cross(flat) * sin
                    }
                    CurveStyle::Flat | CurveStyle::Ribbon => flat,
                }
            }
        };
        // The ray, or the normal, lies along the tangent: any direction across it will do.
        let across = across
            .try_normalize()
            .unwrap_or_else(|| dpdu.any_orthonormal_vector());
        let dpdv = across * width;
        let n = dpdu.cross(across).normalize();
        let ng = Normal3::from_f64(if self.flip_normal { -n } else { n });
        let p = Point3(o + d * hit.t);
        let rounding = (p.0.abs() + o.abs()) * (4.0 * EPSILON);
        SurfacePoint {
            p,
            p_err: self.error_box * (2.0 * width as f32) + Vec3(rounding),
            ng,
            n_surface: ng,
            ns: ng,
            uv: [u, v],
            dpdu: Vec3::from_f64(dpdu),
            dpdv: Vec3::from_f64(dpdv),
            tangent: Vec3::from_f64(dpdu),
            bitangent: Vec3::from_f64(dpdv),
            dndu: Vec3::ZERO,
            dndv: Vec3::ZERO,
            face: 0,
            dn_scale: 1.0,
        }
    }

    /// See [`crate::shape::Shape::sample_toward`]: a direction into a window around the piece, and what it meets
    /// there. `None` where that is nothing, and where there is no window: the receiver is next to the piece.
    pub fn sample_toward(&self, element: u32, from: Point3, u: [f32; 2]) -> Option<ShapeSample> {
        let (o, window) = self.window(element, from)?;
        let w = window.sample(u.map(f64::from));
        let hit = self.meet(element, o, w.as_vec3a(), f32::INFINITY)?;
        let mut at = self.surface_in_curve_space(element, o, w.as_vec3a(), &hit);
        // The point aimed at is known but for rounding, whatever the distance at which rays leave it.
        at.p_err = Vec3((at.p.0.abs() + o.abs()) * (4.0 * EPSILON));
        let pdf_w = self.render_density(w, window.pdf_w(w));
        let at = match &self.render_from_curve {
            Some(transform) => at.placed(transform, 1.0),
            None => at,
        };
        (pdf_w > 0.0).then_some(ShapeSample {
            p: at.p,
            p_err: at.p_err,
            ng: at.ng,
            pdf_w,
            barycentric: hit.barycentric,
        })
    }

    /// See [`crate::shape::Shape::pdf_toward`].
    pub fn pdf_toward(&self, element: u32, from: Point3, p: Point3) -> f32 {
        let Some((_, window)) = self.window(element, from) else {
            return 0.0;
        };
        let w = p.to_f64() - from.to_f64();
        let w = match &self.render_from_curve {
            Some(transform) => transform.inverse().vector(w),
            None => w,
        };
        self.render_density(w.normalize_or_zero(), window.pdf_w(w))
    }

    /// The receiver in curve space, and the window through which it sees a piece.
    fn window(&self, element: u32, from: Point3) -> Option<(Vec3A, Window)> {
        let o = match &self.render_from_curve {
            Some(transform) => transform.inverse().point(from.to_f64()).as_vec3a(),
            None => from.0,
        };
        let (segment, node, c) = self.piece(element, o);
        let width = f64::from(segment.widest(range_of(node)));
        let window = Window::around(wide(&c), 0.5 * width)?;
        Some((o, window))
    }

    /// A density in sr⁻¹ of the unit direction `w`, both in curve space, as density in render space.
    fn render_density(&self, w: DVec3, pdf_w: f64) -> f32 {
        let factor = match &self.render_from_curve {
            Some(t) => t.vector(w).length().powi(3) / t.determinant().abs(),
            None => 1.0,
        };
        let pdf_w = (pdf_w * factor) as f32;
        if pdf_w.is_finite() { pdf_w } else { 0.0 }
    }
}
