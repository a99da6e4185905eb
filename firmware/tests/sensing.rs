//! What the sensor says in the situations it will meet.

mod synthetic;

use proptest::prelude::*;
use synthetic::{Bench, Disturbance, HalfSine, RATE, code, configuration};
use thud_firmware::board::{BLOCK, BlockInfo, Overrun};
use thud_firmware::capture::{CAPTURE, Curve, LostCurves};
use thud_firmware::configuration::{Configuration, ContactKind, FilterProfile};
use thud_firmware::detector::{ChainFault, Signal};
use thud_firmware::event::{Event, Flags, Verdict};
use thud_firmware::units::{Hertz, Kilogram, Second, Volt};

type Usual = Bench<CAPTURE>;

const QUIET: Disturbance = Disturbance { noise: 0.3, ..Disturbance::NONE };

/// A pulse of 200 N and 30 ms at this instant.
fn blow(at: f64) -> impl Fn(f64) -> f64 {
    let pulse = HalfSine::of_duration(200.0, 0.03);
    move |t| pulse.at(t - at)
}

fn settled(configuration: Configuration) -> Usual {
    let mut bench = Usual::new(configuration, 3);
    bench.run(1.0, &QUIET, |_| 0.0);
    assert!(bench.sensor.settled());
    assert_eq!(bench.signals, []);
    bench
}

fn one(bench: &Usual) -> Event {
    assert_eq!(bench.events.len(), 1, "{:?}", bench.events);
    bench.events[0]
}

fn struck(configuration: Configuration) -> Event {
    let mut bench = settled(configuration);
    bench.run(1.0, &QUIET, blow(1.2));
    one(&bench)
}

#[test]
fn a_clean_blow_is_one_event_that_passes() {
    let event = struck(configuration(RATE));
    assert_eq!((event.number, event.impact, event.contact), (1, 1, 0));
    assert_eq!(event.flags, Flags::empty());
    assert_eq!(event.severity.verdict, Verdict::Pass);
    assert!((event.duration.0 - 0.03).abs() < 1e-4, "{}", event.duration.0);
    assert!((event.time_to_peak(Hertz(RATE as f32)).0 - 0.015).abs() < 5e-4);
    assert_eq!((event.configuration_revision, event.configuration_hash), (7, 0xC0FF_EE00));
}

/// The verdict filter's peak error on half-sines: the published check values, to the rounding of their last digit.
#[test]
fn the_verdict_filter_takes_off_what_is_published() {
    for (milliseconds, least, most) in [
        (2.3, -0.665, -0.615),
        (5.0, -0.335, -0.295),
        (10.0, -0.055, -0.035),
        (19.0, -0.01, 0.01),
        (28.0, -0.002, 0.002),
    ] {
        let mut bench = settled(configuration(RATE));
        let pulse = HalfSine::of_duration(1000.0, milliseconds * 1e-3);
        bench.run(1.0, &Disturbance::NONE, |t| pulse.at(t - 1.2));
        let event = one(&bench);
        let error = f64::from(event.peak.0) / 1000.0 - 1.0;
        assert!((least..=most).contains(&error), "{milliseconds} ms: {} %", error * 100.0);
        assert_eq!(event.flags.contains(Flags::SHORT_PULSE), error < -0.1);
    }
}

#[test]
fn without_a_filter_the_raw_peak_is_judged() {
    let event = struck(Configuration { filter: FilterProfile::None, ..configuration(RATE) });
    assert_eq!(event.peak, event.raw_peak);
    assert_eq!(event.severity.transient, event.raw_peak);
}

#[test]
fn rebounds_are_contacts_of_their_own_with_consecutive_numbers() {
    let mut bench = settled(configuration(RATE));
    let force = |t: f64| {
        blow(1.2)(t) + HalfSine::of_duration(60.0, 0.02).at(t - 1.27) + HalfSine::of_duration(20.0, 0.02).at(t - 1.33)
    };
    bench.run(1.0, &QUIET, force);
    bench.run(1.5, &QUIET, blow(2.5));
    let seen: Vec<_> = bench.events.iter().map(|e| (e.number, e.impact, e.contact, e.flags)).collect();
    let again = Flags::REBOUND;
    assert_eq!(seen, [(1, 1, 0, Flags::empty()), (2, 1, 1, again), (3, 1, 2, again), (4, 2, 0, Flags::empty())]);
    for (event, peak) in bench.events.iter().zip([200.0, 60.0, 20.0]) {
        assert!((event.raw_peak.0 - peak).abs() < 1.0, "{} N", event.raw_peak.0);
    }
    assert!((bench.events[0].severity.transient.0 - bench.events[0].peak.0).abs() < 1e-3);
}

