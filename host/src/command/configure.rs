//! `thud configure`: change what a sensor judges by, all or nothing.

use std::path::PathBuf;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use clap::builder::TypedValueParser as _;
use serde::Serialize;
use thud_firmware::configuration::{ContactKind, FilterProfile};
use thud_firmware::limits::{LimitsProfile, Region};

use crate::bus::option::BusOption;
use crate::client::settings::{Active, Change, Configured, ITEMS, Raw, Wanted};
use crate::client::words::searching;
use crate::client::{Client, ClientError, Nmt};
use crate::json::JsonOption;
use crate::key_file;
use crate::settings::{contact_word, one_of};
use crate::table::{Side, Table};

/// Set body region, stiffness, effective mass, limits, filter and node settings of a sensor
///
/// Only what is given changes, and all of it or nothing: the sensor checks the whole and says what it refuses and what
/// it would permit. The new configuration is in force between impacts, gets the next revision, and is kept in flash.
/// Without any setting, the present configuration is shown.
///
/// An armed (Operational) sensor refuses configuration: it is disarmed for the change and armed again, which is said. A
/// configuration can be locked with a key (--lock): from then on everybody reads it, and only who has the key changes it.
#[derive(clap::Args, Debug)]
#[command(
    after_long_help = "Examples:\n  thud configure --region chest --mass 6.1\n  thud configure --node 32 --node-id 33 --reset\n  thud configure --lock cell.key\n  thud configure --region face --key cell.key"
)]
pub struct Configure {
    #[command(flatten)]
    bus: BusOption,
    /// The sensor with this node id; needed where there are several
    #[arg(long, value_name = "ID", value_parser = clap::value_parser!(u8).range(1..=127))]
    node: Option<u8>,
    #[command(flatten)]
    judgement: Judgement,
    #[command(flatten)]
    chain: Chain,
    #[command(flatten)]
    on_bus: OnBus,
    #[command(flatten)]
    lock: Lock,
    #[command(flatten)]
    json: JsonOption,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "Lock")]
struct Lock {
    /// The key of a locked configuration: a file with 32 hexadecimal digits
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Lock the configuration with the key in FILE; where there is no such file, a new key is drawn and written there. The
    /// key crosses the bus as it is: do this where nobody else listens
    #[arg(long, value_name = "FILE", conflicts_with = "unlock")]
    lock: Option<PathBuf>,
    /// Remove the lock; needs --key
    #[arg(long, requires = "key")]
    unlock: bool,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "What is judged, and by what")]
struct Judgement {
    /// Body region that is hit; `none` for no verdict. Brings its stiffness, unless --stiffness is given
    #[arg(long, value_parser = region_names().map(|name| Region::from_name(&name).map_or(0, |region| region as u8)))]
    region: Option<u8>,
    /// Whether the body part can recoil (free) or not (clamped)
    #[arg(long, value_parser = one_of(&[ContactKind::Free, ContactKind::Clamped], contact_word))]
    contact: Option<ContactKind>,
    /// Table of limits
    #[arg(long, value_parser = one_of(&LimitsProfile::ALL, LimitsProfile::name))]
    limits: Option<LimitsProfile>,
    /// Stiffness of the body spring as assembled in the rig
    #[arg(long, value_name = "N/M")]
    stiffness: Option<f32>,
    /// Filter of the judged force
    #[arg(long, value_parser = one_of(&FilterProfile::ALL, FilterProfile::name))]
    filter: Option<FilterProfile>,
    /// Relative expanded uncertainty (k = 2) of the force: the guard band on both sides of a limit
    #[arg(long, value_name = "RATIO")]
    uncertainty: Option<f32>,
    /// Effective mass of the robot where none is received while it moves; 0 for unknown
    #[arg(long, value_name = "KG")]
    mass: Option<f32>,
    /// A received effective mass older than this when the contact begins is stale
    #[arg(long, value_name = "MS")]
    mass_max_age: Option<u32>,
    /// A contact is what rises above this many times the noise
    #[arg(long, value_name = "N")]
    onset_multiple: Option<f32>,
    /// A contact is what rises above this force, however quiet the signal is
    #[arg(long, value_name = "NEWTON")]
    onset_minimum: Option<f32>,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "Measuring chain (from the calibration certificate)")]
