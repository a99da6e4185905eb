//! The estimate of ISO/TS 15066, Annex A: m_R = M/2 + m_L.
//!
//! M is the mass of the robot's moving parts, m_L that of the load. It knows neither posture nor direction: along an
//! axis in which the arm gives way it overstates m_R several times, which lowers the permitted speed (careful) and
//! lowers S (not careful).

use super::Robot;

/// M/2 + m_L, kg.
#[must_use]
pub fn iso_estimate_kg(robot: &Robot, load_kg: f64) -> f64 {
    robot.moving_mass_kg() / 2.0 + load_kg
}
