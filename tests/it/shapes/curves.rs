//! Curves against their definition: the nearest point of the centre line as a ray sees it.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use tyndall::ids::{LightId, MaterialId, ObjectId};
use tyndall::math::error::offset_origin;
use tyndall::math::{Point3, Ray, Transform};
use tyndall::shape::curve::{CurveSource, CurveStyle, spline};
use tyndall::shape::{Curves, ElementHit, RayShear, Shape};
use tyndall::world::{Cutout, Geometry, World, WorldParts};
use tyndall_test_support::z_test::Mean;
use tyndall_test_support::{Uniform, assert_close};

use super::copies::{direction, ray};

const STYLES: [CurveStyle; 3] = [CurveStyle::Flat, CurveStyle::Cylinder, CurveStyle::Ribbon];

/// An S of two segments, split so often that its parts are straight.
fn source(style: CurveStyle, width: f64) -> CurveSource {
    let points = [
        [-1.0, -0.5, 0.1],
        [-0.4, 0.8, -0.3],
        [0.1, 0.5, 0.4],
        [0.2, 0.0, 0.3],
        [0.3, -0.5, 0.2],
        [0.8, -0.9, -0.5],
        [1.1, 0.3, 0.0],
    ];
    let normals = [[0.1, 0.2, 1.0], [0.3, -0.4, 0.8], [0.0, 0.6, 0.9]];
    CurveSource {
        style,
        segments: spline::bezier(&points.map(DVec3::from), 3).expect("two segments"),
        widths: [width, 0.4 * width],
        split_depth: 8,
        normals: match style {
            CurveStyle::Ribbon => normals.map(|n| DVec3::from(n) * 2.0).to_vec(),
            _ => Vec::new(),
        },
    }
}

fn placed(source: &CurveSource, map: DAffine3) -> Shape {
    let transform = Transform::from_affine(map).expect("an invertible map");
    Shape::Curves(Curves::new(source, &transform, false))
}

fn whole(source: &CurveSource) -> Shape {
    placed(source, DAffine3::IDENTITY)
}

/// The nearest meeting with any piece.
fn nearest(shape: &Shape, ray: &Ray) -> Option<(u32, ElementHit)> {
    let shear = RayShear::new(ray);
    (0..shape.n_elements() as u32)
        .filter_map(|k| Some((k, shape.intersect(k, ray, &shear, f32::INFINITY)?)))
        .min_by(|a, b| a.1.t.total_cmp(&b.1.t))
}

/// A world of shapes that shine from both sides if they emit.
fn world_of(shapes: Vec<Shape>) -> World {
    let geometries = shapes.into_iter().map(|shape| Geometry {
        shape,
        material: MaterialId::NONE,
        media: None,
        cutout: Cutout::default(),
        first_light: LightId::NONE,
        object: ObjectId::NONE,
    });
    World::new(WorldParts {
        geometries: geometries.collect(),
        ..WorldParts::default()
    })
}

fn bezier([a, b, c, d]: [DVec3; 4], u: f64) -> (DVec3, DVec3) {
    let v = 1.0 - u;
    let p = a * (v * v * v) + b * (3.0 * u * v * v) + c * (3.0 * u * u * v) + d * (u * u * u);
    let dp = (b - a) * (3.0 * v * v) + (c - b) * (6.0 * u * v) + (d - c) * (3.0 * u * u);
    (p, dp)
}

/// The normal of a ribbon, along the great circle.
fn ribbon_normal(source: &CurveSource, segment: usize, u: f64) -> DVec3 {
    let [n0, n1] = [segment, segment + 1].map(|k| source.normals[k].normalize());
    let turn = n0.angle_between(n1);
    (n0 * ((1.0 - u) * turn).sin() + n1 * (u * turn).sin()) / turn.sin()
}

fn some_rays(source: &CurveSource, n: usize, seed: u64) -> Vec<Ray> {
    let mut random = Uniform::new(seed);
    (0..n)
        .map(|k| {
            let segment = source.segments[k % source.segments.len()];
            let aside = direction(&mut random) * (0.6 * source.widths[0]);
            let target = bezier(segment, f64::from(random.unit())).0 + aside;
            let o = target + direction(&mut random) * [0.9, 3.0, 20.0][k % 3];
            ray(o, target - o)
        })
        .collect()
}

