//! An impact through everything: rig, measuring chain, ADC, the firmware with its tasks, bus, and what a host decodes
//! there, beside what the rig knows to be true.

#![allow(dead_code, reason = "the test and the bench each use a part")]

use std::f64::consts::PI;
use std::rc::Rc;

use embassy_time::{Duration, Instant};
use thud_firmware::board::{Frame, Received};
use thud_firmware::configuration::{Chain, Configuration};
use thud_firmware::dictionary::frame::{ALARM_BASE, Assembly, Part, Summary};
use thud_firmware::dictionary::{event_record, index};
use thud_firmware::event::Event;
use thud_firmware::limits::Region;
use thud_firmware::units::{Hertz, Kilogram, Newton, NewtonPerMetre, Second};
use thud_sim::board::{BoardSettings, commission, firmware};
use thud_sim::bus::{Arrival, BitRate, HostPort};
use thud_sim::chain::{ChainSettings, Drift, Hum, Spikes};
use thud_sim::force::{Blows, Untouched};
use thud_sim::mechanism::Effect;
use thud_sim::rig::{Accuracy, Approach, Impact, Rig, pad_of};
use thud_sim::world::{BoardId, World};

const NODE: u8 = Configuration::DEFAULT.node.node_id;
/// Effective mass of the robot, kg.
pub const MASS_KG: f64 = 6.0;
/// White noise of the chain, N rms.
pub const NOISE_N: f64 = 0.3;
const SAMPLE_RATE_HZ: f64 = Chain::REFERENCE.sample_rate.0 as f64;
/// The detector has settled by then.
const SETTLED: Duration = Duration::from_secs(6);
/// From contact until everything has been sent: longer than the impact, its transient window of 0.5 s and the return to rest.
const PERIOD_S: f64 = 1.5;

/// The regions whose springs the table stands on: 10, 25, 75 and 150 N/mm.
pub const REGIONS: [Region; 4] = [Region::Abdomen, Region::Chest, Region::Hand, Region::Skull];
/// Speeds of the table, m/s.
pub const SPEEDS_M_PER_S: [f64; 4] = [0.05, 0.15, 0.35, 0.6];

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Speed at contact.
    pub speed_m_per_s: f64,
    /// The body region; its springs, and its pad if any.
    pub region: Region,
    /// Whether the region's pad is on.
    pub pad: bool,
    /// Whether the moving piece has a mass: 0.12 kg, which rings.
    pub piece: bool,
}

/// What came of one impact, as errors against the truth.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Sensed less true instant of contact, s; the delay of the anti-alias filter is taken off.
    pub contact_s: f64,
    /// Sensed less true peak at the cell, N.
    pub peak_n: f64,
    /// The true peak, N.
    pub true_peak_n: f64,
    /// Sensed over true impulse, less 1.
    pub impulse: f64,
    /// Sensed less true time from first touch to last separation, s.
    pub duration_s: f64,
    /// Relative error of the scaled force against S in double precision times the sensed transient force.
    pub scaled: f64,
    /// From the true force passing six times the noise to the end of the alarm frame on the bus, s.
    pub alarm_s: f64,
    /// Contacts that were reported for this impact.
    pub events: usize,
    /// Alarms that were sent for it.
    pub alarms: usize,
}

/// What is true of an impact of the rig.
struct Truth {
    impact: Rc<Impact>,
    peak_n: f64,
    impulse_ns: f64,
    ends_s: f64,
    passes_s: f64,
}

impl Hit {
    /// All of one kind, by stiffness, then speed.
    pub fn grid(pad: bool, piece: bool) -> impl Iterator<Item = Self> {
        REGIONS
            .into_iter()
            .flat_map(move |region| SPEEDS_M_PER_S.map(|speed_m_per_s| Self { speed_m_per_s, region, pad, piece }))
    }

    fn rig(&self) -> Rig {
        let rig = Rig::impact(f64::from(self.region.body().stiffness.0));
        if self.pad { rig.with_pad(pad_of(self.region).typical_stiffness_n_per_m()) } else { rig }
    }

