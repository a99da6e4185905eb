//! What the controller lets in: each service that the node listens to, wherever it has gone, and nothing else.

use thud::client::Nmt;
use thud_firmware::board::Frame;
use thud_firmware::dictionary::frame::{MASS_BASE, MassFrame};
use thud_firmware::dictionary::index;
use thud_firmware::units::Kilogram;
use thud_sim::bus::{HostPort, Traffic};
use thud_sim::chain::ChainSettings;

mod lab;
use lab::{Lab, NODE};

const SDO: u16 = 0x600 + NODE as u16;
const MASS: u16 = MASS_BASE + NODE as u16;
const TIME: u16 = 0x100;
const LSS: u16 = 0x7E5;
const LSS_ANSWER: u16 = 0x7E4;

struct Filtered {
    lab: Lab,
    master: HostPort,
}

impl Filtered {
    fn running() -> Self {
        let mut lab = Lab::new(ChainSettings::quiet());
        lab.run_ms(300);
        let master = lab.emulator().bus().attach_host("master");
        Self { lab, master }
    }

    /// Sends a frame; whether it came to the processor.
    fn heard(&mut self, id: u16, bytes: &[u8]) -> bool {
        let accepted = self.lab.emulator().chip().can.accepted();
        self.master.send(&Frame::new(id, bytes).expect("a frame"));
        self.lab.run_ms(5);
        self.lab.emulator().chip().can.accepted() > accepted
    }

    /// An SDO request that is answered.
    fn sdo(&mut self, node: u16, request: [u8; 8]) -> [u8; 8] {
        let _ = self.lab.sent(0);
        assert!(self.heard(0x600 + node, &request));
        self.lab.sent(0x580 + node).first().expect("an answer").1.data
    }

    fn mass(&mut self, id: u16, kilogram: f32) -> bool {
        self.heard(id, &MassFrame { mass: Kilogram(kilogram), sequence: 1 }.encode())
    }

    /// Object 0x2101:1, the effective mass as received.
    fn received_mass(&mut self, node: u16) -> f32 {
        let [low, high] = index::RECEIVED_MASS.to_le_bytes();
        let [_, _, _, _, a, b, c, d] = self.sdo(node, [0x40, low, high, 1, 0, 0, 0, 0]);
        f32::from_le_bytes([a, b, c, d])
    }
}

#[test]
fn each_service_is_heard_and_nobody_else() {
    let mut filtered = Filtered::running();
    let heard: Vec<u16> = (0..0x800).filter(|id| filtered.heard(*id, &[])).collect();
    assert_eq!(heard, [0, TIME, MASS, SDO, LSS]);
    // And does what it is there for.
    assert!(filtered.heard(TIME, &[0x10, 0x27, 0, 0, 0x34, 0x12]));
    let [low, high] = index::TIME.to_le_bytes();
    assert_eq!(filtered.sdo(u16::from(NODE), [0x40, low, high, 2, 0, 0, 0, 0])[4..6], [0x34, 0x12]);
    assert!(filtered.heard(0, &[Nmt::Start as u8, NODE]));
    assert!(filtered.mass(MASS, 7.5));
    assert_eq!(filtered.received_mass(u16::from(NODE)), 7.5);
    filtered.lab.expect_order(1);
}

#[test]
fn a_node_id_from_lss_and_another_cob_id_are_listened_to_and_the_old_ones_no_more() {
    let mut filtered = Filtered::running();
    assert!(filtered.heard(LSS, &[0x04, 1, 0, 0, 0, 0, 0, 0]));
    let _ = filtered.lab.sent(0);
    assert!(filtered.heard(LSS, &[0x11, 0x42, 0, 0, 0, 0, 0, 0]));
    assert_eq!(filtered.lab.sent(LSS_ANSWER)[0].1.data[..2], [0x11, 0]);
    assert!(filtered.heard(LSS, &[0x04, 0, 0, 0, 0, 0, 0, 0]));
    assert!(filtered.heard(SDO, &[0x40, 0x18, 0x10, 4, 0, 0, 0, 0]), "the old id holds until communication is reset");
    assert!(filtered.heard(0, &[Nmt::ResetCommunication as u8, 0]));
    assert_eq!((filtered.heard(SDO, &[]), filtered.mass(MASS, 5.0)), (false, false));
    let serial = filtered.sdo(0x42, [0x40, 0x18, 0x10, 4, 0, 0, 0, 0]);
    assert_eq!(serial[0], 0x43);
    // The effective mass goes elsewhere, and then nowhere.
    let [low, high] = index::RPDO_MASS.to_le_bytes();
    for (cob_id, heard) in [(0x1C2u32, 0x1C2), (1 << 31 | 0x1C2, 0)] {
        let [a, b, c, d] = cob_id.to_le_bytes();
        assert_eq!(filtered.sdo(0x42, [0x23, low, high, 1, a, b, c, d])[0], 0x60);
        assert!(!filtered.mass(MASS_BASE + 0x42, 5.0));
        assert_eq!(filtered.mass(0x1C2, 5.0), heard != 0, "COB-ID 0x{cob_id:X}");
    }
    filtered.lab.expect_order(1);
}

/// While an impact is evaluated nobody takes frames from the 64 places between controller and node; a busy bus fills them in 9 ms.
#[test]
fn a_busy_bus_of_others_costs_the_node_nothing() {
    let mut lab = Lab::quiet();
    lab.client.nmt(Nmt::Start, NODE).unwrap();
    let bus = lab.emulator().bus().clone();
    bus.attach_traffic("others", Traffic { identifiers: 0x421..=0x47F, ..Traffic::with_load(0.9) });
    lab.run_ms(50);
    let (accepted, filtered) = {
        let emulator = lab.emulator();
        (emulator.chip().can.accepted(), emulator.chip().can.filtered())
    };
    lab.strike(lab.now_s() + 0.02, 0.25);
    lab.run_ms(1_000);
    {
        let emulator = lab.emulator();
        assert_eq!(emulator.chip().can.accepted(), accepted);
        assert!(emulator.chip().can.filtered() > filtered + 5_000);
    }
    lab.fresh_client();
    assert_eq!(lab.loss("frames not received"), 0);
    lab.expect_order(1);
}
