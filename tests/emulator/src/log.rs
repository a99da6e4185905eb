//! The program's log: defmt frames from the RTT buffer, as `probe-rs` reads them.
//!
//! ```text
//! _SEGGER_RTT: "SEGGER RTT", channels up and down │ name, buffer, size, written, read, flags │ …
//! ```

use defmt_decoder::{DecodeError, Table};

use crate::image::Image;
use crate::machine::Machine;

/// Offset of the first up channel in the control block, and of its fields.
const CHANNEL: u32 = 24;
const BUFFER: u32 = CHANNEL + 4;
const SIZE: u32 = CHANNEL + 8;
const WRITTEN: u32 = CHANNEL + 12;
const READ: u32 = CHANNEL + 16;

/// Reads the log out of the memory and decodes it.
pub struct Log {
    block: Option<u32>,
    table: Option<Table>,
    raw: Vec<u8>,
    lines: Vec<String>,
}

impl Log {
    /// For this program; without defmt there are no lines.
    #[must_use]
    pub fn new(image: &Image) -> Self {
        let table = Table::parse(&image.elf).ok().flatten();
        Self { block: image.symbol("_SEGGER_RTT"), table, raw: Vec::new(), lines: Vec::new() }
    }

    /// A reset: a frame that was cut is dropped.
    pub fn reset(&mut self) {
        self.raw.clear();
    }

    /// Fetches what is there.
    pub fn drain(&mut self, machine: &mut Machine) {
        let Some(block) = self.block else { return };
        if machine.memory(block, 10) != b"SEGGER RTT" {
            return;
        }
        let [buffer, size, written, mut read] = [BUFFER, SIZE, WRITTEN, READ].map(|field| machine.word(block + field));
        if size == 0 || written >= size || read >= size || written == read {
            return;
        }
        let bytes = machine.memory(buffer, size as usize);
        while read != written {
            self.raw.push(bytes[read as usize]);
            read = (read + 1) % size;
        }
        machine.poke(block + READ, &read.to_le_bytes());
        self.decode();
    }

    fn decode(&mut self) {
        let Some(table) = &self.table else {
            self.raw.clear();
            return;
        };
        let mut decoder = table.new_stream_decoder();
        decoder.received(&self.raw);
        let mut new = Vec::new();
        loop {
            match decoder.decode() {
                Ok(frame) => new.push(frame.display(false).to_string()),
                Err(DecodeError::UnexpectedEof) => break,
                Err(DecodeError::Malformed) => new.push("(a damaged frame)".into()),
            }
        }
        // rzCOBS frames end with a zero; what follows the last is not complete.
        let complete = self.raw.iter().rposition(|byte| *byte == 0).map_or(0, |last| last + 1);
        self.raw.drain(..complete);
        self.lines.append(&mut new);
    }

    /// The lines so far.
    #[must_use]
    pub fn lines(&self) -> &[String] {
        &self.lines
    }
}
