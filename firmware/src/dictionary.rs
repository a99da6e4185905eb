//! The object dictionary: everything that a CANopen master can read and write.
//!
//! [`object::OBJECTS`] lists it; the table below is written from that list and a test fails when it is stale
//! (`UPDATE_TABLES=1 cargo test -p thud-firmware dictionary` writes it anew).
//!
//! # Configuring
//! Writing a setting (0x2000 to 0x2004) *stages* it. A value that is impossible by itself is refused at once.
//! `apply` (0x2010:1 = 1) validates all of them together and makes them the active configuration as one, between
//! impacts; or it is refused and the active configuration stays as it was. Whatever was refused last stands in
//! 0x2011: which object, why, and what would be permitted. Settings read back as staged. An applied configuration is
//! stored in flash as soon as no impact is open; "save" (0x1010:1) stores it again.
//!
//! Configuring is for a sensor that is not armed: while it is Operational, writing a setting, `apply`, "save" and "load" are refused
//! with abort 0x08000022. With a key set (0x2012) they are refused with 0x08000021 in every state, and so are the PDOs' COB-IDs:
//! settings then come as one signed change, see [`crate::configuration_lock`]. What is no configuration stays open: the
//! effective mass, the stream, the heartbeat until the next reset, the event to be read, the error history.
//!
//! # PDOs
//! Their mapping is fixed, so that they are decoded by table; [`frame`] is their one encoder and decoder.
//! COB-IDs can be changed while the node is not Operational and last until the next reset.
//!
//! | PDO | default COB-ID | carries |
//! |---|---|---|
//! | TPDO 1 | 0x000 + node id | alarm at onset |
//! | TPDO 2 | 0x280 + node id | event: judgement |
//! | TPDO 3 | 0x380 + node id | event: force |
//! | TPDO 4 | 0x480 + node id | event: instant |
//! | TPDO 5 | 0x300 + node id | event: course |
//! | TPDO 6 | 0x400 + node id | event: mass |
//! | TPDO 7 | 0x500 + node id | stream of samples, while 0x2020:1 is not 0 |
//! | RPDO 1 | 0x200 + node id | effective mass of the robot |
//!
//! The alarm's default lies in 0x001–0x07F, which CiA 301 (table of restricted CAN-IDs) reserves. That is deliberate:
//! the alarm must win against everything but an NMT command, SYNC, EMCY and TIME of other nodes included, and no
//! permitted identifier does (the lowest for a PDO is 0x181, behind SYNC, EMCY and TIME). Nothing in CiA 301 or 302
//! sends there; EN 50325-5 uses 0x001 alone, so a CANopen Safety network must not give a sensor node id 1. Where strict conformity is wanted, write 0x180 + node id
//! to 0x1800:1. TPDO 5 to 7 borrow the identifiers of RPDO 2 to 4, which this device does not have.
#![doc = ""]
#![doc = include_str!("dictionary/table.md")]

pub mod access;
pub mod event_record;
pub mod frame;
pub mod object;
pub mod settings;
pub mod value;

