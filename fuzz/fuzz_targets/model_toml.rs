#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| thud_fuzz_targets::model_toml(data));
