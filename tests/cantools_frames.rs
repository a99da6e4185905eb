//! Every frame of the sensor, between the firmware's own encoder and `cantools` with the shipped DBC file, both ways.
//!
//! The firmware encodes random and extreme values; cantools decodes them and they must be what was meant, within half a step or
//! marked as out of range; encoded again by cantools they must be the same bytes. The effective mass goes the other way.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use thud_firmware::dictionary::frame::{self, Alarm, ForecastFrame, MassFrame};
use thud_firmware::emergency::{Emergency, Fault};
use thud_firmware::event::{Event, Flags, Onset, Severity, Verdict};
use thud_firmware::forecast::Forecast;
use thud_firmware::stream::{Samples, VALUES};
use thud_firmware::units::{Hertz, Kilogram, Newton, NewtonSecond, SampleInstant, Second};

mod python;

const RATE: Hertz = Hertz(20_000.0);
const CASES: u32 = 4_000;

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Mostly within a field's range, sometimes just at its ends, sometimes far beyond.
fn value(random: &mut ChaCha8Rng, most: f32) -> f32 {
    match random.random_range(0..8) {
        0 => 0.0,
        1 => most,
        2 => most * 1.5,
        3 => -most,
        4 => most * (1.0 + 2e-5),
        _ => most * random.random::<f32>(),
    }
}

fn event(random: &mut ChaCha8Rng) -> Event {
    let mass = random.random_bool(0.7).then(|| Kilogram(value(random, 1310.68)));
    let index = random.random::<u64>() >> random.random_range(8..60);
    let contact_instant = SampleInstant { index, fraction: random.random_range(0.0..0.999) };
    Event {
        number: random.random(),
        impact: random.random(),
        contact: random.random(),
        flags: Flags::from_bits_truncate(random.random()),
        contact_instant,
        peak_instant: SampleInstant::from_offset(index, random.random_range(0.0..20_000.0)),
        raw_peak: Newton(value(random, 6553.5)),
        peak: Newton(value(random, 6553.5)),
        impulse: NewtonSecond(value(random, 65.535)),
        duration: Second(value(random, 6.5535)),
        noise: Newton(0.1),
        severity: Severity {
            verdict: Verdict::from_number(random.random_range(0..4)).unwrap(),
            scaled: Newton(value(random, 6553.5)),
            quasi_static: random.random_bool(0.5).then(|| Newton(value(random, 6553.4))),
            effective_mass: mass,
            effective_mass_age_ms: mass.filter(|_| random.random_bool(0.5)).map(|_| random.random_range(0..70_000)),
            ..Severity::default()
        },
        configuration_revision: 1,
        configuration_hash: 2,
    }
}

/// What cantools must find in the frames of an event. A number with a unit is `[value, signal that says out of range]`.
fn lines_of_event(event: &Event) -> [Value; frame::PARTS] {
    let frames = frame::encode(event, RATE).map(|frame| hex(&frame));
    let severity = &event.severity;
    let number = event.number as u16;
    let optional = |value: Option<f32>, flag: &str| value.map_or(json!("none"), |value| json!([value, flag]));
    let mut judgement = json!({
        "Number": number, "Verdict": severity.verdict.name(), "ScaledForce": [severity.scaled.0, "ScaledOutOfRange"],
    });
    for (flag, name) in Flags::NAMES {
        let signal: String = name.split('-').map(|word| word[..1].to_uppercase() + &word[1..]).collect();
        judgement[signal] = u8::from(event.flags.contains(flag)).into();
    }
    let age = severity.effective_mass_age_ms.filter(|_| severity.effective_mass.is_some());
    let contents = [
        ("EventJudgement", judgement),
        (
            "EventForce",
            json!({
                "Number": number, "Peak": [event.peak.0, "PeakOutOfRange"],
                "RawPeak": [event.raw_peak.0, "RawPeakOutOfRange"], "Impulse": [event.impulse.0, "ImpulseOutOfRange"],
            }),
        ),
        (
            "EventInstant",
            json!({
                "Number": number, "Contact": event.contact, "ContactIndex": event.contact_instant.index as u32,
                // Cut off to the step below, so that it stays below one sample.
                "ContactFraction": (event.contact_instant.fraction * 256.0).floor() / 256.0,
            }),
        ),
        (
            "EventCourse",
            json!({
                "Number": number, "Duration": [event.duration.0 * 1e3, "DurationOutOfRange"],
                "TimeToPeak": [event.time_to_peak(RATE).0 * 1e3, "TimeToPeakOutOfRange"],
                "QuasiStaticForce": optional(severity.quasi_static.map(|force| force.0), "QuasiStaticOutOfRange"),
            }),
        ),
        (
            "EventMass",
            json!({
                "Number": number, "Impact": event.impact as u16,
                "EffectiveMass": optional(severity.effective_mass.map(|mass| mass.0), "MassOutOfRange"),
                "AgeOfTheMass": optional(age.map(|age| age as f32), "MassOutOfRange"),
            }),
        ),
    ];
    let mut frames = frames.into_iter();
    contents.map(|(name, content)| json!({"message": name, "data": frames.next(), "is": content}))
}

