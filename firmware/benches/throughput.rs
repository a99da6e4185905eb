//! How fast the sensor's logic runs on this machine.
//!
//! `cargo bench -p thud-firmware --bench throughput`
//!
//! The per-sample path in its two states, and the evaluation of one impact.

#[path = "../tests/synthetic/mod.rs"]
mod synthetic;

use std::time::{Duration, Instant};

use rand_distr::{Distribution, StandardNormal};
use synthetic::{Bench, Disturbance, HalfSine, RATE, code, configuration};
use thud_firmware::board::{BLOCK, BlockInfo};
use thud_firmware::capture::CAPTURE;
use thud_firmware::units::Volt;

/// Best of some runs of at least a tenth of a second, per item.
fn best(items: u64, mut run: impl FnMut()) -> Duration {
    (0..5)
        .map(|_| {
            let start = Instant::now();
            let mut rounds = 0;
            while start.elapsed() < Duration::from_millis(100) {
                run();
                rounds += 1;
            }
            start.elapsed().div_f64((rounds * items) as f64)
        })
        .min()
        .unwrap_or_default()
}

fn main() {
    println!("| part | ns each | times real time at 20 kS/s |");
    println!("|---|---|---|");
    let row = |name: &str, each: Duration| {
        let real_time = 1.0 / (RATE * each.as_secs_f64());
        println!("| {name} | {:.1} | {real_time:.0} |", each.as_secs_f64() * 1e9);
    };

    let mut bench = Bench::<CAPTURE>::new(configuration(RATE), 1);
    bench.run(1.0, &Disturbance::USUAL, |_| 0.0);
    // One second of idling, with its hum in phase with what was learned.
    let next = bench.next;
    let codes: Vec<u16> =
        (0..RATE as u64).map(|i| code(Disturbance::USUAL.at((next + i) as f64 / RATE), &bench.chain)).collect();
    let mut index = next;
    row(
        "a sample while nothing touches",
        best(codes.len() as u64, || {
            for block in codes.chunks(BLOCK) {
                let signals = bench.sensor.push(block, &BlockInfo { first_index: index, bias: Volt(10.0) });
                assert!(signals.is_empty());
                index += block.len() as u64;
            }
        }),
    );

    let mut bench = Bench::<CAPTURE>::new(configuration(RATE), 1);
    let pulse = HalfSine::of_duration(200.0, 0.03);
    let quiet = (0.4 * RATE) as usize;
    // A blow, its window, and time to settle, over and over; noise, because exact zeros are denormal numbers in a filter.
    let codes: Vec<u16> = (0..RATE as usize)
        .map(|i| {
            let noise: f64 = StandardNormal.sample(&mut bench.rng);
            code(pulse.at((i as f64 - quiet as f64) / RATE) + 0.3 * noise, &bench.chain)
        })
        .collect();
    let mut index = 0;
    let mut context = None;
    row(
        "a sample with an impact every second",
        best(codes.len() as u64, || {
            for block in codes.chunks(BLOCK) {
                for signal in bench.sensor.push(block, &BlockInfo { first_index: index, bias: Volt(10.0) }) {
                    if let thud_firmware::detector::Signal::Over(over) = signal {
                        context = Some(over);
                    }
                }
                index += block.len() as u64;
            }
        }),
    );
    let context = context.expect("an impact");
    let each = best(1, || assert_eq!(bench.sensor.evaluate(&context).len(), 1));
    println!("\nEvaluation of one impact of 0.6 s: {:.2} ms.", each.as_secs_f64() * 1e3);
}
