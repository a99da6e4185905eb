//! How fast a robot may be where it can hit a body region.
//!
//! ```text
//! μ = (1/m_H + 1/m_R)⁻¹        E = F²/2K = ½ μ v²        v = F/√(Kμ)              (1)–(3), and (4) corrected
//! F = min(F_limit, p_limit·A)                             A: area of contact
//! S = √(μ/m_R),  a rigid rig may read up to F/S                                   (5), (6)
//! ∂ln v/∂ln m_R = −½ μ/m_R                                                        between −½ and 0
//!
//! F ∝ δⁿ through the limit at the region's stroke F/K:    E = F²/((n + 1)K)       S = (μ/m_R)^(n/(n+1))
//! ```
//!
//! The paper prints (4) as F = √(2Kμ)·v; from its own energy balance (2) there is no 2. K is the region's alone: a soft
//! pad on the rig, or on the robot, is credited to nobody, because nobody knows that it will be between the robot and
//! the person (the paper's +63 % does that).
//!
//! A harder law (n > 1) through the same point stores less energy, so it permits less speed; a softer one would permit
//! more than the standard's spring, and is refused. A larger m_R lowers v, which is careful, and lowers S, which is
//! not: the same reading then looks milder.

use thud_firmware::limits::{LimitsProfile, Region, TransientLimit};

use super::area::Area;

/// Exponents that are taken; the paper's fits were 0.98 to 1.13, a sphere on a plane has 1.5.
pub const EXPONENTS: std::ops::RangeInclusive<f64> = 1.0..=3.0;
/// Effective masses that are taken, kg: what the sensor takes.
pub const MASSES_KG: std::ops::RangeInclusive<f64> = 0.05..=1000.0;

/// What is asked.
#[derive(Clone, Copy, Debug)]
pub struct Question<'a> {
    /// The region that may be hit.
    pub region: Region,
    /// Table of limits.
    pub limits: LimitsProfile,
    /// Effective mass of the robot, kg.
    pub robot_kg: f64,
    /// Exponent n of the contact law; 1 is the standard's spring.
    pub exponent: f64,
    /// Area of contact, cm², and the body area whose pressure limit holds there; the region's lowest where none is named.
    pub contact: Option<(f64, Option<&'a Area>)>,
}

/// Which limit decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Decides {
    /// The force on the region.
    Force,
    /// The pressure on the area.
    Pressure,
}

/// What is permitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Permission {
    /// Transient force limit of the region, N.
    pub force_limit_n: f64,
    /// Transient pressure limit N/cm², and the body area that has it, where an area of contact was given.
    pub pressure: Option<(f64, &'static Area)>,
    /// Largest closing speed by force, m/s.
    pub by_force_m_per_s: f64,
    /// Largest closing speed by pressure, m/s.
    pub by_pressure_m_per_s: Option<f64>,
    /// The smaller of both.
    pub permitted_m_per_s: f64,
    /// Which one it is.
    pub decides: Decides,
    /// The force that goes with it, N.
    pub force_n: f64,
    /// Compression of the region at that force, m.
    pub stroke_m: f64,
    /// Energy that the region takes up, J.
    pub energy_j: f64,
    /// Reduced mass μ, kg.
    pub reduced_mass_kg: f64,
    /// S: force on a free body over the reading of a rigid rig.
    pub scaling: f64,
    /// What a rigid rig with the region's spring may read, N: force / S.
    pub rig_reading_n: f64,
    /// Relative change of the speed by relative change of m_R, −½ to 0.
    pub sensitivity: f64,
}

/// Why nothing is permitted, or nothing can be said.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum Refusal {
    /// Skull or face.
    #[error("transient contact with the {} is not permitted at any speed", region.name())]
    #[diagnostic(help(
        "keep the robot away from the head (safety distance, guards, a lower tool); the quasi-static limits of `thud limits` are \
         for clamping only and no permission to hit"
    ))]
    NotPermitted {
        /// Which.
        region: Region,
    },
    /// A mass that no robot has.
    #[error("an effective mass of {0} kg is none that a robot has: {low} to {high} kg are taken", low = MASSES_KG.start(), high = MASSES_KG.end())]
    #[diagnostic(help("`thud mass` computes it from the robot's description and posture"))]
    Mass(f64),
    /// An exponent that would permit more than the standard, or is no law.
    #[error("an exponent of {0} is not taken: {low} to {high} are", low = EXPONENTS.start(), high = EXPONENTS.end())]
    #[diagnostic(help(
        "a law that softens would permit more speed than the standard's spring, which is credited to nobody"
    ))]
    Exponent(f64),
    /// An area of contact that is none.
    #[error("an area of contact of {0} cm² is not possible")]
    #[diagnostic(help("give the smallest area in cm² that the robot can touch with, above 0"))]
    ContactArea(f64),
    /// A body area of another region.
    #[error("body area {} ({}) is on the {}, not on the {}", area.number, area.name, area.region.name(), region.name())]
    #[diagnostic(help("`thud limits --region {}` lists the areas of the region", region.name()))]
    AreaElsewhere {
        /// The area.
        area: Area,
        /// The region that was asked for.
        region: Region,
    },
    /// The older table has no pressures for the areas.
    #[error("the table bgia-2011 has no pressures of the 29 body areas, and tables are not mixed")]
    #[diagnostic(help("leave the area of contact out, or take --limits iso-ts-15066-2016"))]
    PressureOfOtherTable,
}

