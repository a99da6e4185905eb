//! The falling mass and the impact piece as two bodies, on the simulated rig.
//!
//! They meet over a stiff elastic contact, part, and meet again; the cell feels the springs under the piece. The
//! piece's weight rests on the springs from the beginning and is not in the reading.

use thud_sim::mechanism::{Effect, MechanismError};
use thud_sim::rig::{Accuracy, Approach, Impact, Rig, RigError};

/// Stiffness of the bare contact between metal and printed piece, N/m; the peak hardly depends on it.
pub const CONTACT_N_PER_M: f64 = 2e6;

/// Why there is no motion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoMotion {
    /// A number that no rig has.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// A piece that the simulation does not know.
    #[error(transparent)]
    Piece(#[from] MechanismError),
}

/// The piece as a body of its own, without any loss.
///
/// # Errors
/// A mass out of range, with the range.
pub fn piece(mass_kg: f64) -> Result<Effect, MechanismError> {
    Effect::new(
        "moving-piece-inertia",
        &[
            ("mass_kg", mass_kg),
            ("pad_damping_ratio", 0.0),
            ("spring_damping_ratio", 0.0),
            ("contact_stiffness_N_per_m", CONTACT_N_PER_M),
        ],
    )
}

/// The motion until the mass has been thrown up again: one and a half times the half period of both masses on the spring.
///
/// # Errors
/// [`NoMotion`].
pub fn motion(mass_kg: f64, piece_kg: f64, stiffness_n_per_m: f64, height_m: f64) -> Result<Impact, NoMotion> {
    let effects = if piece_kg > 0.0 { vec![piece(piece_kg)?] } else { Vec::new() };
    let until = 1.5 * std::f64::consts::PI * ((mass_kg + piece_kg) / stiffness_n_per_m).sqrt();
    let approach = Approach::dropped_from(height_m, mass_kg);
    Ok(Rig::drop(stiffness_n_per_m).strike(&approach, &effects, until, Accuracy::default())?)
}

/// Instants at which the highest force is looked for.
const LOOKS: u32 = 4000;

/// Highest force at the cell, N.
///
/// # Errors
/// [`NoMotion`].
pub fn peak_n(mass_kg: f64, piece_kg: f64, stiffness_n_per_m: f64, height_m: f64) -> Result<f64, NoMotion> {
    let motion = motion(mass_kg, piece_kg, stiffness_n_per_m, height_m)?;
    let end = motion.end_s();
    Ok((0..=LOOKS).map(|look| motion.force_n(end * f64::from(look) / f64::from(LOOKS))).fold(0.0, f64::max))
}
