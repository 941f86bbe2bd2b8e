//! The directives: arguments, where they may stand, what they do.

use super::Family;
use std::collections::HashMap;
use std::sync::LazyLock;

/// One directive of the language.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DirectiveSchema {
    /// The word that starts it.
    pub keyword: &'static str,
    /// Its arguments as they are written.
    pub arguments: &'static str,
    /// Allowed before `WorldBegin`.
    pub in_options: bool,
    /// Allowed between `WorldBegin` and `WorldEnd`.
    pub in_world: bool,
    /// The plugins it may name.
    pub families: &'static [Family],
    /// What it does, in one line.
    pub meaning: &'static str,
}

const fn options(
    keyword: &'static str,
    arguments: &'static str,
    meaning: &'static str,
) -> DirectiveSchema {
    DirectiveSchema {
        keyword,
        arguments,
        in_options: true,
        in_world: false,
        families: &[],
        meaning,
    }
}

const fn world(
    keyword: &'static str,
    arguments: &'static str,
    meaning: &'static str,
) -> DirectiveSchema {
    DirectiveSchema {
        keyword,
        arguments,
        in_options: false,
        in_world: true,
        families: &[],
        meaning,
    }
}

const fn both(
    keyword: &'static str,
    arguments: &'static str,
    meaning: &'static str,
) -> DirectiveSchema {
    DirectiveSchema {
        keyword,
        arguments,
        in_options: true,
        in_world: true,
        families: &[],
        meaning,
    }
}

impl DirectiveSchema {
    const fn names(mut self, families: &'static [Family]) -> Self {
        self.families = families;
        self
    }
}

/// Every directive. CTM stands for the pair of current transforms (start and end of the motion).
pub static DIRECTIVES: &[DirectiveSchema] = &[
    both(
        "Include",
        "\"path\"",
        "Continues with another file; its path is relative to the top-level file.",
    ),
    both("Identity", "", "CTM := identity."),
    both("Translate", "x y z", "CTM := CTM · translation."),
    both("Scale", "x y z", "CTM := CTM · scale."),
    both(
        "Rotate",
        "degrees x y z",
        "CTM := CTM · rotation about the axis, by the right-hand rule.",
    ),
    both(
        "LookAt",
        "eye(3) target(3) up(3)",
        "CTM := CTM · (camera from world); the camera looks along +z, +y up, +x right.",
    ),
    both(
        "Transform",
        "[ 16 numbers ]",
        "CTM := the matrix, column by column.",
    ),
    both(
        "ConcatTransform",
        "[ 16 numbers ]",
        "CTM := CTM · the matrix, column by column.",
    ),
    both(
        "CoordinateSystem",
        "\"name\"",
        "Remembers the CTM under a name.",
    ),
    both(
        "CoordSysTransform",
        "\"name\"",
        "CTM := the one remembered, whatever ActiveTransform says.",
    ),
    both(
        "ActiveTransform",
        "All | StartTime | EndTime",
        "Which of the two current transforms later transform directives change.",
    ),
    options(
        "TransformTimes",
        "start end",
        "The times of the two current transforms; 0 and 1 when absent.",
    ),
    options(
        "Camera",
        "\"name\" params",
        "The camera, standing where the inverse of the CTM puts it; `perspective` when absent.",
    )
    .names(&[Family::Camera]),
    options("Film", "\"name\" params", "The image; `image` when absent.").names(&[Family::Film]),
    options(
        "PixelFilter",
        "\"name\" params",
        "How samples are weighted into pixels; `box` when absent.",
    )
    .names(&[Family::Filter]),
    options(
        "Sampler",
        "\"name\" params",
        "Where samples are taken, and how many; `halton` when absent.",
    )
    .names(&[Family::Sampler]),
    options(
        "Accelerator",
        "\"name\" params",
        "How rays find shapes; `bvh` when absent.",
    )
    .names(&[Family::Accelerator]),
    options(
        "Integrator",
        "\"name\" params",
        "How light is followed; `path` when absent.",
    )
    .names(&[Family::Integrator]),
    both(
        "MakeNamedMedium",
        "\"name\" params",
        "Defines a medium; `string type` names its kind, and the CTM places it.",
    )
    .names(&[Family::Medium]),
    both(
        "MediumInterface",
        "\"inside\" [\"outside\"]",
        "The media on both sides of later shapes and around later lights; \"\" is vacuum, one name means both sides.",
    ),
    options("WorldBegin", "", "Ends the options: CTM := identity."),
    world(
        "WorldEnd",
        "",
        "Renders the picture and forgets everything.",
    ),
    world(
        "AttributeBegin",
        "",
        "Saves the graphics state and the CTM.",
    ),
    world(
        "AttributeEnd",
        "",
        "Restores the graphics state and the CTM.",
    ),
    world("TransformBegin", "", "Saves the CTM."),
    world("TransformEnd", "", "Restores the CTM."),
    world(
        "Texture",
        "\"name\" \"float | spectrum | color\" \"class\" params",
        "Defines a texture.",
    )
    .names(&[Family::FloatTexture, Family::SpectrumTexture]),
    world(
        "Material",
        "\"name\" params",
        "The material of later shapes.",
    )
    .names(&[Family::Material]),
    world(
        "MakeNamedMaterial",
        "\"name\" params",
        "Defines a material; `string type` names its kind.",
    )
    .names(&[Family::Material]),
    world(
        "NamedMaterial",
        "\"name\"",
        "Makes a defined material the one of later shapes.",
    ),
    world("LightSource", "\"name\" params", "Adds a light.").names(&[Family::Light]),
    world(
        "AreaLightSource",
        "\"name\" params",
        "Makes later shapes emit light.",
    )
    .names(&[Family::AreaLight]),
    world(
        "Shape",
        "\"name\" params",
        "Adds a shape with everything currently in force.",
    )
    .names(&[Family::Shape]),
    world(
        "ReverseOrientation",
        "",
        "Turns the normals of later shapes round.",
    ),
    world(
        "ObjectBegin",
        "\"name\"",
        "Starts an object that is placed later; saves like AttributeBegin.",
    ),
    world(
        "ObjectEnd",
        "",
        "Ends the object; restores like AttributeEnd.",
    ),
    world(
        "ObjectInstance",
        "\"name\"",
        "Places an object: the CTM multiplies the object's own transforms on the left.",
    ),
];

/// The directive of that keyword.
pub fn directive(keyword: &str) -> Option<&'static DirectiveSchema> {
    // Asked for every directive of a scene, so searching the table would show.
    static BY_KEYWORD: LazyLock<HashMap<&str, &DirectiveSchema>> = LazyLock::new(|| {
        DIRECTIVES
            .iter()
            .map(|entry| (entry.keyword, entry))
            .collect()
    });
    BY_KEYWORD.get(keyword).copied()
}
