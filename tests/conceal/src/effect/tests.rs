//! Each effect does what it says: seen in the noise-free recordings, beside the same campaign without it.

use std::f64::consts::TAU;

use super::*;
use crate::case::traces;
use crate::motion::Trace;
use crate::plan::Wish;

/// A campaign without traces, offsets or repeatability; a soft pad, so that what the pad does can be seen.
fn bare(kind: Kind) -> Plan {
    let wish = Wish { kind, recordings: 4, long: false };
    let mut plan = (0..)
        .map(|seed| Plan::draw(&mut Draw::new(seed), &wish))
        .find(|p| kind == Kind::Fall || (p.pad_n_per_m < 1.1e5 && p.pad_n_per_m > 5e4 && p.rate_hz >= 1e4))
        .expect("a soft pad");
    let t = &mut plan.traces;
    (t.hum_n, t.drift_n_per_s, t.dashpot_n_s_per_m, t.friction_n) = (0.0, 0.0, 0.0, 0.0);
    (t.piece_kg, t.ring_damping, t.anti_alias_hz) = (5e-5, 0.2, 5e3);
    for r in &mut plan.recordings {
        (r.offset, r.spring_ln) = (0.0, 0.0);
    }
    plan
}

struct Seen {
    plan: Plan,
    with: Vec<Trace>,
    without: Vec<Trace>,
    parameters: Vec<Parameter>,
}

impl Seen {
    fn of(id: &str, scale: f64) -> Self {
        let effect = named(id).expect("an effect");
        let plan = bare(effect.kinds[0]);
        let touched = vec![true; plan.recordings.len()];
        let shaped = (effect.shape)(&mut Draw::new(77), &plan, &touched);
        let scale = if scale.is_nan() { shaped.typical } else { scale };
        let with = traces(&plan, &[(&shaped, scale)]);
        let without = traces(&plan, &[]);
        let parameters = (shaped.parameters)(scale);
        Self { plan, with, without, parameters }
    }

    fn parameter(&self, name: &str) -> f64 {
        self.parameters.iter().find(|p| p.name == name).expect("a parameter of this name").value
    }

    fn count(&self) -> usize {
        self.with.len()
    }

    /// Recordings, slowest first.
    fn by_speed(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.count()).collect();
        let speed = |i: &usize| self.plan.recordings[*i].speed_m_per_s;
        order.sort_by(|a, b| speed(a).total_cmp(&speed(b)));
        order
    }

    /// What the impulse at the cell says about the speed of rebound over that of approach.
    fn restitution(&self, i: usize) -> f64 {
        let r = &self.plan.recordings[i];
        impulse(&self.with[i], self.plan.rate_hz)
            / (self.plan.configurations[r.configuration].mass_kg * r.speed_m_per_s)
            - 1.0
    }

    fn peak_ratio(&self, i: usize) -> f64 {
        highest(&self.with[i]) / highest(&self.without[i])
    }

    fn touch_ratio(&self, i: usize) -> f64 {
        let contact = self.plan.recordings[i].sampling.contact_s;
        (self.with[i].separation_s - contact) / (self.without[i].separation_s - contact)
    }

    fn last(&self, i: usize) -> f64 {
        *self.with[i].readings.last().expect("samples")
    }
}

fn impulse(trace: &Trace, rate_hz: f64) -> f64 {
    trace.readings.iter().sum::<f64>() / rate_hz
}

fn highest(trace: &Trace) -> f64 {
    trace.readings.iter().copied().fold(f64::MIN, f64::max)
}

fn lowest(trace: &Trace) -> f64 {
    trace.readings.iter().copied().fold(f64::MAX, f64::min)
}

#[track_caller]
fn about(value: f64, expected: f64, relative: f64) {
    assert!((value / expected - 1.0).abs() < relative, "{value} instead of {expected}");
}

