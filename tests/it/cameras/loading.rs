//! Lens files as they should not be.

use std::sync::Arc;

use tyndall::compile::{Assets, CompileOptions, Compiled, compile};
use tyndall::describe::describe;
use tyndall_parser::source::{SourceBytes, Sources, Spanned};
use tyndall_parser::{NoIncludes, parse};
use tyndall_test_support::Uniform;

use super::{WORLD, sample};

/// Every file a scene names has these bytes.
struct OneFile(Vec<u8>);

impl Assets for OneFile {
    fn read(&self, path: &Spanned<String>) -> Result<SourceBytes, String> {
        if path.value == "absent.dat" {
            return Err("it is not there".to_owned());
        }
        Ok(Arc::new(self.0.clone()))
    }
}

/// What becomes of a realistic camera, and the codes of what is found about it; every finding has a place.
fn load(lens: &str, options: &str) -> (Option<Compiled>, Vec<&'static str>) {
    let text = format!(
        "Film \"image\" \"integer xresolution\" 9 \"integer yresolution\" 6\n\
         Camera \"realistic\" {options}\n{WORLD}"
    );
    let mut sources = Sources::new();
    let root = sources.add_text("scene", text);
    let (file, mut findings) = parse(&mut sources, root, &NoIncludes);
    let (scene, more) = describe(file);
    findings.extend(more);
    let frame = scene.frames.into_iter().next().expect("a frame");
    let files = OneFile(lens.as_bytes().to_vec());
    let (compiled, more) = compile(frame, &CompileOptions::default(), &files);
    findings.extend(more);
    for finding in &findings.list {
        assert!(finding.span.is_some(), "{} has no place", finding.message);
    }
    let codes = findings.list.iter().map(|finding| finding.code).collect();
    (compiled, codes)
}

const FILE: &str = "\"string lensfile\" \"lens.dat\"";
const SINGLE: &str = "100 1 1.5 16\n0 1 0 10\n-100 50 1 16\n";

#[test]
fn a_good_lens_is_loaded_without_a_word() {
    let (compiled, codes) = load(SINGLE, FILE);
    assert!(compiled.is_some() && codes.is_empty(), "{codes:?}");
}

#[test]
fn l10_lens_files_that_make_no_camera_are_located_errors() {
    let absent = "\"string lensfile\" \"absent.dat\"";
    let close = &format!("{FILE} \"float focusdistance\" 0.1");
    let long = "1 1 1 1\n".repeat(1025);
    for (lens, options, code) in [
        (SINGLE, "", "missing-parameter"),
        (SINGLE, absent, "missing-file"),
        ("", FILE, "bad-lens"),
        ("# nothing\n", FILE, "bad-lens"),
        ("100 1 1.5\n", FILE, "bad-lens"),
        ("100 1 1.5 16 -100\n", FILE, "bad-lens"),
        ("100 1 -1.5 16\n-100 50 1 16\n", FILE, "bad-lens"),
        ("100 1 1.5 0\n-100 50 1 16\n", FILE, "bad-lens"),
        ("100 1e999 1.5 16\n-100 50 1 16\n", FILE, "bad-lens"),
        (&long, FILE, "bad-lens"),
        (
            "1.00000000000000000000000000000000001 1 1 1\n",
            FILE,
            "bad-number",
        ),
        (SINGLE, close, "unfocused-lens"),
    ] {
        let (compiled, codes) = load(lens, options);
        assert!(compiled.is_none(), "{lens}{options}");
        assert_eq!(codes, [code], "{lens}{options}");
    }
    let (compiled, codes) = load("-100 1 1.5 16\n100 50 1 16\n", FILE);
    assert!(compiled.is_none());
    assert_eq!(codes, ["no-stop", "unfocused-lens"]);
    // The axis meets the front vertex before the rear one.
    let (compiled, codes) = load("100 -1 1.5 16\n-100 50 1 16\n", FILE);
    assert!(compiled.is_none());
    assert_eq!(codes, ["no-stop", "bad-lens"]);
}

#[test]
fn oddities_of_lens_files_are_warnings() {
    for (lens, options, code) in [
        (SINGLE, "\"float aperturediameter\" 11", "wide-aperture"),
        ("100 1 1.5 16\n-100 50 1 16\n", "", "no-stop"),
        ("100 1 1.5 16\n0 1 0 10\n-100 50 1 16 ;\n", "", "lens-file"),
    ] {
        let (compiled, codes) = load(lens, &format!("{FILE} {options}"));
        assert!(compiled.is_some());
        assert_eq!(codes, [code], "{lens}{options}");
    }
    // Row 17: the number that the end of the file cuts short is lost, here with its row.
    let (compiled, codes) = load(SINGLE.trim_end(), FILE);
    assert!(compiled.is_none());
    assert_eq!(codes, ["lens-file", "bad-lens"]);
}

#[test]
fn no_lens_file_panics_or_makes_rays_that_are_no_numbers() {
    const NUMBERS: [&str; 20] = [
        "0", "-0", "1", "1.5", "1.8", "-20", "35", "50", "100", "-100", "5", "1e-300", "1e-9",
        "1e9", "-1e9", "1e30", "1e160", "1e300", "-1e300", "1e-40",
    ];
    let mut random = Uniform::new(3);
    let mut n_cameras = 0;
    for _ in 0..1500 {
        let mut pick = |n: usize| (random.bits() % n as u64) as usize;
        // Sane lenses with a few numbers out of place find more than noise does.
        let sane = [
            "30", "4", "1.6", "12", "0", "2", "1", "8", "-50", "45", "1", "12",
        ];
        let n_changes = pick(4);
        let mut words: Vec<&str> = sane.to_vec();
        for _ in 0..n_changes {
            let at = pick(words.len());
            words[at] = NUMBERS[pick(NUMBERS.len())];
        }
        let focus = ["1e-30", "0.05", "0.5", "10", "1e30"][pick(5)];
        let stop = ["1e-30", "0.01", "2", "1e30"][pick(4)];
        let weighting = ["true", "false"][pick(2)];
        let options = format!(
            "{FILE} \"float focusdistance\" {focus} \"float aperturediameter\" {stop} \
             \"bool simpleweighting\" \"{weighting}\""
        );
        let lens = words.join(" ") + "\n";
        let (compiled, codes) = load(&lens, &options);
        let Some(compiled) = compiled else {
            assert!(!codes.is_empty(), "{lens}");
            continue;
        };
        n_cameras += 1;
        for _ in 0..200 {
            let [x, y] = random.unit2().map(f64::from);
            let at = sample([x * 15.0 - 3.0, y * 12.0 - 3.0], random.unit2());
            let Some(found) = compiled.job.camera.ray(&at) else {
                continue;
            };
            let is_sound = found.ray.o.is_finite()
                && (found.ray.d.length_squared() - 1.0).abs() < 1e-5
                && found.weight.is_finite()
                && found.weight >= 0.0;
            assert!(is_sound, "{lens}{options}: {found:?}");
        }
    }
    assert!(n_cameras > 300, "{n_cameras}");
}
