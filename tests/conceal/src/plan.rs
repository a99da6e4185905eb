//! The plan of a campaign: what the experimenter believes, what is true, and what he did, before anything is hidden.

use crate::baseline::Baseline;
use crate::draw::Draw;
use crate::motion::Sampling;
use crate::noise::Colour;
use crate::readout::anti_alias_delay_s;
use crate::strength::Belief;
use crate::world::{Chain, Guide, Kind, Pad, Piece, Robot, Spring, World};

/// A belief: value and one standard deviation.
#[derive(Debug, Clone, Copy)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// One standard deviation, same unit.
    pub sd: f64,
}

/// One recording of the plan.
#[derive(Debug, Clone)]
pub struct Planned {
    /// True speed at contact or release, m/s.
    pub speed_m_per_s: f64,
    /// Stated speed.
    pub stated_speed: Estimate,
    /// Index of the configuration.
    pub configuration: usize,
    /// This recording's springs over the campaign's, ln.
    pub spring_ln: f64,
    /// Sampling.
    pub sampling: Sampling,
    /// Phase of the hum, rad.
    pub hum_phase: f64,
    /// Offset of the zero, N.
    pub offset: f64,
    /// The recording whose part of an effect it has: its own, or, where it was made later, an earlier one's.
    pub like: usize,
}

/// One robot pose (or falling mass).
#[derive(Debug, Clone, Copy)]
pub struct Configuration {
    /// True mass, kg.
    pub mass_kg: f64,
    /// Stated mass.
    pub stated: Estimate,
}

/// Traces that every rig has.
#[derive(Debug, Clone, Copy)]
pub struct Traces {
    /// Amplitude of the hum, N.
    pub hum_n: f64,
    /// Its frequency, Hz.
    pub hum_hz: f64,
    /// Drift, N/s.
    pub drift_n_per_s: f64,
    /// Damping in the pad, N·s/m.
    pub dashpot_n_s_per_m: f64,
    /// Friction of the guide, N.
    pub friction_n: f64,
    /// The light piece, kg.
    pub piece_kg: f64,
    /// Damping ratio of the piece on pad and springs, from the pad's rubber.
    pub ring_damping: f64,
    /// Anti-alias filter, Hz.
    pub anti_alias_hz: f64,
}

/// A campaign before anything is hidden.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Impact, drop or fall.
    pub kind: Kind,
    /// Gravity along the motion, m/s².
    pub gravity_m_per_s2: f64,
    /// True stiffness of the body springs, N/m.
    pub body_n_per_m: f64,
    /// Stated.
    pub stated_body: Estimate,
    /// True stiffness of the pad, N/m.
    pub pad_n_per_m: f64,
    /// Stated.
    pub stated_pad: Estimate,
    /// Whether the moving mass is stated, and how well it is known (relative).
    pub states_piece: Option<f64>,
    /// Thickness of the pad, m.
    pub pad_thickness_m: f64,
    /// Poses or masses.
    pub configurations: Vec<Configuration>,
    /// Recordings in order of time.
    pub recordings: Vec<Planned>,
    /// Stated repeatability of the springs.
    pub repeatability: f64,
    /// Samples a second.
    pub rate_hz: f64,
    /// Noise rms, in the channel's unit.
    pub noise_rms: f64,
    /// Colour of the noise.
    pub colour: Colour,
    /// Full scale, in the channel's unit.
    pub full_scale: f64,
    /// Traces of every rig.
    pub traces: Traces,
}

/// What kind of campaign is wanted.
#[derive(Debug, Clone, Copy)]
pub struct Wish {
    /// Impact, drop or fall.
    pub kind: Kind,
    /// How many recordings.
    pub recordings: usize,
    /// Whether some recordings go on for a second or two.
    pub long: bool,
}

/// Body stiffnesses of the regions, N/mm, with the pads that may lie on them: thickness mm, stiffness from to N/mm.
const REGIONS: [(f64, PadKind); 11] = [
    (10.0, PadKind::A10),
    (25.0, PadKind::A30),
    (30.0, PadKind::A30),
    (35.0, PadKind::A30),
    (40.0, PadKind::A70),
    (50.0, PadKind::A30),
    (50.0, PadKind::A70),
    (60.0, PadKind::A70),
    (75.0, PadKind::A70),
    (75.0, PadKind::A30),
    (150.0, PadKind::A70),
];

#[derive(Debug, Clone, Copy)]
enum PadKind {
    A10,
    A30,
    A70,
}

impl PadKind {
    /// Thickness, m, and range of stiffness, N/m.
    const fn data(self) -> (f64, f64, f64) {
        match self {
            Self::A10 => (0.021, 15e3, 20e3),
            Self::A30 => (0.014, 64e3, 104e3),
            Self::A70 => (0.007, 615e3, 2170e3),
        }
    }
}