#[test]
fn at_scale_nought_nothing_changes_and_at_an_ordinary_one_something_does() {
    for effect in ALL {
        let seen = Seen::of(effect.id, f64::NAN);
        let changed = seen.with.iter().zip(&seen.without).any(|(a, b)| a.readings != b.readings);
        assert!(changed, "{} does nothing", effect.id);
        assert!(!seen.parameters.is_empty() && seen.parameters.iter().all(|p| p.value.is_finite()), "{}", effect.id);
        assert!(seen.with.iter().all(|t| t.readings.iter().all(|y| y.is_finite())), "{} runs away", effect.id);
        let none = Seen::of(effect.id, 0.0);
        assert!(none.with.iter().zip(&none.without).all(|(a, b)| a.readings == b.readings), "{}", effect.id);
    }
}

#[test]
fn hunt_crossley_loses_in_proportion_to_speed() {
    let seen = Seen::of("hunt-crossley-damping", 0.3);
    let order = seen.by_speed();
    let (slow, fast) = (order[0], order[3]);
    let loss = |i: usize| 1.0 - seen.restitution(i);
    let speeds = seen.plan.recordings[fast].speed_m_per_s / seen.plan.recordings[slow].speed_m_per_s;
    assert!(loss(slow) > 0.0);
    about(loss(fast) / loss(slow), speeds, 0.2);
}

#[test]
fn linear_losses_do_not_know_the_speed() {
    for id in ["viscous-damping", "pad-relaxation", "printed-part-creep"] {
        let seen = Seen::of(id, f64::NAN);
        // Of one mass, another speed: the same restitution.
        for a in 0..seen.count() {
            assert!(seen.restitution(a) < 0.999, "{id}: {}", seen.restitution(a));
            for b in 0..a {
                if seen.plan.recordings[a].configuration == seen.plan.recordings[b].configuration {
                    assert!((seen.restitution(a) - seen.restitution(b)).abs() < 2e-3, "{id}");
                }
            }
        }
    }
}

#[test]
fn air_costs_the_fast_more() {
    let seen = Seen::of("air-damping", 100.0);
    let order = seen.by_speed();
    assert!(1.0 - seen.restitution(order[3]) > 2.0 * (1.0 - seen.restitution(order[0])));
}

#[test]
fn a_pad_is_stiffer_when_hit_faster_and_when_new() {
    let seen = Seen::of("rate-stiffening", 0.1);
    let order = seen.by_speed();
    assert!(seen.touch_ratio(order[3]) < seen.touch_ratio(order[0]) - 0.005);
    let seen = Seen::of("mullins-softening", 0.5);
    assert!(seen.touch_ratio(0) < seen.touch_ratio(3) - 0.005);
    assert!(seen.touch_ratio(3) < 1.0);
}

#[test]
fn hardening_raises_the_highest_peaks_most() {
    let seen = Seen::of("hardening", 0.4);
    let order = seen.plan.by_peak();
    assert!(seen.peak_ratio(order[0]) > 1.005);
    assert!(seen.peak_ratio(order[0]) > seen.peak_ratio(order[3]));
}

#[test]
fn a_stop_is_met_by_long_strokes_only() {
    let seen = Seen::of("end-stop", 0.2);
    let at = seen.parameter("stroke");
    for i in 0..seen.count() {
        if seen.without[i].stroke_m < at {
            assert_eq!(seen.with[i].readings, seen.without[i].readings);
        }
    }
    let first = seen.plan.by_peak()[0];
    assert!(seen.peak_ratio(first) > 1.05 && seen.with[first].stroke_m < seen.without[first].stroke_m);
}

#[test]
fn loose_springs_take_longer() {
    let seen = Seen::of("clearance", 2e-4);
    assert!((0..seen.count()).all(|i| seen.touch_ratio(i) > 1.005));
}

#[test]
fn glue_pulls_at_the_end() {
    let seen = Seen::of("adhesion", 5.0);
    for i in 0..seen.count() {
        about(lowest(&seen.with[i]), -5.0, 0.2);
        assert!(lowest(&seen.without[i]) > -1.0);
    }
}

#[test]
fn friction_leaves_the_springs_a_little_pressed() {
    let seen = Seen::of("guide-friction", 3.0);
    for i in 0..seen.count() {
        about(seen.last(i), 3.0, 0.1);
    }
    let seen = Seen::of("stiction", 2.0);
    for i in 0..seen.count() {
        let breakaway = seen.parameter("breakaway_force");
        assert!(seen.last(i) > 1.5 && seen.last(i) < breakaway * 1.05, "{} of {breakaway}", seen.last(i));
    }
    // What goes with the load is gone with it.
    let seen = Seen::of("load-dependent-friction", 0.05);
    for i in 0..seen.count() {
        assert!(seen.last(i).abs() < 0.1);
        assert!(seen.peak_ratio(i) < 0.99);
    }
}

