//! The texture classes. Most exist for float and for spectrum textures; some only for spectrum textures.

use super::Type::{Choice, File, Float, IntChoice, OwnTexture};
use super::words::{
    boolean, choice, float, float_tex, int, own_constant, own_tex, param, plugin, vector3,
};
use super::{Default, ParamSchema, PluginSchema};

/// How a surface point becomes a texture coordinate (s, t).
const MAPPING: &[ParamSchema] = &[
    choice(
        "mapping",
        &[Choice(&["uv", "spherical", "cylindrical", "planar"])],
        "uv",
        "Where (s, t) comes from.",
    ),
    float("uscale", 1.0, "Multiplies u; `uv` only."),
    float("vscale", 1.0, "Multiplies v; `uv` only."),
    float("udelta", 0.0, "Added to s; `uv` and `planar`."),
    float("vdelta", 0.0, "Added to t; `uv` and `planar`."),
    vector3(
        "v1",
        [1.0, 0.0, 0.0],
        "Direction of s in world space; `planar` only.",
    ),
    vector3(
        "v2",
        [0.0, 1.0, 0.0],
        "Direction of t in world space; `planar` only.",
    ),
];

const OCTAVES: ParamSchema = int("octaves", 8, "Layers of noise.").between(0.0, 64.0);
const ROUGHNESS: ParamSchema = float(
    "roughness",
    0.5,
    "Strength of each layer relative to the one before.",
);

const CONSTANT: PluginSchema = plugin(
    "constant",
    "The same everywhere.",
    &[&[own_constant("value", 1.0, "The value.")]],
);

const SCALE: PluginSchema = plugin(
    "scale",
    "Product of two textures.",
    &[&[
        own_tex("tex1", 1.0, "First factor."),
        own_tex("tex2", 1.0, "Second factor."),
    ]],
);

const MIX: PluginSchema = plugin(
    "mix",
    "Blend of two textures.",
    &[&[
        own_tex("tex1", 0.0, "What `amount` 0 shows."),
        own_tex("tex2", 1.0, "What `amount` 1 shows."),
        float_tex("amount", 0.5, "Weight of `tex2`."),
    ]],
);

const BILERP: PluginSchema = plugin(
    "bilerp",
    "Bilinear blend of four corner values.",
    &[
        &[
            own_constant("v00", 0.0, "Value at (0, 0)."),
            own_constant("v01", 1.0, "Value at (0, 1)."),
            own_constant("v10", 0.0, "Value at (1, 0)."),
            own_constant("v11", 1.0, "Value at (1, 1)."),
        ],
        MAPPING,
    ],
);

const IMAGEMAP: PluginSchema = plugin(
    "imagemap",
    "A picture from a file.",
    &[
        &[
            param(
                "filename",
                &[File],
                Default::Required,
                "PNG, TGA, JPEG, HDR, PFM or EXR file.",
            ),
            choice(
                "wrap",
                &[Choice(&["repeat", "black", "clamp"])],
                "repeat",
                "What lies outside the picture.",
            ),
            float(
                "maxanisotropy",
                8.0,
                "Longest filter ellipse, relative to its width.",
            )
            .at_least(1.0),
            boolean(
                "trilinear",
                false,
                "Simpler filter than the elliptical one.",
            ),
            float("scale", 1.0, "Multiplies the values."),
            param(
                "gamma",
                &[super::Type::Bool],
                Default::Formula("true for .png, .tga, .jpg"),
                "Decodes sRGB.",
            ),
        ],
        MAPPING,
    ],
);

const UV: PluginSchema = plugin("uv", "Shows (s, t) as red and green.", &[MAPPING]);

const CHECKERBOARD: PluginSchema = plugin(
    "checkerboard",
    "Chequers of two textures.",
    &[
        &[
            param(
                "dimension",
                &[IntChoice(&[2, 3])],
                Default::Int(2),
                "Squares of (s, t), or cubes of texture space.",
            ),
            param("tex1", &[OwnTexture], Default::Number(1.0), "Even fields."),
            param("tex2", &[OwnTexture], Default::Number(0.0), "Odd fields."),
            choice(
                "aamode",
                &[Choice(&["closedform", "none"])],
                "closedform",
                "How edges are smoothed; dimension 2 only.",
            ),
        ],
        MAPPING,
    ],
);

const DOTS: PluginSchema = plugin(
    "dots",
    "Random dots. As in pbrt-v3 the two names are swapped: `inside` colours the ground.",
    &[
        &[
            own_tex("inside", 1.0, "The ground."),
            own_tex("outside", 0.0, "The dots."),
        ],
        MAPPING,
    ],
);

const FBM: PluginSchema = plugin("fbm", "Sum of layers of noise.", &[&[OCTAVES, ROUGHNESS]]);
const WRINKLED: PluginSchema = plugin(
    "wrinkled",
    "Sum of layers of absolute noise.",
    &[&[OCTAVES, ROUGHNESS]],
);
const WINDY: PluginSchema = plugin("windy", "Waves under gusts.", &[]);

const MARBLE: PluginSchema = plugin(
    "marble",
    "Veins of marble.",
    &[&[
        OCTAVES,
        ROUGHNESS,
        float("scale", 1.0, "Multiplies the position."),
        float("variation", 0.2, "How far the veins are bent."),
    ]],
);

const PTEX: PluginSchema = plugin(
    "ptex",
    "A Ptex file, one picture for each face.",
    &[&[
        param(
            "filename",
            &[File],
            Default::Required,
            "Ptex file with 1 or 3 channels.",
        ),
        param(
            "gamma",
            &[Float],
            Default::Number(2.2),
            "Exponent applied to the values.",
        )
        .above(0.0),
    ]],
);

pub(super) static FLOAT_TEXTURES: &[PluginSchema] = &[
    CONSTANT,
    SCALE,
    MIX,
    BILERP,
    IMAGEMAP,
    CHECKERBOARD,
    DOTS,
    FBM,
    WRINKLED,
    WINDY,
    PTEX,
];

pub(super) static SPECTRUM_TEXTURES: &[PluginSchema] = &[
    CONSTANT,
    SCALE,
    MIX,
    BILERP,
    IMAGEMAP,
    UV,
    CHECKERBOARD,
    DOTS,
    FBM,
    WRINKLED,
    WINDY,
    MARBLE,
    PTEX,
];
