//! The shapes.

use super::Type::{
    Choice, Float, FloatTexture, Floats, Int, IntChoice, Ints, Normals, Point2s, Point3s, Vector3s,
};
use super::words::{MANY, choice, file, float, int, list, param, plugin, point3};
use super::{Default, ParamSchema, PluginSchema};

const PHI_MAX: ParamSchema = float("phimax", 360.0, "Angle swept about the z axis.")
    .unit("degrees")
    .clamped(0.0, 360.0);

const fn radius(meaning: &'static str) -> ParamSchema {
    float("radius", 1.0, meaning)
        .unit("object space")
        .at_least(0.0)
}

const fn height(name: &'static str, default: f32, meaning: &'static str) -> ParamSchema {
    float(name, default, meaning).unit("object space")
}

const ALPHA: &[ParamSchema] = &[
    param(
        "alpha",
        &[FloatTexture],
        Default::Absent,
        "Cut-out: there is no surface where it is 0.",
    ),
    param(
        "shadowalpha",
        &[FloatTexture],
        Default::Absent,
        "The same, for shadow rays only.",
    ),
];

const INDICES: ParamSchema = list(
    "indices",
    &[Ints(MANY)],
    "Three vertex numbers for each triangle.",
)
.required();
const VERTICES: ParamSchema = list("P", &[Point3s], "Vertex positions.")
    .unit("object space")
    .required();

pub(super) static SHAPES: &[PluginSchema] = &[
    plugin(
        "sphere",
        "Sphere about the origin, its poles on the z axis.",
        &[&[
            radius("Radius."),
            height("zmin", 0.0, "Cut off below.").formula("-radius"),
            height("zmax", 0.0, "Cut off above.").formula("radius"),
            PHI_MAX,
        ]],
    ),
    plugin(
        "cylinder",
        "Open cylinder around the z axis.",
        &[&[
            radius("Radius."),
            height("zmin", -1.0, "Lower end."),
            height("zmax", 1.0, "Upper end."),
            PHI_MAX,
        ]],
    ),
    plugin(
        "disk",
        "Disk or ring across the z axis, normal +z.",
        &[&[
            height("height", 0.0, "Place on the z axis."),
            radius("Outer radius."),
            float("innerradius", 0.0, "Radius of the hole.")
                .unit("object space")
                .at_least(0.0),
            PHI_MAX,
        ]],
    ),
    plugin(
        "cone",
        "Open cone around the z axis, its base at z = 0.",
        &[&[
            radius("Radius of the base."),
            height("height", 1.0, "Place of the tip on the z axis."),
            PHI_MAX,
        ]],
    ),
    plugin(
        "paraboloid",
        "Open paraboloid around the z axis, its tip at the origin.",
        &[&[
            radius("Radius at `zmax`."),
            height("zmin", 0.0, "Lower end."),
            height("zmax", 1.0, "Upper end."),
            PHI_MAX,
        ]],
    ),
    plugin(
        "hyperboloid",
        "A segment swept about the z axis.",
        &[&[
            point3(
                "p1",
                [0.0, 0.0, 0.0],
                "One end of the segment; the defaults sweep a cone.",
            )
            .unit("object space"),
            point3("p2", [1.0, 1.0, 1.0], "The other end.").unit("object space"),
            PHI_MAX,
        ]],
    ),
    plugin(
        "trianglemesh",
        "Triangles that share vertices.",
        &[
            &[
                INDICES,
                VERTICES,
                list("N", &[Normals], "Shading normal of each vertex."),
                list("S", &[Vector3s], "Tangent of each vertex."),
                list(
                    "uv",
                    &[Point2s, Floats(MANY)],
                    "Texture coordinates of each vertex.",
                )
                .fallback(&["st"]),
                list("faceIndices", &[Ints(MANY)], "Ptex face of each triangle."),
            ],
            ALPHA,
        ],
    ),
    plugin(
        "plymesh",
        "Triangles and quadrilaterals from a PLY file.",
        &[&[file("filename", "PLY file, text or binary.")], ALPHA],
    ),
    plugin(
        "curve",
        "Thin ribbon or tube along a cubic or quadratic spline.",
        &[&[
            choice(
                "type",
                &[Choice(&["flat", "cylinder", "ribbon"])],
                "flat",
                "Faces the ray, is shaded as a tube, or has normals.",
            )
            .otherwise("cylinder"),
            choice(
                "basis",
                &[Choice(&["bezier", "bspline"])],
                "bezier",
                "What the control points mean.",
            )
            .strict(),
            param(
                "degree",
                &[IntChoice(&[2, 3])],
                Default::Int(3),
                "Degree of the spline.",
            ),
            list("P", &[Point3s], "Control points.")
                .unit("object space")
                .required(),
            float("width", 1.0, "Full width.")
                .unit("object space")
                .at_least(0.0),
            float("width0", 1.0, "Full width at the start.")
                .formula("width")
                .unit("object space")
                .at_least(0.0),
            float("width1", 1.0, "Full width at the end.")
                .formula("width")
                .unit("object space")
                .at_least(0.0),
            list(
                "N",
                &[Normals],
                "Normal at the start of each segment and the end of the last; a ribbon needs them.",
            ),
            param(
                "splitdepth",
                &[Float, Int],
                Default::Int(3),
                "Each segment is bounded in 2^splitdepth parts.",
            )
            .between(0.0, 10.0),
        ]],
    ),
    plugin(
        "loopsubdiv",
        "Limit surface of Loop subdivision of a triangle mesh.",
        &[&[
            int("levels", 3, "How often the mesh is refined.")
                .fallback(&["nlevels"])
                .between(0.0, 10.0),
            INDICES,
            VERTICES,
            choice(
                "scheme",
                &[Choice(&["loop"])],
                "loop",
                "Read, but without effect.",
            ),
        ]],
    ),
    plugin(
        "heightfield",
        "Triangulated heights over the unit square.",
        &[&[
            int("nu", 0, "Heights along x.").required().at_least(2.0),
            int("nv", 0, "Heights along y.").required().at_least(2.0),
            list("Pz", &[Floats(MANY)], "nu · nv heights, x fastest.")
                .unit("object space")
                .required(),
        ]],
    ),
    plugin(
        "nurbs",
        "NURBS patch, diced to a fixed grid.",
        &[&[
            int("nu", 0, "Control points along u.")
                .required()
                .at_least(2.0),
            int("nv", 0, "Control points along v.")
                .required()
                .at_least(2.0),
            int("uorder", 0, "Degree along u, plus 1.")
                .required()
                .at_least(2.0),
            int("vorder", 0, "Degree along v, plus 1.")
                .required()
                .at_least(2.0),
            list("uknots", &[Floats(MANY)], "nu + uorder knots.").required(),
            list("vknots", &[Floats(MANY)], "nv + vorder knots.").required(),
            float("u0", 0.0, "Start of the u range.").formula("uknots[uorder - 1]"),
            float("u1", 0.0, "End of the u range.").formula("uknots[nu]"),
            float("v0", 0.0, "Start of the v range.").formula("vknots[vorder - 1]"),
            float("v1", 0.0, "End of the v range.").formula("vknots[nv]"),
            list(
                "P",
                &[Point3s],
                "nu · nv control points, u fastest; this or `Pw`.",
            )
            .unit("object space"),
            list(
                "Pw",
                &[Floats(MANY)],
                "nu · nv homogeneous control points x y z w, as they are.",
            )
            .unit("object space"),
        ]],
    ),
];
