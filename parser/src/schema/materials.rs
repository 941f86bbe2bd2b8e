//! The materials.

use super::Type::{FloatTexture, SpectrumTexture, String};
use super::media::PRESETS;
use super::words::{boolean, choice, file, float, float_tex, param, plugin, spectrum_tex, text};
use super::{Default, ParamSchema, PluginSchema};

/// Carried by `MakeNamedMaterial`, which has the kind among its parameters.
const TYPE: ParamSchema = param(
    "type",
    &[String],
    Default::Absent,
    "The kind, for `MakeNamedMaterial`.",
);

/// What nearly every material has.
const COMMON: &[ParamSchema] = &[
    TYPE,
    param(
        "bumpmap",
        &[FloatTexture],
        Default::Absent,
        "Displacement that bends the shading normal.",
    )
    .unit("object space"),
];

const REMAP: ParamSchema = boolean(
    "remaproughness",
    true,
    "Roughness is perceptual, 0 to 1; false makes it the microfacet width.",
);

const fn rough(name: &'static str, default: f32, meaning: &'static str) -> ParamSchema {
    float_tex(name, default, meaning).clamped(0.0, f64::INFINITY)
}

const fn fraction(name: &'static str, default: f32, meaning: &'static str) -> ParamSchema {
    float_tex(name, default, meaning)
}

const ETA: ParamSchema = float_tex("eta", 1.5, "Index of refraction inside.")
    .fallback(&["index"])
    .above(0.0);

/// The rough dielectric boundary of glass and the subsurface materials.
const BOUNDARY: &[ParamSchema] = &[
    spectrum_tex("Kr", 1.0, "Reflectance of the boundary."),
    spectrum_tex("Kt", 1.0, "Transmittance of the boundary."),
    rough("uroughness", 0.0, "Roughness along u."),
    rough("vroughness", 0.0, "Roughness along v."),
    REMAP,
];

const SUBSURFACE_ETA: ParamSchema = float(
    "eta",
    1.33,
    "Index of refraction inside; there is no `index` here.",
)
.above(0.0);
const SUBSURFACE_G: ParamSchema = float("g", 0.0, "Mean cosine of scattering.").between(-1.0, 1.0);

