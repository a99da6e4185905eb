//! How many times faster than life the simulation runs, on one core.
//!
//! `cargo bench -p thud-sim --bench real_time`

use std::time::Instant as WallClock;

use embassy_time::Instant;
use thud_firmware::board::{BLOCK, ResetCause, Samples as _, Watchdog as _};
use thud_sim::board::{BoardSettings, Life, Parts, firmware};
use thud_sim::bus::BitRate;
use thud_sim::chain::{ChainSettings, MeasuringChain};
use thud_sim::force::{ForceSource, Untouched};
use thud_sim::world::World;

const SAMPLE_RATE: f64 = 20_000.0;
const VIRTUAL_S: u64 = 120;
const RUNS: usize = 5;

fn main() {
    println!("{VIRTUAL_S} s of virtual time at {SAMPLE_RATE} samples a second, best of {RUNS} runs");
    println!("{:<52} {:>10} {:>14}", "", "ns/sample", "x real time");
    report("measuring chain alone", chain);
    report("ADC and a program that only reads blocks", || world(&Untouched, reader));
    report("firmware with all tasks and bus, rig idle", || world(&Untouched, firmware));
    report("the same, an impact every second", || world(&knocks, firmware));
}

fn report(what: &str, run: impl Fn()) {
    let best_s = (0..RUNS)
        .map(|_| {
            let began = WallClock::now();
            run();
            began.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min);
    let samples = VIRTUAL_S as f64 * SAMPLE_RATE;
    println!("{what:<52} {:>10.1} {:>14.0}", best_s / samples * 1e9, VIRTUAL_S as f64 / best_s);
}

fn chain() {
    let mut chain = MeasuringChain::new(&ChainSettings::workshop(), 1);
    let mut codes = [0; BLOCK];
    for _ in 0..VIRTUAL_S * SAMPLE_RATE as u64 / BLOCK as u64 {
        chain.convert(&mut [0.0; BLOCK], &mut codes);
        std::hint::black_box(&codes);
    }
}

fn world(force: &(impl ForceSource + Clone + 'static), program: fn(Parts) -> Life) {
    let mut world = World::new(BitRate::MEGABIT, 1);
    let host = world.bus().attach_host("host");
    world.add_board(BoardSettings::new(1, 1).with_chain(ChainSettings::workshop()), force.clone(), program);
    for second in 1..=VIRTUAL_S {
        world.run_until(Instant::from_secs(second)).expect("the firmware lives");
        while let Some(arrival) = host.receive() {
            std::hint::black_box(arrival);
        }
    }
}

/// A half sine of 30 ms and 150 N every second, from the fifth on: 25 N/mm struck by 6 kg.
fn knocks(at_s: f64) -> f64 {
    let since_s = at_s.fract();
    if at_s > 5.0 && since_s < 0.030 { 150.0 * (std::f64::consts::PI * since_s / 0.030).sin() } else { 0.0 }
}

fn reader(parts: Parts) -> Life {
    Box::pin(async move {
        let (mut samples, mut watchdog) = (parts.samples, parts.watchdog);
        let mut block = [0; BLOCK];
        while samples.next_block(&mut block).await.is_ok() {
            watchdog.pet();
            std::hint::black_box(&block);
        }
        ResetCause::Software
    })
}
