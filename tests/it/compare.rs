//! `tyndall compare`: the real program on pictures whose differences are known.

use std::fs;
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use tempfile::TempDir;
use tyndall::image::codec::{self, ImageFile, Precision};
use tyndall::image::{Image, PixelRect, srgb};

/// A directory with pictures in it.
struct Desk {
    directory: TempDir,
}

/// What a run of the program left behind.
struct Run {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Desk {
    fn new() -> Self {
        let directory = TempDir::new().expect("temporary directories can be made");
        Self { directory }
    }

    fn put(&self, name: &str, file: &ImageFile) {
        let extension = name.rsplit('.').next().expect("an extension");
        let bytes = codec::encode(file, extension, Precision::Float).expect("it fits");
        fs::write(self.directory.path().join(name), bytes).expect("a file");
    }

    /// Writes a picture that fills its frame.
    fn put_full(&self, name: &str, image: Image) {
        self.put(name, &ImageFile::new(image));
    }

    /// Writes the part of a full picture inside `window`.
    fn put_crop(&self, name: &str, full: &Image, window: PixelRect) {
        let file = ImageFile {
            image: full.crop(window).expect("it is inside"),
            origin: (window.x0, window.y0),
            display_window: full.bounds(),
            attributes: Vec::new(),
        };
        self.put(name, &file);
    }

    fn picture(&self, name: &str) -> Image {
        let extension = name.rsplit('.').next().expect("an extension");
        let bytes = fs::read(self.directory.path().join(name)).expect("the file is there");
        codec::decode(&bytes, extension).expect("a picture").image
    }

    fn has(&self, name: &str) -> bool {
        self.directory.path().join(name).exists()
    }

