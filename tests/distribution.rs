//! Choice by weight: what is drawn is what the density says, for any weights and any random number.

use glam::Vec2;
use tyndall::sampling::distribution::{AliasTable, DiscreteSample, Distribution1D, Distribution2D};
use tyndall_test_support::chi2::{Chi2, Line, Square};
use tyndall_test_support::{Uniform, assert_close};

const ALMOST_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// The ends of the unit interval, numbers around them, and numbers outside.
const AWKWARD: [f32; 11] = [
    0.0,
    -0.0,
    f32::MIN_POSITIVE,
    2.328_306_4e-10,
    0.5,
    ALMOST_ONE,
    1.0,
    7.0,
    -3.0,
    f32::INFINITY,
    f32::NAN,
];

fn weight_sets() -> Vec<Vec<f32>> {
    let mut random = Uniform::new(11);
    let noise = (0..1000)
        .map(|_| {
            if random.unit() < 0.3 {
                0.0
            } else {
                random.unit()
            }
        })
        .collect();
    vec![
        vec![1.0],
        vec![0.0, 2.0],
        vec![2.0, 0.0],
        vec![1.0, 0.0, 0.0, 3.0],
        vec![0.0, 0.0, 5.0, 0.0],
        vec![1e-38, 1e38],
        vec![1e38, 1e-38],
        vec![1e-38; 7],
        vec![f32::MAX; 5],
        vec![1e-45, 0.0, 1e-45],
        vec![1.0, 2.0, 3.0],
        vec![1e-7, 1.0, 1e-7, 1e7, 1e-7],
        noise,
    ]
}

/// Random numbers that reach every entry's borders, beside the awkward ones.
fn random_numbers(weights: &[f32]) -> Vec<f64> {
    let total: f64 = weights.iter().map(|&w| f64::from(w)).sum();
    let sums = weights.iter().scan(0.0, |sum, &w| {
        *sum += f64::from(w) / total;
        Some(*sum)
    });
    let borders: Vec<f64> = sums
        .flat_map(|sum| [sum.next_down(), sum, sum.next_up()])
        .collect();
    let mut random = Uniform::new(3);
    let awkward = AWKWARD
        .map(f64::from)
        .into_iter()
        .chain([1.0f64.next_down()]);
    awkward
        .chain(borders)
        .chain((0..1000).map(|_| f64::from(random.unit())))
        .collect()
}

fn assert_sound_choice(weights: &[f32], choice: DiscreteSample, pmf: f32) {
    assert!(weights[choice.index] > 0.0, "{choice:?} has no weight");
    assert!(
        choice.pmf > 0.0 && choice.pmf <= 1.0 && choice.pmf == pmf,
        "{choice:?}"
    );
    assert!((0.0..1.0).contains(&choice.u), "{choice:?}");
}

#[test]
fn weightless_entries_are_never_chosen() {
    for weights in weight_sets() {
        let table = Distribution1D::new(&weights).unwrap();
        let alias = AliasTable::new(&weights).unwrap();
        for u in random_numbers(&weights) {
            let choice = table.sample_discrete(u);
            assert_sound_choice(&weights, choice, table.pmf(choice.index));
            let choice = alias.sample(u);
            assert_sound_choice(&weights, choice, alias.pmf(choice.index));
            let point = table.sample_continuous(u);
            assert!(
                weights[point.index] > 0.0 && (0.0..1.0).contains(&point.x),
                "{point:?}"
            );
            assert!(
                point.pdf > 0.0 && point.pdf == table.pdf(point.x),
                "{point:?} {}",
                table.pdf(point.x)
            );
        }
    }
}

#[test]
fn probabilities_are_the_weights_over_their_sum() {
    for weights in weight_sets() {
        let total: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        let table = Distribution1D::new(&weights).unwrap();
        let alias = AliasTable::new(&weights).unwrap();
        assert_eq!(table.n_cells(), weights.len());
        assert_close(table.mean_weight(), total / weights.len() as f64, 1e-12);
        let sum =
            |pmf: &dyn Fn(usize) -> f32| (0..weights.len()).map(|i| f64::from(pmf(i))).sum::<f64>();
        assert_close(sum(&|i| table.pmf(i)), 1.0, 1e-6);
        assert_close(sum(&|i| alias.pmf(i)), 1.0, 1e-6);
        for (i, &weight) in weights.iter().enumerate() {
            let expected = f64::from(weight) / total;
            if expected > 1e-9 || expected == 0.0 {
                assert_close(table.pmf(i).into(), expected, 1e-6);
                assert_close(alias.pmf(i).into(), expected, 1e-6);
            }
        }
    }
}

#[test]
fn without_weight_there_is_no_sample() {
    for weights in [
        &[][..],
        &[0.0],
        &[0.0; 5],
        &[-1.0, f32::NAN, f32::INFINITY, -0.0],
    ] {
        assert!(Distribution1D::new(weights).is_none() && AliasTable::new(weights).is_none());
        assert!(Distribution2D::new(weights, 1).is_none());
    }
    assert!(Distribution2D::new(&[1.0f32; 6], 0).is_none());
    assert!(
        Distribution2D::new(&[1.0f32; 6], 4).is_none(),
        "six weights are not rows of four"
    );
}

#[test]
fn impossible_weights_count_as_zero() {
    let table = Distribution1D::new(&[f64::NAN, 1.0, -5.0, f64::INFINITY, 3.0]).unwrap();
    let pmfs: Vec<f32> = (0..5).map(|i| table.pmf(i)).collect();
    assert_eq!(pmfs, [0.0, 0.25, 0.0, 0.0, 0.75]);
    let huge = Distribution1D::new(&[f64::MAX, f64::MAX]).unwrap();
    assert_eq!(huge.pmf(0), 0.5);
}