    fn truth(&self) -> Truth {
        let effects: Vec<Effect> =
            self.piece.then(|| "moving-piece-inertia".parse().expect("listed")).into_iter().collect();
        let approach = Approach::new(self.speed_m_per_s, MASS_KG);
        let impact = self.rig().strike(&approach, &effects, 0.5, Accuracy::default()).expect("a usual rig");
        let truth = impact.truth();
        // A ringing piece lets go of the robot for moments; to the cell all of it is one contact.
        let ends_s = truth.contacts.iter().filter_map(|contact| contact.end_s).fold(0.0, f64::max);
        let impulse_ns = integral(&impact, ends_s);
        let threshold_n = 6.0 * NOISE_N;
        let step_s = 1e-6;
        let passes_s = (0..).map(|step| f64::from(step) * step_s).find(|at_s| impact.force_n(*at_s) > threshold_n);
        let passes_s = passes_s.expect("the force passes six times the noise");
        Truth { peak_n: truth.peak_n, impulse_ns, ends_s, passes_s, impact: Rc::new(impact) }
    }

    /// Cramér–Rao bound of the contact instant, s: a half sine of unknown height, frequency and instant in white noise
    /// (with the quantiser's), zero and hum known. Only for a piece without mass, whose force is a half sine.
    pub fn bound_s(&self) -> f64 {
        let k = self.rig().effective_stiffness_n_per_m();
        let pulsation = (k / MASS_KG).sqrt();
        let peak = self.speed_m_per_s * (k * MASS_KG).sqrt();
        let variance = NOISE_N * NOISE_N + f64::from(Chain::REFERENCE.newton_per_code).powi(2) / 12.0;
        let mut fisher = nalgebra::Matrix3::<f64>::zeros();
        for sample in 0..(PI / pulsation * SAMPLE_RATE_HZ) as u32 {
            let phase = pulsation * f64::from(sample) / SAMPLE_RATE_HZ;
            // By height, by the logarithm of the frequency, by the instant in 1/ω: all of the size of 1.
            let gradient = nalgebra::Vector3::new(phase.sin(), peak * phase.cos() * phase, -peak * phase.cos());
            fisher += gradient * gradient.transpose() / variance;
        }
        let variances = fisher.try_inverse().expect("three things can be told from one pulse");
        variances[(2, 2)].sqrt() / pulsation
    }

    /// `repeats` impacts, one after the other on one board, at all phases of sample clock and hum.
    pub fn outcomes(&self, repeats: u32, seed: u64) -> Vec<Outcome> {
        let truth = self.truth();
        let mut scene = Scene::new(self.region, seed);
        (0..repeats).map(|repeat| scene.strike(&truth, f64::from(repeat))).collect()
    }
}

/// ∫F dt from contact to `end_s`, by Simpson's rule in steps of about 5 µs: exact to 10⁻⁶ of itself, rings included.
fn integral(impact: &Impact, end_s: f64) -> f64 {
    let halves = 2 * (end_s / 1e-5).ceil() as u32;
    let step_s = end_s / f64::from(halves);
    let weight = |number: u32| match number {
        0 => 1.0,
        _ if number == halves => 1.0,
        _ if number % 2 == 1 => 4.0,
        _ => 2.0,
    };
    (0..=halves).map(|number| weight(number) * impact.force_n(f64::from(number) * step_s)).sum::<f64>() * step_s / 3.0
}

/// The workshop with a mains that is slightly off, so that hum and samples never fall into step.
fn chain() -> ChainSettings {
    let workshop = ChainSettings::workshop();
    let hum = workshop.hum.clone().map(|hum| Hum { fundamental: Hertz(50.03), ..hum });
    ChainSettings { hum, ..workshop }
}

struct Scene {
    world: World,
    host: HostPort,
    blows: Blows,
    board: BoardId,
    region: Region,
    assembly: Assembly,
}

