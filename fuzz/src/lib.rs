//! What the targets share: the entry points, and the memory an input may ask for.

pub mod entry;

use std::alloc::System;

use cap::Cap;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

/// Bytes that any input may use, however short: a picture of one colour unpacks to 16 million samples.
const FREE: usize = 512 << 20;
/// Bytes that each byte of input may use: deflate packs 1032 samples into one.
const PER_BYTE: usize = 16 << 10;

/// Runs an entry point in memory bounded by the length of its input. What needs more fails to allocate, which aborts.
pub fn run(entry: fn(&[u8]), bytes: &[u8]) {
    let limit = ALLOCATOR.allocated() + FREE + PER_BYTE * bytes.len();
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
