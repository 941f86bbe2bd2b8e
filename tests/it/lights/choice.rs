//! Choosing one of many lights.

use std::fmt::Write as _;

use tyndall::ids::LightId;
use tyndall::light::Light;
use tyndall::sampling::warp::uniform_sphere;
use tyndall::world::{Receiver, World};
use tyndall_test_support::Uniform;
use tyndall_test_support::z_test::Mean;

use crate::lights::setup::{picture, receiver, world_of};

const STRATEGIES: [&str; 3] = ["uniform", "power", "spatial"];

/// `n` small emitters of very different power.
fn emitters(n: usize) -> String {
    let mut random = Uniform::new(17);
    let mut text = String::new();
    for k in 0..n {
        let [x, y] = random.unit2().map(|u| 1.2 * u - 0.6);
        let [z, power] = random.unit2();
        let l = 10f32.powf(2.0 * power);
        let d = uniform_sphere(random.unit2());
        let sides = if k % 5 == 0 { "true" } else { "false" };
        let shape = match k % 4 {
            0 => "Shape \"sphere\" \"float radius\" .01",
            1 => "Shape \"disk\" \"float radius\" .012",
            _ => {
                "Shape \"trianglemesh\" \"point P\" [-.01 0 0  .01 0 0  0 .02 0] \"integer indices\" [0 1 2]"
            }
        };
        writeln!(
            text,
            "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [{l} {l} {l}] \"bool twosided\" \"{sides}\"\n\
             Translate {x} {y} {} Rotate {} {} {} {} {shape} AttributeEnd",
            0.1 + 0.8 * z,
            360.0 * power,
            d.x(),
            d.y(),
            d.z()
        )
        .expect("a string");
    }
    text
}

/// Lights of every kind that is not a surface.
const OTHERS: &str = "LightSource \"distant\" \"rgb L\" [.2 .2 .2] \"point from\" [.2 .3 1] \"point to\" [0 0 0]\n\
         LightSource \"infinite\" \"rgb L\" [.1 .1 .1]\n\
         AttributeBegin Rotate 20 1 1 0 LightSource \"infinite\" \"rgb L\" [.1 .1 .1] \"string mapname\" \"a.pfm\" AttributeEnd\n\
         LightSource \"point\" \"point from\" [.1 .2 .3] \"rgb I\" [.01 .01 .01]\n\
         LightSource \"spot\" \"point from\" [.1 .2 .6] \"point to\" [0 0 0] \"rgb I\" [.2 .2 .2]\n\
         AttributeBegin Translate -.3 0 .5 Rotate 190 1 0 0 LightSource \"projection\" \"string mapname\" \"a.pfm\" \"rgb I\" [.1 .1 .1] AttributeEnd\n\
         AttributeBegin Translate -.3 .3 .5 Scale 1 2 1 LightSource \"projection\" \"rgb I\" [.1 .1 .1] AttributeEnd\n\
         AttributeBegin Translate .3 -.3 .5 LightSource \"goniometric\" \"string mapname\" \"a.pfm\" \"rgb I\" [.1 .1 .1] AttributeEnd\n";

/// Where copies of some lamps are: turned, mirrored, small, large, squeezed, sheared and far away.
const PLACES: [&str; 9] = [
    "Translate .3 .2 .1 Scale .3 .3 .3",
    "Translate -.4 .3 .2 Rotate 70 1 2 3 Scale .3 .3 .3",
    "Translate .2 -.4 .2 Rotate 200 3 -1 2 Scale .2 .2 -.2",
    "Translate -.3 -.3 .3 Scale -.5 .5 .5 Rotate 40 0 1 1",
    "Translate .5 .5 .1 Scale .01 .01 .01",
    "Translate 0 .1 .4 Rotate 30 1 1 0 Scale .1 .4 .2",
    "Translate .1 -.1 .3 Scale -.4 .1 .1",
    "Translate -.1 -.2 .6 ConcatTransform [.2 0 0 0  .1 .2 0 0  0 0 .2 0  0 0 0 1]",
    "Translate 30 -20 40 Scale 9 9 9",
];

/// Some of the places: those of copies that are similar to each other.
fn similar() -> Vec<&'static str> {
    let (similar, others) = PLACES.split_at(5);
    [similar, &others[3..]].concat()
}

