//! `cargo xtask dictionary`: what other people's CAN tools read about the sensor, written from the firmware's object
//! dictionary, which is the single source.
//!
//! ```text
//! dictionary::object::OBJECTS, limits, defaults ─┬─▶ docs/can/thud.eds     CANopen masters
//!                                                ├─▶ docs/can/thud.dbc     CAN analysers
//! dictionary::frame, emergency ──────────────────┘─▶ docs/can/objects.md   people
//! ```
//!
//! The files are in the tree; a test fails when they are not what this would write.

mod dbc;
mod defaults;
mod eds;
mod table;

use std::collections::BTreeSet;
use std::path::PathBuf;

use thud_firmware::configuration::Configuration;

use crate::step;

/// The files, with what belongs into them.
fn files() -> [(PathBuf, String); 3] {
    let folder = step::root().join("docs/can");
    [
        (folder.join("thud.eds"), eds::write()),
        (folder.join("thud.dbc"), dbc::write(&[Configuration::DEFAULT.node.node_id])),
        (folder.join("objects.md"), table::write()),
    ]
}

/// Writes the files, or with node ids prints a DBC for them.
///
/// # Errors
/// Says which file could not be written, or which node id is none.
pub fn run(nodes: &[String]) -> Result<(), String> {
    if !nodes.is_empty() {
        let nodes: BTreeSet<u8> = nodes.iter().map(|text| node(text)).collect::<Result<_, _>>()?;
        let nodes: Vec<u8> = nodes.into_iter().collect();
        print!("{}", dbc::write(&nodes));
        return Ok(());
    }
    for (path, text) in files() {
        let failed = |error| format!("{}: {error}", path.display());
        std::fs::create_dir_all(path.parent().unwrap_or(&path)).map_err(failed)?;
        std::fs::write(&path, text).map_err(failed)?;
        eprintln!("wrote {}", path.display());
    }
    Ok(())
}

fn node(text: &str) -> Result<u8, String> {
    let number = match text.strip_prefix("0x") {
        Some(digits) => u8::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    };
    number.filter(|id| (1..=127).contains(id)).ok_or_else(|| format!("`{text}` is no node id; 1 to 127 (0x7F) are"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_in_docs_can_are_current() {
        for (path, text) in files() {
            let written = std::fs::read_to_string(&path).unwrap_or_default();
            assert!(written == text, "{} is stale: cargo xtask dictionary", path.display());
        }
    }

    #[test]
    fn node_ids_are_read_in_both_notations() {
        assert_eq!((node("32"), node("0x20")), (Ok(32), Ok(32)));
        for wrong in ["0", "128", "0x80", "x", ""] {
            assert!(node(wrong).unwrap_err().contains("1 to 127"));
        }
    }
}
