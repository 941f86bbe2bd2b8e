//! The plugins of the options block: camera, film, filter, sampler, accelerator, integrator.

use super::Type::{self, Choice, Float, Floats, Ints};
use super::words::{FOUR, boolean, choice, file, float, int, list, param, plugin, text};
use super::{Default, ParamSchema, PluginSchema};

const SHUTTER: &[ParamSchema] = &[
    float("shutteropen", 0.0, "When the shutter opens.").unit("time"),
    float(
        "shutterclose",
        1.0,
        "When the shutter closes; swapped with `shutteropen` if it comes first.",
    )
    .unit("time"),
];

const SCREEN: &[ParamSchema] = &[
    float(
        "frameaspectratio",
        1.0,
        "Width over height of the default screen window.",
    )
    .formula("xresolution / yresolution")
    .above(0.0),
    list(
        "screenwindow",
        &[Floats(FOUR)],
        "Screen window `x0 x1 y0 y1`; the shorter axis runs from -1 to 1 when absent.",
    ),
];

const LENS: &[ParamSchema] = &[
    float(
        "lensradius",
        0.0,
        "Radius of the thin lens; 0 is a pinhole.",
    )
    .unit("camera space")
    .at_least(0.0),
    float(
        "focaldistance",
        1e6,
        "Distance of the plane in focus, along +z.",
    )
    .unit("camera space")
    .above(0.0),
];

pub(super) static CAMERAS: &[PluginSchema] = &[
    plugin(
        "perspective",
        "Pinhole or thin-lens camera.",
        &[
            &[
                float("fov", 90.0, "Full angle of view along the shorter axis.")
                    .unit("degrees")
                    .inside(0.0, 180.0),
                float("halffov", -1.0, "Half of `fov`; wins over it when above 0.")
                    .unit("degrees")
                    .optional(),
            ],
            LENS,
            SCREEN,
            SHUTTER,
        ],
    ),
    plugin(
        "orthographic",
        "Parallel projection along +z.",
        &[LENS, SCREEN, SHUTTER],
    ),
    plugin(
        "environment",
        "All directions in one latitude-longitude picture, +y up.",
        &[
            &[
                float("lensradius", 0.0, "Read, but without effect.").at_least(0.0),
                float("focaldistance", 1e30, "Read, but without effect.").above(0.0),
            ],
            SCREEN,
            SHUTTER,
        ],
    ),
    plugin(
        "realistic",
        "Rays traced through the surfaces of a lens system.",
        &[
            &[
                file(
                    "lensfile",
                    "Lens table: radius, thickness, index, aperture diameter (mm) of each surface, scene side first.",
                ),
                float(
                    "aperturediameter",
                    1.0,
                    "Diameter of the stop; never larger than the lens table's.",
                )
                .unit("mm")
                .above(0.0),
                float("focusdistance", 10.0, "Distance of the plane in focus.")
                    .unit("scene units")
                    .above(0.0),
                boolean(
                    "simpleweighting",
                    true,
                    "Weights rays by cos⁴ and relative pupil area; false by absolute exposure.",
                ),
            ],
            SHUTTER,
        ],
    ),
];

pub(super) static FILMS: &[PluginSchema] = &[plugin(
    "image",
    "The picture that is written.",
    &[&[
        text(
            "filename",
            "pbrt.exr",
            "Output file, relative to the working directory; the extension is the format.",
        ),
        int("xresolution", 1280, "Width of the full picture.")
            .unit("pixels")
            .at_least(1.0),
        int("yresolution", 720, "Height of the full picture.")
            .unit("pixels")
            .at_least(1.0),
        list(
            "cropwindow",
            &[Floats(FOUR)],
            "Part that is rendered, `x0 x1 y0 y1` in fractions of the full picture.",
        ),
        float("scale", 1.0, "Multiplies every pixel."),
        float(
            "diagonal",
            35.0,
            "Diagonal of the sensor; only the realistic camera uses it.",
        )
        .unit("mm")
        .above(0.0),
        float(
            "maxsampleluminance",
            f32::INFINITY,
            "Brighter samples are dimmed to this luminance.",
        )
        .between(0.0, f64::INFINITY),
    ]],
)];