/// What the definition says: (distance, segment, u, v) of the nearest crossing; `None` also in doubtful cases as
/// `Err`.
fn expected(source: &CurveSource, ray: &Ray) -> Result<Option<(f64, [f64; 2])>, ()> {
    const N: usize = 4000;
    let (o, d) = (ray.o.to_f64(), ray.d.to_f64().normalize());
    let mut best: Option<(f64, [f64; 2])> = None;
    for (k, &segment) in source.segments.iter().enumerate() {
        let share = |u: f64| (k as f64 + u) / source.segments.len() as f64;
        // Where the tangent is across the ray: a change of sign of its product with the way to the ray.
        let away = |u: f64| {
            let (p, dp) = bezier(segment, u);
            let p = p - o;
            (p - d * p.dot(d), dp - d * dp.dot(d), p.dot(d))
        };
        let slope = |u: f64| {
            let (p, dp, _) = away(u);
            p.dot(dp)
        };
        for i in 0..N {
            let [mut lo, mut hi] = [i, i + 1].map(|i| i as f64 / N as f64);
            if !(slope(lo) < 0.0 && slope(hi) >= 0.0) {
                continue;
            }
            for _ in 0..30 {
                let middle = 0.5 * (lo + hi);
                if slope(middle) < 0.0 {
                    lo = middle;
                } else {
                    hi = middle;
                }
            }
            let u = 0.5 * (lo + hi);
            let (p, dp, t) = away(u);
            let [w0, w1] = source.widths;
            let mut width = w0 + (w1 - w0) * share(u);
            if source.style == CurveStyle::Ribbon {
                width *= ribbon_normal(source, k, u).dot(d).abs();
            }
            let ratio = p.length() / (0.5 * width);
            let is_end = !(0.003..=0.997).contains(&u);
            // At the rim, at a joint, or where the curve runs along the ray.
            if ratio < 1.15 && (ratio > 0.85 || is_end || dp.length() < 1.0) || t.abs() < 0.05 {
                return Err(());
            }
            if ratio < 1.0 && t > 0.0 && best.is_none_or(|(found, _)| t < found) {
                // v grows toward d × tangent; the way from the ray to the centre looks back.
                let side = -p.dot(d.cross(dp));
                best = Some((t, [u, 0.5 + (0.5 * ratio).copysign(side)]));
            }
        }
    }
    Ok(best)
}

#[test]
fn rays_meet_curves_where_the_definition_says() {
    for style in STYLES {
        let source = source(style, 0.12);
        let shape = whole(&source);
        let (mut n_hits, mut n_misses) = (0, 0);
        for ray in some_rays(&source, 3000, 1) {
            let Ok(expected) = expected(&source, &ray) else {
                continue;
            };
            let found = nearest(&shape, &ray);
            let Some((t, uv)) = expected else {
                assert!(found.is_none(), "{style:?}: {found:?} for {ray:?}");
                n_misses += 1;
                continue;
            };
            let (element, at) = found.unwrap_or_else(|| panic!("{style:?}: {uv:?} for {ray:?}"));
            let surface = shape.surface(element, &ray, &at);
            assert!(
                (f64::from(at.t) - t).abs() < 2e-3,
                "{style:?}: {at:?} is not {t}"
            );
            for (found, expected) in surface.uv.iter().zip(uv) {
                let off = (f64::from(*found) - expected).abs();
                assert!(off < 0.03, "{style:?}: {:?} is not {uv:?}", surface.uv);
            }
            n_hits += 1;
        }
        assert!(
            n_hits > 500 && n_misses > 300,
            "{n_hits} hits, {n_misses} misses"
        );
    }
}

#[test]
fn normals_and_derivatives_are_those_of_the_style() {
    for style in STYLES {
        let source = source(style, 0.12);
        let shape = whole(&source);
        let mut n = 0;
        for ray in some_rays(&source, 1500, 2) {
            let Some((element, at)) = nearest(&shape, &ray) else {
                continue;
            };
            n += 1;
            let surface = shape.surface(element, &ray, &at);
            let [u, v] = surface.uv.map(f64::from);
            let (ng, d) = (surface.ng.to_f64(), ray.d.to_f64());
            let (dpdu, dpdv) = (surface.dpdu.to_f64(), surface.dpdv.to_f64());
            // The segment is the one whose tangent this is.
            let (segment, tangent) = source
                .segments
                .iter()
                .map(|s| bezier(*s, u).1)
                .enumerate()
                .min_by(|a, b| (a.1 - dpdu).length().total_cmp(&(b.1 - dpdu).length()))
                .expect("two segments");
            assert!((tangent - dpdu).length() < 1e-4 * dpdu.length());
            assert!(dpdu.cross(dpdv).normalize().dot(ng) > 0.9999);
            let mut width = source.widths[0]
                + (source.widths[1] - source.widths[0]) * 0.5 * (segment as f64 + u);
            let across = d.cross(tangent).normalize();
            match style {
                CurveStyle::Flat => {
                    assert!(dpdv.normalize().dot(across) > 0.9999, "across the ray");
                    assert!(ng.dot(d) > 0.0, "along the ray");
                }
                CurveStyle::Cylinder => {
                    let tilt = (v - 0.5) * std::f64::consts::PI;
                    assert!((dpdv.normalize().dot(across) - tilt.cos()).abs() < 1e-4);
                    assert!((ng.dot(across) - tilt.sin()).abs() < 1e-4, "turned outward");
                }
                CurveStyle::Ribbon => {
                    let n = ribbon_normal(&source, segment, u);
                    assert!(
                        dpdv.dot(n).abs() < 1e-3 * dpdv.length(),
                        "across its normal"
                    );
                    width *= n.dot(d).abs();
                }
            }
            assert_close(dpdv.length(), width, 1e-3);
        }
        assert!(n > 200);
    }
}

