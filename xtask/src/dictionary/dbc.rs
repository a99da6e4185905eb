//! The DBC file: every frame that the sensor sends by itself, and the one that a robot controller sends to it.
//!
//! CAN identifiers contain the node id, a DBC file has fixed ones. The file in the tree is for the node id of a sensor that
//! nobody has configured; `cargo xtask dictionary NODE...` prints one for other node ids, with the node id after each message's
//! name where there are several. It holds while the COB-IDs of 0x1400 and 0x1800 to 0x1805 are the default ones.

use std::fmt::Write as _;

use thud_firmware::dictionary::access::mapped;
use thud_firmware::dictionary::frame::{ALARM_BASE, FORECAST_BASE, MASS_BASE, PARTS, Part, Saturated};
use thud_firmware::dictionary::object::{self, Object, Sub};
use thud_firmware::dictionary::{index, settings};
use thud_firmware::emergency::Fault;
use thud_firmware::event::{Flags, Verdict};
use thud_firmware::stream::STREAM_BASE;
use zencan_common::objects::{DataType, PdoMappable};

struct Message {
    name: &'static str,
    base: u16,
    bytes: usize,
    /// Whether the robot controller sends it to the sensor.
    to_sensor: bool,
    comment: &'static str,
    signals: Vec<Signal>,
}

struct Signal {
    name: String,
    start: usize,
    bits: usize,
    kind: DataType,
    factor: f64,
    unit: &'static str,
    range: (f64, f64),
    comment: String,
    choices: Vec<(i64, String)>,
}

/// The file's text, for sensors with these node ids.
pub fn write(nodes: &[u8]) -> String {
    let mut text = String::new();
    fill(&mut text, nodes).expect("writing to a string succeeds");
    text
}

fn fill(text: &mut String, nodes: &[u8]) -> std::fmt::Result {
    let messages = messages();
    // Alone it needs no number in its name.
    let named = |name: &str, node: u8| if nodes.len() == 1 { name.to_owned() } else { format!("{name}_{node}") };
    let sensors: Vec<String> = nodes.iter().map(|node| named("Sensor", *node)).collect();
    writeln!(text, "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: {} Robot Master\n", sensors.join(" "))?;
    let all = || nodes.iter().flat_map(|node| messages.iter().map(move |message| (*node, message)));
    for (node, message) in all() {
        let sensor = named("Sensor", node);
        let (sender, receiver) =
            if message.to_sensor { ("Robot", sensor.as_str()) } else { (sensor.as_str(), "Master") };
        let id = message.base + u16::from(node);
        writeln!(text, "BO_ {id} {}: {} {sender}", named(message.name, node), message.bytes)?;
        for signal in &message.signals {
            let sign = if matches!(signal.kind, DataType::Int16 | DataType::Real32) { '-' } else { '+' };
            writeln!(
                text,
                " SG_ {} : {}|{}@1{sign} ({},0) [{}|{}] \"{}\" {receiver}",
                signal.name, signal.start, signal.bits, signal.factor, signal.range.0, signal.range.1, signal.unit
            )?;
        }
        writeln!(text)?;
    }
    writeln!(
        text,
        "CM_ \"thud impact sensor. Written by 'cargo xtask dictionary' from the firmware's object dictionary; changes here are lost.\";"
    )?;
    for (node, message) in all() {
        let id = message.base + u16::from(node);
        writeln!(text, "CM_ BO_ {id} \"{}\";", message.comment)?;
        for signal in message.signals.iter().filter(|signal| !signal.comment.is_empty()) {
            writeln!(text, "CM_ SG_ {id} {} \"{}\";", signal.name, signal.comment)?;
        }
    }
    for (node, message) in all() {
        let id = message.base + u16::from(node);
        for signal in message.signals.iter().filter(|signal| !signal.choices.is_empty()) {
            write!(text, "VAL_ {id} {}", signal.name)?;
            for (number, word) in &signal.choices {
                write!(text, " {number} \"{word}\"")?;
            }
            writeln!(text, " ;")?;
        }
    }
    for (node, message) in all() {
        let id = message.base + u16::from(node);
        for signal in message.signals.iter().filter(|signal| signal.kind == DataType::Real32) {
            writeln!(text, "SIG_VALTYPE_ {id} {} : 1;", signal.name)?;
        }
    }
    Ok(())
}

