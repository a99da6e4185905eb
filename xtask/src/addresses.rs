//! `cargo xtask where ADDRESS...`: the places in the source that a panic record's addresses mean.
//!
//! An odd address is where a call would have gone on; the call itself is the instruction before it. An even one is that of an
//! instruction: one that faulted, or that an interrupt came before.

use std::path::Path;

use addr2line::Loader;

use crate::target::built;

/// Prints function, file and line of each address, the functions that were inlined there first.
///
/// # Errors
/// When there is no firmware file, or a word is no address.
pub fn run(words: &[String]) -> Result<(), String> {
    let path = built("thud-firmware");
    let program = Program::open(&path)?;
    for word in words {
        // As the log prints a list of them.
        let word = word.trim_matches(|at: char| "[],".contains(at));
        let digits = word.strip_prefix("0x").unwrap_or(word);
        let address =
            u64::from_str_radix(digits, 16).map_err(|_| format!("`{word}` is no address; 0x08001235 is one"))?;
        println!("{address:#010x}");
        for line in program.at(address)? {
            println!("    {line}");
        }
    }
    Ok(())
}

/// The firmware's file with what its compiler noted.
struct Program(Loader);

impl Program {
    fn open(path: &Path) -> Result<Self, String> {
        Loader::new(path).map(Self).map_err(|error| {
            format!("{}: {error}; `cargo xtask size` builds it, from the commit that the board runs", path.display())
        })
    }

    fn at(&self, address: u64) -> Result<Vec<String>, String> {
        let instruction = if address & 1 == 0 { address } else { address.saturating_sub(3) };
        if !self.0.get_section_range(b".text").is_some_and(|text| (text.begin..text.end).contains(&instruction)) {
            return Ok(vec!["not in this program".into()]);
        }
        let unreadable = |error: &dyn std::fmt::Display| format!("{address:#010x}: {error}");
        let mut frames = self.0.find_frames(instruction).map_err(|error| unreadable(&error))?;
        let mut lines = Vec::new();
        while let Some(frame) = frames.next().map_err(|error| unreadable(&error))? {
            let function = frame.function.as_ref().and_then(|name| name.demangle().ok());
            let place = frame.location.map_or_else(String::new, |at| {
                format!(
                    " at {}:{}",
                    at.file.unwrap_or("?"),
                    at.line.map_or_else(|| "?".into(), |line| line.to_string())
                )
            });
            lines.push(format!("{}{place}", function.as_deref().unwrap_or("?")));
        }
        if lines.is_empty() || lines == ["?"] {
            // Compiled without notes, as `core` is, there is still the function's name.
            let name = self.0.find_symbol(instruction).unwrap_or("?");
            lines = vec![addr2line::demangle_auto(name.into(), None).into_owned()];
        }
        Ok(lines)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[inline(never)]
    fn known_to_the_debug_information() -> usize {
        std::hint::black_box(7)
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_call_is_found_with_its_line() {
        let program = Program::open(&std::env::current_exe().unwrap()).unwrap();
        let base = program.0.relative_address_base();
        // The file's address of a function is its address here less where the program was loaded.
        let symbol = known_to_the_debug_information as *const () as u64;
        let start = std::fs::read_to_string("/proc/self/maps").unwrap();
        let loaded = u64::from_str_radix(start.split('-').next().unwrap(), 16).unwrap();
        let first = symbol - loaded + base;
        // The function's first instruction, and a call that would return behind it.
        for address in [first, first + 3] {
            let lines = program.at(address).unwrap();
            assert!(
                lines
                    .iter()
                    .any(|line| line.contains("known_to_the_debug_information") && line.contains("addresses.rs:")),
                "{lines:?}"
            );
        }
        assert_eq!(program.at(u64::from(u32::MAX)).unwrap(), ["not in this program"]);
    }
}
