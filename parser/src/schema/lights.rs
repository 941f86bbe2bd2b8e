//! The lights and the area light.

use super::Type::File;
use super::words::{boolean, float, int, param, plugin, point3, spectrum};
use super::{Default, ParamSchema, PluginSchema};

const SCALE: ParamSchema = spectrum(
    "scale",
    1.0,
    "Multiplies the emission; a spectrum, so `rgb scale`, not `float scale`.",
);
const INTENSITY: &[ParamSchema] = &[spectrum("I", 1.0, "Radiant intensity.").unit("W/sr"), SCALE];
const SAMPLES: ParamSchema = int(
    "samples",
    1,
    "Shadow rays of each point, for `directlighting` with strategy `all`.",
)
.fallback(&["nsamples"])
.at_least(1.0);

const fn map(meaning: &'static str) -> ParamSchema {
    param("mapname", &[File], Default::Absent, meaning)
}

pub(super) static LIGHTS: &[PluginSchema] = &[
    plugin(
        "point",
        "A point that shines all round.",
        &[
            INTENSITY,
            &[point3(
                "from",
                [0.0; 3],
                "Its place, added in world space after the CTM.",
            )
            .unit("world space")],
        ],
    ),
    plugin(
        "spot",
        "A point that shines into a cone.",
        &[
            INTENSITY,
            &[
                point3("from", [0.0; 3], "Its place.").unit("light space"),
                point3("to", [0.0, 0.0, 1.0], "A point on the axis of the cone.")
                    .unit("light space"),
                float("coneangle", 30.0, "Half angle of the cone.")
                    .unit("degrees")
                    .inside(0.0, 180.0),
                float(
                    "conedeltaangle",
                    5.0,
                    "Width of the soft edge inside the cone.",
                )
                .unit("degrees")
                .at_least(0.0),
            ],
        ],
    ),
    plugin(
        "goniometric",
        "A point whose intensity follows a picture of directions.",
        &[
            INTENSITY,
            &[map(
                "Latitude-longitude picture, poles on ±y; constant 1 without it.",
            )],
        ],
    ),
    plugin(
        "projection",
        "A point that projects a picture along +z.",
        &[
            INTENSITY,
            &[
                float("fov", 45.0, "Full angle along the shorter axis.")
                    .unit("degrees")
                    .inside(0.0, 180.0),
                map("The picture; a white square without it."),
            ],
        ],
    ),
    plugin(
        "distant",
        "Parallel light, as from the sun.",
        &[&[
            spectrum("L", 1.0, "Irradiance across the direction.").unit("W/m²"),
            SCALE,
            point3("from", [0.0; 3], "Start of the direction.").unit("light space"),
            point3("to", [0.0, 0.0, 1.0], "End of the direction.").unit("light space"),
        ]],
    ),
    plugin(
        "infinite",
        "Light from all around, +z up.",
        &[&[
            spectrum("L", 1.0, "Radiance; multiplies the map.").unit("W/(m² sr)"),
            SCALE,
            map("Latitude-longitude picture; constant `L` without it."),
            SAMPLES,
        ]],
    )
    .alias(&["exinfinite"]),
];

pub(super) static AREA_LIGHTS: &[PluginSchema] = &[plugin(
    "diffuse",
    "Every point of the shape emits the same in all directions.",
    &[&[
        spectrum("L", 1.0, "Emitted radiance.").unit("W/(m² sr)"),
        SCALE,
        boolean(
            "twosided",
            false,
            "Emits on both sides, not only where the normal points.",
        ),
        SAMPLES,
    ]],
)
.alias(&["area"])];
