//! What is current while a scene file is read, and the two stacks that save it.

use super::description::{
    AreaLightRef, CameraEntity, Entity, InstanceEntity, LightEntity, MaterialEntity, MaterialRef,
    MediumEntity, MediumRef, ObjectEntity, ObjectRef, ShapeEntity, TextureEntity, TextureRef,
    TransformPair,
};
use super::names::Scoped;
use glam::DMat4;
use std::collections::{HashMap, HashSet};
use std::mem::Discriminant;
use tyndall_parser::directive::{ActiveTransform, Directive};
use tyndall_parser::params::ParamList;
use tyndall_parser::source::{FileId, Span, Spanned};

/// The current transforms and which of them transform directives change. Saved and restored all the time, so that it is
/// kept small.
#[derive(Clone, Debug)]
pub(super) struct Ctm {
    /// At the start of the motion.
    pub(super) start: DMat4,
    /// At its end, where that differs.
    pub(super) end: Option<Box<DMat4>>,
    /// Which of them change.
    pub(super) active: ActiveTransform,
    /// What hides or bends what is below, where something does.
    pub(super) flaws: Option<Box<Flaws>>,
}

/// The directives that took from the current transforms what geometry needs of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Flaws {
    /// What took away the inverse, at the start and at the end of the motion: shapes below vanish.
    pub(super) singular: [Option<Span>; 2],
    /// What had a projective last row, which is left out.
    pub(super) projective: [Option<Span>; 2],
}

impl Flaws {
    /// Whether there is one.
    pub(super) fn is_any(&self) -> bool {
        self.singular
            .iter()
            .chain(&self.projective)
            .any(Option::is_some)
    }
}

impl Default for Ctm {
    fn default() -> Self {
        Self {
            start: DMat4::IDENTITY,
            end: None,
            active: ActiveTransform::All,
            flaws: None,
        }
    }
}

impl Ctm {
    /// The transforms.
    pub(super) fn pair(&self) -> TransformPair {
        TransformPair {
            start: self.start,
            end: self.end.as_deref().copied().unwrap_or(self.start),
        }
    }

    /// Whether the two differ.
    pub(super) fn is_animated(&self) -> bool {
        self.end.is_some()
    }

    /// What hides everything below: a transform without an inverse.
    pub(super) fn hidden_by(&self) -> Option<Span> {
        let [start, end] = self.flaws.as_ref()?.singular;
        start.or(end)
    }

    /// The same with other transforms.
    pub(super) fn with(&self, pair: &TransformPair) -> Self {
        Self {
            start: pair.start,
            end: pair.is_animated().then(|| Box::new(pair.end)),
            active: self.active,
            flaws: self.flaws.clone(),
        }
    }

    /// The same with the active transforms changed.
    pub(super) fn changed(&self, change: impl Fn(DMat4) -> DMat4) -> Self {
        if self.active == ActiveTransform::All && !self.is_animated() {
            return Self {
                start: change(self.start),
                end: None,
                active: self.active,
                flaws: self.flaws.clone(),
            };
        }
        let TransformPair { start, end } = self.pair();
        self.with(&match self.active {
            ActiveTransform::All => TransformPair {
                start: change(start),
                end: change(end),
            },
            ActiveTransform::StartTime => TransformPair {
                start: change(start),
                end,
            },
            ActiveTransform::EndTime => TransformPair {
                start,
                end: change(end),
            },
        })
    }
}

/// A named coordinate system.
#[derive(Clone, Debug)]
pub(super) struct CoordinateSystem {
    /// Its transforms.
    pub(super) pair: TransformPair,
    /// What is wrong with them.
    pub(super) flaws: Option<Box<Flaws>>,
    /// Where it was named.
    pub(super) span: Span,
}

/// The part of the graphics state that is saved as a whole. Names are saved as marks in their maps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Graphics {
    /// Material of later shapes.
    pub(super) material: MaterialRef,
    /// Emission of later shapes.
    pub(super) area_light: Option<AreaLightRef>,
    /// Whether later shapes are turned inside out.
    pub(super) reverse_orientation: bool,
    /// Index of the `MediumInterface` in force, into [`Draft::interfaces`]; `None` is vacuum on both sides.
    pub(super) interface: Option<usize>,
}

