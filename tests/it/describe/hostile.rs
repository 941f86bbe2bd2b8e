//! Scenes that nobody means: many mistakes, and any sequence of directives.

use tyndall::describe::description::{Frame, ShapeEntity, TextureBinding, TransformPair};
use tyndall_parser::directive::{ActiveTransform, Directive, Plugin};

use crate::describe::scene::{
    float, make_material, media, name, plugin, points, rgb, run, string, texture, texture_param,
    world,
};

#[test]
fn many_scopes_and_many_mistakes_take_linear_time() {
    let mut directives = Vec::new();
    for i in 0..20_000 {
        directives.push(Directive::AttributeBegin);
        directives.push(texture(&format!("t{i}"), "float", "constant", []));
        directives.push(Directive::NamedMaterial(plugin(&format!("m{i}"), [])));
        directives.push(make_material(&format!("n{i}"), [string("type", "matte")]));
    }
    let start = std::time::Instant::now();
    let (description, diagnostics) = run(world(directives));
    assert_eq!(description.frames[0].textures.len(), 20_000);
    let counts = diagnostics.counts();
    assert_eq!(counts.errors + counts.warnings, 40_000);
    // Of each of both kinds so many are kept.
    assert_eq!(diagnostics.list.len(), 400);
    assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
}

/// A small deterministic generator: Knuth's 64-bit linear congruence, upper bits.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 33) as usize % sides
    }

    fn number(&mut self) -> f64 {
        const NUMBERS: [f64; 12] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            90.0,
            1e-30,
            1e30,
            1e300,
            f64::NAN,
            f64::INFINITY,
            1e-300,
        ];
        NUMBERS[self.roll(NUMBERS.len())]
    }

    fn triple(&mut self) -> [f64; 3] {
        std::array::from_fn(|_| self.number())
    }

    fn word(&mut self) -> &'static str {
        const WORDS: [&str; 12] = [
            "a",
            "b",
            "A",
            "",
            "camera",
            "world",
            "mix",
            "matte",
            "none",
            "homogeneous",
            "constant",
            "float",
        ];
        WORDS[self.roll(WORDS.len())]
    }

    fn plugin(&mut self) -> Plugin {
        let params: Vec<_> = (0..self.roll(4))
            .map(|_| match self.roll(6) {
                0 => string("type", self.word()),
                1 => string("namedmaterial1", self.word()),
                2 => texture_param("Kd", self.word()),
                3 => float("radius", self.number() as f32),
                4 => points("P", self.roll(3)),
                _ => rgb("Kd", 0.5),
            })
            .collect();
        plugin(self.word(), params)
    }

    fn directive(&mut self) -> Directive {
        match self.roll(36) {
            0 => Directive::Identity,
            1 => Directive::Translate(self.triple()),
            2 => Directive::Scale(self.triple()),
            3 => Directive::Rotate {
                degrees: self.number(),
                axis: self.triple(),
            },
            4 => Directive::LookAt {
                eye: self.triple(),
                target: self.triple(),
                up: self.triple(),
            },
            5 => Directive::Transform(std::array::from_fn(|_| self.number())),
            6 => Directive::ConcatTransform(std::array::from_fn(|_| self.number())),
            7 => Directive::CoordinateSystem(name(self.word())),
            8 => Directive::CoordSysTransform(name(self.word())),
            9 => Directive::ActiveTransform(ActiveTransform::EndTime),
            10 => Directive::ActiveTransform(ActiveTransform::All),
            11 => Directive::TransformTimes([self.number(), self.number()]),
            12 => Directive::Film(self.plugin()),
            13 => Directive::Camera(self.plugin()),
            14 => Directive::MakeNamedMedium(self.plugin()),
            15 => media(self.word(), self.word()),
            16 | 17 => Directive::WorldBegin,
            18 if self.roll(8) == 0 => Directive::WorldEnd,
            18 => Directive::ObjectEnd,
            19 => Directive::AttributeBegin,
            20 => Directive::AttributeEnd,
            21 => Directive::TransformBegin,
            22 => Directive::TransformEnd,
            23 | 24 => texture(
                self.word(),
                "float",
                self.word(),
                [texture_param("tex1", self.word())],
            ),
            25 => texture(self.word(), "color", "constant", []),
            26 => Directive::Material(self.plugin()),
            27 => Directive::MakeNamedMaterial(self.plugin()),
            28 => Directive::NamedMaterial(self.plugin()),
            29 => Directive::LightSource(self.plugin()),
            30 => Directive::AreaLightSource(self.plugin()),
            31 => Directive::ReverseOrientation,
            32 => Directive::ObjectBegin(name(self.word())),
            33 => Directive::ObjectEnd,
            34 => Directive::ObjectInstance(name(self.word())),
            _ => Directive::Shape(self.plugin()),
        }
    }
}

/// Every reference leads somewhere, textures and mixes only to what came before, and every transform can be inverted.
fn assert_sound(frame: &Frame) {
    let usable = |pair: TransformPair| {
        assert!(
            [pair.start, pair.end]
                .iter()
                .all(|m| m.is_finite() && m.inverse().is_finite())
        );
    };
    let bound = |bindings: &[TextureBinding], limit: usize| {
        for texture in bindings
            .iter()
            .flat_map(|binding| [binding.float, binding.spectrum])
            .flatten()
        {
            assert!((texture.0 as usize) < limit);
        }
    };
    let shape = |shape: &ShapeEntity| {
        usable(shape.world_from_object);
        bound(&shape.entity.textures, frame.textures.len());
        bound(
            shape.private_material.as_deref().unwrap_or_default(),
            frame.textures.len(),
        );
        assert!((shape.material.0 as usize) < frame.materials.len());
        assert!(
            shape
                .area_light
                .is_none_or(|light| (light.0 as usize) < frame.area_lights.len())
        );
        for medium in [shape.media.inside, shape.media.outside]
            .into_iter()
            .flatten()
        {
            assert!((medium.0 as usize) < frame.media.len());
        }
    };
    frame
        .shapes
        .iter()
        .chain(frame.objects.iter().flat_map(|object| &object.shapes))
        .for_each(shape);
    for (index, texture) in frame.textures.iter().enumerate() {
        bound(&texture.entity.textures, index);
    }
    for (index, material) in frame.materials.iter().enumerate() {
        bound(&material.entity.textures, frame.textures.len());
        assert!(
            material
                .materials
                .iter()
                .all(|(_, part)| part.is_none_or(|part| (part.0 as usize) < index))
        );
    }
    for instance in &frame.instances {
        usable(instance.world_from_instance.pair());
        assert!(!frame.objects[instance.object.0 as usize].shapes.is_empty());
    }
    usable(frame.camera.world_from_camera);
    assert!(
        frame
            .camera
            .medium
            .is_none_or(|medium| (medium.0 as usize) < frame.media.len())
    );
    assert!(frame.transform_times.iter().all(|time| time.is_finite()));
}

#[test]
fn any_sequence_of_directives_makes_a_sound_description() {
    let (mut n_frames, mut n_shapes, mut n_instances) = (0, 0, 0);
    for seed in 0..3000 {
        let mut dice = Dice(seed);
        let directives = (0..300).map(|_| dice.directive()).collect();
        let (description, _) = run(directives);
        for frame in &description.frames {
            assert_sound(frame);
            n_shapes += frame.shapes.len();
            n_instances += frame.instances.len();
        }
        n_frames += description.frames.len();
    }
    assert!(
        n_frames > 1000 && n_shapes > 1000 && n_instances > 100,
        "{n_frames} {n_shapes} {n_instances}"
    );
}