struct Chain {
    /// Samples per second
    #[arg(long, value_name = "HZ")]
    sample_rate: Option<f32>,
    /// Force of one ADC code
    #[arg(long, value_name = "NEWTON")]
    force_per_code: Option<f32>,
    /// ADC code at no force
    #[arg(long, value_name = "CODE")]
    zero_code: Option<u16>,
    /// Codes at or below this are clipped
    #[arg(long, value_name = "CODE")]
    clip_low: Option<u16>,
    /// Codes at or above this are clipped
    #[arg(long, value_name = "CODE")]
    clip_high: Option<u16>,
    /// Discharge time constant of cell and readout together
    #[arg(long, value_name = "S")]
    time_constant: Option<f32>,
    /// Lowest healthy bias voltage of the cell
    #[arg(long, value_name = "V")]
    bias_low: Option<f32>,
    /// Highest healthy bias voltage of the cell
    #[arg(long, value_name = "V")]
    bias_high: Option<f32>,
    /// Delay of the anti-alias filter in front of the ADC, taken off every reported instant
    #[arg(long, value_name = "S")]
    delay: Option<f32>,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "On the bus")]
struct OnBus {
    /// New node id, 1 to 127; takes effect at the next reset
    #[arg(long, value_name = "ID")]
    node_id: Option<u8>,
    /// Period of the heartbeat; 0 for none
    #[arg(long, value_name = "MS")]
    heartbeat: Option<u16>,
    /// Tell all sensors on the bus this computer's time
    #[arg(long)]
    set_time: bool,
    /// Reset the sensor afterwards, so that a new node id takes effect
    #[arg(long)]
    reset: bool,
}

fn region_names() -> clap::builder::PossibleValuesParser {
    std::iter::once("none").chain(Region::ALL.map(Region::name)).collect::<Vec<_>>().into()
}

#[derive(Serialize)]
struct Answer {
    node: u8,
    serial: u32,
    revision: u32,
    /// As it is shown everywhere: eight hexadecimal digits.
    hash: String,
    stored: bool,
    changes: Vec<Change>,
    configuration: Vec<Setting>,
}

#[derive(Serialize)]
struct Setting {
    setting: &'static str,
    value: String,
}

impl Configure {
    pub(super) fn run(self) -> miette::Result<()> {
        let key = self.lock.key.as_deref().map(key_file::read).transpose()?;
        let new_key = self.lock.lock.as_deref().map(key_file::read_or_draw).transpose()?;
        let mut client = Client::open(&self.bus.bus)?;
        let progress = searching(&client.line().describe());
        let sensor = client.the_sensor(self.node)?;
        let node = sensor.node;
        if self.on_bus.set_time {
            client.set_time(SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default())?;
        }
        progress.set_message(format!("configuring node {node}"));
        let wanted = self.wanted();
        let done = if wanted.is_empty() {
            let active = client.read_configuration(node)?;
            Configured {
                before: active,
                after: active,
                changes: vec![],
                discarded_foreign: false,
                disarmed: false,
                stored: true,
            }
        } else {
            client.configure(node, &wanted, key.as_ref())?
        };
        let mut disarmed = done.disarmed;
        if new_key.is_some() || self.lock.unlock {
            disarmed |= client.lock(node, new_key.as_ref(), key.as_ref())?;
        }
        let came_back = if self.on_bus.reset {
            progress.set_message(format!("waiting for node {node} after its reset"));
            Some(reset(&mut client, node, done.after.configuration.node.node_id)?)
        } else {
            None
        };
        progress.finish_and_clear();

        let answer = Answer {
            node,
            serial: sensor.serial,
            revision: done.after.revision,
            hash: format!("{:08x}", done.after.hash),
            stored: done.stored,
            changes: done.changes.clone(),
            configuration: ITEMS
                .iter()
                .map(|item| Setting { setting: item.name, value: item.show((item.get)(&done.after.configuration)) })
                .collect(),
        };
        self.json.write(&answer)?;
        if !self.json.owns_stdout() {
            print(&answer, &done, wanted.is_empty());
            if disarmed {
                crate::say!("  The sensor was armed (Operational): it was disarmed for the change and is armed again.");
            }
            if let Some(file) = &self.lock.lock {
                crate::say!("  The configuration is locked; only the key in {} changes it.", file.display());
            } else if self.lock.unlock {
                crate::say!("  The lock is removed; whoever is on the bus can change the configuration.");
            }
            if self.on_bus.set_time {
                crate::say!("  The time was sent to all sensors on the bus.");
            }
            if let Some(node) = came_back {
                crate::say!("  The sensor was reset and answers as node {node}.");
            }
        }
        Ok(())
    }

