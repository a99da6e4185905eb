//! Faults as CANopen tells them: error register (0x1001), error history (0x1003) and EMCY frames.
//!
//! ```text
//! byte  0    1     2              3       4 … 7
//!       code       error register cause   detail, UNSIGNED32
//! ```
//!
//! A lasting fault is told once when it appears and once when it has gone; a loss is told when it happens. When
//! the last fault has gone, code 0 says that the node is free of errors.

use crate::detector::ChainFault;

/// What can be wrong, each with its CiA 301 error code and error register bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// The bias of the IEPE cell left its range: the cable is broken or shorted. Lasts.
    Bias = 0,
    /// The signal sits at the end of its range while nothing touches. Lasts.
    Clipped = 1,
    /// Samples were lost; the detail says how many.
    SamplesLost = 2,
    /// The bus went bus-off and the node came back; the detail counts how often.
    BusOff = 3,
    /// The controller is error passive. Lasts.
    BusPassive = 4,
    /// Received frames were lost; the detail counts them.
    ReceiveOverrun = 5,
    /// The stored configuration could not be read and the defaults are in use. Lasts until one is stored.
    Configuration = 6,
    /// The configuration could not be written to flash. Lasts until one is stored.
    Storage = 7,
    /// The last reset was forced by the watchdog.
    Watchdog = 8,
    /// The last reset followed a panic or a fault of the processor; the detail is the address in the program where, for
    /// `cargo xtask where`, or 0.
    Panic = 9,
    /// An impact was not evaluated because the one before it still was; the detail is its number.
    NotEvaluated = 10,
    /// An effective mass frame was too short; the detail is its length.
    PdoLength = 11,
}

/// Number of faults.
const FAULTS: usize = 12;

impl Fault {
    /// All faults.
    pub const ALL: [Self; FAULTS] = [
        Self::Bias,
        Self::Clipped,
        Self::SamplesLost,
        Self::BusOff,
        Self::BusPassive,
        Self::ReceiveOverrun,
        Self::Configuration,
        Self::Storage,
        Self::Watchdog,
        Self::Panic,
        Self::NotEvaluated,
        Self::PdoLength,
    ];

    /// Error code. 0x81xx, 0x82xx, 0x61xx and 0x63xx are those of CiA 301, 0x55xx is its "data storage", 0x3210 its
    /// "voltage inside the device", 0xFFxx are the device's own.
    #[must_use]
    pub const fn code(self) -> u16 {
        match self {
            Self::Bias => 0x3210,
            Self::Clipped => 0xFF01,
            Self::SamplesLost => 0xFF02,
            Self::BusOff => 0x8140,
            Self::BusPassive => 0x8120,
            Self::ReceiveOverrun => 0x8110,
            Self::Configuration => 0x6310,
            Self::Storage => 0x5530,
            Self::Watchdog => 0x6101,
            Self::Panic => 0x6100,
            Self::NotEvaluated => 0xFF03,
            Self::PdoLength => 0x8210,
        }
    }

    /// The fault with this code, if there is one.
    #[must_use]
    pub fn from_code(code: u16) -> Option<Self> {
        Self::ALL.into_iter().find(|fault| fault.code() == code)
    }

    /// Bit of the error register beside the generic one: 2 voltage, 4 communication, 7 manufacturer-specific.
    const fn register(self) -> u8 {
        match self {
            Self::Bias => 1 << 2,
            Self::BusOff | Self::BusPassive | Self::ReceiveOverrun | Self::PdoLength => 1 << 4,
            Self::Clipped | Self::SamplesLost | Self::NotEvaluated => 1 << 7,
            Self::Configuration | Self::Storage | Self::Watchdog | Self::Panic => 0,
        }
    }

    /// Whether it is over by itself when it has been told.
    const fn is_momentary(self) -> bool {
        !matches!(self, Self::Bias | Self::Clipped | Self::BusPassive | Self::Configuration | Self::Storage)
    }
}

impl From<ChainFault> for Fault {
    fn from(fault: ChainFault) -> Self {
        match fault {
            ChainFault::Bias => Self::Bias,
            ChainFault::Clipped => Self::Clipped,
        }
    }
}

/// An EMCY frame's meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emergency {
    /// Error code; 0: free of errors (again).
    pub code: u16,
    /// Error register after it.
    pub register: u8,
    /// Which fault appeared or has gone.
    pub cause: u8,
    /// Its detail.
    pub detail: u32,
}

