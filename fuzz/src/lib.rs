//! What the targets share: the entry points, and the memory an input may ask for.

pub mod entry;

use std::alloc::System;

use cap::Cap;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

/// Memory in bytes that an input may use.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// However short it is.
    free: usize,
    /// For each of its bytes.
    per_byte: usize,
}

impl Budget {
    /// For text and meshes, where a byte is no more than a few numbers.
    pub const TEXT: Self = Self {
        free: 32 << 20,
        per_byte: 1 << 10,
    };

    /// For scenes, where a few bytes may be a triangle that is subdivided.
    pub const SCENE: Self = Self {
        free: 256 << 20,
        per_byte: 4 << 10,
    };

    /// For pictures: one of a single colour unpacks to 16 million samples, and deflate packs 1032 samples into a byte.
    pub const PICTURE: Self = Self {
        free: 512 << 20,
        per_byte: 16 << 10,
    };
}

/// Runs an entry point in memory bounded by the length of its input. What needs more fails to allocate, which aborts.
pub fn run(budget: Budget, entry: fn(&[u8]), bytes: &[u8]) {
    let limit = ALLOCATOR.allocated() + budget.free + budget.per_byte * bytes.len();
    ALLOCATOR
        .set_limit(limit)
        .expect("less is in use than is allowed");
    entry(bytes);
    ALLOCATOR.set_limit(usize::MAX).expect("no limit");
}

/// Undoes that every panic aborts. `codec::decode` answers panics of the codecs below it with an error; those that get
/// past it still end the run.
pub fn let_codecs_panic() {
    std::panic::set_hook(Box::new(|_| {}));
}
