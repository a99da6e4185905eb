//! What an entry of the dictionary says about itself, and the list of all entries.
//!
//! This list is the single source: the SDO server answers from it, the manual's table and
//! the EDS and DBC files are written from it.

use zencan_common::objects::{AccessType, DataType, ObjectCode, PdoMappable, SubInfo};

/// Text for manual, EDS file and people. It does not go onto the board, where nothing reads it and it would take 15 KiB.
#[cfg(not(target_os = "none"))]
pub type Prose = &'static str;
/// Left out.
#[cfg(target_os = "none")]
pub type Prose = ();

/// One object of the dictionary.
#[derive(Clone, Copy, Debug)]
pub struct Object {
    /// Index, 0x1000 to 0xFFFF.
    pub index: u16,
    /// Name, as EDS files write it.
    pub name: Prose,
    /// Variable, array or record.
    pub code: ObjectCode,
    /// Sub-objects; a variable has exactly one, of sub-index 0. Sub-index 0 of a record is not listed: it is
    /// the highest sub-index.
    pub subs: &'static [Sub],
}

impl Object {
    /// The sub-object with this sub-index.
    #[must_use]
    pub fn sub(&self, sub: u8) -> Option<&Sub> {
        self.subs.iter().find(|candidate| candidate.sub == sub)
    }

    /// The highest sub-index.
    #[must_use]
    pub fn highest(&self) -> u8 {
        self.subs.iter().map(|sub| sub.sub).max().unwrap_or(0)
    }

    /// Whether sub-index 0 is the count of the others.
    #[must_use]
    pub fn has_count(&self) -> bool {
        !matches!(self.code, ObjectCode::Var)
    }
}

/// One sub-object.
#[derive(Clone, Copy, Debug)]
pub struct Sub {
    /// Sub-index.
    pub sub: u8,
    /// Name.
    pub name: Prose,
    /// Type on the wire; everything is little-endian.
    pub kind: DataType,
    /// Who may read and write.
    pub access: AccessType,
    /// Unit, or what the number means.
    pub unit: Prose,
    /// Permitted range or the choices; empty where every value of the type is meant.
    pub range: Prose,
    /// Which PDO carries it.
    pub pdo: PdoMappable,
}

impl Sub {
    /// Bytes of a value; 0 where the length is not fixed.
    #[must_use]
    pub const fn size(&self) -> usize {
        match self.kind {
            DataType::Boolean | DataType::Int8 | DataType::UInt8 => 1,
            DataType::Int16 | DataType::UInt16 => 2,
            DataType::Int24 | DataType::UInt24 => 3,
            DataType::Int32 | DataType::UInt32 | DataType::Real32 => 4,
            DataType::Int64 | DataType::UInt64 | DataType::Real64 => 8,
            _ => 0,
        }
    }

    /// What one step of the number is worth, and in which unit, as [`Self::unit`] says; (1, "") for what is no quantity.
    ///
    /// ```
    /// use thud_firmware::dictionary::object::find;
    /// let peak = find(0x2111).unwrap().sub(2).unwrap();
    /// assert_eq!(peak.step(), (0.1, "N"));
    /// ```
    #[must_use]
    #[cfg(not(target_os = "none"))]
    pub fn step(&self) -> (f64, &'static str) {
        const UNITS: [&str; 9] = ["N", "N s", "s", "ms", "kg", "Hz", "V", "N/m", "sample"];
        let (quantity, _) = self.unit.split_once(',').unwrap_or((self.unit, ""));
        let unit_of = |text: &str| UNITS.into_iter().find(|unit| *unit == text);
        if let Some(unit) = unit_of(quantity) {
            return (1.0, unit);
        }
        let (number, unit) = quantity.split_once(' ').unwrap_or((quantity, ""));
        let (above, below) = number.split_once('/').unwrap_or((number, "1"));
        match (above.parse::<f64>(), below.parse::<f64>(), unit_of(unit)) {
            (Ok(above), Ok(below), Some(unit)) => (above / below, unit),
            _ => (1.0, ""),
        }
    }

    /// The same in the words of the stack.
    #[must_use]
    pub const fn info(&self) -> SubInfo {
        SubInfo {
            size: self.size(),
            data_type: self.kind,
            access_type: self.access,
            pdo_mapping: self.pdo,
            persist: false,
        }
    }

    const fn in_tpdo(mut self) -> Self {
        self.pdo = PdoMappable::Tpdo;
        self
    }

