//! Hysteresis set by a restitution, from the momentum balance: F = k·δⁿ·(1 + (1 − c²)/c·δ̇/v₀).
//!
//! The published law asks for d with (1 + d/c)/(1 − d) = exp(d·(1 + 1/c)) and F = k·δⁿ·(1 + d/c·δ̇/v₀); d ≈ 1 − c² is the
//! approximation that its authors give and the compendium lists.
//!
//! Source: Y. Gonthier, J. McPhee, C. Lange, J.-C. Piedbœuf, Multibody Syst. Dyn. 11 (2004) 209.

use super::law::{Damping, Law};

pub(super) static LAW: Law = Law {
    id: "gonthier",
    name: "Gonthier",
    equation: "F = k·δⁿ·(1 + (1 − c²)/c·(dδ/dt)/v0)",
    source: "Gonthier, McPhee, Lange and Piedbœuf, Multibody Syst. Dyn. 11 (2004) 209",
    exponent: true,
    damping: Damping::OverSpeed { loss, restitution },
};

fn loss(restitution: f64) -> f64 {
    (1.0 - restitution * restitution) / restitution
}

/// The positive root of c² + D·c − 1 = 0.
fn restitution(loss: f64) -> f64 {
    (0.25 * loss * loss + 1.0).sqrt() - 0.5 * loss
}
