//! The baseline that the standard implies, in closed form.
//!
//! While touching, m·ẍ = −k·x + m·g with x(0) = 0, ẋ(0) = v, so with ω = √(k/m) and θ = ω·τ
//!
//! F(τ) = k·x = v·√(k·m)·sin θ + m·g·(1 − cos θ),  until tan(θ/2) = −v·ω/g (θ = π without gravity).
//!
//! With gravity the mass comes back after 2·v/g with the same speed, and the pulse repeats. In a fall the height is
//! −v·τ − g·τ²/2 from the release on.

use std::f64::consts::PI;

use crate::world::Kind;

/// The baseline of one recording.
#[derive(Debug, Clone, Copy)]
pub struct Baseline {
    /// Impact, drop or fall.
    pub kind: Kind,
    /// Gravity along the motion, m/s².
    pub gravity_m_per_s2: f64,
    /// Speed at contact or release, m/s.
    pub speed_m_per_s: f64,
    /// Effective mass, kg.
    pub mass_kg: f64,
    /// Springs and pad in series, N/m.
    pub stiffness_n_per_m: f64,
}

/// A value and its derivatives by τ, speed (m/s), ln k and ln m.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tangent {
    /// The reading.
    pub value: f64,
    /// By time.
    pub by_time: f64,
    /// By speed.
    pub by_speed: f64,
    /// By ln k.
    pub by_ln_k: f64,
    /// By ln m.
    pub by_ln_m: f64,
}

impl Baseline {
    fn turn(&self, omega: f64) -> f64 {
        if self.gravity_m_per_s2 > 0.0 {
            2.0 * (PI - (self.speed_m_per_s * omega / self.gravity_m_per_s2).atan())
        } else {
            PI
        }
    }

    /// Time in touch, s.
    #[must_use]
    pub fn touch_s(&self) -> f64 {
        let omega = (self.stiffness_n_per_m / self.mass_kg).sqrt();
        self.turn(omega) / omega
    }

    /// From one touch to the next, s.
    fn period_s(&self) -> f64 {
        if self.gravity_m_per_s2 > 0.0 {
            self.touch_s() + 2.0 * self.speed_m_per_s / self.gravity_m_per_s2
        } else {
            f64::INFINITY
        }
    }

    /// Highest force, N.
    #[must_use]
    pub fn peak_n(&self) -> f64 {
        let weight = self.mass_kg * self.gravity_m_per_s2;
        let a = self.speed_m_per_s * (self.stiffness_n_per_m * self.mass_kg).sqrt();
        weight + f64::hypot(a, weight)
    }

    /// A sampler over time since contact.
    pub fn sampler(&self) -> impl Fn(f64) -> Tangent + use<> {
        let this = *self;
        let Self { kind, gravity_m_per_s2: g, speed_m_per_s: v, mass_kg: m, stiffness_n_per_m: k } = this;
        let omega = (k / m).sqrt();
        let amplitude = v * (k * m).sqrt();
        let weight = m * g;
        let period = this.period_s();
        let touch = this.touch_s();
        // What moves the later touches: the derivatives of the period.
        let step = 1e-6;
        let shifted = |change: Self| (change.period_s() - period) / step;
        let (period_by_v, period_by_k, period_by_m) = if period.is_finite() {
            (
                shifted(Self { speed_m_per_s: v + step, ..this }),
                shifted(Self { stiffness_n_per_m: k * (1.0 + step), ..this }),
                shifted(Self { mass_kg: m * (1.0 + step), ..this }),
            )
        } else {
            (0.0, 0.0, 0.0)
        };
        move |tau: f64| {
            if tau <= 0.0 {
                return Tangent::default();
            }
            if kind == Kind::Fall {
                return Tangent {
                    value: -v * tau - 0.5 * g * tau * tau,
                    by_time: -v - g * tau,
                    by_speed: -tau,
                    ..Tangent::default()
                };
            }
            let touches = if period.is_finite() { (tau / period).floor() } else { 0.0 };
            let tau = if touches > 0.0 { tau - touches * period } else { tau };
            if tau > touch {
                return Tangent::default();
            }
            let (sin, cos) = (omega * tau).sin_cos();
            let by_time = omega * (amplitude * cos + weight * sin);
            Tangent {
                value: amplitude * sin + weight * (1.0 - cos),
                by_time,
                by_speed: amplitude / v * sin - touches * by_time * period_by_v,
                by_ln_k: 0.5 * (amplitude * sin + by_time * tau) - touches * by_time * period_by_k,
                by_ln_m: 0.5 * (amplitude * sin - by_time * tau) + weight * (1.0 - cos)
                    - touches * by_time * period_by_m,
            }
        }
    }
}