/// Indices by name.
pub mod index {
    /// Error register.
    pub const ERROR_REGISTER: u16 = 0x1001;
    /// Pre-defined error field.
    pub const ERROR_HISTORY: u16 = 0x1003;
    /// Manufacturer device name.
    pub const DEVICE_NAME: u16 = 0x1008;
    /// Manufacturer hardware version.
    pub const HARDWARE_VERSION: u16 = 0x1009;
    /// Manufacturer software version.
    pub const SOFTWARE_VERSION: u16 = 0x100A;
    /// Store parameters.
    pub const STORE: u16 = 0x1010;
    /// Restore default parameters.
    pub const RESTORE: u16 = 0x1011;
    /// COB-ID TIME.
    pub const TIME_COB_ID: u16 = 0x1012;
    /// COB-ID EMCY.
    pub const EMERGENCY_COB_ID: u16 = 0x1014;
    /// Producer heartbeat time.
    pub const HEARTBEAT: u16 = 0x1017;
    /// Identity.
    pub const IDENTITY: u16 = 0x1018;
    /// SDO server parameter.
    pub const SDO_SERVER: u16 = 0x1200;
    /// Communication parameters of RPDO 1, the effective mass.
    pub const RPDO_MASS: u16 = 0x1400;
    /// Mapping of RPDO 1.
    pub const RPDO_MASS_MAPPING: u16 = 0x1600;
    /// Communication parameters of TPDO 1, the alarm; those of the event's parts follow.
    pub const TPDO_ALARM: u16 = 0x1800;
    /// Mapping of TPDO 1; those of the event's parts follow.
    pub const TPDO_ALARM_MAPPING: u16 = 0x1A00;
    /// Judgement settings.
    pub const JUDGEMENT: u16 = 0x2000;
    /// Effective mass settings.
    pub const MASS_SETTINGS: u16 = 0x2001;
    /// Detection settings.
    pub const DETECTION: u16 = 0x2002;
    /// Measuring chain.
    pub const CHAIN: u16 = 0x2003;
    /// Node settings.
    pub const NODE: u16 = 0x2004;
    /// Configuration transaction.
    pub const TRANSACTION: u16 = 0x2010;
    /// Last refusal.
    pub const REFUSAL: u16 = 0x2011;
    /// Configuration lock.
    pub const LOCK: u16 = 0x2012;
    /// Sample stream.
    pub const STREAM: u16 = 0x2020;
    /// The latest alarm.
    pub const ALARM: u16 = 0x2100;
    /// Received effective mass.
    pub const RECEIVED_MASS: u16 = 0x2101;
    /// The latest forecast.
    pub const FORECAST: u16 = 0x2102;
    /// The latest event, part judgement; the other parts follow.
    pub const EVENT: u16 = 0x2110;
    /// The latest frame of the stream.
    pub const SAMPLES: u16 = 0x2120;
    /// Event log.
    pub const EVENT_LOG: u16 = 0x2200;
    /// First recording slot; the second follows.
    pub const RECORDING: u16 = 0x2300;
    /// Losses.
    pub const LOSSES: u16 = 0x2400;
    /// Bus.
    pub const BUS: u16 = 0x2401;
    /// Board.
    pub const BOARD: u16 = 0x2402;
    /// Detector.
    pub const DETECTOR: u16 = 0x2403;
    /// Time received.
    pub const TIME: u16 = 0x2404;
}

/// Value that makes 0x1010:1 store: "save" in ASCII, little-endian.
pub const SAVE: u32 = u32::from_le_bytes(*b"save");
/// Value that makes 0x1011:1 restore the defaults: "load".
pub const LOAD: u32 = u32::from_le_bytes(*b"load");
/// Value that makes 0x2010:1 apply what was written.
pub const APPLY: u8 = 1;
/// Value that makes 0x2010:1 discard what was written.
pub const DISCARD: u8 = 2;
/// Product code in the identity object: "thud".
pub const PRODUCT_CODE: u32 = u32::from_be_bytes(*b"thud");
/// Revision number in the identity object: major in the upper, minor in the lower half; the major changes when
/// an object changes its meaning.
pub const REVISION_NUMBER: u32 = 0x0001_0000;

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::string::String;

    use super::*;

    fn table() -> String {
        let mut text = String::from(
            "| object | sub | name | type | access | unit or meaning | range | PDO |\n|---|---|---|---|---|---|---|---|\n",
        );
        for object in object::OBJECTS {
            for sub in object.subs {
                let name =
                    if object.has_count() { std::format!("{}: {}", object.name, sub.name) } else { object.name.into() };
                let pdo = match sub.pdo {
                    zencan_common::objects::PdoMappable::Tpdo => "T",
                    zencan_common::objects::PdoMappable::Rpdo => "R",
                    _ => "",
                };
                writeln!(
                    text,
                    "| 0x{:04X} | {} | {name} | {:?} | {:?} | {} | {} | {pdo} |",
                    object.index, sub.sub, sub.kind, sub.access, sub.unit, sub.range
                )
                .unwrap();
            }
        }
        text
    }

    #[test]
    fn the_table_of_the_manual_is_current() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/dictionary/table.md");
        if std::env::var_os("UPDATE_TABLES").is_some() {
            std::fs::write(path, table()).unwrap();
        }
        let written = std::fs::read_to_string(path).unwrap();
        assert!(
            written == table(),
            "dictionary/table.md is stale: UPDATE_TABLES=1 cargo test -p thud-firmware dictionary"
        );
    }

    #[test]
    fn objects_are_in_order_and_sub_indices_too() {
        assert!(object::OBJECTS.windows(2).all(|pair| pair[0].index < pair[1].index));
        for object in object::OBJECTS {
            assert!(object.subs.windows(2).all(|pair| pair[0].sub < pair[1].sub), "{:#06X}", object.index);
            assert_eq!(object.has_count(), object.subs[0].sub > 0 || object.index == index::ERROR_HISTORY);
        }
    }
}
