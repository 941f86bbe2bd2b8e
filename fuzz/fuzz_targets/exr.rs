//! OpenEXR pictures.

#![no_main]

libfuzzer_sys::fuzz_target!(init: tyndall_fuzz::let_codecs_panic(), |bytes: &[u8]| tyndall_fuzz::run(tyndall_fuzz::Budget::PICTURE, tyndall_fuzz::entry::exr, bytes));
