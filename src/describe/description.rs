//! The scene description: what a file means, as plain entities. Nothing is opened or built yet.

use glam::{DAffine3, DMat4};
use tyndall_parser::params::ParamList;
use tyndall_parser::source::{Span, Spanned};

/// Index into [`Frame::textures`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub struct TextureRef(pub u32);

/// Index into [`Frame::materials`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub struct MaterialRef(pub u32);

/// Index into [`Frame::media`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub struct MediumRef(pub u32);

/// Index into [`Frame::area_lights`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub struct AreaLightRef(pub u32);

/// Index into [`Frame::objects`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub struct ObjectRef(pub u32);

/// The two current transforms of pbrt-v3: at the start and at the end of the motion.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TransformPair {
    /// At the start of the motion; the only one static things use.
    pub start: DMat4,
    /// At the end of the motion.
    pub end: DMat4,
}

impl TransformPair {
    /// Whether the two differ.
    pub fn is_animated(&self) -> bool {
        self.start != self.end
    }
}

/// A pair of affine transforms in the memory that it takes: scenes may have a million.
#[derive(Clone, Debug)]
pub struct CompactPair {
    start: DAffine3,
    /// Where it differs.
    end: Option<Box<DAffine3>>,
}

impl CompactPair {
    /// From matrices that have 0 0 0 1 as their last row; the end where it differs.
    pub fn new(start: &DMat4, end: Option<&DMat4>) -> Self {
        Self {
            start: DAffine3::from_mat4(*start),
            end: end.map(|end| Box::new(DAffine3::from_mat4(*end))),
        }
    }

    /// At the start of the motion.
    pub fn start(&self) -> &DAffine3 {
        &self.start
    }

    /// At its end, where that differs.
    pub fn end(&self) -> Option<&DAffine3> {
        self.end.as_deref()
    }

    /// As matrices.
    pub fn pair(&self) -> TransformPair {
        let start = DMat4::from(self.start);
        let end = self.end.as_ref().map_or(start, |end| DMat4::from(**end));
        TransformPair { start, end }
    }
}

/// A plugin with its parameters and everything its names referred to where it was written.
#[derive(Clone, Debug)]
pub struct Entity {
    /// Plugin name, e.g. `sphere`, `glass`.
    pub kind: Spanned<String>,
    /// Parameters as written.
    pub params: ParamList,
    /// What the `texture` parameters of `params` refer to.
    pub textures: Vec<TextureBinding>,
    /// The whole directive.
    pub span: Span,
}

/// What one `texture` parameter refers to. Float and spectrum textures are separate name spaces, and which
/// one is meant is known only to the plugin that reads the parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureBinding {
    /// Index into [`ParamList::params`].
    pub param: usize,
    /// Float texture of that name, if there is one.
    pub float: Option<TextureRef>,
    /// Spectrum texture of that name, if there is one.
    pub spectrum: Option<TextureRef>,
    /// When there is neither: the name nearest to it and where that was defined.
    pub near_miss: Option<Box<Spanned<String>>>,
}

/// Value type of a texture.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TextureType {
    /// Scalar.
    Float,
    /// Colour.
    Spectrum,
}

/// A `Texture` directive.
#[derive(Clone, Debug)]
pub struct TextureEntity {
    /// Its name.
    pub name: Spanned<String>,
    /// Its value type.
    pub value_type: TextureType,
    /// Class and parameters.
    pub entity: Entity,
    /// The CTM at the directive.
    pub world_from_texture: TransformPair,
}

/// A `Material` or `MakeNamedMaterial` directive.
#[derive(Clone, Debug)]
pub struct MaterialEntity {
    /// Its name, for a named material.
    pub name: Option<Spanned<String>>,
    /// Kind (`""` and `none` are the null material) and parameters.
    pub entity: Entity,
    /// What `namedmaterial1` and `namedmaterial2` of a `mix` referred to: (parameter index, material if known).
    pub materials: Vec<(usize, Option<MaterialRef>)>,
}

/// A `MakeNamedMedium` directive. `entity.kind` is the value of its `string type`.
#[derive(Clone, Debug)]
pub struct MediumEntity {
    /// Its name.
    pub name: Spanned<String>,
    /// Type and parameters.
    pub entity: Entity,
    /// The CTM at the directive.
    pub world_from_medium: TransformPair,
}

