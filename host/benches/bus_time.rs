//! How long a recording takes over a bus at 1 Mbit/s, counted in bits on the simulated wire, beside what the protocol permits at best.
//!
//! `cargo bench -p thud --bench bus_time`. Virtual time: the same figures on every computer.
//!
//! The limit: a segment of a block upload carries seven bytes in a frame of eight, 108 bits without a stuff bit and three of
//! intermission (ISO 11898-1), and nobody waits for anybody. Segmented upload asks for each segment with a frame of its own.

use std::time::Duration;

use thud::client::Client;
use thud::simulated_sensor::{Setup, SimulatedSensor};
use thud_firmware::configuration::Configuration;
use thud_firmware::dictionary::index;
use thud_sim::bus::{Disturbance, Traffic};
use thud_sim::chain::ChainSettings;
use thud_sim::rig::{Approach, Rig};

const NODE: u8 = 32;
/// Bits of a frame with eight bytes and no stuff bit, and of the intermission after it.
const FRAME_BITS: f64 = 108.0 + 3.0;
const BIT_S: f64 = 1e-6;

fn main() {
    println!(
        "| transfer | samples | bits on the wire | bus time s | limit s | scaled to 14 000 samples (0.7 s at 20 kS/s) s |"
    );
    println!("|---|---|---|---|---|---|");
    row("block upload, free bus", true, |_| {});
    row("block upload, 60 % foreign load of more urgent frames", true, |sensor| {
        let others = Traffic { identifiers: 0x081..=0x0FF, ..Traffic::with_load(0.6) };
        sensor.world().borrow().bus().attach_traffic("others", others);
    });
    row("block upload, 1 % of frames destroyed", true, |sensor| {
        sensor.world().borrow().bus().disturb(Disturbance::Probability(0.01));
    });
    row("segmented upload, free bus", false, |_| {});
}

fn row(name: &str, blocks: bool, prepare: impl FnOnce(&SimulatedSensor)) {
    let sensor = SimulatedSensor::new(Setup {
        seed: 1,
        serial: 7,
        configuration: Configuration::DEFAULT,
        chain: ChainSettings::workshop(),
        rig: Rig::impact(25_000.0),
        effects: Vec::new(),
    })
    .expect("an empty flash takes a configuration");
    let mut client = Client::new(Box::new(sensor.bus()));
    pass(&mut client, 3);
    sensor.strike(&Approach::new(0.3, 6.0)).expect("a possible impact");
    pass(&mut client, 2);
    let (_, slot) = client.stored_curves(NODE).expect("the sensor answers")[0];
    prepare(&sensor);
    let bus = sensor.world().borrow().bus().clone();
    let (before, began) = (bus.statistics(), client.line().now());
    let mut sdo = client.sdo(NODE);
    let object = index::RECORDING + slot;
    let bytes = if blocks { sdo.upload_blocks(object, 12, &mut |_| {}) } else { sdo.upload(object, 12) };
    let samples = bytes.expect("the curve comes").len() / 2;
    let seconds = (client.line().now() - began).as_secs_f64();
    let bits = bus.statistics().bits - before.bits;
    let frames = (samples * 2).div_ceil(7) as f64 * if blocks { 1.0 } else { 2.0 };
    println!(
        "| {name} | {samples} | {bits} | {seconds:.3} | {:.3} | {:.3} |",
        frames * FRAME_BITS * BIT_S,
        seconds / samples as f64 * 14_000.0
    );
}

fn pass(client: &mut Client, seconds: u64) {
    let until = client.line().now() + Duration::from_secs(seconds);
    while client.line().now() < until {
        client.line().next(Duration::from_millis(100)).expect("the simulated bus does not fail");
    }
}