impl Emergency {
    /// Bytes of the frame.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        let [low, high] = self.code.to_le_bytes();
        let [a, b, c, d] = self.detail.to_le_bytes();
        [low, high, self.register, self.cause, a, b, c, d]
    }

    /// Reads such a frame; `None` when it does not have eight bytes.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let [low, high, register, cause, a, b, c, d] = *bytes else { return None };
        let code = u16::from_le_bytes([low, high]);
        Some(Self { code, register, cause, detail: u32::from_le_bytes([a, b, c, d]) })
    }
}

/// Errors that the history keeps.
pub const HISTORY: usize = 8;

/// Which faults there are and which there were.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    lasting: u16,
    history: heapless::Deque<u32, HISTORY>,
}

impl Faults {
    /// No faults.
    #[must_use]
    pub const fn new() -> Self {
        Self { lasting: 0, history: heapless::Deque::new() }
    }

    /// A fault appeared or a loss happened; what to tell, nothing when a lasting one was known.
    pub fn raise(&mut self, fault: Fault, detail: u32) -> Option<Emergency> {
        let bit = 1 << fault as u8;
        if self.lasting & bit != 0 {
            return None;
        }
        let mut register = self.register() | 1 | fault.register();
        if !fault.is_momentary() {
            self.lasting |= bit;
            register = self.register();
        }
        if self.history.is_full() {
            self.history.pop_back();
        }
        // CiA 301, object 0x1003: code in the lower half, the device's own information in the upper.
        let _ = self.history.push_front(u32::from(fault.code()) | u32::from(fault as u8) << 16);
        Some(Emergency { code: fault.code(), register, cause: fault as u8, detail })
    }

    /// A lasting fault has gone; what to tell, nothing when there was none.
    pub fn clear(&mut self, fault: Fault) -> Option<Emergency> {
        let bit = 1 << fault as u8;
        if self.lasting & bit == 0 {
            return None;
        }
        self.lasting &= !bit;
        Some(Emergency { code: 0, register: self.register(), cause: fault as u8, detail: 0 })
    }

    /// Object 0x1001.
    #[must_use]
    pub fn register(&self) -> u8 {
        Fault::ALL
            .into_iter()
            .filter(|fault| self.lasting & 1 << *fault as u8 != 0)
            .fold(0, |register, fault| register | 1 | fault.register())
    }

    /// Object 0x1003: the n-th newest error, from 0.
    #[must_use]
    pub fn history(&self, place: usize) -> Option<u32> {
        self.history.iter().nth(place).copied()
    }

    /// How many errors the history holds.
    #[must_use]
    pub fn remembered(&self) -> usize {
        self.history.len()
    }

    /// Empties the history.
    pub fn forget(&mut self) {
        self.history.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lasting_fault_is_told_once_and_its_end_once() {
        let mut faults = Faults::new();
        let told = faults.raise(Fault::Bias, 0).unwrap();
        assert_eq!((told.code, told.register), (0x3210, 0b101));
        assert_eq!(faults.raise(Fault::Bias, 0), None);
        let loss = faults.raise(Fault::SamplesLost, 80).unwrap();
        assert_eq!((loss.register, loss.detail), (0b1000_0101, 80));
        assert_eq!(faults.register(), 0b101, "a loss does not last");
        let gone = faults.clear(Fault::Bias).unwrap();
        assert_eq!((gone.code, gone.register, gone.cause), (0, 0, Fault::Bias as u8));
        assert_eq!(faults.clear(Fault::Bias), None);
        assert_eq!(faults.history(0), Some(0x0002_FF02));
        assert_eq!(faults.history(1), Some(0x0000_3210));
    }

    #[test]
    fn the_history_keeps_the_newest() {
        let mut faults = Faults::new();
        for detail in 0..20 {
            faults.raise(Fault::SamplesLost, detail);
        }
        assert_eq!(faults.remembered(), HISTORY);
        faults.forget();
        assert_eq!(faults.remembered(), 0);
    }

    #[test]
    fn a_frame_comes_back() {
        let emergency = Emergency { code: 0x8140, register: 0x11, cause: 3, detail: 0x0102_0304 };
        assert_eq!(Emergency::decode(&emergency.encode()), Some(emergency));
        assert_eq!(Emergency::decode(&[0; 7]), None);
        for fault in Fault::ALL {
            assert_eq!(Fault::from_code(fault.code()), Some(fault));
        }
    }
}
