//! `thud monitor`: the events of all sensors as they happen.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::Serialize;
use thud_firmware::configuration::Configuration;
use thud_firmware::dictionary::index;
use thud_firmware::limits::{LimitsProfile, Region, TransientLimit};
use thud_firmware::units::Hertz;

use crate::bus::Counters;
use crate::bus::option::BusOption;
use crate::client::Client;
use crate::client::find::Sensor;
use crate::client::samples::Streamed;
use crate::client::settings::Active;
use crate::client::watch::{Happening, SeenEvent, Source, Watch};
use crate::client::words::{searching, traffic};
use crate::interrupt;
use crate::json::JsonOption;

/// Show the events of the sensors on a bus as they happen
///
/// Alarms, events with their verdicts, faults in words, and losses, of all sensors in one table, until Ctrl-C, --count
/// or --duration. An event whose frames got lost is read from the sensor's log; one that is no longer there is
/// reported as lost. Times are the sensor's own, in seconds since its power-up. The limit beside the scaled force is
/// that of the configuration in force: `none` where no contact is permitted at all, `-` without a region.
///
/// With `--bus log:FILE` a candump log is followed as if live, in its own time or as fast as it can be read (`log:FILE,pace=1`
/// plays it in its own time). Nobody can be asked then: events that are not in the log are lost, and limits are known only
/// where somebody read the configuration while the log was written, as `thud log` does.
#[derive(clap::Args, Debug)]
#[command(
    after_long_help = "Examples:\n  thud monitor\n  thud monitor --count 3 --json events.json\n  thud monitor --bus log:monday.log"
)]
pub struct Monitor {
    #[command(flatten)]
    bus: BusOption,
    /// Only the sensor with this node id
    #[arg(long, value_name = "ID", value_parser = clap::value_parser!(u8).range(1..=127))]
    node: Option<u8>,
    /// End after so many events
    #[arg(long, value_name = "N")]
    count: Option<u64>,
    /// End after so many seconds
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Do not switch sensors to Operational; those that are not send no events
    #[arg(long)]
    listen_only: bool,
    /// Of a log: samples per second of sensors that nobody asked for it while the log was written
    #[arg(long, value_name = "HZ", default_value_t = Configuration::DEFAULT.chain.sample_rate.0)]
    sample_rate: f32,
    #[command(flatten)]
    json: JsonOption,
}

#[derive(Serialize)]
struct Answer {
    sensors: Vec<Sensor>,
    events: Vec<Judged>,
    /// Events that can no longer be read.
    lost: u64,
    /// Everything else that happened, in order.
    other: Vec<Happening>,
    /// Sample streams that came by, for each sensor that sent one.
    streams: Vec<Stream>,
    frames: Counters,
}

#[derive(Serialize)]
struct Stream {
    node: u8,
    #[serde(flatten)]
    streamed: Streamed,
}

/// An event beside the limits of the configuration that is in force.
#[derive(Serialize)]
#[expect(non_snake_case, reason = "the keys carry their units")]
struct Judged {
    #[serde(flatten)]
    event: SeenEvent,
    /// Limit of the scaled force; `null` without a region, and where no contact is permitted.
    transient_limit_N: Option<f32>,
    /// Limit of the quasi-static force; `null` without a region.
    quasi_static_limit_N: Option<f32>,
}

/// Configurations of the sensors, read again when their revision changes: event frames have no room for limits.
#[derive(Default)]
struct Limits(BTreeMap<u8, Active>);

impl Limits {
    /// The event with its limits; without them where the sensor does not answer.
    fn judged(&mut self, client: &mut Client, event: SeenEvent) -> Judged {
        let (mut transient, mut quasi_static) = (None, None);
        let judged_by = if client.line().is_playback() {
            overheard(client, event.node)
        } else {
            self.of(client, event.node).map(|Active { configuration, .. }| (configuration.region, configuration.limits))
        };
        if let Some((Some(region), profile)) = judged_by {
            let limits = profile.limits(region);
            quasi_static = Some(limits.quasi_static.0);
            if let TransientLimit::UpTo(limit) = limits.transient {
                transient = Some(limit.0);
            }
        }
        Judged { event, transient_limit_N: transient, quasi_static_limit_N: quasi_static }
    }

    fn of(&mut self, client: &mut Client, node: u8) -> Option<&Active> {
        let revision: u32 = client.sdo(node).read(index::TRANSACTION, 3).ok()?;
        if self.0.get(&node).is_none_or(|active| active.revision != revision) {
            self.0.insert(node, client.read_configuration(node).ok()?);
        }
        self.0.get(&node)
    }
}

/// Region and table of limits, where somebody in the log read them.
fn overheard(client: &mut Client, node: u8) -> Option<(Option<Region>, LimitsProfile)> {
    let mut number = |sub| client.line().overheard(node, index::JUDGEMENT, sub).map(|[number, ..]| number);
    Some((Region::from_number(number(1)?), LimitsProfile::from_number(number(3)?)?))
}

