//! The LSS slave of CiA 305: how a master finds the sensor by its identity and gives it a node id.
//!
//! ```text
//!            switch global 1, switch selective (all four numbers ours),
//!            fast scan to its end (only without a node id)
//! waiting ──────────────────────────────────────────────────────────────▶ configuration: node id, store, inquire
//!    ▲                                                                          │
//!    └───────────────────────────── switch global 0 ────────────────────────────┘
//! ```
//!
//! Fast scan asks for one bit after the other, from the highest down, of vendor, product, revision and serial number: who has the
//! bits asked so far answers, all with the same frame.
//!
//! Messages are those of `zencan-common`. Its slave in `zencan-node` 0.0.5 is not used: it takes any byte for a node id, and brings a
//! dictionary and an SDO server along, 11 KiB of flash.

use zencan_common::lss::{LSS_FASTSCAN_CONFIRM, LssRequest, LssResponse};

/// Answer to "configure node id": the id is not 1 to 127 or 255.
pub const ID_OUT_OF_RANGE: u8 = 1;
/// Answer to "configure bit timing": no other than the present one.
const TIMING_NOT_SUPPORTED: u8 = 1;
/// Answer to "store configuration": the storage medium could not be accessed.
pub const NOT_STORED: u8 = 2;
/// What stands for no node id.
pub const NO_ID: u8 = 255;

/// What a request asks of the node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Asked {
    /// This answer, and nothing else.
    Answer(LssResponse),
    /// This node id, or none, from the next reset of communication on; or at once if the node has none.
    NodeId(Option<u8>),
    /// To keep the node id through a power cycle.
    Store,
}

/// The slave: vendor, product, revision, serial number, and how far a master has got with them.
#[derive(Clone, Copy, Debug)]
pub struct LssSlave {
    identity: [u32; 4],
    configuring: bool,
    /// Which of vendor, product and revision the master has named and are ours.
    named: [bool; 3],
    /// The number whose bits fast scan asks for.
    scanned: u8,
}

impl LssSlave {
    /// Waiting, with vendor, product, revision and serial number.
    #[must_use]
    pub const fn new(identity: [u32; 4]) -> Self {
        Self { identity, configuring: false, named: [false; 3], scanned: 0 }
    }

    /// Takes a request, with the node id that holds now. `None`: it is not for this node, or nothing is to be done.
    pub fn receive(&mut self, request: &[u8; 8], node_id: Option<u8>) -> Option<Asked> {
        let request = LssRequest::try_from(&request[..]).ok()?;
        let answer = match request {
            LssRequest::SwitchModeGlobal { mode } => {
                self.configuring = if mode < 2 { mode == 1 } else { self.configuring };
                return None;
            }
            LssRequest::SwitchStateVendor { vendor_id } => return self.name(0, vendor_id),
            LssRequest::SwitchStateProduct { product_code } => return self.name(1, product_code),
            LssRequest::SwitchStateRevision { revision } => return self.name(2, revision),
            LssRequest::SwitchStateSerial { serial } => {
                let ours = core::mem::take(&mut self.named) == [true; 3] && serial == self.identity[3];
                if self.configuring || !ours {
                    return None;
                }
                self.configuring = true;
                LssResponse::SwitchStateResponse
            }
            LssRequest::FastScan { id, bit_check, sub, next } => {
                if self.configuring || node_id.is_some() || !self.scan(id, bit_check, sub, next) {
                    return None;
                }
                LssResponse::IdentifySlave
            }
            _ if !self.configuring => return None,
            LssRequest::ConfigureNodeId { node_id: id @ 1..=127 } => return Some(Asked::NodeId(Some(id))),
            LssRequest::ConfigureNodeId { node_id: NO_ID } => return Some(Asked::NodeId(None)),
            LssRequest::ConfigureNodeId { .. } => {
                LssResponse::ConfigureNodeIdAck { error: ID_OUT_OF_RANGE, spec_error: 0 }
            }
            LssRequest::ConfigureBitTiming { .. } => {
                LssResponse::ConfigureBitTimingAck { error: TIMING_NOT_SUPPORTED, spec_error: 0 }
            }
            LssRequest::StoreConfiguration => return Some(Asked::Store),
            LssRequest::InquireVendor => LssResponse::InquireVendorAck { vendor_id: self.identity[0] },
            LssRequest::InquireProduct => LssResponse::InquireProductAck { product_code: self.identity[1] },
            LssRequest::InquireRev => LssResponse::InquireRevAck { revision: self.identity[2] },
            LssRequest::InquireSerial => LssResponse::InquireSerialAck { serial_number: self.identity[3] },
            LssRequest::InquireNodeId => LssResponse::InquireNodeIdAck { node_id: node_id.unwrap_or(NO_ID) },
            LssRequest::ActivateBitTiming { .. } => return None,
        };
        Some(Asked::Answer(answer))
    }