/// The media on both sides of a surface, as they were defined when the surface was; `None` is vacuum.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct MediumPair {
    /// On the side the normal points away from.
    pub inside: Option<MediumRef>,
    /// On the side the normal points to.
    pub outside: Option<MediumRef>,
}

/// A `LightSource` directive.
#[derive(Clone, Debug)]
pub struct LightEntity {
    /// Kind and parameters.
    pub entity: Entity,
    /// The CTM at the directive.
    pub world_from_light: TransformPair,
    /// The outside medium at the directive.
    pub medium: Option<MediumRef>,
}

/// A `Shape` directive with the state it was made under.
#[derive(Clone, Debug)]
pub struct ShapeEntity {
    /// Kind and parameters.
    pub entity: Entity,
    /// The CTM at the directive; animated when the two differ.
    pub world_from_object: TransformPair,
    /// Whether `ReverseOrientation` was on.
    pub reverse_orientation: bool,
    /// The material.
    pub material: MaterialRef,
    /// pbrt-v3's guess says that the shape overrides material parameters: the material is rebuilt for this
    /// shape from (shape parameters, then material parameters). Holds the material's texture bindings as
    /// they are visible *at the shape*.
    pub private_material: Option<Vec<TextureBinding>>,
    /// The area light it emits with.
    pub area_light: Option<AreaLightRef>,
    /// The media on its two sides.
    pub media: MediumPair,
}

/// An `ObjectBegin … ObjectEnd` definition.
#[derive(Clone, Debug)]
pub struct ObjectEntity {
    /// Its name.
    pub name: Spanned<String>,
    /// Its shapes; their transforms hold the CTM in force at the definition.
    pub shapes: Vec<ShapeEntity>,
}

/// An `ObjectInstance` directive.
#[derive(Clone, Debug)]
pub struct InstanceEntity {
    /// The object placed.
    pub object: ObjectRef,
    /// The CTM at the directive; multiplies the object's own transforms on the left.
    pub world_from_instance: CompactPair,
    /// The directive.
    pub span: Span,
}

/// The camera with the state it takes from its surroundings.
#[derive(Clone, Debug)]
pub struct CameraEntity {
    /// Kind and parameters.
    pub entity: Entity,
    /// Camera space (left-handed, +x right, +y up, +z forward) to world: the inverse of the CTM.
    pub world_from_camera: TransformPair,
    /// The outside medium in force at `WorldEnd`, as pbrt-v3 takes it.
    pub medium: Option<MediumRef>,
}

/// One picture: the options and the world of a `WorldBegin … WorldEnd` block.
///
/// Options that the file leaves out hold pbrt-v3's default kind with an empty parameter list.
#[derive(Clone, Debug)]
pub struct Frame {
    /// `Film`, default `image`.
    pub film: Entity,
    /// `PixelFilter`, default `box`.
    pub filter: Entity,
    /// `Sampler`, default `halton`.
    pub sampler: Entity,
    /// `Accelerator`, default `bvh`.
    pub accelerator: Entity,
    /// `Integrator`, default `path`.
    pub integrator: Entity,
    /// `Camera`, default `perspective`.
    pub camera: CameraEntity,
    /// `TransformTimes`, default (0, 1).
    pub transform_times: [f64; 2],
    /// Named media, redefinitions included, in file order.
    pub media: Vec<MediumEntity>,
    /// Textures, redefinitions included, in file order: a texture only refers to earlier ones.
    pub textures: Vec<TextureEntity>,
    /// Materials in file order; entry 0 is the default matte.
    pub materials: Vec<MaterialEntity>,
    /// `AreaLightSource` directives in file order.
    pub area_lights: Vec<Entity>,
    /// `LightSource` directives in file order.
    pub lights: Vec<LightEntity>,
    /// Shapes outside object definitions, in file order.
    pub shapes: Vec<ShapeEntity>,
    /// Object definitions, redefinitions included, in file order.
    pub objects: Vec<ObjectEntity>,
    /// Instances in file order.
    pub instances: Vec<InstanceEntity>,
    /// The `WorldEnd` directive.
    pub span: Span,
}

/// Everything the input asks for: one frame for each `WorldBegin … WorldEnd`.
#[derive(Clone, Debug, Default)]
pub struct SceneDescription {
    /// Frames in file order.
    pub frames: Vec<Frame>,
}