fn lines(seed: u64) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut lines = Vec::new();
    for _ in 0..CASES {
        lines.extend(lines_of_event(&event(&mut random)));
        let sign = if random.random_bool(0.5) { -1.0 } else { 1.0 };
        let force = sign * value(&mut random, 3276.7);
        let onset = Onset {
            impact: random.random(),
            noticed_at: random.random(),
            threshold: Newton(3.0),
            force: Newton(force),
        };
        lines.push(json!({
            "message": "Alarm", "data": hex(&Alarm::encode(&onset)),
            "is": {"Impact": onset.impact as u8, "Index": onset.noticed_at as u32, "Force": [force, "ForceOutOfRange"]},
        }));
        let forecast = Forecast { peak: Newton(value(&mut random, 6553.5)), bound: Newton(value(&mut random, 6553.5)) };
        let (impact, samples): (u32, u16) = (random.random(), random.random());
        lines.push(json!({
            "message": "Forecast", "data": hex(&ForecastFrame::encode(impact, &forecast, samples)),
            "is": {"Impact": impact as u8, "ExpectedPeak": [forecast.peak.0, "ForecastOutOfRange"],
                   "Bound": [forecast.bound.0, "ForecastOutOfRange"], "SamplesSinceOnset": samples},
        }));
        let forces = [(); VALUES].map(|()| {
            let sign = if random.random_bool(0.5) { -1.0 } else { 1.0 };
            sign * value(&mut random, 3276.6)
        });
        let streamed = forces.map(|force| match (force * 10.0).round() {
            steps if steps >= 32_767.0 => json!("above_range"),
            steps if steps <= -32_768.0 => json!("below_range"),
            _ => json!([force, "itself"]),
        });
        let number: u16 = random.random();
        lines.push(json!({
            "message": "Samples", "data": hex(&Samples::encode(number, &forces)),
            "is": {"Number": number, "Force1": streamed[0], "Force2": streamed[1], "Force3": streamed[2]},
        }));
        let fault = Fault::ALL[random.random_range(0..Fault::ALL.len())];
        let emergency =
            Emergency { code: fault.code(), register: random.random(), cause: fault as u8, detail: random.random() };
        let name = format!("{fault:?}");
        lines.push(json!({
            "message": "Emergency", "data": hex(&emergency.encode()),
            "is": {"Code": name, "Cause": name, "Detail": emergency.detail, "RegisterGeneric": emergency.register & 1,
                   "RegisterManufacturer": emergency.register >> 7},
        }));
    }
    lines.iter().map(|line| format!("{line}\n")).collect()
}

#[test]
fn cantools_and_the_firmware_agree_about_every_frame() {
    let Some(python) = python::python("cantools") else { return };
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut child = Command::new(python)
        .arg(top.join("tests/python/frames.py"))
        .arg(top.join("docs/can/thud.dbc"))
        .arg(CASES.to_string())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let sent = lines(0xD8C);
    let mut stdin = child.stdin.take().unwrap();
    // Written beside reading, or both sides would wait for each other.
    let writer = std::thread::spawn(move || stdin.write_all(sent.as_bytes()));
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "frames.py says what differs above");
    writer.join().unwrap().unwrap();

    let mut masses = 0;
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        let encoded: Value = serde_json::from_str(line).unwrap();
        let text = encoded["data"].as_str().unwrap();
        let bytes: Vec<u8> =
            (0..text.len()).step_by(2).map(|at| u8::from_str_radix(&text[at..at + 2], 16).unwrap()).collect();
        let read = MassFrame::decode(&bytes).unwrap();
        let mass = encoded["mass"].as_f64().unwrap() as f32;
        assert_eq!(
            (read.mass.0.to_bits(), u64::from(read.sequence)),
            (mass.to_bits(), encoded["sequence"].as_u64().unwrap())
        );
        assert_eq!(read.encode().as_slice(), bytes);
        masses += 1;
    }
    assert_eq!(masses, CASES);
}