#[test]
fn splines_are_cut_into_segments() {
    let points: Vec<DVec3> = (0..7)
        .map(|k| DVec3::new(k.into(), f64::from(k * k % 5), f64::from(k % 3)))
        .collect();
    // The basis functions of uniform knots, by the recursion of Cox and de Boor.
    fn basis(i: i32, degree: i32, t: f64) -> f64 {
        if degree == 0 {
            return f64::from(u8::from((f64::from(i)..f64::from(i + 1)).contains(&t)));
        }
        let (i0, n) = (f64::from(i), f64::from(degree));
        (t - i0) / n * basis(i, degree - 1, t)
            + (i0 + n + 1.0 - t) / n * basis(i + 1, degree - 1, t)
    }
    for degree in [2, 3] {
        let segments = spline::b_spline(&points, degree).expect("enough points");
        assert_eq!(segments.len(), points.len() - degree);
        for (k, segment) in segments.iter().enumerate() {
            for u in [0.0, 0.3, 0.7] {
                let t = (k + degree) as f64 + u;
                let expected: DVec3 = (0..points.len())
                    .map(|i| points[i] * basis(i as i32, degree as i32, t))
                    .sum();
                assert!(
                    (bezier(*segment, u).0 - expected).length() < 1e-12,
                    "{degree} {k} {u}"
                );
            }
        }
        assert_eq!(spline::b_spline(&points[..degree], degree), None);

        let segments = spline::bezier(&points, degree).expect("whole segments");
        assert_eq!(segments.len(), 6 / degree);
        for (k, segment) in segments.iter().enumerate() {
            assert_eq!(
                [segment[0], segment[3]],
                [points[degree * k], points[degree * (k + 1)]]
            );
            if degree == 2 {
                let [a, b, c] = [0, 1, 2].map(|i| points[2 * k + i]);
                let middle = (a + b * 2.0 + c) * 0.25;
                assert!((bezier(*segment, 0.5).0 - middle).length() < 1e-12);
            }
        }
        assert_eq!(spline::bezier(&points[..degree], degree), None);
        assert_eq!(
            spline::bezier(&points[..degree + 2], degree).is_none(),
            degree > 1
        );
    }
}

fn maps() -> [(&'static str, DAffine3); 4] {
    let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.9);
    let at = DVec3::new(3.0, -2.0, 7.0);
    let scaled = |s: DVec3| DAffine3::from_mat3_translation(turn * DMat3::from_diagonal(s), at);
    [
        ("as defined", DAffine3::IDENTITY),
        ("turned", scaled(DVec3::splat(1.5))),
        ("stretched", scaled(DVec3::new(0.5, 2.0, 1.0))),
        ("mirrored", scaled(DVec3::new(1.0, 1.0, -1.0))),
    ]
}

