//! Hysteresis set by a restitution: F = k·δⁿ·(1 + 3·(1 − c²)/4·δ̇/v₀).
//!
//! From the energy lost by a nearly elastic impact, for restitutions near 1. At c = 0 it still bounces back with two thirds of
//! its speed.
//!
//! Source: H. M. Lankarani, P. E. Nikravesh, J. Mech. Des. 112 (1990) 369; Nonlinear Dynamics 5 (1994) 193.

use super::law::{Damping, Law};

pub(super) static LAW: Law = Law {
    id: "lankarani-nikravesh",
    name: "Lankarani–Nikravesh",
    equation: "F = k·δⁿ·(1 + 3·(1 − c²)/4·(dδ/dt)/v0)",
    source: "Lankarani and Nikravesh, Nonlinear Dynamics 5 (1994) 193",
    exponent: true,
    damping: Damping::OverSpeed { loss, restitution },
};

fn loss(restitution: f64) -> f64 {
    0.75 * (1.0 - restitution * restitution)
}

/// No restitution gives more loss than c = 0 does.
fn restitution(loss: f64) -> f64 {
    (1.0 - loss / 0.75).max(0.0).sqrt()
}
