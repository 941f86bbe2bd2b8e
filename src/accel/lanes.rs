//! Eight numbers at a time, in whatever registers the processor has.
//!
//! Every implementation does the same IEEE operations in the same order, with no fused multiplication: hits do not
//! depend on the processor. Masks have bit i set for lane i.

use crate::math::{greater, lesser};

/// Boxes of a node, and triangles of a packet.
pub(super) const N_LANES: usize = 8;

/// Arithmetic of f32, one or many at a time: what is written with it has the same results to the last bit.
pub(super) trait Numbers: Copy {
    /// One number, or as many as there are lanes.
    type Floats: Copy;

    fn splat(self, a: f32) -> Self::Floats;
    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn div(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn abs(self, a: Self::Floats) -> Self::Floats;
    /// The smaller number; `b` if either is none.
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// The larger number; `b` if either is none.
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
}

/// Operations on eight f32.
pub(super) trait Lanes: Numbers {
    fn load(self, a: &[f32; N_LANES]) -> Self::Floats;
    fn store(self, a: Self::Floats) -> [f32; N_LANES];
    /// Where a < b.
    fn lt(self, a: Self::Floats, b: Self::Floats) -> u32;
    /// Where a ≤ b.
    fn le(self, a: Self::Floats, b: Self::Floats) -> u32;
    /// Where a = b.
    fn eq(self, a: Self::Floats, b: Self::Floats) -> u32;
    /// Asks for memory that will be needed soon.
    fn prefetch<T>(self, what: &T);
}

/// One number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Single;

impl Numbers for Single {
    type Floats = f32;

    #[inline(always)]
    fn splat(self, a: f32) -> f32 {
        a
    }

    #[inline(always)]
    fn add(self, a: f32, b: f32) -> f32 {
        a + b
    }

    #[inline(always)]
    fn sub(self, a: f32, b: f32) -> f32 {
        a - b
    }

    #[inline(always)]
    fn mul(self, a: f32, b: f32) -> f32 {
        a * b
    }

    #[inline(always)]
    fn div(self, a: f32, b: f32) -> f32 {
        a / b
    }

    #[inline(always)]
    fn abs(self, a: f32) -> f32 {
        a.abs()
    }

    #[inline(always)]
    fn min(self, a: f32, b: f32) -> f32 {
        lesser(a, b)
    }

    #[inline(always)]
    fn max(self, a: f32, b: f32) -> f32 {
        greater(a, b)
    }
}

/// For any processor: the compiler makes of it what it can.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portable;

#[inline(always)]
fn zip(a: [f32; N_LANES], b: [f32; N_LANES], f: impl Fn(f32, f32) -> f32) -> [f32; N_LANES] {
    std::array::from_fn(|i| f(a[i], b[i]))
}

#[inline(always)]
fn mask(a: [f32; N_LANES], b: [f32; N_LANES], f: impl Fn(f32, f32) -> bool) -> u32 {
    (0..N_LANES).fold(0, |m, i| m | u32::from(f(a[i], b[i])) << i)
}

impl Numbers for Portable {
    type Floats = [f32; N_LANES];

    #[inline(always)]
    fn splat(self, a: f32) -> Self::Floats {
        [a; N_LANES]
    }

    #[inline(always)]
    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        zip(a, b, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        zip(a, b, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        zip(a, b, |a, b| a * b)
    }

    #[inline(always)]
    fn div(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        zip(a, b, |a, b| a / b)
    }

    #[inline(always)]
    fn abs(self, a: Self::Floats) -> Self::Floats {
        a.map(f32::abs)
    }

    #[inline(always)]
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        zip(a, b, lesser)
    }

    #[inline(always)]
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats {
        zip(a, b, greater)
    }
}

impl Lanes for Portable {
    #[inline(always)]
    fn load(self, a: &[f32; N_LANES]) -> Self::Floats {
        *a
    }

    #[inline(always)]
    fn store(self, a: Self::Floats) -> [f32; N_LANES] {
        a
    }

    #[inline(always)]
    fn lt(self, a: Self::Floats, b: Self::Floats) -> u32 {
        mask(a, b, |a, b| a < b)
    }

    #[inline(always)]
    fn le(self, a: Self::Floats, b: Self::Floats) -> u32 {
        mask(a, b, |a, b| a <= b)
    }

    #[inline(always)]
    fn eq(self, a: Self::Floats, b: Self::Floats) -> u32 {
        mask(a, b, |a, b| a == b)
    }

    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::{__m256, _CMP_EQ_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _MM_HINT_T0};

    use pulp::x86::V3;

    use super::{Lanes, N_LANES, Numbers};

    impl Numbers for V3 {
        type Floats = __m256;

        #[inline(always)]
        fn splat(self, a: f32) -> __m256 {
            self.avx._mm256_set1_ps(a)
        }

        #[inline(always)]
        fn add(self, a: __m256, b: __m256) -> __m256 {
            self.avx._mm256_add_ps(a, b)
        }

        #[inline(always)]
        fn sub(self, a: __m256, b: __m256) -> __m256 {
            self.avx._mm256_sub_ps(a, b)
        }

        #[inline(always)]
        fn mul(self, a: __m256, b: __m256) -> __m256 {
            self.avx._mm256_mul_ps(a, b)
        }

        #[inline(always)]
        fn div(self, a: __m256, b: __m256) -> __m256 {
            self.avx._mm256_div_ps(a, b)
        }

        #[inline(always)]
        fn abs(self, a: __m256) -> __m256 {
            self.avx._mm256_andnot_ps(self.splat(-0.0), a)
        }

        #[inline(always)]
        fn min(self, a: __m256, b: __m256) -> __m256 {
            self.avx._mm256_min_ps(a, b)
        }

        #[inline(always)]
        fn max(self, a: __m256, b: __m256) -> __m256 {
            self.avx._mm256_max_ps(a, b)
        }
    }

    impl Lanes for V3 {
        #[inline(always)]
        fn load(self, a: &[f32; N_LANES]) -> __m256 {
            pulp::cast(*a)
        }

        #[inline(always)]
        fn store(self, a: __m256) -> [f32; N_LANES] {
            pulp::cast(a)
        }

        #[inline(always)]
        fn lt(self, a: __m256, b: __m256) -> u32 {
            let mask = self.avx._mm256_cmp_ps::<_CMP_LT_OQ>(a, b);
            self.avx._mm256_movemask_ps(mask) as u32
        }

        #[inline(always)]
        fn le(self, a: __m256, b: __m256) -> u32 {
            let mask = self.avx._mm256_cmp_ps::<_CMP_LE_OQ>(a, b);
            self.avx._mm256_movemask_ps(mask) as u32
        }

        #[inline(always)]
        fn eq(self, a: __m256, b: __m256) -> u32 {
            let mask = self.avx._mm256_cmp_ps::<_CMP_EQ_OQ>(a, b);
            self.avx._mm256_movemask_ps(mask) as u32
        }

        #[inline(always)]
        fn prefetch<T>(self, what: &T) {
            let start = std::ptr::from_ref(what).cast::<i8>();
            for line in (0..size_of::<T>()).step_by(64) {
                self.sse
                    ._mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(line));
            }
        }
    }
}

/// The widest registers that this processor has and this program knows.
#[derive(Clone, Copy, Debug)]
pub(super) enum Level {
    /// See [`Portable`].
    Portable,
    /// AVX2.
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
}

impl Level {
    pub(super) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = pulp::x86::V3::try_new() {
            return Self::Avx2(avx2);
        }
        Self::Portable
    }
}