impl Scene {
    fn new(region: Region, seed: u64) -> Self {
        let mut world = World::new(BitRate::MEGABIT, seed);
        let host = world.bus().attach_host("host");
        let blows = Blows::new();
        let board = world.add_board(BoardSettings::new(1, seed).with_chain(chain()), blows.clone(), firmware);
        let configuration = Configuration {
            region: Some(region),
            body_stiffness: NewtonPerMetre(region.body().stiffness.0),
            effective_mass: Some(Kilogram(MASS_KG as f32)),
            ..Configuration::DEFAULT
        };
        commission(world.board(board).flash(), configuration).expect("a new flash takes a configuration");
        world.run_for(Duration::from_millis(20)).expect("the firmware lives");
        host.send(&Frame::new(0x000, &[0x01, NODE]).expect("an NMT command"));
        world.run_for(SETTLED).expect("the firmware lives");
        while host.receive().is_some() {}
        Self { world, host, blows, board, region, assembly: Assembly::new() }
    }

    fn strike(&mut self, truth: &Truth, number: f64) -> Outcome {
        // The golden section spreads the phases of hum (20 ms) and sample clock (50 µs) evenly.
        let phase_s = (number * 0.618_033_988_7).fract() * 0.02;
        let contact_s = (self.world.now().as_micros() as f64 * 1e-6).floor() + 1.0 + phase_s;
        let impact = truth.impact.clone();
        self.blows.strike(contact_s, impact.end_s(), move |since_s| impact.force_n(since_s));
        let until = Instant::from_micros(((contact_s + PERIOD_S) * 1e6) as u64);
        self.world.run_until(until).expect("the firmware lives");
        let (alarms, summaries) = self.collect();
        let first = summaries.first().unwrap_or_else(|| panic!("no event for a contact at {contact_s} s"));
        let event = self.event(u32::from(first.number));
        assert_eq!(event.number as u16, first.number);
        let board = self.world.board(self.board);
        let since_start_s = board.instant_of(0).as_micros() as f64 * 1e-6;
        let sensed_s = since_start_s
            + (event.contact_instant.index as f64 + f64::from(event.contact_instant.fraction)) / SAMPLE_RATE_HZ;
        let scaled_n = scaling(self.region) * f64::from(event.severity.transient.0);
        Outcome {
            contact_s: sensed_s - contact_s,
            peak_n: f64::from(event.raw_peak.0) - truth.peak_n,
            true_peak_n: truth.peak_n,
            impulse: f64::from(event.impulse.0) / truth.impulse_ns - 1.0,
            duration_s: f64::from(event.duration.0) - truth.ends_s,
            scaled: f64::from(event.severity.scaled.0) / scaled_n - 1.0,
            alarm_s: alarms.first().map_or(f64::INFINITY, |at_s| at_s - contact_s - truth.passes_s),
            events: summaries.len(),
            alarms: alarms.len(),
        }
    }
}

/// S = √(m_H/(m_H + m_R)) in double precision; skull and face are never scaled.
fn scaling(region: Region) -> f64 {
    let body_kg = match region {
        Region::Skull | Region::Face => return 1.0,
        // As the standard's table prints it: 0.6 kg is no power of two, so not by way of single precision.
        _ => f64::from(region.body().effective_mass.0 * 10.0).round() / 10.0,
    };
    (body_kg / (body_kg + MASS_KG)).sqrt()
}

impl Scene {
    /// When the alarms were complete on the bus, s, and what the frames of events say.
    fn collect(&mut self) -> (Vec<f64>, Vec<Summary>) {
        let (mut alarms, mut summaries) = (Vec::new(), Vec::new());
        while let Some(Arrival { at, received }) = self.host.receive() {
            let Received::Frame(frame) = received else { panic!("the host has lost frames") };
            if frame.id == ALARM_BASE + u16::from(NODE) {
                alarms.push(at.as_micros() as f64 * 1e-6);
            } else if let Some((part, NODE)) = Part::of(frame.id) {
                summaries.extend(self.assembly.push(part, frame.bytes()).expect("a sound frame"));
            }
        }
        (alarms, summaries)
    }

