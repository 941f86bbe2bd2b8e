//! The facts of a run: `--json` and `--verbose`.

use std::collections::BTreeSet;

use crate::room::{Room, ball, ball_without_its_mesh};

/// `a.b`, `list[].c`: the fields of a value, `[]` at the end left out.
fn fields(value: &serde_json::Value, path: &str, found: &mut BTreeSet<String>) {
    found.insert(path.trim_end_matches("[]").to_owned());
    if let Some(object) = value.as_object() {
        for (name, value) in object {
            fields(
                value,
                format!("{path}.{name}").trim_start_matches('.'),
                found,
            );
        }
    }
    for element in value.as_array().into_iter().flatten() {
        fields(element, &format!("{path}[]"), found);
    }
}

/// The same from the tables of the manual, where `.b` behind `a.x` means `a.b`.
fn documented_fields() -> BTreeSet<String> {
    let manual = include_str!("../../docs/cli.md");
    let (_, section) = manual
        .split_once("## Report")
        .expect("a section on the report");
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    let mut found = BTreeSet::new();
    for row in rows {
        let cell = row.split('|').nth(1).expect("a first column");
        let mut path = String::new();
        for field in cell.split('`').skip(1).step_by(2) {
            path = match (field.strip_prefix('.'), path.rsplit_once('.')) {
                (Some(last), Some((parent, _))) => format!("{parent}.{last}"),
                _ => field.to_owned(),
            };
            found.insert(path.trim_end_matches("[]").to_owned());
        }
    }
    found
}

#[test]
fn the_report_holds_the_documented_fields_and_no_others() {
    let room = Room::new();
    room.put("ball.pbrt", &ball_without_its_mesh());
    let mut reported = BTreeSet::new();
    fields(&room.report("ball.pbrt"), "", &mut reported);
    let documented = documented_fields();
    let missing: Vec<_> = documented.difference(&reported).collect();
    assert!(missing.is_empty(), "not in the report: {missing:?}");
    let is_group = |field: &String| {
        documented
            .iter()
            .any(|other| other.starts_with(&format!("{field}.")))
    };
    let unknown: Vec<_> = reported
        .difference(&documented)
        .filter(|field| !field.is_empty() && !is_group(field))
        .collect();
    assert!(unknown.is_empty(), "not in docs/cli.md: {unknown:?}");
    assert_eq!(room.report("ball.pbrt")["schema"], 1);
}

#[test]
fn the_report_places_findings_and_counts_them() {
    let room = Room::new();
    room.put("ball.pbrt", &ball_without_its_mesh());
    let report = room.report("ball.pbrt");
    let finding = &report["findings"][0];
    assert_eq!(finding["severity"], "error");
    assert_eq!(finding["code"], "missing-file");
    assert_eq!(finding["file"], "ball.pbrt");
    assert_eq!(
        (&finding["line"], &finding["column"]),
        (&10.into(), &35.into())
    );
    assert_eq!(
        report["counts"],
        serde_json::json!({"fatal": 0, "errors": 1, "warnings": 0})
    );
    assert_eq!(report["outcome"], "substituted");
}

#[test]
fn the_report_adds_up() {
    let report = Room::new().report("--spp 64 ball.pbrt");
    let seconds = |name: &str| report["seconds"][name].as_f64().expect("a number");
    let phases = ["parse", "compile", "render", "write"].map(seconds);
    assert!(phases.iter().all(|seconds| *seconds > 0.0));
    assert!(phases.iter().sum::<f64>() <= seconds("wall"));
    assert!(seconds("cpu") > 0.0);
    assert!(report["peak_memory_bytes"].as_u64() > Some(1 << 20));
    let render = &report["pictures"][0]["render"];
    assert!(render["rays"].as_u64() >= render["samples"].as_u64());
    assert_eq!(
        report["pictures"][0]["job"]["skipped"]["materials"], 1,
        "the default matte"
    );
}

#[test]
fn the_report_is_written_whatever_happens() {
    let room = Room::new();
    assert_eq!(room.report("gone.pbrt")["outcome"], "failed");
    room.run("--json r.json gone.pbrt").ends_with(1);
    assert_eq!(room.list(), ["ball.pbrt", "r.json"]);
    let run = room.run("--json no/r.json ball.pbrt").ends_with(1);
    run.says("cannot write \"no/r.json\": there is no directory \"no\"");
    assert!(
        !room.path("ball.exr").exists(),
        "rendered before the report was found impossible"
    );
}

