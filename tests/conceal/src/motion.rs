//! The bodies in motion: link, tip, piece and frame, stepped by position Verlet with implicit dampers.
//!
//! ```text
//!  x½ = x + h/2·v          (M + h·C)·v' = M·v + h·F(x½)          x' = x½ + h/2·v'
//! ```
//!
//! C couples neighbours only, so the middle line is a tridiagonal system of four. Steps are a few microseconds and never
//! change within a recording; there is no event location: contact, stops and slip are resolved by the steps themselves.

use std::f64::consts::TAU;

use crate::bristle::Bristles;
use crate::contact::Contact;
use crate::readout::Readout;
use crate::world::{Kind, World};

/// When a recording samples.
#[derive(Debug, Clone, Copy)]
pub struct Sampling {
    /// Samples a second.
    pub rate_hz: f64,
    /// How many.
    pub samples: usize,
    /// First touch (or release) after the first sample, s.
    pub contact_s: f64,
}

/// What an ideal converter would have read, and when things happened.
#[derive(Debug, Clone)]
pub struct Trace {
    /// Readings before saturation, noise and quantisation, in the channel's unit.
    pub readings: Vec<f64>,
    /// Instant of the highest force at the cell, s in the recording.
    pub peak_s: f64,
    /// Instant at which the pad lets go for the first time, s in the recording; the end where it never does.
    pub separation_s: f64,
    /// Highest force at the cell, N.
    pub peak_n: f64,
    /// Largest stroke of the springs, m.
    pub stroke_m: f64,
}

/// Longest step, s.
const LONGEST_STEP_S: f64 = 4e-6;

/// Runs one recording.
#[must_use]
pub fn run(world: &World, sampling: &Sampling) -> Trace {
    let lost: usize = world.chain.lost.iter().map(|(_, count)| count).sum();
    let wanted = Sampling { samples: sampling.samples + lost, ..*sampling };
    let mut trace = if world.kind == Kind::Fall { fall(world, &wanted) } else { collide(world, &wanted) };
    let chain = &world.chain;
    for (index, reading) in trace.readings.iter_mut().enumerate() {
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let t = index as f64 / sampling.rate_hz;
        let [amplitude, hz, phase, third] = chain.hum;
        let turn = TAU * hz * t + phase;
        *reading += chain.drift_n_per_s * t + amplitude * (turn.sin() + third * (3.0 * turn).sin());
    }
    for &(index, count) in chain.lost.iter().rev() {
        let from = index.min(trace.readings.len());
        let to = (index + count).min(trace.readings.len());
        trace.readings.drain(from..to);
    }
    trace.readings.truncate(sampling.samples);
    trace
}

/// A body falls from rest (or was thrown): the height over where it was released.
#[expect(clippy::cast_precision_loss, reason = "indices are far below 2^53")]
fn fall(world: &World, sampling: &Sampling) -> Trace {
    const STEPS: usize = 16;
    let mut readings = Vec::with_capacity(sampling.samples);
    let (mut height, mut speed) = (0.0, world.speed_m_per_s);
    let mut at = sampling.contact_s;
    for index in 0..sampling.samples {
        let t = index as f64 / sampling.rate_hz;
        if t > at {
            let h = (t - at) / STEPS as f64;
            for step in 0..STEPS {
                let flight = at - sampling.contact_s + (step as f64 + 0.5) * h;
                // Midpoint, the drag implicit in the new speed.
                let drag = world.drag_n_s2_per_m2 * speed.abs() / world.mass_kg;
                let pull = world.gravity_m_per_s2 - world.spin_m_per_s3 * flight;
                let next = (speed * (1.0 - 0.5 * h * drag) + h * pull) / (1.0 + 0.5 * h * drag);
                height -= 0.5 * h * (speed + next);
                speed = next;
            }
            at = t;
        }
        readings.push(height);
    }
    let end = sampling.samples as f64 / sampling.rate_hz;
    Trace { readings, peak_s: end, separation_s: end, peak_n: 0.0, stroke_m: 0.0 }
}

/// Solves the tridiagonal system with dampers (times the step) between neighbours; the last one is to the ground.
fn shared_speeds(mass: &[f64; 4], dampers: &[f64; 4], rhs: &[f64; 4]) -> [f64; 4] {
    let d = dampers;
    let mut diagonal = [mass[0] + d[0], mass[1] + d[0] + d[1], mass[2] + d[1] + d[2], mass[3] + d[2] + d[3]];
    let mut right = *rhs;
    for row in 1..4 {
        let factor = -d[row - 1] / diagonal[row - 1];
        diagonal[row] += factor * d[row - 1];
        right[row] -= factor * right[row - 1];
    }
    let mut speed = [0.0; 4];
    speed[3] = right[3] / diagonal[3];
    for row in (0..3).rev() {
        speed[row] = (right[row] + d[row] * speed[row + 1]) / diagonal[row];
    }
    speed
}

