//! How deep textures are nested, and how many a single look-up visits.
//!
//! A texture refers to earlier ones only, so that one pass in the order of the file is enough and there are no cycles.
//! A look-up calls itself along the nesting, and visits a texture as often as paths lead to it: both are bounded here,
//! before anything is built, so that a small file can neither overflow the stack nor keep a look-up busy for ever.

use crate::describe::description::{TextureEntity, TextureRef};

/// Most textures inside one another.
const MAX_DEPTH: u32 = 64;

/// Most textures that one look-up may visit.
const MAX_VISITS: u64 = 4096;

/// What a texture refers to, taken together. Counts what is written, before constants are folded.
#[derive(Clone, Copy)]
pub(super) struct Nesting {
    depth: u32,
    visits: u64,
    /// Whether building it reads an image.
    pub(super) reads_image: bool,
}

impl Nesting {
    /// Why a texture cannot be built.
    pub(super) fn check(&self) -> Result<(), String> {
        let Self { depth, visits, .. } = *self;
        if depth > MAX_DEPTH {
            return Err(format!(
                "textures are nested {depth} deep here, and more than {MAX_DEPTH} are not evaluated"
            ));
        }
        if visits > MAX_VISITS {
            return Err(format!(
                "a look-up would visit {visits} textures here, and more than {MAX_VISITS} are too many"
            ));
        }
        Ok(())
    }
}

/// The nesting of every texture, in the order of the file.
pub(super) fn of(entities: &[TextureEntity]) -> Vec<Nesting> {
    let mut nesting: Vec<Nesting> = Vec::with_capacity(entities.len());
    for TextureEntity { entity, .. } in entities {
        let mut own = Nesting {
            depth: 1,
            visits: 1,
            reads_image: matches!(entity.kind.value.as_str(), "imagemap" | "ptex"),
        };
        let inputs = entity.textures.iter().flat_map(|b| [b.float, b.spectrum]);
        for TextureRef(input) in inputs.flatten() {
            let input = nesting[input as usize];
            own.depth = own.depth.max(input.depth.saturating_add(1));
            own.visits = own.visits.saturating_add(input.visits);
            own.reads_image |= input.reads_image;
        }
        nesting.push(own);
    }
    nesting
}
