//! What the PLY decoder promises. Files are written here in every encoding and read on both routes, which have to
//! agree.

use std::io::Write;
use std::time::{Duration, Instant};

use tyndall::shape::ply::{
    Place, PlyError, PlyMesh, PlyWarning, Route, decode, decode_by, decode_within,
};

#[derive(Clone, Copy, PartialEq, Debug)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

const ENCODINGS: [Encoding; 3] = [Encoding::Ascii, Encoding::Little, Encoding::Big];

/// One element of a file: properties as declared (`float x`, `list uchar int vertex_indices`) and its items, whose
/// lists start with their length.
#[derive(Clone)]
struct Element {
    name: &'static str,
    properties: Vec<&'static str>,
    items: Vec<Vec<f64>>,
}

impl Element {
    fn new(name: &'static str, properties: &[&'static str], items: &[&[f64]]) -> Self {
        Self {
            name,
            properties: properties.to_vec(),
            items: items.iter().map(|item| item.to_vec()).collect(),
        }
    }
}

const XYZ: [&str; 3] = ["float x", "float y", "float z"];
const CORNERS: &str = "list uchar int vertex_indices";

fn square() -> Element {
    let corners: [&[f64]; 4] = [&[0., 0., 0.], &[1., 0., 0.], &[1., 1., 0.], &[0., 1., 0.]];
    Element::new("vertex", &XYZ, &corners)
}

fn faces(items: &[&[f64]]) -> Element {
    Element::new("face", &[CORNERS], items)
}

fn put(bytes: &mut Vec<u8>, encoding: Encoding, kind: &str, value: f64) {
    let little = match kind {
        "char" | "int8" => (value as i8).to_le_bytes().to_vec(),
        "uchar" | "uint8" => (value as u8).to_le_bytes().to_vec(),
        "short" | "int16" => (value as i16).to_le_bytes().to_vec(),
        "ushort" | "uint16" => (value as u16).to_le_bytes().to_vec(),
        "int" | "int32" => (value as i32).to_le_bytes().to_vec(),
        "uint" | "uint32" => (value as u32).to_le_bytes().to_vec(),
        "float" | "float32" => (value as f32).to_le_bytes().to_vec(),
        "double" | "float64" => value.to_le_bytes().to_vec(),
        other => panic!("no type {other}"),
    };
    match encoding {
        Encoding::Ascii => bytes.extend(format!("{value} ").bytes()),
        Encoding::Little => bytes.extend(little),
        Encoding::Big => bytes.extend(little.iter().rev()),
    }
}

fn encode(encoding: Encoding, elements: &[Element]) -> Vec<u8> {
    let format = match encoding {
        Encoding::Ascii => "ascii",
        Encoding::Little => "binary_little_endian",
        Encoding::Big => "binary_big_endian",
    };
    let mut bytes = format!("ply\nformat {format} 1.0\ncomment made here\n").into_bytes();
    for element in elements {
        bytes.extend(format!("element {} {}\n", element.name, element.items.len()).bytes());
        for property in &element.properties {
            bytes.extend(format!("property {property}\n").bytes());
        }
    }
    bytes.extend(b"end_header\n");
    for element in elements {
        for item in &element.items {
            let mut values = item.iter().copied();
            for property in &element.properties {
                let words: Vec<&str> = property.split(' ').collect();
                if let ["list", length, kind, _] = words[..] {
                    let n = values.next().unwrap();
                    put(&mut bytes, encoding, length, n);
                    for _ in 0..n.max(0.0) as usize {
                        put(&mut bytes, encoding, kind, values.next().unwrap());
                    }
                } else {
                    put(&mut bytes, encoding, words[0], values.next().unwrap());
                }
            }
            assert_eq!(values.next(), None);
            if encoding == Encoding::Ascii {
                bytes.push(b'\n');
            }
        }
    }
    bytes
}

/// Decodes the elements in every encoding on both routes, checks that all agree, and gives the mesh.
fn mesh(elements: &[Element]) -> PlyMesh {
    mesh_in(&ENCODINGS, elements)
}

