//! Scenes up to the job, with a few files that always are the same.

#![no_main]

libfuzzer_sys::fuzz_target!(init: tyndall_fuzz::let_codecs_panic(), |bytes: &[u8]| tyndall_fuzz::run(tyndall_fuzz::Budget::SCENE, tyndall_fuzz::entry::check, bytes));
