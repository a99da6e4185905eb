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

/// A blow of 200 N at each instant, after each of which friction holds a rest: the springs push either more than that or just that.
fn blows_with_rest(at: Vec<f64>, rest: f64) -> impl Fn(f64) -> f64 {
    move |t| {
        let blow: f64 = at.iter().map(|at| blow(*at)(t)).fold(0.0, f64::max);
        // Behind the top of the first blow the rest is the least.
        if t > at[0] + 0.015 { blow.max(rest) } else { blow }
    }
}

/// Contact, peak, separation and impulse of a blow of 200 N that rises from the one rest and comes back to the other.
fn assert_blow(event: &Event, at: f64, (before, after): (f64, f64)) {
    let pulse = HalfSine::of_duration(200.0, 0.03);
    let reaches = |rest: f64| (rest / 200.0).asin() / pulse.omega;
    let contact = event.contact_instant.seconds(Hertz(RATE as f32));
    let (begins, ends) = (at + reaches(before), at + 0.03 - reaches(after));
    assert!((contact - begins).abs() < 50e-6, "contact at {contact} s, truly {begins} s");
    let separation = contact + f64::from(event.duration.0);
    assert!((separation - ends).abs() < 100e-6, "separation at {separation} s, truly {ends} s");
    assert!((event.raw_peak.0 - 200.0).abs() < 0.5, "{} N", event.raw_peak.0);
    assert!((event.peak.0 - 200.0).abs() < 0.5, "{} N", event.peak.0);
    let impulse = f64::from(event.impulse.0) / pulse.impulse();
    assert!((impulse - 1.0).abs() < 0.01, "{impulse} of the impulse");
    let expected = if before > 0.0 || after > 0.0 { Flags::REST } else { Flags::empty() };
    assert_eq!(event.flags - Flags::REBOUND, expected, "blow at {at} s");
    assert_eq!(event.severity.verdict, Verdict::Pass);
}

#[test]
fn what_friction_holds_after_a_blow_is_no_contact() {
    for rest in [1.2, 4.0, 9.5] {
        let mut bench = settled(configuration(RATE));
        bench.run(0.72, &QUIET, blows_with_rest(vec![1.2], rest));
        assert!(!bench.sensor.impact_open(), "{rest} N: over 0.5 s after the contact");
        assert!(bench.sensor.settled(), "{rest} N: and ready to judge");
        assert_blow(&one(&bench), 1.2, (0.0, rest));
        assert!((f64::from(bench.contexts[0].rest_after.0) - rest).abs() < 0.1, "{:?}", bench.contexts[0].rest_after);
        // Minutes with hum and drift on that rest, and it is still known.
        let drifting = Disturbance { hum_amplitude: 0.5, hum_hertz: 50.1, drift: 0.014, ..QUIET };
        let began = bench.next as f64 / RATE;
        let disturbance = Disturbance { offset: -drifting.drift * began, ..drifting };
        bench.run(180.0, &disturbance, |_| rest);
        assert_eq!(bench.onsets.len(), 1, "{rest} N: {:?}", bench.onsets);
        let next = bench.next as f64 / RATE + 0.3;
        bench.run(1.2, &disturbance, |t| blow(next)(t).max(rest));
        assert_blow(&bench.events[1], next, (rest, rest));
    }
}

/// Within the transient window of the first, right where it ends, and after it.
#[test]
fn blows_on_a_rest_are_events_of_their_own() {
    for pause in [0.12, 0.3, 0.499, 0.5, 0.5005, 0.51, 0.6, 0.9, 1.0] {
        for rest in [0.0, 4.0] {
            let at: Vec<f64> = (0..5).map(|number| 1.2 + pause * f64::from(number)).collect();
            let mut bench = settled(configuration(RATE));
            bench.run(0.8 + 5.0 * pause, &QUIET, blows_with_rest(at.clone(), rest));
            assert_eq!(bench.events.len(), 5, "{pause} s, {rest} N: {:#?}", bench.events);
            let mut first = 0.0;
            for (index, (event, at)) in bench.events.iter().zip(at).enumerate() {
                let before = if index == 0 { 0.0 } else { rest };
                if event.contact == 0 {
                    first = at;
                }
                // What lasts beyond the transient window is held, and judged so.
                if at + 0.03 > first + 0.5 && event.contact > 0 {
                    assert!(event.flags.contains(Flags::HELD), "{pause} s, {rest} N, blow {index}");
                    assert!((event.raw_peak.0 - 200.0).abs() < 0.5);
                } else {
                    assert_blow(event, at, (before, rest));
                }
            }
        }
    }
}