#[test]
fn a_transform_moves_what_is_seen_in_object_space() {
    for style in STYLES {
        let source = source(style, 0.12);
        let shape = whole(&source);
        for (name, map) in maps() {
            let moved = placed(&source, map);
            let (mut n, mut n_differing) = (0, 0);
            for first in some_rays(&source, 1500, 3) {
                let o = map.transform_point3(first.o.to_f64());
                let d = map.transform_vector3(first.d.to_f64());
                let (a, b) = (nearest(&shape, &first), nearest(&moved, &ray(o, d)));
                let (Some((k, a)), Some((l, b))) = (a, b) else {
                    // Rounding decides at the rim.
                    n_differing += usize::from(a.is_some() != b.is_some());
                    continue;
                };
                n += 1;
                assert_close(f64::from(b.t), f64::from(a.t) * d.length(), 1e-3);
                let second = ray(o, d);
                let [p, q] = [shape.surface(k, &first, &a), moved.surface(l, &second, &b)];
                if (p.uv[0] - q.uv[0]).abs() > 1e-3 || (p.uv[1] - q.uv[1]).abs() > 0.02 {
                    n_differing += 1;
                    continue;
                }
                let transform = Transform::from_affine(map).expect("an invertible map");
                let expected = transform.normal(p.ng.to_f64()).normalize();
                assert!(q.ng.to_f64().dot(expected) > 0.99, "{style:?}, {name}");
                let err = (map.matrix3.x_axis.abs()
                    + map.matrix3.y_axis.abs()
                    + map.matrix3.z_axis.abs())
                    * f64::from(p.p_err.x());
                assert!(
                    (q.p_err.to_f64() / err - 1.0).abs().max_element() < 0.1,
                    "{name}"
                );
            }
            assert!(
                n > 300 && n_differing < 20,
                "{style:?}, {name}: {n} and {n_differing}"
            );
        }
    }
}

#[test]
fn boxes_hold_every_hit_and_the_hierarchy_finds_it() {
    for style in STYLES {
        for (name, map) in maps() {
            let source = source(style, 0.12);
            let shape = placed(&source, map);
            let world = world_of(vec![shape.clone()]);
            let mut n = 0;
            for first in some_rays(&source, 1000, 4) {
                let o = map.transform_point3(first.o.to_f64());
                let ray = ray(o, map.transform_vector3(first.d.to_f64()));
                let found = world.closest(&ray, f32::INFINITY).map(|hit| hit.at.t);
                let Some((element, at)) = nearest(&shape, &ray) else {
                    assert_eq!(found, None);
                    continue;
                };
                n += 1;
                assert_eq!(found, Some(at.t), "{style:?}, {name}");
                let (bounds, p) = (shape.bounds(element), ray.at(at.t));
                let inside = p.0.cmpge(bounds.min.0).all() && p.0.cmple(bounds.max.0).all();
                assert!(inside, "{style:?}, {name}: {p:?} is not in {bounds:?}");
            }
            assert!(n > 200, "{style:?}, {name}: {n}");
        }
    }
}

#[test]
fn pieces_cover_the_segments_once() {
    // A strand across the axes is cut; the area of its pieces is that of the whole.
    let strand = |split_depth: u32| CurveSource {
        split_depth,
        segments: vec![[0.0, 1.0, 2.0, 3.0].map(|t| DVec3::splat(t / 3.0))],
        ..source(CurveStyle::Flat, 0.01)
    };
    for (split_depth, n) in [(0, 1), (1, 2), (3, 8), (10, 8)] {
        let shape = whole(&strand(split_depth));
        assert_eq!(shape.n_elements(), n);
        let area: f64 = (0..n as u32).map(|k| shape.area(k)).sum();
        assert_close(area, 0.007 * 3f64.sqrt(), 1e-6);
    }
    // One along an axis fills its box as it is.
    let straight = CurveSource {
        segments: vec![[0.0, 1.0, 2.0, 3.0].map(|t| DVec3::X * t)],
        ..strand(3)
    };
    assert_eq!(whole(&straight).n_elements(), 1);
}

#[test]
fn samples_of_a_curve_are_hits_of_the_density_they_say() {
    for style in STYLES {
        for (name, map) in maps() {
            let shape = placed(&source(style, 0.12), map);
            let from = map.transform_point3(DVec3::new(0.3, -0.2, 1.6));
            let mut random = Uniform::new(9);
            let mut n = 0;
            for k in 0..2000 {
                let element = k % shape.n_elements() as u32;
                let toward = Point3::from_f64(from);
                let Some(sample) = shape.sample_toward(element, toward, random.unit2()) else {
                    continue;
                };
                n += 1;
                let pdf_w = shape.pdf_toward(element, toward, sample.p, sample.ng);
                assert_close(pdf_w.into(), sample.pdf_w.into(), 1e-3);
                let ray = ray(from, sample.p.to_f64() - from);
                let shear = RayShear::new(&ray);
                if let Some(at) = shape.intersect(element, &ray, &shear, f32::INFINITY) {
                    let surface = shape.surface(element, &ray, &at);
                    let off = (surface.p - sample.p).length() / at.t;
                    assert!(off < 1e-4, "{style:?}, {name}: {off}");
                }
            }
            assert!(n > 200, "{style:?}, {name}: {n} of 2000");
        }
    }
}

