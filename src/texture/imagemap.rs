//! Image texture. Scene-file manual (`Texture … "imagemap"`), beside the parameters of the mapping:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `string filename` | required | the image; its bottom row is t = 0 |
//! | `string wrap` | `repeat` | beyond the border: `repeat`, `black`, `clamp` |
//! | `bool trilinear` | false | isotropic filter instead of the elliptical one |
//! | `float maxanisotropy` | 8 | longest ellipse of the elliptical filter |
//! | `float scale` | 1 | multiplies the values, after gamma |
//! | `bool gamma` | true for png and tga | values are sRGB-encoded |

use crate::ids::ImageId;
use crate::image::mip::{MipMap, Texel};
use crate::texture::{TextureContext, UvMapping};

/// How an image is filtered under a footprint.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Filter {
    /// Two levels of the pyramid, blended.
    Trilinear,
    /// Elliptically weighted average.
    Ewa {
        /// Longest ratio of the ellipse's axes.
        max_anisotropy: f32,
    },
}

/// An image laid over a surface.
#[derive(Clone, Copy, Debug)]
pub struct ImageTexture {
    /// The image.
    pub image: ImageId,
    /// From surface parameters to image coordinates.
    pub mapping: UvMapping,
    /// The filter.
    pub filter: Filter,
}

impl ImageTexture {
    /// The filtered value at a surface point.
    pub fn evaluate<T: Texel>(&self, image: &MipMap, ctx: &TextureContext) -> T {
        let at = self.mapping.map(ctx);
        match self.filter {
            Filter::Trilinear => image.trilinear_footprint(at.st, at.dst_dx, at.dst_dy),
            Filter::Ewa { max_anisotropy } => {
                image.ewa(at.st, at.dst_dx, at.dst_dy, max_anisotropy)
            }
        }
    }
}
