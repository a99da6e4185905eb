//! Real blows through the sensor: every blow once, the rebound separately, nothing before contact.
//!
//! The recordings lie beside the workspace in `../shared/recordings`, or in the folder that `THUD_SHARED` names; where they
//! are absent the tests say so and do nothing.

mod synthetic;

use std::path::PathBuf;

use synthetic::{Bench, Disturbance, configuration};
use thud_firmware::capture::CAPTURE;
use thud_firmware::event::{Event, Flags};
use thud_firmware::units::Hertz;

/// A recording: times in s, forces in N.
struct Recording {
    times: Vec<f64>,
    forces: Vec<f64>,
}

fn read(path: &str) -> Option<Recording> {
    let shared = std::env::var_os("THUD_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared"), PathBuf::from);
    let path = shared.join("recordings").join(path);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(reason) => {
            eprintln!("SKIPPED: {} cannot be read ({reason}); the shared recordings are not here", path.display());
            return None;
        }
    };
    let mut recording = Recording { times: Vec::new(), forces: Vec::new() };
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let mut fields = line.split(',').map(str::parse::<f64>);
        if let (Some(Ok(time)), Some(Ok(force))) = (fields.next(), fields.next()) {
            recording.times.push(time);
            recording.forces.push(force);
        }
    }
    assert!(recording.times.len() > 1000, "{} holds {} samples", path.display(), recording.times.len());
    Some(recording)
}

impl Recording {
    /// The recording at another rate: monotone cubic (Fritsch–Carlson), which adds no overshoot between samples.
    fn resampled(&self, rate: f64) -> Vec<f64> {
        let (t, y) = (&self.times, &self.forces);
        let n = t.len();
        let secant: Vec<f64> = (0..n - 1).map(|i| (y[i + 1] - y[i]) / (t[i + 1] - t[i])).collect();
        let mut slope = vec![0.0; n];
        for i in 1..n - 1 {
            if secant[i - 1] * secant[i] > 0.0 {
                slope[i] = 2.0 / (1.0 / secant[i - 1] + 1.0 / secant[i]);
            }
        }
        let count = ((t[n - 1] - t[0]) * rate) as usize;
        let mut i = 0;
        (0..count)
            .map(|k| {
                let at = t[0] + k as f64 / rate;
                while i + 2 < n && t[i + 1] <= at {
                    i += 1;
                }
                let h = t[i + 1] - t[i];
                let u = (at - t[i]) / h;
                let (u2, u3) = (u * u, u * u * u);
                y[i] * (2.0 * u3 - 3.0 * u2 + 1.0)
                    + h * slope[i] * (u3 - 2.0 * u2 + u)
                    + y[i + 1] * (3.0 * u2 - 2.0 * u3)
                    + h * slope[i + 1] * (u3 - u2)
            })
            .collect()
    }
}

/// Plays forces after a second made of the mirrored first `idle` forces; after them the sensor is left alone.
/// Returns the onsets' and events' times in the recording's own time, where `start` is its first sample.
fn play(forces: &[f64], rate: f64, start: f64, idle: usize, seconds_after: f64) -> (Vec<f64>, Vec<(f64, Event)>) {
    let mut configuration = configuration(rate);
    configuration.chain.sample_rate = Hertz(rate as f32);
    let mut bench = Bench::<{ 4 * CAPTURE }>::new(configuration, 1);
    let quiet = rate as usize;
    let at = |i: i64| -> f64 {
        if i >= 0 {
            return forces.get(i as usize).copied().unwrap_or(0.0);
        }
        // Mirrored at the recording's beginning, to and fro.
        let period = 2 * (idle as i64 - 1);
        let place = (-i) % period;
        forces[if place < idle as i64 { place } else { period - place } as usize]
    };
    let total = quiet as f64 / rate + forces.len() as f64 / rate + seconds_after;
    bench.run(total, &Disturbance::NONE, |t| at((t * rate).round() as i64 - quiet as i64));
    let own = |seconds: f64| seconds - quiet as f64 / rate + start;
    let onsets = bench.onsets.iter().map(|(_, onset)| own(onset.noticed_at as f64 / rate)).collect();
    let events =
        bench.events.iter().map(|event| (own(event.contact_instant.seconds(Hertz(rate as f32))), *event)).collect();
    (onsets, events)
}

