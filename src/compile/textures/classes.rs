//! The texture classes: parameters to what [`crate::texture`] evaluates, or to a constant.
//!
//! Every class reads all its parameters first and builds its inputs after that, and only those that can be seen.

use tyndall_parser::diagnostic::Diagnostics;
use tyndall_parser::schema::PluginRef;

use crate::compile::reader::{ParamReader, Textured};
use crate::compile::textures::TextureBuilder;
use crate::compile::textures::images::{Loaded, WrittenImage};
use crate::compile::textures::kind::Kind;
use crate::compile::textures::mappings::{self, WrittenMapping};
use crate::describe::description::TextureEntity;
use crate::image::mip::Wrap;
use crate::texture::noise::Octaves;
use crate::texture::{
    Bilerp, Checkerboard2, Checkerboard3, Dots, Fbm, Filter, ImageTexture, Mapping2, Mapping3,
    Marble, Mix, PtexTexture, Scale, Smoothing, Source, Texture, Uv, Windy, Wrinkled,
};

/// One `Texture` directive while it is built.
pub(super) struct Directive<'a> {
    pub(super) plugin: PluginRef,
    pub(super) entity: &'a TextureEntity,
    pub(super) diagnostics: &'a mut Diagnostics,
}

impl Directive<'_> {
    /// Reads all parameters.
    fn read<T>(&mut self, read: impl FnOnce(&mut ParamReader) -> T) -> T {
        let mut p = ParamReader::new(self.plugin, &self.entity.entity, self.diagnostics);
        let parameters = read(&mut p);
        p.finish();
        parameters
    }
}

