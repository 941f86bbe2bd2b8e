//! The four types of samples, and the arithmetic of the Ptex library on them.

use half::f16;

/// Largest magnitude that is kept: sums of a few thousand weighted samples stay finite.
const MAGNITUDE_MAX: f32 = 1e30;

/// A sample as a file stores it.
pub trait Sample: Copy + Send + Sync + 'static {
    /// What 1 is stored as.
    const ONE: f32;
    /// Bytes in the file.
    const BYTES: usize;
    /// Zero.
    const ZERO: Self;

    /// From its bytes, the lowest first; as many as [`Self::BYTES`].
    fn from_bytes(bytes: &[u8]) -> Self;

    /// The number as stored.
    fn to_f32(self) -> f32;

    /// The mean of two; whole numbers are rounded down.
    fn halved(a: Self, b: Self) -> Self;

    /// The mean of four; whole numbers are rounded down.
    fn quartered(samples: [Self; 4]) -> Self;

    /// Times a number of at most 1; whole numbers are rounded down.
    fn scaled(self, by: f32) -> Self;

    /// The sum that differences are undone by; other types than whole numbers have none.
    fn plus(self, previous: Self) -> Self;

    /// Whether it can be added up.
    fn is_usable(self) -> bool;
}

macro_rules! whole_numbers {
    ($type:ty, $wide:ty) => {
        impl Sample for $type {
            const ONE: f32 = <$type>::MAX as f32;
            const BYTES: usize = size_of::<$type>();
            const ZERO: Self = 0;

            fn from_bytes(bytes: &[u8]) -> Self {
                let mut array = [0; size_of::<$type>()];
                array.copy_from_slice(bytes);
                Self::from_le_bytes(array)
            }

            #[inline]
            fn to_f32(self) -> f32 {
                f32::from(self)
            }

            fn halved(a: Self, b: Self) -> Self {
                ((<$wide>::from(a) + <$wide>::from(b)) / 2) as Self
            }

            fn quartered(samples: [Self; 4]) -> Self {
                (samples.map(<$wide>::from).iter().sum::<$wide>() / 4) as Self
            }

            fn scaled(self, by: f32) -> Self {
                (f32::from(self) * by) as Self
            }

            fn plus(self, previous: Self) -> Self {
                self.wrapping_add(previous)
            }

            fn is_usable(self) -> bool {
                true
            }
        }
    };
}

whole_numbers!(u8, u16);
whole_numbers!(u16, u32);

macro_rules! real_numbers {
    ($type:ty, $from:expr) => {
        impl Sample for $type {
            const ONE: f32 = 1.0;
            const BYTES: usize = size_of::<$type>();
            const ZERO: Self = <$type>::from_bits(0);

            fn from_bytes(bytes: &[u8]) -> Self {
                let mut array = [0; size_of::<$type>()];
                array.copy_from_slice(bytes);
                Self::from_le_bytes(array)
            }

            #[inline]
            fn to_f32(self) -> f32 {
                f32::from(self)
            }

            fn halved(a: Self, b: Self) -> Self {
                $from(0.5 * (f32::from(a) + f32::from(b)))
            }

            fn quartered(samples: [Self; 4]) -> Self {
                $from(0.25 * samples.map(f32::from).iter().sum::<f32>())
            }

            fn scaled(self, by: f32) -> Self {
                $from(f32::from(self) * by)
            }

            fn plus(self, _: Self) -> Self {
                self
            }

            fn is_usable(self) -> bool {
                f32::from(self).abs() <= MAGNITUDE_MAX
            }
        }
    };
}

real_numbers!(f16, nearest_half);
real_numbers!(f32, std::convert::identity);

/// The nearest half, the larger one of two that are as near: as the library rounds.
fn nearest_half(x: f32) -> f16 {
    f16::from_f32(f32::from_bits(x.to_bits().wrapping_add(0x1000) & !0x1fff))
}
