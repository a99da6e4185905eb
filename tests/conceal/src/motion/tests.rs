//! Against closed forms.

use super::*;
use crate::baseline::Baseline;
use crate::draw::Draw;
use crate::plan::{Plan, Wish};
use crate::readout::anti_alias_delay_s;

/// A plan without any trace: a hair for a piece, and a filter far above the pulse.
fn bare(kind: Kind, seed: u64) -> Plan {
    let mut plan = Plan::draw(&mut Draw::new(seed), &Wish { kind, recordings: 4, long: false });
    let t = &mut plan.traces;
    (t.hum_n, t.drift_n_per_s, t.dashpot_n_s_per_m, t.friction_n) = (0.0, 0.0, 0.0, 0.0);
    (t.piece_kg, t.ring_damping, t.anti_alias_hz) = (1e-5, 0.3, 5e4);
    plan
}

/// Largest difference from the closed form over its peak; the crown of the pad delays the contact by half of it.
fn worst(plan: &Plan, index: usize, until_s: f64) -> f64 {
    let world = plan.world(index);
    let sampling = plan.recordings[index].sampling;
    let trace = run(&world, &sampling);
    let baseline: Baseline = plan.true_baseline(index);
    let delay = anti_alias_delay_s(plan.traces.anti_alias_hz) + 0.5 * world.pad.crown_m / world.speed_m_per_s;
    let sampler = baseline.sampler();
    let model = |i: usize| sampler(i as f64 / sampling.rate_hz - sampling.contact_s - delay).value;
    let count = (((sampling.contact_s + until_s) * sampling.rate_hz) as usize).min(trace.readings.len());
    (0..count).map(|i| (trace.readings[i] - model(i)).abs()).fold(0.0, f64::max) / baseline.peak_n()
}

#[test]
fn without_effects_an_impact_is_a_half_sine() {
    for seed in 0..4 {
        let plan = bare(Kind::Impact, seed);
        for index in 0..2 {
            let error = worst(&plan, index, f64::INFINITY);
            assert!(error < 1e-3, "seed {seed}: {error}");
            let trace = run(&plan.world(index), &plan.recordings[index].sampling);
            let peak = trace.peak_n / plan.true_baseline(index).peak_n() - 1.0;
            assert!(peak.abs() < 1e-3, "seed {seed}: the peak is off by {peak}");
        }
    }
}

#[test]
fn a_fallen_mass_presses_with_its_weight_and_comes_back() {
    let plan = bare(Kind::Drop, 3);
    for index in 0..2 {
        let error = worst(&plan, index, plan.true_baseline(index).touch_s() * 1.2);
        assert!(error < 1e-2, "{error}");
    }
    // Left long enough it touches again, 2·v/g after it left.
    let baseline = plan.true_baseline(0);
    let flight = 2.0 * baseline.speed_m_per_s / baseline.gravity_m_per_s2;
    let rate_hz = plan.rate_hz;
    let sampling =
        Sampling { rate_hz, contact_s: 0.03, samples: ((0.03 + 1.5 * baseline.touch_s() + flight) * rate_hz) as usize };
    let trace = run(&plan.world(0), &sampling);
    let again = 0.03 + baseline.touch_s() + flight;
    let at = |t: f64| trace.readings[(t * rate_hz) as usize];
    assert!(at(again - 0.3 * flight).abs() < 1e-2 * baseline.peak_n());
    assert!(at(again + 0.45 * baseline.touch_s()) > 0.95 * baseline.peak_n());
}

#[test]
fn energy_is_kept_where_nothing_takes_it() {
    let plan = bare(Kind::Impact, 1);
    let trace = run(&plan.world(0), &plan.recordings[0].sampling);
    let impulse: f64 = trace.readings.iter().sum::<f64>() / plan.rate_hz;
    let r = &plan.recordings[0];
    let mass = plan.configurations[r.configuration].mass_kg;
    let restitution = impulse / (mass * r.speed_m_per_s) - 1.0;
    assert!((restitution - 1.0).abs() < 2e-3, "{restitution}");
}

#[test]
fn halving_the_sampling_changes_nothing_but_the_sampling() {
    // Other samples a second, other steps: the same motion.
    let plan = bare(Kind::Impact, 2);
    let sampling = plan.recordings[0].sampling;
    let finer = Sampling { rate_hz: sampling.rate_hz * 2.0, samples: sampling.samples * 2, ..sampling };
    let (coarse, fine) = (run(&plan.world(0), &sampling), run(&plan.world(0), &finer));
    let worst = (0..sampling.samples).map(|i| (coarse.readings[i] - fine.readings[2 * i]).abs()).fold(0.0, f64::max);
    assert!(worst < 2e-3 * coarse.peak_n, "{worst} of {}", coarse.peak_n);
}

