//! False alarms of the whole firmware in hours of virtual idling, with noise, hum, drift and single-sample spikes.
//!
//! `cargo bench -p thud-sim --bench idle_hours [-- HOURS]`, 10 hours if not said otherwise.

#[path = "../tests/system_trial/mod.rs"]
mod system_trial;

use std::time::Instant as WallClock;

use embassy_time::Instant;
use system_trial::{Idling, SPIKES_PER_S};

fn main() {
    let hours = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(10);
    let began = WallClock::now();
    let mut idling = Idling::new(1);
    idling.run_until(Instant::from_secs(3600 * hours));
    let took_s = began.elapsed().as_secs_f64();
    println!(
        "Idling at 20 kS/s with 0.3 N rms noise, 0.5 N hum at 50.03 Hz with harmonics, drift of 14 mN/s and 3 N of"
    );
    println!("warming, {SPIKES_PER_S} spike of one sample and up to 50 N a second.\n");
    println!("| virtual hours | spikes | false alarms | took s | × real time |");
    println!("|---|---|---|---|---|");
    let seconds = hours as f64 * 3600.0;
    let spikes = seconds * f64::from(SPIKES_PER_S);
    println!("| {hours} | about {spikes:.0} | {} | {took_s:.1} | {:.0} |", idling.alarms_s().len(), seconds / took_s);
    for at_s in idling.alarms_s() {
        println!("\nfalse alarm at {at_s} s");
    }
}
