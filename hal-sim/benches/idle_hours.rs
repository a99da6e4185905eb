//! False alarms of the whole firmware in hours of virtual idling, with noise, hum, drift and single-sample spikes.
//!
//! `cargo bench -p thud-sim --bench idle_hours [-- HOURS]`, 10 hours if not said otherwise.

use std::time::Instant as WallClock;

use embassy_time::{Duration, Instant};
use thud_firmware::board::{Frame, Received};
use thud_firmware::configuration::Configuration;
use thud_firmware::dictionary::frame::ALARM_BASE;
use thud_firmware::units::{Hertz, Newton, Second};
use thud_sim::board::{BoardSettings, firmware};
use thud_sim::bus::BitRate;
use thud_sim::chain::{ChainSettings, Drift, Hum, Spikes};
use thud_sim::force::Untouched;
use thud_sim::world::World;

const SPIKES_PER_S: f32 = 1.0;

fn main() {
    let hours = std::env::args().filter_map(|argument| argument.parse().ok()).next().unwrap_or(10);
    let chain = ChainSettings {
        hum: Some(Hum { fundamental: Hertz(50.02), amplitude: Newton(0.5), harmonics: vec![0.1, 0.3] }),
        drift: Drift { rate_newton_per_second: 0.014, thermal: Newton(3.0), thermal_time: Second(900.0) },
        spikes: Some(Spikes { rate: Hertz(SPIKES_PER_S), height: Newton(50.0) }),
        ..ChainSettings::workshop()
    };
    let node = Configuration::DEFAULT.node.node_id;
    let mut world = World::new(BitRate::MEGABIT, 1);
    let host = world.bus().attach_host("host");
    world.add_board(BoardSettings::new(1, 1).with_chain(chain), Untouched, firmware);
    world.run_for(Duration::from_millis(20)).expect("the firmware lives");
    host.send(&Frame::new(0x000, &[0x01, node]).expect("an NMT command"));
    let began = WallClock::now();
    let mut alarms = Vec::new();
    for minute in 1..=60 * hours {
        world.run_until(Instant::from_secs(60 * minute)).expect("the firmware lives");
        while let Some(arrival) = host.receive() {
            if let Received::Frame(Frame { id, .. }) = arrival.received
                && id == ALARM_BASE + u16::from(node)
            {
                alarms.push(arrival.at.as_millis() as f64 * 1e-3);
            }
        }
    }
    let took_s = began.elapsed().as_secs_f64();
    println!("{hours} h idle at 20 kS/s: 0.3 N rms noise, 0.5 N hum at 50.02 Hz with harmonics, drift 14 mN/s and");
    println!("3 N of warming, {SPIKES_PER_S} spike of up to 50 N a second");
    println!("false alarms: {} {alarms:?}", alarms.len());
    println!("took {took_s:.1} s, {:.0} x real time", hours as f64 * 3600.0 / took_s);
}
