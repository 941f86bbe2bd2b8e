//! Colour as the renderer carries it, and the ways into it.
//!
//! Owns: the three-channel linear value of the inner loop ([`Rgb`]), the XYZ matrices ([`xyz`]), the CIE 1931
//! observer ([`cie`]), wavelength tables and their projection ([`sampled`]), Planck's law ([`blackbody`]), the text
//! files that hold such tables ([`float_file`]) and the one metal that needs no file ([`copper`]).
//!
//! Refuses: transfer curves and 8-bit encodings (those belong to `image`), files and paths, defaults of materials.
//!
//! The working space is linear RGB with Rec. 709 primaries. Values are not clamped on the way in: a spectrum outside
//! the gamut has negative channels, and light keeps them.

pub mod blackbody;
pub mod cie;
pub mod copper;
pub mod float_file;
mod rgb;
pub mod sampled;
pub mod xyz;

pub use rgb::Rgb;
