//! How a sensor is: identity, configuration, noise, losses, bus.

use std::time::Duration;

use serde::Serialize;
use thud_firmware::dictionary::index;

use super::find::Sensor;
use super::{Client, ClientError, emergency};

/// Everything that a sensor says about itself.
#[derive(Clone, Debug, Serialize)]
pub struct Status {
    /// Node id.
    pub node: u8,
    /// Serial number.
    pub serial: u32,
    /// Device name.
    pub device: String,
    /// Hardware version.
    pub hardware: String,
    /// Firmware version.
    pub firmware: String,
    /// NMT state as the heartbeat says it; `None` when no heartbeat was heard.
    pub state: Option<&'static str>,
    /// Configured region's name, or `none`.
    pub region: String,
    /// Revision of the active configuration.
    pub configuration_revision: u32,
    /// Its hash.
    #[serde(serialize_with = "hexadecimal")]
    pub configuration_hash: u32,
    /// `stored`, `default` (none stored yet) or `unreadable` (defaults in use).
    pub stored_configuration: &'static str,
    /// Noise of the idle signal, root mean square.
    #[serde(rename = "noise_N")]
    pub noise_n: f32,
    /// Hum, amplitude.
    #[serde(rename = "hum_N")]
    pub hum_n: f32,
    /// Force above which an onset is seen.
    #[serde(rename = "threshold_N")]
    pub threshold_n: f32,
    /// Code at no force.
    pub zero_code: f32,
    /// Zero and noise are settled; before that nothing passes.
    pub settled: bool,
    /// Whether writing the configuration wants a key.
    pub locked: bool,
    /// How often the board has started, this time included; event numbers begin anew with each start. 0 where it is not known.
    pub start: u32,
    /// Since power-up.
    pub uptime_s: u32,
    /// Why it started.
    pub reset_cause: &'static str,
    /// Events since power-up.
    pub events: u32,
    /// What was lost, by name; everything is 0 in a healthy sensor.
    pub losses: Vec<Loss>,
    /// Error state of its CAN controller.
    pub bus_state: &'static str,
    /// Transmit error counter.
    pub transmit_errors: u16,
    /// Receive error counter.
    pub receive_errors: u16,
    /// Faults that last, as bits of CiA 301's error register.
    pub error_register: u8,
    /// Error history in words, newest first.
    pub errors: Vec<String>,
}

/// A loss counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Loss {
    /// What.
    pub what: &'static str,
    /// How much.
    pub count: u32,
}

/// Sub-indices 1 to 14 of 0x2400.
const LOSSES: [&str; 14] = [
    "overruns",
    "lost samples",
    "frames evicted",
    "frames refused",
    "frames not received",
    "events overwritten",
    "curves overwritten",
    "bus-off",
    "impacts not evaluated",
    "alarms withheld",
    "events not sent",
    "storage failures",
    "stream frames dropped",
    "changes rejected",
];

/// NMT state in words, CiA 301 7.2.8.3.2.2.
#[must_use]
pub fn nmt_state(number: u8) -> &'static str {
    match number & 0x7F {
        0 => "boot-up",
        4 => "stopped",
        5 => "operational",
        127 => "pre-operational",
        _ => "unknown",
    }
}

/// A hash as it is shown everywhere: eight hexadecimal digits.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn hexadecimal<S: serde::Serializer>(hash: &u32, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{hash:08x}"))
}

impl Client {
    /// How this sensor is.
    ///
    /// # Errors
    /// [`ClientError::Sdo`].
    pub fn status(&mut self, sensor: &Sensor) -> Result<Status, ClientError> {
        let node = sensor.node;
        let mut sdo = self.sdo(node);
        let region: u8 = sdo.read(index::JUDGEMENT, 1)?;
        let losses = LOSSES
            .iter()
            .enumerate()
            .map(|(at, what)| Ok(Loss { what, count: sdo.read(index::LOSSES, at as u8 + 1)? }))
            .collect::<Result<Vec<_>, ClientError>>()?;
        let errors = (0..sdo.read::<u8>(index::ERROR_HISTORY, 0)?)
            .map(|at| Ok(emergency::history_entry(sdo.read(index::ERROR_HISTORY, at + 1)?)))
            .collect::<Result<Vec<_>, ClientError>>()?;
        let mut status = Status {
            node,
            serial: sensor.serial,
            device: sdo.read_text(index::DEVICE_NAME, 0)?,
            hardware: sdo.read_text(index::HARDWARE_VERSION, 0)?,
            firmware: sdo.read_text(index::SOFTWARE_VERSION, 0)?,
            state: None,
            region: super::settings::ITEMS[0].show(super::settings::Raw::U8(region)),
            configuration_revision: sdo.read(index::TRANSACTION, 3)?,
            configuration_hash: sdo.read(index::TRANSACTION, 4)?,
            stored_configuration: match sdo.read::<u8>(index::BOARD, 5)? {
                0 => "stored",
                1 => "default",
                _ => "unreadable",
            },
            noise_n: sdo.read(index::DETECTOR, 2)?,
            hum_n: sdo.read(index::DETECTOR, 3)?,
            threshold_n: sdo.read(index::DETECTOR, 6)?,
            zero_code: sdo.read(index::DETECTOR, 1)?,
            settled: sdo.read::<u8>(index::DETECTOR, 4)? != 0,
            locked: sdo.read::<u8>(index::LOCK, 1)? != 0,
            start: sdo.read(index::BOARD, 8)?,
            uptime_s: sdo.read(index::BOARD, 1)?,
            reset_cause: match sdo.read::<u8>(index::BOARD, 3)? {
                0 => "power",
                1 => "pin",
                2 => "watchdog",
                3 => "software",
                4 => "brown-out",
                5 => "panic",
                _ => "unknown",
            },
            events: sdo.read(index::EVENT_LOG, 2)?,
            losses,
            bus_state: match sdo.read::<u8>(index::BUS, 1)? {
                0 => "error active",
                1 => "error passive",
                _ => "bus-off",
            },
            transmit_errors: sdo.read(index::BUS, 2)?,
            receive_errors: sdo.read(index::BUS, 3)?,
            error_register: sdo.read(index::ERROR_REGISTER, 0)?,
            errors,
        };
        let heartbeat_ms: u16 = sdo.read(index::HEARTBEAT, 0)?;
        status.state = self.state(node, Duration::from_millis(heartbeat_ms.into()))?.map(nmt_state);
        Ok(status)
    }

    /// The node's NMT state from its next heartbeat, which comes within one and a half periods.
    fn state(&mut self, node: u8, period: Duration) -> Result<Option<u8>, ClientError> {
        let deadline = self.line.now() + (period * 3 / 2).min(Duration::from_secs(2));
        while self.line.heartbeat(node).is_none() && self.line.now() < deadline {
            self.line.listen(Duration::from_millis(20))?;
        }
        Ok(self.line.heartbeat(node).map(|(state, _)| state))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_loss_of_the_dictionary_has_its_name() {
        let object = thud_firmware::dictionary::object::find(index::LOSSES).unwrap();
        let names: Vec<String> = object.subs.iter().map(|sub| sub.name.to_lowercase()).collect();
        assert_eq!(names, LOSSES);
    }
}