#[test]
fn the_rest_of_the_random_number_is_uniform() {
    let weights = [1.0f32, 0.0, 4.0, 2.5];
    let table = Distribution1D::new(&weights).unwrap();
    let alias = AliasTable::new(&weights).unwrap();
    let family = Chi2 {
        n_tests: 2,
        ..Chi2::default()
    };
    let rest = |random: &mut Uniform| Some(table.sample_discrete(random.unit()).u);
    family
        .check(Line, rest, |_| 1.0)
        .assert_accepted("prefix sums");
    let rest = |random: &mut Uniform| Some(alias.sample(random.unit()).u);
    family
        .check(Line, rest, |_| 1.0)
        .assert_accepted("alias table");
}

#[test]
fn lines_are_drawn_as_their_density_says() {
    let sets = [
        vec![1.0f32, 0.0, 3.0, 0.5],
        (0..64).map(|i| ((i * 37) % 64) as f32).collect(),
    ];
    let family = Chi2 {
        n_tests: sets.len(),
        ..Chi2::default()
    };
    for weights in sets {
        let table = Distribution1D::new(&weights).unwrap();
        let draw = |random: &mut Uniform| Some(table.sample_continuous(random.unit()).x);
        family
            .check(Line, draw, |x| table.pdf(x).into())
            .assert_accepted("line");
    }
}

#[test]
fn squares_are_drawn_as_their_density_says() {
    let smooth = |x: f32, y: f32| (1.5 + (9.0 * x).sin()) * (1.2 + (7.0 * y).cos());
    let weights: Vec<f32> = (0..64 * 64)
        .map(|i| smooth((i % 64) as f32 / 64.0, (i / 64) as f32 / 64.0))
        .collect();
    let mut sun = weights.clone();
    sun[20 * 64 + 11] = 5000.0;
    sun[64..128].fill(0.0);
    let family = Chi2 {
        n_tests: 2,
        ..Chi2::default()
    };
    for weights in [weights, sun] {
        let table = Distribution2D::new(&weights, 64).unwrap();
        let draw = |random: &mut Uniform| Some(table.sample(Vec2::from(random.unit2())).uv.into());
        family
            .check(Square, draw, |p| table.pdf(p.into()).into())
            .assert_accepted("square");
    }
}

#[test]
fn the_alias_table_chooses_at_the_stated_rates() {
    let weights: Vec<f32> = (0..256)
        .map(|i| {
            if i % 5 == 0 {
                0.0
            } else {
                (i % 17) as f32 + 0.1
            }
        })
        .collect();
    let alias = AliasTable::new(&weights).unwrap();
    // An entry shown as a cell of the line; the rest of the random number is the place in it.
    let draw = |random: &mut Uniform| {
        let choice = alias.sample(random.unit());
        Some(((choice.index as f32 + choice.u) / 256.0).min(ALMOST_ONE))
    };
    let pdf = |x: f32| f64::from(alias.pmf((x * 256.0) as usize)) * 256.0;
    Chi2::default()
        .check(Line, draw, pdf)
        .assert_accepted("alias table");
}

#[test]
fn points_lie_in_their_cell_and_carry_its_density() {
    for (width, height) in [(1, 1), (3, 7), (100, 33), (8192, 2), (1000, 999)] {
        let mut random = Uniform::new(5);
        let weights: Vec<f32> = (0..width * height)
            .map(|_| {
                if random.unit() < 0.5 {
                    0.0
                } else {
                    random.unit()
                }
            })
            .collect();
        let Some(table) = Distribution2D::new(&weights, width) else {
            assert!(weights.iter().all(|&w| w == 0.0));
            continue;
        };
        let awkward = AWKWARD
            .into_iter()
            .flat_map(|x| AWKWARD.map(|y| Vec2::new(x, y)));
        for u in awkward.chain((0..2000).map(|_| Vec2::from(random.unit2()))) {
            let sample = table.sample(u);
            assert!(
                weights[sample.row * width + sample.column] > 0.0,
                "{sample:?}"
            );
            assert!(
                sample.uv.cmpge(Vec2::ZERO).all() && sample.uv.cmplt(Vec2::ONE).all(),
                "{sample:?}"
            );
            assert!(
                sample.pdf > 0.0 && sample.pdf == table.pdf(sample.uv),
                "{sample:?} {}",
                table.pdf(sample.uv)
            );
        }
    }
}

#[test]
fn large_tables_keep_every_texel_and_integrate_to_one() {
    let (width, height) = (4096, 2048);
    // One texel in a constant map holds a 10⁻⁷th part of the light.
    let table = Distribution2D::new(&vec![1.0f32; width * height], width).unwrap();
    let center = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
    let mut sum = 0.0;
    for y in 0..height {
        for x in 0..width {
            sum += f64::from(table.pdf(Vec2::new(center(x, width), center(y, height))));
        }
    }
    assert_close(sum / (width * height) as f64, 1.0, 1e-6);
    assert_close(table.mean_weight(), 1.0, 1e-12);
    let corners = [Vec2::ZERO, Vec2::splat(ALMOST_ONE)].map(|u| table.sample(u));
    assert_eq!((corners[0].column, corners[0].row), (0, 0));
    assert_eq!((corners[1].column, corners[1].row), (width - 1, height - 1));
}

#[test]
fn thread_counts_do_not_change_a_density() {
    let mut random = Uniform::new(9);
    let weights: Vec<f32> = (0..300 * 200).map(|_| random.unit()).collect();
    let build = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .unwrap();
        pool.install(|| Distribution2D::new(&weights, 300).unwrap())
    };
    let (one, four) = (build(1), build(4));
    for _ in 0..1000 {
        let u = Vec2::from(random.unit2());
        assert_eq!(one.sample(u), four.sample(u));
    }
}