    /// Runs `tyndall` with these arguments.
    fn run(&self, line: &str) -> Run {
        let output = Command::new(env!("CARGO_BIN_EXE_tyndall"))
            .args(line.split_whitespace())
            .current_dir(self.directory.path())
            .stdin(Stdio::null())
            .output()
            .expect("the program starts");
        let text = |bytes| String::from_utf8(bytes).expect("the program writes UTF-8");
        Run {
            code: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }

    /// Compares with `--json -`.
    fn report(&self, line: &str) -> Value {
        let run = self.run(&format!("compare {line} --json -"));
        let report: Value = serde_json::from_str(&run.stdout).expect("a report and nothing else");
        assert_eq!(report["exit_code"].as_i64(), run.code.map(i64::from));
        report
    }
}

impl Run {
    /// Asserts the exit status, showing what was said if it is another.
    #[track_caller]
    fn ends_with(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "standard error:\n{}", self.stderr);
        self
    }
}

fn rgb(width: usize, height: usize, data: &[f32]) -> Image {
    Image::new(width, height, 3, data.to_vec()).expect("the samples fill it")
}

/// No two samples are the same.
fn gradient(width: usize, height: usize) -> Image {
    let n_samples = width * height * 3;
    let data: Vec<f32> = (0..n_samples).map(|i| 0.5 + i as f32 / 64.0).collect();
    rgb(width, height, &data)
}

#[track_caller]
fn assert_near(value: &Value, wanted: f64) {
    let value = value.as_f64().expect("a number");
    let error = (value - wanted).abs();
    assert!(error <= 1e-12 * wanted.abs(), "{value} is not {wanted}");
}

/// Differences 1, 0, 2 and 0, 0, 1 at a reference of mean 2.
fn known_difference() -> Desk {
    let desk = Desk::new();
    desk.put_full("b.exr", rgb(2, 1, &[1.0, 2.0, 4.0, 1.0, 2.0, 2.0]));
    desk.put_full("a.exr", rgb(2, 1, &[2.0, 2.0, 2.0, 1.0, 2.0, 1.0]));
    desk
}

#[test]
fn a_picture_is_no_distance_from_itself() {
    let desk = Desk::new();
    for name in ["a.exr", "a.pfm", "a.png", "a.tga"] {
        desk.put_full(name, gradient(5, 4));
        let limits = "--max-mse 0 --max-rmse 0 --max-relmse 0 --max-mae 0 --max-mean-ratio-error 0";
        let report = desk.report(&format!("{name} {name} {limits}"));
        assert_eq!(report["outcome"], "within", "{name}");
        assert_eq!(report["compared"]["pixels"], 20);
        let measures = &report["measures"];
        for measure in ["mse", "rmse", "relmse", "mae", "mean_ratio_error"] {
            assert_eq!(measures[measure], 0.0, "{measure} of {name}");
        }
        assert_eq!(measures["mean_ratio"], json!([1.0, 1.0, 1.0]));
        assert_eq!(measures["psnr"], Value::Null, "it is infinite");
        assert_eq!(report["limits"].as_array().map(Vec::len), Some(5));
    }
}

#[test]
fn measures_have_their_closed_form() {
    let report = known_difference().report("a.exr b.exr");
    assert_eq!(report["outcome"], "within", "there are no limits");
    let measures = &report["measures"];
    let mse = 6.0 / 6.0;
    assert_near(&measures["mse"], mse);
    assert_near(&measures["rmse"], mse.sqrt());
    assert_near(&measures["mae"], 4.0 / 6.0);
    let floor = 0.01 * 2.0 * 2.0;
    let relmse = 1.0 / (1.0 + floor) + 4.0 / (16.0 + floor) + 1.0 / (4.0 + floor);
    assert_near(&measures["relmse"], relmse / 6.0);
    assert_near(&measures["peak"], 4.0);
    assert_near(&measures["psnr"], 10.0 * 16f64.log10());
    assert_eq!(measures["mean_ratio"], json!([1.5, 1.0, 0.5]));
    assert_eq!(measures["mean_ratio_error"], 0.5);
}

#[test]
fn the_two_pictures_are_not_interchangeable() {
    let report = known_difference().report("b.exr a.exr");
    assert_eq!(report["measures"]["mean_ratio"][2], 2.0);
    assert_eq!(report["measures"]["peak"], 2.0);
}

#[test]
fn the_peak_can_be_chosen() {
    let desk = known_difference();
    let report = desk.report("a.exr b.exr --peak 10");
    assert_near(&report["measures"]["psnr"], 20.0);
    let table = desk.run("compare a.exr b.exr -peak=10").ends_with(0).stdout;
    assert!(table.contains("20.0000 dB"), "{table}");
    assert!(table.contains("as given"), "{table}");
}

#[test]
fn a_crop_lines_up_with_the_full_picture() {
    let desk = Desk::new();
    let full = gradient(8, 6);
    desk.put_full("full.exr", full.clone());
    let rect = |x0, y0, width, height| PixelRect {
        x0,
        y0,
        width,
        height,
    };
    desk.put_crop("crop.exr", &full, rect(3, 2, 4, 3));
    desk.put_crop("corner.exr", &full, rect(5, 4, 3, 2));
    desk.put_crop("apart.exr", &full, rect(0, 0, 3, 6));
    for (line, window, size) in [
        ("crop.exr full.exr", json!([3, 7, 2, 5]), [4, 3]),
        ("full.exr crop.exr", json!([3, 7, 2, 5]), [4, 3]),
        ("corner.exr crop.exr", json!([5, 7, 4, 5]), [2, 1]),
    ] {
        let report = desk.report(&format!("{line} --max-mse 0"));
        assert_eq!(report["outcome"], "within", "{line}: {report}");
        assert_eq!(report["compared"]["window"], window);
        assert_eq!(report["compared"]["resolution"], json!(size));
        assert_eq!(report["compared"]["pixels"], size[0] * size[1]);
    }
    let table = desk.run("compare crop.exr full.exr").ends_with(0).stdout;
    assert!(table.contains("4x3 pixels at (3, 2)"), "{table}");

    let run = desk.run("compare crop.exr apart.exr").ends_with(3);
    assert!(run.stderr.contains("do not overlap"), "{}", run.stderr);
}

#[test]
fn parts_of_different_frames_are_not_compared() {
    let desk = Desk::new();
    desk.put_full("a.exr", gradient(4, 4));
    desk.put_full("b.exr", gradient(4, 5));
    let run = desk.run("compare a.exr b.exr").ends_with(3);
    assert!(run.stderr.contains("different frames"), "{}", run.stderr);
    assert_eq!(run.stdout, "");
    let report = desk.report("a.exr b.exr");
    assert_eq!(report["outcome"], "incomparable");
    assert!(report["error"].is_string());
    assert_eq!(report.get("measures"), None);
}

#[test]
fn every_limit_decides_the_exit_status() {
    let desk = known_difference();
    for (option, value) in [
        ("--max-mse", 1.0),
        ("--max-rmse", 1.0),
        ("--max-relmse", 0.243),
        ("--max-mae", 4.0 / 6.0),
        ("--max-mean-ratio-error", 0.5),
    ] {
        let run = |limit: f64| desk.run(&format!("compare a.exr b.exr {option} {limit}"));
        run(value * 1.01).ends_with(0);
        let run = run(value * 0.99).ends_with(1);
        assert!(run.stdout.contains("EXCEEDED"), "{}", run.stdout);
        assert!(run.stderr.contains("above the limit"), "{}", run.stderr);
    }
    // A measure at its limit keeps it; one of several exceeded limits is enough.
    desk.run("compare a.exr b.exr --max-mse 1").ends_with(0);
    let report = desk.report("a.exr b.exr --max-mse 1 --max-mae 0.5");
    assert_eq!(report["outcome"], "exceeded");
    assert_eq!(report["limits"][0]["exceeded"], false);
    assert_eq!(report["limits"][1]["exceeded"], true);
    let run = desk
        .run("compare a.exr b.exr --max-mse 0 --quiet")
        .ends_with(1);
    assert_eq!((run.stdout, run.stderr), (String::new(), String::new()));
}

#[test]
fn pixels_that_are_not_finite_are_counted_and_left_out() {
    let desk = Desk::new();
    let sound = gradient(3, 2);
    let mut broken = sound.clone();
    broken.data_mut()[1] = f32::NAN;
    broken.data_mut()[2] = f32::INFINITY;
    broken.data_mut()[9] = f32::NEG_INFINITY;
    desk.put_full("sound.exr", sound.clone());
    desk.put_full("broken.exr", broken);
    desk.put_full("lost.exr", rgb(3, 2, &[f32::NAN; 18]));

    let report = desk.report("broken.exr sound.exr");
    assert_eq!(report["outcome"], "exceeded", "without any limit");
    assert_eq!(report["test"]["non_finite"], 2);
    assert_eq!(report["reference"]["non_finite"], 0);
    assert_eq!(report["compared"]["pixels"], 4);
    assert_eq!(report["measures"]["mse"], 0.0);
    let run = desk.run("compare broken.exr sound.exr").ends_with(1);
    assert!(run.stderr.contains("not finite: 2"), "{}", run.stderr);
    assert!(run.stdout.contains("2 in A, 0 in B"), "{}", run.stdout);

    let report = desk.report("sound.exr broken.exr --max-mse 0");
    assert_eq!(report["outcome"], "within", "only the reference is broken");
    assert_eq!(report["reference"]["non_finite"], 2);

    let report = desk.report("lost.exr sound.exr --max-mse 1e9");
    assert_eq!(report["outcome"], "exceeded");
    assert_eq!(report["measures"]["mse"], Value::Null);
    assert_eq!(report["limits"][0]["exceeded"], true);
    desk.run("compare sound.exr lost.exr").ends_with(3);
}

#[test]
fn eight_bit_pictures_are_made_linear() {
    let desk = Desk::new();
    let code = 100;
    let linear = srgb::to_linear(code as f32 / 255.0);
    desk.put_full("a.png", rgb(1, 1, &[linear; 3]));
    desk.put_full("b.exr", rgb(1, 1, &[linear; 3]));
    assert_eq!(desk.picture("a.png").data()[0], code as f32 / 255.0);
    let report = desk.report("a.png b.exr --max-mae 1e-6");
    assert_eq!(report["outcome"], "within");
    assert_eq!(report["test"]["made_linear"], true);
    assert_eq!(report["reference"]["made_linear"], false);
    let table = desk.run("compare a.png b.exr").ends_with(0).stdout;
    assert_eq!(table.matches("made linear").count(), 1, "{table}");
}

#[test]
fn grey_counts_for_all_channels_of_a_coloured_picture() {
    let desk = Desk::new();
    let grey = Image::new(1, 1, 1, vec![2.0]).expect("a pixel");
    desk.put_full("grey.pfm", grey);
    desk.put_full("rgb.pfm", rgb(1, 1, &[1.0, 2.0, 4.0]));
    let report = desk.report("grey.pfm rgb.pfm");
    assert_eq!(report["measures"]["mean_ratio"], json!([2.0, 1.0, 0.5]));
    let report = desk.report("grey.pfm grey.pfm");
    assert_eq!(report["measures"]["mean_ratio"], json!([1.0]));
}

#[test]
fn the_map_is_a_picture_of_the_errors() {
    let desk = Desk::new();
    let full = gradient(8, 6);
    let mut changed = full.clone();
    for channel in 0..3 {
        // Pixel (3, 2) is off by 2, pixel (4, 2) by 1, pixel (5, 2) by half of that; pixel (6, 4) is broken.
        changed.data_mut()[3 * (2 * 8 + 3) + channel] += 2.0;
        changed.data_mut()[3 * (2 * 8 + 4) + channel] -= 1.0;
        changed.data_mut()[3 * (2 * 8 + 5) + channel] += 0.5;
        changed.data_mut()[3 * (4 * 8 + 6) + channel] = f32::NAN;
    }
    let window = PixelRect {
        x0: 3,
        y0: 2,
        width: 4,
        height: 3,
    };
    desk.put_full("full.exr", full);
    desk.put_crop("crop.exr", &changed, window);
    let report = desk.report("crop.exr full.exr --map map.png");
    assert_eq!(report["map"]["file"], "map.png");
    assert_near(&report["map"]["max"], 2.0);
    let map = desk.picture("map.png");
    assert_eq!((map.width(), map.height()), (4, 3));
    assert_eq!(map.pixel(0, 0), [1.0, 1.0, 1.0]);
    assert_eq!(map.pixel(1, 0), [1.0, 0.0, 0.0]);
    assert_eq!(map.pixel(2, 0), [0.0, 0.0, 1.0]);
    assert_eq!(map.pixel(3, 0), [0.0, 0.0, 0.0]);
    assert_eq!(map.pixel(3, 2), [0.0, 1.0, 0.0]);

    let line = "compare crop.exr full.exr --map map.png --map-max 1";
    let table = desk.run(line).ends_with(1).stdout;
    assert!(table.contains("white 1.000000e0"), "{table}");
    assert_eq!(desk.picture("map.png").pixel(1, 0), [1.0, 1.0, 1.0]);

    desk.run("compare full.exr full.exr --map none.png")
        .ends_with(0);
    let none = desk.picture("none.png");
    assert!(none.data().iter().all(|&sample| sample == 0.0));
}

#[test]
fn what_cannot_be_read_or_written_is_named() {
    let desk = Desk::new();
    desk.put_full("a.exr", gradient(2, 2));
    fs::write(desk.directory.path().join("b.png"), "no picture").expect("a file");
    fs::write(desk.directory.path().join("c.txt"), "no picture").expect("a file");
    for (line, named) in [
        ("gone.exr a.exr", "gone.exr"),
        ("a.exr gone.exr", "gone.exr"),
        ("a.exr b.png", "b.png"),
        ("c.txt a.exr", "c.txt"),
        ("a.exr .", "\".\""),
        ("a.exr a.exr --map gone/map.png", "gone/map.png"),
        ("a.exr a.exr --json gone/report.json", "gone/report.json"),
    ] {
        let run = desk.run(&format!("compare {line}")).ends_with(3);
        assert!(run.stderr.contains(named), "{line}: {}", run.stderr);
        assert_eq!(run.stdout, "", "{line}");
    }
}

#[test]
fn wrong_command_lines_do_nothing() {
    let desk = Desk::new();
    desk.put_full("a.exr", gradient(2, 2));
    for line in [
        "compare",
        "compare a.exr",
        "compare a.exr a.exr a.exr",
        "compare a.exr a.exr --max-mse -1",
        "compare a.exr a.exr --max-mse nan",
        "compare a.exr a.exr --max-mae few",
        "compare a.exr a.exr --peak 0",
        "compare a.exr a.exr --map map.exr",
        "compare a.exr a.exr --map-max 1",
        "compare a.exr a.exr --spp 4",
        "--quick compare a.exr a.exr",
    ] {
        let run = desk.run(line).ends_with(2);
        assert_eq!(run.stdout, "", "{line}");
        assert!(!run.stderr.is_empty(), "{line}");
    }
    assert!(!desk.has("map.exr"));
}

#[test]
fn a_scene_named_compare_is_rendered_by_its_path() {
    let desk = Desk::new();
    let scene = "Film \"image\" \"integer xresolution\" 2 \"integer yresolution\" 2\n\
                 \"string filename\" \"x.exr\"\nWorldBegin\nWorldEnd\n";
    fs::write(desk.directory.path().join("compare"), scene).expect("a file");
    desk.run("./compare --spp 1").ends_with(0);
    assert!(desk.has("x.exr"));
}

#[test]
fn the_report_goes_to_a_file_beside_the_table() {
    let desk = known_difference();
    let run = desk.run("compare a.exr b.exr --json report.json");
    let run = run.ends_with(0);
    assert!(run.stdout.contains("relMSE"), "{}", run.stdout);
    let text = fs::read_to_string(desk.directory.path().join("report.json")).expect("a report");
    let report: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(report["task"], "compare");
    assert_near(&report["measures"]["mse"], 1.0);
}

const MANUAL: &str = include_str!("../../docs/cli.md");

/// What the manual says about comparisons.
fn manual() -> &'static str {
    let (_, section) = MANUAL
        .split_once("\n## Comparing pictures\n")
        .expect("a section on comparisons");
    section.split("\n## ").next().expect("its text")
}

