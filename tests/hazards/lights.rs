//! Family L: lights.

use crate::loaded::load;
use crate::probe::Probe;
use crate::seen::seen_by;

const FLOOR: &str = "AttributeBegin Material \"matte\" \"rgb Kd\" [1 1 1] Shape \"disk\" \"float radius\" 50 AttributeEnd\n";

#[test]
fn l05_lamps_in_instances_light_as_lamps_that_stand_by_themselves() {
    let lamp = "AreaLightSource \"diffuse\" \"rgb L\" [4 3 2] \"bool twosided\" \"true\"\n\
                Shape \"trianglemesh\" \"point P\" [-1 -1 0  1 -1 0  1 1 0] \"integer indices\" [0 1 2]\n\
                Shape \"sphere\" \"float radius\" .2\n";
    let places = [
        "Translate 0 0 3",
        "Translate 2 0 2 Rotate 40 1 2 3",
        "Translate -2 1 2",
    ];
    let copies: String = places
        .iter()
        .map(|place| format!("AttributeBegin {place} ObjectInstance \"lamp\" AttributeEnd\n"))
        .collect();
    let copied = format!("{FLOOR}ObjectBegin \"lamp\"\n{lamp}ObjectEnd\n{copies}");
    let lamps: String = places
        .iter()
        .map(|place| format!("AttributeBegin {place} {lamp} AttributeEnd\n"))
        .collect();
    let lit = |world: &str, integrator: &str| {
        let scene = seen_by(integrator, 1, [0.4, 0.3, 1.0], [-0.1, 0.05, -1.0], world);
        let film = "Film \"image\" \"integer xresolution\" 1 \"integer yresolution\" 1\nPixelFilter \"box\"\n";
        // pbrt-v3 lights nothing with lamps in objects, which is told.
        let (compiled, found) = load(&(film.to_owned() + &scene), None);
        assert!(found.iter().all(|finding| !finding.is_error), "{found:?}");
        Probe::of(compiled.expect("a job").job).means(100_000)
    };
    let direct = format!("{FLOOR}{lamps}");
    for integrator in ["path", "volpath"] {
        let (a, b) = (lit(&copied, integrator), lit(&direct, integrator));
        for (a, b) in a.iter().zip(&b) {
            assert!(b.value > 0.1);
            a.agrees_with_mean(b).assert_accepted(integrator);
        }
    }
}
