#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| cornermill_fuzz::manifest(data));