const fn width(default: f32) -> [ParamSchema; 2] {
    [
        float("xwidth", default, "Half the extent in x.")
            .unit("pixels")
            .above(0.0),
        float("ywidth", default, "Half the extent in y.")
            .unit("pixels")
            .above(0.0),
    ]
}

pub(super) static FILTERS: &[PluginSchema] = &[
    plugin("box", "Equal weight.", &[&width(0.5)]),
    plugin("triangle", "Weight falls linearly.", &[&width(2.0)]),
    plugin(
        "gaussian",
        "Gaussian bell, lowered to 0 at its edge.",
        &[
            &width(2.0),
            &[float("alpha", 2.0, "How fast the bell falls: exp(-alpha x²).").at_least(0.0)],
        ],
    ),
    plugin(
        "mitchell",
        "Mitchell-Netravali cubic, with negative lobes.",
        &[
            &width(2.0),
            &[
                float("B", 1.0 / 3.0, "Blur of the cubic."),
                float("C", 1.0 / 3.0, "Ringing of the cubic."),
            ],
        ],
    ),
    plugin(
        "sinc",
        "Sinc under a Lanczos window.",
        &[
            &width(4.0),
            &[float("tau", 3.0, "Width of the window, in cycles.").above(0.0)],
        ],
    ),
];

const PIXEL_SAMPLES: ParamSchema = int("pixelsamples", 16, "Samples of each pixel.").at_least(1.0);
const DIMENSIONS: ParamSchema = int(
    "dimensions",
    4,
    "Dimensions that are well distributed; later ones are uniform random.",
)
.at_least(0.0);

pub(super) static SAMPLERS: &[PluginSchema] = &[
    plugin(
        "halton",
        "Scrambled Halton sequence over the whole image.",
        &[&[
            PIXEL_SAMPLES,
            boolean(
                "samplepixelcenter",
                false,
                "Always samples the centre of the pixel.",
            ),
        ]],
    ),
    plugin(
        "sobol",
        "Sobol sequence over the whole image; the count is rounded up to a power of two.",
        &[&[PIXEL_SAMPLES]],
    ),
    plugin(
        "lowdiscrepancy",
        "(0,2)-sequences in each pixel; the count is rounded up to a power of two.",
        &[&[PIXEL_SAMPLES, DIMENSIONS]],
    )
    .alias(&["02sequence"]),
    plugin(
        "maxmindist",
        "Points of largest least distance in each pixel; the count is rounded up to a power of two.",
        &[&[PIXEL_SAMPLES, DIMENSIONS]],
    ),
    plugin(
        "random",
        "Independent uniform samples.",
        &[&[int("pixelsamples", 4, "Samples of each pixel.").at_least(1.0)]],
    ),
    plugin(
        "stratified",
        "One sample in each cell of a grid.",
        &[&[
            int("xsamples", 4, "Cells along x.").at_least(1.0),
            int("ysamples", 4, "Cells along y.").at_least(1.0),
            boolean(
                "jitter",
                true,
                "Random place in the cell; false is its centre.",
            ),
            DIMENSIONS,
        ]],
    ),
];

pub(super) static ACCELERATORS: &[PluginSchema] = &[
    plugin(
        "bvh",
        "Tree of bounding boxes.",
        &[&[
            int("maxnodeprims", 4, "Most primitives in a leaf.").clamped(1.0, 255.0),
            choice(
                "splitmethod",
                &[Choice(&["sah", "hlbvh", "middle", "equal"])],
                "sah",
                "How a node is divided.",
            ),
        ]],
    ),
    plugin(
        "kdtree",
        "Tree of axis-aligned cuts.",
        &[&[
            int("intersectcost", 80, "Cost of testing a primitive."),
            int("traversalcost", 1, "Cost of passing a node."),
            float("emptybonus", 0.5, "Favours cutting off empty space."),
            int("maxprims", 1, "Most primitives in a leaf.").at_least(1.0),
            int(
                "maxdepth",
                -1,
                "Greatest depth; 0 or less derives it from the number of primitives.",
            ),
        ]],
    ),
];

