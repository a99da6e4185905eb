//! The data set: the paper's plan of tests, and a wider one for the sensor's own forecast, both simulated.
//!
//! A *session* is the rig as it was put together on one day for one region: springs, pad, friction, damping and the robot's
//! calibration are drawn once for it, around what the experimenter believes; speed and springs scatter from impact to impact.

use std::str::FromStr as _;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use thud_firmware::limits::Region;
use thud_sim::mechanism::Effect;
use thud_sim::rig::{pad_of, spring_set_of};

use crate::campaign::{Estimate, Rig, RigKind, SPRING_REPEATABILITY};
use crate::simulation::{Doubt, Imperfection, Plan};

/// The paper's five body regions.
pub const REGIONS: [Region; 5] = [Region::Skull, Region::Face, Region::Neck, Region::Chest, Region::Back];
/// The paper's four configurations, degrees: table 1.
pub const POSTURES_DEG: [[f64; 7]; 4] = [
    [-56.6, 87.6, -90.0, 109.2, 2.9, 52.5, 90.0],
    [-38.1, 45.5, -135.0, 109.2, -2.8, 52.5, 151.1],
    [-14.2, 36.6, -167.0, 109.2, -4.5, 53.7, 174.6],
    [14.7, 39.7, -25.6, -107.2, 167.2, 56.6, 30.9],
];
/// Effective mass at the flange along +x of the base in these, kg, by Drake's figures; `thud mass` on examples/robots/iiwa14.urdf gives
/// nearly the same (a test says how nearly).
pub const MASSES_KG: [f64; 4] = [6.08, 6.09, 6.01, 5.91];
/// Speeds, m/s. The paper's figure 6 has a range without naming its values; this one spans its forces, 60 to 450 N.
pub const SPEEDS_M_PER_S: [f64; 9] = [0.10, 0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45, 0.50];
/// The part of the mass behind the elastic joints, and their mode in Hz, in each configuration: within what is known of an iiwa
/// (10 to 28 Hz), and another one in each posture.
const JOINTS: [(f64, f64); 4] = [(0.10, 22.0), (0.14, 19.0), (0.18, 16.0), (0.12, 25.0)];
/// Samples per second of the paper's NI 9230.
const PAPER_RATE_HZ: f64 = 12_800.0;
/// Samples per second of the sensor.
const SENSOR_RATE_HZ: f64 = 20_000.0;
/// Impacts of a session of the wide plan: masses and speeds, drawn for each session.
const WIDE: (usize, usize) = (3, 4);

/// Which plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// The paper's: four configurations, nine speeds, five regions.
    #[default]
    Paper,
    /// All regions, with and without a pad, masses of 2.5 to 20 kg, speeds of 0.05 to 0.6 m/s: what a sensor may meet.
    Wide,
}

impl Kind {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Paper, Self::Wide];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Wide => "wide",
        }
    }
}

/// The campaigns of a plan with the names of their folders.
#[must_use]
pub fn campaigns(kind: Kind, sessions: usize, seed: u64) -> Vec<(String, Plan)> {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let regions: &[Region] = match kind {
        Kind::Paper => &REGIONS,
        Kind::Wide => &Region::ALL,
    };
    regions
        .iter()
        .flat_map(|region| (1..=sessions).map(move |session| (*region, session)))
        .map(|(region, session)| (format!("{}-{session}", region.name()), plan(kind, region, session, &mut chance)))
        .collect()
}

/// A number between two, each power of ten as likely.
fn between(low: f64, high: f64, chance: &mut ChaCha8Rng) -> f64 {
    low * (high / low).powf(chance.random::<f64>())
}

fn effect(text: &str) -> Effect {
    Effect::from_str(text).expect("its parameters are within their ranges")
}

