//! The mapping of a texture: parameters and current transform to what [`crate::texture::mapping`] evaluates.

use glam::{DAffine3, DMat3, DVec3, Vec2};
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};

use crate::compile::reader::ParamReader;
use crate::compile::space::{self, RenderSpace};
use crate::describe::description::TextureEntity;
use crate::math::Transform;
use crate::texture::{Mapping2, Mapping3, UvMapping};

/// A mapping to (s, t) as written.
#[derive(Clone, Copy)]
pub(super) enum WrittenMapping {
    Uv(UvMapping),
    Spherical,
    Cylindrical,
    Planar { v: [[f32; 3]; 2], delta: [f32; 2] },
}

impl WrittenMapping {
    /// Reads the parameters, and warns of a texture that a factor of 0 makes a row of lines or a single colour.
    pub(super) fn read(p: &mut ParamReader) -> Self {
        match p.strict_choice("mapping") {
            // As in pbrt-v3, scales and shifts go with it.
            None => Self::Uv(UvMapping::IDENTITY),
            Some("spherical") => Self::Spherical,
            Some("cylindrical") => Self::Cylindrical,
            Some("planar") => {
                let v = ["v1", "v2"].map(|name| {
                    let v = p.vector3(name);
                    warn_if_flat(p, name, v == [0.0; 3]);
                    v
                });
                let delta = ["udelta", "vdelta"].map(|name| p.float(name));
                Self::Planar { v, delta }
            }
            Some(_) => {
                let scale = ["uscale", "vscale"].map(|name| {
                    let scale = p.float(name);
                    warn_if_flat(p, name, scale == 0.0);
                    scale
                });
                let delta = ["udelta", "vdelta"].map(|name| p.float(name));
                Self::Uv(UvMapping {
                    scale: Vec2::from(scale),
                    delta: Vec2::from(delta),
                })
            }
        }
    }

    /// The mapping from render space; `None` if the current transform has no inverse, which is reported.
    pub(super) fn place(
        self,
        entity: &TextureEntity,
        space: &RenderSpace,
        diagnostics: &mut Diagnostics,
    ) -> Option<Mapping2> {
        let mut local_from_render = || {
            let world_from_local = ctm(entity, diagnostics)?;
            let world_from_render = space.world_from_render();
            Some(
                *world_from_local
                    .inverse()
                    .compose(&world_from_render)
                    .affine(),
            )
        };
        Some(match self {
            Self::Uv(uv) => Mapping2::Uv(uv),
            Self::Spherical => Mapping2::Spherical {
                sphere_from_render: local_from_render()?,
            },
            Self::Cylindrical => Mapping2::Cylindrical {
                cylinder_from_render: local_from_render()?,
            },
            Self::Planar { v, delta } => {
                let [s, t] = v.map(|v| DVec3::from(v.map(f64::from)));
                let st_from_world = DAffine3 {
                    matrix3: DMat3::from_cols(s, t, DVec3::ZERO).transpose(),
                    translation: DVec3::new(delta[0].into(), delta[1].into(), 0.0),
                };
                Mapping2::Planar {
                    st_from_render: st_from_world * *space.world_from_render().affine(),
                }
            }
        })
    }
}

fn warn_if_flat(p: &mut ParamReader, name: &str, is_flat: bool) {
    if is_flat {
        let message = format!("with {name} 0 the texture is the same all along this direction");
        let warning = Diagnostic::warning("flat-texture", p.span(name), message);
        p.report(warning);
    }
}

/// The mapping to texture space. As in pbrt-v3, the current transform acts forward.
pub(super) fn solid(
    entity: &TextureEntity,
    space: &RenderSpace,
    diagnostics: &mut Diagnostics,
) -> Option<Mapping3> {
    let texture_from_world = ctm(entity, diagnostics)?;
    Some(Mapping3 {
        texture_from_render: *texture_from_world.affine() * *space.world_from_render().affine(),
    })
}

/// The current transform at the directive.
fn ctm(entity: &TextureEntity, diagnostics: &mut Diagnostics) -> Option<Transform> {
    space::transform(
        entity.world_from_texture.start,
        entity.entity.span,
        diagnostics,
    )
}