    const fn in_rpdo(mut self) -> Self {
        self.pdo = PdoMappable::Rpdo;
        self
    }
}

const fn sub(
    sub: u8,
    name: &'static str,
    kind: DataType,
    access: AccessType,
    unit: &'static str,
    range: &'static str,
) -> Sub {
    let (name, unit, range) = (for_people(name), for_people(unit), for_people(range));
    Sub { sub, name, kind, access, unit, range, pdo: PdoMappable::None }
}

#[cfg(not(target_os = "none"))]
const fn for_people(text: &'static str) -> Prose {
    text
}

#[cfg(target_os = "none")]
const fn for_people(_: &'static str) -> Prose {}

const fn ro(number: u8, name: &'static str, kind: DataType, unit: &'static str, range: &'static str) -> Sub {
    sub(number, name, kind, AccessType::Ro, unit, range)
}

const fn rw(number: u8, name: &'static str, kind: DataType, unit: &'static str, range: &'static str) -> Sub {
    sub(number, name, kind, AccessType::Rw, unit, range)
}

const fn wo(number: u8, name: &'static str, kind: DataType, unit: &'static str, range: &'static str) -> Sub {
    sub(number, name, kind, AccessType::Wo, unit, range)
}

const fn fixed(number: u8, name: &'static str, kind: DataType, unit: &'static str) -> Sub {
    sub(number, name, kind, AccessType::Const, unit, "")
}

const fn var(index: u16, name: &'static str, subs: &'static [Sub]) -> Object {
    Object { index, name: for_people(name), code: ObjectCode::Var, subs }
}

const fn record(index: u16, name: &'static str, subs: &'static [Sub]) -> Object {
    Object { index, name: for_people(name), code: ObjectCode::Record, subs }
}

const fn array(index: u16, name: &'static str, subs: &'static [Sub]) -> Object {
    Object { index, name: for_people(name), code: ObjectCode::Array, subs }
}

use DataType::{Domain, Int16, Real32, UInt8, UInt16, UInt32, UInt64, VisibleString};

const PDO_COMMUNICATION: &[Sub] = &[
    rw(1, "COB-ID", UInt32, "bit 31: not used", "0x001 to 0x7FF, while not Operational"),
    rw(2, "Transmission type", UInt8, "", "254, 255: on event"),
];

const MAPPED_1: &[Sub] = &[fixed(1, "Mapped 1", UInt32, "index, sub, bits")];
const MAPPED_2: &[Sub] = &[MAPPED_1[0], fixed(2, "Mapped 2", UInt32, "index, sub, bits")];
const MAPPED_4: &[Sub] = &[
    MAPPED_2[0],
    MAPPED_2[1],
    fixed(3, "Mapped 3", UInt32, "index, sub, bits"),
    fixed(4, "Mapped 4", UInt32, "index, sub, bits"),
];
const MAPPED_5: &[Sub] =
    &[MAPPED_4[0], MAPPED_4[1], MAPPED_4[2], MAPPED_4[3], fixed(5, "Mapped 5", UInt32, "index, sub, bits")];

const RECORDING: &[Sub] = &[
    ro(1, "Filled", UInt8, "0 empty, 1 a finished curve", ""),
    ro(2, "Impact", UInt32, "number of the impact", ""),
    ro(3, "First index", UInt64, "sample number since power-up", ""),
    ro(4, "Length", UInt32, "samples", ""),
    ro(5, "CRC", UInt32, "CRC-32 (ISO-HDLC) of the curve's bytes", ""),
    ro(6, "Sample rate", Real32, "Hz", ""),
    ro(7, "Force per code", Real32, "N", ""),
    ro(8, "Zero", Real32, "code at no force when the impact began", ""),
    ro(9, "Onset index", UInt64, "sample number since power-up", ""),
    ro(10, "Configuration revision", UInt32, "", ""),
    ro(11, "Configuration hash", UInt32, "", ""),
    ro(12, "Curve", Domain, "samples as UNSIGNED16 codes, little-endian", ""),
];

/// Every object, ordered by index.
pub static OBJECTS: &[Object] = &[
    var(0x1000, "Device type", &[fixed(0, "Device type", UInt32, "no profile")]),
    var(0x1001, "Error register", &[ro(0, "Error register", UInt8, "bits of CiA 301", "")]),
    array(
        0x1003,
        "Pre-defined error field",
        &[
            // Sub-index 0 is the number of errors and can be cleared by writing 0.
            rw(0, "Number of errors", UInt8, "", "0 clears"),
            ro(1, "Error 1", UInt32, "EMCY code, newest first", ""),
            ro(2, "Error 2", UInt32, "EMCY code", ""),
            ro(3, "Error 3", UInt32, "EMCY code", ""),
            ro(4, "Error 4", UInt32, "EMCY code", ""),
            ro(5, "Error 5", UInt32, "EMCY code", ""),
            ro(6, "Error 6", UInt32, "EMCY code", ""),
            ro(7, "Error 7", UInt32, "EMCY code", ""),
            ro(8, "Error 8", UInt32, "EMCY code", ""),
        ],
    ),
    var(0x1008, "Manufacturer device name", &[fixed(0, "Manufacturer device name", VisibleString, "")]),
    var(0x1009, "Manufacturer hardware version", &[fixed(0, "Manufacturer hardware version", VisibleString, "")]),
    var(0x100A, "Manufacturer software version", &[fixed(0, "Manufacturer software version", VisibleString, "")]),
    array(
        0x1010,
        "Store parameters",
        &[rw(1, "Save all parameters", UInt32, "reads 1: on command", "0x65766173 \"save\"")],
    ),
    array(
        0x1011,
        "Restore default parameters",
        &[rw(1, "Restore all parameters", UInt32, "reads 1: possible", "0x64616F6C \"load\"")],
    ),
    var(0x1012, "COB-ID TIME", &[ro(0, "COB-ID TIME", UInt32, "bit 31: consumes", "")]),
    var(0x1014, "COB-ID EMCY", &[ro(0, "COB-ID EMCY", UInt32, "0x80 + node id", "")]),
    var(0x1017, "Producer heartbeat time", &[rw(0, "Producer heartbeat time", UInt16, "ms", "0 none; until reset")]),
    record(
        0x1018,
        "Identity object",
        &[
            fixed(1, "Vendor id", UInt32, "0: none assigned"),
            fixed(2, "Product code", UInt32, ""),
            fixed(3, "Revision number", UInt32, "major << 16 | minor"),
            fixed(4, "Serial number", UInt32, ""),
        ],
    ),
    record(
        0x1200,
        "SDO server parameter",
        &[
            ro(1, "COB-ID client to server", UInt32, "0x600 + node id", ""),
            ro(2, "COB-ID server to client", UInt32, "0x580 + node id", ""),
        ],
    ),
    record(0x1400, "RPDO 1 communication: effective mass", PDO_COMMUNICATION),
    record(0x1600, "RPDO 1 mapping", MAPPED_2),
    record(0x1800, "TPDO 1 communication: alarm", PDO_COMMUNICATION),
    record(0x1801, "TPDO 2 communication: judgement", PDO_COMMUNICATION),
    record(0x1802, "TPDO 3 communication: force", PDO_COMMUNICATION),
    record(0x1803, "TPDO 4 communication: instant", PDO_COMMUNICATION),
    record(0x1804, "TPDO 5 communication: course", PDO_COMMUNICATION),
    record(0x1805, "TPDO 6 communication: mass", PDO_COMMUNICATION),
    record(0x1806, "TPDO 7 communication: samples", PDO_COMMUNICATION),
    record(0x1807, "TPDO 8 communication: forecast", PDO_COMMUNICATION),
    record(0x1A00, "TPDO 1 mapping", MAPPED_4),
    record(0x1A01, "TPDO 2 mapping", MAPPED_5),
    record(0x1A02, "TPDO 3 mapping", MAPPED_4),
    record(0x1A03, "TPDO 4 mapping", MAPPED_4),
    record(0x1A04, "TPDO 5 mapping", MAPPED_4),
    record(0x1A05, "TPDO 6 mapping", MAPPED_4),
    record(0x1A06, "TPDO 7 mapping", MAPPED_4),
    record(0x1A07, "TPDO 8 mapping", MAPPED_5),
    record(
        0x2000,
        "Judgement settings",
        &[
            rw(1, "Region", UInt8, "region of ISO/TS 15066, 0 none", "0 to 12"),
            rw(2, "Contact", UInt8, "0 free, 1 clamped", "0 to 1"),
            rw(3, "Limits", UInt8, "0 ISO/TS 15066, 1 ISO 10218-2 unverified, 2 BG/BGIA", "0 to 2"),
            rw(4, "Body stiffness", Real32, "N/m", "1e3 to 1e6"),
            rw(5, "Filter", UInt8, "0 ISO/PAS 5672, 1 CFC 100, 2 CFC 180, 3 none", "0 to 3"),
            rw(6, "Relative uncertainty", Real32, "1, k = 2", "0 to 0.5"),
        ],
    ),
    record(
        0x2001,
        "Effective mass settings",
        &[
            rw(1, "Effective mass", Real32, "kg, 0 unknown", "0; 0.05 to 1000"),
            rw(2, "Longest age", UInt32, "ms", "1 to 60000"),
        ],
    ),
    record(
        0x2002,
        "Detection settings",
        &[
            rw(1, "Onset multiple", Real32, "of the tracked noise", "3 to 50"),
            rw(2, "Onset minimum", Real32, "N", "0 to 100"),
        ],
    ),
    record(
        0x2003,
        "Measuring chain",
        &[
            rw(1, "Sample rate", Real32, "Hz", "1e3 to 2.5e5"),
            rw(2, "Force per code", Real32, "N", "1e-4 to 10"),
            rw(3, "Zero code", UInt16, "code", "between the clips"),
            rw(4, "Clip low", UInt16, "code", "below the zero"),
            rw(5, "Clip high", UInt16, "code", "above the zero"),
            rw(6, "Time constant", Real32, "s", "0.01 to 1e6"),
            rw(7, "Bias low", Real32, "V", "below the high one"),
            rw(8, "Bias high", Real32, "V", "above the low one"),
            rw(9, "Delay", Real32, "s", "0 to 0.002"),
        ],
    ),
    record(
        0x2004,
        "Node settings",
        &[rw(1, "Node id", UInt8, "from the next reset on", "1 to 127"), rw(2, "Heartbeat", UInt16, "ms, 0 none", "")],
    ),
    record(
        0x2010,
        "Configuration transaction",
        &[
            wo(1, "Command", UInt8, "1 apply, 2 discard what was written", "1 to 2"),
            ro(2, "State", UInt8, "bit 0: written, not applied; bit 1: applied, not yet stored", ""),
            ro(3, "Revision", UInt32, "of the active configuration", ""),
            ro(4, "Hash", UInt32, "CRC-32 of the active configuration as stored", ""),
        ],
    ),
    record(
        0x2011,
        "Last refusal",
        &[
            ro(1, "Count", UInt32, "refusals since power-up", ""),
            ro(2, "Object", UInt32, "index << 8 | sub of the setting", ""),
            ro(3, "Reason", UInt8, "1 too low, 2 too high, 3 no such value, 4 contradiction", ""),
            ro(4, "Lowest", Real32, "lowest permitted value", ""),
            ro(5, "Highest", Real32, "highest permitted value", ""),
            ro(6, "Offered", Real32, "the value that was refused", ""),
        ],
    ),
    record(
        0x2012,
        "Configuration lock",
        &[
            ro(1, "State", UInt8, "0 open, 1 locked by a key, 2 not read from flash yet", ""),
            ro(2, "Counter", UInt32, "of the last signed change", ""),
            wo(3, "Signed change", Domain, "layout of `configuration_lock`", ""),
            wo(4, "Key", Domain, "AES-128, 16 bytes", "while open"),
        ],
    ),
    record(
        0x2020,
        "Sample stream",
        &[rw(1, "Decimation", UInt16, "samples a value, 0 off; until reset", "0 to 10000")],
    ),
    record(
        0x2100,
        "Alarm",
        &[
            ro(1, "Impact", UInt8, "low byte of the impact's number", "").in_tpdo(),
            ro(2, "Alarm flags", UInt8, "bit 0: force out of range", "").in_tpdo(),
            ro(3, "Force", Int16, "0.1 N", "").in_tpdo(),
            ro(4, "Index", UInt32, "sample number, low 32 bits", "").in_tpdo(),
        ],
    ),
    record(
        0x2101,
        "Received effective mass",
        &[
            rw(1, "Effective mass", Real32, "kg", "0.05 to 1000").in_rpdo(),
            rw(2, "Sequence", UInt16, "counts up", "").in_rpdo(),
            ro(3, "Age", UInt32, "ms, 0xFFFFFFFF never received", ""),
            ro(4, "Received", UInt32, "values taken", ""),
            ro(5, "Refused", UInt32, "values out of range", ""),
            ro(6, "Missed", UInt32, "sequence numbers skipped", ""),
        ],
    ),
    record(
        0x2102,
        "Forecast",
        &[
            ro(1, "Impact", UInt8, "low byte of the impact's number", "").in_tpdo(),
            ro(2, "Forecast flags", UInt8, "bit 0: peak or bound out of range", "").in_tpdo(),
            ro(3, "Expected peak", UInt16, "0.1 N", "").in_tpdo(),
            ro(4, "Bound", UInt16, "0.1 N", "").in_tpdo(),
            ro(5, "Samples since onset", UInt16, "samples", "").in_tpdo(),
        ],
    ),
    record(
        0x2110,
        "Event: judgement",
        &[
            ro(1, "Number", UInt16, "event, low 16 bits", "").in_tpdo(),
            ro(2, "Verdict", UInt8, "0 none, 1 pass, 2 inconclusive, 3 fail", "").in_tpdo(),
            ro(3, "Out of range", UInt8, "bits of `Saturated`", "").in_tpdo(),
            ro(4, "Flags", UInt16, "bits of `Flags`", "").in_tpdo(),
            ro(5, "Scaled force", UInt16, "0.1 N", "").in_tpdo(),
        ],
    ),
    record(
        0x2111,
        "Event: force",
        &[
            ro(1, "Number", UInt16, "event, low 16 bits", "").in_tpdo(),
            ro(2, "Peak", UInt16, "0.1 N", "").in_tpdo(),
            ro(3, "Raw peak", UInt16, "0.1 N", "").in_tpdo(),
            ro(4, "Impulse", UInt16, "0.001 N s", "").in_tpdo(),
        ],
    ),
    record(
        0x2112,
        "Event: instant",
        &[
            ro(1, "Number", UInt16, "event, low 16 bits", "").in_tpdo(),
            ro(2, "Contact", UInt8, "0 blow, n rebound", "").in_tpdo(),
            ro(3, "Contact fraction", UInt8, "1/256 sample", "").in_tpdo(),
            ro(4, "Contact index", UInt32, "sample number, low 32 bits", "").in_tpdo(),
        ],
    ),
    record(
        0x2113,
        "Event: course",
        &[
            ro(1, "Number", UInt16, "event, low 16 bits", "").in_tpdo(),
            ro(2, "Duration", UInt16, "0.1 ms", "").in_tpdo(),
            ro(3, "Time to peak", UInt16, "0.01 ms", "").in_tpdo(),
            ro(4, "Quasi-static force", UInt16, "0.1 N, 0xFFFF none", "").in_tpdo(),
        ],
    ),
    record(
        0x2114,
        "Event: mass",
        &[
            ro(1, "Number", UInt16, "event, low 16 bits", "").in_tpdo(),
            ro(2, "Impact", UInt16, "impact, low 16 bits", "").in_tpdo(),
            ro(3, "Effective mass", UInt16, "0.02 kg, 0xFFFF none", "").in_tpdo(),
            ro(4, "Age of the mass", UInt16, "ms, 0xFFFF a configured constant or none", "").in_tpdo(),
        ],
    ),
    record(
        0x2120,
        "Samples",
        &[
            ro(1, "Number", UInt16, "of the first value, low 16 bits", "").in_tpdo(),
            ro(2, "Force 1", Int16, "0.1 N, 32767 above, -32768 below the range", "").in_tpdo(),
            ro(3, "Force 2", Int16, "0.1 N, 32767 above, -32768 below the range", "").in_tpdo(),
            ro(4, "Force 3", Int16, "0.1 N, 32767 above, -32768 below the range", "").in_tpdo(),
        ],
    ),
    record(
        0x2200,
        "Event log",
        &[
            ro(1, "First number", UInt32, "oldest event held, 0 none", ""),
            ro(2, "Last number", UInt32, "newest event, 0 none", ""),
            ro(3, "Overwritten", UInt32, "events that gave way to newer ones", ""),
            rw(4, "Select", UInt32, "event number; 0 the newest", ""),
            ro(5, "Record", Domain, "the selected event, layout of `event_record`", ""),
        ],
    ),
    record(0x2300, "Recording A", RECORDING),
    record(0x2301, "Recording B", RECORDING),
    record(
        0x2400,
        "Losses",
        &[
            ro(1, "Overruns", UInt32, "gaps in the samples", ""),
            ro(2, "Lost samples", UInt32, "samples", ""),
            ro(3, "Frames evicted", UInt32, "gave way to more urgent ones", ""),
            ro(4, "Frames refused", UInt32, "found the queue full", ""),
            ro(5, "Frames not received", UInt32, "receive buffer full", ""),
            ro(6, "Events overwritten", UInt32, "in the log", ""),
            ro(7, "Curves overwritten", UInt32, "while they were downloaded, or not kept because another was", ""),
            ro(8, "Bus-off", UInt32, "times", ""),
            ro(9, "Impacts not evaluated", UInt32, "evaluation was too slow", ""),
            ro(10, "Alarms withheld", UInt32, "not Operational or alarm switched off", ""),
            ro(11, "Events not sent", UInt32, "left the log before they could be sent", ""),
            ro(12, "Storage failures", UInt32, "configuration not written", ""),
            ro(13, "Stream frames dropped", UInt32, "gave way to more urgent ones", ""),
            ro(14, "Changes rejected", UInt32, "not signed by the key, or replayed", ""),
        ],
    ),
    record(
        0x2401,
        "Bus",
        &[
            ro(1, "State", UInt8, "0 error active, 1 error passive, 2 bus-off", ""),
            ro(2, "Transmit errors", UInt16, "counter", ""),
            ro(3, "Receive errors", UInt16, "counter", ""),
        ],
    ),
    record(
        0x2402,
        "Board",
        &[
            ro(1, "Uptime", UInt32, "s", ""),
            ro(2, "Sample index", UInt64, "next sample", ""),
            ro(3, "Reset cause", UInt8, "0 power, 1 pin, 2 watchdog, 3 software, 4 brown-out, 5 panic", ""),
            ro(4, "Hardware revision", UInt32, "", ""),
            ro(5, "Stored configuration", UInt8, "0 found, 1 none yet, 2 unreadable, defaults in use", ""),
            ro(6, "Build", UInt64, "first half of the program's build id; 0 in the simulation", ""),
            ro(7, "Dictionary hash", UInt32, "CRC-32 over index, sub, type, access, PDO", ""),
            ro(8, "Start", UInt32, "starts of this board, this one included; 0 not read from flash yet", ""),
        ],
    ),
    record(
        0x2403,
        "Detector",
        &[
            ro(1, "Zero", Real32, "code at no force", ""),
            ro(2, "Noise", Real32, "N, root mean square", ""),
            ro(3, "Hum", Real32, "N, amplitude", ""),
            ro(4, "Settled", UInt8, "0 no, 1 yes", ""),
            ro(5, "Impact open", UInt8, "0 no, 1 yes", ""),
            ro(6, "Threshold", Real32, "N", ""),
        ],
    ),
    record(
        0x2404,
        "Time received",
        &[
            ro(1, "Milliseconds", UInt32, "after midnight", ""),
            ro(2, "Days", UInt16, "since 1984-01-01; 0 with sub 3 = 0: none received", ""),
            ro(3, "Sample index", UInt64, "sample number when it arrived", ""),
        ],
    ),
];

/// A type's number, CiA 301, table 44.
#[must_use]
pub const fn type_number(kind: DataType) -> u16 {
    match kind {
        DataType::Boolean => 0x01,
        DataType::Int8 => 0x02,
        DataType::Int16 => 0x03,
        DataType::Int32 => 0x04,
        DataType::UInt8 => 0x05,
        DataType::UInt16 => 0x06,
        DataType::UInt32 => 0x07,
        DataType::Real32 => 0x08,
        DataType::VisibleString => 0x09,
        DataType::OctetString => 0x0A,
        DataType::UnicodeString => 0x0B,
        DataType::TimeOfDay => 0x0C,
        DataType::TimeDifference => 0x0D,
        DataType::Domain => 0x0F,
        DataType::Int24 => 0x10,
        DataType::Real64 => 0x11,
        DataType::Int64 => 0x15,
        DataType::UInt24 => 0x16,
        DataType::UInt64 => 0x1B,
        DataType::Other(number) => number,
    }
}

/// CRC-32 (ISO-HDLC) over what every entry is on the wire: index (u16), sub-index (u8), type (u16), access (u8), PDO (u8). Two
/// devices with the same hash are read and written alike, whatever else differs.
#[must_use]
pub fn hash() -> u32 {
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut digest = CRC.digest();
    for object in OBJECTS {
        for sub in object.subs {
            digest.update(&object.index.to_le_bytes());
            digest.update(&[sub.sub]);
            digest.update(&type_number(sub.kind).to_le_bytes());
            digest.update(&[sub.access as u8, sub.pdo as u8]);
        }
    }
    digest.finalize()
}

/// The object with this index.
#[must_use]
pub fn find(index: u16) -> Option<&'static Object> {
    OBJECTS.binary_search_by_key(&index, |object| object.index).ok().map(|position| &OBJECTS[position])
}