#[test]
fn light_of_curves_by_samples_is_light_of_curves_by_rays() {
    for style in STYLES {
        for (name, map) in maps() {
            let shape = placed(&source(style, 0.12), map);
            let mut random = Uniform::new(5);
            for place in [[0.3, 0.2, 2.5], [2.0, 1.0, 0.2], [0.1, -0.4, -0.9]] {
                let from = map.transform_point3(DVec3::from(place));
                let [mut samples, mut rays] = [0.0; 2];
                let mut variance = 0.0;
                for element in 0..shape.n_elements() as u32 {
                    let by_samples = Mean::of(5000, || {
                        let sample =
                            shape.sample_toward(element, Point3::from_f64(from), random.unit2());
                        sample.map_or(0.0, |sample| 1.0 / f64::from(sample.pdf_w))
                    });
                    // Rays into a cone around the piece, which is seen whole in it.
                    let bounds = shape.bounds(element);
                    let axis = (bounds.center().to_f64() - from).normalize();
                    let radius = 0.5 * f64::from(bounds.extent().length());
                    let distance = bounds.center().to_f64().distance(from);
                    let cos = if distance > radius {
                        (1.0 - (radius / distance).powi(2)).sqrt()
                    } else {
                        -1.0
                    };
                    let share = std::f64::consts::TAU * (1.0 - cos);
                    let by_rays = Mean::of(5000, || {
                        let z = cos + (1.0 - cos) * f64::from(random.unit());
                        let (sin, phi) = ((1.0 - z * z).sqrt(), f64::from(random.unit()));
                        let (x, y) = axis.any_orthonormal_pair();
                        let at = DVec2::from_angle(std::f64::consts::TAU * phi) * sin;
                        let ray = ray(from, x * at.x + y * at.y + axis * z);
                        let shear = RayShear::new(&ray);
                        let hit = shape.intersect(element, &ray, &shear, f32::INFINITY);
                        share * f64::from(u8::from(hit.is_some()))
                    });
                    samples += by_samples.value;
                    rays += by_rays.value;
                    variance += by_samples.standard_error.powi(2) + by_rays.standard_error.powi(2);
                }
                assert!(rays > 1e-3, "{style:?}, {name}: in sight of {place:?}");
                assert!(
                    (samples - rays).abs() < 4.5 * variance.sqrt() + 1e-4 * rays,
                    "{style:?}, {name}, {place:?}: {samples} by samples, {rays} by rays, +- {}",
                    variance.sqrt()
                );
            }
        }
    }
}

#[test]
fn g28_what_has_no_width_or_length_is_no_surface() {
    let at_a_point = CurveSource {
        segments: vec![[DVec3::ONE; 4]],
        ..source(CurveStyle::Flat, 0.1)
    };
    let of_no_width = source(CurveStyle::Cylinder, 0.0);
    for source in [at_a_point, of_no_width] {
        let shape = whole(&source);
        for element in 0..shape.n_elements() as u32 {
            assert!(shape.bounds(element).is_empty());
            for first in some_rays(&source, 200, 6) {
                let shear = RayShear::new(&first);
                assert_eq!(
                    shape.intersect(element, &first, &shear, f32::INFINITY),
                    None
                );
            }
        }
    }
}

#[test]
fn g28_a_long_thin_curve_does_not_shadow_itself() {
    for style in STYLES {
        for far in [0.0, 1e4] {
            // A thousand times as long as wide; coordinates as large as they get in render space.
            let at = DVec3::splat(far / 1e4);
            let mut thin = source(style, 2e-3);
            thin.widths = [2e-3; 2];
            let shape = placed(&thin, DAffine3::from_translation(at));
            let mut random = Uniform::new(7);
            let (mut n, mut n_again) = (0, 0);
            for first in some_rays(&thin, 20_000, 8) {
                let first = ray(first.o.to_f64() + at, first.d.to_f64());
                let Some((element, hit)) = nearest(&shape, &first) else {
                    continue;
                };
                n += 1;
                let surface = shape.surface(element, &first, &hit);
                let leaving = ray(DVec3::ZERO, direction(&mut random));
                let o = offset_origin(surface.p, surface.p_err, surface.ng, leaving.d);
                let again = nearest(&shape, &Ray { o, ..leaving });
                n_again += usize::from(again.is_some_and(|(_, hit)| hit.t < 0.05));
            }
            assert!(n > 3000, "{style:?}: {n}");
            let share = n_again as f64 / n as f64;
            assert!(share < 5e-3, "{style:?} at {far}: {share}");
        }
    }
}
