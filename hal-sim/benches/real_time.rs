//! How many times faster than life the simulation runs, on one core.
//!
//! `cargo bench -p thud-sim --bench real_time`

use std::time::Instant as WallClock;

use embassy_time::Instant;
use thud_firmware::board::{BLOCK, ResetCause, Samples as _, Watchdog as _};
use thud_sim::board::{BoardSettings, Life, Parts, firmware};
use thud_sim::bus::BitRate;
use thud_sim::chain::{ChainSettings, MeasuringChain};
use thud_sim::force::Blows;
use thud_sim::mechanism::Effect;
use thud_sim::rig::{Accuracy, Approach, Quantity, Rig};
use thud_sim::world::World;

const SAMPLE_RATE: f64 = 20_000.0;
const VIRTUAL_S: u64 = 120;
/// Odd, so that the median is a run.
const RUNS: usize = 7;

fn main() {
    println!("{VIRTUAL_S} s of virtual time at {SAMPLE_RATE} samples a second on one core; median of {RUNS} runs, and");
    println!("the quickest, which a busy machine disturbs least.\n");
    println!("| | × real time | quickest | ns a sample |");
    println!("|---|---|---|---|");
    report("**sensor and rig, struck every second**", || world(firmware, |second, blows| strike(second, blows, &[])));
    report("**the same with damping and a moving piece**", || {
        world(firmware, |second, blows| strike(second, blows, &DAMPED_PIECE))
    });
    report("sensor with all tasks and bus, rig idle", || world(firmware, |_, _| ()));
    report("ADC and a program that only reads blocks", || world(reader, |_, _| ()));
    report("measuring chain alone", chain);
}

fn report(what: &str, run: impl Fn()) {
    let mut took_s: Vec<f64> = (0..RUNS)
        .map(|_| {
            let began = WallClock::now();
            run();
            began.elapsed().as_secs_f64()
        })
        .collect();
    took_s.sort_by(f64::total_cmp);
    let (quickest_s, median_s) = (took_s[0], took_s[RUNS / 2]);
    let virtual_s = VIRTUAL_S as f64;
    let sample_ns = median_s / (virtual_s * SAMPLE_RATE) * 1e9;
    println!("| {what} | {:.0} | {:.0} | {sample_ns:.0} |", virtual_s / median_s, virtual_s / quickest_s);
}

fn chain() {
    let mut chain = MeasuringChain::new(&ChainSettings::workshop(), 1);
    let mut codes = [0; BLOCK];
    for _ in 0..VIRTUAL_S * SAMPLE_RATE as u64 / BLOCK as u64 {
        chain.convert(&mut [0.0; BLOCK], &mut codes);
        std::hint::black_box(&codes);
    }
}

fn world(program: fn(Parts) -> Life, each_second: fn(u64, &Blows)) {
    let mut world = World::new(BitRate::MEGABIT, 1);
    let host = world.bus().attach_host("host");
    let blows = Blows::new();
    world.add_board(BoardSettings::new(1, 1).with_chain(ChainSettings::workshop()), blows.clone(), program);
    for second in 1..=VIRTUAL_S {
        each_second(second, &blows);
        world.run_until(Instant::from_secs(second)).expect("the firmware lives");
        while let Some(arrival) = host.receive() {
            std::hint::black_box(arrival);
        }
    }
}

const DAMPED_PIECE: [&str; 2] = ["hunt-crossley-damping", "moving-piece-inertia"];

/// From the fifth second on a robot of 6 kg hits 25 N/mm behind a pad, at 0.1 to 0.5 m/s; the rig is integrated here.
fn strike(second: u64, blows: &Blows, effects: &[&str]) {
    if second < 5 {
        return;
    }
    let approach = Approach::new(0.1 * (1 + second % 5) as f64, 6.0);
    let effects: Vec<_> = effects.iter().map(|id| Effect::new(id, &[]).expect("listed")).collect();
    let rig = Rig::impact(25e3).with_pad(80e3);
    let impact = rig.strike(&approach, &effects, 0.3, Accuracy::default()).expect("a usual rig");
    let times_s: Vec<_> = (0..6_000).map(|index| f64::from(index) / SAMPLE_RATE).collect();
    let contact_s = (second - 1) as f64 + 0.2;
    blows.strike_sampled(contact_s, SAMPLE_RATE, impact.sample(Quantity::CellForce, &times_s));
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
