//! The colour of the inner loop: three linear channels in one SIMD register.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Index, Mul, MulAssign, Neg, Sub, SubAssign};

use glam::Vec3A;

/// Linear RGB, Rec. 709 primaries: radiance (W·sr⁻¹·m⁻²), reflectance or an optical depth, by context.
///
/// All operators work channel by channel. 16 bytes, aligned to 16.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[repr(transparent)]
pub struct Rgb(Vec3A);

/// Weights of R, G, B in luminance: the RGB→Y row of [`super::xyz::XYZ_FROM_RGB`], in the precision of the inner loop.
const LUMINANCE: Vec3A = Vec3A::new(0.212_671, 0.715_160, 0.072_169);

impl Rgb {
    /// No light.
    pub const BLACK: Self = Self::splat(0.0);
    /// One in every channel.
    pub const ONE: Self = Self::splat(1.0);

    /// Three channels.
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self(Vec3A::new(r, g, b))
    }

    /// The same value in every channel.
    pub const fn splat(value: f32) -> Self {
        Self(Vec3A::splat(value))
    }

    /// From `[r, g, b]`.
    pub const fn from_array(channels: [f32; 3]) -> Self {
        Self(Vec3A::from_array(channels))
    }

    /// To `[r, g, b]`.
    pub const fn to_array(self) -> [f32; 3] {
        self.0.to_array()
    }

    /// Red.
    pub fn r(self) -> f32 {
        self.0.x
    }

    /// Green.
    pub fn g(self) -> f32 {
        self.0.y
    }

    /// Blue.
    pub fn b(self) -> f32 {
        self.0.z
    }

    /// Relative luminance Y.
    pub fn luminance(self) -> f32 {
        self.0.dot(LUMINANCE)
    }

    /// The largest channel.
    pub fn max_component(self) -> f32 {
        self.0.max_element()
    }

    /// The smallest channel.
    pub fn min_component(self) -> f32 {
        self.0.min_element()
    }

    /// The arithmetic mean of the channels.
    pub fn mean(self) -> f32 {
        self.0.element_sum() / 3.0
    }

    /// `exp(-x)` per channel: the transmittance of an optical depth.
    pub fn exp_neg(self) -> Self {
        Self((-self.0).exp())
    }

    /// The square root per channel.
    pub fn sqrt(self) -> Self {
        self.map(f32::sqrt)
    }

    /// Any function of one channel, applied to each.
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        let [r, g, b] = self.to_array();
        Self::new(f(r), f(g), f(b))
    }

    /// The larger of the two per channel.
    pub fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    /// The smaller of the two per channel.
    pub fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }

    /// Negative channels become 0.
    pub fn clamp_negative(self) -> Self {
        Self(self.0.max(Vec3A::ZERO))
    }

    /// Every channel into `[low, high]`.
    pub fn clamp(self, low: f32, high: f32) -> Self {
        Self(self.0.clamp(Vec3A::splat(low), Vec3A::splat(high)))
    }

    /// `self` at `t` = 0, `other` at `t` = 1.
    pub fn lerp(self, other: Self, t: f32) -> Self {
        self * (1.0 - t) + other * t
    }

    /// True when every channel is exactly 0.
    pub fn is_black(self) -> bool {
        self.0 == Vec3A::ZERO
    }

    /// True when no channel is infinite or NaN.
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    /// True when some channel is below 0.
    pub fn has_negative(self) -> bool {
        self.0.cmplt(Vec3A::ZERO).any()
    }
}

/// One operator in its four forms: colour with colour, colour with number, and both assigning.
macro_rules! channel_operator {
    ($trait:ident $method:ident, $assign_trait:ident $assign:ident) => {
        impl $trait for Rgb {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0))
            }
        }
        impl $trait<f32> for Rgb {
            type Output = Self;
            fn $method(self, other: f32) -> Self {
                Self(self.0.$method(other))
            }
        }
        impl $assign_trait for Rgb {
            fn $assign(&mut self, other: Self) {
                self.0.$assign(other.0);
            }
        }
        impl $assign_trait<f32> for Rgb {
            fn $assign(&mut self, other: f32) {
                self.0.$assign(other);
            }
        }
    };
}

channel_operator!(Add add, AddAssign add_assign);
channel_operator!(Sub sub, SubAssign sub_assign);
channel_operator!(Mul mul, MulAssign mul_assign);
channel_operator!(Div div, DivAssign div_assign);

impl Mul<Rgb> for f32 {
    type Output = Rgb;
    fn mul(self, colour: Rgb) -> Rgb {
        colour * self
    }
}

impl Neg for Rgb {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Sum for Rgb {
    fn sum<I: Iterator<Item = Self>>(colours: I) -> Self {
        colours.fold(Self::BLACK, Add::add)
    }
}

/// Channel 0, 1 or 2; panics on any other index, like an array.
impl Index<usize> for Rgb {
    type Output = f32;
    fn index(&self, channel: usize) -> &f32 {
        &self.0[channel]
    }
}

impl From<[f32; 3]> for Rgb {
    fn from(channels: [f32; 3]) -> Self {
        Self::from_array(channels)
    }
}