/// The same lamps at each of some places, as copies of an object or each by itself.
fn copies(n: usize, places: &[&str], are_instances: bool) -> String {
    let lamps = emitters(n);
    let at = |what: &str| -> String {
        let place = |place: &&str| format!("AttributeBegin {place}\n{what} AttributeEnd\n");
        places.iter().map(place).collect()
    };
    if are_instances {
        let object = format!("ObjectBegin \"lamps\"\n{lamps}ObjectEnd\n");
        object + &at("ObjectInstance \"lamps\"")
    } else {
        at(&lamps)
    }
}

fn world(strategy: &str, lamps: &str) -> World {
    let map = picture(16, 8, |x, y| 0.2 + ((3 * x + 5 * y) % 7) as f32);
    world_of(strategy, &(OTHERS.to_owned() + lamps), Some(&map))
}

/// Lamps by themselves, and copies.
fn lamps(n: usize) -> [String; 2] {
    [emitters(n), copies(n.div_ceil(PLACES.len()), &PLACES, true)]
}

fn receivers(n: usize) -> Vec<Receiver> {
    let mut random = Uniform::new(23);
    let mut all: Vec<Receiver> = (0..n)
        .map(|k| {
            let [x, y] = random.unit2().map(|u| 1.4 * u - 0.7);
            let z = random.unit();
            let ng = uniform_sphere(random.unit2());
            let normal = match k % 3 {
                0 => [0.0; 3],
                1 => [0.0, 0.0, 1.0],
                _ => ng.to_f64().as_vec3().to_array(),
            };
            receiver([x, y, z], normal)
        })
        .collect();
    // On a light, and far away.
    all.push(receiver([0.1, 0.2, 0.3], [0.0, 0.0, 1.0]));
    all.push(receiver([1e4, -3e4, 1e5], [0.0; 3]));
    all
}

/// Up to the order of factors.
fn is_same(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-5 * b
}

#[test]
fn probabilities_sum_to_one_and_are_what_is_chosen() {
    const N: usize = 100_000;
    let kinds = lamps(100);
    for (strategy, lamps) in STRATEGIES
        .iter()
        .flat_map(|s| kinds.iter().map(move |l| (*s, l)))
    {
        let world = world(strategy, lamps);
        for at in receivers(12) {
            let pmfs: Vec<f64> = (0..world.n_lights())
                .map(|i| world.light_pmf(&at, LightId::new(i)).into())
                .collect();
            let sum: f64 = pmfs.iter().sum();
            assert!((sum - 1.0).abs() < 1e-4, "{strategy}: {sum}");
            let mut counts = vec![0usize; pmfs.len()];
            for k in 0..N {
                let u = (k as f64 + 0.5) / N as f64;
                let (light, pmf) = world.choose_light(&at, u).expect("there are lights");
                assert!(
                    pmf > 0.0 && is_same(pmf, world.light_pmf(&at, light)),
                    "{strategy}"
                );
                counts[light.index()] += 1;
            }
            // Evenly spread numbers: each light has a stretch of its own, or as many as the alias table has entries.
            for (count, pmf) in counts.iter().zip(&pmfs) {
                let off = (*count as f64 - N as f64 * pmf).abs();
                let stretches = if strategy == "spatial" { 16.0 } else { 256.0 };
                assert!(off <= stretches, "{strategy}: {count} for {pmf}");
            }
            for u in [0.0, 1e-300, 1.0 - f64::EPSILON / 2.0] {
                let (light, pmf) = world.choose_light(&at, u).expect("there are lights");
                assert!(
                    pmf > 0.0 && is_same(pmf, world.light_pmf(&at, light)),
                    "{u}"
                );
            }
        }
    }
}

