//! Choice by weight: what is drawn is what the probability says, for any weights and any random number.

use tyndall::sampling::alias::{AliasTable, DiscreteSample};
use tyndall_test_support::chi2::{Chi2, Line};
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
        let alias = AliasTable::new(&weights).unwrap();
        for u in random_numbers(&weights) {
            let choice = alias.sample(u);
            assert_sound_choice(&weights, choice, alias.pmf(choice.index));
        }
    }
}

#[test]
fn probabilities_are_the_weights_over_their_sum() {
    for weights in weight_sets() {
        let total: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        let alias = AliasTable::new(&weights).unwrap();
        let sum: f64 = (0..weights.len()).map(|i| f64::from(alias.pmf(i))).sum();
        assert_close(sum, 1.0, 1e-6);
        for (i, &weight) in weights.iter().enumerate() {
            let expected = f64::from(weight) / total;
            if expected > 1e-9 || expected == 0.0 {
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
        assert!(AliasTable::new(weights).is_none());
    }
}

#[test]
fn impossible_weights_count_as_zero() {
    let table = AliasTable::new(&[f64::NAN, 1.0, -5.0, f64::INFINITY, 3.0]).unwrap();
    let pmfs: Vec<f32> = (0..5).map(|i| table.pmf(i)).collect();
    assert_eq!(pmfs, [0.0, 0.25, 0.0, 0.0, 0.75]);
    let huge = AliasTable::new(&[f64::MAX, f64::MAX]).unwrap();
    assert_eq!(huge.pmf(0), 0.5);
}

#[test]
fn the_rest_of_the_random_number_is_uniform() {
    let alias = AliasTable::new(&[1.0f32, 0.0, 4.0, 2.5]).unwrap();
    let rest = |random: &mut Uniform| Some(alias.sample(random.unit()).u);
    Chi2::default()
        .check(Line, rest, |_| 1.0)
        .assert_accepted("alias table");
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