fn mesh_in(encodings: &[Encoding], elements: &[Element]) -> PlyMesh {
    let mut first: Option<PlyMesh> = None;
    for &encoding in encodings {
        let bytes = encode(encoding, elements);
        for route in [Route::Fastest, Route::General] {
            let mesh = decode_by(&bytes, route).unwrap_or_else(|e| panic!("{encoding:?}: {e}"));
            // Compared as text, where NaN equals itself.
            let text = format!("{mesh:?}");
            let first = first.get_or_insert(mesh);
            assert_eq!(text, format!("{first:?}"), "{encoding:?} {route:?}");
        }
    }
    first.unwrap()
}

/// The errors of the elements in each encoding, the same on both routes.
fn errors(elements: &[Element]) -> [PlyError; 3] {
    ENCODINGS.map(|encoding| {
        let bytes = encode(encoding, elements);
        let fast = decode_by(&bytes, Route::Fastest).unwrap_err();
        let general = decode_by(&bytes, Route::General).unwrap_err();
        assert_eq!(fast, general);
        fast
    })
}

fn header(format: &str, lines: &[&str]) -> Vec<u8> {
    format!(
        "ply\nformat {format} 1.0\n{}\nend_header\n",
        lines.join("\n")
    )
    .into_bytes()
}

#[test]
fn triangles_and_vertices_come_out_as_stored() {
    let mesh = mesh(&[square(), faces(&[&[3., 0., 1., 2.], &[3., 0., 2., 3.]])]);
    assert_eq!(
        mesh.positions,
        [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]
    );
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert!(mesh.normals.is_empty() && mesh.uvs.is_empty() && mesh.face_indices.is_empty());
    assert!(mesh.warnings.is_empty());
}

#[test]
fn a_quad_becomes_the_two_triangles_of_pbrt() {
    let mesh = mesh(&[square(), faces(&[&[4., 0., 1., 2., 3.]])]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 0, 2]]);
}

#[test]
fn both_names_of_the_corner_list_are_read_and_the_first_wins() {
    let second = Element::new(
        "face",
        &["list uchar uint vertex_index"],
        &[&[3., 0., 1., 2.]],
    );
    assert_eq!(mesh(&[square(), second]).triangles, [[0, 1, 2]]);
    let names = ["list uchar int vertex_index", CORNERS];
    let both = Element::new("face", &names, &[&[3., 0., 1., 2., 3., 3., 2., 1.]]);
    assert_eq!(mesh(&[square(), both]).triangles, [[3, 2, 1]]);
}

