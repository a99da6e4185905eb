//! The demonstration: a robot hits the simulated rig, and what the sensor says is put beside what truly happened.
//!
//! ```text
//! scenario (seed) ─▶ rig ─N─▶ chain ─codes─▶ firmware's tasks ─▶ CAN ─▶ client ─▶ sensed ─┐
//!                     └─────────────────────────── truth ─────────────────────────────────┴▶ table, JSON, page
//! ```
//!
//! Nothing is short-circuited: the sensor is found, configured and started over the simulated bus as a real one
//! would be; alarm and event come as frames, the event's full precision from the sensor's log and the force curve from
//! its memory, by SDO. Only the truth is taken from the rig itself.
//!
//! It ends with a [`riddle`]: a rig that hides something, and the diagnosis that has to find it.

use std::time::Duration;

use thud_firmware::configuration::Configuration;
use thud_firmware::event::Event;
use thud_firmware::storage::NotStored;
use thud_firmware::units::Kilogram;
use thud_sim::chain::ChainSettings;
use thud_sim::rig::RigError;

use crate::client::settings::{Raw, Wanted};
use crate::client::watch::{Happening, Watch};
use crate::client::{Client, ClientError};
use crate::report::ForceCurve;
use crate::simulated_sensor::{Setup, SimulatedSensor};

mod outcome;
mod riddle;
mod scenario;
mod shown;
mod truth;

pub use outcome::{Outcome, table};
pub use riddle::{RECORDINGS, Riddle, riddle};
pub use scenario::Scenario;
pub use shown::report;
pub use truth::Truth;

/// Idle time before the first blow: the sensor learns zero, hum and noise.
const SETTLING: Duration = Duration::from_secs(3);
/// From one blow to the next.
const BETWEEN: Duration = Duration::from_secs(2);
/// A blow's events must have come within this.
const PATIENCE: Duration = Duration::from_secs(5);
/// How often the robot controller says how heavy the robot is.
const MASS_PERIOD: Duration = Duration::from_millis(20);

/// Why the demonstration failed; each would be a fault of the program.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum DemonstrationError {
    /// The sensor did not do what a sensor does.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Client(#[from] ClientError),
    /// The rig could not be simulated.
    #[error("the rig cannot be simulated: {0}")]
    Rig(#[from] RigError),
    /// The simulated board could not be given its first configuration.
    #[error("the simulated board's flash refused its first configuration: {0:?}")]
    Flash(NotStored),
    /// A blow went unseen.
    #[error("no event came within {} s of virtual time after blow {blow}", PATIENCE.as_secs())]
    Unseen {
        /// Its number from 1.
        blow: usize,
    },
}

impl From<NotStored> for DemonstrationError {
    fn from(refused: NotStored) -> Self {
        Self::Flash(refused)
    }
}

/// One blow: what was sensed and what was true.
#[derive(Debug)]
pub struct Blow {
    /// Speed of the robot at contact, m/s.
    pub speed_m_per_s: f64,
    /// Its contacts as the sensor's log holds them, the blow first.
    pub events: Vec<Event>,
    /// Its force curve, downloaded; `None` if it was overwritten.
    pub curve: Option<ForceCurve>,
    /// From the true contact until the alarm frame was with the host, s.
    pub alarm_after_s: Option<f64>,
    /// What was true.
    pub truth: Truth,
}

/// A demonstration that has run.
#[derive(Debug)]
pub struct Demonstrated {
    /// What was simulated.
    pub scenario: Scenario,
    /// The configuration as read back from the sensor.
    pub configuration: Configuration,
    /// Its revision and hash.
    pub stamp: (u32, u32),
    /// Serial number and node id of the sensor.
    pub sensor: (u32, u8),
    /// The blows in order.
    pub blows: Vec<Blow>,
    /// Frames that the host received and lost.
    pub frames: (u64, u64),
    /// Virtual time that passed, s.
    pub virtual_s: f64,
}