#[test]
fn a_light_that_can_contribute_can_be_chosen() {
    let mut random = Uniform::new(31);
    let kinds = lamps(400);
    for (strategy, lamps) in STRATEGIES
        .iter()
        .flat_map(|s| kinds.iter().map(move |l| (*s, l)))
    {
        let world = world(strategy, lamps);
        for at in receivers(60) {
            for i in 0..world.n_lights() {
                let light = LightId::new(i);
                for _ in 0..4 {
                    if world
                        .sample_on_light(light, 1.0, &at, random.unit2())
                        .is_some_and(|s| !s.radiance.is_black())
                    {
                        assert!(
                            world.light_pmf(&at, light) > 0.0,
                            "{strategy}, light {i}: {at:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn a_light_at_infinity_of_no_luminance_can_be_chosen_beside_many_lamps() {
    // What its channels make of luminance is negative, so that it has no power at all.
    let odd = "LightSource \"distant\" \"rgb L\" [-1 .1 .1]\n".to_owned();
    let world = world_of("spatial", &(odd + &emitters(100)), None);
    let id = (0..world.n_lights())
        .map(LightId::new)
        .find(|id| matches!(world.light(*id), Light::Distant(_)))
        .expect("there is one");
    for at in receivers(12) {
        let pmf = world.light_pmf(&at, id);
        assert!(pmf > 0.0, "{at:?}");
        let last = world.choose_light(&at, 1.0 - f64::EPSILON);
        assert_eq!(last, Some((id, pmf)), "{at:?}");
    }
}

fn received(at: &Receiver, sample: &tyndall::world::LightSample) -> f64 {
    let cos = if at.ng.length_squared() > 0.0 {
        at.ng.abs_dot(sample.wi)
    } else {
        1.0
    };
    f64::from(sample.radiance.g() * cos) / f64::from(sample.pdf)
}

#[test]
fn every_strategy_finds_the_sum_over_all_lights() {
    let mut random = Uniform::new(41);
    for at in receivers(8) {
        let exhaustive = {
            let world = world("uniform", &emitters(100));
            Mean::of(2000, || {
                (0..world.n_lights())
                    .filter_map(|i| {
                        world.sample_on_light(LightId::new(i), 1.0, &at, random.unit2())
                    })
                    .map(|sample| received(&at, &sample))
                    .sum()
            })
        };
        for strategy in STRATEGIES {
            let world = world(strategy, &emitters(100));
            let mut estimate = |bias: &dyn Fn(LightId) -> f32| {
                Mean::of(200_000, || {
                    let u = f64::from(random.unit());
                    let (light, pmf) = world.choose_light(&at, u).expect("there are lights");
                    let pmf = pmf * bias(light);
                    world
                        .sample_on_light(light, pmf, &at, random.unit2())
                        .map_or(0.0, |sample| received(&at, &sample))
                })
            };
            estimate(&|_| 1.0)
                .agrees_with_mean(&exhaustive)
                .assert_accepted(&format!("{strategy} at {at:?}"));
            // The judge is awake: a probability that is wrong for every second light shows.
            let planted = estimate(&|light| if light.index() % 2 == 0 { 1.3 } else { 1.0 });
            assert!(
                strategy != "spatial" || !planted.agrees_with_mean(&exhaustive).accepted(),
                "a planted bug at {at:?}"
            );
        }
    }
}

#[test]
fn copies_of_lamps_light_as_lamps_by_themselves() {
    let mut random = Uniform::new(47);
    let [copied, alone] =
        [true, false].map(|are_instances| world("spatial", &copies(12, &PLACES, are_instances)));
    for at in receivers(12) {
        let mut of = |world: &World| {
            Mean::of(100_000, || {
                let u = f64::from(random.unit());
                let sample = world.sample_light(&at, u, random.unit2());
                sample.map_or(0.0, |sample| received(&at, &sample))
            })
        };
        of(&copied)
            .agrees_with_mean(&of(&alone))
            .assert_accepted(&format!("{at:?}"));
    }
}

/// Logarithm of the relative variance of a light sample, in the mean over some receivers.
fn noise(world: &World, at: &[Receiver]) -> f64 {
    let mut random = Uniform::new(43);
    let of_receiver = |at: &Receiver| {
        let mean = Mean::of(20_000, || {
            let u = f64::from(random.unit());
            let sample = world.sample_light(at, u, random.unit2());
            sample.map_or(0.0, |sample| received(at, &sample))
        });
        (mean.standard_error / mean.value).powi(2).ln()
    };
    at.iter().map(of_receiver).sum::<f64>() / at.len() as f64
}

#[test]
fn a_tree_for_all_copies_is_as_quiet_as_one_of_all_lamps() {
    // Of copies that are not similar it guesses angles.
    let world = |are_instances| world_of("spatial", &copies(60, &similar(), are_instances), None);
    let at = &receivers(24)[..24];
    let [copied, alone] = [true, false].map(|are_instances| noise(&world(are_instances), at));
    assert!(
        copied < alone + 0.1,
        "mean logarithm of variance: {copied} {alone}"
    );
}

#[test]
fn the_tree_is_quieter_than_power_among_many_lights() {
    let [power, tree] = ["power", "spatial"].map(|strategy| {
        let world = world_of(strategy, &emitters(1000), None);
        noise(&world, &receivers(24)[..24])
    });
    assert!(
        tree < power - 1.0,
        "mean logarithm of variance: {tree} {power}"
    );
}
