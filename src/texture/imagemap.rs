//! Image texture. Scene-file manual (`Texture … "imagemap"`), beside the parameters of the mapping:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `string filename` | required | the image; its bottom row is t = 0 |
//! | `string wrap` | `repeat` | beyond the border: `repeat`, `black`, `clamp` |
//! | `bool trilinear` | false | isotropic filter instead of the elliptical one |
//! | `float maxanisotropy` | 8 | longest ellipse of the elliptical filter |
//! | `float scale` | 1 | multiplies the values, after gamma |
//! | `bool gamma` | true for png, tga and jpg | values are sRGB-encoded |

use crate::ids::ImageId;
use crate::image::mip::{MipMap, Wrap};
use crate::texture::{Mapping2, TextureContext, Value};

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
    /// From surface points to image coordinates.
    pub mapping: Mapping2,
    /// The filter.
    pub filter: Filter,
}

impl ImageTexture {
    /// The filtered value at a surface point.
    pub(super) fn evaluate<V: Value>(&self, image: &MipMap, ctx: &TextureContext) -> V {
        let at = self.mapping.map(ctx);
        // Whole repeats go before single precision takes digits from what is left.
        let st = match image.wrap() {
            Wrap::Repeat => at.st - at.st.floor(),
            Wrap::Black | Wrap::Clamp => at.st,
        };
        let st = st.as_vec2();
        match self.filter {
            Filter::Trilinear => image.trilinear_footprint(st, at.dst_dx, at.dst_dy),
            Filter::Ewa { max_anisotropy } => image.ewa(st, at.dst_dx, at.dst_dy, max_anisotropy),
        }
    }
}
