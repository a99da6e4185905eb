//! The paper's plan: three masses, two heights, the rig's stiffnesses.

use serde::Serialize;
use thud_firmware::limits::Region;

use super::closed_form::{alone_as_printed_n, alone_n, deviation_percent, energy_j, speed_m_per_s, together_n};
use super::two_bodies::{NoMotion, peak_n};

/// Falling masses, kg.
pub const MASSES_KG: [f64; 3] = [0.021_59, 0.028_30, 0.041_24];
/// Heights of the fall, m.
pub const HEIGHTS_M: [f64; 2] = [0.040, 0.070];

/// The stiffnesses that stand for body regions, N/m, each once, softest first.
#[must_use]
pub fn stiffnesses_n_per_m() -> Vec<f64> {
    let mut all: Vec<f64> = Region::ALL.iter().map(|region| f64::from(region.body().stiffness.0)).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// One drop, by every model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
pub struct Row {
    /// Falling mass.
    pub mass_kg: f64,
    /// Height of the fall.
    pub height_m: f64,
    /// The rig's springs together.
    pub stiffness_N_per_m: f64,
    /// Mass of the impact piece.
    pub piece_kg: f64,
    /// At contact: (18).
    pub speed_m_per_s: f64,
    /// Of the fall: (19).
    pub energy_J: f64,
    /// Two bodies that part again.
    pub two_bodies_N: f64,
    /// (24), corrected: the piece has no mass.
    pub alone_N: f64,
    /// (24) as printed.
    pub alone_as_printed_N: f64,
    /// (22) with c_r = 1.
    pub together_elastic_N: f64,
    /// (22) with c_r = 0, as ISO/TS 15066 would have it.
    pub together_inelastic_N: f64,
    /// Δ % of each model against the two bodies: (23).
    pub alone_deviation_percent: f64,
    /// The same for (24) as printed.
    pub alone_as_printed_deviation_percent: f64,
    /// The same for (22), c_r = 1.
    pub together_elastic_deviation_percent: f64,
    /// The same for (22), c_r = 0.
    pub together_inelastic_deviation_percent: f64,
}

/// One drop, by every model.
///
/// # Errors
/// [`NoMotion`] where the simulation refuses a number.
pub fn row(mass_kg: f64, height_m: f64, stiffness: f64, piece_kg: f64) -> Result<Row, NoMotion> {
    let two_bodies = peak_n(mass_kg, piece_kg, stiffness, height_m)?;
    let alone = alone_n(mass_kg, stiffness, height_m);
    let printed = alone_as_printed_n(mass_kg, stiffness, height_m);
    let together = |restitution| together_n(mass_kg, piece_kg, stiffness, restitution, height_m);
    let deviation = |model| deviation_percent(model, two_bodies);
    Ok(Row {
        mass_kg,
        height_m,
        stiffness_N_per_m: stiffness,
        piece_kg,
        speed_m_per_s: speed_m_per_s(height_m),
        energy_J: energy_j(mass_kg, height_m),
        two_bodies_N: two_bodies,
        alone_N: alone,
        alone_as_printed_N: printed,
        together_elastic_N: together(1.0),
        together_inelastic_N: together(0.0),
        alone_deviation_percent: deviation(alone),
        alone_as_printed_deviation_percent: deviation(printed),
        together_elastic_deviation_percent: deviation(together(1.0)),
        together_inelastic_deviation_percent: deviation(together(0.0)),
    })
}
