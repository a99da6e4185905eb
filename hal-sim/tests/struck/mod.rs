//! A sensor under the simulated rig: what it makes of the contact instant, and what no estimator could do better.

#![allow(dead_code, reason = "the test and the bench use their parts")]

use nalgebra::{SMatrix, SVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use thud_firmware::board::{BLOCK, BlockInfo};
use thud_firmware::capture::CAPTURE;
use thud_firmware::configuration::Configuration;
use thud_firmware::detector::{Signal, Stamped};
use thud_firmware::event::Event;
use thud_firmware::sensor::Sensor;
use thud_firmware::units::{Hertz, Newton, Volt};
use thud_sim::chain::{ChainSettings, Hum, MeasuringChain, Noise};
use thud_sim::mechanism::Effect;
use thud_sim::rig::{Accuracy, Approach, Impact, Quantity, Rig};

/// Samples per second.
pub const RATE: f64 = 20_000.0;
/// White noise, N rms.
pub const NOISE_N: f64 = 0.3;

/// One rig and one approach.
#[derive(Clone, Debug)]
pub struct Case {
    /// Stiffness of the body springs, N/m.
    pub body_n_per_m: f64,
    /// Stiffness of the pad, N/m.
    pub pad_n_per_m: f64,
    /// Mass of the moving piece, kg.
    pub piece_kg: f64,
    /// Damping ratio of the ring by the pad and by the springs.
    pub damping: (f64, f64),
    /// Speed at contact, m/s.
    pub speed_m_per_s: f64,
    /// Effective mass of the robot, kg.
    pub robot_kg: f64,
    /// Mechanisms besides the piece, as text.
    pub further: &'static [&'static str],
}

/// The contact is this long after power-up, to within a twentieth of a second, s.
const CONTACT_S: f64 = 2.5;

/// Long enough for the piece to come to rest after the robot has left, s.
const SIMULATED_S: f64 = 2.0;

impl Case {
    /// Simulates the impact for `until_s`.
    pub fn strike(&self, until_s: f64) -> Impact {
        let piece = format!(
            "moving-piece-inertia:mass_kg={},pad_damping_ratio={},spring_damping_ratio={}",
            self.piece_kg, self.damping.0, self.damping.1
        );
        let effects: Vec<Effect> = std::iter::once(piece.as_str())
            .chain(self.further.iter().copied())
            .map(|text| text.parse().expect("a known mechanism"))
            .collect();
        Rig::impact(self.body_n_per_m)
            .with_pad(self.pad_n_per_m)
            .strike(&Approach::new(self.speed_m_per_s, self.robot_kg), &effects, until_s, Accuracy::default())
            .unwrap_or_else(|error| panic!("{self:?}: {error}"))
    }

    /// Stiffness of pad and springs in series, N/m.
    pub fn stiffness_n_per_m(&self) -> f64 {
        1.0 / (1.0 / self.body_n_per_m + 1.0 / self.pad_n_per_m)
    }

    /// Frequency of the ring, Hz.
    pub fn ring_hertz(&self) -> f64 {
        ((self.pad_n_per_m + self.body_n_per_m) / self.piece_kg).sqrt() / std::f64::consts::TAU
    }

    /// About when the robot has left, s after contact.
    pub fn duration_s(&self) -> f64 {
        std::f64::consts::PI * (self.robot_kg / self.stiffness_n_per_m()).sqrt()
    }

    /// Errors of the contact instant over some seeds, s.
    pub fn errors_s(&self, seeds: std::ops::Range<u64>) -> Vec<f64> {
        let impact = self.strike(SIMULATED_S);
        seeds.map(|seed| self.sensed(&impact, seed).1).collect()
    }

