//! Damping that grows with depth, of the material: F = k·δⁿ·(1 + (3/2)·α·δ̇).
//!
//! With χ = (3/2)·α·k as printed (eq. 10), the restitution is not c_r = 1 − α·v₀ (eq. 11), which is its first order for small
//! losses. What the equation of motion gives is that of [`hysteresis`](super::hysteresis) with x = (3/2)·α·v₀, close to
//! e = 1/(1 + α·v₀):
//!
//! | α·v₀ | printed 1 − α·v₀ | true | 1/(1 + α·v₀) |
//! |---|---|---|---|
//! | 0.1 | 0.90 | 0.909 | 0.909 |
//! | 0.3 | 0.70 | 0.768 | 0.769 |
//! | 0.5 | 0.50 | 0.663 | 0.667 |
//!
//! Hence α = (1 − e)/(e·v₀), not (1 − e)/v₀. (Eq. 11 also lacks the minus sign of the rebound's velocity.)
//!
//! Source: K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440; paper 1, eq. 9 to 12 and 25.

use super::law::{Damping, Law};

pub(super) static LAW: Law = Law {
    id: "hunt-crossley",
    name: "Hunt–Crossley",
    equation: "F = k·δⁿ·(1 + 1.5·α·dδ/dt)",
    source: "Hunt and Crossley, J. Appl. Mech. 42 (1975) 440",
    exponent: true,
    damping: Damping::Material,
};

/// The restitution as printed, 1 − α·v₀: the law's claim, first order only.
pub(super) fn printed_restitution(alpha_s_per_m: f64, speed_m_per_s: f64) -> f64 {
    1.0 - alpha_s_per_m * speed_m_per_s
}