/// Runs the demonstration of a scenario; `progress` hears what is being done.
///
/// # Errors
/// See [`DemonstrationError`].
pub fn demonstrate(scenario: Scenario, mut progress: impl FnMut(&str)) -> Result<Demonstrated, DemonstrationError> {
    progress("switching the simulated sensor on");
    let sensor = SimulatedSensor::new(Setup {
        seed: scenario.seed,
        serial: scenario.serial,
        configuration: Configuration::DEFAULT,
        chain: ChainSettings::workshop(),
        rig: scenario.rig,
        effects: scenario.effects.clone(),
    })?;
    let mut client = Client::new(Box::new(sensor.bus()));
    let found = client.the_sensor(None)?;
    let node = found.node;

    progress("configuring it over the bus");
    let mut wanted = Wanted::default();
    wanted.set("region", Raw::U8(scenario.region as u8));
    wanted.set("body stiffness", Raw::F32(scenario.region.body().stiffness.0));
    client.configure(node, &wanted, None)?;
    let mut watch = Watch::new(&mut client, vec![found.clone()], true)?;
    let mut robot = Robot { mass: Kilogram(scenario.believed_mass_kg as f32), node, sequence: 0 };
    robot.stream(&mut client, &mut watch, SETTLING)?;
    let active = client.read_configuration(node)?;

    let mut blows = Vec::new();
    for (index, approach) in scenario.approaches().into_iter().enumerate() {
        progress(&format!(
            "blow {} of {}: {:.2} m/s",
            index + 1,
            scenario.speeds_m_per_s.len(),
            approach.speed_m_per_s
        ));
        robot.stream(&mut client, &mut watch, BETWEEN)?;
        let (begins_s, impact) = sensor.strike(&approach)?;
        let seen = robot.wait(&mut client, &mut watch)?.ok_or(DemonstrationError::Unseen { blow: index + 1 })?;
        let mut events = client.logged_events(node)?;
        events.retain(|event| event.impact & 0xFFFF == u32::from(seen.impact));
        events.sort_by_key(|event| event.contact);
        if events.is_empty() {
            return Err(DemonstrationError::Unseen { blow: index + 1 });
        }
        let curve = download(&mut client, node, &events[0], &active.configuration)?;
        let truth = Truth::new(&impact, begins_s, &scenario, &active.configuration);
        blows.push(Blow {
            speed_m_per_s: approach.speed_m_per_s,
            events,
            curve,
            alarm_after_s: seen.alarm_at.map(|at| at.as_secs_f64() - truth.contacts[0].contact_s),
            truth,
        });
    }
    let counters = client.counters();
    Ok(Demonstrated {
        scenario,
        configuration: active.configuration,
        stamp: (active.revision, active.hash),
        sensor: (found.serial, node),
        blows,
        frames: (counters.received, counters.lost),
        virtual_s: client.line().now().as_secs_f64(),
    })
}

/// The robot's controller on the bus: it says all the time how heavy the robot is.
struct Robot {
    mass: Kilogram,
    node: u8,
    sequence: u16,
}

/// What was heard of a blow.
struct Seen {
    impact: u16,
    alarm_at: Option<Duration>,
}

impl Robot {
    fn tell(&mut self, client: &mut Client) -> Result<(), ClientError> {
        self.sequence = self.sequence.wrapping_add(1);
        Ok(client.send_effective_mass(self.node, self.mass, self.sequence)?)
    }

    /// Streams the mass for some time in which nothing is expected.
    fn stream(&mut self, client: &mut Client, watch: &mut Watch, time: Duration) -> Result<(), ClientError> {
        let until = client.line().now() + time;
        while client.line().now() < until {
            self.tell(client)?;
            self.listen(client, watch, |_| {})?;
        }
        Ok(())
    }

    /// Streams the mass until the events of a blow have come.
    fn wait(&mut self, client: &mut Client, watch: &mut Watch) -> Result<Option<Seen>, ClientError> {
        let until = client.line().now() + PATIENCE;
        let (mut alarm_at, mut impact) = (None, None);
        while impact.is_none() && client.line().now() < until {
            self.tell(client)?;
            self.listen(client, watch, |happened| match happened {
                (at, Happening::Alarm { .. }) => alarm_at = alarm_at.or(Some(*at)),
                (_, Happening::Event(event)) if event.contact == 0 => impact = Some(event.impact),
                _ => {}
            })?;
        }
        // The frames of rebounds follow at once; they are read from the log.
        Ok(impact.map(|impact| Seen { impact, alarm_at }))
    }

    fn listen(
        &mut self,
        client: &mut Client,
        watch: &mut Watch,
        mut hear: impl FnMut(&(Duration, Happening)),
    ) -> Result<(), ClientError> {
        let until = client.line().now() + MASS_PERIOD;
        while client.line().now() < until {
            let left = until.saturating_sub(client.line().now());
            for happening in watch.next(client, left)? {
                hear(&(client.line().now(), happening));
            }
        }
        Ok(())
    }
}

/// The captured curve of an event, as force above the zero that the sensor knew.
fn download(
    client: &mut Client,
    node: u8,
    event: &Event,
    configuration: &Configuration,
) -> Result<Option<ForceCurve>, ClientError> {
    for (impact, slot) in client.stored_curves(node)? {
        if impact == event.impact {
            let curve = client.download_curve(node, slot, impact, &mut |_, _| {})?;
            return Ok(curve.map(|curve| {
                let raw = curve.forces().map(|force| force.0).collect();
                ForceCurve::new(curve.first_index, &configuration.chain, raw, configuration.filter)
            }));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests;
