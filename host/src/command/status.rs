//! `thud status`: who is on the bus, and how is it?

use serde::Serialize;

use crate::bus::Counters;
use crate::bus::option::BusOption;
use crate::client::Client;
use crate::client::status::Status as SensorStatus;
use crate::client::words::{searching, traffic};
use crate::json::JsonOption;
use crate::table::{Side, Table};

/// Show who is on the bus and how it is
///
/// Asks every node id for a sensor (or the one given by --node) and shows identity, configuration, noise, losses and
/// bus errors of each. Losses and errors that are not zero are explained below the table.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "Example, with `thud sensor` running in another terminal:\n  thud status")]
pub struct Status {
    #[command(flatten)]
    bus: BusOption,
    /// Only the sensor with this node id
    #[arg(long, value_name = "ID", value_parser = clap::value_parser!(u8).range(1..=127))]
    node: Option<u8>,
    #[command(flatten)]
    json: JsonOption,
}

#[derive(Serialize)]
struct Answer {
    bus: String,
    frames: Counters,
    sensors: Vec<SensorStatus>,
}

impl Status {
    pub(super) fn run(self) -> miette::Result<()> {
        let mut client = Client::open(&self.bus.bus)?;
        let progress = searching(&client.line().describe());
        let found = client.find(self.node);
        let mut sensors = Vec::new();
        for sensor in found? {
            progress.set_message(format!("asking node {}", sensor.node));
            sensors.push(client.status(&sensor)?);
        }
        progress.finish_and_clear();

        let answer = Answer { bus: client.line().describe(), frames: client.counters(), sensors };
        self.json.write(&answer)?;
        if !self.json.owns_stdout() {
            print(&answer);
        }
        Ok(())
    }
}

fn print(answer: &Answer) {
    let mut table = Table::new(&[
        ("node", Side::Right),
        ("serial", Side::Right),
        ("firmware", Side::Left),
        ("state", Side::Left),
        ("region", Side::Left),
        ("revision", Side::Right),
        ("hash", Side::Left),
        ("noise N", Side::Right),
        ("zero code", Side::Right),
        ("events", Side::Right),
        ("up s", Side::Right),
        ("losses", Side::Right),
        ("bus", Side::Left),
    ]);
    for sensor in &answer.sensors {
        let losses: u64 = sensor.losses.iter().map(|loss| u64::from(loss.count)).sum();
        let noise = if sensor.settled { format!("{:.3}", sensor.noise_n) } else { "settling".to_owned() };
        table.row([
            sensor.node.to_string(),
            sensor.serial.to_string(),
            sensor.firmware.clone(),
            sensor.state.unwrap_or("no heartbeat").to_owned(),
            sensor.region.clone(),
            sensor.configuration_revision.to_string(),
            format!("{:08x}", sensor.configuration_hash),
            noise,
            format!("{:.1}", sensor.zero_code),
            sensor.events.to_string(),
            sensor.uptime_s.to_string(),
            losses.to_string(),
            format!("{} (tx {}, rx {})", sensor.bus_state, sensor.transmit_errors, sensor.receive_errors),
        ]);
    }
    crate::standard_output::say(format_args!("{table}"));
    for sensor in &answer.sensors {
        for loss in sensor.losses.iter().filter(|loss| loss.count > 0) {
            crate::say!("  node {}: {} {}", sensor.node, loss.count, loss.what);
        }
        if sensor.locked {
            crate::say!("  node {}: the configuration is locked by a key", sensor.node);
        }
        if sensor.stored_configuration != "stored" {
            crate::say!("  node {}: no configuration is stored, defaults are in use", sensor.node);
        }
        for error in &sensor.errors {
            crate::say!("  node {}: {error}", sensor.node);
        }
    }
    crate::say!("  {}", traffic(&answer.bus, &answer.frames));
}