#[test]
fn a_weak_blow_on_a_rest_comes_back_to_it() {
    let mut bench = settled(configuration(RATE));
    let tap = |t: f64| 4.0 + HalfSine::of_duration(3.0, 0.03).at(t - 2.4);
    bench.run(2.5, &QUIET, |t| if t > 1.215 { tap(t).max(blow(1.2)(t)) } else { blow(1.2)(t) });
    assert_eq!(bench.events.len(), 2, "{:?}", bench.events);
    assert!((bench.events[1].raw_peak.0 - 7.0).abs() < 0.5, "{}", bench.events[1].raw_peak.0);
    assert!(!bench.sensor.impact_open());
}

/// Friction may hold the piece on either side of where it would rest without.
#[test]
fn a_rest_that_pulls_is_one_too() {
    let mut bench = settled(configuration(RATE));
    let force = |t: f64| if t > 1.23 { -4.0 } else { blow(1.2)(t) };
    bench.run(1.5, &QUIET, force);
    bench.run(1.0, &QUIET, |t| -4.0 + HalfSine::of_duration(204.0, 0.03).at(t - 2.8));
    assert_eq!(bench.events.len(), 2, "{:?}", bench.events);
    assert!((bench.events[1].raw_peak.0 - 200.0).abs() < 0.5, "{}", bench.events[1].raw_peak.0);
    assert!((bench.events[1].contact_instant.seconds(Hertz(RATE as f32)) - 2.8).abs() < 50e-6);
    // It leaves: a rise by 4 N that is no onset, because it ends at no force.
    bench.run(1.0, &QUIET, |t| if t > 4.0 { 0.0 } else { -4.0 });
    bench.run(2.0, &QUIET, |t| if t > 4.0 { 0.0 } else { -4.0 });
    assert_eq!(bench.onsets.len(), 2, "{:?}", bench.onsets);
    bench.run(1.0, &QUIET, blow(6.8));
    assert_blow(&bench.events[2], 6.8, (0.0, 0.0));
}

#[test]
fn a_rest_that_leaves_raises_no_onset_and_the_true_zero_is_back() {
    // Taken back at once, within 0.2 s, and slowly; soon after the blow and later.
    for (leaves, over) in [(1.75, 0.001), (2.5, 0.001), (2.5, 0.2), (2.5, 2.0), (1.9, 1.0)] {
        let rest = move |t: f64| 4.0 * (1.0 - (t - leaves) / over).clamp(0.0, 1.0);
        let mut bench = settled(configuration(RATE));
        bench.run(5.0, &QUIET, |t| if t > 1.215 { blow(1.2)(t).max(rest(t)) } else { blow(1.2)(t) });
        assert_eq!(bench.onsets.len(), 1, "{leaves} s, over {over} s: {:?}", bench.onsets);
        bench.run(1.0, &QUIET, blow(6.3));
        let event = bench.events[1];
        println!("leaves at {leaves} over {over}: {} N {:?}", event.raw_peak.0, event.flags);
        assert!((event.raw_peak.0 - 200.0).abs() < 1.0, "{leaves} s, over {over} s: {} N", event.raw_peak.0);
        assert!(!event.flags.intersects(Flags::VOID), "{:?}", event.flags);
        if over < 0.5 {
            assert_blow(&event, 6.3, (0.0, 0.0));
        }
    }
}

#[test]
fn a_piece_that_swings_on_a_rest_is_no_rebound() {
    for (newton, decay) in [(40.0, 0.14), (20.0, 0.05), (60.0, 0.1)] {
        let mut bench = settled(configuration(RATE));
        let swing = |u: f64| -newton * (-u / decay).exp() * (std::f64::consts::TAU * 56.0 * u).sin();
        let force = |t: f64| if t > 1.2294 { 4.0 + swing(t - 1.2294) } else { blow(1.2)(t) };
        bench.run(2.5, &QUIET, force);
        let event = one(&bench);
        assert!((event.raw_peak.0 - 200.0).abs() < 1.0);
        assert!(event.flags.contains(Flags::REST), "{:?}", event.flags);
        assert_eq!(bench.onsets.len(), 1, "{newton} N: {:?}", bench.onsets);
        bench.run(1.0, &QUIET, |t| blow(3.8)(t).max(4.0));
        assert_blow(&bench.events[1], 3.8, (4.0, 4.0));
    }
}