#[test]
fn a_heavy_piece_rings_on_the_springs_after_separation() {
    let seen = Seen::of("moving-piece-inertia", 0.1);
    let expected = (seen.plan.body_n_per_m / 0.1).sqrt() / TAU;
    let i = seen.by_speed()[3];
    let from = ((seen.with[i].separation_s + 0.002) * seen.plan.rate_hz) as usize;
    let tail = &seen.with[i].readings[from..];
    let ups: Vec<usize> = (1..tail.len()).filter(|j| tail[j - 1] < 0.0 && tail[*j] >= 0.0).collect();
    let cycles = (ups.len() - 1) as f64;
    let found = cycles * seen.plan.rate_hz / (ups[ups.len() - 1] - ups[0]) as f64;
    about(found, expected, 0.03);
}

#[test]
fn a_frame_on_feet_is_softer() {
    let seen = Seen::of("frame-compliance", 10.0);
    assert!((0..seen.count()).all(|i| seen.touch_ratio(i) > 1.002));
}

#[test]
fn mass_behind_a_joint_comes_later() {
    let seen = Seen::of("joint-elasticity", 0.4);
    assert!((0..seen.count()).all(|i| seen.peak_ratio(i) < 0.98));
}

#[test]
fn a_swaying_link_arrives_faster_or_slower() {
    let seen = Seen::of("link-oscillation", 2e-3);
    let ratios: Vec<f64> = (0..seen.count()).map(|i| seen.peak_ratio(i)).collect();
    let (low, high) = (ratios.iter().copied().fold(f64::MAX, f64::min), ratios.iter().copied().fold(0.0, f64::max));
    assert!(high - low > 0.05, "{ratios:?}");
}

#[test]
fn a_pushing_drive_adds_impulse_and_a_reaction_takes_it() {
    let seen = Seen::of("robot-push", 20.0);
    assert!((0..seen.count()).all(|i| seen.restitution(i) > 1.01));
    let seen = Seen::of("collision-reaction", 40.0);
    let (threshold, delay) = (seen.parameter("threshold"), seen.parameter("delay"));
    let mut reached = 0;
    for i in 0..seen.count() {
        let noticed = seen.without[i].readings.iter().position(|y| *y > threshold * 0.9);
        let Some(noticed) = noticed else {
            assert_eq!(seen.with[i].readings, seen.without[i].readings);
            continue;
        };
        reached += 1;
        let quiet = noticed + ((delay - 0.001).max(0.0) * seen.plan.rate_hz) as usize;
        assert_eq!(seen.with[i].readings[..quiet], seen.without[i].readings[..quiet]);
        assert!(seen.restitution(i) < 0.99 || seen.with[i].readings != seen.without[i].readings);
    }
    assert!(reached > 0);
}

#[test]
fn an_arm_that_gives_way_holds_the_force_down() {
    let seen = Seen::of("force-ceiling", 0.2);
    let ceiling = seen.parameter("force");
    for i in 0..seen.count() {
        assert!(highest(&seen.with[i]) < 1.03 * ceiling);
        if highest(&seen.without[i]) < 0.97 * ceiling {
            assert_eq!(seen.with[i].readings, seen.without[i].readings);
        }
    }
}

#[test]
fn wrong_numbers_are_just_that() {
    let seen = Seen::of("pose-dependent-mass", 0.2);
    let ratio = seen.parameter("mass_ratio");
    let changed: Vec<usize> = (0..seen.count()).filter(|i| (seen.touch_ratio(*i) - 1.0).abs() > 1e-4).collect();
    assert!(!changed.is_empty() && changed.len() < seen.count());
    for i in changed {
        about(seen.touch_ratio(i), ratio.sqrt(), 2e-3);
    }
    let seen = Seen::of("speed-error", 0.1);
    let error = seen.parameter("relative_error");
    assert!((0..seen.count()).all(|i| (seen.peak_ratio(i) - 1.0 - error).abs() < 3e-3));
    let seen = Seen::of("gain-error", 0.05);
    let gain = seen.parameter("gain");
    assert!((0..seen.count()).all(|i| (seen.peak_ratio(i) - gain).abs() < 1e-9));
}