#[test]
fn a_dip_shorter_than_the_gap_is_one_contact() {
    let mut bench = settled(configuration(RATE));
    let force =
        |t: f64| HalfSine::of_duration(100.0, 0.02).at(t - 1.2) + HalfSine::of_duration(90.0, 0.02).at(t - 1.222);
    bench.run(1.0, &QUIET, force);
    let event = one(&bench);
    assert!((event.duration.0 - 0.042).abs() < 1e-3, "{}", event.duration.0);
}

#[test]
fn a_piece_that_swings_after_the_robot_has_left_is_no_rebound() {
    let mut bench = settled(configuration(RATE));
    // 0.2 kg on 25 N/mm: 56 Hz.
    let swing =
        |u: f64| if u > 0.0 { -40.0 * (-u / 0.14).exp() * (std::f64::consts::TAU * 56.0 * u).sin() } else { 0.0 };
    bench.run(1.5, &QUIET, |t| blow(1.2)(t) + swing(t - 1.23));
    assert!((one(&bench).raw_peak.0 - 200.0).abs() < 1.0);
}

/// A contact that is pressed on for two seconds: transient peak, plateau, release.
fn press(t: f64) -> f64 {
    let plateau = if (1.21..3.2).contains(&t) { 80.0 } else { 0.0 };
    let edge = if (3.2..3.21).contains(&t) { 80.0 * (3.21 - t) / 0.01 } else { 0.0 };
    let rise = if (1.2..1.21).contains(&t) { 80.0 * (t - 1.2) / 0.01 } else { 0.0 };
    rise + plateau + edge + HalfSine::of_duration(120.0, 0.04).at(t - 1.2)
}

#[test]
fn a_held_contact_has_a_quasi_static_force_and_its_whole_impulse() {
    let mut bench = settled(Configuration { contact: ContactKind::Clamped, ..configuration(RATE) });
    bench.run(3.0, &QUIET, press);
    let event = one(&bench);
    assert_eq!(event.flags, Flags::HELD);
    let quasi_static = event.severity.quasi_static.unwrap().0;
    assert!((quasi_static - 80.0).abs() < 0.5, "{quasi_static} N");
    assert!((event.duration.0 - 2.01).abs() < 0.01, "{} s", event.duration.0);
    let impulse = 80.0 * 2.0 + HalfSine::of_duration(120.0, 0.04).impulse();
    assert!((f64::from(event.impulse.0) / impulse - 1.0).abs() < 0.01, "{} N·s of {impulse}", event.impulse.0);
    assert_eq!((event.severity.scaling, event.severity.verdict), (1.0, Verdict::Pass));
    // And the sensor is ready again.
    bench.run(1.5, &QUIET, blow(4.5));
    assert_eq!(bench.events.len(), 2);
    assert_eq!(bench.events[1].flags, Flags::empty());
}

#[test]
fn a_short_time_constant_gives_no_quasi_static_verdict() {
    let mut short = Configuration { contact: ContactKind::Clamped, ..configuration(RATE) };
    short.chain.time_constant = Second(1.59);
    let mut bench = settled(short);
    bench.run(3.0, &QUIET, press);
    let event = one(&bench);
    assert!(event.flags.contains(Flags::NO_QUASI_STATIC | Flags::HELD));
    assert_eq!((event.severity.quasi_static, event.severity.verdict), (None, Verdict::Inconclusive));
}

