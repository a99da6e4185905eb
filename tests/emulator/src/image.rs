//! The ELF file: what is flashed, and the symbols that the emulator looks at.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{ElfFile32, FileHeader as _, ProgramHeader as _};
use object::{Endianness, Object as _, ObjectSymbol as _, SymbolKind};

use crate::chip::map::{BANK, BANK_1};

/// `WFE`, `WFI` and `SEV` as half-words.
const WFE: u16 = 0xBF20;
const WFI: u16 = 0xBF30;
const SEV: u16 = 0xBF40;

/// Why there is nothing to run.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// Not there.
    #[error("{path}: {source}; `cargo xtask size` builds it")]
    Read {
        /// Where it was looked for.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Older than what it is built from, by the list that cargo writes beside it.
    #[error("{path} is older than {changed}; `cargo xtask size` builds it anew")]
    Stale {
        /// The program.
        path: PathBuf,
        /// What has changed since.
        changed: String,
    },
    /// Not an ELF file for this chip.
    #[error("{path}: {reason}")]
    Format {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
}

/// A program for the board.
#[derive(Clone)]
pub struct Image {
    /// The whole file, for the log's decoder.
    pub elf: Vec<u8>,
    /// Bank 1 of the flash.
    pub bank_1: Vec<u8>,
    symbols: BTreeMap<String, u32>,
    functions: BTreeMap<u32, String>,
    nameless: String,
}

impl Image {
    /// Where `cargo xtask size` and `cargo xtask emulator` put the firmware.
    #[must_use]
    pub fn usual_place() -> PathBuf {
        let target = std::env::var_os("CARGO_TARGET_DIR")
            .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target"), PathBuf::from);
        std::env::var_os("THUD_FIRMWARE")
            .map_or_else(|| target.join("thumbv7em-none-eabihf/board/thud-firmware"), PathBuf::from)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`ImageError`].
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let elf = std::fs::read(path).map_err(|source| ImageError::Read { path: path.to_owned(), source })?;
        if let Some(changed) = changed_source(path) {
            return Err(ImageError::Stale { path: path.to_owned(), changed });
        }
        Self::parse(elf).map_err(|reason| ImageError::Format { path: path.to_owned(), reason })
    }

    fn parse(elf: Vec<u8>) -> Result<Self, String> {
        let told = |error: object::Error| error.to_string();
        let header = FileHeader32::<Endianness>::parse(elf.as_slice()).map_err(told)?;
        let endian = header.endian().map_err(told)?;
        let mut bank_1 = vec![0xFF; BANK as usize];
        for segment in header.program_headers(endian, elf.as_slice()).map_err(told)? {
            if segment.p_type(endian) != PT_LOAD || segment.p_filesz(endian) == 0 {
                continue;
            }
            let bytes = segment.data(endian, elf.as_slice()).map_err(|()| "a segment ends beyond the file")?;
            let place = segment.p_paddr(endian);
            let start = place.checked_sub(BANK_1).map(|start| start as usize);
            let room = start.and_then(|start| bank_1.get_mut(start..start + bytes.len()));
            room.ok_or_else(|| format!("a segment at 0x{place:08X} does not lie in bank 1 of the flash"))?
                .copy_from_slice(bytes);
        }
        let file = ElfFile32::<Endianness>::parse(elf.as_slice()).map_err(told)?;
        let symbols = file
            .symbols()
            .filter_map(|symbol| Some((symbol.name().ok()?.to_owned(), symbol.address() as u32)))
            .collect();
        let functions = file
            .symbols()
            .filter(|symbol| symbol.kind() == SymbolKind::Text)
            // The lowest bit says Thumb.
            .filter_map(|symbol| Some((symbol.address() as u32 & !1, symbol.name().ok()?.to_owned())))
            .collect();
        Ok(Self { elf, bank_1, symbols, functions, nameless: "?".into() })
    }

    /// Address of a symbol.
    #[must_use]
    pub fn symbol(&self, name: &str) -> Option<u32> {
        self.symbols.get(name).copied()
    }

    /// The symbol that lies at or before an address of the program.
    #[must_use]
    pub fn function_at(&self, address: u32) -> &str {
        let (_, name) = self.functions.range(..=address).next_back().unwrap_or((&0, &self.nameless));
        name
    }

    /// An address of the program at which a half-word has this value.
    #[must_use]
    pub fn find(&self, half: u16) -> Option<u32> {
        let place = self.bank_1.chunks_exact(2).position(|bytes| bytes == half.to_le_bytes())?;
        Some(BANK_1 + 2 * place as u32)
    }

    /// Addresses whose half-word is that of `WFE` or `WFI`, and of `SEV`. Some may be data or the second half of another
    /// instruction; those are never executed.
    #[must_use]
    pub fn hints(&self) -> (Vec<u32>, Vec<u32>) {
        let mut waits = Vec::new();
        let mut sends = Vec::new();
        for (index, half) in self.bank_1.chunks_exact(2).enumerate() {
            let address = BANK_1 + 2 * index as u32;
            match u16::from_le_bytes([half[0], half[1]]) {
                WFE | WFI => waits.push(address),
                SEV => sends.push(address),
                _ => {}
            }
        }
        (waits, sends)
    }
}

/// A source, of those that cargo lists in `program.d`, that has changed or gone since the program was built.
fn changed_source(program: &Path) -> Option<String> {
    let modified = |path: &Path| std::fs::metadata(path).and_then(|about| about.modified()).ok();
    let list = std::fs::read_to_string(program.with_extension("d")).ok()?;
    let built = modified(program)?;
    let (_, sources) = list.lines().next()?.split_once(": ")?;
    // A blank within a name has a backslash before it.
    let names = sources.replace("\\ ", "\0");
    let mut names = names.split(' ').map(|name| name.replace('\0', " "));
    // A commit changes what the build script reads of git, and not the program.
    names.find(|name| !name.contains("/.git/") && modified(Path::new(name)).is_none_or(|modified| modified > built))
}