const PIXEL_BOUNDS: ParamSchema = list(
    "pixelbounds",
    &[Ints(FOUR)],
    "Pixels that are sampled, `x0 x1 y0 y1`; the others stay black.",
);
const MAX_DEPTH: ParamSchema = int(
    "maxdepth",
    5,
    "Most bounces of a path; 0 is emission only, 1 direct light only.",
)
.at_least(0.0);
const STRATEGIES: &[Type] = &[Choice(&["uniform", "power", "spatial"])];
const RR_THRESHOLD: ParamSchema = float(
    "rrthreshold",
    1.0,
    "Paths that carry less may be ended at random.",
);
const LIGHT_STRATEGY: ParamSchema = choice(
    "lightsamplestrategy",
    STRATEGIES,
    "spatial",
    "How the light to sample is chosen.",
);

pub(super) static INTEGRATORS: &[PluginSchema] = &[
    plugin(
        "path",
        "Path tracing of surfaces.",
        &[&[MAX_DEPTH, RR_THRESHOLD, LIGHT_STRATEGY, PIXEL_BOUNDS]],
    ),
    plugin(
        "volpath",
        "Path tracing of surfaces and participating media.",
        &[&[MAX_DEPTH, RR_THRESHOLD, LIGHT_STRATEGY, PIXEL_BOUNDS]],
    ),
    plugin(
        "directlighting",
        "Direct light, and mirrors seen in mirrors.",
        &[&[
            int("maxdepth", 5, "Most specular bounces.").at_least(0.0),
            choice(
                "strategy",
                &[Choice(&["all", "one"])],
                "all",
                "Samples every light, or one at random.",
            ),
            PIXEL_BOUNDS,
        ]],
    ),
    plugin(
        "whitted",
        "Direct light without areas, and mirrors seen in mirrors.",
        &[&[
            int("maxdepth", 5, "Most specular bounces.").at_least(0.0),
            PIXEL_BOUNDS,
        ]],
    ),
    plugin(
        "ambientocclusion",
        "How open the hemisphere of each point is.",
        &[&[
            int("nsamples", 64, "Rays from each point.").at_least(1.0),
            boolean(
                "cossample",
                true,
                "Cosine-weighted directions; false is uniform ones.",
            ),
            PIXEL_BOUNDS,
        ]],
    ),
    plugin(
        "bdpt",
        "Bidirectional path tracing.",
        &[&[
            MAX_DEPTH,
            choice(
                "lightsamplestrategy",
                STRATEGIES,
                "power",
                "How the light to start from is chosen.",
            )
            .otherwise("spatial"),
            boolean(
                "visualizestrategies",
                false,
                "Also writes one picture for each strategy.",
            ),
            boolean(
                "visualizeweights",
                false,
                "Also writes one picture of each strategy's weights.",
            ),
            PIXEL_BOUNDS,
        ]],
    ),
    plugin(
        "mlt",
        "Metropolis light transport on bidirectional paths.",
        &[&[
            MAX_DEPTH,
            int(
                "bootstrapsamples",
                100_000,
                "Paths that estimate the image's brightness.",
            )
            .at_least(1.0),
            int("chains", 1000, "Independent Markov chains.").at_least(1.0),
            int(
                "mutationsperpixel",
                100,
                "Mutations, as a mean over the pixels.",
            )
            .at_least(1.0),
            float(
                "largestepprobability",
                0.3,
                "Chance of a mutation that forgets the current path.",
            )
            .between(0.0, 1.0),
            float(
                "sigma",
                0.01,
                "Standard deviation of small mutations, in sample space.",
            )
            .above(0.0),
        ]],
    ),
    plugin(
        "sppm",
        "Stochastic progressive photon mapping.",
        &[&[
            int("iterations", 64, "Photon passes.")
                .fallback(&["numiterations"])
                .at_least(1.0),
            MAX_DEPTH,
            int(
                "photonsperiteration",
                -1,
                "Photons of a pass; 0 or less is the number of pixels.",
            ),
            param(
                "imagewritefrequency",
                &[Type::Int],
                Default::Absent,
                "Passes between intermediate pictures.",
            )
            .at_least(1.0),
            param(
                "radius",
                &[Float],
                Default::Number(1.0),
                "First search radius.",
            )
            .unit("world space")
            .above(0.0),
        ]],
    ),
];
