//! `thud hit`: ask a simulated sensor's rig for a robot.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::Serialize;

use crate::bus::option::BusOption;
use crate::json::JsonOption;
use crate::simulated_sensor::request::{Answer as Answered, Request};

/// Let a simulated robot hit the simulated sensors on a bus
///
/// Asks every `thud sensor` on the bus, or the one given by --node, for one hit. The request is a frame that only
/// simulators understand; a real sensor is hit by a real robot.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "Example, with `thud sensor` in another terminal:\n  thud hit --speed 0.4 --mass 8")]
pub struct Hit {
    #[command(flatten)]
    bus: BusOption,
    /// Only the sensor with this node id
    #[arg(long, value_name = "ID", value_parser = clap::value_parser!(u8).range(1..=127))]
    node: Option<u8>,
    /// Speed at contact [default: that of `thud sensor`]
    #[arg(long, value_name = "M/S")]
    speed: Option<f64>,
    /// Effective mass of the robot [default: that of `thud sensor`]
    #[arg(long, value_name = "KG")]
    mass: Option<f64>,
    #[command(flatten)]
    json: JsonOption,
}

#[derive(Serialize)]
struct Answer {
    hits: Vec<One>,
}

#[derive(Serialize)]
struct One {
    node: u8,
    #[serde(rename = "peak_N")]
    peak_n: f64,
}

/// Nobody answers after this.
const FIRST: Duration = Duration::from_millis(1_500);
/// Others answer within this after the first.
const OTHERS: Duration = Duration::from_millis(200);

impl Hit {
    pub(super) fn run(self) -> miette::Result<()> {
        let mut bus = self.bus.bus.open()?;
        // Any number will do that the last request did not have.
        let number = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis() as u16);
        let request = Request { node: self.node, speed_m_per_s: self.speed, mass_kg: self.mass, number };
        bus.send(&request.encode().map_err(|error| miette::miette!("{error}"))?)?;

        let mut answer = Answer { hits: Vec::new() };
        let mut until = bus.now() + FIRST;
        while bus.now() < until {
            let Some(stamped) = bus.receive(until.saturating_sub(bus.now()))? else { continue };
            let Some(answered) = Answered::decode(&stamped.frame).filter(|answered| answered.number == number) else {
                continue;
            };
            let Some(peak_n) = answered.peak_n else {
                miette::bail!("the simulator of node {} says that this is no possible impact", answered.node);
            };
            answer.hits.push(One { node: answered.node, peak_n });
            if self.node.is_some() {
                break;
            }
            until = bus.now() + OTHERS;
        }
        if answer.hits.is_empty() {
            let asked = self.node.map_or_else(String::new, |node| format!(" for node {node}"));
            miette::bail!(
                help = "start one in another terminal with `thud sensor --bus …` and the same bus",
                "no simulated sensor{asked} answers on {}",
                bus.describe()
            );
        }
        self.json.write(&answer)?;
        if !self.json.owns_stdout() {
            for hit in &answer.hits {
                crate::say!("Node {} is hit: {:.1} N truly reach its cell.", hit.node, hit.peak_n);
            }
        }
        Ok(())
    }
}
