//! "Hit it now": how another program asks a simulated sensor's rig for a robot. Only simulators speak this.
//!
//! ```text
//! byte       0      1        2   3          4   5         6   7
//! request    node   0        speed mm/s     mass 10 g     number       id 0x6D0
//! answer     node   status   peak 0.1 N     0   0         number       id 0x6D1
//! ```
//!
//! Little-endian. Node 0 asks every simulator; speed or mass 0 is the simulator's own. Both identifiers lie in the only
//! gap that CiA 301 leaves below NMT error control (0x680 to 0x6DF belong to nobody), so that no device of a
//! real bus is addressed, and the simulated sensor itself never sees them.

use thud_firmware::board::Frame;

/// Identifier of a request.
pub const REQUEST: u16 = 0x6D0;
/// Identifier of an answer.
pub const ANSWER: u16 = 0x6D1;

/// A request for a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Node id of the sensor to hit; `None` for every one.
    pub node: Option<u8>,
    /// Speed at contact, m/s; `None` for the simulator's own.
    pub speed_m_per_s: Option<f64>,
    /// Effective mass, kg; `None` for the simulator's own.
    pub mass_kg: Option<f64>,
    /// Number of the request, which the answer repeats.
    pub number: u16,
}

/// What the simulator did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Its sensor's node id.
    pub node: u8,
    /// The highest force that will truly reach the cell, N; `None` when the request was no possible impact.
    pub peak_n: Option<f64>,
    /// Number of the request.
    pub number: u16,
}

/// A value that does not fit its field.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{what} {value} {unit} cannot be requested; above 0 and up to {most} {unit} can")]
pub struct OutOfRange {
    what: &'static str,
    value: f64,
    unit: &'static str,
    most: f64,
}

fn steps(what: &'static str, value: Option<f64>, unit: &'static str, per_unit: f64) -> Result<u16, OutOfRange> {
    let Some(value) = value else { return Ok(0) };
    let steps = (value * per_unit).round();
    if (1.0..=65_535.0).contains(&steps) {
        Ok(steps as u16)
    } else {
        Err(OutOfRange { what, value, unit, most: 65_535.0 / per_unit })
    }
}

fn word(data: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([data[at], data[at + 1]])
}

impl Request {
    /// The frame.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn encode(&self) -> Result<Frame, OutOfRange> {
        let speed = steps("the speed", self.speed_m_per_s, "m/s", 1000.0)?.to_le_bytes();
        let mass = steps("the mass", self.mass_kg, "kg", 100.0)?.to_le_bytes();
        let number = self.number.to_le_bytes();
        let data = [self.node.unwrap_or(0), 0, speed[0], speed[1], mass[0], mass[1], number[0], number[1]];
        Ok(Frame { id: REQUEST, len: 8, data })
    }

    /// Reads a frame; `None` if it is no request.
    #[must_use]
    pub fn decode(frame: &Frame) -> Option<Self> {
        let (REQUEST, [node, _, ..]) = (frame.id, frame.bytes()) else { return None };
        let data = (frame.len == 8).then_some(&frame.data)?;
        let some = |steps: u16, per_unit: f64| (steps != 0).then(|| f64::from(steps) / per_unit);
        Some(Self {
            node: (*node != 0).then_some(*node),
            speed_m_per_s: some(word(data, 2), 1000.0),
            mass_kg: some(word(data, 4), 100.0),
            number: word(data, 6),
        })
    }
}

impl Answer {
    /// The frame.
    #[must_use]
    pub fn encode(&self) -> Frame {
        // A force beyond 6553.5 N is told as that.
        let peak = self.peak_n.map_or(0, |peak| (peak * 10.0).round().clamp(0.0, 65_535.0) as u16).to_le_bytes();
        let number = self.number.to_le_bytes();
        let refused = u8::from(self.peak_n.is_none());
        Frame { id: ANSWER, len: 8, data: [self.node, refused, peak[0], peak[1], 0, 0, number[0], number[1]] }
    }

    /// Reads a frame; `None` if it is no answer.
    #[must_use]
    pub fn decode(frame: &Frame) -> Option<Self> {
        let data = (frame.id == ANSWER && frame.len == 8).then_some(&frame.data)?;
        let peak_n = (data[1] == 0).then(|| f64::from(word(data, 2)) / 10.0);
        Some(Self { node: data[0], peak_n, number: word(data, 6) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_arrives() {
        for request in [
            Request { node: None, speed_m_per_s: None, mass_kg: None, number: 1 },
            Request { node: Some(32), speed_m_per_s: Some(0.25), mass_kg: Some(6.08), number: 65_535 },
        ] {
            assert_eq!(Request::decode(&request.encode().unwrap()), Some(request));
        }
        let answer = Answer { node: 32, peak_n: Some(93.1), number: 7 };
        assert_eq!(Answer::decode(&answer.encode()), Some(answer));
        assert_eq!(Request::decode(&answer.encode()), None);
    }

    #[test]
    fn what_does_not_fit_is_refused_with_its_range() {
        let request = Request { node: None, speed_m_per_s: Some(70.0), mass_kg: None, number: 1 };
        let error = request.encode().unwrap_err().to_string();
        assert_eq!(error, "the speed 70 m/s cannot be requested; above 0 and up to 65.535 m/s can");
    }
}
