//! What hostile and large scenes cost, at two sizes each; and that memory has a limit.

use std::fmt::Write;

use crate::room::{Room, ball};

/// Asserts that twice the input takes little more than twice the time and the memory.
const RATIO: f64 = 2.2;
/// What the machine adds to a ratio of times when it has other things to do.
const NOISE: f64 = 1.5;

/// Seconds of processors and mebibytes that checking a scene takes beyond those of an empty one; the least of some runs.
fn cost(room: &Room, scene: &str) -> [f64; 2] {
    room.put("costly.pbrt", scene);
    let run = |_| {
        let report = room.report("check --quiet --nthreads 1 costly.pbrt");
        let seconds = report["seconds"]["cpu"]
            .as_f64()
            .expect("this system tells");
        let bytes = report["peak_memory_bytes"]
            .as_f64()
            .expect("this system tells");
        [seconds, bytes / f64::from(1 << 20)]
    };
    let runs: Vec<[f64; 2]> = (0..3).map(run).collect();
    [0, 1].map(|k| runs.iter().map(|run| run[k]).fold(f64::INFINITY, f64::min))
}

fn times(n: usize, line: impl Fn(usize) -> String) -> String {
    (0..n).map(line).collect()
}

fn scene(world: &str) -> String {
    let film = "Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8";
    format!(
        "{film}\nLookAt 0 0 9  0 0 0  0 1 0\nCamera \"perspective\"\nWorldBegin\n{world}\nWorldEnd\n"
    )
}

/// A scene of lamps in instances.
fn lamps(n_lamps: usize, n_instances: usize) -> String {
    let lamp = |i| {
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [{i} 0 0  {i}.5 0 0  {i} .5 0]\n"
        )
    };
    let instance =
        |j| format!("TransformBegin Translate 0 {j} 0 ObjectInstance \"o\" TransformEnd\n");
    let light = "AreaLightSource \"diffuse\"";
    let object = format!(
        "ObjectBegin \"o\" {light}\n{}ObjectEnd\n",
        times(n_lamps, lamp)
    );
    scene(&(object + &times(n_instances, instance)))
}

/// Memory that the peak of a child may hide.
const UNSEEN_MEBIBYTES: f64 = 64.0;

