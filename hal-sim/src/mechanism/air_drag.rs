//! Air slows a falling body.
//!
//! m·ẍ = m·g − c·ẋ·|ẋ|, c = ½·ρ·C_d·A; the terminal velocity is √(m·g/c), and from rest v = v_t·tanh(g·t/v_t).
//!
//! Source: quadratic drag at high Reynolds number.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Drive, Motion};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "air-drag",
    group: Group::Fall,
    site: Site::Drive,
    lasting: true,
    exact: false,
    by_configuration: &["coefficient_kg_per_m"],
    by_recording: &[],
    used_in: &[],
    sized: &[],
    equation: "F = −c·v·|v|, c = 0.5·ρ·C_d·A",
    source: "quadratic drag; a golf ball 0.0004, a basketball 0.02 kg/m",
    parameters: &[Parameter {
        name: "coefficient_kg_per_m",
        unit: "kg/m",
        meaning: "drag per square of the velocity",
        null: Some(0.0),
        range: (0.0, 10.0),
        plausible: (1e-5, 0.1),
        typical: 0.005,
        scale: Scale::Logarithmic,
        search: Search::Strength,
    }],
    signature: "the acceleration falls with the square of the speed; height over time straightens",
    confused_with: &["speed-error", "gain-error"],
    separated_by: "mass at equal size; the loss grows with the square of the speed",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.drives.push(Box::new(Drag { coefficient_kg_per_m: effect.value(0) }));
}

#[derive(Debug)]
struct Drag {
    coefficient_kg_per_m: f64,
}

impl Drive for Drag {
    fn force_n(&self, motion: Motion) -> f64 {
        -self.coefficient_kg_per_m * motion.velocity_m_per_s * motion.velocity_m_per_s.abs()
    }
}