pub(super) static MATERIALS: &[PluginSchema] = &[
    plugin(
        "matte",
        "Diffuse: Lambert, or Oren-Nayar when `sigma` is above 0.",
        &[
            &[
                spectrum_tex("Kd", 0.5, "Diffuse reflectance."),
                float_tex("sigma", 0.0, "Spread of the facets' slopes.")
                    .unit("degrees")
                    .clamped(0.0, 90.0),
            ],
            COMMON,
        ],
    ),
    plugin(
        "plastic",
        "Diffuse base and glossy coat.",
        &[
            &[
                spectrum_tex("Kd", 0.25, "Diffuse reflectance."),
                spectrum_tex("Ks", 0.25, "Glossy reflectance."),
                rough("roughness", 0.1, "Roughness of the coat."),
                REMAP,
            ],
            COMMON,
        ],
    ),
    plugin(
        "translucent",
        "Thin sheet that reflects and transmits, diffuse and glossy; index of refraction 1.5.",
        &[
            &[
                spectrum_tex("Kd", 0.25, "Diffuse colour."),
                spectrum_tex("Ks", 0.25, "Glossy colour."),
                spectrum_tex("reflect", 0.5, "Share that is reflected."),
                spectrum_tex("transmit", 0.5, "Share that is transmitted."),
                rough("roughness", 0.1, "Roughness of the glossy part."),
                REMAP,
            ],
            COMMON,
        ],
    ),
    plugin(
        "glass",
        "Smooth or rough dielectric; there is no plain `roughness`.",
        &[&[ETA], BOUNDARY, COMMON],
    ),
    plugin(
        "mirror",
        "Perfect mirror.",
        &[&[spectrum_tex("Kr", 0.9, "Reflectance.")], COMMON],
    ),
    plugin(
        "metal",
        "Rough conductor.",
        &[
            &[
                param(
                    "eta",
                    &[SpectrumTexture],
                    Default::Formula("copper"),
                    "Index of refraction.",
                ),
                param(
                    "k",
                    &[SpectrumTexture],
                    Default::Formula("copper"),
                    "Absorption coefficient.",
                ),
                rough("roughness", 0.01, "Roughness along both axes."),
                rough("uroughness", 0.0, "Roughness along u.").formula("roughness"),
                rough("vroughness", 0.0, "Roughness along v.").formula("roughness"),
                REMAP,
            ],
            COMMON,
        ],
    ),
    plugin(
        "substrate",
        "Diffuse base under a rough coat (Ashikhmin-Shirley); there is no plain `roughness`.",
        &[
            &[
                spectrum_tex("Kd", 0.5, "Diffuse reflectance."),
                spectrum_tex("Ks", 0.5, "Reflectance of the coat, seen straight on."),
                rough("uroughness", 0.1, "Roughness along u."),
                rough("vroughness", 0.1, "Roughness along v."),
                REMAP,
            ],
            COMMON,
        ],
    ),
    plugin(
        "uber",
        "Diffuse, glossy, mirror and transparent parts in one.",
        &[
            &[
                spectrum_tex("Kd", 0.25, "Diffuse reflectance."),
                spectrum_tex("Ks", 0.25, "Glossy reflectance."),
                spectrum_tex("Kr", 0.0, "Mirror reflectance."),
                spectrum_tex("Kt", 0.0, "Specular transmittance."),
                rough("roughness", 0.1, "Roughness along both axes."),
                rough("uroughness", 0.0, "Roughness along u.").formula("roughness"),
                rough("vroughness", 0.0, "Roughness along v.").formula("uroughness"),
                ETA,
                spectrum_tex(
                    "opacity",
                    1.0,
                    "Share of light that meets the surface at all.",
                ),
                REMAP,
            ],
            COMMON,
        ],
    ),
    plugin(
        "mix",
        "Two named materials, blended.",
        &[&[
            text("namedmaterial1", "", "The first material.").required(),
            text("namedmaterial2", "", "The second material.").required(),
            spectrum_tex(
                "amount",
                0.5,
                "Weight of the *first* material; the second gets the rest.",
            ),
            TYPE,
        ]],
    ),
    plugin(
        "subsurface",
        "Dielectric boundary around a scattering inside, given by its coefficients.",
        &[
            &[
                choice("name", PRESETS, "", "Measured coefficients by name."),
                param(
                    "sigma_a",
                    &[SpectrumTexture],
                    Default::Rgb([0.0011, 0.0024, 0.014]),
                    "Absorption; wins over `name`.",
                )
                .unit("per scene unit"),
                param(
                    "sigma_s",
                    &[SpectrumTexture],
                    Default::Rgb([2.55, 3.21, 3.77]),
                    "Scattering; wins over `name`.",
                )
                .unit("per scene unit"),
                float("scale", 1.0, "Multiplies both coefficients.").at_least(0.0),
                SUBSURFACE_G,
                SUBSURFACE_ETA,
            ],
            BOUNDARY,
            COMMON,
        ],
    ),
    plugin(
        "kdsubsurface",
        "Dielectric boundary around a scattering inside, given by the colour it should show.",
        &[
            &[
                spectrum_tex("Kd", 0.5, "Diffuse reflectance to reach."),
                spectrum_tex("mfp", 1.0, "Mean free path.").unit("scene units"),
                float("scale", 1.0, "Multiplies the mean free path.").at_least(0.0),
                SUBSURFACE_G,
                SUBSURFACE_ETA,
            ],
            BOUNDARY,
            COMMON,
        ],
    ),
    plugin(
        "fourier",
        "Measured or simulated BSDF from a table.",
        &[
            &[file("bsdffile", "Table of Fourier coefficients.")],
            COMMON,
        ],
    ),
    plugin(
        "hair",
        "Hair fibre, for curves.",
        &[&[
            param(
                "sigma_a",
                &[SpectrumTexture],
                Default::Absent,
                "Absorption in the fibre; wins over the others.",
            )
            .unit("per fibre diameter"),
            param(
                "color",
                &[SpectrumTexture],
                Default::Absent,
                "Colour of dense hair; wins over the pigments.",
            ),
            param(
                "eumelanin",
                &[FloatTexture],
                Default::Formula("1.3 when nothing is given"),
                "Concentration of brown pigment.",
            )
            .at_least(0.0),
            param(
                "pheomelanin",
                &[FloatTexture],
                Default::Absent,
                "Concentration of red pigment.",
            )
            .at_least(0.0),
            float_tex("eta", 1.55, "Index of refraction.").above(0.0),
            float_tex("beta_m", 0.3, "Roughness along the fibre.").between(0.0, 1.0),
            float_tex("beta_n", 0.3, "Roughness around the fibre.").between(0.0, 1.0),
            float_tex("alpha", 2.0, "Tilt of the scales.").unit("degrees"),
            TYPE,
        ]],
    ),
    plugin(
        "disney",
        "Artists' material with many sliders.",
        &[
            &[
                spectrum_tex("color", 0.5, "Base colour."),
                fraction("metallic", 0.0, "Dielectric to metal."),
                float_tex("eta", 1.5, "Index of refraction.").above(0.0),
                rough(
                    "roughness",
                    0.5,
                    "Roughness; the microfacet width is its square.",
                ),
                fraction(
                    "speculartint",
                    0.0,
                    "Tints the highlight with the base colour.",
                ),
                fraction("anisotropic", 0.0, "Stretches the highlight."),
                fraction("sheen", 0.0, "Glow of cloth at grazing angles."),
                fraction("sheentint", 0.5, "Tints the sheen with the base colour."),
                fraction("clearcoat", 0.0, "Strength of a second, clear highlight."),
                fraction("clearcoatgloss", 1.0, "Glossiness of the clear coat."),
                fraction("spectrans", 0.0, "Opaque to glass-like."),
                spectrum_tex(
                    "scatterdistance",
                    0.0,
                    "How far light wanders beneath; not when thin.",
                )
                .unit("scene units"),
                boolean("thin", false, "A thin sheet instead of a solid."),
                fraction(
                    "flatness",
                    0.0,
                    "Flattens the diffuse part; only when thin.",
                ),
                float_tex(
                    "difftrans",
                    1.0,
                    "0 reflects, 2 transmits all diffuse light; only when thin.",
                )
                .between(0.0, 2.0),
            ],
            COMMON,
        ],
    ),
    plugin(
        "none",
        "No surface: only a boundary between media.",
        &[&[TYPE]],
    )
    .alias(&[""]),
];