fn print(name: &str, onsets: &[f64], events: &[(f64, Event)]) {
    println!("{name}: onsets {onsets:.4?}");
    for (at, event) in events {
        println!(
            "  {:8.3} ms  contact {}  raw {:7.1} N  filtered {:6.1} N  {:.4} N·s  {:6.2} ms  {:?}",
            at * 1e3,
            event.contact,
            event.raw_peak.0,
            event.peak.0,
            event.impulse.0,
            event.duration.0 * 1e3,
            event.flags.names().collect::<Vec<_>>()
        );
    }
}

#[test]
fn every_hammer_blow_is_found_once() {
    for blow in 1..=5 {
        let Some(recording) = read(&format!("impact_hammer/blow{blow}.csv")) else { return };
        let rate = 25_600.0;
        let (onsets, events) = play(&recording.forces, rate, 0.0, 16, 1.0);
        print(&format!("blow {blow}"), &onsets, &events);
        let highest = recording.forces.iter().copied().fold(0.0, f64::max);
        assert_eq!((onsets.len(), events.len()), (1, 1), "blow {blow}");
        let (contact, event) = events[0];
        // The force is at a third of its peak 0.78 ms after the recording began, and nothing one sample before.
        assert!((0.70e-3..0.80e-3).contains(&contact), "blow {blow}: contact at {contact} s");
        assert!(
            (f64::from(event.raw_peak.0) / highest - 1.0).abs() < 0.05,
            "blow {blow}: {} N of {highest}",
            event.raw_peak.0
        );
        // Impulse 12 to 15 mN·s as the recording's description says.
        assert!((0.011..0.016).contains(&event.impulse.0), "blow {blow}: {} N·s", event.impulse.0);
        assert!((0.2e-3..0.5e-3).contains(&event.duration.0), "blow {blow}: {} s", event.duration.0);
        assert!(event.flags.contains(Flags::SHORT_PULSE));
    }
}

struct Robot {
    file: &'static str,
    /// When the second contact begins, s; none where the robot stays.
    second: Option<(f64, f64)>,
}

#[test]
fn a_robots_blow_and_its_rebound_are_two_contacts() {
    for robot in [
        Robot { file: "ur_gain1_v0.25", second: Some((0.099, 0.103)) },
        Robot { file: "ur_gain1_v0.10", second: None },
        Robot { file: "acf_ramp0.1s_fzero10N_v0.25", second: Some((0.052, 0.055)) },
        Robot { file: "acf_ramp0.1s_fzero10N_v0.10", second: Some((0.039, 0.045)) },
    ] {
        let Some(recording) = read(&format!("ur10e_direct_contact/force_{}.csv", robot.file)) else { return };
        let rate = 20_000.0;
        let start = recording.times[0];
        let (onsets, events) = play(&recording.resampled(rate), rate, start, 3000, 1.0);
        print(robot.file, &onsets, &events);
        assert_eq!(onsets.len(), 1, "{}: one impact", robot.file);
        // Within two samples (1.25 kHz) of the authors' start of contact.
        assert!(events[0].0.abs() < 1.6e-3, "{}: contact at {} s", robot.file, events[0].0);
        let highest = |from: f64, to: f64| {
            let samples = recording.times.iter().zip(&recording.forces);
            samples.filter(|(t, _)| (from..to).contains(*t)).map(|(_, force)| *force).fold(0.0, f64::max)
        };
        for (index, (at, event)) in events.iter().enumerate() {
            assert_eq!(usize::from(event.contact), index);
            assert_eq!(event.flags.contains(Flags::REBOUND), index > 0);
            let next = events.get(index + 1).map_or(0.5, |(next, _)| *next);
            let truth = highest(*at, next);
            let found = f64::from(event.raw_peak.0);
            // 10 N is the offset and the ringing of a single sample at 1.25 kHz.
            assert!((found - truth).abs() < 10.0, "{}: contact {index} has {found} N of {truth} N", robot.file);
        }
        match (robot.second, events.get(1)) {
            (Some((from, to)), Some((at, _))) => {
                assert!((from..to).contains(at), "{}: second contact at {at} s", robot.file);
            }
            (None, None) => assert!(events[0].1.flags.contains(Flags::HELD)),
            (wanted, got) => panic!("{}: second contact {got:?}, wanted in {wanted:?}", robot.file),
        }
    }
}
