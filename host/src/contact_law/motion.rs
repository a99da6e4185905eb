//! The motion of one mass that meets a contact law: m·δ̈ = m·g − F(δ, δ̇), from δ = 0, δ̇ = v₀ until F or δ is back at zero.
//!
//! Runge and Kutta's classical method with steps that are a fixed part of the contact, so that the result changes smoothly with
//! every parameter, which a fit needs.

use super::law::{Force, Law, Values};

/// Steps in the duration of a lossless contact.
const STEPS: f64 = 300.0;
/// A contact that has not ended after this many durations of a lossless one is cut.
const MOST_DURATIONS: f64 = 12.0;

/// A motion from first contact to separation, at even steps; the last one is shorter.
#[derive(Clone, Debug)]
pub struct Motion {
    step_s: f64,
    /// Instant of separation, s; of the last point where it never separates.
    pub end_s: f64,
    /// Whether it ends with a separation.
    pub separates: bool,
    /// Depth, m.
    pub depth_m: Vec<f64>,
    /// Rate of depth, m/s.
    pub rate_m_per_s: Vec<f64>,
    /// Force, N.
    pub force_n: Vec<f64>,
}

impl Motion {
    /// The motion of a mass (kg) that comes at a speed (m/s); gravity into the contact, m/s².
    #[must_use]
    pub fn of(force: &Force, mass_kg: f64, speed_m_per_s: f64, gravity_m_per_s2: f64) -> Self {
        let depth = force.elastic_depth_m(mass_kg, speed_m_per_s);
        // A half sine lasts π·δ/v, a contact with n = 1.5 lasts 2.94·δ/v.
        let step_s = 3.0 * depth / speed_m_per_s / STEPS;
        let most = (MOST_DURATIONS * STEPS) as usize;
        let acceleration = |x: f64, v: f64| gravity_m_per_s2 - force.at(x, v) / mass_kg;
        let (mut x, mut v) = (0.0, speed_m_per_s);
        let mut motion = Self {
            step_s,
            end_s: 0.0,
            separates: false,
            depth_m: vec![x],
            rate_m_per_s: vec![v],
            force_n: vec![force.at(x, v)],
        };
        for _ in 0..most {
            let k1 = (v, acceleration(x, v));
            let k2 = (v + 0.5 * step_s * k1.1, acceleration(x + 0.5 * step_s * k1.0, v + 0.5 * step_s * k1.1));
            let k3 = (v + 0.5 * step_s * k2.1, acceleration(x + 0.5 * step_s * k2.0, v + 0.5 * step_s * k2.1));
            let k4 = (v + step_s * k3.1, acceleration(x + step_s * k3.0, v + step_s * k3.1));
            let next_x = x + step_s / 6.0 * (k1.0 + 2.0 * (k2.0 + k3.0) + k4.0);
            let next_v = v + step_s / 6.0 * (k1.1 + 2.0 * (k2.1 + k3.1) + k4.1);
            let now = force.at(next_x, next_v);
            if next_v < 0.0 && now <= 0.0 {
                // Depth or force falls through zero within this step.
                let (before, after) =
                    if next_x <= 0.0 { (x, next_x) } else { (force.at(x, v), force.with_pull(next_x, next_v)) };
                let part = (before / (before - after).max(f64::MIN_POSITIVE)).clamp(1e-6, 1.0);
                motion.end_s += part * step_s;
                motion.separates = true;
                motion.push(x + part * (next_x - x), v + part * (next_v - v), 0.0);
                return motion;
            }
            (x, v) = (next_x, next_v);
            motion.end_s += step_s;
            motion.push(x, v, now);
        }
        motion
    }

    fn push(&mut self, depth_m: f64, rate_m_per_s: f64, force_n: f64) {
        self.depth_m.push(depth_m);
        self.rate_m_per_s.push(rate_m_per_s);
        self.force_n.push(force_n);
    }

    /// The force at an instant after first contact, N; zero before and after the contact.
    #[must_use]
    pub fn force_at(&self, time_s: f64) -> f64 {
        if !(0.0..self.end_s).contains(&time_s) {
            return 0.0;
        }
        let last = self.force_n.len() - 2;
        let place = ((time_s / self.step_s) as usize).min(last);
        let begins = place as f64 * self.step_s;
        let length = if place == last { self.end_s - begins } else { self.step_s };
        let part = ((time_s - begins) / length).clamp(0.0, 1.0);
        self.force_n[place] + part * (self.force_n[place + 1] - self.force_n[place])
    }

    /// Largest force, N.
    #[must_use]
    pub fn peak_n(&self) -> f64 {
        self.force_n.iter().copied().fold(0.0, f64::max)
    }

    /// Speed of the rebound over that of the approach; 0 where it never separates.
    #[must_use]
    pub fn restitution(&self) -> f64 {
        match (self.rate_m_per_s.first(), self.rate_m_per_s.last()) {
            (Some(first), Some(last)) if self.separates => -last / first,
            _ => 0.0,
        }
    }
}

/// The restitution that a law really gives for a mass (kg) at a speed (m/s), by its own motion, gravity apart.
#[must_use]
pub fn restitution(law: &Law, values: &Values, mass_kg: f64, speed_m_per_s: f64) -> f64 {
    law.motion(values, mass_kg, speed_m_per_s, 0.0).restitution()
}
