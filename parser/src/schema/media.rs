//! The participating media.

use super::Type::{self, Choice, Floats, String};
use super::words::{MANY, choice, float, int, list, param, plugin, point3, spectrum};
use super::{Default, ParamSchema, PluginSchema};

/// Names of the measured coefficients, shared by media and the `subsurface` material; `""` is none.
/// Jensen et al. 2001, A Practical Model for Subsurface Light Transport, and Narasimhan et al. 2006, Acquiring
/// Scattering Properties of Participating Media by Dilution.
#[rustfmt::skip]
pub(super) const PRESETS: &[Type] = &[Choice(&[
    "",
    "Apple", "Chicken1", "Chicken2", "Cream", "Ketchup", "Marble", "Potato", "Skimmilk", "Skin1", "Skin2",
    "Spectralon", "Wholemilk",
    "Lowfat Milk", "Reduced Milk", "Regular Milk", "Espresso", "Mint Mocha Coffee", "Lowfat Soy Milk",
    "Regular Soy Milk", "Lowfat Chocolate Milk", "Regular Chocolate Milk", "Coke", "Pepsi", "Sprite", "Gatorade",
    "Chardonnay", "White Zinfandel", "Merlot", "Budweiser Beer", "Coors Light Beer", "Clorox", "Apple Juice",
    "Cranberry Juice", "Grape Juice", "Ruby Grapefruit Juice", "White Grapefruit Juice", "Shampoo",
    "Strawberry Shampoo", "Head & Shoulders Shampoo", "Lemon Tea Powder", "Orange Powder", "Pink Lemonade Powder",
    "Cappuccino Powder", "Salt Powder", "Sugar Powder", "Suisse Mocha Powder", "Pacific Ocean Surface Water",
])];

const COMMON: &[ParamSchema] = &[
    param("type", &[String], Default::Required, "The kind of medium."),
    choice(
        "preset",
        PRESETS,
        "",
        "Measured coefficients by name, per mm.",
    ),
    spectrum("sigma_a", 0.0, "Absorption; wins over `preset`.")
        .rgb([0.0011, 0.0024, 0.014])
        .unit("per scene unit"),
    spectrum("sigma_s", 0.0, "Scattering; wins over `preset`.")
        .rgb([2.55, 3.21, 3.77])
        .unit("per scene unit"),
    float("scale", 1.0, "Multiplies both coefficients.").at_least(0.0),
    float("g", 0.0, "Mean cosine of Henyey-Greenstein scattering.").between(-1.0, 1.0),
];

pub(super) static MEDIA: &[PluginSchema] = &[
    plugin("homogeneous", "The same everywhere.", &[COMMON]),
    plugin(
        "heterogeneous",
        "Densities on a regular grid, blended trilinearly; nothing outside.",
        &[
            COMMON,
            &[
                int("nx", 1, "Cells along x.").at_least(1.0),
                int("ny", 1, "Cells along y.").at_least(1.0),
                int("nz", 1, "Cells along z.").at_least(1.0),
                list(
                    "density",
                    &[Floats(MANY)],
                    "nx · ny · nz factors of the coefficients, x fastest, then y.",
                )
                .required(),
                point3("p0", [0.0; 3], "One corner of the grid.").unit("medium space"),
                point3("p1", [1.0; 3], "The opposite corner.").unit("medium space"),
            ],
        ],
    ),
];