/// A vertex element with one position and the named columns behind it.
fn one_vertex(columns: &[&'static str], values: &[f64]) -> Element {
    let properties = [&XYZ, columns].concat();
    let item = [&[1., 2., 3.], values].concat();
    Element::new("vertex", &properties, &[&item])
}

#[test]
fn the_first_complete_pair_of_texture_coordinates_is_taken() {
    let columns = ["float s", "float t", "float u", "float v"];
    let faces = faces(&[]);
    let both = mesh(&[one_vertex(&columns, &[0.1, 0.2, 0.3, 0.4]), faces.clone()]);
    assert_eq!(both.uvs, [[0.3, 0.4]]);
    let half = mesh(&[one_vertex(&columns[..3], &[0.1, 0.2, 0.3]), faces.clone()]);
    assert_eq!(half.uvs, [[0.1, 0.2]]);
    for names in [
        ["float texture_v", "float texture_u"],
        ["float texture_t", "float texture_s"],
    ] {
        let mesh = mesh(&[one_vertex(&names, &[0.5, 0.75]), faces.clone()]);
        assert_eq!(mesh.uvs, [[0.75, 0.5]]);
    }
    let none = mesh(&[one_vertex(&["float u", "float t"], &[0.1, 0.2]), faces]);
    assert!(none.uvs.is_empty());
}

#[test]
fn normals_need_all_three_components() {
    let columns = ["float nz", "uchar red", "float nx", "float ny"];
    let whole = mesh(&[one_vertex(&columns, &[3., 9., 1., 2.]), faces(&[])]);
    assert_eq!(whole.normals, [[1., 2., 3.]]);
    let part = mesh(&[one_vertex(&columns[..3], &[3., 9., 1.]), faces(&[])]);
    assert!(part.normals.is_empty());
}

#[test]
fn every_type_is_read_for_positions_and_for_corners() {
    let names = [
        "char", "uchar", "int16", "ushort", "int", "uint32", "float32", "double",
    ];
    for kind in names {
        let own = |name: &str| -> &'static str { format!("{kind} {name}").leak() };
        let corners: &'static str = format!("list int {kind} vertex_indices").leak();
        let vertex = Element {
            properties: vec![own("x"), own("y"), own("z")],
            ..square()
        };
        let face = Element::new("face", &[corners], &[&[3., 0., 1., 2.]]);
        let mesh = mesh(&[vertex, face]);
        assert_eq!(
            (mesh.positions[2], mesh.triangles[0]),
            ([1., 1., 0.], [0, 1, 2]),
            "{kind}"
        );
    }
}

#[test]
fn elements_come_in_any_order_and_unknown_ones_are_skipped() {
    let list = Element::new(
        "strip",
        &["list int short path", "double w"],
        &[&[2., 7., 8., 1.], &[0., 2.]],
    );
    let plain = Element::new("camera", &["short a", "double b"], &[&[1., 2.], &[3., 4.]]);
    let columns = [
        "uchar red",
        "list uchar float texcoord",
        CORNERS,
        "ushort flags",
    ];
    let face = Element::new(
        "face",
        &columns,
        &[&[200., 2., 0.5, 0.25, 3., 1., 2., 3., 77.]],
    );
    let mesh = mesh(&[list, face, plain, square()]);
    assert_eq!(mesh.triangles, [[1, 2, 3]]);
    assert_eq!(mesh.positions[3], [0., 1., 0.]);
}

#[test]
fn face_indices_are_repeated_for_every_triangle_of_a_face() {
    let items: [&[f64]; 3] = [&[3., 0., 1., 2.], &[4., 0., 1., 2., 3.], &[2., 0., 1.]];
    for before in [true, false] {
        let mut columns = vec!["uchar flags", "int face_indices", CORNERS];
        let mut with_index: Vec<Vec<f64>> = Vec::new();
        for (n, item) in items.iter().enumerate() {
            let own = [1., 10. * n as f64 - 5.];
            with_index.push(if before {
                [&own, *item].concat()
            } else {
                [item, &own[..]].concat()
            });
        }
        if !before {
            columns.rotate_right(1);
        }
        let face = Element {
            name: "face",
            properties: columns,
            items: with_index,
        };
        let mesh = mesh(&[square(), face]);
        assert_eq!(mesh.face_indices, [-5, 5, 5]);
        assert_eq!(mesh.triangles.len(), 3);
        assert_eq!(
            mesh.warnings,
            [PlyWarning::ShortFaces { count: 1, first: 2 }]
        );
    }
}

const CORNER_UVS: &str = "list uchar float texcoord";

/// The texture coordinates of each corner of each triangle.
fn corner_uvs(mesh: &PlyMesh) -> Vec<[[f32; 2]; 3]> {
    let uv = |corner: u32| mesh.uvs[corner as usize];
    mesh.triangles
        .iter()
        .map(|corners| corners.map(uv))
        .collect()
}

#[test]
fn texture_coordinates_of_faces_are_used() {
    // A seam: vertices 0 and 2 have other coordinates in the second face.
    let items: [&[f64]; 2] = [
        &[3., 0., 1., 2., 6., 0., 0., 1., 0., 1., 1.],
        &[3., 0., 2., 3., 6., 5., 0., 6., 1., 0., 1.],
    ];
    let normals = Element::new(
        "vertex",
        &[
            "float x", "float y", "float z", "float nx", "float ny", "float nz",
        ],
        &[
            &[0., 0., 0., 0., 0., 1.],
            &[1., 0., 0., 0., 0., 2.],
            &[1., 1., 0., 0., 0., 3.],
            &[0., 1., 0., 0., 0., 4.],
        ],
    );
    let faces = Element::new("face", &[CORNERS, CORNER_UVS], &items);
    // The list may come first, and so may the faces.
    let turned = |item: &&[f64]| [&item[4..], &item[..4]].concat();
    let turned: Vec<Vec<f64>> = items.iter().map(turned).collect();
    let turned: Vec<&[f64]> = turned.iter().map(Vec::as_slice).collect();
    let turned = Element::new("face", &["list uchar float texcoords", CORNERS], &turned);
    let first = mesh(&[square(), faces.clone()]);
    let expected = [
        [[0., 0.], [1., 0.], [1., 1.]],
        [[5., 0.], [6., 1.], [0., 1.]],
    ];
    assert_eq!(corner_uvs(&first), expected);
    assert_eq!((first.positions.len(), first.warnings.len()), (6, 0));
    for elements in [[square(), turned], [faces.clone(), square()]] {
        assert_eq!(mesh(&elements), first);
    }
    let smooth = mesh(&[normals, faces]);
    assert_eq!(corner_uvs(&smooth), expected);
    assert_eq!(smooth.normals[4..], [[0., 0., 1.], [0., 0., 3.]]);
}

#[test]
fn texture_coordinates_of_quads_follow_triangles() {
    let quad: &[f64] = &[4., 0., 1., 2., 3., 8., 0., 0., 1., 0., 1., 1., 0., 1.];
    let faces = Element::new("face", &[CORNERS, CORNER_UVS], &[quad]);
    let found = mesh(&[square(), faces]);
    let expected = [
        [[0., 0.], [1., 0.], [1., 1.]],
        [[0., 1.], [0., 0.], [1., 1.]],
    ];
    assert_eq!(corner_uvs(&found), expected);
    assert_eq!(found.positions.len(), 4);
    let corners = [0., 1., 1.5, 1., 0., 0., 1., 1.];
    let positions: Vec<Vec<f64>> = (0..5)
        .map(|i| vec![corners[i], corners[i + 3], 0.])
        .collect();
    let positions: Vec<&[f64]> = positions.iter().map(Vec::as_slice).collect();
    let vertices = Element::new("vertex", &XYZ, &positions);
    let mut pentagon = vec![5., 0., 1., 2., 3., 4., 10.];
    pentagon.extend((0..10).map(f64::from));
    let faces = Element::new("face", &[CORNERS, CORNER_UVS], &[&pentagon]);
    let fan = corner_uvs(&mesh(&[vertices, faces]));
    assert_eq!(fan[2], [[0., 1.], [6., 7.], [8., 9.]]);
}

#[test]
fn unusable_texture_coordinates_of_faces_warn_once() {
    let items: [&[f64]; 2] = [&[3., 0., 1., 2., 4., 1., 1., 1., 1.], &[3., 0., 2., 3., 0.]];
    let found = mesh(&[
        square(),
        Element::new("face", &[CORNERS, CORNER_UVS], &items),
    ]);
    let misfit = PlyWarning::MisfitCornerUvs { count: 2, first: 0 };
    assert_eq!(found.warnings, [misfit]);
    assert_eq!(found.triangles.len(), 2);
    // Coordinates of vertices win, as in pbrt-v3.
    let mut columns = XYZ.to_vec();
    columns.extend(["float u", "float v"]);
    let vertices: [&[f64]; 3] = [
        &[0., 0., 0., 7., 7.],
        &[1., 0., 0., 8., 8.],
        &[1., 1., 0., 9., 9.],
    ];
    let face: &[f64] = &[3., 0., 1., 2., 6., 0., 0., 1., 0., 1., 1.];
    let found = mesh(&[
        Element::new("vertex", &columns, &vertices),
        Element::new("face", &[CORNERS, CORNER_UVS], &[face]),
    ]);
    assert_eq!(found.uvs, [[7., 7.], [8., 8.], [9., 9.]]);
    assert_eq!(found.warnings, [PlyWarning::IdleCornerUvs]);
}

#[test]
fn bytes_behind_the_last_element_are_reported() {
    for encoding in ENCODINGS {
        let bytes = encode(encoding, &[square(), faces(&[&[3., 0., 1., 2.]])]);
        for (rest, count) in [
            (b"".as_slice(), 0),
            (b"\n\n", 0),
            (b"\0", 0),
            (b"3 0 2 3\n", 7),
        ] {
            let bytes = [bytes.as_slice(), rest].concat();
            let found = decode(&bytes).unwrap();
            let expected: Vec<PlyWarning> = (count > 0)
                .then_some(PlyWarning::Surplus { count })
                .into_iter()
                .collect();
            assert_eq!(found.warnings, expected, "{encoding:?} {rest:?}");
        }
    }
}

#[test]
fn meshes_beyond_the_memory_left_are_refused() {
    let bytes = encode(Encoding::Little, &[square(), faces(&[&[3., 0., 1., 2.]])]);
    assert!(decode_within(&bytes, 1 << 20).is_ok());
    let error = decode_within(&bytes, 100).unwrap_err();
    assert!(matches!(error, PlyError::Unsupported { .. }), "{error}");
}

#[test]
fn a_convex_polygon_equals_its_fan() {
    let corners: Vec<Vec<f64>> = (0..5)
        .map(|k| (f64::from(k) * std::f64::consts::TAU / 5.0).sin_cos())
        .map(|(y, x)| vec![f64::from(x as f32), f64::from(y as f32), 0.0])
        .collect();
    let vertex = Element {
        items: corners,
        ..square()
    };
    let mesh = mesh(&[vertex, faces(&[&[5., 0., 1., 2., 3., 4.]])]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    assert!(mesh.warnings.is_empty());
}

#[test]
fn a_polygon_that_its_fan_does_not_tile_is_reported() {
    // An arrow head with its notch at vertex 3, and one more corner: from vertex 0 the fan folds back.
    let points: [&[f64]; 5] = [
        &[0., 0., 0.],
        &[2., 0., 0.],
        &[4., 4., 0.],
        &[1., 0.5, 0.],
        &[0.2, 4., 0.],
    ];
    let vertex = Element::new("vertex", &XYZ, &points);
    let folded = mesh(&[
        vertex.clone(),
        faces(&[&[3., 0., 1., 2.], &[5., 1., 2., 3., 4., 0.]]),
    ]);
    assert_eq!(
        folded.warnings,
        [PlyWarning::FoldedPolygons { count: 1, first: 1 }]
    );
    assert_eq!(folded.triangles.len(), 4);
    // Seen from the notch it is star-shaped, and the fan is right.
    let star = mesh(&[vertex, faces(&[&[5., 3., 4., 0., 1., 2.]])]);
    assert!(star.warnings.is_empty(), "{:?}", star.warnings);
}

#[test]
fn triangles_with_vertices_that_are_not_finite_are_dropped_and_reported() {
    for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut vertex = square();
        vertex.items[1][2] = odd;
        let columns = [CORNERS, "int face_indices"];
        let items: [&[f64]; 3] = [
            &[3., 0., 1., 2., 7.],
            &[3., 0., 2., 3., 8.],
            &[4., 0., 1., 2., 3., 9.],
        ];
        let elements = [vertex, Element::new("face", &columns, &items)];
        // ply-rs takes no such words in ASCII; this reader does.
        let mesh = mesh_in(&[Encoding::Little, Encoding::Big], &elements);
        let ascii = decode(&encode(Encoding::Ascii, &elements)).unwrap();
        assert_eq!(format!("{mesh:?}"), format!("{ascii:?}"));
        assert_eq!(mesh.triangles, [[0, 2, 3], [3, 0, 2]]);
        assert_eq!(mesh.face_indices, [8, 9]);
        assert_eq!(mesh.positions.len(), 4);
        let warning = PlyWarning::NonFiniteVertices {
            count: 1,
            first: 1,
            dropped: 2,
        };
        assert_eq!(mesh.warnings, [warning]);
    }
}

#[test]
fn doubles_beyond_single_precision_are_not_finite() {
    let item: &[f64] = &[1e300, 0., 0.];
    let vertex = Element::new("vertex", &["double x", "double y", "double z"], &[item]);
    let mesh = mesh_in(
        &[Encoding::Little, Encoding::Big],
        &[vertex, faces(&[&[3., 0., 0., 0.]])],
    );
    assert!(mesh.triangles.is_empty());
}

#[test]
fn normals_and_texture_coordinates_that_cannot_be_used_are_zeroed_and_reported() {
    let columns = ["float nx", "float ny", "float nz", "float u", "float v"];
    let mut vertex = one_vertex(&columns, &[0., 0., 1., 0.5, 0.5]);
    for values in [[0., 0., 0., 0., f64::NAN], [f64::NAN, 0., 1., 0., 0.]] {
        vertex.items.push([&[1., 2., 3.], &values[..]].concat());
    }
    let mesh = mesh_in(&[Encoding::Little, Encoding::Big], &[vertex, faces(&[])]);
    assert_eq!(mesh.normals, [[0., 0., 1.], [0.; 3], [0.; 3]]);
    assert_eq!(mesh.uvs, [[0.5, 0.5], [0.; 2], [0.; 2]]);
    let normals = PlyWarning::UnusableNormals { count: 2, first: 1 };
    assert_eq!(
        mesh.warnings,
        [normals, PlyWarning::NonFiniteUvs { count: 1, first: 1 }]
    );
}

#[test]
fn an_index_outside_the_vertices_is_an_error_with_face_and_index() {
    for index in [4., 200., -5., 2147483647.] {
        for face in [
            &[3., 0., 1., index][..],
            &[4., index, 0., 1., 2.],
            &[5., 0., 1., 2., 3., index],
        ] {
            for error in errors(&[square(), faces(&[&[3., 0., 1., 2.], face])]) {
                let expected = format!("face 1 uses vertex {index}, but there are 4 vertices");
                assert!(error.to_string().ends_with(&expected), "{error}");
                assert!(matches!(
                    error,
                    PlyError::Invalid {
                        at: Place::Line(_) | Place::Byte(_),
                        ..
                    }
                ));
            }
        }
    }
}

#[test]
fn errors_in_ascii_name_the_line_and_in_binary_the_byte() {
    let elements = [square(), faces(&[&[3., 0., 1., 2.], &[3., 0., 1., 9.]])];
    let [ascii, little, _] = errors(&elements);
    let is_at =
        |error: PlyError, place| matches!(error, PlyError::Invalid { at, .. } if at == place);
    // Ten lines of header, four vertices, two faces.
    assert!(is_at(ascii, Place::Line(16)));
    let whole = encode(Encoding::Little, &elements).len();
    assert!(is_at(little, Place::Byte(whole - 13)));
}

#[test]
fn fractions_are_not_indices() {
    let face = Element::new(
        "face",
        &["list uchar float vertex_indices"],
        &[&[3., 0., 1., 1.5]],
    );
    for error in errors(&[square(), face]) {
        assert!(error.to_string().contains("vertex 1.5"), "{error}");
    }
}

#[test]
fn negative_list_lengths_are_errors() {
    for length in ["char", "short", "int"] {
        let corners: &'static str = format!("list {length} int vertex_indices").leak();
        let face = Element::new("face", &[corners], &[&[-1.]]);
        for encoding in ENCODINGS {
            let bytes = encode(encoding, &[square(), face.clone()]);
            for route in [Route::Fastest, Route::General] {
                assert!(matches!(
                    decode_by(&bytes, route),
                    Err(PlyError::Invalid { .. })
                ));
            }
        }
    }
}

#[test]
fn every_cut_of_a_file_is_an_error_and_never_a_panic() {
    let columns = [
        "double w",
        "list uchar int vertex_indices",
        "int face_indices",
    ];
    let face = Element::new(
        "face",
        &columns,
        &[&[0.5, 3., 0., 1., 2., 1.], &[0.5, 4., 0., 1., 2., 3., 2.]],
    );
    for encoding in ENCODINGS {
        let whole = encode(encoding, &[square(), face.clone()]);
        // The last number of ASCII may lose its space and its line end and still be there.
        let end = whole.len() - if encoding == Encoding::Ascii { 2 } else { 0 };
        for cut in 0..end {
            for route in [Route::Fastest, Route::General] {
                let result = decode_by(&whole[..cut], route);
                assert!(
                    matches!(result, Err(PlyError::Invalid { .. })),
                    "{encoding:?} {route:?} {cut}"
                );
            }
        }
    }
}

#[test]
fn damaged_bytes_never_panic() {
    for encoding in ENCODINGS {
        let whole = encode(
            encoding,
            &[square(), faces(&[&[3., 0., 1., 2.], &[4., 0., 1., 2., 3.]])],
        );
        for at in 0..whole.len() {
            for value in [0, 1, b' ', b'-', b'9', 0x7f, 0x80, 0xff] {
                let mut bytes = whole.clone();
                bytes[at] = value;
                for route in [Route::Fastest, Route::General] {
                    if let Ok(mesh) = decode_by(&bytes, route) {
                        let n = mesh.positions.len() as u32;
                        assert!(mesh.triangles.iter().flatten().all(|&i| i < n));
                    }
                }
            }
        }
    }
}

#[test]
fn counts_beyond_the_file_fail_at_once() {
    let start = Instant::now();
    let xyz = ["property float x", "property float y", "property float z"];
    let corners = "property list uint int vertex_indices";
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for route in [Route::Fastest, Route::General] {
            for count in [
                "1000000000",
                "2147483647",
                "4294967295",
                "18446744073709551615",
                "99999999999999999999",
            ] {
                let count = format!("element vertex {count}");
                let mut bytes = header(
                    format,
                    &[&count, xyz[0], xyz[1], xyz[2], "element face 1", corners],
                );
                bytes.extend([b' '; 50]);
                assert!(decode_by(&bytes, route).is_err(), "{format} {count}");
            }
            // A list of 2^32 - 1 corners, and 10^9 faces.
            let n_faces = "element face 1000000000";
            let mut bytes = header(
                format,
                &["element vertex 0", xyz[0], xyz[1], xyz[2], n_faces, corners],
            );
            bytes.extend([0xff; 50]);
            assert!(decode_by(&bytes, route).is_err());
            // Items without properties take no bytes: they are not counted out.
            let bytes = header(
                format,
                &[
                    "element nothing 1000000000000",
                    "element vertex 0",
                    xyz[0],
                    xyz[1],
                    xyz[2],
                ],
            );
            assert_eq!(
                decode_by(&bytes, route).unwrap().warnings,
                [PlyWarning::NoFaces]
            );
        }
    }
    assert!(start.elapsed() < Duration::from_secs(2));
}

