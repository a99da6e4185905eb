//! `thud record`: the captured force curves of a sensor, into a campaign.

use std::path::{Path, PathBuf};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use miette::{IntoDiagnostic as _, WrapErr as _};
use serde::Serialize;
use thud_firmware::dictionary::index;
use thud_firmware::event::Event;

use crate::bus::Counters;
use crate::bus::option::BusOption;
use crate::campaign::{self, Campaign, Entry, Estimate, Observed, Rig, RigKind};
use crate::client::recording::Curve;
use crate::client::watch::{Happening, Watch};
use crate::client::words::{searching, traffic};
use crate::client::{Client, find::Sensor};
use crate::decimal::{decimal, significant};
use crate::interrupt;
use crate::json::JsonOption;
use crate::recording::{Channel, FORCE, Recording};

/// Download the captured force curves of a sensor into a campaign
///
/// First what the sensor still holds (the latest curve), then each new one as it happens, until --count, --duration or
/// Ctrl-C. The campaign in DIR is complete after each curve. A curve that came damaged is fetched again, never
/// patched; one that was overwritten before it could be fetched is counted as lost.
///
/// A campaign also says what the experimenter believes: give --speed and --mass with their standard deviations.
/// Without --speed, the speed is estimated from impulse and mass (v = J / (m (1 + e)), e = 0.8 ± 0.15).
#[derive(clap::Args, Debug)]
#[command(after_long_help = "Example:\n  thud record --out chest-pose-1 --count 5 --speed 0.25 --speed-sd 0.003")]
pub struct Record {
    #[command(flatten)]
    bus: BusOption,
    /// The sensor with this node id; needed where there are several
    #[arg(long, value_name = "ID", value_parser = clap::value_parser!(u8).range(1..=127))]
    node: Option<u8>,
    /// Folder of the campaign; it must not hold one already
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// End after so many curves
    #[arg(long, value_name = "N")]
    count: Option<usize>,
    /// End after so many seconds
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Only what the sensor holds now; do not wait for more
    #[arg(long, conflicts_with = "new_only")]
    stored_only: bool,
    /// Only curves of contacts from now on
    #[arg(long)]
    new_only: bool,
    #[command(flatten)]
    believed: Believed,
    #[command(flatten)]
    json: JsonOption,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "What you believe")]
struct Believed {
    /// Name of the campaign [default: that of the folder]
    #[arg(long)]
    name: Option<String>,
    /// Speed at contact
    #[arg(long, value_name = "M/S")]
    speed: Option<f64>,
    /// Its standard deviation [default: 1 % of it]
    #[arg(long, value_name = "M/S", requires = "speed")]
    speed_sd: Option<f64>,
    /// Effective mass of the robot [default: what the sensor was told]
    #[arg(long, value_name = "KG")]
    mass: Option<f64>,
    /// Its standard deviation [default: 3 % of it]
    #[arg(long, value_name = "KG")]
    mass_sd: Option<f64>,
    /// Standard deviation of the configured body stiffness [default: 5 % of it]
    #[arg(long, value_name = "N/M")]
    stiffness_sd: Option<f64>,
    /// Label of the robot's configuration (pose, load); recordings of one share the robot's mass error
    #[arg(long, value_name = "LABEL")]
    configuration: Option<String>,
}

#[derive(Serialize)]
struct Answer {
    campaign: String,
    node: u8,
    serial: u32,
    recordings: Vec<Recorded>,
    /// Curves that were overwritten before they could be fetched, or never came whole.
    lost: u64,
    /// What else is to be known, a sentence each.
    notes: Vec<String>,
    frames: Counters,
}

#[derive(Serialize)]
struct Recorded {
    file: String,
    impact: u32,
    samples: usize,
    sample_rate_hz: f32,
    #[serde(rename = "peak_N")]
    peak_n: f32,
    verdict: &'static str,
    flags: Vec<&'static str>,
    configuration_revision: u32,
    /// How often it came damaged and was fetched again.
    refetched: u32,
}