#[test]
fn what_leans_on_the_sensor_is_one_truncated_impact_and_then_a_new_zero() {
    let mut bench = settled(configuration(RATE));
    let lean = |t: f64| if (2.0..60.0).contains(&t) { 50.0 } else { 0.0 };
    bench.run(15.0, &QUIET, lean);
    assert!(one(&bench).flags.contains(Flags::TRUNCATED));
    assert_ne!(one(&bench).severity.verdict, Verdict::Pass);
    bench.run(40.0, &QUIET, lean);
    assert_eq!(bench.onsets.len(), 1, "no stream of onsets");
    assert!(bench.sensor.settled(), "30 s later the force is the new zero");
    bench.run(1.5, &QUIET, |t| lean(t) + blow(56.5)(t));
    assert_eq!(bench.onsets.len(), 2);
    assert!((bench.events[1].raw_peak.0 - 200.0).abs() < 1.0);
    // Taken away: the zero jumps down, which no push can do, and is learned anew at once.
    bench.run(4.0, &QUIET, lean);
    bench.run(2.0, &QUIET, blow(62.5));
    assert_eq!(bench.onsets.len(), 3);
    assert!((bench.events[2].raw_peak.0 - 200.0).abs() < 1.0, "{}", bench.events[2].raw_peak.0);
}

#[test]
fn what_leans_and_goes_re_arms() {
    let mut bench = settled(configuration(RATE));
    bench.run(14.0, &QUIET, |t| if (2.0..14.0).contains(&t) { 50.0 } else { 0.0 });
    bench.run(2.0, &QUIET, blow(16.0));
    assert_eq!(bench.onsets.len(), 2);
    assert_eq!(bench.events[1].flags, Flags::empty());
}

#[test]
fn a_push_that_grows_is_not_tracked_away_and_a_drift_is() {
    let mut bench = settled(configuration(RATE));
    bench.run(20.0, &QUIET, |t| 0.4 * (t - 1.0).max(0.0));
    assert_eq!(bench.onsets, []);
    bench.run(10.0, &QUIET, |t| 8.0 + 2.0 * (t - 21.0).max(0.0));
    assert_eq!(bench.onsets.len(), 1);
}

#[test]
fn a_blow_before_settling_is_unsettled_and_never_passes() {
    let mut bench = Usual::new(configuration(RATE), 3);
    bench.run(1.5, &QUIET, blow(0.3));
    let event = one(&bench);
    assert_eq!(event.flags, Flags::UNSETTLED);
    assert_eq!(event.severity.verdict, Verdict::Inconclusive);
    assert!((event.raw_peak.0 - 200.0).abs() < 2.0);
}

#[test]
fn clipping_is_flagged_and_lasting_clipping_is_a_fault() {
    let mut bench = settled(configuration(RATE));
    let hard = HalfSine::of_duration(4000.0, 0.01);
    bench.run(1.0, &QUIET, |t| hard.at(t - 1.2));
    assert!(one(&bench).flags.contains(Flags::CLIPPED));
    assert_eq!(one(&bench).severity.verdict, Verdict::Fail);
    bench.run(0.5, &Disturbance::NONE, |_| -4000.0);
    bench.run(1.0, &QUIET, |_| 0.0);
    let faults: Vec<_> = bench.signals.iter().map(|(_, signal)| *signal).filter(is_fault).collect();
    assert_eq!(faults, [Signal::FaultRaised(ChainFault::Clipped), Signal::FaultCleared(ChainFault::Clipped)]);
    assert!(bench.sensor.settled());
}

fn is_fault(signal: &Signal) -> bool {
    matches!(signal, Signal::FaultRaised(_) | Signal::FaultCleared(_))
}

/// Codes of a force at this instant, one block.
fn block(bench: &Usual, force: &impl Fn(f64) -> f64) -> [u16; BLOCK] {
    core::array::from_fn(|i| code(force((bench.next + i as u64) as f64 / RATE), &bench.chain))
}

#[test]
fn a_broken_cable_is_a_fault_once_and_voids_the_impact() {
    let mut bench = settled(configuration(RATE));
    let force = blow(1.0);
    while bench.next < (1.8 * RATE) as u64 {
        let codes = block(&bench, &force);
        let t = bench.next as f64 / RATE;
        let bias = if (1.02..1.1).contains(&t) { 23.0 } else { 10.0 };
        bench.push(&codes, bias);
    }
    let faults: Vec<_> = bench.signals.iter().map(|(_, signal)| *signal).filter(is_fault).collect();
    assert_eq!(faults, [Signal::FaultRaised(ChainFault::Bias), Signal::FaultCleared(ChainFault::Bias)]);
    assert!(one(&bench).flags.contains(Flags::BIAS_FAULT));
    assert_eq!(one(&bench).severity.verdict, Verdict::Inconclusive);
}