/// A saved graphics state.
#[derive(Clone, Copy, Debug)]
pub(super) struct SavedGraphics {
    /// The values.
    pub(super) graphics: Graphics,
    /// Mark in the float textures.
    pub(super) float_textures: usize,
    /// Mark in the spectrum textures.
    pub(super) spectrum_textures: usize,
    /// Mark in the named materials.
    pub(super) named_materials: usize,
}

/// What saved a transform.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Block {
    /// `AttributeBegin`
    Attribute,
    /// `TransformBegin`
    Transform,
    /// `ObjectBegin`
    Object,
}

impl Block {
    /// The directive that starts it.
    pub(super) fn begin(self) -> &'static str {
        match self {
            Self::Attribute => "AttributeBegin",
            Self::Transform => "TransformBegin",
            Self::Object => "ObjectBegin",
        }
    }

    /// The directive that ends it.
    pub(super) fn end(self) -> &'static str {
        match self {
            Self::Attribute => "AttributeEnd",
            Self::Transform => "TransformEnd",
            Self::Object => "ObjectEnd",
        }
    }
}

/// A saved transform. All blocks share one stack, so that crossed blocks restore the wrong one, as in pbrt-v3.
#[derive(Clone, Debug)]
pub(super) struct SavedCtm {
    /// What was current.
    pub(super) ctm: Ctm,
    /// What saved it.
    pub(super) block: Block,
    /// Where.
    pub(super) span: Span,
}

/// A `MediumInterface` directive: names, to be looked up at each use.
#[derive(Clone, Debug)]
pub(super) struct Interface {
    /// Medium inside.
    pub(super) inside: Spanned<String>,
    /// Medium outside.
    pub(super) outside: Spanned<String>,
}

/// The options given so far.
#[derive(Debug, Default)]
pub(super) struct Options {
    /// `Film`
    pub(super) film: Option<Entity>,
    /// `PixelFilter`
    pub(super) filter: Option<Entity>,
    /// `Sampler`
    pub(super) sampler: Option<Entity>,
    /// `Accelerator`
    pub(super) accelerator: Option<Entity>,
    /// `Integrator`
    pub(super) integrator: Option<Entity>,
    /// `Camera`
    pub(super) camera: Option<CameraEntity>,
    /// `TransformTimes`
    pub(super) transform_times: Option<[f64; 2]>,
}

/// A frame in the making: everything that `WorldEnd` forgets.
#[derive(Debug)]
pub(super) struct Draft {
    /// `WorldBegin`, once it was met: the world block.
    pub(super) world: Option<Span>,
    /// Kinds of directives that were met in this block and may stand in it.
    pub(super) allowed: Vec<Discriminant<Directive>>,
    /// The options.
    pub(super) options: Options,
    /// The current transforms.
    pub(super) ctm: Ctm,
    /// Saved transforms, of attribute, transform and object blocks alike.
    pub(super) saved_ctms: Vec<SavedCtm>,
    /// The current graphics state.
    pub(super) graphics: Graphics,
    /// Saved graphics states.
    pub(super) saved_graphics: Vec<SavedGraphics>,
    /// Float textures by name.
    pub(super) float_textures: Scoped<TextureRef>,
    /// Spectrum textures by name.
    pub(super) spectrum_textures: Scoped<TextureRef>,
    /// Named materials.
    pub(super) named_materials: Scoped<MaterialRef>,
    /// Named media. Not scoped.
    pub(super) named_media: HashMap<String, MediumRef>,
    /// Objects by name. Not scoped.
    pub(super) named_objects: HashMap<String, ObjectRef>,
    /// Coordinate systems by name. Not scoped.
    pub(super) coordinate_systems: HashMap<String, CoordinateSystem>,
    /// Transforms already reported for what is below them, by their place.
    pub(super) reported_transforms: HashSet<Span>,
    /// Places of projective matrices: reported at the end unless something was below them.
    pub(super) projective: Vec<Span>,
    /// The object being defined.
    pub(super) object: Option<ObjectRef>,
    /// Every `MediumInterface`.
    pub(super) interfaces: Vec<Interface>,
    /// Medium names already reported as unknown, by their place.
    pub(super) reported_media: HashSet<Span>,
    /// Area lights already reported as standing in an object.
    pub(super) reported_area_lights: HashSet<AreaLightRef>,
    /// Media in file order.
    pub(super) media: Vec<MediumEntity>,
    /// Textures in file order.
    pub(super) textures: Vec<TextureEntity>,
    /// Materials in file order, the default matte first.
    pub(super) materials: Vec<MaterialEntity>,
    /// Area lights in file order.
    pub(super) area_lights: Vec<Entity>,
    /// Lights in file order.
    pub(super) lights: Vec<LightEntity>,
    /// Shapes outside objects in file order.
    pub(super) shapes: Vec<ShapeEntity>,
    /// Objects in file order.
    pub(super) objects: Vec<ObjectEntity>,
    /// Instances in file order.
    pub(super) instances: Vec<InstanceEntity>,
}

