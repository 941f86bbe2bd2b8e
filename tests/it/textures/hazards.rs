//! Absurd input: whatever comes in, a finite value comes out, and soon.

use glam::{DAffine3, DMat3, DVec3, Vec2};
use tyndall::image::Image;
use tyndall::image::mip::{MipMap, Wrap};
use tyndall::math::{Point3, Vec3};
use tyndall::spectrum::Rgb;
use tyndall::texture::noise::Octaves;
use tyndall::texture::{
    Bilerp, Checkerboard2, Checkerboard3, Dots, Fbm, Filter, ImageTexture, Mapping2, Mapping3,
    Marble, Smoothing, Texture, TextureContext, Textures, Uv, UvMapping, Value, Windy, Wrinkled,
};

use crate::textures::at::constant;

const EXTREMES: [f32; 12] = [
    0.0,
    -0.0,
    1e-40,
    0.3,
    -7.5,
    16_777_217.0,
    1e12,
    -1e30,
    f32::MAX,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
];

fn mappings() -> Vec<Mapping2> {
    let uv = |scale: f32, delta: f32| {
        Mapping2::Uv(UvMapping {
            scale: Vec2::splat(scale),
            delta: Vec2::splat(delta),
        })
    };
    let linear = |scale: f64| DAffine3::from_scale(DVec3::splat(scale));
    let mut mappings = vec![uv(1.0, 0.0), uv(0.0, 0.5), uv(1e12, 0.0), uv(1e38, -1e38)];
    for scale in [1e-300, 1.0, 1e12, 1e300] {
        mappings.extend([
            Mapping2::Spherical {
                sphere_from_render: linear(scale),
            },
            Mapping2::Cylindrical {
                cylinder_from_render: linear(scale),
            },
            Mapping2::Planar {
                st_from_render: linear(scale),
            },
        ]);
    }
    // "v1" and "v2" 0.
    mappings.push(Mapping2::Planar {
        st_from_render: DAffine3::from_mat3(DMat3::ZERO),
    });
    mappings
}

fn contexts() -> impl Iterator<Item = TextureContext> {
    EXTREMES.into_iter().flat_map(|place| {
        EXTREMES.into_iter().map(move |size| TextureContext {
            p: Point3::new(place, 0.25, -place),
            uv: [place, 0.75],
            duv_dx: [size, 0.0],
            duv_dy: [0.01, -size],
            dp_dx: Vec3::new(size, 0.0, 0.0),
            dp_dy: Vec3::new(0.0, 0.01, -size),
            face: 0,
        })
    })
}

#[track_caller]
fn assert_finite<V: Value + std::fmt::Debug>(textures: &mut Textures, texture: Texture<V>) {
    let what = format!("{texture:?}");
    let source = textures.add(texture);
    for ctx in contexts() {
        let value = textures.evaluate(source, &ctx);
        assert!(value.is_finite(), "{what}: {value:?} at {ctx:?}");
    }
}

#[test]
fn m10_noise_is_finite_anywhere() {
    let mut textures = Textures::default();
    for scale in [0.0, 1e-300, 1.0, 1e12, 1e300] {
        let mapping = Mapping3 {
            texture_from_render: DAffine3::from_scale(DVec3::splat(scale)),
        };
        for octaves in [(8, 0.5), (64, 1e30), (64, -3.0), (0, 0.5)] {
            let octaves = Octaves {
                count: octaves.0,
                roughness: octaves.1,
            };
            let textures = &mut textures;
            assert_finite::<f32>(textures, Texture::Fbm(Fbm { mapping, octaves }));
            assert_finite::<f32>(textures, Texture::Wrinkled(Wrinkled { mapping, octaves }));
            assert_finite::<f32>(textures, Texture::Windy(Windy { mapping }));
            for (scale, variation) in [(1e12, 0.2), (1.0, 1e38), (1e38, 1e38)] {
                assert_finite::<Rgb>(
                    textures,
                    Texture::Marble(Marble {
                        mapping,
                        octaves,
                        scale,
                        variation,
                    }),
                );
            }
        }
        let fields = [constant(1.0), constant(0.0)];
        assert_finite(
            &mut textures,
            Texture::Checkerboard3(Checkerboard3 { mapping, fields }),
        );
    }
}

#[test]
fn m11_m12_mappings_that_blow_up_or_collapse_give_finite_values() {
    let mut textures = Textures::default();
    for mapping in mappings() {
        let textures = &mut textures;
        let ends = [constant(1.0), constant(0.0)];
        for smoothing in [Smoothing::None, Smoothing::ClosedForm] {
            assert_finite(
                textures,
                Texture::Checkerboard2(Checkerboard2 {
                    mapping,
                    fields: ends,
                    smoothing,
                }),
            );
        }
        let [ground, dot] = ends;
        assert_finite(
            textures,
            Texture::Dots(Dots {
                mapping,
                ground,
                dot,
            }),
        );
        let corners = [0.0, 1.0, -1.0, 2.0];
        assert_finite(textures, Texture::Bilerp(Bilerp { mapping, corners }));
        assert_finite::<Rgb>(textures, Texture::Uv(Uv { mapping }));
    }
}

#[test]
fn m13_images_under_any_footprint_give_finite_values_soon() {
    let mut textures = Textures::default();
    let texels = (0..64 * 32).map(|i| (i % 7) as f32).collect();
    let texels = Image::new(64, 32, 1, texels).expect("64 x 32 texels");
    for wrap in [Wrap::Repeat, Wrap::Black, Wrap::Clamp] {
        let image = textures.add_image(MipMap::new(texels.clone(), wrap));
        for mapping in mappings() {
            for filter in [
                Filter::Trilinear,
                Filter::Ewa {
                    max_anisotropy: 8.0,
                },
                Filter::Ewa {
                    max_anisotropy: f32::MAX,
                },
            ] {
                let texture = ImageTexture {
                    image,
                    mapping,
                    filter,
                };
                assert_finite::<f32>(&mut textures, Texture::Image(texture));
            }
        }
    }
}

#[test]
fn m13_an_infinite_footprint_shows_the_mean_of_the_image() {
    let mut textures = Textures::default();
    let texels = Image::new(2, 2, 1, vec![0.0, 1.0, 2.0, 5.0]).expect("2 x 2 texels");
    let image = textures.add_image(MipMap::new(texels, Wrap::Repeat));
    let source = textures.add::<f32>(Texture::Image(ImageTexture {
        image,
        mapping: Mapping2::Uv(UvMapping::IDENTITY),
        filter: Filter::Ewa {
            max_anisotropy: 8.0,
        },
    }));
    for size in [10.0, 1e20, f32::INFINITY] {
        let ctx = TextureContext {
            p: Point3::ZERO,
            uv: [0.3, 0.1],
            duv_dx: [size, 0.0],
            duv_dy: [0.0, size],
            dp_dx: Vec3::ZERO,
            dp_dy: Vec3::ZERO,
            face: 0,
        };
        assert_eq!(textures.float(source, &ctx), 2.0, "{size}");
    }
}
