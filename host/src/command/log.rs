//! `thud log`: everything that is on a bus, into a file that other people's tools read.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;
use std::time::Duration;

use indicatif::ProgressBar;
use miette::{IntoDiagnostic as _, WrapErr as _};
use serde::Serialize;
use thud_firmware::dictionary::index;

use crate::bus::Counters;
use crate::bus::option::BusOption;
use crate::bus::tap::Tap;
use crate::client::find::Sensor;
use crate::client::words::traffic;
use crate::client::{Client, ClientError, Nmt};
use crate::interrupt;
use crate::json::JsonOption;

/// Write everything on a bus to a candump log
///
/// can-utils (`canplayer`, `log2asc`), python-can (`can.LogReader`) and `thud monitor --bus log:FILE` read it. Before it
/// listens, sensors are asked for serial number, sample rate and limits; the answers are in the log, so that whoever
/// reads it later knows them. --listen-only asks nothing.
#[derive(clap::Args, Debug)]
#[command(
    after_long_help = "Examples:\n  thud log --bus can0 --out monday.log\n  thud log --duration 60 --out - | cantools decode docs/can/thud.dbc"
)]
pub struct Log {
    #[command(flatten)]
    bus: BusOption,
    /// The file; `-` is standard output
    #[arg(long, short, value_name = "FILE", default_value = "-")]
    out: PathBuf,
    /// What the interface is called in the log [default: its own name, `can0` where it has none]
    #[arg(long, value_name = "NAME", value_parser = interface_name)]
    interface: Option<String>,
    /// End after so many frames
    #[arg(long, value_name = "N")]
    count: Option<u64>,
    /// End after so many seconds
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Let the sensors stream their force while the log is written, each value the mean of N samples; 1 is every sample,
    /// 0.8 Mbit/s for each sensor
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=10_000), conflicts_with = "listen_only")]
    stream: Option<u16>,
    /// Send nothing: sensors are not asked who they are
    #[arg(long)]
    listen_only: bool,
    #[command(flatten)]
    json: JsonOption,
}

/// One word, as the format wants it; Linux permits 15 bytes.
fn interface_name(name: &str) -> Result<String, String> {
    let possible = (1..=15).contains(&name.len()) && name.bytes().all(|byte| byte.is_ascii_graphic());
    if possible { Ok(name.to_owned()) } else { Err("a name of 1 to 15 letters without blanks is possible".to_owned()) }
}

#[derive(Serialize)]
struct Answer {
    bus: String,
    /// Sensors that said who they are before the log began to be only listened to.
    sensors: Vec<Sensor>,
    lasted_s: f64,
    frames: Counters,
}

impl Log {
    pub(super) fn run(self) -> miette::Result<()> {
        let duration = interrupt::span(self.duration)?;
        let to_stdout = self.out.as_os_str() == "-";
        miette::ensure!(
            !(to_stdout && self.json.owns_stdout()),
            "log and JSON cannot both go to standard output: give one of them a file"
        );
        interrupt::catch();
        let bus = self.bus.bus.open()?;
        let log: Box<dyn Write> = if to_stdout {
            Box::new(StandardOutput)
        } else {
            let file = File::create(&self.out)
                .into_diagnostic()
                .wrap_err_with(|| format!("cannot write the log {}", self.out.display()))?;
            Box::new(BufWriter::new(file))
        };
        let interface = self.interface.as_deref().unwrap_or_else(|| self.bus.bus.interface());
        let mut client = Client::new(Box::new(Tap::new(bus, log, interface)));
        let quiet = to_stdout || self.json.owns_stdout();

        let sensors =
            if self.listen_only || client.line().is_playback() { Vec::new() } else { identities(&mut client)? };
        self.stream(&mut client, &sensors, self.stream)?;
        if !quiet {
            let known: Vec<String> =
                sensors.iter().map(|sensor| format!("node {} (serial {})", sensor.node, sensor.serial)).collect();
            let who = if known.is_empty() { "no sensor yet".to_owned() } else { known.join(", ") };
            crate::say!("Logging {} to {}: {who}. Ctrl-C ends.", client.line().describe(), self.out.display());
        }
        let progress = ProgressBar::new_spinner();
        progress.enable_steady_tick(Duration::from_millis(250));
        let until = duration.map(|duration| client.line().now() + duration);
        while !interrupt::asked()
            && until.is_none_or(|until| client.line().now() < until)
            && self.count.is_none_or(|count| client.counters().received < count)
            && !client.line().ended()
        {
            client.line().hear(Duration::from_millis(100))?;
            progress.set_message(format!("{} frames", client.counters().received));
        }
        progress.finish_and_clear();
        self.stream(&mut client, &sensors, None)?;

        let answer = Answer {
            bus: client.line().describe(),
            sensors,
            lasted_s: client.line().now().as_secs_f64(),
            frames: client.counters(),
        };
        self.json.write(&answer)?;
        if !quiet {
            crate::say!("{}", traffic(&answer.bus, &answer.frames));
        }
        Ok(())
    }
}

impl Log {
    /// Switches the streams of these sensors on, or off again what it has switched on. A sensor streams while it is Operational.
    fn stream(&self, client: &mut Client, sensors: &[Sensor], decimation: Option<u16>) -> Result<(), ClientError> {
        if self.stream.is_none() {
            return Ok(());
        }
        for sensor in sensors {
            if decimation.is_some() {
                client.nmt(Nmt::Start, sensor.node)?;
            }
            client.sdo(sensor.node).write(index::STREAM, 1, decimation.unwrap_or(0))?;
        }
        Ok(())
    }
}

/// Asks sensors for what a reader of the log wants to know; that nobody is there yet is no reason not to log.
fn identities(client: &mut Client) -> Result<Vec<Sensor>, ClientError> {
    let sensors = match client.find(None) {
        Ok(sensors) => sensors,
        Err(ClientError::Bus(error)) => return Err(error.into()),
        Err(_) => return Ok(Vec::new()),
    };
    for sensor in &sensors {
        let mut sdo = client.sdo(sensor.node);
        for (object, sub) in [(index::CHAIN, 1), (index::JUDGEMENT, 1), (index::JUDGEMENT, 3), (index::BOARD, 8)] {
            // What does not answer now is missing from the log, and `monitor` then says that it does not know it.
            let _ = sdo.upload(object, sub);
        }
    }
    Ok(sensors)
}

/// Standard output, whose reader may go.
struct StandardOutput;

impl Write for StandardOutput {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        crate::standard_output::write(bytes).map(|()| bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