impl Default for Draft {
    fn default() -> Self {
        // The default matte stands nowhere in the file; nothing about it is ever reported.
        let nowhere = Span {
            file: FileId(0),
            lo: 0,
            hi: 0,
        };
        let matte = MaterialEntity {
            name: None,
            entity: default_entity("matte", nowhere),
            materials: Vec::new(),
        };
        let graphics = Graphics {
            material: MaterialRef(0),
            area_light: None,
            reverse_orientation: false,
            interface: None,
        };
        Self {
            world: None,
            allowed: Vec::new(),
            options: Options::default(),
            ctm: Ctm::default(),
            saved_ctms: Vec::new(),
            graphics,
            saved_graphics: Vec::new(),
            float_textures: Scoped::default(),
            spectrum_textures: Scoped::default(),
            named_materials: Scoped::default(),
            named_media: HashMap::new(),
            named_objects: HashMap::new(),
            coordinate_systems: HashMap::new(),
            reported_transforms: HashSet::new(),
            projective: Vec::new(),
            object: None,
            interfaces: Vec::new(),
            reported_media: HashSet::new(),
            reported_area_lights: HashSet::new(),
            media: Vec::new(),
            textures: Vec::new(),
            materials: vec![matte],
            area_lights: Vec::new(),
            lights: Vec::new(),
            shapes: Vec::new(),
            objects: Vec::new(),
            instances: Vec::new(),
        }
    }
}

/// What holds when a directive is absent: a plugin without parameters.
pub(super) fn default_entity(kind: &str, span: Span) -> Entity {
    Entity {
        kind: Spanned::new(kind.to_owned(), span),
        params: ParamList::default(),
        textures: Vec::new(),
        span,
    }
}

impl Draft {
    /// Saves the graphics state and the transforms.
    pub(super) fn push_graphics(&mut self, block: Block, span: Span) {
        self.saved_graphics.push(SavedGraphics {
            graphics: self.graphics,
            float_textures: self.float_textures.mark(),
            spectrum_textures: self.spectrum_textures.mark(),
            named_materials: self.named_materials.mark(),
        });
        self.push_ctm(block, span);
    }

    /// Restores the graphics state, not the transforms. False when none was saved.
    pub(super) fn pop_graphics(&mut self) -> bool {
        let Some(saved) = self.saved_graphics.pop() else {
            return false;
        };
        self.graphics = saved.graphics;
        self.float_textures.undo_to(saved.float_textures);
        self.spectrum_textures.undo_to(saved.spectrum_textures);
        self.named_materials.undo_to(saved.named_materials);
        true
    }

    /// Saves the transforms.
    pub(super) fn push_ctm(&mut self, block: Block, span: Span) {
        self.saved_ctms.push(SavedCtm {
            ctm: self.ctm.clone(),
            block,
            span,
        });
    }
}
