//! Two materials, blended. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `string namedmaterial1`, `namedmaterial2` | – | the materials, which may be mixtures again |
//! | `spectrum texture amount` | 0.5 | weight of the *first* material; the second has the rest |
//!
//! Shading frame, bump map and the index that Russian roulette heeds are those of the first material.

use crate::ids::MaterialId;
use crate::texture::SpectrumSource;

/// Inputs of the mix material.
#[derive(Clone, PartialEq, Debug)]
pub struct Mix {
    /// Material 1, not null.
    pub first: MaterialId,
    /// Material 2, not null.
    pub second: MaterialId,
    /// `"amount"`, clamped to ≥ 0 where it is evaluated.
    pub amount: SpectrumSource,
}