#[test]
fn verbose_says_what_was_built_and_where_the_time_went() {
    let run = Room::new().run("--verbose ball.pbrt").ends_with(0);
    let run = run
        .says("64 x 48 pixels")
        .says("4 samples per pixel, seed 0, integrator \"path\"");
    run.says("1 surface elements")
        .says("samples    12288")
        .says("parse ");
}

#[test]
fn verbose_and_the_report_say_what_was_skipped() {
    let room = Room::new();
    let unused = "Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"gone.exr\"\n\
                  MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"float scale\" 0.02\n\
                  ObjectBegin \"o\"\nShape \"plymesh\" \"string filename\" \"gone.ply\"\nObjectEnd\n";
    room.put("ball.pbrt", &ball("Shape", &format!("{unused}Shape")));
    let run = room.run("--verbose ball.pbrt").ends_with(0);
    run.says("unused     1 textures, 1 materials, 1 media, 1 objects")
        .says("textures \"t\"")
        .says("media \"fog\"");
    assert_eq!(
        room.report("ball.pbrt")["pictures"][0]["job"]["skipped"],
        serde_json::json!({"textures": 1, "materials": 1, "media": 1, "objects": 1})
    );
    assert_eq!(
        room.report("ball.pbrt")["pictures"][0]["job"]["skipped_names"],
        serde_json::json!({"textures": ["t"], "materials": ["matte"], "media": ["fog"], "objects": ["o"]})
    );
}

#[test]
fn verbose_names_only_the_first_of_many_that_were_skipped() {
    let room = Room::new();
    let unused: String = (0..20)
        .map(|i| format!("Texture \"t{i}\" \"float\" \"constant\"\n"))
        .collect();
    room.put("ball.pbrt", &ball("Shape", &format!("{unused}Shape")));
    let run = room.run("--verbose ball.pbrt").ends_with(0);
    run.says("\"t7\", and 12 more");
    let report = room.report("ball.pbrt");
    let names = &report["pictures"][0]["job"]["skipped_names"]["textures"];
    assert_eq!(names.as_array().map(Vec::len), Some(20));
}

/// A program that starts slowly is slow for every small picture.
#[test]
fn a_small_picture_is_there_at_once() {
    let room = Room::new();
    let seconds = |_| {
        let start = std::time::Instant::now();
        room.run("--quiet --spp 1 --cropwindow 0 0.1 0 0.1 ball.pbrt")
            .ends_with(0);
        start.elapsed().as_secs_f64()
    };
    // The least of several: what else the machine does only adds.
    let least = (0..20).map(seconds).fold(f64::INFINITY, f64::min);
    assert!(least < 0.030, "the process takes {least} s");
}

#[test]
fn media_on_one_side_of_surfaces_are_told_at_their_place() {
    let scene = |integrator: &str, inside: &str| {
        format!(
            "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"float scale\" 0.02\n\
             MediumInterface \"{inside}\" \"fog\"\n\
             Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8 \"string filename\" \"x.exr\"\n\
             Integrator \"{integrator}\"\nCamera \"perspective\"\nWorldBegin\nTranslate 0 0 4\n\
             LightSource \"point\" \"point from\" [0 1 -2]\n\
             Shape \"sphere\" \"float radius\" 0.5\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]\n\
             \"point P\" [-9 -9 1 9 -9 1 9 9 1 -9 9 1]\nWorldEnd\n"
        )
    };
    let room = Room::new();
    for integrator in ["volpath", "bdpt"] {
        // The wall turns its back to the camera.
        room.put("wall.pbrt", &scene(integrator, ""));
        let report = room.report("wall.pbrt");
        let told = |finding: &&serde_json::Value| finding["code"] == "one-sided-media";
        let findings = report["findings"].as_array().expect("a list");
        let finding = findings.iter().find(told).expect("it is told");
        assert_eq!(
            (&finding["file"], &finding["line"]),
            (&"wall.pbrt".into(), &10.into())
        );
        assert!(report["pictures"][0]["render"]["one_sided_media"].as_u64() > Some(0));
        room.put("fog.pbrt", &scene(integrator, "fog"));
        let report = room.report("fog.pbrt");
        assert_eq!(report["pictures"][0]["render"]["one_sided_media"], 0);
    }
}
