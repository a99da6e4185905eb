//! The friction loop of a pneumatic piston: a cylinder of 25 mm bore under regulated pressure is pushed in and pulled out eight times over
//! 40 mm at 5 to 13 mm/s (E. Zillen, TU Delft).
//!
//! The recordings are too slow to be impacts. So the loop stays real and the impact is made: the piston is the guide of the rig's moving piece. A
//! mass of 4 kg runs into a spring of 3 kN/m and the recorded loop, m·ẍ = −k·x − f(s), where f is the recorded force less pressure times the
//! bore's area and less the middle between both ways (the cell's zero is not documented), by the way s since the last turning point, as it was recorded on the way
//! in and on the way out; the cell behind the spring reads k·x, with noise. It parts from the piece when that no longer pushes, k·x + f = 0; the
//! piece stays there, held by its friction. Each recorded cycle makes one recording, each with another speed.
//! Baseline: mass and spring, no friction. Friction that does not depend on speed keeps its form when the loop is run through faster; what
//! does depend on it is taken as recorded at 5 to 13 mm/s.

use super::{Belief, Campaign, Entry, Expected, Real, series};

/// π/4·(25 mm)².
const AREA_M2: f64 = 4.908_739e-4;
const MASS_KG: f64 = 4.0;
const STIFFNESS_N_PER_M: f64 = 3000.0;
/// The way in begins where it slides: what turns the piston round is not part of an impact.
const SLIDING_M: f64 = 0.003;
const STEP_S: f64 = 2e-5;
const RATE_HZ: f64 = 5000.0;
/// Of the made cell, as of a rig's own.
const NOISE_N: f64 = 0.3;

const PRESSURES: [u32; 4] = [1, 3, 5, 7];

/// Friction by the way since a turning point, in steps of the recording.
struct Way(Vec<(f64, f64)>);

impl Way {
    fn at(&self, way_m: f64) -> f64 {
        let place = self.0.partition_point(|(way, _)| *way < way_m).clamp(1, self.0.len() - 1);
        let ((from, before), (to, after)) = (self.0[place - 1], self.0[place]);
        before + (after - before) * ((way_m - from) / (to - from)).clamp(0.0, 1.0)
    }
}

/// Cycles of a recording, each a way in and a way out.
fn cycles(path: &std::path::Path) -> Vec<(Way, Way)> {
    let recording = thud::recording::read(path).unwrap();
    let column = |name: &str| recording.channel(name).unwrap().to_vec();
    let (x, pressure, force) = (column("displacement_m"), column("pressure_gauge_Pa"), column("force_N"));
    let rest: Vec<f64> = force.iter().zip(&pressure).map(|(force, pressure)| force - pressure * AREA_M2).collect();
    // Turning points: the lowest and the highest places, in turn.
    let (low, high) = (0.005, 0.030);
    let mut turns: Vec<usize> = Vec::new();
    let mut upwards = true;
    let mut extreme = 0;
    for place in 0..x.len() {
        let further = if upwards { x[place] > x[extreme] } else { x[place] < x[extreme] };
        if further {
            extreme = place;
        }
        let turned = if upwards {
            x[extreme] > high && x[place] < x[extreme] - 0.002
        } else {
            x[extreme] < low && x[place] > x[extreme] + 0.002
        };
        if turned {
            turns.push(extreme);
            upwards = !upwards;
            extreme = place;
        }
    }
    // The first turn is the end of a way in; then a way out, and so on.
    let mean = |first: usize| {
        let ways = turns[first..].windows(2).step_by(2);
        let (sum, count) = ways.fold((0.0, 0), |(sum, count), way| {
            (sum + rest[way[0]..way[1]].iter().sum::<f64>(), count + way[1] - way[0])
        });
        sum / f64::from(u32::try_from(count).unwrap())
    };
    let middle = f64::midpoint(mean(0), mean(1));
    let way = |from: usize, to: usize| {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for place in from..to {
            let gone = (x[place] - x[from]).abs();
            if points.last().is_none_or(|(last, _)| gone > last + 1e-6) {
                points.push((gone, rest[place] - middle));
            }
        }
        Way(points)
    };
    turns[1..].windows(3).step_by(2).map(|turn| (way(turn[0], turn[1]), way(turn[1], turn[2]))).collect()
}

/// The mass runs into the loop.
fn run(speed_m_per_s: f64, (inwards, outwards): &(Way, Way), number: usize) -> Vec<(f64, f64)> {
    let (mut x, mut v, mut turned_m) = (0.0_f64, speed_m_per_s, None);
    let every = (1.0 / (RATE_HZ * STEP_S)).round() as i64;
    let mut samples = Vec::new();
    // Xorshift and Box–Muller: the same noise every time.
    let mut state = 88_172_645_463_325_252_u64 + number as u64;
    let mut noise = move || {
        let mut uniform = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        NOISE_N * (-2.0 * uniform().max(1e-12).ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
    };
    let mut gone = false;
    for step in (-0.06 / STEP_S) as i64..(0.2 / STEP_S) as i64 {
        if step >= 0 && !gone {
            let friction = match turned_m {
                None => inwards.at(SLIDING_M + x),
                Some(turned) => outwards.at(turned - x),
            };
            let contact = STIFFNESS_N_PER_M * x + friction;
            gone = turned_m.is_some() && contact <= 0.0;
            if !gone {
                v -= contact / MASS_KG * STEP_S;
                x += v * STEP_S;
            }
            if v < 0.0 && turned_m.is_none() {
                turned_m = Some(x);
            }
        }
        if step % every == 0 {
            samples.push((step as f64 * STEP_S, STIFFNESS_N_PER_M * x + noise()));
        }
    }
    samples
}

pub fn all() -> Vec<Real> {
    let one = |pressure: u32| Real {
        name: format!("piston-{pressure}-bar"),
        about: "the recorded friction loop of a piston with O-ring as a guide, in a made impact",
        documented: "friction of the seal, independent of speed (half width 4 to 8 N, growing with pressure)",
        expected: Expected::Names(&["guide-friction", "stiction"]),
        make: Box::new(move |recordings, folder| {
            let cycles = cycles(&recordings.join(format!("piston_seal_friction/O-ring_{pressure}bar.csv")));
            let entries = cycles
                .iter()
                .take(8)
                .enumerate()
                .map(|(number, cycle)| {
                    // Strokes of 11 to 31 mm.
                    let speed = 0.3 + 0.075 * number as f64;
                    let file = format!("{:03}.csv", number + 1);
                    series(&folder.join(&file), "force_N", run(speed, cycle, number));
                    Entry {
                        file,
                        speed_m_per_s: Belief(speed, 0.005 * speed),
                        mass_kg: Belief(MASS_KG, 0.01 * MASS_KG),
                        configuration: None,
                    }
                })
                .collect();
            Campaign {
                kind: "impact",
                body_n_per_m: Some(Belief(STIFFNESS_N_PER_M, 0.02 * STIFFNESS_N_PER_M)),
                sample_rate_hz: RATE_HZ,
                noise_rms: NOISE_N,
                full_scale: 500.0,
                observed: "force_N",
                entries,
            }
        }),
    };
    PRESSURES.into_iter().map(one).collect()
}
