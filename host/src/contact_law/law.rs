//! What a contact law is, and the force that it gives for one impact.
//!
//! ```text
//!   F = F_r·(δ/δ_r)ⁿ·(1 + λ·δ̇) + c·δ̇ ≥ 0        k = F_r/δ_rⁿ
//! ```
//!
//! The stiffness k has a unit that depends on n, and moves by decades when n moves a little. The force F_r at a depth δ_r that the
//! recordings reach does not: it is what is fitted, and k is computed from it.

use super::motion::Motion;

/// How a law loses energy.
#[derive(Clone, Copy, Debug)]
pub enum Damping {
    /// Not at all.
    None,
    /// λ = 3α/2 with α of the material, s/m.
    Material,
    /// λ = D/v₀: the same share of the energy is lost at every speed. The law reads a restitution from D.
    OverSpeed {
        /// D for a claimed restitution.
        loss: fn(f64) -> f64,
        /// The claimed restitution for D.
        restitution: fn(f64) -> f64,
    },
    /// A dashpot c beside the spring, N·s/m.
    Dashpot,
}

/// A contact law.
#[derive(Debug)]
pub struct Law {
    /// Its name in files and on the command line.
    pub id: &'static str,
    /// Its name for people.
    pub name: &'static str,
    /// Its equation, as text.
    pub equation: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    /// Whether the exponent n is a parameter; else it is 1.
    pub exponent: bool,
    /// What it loses.
    pub damping: Damping,
}

/// Values of a law's parameters, in the form that is fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Values {
    /// Depth δ_r that the stiffness belongs to, m.
    pub reference_m: f64,
    /// Force F_r at that depth, at rest, N.
    pub reference_n: f64,
    /// Exponent n.
    pub exponent: f64,
    /// α in s/m, D, or c in N·s/m, as [`Damping`] says.
    pub damping: f64,
}

impl Values {
    /// The stiffness k = F_r/δ_rⁿ, N/mⁿ.
    #[must_use]
    pub fn stiffness(&self) -> f64 {
        self.reference_n / self.reference_m.powf(self.exponent)
    }
}

/// A law's force for one impact.
#[derive(Clone, Copy, Debug)]
pub struct Force {
    reference_m: f64,
    reference_n: f64,
    exponent: f64,
    lambda_s_per_m: f64,
    dashpot_ns_per_m: f64,
}

impl Force {
    /// The force at a depth (m) and its rate (m/s), N.
    #[must_use]
    pub fn at(&self, depth_m: f64, rate_m_per_s: f64) -> f64 {
        self.with_pull(depth_m, rate_m_per_s).max(0.0)
    }

    /// The same where nothing lets go: below zero it pulls.
    pub(super) fn with_pull(&self, depth_m: f64, rate_m_per_s: f64) -> f64 {
        self.elastic_n(depth_m) * (1.0 + self.lambda_s_per_m * rate_m_per_s) + self.dashpot(depth_m) * rate_m_per_s
    }

    /// The part that is there at rest, N.
    #[must_use]
    pub fn elastic_n(&self, depth_m: f64) -> f64 {
        if depth_m <= 0.0 {
            return 0.0;
        }
        let part = depth_m / self.reference_m;
        self.reference_n * if self.exponent == 1.0 { part } else { part.powf(self.exponent) }
    }

    fn dashpot(&self, depth_m: f64) -> f64 {
        // At depth zero it touches.
        if depth_m < 0.0 { 0.0 } else { self.dashpot_ns_per_m }
    }

    /// How deep a mass (kg) of this speed (m/s) would go without loss, m.
    #[must_use]
    pub fn elastic_depth_m(&self, mass_kg: f64, speed_m_per_s: f64) -> f64 {
        // ½mv² = F_r·δ_r/(n+1)·(δ/δ_r)^(n+1)
        let energy = 0.5 * mass_kg * speed_m_per_s * speed_m_per_s;
        let share = energy * (self.exponent + 1.0) / (self.reference_n * self.reference_m);
        self.reference_m * share.powf(1.0 / (self.exponent + 1.0))
    }
}

impl Law {
    /// The law with this id.
    #[must_use]
    pub fn named(id: &str) -> Option<&'static Self> {
        super::LAWS.iter().copied().find(|law| law.id == id)
    }

    /// How many parameters it has; `held`: the exponent is none of them.
    #[must_use]
    pub fn parameters(&self, held: bool) -> usize {
        1 + usize::from(self.exponent && !held) + usize::from(!matches!(self.damping, Damping::None))
    }

    /// Its force for an impact at this speed, m/s.
    #[must_use]
    pub fn force(&self, values: &Values, speed_m_per_s: f64) -> Force {
        let (lambda, dashpot) = match self.damping {
            Damping::None => (0.0, 0.0),
            Damping::Material => (1.5 * values.damping, 0.0),
            Damping::OverSpeed { .. } => (values.damping / speed_m_per_s, 0.0),
            Damping::Dashpot => (0.0, values.damping),
        };
        Force {
            reference_m: values.reference_m,
            reference_n: values.reference_n,
            exponent: if self.exponent { values.exponent } else { 1.0 },
            lambda_s_per_m: lambda,
            dashpot_ns_per_m: dashpot,
        }
    }

    /// Whether two laws give the same force for the same values.
    #[must_use]
    pub fn same_force(&self, other: &Self) -> bool {
        self.exponent == other.exponent
            && std::mem::discriminant(&self.damping) == std::mem::discriminant(&other.damping)
    }

    /// Whether every force of `other` is one of this law's, too.
    #[must_use]
    pub fn contains(&self, other: &Self) -> bool {
        let damps = |law: &Self| !matches!(law.damping, Damping::None);
        self.same_force(other)
            || ((self.exponent || !other.exponent) && !damps(other))
            || (self.exponent && std::mem::discriminant(&self.damping) == std::mem::discriminant(&other.damping))
    }

    /// The motion of a mass that meets the law.
    #[must_use]
    pub fn motion(&self, values: &Values, mass_kg: f64, speed_m_per_s: f64, gravity_m_per_s2: f64) -> Motion {
        Motion::of(&self.force(values, speed_m_per_s), mass_kg, speed_m_per_s, gravity_m_per_s2)
    }

    /// What the law says its restitution is at this speed; `None` where it claims none.
    #[must_use]
    pub fn claimed_restitution(&self, values: &Values, speed_m_per_s: f64) -> Option<f64> {
        match self.damping {
            Damping::None => Some(1.0),
            Damping::Material => Some(super::hunt_crossley::printed_restitution(values.damping, speed_m_per_s)),
            Damping::OverSpeed { restitution, .. } => Some(restitution(values.damping)),
            Damping::Dashpot => None,
        }
    }
}
