//! The error counters of a CAN controller and what they make of it, ISO 11898-1 (fault confinement).
//!
//! ```text
//!               > 127                    transmit > 255
//! error active ───────▶ error passive ─────────────────▶ bus off
//!      ▲  └────────────────┘ both ≤ 127                     │
//!      └────────────── 128 × 11 recessive bits ─────────────┘
//! ```

use thud_firmware::board::{BusState, BusStatus};

/// Transmit and receive error counter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ErrorCounters {
    transmit: u16,
    receive: u16,
    bus_off: bool,
}

impl ErrorCounters {
    pub(super) fn status(self) -> BusStatus {
        let state = if self.bus_off {
            BusState::BusOff
        } else if self.is_passive() {
            BusState::ErrorPassive
        } else {
            BusState::ErrorActive
        };
        BusStatus { state, transmit_errors: self.transmit, receive_errors: self.receive }
    }

    pub(super) fn is_passive(self) -> bool {
        self.transmit > 127 || self.receive > 127
    }

    pub(super) fn is_bus_off(self) -> bool {
        self.bus_off
    }

    /// It sent an error flag as transmitter.
    pub(super) fn transmit_failed(&mut self) {
        self.transmit += 8;
        self.bus_off = self.transmit > 255;
    }

    /// Nobody acknowledged. Once error passive this no longer counts, so that a node which is alone on the bus does
    /// not go bus-off.
    pub(super) fn not_acknowledged(&mut self) {
        if !self.is_passive() {
            self.transmit_failed();
        }
    }

    pub(super) fn transmitted(&mut self) {
        self.transmit = self.transmit.saturating_sub(1);
    }

    /// It saw an error as receiver.
    pub(super) fn receive_failed(&mut self) {
        self.receive = (self.receive + 1).min(255);
    }

    /// It saw an error that the others did not: their echo follows its own error flag.
    pub(super) fn alone_in_error(&mut self) {
        self.receive = (self.receive + 9).min(255);
    }

    pub(super) fn received(&mut self) {
        // The standard permits 119 to 127 after error passive.
        self.receive = if self.receive > 127 { 119 } else { self.receive.saturating_sub(1) };
    }

    /// Recovered from bus-off, or powered up.
    pub(super) fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_failures_make_passive_and_thirty_two_bus_off() {
        let mut counters = ErrorCounters::default();
        let states: Vec<_> = (0..32)
            .map(|_| {
                counters.transmit_failed();
                counters.status().state
            })
            .collect();
        assert_eq!(states[14], BusState::ErrorActive);
        assert_eq!(states[15], BusState::ErrorPassive);
        assert_eq!(states[30], BusState::ErrorPassive);
        assert_eq!(states[31], BusState::BusOff);
    }

    #[test]
    fn alone_on_the_bus_is_passive_but_never_off() {
        let mut counters = ErrorCounters::default();
        (0..1000).for_each(|_| counters.not_acknowledged());
        assert_eq!(
            counters.status(),
            BusStatus { state: BusState::ErrorPassive, transmit_errors: 128, receive_errors: 0 }
        );
    }

    #[test]
    fn success_leads_back_to_active() {
        let mut counters = ErrorCounters::default();
        (0..16).for_each(|_| counters.transmit_failed());
        counters.transmitted();
        assert_eq!(counters.status().state, BusState::ErrorActive);
        (0..15).for_each(|_| counters.alone_in_error());
        assert_eq!(counters.status().state, BusState::ErrorPassive);
        counters.received();
        assert_eq!(counters.status().receive_errors, 119);
        assert_eq!(counters.status().state, BusState::ErrorActive);
    }
}