    /// An event in full, from the sensor's log.
    fn event(&mut self, number: u32) -> Event {
        let [low, high] = index::EVENT_LOG.to_le_bytes();
        let [a, b, c, d] = number.to_le_bytes();
        self.sdo([0x23, low, high, 4, a, b, c, d]);
        let announced = self.sdo([0x40, low, high, 5, 0, 0, 0, 0]);
        let length = u32::from_le_bytes([announced[4], announced[5], announced[6], announced[7]]) as usize;
        let mut record = Vec::new();
        let mut toggle = 0;
        while record.len() < length {
            let segment = self.sdo([0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]);
            let unused = usize::from(segment[0] >> 1 & 7);
            record.extend_from_slice(&segment[1..8 - unused]);
            toggle ^= 0x10;
        }
        event_record::decode(&record).expect("a sound record")
    }

    fn sdo(&mut self, request: [u8; 8]) -> [u8; 8] {
        self.host.send(&Frame::new(0x600 + u16::from(NODE), &request).expect("eight bytes"));
        let deadline = self.world.now() + Duration::from_millis(100);
        while let Some(arrival) = self.world.run_until_arrival(&self.host, deadline).expect("the firmware lives") {
            if let Received::Frame(frame) = arrival.received
                && frame.id == 0x580 + u16::from(NODE)
            {
                assert_ne!(frame.data[0], 0x80, "an SDO abort: {:02X?}", frame.data);
                return frame.data;
            }
        }
        panic!("no answer to an SDO request within 100 ms");
    }
}

/// A rig whose guide rubs, struck again and again.
#[derive(Clone, Copy, Debug)]
pub struct Rubbing {
    /// Sliding force of the guide, which stays on the cell after the first blow, N.
    pub sliding_n: f64,
    /// Mass of the moving piece, kg.
    pub piece_kg: f64,
    /// Speed at contact.
    pub speed_m_per_s: f64,
    /// From blow to blow, s.
    pub every_s: f64,
}

/// What came of one of its blows, as errors against the truth.
#[derive(Clone, Copy, Debug)]
pub struct Struck {
    /// The event.
    pub event: Event,
    /// Sensed less true instant at which the force at the cell begins to rise, s.
    pub contact_s: f64,
    /// Sensed less true instant at which it is back, s.
    pub separation_s: f64,
    /// Sensed less true peak, N.
    pub peak_n: f64,
    /// Sensed over true impulse at the cell, less 1.
    pub impulse: f64,
}

impl Rubbing {
    /// A chest pad of 80 kN/m on springs of 25 kN/m.
    fn strike(&self) -> Impact {
        let mut effects = vec![format!("guide-friction:force_N={}", self.sliding_n)];
        effects.extend((self.piece_kg > 0.0).then(|| format!("moving-piece-inertia:mass_kg={}", self.piece_kg)));
        let effects: Vec<Effect> = effects.iter().map(|effect| effect.parse().expect("listed")).collect();
        Rig::impact(25_000.0)
            .with_pad(80_000.0)
            .strike(&Approach::new(self.speed_m_per_s, MASS_KG), &effects, 0.5, Accuracy::default())
            .expect("a usual rig")
    }

    /// What stays on the cell after a blow, N.
    pub fn rest_n(&self) -> f64 {
        let impact = self.strike();
        impact.force_n(impact.end_s())
    }