    /// One impact through the workshop chain: the first event and the error of its contact instant, s.
    pub fn sensed(&self, impact: &Impact, seed: u64) -> (Event, f64) {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x0072_6967);
        let contact_s = CONTACT_S + random.random_range(0.0..0.05);
        let mut settings = ChainSettings::workshop();
        settings.noise = Noise { white: Newton(NOISE_N as f32), coloured: None };
        settings.hum = Some(Hum {
            fundamental: Hertz(random.random_range(49.8..50.2)),
            amplitude: Newton(0.5),
            harmonics: Vec::new(),
        });
        let mut chain = MeasuringChain::new(&settings, seed);
        let configuration = Configuration::DEFAULT;
        let mut sensor = Box::new(Sensor::<CAPTURE>::new(Stamped { configuration, revision: 1, hash: 0 }));
        let mut events = Vec::new();
        for block in 0.. {
            let first_index = block * BLOCK as u64;
            assert!(first_index < 15 * RATE as u64, "{self:?}, seed {seed}: no event");
            let times: Vec<f64> =
                (0..BLOCK as u64).map(|index| (first_index + index) as f64 / RATE - contact_s).collect();
            let mut newtons = impact.sample(Quantity::CellForce, &times);
            let mut codes = [0; BLOCK];
            chain.convert(&mut newtons, &mut codes);
            for signal in sensor.push(&codes, &BlockInfo { first_index, bias: Volt(11.0) }) {
                if let Signal::Over(context) = signal {
                    events.extend(sensor.evaluate(&context));
                }
            }
            if !events.is_empty() {
                break;
            }
        }
        let event = events[0];
        let sensed_s = (event.contact_instant.index as f64 + f64::from(event.contact_instant.fraction)) / RATE;
        (event, sensed_s - contact_s)
    }

    /// Cramér–Rao bound of the contact instant, s: what no unbiased estimator can beat that does not know the rig.
    ///
    /// The force of robot m_R, pad k_p, c_p, piece m and springs k_b, c_b depends on seven quantities with the speed v.
    /// All masses, stiffnesses and dampings larger by one factor and v smaller by it give the same force, so that six numbers
    /// are to be told from it besides the instant: here v, m_R, m, k_p and both damping ratios, with k_b as the unit. None is
    /// taken as known: a robot's effective mass is known to some ten per cent, a pad's stiffness and a piece's ring hardly.
    ///
    /// Every sample until the robot leaves counts, so also the instants at which a rattling piece is hit again. The noise is
    /// white with the quantiser's added; zero and hum are known, from the seconds before. Derivatives by central differences
    /// of the simulation.
    pub fn bound_s(&self) -> f64 {
        let until_s = 0.98 * self.duration_s();
        let times: Vec<f64> = (0..(until_s * RATE) as usize).map(|index| index as f64 / RATE).collect();
        let curve = |case: &Self, shift_s: f64| {
            let times: Vec<f64> = times.iter().map(|time| time - shift_s).collect();
            case.strike(until_s + 1e-3).sample(Quantity::CellForce, &times)
        };
        let vary = |change: fn(&mut Self, f64), step: f64| {
            let (mut more, mut less) = (self.clone(), self.clone());
            change(&mut more, step);
            change(&mut less, -step);
            let (more, less) = (curve(&more, 0.0), curve(&less, 0.0));
            more.iter().zip(less).map(|(more, less)| (more - less) / (2.0 * step)).collect::<Vec<f64>>()
        };
        let step_s = 2e-6;
        let (late, early) = (curve(self, step_s), curve(self, -step_s));
        let gradients: [Vec<f64>; 7] = [
            late.iter().zip(early).map(|(late, early)| (late - early) / (2.0 * step_s)).collect(),
            vary(|case, part| case.speed_m_per_s *= 1.0 + part, 1e-3),
            vary(|case, part| case.robot_kg *= 1.0 + part, 1e-3),
            vary(|case, part| case.piece_kg *= 1.0 + part, 1e-3),
            vary(|case, part| case.pad_n_per_m *= 1.0 + part, 1e-3),
            vary(|case, part| case.damping.0 += part, 1e-3),
            vary(|case, part| case.damping.1 += part, 1e-3),
        ];
        // Each gradient at unit length, so that the matrix is well conditioned.
        let lengths = SVector::<f64, 7>::from_fn(|row, _| gradients[row].iter().map(|g| g * g).sum::<f64>().sqrt());
        let fisher = SMatrix::<f64, 7, 7>::from_fn(|row, column| {
            let dot: f64 = gradients[row].iter().zip(&gradients[column]).map(|(a, b)| a * b).sum();
            dot / (lengths[row] * lengths[column])
        });
        let inverse = fisher.try_inverse().expect("independent unknowns");
        let quantiser = f64::from(Configuration::DEFAULT.chain.newton_per_code);
        let variance = NOISE_N * NOISE_N + quantiser * quantiser / 12.0;
        (variance * inverse[(0, 0)]).sqrt() / lengths[0]
    }
}

