//! Bodies in ASCII, of any layout: numbers between white space. Like the readers in C, this one gives no meaning to
//! the ends of lines and takes every spelling of `strtof`.

use tyndall_parser::numbers::{Number, is_space, literal};

use super::builder::Builder;
use super::general::ends_early;
use super::header::{Element, Header, Role, Use};
use super::{Place, PlyError};
use ply_rs_bw::ply::PropertyType;

/// Why a number could not be had; the place is where the reader stands.
enum Fault {
    Ended,
    Wrong(String),
}

/// The words of a body.
struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Words<'a> {
    #[inline]
    fn next(&mut self) -> Result<&'a [u8], Fault> {
        let rest = &self.bytes[self.at..];
        let start = rest
            .iter()
            .position(|&b| !is_space(b))
            .ok_or(Fault::Ended)?;
        let rest = &rest[start..];
        let length = rest.iter().position(|&b| is_space(b)).unwrap_or(rest.len());
        self.at += start + length;
        Ok(&rest[..length])
    }

    #[inline]
    fn number(&mut self) -> Result<Number, Fault> {
        let word = self.next()?;
        match literal(word) {
            Some(literal) if literal.used == word.len() => Ok(literal.number),
            _ => {
                let start = &word[..word.len().min(40)];
                let word = String::from_utf8_lossy(start);
                Err(Fault::Wrong(format!("`{word}` is not a number")))
            }
        }
    }

    /// The length of a list.
    fn length(&mut self) -> Result<usize, Fault> {
        let length = self.number()?.to_f64();
        if length >= 0.0 && length.fract() == 0.0 {
            Ok(length as usize)
        } else {
            Err(Fault::Wrong(format!("a list has the length {length}")))
        }
    }
}

/// Reads the items of one element from `at` on; returns where they end.
pub(super) fn read(
    element: &Element,
    header: &Header,
    bytes: &[u8],
    at: usize,
    builder: &mut Builder,
) -> Result<usize, PlyError> {
    let mut words = Words { bytes, at };
    let columns: Vec<(Use, bool)> = element
        .def
        .properties
        .values()
        .zip(&element.uses)
        .map(|(property, usage)| (*usage, matches!(property.data_type, PropertyType::List(..))))
        .collect();
    let mut lists = Lists::default();
    for index in 0..element.n_items() {
        read_item(element.role, &columns, &mut words, &mut lists, builder).map_err(|fault| {
            let line = Place::Line(header.line_of(bytes, words.at));
            match fault {
                Fault::Ended => ends_early(element, index, line),
                Fault::Wrong(message) => PlyError::invalid(line, message),
            }
        })?;
    }
    Ok(words.at)
}

/// The lists of a face.
#[derive(Default)]
struct Lists {
    corners: Vec<f64>,
    uvs: Vec<f32>,
}

fn read_item(
    role: Role,
    columns: &[(Use, bool)],
    words: &mut Words<'_>,
    lists: &mut Lists,
    builder: &mut Builder,
) -> Result<(), Fault> {
    let mut vertex = [0.0; 8];
    let mut face_index = 0.0;
    for &(usage, is_list) in columns {
        match usage {
            Use::Skip => {
                let n_words = if is_list { words.length()? } else { 1 };
                for _ in 0..n_words {
                    words.next()?;
                }
            }
            Use::Slot(slot) => vertex[slot] = words.number()?.to_f32(),
            Use::FaceIndex => face_index = words.number()?.to_f64(),
            Use::Corners => {
                lists.corners.clear();
                for _ in 0..words.length()? {
                    lists.corners.push(words.number()?.to_f64());
                }
            }
            Use::CornerUvs => {
                lists.uvs.clear();
                for _ in 0..words.length()? {
                    lists.uvs.push(words.number()?.to_f32());
                }
            }
        }
    }
    match role {
        Role::Vertex => builder.vertex(vertex),
        Role::Face => builder
            .face_of_numbers(&lists.corners, face_index, &lists.uvs)
            .map_err(Fault::Wrong)?,
        Role::Other => {}
    }
    Ok(())
}
