//! Sobol' points in 16 dimensions, by the direction numbers of Joe and Kuo 2008 ("Constructing Sobol sequences with
//! better two-dimensional projections", their table `new-joe-kuo-6`).

/// Dimensions of one sequence.
pub(super) const N_DIMENSIONS: usize = 16;

/// Degree of the primitive polynomial, its inner coefficients as bits, and the first direction numbers, for the
/// dimensions after the first.
const FIGURES: [(usize, u32, &[u32]); N_DIMENSIONS - 1] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
];

/// Columns of the generator matrices, as 32-bit fractions.
static COLUMNS: [[u32; 32]; N_DIMENSIONS] = columns();

const fn columns() -> [[u32; 32]; N_DIMENSIONS] {
    let mut columns = [[0; 32]; N_DIMENSIONS];
    let mut k = 0;
    while k < 32 {
        columns[0][k] = 1 << (31 - k);
        k += 1;
    }
    let mut dimension = 1;
    while dimension < N_DIMENSIONS {
        let (degree, inner, first) = FIGURES[dimension - 1];
        let mut k = 0;
        while k < 32 {
            columns[dimension][k] = if k < degree {
                first[k] << (31 - k)
            } else {
                // v_k = v_{k−s} ⊕ v_{k−s} / 2ˢ ⊕ Σ a_j v_{k−j}
                let mut v = columns[dimension][k - degree];
                v ^= v >> degree;
                let mut j = 1;
                while j < degree {
                    if inner >> (degree - 1 - j) & 1 == 1 {
                        v ^= columns[dimension][k - j];
                    }
                    j += 1;
                }
                v
            };
            k += 1;
        }
        dimension += 1;
    }
    columns
}

/// Coordinate `dimension` of a point, as a 32-bit fraction.
#[inline]
pub(super) fn coordinate(mut index: u32, dimension: usize) -> u32 {
    let columns = &COLUMNS[dimension];
    let mut fraction = 0;
    while index != 0 {
        fraction ^= columns[index.trailing_zeros() as usize];
        index &= index - 1;
    }
    fraction
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::owen;

    #[test]
    fn the_first_two_dimensions_are_the_net_that_is_computed_without_matrices() {
        for index in (0..1000).chain([u32::MAX, 0x8000_0001, 0xdead_beef]) {
            assert_eq!(coordinate(index, 0), owen::sobol_0(index));
            assert_eq!(coordinate(index, 1), owen::sobol_1(index));
        }
    }

    #[test]
    fn every_dimension_takes_each_stratum_once() {
        for dimension in 0..N_DIMENSIONS {
            let mut seen = [false; 1024];
            for index in 0..1024 {
                let cell = (coordinate(index, dimension) >> 22) as usize;
                assert!(!seen[cell], "dimension {dimension}, point {index}");
                seen[cell] = true;
            }
        }
    }
}