    fn name(&mut self, number: usize, named: u32) -> Option<Asked> {
        self.named[number] = named == self.identity[number];
        None
    }

    /// Whether the upper bits of a number, down to `bit`, are ours.
    fn scan(&mut self, id: u32, bit: u8, number: u8, next: u8) -> bool {
        if bit == LSS_FASTSCAN_CONFIRM {
            self.scanned = 0;
            return true;
        }
        let Some(ours) = self.identity.get(usize::from(number)) else { return false };
        if bit >= 32 || next > 3 || number != self.scanned || (ours ^ id) >> bit != 0 {
            return false;
        }
        self.scanned = next;
        // The last bit of the last number.
        self.configuring = bit == 0 && next < number;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: [u32; 4] = [0, 0x7468, 0x0001_0002, 0xDEAD_BEEF];

    fn request(command: u8, number: u32) -> [u8; 8] {
        let [a, b, c, d] = number.to_le_bytes();
        [command, a, b, c, d, 0, 0, 0]
    }

    fn select(slave: &mut LssSlave, identity: [u32; 4]) -> Option<Asked> {
        (0x40..).zip(identity).map(|(command, number)| slave.receive(&request(command, number), Some(32))).last()?
    }

    #[test]
    fn it_is_selected_by_all_four_numbers_and_by_no_fewer() {
        for wrong in 0..4 {
            let mut slave = LssSlave::new(IDENTITY);
            let mut identity = IDENTITY;
            identity[wrong] ^= 0x8000_0000;
            assert_eq!(select(&mut slave, identity), None);
            assert_eq!(slave.receive(&request(0x43, IDENTITY[3]), Some(32)), None, "number {wrong} was another's");
            assert_eq!(slave.receive(&request(0x5E, 0), Some(32)), None);
        }
        let mut slave = LssSlave::new(IDENTITY);
        assert_eq!(select(&mut slave, IDENTITY), Some(Asked::Answer(LssResponse::SwitchStateResponse)));
        let inquired = [0x5A, 0x5B, 0x5C, 0x5D].map(|command| match slave.receive(&request(command, 0), Some(32)) {
            Some(Asked::Answer(LssResponse::InquireVendorAck { vendor_id })) => vendor_id,
            Some(Asked::Answer(LssResponse::InquireProductAck { product_code })) => product_code,
            Some(Asked::Answer(LssResponse::InquireRevAck { revision })) => revision,
            Some(Asked::Answer(LssResponse::InquireSerialAck { serial_number })) => serial_number,
            other => panic!("{command:#x}: {other:?}"),
        });
        assert_eq!(inquired, IDENTITY);
        let id = |node_id| Some(Asked::Answer(LssResponse::InquireNodeIdAck { node_id }));
        assert_eq!(slave.receive(&request(0x5E, 0), Some(32)), id(32));
        assert_eq!(slave.receive(&request(0x5E, 0), None), id(255));
    }

    /// As a master does it: each bit is 0 unless nobody says so.
    #[test]
    fn fast_scan_finds_every_bit_and_ends_in_configuration() {
        let mut slave = LssSlave::new(IDENTITY);
        let scan = |slave: &mut LssSlave, id: u32, bit: u8, number: u8, next: u8| {
            let [a, b, c, d] = id.to_le_bytes();
            slave.receive(&[0x51, a, b, c, d, bit, number, next], None).is_some()
        };
        assert!(scan(&mut slave, 0, 0x80, 0, 0));
        let mut found = [0; 4];
        for number in 0..4u8 {
            let id = &mut found[usize::from(number)];
            for bit in (0..32).rev() {
                if !scan(&mut slave, *id, bit, number, number) {
                    *id |= 1 << bit;
                }
            }
            assert!(scan(&mut slave, *id, 0, number, (number + 1) % 4), "number {number}");
        }
        assert_eq!(found, IDENTITY);
        assert_eq!(slave.receive(&request(0x11, 7), None), Some(Asked::NodeId(Some(7))));
        slave.receive(&request(0x04, 0), None);
        assert_eq!(slave.receive(&[0x51, 0, 0, 0, 0, 0x80, 0, 0], Some(7)), None, "who has an id is not scanned");
    }
}