/// A number that a person would write.
fn rounded(value: f64, digits: i32) -> f64 {
    #[expect(clippy::cast_sign_loss, reason = "digits are few and positive")]
    let decimals = (digits - 1) as usize;
    // Through text, so that what is written is short.
    format!("{value:.decimals$e}").parse().unwrap_or(value)
}

fn believed(draw: &mut Draw, truth: f64, relative_sd: f64, digits: i32) -> Estimate {
    Estimate {
        value: rounded(truth / (1.0 + relative_sd * draw.bounded_normal(2.5)), digits),
        sd: rounded(truth * relative_sd, 2),
    }
}

impl Plan {
    /// Draws a campaign.
    #[must_use]
    pub fn draw(draw: &mut Draw, wish: &Wish) -> Self {
        if wish.kind == Kind::Fall { Self::draw_fall(draw, wish) } else { Self::draw_impact(draw, wish) }
    }

    #[expect(clippy::cast_precision_loss, reason = "few recordings")]
    fn draw_impact(draw: &mut Draw, wish: &Wish) -> Self {
        let drop = wish.kind == Kind::Drop;
        let gravity = if drop { 9.80665 } else { 0.0 };
        let (region, pad) = draw.pick(&REGIONS);
        let (thickness, softest, hardest) = pad.data();
        let body_sd = rounded(draw.uniform(0.03, 0.05), 2);
        let pad_sd = rounded(draw.uniform(0.15, 0.25), 2);
        // Springs are ordered by their nominal stiffness; the true one is what came.
        let stated_body = Estimate { value: region * 1e3, sd: rounded(region * 1e3 * body_sd, 2) };
        let body = stated_body.value * (1.0 + body_sd * draw.bounded_normal(2.5));
        let pad = draw.log_uniform(softest, hardest);
        let stated_pad = believed(draw, pad, pad_sd, 2);
        let k = 1.0 / (1.0 / body + 1.0 / pad);
        let mass_sd = draw.uniform(0.03, 0.05);
        let configurations: Vec<Configuration> = (0..draw.pick(&[3, 4]))
            .map(|_| {
                let mass = if drop { draw.log_uniform(0.5, 4.0) } else { draw.log_uniform(4.0, 12.0) };
                let sd = if drop { 0.01 } else { mass_sd };
                Configuration { mass_kg: mass, stated: believed(draw, mass, sd, 3) }
            })
            .collect();
        let lightest = configurations.iter().map(|c| c.mass_kg).fold(f64::INFINITY, f64::min);
        let shortest = std::f64::consts::PI * (lightest / k).sqrt();
        // At least sixty samples a pulse.
        let rates: Vec<f64> =
            [2e3, 5e3, 10e3, 12.8e3, 20e3].into_iter().filter(|rate| rate * shortest > 60.0).collect();
        let rate_hz = draw.pick(if rates.is_empty() { &[20e3] } else { &rates });
        let speed_sd = draw.uniform(0.01, 0.015);
        let n = wish.recordings;
        let fastest = if drop { 1.0 } else { draw.uniform(0.4, 0.6) };
        let slowest = if drop { 0.3 } else { draw.uniform(0.05, 0.1) };
        let mut speeds: Vec<f64> = (0..n)
            .map(|i| {
                let share = (i as f64 + draw.uniform(0.0, 1.0)) / n as f64;
                slowest * (fastest / slowest).powf(share)
            })
            .collect();
        draw.shuffle(&mut speeds);
        let spring_spread = draw.uniform(0.001, 0.002);
        let mut recordings: Vec<Planned> = Vec::with_capacity(n);
        for (index, speed) in speeds.into_iter().enumerate() {
            let configuration = index % configurations.len();
            let mass = configurations[configuration].mass_kg;
            let base = Baseline {
                kind: wish.kind,
                gravity_m_per_s2: gravity,
                speed_m_per_s: speed,
                mass_kg: mass,
                stiffness_n_per_m: k,
            };
            let contact_s = draw.uniform(0.03, 0.08);
            let tail = if wish.long && index < 2 { draw.uniform(1.0, 2.0) } else { draw.uniform(0.05, 0.15) };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "seconds times a rate")]
            let samples = ((contact_s + base.touch_s() + tail) * rate_hz) as usize;
            recordings.push(Planned {
                speed_m_per_s: speed,
                stated_speed: believed(draw, speed, speed_sd, 4),
                configuration,
                spring_ln: spring_spread * draw.normal(),
                sampling: Sampling { rate_hz, samples, contact_s },
                hum_phase: draw.uniform(0.0, std::f64::consts::TAU),
                offset: draw.uniform(-1.0, 1.0),
                like: index,
            });
        }
        // A session is run pose by pose or mixed.
        if draw.chance(0.6) {
            recordings.sort_by_key(|r| r.configuration);
            recordings.iter_mut().enumerate().for_each(|(index, r)| r.like = index);
        }
        let highest = recordings
            .iter()
            .map(|r| r.speed_m_per_s * (k * configurations[r.configuration].mass_kg).sqrt())
            .fold(0.0, f64::max);
        let full_scale = if highest < 400.0 && draw.chance(0.4) { 500.0 } else { 2224.0 };
        let noise_rms = rounded(draw.log_uniform(0.2, 0.6), 2);
        Self {
            kind: wish.kind,
            gravity_m_per_s2: gravity,
            body_n_per_m: body,
            stated_body,
            pad_n_per_m: pad,
            stated_pad,
            states_piece: None,
            pad_thickness_m: thickness,
            configurations,
            recordings,
            repeatability: 0.002,
            rate_hz,
            noise_rms,
            colour: Colour::draw(draw, noise_rms),
            full_scale,
            traces: Traces {
                hum_n: noise_rms * draw.uniform(0.003, 0.01),
                hum_hz: draw.pick(&[50.0, 60.0]),
                drift_n_per_s: noise_rms * draw.uniform(-0.03, 0.03),
                dashpot_n_s_per_m: draw.uniform(0.0, 0.1),
                friction_n: draw.uniform(0.0, 0.01),
                ring_damping: draw.uniform(0.15, 0.3),
                piece_kg: draw.log_uniform(5e-5, 5e-4),
                anti_alias_hz: (rate_hz * draw.uniform(0.38, 0.46)).clamp(1.5e3, 6e3),
            },
        }
    }

    /// Balls that fall before a height sensor.
    fn draw_fall(draw: &mut Draw, wish: &Wish) -> Self {
        let rate_hz = draw.pick(&[500.0, 1000.0, 2000.0]);
        let configurations: Vec<Configuration> = (0..3)
            .map(|_| {
                let mass = draw.log_uniform(0.045, 0.6);
                Configuration { mass_kg: mass, stated: believed(draw, mass, 0.01, 3) }
            })
            .collect();
        let speed_sd = 0.02;
        let recordings = (0..wish.recordings)
            .map(|index| {
                let speed = speed_sd * draw.bounded_normal(2.5);
                let contact_s = draw.uniform(0.05, 0.08);
                let height: f64 = draw.uniform(1.0, 3.0);
                let flight = (2.0 * height / 9.80665).sqrt() * 0.98;
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "seconds times a rate")]
                let samples = ((contact_s + flight) * rate_hz) as usize;
                Planned {
                    speed_m_per_s: speed,
                    stated_speed: Estimate { value: 0.0, sd: speed_sd },
                    configuration: index % 3,
                    spring_ln: 0.0,
                    sampling: Sampling { rate_hz, samples, contact_s },
                    hum_phase: draw.uniform(0.0, std::f64::consts::TAU),
                    offset: height,
                    like: index,
                }
            })
            .collect();
        let noise_rms = rounded(draw.log_uniform(0.0005, 0.002), 2);
        Self {
            kind: Kind::Fall,
            gravity_m_per_s2: 9.80665,
            body_n_per_m: 1.0,
            stated_body: Estimate { value: 1.0, sd: 1.0 },
            pad_n_per_m: 1.0,
            stated_pad: Estimate { value: 1.0, sd: 1.0 },
            states_piece: None,
            pad_thickness_m: 0.01,
            configurations,
            recordings,
            repeatability: 0.002,
            rate_hz,
            noise_rms,
            colour: Colour::draw(draw, noise_rms),
            full_scale: 5.0,
            traces: Traces {
                hum_n: noise_rms * draw.uniform(0.003, 0.01),
                hum_hz: draw.pick(&[50.0, 60.0]),
                drift_n_per_s: 0.0,
                dashpot_n_s_per_m: 0.0,
                friction_n: 0.0,
                ring_damping: 0.2,
                piece_kg: 0.003,
                anti_alias_hz: rate_hz * 0.4,
            },
        }
    }

    /// Springs, cell and pad of recording `index` in series, N/m.
    #[must_use]
    pub fn series_n_per_m(&self, index: usize) -> f64 {
        let spring = self.body_n_per_m * self.recordings[index].spring_ln.exp();
        1.0 / (1.0 / spring + 1.0 / self.pad_n_per_m + 1.0 / CELL_N_PER_M)
    }

    /// The baseline with everything true, for recording `index`.
    #[must_use]
    pub fn true_baseline(&self, index: usize) -> Baseline {
        let r = &self.recordings[index];
        Baseline {
            kind: self.kind,
            gravity_m_per_s2: self.gravity_m_per_s2,
            speed_m_per_s: r.speed_m_per_s,
            mass_kg: self.configurations[r.configuration].mass_kg,
            stiffness_n_per_m: self.series_n_per_m(index),
        }
    }

    /// Highest force that the baseline has in recording `index`, N.
    #[must_use]
    pub fn peak_n(&self, index: usize) -> f64 {
        self.true_baseline(index).peak_n()
    }

    /// Largest stroke of the springs in recording `index`, m.
    #[must_use]
    pub fn stroke_m(&self, index: usize) -> f64 {
        self.peak_n(index) / self.body_n_per_m
    }

    /// Longest time in touch, s.
    #[must_use]
    pub fn longest_touch_s(&self) -> f64 {
        (0..self.recordings.len()).map(|i| self.true_baseline(i).touch_s()).fold(0.0, f64::max)
    }

    /// Recordings by falling peak force.
    #[must_use]
    pub fn by_peak(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.recordings.len()).collect();
        order.sort_by(|a, b| self.peak_n(*b).total_cmp(&self.peak_n(*a)));
        order
    }

    /// Where the fit's contact instant is: the true one plus the filter's delay, s.
    #[must_use]
    pub fn seen_contact_s(&self, index: usize) -> f64 {
        let delay = if self.kind == Kind::Fall { 0.0 } else { anti_alias_delay_s(self.traces.anti_alias_hz) };
        self.recordings[index].sampling.contact_s + delay
    }

    /// What the experimenter states, as the fit takes it.
    #[must_use]
    pub fn belief(&self) -> Belief {
        let relative = |e: &Estimate| e.sd / e.value;
        // k = 1/(1/b + 1/p): ∂ln k/∂ln b = p/(b+p).
        let share = self.pad_n_per_m / (self.body_n_per_m + self.pad_n_per_m);
        let stiffness_sd = f64::hypot(share * relative(&self.stated_body), (1.0 - share) * relative(&self.stated_pad));
        Belief { stiffness_sd, repeatability: self.repeatability, rate_hz: self.rate_hz }
    }

    /// The world of recording `index` with nothing hidden in it but the traces.
    #[must_use]
    pub fn world(&self, index: usize) -> World {
        let r = &self.recordings[index];
        let traces = &self.traces;
        let ring = 2.0 * traces.ring_damping * ((self.pad_n_per_m + self.body_n_per_m) * traces.piece_kg).sqrt();
        World {
            kind: self.kind,
            gravity_m_per_s2: self.gravity_m_per_s2,
            speed_m_per_s: r.speed_m_per_s,
            mass_kg: self.configurations[r.configuration].mass_kg,
            robot: Robot::default(),
            pad: Pad {
                stiffness_n_per_m: self.pad_n_per_m,
                crown_m: 2e-6,
                alpha_s_per_m: 0.0,
                dashpot_n_s_per_m: traces.dashpot_n_s_per_m + ring,
                branches: Vec::new(),
                rate: None,
                lock: None,
                pull_off_n: 0.0,
                soft_layer_n_per_m2: None,
            },
            piece: Piece { mass_kg: traces.piece_kg, damping_ratio: 0.005, rest_damping_ratio: 0.7 },
            spring: Spring {
                stiffness_n_per_m: self.body_n_per_m * r.spring_ln.exp(),
                stop: None,
                loose: None,
                air_n_s2_per_m2: 0.0,
                surge: None,
                creep: Vec::new(),
                loss: None,
            },
            guide: Guide {
                sliding_n: traces.friction_n,
                breakaway_n: traces.friction_n,
                stribeck_m_per_s: 0.0,
                load_share: 0.0,
                presliding_m: 8e-6,
            },
            frame: None,
            chain: Chain {
                cell_n_per_m: CELL_N_PER_M,
                gain: 1.0,
                curvature: 0.0,
                tilt_rad_per_m: 0.0,
                discharge_s: None,
                heat: None,
                lag_hz: None,
                anti_alias_hz: traces.anti_alias_hz,
                drift_n_per_s: traces.drift_n_per_s,
                hum: [traces.hum_n, traces.hum_hz, r.hum_phase, 0.2],
                clip_n: self.full_scale,
                step_n: 2.0 * self.full_scale / 65_536.0,
                lost: Vec::new(),
            },
            drag_n_s2_per_m2: 0.0,
            spin_m_per_s3: 0.0,
        }
    }
}

/// Stiffness of the load cell with its mounting, N/m.
pub const CELL_N_PER_M: f64 = 1e8;
