//! What the PLY decoder promises.

use tyndall::shape::ply::{PlyError, PlyMesh, decode};

#[test]
fn a_quad_in_ascii_becomes_the_two_triangles_of_pbrt() {
    let text = b"ply\nformat ascii 1.0\ncomment M\xfcller\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n\
        0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    let mesh: Result<PlyMesh, PlyError> = decode(text);
    assert_eq!(mesh.unwrap().triangles, [[0, 1, 2], [3, 0, 2]]);
}
