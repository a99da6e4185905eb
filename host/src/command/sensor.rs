//! `thud sensor`: a simulated sensor that lives in real time on a bus.

use std::io::BufRead as _;
use std::str::FromStr as _;
use std::sync::mpsc;
use std::time::Duration;

use miette::IntoDiagnostic as _;
use serde::Serialize;
use thud_sim::chain::ChainSettings;
use thud_sim::mechanism::Effect;
use thud_sim::rig::{Approach, Rig};

use crate::bus::Counters;
use crate::bus::option::BusOption;
use crate::client::words::traffic;
use crate::decimal::decimal;
use crate::interrupt;
use crate::json::JsonOption;
use crate::model::MechanismRefused;
use crate::settings::JudgeOptions;
use crate::simulated_sensor::live::{Hit, LiveSensor};
use crate::simulated_sensor::{Setup, SimulatedSensor};

/// Run a simulated sensor in real time on a bus
///
/// The firmware's own tasks on a simulated board with a rig. It is hit by a simulated robot every --hit-every seconds,
/// with --on-enter whenever Enter is pressed, and whenever `thud hit` asks for it from another terminal.
/// It lives until Ctrl-C or --duration.
#[derive(clap::Args, Debug)]
#[command(
    after_long_help = "Example, with `thud monitor` in another terminal:\n  thud sensor --region chest --mass 6.1 --speed 0.25 --hit-every 5"
)]
pub struct Sensor {
    #[command(flatten)]
    bus: BusOption,
    /// Node id, 1 to 127
    #[arg(long, value_name = "ID", default_value_t = 32)]
    node_id: u8,
    /// Serial number of the board
    #[arg(long, value_name = "N", default_value_t = 1)]
    serial: u32,
    /// Starts the random numbers of noise and drift
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// End after so many seconds
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    #[command(flatten)]
    robot: Robot,
    #[command(flatten)]
    judge: JudgeOptions,
    #[command(flatten)]
    json: JsonOption,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "The robot and the rig")]
struct Robot {
    /// Speed at contact
    #[arg(long, value_name = "M/S", default_value_t = 0.25)]
    speed: f64,
    /// True effective mass of the robot [default: that of --mass, or 6 kg]
    #[arg(long, value_name = "KG")]
    true_mass: Option<f64>,
    /// Stiffness of a pad in series with the body spring [default: none]
    #[arg(long, value_name = "N/M")]
    pad: Option<f64>,
    /// A mechanism that the rig has beyond the ideal impact: `ID` or `ID:parameter=value,…`; repeatable
    #[arg(long = "mechanism", value_name = "MECHANISM")]
    mechanisms: Vec<String>,
    /// Relative standard deviation of the speed from one hit to the next
    #[arg(long, value_name = "RATIO", default_value_t = 0.0)]
    scatter: f64,
    /// Hit it every so many seconds, beginning after the first
    #[arg(long, value_name = "S")]
    hit_every: Option<f64>,
    /// Hit it whenever Enter is pressed
    #[arg(long)]
    on_enter: bool,
    /// No noise, hum or drift
    #[arg(long)]
    quiet: bool,
}

#[derive(Serialize)]
struct Answer {
    node: u8,
    serial: u32,
    lived_s: f64,
    /// At worst it was so far behind real time.
    behind_s: f64,
    hits: Vec<Hit>,
    /// Frames lost between the simulated bus and the shared one.
    lost: u64,
    /// How often two devices under one node id drove it off the bus.
    bus_off: u64,
    frames: Counters,
}

/// Effective mass of the robot where none is given: a collaborative arm of the 7 kg class at mid-stretch.
const MASS_KG: f64 = 6.0;

/// Largest relative scatter of the speed: beyond it a speed could change its sign.
const MOST_SCATTER: f64 = 0.3;