/// μ, kg.
#[must_use]
pub fn reduced_mass_kg(body_kg: f64, robot_kg: f64) -> f64 {
    body_kg * robot_kg / (body_kg + robot_kg)
}

/// S for a contact law F ∝ δⁿ.
#[must_use]
pub fn scaling(body_kg: f64, robot_kg: f64, exponent: f64) -> f64 {
    (body_kg / (body_kg + robot_kg)).powf(exponent / (exponent + 1.0))
}

/// Energy in a region that is pressed with this force, J; K in N/m.
#[must_use]
pub fn energy_j(force_n: f64, stiffness_n_per_m: f64, exponent: f64) -> f64 {
    force_n * force_n / ((exponent + 1.0) * stiffness_n_per_m)
}

/// Closing speed at which the peak is this force, m/s.
#[must_use]
pub fn speed_m_per_s(force_n: f64, stiffness_n_per_m: f64, reduced_mass_kg: f64, exponent: f64) -> f64 {
    (2.0 * energy_j(force_n, stiffness_n_per_m, exponent) / reduced_mass_kg).sqrt()
}

/// What a region permits.
///
/// # Errors
/// [`Refusal`].
pub fn permit(question: &Question<'_>) -> Result<Permission, Refusal> {
    let &Question { region, limits, robot_kg, exponent, contact } = question;
    if !MASSES_KG.contains(&robot_kg) {
        return Err(Refusal::Mass(robot_kg));
    }
    if !EXPONENTS.contains(&exponent) {
        return Err(Refusal::Exponent(exponent));
    }
    let TransientLimit::UpTo(limit) = limits.limits(region).transient else {
        return Err(Refusal::NotPermitted { region });
    };
    let pressure = contact.map(|(area_cm2, area)| pressure(region, limits, area_cm2, area)).transpose()?;

    let body = region.body();
    let stiffness = f64::from(body.stiffness.0);
    // The table has it in decimals: 4.4 kg, not the nearest f32.
    let body_kg = crate::decimal::decimal(body.effective_mass.0);
    let reduced = reduced_mass_kg(body_kg, robot_kg);
    let force_limit_n = f64::from(limit.0);
    let speed = |force: f64| speed_m_per_s(force, stiffness, reduced, exponent);
    let by_force = speed(force_limit_n);
    let by_pressure = pressure.map(|(force, ..)| speed(force));
    let (force_n, decides) = match pressure {
        Some((force, ..)) if force < force_limit_n => (force, Decides::Pressure),
        _ => (force_limit_n, Decides::Force),
    };
    let scaling = scaling(body_kg, robot_kg, exponent);
    Ok(Permission {
        force_limit_n,
        pressure: pressure.map(|(_, limit, area)| (limit, area)),
        by_force_m_per_s: by_force,
        by_pressure_m_per_s: by_pressure,
        permitted_m_per_s: speed(force_n),
        decides,
        force_n,
        stroke_m: force_n / stiffness,
        energy_j: energy_j(force_n, stiffness, exponent),
        reduced_mass_kg: reduced,
        scaling,
        rig_reading_n: force_n / scaling,
        sensitivity: -0.5 * reduced / robot_kg,
    })
}

/// Force at which the pressure limit is reached, N; the limit, N/cm²; and whose it is.
fn pressure(
    region: Region,
    limits: LimitsProfile,
    contact_cm2: f64,
    area: Option<&Area>,
) -> Result<(f64, f64, &'static Area), Refusal> {
    if limits == LimitsProfile::Bgia2011 {
        return Err(Refusal::PressureOfOtherTable);
    }
    if !(contact_cm2.is_finite() && contact_cm2 > 0.0) {
        return Err(Refusal::ContactArea(contact_cm2));
    }
    if let Some(area) = area
        && area.region != region
    {
        return Err(Refusal::AreaElsewhere { area: *area, region });
    }
    Area::of(region)
        .filter(|candidate| area.is_none_or(|area| area.number == candidate.number))
        .filter_map(|area| Some((area.transient_n_per_cm2()?, area)))
        .min_by(|one, other| one.0.total_cmp(&other.0))
        .map(|(limit, area)| (limit * contact_cm2, limit, area))
        .ok_or(Refusal::NotPermitted { region })
}