#[test]
#[expect(clippy::print_stderr, reason = "how much it was is worth reading")]
fn twice_the_input_costs_twice_as_much() {
    type Kind = (&'static str, usize, fn(usize) -> String);
    let kinds: [Kind; 13] = [
        ("unknown parameters", 20_000, |n| {
            scene(&format!(
                "Shape \"sphere\" {}",
                times(n, |i| format!("\"float p{i}\" 1 "))
            ))
        }),
        ("repeated parameters", 20_000, |n| {
            scene(&format!(
                "Shape \"sphere\" {}",
                times(n, |_| "\"float radius\" 1 ".into())
            ))
        }),
        ("open blocks", 50_000, |n| {
            scene(&times(n, |_| "AttributeBegin\n".into()))
        }),
        ("unmatched ends", 50_000, |n| {
            scene(&times(n, |_| "AttributeEnd\n".into()))
        }),
        ("unknown names", 20_000, |n| {
            scene(&times(n, |i| format!("NamedMaterial \"m{i}\"\n")))
        }),
        ("includes", 5_000, |n| {
            scene(&times(n, |_| "Include \"sphere.pbrt\"\n".into()))
        }),
        ("named materials", 10_000, |n| {
            scene(&times(n, |i| {
                let made = format!("MakeNamedMaterial \"m{i}\" \"string type\" \"matte\"");
                format!("{made} NamedMaterial \"m{i}\" Shape \"sphere\"\n")
            }))
        }),
        ("instances", 50_000, |n| {
            let instance = |i| format!("Translate 1 {} 0 ObjectInstance \"o\"\n", i % 7);
            let object = "ObjectBegin \"o\" Shape \"sphere\" ObjectEnd\n";
            scene(&(object.to_owned() + &times(n, instance)))
        }),
        ("curves", 10_000, |n| {
            scene(&times(n, |i| {
                format!("Shape \"curve\" \"point P\" [{i} 0 0  {i} 1 0  {i} 1 1  {i}.5 2 1]\n")
            }))
        }),
        ("voxels", 500_000, |n| {
            let grid = format!(
                "MakeNamedMedium \"m\" \"string type\" \"heterogeneous\" \"integer nx\" 10 \"integer ny\" 10 \
                 \"integer nz\" {} \"float density\" [{}]",
                n / 100,
                times(n, |i| format!(".{} ", i % 10))
            );
            let scene = scene(&(grid + "\nMediumInterface \"m\" \"\" Shape \"sphere\""));
            scene.replace("WorldBegin", "Integrator \"volpath\" WorldBegin")
        }),
        ("lamps in instances", 100, |n| lamps(100, 4 * n)),
        ("bright materials", 2_000, |n| {
            scene(&times(n, |i| {
                let material = format!(
                    "Material \"plastic\" \"rgb Kd\" [1 {} 1]",
                    i as f64 / n as f64
                );
                format!("{material} Shape \"sphere\" \"float radius\" {}\n", 1 + i)
            }))
        }),
        ("materials", 10_000, |n| {
            scene(&times(n, |i| {
                let material = format!(
                    "Material \"plastic\" \"rgb Kd\" [.1 {} .1]",
                    i as f64 / n as f64
                );
                format!("{material} Shape \"sphere\" \"float radius\" {}\n", 1 + i)
            }))
        }),
    ];
    let room = Room::new();
    room.put("sphere.pbrt", "Shape \"sphere\"\n");
    let [idle_seconds, idle_mebibytes] = cost(&room, &scene("Shape \"sphere\""));
    let mut table = String::new();
    let mut is_right = true;
    for (what, n, text) in kinds {
        let [one, two] = [n, 2 * n].map(|n| cost(&room, &text(n)));
        let seconds = (two[0] - idle_seconds) / (one[0] - idle_seconds).max(0.05);
        // A child's peak begins with what this process held when it started: less than that is not seen.
        let mebibytes = (two[1] - idle_mebibytes) / (one[1] - idle_mebibytes).max(UNSEEN_MEBIBYTES);
        is_right &= seconds <= RATIO * NOISE && mebibytes <= RATIO;
        writeln!(
            table,
            "{what:<20} {n:>6}: {:.3} s {:6.1} MiB; twice: {:.3} s {:6.1} MiB; ratios {seconds:.2} {mebibytes:.2}",
            one[0], one[1], two[0], two[1]
        )
        .expect("memory is there");
    }
    eprintln!("{table}");
    assert!(is_right, "\n{table}");
}

#[test]
fn many_bright_materials_are_told_of_in_few_lines() {
    let world = times(1000, |i| {
        let material = format!(
            "Material \"plastic\" \"rgb Kd\" [1 {} 1]",
            f64::from(i as u32) / 1e3
        );
        format!("{material} Shape \"sphere\" \"float radius\" {}\n", 1 + i)
    });
    let room = Room::new();
    room.put("ball.pbrt", &scene(&world));
    let report = room.report("check ball.pbrt");
    let findings = report["findings"].as_array().expect("a list");
    let of_kind = findings
        .iter()
        .filter(|finding| finding["code"] == "bright-material");
    let of_kind: Vec<_> = of_kind.collect();
    assert!((50..=128).contains(&of_kind.len()), "{}", of_kind.len());
    let last = of_kind.last().expect("some").to_string();
    assert!(last.contains("were not looked at"), "{last}");
}

#[test]
fn a_bright_material_behind_many_dull_ones_is_told_of() {
    // Of these it takes nothing to know that they are dull.
    let dull = times(10_000, |i| {
        let kd = i as f64 / 2e4;
        format!("Material \"matte\" \"rgb Kd\" [.1 {kd} .1] Shape \"sphere\"\n")
    });
    let bright = "Material \"plastic\" \"rgb Kd\" [1 1 1] Shape \"sphere\"";
    let room = Room::new();
    room.put("ball.pbrt", &scene(&(dull + bright)));
    let report = room.report("check ball.pbrt");
    let findings = report["findings"].as_array().expect("a list");
    let is_bright = |finding: &&serde_json::Value| finding["code"] == "bright-material";
    let bright: Vec<_> = findings.iter().filter(is_bright).collect();
    assert!(
        bright.len() == 1 && bright[0]["line"] == 10_005,
        "{bright:?}"
    );
}

#[test]
fn many_findings_of_a_kind_are_counted_in_the_report() {
    let room = Room::new();
    room.put(
        "ball.pbrt",
        &scene(&times(10_000, |_| "AttributeEnd\n".into())),
    );
    let report = room.report("check ball.pbrt");
    assert_eq!(report["counts"]["errors"], 10_000);
    let findings = report["findings"].as_array().expect("a list");
    assert!(findings.len() < 300, "{}", findings.len());
    let more = findings.iter().any(|finding| {
        let message = finding["message"].as_str().unwrap_or_default();
        message == "9800 more of the kind `unmatched-end` are not listed"
    });
    assert!(more);
}

/// The code of the first error or fatal error of a run within so much memory, which has a place.
fn refusal(room: &Room, memory: &str, code: i64) -> (String, String) {
    let report = room.report(&format!("check --max-memory {memory} ball.pbrt"));
    assert_eq!(report["exit_code"], code, "{report}");
    let findings = report["findings"].as_array().expect("a list");
    let worst = findings
        .iter()
        .find(|finding| finding["severity"] != "warning");
    let worst = worst.expect("a refusal");
    assert!(worst["line"].is_u64(), "{worst}");
    let text = |key: &str| worst[key].as_str().unwrap_or_default().to_owned();
    (text("code"), text("message"))
}

#[test]
fn what_exceeds_the_memory_is_refused_in_place() {
    let room = Room::new();
    // A deflated picture of one colour.
    let (width, height) = (4096, 4096);
    let mut png = std::io::Cursor::new(Vec::new());
    let pixels = vec![7_u8; 3 * width * height];
    image::write_buffer_with_format(
        &mut png,
        &pixels,
        width as u32,
        height as u32,
        image::ExtendedColorType::Rgb8,
        image::ImageFormat::Png,
    )
    .expect("a picture");
    std::fs::write(room.path("grey.png"), png.into_inner()).expect("a file");
    let texture = "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"grey.png\"";
    let textured = format!("{texture} Material \"matte\" \"texture Kd\" \"t\" Shape \"sphere\"");
    room.put("ball.pbrt", &scene(&textured));
    let (code, message) = refusal(&room, "100M", 3);
    assert!(
        code == "bad-image" && message.contains("MiB of memory"),
        "{message}"
    );
    room.run("check --max-memory 4G ball.pbrt").ends_with(0);

    let tetrahedron =
        "\"integer indices\" [0 1 2 0 3 1 1 3 2 2 3 0] \"point P\" [0 0 0  1 0 0  0 1 0  0 0 1]";
    room.put(
        "ball.pbrt",
        &scene(&format!(
            "Shape \"loopsubdiv\" \"integer levels\" 9 {tetrahedron}"
        )),
    );
    assert_eq!(refusal(&room, "100M", 3).0, "too-large");

    let triangles = "0 1 2 ".repeat(2000);
    room.put("ball.pbrt", &lamps(1, 300).replace("0 1 2", &triangles));
    let (code, message) = refusal(&room, "100M", 3);
    assert!(
        code == "too-large" && message.starts_with("a light in 300 instances"),
        "{message}"
    );

    room.put(
        "ball.pbrt",
        &lamps(1, 1).replace(
            "\"integer xresolution\" 8",
            "\"integer xresolution\" 4000000",
        ),
    );
    assert_eq!(refusal(&room, "200M", 1).0, "too-large");

    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0\n3 0 1 2\n";
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    std::io::Write::write_all(&mut packed, ply.as_bytes()).expect("memory");
    for _ in 0..16 {
        std::io::Write::write_all(&mut packed, &[b' '; 1 << 20]).expect("memory");
    }
    let mut packed = packed.finish().expect("memory");
    // Padding, so that so much may come out.
    packed.extend(vec![0; 100_000]);
    std::fs::write(room.path("far.ply"), packed).expect("a file");
    room.put(
        "ball.pbrt",
        &scene("Shape \"plymesh\" \"string filename\" \"far.ply\""),
    );
    assert_eq!(refusal(&room, "60M", 3).0, "bad-ply");
}

#[test]
fn scenes_that_exceed_the_memory_are_refused_in_place() {
    let room = Room::new();
    let refused = |world: &str, memory: &str, status: i64| {
        room.put("ball.pbrt", &scene(world));
        refusal(&room, memory, status)
    };
    let far = std::fs::File::create(room.path("far.pbrt")).expect("a file");
    far.set_len(1 << 28).expect("a file system with holes");
    let (_, message) = refused("Include \"far.pbrt\"", "100M", 3);
    assert!(message.contains("not so much memory"), "{message}");

    let spheres = times(200_000, |_| "Shape \"sphere\"\n".into());
    let (code, message) = refused(&spheres, "50M", 1);
    assert!(
        code == "too-large" && message.contains("up to here"),
        "{message}"
    );

    let points = "0 1 2 ".repeat(400_000);
    let curve = format!("Shape \"curve\" \"string basis\" \"bspline\" \"point P\" [{points}]");
    let knots = "0 0 0 0 1 1 1 1";
    let control = times(16, |i| format!("{} {} 0 ", i % 4, i / 4));
    let patch = format!(
        "Shape \"nurbs\" \"integer nu\" 4 \"integer nv\" 4 \"integer uorder\" 4 \"integer vorder\" 4 \
         \"float uknots\" [{knots}] \"float vknots\" [{knots}] \"point P\" [{control}]\n"
    );
    let heights = format!(
        "Shape \"heightfield\" \"integer nu\" 1500 \"integer nv\" 1000 \"float Pz\" [{}]",
        "1 ".repeat(1_500_000)
    );
    // Thin: its border is eight times as large as it is.
    let grid = format!(
        "MakeNamedMedium \"m\" \"string type\" \"heterogeneous\" \"integer nz\" 2000000 \"float density\" [{}]\n\
         MediumInterface \"m\" \"\" Shape \"sphere\"",
        "1 ".repeat(2_000_000)
    );
    for (what, world, status) in [
        ("a curve of 400000", curve, 3),
        // As many as fit leave no memory for a hierarchy of them.
        ("a mesh of 900 vertices", patch.repeat(3000), 1),
        ("a mesh of 1500000 vertices", heights, 3),
        ("a grid of 1 x 1 x 2000000", grid, 3),
    ] {
        let scene = scene(&world).replace("WorldBegin", "Integrator \"volpath\" WorldBegin");
        room.put("ball.pbrt", &scene);
        let (code, message) = refusal(&room, "80M", status);
        assert!(
            code == "too-large" && message.starts_with(what),
            "{what}: {code}: {message}"
        );
        room.run("check --max-memory 2G ball.pbrt").ends_with(0);
    }

    // All that is small is refused once there is no room, not one in many.
    room.put("ball.pbrt", &scene(&patch.repeat(3000)));
    let report = room.report("check --max-memory 80M ball.pbrt");
    assert!(
        report["counts"]["errors"].as_u64() > Some(1000),
        "{}",
        report["counts"]
    );
}

#[test]
fn a_crop_of_a_huge_frame_takes_its_own_memory() {
    let room = Room::new();
    let film = "\"integer xresolution\" 64 \"integer yresolution\" 48";
    let huge = "\"integer xresolution\" 100000 \"integer yresolution\" 100000 \
                \"float cropwindow\" [0.5 0.5001 0.5 0.5001]";
    room.put("ball.pbrt", &ball(film, huge));
    let report = room.report("--max-memory 200M --spp 1 --outfile ball.exr ball.pbrt");
    assert_eq!(report["exit_code"], 0, "{report}");
    assert_eq!(room.picture("ball.exr").image.width(), 10);
}

#[test]
fn a_size_is_a_number_with_a_unit() {
    let room = Room::new();
    room.run("check --max-memory 2.5G ball.pbrt").ends_with(0);
    for size in ["0", "1X", "-1", "all"] {
        let run = room
            .run(&format!("check --max-memory={size} ball.pbrt"))
            .ends_with(2);
        run.says("a size is a number of bytes");
    }
}