#[test]
fn a_free_fall_is_a_parabola() {
    let mut plan = bare(Kind::Fall, 5);
    plan.recordings[0].speed_m_per_s = 0.01;
    let sampling = plan.recordings[0].sampling;
    let trace = run(&plan.world(0), &sampling);
    let tau = (sampling.samples - 1) as f64 / sampling.rate_hz - sampling.contact_s;
    let expected = -0.01 * tau - 0.5 * 9.80665 * tau * tau;
    let last = trace.readings[sampling.samples - 1];
    assert!((last - expected).abs() < 1e-9, "{last} instead of {expected}");
}

/// Step of the massless piece's motion.
const STEP_S: f64 = 1e-7;

/// How a piece without mass moves: force on the robot and rate of the piece from the stiffness behind it, the positions of robot
/// and piece, and the robot's speed.
type Law = fn(&World, f64, (f64, f64, f64)) -> (f64, f64);

/// Pad a spring beside a dashpot: k·u = k_p·(x − u) + c·(v − u̇).
fn behind_a_dashpot(world: &World, k: f64, (x, u, v): (f64, f64, f64)) -> (f64, f64) {
    let force = k * u;
    (force, v - (force - world.pad.stiffness_n_per_m * (x - u)) / world.pad.dashpot_n_s_per_m)
}

/// Air behind the piece: k_p·(x − u) = k·u + c·u̇·|u̇|; the cell feels springs and air.
fn in_air(world: &World, k: f64, (x, u, _): (f64, f64, f64)) -> (f64, f64) {
    let force = world.pad.stiffness_n_per_m * (x - u);
    let air = force - k * u;
    (force, (air.abs() / world.spring.air_n_s2_per_m2).sqrt().copysign(air))
}

/// The force, step by step until some time after contact.
fn without_mass(world: &World, baseline: &Baseline, law: Law, until_s: f64) -> Vec<f64> {
    let k = 1.0 / (1.0 / world.spring.stiffness_n_per_m + 1.0 / world.chain.cell_n_per_m);
    let (mut x, mut v, mut u) = (0.0, baseline.speed_m_per_s, 0.0);
    (0..(until_s / STEP_S) as usize)
        .map(|_| {
            let (force, rate) = law(world, k, (x, u, v));
            u += STEP_S * rate;
            v -= STEP_S * force / world.mass_kg;
            x += STEP_S * v;
            force
        })
        .collect()
}

#[test]
fn a_light_piece_does_not_chatter() {
    struct Row {
        law: Law,
        recordings: usize,
        /// What the plan of a case has.
        planned: fn(&mut Plan),
        /// What the world of a recording has.
        built: fn(&mut World),
        /// The largest difference, relative to the peak.
        within: f64,
    }
    let rows = [
        Row {
            law: behind_a_dashpot,
            recordings: 2,
            planned: |plan| plan.traces.dashpot_n_s_per_m = 80.0,
            built: |_| (),
            within: 1.5e-3,
        },
        Row {
            law: in_air,
            recordings: 4,
            planned: |plan| (plan.traces.piece_kg, plan.traces.ring_damping) = (3e-5, 0.03),
            built: |world| world.spring.air_n_s2_per_m2 = 90.0,
            within: 2e-3,
        },
    ];
    for (row, seed) in rows.iter().flat_map(|row| (0..6).map(move |seed| (row, seed))) {
        let mut plan = bare(Kind::Impact, seed);
        (row.planned)(&mut plan);
        for index in 0..row.recordings {
            let mut world = plan.world(index);
            (row.built)(&mut world);
            let sampling = plan.recordings[index].sampling;
            let baseline = plan.true_baseline(index);
            let trace = run(&world, &sampling);
            let delay = anti_alias_delay_s(plan.traces.anti_alias_hz) + 0.5 * world.pad.crown_m / world.speed_m_per_s;
            let until_s = 0.97 * baseline.touch_s();
            let expected = without_mass(&world, &baseline, row.law, until_s);
            for (number, reading) in trace.readings.iter().enumerate() {
                let since = number as f64 / sampling.rate_hz - sampling.contact_s - delay;
                if since > 1e-3 && since < until_s - 1e-3 {
                    let off = (reading - expected[(since / STEP_S) as usize]).abs() / trace.peak_n;
                    assert!(off < row.within, "seed {seed}, recording {index}: {off} at {since} s");
                }
            }
        }
    }
}
