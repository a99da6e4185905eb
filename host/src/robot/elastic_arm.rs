//! What an arm whose links bend feels of a collision: the corrected equations of the elastic-arm paper (paper 2).
//!
//! ```text
//!  joint ■══════x_s══════════════▶ tip      τ(x) = ½·ρ·g·cosφ·(L − x)² + f·(L − x) + τ_b          (1) to (4)
//!        0      gauge            L           Δτ   = τ(0) − τ(x_s) = ρ·g·cosφ·(L·x_s − x_s²/2) + f·x_s
//!
//!  r = K_I·[p − ∫(τ + Cᵀq̇ − g + r)dt − p(0)]     ⇒     ṙ = K_I·(τ_c − r)                             (15) to (17)
//! ```
//!
//! Printed are (2) and (3) divided by E·I, which is the curvature and not a torque, and (2) without g·cosφ; and (15) without r in the integral,
//! from which (16) does not follow: what is printed would go on growing while the contact lasts. τ_c is what a collision does to the joint from outside,
//! M·q̈ + C·q̇ + g = τ + τ_c.

use nalgebra::DVector;
use thud_sim::rig::STANDARD_GRAVITY_M_PER_S2;

/// A uniform link that is clamped in its joint, and what bends it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadedLink {
    /// L, m.
    pub length_m: f64,
    /// ρ, kg/m.
    pub mass_per_length_kg_per_m: f64,
    /// φ, between link and horizontal, rad.
    pub elevation_rad: f64,
    /// f across the link at its tip, N; downward is positive.
    pub tip_force_n: f64,
    /// τ_b at its tip, N·m.
    pub tip_torque_n_m: f64,
}

impl LoadedLink {
    /// Torque that bends the link at a distance from its joint (m, 0 to L), N·m.
    #[must_use]
    pub fn torque_n_m(&self, at_m: f64) -> f64 {
        let beyond = self.length_m - at_m;
        0.5 * self.weight_n_per_m() * beyond * beyond + self.tip_force_n * beyond + self.tip_torque_n_m
    }

    /// By how much the torque at the joint exceeds that at a strain gauge (m from the joint), N·m.
    #[must_use]
    pub fn torque_before_n_m(&self, gauge_m: f64) -> f64 {
        self.weight_n_per_m() * (self.length_m * gauge_m - 0.5 * gauge_m * gauge_m) + self.tip_force_n * gauge_m
    }

    fn weight_n_per_m(&self) -> f64 {
        self.mass_per_length_kg_per_m * STANDARD_GRAVITY_M_PER_S2 * self.elevation_rad.cos()
    }
}

/// The residual of the generalised momentum: what a collision does to each joint, behind a filter of first order (De Luca 2005).
#[derive(Clone, Debug, PartialEq)]
pub struct MomentumResidual {
    /// K_I of each joint, 1/s.
    gain_per_s: DVector<f64>,
    /// p(0) and what has been integrated since.
    expected: DVector<f64>,
    residual: DVector<f64>,
}

impl MomentumResidual {
    /// At rest in the beginning's momentum p(0) = M·q̇.
    #[must_use]
    pub fn new(gain_per_s: DVector<f64>, momentum: DVector<f64>) -> Self {
        Self { residual: DVector::zeros(momentum.len()), expected: momentum, gain_per_s }
    }

