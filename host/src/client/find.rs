//! Who is on the bus: every node id is asked who it is, and all who answer are heard.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::Serialize;
use thud_firmware::dictionary::{PRODUCT_CODE, index};
use zencan_common::sdo::{SdoRequest, SdoResponse};

use super::ClientError;
use super::line::{Line, answers};
use super::sdo::{Sdo, SdoError};

/// First, who else talks is heard, so that another master's transfer is not broken off.
const LISTEN: Duration = Duration::from_millis(60);
/// The first answer may take so long; with [`LISTEN`] it is well within the 2 s that a person is asked to wait.
const FIRST: Duration = Duration::from_millis(1_500);
/// After the last answer nobody is expected any more: a sensor answers within milliseconds.
const AFTER: Duration = Duration::from_millis(250);

/// A sensor on the bus.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Sensor {
    /// Node id.
    pub node: u8,
    /// Serial number.
    pub serial: u32,
}

/// Asks one id or all.
pub(super) fn find(line: &mut Line, node: Option<u8>) -> Result<Vec<Sensor>, ClientError> {
    let asked: Vec<u8> = node.map_or_else(|| (1..=127).collect(), |node| vec![node]);

    let products = ask_all(line, &asked, index::IDENTITY, 2)?;
    let ours: Vec<u8> =
        products.iter().filter(|(_, answers)| answers.contains(&PRODUCT_CODE)).map(|(node, _)| *node).collect();
    let mut serials = ask_all(line, &ours, index::IDENTITY, 4)?;
    // One serial number twice may be the late answer to another tool, whose question went by before this one listened.
    let alike = |serials: &Vec<u32>| serials.len() > 1 && serials.iter().all(|serial| *serial == serials[0]);
    let again: Vec<u8> = serials.iter().filter(|(_, serials)| alike(serials)).map(|(node, _)| *node).collect();
    serials.extend(ask_all(line, &again, index::IDENTITY, 4)?);
    if serials.is_empty() {
        return Err(nobody(line, node, &products));
    }
    for (&node, serials) in &serials {
        if serials.len() > 1 {
            return Err(ClientError::Doubled { node, serials: serials.clone() });
        }
    }
    Ok(serials.into_iter().map(|(node, serials)| Sensor { node, serial: serials[0] }).collect())
}

/// Reads a 32-bit object of many nodes at once, and hears every answer, the second one of a node too.
///
/// Where another master asks the same at the same time, its answers are heard as well: answers that agree are told once unless they are
/// more than were asked for. Devices that share an id tell the same only where their objects hold the same.
pub(super) fn ask_all(
    line: &mut Line,
    nodes: &[u8],
    index: u16,
    sub: u8,
) -> Result<BTreeMap<u8, Vec<u32>>, ClientError> {
    let mut found = BTreeMap::<u8, Vec<u32>>::new();
    if nodes.is_empty() {
        return Ok(found);
    }
    line.listen(LISTEN)?;
    let (busy, free): (Vec<u8>, Vec<u8>) = nodes.iter().partition(|node| line.shared(**node, LISTEN));
    let foreign_before: Vec<u32> = free.iter().map(|node| line.foreign_requests(*node)).collect();
    for node in &free {
        line.ask(*node, SdoRequest::initiate_upload(index, sub).to_bytes())?;
    }
    let last = line.now() + if free.is_empty() { Duration::ZERO } else { FIRST };
    let mut until = last;
    while line.now() < until {
        let Some((node, data)) = line.any_answer(until.saturating_sub(line.now()))? else { continue };
        if let Ok(SdoResponse::ConfirmUpload { index: i, sub: s, data, .. }) = SdoResponse::try_from(data)
            && (i, s) == (index, sub)
        {
            found.entry(node).or_default().push(u32::from_le_bytes(data));
            until = last.min(line.now() + AFTER);
        }
    }
    for (node, before) in free.iter().zip(foreign_before) {
        let requests = 1 + line.foreign_requests(*node).wrapping_sub(before) as usize;
        if let Some(values) = found.get_mut(node)
            && values.len() <= requests
            && values.iter().all(|value| *value == values[0])
        {
            values.truncate(1);
        }
    }
    for node in busy {
        match Sdo::new(line, node).read::<u32>(index, sub) {
            Ok(value) => found.entry(node).or_default().push(value),
            Err(SdoError::Bus(error)) => return Err(error.into()),
            Err(_) => {}
        }
    }
    Ok(found)
}

fn nobody(line: &Line, node: Option<u8>, products: &BTreeMap<u8, Vec<u32>>) -> ClientError {
    let asked = match node {
        Some(node) => format!("node id {node} was asked"),
        None => "node ids 1 to 127 were asked".to_owned(),
    };
    let counters = line.counters();
    let mut heard = match counters.received {
        0 => "nothing at all was heard".to_owned(),
        1 => "one frame was heard".to_owned(),
        frames => format!("{frames} frames were heard"),
    };
    if counters.malformed > 0 {
        heard += &format!(", and {} packets that are no CAN frames", counters.malformed);
    }
    let others: Vec<String> = products.keys().map(u8::to_string).collect();
    if !others.is_empty() {
        heard += &format!("; node {} answered, but is another kind of device", others.join(", "));
    }
    ClientError::Nobody {
        bus: line.describe(),
        tried: format!(
            "{asked} for {:.1} s, and {heard}. Is the sensor powered, and on this bus? A simulated one is started \
             in another terminal with `thud sensor --bus …` and the same bus",
            (LISTEN + FIRST).as_secs_f64()
        ),
    }
}

impl Line {
    /// Hears what goes on for a while; frames are kept.
    pub(super) fn listen(&mut self, span: Duration) -> Result<(), ClientError> {
        let until = self.now() + span;
        while self.now() < until {
            self.any_answer(until.saturating_sub(self.now()))?;
        }
        Ok(())
    }

    /// The next SDO answer of whichever node.
    pub(super) fn any_answer(&mut self, timeout: Duration) -> Result<Option<(u8, [u8; 8])>, ClientError> {
        let deadline = self.now() + timeout;
        loop {
            let left = deadline.saturating_sub(self.now());
            if let Some(stamped) = self.receive(left)? {
                match answers(&stamped.frame) {
                    Some(node) => return Ok(Some((node, stamped.frame.data))),
                    None => self.keep(stamped),
                }
            }
            if self.now() >= deadline {
                return Ok(None);
            }
        }
    }
}
