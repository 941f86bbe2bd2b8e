//! Measured or simulated BSDF from a table. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `string bsdffile` | – | table of Fourier coefficients |
//! | `float texture bumpmap` | – | displacement |
//!
//! A table that cannot be read is black.

use crate::ids::FourierTableId;
use crate::scatter::fourier::FourierTable;
use crate::scatter::{Bsdf, Bxdf};

/// Inputs of the fourier material.
#[derive(Clone, PartialEq, Debug)]
pub struct Fourier {
    /// `"bsdffile"`; `NONE` scatters nothing.
    pub table: FourierTableId,
}

impl Fourier {
    pub(super) fn scatter<'a>(&self, tables: &'a [FourierTable], bsdf: &mut Bsdf<'a>) {
        if self.table.is_some() {
            bsdf.add(Bxdf::Fourier(&tables[self.table.index()]));
        }
    }
}
