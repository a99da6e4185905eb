//! Faults of a sensor (EMCY, error register, error history) in words.

use thud_firmware::emergency::{Emergency, Fault};

/// The fault in a sentence's words, with what to look at.
#[must_use]
pub fn words(fault: Fault) -> &'static str {
    match fault {
        Fault::Bias => "the bias of the load cell is out of range (cable broken or shorted)",
        Fault::Clipped => "the signal sits at the end of its range while nothing touches",
        Fault::SamplesLost => "samples were lost",
        Fault::BusOff => "the node was bus-off and came back",
        Fault::BusPassive => "the CAN controller is error passive (wiring, bit rate or termination)",
        Fault::ReceiveOverrun => "frames to the node were lost",
        Fault::Configuration => "the stored configuration could not be read, defaults are in use",
        Fault::Storage => "the configuration could not be written to flash",
        Fault::Watchdog => "the last reset was forced by the watchdog",
        Fault::Panic => "the last reset followed a panic or a fault of the firmware",
        Fault::NotEvaluated => "an impact was not evaluated, the one before it still was",
        Fault::PdoLength => "an effective-mass frame was too short",
    }
}

/// An EMCY frame in words.
#[must_use]
pub fn sentence(emergency: &Emergency) -> String {
    if emergency.code == 0 {
        let gone = Fault::ALL.into_iter().find(|fault| *fault as u8 == emergency.cause);
        let rest = if emergency.register == 0 { "free of errors" } else { "other errors remain" };
        return match gone {
            Some(fault) => format!("over: {} ({rest})", words(fault)),
            None => rest.to_owned(),
        };
    }
    match Fault::from_code(emergency.code) {
        Some(Fault::Panic) if emergency.detail != 0 => {
            format!("{}; cargo xtask where 0x{:08X}", words(Fault::Panic), emergency.detail)
        }
        Some(fault) if emergency.detail != 0 => format!("{} ({})", words(fault), emergency.detail),
        Some(fault) => words(fault).to_owned(),
        None => format!("error 0x{:04X}, which this version does not know", emergency.code),
    }
}

/// An entry of the error history (object 0x1003) in words.
#[must_use]
pub fn history_entry(entry: u32) -> String {
    let code = entry as u16;
    match Fault::from_code(code) {
        Some(fault) => words(fault).to_owned(),
        None => format!("error 0x{code:04X}, which this version does not know"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_its_end_and_an_unknown_one_are_told_apart() {
        let mut emergency = Emergency { code: 0xFF02, register: 0x81, cause: 2, detail: 40 };
        assert_eq!(sentence(&emergency), "samples were lost (40)");
        emergency = Emergency { code: 0x6100, register: 0x01, cause: 9, detail: 0x0800_1235 };
        assert!(sentence(&emergency).ends_with("; cargo xtask where 0x08001235"));
        emergency = Emergency { code: 0, register: 0, cause: 0, detail: 0 };
        assert!(sentence(&emergency).starts_with("over: the bias of the load cell"));
        emergency.code = 0x1234;
        assert!(sentence(&emergency).contains("0x1234"));
    }
}
