//! The manual's object table.

use std::fmt::Write as _;

use thud_firmware::dictionary::object::OBJECTS;
use zencan_common::objects::{AccessType, DataType, PdoMappable};

use super::defaults;

const HEAD: &str = "\
# Object dictionary

Written by `cargo xtask dictionary` from the firmware's object dictionary; changes here are lost. The same as
[`thud.eds`](thud.eds) for CANopen masters; the PDOs also as [`thud.dbc`](thud.dbc). Everything is little-endian.

Settings (0x2000 to 0x2004) are staged when written and take effect together when 1 is written to 0x2010:1; 0x2011 says what
was refused last, and why. `N` in a default stands for the node id.

| object | sub | name | type | access | default | unit or meaning | range | PDO |
|---|---|---|---|---|---|---|---|---|
";

/// The file's text.
pub fn write() -> String {
    let mut text = HEAD.to_owned();
    for object in OBJECTS {
        for sub in object.subs {
            let name =
                if object.has_count() { format!("{}: {}", object.name, sub.name) } else { object.name.to_owned() };
            let default = defaults::default(object.index, sub).map_or_else(String::new, |default| default.to_string());
            let kind = match sub.kind {
                DataType::UInt8 => "UNSIGNED8",
                DataType::UInt16 => "UNSIGNED16",
                DataType::UInt32 => "UNSIGNED32",
                DataType::UInt64 => "UNSIGNED64",
                DataType::Int16 => "INTEGER16",
                DataType::Real32 => "REAL32",
                DataType::VisibleString => "VISIBLE_STRING",
                DataType::Domain => "DOMAIN",
                other => unreachable!("{other:?} has no name here yet"),
            };
            let access = match sub.access {
                AccessType::Ro => "ro",
                AccessType::Wo => "wo",
                AccessType::Rw => "rw",
                AccessType::Const => "const",
            };
            let pdo = match sub.pdo {
                PdoMappable::Tpdo => "T",
                PdoMappable::Rpdo => "R",
                _ => "",
            };
            // A bar would begin a new column.
            let plain = |words: &str| words.replace('|', "\\|");
            writeln!(
                text,
                "| 0x{:04X} | {} | {name} | {kind} | {access} | {} | {} | {} | {pdo} |",
                object.index,
                sub.sub,
                default.replace("$NODEID", "N"),
                plain(sub.unit),
                plain(sub.range)
            )
            .expect("writing to a string succeeds");
        }
    }
    text
}
