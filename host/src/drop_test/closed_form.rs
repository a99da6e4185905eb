//! Equations 18 to 24 of the paper.
//!
//! ```text
//! v = √(2gh)        E = Mgh                                                              (18), (19)
//! V_m = M(1 + c_r)v/(m + M)      V_M = v − m(1 + c_r)v/(m + M)                           (20), piece at rest
//! F = (m + M)g + √(((m + M)g)² + k(mV_m² + MV_M²))                                       (22)
//! F* = Mg(1 + √(1 + 2kh/(Mg)))                                                           (24), corrected
//! ```
//!
//! **(24)** is printed with g² under the root, where (22) with m = 0 leaves one g; 2kh/(Mg²) would even have a unit.
//! For M = 41.2 g, h = 40 mm, k = 75 N/mm it is 49.7 N, as printed 16.1 N.
//!
//! **(21), and with it (22),** lets both masses come to rest at the same instant. With c_r = 1 they part at once, so
//! that the piece alone compresses the spring until they meet again: [`super::two_bodies`]. Nor is the piece's mass
//! negligible, if c_r = 0 is to underestimate by 41 to 55 %, as the paper found: without mass it would underestimate by
//! nothing.

use thud_sim::rig::STANDARD_GRAVITY_M_PER_S2 as G;

/// Speed after a fall from rest, m/s: (18).
#[must_use]
pub fn speed_m_per_s(height_m: f64) -> f64 {
    (2.0 * G * height_m).sqrt()
}

/// Energy of the fall, J: (19).
#[must_use]
pub fn energy_j(mass_kg: f64, height_m: f64) -> f64 {
    mass_kg * G * height_m
}

/// Velocities of the piece and of the falling mass just after they met, m/s: (20), with the piece at rest before.
#[must_use]
pub fn after_contact_m_per_s(mass_kg: f64, piece_kg: f64, restitution: f64, speed_m_per_s: f64) -> (f64, f64) {
    let exchanged = (1.0 + restitution) * speed_m_per_s / (piece_kg + mass_kg);
    (mass_kg * exchanged, speed_m_per_s - piece_kg * exchanged)
}

/// Peak force where both masses stop together, N: (22).
#[must_use]
pub fn together_n(mass_kg: f64, piece_kg: f64, stiffness_n_per_m: f64, restitution: f64, height_m: f64) -> f64 {
    let (piece, mass) = after_contact_m_per_s(mass_kg, piece_kg, restitution, speed_m_per_s(height_m));
    let weight = (mass_kg + piece_kg) * G;
    weight + (weight * weight + stiffness_n_per_m * (piece_kg * piece * piece + mass_kg * mass * mass)).sqrt()
}

/// Peak force of a mass on a spring whose piece has none, N: (24), corrected.
#[must_use]
pub fn alone_n(mass_kg: f64, stiffness_n_per_m: f64, height_m: f64) -> f64 {
    let weight = mass_kg * G;
    weight * (1.0 + (1.0 + 2.0 * stiffness_n_per_m * height_m / weight).sqrt())
}

/// (24) as it is printed, with g² under the root: for comparison only.
#[must_use]
pub fn alone_as_printed_n(mass_kg: f64, stiffness_n_per_m: f64, height_m: f64) -> f64 {
    mass_kg * G * (1.0 + (1.0 + 2.0 * stiffness_n_per_m * height_m / (mass_kg * G * G)).sqrt())
}

/// Δ %, by how much a model is above an observed force: (23).
#[must_use]
pub fn deviation_percent(model_n: f64, observed_n: f64) -> f64 {
    100.0 * (model_n - observed_n) / observed_n
}
