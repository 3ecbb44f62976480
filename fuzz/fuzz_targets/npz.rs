//! See `readers.rs`.
#![no_main]

use libfuzzer_sys::fuzz_target;

#[path = "../readers.rs"]
mod readers;

fuzz_target!(|bytes: &[u8]| {
    readers::read("npz", bytes);
});