impl Monitor {
    pub(super) fn run(self) -> miette::Result<()> {
        let duration = crate::interrupt::span(self.duration)?;
        interrupt::catch();
        let mut client = Client::open(&self.bus.bus)?;
        let mut watch = if client.line().is_playback() {
            Watch::listening(Hertz(self.sample_rate))
        } else {
            let progress = searching(&client.line().describe());
            let sensors = client.find(self.node)?;
            let watch = Watch::new(&mut client, sensors, !self.listen_only)?;
            progress.finish_and_clear();
            watch
        };

        let quiet = self.json.owns_stdout();
        if !quiet {
            for sensor in watch.sensors() {
                crate::say!("Following node {}, serial {}. Ctrl-C ends.", sensor.node, sensor.serial);
            }
            crate::say!("{HEADING}");
        }
        let mut answer = Answer {
            sensors: vec![],
            events: vec![],
            lost: 0,
            other: vec![],
            streams: vec![],
            frames: Counters::default(),
        };
        let mut limits = Limits::default();
        let until = duration.map(|duration| client.line().now() + duration);
        while !interrupt::asked()
            && until.is_none_or(|until| client.line().now() < until)
            && !client.line().ended()
            && self.count.is_none_or(|count| (answer.events.len() as u64) < count)
        {
            for happening in watch.next(&mut client, Duration::from_millis(50))? {
                match happening {
                    Happening::Event(event) => {
                        let judged = limits.judged(&mut client, *event);
                        if !quiet {
                            crate::say!("{}", event_line(&judged));
                        }
                        answer.events.push(judged);
                    }
                    other => {
                        if !quiet {
                            crate::say!("{}", line(&other));
                        }
                        if let Happening::Lost { numbers, .. } = &other {
                            answer.lost += numbers.len() as u64;
                        }
                        answer.other.push(other);
                    }
                }
            }
        }
        answer.sensors = watch.sensors().cloned().collect();
        answer.streams = watch.streamed().map(|(node, streamed)| Stream { node, streamed }).collect();
        answer.frames = client.counters();
        self.json.write(&answer)?;
        if !quiet {
            let from_log = answer.events.iter().filter(|judged| judged.event.source == Source::Log).count();
            crate::say!("{} events, {from_log} of them from the log, {} lost.", answer.events.len(), answer.lost);
            for Stream { node, streamed } in &answer.streams {
                crate::say!(
                    "Node {node} streamed {} values, {} between them were lost.",
                    streamed.values,
                    streamed.lost
                );
            }
            crate::say!("{}", traffic(&client.line().describe(), &answer.frames));
        }
        Ok(())
    }
}

const HEADING: &str =
    "node       at s  contact        peak N     raw N  scaled N   limit N  impulse Ns      ms  verdict       flags";

/// One line of the table, or a sentence.
fn line(happening: &Happening) -> String {
    match happening {
        // Events have a line of their own, with their limits.
        Happening::Event(event) => format!("{:>4}             event {}", event.node, event.number),
        Happening::Alarm { node, noticed_s, force_n, .. } => {
            format!("{node:>4} {noticed_s:>10.4}  alarm: contact began, {force_n:.1} N so far")
        }
        Happening::Forecast { node, peak_n, bound_n, after_s, .. } => format!(
            "{node:>4}             forecast, {:.1} ms after the alarm: peak {peak_n:.0} ± {bound_n:.0} N",
            1e3 * after_s
        ),
        Happening::Lost { node, numbers } => {
            let numbers: Vec<String> = numbers.iter().map(u32::to_string).collect();
            format!(
                "{node:>4}             LOST: event {} was not received, and the log has overwritten it",
                numbers.join(", ")
            )
        }
        Happening::Emergency { node, words, .. } => format!("{node:>4}             fault: {words}"),
        Happening::Malformed { node, words } => format!("{node:>4}             cannot be read: {words}"),
        Happening::State { node, state } => format!("{node:>4}             is {state}"),
        Happening::Started { node, serial } => format!("{node:>4}             started (serial {serial})"),
        Happening::Silent { node } => format!("{node:>4}             SILENT: its heartbeat stopped"),
        Happening::Doubled { node, serials } => {
            let serials: Vec<String> = serials.iter().map(u32::to_string).collect();
            format!("{node:>4}             TWO DEVICES have this id (of serial {})", serials.join(" and "))
        }
    }
}

fn event_line(judged: &Judged) -> String {
    let event = &judged.event;
    let limit = match (judged.transient_limit_N, judged.quasi_static_limit_N) {
        (Some(limit), _) => format!("{limit:.0}"),
        (None, Some(_)) => "none".to_owned(),
        (None, None) => "-".to_owned(),
    };
    let contact = if event.contact == 0 { "blow".to_owned() } else { format!("rebound {}", event.contact) };
    let mut flags: Vec<&str> = event.flags.names().collect();
    if !event.saturated.is_empty() {
        flags.push("(values at the end of their frame's range)");
    }
    if event.source == Source::Log {
        flags.push("(from the log)");
    }
    format!(
        "{:>4} {:>10.4}  {contact:<12} {:>8.1}  {:>8.1}  {:>8.1}  {limit:>8}  {:>10.3}  {:>6.1}  {:<12}  {}",
        event.node,
        event.contact_s,
        event.peak_n,
        event.raw_peak_n,
        event.scaled_n,
        event.impulse_ns,
        event.duration_s * 1e3,
        event.verdict.name(),
        flags.join(" "),
    )
    .trim_end()
    .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_stand_under_their_headings() {
        let line = line(&Happening::Alarm { node: 32, noticed_s: 1.5, force_n: 14.24, impact: 1 });
        assert_eq!(line, "  32     1.5000  alarm: contact began, 14.2 N so far");
        assert!(HEADING.find("at s").unwrap() + 4 == line.find("1.5000").unwrap() + 6);
        let forecast =
            Happening::Forecast { node: 32, impact: 1, peak_n: 120.3, bound_n: 8.6, after_s: 0.004, saturated: false };
        assert_eq!(self::line(&forecast), "  32             forecast, 4.0 ms after the alarm: peak 120 ± 9 N");
    }
}
