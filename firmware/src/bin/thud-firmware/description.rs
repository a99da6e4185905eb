//! What the board says about itself, for people and scripts without a board: identity, memory, bus, object dictionary.

use std::io::{self, Write};

use thud_firmware::capture::{CAPTURE, pre_trigger};
use thud_firmware::configuration::Chain;
use thud_firmware::dictionary::object::{OBJECTS, hash};
use thud_firmware::dictionary::{PRODUCT_CODE, REVISION_NUMBER};

use crate::bit_timing;

/// Writes it; the dictionary as tab-separated lines.
///
/// # Errors
/// When it cannot be written.
pub fn print(to: &mut impl Write) -> io::Result<()> {
    let rate = Chain::REFERENCE.sample_rate.0;
    writeln!(to, "This is the firmware of the thud sensor board (STM32G474RE). With a board and probe-rs:")?;
    writeln!(to, "    cargo flash")?;
    writeln!(to, "Without one, `cargo run --release -- sensor` runs the same logic on a simulated board.")?;
    writeln!(to)?;
    writeln!(to, "product code     0x{PRODUCT_CODE:08X}")?;
    writeln!(to, "revision number  0x{REVISION_NUMBER:08X}")?;
    writeln!(to, "dictionary hash  0x{:08X}", hash())?;
    writeln!(to, "version          {}", env!("CARGO_PKG_VERSION"))?;
    writeln!(
        to,
        "bus              CAN, {} kbit/s, sample point {:.1} %",
        bit_timing::BIT_RATE / 1000,
        f64::from(bit_timing::SAMPLE_POINT_PER_MILLE) / 10.0
    )?;
    writeln!(
        to,
        "capture          {:.3} s at {:.0} kS/s, {:.3} s of it before the onset",
        CAPTURE as f32 / rate,
        rate / 1000.0,
        pre_trigger(CAPTURE) as f32 / rate
    )?;
    writeln!(to)?;
    writeln!(to, "object\tsub\tname\ttype\taccess\tunit\trange")?;
    for object in OBJECTS {
        for sub in object.subs {
            let (separator, name) = if object.has_count() { (": ", sub.name) } else { ("", "") };
            writeln!(
                to,
                "0x{:04X}\t{}\t{}{separator}{name}\t{:?}\t{:?}\t{}\t{}",
                object.index, sub.sub, object.name, sub.kind, sub.access, sub.unit, sub.range
            )?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sub_object_is_one_line_of_seven_fields() {
        let mut text = Vec::new();
        print(&mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let lines: Vec<_> = text.lines().filter(|line| line.starts_with("0x")).collect();
        assert_eq!(lines.len(), OBJECTS.iter().map(|object| object.subs.len()).sum::<usize>());
        for line in lines {
            assert_eq!(line.split('\t').count(), 7, "{line}");
        }
    }
}