#[test]
fn the_chain_does_to_the_signal_what_chains_do() {
    let seen = Seen::of("piezo-discharge", 1.0);
    for i in 0..seen.count() {
        // A leaking charge undershoots by the impulse over the time constant.
        let end = seen.without[i].separation_s + 0.01;
        let under = seen.with[i].readings[(end * seen.plan.rate_hz) as usize];
        about(under, -impulse(&seen.without[i], seen.plan.rate_hz), 0.1);
    }
    let seen = Seen::of("charge-drift", 2.0);
    let slope = seen.parameter("slope");
    let t = (seen.with[0].readings.len() - 1) as f64 / seen.plan.rate_hz;
    about(seen.last(0) - seen.without[0].readings[seen.with[0].readings.len() - 1], slope * t, 1e-6);
    let seen = Seen::of("clipping", 0.2);
    let first = seen.plan.by_peak()[0];
    let level = seen.parameter("level");
    assert!(seen.with[first].readings.iter().filter(|y| **y == level).count() > 10);
    assert_eq!(highest(&seen.with[first]), level);
    let seen = Seen::of("filter-lag", 1.0 / (TAU * 100.0));
    let centre = |t: &Trace| {
        let sum: f64 = t.readings.iter().sum();
        t.readings.iter().enumerate().map(|(i, y)| i as f64 * y).sum::<f64>() / sum / seen.plan.rate_hz
    };
    // A Butterworth filter of second order delays by √2/(2π·f).
    about(centre(&seen.with[0]) - centre(&seen.without[0]), std::f64::consts::SQRT_2 / (TAU * 100.0), 0.03);
    let seen = Seen::of("mains-hum", 0.5);
    let hz = seen.parameter("frequency");
    let (mut s, mut c) = (0.0, 0.0);
    // Whole periods of the line.
    let periods = (seen.with[0].readings.len() as f64 / seen.plan.rate_hz * hz).floor();
    let n = (periods / hz * seen.plan.rate_hz).round() as usize;
    for j in 0..n {
        let turn = TAU * hz * j as f64 / seen.plan.rate_hz;
        let y = seen.with[0].readings[j] - seen.without[0].readings[j];
        s += y * turn.sin();
        c += y * turn.cos();
    }
    about(f64::hypot(s, c) * 2.0 / n as f64, 0.5, 0.02);
}

#[test]
fn lost_samples_are_gone_and_what_follows_moves_up() {
    let seen = Seen::of("lost-samples", 1e-3);
    let total = seen.parameter("lost_samples");
    assert!(total > 0.0);
    let mut found = 0;
    for i in 0..seen.count() {
        let (with, without) = (&seen.with[i].readings, &seen.without[i].readings);
        assert_eq!(with.len(), without.len());
        let Some(at) = with.iter().zip(without).position(|(a, b)| a != b) else { continue };
        let lost = (1..200).find(|n| with[at] == without[at + n]).expect("the rest moved up");
        assert!((0..200).all(|j| with[at + j] == without[at + j + lost]));
        found += lost;
    }
    assert_eq!(found as f64, total);
}

#[test]
fn drag_holds_a_falling_body() {
    let seen = Seen::of("air-drag", 1e-4);
    for i in 0..seen.count() {
        let r = &seen.plan.recordings[i];
        let mass = seen.plan.configurations[r.configuration].mass_kg;
        let drag = seen.parameter(&format!("drag_of_configuration_{}", r.configuration + 1));
        let last = r.sampling.samples - 1;
        let t = last as f64 / seen.plan.rate_hz - r.sampling.contact_s;
        // To first order in the drag, ∫∫ c·(g·t)²/m = c·g²·t⁴/(12·m).
        let expected = drag / mass * 9.80665f64.powi(2) * t.powi(4) / 12.0;
        about(seen.with[i].readings[last] - seen.without[i].readings[last], expected, 0.15);
    }
}
