//! Hysteresis set by a restitution, over the whole range: F = k·δⁿ·(1 + 8·(1 − c)/(5·c)·δ̇/v₀).
//!
//! At c = 0 the loss is infinite, as it should be.
//!
//! Source: P. Flores, M. Machado, M. T. Silva, J. M. Martins, Multibody Syst. Dyn. 25 (2011) 357.

use super::law::{Damping, Law};

pub(super) static LAW: Law = Law {
    id: "flores",
    name: "Flores",
    equation: "F = k·δⁿ·(1 + 8·(1 − c)/(5·c)·(dδ/dt)/v0)",
    source: "Flores, Machado, Silva and Martins, Multibody Syst. Dyn. 25 (2011) 357",
    exponent: true,
    damping: Damping::OverSpeed { loss, restitution },
};

fn loss(restitution: f64) -> f64 {
    1.6 * (1.0 - restitution) / restitution
}

fn restitution(loss: f64) -> f64 {
    1.0 / (1.0 + loss / 1.6)
}