impl TextureBuilder<'_> {
    /// Builds a texture; `None` if it cannot be, which is reported.
    pub(super) fn class<V: Kind>(&mut self, mut from: Directive) -> Option<Source<V>> {
        let from = &mut from;
        match from.plugin.schema.name {
            "constant" => {
                let value = from.read(|p| V::constant(p, "value"));
                let value = V::value(&value, self.assets, from.diagnostics);
                Some(Source::Constant(value))
            }
            "scale" => Some(self.scale(from)),
            "mix" => Some(self.mix(from)),
            "bilerp" => self.bilerp(from),
            "imagemap" => self.imagemap(from),
            "checkerboard" => self.checkerboard(from),
            "dots" => self.dots(from),
            "fbm" => {
                let octaves = from.read(octaves);
                let mapping = self.solid(from)?;
                Some(self.add(Texture::Fbm(Fbm { mapping, octaves })))
            }
            "wrinkled" => {
                let octaves = from.read(octaves);
                let mapping = self.solid(from)?;
                Some(self.add(Texture::Wrinkled(Wrinkled { mapping, octaves })))
            }
            "windy" => {
                from.read(|_| ());
                let mapping = self.solid(from)?;
                Some(self.add(Texture::Windy(Windy { mapping })))
            }
            "uv" => {
                let mapping = from.read(WrittenMapping::read);
                let mapping = self.mapping(mapping, from)?;
                Some(self.add(Texture::Uv(Uv { mapping })))
            }
            "marble" => self.marble(from),
            "ptex" => Some(self.ptex(from)),
            name => unreachable!("the schema's texture class {name} is not built"),
        }
    }

    fn add<V: Kind>(&mut self, texture: Texture<V>) -> Source<V> {
        self.textures.add(texture)
    }

    fn mapping(&self, written: WrittenMapping, from: &mut Directive) -> Option<Mapping2> {
        written.place(from.entity, &self.space, from.diagnostics)
    }

    fn solid(&self, from: &mut Directive) -> Option<Mapping3> {
        mappings::solid(from.entity, &self.space, from.diagnostics)
    }

    fn scale<V: Kind>(&mut self, from: &mut Directive) -> Source<V> {
        let [a, b] = from.read(|p| ["tex1", "tex2"].map(|name| V::textured(p, name)));
        // A factor of 0 hides the other one: the one that is cheaper to know comes first.
        let swap = self.reads_image(&a) && !self.reads_image(&b);
        let (first, second) = if swap { (b, a) } else { (a, b) };
        let first = self.source(first, V::ONE, from.diagnostics);
        if first == Source::Constant(V::ZERO) {
            return first;
        }
        let second = self.source(second, V::ONE, from.diagnostics);
        match (first, second) {
            (Source::Constant(a), Source::Constant(b)) => Source::Constant(a * b),
            (Source::Constant(one), other) | (other, Source::Constant(one)) if one == V::ONE => {
                other
            }
            (_, zero) if zero == Source::Constant(V::ZERO) => zero,
            _ => {
                let factors = [first, second];
                self.add(Texture::Scale(Scale { factors }))
            }
        }
    }

    fn mix<V: Kind>(&mut self, from: &mut Directive) -> Source<V> {
        let (tex1, tex2, amount) = from.read(|p| {
            let [tex1, tex2] = ["tex1", "tex2"].map(|name| V::textured(p, name));
            (tex1, tex2, p.float_texture("amount"))
        });
        let amount = self.float_source(amount, 0.5, from.diagnostics);
        if amount == Source::Constant(0.0) {
            return self.source(tex1, V::ZERO, from.diagnostics);
        }
        if amount == Source::Constant(1.0) {
            return self.source(tex2, V::ONE, from.diagnostics);
        }
        let first = self.source(tex1, V::ZERO, from.diagnostics);
        let second = self.source(tex2, V::ONE, from.diagnostics);
        match (first, second, amount) {
            _ if first == second => first,
            (Source::Constant(a), Source::Constant(b), Source::Constant(amount)) => {
                Source::Constant(a.blend(b, amount))
            }
            _ => {
                let ends = [first, second];
                self.add(Texture::Mix(Mix { ends, amount }))
            }
        }
    }

    fn bilerp<V: Kind>(&mut self, from: &mut Directive) -> Option<Source<V>> {
        let (corners, mapping) = from.read(|p| {
            let corners = ["v00", "v01", "v10", "v11"].map(|name| V::constant(p, name));
            (corners, WrittenMapping::read(p))
        });
        let corners = corners.map(|corner| V::value(&corner, self.assets, from.diagnostics));
        if corners.iter().all(|corner| *corner == corners[0]) {
            return Some(Source::Constant(corners[0]));
        }
        let mapping = self.mapping(mapping, from)?;
        Some(self.add(Texture::Bilerp(Bilerp { mapping, corners })))
    }

    fn imagemap<V: Kind>(&mut self, from: &mut Directive) -> Option<Source<V>> {
        let (mapping, filter, image) = from.read(|p| {
            let mapping = WrittenMapping::read(p);
            let max_anisotropy = p.float("maxanisotropy");
            let filter = if p.bool("trilinear") {
                Filter::Trilinear
            } else {
                Filter::Ewa { max_anisotropy }
            };
            (mapping, filter, written_image(p))
        });
        let mapping = self.mapping(mapping, from)?;
        match self.image(image?, from.diagnostics) {
            Loaded::Constant(value) => Some(Source::Constant(value)),
            Loaded::Image(image) => Some(self.add(Texture::Image(ImageTexture {
                image,
                mapping,
                filter,
            }))),
        }
    }

    fn ptex<V: Kind>(&mut self, from: &mut Directive) -> Source<V> {
        let (file, gamma) = from.read(|p| (p.file("filename"), p.float("gamma")));
        // What cannot be looked up is black.
        match file.and_then(|file| self.ptex_file(&file, from.diagnostics)) {
            Some(file) => self.add(Texture::Ptex(PtexTexture { file, gamma })),
            None => Source::Constant(V::ZERO),
        }
    }

    fn checkerboard<V: Kind>(&mut self, from: &mut Directive) -> Option<Source<V>> {
        let (dimension, fields, mapping, smoothing) = from.read(|p| {
            let dimension = p.int_choice("dimension");
            let fields = ["tex1", "tex2"].map(|name| V::textured(p, name));
            let mapping = (dimension == Some(2)).then(|| WrittenMapping::read(p));
            let smoothing = match p.choice("aamode") {
                "none" => Smoothing::None,
                _ => Smoothing::ClosedForm,
            };
            (dimension, fields, mapping, smoothing)
        });
        dimension?;
        let fields = self.pair(fields, [V::ONE, V::ZERO], from.diagnostics);
        if fields[0] == fields[1] {
            return Some(fields[0]);
        }
        Some(match mapping {
            Some(mapping) => {
                let mapping = self.mapping(mapping, from)?;
                self.add(Texture::Checkerboard2(Checkerboard2 {
                    mapping,
                    fields,
                    smoothing,
                }))
            }
            None => {
                let mapping = self.solid(from)?;
                self.add(Texture::Checkerboard3(Checkerboard3 { mapping, fields }))
            }
        })
    }

    fn dots<V: Kind>(&mut self, from: &mut Directive) -> Option<Source<V>> {
        let (sources, mapping) = from.read(|p| {
            let sources = ["inside", "outside"].map(|name| V::textured(p, name));
            (sources, WrittenMapping::read(p))
        });
        // The names are swapped, as in pbrt-v3.
        let [ground, dot] = self.pair(sources, [V::ONE, V::ZERO], from.diagnostics);
        if ground == dot {
            return Some(ground);
        }
        let mapping = self.mapping(mapping, from)?;
        Some(self.add(Texture::Dots(Dots {
            mapping,
            ground,
            dot,
        })))
    }

    fn marble<V: Kind>(&mut self, from: &mut Directive) -> Option<Source<V>> {
        let (octaves, scale, variation) =
            from.read(|p| (octaves(p), p.float("scale"), p.float("variation")));
        let mapping = self.solid(from)?;
        Some(self.add(Texture::Marble(Marble {
            mapping,
            octaves,
            scale,
            variation,
        })))
    }

    fn pair<V: Kind>(
        &mut self,
        [first, second]: [Textured<V::Written>; 2],
        defaults: [V; 2],
        diagnostics: &mut Diagnostics,
    ) -> [Source<V>; 2] {
        [
            self.source(first, defaults[0], diagnostics),
            self.source(second, defaults[1], diagnostics),
        ]
    }

    fn reads_image<T>(&self, value: &Textured<T>) -> bool {
        match value {
            Textured::Texture(texture) => self.nesting[texture.0 as usize].reads_image,
            Textured::Constant(_) | Textured::Default => false,
        }
    }
}

fn octaves(p: &mut ParamReader) -> Octaves {
    Octaves {
        // The schema keeps it in range.
        count: p.int("octaves").max(0) as u32,
        roughness: p.float("roughness"),
    }
}

fn written_image(p: &mut ParamReader) -> Option<WrittenImage> {
    let wrap = match p.choice("wrap") {
        "black" => Wrap::Black,
        "clamp" => Wrap::Clamp,
        _ => Wrap::Repeat,
    };
    let (scale, gamma) = (p.float("scale"), p.optional_bool("gamma"));
    p.file("filename").map(|file| WrittenImage {
        file,
        gamma,
        scale,
        wrap,
    })
}