/// The names of all fields of a report.
fn names(value: &Value, found: &mut Vec<String>) {
    for (name, value) in value.as_object().into_iter().flatten() {
        found.push(name.clone());
        names(value, found);
    }
    for element in value.as_array().into_iter().flatten() {
        names(element, found);
    }
}

#[test]
fn the_manual_names_every_field_of_the_report() {
    let report = known_difference().report("a.exr b.exr --max-mse 1 --map map.png");
    let mut found = Vec::new();
    names(&report, &mut found);
    assert!(found.iter().any(|name| name == "exceeded"), "{found:?}");
    for name in found {
        let is_named = ['`', '.'].iter().any(|before| {
            ["`", "[]`", "."]
                .iter()
                .any(|after| manual().contains(&format!("{before}{name}{after}")))
        });
        assert!(is_named, "docs/cli.md lacks {name}");
    }
}

#[test]
fn the_manual_names_every_option() {
    let help = Desk::new().run("compare --help").ends_with(0).stdout;
    let options = help
        .split_whitespace()
        .filter(|word| word.starts_with("--") && word.len() > 2);
    let mut n_options = 0;
    for option in options.map(|word| word.trim_end_matches([',', ':', ';', '.'])) {
        let quoted = MANUAL.contains(&format!("`{option}"));
        assert!(quoted, "docs/cli.md lacks {option}");
        n_options += 1;
    }
    assert!(n_options >= 10, "{help}");
}

#[test]
fn a_picture_that_does_not_say_where_it_is_can_be_put_in_its_place() {
    let desk = Desk::new();
    let full = Image::new(4, 4, 1, (0..16u8).map(f32::from).collect()).expect("16 pixels");
    let window = PixelRect {
        x0: 1,
        y0: 2,
        width: 3,
        height: 2,
    };
    desk.put_crop("crop.exr", &full, window);
    desk.put_full("lost.exr", full.crop(window).expect("it is inside"));
    let run = desk.run("compare lost.exr crop.exr");
    assert_eq!(run.code, Some(3), "{}", run.stderr);
    let run = desk.run("compare lost.exr crop.exr --same-window --max-mse 0");
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    desk.put_full("full.exr", full);
    let run = desk.run("compare full.exr crop.exr --same-window");
    assert_eq!(run.code, Some(3));
    assert!(
        run.stderr.contains("A has 4x4 pixels, B 3x2"),
        "{}",
        run.stderr
    );
}
