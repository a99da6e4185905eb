//! What is simulated: a region, a robot, three speeds around the permitted one; all from one seed.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use thud_firmware::limits::{LimitsProfile, Region, TransientLimit};
use thud_sim::mechanism::{Effect, MechanismError};
use thud_sim::rig::{Approach, Rig, pad_of, spring_set_of};

/// Speeds over the permitted one: certainly below, near, certainly above.
const OF_PERMITTED: [f64; 3] = [0.6, 1.0, 1.35];

/// A rig, a robot and its speeds.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Starts everything, the noise too.
    pub seed: u64,
    /// Serial number of the board.
    pub serial: u32,
    /// The body region that the rig stands for.
    pub region: Region,
    /// The rig as it is.
    pub rig: Rig,
    /// What it has beyond the ideal impact.
    pub effects: Vec<Effect>,
    /// Effective mass of the robot, kg.
    pub true_mass_kg: f64,
    /// What the robot's controller says, kg.
    pub believed_mass_kg: f64,
    /// Speeds at contact, m/s.
    pub speeds_m_per_s: Vec<f64>,
}

impl Scenario {
    /// The scenario of a seed.
    ///
    /// # Errors
    /// None of the values is refused by the mechanisms' own ranges; were one, it is said.
    pub fn from_seed(seed: u64) -> Result<Self, MechanismError> {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        // Regions on which a transient contact may pass.
        let regions: Vec<(Region, f64)> = Region::ALL
            .into_iter()
            .filter_map(|region| match LimitsProfile::IsoTs15066.limits(region).transient {
                TransientLimit::UpTo(limit) => Some((region, f64::from(limit.0))),
                TransientLimit::NotPermitted => None,
            })
            .collect();
        let (region, limit_n) = regions[chance.random_range(0..regions.len())];
        let true_mass_kg = chance.random_range(4.0..9.0_f64);
        // The controller's own model of the robot is off by a few per cent.
        let believed_mass_kg = true_mass_kg * chance.random_range(0.97..1.03);
        let springs = spring_set_of(region).stiffness_n_per_m() * chance.random_range(0.97..1.03);
        let pad = pad_of(region).typical_stiffness_n_per_m() * chance.random_range(0.8..1.25);
        let rig = Rig::impact(springs).with_pad(pad);
        let damping = chance.random_range(0.02..0.3);
        let effects = vec![Effect::new("hunt-crossley-damping", &[("alpha_s_per_m", damping)])?];
        // v = F_limit/(S·√(k·m)) of the ideal impact; damping makes it a little less.
        let body_kg = f64::from(region.body().effective_mass.0);
        let scaling = (body_kg / (body_kg + believed_mass_kg)).sqrt();
        let permitted = limit_n / (scaling * (rig.effective_stiffness_n_per_m() * true_mass_kg).sqrt());
        let speeds_m_per_s = OF_PERMITTED.map(|share| share * permitted * chance.random_range(0.97..1.03)).to_vec();
        let serial = chance.random_range(1..1_000_000);
        Ok(Self { seed, serial, region, rig, effects, true_mass_kg, believed_mass_kg, speeds_m_per_s })
    }

    /// The approaches of the robot, in order.
    #[must_use]
    pub fn approaches(&self) -> Vec<Approach> {
        let approach = |(order, speed): (usize, &f64)| Approach {
            order: order as u32,
            ..Approach::new(*speed, self.true_mass_kg)
        };
        self.speeds_m_per_s.iter().enumerate().map(approach).collect()
    }
}
