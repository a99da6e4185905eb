//! The error state.

use embassy_stm32::can::Properties;
use embassy_stm32::can::enums::BusErrorMode;
use embassy_stm32::pac::FDCAN1;
use thud_firmware::board::{BusState, BusStatus, CanSupervise};

/// Sees the error state and ends bus-off.
pub struct Supervision(Properties);

impl Supervision {
    pub(super) fn new(properties: Properties) -> Self {
        Self(properties)
    }
}

impl CanSupervise for Supervision {
    fn status(&mut self) -> BusStatus {
        BusStatus {
            state: match self.0.bus_error_mode() {
                BusErrorMode::ErrorActive => BusState::ErrorActive,
                BusErrorMode::ErrorPassive => BusState::ErrorPassive,
                BusErrorMode::BusOff => BusState::BusOff,
            },
            transmit_errors: u16::from(self.0.tx_error_count()),
            receive_errors: u16::from(self.0.rx_error_count()),
        }
    }

    fn recover(&mut self) {
        // Bus-off has set INIT; without it the controller waits for 129 times 11 recessive bits and is back.
        FDCAN1.cccr().modify(|cccr| cccr.set_init(false));
    }
}
