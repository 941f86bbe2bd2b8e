//! Ptex files, read and filtered.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| tyndall_fuzz::run(
    tyndall_fuzz::Budget::PICTURE,
    tyndall_fuzz::entry::ptex,
    bytes
));