impl Record {
    pub(super) fn run(self) -> miette::Result<()> {
        let duration = crate::interrupt::span(self.duration)?;
        if self.out.join(campaign::FILE_NAME).exists() {
            miette::bail!(
                help = "choose another folder with --out; nothing is overwritten",
                "{} already holds a campaign",
                self.out.display()
            );
        }
        interrupt::catch();
        let answer = self.record(&mut Client::open(&self.bus.bus)?, duration)?;
        self.json.write(&answer)
    }

    /// Fetches what there is and what comes, until enough is there or time is up.
    fn record(&self, client: &mut Client, duration: Option<Duration>) -> miette::Result<Answer> {
        let progress = searching(&client.line().describe());
        let sensor = client.the_sensor(self.node)?;
        progress.finish_and_clear();

        let mut session = Session::begin(client, sensor, self)?;
        let node = session.sensor.node;
        let mut watch = Watch::new(client, vec![session.sensor.clone()], true)?;
        let stored = client.stored_curves(node)?;
        if self.new_only {
            session.last_impact = stored.last().map(|(impact, _)| *impact);
        } else {
            session.fetch_new(client, self.count)?;
        }

        let until = duration.map(|duration| client.line().now() + duration);
        while !self.stored_only
            && !interrupt::asked()
            && until.is_none_or(|until| client.line().now() < until)
            && self.count.is_none_or(|count| session.answer.recordings.len() < count)
        {
            let happened = watch.next(client, Duration::from_millis(50))?;
            for happening in &happened {
                session.hear(happening);
            }
            // Events of an impact come together, when its curve is complete.
            let blows = happened.iter().filter_map(|happening| match happening {
                Happening::Event(event) if event.node == node && event.contact == 0 => Some(event.impact),
                _ => None,
            });
            let blows: Vec<u16> = blows.collect();
            if !blows.is_empty() {
                session.fetch_new(client, self.count)?;
                blows.into_iter().for_each(|impact| session.miss(impact));
            }
        }
        Ok(session.finish(client))
    }
}

/// One run of the command.
struct Session<'a> {
    record: &'a Record,
    sensor: Sensor,
    campaign: Campaign,
    last_impact: Option<u32>,
    answer: Answer,
}

impl<'a> Session<'a> {
    fn begin(client: &mut Client, sensor: Sensor, record: &'a Record) -> miette::Result<Self> {
        let node = sensor.node;
        let active = client.read_configuration(node)?;
        let configuration = active.configuration;
        let noise: f32 = client.sdo(node).read(index::DETECTOR, 2).into_diagnostic()?;
        let mass_age: u32 = client.sdo(node).read(index::RECEIVED_MASS, 3).into_diagnostic()?;
        if record.believed.mass.is_none() && configuration.effective_mass.is_none() && mass_age == u32::MAX {
            miette::bail!(
                help = "give it here with --mass KG, or to the sensor with `thud configure --mass KG`",
                "nobody has told the sensor the robot's effective mass, and a campaign needs it"
            );
        }
        let stiffness = decimal(configuration.body_stiffness.0);
        let name = record.believed.name.clone().unwrap_or_else(|| {
            record.out.file_name().map_or_else(|| "recorded".to_owned(), |name| name.to_string_lossy().into_owned())
        });
        let chain = configuration.chain;
        let campaign = Campaign {
            name,
            rig: Rig {
                kind: RigKind::Impact,
                body_stiffness_n_per_m: Some(Estimate::new(
                    stiffness,
                    record.believed.stiffness_sd.unwrap_or(significant(0.05 * stiffness, 4)),
                )),
                pad_stiffness_n_per_m: None,
                moving_mass_kg: None,
                gravity_along_impact_m_per_s2: RigKind::Impact.default_gravity_m_per_s2(),
                spring_repeatability: campaign::SPRING_REPEATABILITY,
            },
            chain: campaign::Chain {
                sample_rate_hz: chain.sample_rate.0.into(),
                noise_rms: significant(noise.into(), 4),
                full_scale: Some(significant(f64::from(chain.newton_per_code) * f64::from(chain.zero_code), 6)),
                observed: Observed::Force,
            },
            recordings: Vec::new(),
        };
        let answer = Answer {
            campaign: record.out.display().to_string(),
            node,
            serial: sensor.serial,
            recordings: Vec::new(),
            lost: 0,
            notes: Vec::new(),
            frames: Counters::default(),
        };
        Ok(Self { record, sensor, campaign, last_impact: None, answer })
    }