impl Sensor {
    pub(super) fn run(self) -> miette::Result<()> {
        let duration = interrupt::span(self.duration)?;
        let every = interrupt::span(self.robot.hit_every)?;
        let quiet = self.json.owns_stdout();
        let mut live = self.start()?;
        interrupt::catch();
        let enter = self.robot.on_enter.then(lines_of_stdin);
        if !quiet {
            crate::say!(
                "Sensor {} lives as node {} on {}. Ctrl-C ends.",
                self.serial,
                self.node_id,
                live.bus().describe()
            );
        }

        let mut hits = Vec::new();
        let mut next = every;
        while !interrupt::asked() && duration.is_none_or(|duration| live.age() < duration) {
            let mut happened = live.live()?;
            if let (Some(at), Some(every)) = (next, every)
                && live.age() >= at
            {
                next = Some(at + every.max(Duration::from_millis(1)));
                happened.push(live.hit(None, None).into_diagnostic()?);
            }
            if let Some(enter) = &enter {
                for () in enter.try_iter() {
                    happened.push(live.hit(None, None).into_diagnostic()?);
                }
            }
            if !quiet {
                happened.iter().for_each(|hit| crate::say!("{}", words(hit)));
            }
            hits.extend(happened);
        }

        let answer = Answer {
            node: live.node(),
            serial: self.serial,
            lived_s: live.age().as_secs_f64(),
            behind_s: live.behind().as_secs_f64(),
            hits,
            lost: live.lost(),
            bus_off: live.bus_off(),
            frames: live.bus().counters(),
        };
        self.json.write(&answer)?;
        if !quiet {
            crate::say!("Lived {:.1} s, hit {} times.", answer.lived_s, answer.hits.len());
            if answer.bus_off > 0 {
                crate::say!("It was driven off the bus {} times: another device has its node id.", answer.bus_off);
            }
            if answer.behind_s > 0.1 {
                crate::say!("It was up to {:.2} s behind real time: this computer is busy.", answer.behind_s);
            }
            crate::say!("{}", traffic(&live.bus().describe(), &answer.frames));
        }
        Ok(())
    }

    fn start(&self) -> miette::Result<LiveSensor> {
        let mut configuration = self.judge.configuration()?;
        configuration.node.node_id = self.node_id;
        configuration.validate().map_err(|invalid| miette::miette!("{}", crate::settings::explain_invalid(invalid)))?;
        let effects: Result<Vec<Effect>, _> =
            self.robot.mechanisms.iter().map(|text| Effect::from_str(text).map_err(MechanismRefused)).collect();
        let chain = if self.robot.quiet { ChainSettings::quiet() } else { ChainSettings::workshop() };
        let mut rig = Rig::impact(f64::from(configuration.body_stiffness.0));
        if let Some(pad) = self.robot.pad {
            rig = rig.with_pad(pad);
        }
        let mass = self.robot.true_mass.or(self.judge.mass.map(decimal)).unwrap_or(MASS_KG);
        let approach = Approach::new(self.robot.speed, mass);
        let sensor = SimulatedSensor::new(Setup {
            seed: self.seed,
            serial: self.serial,
            configuration,
            chain,
            rig,
            effects: effects?,
        })
        .map_err(|reason| miette::miette!("the simulated flash did not take the configuration: {reason:?}"))?;
        if !(0.0..=MOST_SCATTER).contains(&self.robot.scatter) {
            miette::bail!("--scatter is {}; 0 to {MOST_SCATTER} is possible", self.robot.scatter);
        }
        let live = LiveSensor::new(sensor, self.bus.bus.open()?, approach, self.node_id)
            .with_scatter(self.robot.scatter, self.seed);
        Ok(live)
    }
}

fn words(hit: &Hit) -> String {
    let rebounds = match hit.contacts {
        0 | 1 => String::new(),
        contacts => format!(", {} rebounds", contacts - 1),
    };
    format!(
        "{:>10.4} s: hit at {:.4} m/s by {} kg: {:.1} N truly reach the cell, {:.3} N·s{rebounds}",
        hit.contact_s, hit.speed_m_per_s, hit.mass_kg, hit.peak_n, hit.impulse_ns
    )
}

/// A message for each line on standard input, until it ends.
fn lines_of_stdin() -> mpsc::Receiver<()> {
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines() {
            if line.is_err() || sender.send(()).is_err() {
                return;
            }
        }
    });
    receiver
}