    /// All events of so many blows, in the order of time, and the number of alarms; then `idle_s` of rest.
    pub fn blows(&self, count: u32, idle_s: f64, seed: u64) -> (Vec<Struck>, usize) {
        let impact = Rc::new(self.strike());
        let rest_n = impact.force_n(impact.end_s());
        let truth = impact.truth();
        let ends_s = truth.contacts.iter().filter_map(|contact| contact.end_s).fold(0.0, f64::max);
        let mut scene = Scene::new(Region::Chest, seed);
        let first_s = (scene.world.now().as_micros() as f64 * 1e-6).floor() + 1.0;
        let contacts_s: Vec<f64> =
            (0..count).map(|n| first_s + f64::from(n) * self.every_s + 1e-5 * f64::from(n * 7 % 5)).collect();
        for (number, contact_s) in contacts_s.iter().enumerate() {
            let impact = impact.clone();
            // The guide holds the piece where the blow before has left it: the next one is felt from there on.
            let held_n = if number == 0 { 0.0 } else { rest_n };
            let lasts_s = if number == 0 { f64::MAX } else { impact.end_s() };
            scene.blows.strike(*contact_s, lasts_s, move |since_s| {
                let force_n = impact.force_n(since_s) - held_n;
                if number == 0 { force_n } else { force_n.max(0.0) }
            });
        }
        let end_s = contacts_s[contacts_s.len() - 1] + 1.0 + idle_s;
        let (mut events, mut alarms) = (Vec::new(), 0);
        while (scene.world.now().as_micros() as f64) < end_s * 1e6 {
            scene.world.run_for(Duration::from_millis(200)).expect("the firmware lives");
            let (alarms_s, summaries) = scene.collect();
            alarms += alarms_s.len();
            events.extend(summaries.iter().map(|summary| u32::from(summary.number)));
        }
        let struck = events.into_iter().enumerate().map(|(blow, number)| {
            let event = scene.event(number);
            let since_start_s = scene.world.board(scene.board).instant_of(0).as_micros() as f64 * 1e-6;
            let sensed_s = since_start_s + event.contact_instant.seconds(Hertz(SAMPLE_RATE_HZ as f32));
            let held_n = if blow == 0 { 0.0 } else { rest_n };
            let begins_s = (0..).map(|step| f64::from(step) * 1e-6).find(|at_s| impact.force_n(*at_s) > held_n + 1e-6);
            let begins_s = begins_s.expect("a blow is stronger than the rest");
            let contact_s = contacts_s.get(blow).copied().unwrap_or(f64::NAN);
            let impulse_ns = integral(&impact, ends_s) - integral(&impact, begins_s);
            Struck {
                event,
                contact_s: sensed_s - contact_s - begins_s,
                separation_s: sensed_s + f64::from(event.duration.0) - contact_s - ends_s,
                peak_n: f64::from(event.raw_peak.0) - truth.peak_n,
                impulse: f64::from(event.impulse.0) / impulse_ns - 1.0,
            }
        });
        (struck.collect(), alarms)
    }
}

/// Spikes of one sample a second while idling.
pub const SPIKES_PER_S: f32 = 1.0;

/// A sensor that nobody touches, in a workshop with spikes, whose mains is slightly off and which warms up.
pub struct Idling {
    world: World,
    host: HostPort,
    alarms_s: Vec<f64>,
}

impl Idling {
    /// Switched on and operational.
    pub fn new(seed: u64) -> Self {
        let chain = ChainSettings {
            drift: Drift { rate_newton_per_second: 0.014, thermal: Newton(3.0), thermal_time: Second(900.0) },
            spikes: Some(Spikes { rate: Hertz(SPIKES_PER_S), height: Newton(50.0) }),
            ..chain()
        };
        let mut world = World::new(BitRate::MEGABIT, seed);
        let host = world.bus().attach_host("host");
        world.add_board(BoardSettings::new(1, seed).with_chain(chain), Untouched, firmware);
        world.run_for(Duration::from_millis(20)).expect("the firmware lives");
        host.send(&Frame::new(0x000, &[0x01, NODE]).expect("an NMT command"));
        Self { world, host, alarms_s: Vec::new() }
    }

    /// Lets time pass.
    pub fn run_until(&mut self, end: Instant) {
        while self.world.now() < end {
            let minute = self.world.now() + Duration::from_secs(60);
            self.world.run_until(minute.min(end)).expect("the firmware lives");
            while let Some(arrival) = self.host.receive() {
                match arrival.received {
                    Received::Frame(frame) if frame.id == ALARM_BASE + u16::from(NODE) => {
                        self.alarms_s.push(arrival.at.as_micros() as f64 * 1e-6);
                    }
                    Received::Frame(_) => {}
                    Received::Lost(lost) => panic!("the host has lost {lost} frames"),
                }
            }
        }
    }

    /// When there were alarms, s.
    pub fn alarms_s(&self) -> &[f64] {
        &self.alarms_s
    }
}

/// Root mean square.
pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

/// The largest by amount.
pub fn worst(values: impl Iterator<Item = f64>) -> f64 {
    values.map(f64::abs).fold(0.0, f64::max)
}