#[test]
fn hum_does_not_hide_a_rest() {
    for hum_hertz in [49.9, 50.0, 60.1] {
        let humming = Disturbance { hum_amplitude: 1.0, hum_hertz, ..QUIET };
        let mut bench = Usual::new(configuration(RATE), 3);
        bench.run(2.0, &humming, |_| 0.0);
        let at: Vec<f64> = (0..4).map(|number| 2.2 + 0.8 * f64::from(number)).collect();
        bench.run(4.0, &humming, blows_with_rest(at.clone(), 4.0));
        assert_eq!(bench.events.len(), 4, "{hum_hertz} Hz: {:?}", bench.events);
        for (index, (event, at)) in bench.events.iter().zip(at).enumerate() {
            assert_blow(event, at, (if index == 0 { 0.0 } else { 4.0 }, 4.0));
        }
        assert_eq!(bench.onsets.len(), 4);
    }
}

/// A rest must not hide what a robot does next: a slow push from it is an impact with all of its force.
#[test]
fn a_slow_push_from_a_rest_is_an_impact_with_its_quasi_static_force() {
    let mut bench = settled(Configuration { contact: ContactKind::Clamped, ..configuration(RATE) });
    let push = |t: f64| if (2.3..6.0).contains(&t) { (150.0 * (t - 2.3)).clamp(4.0, 150.0) } else { 4.0 };
    bench.run(7.0, &QUIET, |t| if t > 1.215 { blow(1.2)(t).max(push(t)) } else { blow(1.2)(t) });
    assert_eq!(bench.events.len(), 2, "{:?}", bench.events);
    let event = bench.events[1];
    assert_eq!(event.flags, Flags::HELD | Flags::REST);
    assert!((event.severity.quasi_static.unwrap().0 - 150.0).abs() < 0.5, "{:?}", event.severity.quasi_static);
    assert_eq!(event.severity.verdict, Verdict::Fail, "150 N are more than a chest bears for long");
    let impulse = 75.0 + 150.0 * 2.7;
    assert!((f64::from(event.impulse.0) / impulse - 1.0).abs() < 0.01, "{} N·s of {impulse}", event.impulse.0);
    assert!((event.duration.0 - 3.7).abs() < 0.05, "{}", event.duration.0);
    assert!(!bench.sensor.impact_open(), "over soon after the push");
}

/// Slowly enough to be taken for a rest at first: it becomes an onset as soon as it has grown by the threshold.
#[test]
fn a_force_that_grows_after_a_blow_is_not_hidden() {
    for (newton_per_second, most) in [(3.0, 25.0), (8.0, 60.0), (20.0, 60.0)] {
        let mut bench = settled(Configuration { contact: ContactKind::Clamped, ..configuration(RATE) });
        let grows = |t: f64| (newton_per_second * (t - 1.25)).clamp(0.0, most);
        bench.run(most / newton_per_second + 1.5, &QUIET, |t| blow(1.2)(t) + grows(t));
        bench.run(1.5, &QUIET, |_| 0.0);
        let held: Vec<_> = bench.events.iter().filter(|event| event.flags.contains(Flags::HELD)).collect();
        let [event] = held[..] else { panic!("{newton_per_second} N/s: {:?}", bench.events) };
        let quasi_static = f64::from(event.severity.quasi_static.unwrap().0);
        // Before it is an onset it may be taken for a drift, at the limit of what is followed.
        let drift = f64::from(thud_firmware::idle::ZERO_RATE_LIMIT) * f64::from(event.duration.0);
        assert!((quasi_static - most).abs() < 0.7 + drift, "{newton_per_second} N/s: {quasi_static} N of {most} N");
    }
}

/// What a robot goes on pressing with is no rest, even where it swings in between.
#[test]
fn a_clamp_stays_an_open_impact() {
    for newtons in [11.0, 25.0, 100.0] {
        let mut bench = settled(Configuration { contact: ContactKind::Clamped, ..configuration(RATE) });
        let press = |t: f64| -> f64 { if (1.22..4.0).contains(&t) { newtons } else { 0.0 } };
        bench.run(2.0, &QUIET, |t| press(t).max(blow(1.2)(t)));
        assert!(bench.sensor.impact_open(), "{newtons} N");
        bench.run(2.0, &QUIET, |t| press(t).max(blow(1.2)(t)));
        let event = one(&bench);
        assert_eq!(event.flags, Flags::HELD);
        assert!((f64::from(event.severity.quasi_static.unwrap().0) - newtons).abs() < 0.3);
    }
}

#[test]
fn what_leans_and_leaves_a_rest_re_arms() {
    let mut bench = settled(configuration(RATE));
    bench.run(14.0, &QUIET, |t| {
        if (2.0..13.5).contains(&t) {
            50.0
        } else if t > 2.0 {
            4.0
        } else {
            0.0
        }
    });
    bench.run(2.0, &QUIET, |t| blow(15.2)(t).max(4.0));
    assert_eq!(bench.onsets.len(), 2);
    assert_blow(&bench.events[1], 15.2, (4.0, 4.0));
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