#[test]
fn lost_samples_are_said_and_void_the_impact() {
    for announced in [false, true] {
        let mut bench = settled(configuration(RATE));
        bench.run(0.22, &QUIET, blow(1.2));
        if announced {
            bench.sensor.overrun(Overrun { lost: 16 }).iter().for_each(|s| bench.signals.push((0, *s)));
        }
        bench.next += 16;
        bench.run(1.0, &QUIET, blow(1.2));
        let lost: Vec<_> = bench.signals.iter().filter(|(_, s)| matches!(s, Signal::Lost(_))).collect();
        assert!(matches!(lost[..], [(_, Signal::Lost(16))]), "{lost:?}");
        let event = one(&bench);
        assert!(event.flags.contains(Flags::LOST_SAMPLES));
        assert_ne!(event.severity.verdict, Verdict::Pass);
        // A later blow is clean: hum and time went on through the gap.
        bench.run(1.0, &QUIET, blow(bench.next as f64 / RATE + 0.3));
        assert_eq!(bench.events[1].flags, Flags::empty());
    }
}

#[test]
fn the_mass_is_latched_at_onset_and_its_age_judged() {
    for (age, stale) in [(0.05, false), (0.3, true)] {
        let mut bench = settled(configuration(RATE));
        bench.sensor.receive_effective_mass(Kilogram(9.0));
        bench.sensor.receive_effective_mass(Kilogram(f32::NAN));
        let at = 1.0 + age;
        bench.run(age + 0.01, &QUIET, blow(at));
        bench.sensor.receive_effective_mass(Kilogram(1.0));
        bench.run(1.0, &QUIET, blow(at));
        let event = one(&bench);
        assert_eq!(event.severity.effective_mass, Some(Kilogram(9.0)));
        let found = event.severity.effective_mass_age_ms.unwrap();
        assert!((f64::from(found) - age * 1e3).abs() < 2.0, "{found} ms");
        assert_eq!(event.flags.contains(Flags::STALE_MASS), stale);
        assert_eq!(event.severity.verdict, if stale { Verdict::Inconclusive } else { Verdict::Pass });
    }
    let event = struck(Configuration { effective_mass: None, ..configuration(RATE) });
    assert_eq!((event.flags, event.severity.scaling), (Flags::NO_MASS, 1.0));
}

#[test]
fn a_configuration_takes_effect_between_impacts() {
    let mut bench = settled(configuration(RATE));
    bench.run(0.21, &QUIET, blow(1.2));
    assert!(bench.sensor.impact_open());
    let mut next = synthetic::stamped(Configuration { region: None, ..configuration(RATE) });
    next.revision = 8;
    bench.sensor.configure(next);
    bench.run(1.0, &QUIET, blow(1.2));
    assert_eq!((one(&bench).configuration_revision, one(&bench).severity.verdict), (7, Verdict::Pass));
    bench.run(1.0, &QUIET, blow(bench.next as f64 / RATE + 0.3));
    assert_eq!((bench.events[1].configuration_revision, bench.events[1].severity.verdict), (8, Verdict::None));
}

#[test]
fn the_curve_holds_the_pre_trigger_and_the_pulse() {
    let mut bench = settled(configuration(RATE));
    bench.run(1.0, &QUIET, blow(1.2));
    let context = bench.contexts[0];
    let curve = bench.sensor.curve(&context);
    assert_eq!(curve.first_index() + 2048, context.onset.noticed_at);
    assert!(curve.len() > 2048 + 10_000 && curve.len() <= CAPTURE);
    let mut codes = vec![0; curve.len()];
    assert_eq!(curve.read(0, &mut codes), codes.len());
    let highest =
        codes.iter().max().map(|c| f64::from(*c) - 32_768.0).unwrap() * f64::from(bench.chain.newton_per_code);
    assert!((highest - 200.0).abs() < 3.0, "{highest} N");
    assert_eq!(bench.sensor.lost_curves(), LostCurves::default());
}

