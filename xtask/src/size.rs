//! `cargo xtask size`: what the firmware takes of the board's memory, beside what it may.
//!
//! ```text
//! flash        = everything loaded: vectors, program, constants, initial values of .data
//! static RAM   = .data, .bss, the capture buffer, what survives a reset
//! stack        = what the linker leaves to it between _stack_end and _stack_start: all of the CCM, where nothing else may lie,
//!                so that an overflow leaves memory and is a fault. How deep it gets is measured in the emulator, whose test at full
//!                load notes it beside the program (tests/emulator/src/stack_depth.rs).
//! ```

use std::fs;

use object::elf::{FileHeader32, PT_LOAD, SHF_ALLOC, SHT_NOBITS};
use object::read::elf::{ElfFile32, FileHeader as _, ProgramHeader as _, SectionHeader as _};
use object::{Endianness, Object as _, ObjectSymbol as _};

use crate::step;
use crate::target::{Toolchain, built};

/// What the project grants itself; the chip has four times as much flash and a third more memory.
const FLASH_BUDGET: u64 = 128 * 1024;
const RAM_BUDGET: u64 = 96 * 1024;
/// Least room for the stack, see `docs/board.md`.
const STACK_BUDGET: u64 = 32 * 1024;
/// Stack that must never have been used.
const STACK_RESERVE: u64 = 8 * 1024;
/// Where the emulator notes a build id and the depth that it has seen, beside the program.
const STACK_DEPTH: &str = "stack-depth";
/// RM0440, 2.2: flash, SRAM1 with SRAM2.
const FLASH: std::ops::Range<u64> = 0x0800_0000..0x0808_0000;
const RAM: std::ops::Range<u64> = 0x2000_0000..0x2001_8000;
/// RM0440, 2.2: the CCM, below which there is no memory.
const CCM: std::ops::Range<u64> = 0x1000_0000..0x1000_8000;
/// Symbols that are listed.
const LARGEST: usize = 12;

/// Builds the firmware and shows its sizes.
///
/// # Errors
/// When it does not build or is larger than the budget.
pub fn run(toolchain: Toolchain) -> Result<(), String> {
    build(toolchain)?;
    let path = built("thud-firmware");
    let bytes = fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let mut sizes = Sizes::of(&bytes).map_err(|error| format!("{}: {error}", path.display()))?;
    sizes.deepest = sizes.noted(&fs::read_to_string(path.with_file_name(STACK_DEPTH)).unwrap_or_default());
    print!("{sizes}");
    sizes.within_budget()
}

/// Builds the firmware.
///
/// # Errors
/// When it does not build.
pub fn build(toolchain: Toolchain) -> Result<(), String> {
    let mut build = toolchain.cargo("build");
    step::run("firmware", build.args(["--profile", "board", "--package", "thud-firmware", "--quiet"]))
}

/// A section that takes memory.
struct Section {
    name: String,
    address: u64,
    flash: u64,
    ram: u64,
}

/// What an ELF file takes.
struct Sizes {
    sections: Vec<Section>,
    flash: u64,
    ram: u64,
    stack: std::ops::Range<u64>,
    /// Bytes of the stack that this very program has used at worst, if it was run in the emulator.
    deepest: Option<u64>,
    largest: Vec<(u64, String)>,
    /// The linker's hash of the program, empty for none.
    build_id: Vec<u8>,
}

impl Sizes {
    fn of(bytes: &[u8]) -> Result<Self, object::Error> {
        let file = ElfFile32::<Endianness>::parse(bytes)?;
        let endian = file.endian();
        let table = file.elf_section_table();
        let mut sections = Vec::new();
        for header in table.iter() {
            let size = u64::from(header.sh_size(endian));
            if header.sh_flags(endian) & SHF_ALLOC == 0 || size == 0 {
                continue;
            }
            let address = u64::from(header.sh_addr(endian));
            let loaded = header.sh_type(endian) != SHT_NOBITS;
            sections.push(Section {
                name: String::from_utf8_lossy(table.section_name(endian, header)?).into_owned(),
                address,
                flash: if loaded { size } else { 0 },
                ram: if RAM.contains(&address) { size } else { 0 },
            });
        }
        sections.sort_by_key(|section| section.address);
        // Not the sum of the sections: what lies between them takes flash too.
        let flash = FileHeader32::<Endianness>::parse(bytes)?
            .program_headers(endian, bytes)?
            .iter()
            .filter(|header| header.p_type(endian) == PT_LOAD && header.p_filesz(endian) > 0)
            .map(|header| u64::from(header.p_paddr(endian)) + u64::from(header.p_filesz(endian)))
            .filter(|end| FLASH.contains(end))
            .max()
            .map_or(0, |end| end - FLASH.start);
        let ram = sections.iter().map(|section| section.ram).sum();
        let symbol = |name| file.symbol_by_name(name).map_or(0, |symbol| symbol.address());
        let stack = symbol("_stack_end")..symbol("_stack_start");
        let mut largest: Vec<_> = file
            .symbols()
            .filter(|symbol| symbol.size() > 0 && symbol.is_definition())
            .map(|symbol| (symbol.size(), symbol.name().unwrap_or("?").to_owned()))
            .collect();
        largest.sort_by(|a, b| b.cmp(a));
        largest.truncate(LARGEST);
        let build_id = file.build_id()?.unwrap_or_default().to_vec();
        Ok(Self { sections, flash, ram, stack, deepest: None, largest, build_id })
    }

    /// The depth in the emulator's note, if that is about this program.
    fn noted(&self, note: &str) -> Option<u64> {
        let (build, bytes) = note.split_once(' ')?;
        (build == hex(&self.build_id)).then(|| bytes.trim().parse().ok())?
    }

