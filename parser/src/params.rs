//! Parameter lists: typed values of the `"type name" value` pairs that follow a directive.

use std::collections::HashSet;

use crate::source::Span;

/// The value of one parameter, typed by its declaration. Aliases (`color`, `point`, `vector`) are already resolved.
///
/// Numbers follow pbrt-v3: an all-digit literal is an integer, anything else is read in single precision.
#[derive(Clone, PartialEq, Debug)]
pub enum ParamValue {
    /// `integer`, truncated toward zero.
    Integer(Vec<i32>),
    /// `float`.
    Float(Vec<f32>),
    /// `bool`.
    Bool(Vec<bool>),
    /// `string`.
    String(Vec<String>),
    /// `texture`: the name of a texture.
    Texture(String),
    /// `point2`.
    Point2(Vec<[f32; 2]>),
    /// `vector2`.
    Vector2(Vec<[f32; 2]>),
    /// `point3` or `point`.
    Point3(Vec<[f32; 3]>),
    /// `vector3` or `vector`.
    Vector3(Vec<[f32; 3]>),
    /// `normal`.
    Normal(Vec<[f32; 3]>),
    /// `rgb` or `color`: linear RGB.
    Rgb(Vec<[f32; 3]>),
    /// `xyz`: CIE XYZ.
    Xyz(Vec<[f32; 3]>),
    /// `blackbody`: temperature in kelvin and a scale.
    Blackbody(Vec<[f32; 2]>),
    /// `spectrum` given as numbers: (wavelength in nm, value) pairs of one spectrum.
    Spectrum(Vec<[f32; 2]>),
    /// `spectrum` given as strings: one file name for each spectrum.
    SpectrumFiles(Vec<String>),
}

/// Storage classes of pbrt-v3: a later parameter replaces an earlier one of the same name *and class*.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum ParamClass {
    /// `integer`
    Integer,
    /// `float`
    Float,
    /// `bool`
    Bool,
    /// `string`
    String,
    /// `texture`
    Texture,
    /// `point2`
    Point2,
    /// `vector2`
    Vector2,
    /// `point3`, `point`
    Point3,
    /// `vector3`, `vector`
    Vector3,
    /// `normal`
    Normal,
    /// `rgb`, `color`, `xyz`, `blackbody`, `spectrum`
    Spectrum,
}

/// One parameter as written.
#[derive(Clone, PartialEq, Debug)]
pub struct Param {
    /// Name without the type.
    pub name: String,
    /// Typed value.
    pub value: ParamValue,
    /// The quoted `"type name"` string.
    pub decl_span: Span,
    /// The value, brackets included.
    pub value_span: Span,
}

/// The parameters of one directive in file order, with the duplicates of pbrt-v3 resolved (the later one wins).
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ParamList {
    /// Parameters in file order.
    pub params: Vec<Param>,
}

/// The types a parameter can be declared with. Aliases are resolved: `color` is [`ParamType::Rgb`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum ParamType {
    /// `integer`
    Integer,
    /// `float`
    Float,
    /// `bool`
    Bool,
    /// `string`
    String,
    /// `texture`
    Texture,
    /// `point2`
    Point2,
    /// `vector2`
    Vector2,
    /// `point3` or `point`
    Point3,
    /// `vector3` or `vector`
    Vector3,
    /// `normal`
    Normal,
    /// `rgb` or `color`
    Rgb,
    /// `xyz`
    Xyz,
    /// `blackbody`
    Blackbody,
    /// `spectrum`
    Spectrum,
}

/// Every word a declaration may start with. The first word of a type is the one it is printed with.
const TYPE_WORDS: [(&str, ParamType); 17] = [
    ("integer", ParamType::Integer),
    ("float", ParamType::Float),
    ("bool", ParamType::Bool),
    ("string", ParamType::String),
    ("texture", ParamType::Texture),
    ("point2", ParamType::Point2),
    ("vector2", ParamType::Vector2),
    ("point3", ParamType::Point3),
    ("point", ParamType::Point3),
    ("vector3", ParamType::Vector3),
    ("vector", ParamType::Vector3),
    ("normal", ParamType::Normal),
    ("rgb", ParamType::Rgb),
    ("color", ParamType::Rgb),
    ("xyz", ParamType::Xyz),
    ("blackbody", ParamType::Blackbody),
    ("spectrum", ParamType::Spectrum),
];

impl ParamType {
    /// The type a word of a declaration names.
    pub fn from_word(word: &str) -> Option<Self> {
        TYPE_WORDS
            .iter()
            .find(|(known, _)| *known == word)
            .map(|&(_, kind)| kind)
    }