fn messages() -> Vec<Message> {
    let pdo = |name, base, mapping: u16, to_sensor, comment| {
        let carried = mapped(mapping).and_then(object::find).expect("every PDO maps an object");
        let signals = signals(carried);
        let bytes = signals.iter().map(|signal| signal.start + signal.bits).max().unwrap_or(0).div_ceil(8);
        Message { name, base, bytes, to_sensor, comment, signals }
    };
    let part =
        |name, part: Part, comment| pdo(name, part.base(), index::TPDO_ALARM_MAPPING + 1 + part as u16, false, comment);
    vec![
        pdo("Alarm", ALARM_BASE, index::TPDO_ALARM_MAPPING, false, "TPDO 1: a contact began."),
        part(
            "EventJudgement",
            Part::Judgement,
            "TPDO 2: verdict of a contact. The five parts of an event share its Number.",
        ),
        part("EventForce", Part::Force, "TPDO 3: peaks and impulse of a contact."),
        part("EventInstant", Part::Instant, "TPDO 4: instant of a contact."),
        part("EventCourse", Part::Course, "TPDO 5: duration of a contact and the force that stayed."),
        part("EventMass", Part::Mass, "TPDO 6: impact and effective mass of a contact."),
        pdo(
            "Samples",
            STREAM_BASE,
            index::TPDO_ALARM_MAPPING + 1 + PARTS as u16,
            false,
            "TPDO 7: stream of samples, while 0x2020:1 is not 0. Number counts values, three a frame.",
        ),
        pdo(
            "Forecast",
            FORECAST_BASE,
            index::TPDO_ALARM_MAPPING + 2 + PARTS as u16,
            false,
            "TPDO 8: how hard the blow is going to be, while the force rises.",
        ),
        pdo(
            "EffectiveMass",
            MASS_BASE,
            index::RPDO_MASS_MAPPING,
            true,
            "RPDO 1: effective mass of the robot at the contact point, sent while it moves.",
        ),
        emergency(),
        Message {
            name: "Heartbeat",
            base: 0x700,
            bytes: 1,
            to_sensor: false,
            comment: "NMT error control: boot-up and heartbeat.",
            signals: vec![Signal {
                choices: [(0, "boot_up"), (4, "stopped"), (5, "operational"), (127, "pre_operational")]
                    .map(|(state, word)| (state, word.to_owned()))
                    .to_vec(),
                ..plain("State", 0, 8)
            }],
        },
    ]
}

fn plain(name: &str, start: usize, bits: usize) -> Signal {
    Signal {
        name: name.to_owned(),
        start,
        bits,
        kind: DataType::UInt32,
        factor: 1.0,
        unit: "",
        range: (0.0, (2f64).powi(bits as i32) - 1.0),
        comment: String::new(),
        choices: Vec::new(),
    }
}

fn emergency() -> Message {
    let faults =
        |number: fn(Fault) -> i64| Fault::ALL.into_iter().map(move |fault| (number(fault), format!("{fault:?}")));
    let register =
        ["Generic", "Current", "Voltage", "Temperature", "Communication", "Profile", "Reserved", "Manufacturer"];
    let mut signals = vec![Signal {
        choices: std::iter::once((0, "NoError".to_owned())).chain(faults(|fault| i64::from(fault.code()))).collect(),
        ..plain("Code", 0, 16)
    }];
    signals.extend((16..).zip(register).map(|(bit, name)| plain(&format!("Register{name}"), bit, 1)));
    signals.push(Signal {
        comment: "which fault appeared, or has gone".to_owned(),
        choices: faults(|fault| fault as i64).collect(),
        ..plain("Cause", 24, 8)
    });
    signals.push(plain("Detail", 32, 32));
    Message {
        name: "Emergency",
        base: 0x80,
        bytes: 8,
        to_sensor: false,
        comment: "EMCY: a fault appeared or has gone, or something was lost.",
        signals,
    }
}

