//! What textures yield: a number or a colour.

use std::ops::Mul;

use crate::image::mip::Texel;
use crate::spectrum::Rgb;
use crate::texture::{Arena, Textures};

/// A number or a colour: all that scalar and colour textures differ in.
pub trait Value: Texel + Mul<Output = Self> + PartialEq + Sized {
    /// One, in every channel.
    const ONE: Self;

    /// The same number in every channel.
    fn splat(value: f32) -> Self;

    /// From a colour; a number takes its luminance.
    fn from_rgb(rgb: Rgb) -> Self;

    /// From a colour; a number takes the mean of the channels.
    fn from_mean(rgb: Rgb) -> Self;

    /// Whether every channel is finite.
    fn is_finite(self) -> bool;

    /// The textures that yield it.
    fn arena(textures: &Textures) -> &Arena<Self>;

    /// The textures that yield it, to add to.
    fn arena_mut(textures: &mut Textures) -> &mut Arena<Self>;

    /// `self` at `t` = 0, `other` at `t` = 1, and so on along the line.
    #[inline]
    fn blend(self, other: Self, t: f32) -> Self {
        self * (1.0 - t) + other * t
    }
}

impl Value for f32 {
    const ONE: Self = 1.0;

    #[inline]
    fn splat(value: f32) -> Self {
        value
    }

    #[inline]
    fn from_rgb(rgb: Rgb) -> Self {
        rgb.luminance()
    }

    #[inline]
    fn from_mean(rgb: Rgb) -> Self {
        rgb.mean()
    }

    fn is_finite(self) -> bool {
        self.is_finite()
    }

    #[inline]
    fn arena(textures: &Textures) -> &Arena<Self> {
        &textures.float
    }

    fn arena_mut(textures: &mut Textures) -> &mut Arena<Self> {
        &mut textures.float
    }
}

impl Value for Rgb {
    const ONE: Self = Self::ONE;

    #[inline]
    fn splat(value: f32) -> Self {
        Self::splat(value)
    }

    #[inline]
    fn from_rgb(rgb: Rgb) -> Self {
        rgb
    }

    #[inline]
    fn from_mean(rgb: Rgb) -> Self {
        rgb
    }

    fn is_finite(self) -> bool {
        self.is_finite()
    }

    #[inline]
    fn arena(textures: &Textures) -> &Arena<Self> {
        &textures.spectrum
    }

    fn arena_mut(textures: &mut Textures) -> &mut Arena<Self> {
        &mut textures.spectrum
    }
}
