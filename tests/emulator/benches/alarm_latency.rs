//! The alarm's delay in guest time over a thousand impacts, with a bus that others load to 90 % and flash to be written.
//!
//! `cargo bench -p thud-emulator --features unicorn --bench alarm_latency [-- IMPACTS [BOARDS]]`. The impacts are shared out to so
//! many boards (two), each in a thread of its own with other noise and other phases; a thousand take half an hour and more.

#![allow(missing_docs, reason = "a program")]

use std::thread;
use std::time::Instant;

use thud_emulator::stack_depth;

#[path = "../tests/lab/mod.rs"]
mod lab;
#[path = "../tests/load_trial/mod.rs"]
mod load_trial;

use load_trial::Outcome;

fn main() {
    let mut numbers = std::env::args().filter_map(|word| word.parse().ok());
    let impacts: u32 = numbers.next().unwrap_or(1_000);
    let boards = numbers.next().unwrap_or(2).clamp(1, impacts.max(1));
    let began = Instant::now();
    let trial = |board: u32| {
        let share = impacts / boards + u32::from(board < impacts % boards);
        let (mut outcome, mut lab) = load_trial::run(u64::from(board) + 1, share, |number| {
            if number % 10 == 0 {
                eprintln!("board {board}: {number} of {share}, {:.0} s", began.elapsed().as_secs_f64());
            }
        });
        outcome.stored = load_trial::stored(&mut lab);
        outcome
    };
    let outcome = thread::scope(|scope| {
        let trials: Vec<_> = (0..boards).map(|board| scope.spawn(move || trial(board))).collect();
        let outcomes = trials.into_iter().map(|trial| trial.join().expect("an impact went wrong, see above"));
        outcomes.reduce(Outcome::and).expect("a board at least")
    });
    stack_depth::note(outcome.stack).expect("beside the program a file can be written");
    let mut sorted = outcome.alarms_s.clone();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize] * 1e3;
    println!("| over {impacts} impacts on {boards} boards | |");
    println!("|---|---|");
    println!("| alarm after six times the noise, median | {:.3} ms |", at(0.5));
    println!("| 99 of 100 | {:.3} ms |", at(0.99));
    println!("| worst | {:.3} ms |", at(1.0));
    println!("| load of the bus, least | {:.1} % |", 100.0 * outcome.load);
    println!("| processor awake, most | {:.1} % |", 100.0 * outcome.awake);
    println!("| frames kept out by the filters, and let in | {}, {} |", outcome.filtered, outcome.accepted);
    println!("| double words and pages of flash written | {} |", outcome.written);
    println!("| impacts with something still to be written | {} |", outcome.due);
    println!("| of them with flash changed while open | {} |", outcome.disturbed);
    println!("| configurations applied before, and stored in the end | {impacts}, {} |", outcome.stored);
    println!("| samples lost, alarms withheld | {} |", outcome.lost);
    println!("| stack used | {} bytes |", outcome.stack);
    println!("| violations | {} |", outcome.violations);
    println!("| real time, seconds | {:.0} |", began.elapsed().as_secs_f64());
}
