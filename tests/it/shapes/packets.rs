//! Hierarchies of triangles and slots: one order of building, one rule for ties.

use tyndall::accel::{Bvh, Item, Key};
use tyndall::math::{Bounds3, Point3, Ray, Vec3};
use tyndall_test_support::Uniform;

use super::copies::{direction, ray};

fn box_around(points: &[[f32; 3]]) -> Bounds3 {
    let points = points.iter().map(|&p| Point3::from(p));
    points.fold(Bounds3::EMPTY, Bounds3::with_point)
}

/// Everything of a hierarchy of slots that a ray visits, in order.
fn visited(bvh: &Bvh, ray: &Ray) -> Vec<Key> {
    let mut keys = Vec::new();
    let nothing: Option<(f32, ())> = bvh.closest(
        ray,
        f32::INFINITY,
        |_, _| None,
        |key, _, _| {
            keys.push(key);
            None
        },
    );
    assert!(nothing.is_none());
    keys
}

#[test]
fn the_hierarchy_does_not_depend_on_the_number_of_threads() {
    let mut random = Uniform::new(51);
    let item = |i: u32| {
        let mut point = || direction(&mut random).as_vec3().to_array();
        let a = point();
        let b = [0, 1, 2].map(|k| a[k] + 0.05 * point()[k]);
        Item::slot(&box_around(&[a, b]), [0, i])
    };
    let items: Vec<Item> = (0..60_000).map(item).collect();
    let [one, three] = [1, 3].map(|n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
        let pool = pool.expect("threads");
        pool.install(|| Bvh::build(items.clone(), |_| unreachable!("there are no triangles")))
    });
    let mut n_visited = 0;
    for _ in 0..300 {
        let o = direction(&mut random) * 3.0;
        let ray = ray(o, direction(&mut random) * 0.8 - o);
        let keys = visited(&one, &ray);
        n_visited += keys.len();
        assert_eq!(keys, visited(&three, &ray), "{ray:?}");
    }
    assert!(n_visited > 300, "{n_visited}");
}

#[test]
fn of_triangles_and_slots_at_one_distance_the_smallest_key_is_seen() {
    let triangle = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]];
    let bounds = box_around(&triangle);
    let down = Ray {
        o: Point3::new(0.0, 0.0, 2.0),
        d: Vec3::new(0.0, 0.0, -1.0),
        time: 0.0,
    };
    for first_slot in 0..30 {
        let item = |i: u32| {
            // Every third is a slot, in whatever order the builder leaves them.
            if i % 3 == first_slot % 3 && i >= first_slot {
                Item::slot(&bounds, [1, i])
            } else {
                Item::triangle(&bounds, [1 + i % 2, i])
            }
        };
        let bvh = Bvh::build((0..30).rev().map(item).collect(), |_| triangle);
        let seen = bvh.closest(
            &down,
            f32::INFINITY,
            |key, _| Some(key),
            |key, limit, _| (2.0 < limit).then_some((2.0, key)),
        );
        assert_eq!(seen, Some((2.0, [1, 0])), "{first_slot}");
        // Nothing lies before the end of the ray.
        assert!(!bvh.any(&down, 2.0, |_, _| true, |_, _| false));
    }
}