    /// The word it is written with; of several, the one without ambiguity (`rgb`, `point3`).
    pub fn word(self) -> &'static str {
        TYPE_WORDS
            .iter()
            .find(|(_, kind)| *kind == self)
            .map_or("", |&(word, _)| word)
    }

    /// Every word of a type, aliases included.
    pub fn words() -> impl Iterator<Item = &'static str> {
        TYPE_WORDS.iter().map(|&(word, _)| word)
    }

    /// The storage class.
    pub fn class(self) -> ParamClass {
        match self {
            Self::Integer => ParamClass::Integer,
            Self::Float => ParamClass::Float,
            Self::Bool => ParamClass::Bool,
            Self::String => ParamClass::String,
            Self::Texture => ParamClass::Texture,
            Self::Point2 => ParamClass::Point2,
            Self::Vector2 => ParamClass::Vector2,
            Self::Point3 => ParamClass::Point3,
            Self::Vector3 => ParamClass::Vector3,
            Self::Normal => ParamClass::Normal,
            Self::Rgb | Self::Xyz | Self::Blackbody | Self::Spectrum => ParamClass::Spectrum,
        }
    }
}

impl ParamValue {
    /// The type it was declared with.
    pub fn param_type(&self) -> ParamType {
        match self {
            Self::Integer(_) => ParamType::Integer,
            Self::Float(_) => ParamType::Float,
            Self::Bool(_) => ParamType::Bool,
            Self::String(_) => ParamType::String,
            Self::Texture(_) => ParamType::Texture,
            Self::Point2(_) => ParamType::Point2,
            Self::Vector2(_) => ParamType::Vector2,
            Self::Point3(_) => ParamType::Point3,
            Self::Vector3(_) => ParamType::Vector3,
            Self::Normal(_) => ParamType::Normal,
            Self::Rgb(_) => ParamType::Rgb,
            Self::Xyz(_) => ParamType::Xyz,
            Self::Blackbody(_) => ParamType::Blackbody,
            Self::Spectrum(_) | Self::SpectrumFiles(_) => ParamType::Spectrum,
        }
    }

    /// The storage class.
    pub fn class(&self) -> ParamClass {
        self.param_type().class()
    }

    /// Number of values in the sense of the "one value" rule: tuples count as one, all
    /// samples of a spectrum together as one spectrum, no samples as none.
    pub fn len(&self) -> usize {
        match self {
            Self::Integer(values) => values.len(),
            Self::Float(values) => values.len(),
            Self::Bool(values) => values.len(),
            Self::String(values) | Self::SpectrumFiles(values) => values.len(),
            Self::Texture(_) => 1,
            Self::Spectrum(samples) => usize::from(!samples.is_empty()),
            Self::Point2(values) | Self::Vector2(values) | Self::Blackbody(values) => values.len(),
            Self::Point3(values)
            | Self::Vector3(values)
            | Self::Normal(values)
            | Self::Rgb(values)
            | Self::Xyz(values) => values.len(),
        }
    }

    /// Whether it carries no value at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Its single-precision numbers in file order, tuples flattened; `None` for integers, booleans and strings.
    pub fn numbers(&self) -> Option<&[f32]> {
        match self {
            Self::Float(values) => Some(values),
            Self::Point2(pairs)
            | Self::Vector2(pairs)
            | Self::Blackbody(pairs)
            | Self::Spectrum(pairs) => Some(pairs.as_flattened()),
            Self::Point3(triples)
            | Self::Vector3(triples)
            | Self::Normal(triples)
            | Self::Rgb(triples)
            | Self::Xyz(triples) => Some(triples.as_flattened()),
            Self::Integer(_)
            | Self::Bool(_)
            | Self::String(_)
            | Self::Texture(_)
            | Self::SpectrumFiles(_) => None,
        }
    }

    /// Whether both say the same: like `==`, but NaN equals NaN and `-0` differs from `0`.
    pub fn says_the_same(&self, other: &Self) -> bool {
        match (self.numbers(), other.numbers()) {
            (Some(ours), Some(theirs)) => {
                let same =
                    |(a, b): (&f32, &f32)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
                self.param_type() == other.param_type()
                    && ours.len() == theirs.len()
                    && ours.iter().zip(theirs).all(same)
            }
            _ => self == other,
        }
    }
}

impl ParamList {
    /// Keeps, of parameters as written, the last one of each (name, class); the others' order stays.
    pub fn from_written(params: Vec<Param>) -> Self {
        Self::resolved(params).0
    }