    /// A step: the momentum p at its end, and τ + Cᵀ·q̇ − g of the step, each of as many values as there are joints. Gives r, N·m.
    pub fn step(&mut self, momentum: &DVector<f64>, drive: &DVector<f64>, step_s: f64) -> &DVector<f64> {
        self.expected += (drive + &self.residual) * step_s;
        self.residual = self.gain_per_s.component_mul(&(momentum - &self.expected));
        &self.residual
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLADE: LoadedLink = LoadedLink {
        length_m: 0.42,
        mass_per_length_kg_per_m: 0.185 / 0.42,
        elevation_rad: 0.4,
        tip_force_n: 3.9,
        tip_torque_n_m: 0.2,
    };

    /// By cutting the link up: every piece beyond x pulls down at its lever. What the link is made of does not come into it.
    #[test]
    fn torque_along_a_link_is_that_of_statics_and_not_divided_by_its_stiffness() {
        let by_pieces = |at: f64| -> f64 {
            let (count, beyond) = (20_000, BLADE.length_m - at);
            let piece = beyond / f64::from(count);
            let weight = BLADE.mass_per_length_kg_per_m * piece * STANDARD_GRAVITY_M_PER_S2 * BLADE.elevation_rad.cos();
            (0..count).map(|number| weight * (f64::from(number) + 0.5) * piece).sum::<f64>()
                + BLADE.tip_force_n * beyond
                + BLADE.tip_torque_n_m
        };
        for at in [0.0, 0.03, 0.2, 0.42] {
            assert!((BLADE.torque_n_m(at) - by_pieces(at)).abs() < 1e-9, "at {at} m");
            assert!((BLADE.torque_before_n_m(at) - (by_pieces(0.0) - by_pieces(at))).abs() < 1e-9, "at {at} m");
        }
        // As printed, for the paper's blade of steel, 4 mm by 15 mm.
        let rigidity = 210e9 * 0.015 * 0.004_f64.powi(3) / 12.0;
        let share = 0.03 / BLADE.length_m;
        let printed = BLADE.mass_per_length_kg_per_m * BLADE.length_m.powi(2) / (2.0 * rigidity)
            * (1.0 - 2.0 * share + share * share)
            + BLADE.tip_force_n * BLADE.length_m / rigidity * (1.0 - share)
            + BLADE.tip_torque_n_m;
        assert!((printed / by_pieces(0.03) - 1.0).abs() > 0.5, "{printed} N·m as printed, {} are", by_pieces(0.03));
        // Nor would it change when the arm is raised, which lifts the weight's lever.
        let upright = LoadedLink { elevation_rad: std::f64::consts::FRAC_PI_2, tip_force_n: 0.0, ..BLADE };
        assert!((upright.torque_n_m(0.0) - BLADE.tip_torque_n_m).abs() < 1e-12);
    }

    /// A pendulum of one joint swings, and from 0.3 s on somebody pushes it with 1.5 N·m.
    #[test]
    fn the_residual_settles_at_the_collision_and_as_printed_runs_away() {
        let (inertia, weight_n_m, drive, gain, push, step) = (0.3, 4.0, 1.0, 50.0, 1.5, 1e-5);
        let one = |value: f64| DVector::from_element(1, value);
        let mut observer = MomentumResidual::new(one(gain), one(0.0));
        let (mut angle, mut speed, mut printed) = (0.2_f64, 0.0_f64, (0.0, 0.0));
        let (mut before, mut after_20_ms, mut at_end) = (0.0_f64, 0.0, 0.0);
        for number in 0..100_000 {
            let time = f64::from(number) * step;
            let collision = if time < 0.3 { 0.0 } else { push };
            let inner = drive - weight_n_m * angle.sin();
            speed += step * (inner + collision) / inertia;
            angle += step * speed;
            at_end = observer.step(&one(inertia * speed), &one(inner), step)[0];
            printed.0 += step * inner;
            printed.1 = gain * (inertia * speed - printed.0);
            if time < 0.3 {
                before = before.max(at_end.abs());
            } else if time < 0.32 {
                after_20_ms = at_end;
            }
        }
        assert!(before < 1e-9, "{before} N·m without a collision");
        assert!(
            (after_20_ms / push - (1.0 - f64::exp(-gain * 0.02))).abs() < 1e-3,
            "first order, 1/K_I: {after_20_ms}"
        );
        assert!((at_end / push - 1.0).abs() < 1e-3, "and of the sign of what pushes: {at_end}");
        assert!(printed.1 > 30.0 * push, "as printed {} N·m and growing", printed.1);
    }
}
