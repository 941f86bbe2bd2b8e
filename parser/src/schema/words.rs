//! Words of the table: each makes one entry, so that a plugin reads like its manual page.

use super::{Count, Default, ParamSchema, PluginSchema, Range, Type};

pub(super) const fn plugin(
    name: &'static str,
    meaning: &'static str,
    groups: &'static [&'static [ParamSchema]],
) -> PluginSchema {
    PluginSchema {
        name,
        aliases: &[],
        meaning,
        groups,
    }
}

pub(super) const fn param(
    name: &'static str,
    types: &'static [Type],
    default: Default,
    meaning: &'static str,
) -> ParamSchema {
    ParamSchema {
        name,
        fallbacks: &[],
        types,
        default,
        unit: "",
        range: None,
        otherwise: None,
        meaning,
    }
}

pub(super) const fn boolean(
    name: &'static str,
    default: bool,
    meaning: &'static str,
) -> ParamSchema {
    param(name, &[Type::Bool], Default::Bool(default), meaning)
}

pub(super) const fn int(name: &'static str, default: i32, meaning: &'static str) -> ParamSchema {
    param(name, &[Type::Int], Default::Int(default), meaning)
}

pub(super) const fn float(name: &'static str, default: f32, meaning: &'static str) -> ParamSchema {
    param(name, &[Type::Float], Default::Number(default), meaning)
}

pub(super) const fn text(
    name: &'static str,
    default: &'static str,
    meaning: &'static str,
) -> ParamSchema {
    param(name, &[Type::String], Default::Text(default), meaning)
}

pub(super) const fn file(name: &'static str, meaning: &'static str) -> ParamSchema {
    param(name, &[Type::File], Default::Required, meaning)
}

pub(super) const fn point3(
    name: &'static str,
    default: [f32; 3],
    meaning: &'static str,
) -> ParamSchema {
    param(name, &[Type::Point3], Default::Triple(default), meaning)
}

pub(super) const fn vector3(
    name: &'static str,
    default: [f32; 3],
    meaning: &'static str,
) -> ParamSchema {
    param(name, &[Type::Vector3], Default::Triple(default), meaning)
}

pub(super) const fn spectrum(
    name: &'static str,
    default: f32,
    meaning: &'static str,
) -> ParamSchema {
    param(name, &[Type::Spectrum], Default::Number(default), meaning)
}

pub(super) const fn float_tex(
    name: &'static str,
    default: f32,
    meaning: &'static str,
) -> ParamSchema {
    param(
        name,
        &[Type::FloatTexture],
        Default::Number(default),
        meaning,
    )
}

pub(super) const fn spectrum_tex(
    name: &'static str,
    default: f32,
    meaning: &'static str,
) -> ParamSchema {
    param(
        name,
        &[Type::SpectrumTexture],
        Default::Number(default),
        meaning,
    )
}

pub(super) const fn own_tex(
    name: &'static str,
    default: f32,
    meaning: &'static str,
) -> ParamSchema {
    param(name, &[Type::OwnTexture], Default::Number(default), meaning)
}

pub(super) const fn own_constant(
    name: &'static str,
    default: f32,
    meaning: &'static str,
) -> ParamSchema {
    param(
        name,
        &[Type::OwnConstant],
        Default::Number(default),
        meaning,
    )
}

pub(super) const fn list(
    name: &'static str,
    types: &'static [Type],
    meaning: &'static str,
) -> ParamSchema {
    param(name, types, Default::Absent, meaning)
}

/// An enumeration; `types` is `&[Type::Choice(…)]`. An unknown choice stands for the default.
pub(super) const fn choice(
    name: &'static str,
    types: &'static [Type],
    default: &'static str,
    meaning: &'static str,
) -> ParamSchema {
    param(name, types, Default::Text(default), meaning).otherwise(default)
}

const ANY: Range = Range {
    lo: f64::NEG_INFINITY,
    hi: f64::INFINITY,
    lo_open: false,
    hi_open: false,
    clamped: false,
};

impl ParamSchema {
    /// Names read when the parameter is absent.
    pub(super) const fn fallback(mut self, names: &'static [&'static str]) -> Self {
        self.fallbacks = names;
        self
    }

    pub(super) const fn unit(mut self, unit: &'static str) -> Self {
        self.unit = unit;
        self
    }

    /// The plugin cannot be made without it.
    pub(super) const fn required(mut self) -> Self {
        self.default = Default::Required;
        self
    }

    /// Not used when absent.
    pub(super) const fn optional(mut self) -> Self {
        self.default = Default::Absent;
        self
    }

    /// The default depends on something else.
    pub(super) const fn formula(mut self, words: &'static str) -> Self {
        self.default = Default::Formula(words);
        self
    }

    pub(super) const fn rgb(mut self, rgb: [f32; 3]) -> Self {
        self.default = Default::Rgb(rgb);
        self
    }

    /// What an unknown choice stands for.
    pub(super) const fn otherwise(mut self, choice: &'static str) -> Self {
        self.otherwise = Some(choice);
        self
    }

    /// An unknown choice leaves the plugin unmade.
    pub(super) const fn strict(mut self) -> Self {
        self.otherwise = None;
        self
    }

    /// Values from outside are moved to the nearest end with an error.
    pub(super) const fn between(mut self, lo: f64, hi: f64) -> Self {
        self.range = Some(Range { lo, hi, ..ANY });
        self
    }

    /// Finite values from this one on.
    pub(super) const fn at_least(mut self, lo: f64) -> Self {
        self.range = Some(Range {
            lo,
            hi_open: true,
            ..ANY
        });
        self
    }

    /// Values outside or at the ends are replaced by the default with an error.
    pub(super) const fn inside(mut self, lo: f64, hi: f64) -> Self {
        self.range = Some(Range {
            lo,
            hi,
            lo_open: true,
            hi_open: true,
            clamped: false,
        });
        self
    }

    pub(super) const fn above(self, lo: f64) -> Self {
        self.inside(lo, f64::INFINITY)
    }

    /// Values from outside are moved to the nearest end as in pbrt-v3, with a warning.
    pub(super) const fn clamped(mut self, lo: f64, hi: f64) -> Self {
        self.range = Some(Range {
            lo,
            hi,
            hi_open: hi == f64::INFINITY,
            clamped: true,
            ..ANY
        });
        self
    }
}

impl PluginSchema {
    pub(super) const fn alias(mut self, aliases: &'static [&'static str]) -> Self {
        self.aliases = aliases;
        self
    }
}

/// Any number of values.
pub(super) const MANY: Count = Count::Any;
/// Four values.
pub(super) const FOUR: Count = Count::Exactly(4);