    fn wanted(&self) -> Wanted {
        let mut wanted = Wanted::default();
        let mut set = |name: &'static str, raw: Option<Raw>| {
            if let Some(raw) = raw {
                wanted.set(name, raw);
            }
        };
        let Self { judgement, chain, on_bus, .. } = self;
        let region_spring = judgement.region.and_then(Region::from_number).map(|region| region.body().stiffness.0);
        set("region", judgement.region.map(Raw::U8));
        set("contact", judgement.contact.map(|contact| Raw::U8(contact as u8)));
        set("limits", judgement.limits.map(|limits| Raw::U8(limits as u8)));
        set("body stiffness", judgement.stiffness.or(region_spring).map(Raw::F32));
        set("filter", judgement.filter.map(|filter| Raw::U8(filter as u8)));
        set("relative uncertainty", judgement.uncertainty.map(Raw::F32));
        set("effective mass", judgement.mass.map(Raw::F32));
        set("longest age of a received mass", judgement.mass_max_age.map(Raw::U32));
        set("onset multiple", judgement.onset_multiple.map(Raw::F32));
        set("onset minimum", judgement.onset_minimum.map(Raw::F32));
        set("sample rate", chain.sample_rate.map(Raw::F32));
        set("force per code", chain.force_per_code.map(Raw::F32));
        set("zero code", chain.zero_code.map(Raw::U16));
        set("clip low", chain.clip_low.map(Raw::U16));
        set("clip high", chain.clip_high.map(Raw::U16));
        set("time constant", chain.time_constant.map(Raw::F32));
        set("bias low", chain.bias_low.map(Raw::F32));
        set("bias high", chain.bias_high.map(Raw::F32));
        set("delay", chain.delay.map(Raw::F32));
        set("node id", on_bus.node_id.map(Raw::U8));
        set("heartbeat", on_bus.heartbeat.map(Raw::U16));
        wanted
    }
}

/// Resets the node and waits until it answers again, under the id that it has from now on.
fn reset(client: &mut Client, node: u8, next: u8) -> Result<u8, ClientError> {
    const BOOT: Duration = Duration::from_secs(5);
    client.nmt(Nmt::ResetNode, node)?;
    let deadline = client.line().now() + BOOT;
    loop {
        match client.find(Some(next)) {
            Ok(_) => return Ok(next),
            Err(ClientError::Nobody { .. }) if client.line().now() < deadline => {}
            Err(error) => return Err(error),
        }
    }
}

fn print(answer: &Answer, done: &Configured, show_all: bool) {
    if done.discarded_foreign {
        crate::say!("  Somebody had written settings and not applied them; they were discarded.");
    }
    let Active { revision, hash, .. } = done.after;
    if show_all {
        let mut table = Table::new(&[("setting", Side::Left), ("value", Side::Left)]);
        for setting in &answer.configuration {
            table.row([setting.setting.to_owned(), setting.value.clone()]);
        }
        crate::standard_output::say(format_args!("{table}"));
        crate::say!("  Node {}, serial {}: revision {revision}, hash {hash:08x}.", answer.node, answer.serial);
        return;
    }
    if answer.changes.is_empty() {
        crate::say!("  Nothing to change: node {} already has this configuration (revision {revision}).", answer.node);
        return;
    }
    let mut table = Table::new(&[("setting", Side::Left), ("old", Side::Left), ("", Side::Left), ("new", Side::Left)]);
    for change in &answer.changes {
        table.row([change.setting.to_owned(), change.old.clone(), "→".to_owned(), change.new.clone()]);
    }
    crate::standard_output::say(format_args!("{table}"));
    let kept = if done.stored { "kept in flash" } else { "NOT YET in flash: an impact is open or storing failed" };
    crate::say!(
        "  Node {}, serial {}: revision {} → {revision}, hash {hash:08x}, {kept}.",
        answer.node,
        answer.serial,
        done.before.revision
    );
    if answer.changes.iter().any(|change| change.setting == "node id") {
        crate::say!("  The new node id takes effect at the next reset (--reset).");
    }
}