#[test]
fn headers_that_make_no_mesh_are_errors() {
    let xyz = "property float x\nproperty float y\nproperty float z";
    let invalid: [(&[&str], &str); 7] = [
        (
            &["element face 0", "property list uchar int vertex_indices"],
            "no element `vertex`",
        ),
        (
            &["element vertex 0", "property float x", "property float y"],
            "no property `z`",
        ),
        (
            &["element vertex 0", xyz, "property float x"],
            "declared twice",
        ),
        (
            &["element vertex 0", xyz, "element vertex 0", xyz],
            "declared twice",
        ),
        (
            &[
                "element vertex 0",
                xyz,
                "element face 0",
                "property int vertex_indices",
            ],
            "instead of a list",
        ),
        (
            &[
                "element vertex 0",
                "property list uchar float x\nproperty float y\nproperty float z",
            ],
            "is a list",
        ),
        (
            &[
                "element vertex 0",
                xyz,
                "element face 0",
                "property list float int vertex_indices",
            ],
            "not an integer",
        ),
    ];
    for (lines, message) in invalid {
        let error = decode(&header("ascii", lines)).unwrap_err();
        assert!(
            matches!(error, PlyError::Invalid { .. }) && error.to_string().contains(message),
            "{error}"
        );
    }
    for bytes in [
        &b""[..],
        b"ply",
        b"ply\n",
        b"obj\nend_header\n",
        b"ply\nend_header\n",
        b"ply\nformat ascii 1.0\n",
    ] {
        assert!(matches!(decode(bytes), Err(PlyError::Invalid { .. })));
    }
    let error = decode(b"ply\nformat ascii 1.0\nelement vertex many\nend_header\n").unwrap_err();
    assert!(
        matches!(
            error,
            PlyError::Invalid {
                at: Place::Line(3),
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn what_is_not_known_is_unsupported_rather_than_invalid() {
    let xyz = "property float x\nproperty float y\nproperty float z";
    let strips = [
        "element vertex 0",
        xyz,
        "element tristrips 0",
        "property list int int vertex_indices",
    ];
    let version = b"ply\nformat ascii 2.0\nelement vertex 0\nproperty float x\nend_header\n";
    for bytes in [header("ascii", &strips), version.to_vec()] {
        assert!(matches!(decode(&bytes), Err(PlyError::Unsupported { .. })));
    }
}

#[test]
fn headers_end_their_lines_in_any_way_and_comment_in_any_character_set() {
    let body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let text = format!(
        "ply\nformat ascii 1.0\ncomment M?ller\n\nobj_info\n  element vertex 3  \nproperty float x\nproperty float y\n\
         property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n{body}"
    );
    for end in ["\n", "\r\n", "\r"] {
        let mut bytes = text.replace('\n', end).into_bytes();
        let at = bytes.iter().position(|&b| b == b'?').unwrap();
        bytes[at] = 0xfc;
        for route in [Route::Fastest, Route::General] {
            assert_eq!(
                decode_by(&bytes, route).unwrap().triangles,
                [[0, 1, 2]],
                "{end:?}"
            );
        }
    }
}

#[test]
fn ascii_numbers_are_spelled_as_in_c_and_need_no_lines() {
    let lines = [
        "element vertex 3",
        "property float x",
        "property float y",
        "property float z",
        "element face 1",
        "property list uchar int vertex_indices",
    ];
    let mut bytes = header("ascii", &lines);
    bytes.extend(b".5 1. +2e0\n-0.25\t1E-2 0x10 1 2 3 3\n0 1\r\n2");
    let mesh = decode(&bytes).unwrap();
    assert_eq!(
        mesh.positions,
        [[0.5, 1., 2.], [-0.25, 0.01, 16.], [1., 2., 3.]]
    );
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    let mut bytes = header("ascii", &lines);
    bytes.extend(b"0 0 0\n0 zero 0\n0 0 0\n3 0 1 2\n");
    let error = decode(&bytes).unwrap_err();
    assert_eq!(
        error.to_string(),
        "invalid PLY file: line 11: `zero` is not a number"
    );
}

#[test]
fn gzipped_files_are_read_and_bombs_refused() {
    let gzip = |bytes: &[u8]| {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::new(9));
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    };
    let whole = encode(Encoding::Little, &[square(), faces(&[&[3., 0., 1., 2.]])]);
    let packed = gzip(&whole);
    assert_eq!(decode(&packed).unwrap(), decode(&whole).unwrap());
    assert!(matches!(
        decode(&packed[..packed.len() - 9]),
        Err(PlyError::Invalid { .. })
    ));
    let bomb = gzip(&vec![b' '; 64 << 20]);
    assert!(matches!(decode(&bomb), Err(PlyError::Unsupported { .. })));
}

#[test]
#[expect(clippy::print_stdout)] // Says that it was skipped.
fn both_routes_agree_on_the_example_scenes() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/scenes");
    let mut folders = vec![std::path::PathBuf::from(root)];
    let mut n_files = 0;
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else {
            println!("skipped: no {}", folder.display());
            return;
        };
        for path in entries.map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "ply") {
                let bytes = std::fs::read(&path).unwrap();
                let fast = decode_by(&bytes, Route::Fastest).unwrap();
                let general = decode_by(&bytes, Route::General).unwrap();
                assert!(
                    fast == general && !fast.triangles.is_empty(),
                    "{}",
                    path.display()
                );
                n_files += 1;
            }
        }
    }
    assert!(n_files > 0);
}