/// The signals of a mapped object, in the order of its frame.
fn signals(object: &Object) -> Vec<Signal> {
    let mut start = 0;
    let mut signals = Vec::new();
    for sub in object.subs.iter().filter(|sub| !matches!(sub.pdo, PdoMappable::None)) {
        let bits: Vec<(usize, String)> = match (object.index, sub.sub) {
            (index::ALARM, 2) => vec![(0, "ForceOutOfRange".to_owned())],
            (index::FORECAST, 2) => vec![(0, "ForecastOutOfRange".to_owned())],
            (index::EVENT, 3) => {
                named_bits(Saturated::all().iter_names().map(|(name, bit)| (name, u16::from(bit.bits()))))
                    .map(|(bit, name)| (bit, format!("{name}OutOfRange")))
                    .collect()
            }
            (index::EVENT, 4) => named_bits(Flags::NAMES.into_iter().map(|(bit, name)| (name, bit.bits()))).collect(),
            _ => Vec::new(),
        };
        if bits.is_empty() {
            signals.push(whole(object, sub, start));
        }
        signals.extend(bits.into_iter().map(|(bit, name)| plain(&name, start + bit, 1)));
        start += sub.size() * 8;
    }
    signals
}

fn named_bits<'a>(bits: impl Iterator<Item = (&'a str, u16)>) -> impl Iterator<Item = (usize, String)> {
    bits.map(|(name, bit)| (bit.trailing_zeros() as usize, camel(name)))
}

fn whole(object: &Object, sub: &Sub, start: usize) -> Signal {
    let (factor, unit) = sub.step();
    let bits = sub.size() * 8;
    let steps = (2f64).powi(bits as i32) - 1.0;
    let range = match (sub.kind, settings::limits(object.index, sub.sub)) {
        (_, Some((low, high))) => (decimal(low), decimal(high)),
        (DataType::Int16, _) => (-(steps + 1.0) / 2.0, (steps - 1.0) / 2.0),
        _ => (0.0, steps),
    };
    // Written as a decimal fraction: 6553.5, and not 6553.500000000001.
    let scaled = |value: f64| if factor == 1.0 { value } else { (value * factor * 1e9).round() / 1e9 };
    let mut choices = Vec::new();
    if (object.index, sub.sub) == (index::EVENT, 2) {
        choices = (0..4u8)
            .filter_map(Verdict::from_number)
            .map(|verdict| (verdict as i64, verdict.name().to_owned()))
            .collect();
    }
    if object.index == index::SAMPLES && sub.kind == DataType::Int16 {
        choices =
            vec![(i64::from(i16::MIN), "below_range".to_owned()), (i64::from(i16::MAX), "above_range".to_owned())];
    }
    if sub.unit.contains("0xFFFF") {
        choices.push((0xFFFF, "none".to_owned()));
    }
    Signal {
        name: camel(sub.name),
        start,
        bits,
        kind: sub.kind,
        factor,
        unit,
        range: (scaled(range.0), scaled(range.1)),
        comment: sub.unit.replace('"', "'"),
        choices,
    }
}

/// The shortest decimal that means this single-precision number.
fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or_else(|_| f64::from(value))
}

/// "Quasi-static force", "RAW_PEAK" and "stale-mass" as names of signals.
fn camel(name: &str) -> String {
    name.split([' ', '-', '_'])
        .filter_map(|word| {
            let mut letters = word.chars();
            let first = letters.next()?;
            Some(first.to_uppercase().chain(letters.flat_map(char::to_lowercase)).collect::<String>())
        })
        .collect()
}
