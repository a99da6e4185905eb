//! A spring beside a dashpot that let go of each other: F = max(0, k·δ + c·δ̇).
//!
//! The force begins with a step c·v₀. As printed in textbooks the law pulls at the end of the contact; nothing holds a robot to
//! a pad, so the contact ends where the force is zero, still pressed in, and the restitution is
//!
//! ```text
//!   ζ = c/(2·√(k·m)),   e = exp(−ζ/√(1−ζ²)·φ),   φ = 2·atan(√(1−ζ²)/ζ)     (ζ < 1)
//! ```
//!
//! which depends on neither speed nor depth, and is above that of a law that pulls, exp(−π·ζ/√(1−ζ²)).
//!
//! Source: D. Stoianovici, Y. Hurmuzlu, J. Appl. Mech. 63 (1996) 307; the angle: δ̇ and F of the damped oscillator.

use super::law::{Damping, Law};

pub(super) static LAW: Law = Law {
    id: "kelvin-voigt",
    name: "Kelvin–Voigt, separating",
    equation: "F = max(0, k·δ + c·dδ/dt)",
    source: "Stoianovici and Hurmuzlu, J. Appl. Mech. 63 (1996) 307",
    exponent: false,
    damping: Damping::Dashpot,
};
