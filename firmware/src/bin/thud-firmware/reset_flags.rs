//! Why the chip started, from what the reset left behind.
//!
//! Every reset also pulls the reset pin low, and power-on sets the brown-out flag (RM0440, 7.1.2: the G4 has no flag for
//! power-on), so the flags are read from the most telling to the least. Whether power only sagged is told by the memory: a mark
//! that was left in RAM is still there.

use thud_firmware::board::ResetCause;

/// What is known at start.
#[derive(Clone, Copy, Debug, Default)]
pub struct Traces {
    /// RCC_CSR: the independent (or the window) watchdog.
    pub watchdog: bool,
    /// RCC_CSR: SYSRESETREQ.
    pub software: bool,
    /// RCC_CSR: brown-out or power-on.
    pub brown_out: bool,
    /// RCC_CSR: the pin, by whomever.
    pub pin: bool,
    /// There is a panic record that nobody has read.
    pub panicked: bool,
    /// RAM kept its mark.
    pub memory_kept: bool,
}

impl Traces {
    /// The cause.
    pub const fn cause(self) -> ResetCause {
        match self {
            Self { watchdog: true, .. } => ResetCause::Watchdog,
            Self { software: true, panicked: true, .. } => ResetCause::Panic,
            Self { software: true, .. } => ResetCause::Software,
            Self { brown_out: true, memory_kept: true, .. } => ResetCause::BrownOut,
            Self { brown_out: true, .. } => ResetCause::PowerOn,
            Self { pin: true, .. } => ResetCause::Pin,
            _ => ResetCause::PowerOn,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pin_is_low_at_every_reset_and_is_believed_last() {
        let pin = Traces { pin: true, memory_kept: true, ..Traces::default() };
        assert_eq!(pin.cause(), ResetCause::Pin);
        assert_eq!(Traces { watchdog: true, ..pin }.cause(), ResetCause::Watchdog);
        assert_eq!(Traces { software: true, ..pin }.cause(), ResetCause::Software);
        assert_eq!(Traces { software: true, panicked: true, ..pin }.cause(), ResetCause::Panic);
        assert_eq!(Traces { brown_out: true, ..pin }.cause(), ResetCause::BrownOut);
        assert_eq!(Traces { brown_out: true, memory_kept: false, ..pin }.cause(), ResetCause::PowerOn);
    }

    #[test]
    fn a_record_alone_is_no_panic() {
        // Power went before anybody could read it, and the memory happened to survive.
        let sagged = Traces { brown_out: true, panicked: true, memory_kept: true, ..Traces::default() };
        assert_eq!(sagged.cause(), ResetCause::BrownOut);
    }
}
