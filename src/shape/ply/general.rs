//! Bodies through ply-rs, one item at a time: every type, byte order and layout.

use ply_rs_bw::parser::{ParseError, Parser};
use ply_rs_bw::ply::{Encoding, Property, PropertyAccess, PropertyAccessResult};

use super::builder::Builder;
use super::header::{Element, Header, Role, Use, first_line};
use super::{Place, PlyError};

/// The properties of one item, in the order of the declaration, which is the order in which ply-rs reads them.
struct Item(Vec<Property>);

impl Item {
    /// Words of its line in ASCII.
    fn n_words(&self) -> usize {
        self.0.iter().map(|property| 1 + list(property).len()).sum()
    }
}

impl PropertyAccess for Item {
    fn new() -> Self {
        Self(Vec::new())
    }

    fn set_property(&mut self, _name: &str, property: Property) -> PropertyAccessResult {
        self.0.push(property);
        PropertyAccessResult::Set
    }
}

/// Reads the items of one element in a binary encoding from `at` on; returns where they end.
pub(super) fn read_binary(
    element: &Element,
    encoding: Encoding,
    bytes: &[u8],
    at: usize,
    builder: &mut Builder,
) -> Result<usize, PlyError> {
    let parser = Parser::<Item>::new();
    let mut rest = &bytes[at..];
    for index in 0..element.n_items() {
        let place = Place::Byte(bytes.len() - rest.len());
        let item = if encoding == Encoding::BinaryBigEndian {
            parser.read_big_endian_element(&mut rest, &element.def)
        } else {
            parser.read_little_endian_element(&mut rest, &element.def)
        };
        add(element, item, index, place, builder)?;
    }
    Ok(bytes.len() - rest.len())
}

/// Reads the items of one element in ASCII, one per line; returns where they end.
pub(super) fn read_ascii(
    element: &Element,
    header: &Header,
    bytes: &[u8],
    at: usize,
    builder: &mut Builder,
) -> Result<usize, PlyError> {
    let parser = Parser::<Item>::new();
    let mut end = at;
    let mut line = header.line_of(bytes, at) + 1;
    let mut index = 0;
    while index < element.n_items() {
        let place = Place::Line(line);
        let rest = &bytes[end..];
        if rest.is_empty() {
            return Err(ends_early(element, index, place));
        }
        let length = rest
            .iter()
            .position(|&b| b == header.line_end)
            .map_or(rest.len(), |n| n + 1);
        let text = str::from_utf8(&rest[..length])
            .map_err(|_| PlyError::invalid(place, "bytes that are not text"))?
            .trim();
        end += length;
        line += 1;
        if !text.is_empty() {
            let item = parser.read_ascii_element(text, &element.def);
            // ply-rs looks no further than it has to; the next item would begin in this line.
            if item
                .as_ref()
                .is_ok_and(|item| item.n_words() < text.split_whitespace().count())
            {
                return Err(PlyError::invalid(place, "more than one item in a line"));
            }
            add(element, item, index, place, builder)?;
            index += 1;
        }
    }
    Ok(end)
}

/// The error of a body that ends before its last item.
pub(super) fn ends_early(element: &Element, index: usize, at: Place) -> PlyError {
    let (name, count) = (&element.def.name, element.def.count);
    let message = format!("the file ends in item {index} of {count} of element `{name}`");
    PlyError::invalid(at, message)
}

fn add(
    element: &Element,
    item: Result<Item, ParseError>,
    index: usize,
    place: Place,
    builder: &mut Builder,
) -> Result<(), PlyError> {
    let Item(properties) = item.map_err(|error| {
        if error.kind() == std::io::ErrorKind::UnexpectedEof {
            ends_early(element, index, place)
        } else {
            PlyError::invalid(place, first_line(&error.to_string()))
        }
    })?;
    let mut vertex = [0.0; 8];
    let (mut corners, mut uvs) = (Vec::new(), Vec::new());
    let mut face_index = 0.0;
    for (property, usage) in properties.iter().zip(&element.uses) {
        match *usage {
            Use::Skip => {}
            Use::Slot(slot) => vertex[slot] = number(property) as f32,
            Use::FaceIndex => face_index = number(property),
            Use::Corners => corners = list(property),
            Use::CornerUvs => uvs = list(property).iter().map(|&x| x as f32).collect(),
        }
    }
    match element.role {
        Role::Vertex => builder.vertex(vertex),
        Role::Face => builder
            .face_of_numbers(&corners, face_index, &uvs)
            .map_err(|message| PlyError::invalid(place, message))?,
        Role::Other => {}
    }
    Ok(())
}

/// A number of any type; the header was checked to declare no list here.
fn number(property: &Property) -> f64 {
    match *property {
        Property::Char(n) => f64::from(n),
        Property::UChar(n) => f64::from(n),
        Property::Short(n) => f64::from(n),
        Property::UShort(n) => f64::from(n),
        Property::Int(n) => f64::from(n),
        Property::UInt(n) => f64::from(n),
        Property::Float(x) => f64::from(x),
        Property::Double(x) => x,
        _ => f64::NAN,
    }
}

/// A list of any type as numbers; empty for a scalar.
fn list(property: &Property) -> Vec<f64> {
    fn wide<T: Copy + Into<f64>>(items: &[T]) -> Vec<f64> {
        items.iter().map(|&item| item.into()).collect()
    }
    match property {
        Property::ListChar(items) => wide(items),
        Property::ListUChar(items) => wide(items),
        Property::ListShort(items) => wide(items),
        Property::ListUShort(items) => wide(items),
        Property::ListInt(items) => wide(items),
        Property::ListUInt(items) => wide(items),
        Property::ListFloat(items) => wide(items),
        Property::ListDouble(items) => wide(items),
        _ => Vec::new(),
    }
}