/// Root mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// What is promised: 50 µs, or 1.5 times the bound where that is larger, s.
pub fn promised_s(bound_s: f64) -> f64 {
    (1.5 * bound_s).max(50e-6)
}

/// The pads of the standard's rig with body springs they are used with, moving pieces, speeds, robots.
pub fn grid() -> Vec<Case> {
    let mut cases = Vec::new();
    for (pad, bodies) in [(1000e3, [40e3, 75e3, 150e3]), (80e3, [25e3, 35e3, 50e3]), (17e3, [10e3, 10e3, 25e3])] {
        for (index, body) in bodies.into_iter().enumerate() {
            if index == 1 && body == bodies[0] {
                continue;
            }
            for (piece_kg, damping) in [(0.05, (0.03, 0.01)), (0.12, (0.05, 0.01)), (0.3, (0.02, 0.005))] {
                for speed_m_per_s in [0.05, 0.15, 0.35, 0.6] {
                    cases.push(Case {
                        body_n_per_m: body,
                        pad_n_per_m: pad,
                        piece_kg,
                        damping,
                        speed_m_per_s,
                        robot_kg: 6.0,
                        further: &[],
                    });
                }
            }
        }
    }
    cases
}

/// Stiffness of a bare contact, N/m: what the mechanism `moving-piece-inertia` takes where there is no pad.
pub const BARE_N_PER_M: f64 = 2e6;

/// No pad: the piece is kicked, flies ahead and rattles.
pub fn bare() -> Vec<Case> {
    let mut cases = Vec::new();
    for body_n_per_m in [10e3, 25e3, 75e3, 150e3] {
        for speed_m_per_s in [0.05, 0.15, 0.35, 0.6] {
            cases.push(Case {
                body_n_per_m,
                pad_n_per_m: BARE_N_PER_M,
                piece_kg: 0.12,
                damping: (0.03, 0.01),
                speed_m_per_s,
                robot_kg: 6.0,
                further: &[],
            });
        }
    }
    cases
}

/// Dampings a few times larger and smaller than the fit expects, lighter and heavier robots and pieces.
pub fn unexpected() -> Vec<Case> {
    let mut cases = Vec::new();
    for (pad_n_per_m, body_n_per_m) in [(BARE_N_PER_M, 25e3), (1000e3, 75e3), (80e3, 35e3), (17e3, 10e3)] {
        for (piece_kg, damping, robot_kg) in
            [(0.12, (0.1, 0.003), 6.0), (0.12, (0.01, 0.03), 6.0), (0.04, (0.03, 0.01), 3.0), (0.3, (0.03, 0.01), 15.0)]
        {
            for speed_m_per_s in [0.05, 0.35] {
                let further: &[&str] = &[];
                cases.push(Case { body_n_per_m, pad_n_per_m, piece_kg, damping, speed_m_per_s, robot_kg, further });
            }
        }
    }
    cases
}

/// Further mechanisms with the piece: a pad that loses energy as it is compressed, a guide that rubs, and both.
pub fn lossy() -> Vec<Case> {
    const FURTHER: [&[&str]; 3] =
        [&["hunt-crossley-damping"], &["guide-friction"], &["hunt-crossley-damping", "guide-friction"]];
    let mut cases = Vec::new();
    for further in FURTHER {
        for (pad_n_per_m, body_n_per_m) in [(1000e3, 75e3), (80e3, 35e3), (17e3, 10e3)] {
            for speed_m_per_s in [0.15, 0.6] {
                cases.push(Case {
                    body_n_per_m,
                    pad_n_per_m,
                    piece_kg: 0.12,
                    damping: (0.03, 0.01),
                    speed_m_per_s,
                    robot_kg: 6.0,
                    further,
                });
            }
        }
    }
    cases
}
