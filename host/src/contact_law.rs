//! Contact laws: which force answers a depth and its rate, identified from all recordings of a campaign together.
//!
//! ```text
//!   ⟨Loaded⟩ ─▶ blow (the first contact: zero, noise, window) ─▶ depth (measured, or F integrated twice)
//!                     │                                              │
//!                     ▼                                              ▼
//!               identifiable: what these recordings cannot tell is said, not fitted
//!                     │
//!                     ▼
//!   law ─▶ motion ─▶ fit (all recordings at once) ─▶ intervals ─▶ held out ─▶ identification
//!                                                                              ├─▶ answer (JSON), shown (page)
//!                                                                              └─▶ found_model (model file)
//! ```
//!
//! A law is one file: its equation with its source, what it loses, and the restitution that it claims. All are of one form,
//!
//! ```text
//!   F = k·δⁿ·(1 + λ·δ̇) + c·δ̇,  F ≥ 0: contact pushes and never pulls
//!   λ = 0 (linear, Hertz) | 3α/2 (Hunt and Crossley) | D/v₀ (Lankarani–Nikravesh, Flores, Gonthier);  c: Kelvin–Voigt
//! ```
//!
//! The three laws with λ = D/v₀ give the same force to the last bit and differ only in the restitution that they read from
//! it. No recording of force and depth tells them apart; the restitution that was measured does.
//!
//! The compendium: M. R. Silva, F. Marques, M. Tavares da Silva, P. Flores, Mech. Mach. Theory 167 (2022) 104501.

mod answer;
mod blow;
mod depth;
mod fit;
mod flores;
mod found_model;
mod gonthier;
mod hertz;
mod hunt_crossley;
mod hysteresis;
mod identifiable;
mod identification;
mod kelvin_voigt;
mod lankarani_nikravesh;
mod law;
mod linear;
mod motion;
mod refusal;
pub mod shown;

pub use answer::{Answer, answer};
pub use depth::Source;
pub use found_model::{NearestModel, nearest_model, to_toml};
pub use hysteresis::{loss_of_restitution, restitution_of_loss};
pub use identification::{Identification, Identified, Options, Parameter, identify};
pub use law::{Damping, Force, Law, Values};
pub use motion::{Motion, restitution};
pub use refusal::NotIdentified;

/// Every law, simple ones first.
pub static LAWS: &[&Law] = &[
    &linear::LAW,
    &hertz::LAW,
    &kelvin_voigt::LAW,
    &hunt_crossley::LAW,
    &lankarani_nikravesh::LAW,
    &flores::LAW,
    &gonthier::LAW,
];

#[cfg(test)]
mod tests;
