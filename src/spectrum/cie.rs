//! The CIE 1931 2-degree standard observer at 1 nm.
//!
//! Table: ISO/CIE 11664-1, data set doi:10.25039/CIE.DS.xvudnb9b, kept as text beside this file.

use std::sync::LazyLock;

/// First tabulated wavelength in nanometres.
pub const FIRST_NM: usize = 360;
/// Last tabulated wavelength in nanometres.
pub const LAST_NM: usize = 830;
/// Number of tabulated wavelengths, one per nanometre.
pub const N_SAMPLES: usize = LAST_NM - FIRST_NM + 1;

/// The sum of ȳ as the scene format fixes it. The table itself sums to 106.856917: the reference renderer's copy reads
/// 0.9874812 at 547 nm, a misprint for 0.9874182, and neither sum is this one. The effect is below 10⁻⁶ in Y.
pub const Y_INTEGRAL: f64 = 106.856_895;

/// Colour matching functions `[x̄, ȳ, z̄]`; entry `i` belongs to `FIRST_NM + i` nanometres.
pub static MATCHING: LazyLock<[[f64; 3]; N_SAMPLES]> = LazyLock::new(|| {
    let mut table = [[0.0; 3]; N_SAMPLES];
    let rows = include_str!("cie_1931_2deg.csv")
        .lines()
        .filter(|line| !line.starts_with('#'));
    for (i, (entry, row)) in table.iter_mut().zip(rows).enumerate() {
        let mut fields = row.split(',').map(|field| {
            field
                .parse::<f64>()
                .expect("the table is part of the program")
        });
        assert_eq!(
            fields.next(),
            Some((FIRST_NM + i) as f64),
            "the table is complete and in order"
        );
        *entry = std::array::from_fn(|_| fields.next().expect("three functions per row"));
    }
    table
});
