//! The alarm's delay in guest time over a thousand impacts, with a bus that others load to 90 % and flash to be written.
//!
//! `cargo bench -p thud-emulator --features unicorn --bench alarm_latency [-- IMPACTS]`; a thousand take half an hour and more.

#![allow(missing_docs, reason = "a program")]

use std::time::Instant;

#[path = "../tests/lab/mod.rs"]
mod lab;
#[path = "../tests/load_trial/mod.rs"]
mod load_trial;

fn main() {
    let impacts = std::env::args().filter_map(|word| word.parse().ok()).next().unwrap_or(1_000);
    let began = Instant::now();
    let (outcome, lab) = load_trial::run(impacts, |number| {
        if number % 10 == 0 {
            eprintln!("{number} of {impacts}, {:.0} s", began.elapsed().as_secs_f64());
        }
    });
    let mut sorted = outcome.alarms_s.clone();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize] * 1e3;
    println!("| over {impacts} impacts | |");
    println!("|---|---|");
    println!("| alarm after six times the noise, median | {:.3} ms |", at(0.5));
    println!("| 99 of 100 | {:.3} ms |", at(0.99));
    println!("| worst | {:.3} ms |", at(1.0));
    println!("| load of the bus | {:.1} % |", 100.0 * outcome.load);
    println!("| processor awake | {:.1} % |", 100.0 * outcome.awake);
    println!("| double words and pages of flash written | {} |", outcome.written);
    println!("| contacts with something to be written | {} |", outcome.due_contacts);
    println!("| samples lost | {} |", outcome.lost_samples);
    println!("| stack used | {} bytes |", outcome.stack);
    println!("| violations | {} |", lab.emulator().chip().violations().len());
    println!("| real time, seconds | {:.0} |", began.elapsed().as_secs_f64());
}