    fn within_budget(&self) -> Result<(), String> {
        let beyond = |what: &str, used: u64, budget: u64| {
            (used > budget).then(|| format!("{what}: {used} bytes, {} more than the budget of {budget}", used - budget))
        };
        let room = self.stack.end.saturating_sub(self.stack.start);
        let short =
            (room < STACK_BUDGET).then(|| format!("stack: room for {room} bytes, the budget is {STACK_BUDGET}"));
        // At the very bottom of the CCM an overflow leaves memory; anywhere else it would end another variable in silence.
        let open = (self.stack.start != CCM.start || self.stack.end > CCM.end).then(|| {
            format!("stack: at {:#x}, where nothing stops it; it must begin at {:#x}", self.stack.start, CCM.start)
        });
        let shared = self
            .sections
            .iter()
            .find(|section| CCM.contains(&section.address))
            .map(|section| format!("stack: {} lies in it", section.name));
        let beyond: Vec<_> = [
            beyond("flash", self.flash, FLASH_BUDGET),
            beyond("static RAM", self.ram, RAM_BUDGET),
            self.deepest.and_then(|used| beyond("stack in use", used, STACK_BUDGET - STACK_RESERVE)),
            short,
            open,
            shared,
        ]
        .into_iter()
        .flatten()
        .collect();
        if beyond.is_empty() { Ok(()) } else { Err(beyond.join("; ")) }
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

impl std::fmt::Display for Sizes {
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(to, "{:<16}{:>12}{:>10}{:>10}", "section", "address", "flash", "RAM")?;
        for Section { name, address, flash, ram } in &self.sections {
            writeln!(to, "{name:<16}{address:>#12x}{flash:>10}{ram:>10}")?;
        }
        writeln!(to, "{:<28}{:>10}{:>10}", "together", self.flash, self.ram)?;
        writeln!(to, "{:<28}{FLASH_BUDGET:>10}{RAM_BUDGET:>10}", "budget")?;
        let share = |used: u64, budget: u64| format!("{:.1} %", 100.0 * used as f64 / budget as f64);
        writeln!(to, "{:<28}{:>10}{:>10}", "used", share(self.flash, FLASH_BUDGET), share(self.ram, RAM_BUDGET))?;
        writeln!(
            to,
            "\nstack, {:#x} to {:#x}: {} bytes, budget {STACK_BUDGET}",
            self.stack.start,
            self.stack.end,
            self.stack.end.saturating_sub(self.stack.start)
        )?;
        let most = STACK_BUDGET - STACK_RESERVE;
        match self.deepest {
            Some(used) => writeln!(to, "used at worst, in the emulator: {used} bytes, budget {most}")?,
            None => {
                writeln!(to, "used at worst: not yet seen of this build; `cargo xtask emulator` does (budget {most})")?
            }
        }
        let build = &self.build_id[..self.build_id.len().min(8)];
        writeln!(to, "\nbuild 0x{}, object 0x2402:6 (build id {})", hex(build), hex(&self.build_id))?;
        writeln!(to, "\nlargest symbols")?;
        for (size, name) in &self.largest {
            writeln!(to, "{size:>10}  {name}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOTHING: Sizes = Sizes {
        sections: Vec::new(),
        flash: 0,
        ram: 0,
        stack: CCM,
        deepest: None,
        largest: Vec::new(),
        build_id: Vec::new(),
    };

    #[test]
    fn beyond_a_budget_is_a_failure_that_says_by_how_much() {
        let sizes = |flash, ram, deepest| Sizes { flash, ram, deepest: Some(deepest), ..NOTHING };
        assert_eq!(sizes(FLASH_BUDGET, RAM_BUDGET, STACK_BUDGET - STACK_RESERVE).within_budget(), Ok(()));
        let said = sizes(FLASH_BUDGET + 7, RAM_BUDGET + 1, STACK_BUDGET).within_budget().unwrap_err();
        assert!(
            said.contains("flash: 131079 bytes, 7 more")
                && said.contains("static RAM: 98305 bytes, 1 more")
                && said.contains("stack in use: 32768 bytes, 8192 more"),
            "{said}"
        );
    }

    #[test]
    fn a_depth_that_was_seen_of_another_build_does_not_count() {
        let sizes = Sizes { build_id: vec![0x9E, 0xC5], ..NOTHING };
        assert_eq!(sizes.noted("9ec5 16072\n"), Some(16_072));
        for other in ["", "9ec5", "9ec6 16072\n", "9ec53b 16072\n", "9ec5 many\n"] {
            assert_eq!(sizes.noted(other), None, "{other:?}");
        }
    }

    #[test]
    fn a_stack_that_is_short_or_that_nothing_stops_is_a_failure() {
        let with = |stack| Sizes { stack, ..NOTHING };
        assert_eq!(with(CCM).within_budget(), Ok(()));
        let short = with(CCM.start..CCM.end - 8).within_budget().unwrap_err();
        assert!(short.contains("room for 32760 bytes"), "{short}");
        let open = with(0x2001_0000..0x2001_8000).within_budget().unwrap_err();
        assert!(open.contains("nothing stops it"), "{open}");
        let section = Section { name: ".data".into(), address: CCM.start, flash: 0, ram: 0 };
        let shared = Sizes { sections: vec![section], ..NOTHING }.within_budget().unwrap_err();
        assert!(shared.contains(".data lies in it"), "{shared}");
    }

    #[test]
    fn what_is_no_elf_is_refused() {
        assert!(Sizes::of(b"not an ELF file").is_err());
    }
}