fn plan(kind: Kind, region: Region, session: usize, chance: &mut ChaCha8Rng) -> Plan {
    let stiffness = spring_set_of(region).stiffness_n_per_m();
    let pad = pad_of(region).typical_stiffness_n_per_m().round();
    let piece_kg = 0.12;
    // Nearly elastic, as the paper found: restitution of 0.92 to 0.99 at 0.4 m/s.
    let damping = format!("hunt-crossley-damping:alpha_s_per_m={}", between(0.02, 0.2, chance));
    let friction = format!("guide-friction:force_N={}", between(0.3, 3.0, chance));
    let mut effects =
        vec![effect(&damping), effect(&friction), effect(&format!("moving-piece-inertia:mass_kg={piece_kg}"))];
    if chance.random_bool(0.5) {
        effects.push(effect(&format!("robot-push:force_N={},reaction_s=100", between(5.0, 30.0, chance))));
    }
    let elastic = |(fraction, frequency): (f64, f64)| {
        effect(&format!("joint-elasticity:link_fraction={fraction},frequency_Hz={frequency}"))
    };
    let with_pad = kind == Kind::Paper || chance.random_bool(0.7);
    let (masses, speeds, limited): (Vec<f64>, Vec<f64>, Vec<(Effect, String)>) = match kind {
        Kind::Paper => (
            MASSES_KG.to_vec(),
            SPEEDS_M_PER_S.to_vec(),
            JOINTS.iter().zip(1..).map(|(joint, number)| (elastic(*joint), number.to_string())).collect(),
        ),
        Kind::Wide => {
            let masses: Vec<f64> = (0..WIDE.0).map(|_| between(2.5, 20.0, chance)).collect();
            let speeds = (0..WIDE.1).map(|_| between(0.05, 0.6, chance)).collect();
            let limited = (1..=masses.len())
                .map(|number| {
                    let joint = (between(0.02, 0.2, chance), between(12.0, 28.0, chance));
                    (elastic(joint), number.to_string())
                })
                .collect();
            (masses, speeds, limited)
        }
    };
    Plan {
        name: format!("{}, session {session}", region.name()),
        rig: Rig {
            kind: RigKind::Impact,
            body_stiffness_n_per_m: Some(Estimate::new(stiffness, 0.03 * stiffness)),
            pad_stiffness_n_per_m: with_pad.then(|| Estimate::new(pad, (0.15 * pad).round())),
            moving_mass_kg: Some(Estimate::new(piece_kg, 0.08 * piece_kg)),
            gravity_along_impact_m_per_s2: 0.0,
            spring_repeatability: SPRING_REPEATABILITY,
        },
        effects,
        limited,
        speeds_m_per_s: speeds,
        masses_kg: masses,
        repeats: 1,
        doubt: Doubt { speed: 0.01, mass: 0.03 },
        sample_rate_hz: match kind {
            Kind::Paper => PAPER_RATE_HZ,
            Kind::Wide => SENSOR_RATE_HZ,
        },
        full_scale_n: 2_224.0,
        imperfection: Imperfection { noise_n: 0.3, hum_n: 0.2, drift_n_per_s: 0.014 },
        before_s: 0.06,
        after_s: match kind {
            Kind::Paper => 0.18,
            Kind::Wide => 0.16,
        },
        displacement_noise_m: (kind == Kind::Paper).then_some(20e-6),
        height_noise_m: 0.001,
        seed: chance.random(),
    }
}

/// The file beside the campaigns that says what posture each configuration is.
pub const POSTURES_FILE: &str = "postures.csv";

/// Its text.
#[must_use]
pub fn postures_csv() -> String {
    let mut text = String::from("configuration,A1_deg,A2_deg,A3_deg,A4_deg,A5_deg,A6_deg,A7_deg\n");
    for (posture, number) in POSTURES_DEG.iter().zip(1..) {
        let values: Vec<String> = posture.iter().map(ToString::to_string).collect();
        text.push_str(&format!("{number},{}\n", values.join(",")));
    }
    text
}