/// A robot or a falling mass meets the rig.
#[expect(clippy::too_many_lines, reason = "one step of one system, read from top to bottom")]
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "small counts"
)]
fn collide(world: &World, sampling: &Sampling) -> Trace {
    const FIXED_KG: f64 = 1e15;
    let World { robot, pad, spring, chain, .. } = world;
    // The cell is a spring in series with the body springs, too stiff to have a life of its own here.
    let k = 1.0 / (1.0 / spring.stiffness_n_per_m + 1.0 / chain.cell_n_per_m);
    let piece_kg = world.piece.mass_kg;
    let side = pad.stiffness_n_per_m + k + pad.branches.iter().map(|b| b.0).sum::<f64>();
    let guide = &world.guide;
    let bristles = guide.breakaway_n.max(guide.sliding_n) / guide.presliding_m;
    // Verlet is stable up to h·ω = 2. A ring faster than this resolves is far above the anti-alias filter.
    let ring = ((side + bristles) / piece_kg).sqrt();
    let longest = LONGEST_STEP_S.min(0.8 / ring);
    let per_sample = (1.0 / (sampling.rate_hz * longest)).ceil();
    let h = 1.0 / (sampling.rate_hz * per_sample);
    let per_sample = per_sample as usize;

    let joint = robot.joint;
    let share = joint.map_or(0.0, |j| j.share);
    let m = world.mass_kg;
    let mass = [
        if joint.is_some() { m * share } else { 1.0 },
        m * (1.0 - share),
        piece_kg,
        world.frame.map_or(FIXED_KG, |f| f.mass_kg),
    ];
    let reduced = m * share * (1.0 - share);
    let (joint_k, joint_c) = joint.map_or((0.0, 0.0), |j| {
        let w = TAU * j.frequency_hz;
        (w * w * reduced, 2.0 * j.damping_ratio * w * reduced)
    });
    let (feet_k, feet_c, lifted) = world.frame.map_or((0.0, 0.0, 1.0), |f| {
        (f.stiffness_n_per_m, 2.0 * f.damping_ratio * (f.stiffness_n_per_m * f.mass_kg).sqrt(), f.lifted_share)
    });
    let own_c = 2.0 * world.piece.damping_ratio * (side * piece_kg).sqrt();
    let rest_c = 2.0 * world.piece.rest_damping_ratio * (k * piece_kg).sqrt();
    let (surge_kg, surge_c) = spring.surge.map_or((0.0, 0.0), |(kg, ratio)| (kg, 2.0 * ratio * (4.0 * k * kg).sqrt()));
    let creep_keep: Vec<f64> = spring.creep.iter().map(|(_, tau)| (-h / tau).exp()).collect();
    let mut creep = vec![0.0; spring.creep.len()];

    let first = (sampling.contact_s * sampling.rate_hz).floor();
    let lead = sampling.contact_s - first / sampling.rate_hz;
    let g = world.gravity_m_per_s2;
    let v0 = world.speed_m_per_s - g * lead;
    let gap = v0 * lead + 0.5 * g * lead * lead;
    let mut x = [-gap, -gap, 0.0, 0.0];
    let mut v = [v0, v0, 0.0, 0.0];
    let (mut coil_x, mut coil_v) = (0.0, 0.0);
    let mut contact = Contact::new(pad, h);
    let mut bristles = Bristles::new(world.guide, piece_kg);
    let mut readout = Readout::new(chain, h);
    let (mut slid, mut heat, mut loss_bend, mut slip_left) = (0.0, 0.0, 0.0, None);
    let mut noticed_s: Option<f64> = None;
    let (mut peak_n, mut peak_s, mut stroke_m, mut separation_s) = (0.0, 0.0, 0.0f64, None);
    let mut touched = false;

    let first = first as usize;
    let mut readings = vec![0.0; first.min(sampling.samples)];
    let mut reading = 0.0;
    for sample in first..sampling.samples {
        readings.push(reading);
        for step in 0..per_sample {
            let t = sample as f64 / sampling.rate_hz + (step as f64 + 0.5) * h;
            let since = t - sampling.contact_s;
            for (x, v) in x.iter_mut().zip(&v) {
                *x += 0.5 * h * v;
            }
            let mut force = [0.0; 4];
            let mut damper = [joint_c, 0.0, own_c, feet_c];

            // Pad, and what lets the tip yield before it.
            let closing = v[1] - v[2];
            let push = contact.step(x[1] - x[2] - slid, closing);
            let pad_n = push.elastic_n + push.dashpot_n_s_per_m * closing;
            if pad_n == 0.0 {
                damper[2] += rest_c;
            }
            damper[1] = push.dashpot_n_s_per_m;
            force[1] -= push.elastic_n;
            force[2] += push.elastic_n;
            if let Some(ceiling) = robot.ceiling_n
                && pad_n > ceiling
            {
                // Gives way as a stiff dashpot would: back at the ceiling within a fraction of a millisecond.
                slid += h * (pad_n - ceiling) / (pad.stiffness_n_per_m * 2e-4);
            }
            if let Some((at, by)) = robot.slip {
                if slip_left.is_none() && pad_n > at {
                    slip_left = Some(by);
                }
                if let Some(left) = &mut slip_left {
                    // The slip comes to rest within a millisecond or two.
                    let go = *left * (h / 5e-4);
                    slid += go;
                    *left -= go;
                }
            }
            if pad_n > 0.0 {
                touched = true;
            } else if touched && separation_s.is_none() && since > 1e-3 {
                separation_s = Some(t);
            }

            // Springs and what else passes through the cell.
            let u = x[2] - x[3];
            let rate = v[2] - v[3];
            let mut upper = k * u;
            if let Some((loose, gap)) = spring.loose {
                upper = k * ((1.0 - loose) * u + loose * (u - gap).max(0.0));
            }
            if let Some((at, stiffness, over)) = spring.stop {
                let d = (u - at).max(0.0);
                upper += if d < over { stiffness * d * d / (2.0 * over) } else { stiffness * (d - over / 2.0) };
            }
            for ((dashpot, keep), (stiffness, _)) in creep.iter_mut().zip(&creep_keep).zip(&spring.creep) {
                upper += stiffness * (u - *dashpot);
                *dashpot = u + (*dashpot - u) * keep;
            }
            if let Some((part, turn)) = spring.loss {
                loss_bend = (loss_bend + h * rate / turn) / (1.0 + h * rate.abs() / turn);
                upper += part * k * u.abs() * loss_bend;
            }
            let mut lower = upper;
            if surge_kg > 0.0 {
                // Two half springs with the coils' mass between.
                coil_x += 0.5 * h * coil_v;
                upper = 2.0 * k * (x[2] - coil_x);
                lower = 2.0 * k * (coil_x - x[3]);
                let push = upper - lower - surge_c * (coil_v - 0.5 * (v[2] + v[3]));
                coil_v += h * push / surge_kg;
                coil_x += 0.5 * h * coil_v;
            }
            let air = spring.air_n_s2_per_m2 * rate.abs();
            damper[2] += air;
            force[2] -= upper;
            force[3] += lower;
            let (rub, micro) = bristles.step(rate, pad_n, h);
            force[2] -= rub;
            force[3] += rub;
            damper[2] += micro;
            force[3] -= feet_k * x[3] * if x[3] < 0.0 { lifted } else { 1.0 };

            // Robot, or weight.
            if let Some(j) = joint {
                let stretch = x[0] - x[1];
                let play = 0.5 * j.backlash_m;
                let taken = if stretch > play { stretch - play } else { (stretch + play).min(0.0) };
                if play > 0.0 && taken == 0.0 {
                    damper[0] = 0.0;
                }
                force[0] -= joint_k * taken;
                force[1] += joint_k * taken;
            }
            force[0] += g * if joint.is_some() { mass[0] } else { 0.0 };
            force[1] += g * mass[1];
            if let Some(sway) = robot.sway {
                let w = TAU * sway.frequency_hz;
                force[1] -= m * sway.amplitude_m * w * w * (w * since + sway.phase_rad).sin();
            }
            let driven = usize::from(joint.is_none());
            if let Some(push) = robot.push
                && since > 0.0
                && since < push.until_s
            {
                let lag = world.speed_m_per_s * since - x[driven];
                force[driven] += (push.stiffness_n_per_m * lag).clamp(0.0, push.limit_n);
            }
            if let Some(reaction) = robot.reaction {
                if noticed_s.is_none() && pad_n > reaction.threshold_n {
                    noticed_s = Some(t);
                }
                if let Some(at) = noticed_s
                    && t > at + reaction.delay_s
                    && v[1] > -0.3
                {
                    force[1] -= reaction.force_n * (1.0 - (-(t - at - reaction.delay_s) / reaction.rise_s).exp());
                }
            }
            if let Some((amplitude, pitch, phase)) = robot.cogging {
                force[1] += amplitude * (TAU * x[1] / pitch + phase).sin();
            }

            // Speeds, then the other half of the way.
            // The dampers act with the new speeds: a light piece behind a dashpot would never settle under their mean.
            let damping = damper.map(|damper| h * damper);
            let impulse = std::array::from_fn(|row| mass[row] * v[row] + h * force[row]);
            v = shared_speeds(&mass, &damping, &impulse);
            for (x, v) in x.iter_mut().zip(&v) {
                *x += 0.5 * h * v;
            }

            // What the cell feels and the converter gets.
            let felt = lower + air * rate;
            if felt > peak_n {
                (peak_n, peak_s) = (felt, t);
            }
            stroke_m = stroke_m.max(u);
            let mut signal = felt * (1.0 + chain.curvature * felt / 2000.0);
            if chain.tilt_rad_per_m > 0.0 {
                signal *= (chain.tilt_rad_per_m * u).cos();
            }
            if let Some((shift, tau)) = chain.heat {
                let joule = 0.5 * m * world.speed_m_per_s * world.speed_m_per_s;
                let goal = if touched { shift * joule } else { 0.0 };
                heat += (goal - heat) * h / tau;
                signal += heat;
            }
            reading = readout.push(signal * chain.gain);
        }
    }
    let end = sampling.samples as f64 / sampling.rate_hz;
    Trace { readings, peak_s, separation_s: separation_s.unwrap_or(end), peak_n, stroke_m }
}

#[cfg(test)]
mod tests;
