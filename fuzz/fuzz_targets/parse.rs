//! Bytes to directives, printed and read again.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| tyndall_fuzz::run(
    tyndall_fuzz::Budget::TEXT,
    tyndall_fuzz::entry::parse,
    bytes
));