#[test]
fn an_overwritten_curve_is_an_event_that_says_so() {
    let mut bench = settled(configuration(RATE));
    bench.run(1.0, &QUIET, blow(1.2));
    let first = bench.contexts[0];
    bench.run(2.0, &QUIET, blow(2.5));
    let late = bench.sensor.evaluate(&first);
    assert_eq!(late.len(), 1);
    assert!(late[0].flags.contains(Flags::LOST_SAMPLES));
    assert_ne!(late[0].severity.verdict, Verdict::Pass);
}

#[test]
fn other_sample_rates_sense_the_same() {
    fn at<const N: usize>(rate: f64) {
        let mut bench = Bench::<N>::new(configuration(rate), 4);
        bench.run(3.0, &Disturbance { hum_hertz: 60.1, ..Disturbance::USUAL }, blow(2.0));
        assert_eq!(bench.events.len(), 1, "{rate}");
        let event = bench.events[0];
        let contact = event.contact_instant.seconds(Hertz(rate as f32));
        assert!((contact - 2.0).abs() < 60e-6, "{rate}: {contact}");
        assert!((event.raw_peak.0 - 200.0).abs() < 0.8, "{rate}: {}", event.raw_peak.0);
        assert!((f64::from(event.impulse.0) / HalfSine::of_duration(200.0, 0.03).impulse() - 1.0).abs() < 0.01);
    }
    at::<7_168>(10_000.0);
    at::<CAPTURE>(20_000.0);
    at::<20_000>(25_600.0);
    at::<40_000>(51_200.0);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Whatever the counts, the block sizes, the gaps and the bias: no panic, no NaN, and nothing void passes.
    #[test]
    fn any_counts_are_survived(
        seed: u64, pieces in prop::collection::vec((0u16.., 1u16..6000, 0u64..30_000, 0u8..4), 1..80), jump in 0u64..200,
    ) {
        let mut bench = Bench::<3_000>::new(configuration(2_000.0), seed);
        let mut state = seed | 1;
        for (level, length, gap, kind) in pieces {
            if kind == 3 {
                bench.next = (bench.next + gap).saturating_sub(jump);
            }
            let codes: Vec<u16> = (0..length)
                .map(|i| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    match kind {
                        0 => level,
                        1 => (state >> 48) as u16,
                        2 => level.wrapping_add(i),
                        _ => 32_768 + ((state >> 61) as u16),
                    }
                })
                .collect();
            for block in codes.chunks(8) {
                bench.push(block, if kind == 1 && gap % 3 == 0 { f32::NAN } else { 10.0 });
            }
        }
        for (index, event) in bench.events.iter().enumerate() {
            prop_assert_eq!(event.number as usize, index + 1);
            for value in [event.raw_peak.0, event.peak.0, event.impulse.0, event.duration.0, event.noise.0,
                          event.severity.scaled.0, event.contact_instant.fraction, event.peak_instant.fraction] {
                prop_assert!(value.is_finite(), "{event:?}");
            }
            prop_assert!(event.duration.0 >= 0.0);
            if event.flags.intersects(Flags::VOID) {
                prop_assert_ne!(event.severity.verdict, Verdict::Pass);
            }
        }
    }
}

#[test]
fn numbers_that_go_back_end_the_impact_and_start_over() {
    let mut bench = settled(configuration(RATE));
    bench.run(0.21, &QUIET, blow(1.2));
    bench.next = 0;
    let signals = bench.sensor.push(&[32_768; BLOCK], &BlockInfo { first_index: 0, bias: Volt(10.0) });
    assert!(signals.iter().any(|s| matches!(s, Signal::Over(c) if c.flags.contains(Flags::LOST_SAMPLES))));
    bench.next = 8;
    bench.run(1.0, &QUIET, |_| 0.0);
    assert!(bench.sensor.settled());
}

/// The board has 96 KiB for everything; two curves are 56 KiB of it.
#[test]
fn what_the_detector_knows_is_small() {
    let detector = size_of::<thud_firmware::detector::Detector<CAPTURE>>();
    let captures = size_of::<thud_firmware::capture::Captures<CAPTURE>>();
    assert!(captures < 2 * 2 * CAPTURE + 256, "captures take {captures} bytes");
    assert!(detector < 2048, "the detector takes {detector} bytes");
    assert!(size_of::<thud_firmware::detector::Signals>() < 4096);
}