    fn say(&self, words: &str) {
        if !self.record.json.owns_stdout() {
            crate::say!("{words}");
        }
    }

    fn note(&mut self, words: String) {
        self.say(&format!("  {words}"));
        self.answer.notes.push(words);
    }

    fn hear(&mut self, happening: &Happening) {
        match happening {
            Happening::Emergency { node, words, .. } if *node == self.sensor.node => {
                self.note(format!("fault: {words}"));
            }
            Happening::Started { node, .. } if *node == self.sensor.node => {
                self.last_impact = None;
                self.note("the sensor started anew; its numbers begin at 1 again".to_owned());
            }
            Happening::Silent { node } if *node == self.sensor.node => {
                self.note("the sensor's heartbeat stopped".to_owned());
            }
            _ => {}
        }
    }

    /// Fetches the curves that are new to us, and counts those that are gone.
    fn fetch_new(&mut self, client: &mut Client, count: Option<usize>) -> miette::Result<()> {
        let node = self.sensor.node;
        for (impact, slot) in client.stored_curves(node)? {
            if self.last_impact.is_some_and(|last| impact <= last)
                || count.is_some_and(|count| self.answer.recordings.len() >= count)
            {
                continue;
            }
            let missed = self.last_impact.map_or(0, |last| impact - last - 1);
            if missed > 0 {
                self.answer.lost += u64::from(missed);
                self.note(format!(
                    "{missed} curves before impact {impact} were overwritten before they could be fetched"
                ));
            }
            self.last_impact = Some(impact);
            let bar = ProgressBar::new(0)
                .with_style(
                    ProgressStyle::with_template("{msg} {wide_bar} {bytes}/{total_bytes}")
                        .unwrap_or_else(|_| ProgressStyle::default_bar()),
                )
                .with_message(format!("curve of impact {impact}"));
            let fetched = client.download_curve(node, slot, impact, &mut |come, of| {
                bar.set_length(of as u64);
                bar.set_position(come as u64);
            });
            bar.finish_and_clear();
            match fetched {
                Ok(Some(curve)) => self.keep(client, &curve)?,
                Ok(None) => {
                    self.answer.lost += 1;
                    self.note(format!("the curve of impact {impact} was overwritten while it was fetched"));
                }
                Err(error @ crate::client::ClientError::Recording { .. }) => {
                    self.answer.lost += 1;
                    self.note(error.to_string());
                }
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }

    /// Counts the curve of an impact that was told and is not among the stored ones: it was over while another was fetched.
    fn miss(&mut self, low: u16) {
        let Some(impact) = later(self.last_impact.unwrap_or(0), low) else { return };
        if self.record.count.is_some_and(|count| self.answer.recordings.len() >= count) {
            return;
        }
        self.last_impact = Some(impact);
        self.answer.lost += 1;
        self.note(format!("the curve of impact {impact} was not kept, because another one was being fetched"));
    }

    /// Writes a curve, and the campaign that now has it.
    fn keep(&mut self, client: &mut Client, curve: &Curve) -> miette::Result<()> {
        let node = self.sensor.node;
        let blow = client.logged_blow(node, curve.impact)?;
        let number = self.answer.recordings.len() + 1;
        let file = format!("recordings/{number:03}.csv");
        self.recording(curve, blow.as_ref())?
            .write(&self.record.out.join(&file))
            .into_diagnostic()
            .wrap_err_with(|| format!("cannot write {}", self.record.out.join(&file).display()))?;

        let rate = f64::from(curve.sample_rate.0);
        if (rate - self.campaign.chain.sample_rate_hz).abs() > 1e-6 * rate {
            if self.campaign.recordings.is_empty() {
                self.campaign.chain.sample_rate_hz = rate;
            } else {
                self.note(format!("{file} was sampled at {rate} Hz, the others at another rate"));
            }
        }
        let peak = curve.forces().fold(0.0_f32, |peak, force| peak.max(force.0));
        let entry = self.entry(&file, blow.as_ref());
        let (verdict, flags) = blow
            .as_ref()
            .map_or(("none", vec![]), |event| (event.severity.verdict.name(), event.flags.names().collect::<Vec<_>>()));
        match entry {
            Some(entry) => self.campaign.recordings.push(entry),
            None => self.note(format!("{file} is not in the campaign: its effective mass or speed is unknown")),
        }
        self.answer.recordings.push(Recorded {
            file: file.clone(),
            impact: curve.impact,
            samples: curve.codes.len(),
            sample_rate_hz: curve.sample_rate.0,
            peak_n: peak,
            verdict,
            flags,
            configuration_revision: curve.configuration_revision,
            refetched: curve.refetched,
        });
        if !self.campaign.recordings.is_empty() {
            write_campaign(&self.record.out, &self.campaign)?;
        }
        let again =
            if curve.refetched > 0 { format!(", fetched {} times more", curve.refetched) } else { String::new() };
        self.say(&format!("  {file}: impact {}, {} samples, {peak:.1} N{again}", curve.impact, curve.codes.len()));
        Ok(())
    }

    fn recording(&self, curve: &Curve, blow: Option<&Event>) -> miette::Result<Recording> {
        let began = curve.times_s().next().unwrap_or(0.0);
        let rate = f64::from(curve.sample_rate.0);
        let times = (0..curve.codes.len()).map(|sample| sample as f64 / rate).collect();
        let forces = curve.forces().map(|force| force.0.into()).collect();
        let mut comments = vec![
            format!("impact {} of sensor {} (node {})", curve.impact, self.sensor.serial, self.sensor.node),
            format!("first sample {began:.6} s after its power-up"),
            format!("configuration revision {}, hash {:08x}", curve.configuration_revision, curve.configuration_hash),
        ];
        if let Some(event) = blow {
            let flags: Vec<&str> = event.flags.names().collect();
            let flags = if flags.is_empty() { "none".to_owned() } else { flags.join(" ") };
            comments.push(format!("verdict {}, flags {flags}", event.severity.verdict.name()));
            if self.record.believed.speed.is_none() {
                comments.push("the campaign's speed of it is estimated from impulse and mass".to_owned());
            }
        }
        let channel = Channel { name: FORCE.to_owned(), values: forces };
        let recording = Recording::new(times, vec![channel]).into_diagnostic()?;
        Ok(recording.with_comments(comments))
    }

    /// What is believed of a recording; `None` when nobody knows the mass or the speed.
    fn entry(&self, file: &str, blow: Option<&Event>) -> Option<Entry> {
        let believed = &self.record.believed;
        let mass = match (believed.mass, blow.and_then(|event| event.severity.effective_mass)) {
            (Some(mass), _) => mass,
            (None, Some(mass)) => decimal(mass.0),
            (None, None) => return None,
        };
        let speed = match (believed.speed, blow) {
            (Some(speed), _) => Estimate::new(speed, believed.speed_sd.unwrap_or(significant(0.01 * speed, 4))),
            (None, Some(event)) => speed_from_impulse(event.impulse.0.into(), mass),
            (None, None) => return None,
        };
        Some(Entry {
            file: file.to_owned(),
            impact_speed_m_per_s: speed,
            effective_mass_kg: Estimate::new(mass, believed.mass_sd.unwrap_or(significant(0.03 * mass, 4))),
            configuration: believed.configuration.clone(),
        })
    }

    fn finish(mut self, client: &mut Client) -> Answer {
        self.answer.frames = client.counters();
        self.say(&format!(
            "{} curves in {}, {} lost.",
            self.answer.recordings.len(),
            self.answer.campaign,
            self.answer.lost
        ));
        self.say(&traffic(&client.line().describe(), &self.answer.frames));
        self.answer
    }
}

/// The speed that this impulse means for this mass: J = m v (1 + e), where e is the restitution of body spring and
/// pad. Soft rigs have e = 0.8 ± 0.15, which makes 0.15 / 1.8 = 8 % of the speed.
fn speed_from_impulse(impulse_ns: f64, mass_kg: f64) -> Estimate {
    const RESTITUTION: f64 = 0.8;
    const SD: f64 = 0.15 / (1.0 + RESTITUTION);
    let speed = impulse_ns / (mass_kg * (1.0 + RESTITUTION));
    Estimate::new(significant(speed, 4), significant(SD * speed, 2))
}

/// The number after `last` whose low 16 bits these are; `None` if they are those of `last` or of one before it.
fn later(last: u32, low: u16) -> Option<u32> {
    let ahead = low.wrapping_sub(last as u16);
    (1..0x8000).contains(&ahead).then(|| last.wrapping_add(ahead.into()))
}

/// The new file replaces the old one whole, so that a campaign is never half-written.
fn write_campaign(folder: &Path, campaign: &Campaign) -> miette::Result<()> {
    let path = folder.join(campaign::FILE_NAME);
    let fresh = folder.join(format!("{}.new", campaign::FILE_NAME));
    std::fs::write(&fresh, campaign.to_toml())
        .and_then(|()| std::fs::rename(&fresh, &path))
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;

    use clap::Parser as _;
    use thud_firmware::configuration::Configuration;
    use thud_firmware::units::Kilogram;
    use thud_sim::board::{BoardSettings, commission, firmware};
    use thud_sim::bus::{BitRate, Traffic};
    use thud_sim::force::Blows;
    use thud_sim::world::World;

    use super::*;
    use crate::bus::simulated::SimulatedBus;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        record: Record,
    }

    /// Over a bus with 60 % of foreign load a curve takes longer than robots strike: each impact is either recorded or counted as lost.
    #[test]
    fn curves_that_could_not_be_kept_are_counted() {
        let (mut world, blows) = (World::new(BitRate::MEGABIT, 3), Blows::new());
        let board = world.add_board(BoardSettings::new(7, 3), blows.clone(), firmware);
        let configuration = Configuration { effective_mass: Some(Kilogram(6.0)), ..Configuration::DEFAULT };
        commission(world.board(board).flash(), configuration).unwrap();
        for blow in 0..12 {
            blows.strike(8.0 + 0.75 * f64::from(blow), 0.03, |since_s| {
                90.0 * (since_s / 0.03 * std::f64::consts::PI).sin()
            });
        }
        let others = Traffic { identifiers: 0x081..=0x0FF, ..Traffic::with_load(0.6) };
        world.bus().attach_traffic("others", others);
        let mut client = Client::new(Box::new(SimulatedBus::new(Rc::new(RefCell::new(world)))));
        while client.line().now() < Duration::from_secs(3) {
            client.line().next(Duration::from_millis(100)).unwrap();
        }
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().to_str().unwrap();
        let line = Line::parse_from(["record", "--out", out, "--count", "3", "--new-only"]);
        let answer = line.record.record(&mut client, None).unwrap();
        let impacts: Vec<u32> = answer.recordings.iter().map(|recorded| recorded.impact).collect();
        assert!(answer.lost >= 1, "{impacts:?}");
        assert_eq!(u64::from(impacts[2] - impacts[0] + 1), 3 + answer.lost, "{impacts:?} {:?}", answer.notes);
        let said = "was not kept, because another one was being fetched";
        assert!(answer.notes.iter().any(|note| note.contains(said)), "{:?}", answer.notes);
    }

    #[test]
    fn an_impact_is_later_over_the_wrap_of_its_low_bits() {
        assert_eq!((later(0, 1), later(7, 7), later(7, 6)), (Some(1), None, None));
        assert_eq!((later(0x1_FFFE, 1), later(0x2_0001, 0xFFFE)), (Some(0x2_0001), None));
    }

    #[test]
    fn the_speed_follows_from_impulse_and_mass() {
        // 6 kg at 0.25 m/s that return with 0.8 of it: J = 6 · 0.25 · 1.8.
        let speed = speed_from_impulse(2.7, 6.0);
        assert!((speed.value - 0.25).abs() < 1e-12);
        assert!((speed.sd / speed.value - 0.0833).abs() < 1e-3);
    }
}