    /// The same, and the parameters that gave way.
    pub fn resolved(mut params: Vec<Param>) -> (Self, Vec<Param>) {
        // Nearly every list is short; a hostile one must not cost the square of its length.
        const SHORT: usize = 16;
        let replaced = if params.len() <= SHORT {
            let is_last = |i: usize| {
                !params[i + 1..]
                    .iter()
                    .any(|later| later.key() == params[i].key())
            };
            let keep: Vec<bool> = (0..params.len()).map(is_last).collect();
            take_unmarked(&mut params, &keep)
        } else {
            let mut seen = HashSet::with_capacity(params.len());
            let mut keep: Vec<bool> = params
                .iter()
                .rev()
                .map(|param| seen.insert(param.key()))
                .collect();
            keep.reverse();
            drop(seen);
            take_unmarked(&mut params, &keep)
        };
        (Self { params }, replaced)
    }

    /// The parameter of this name and class. (A parameter of another class under the same name is another parameter.)
    pub fn get(&self, name: &str, class: ParamClass) -> Option<&Param> {
        self.params
            .iter()
            .find(|param| param.key() == (name, class))
    }

    /// Whether both have the same parameters in the same order, wherever they stand; NaN equals NaN here.
    pub fn says_the_same(&self, other: &Self) -> bool {
        let same = |(a, b): (&Param, &Param)| a.name == b.name && a.value.says_the_same(&b.value);
        self.len() == other.len() && self.iter().zip(other).all(same)
    }

    /// All parameters in file order.
    pub fn iter(&self) -> std::slice::Iter<'_, Param> {
        self.params.iter()
    }

    /// Number of parameters.
    pub fn len(&self) -> usize {
        self.params.len()
    }

    /// Whether there is no parameter.
    pub fn is_empty(&self) -> bool {
        self.params.is_empty()
    }
}

impl<'a> IntoIterator for &'a ParamList {
    type Item = &'a Param;
    type IntoIter = std::slice::Iter<'a, Param>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl Param {
    /// What tells it from the other parameters of its list.
    pub(crate) fn key(&self) -> (&str, ParamClass) {
        (&self.name, self.value.class())
    }
}

/// Removes those that are not marked.
fn take_unmarked(params: &mut Vec<Param>, keep: &[bool]) -> Vec<Param> {
    if !keep.contains(&false) {
        return Vec::new();
    }
    let mut marks = keep.iter();
    let is_dropped = |_: &mut Param| !marks.next().copied().unwrap_or(true);
    params.extract_if(.., is_dropped).collect()
}

#[cfg(test)]
mod tests {
    use super::{Param, ParamClass, ParamList, ParamType, ParamValue};
    use crate::source::{FileId, Span};

    fn param(name: &str, value: ParamValue) -> Param {
        let nowhere = Span::new(FileId(0), 0, 0);
        Param {
            name: name.to_owned(),
            value,
            decl_span: nowhere,
            value_span: nowhere,
        }
    }

    #[test]
    fn words_lead_back_to_their_type() {
        for word in ParamType::words() {
            let kind = ParamType::from_word(word).unwrap();
            assert_eq!(ParamType::from_word(kind.word()), Some(kind), "{word}");
        }
        assert_eq!(ParamType::from_word("int"), None);
        assert_eq!(ParamType::from_word("normal3"), None);
        assert_eq!(ParamType::from_word("color"), ParamType::from_word("rgb"));
    }

    #[test]
    fn the_last_of_a_name_and_class_wins_and_classes_coexist() {
        let list = ParamList::from_written(vec![
            param("Kd", ParamValue::Rgb(vec![[1.0; 3]])),
            param("Kd", ParamValue::Float(vec![1.0])),
            param("Kd", ParamValue::Blackbody(vec![[5000.0, 1.0]])),
            param("Kd", ParamValue::Texture("t".into())),
        ]);
        assert_eq!(list.len(), 3);
        let spectrum = list
            .get("Kd", ParamClass::Spectrum)
            .map(|param| param.value.param_type());
        assert_eq!(spectrum, Some(ParamType::Blackbody));
    }

    #[test]
    fn long_lists_resolve_duplicates_like_short_ones() {
        let written: Vec<Param> = (0..100)
            .map(|i| param(&format!("p{}", i % 30), ParamValue::Integer(vec![i])))
            .collect();
        let list = ParamList::from_written(written);
        let values: Vec<_> = list.iter().map(|param| param.value.clone()).collect();
        assert_eq!(
            values,
            (70..100)
                .map(|i| ParamValue::Integer(vec![i]))
                .collect::<Vec<_>>()
        );
    }
}
