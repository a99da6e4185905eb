//! How near the sensor comes to the true contact instant behind a moving piece: a table over the rigs of the standard.
//!
//! `cargo bench -p thud-sim --bench contact_instant [-- TRIALS]`

#[path = "../tests/struck/mod.rs"]
mod struck;

use struck::{grid, promised_s, rms};

fn main() {
    let trials = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(40u64);
    println!(
        "{trials} hits each; 6 kg, 0.3 N rms white noise, 0.5 N hum at 50 ± 0.2 Hz, drift, 20 kS/s, 8 kHz anti-alias filter.\n"
    );
    println!(
        "| pad N/mm | body N/mm | piece kg | ζ pad | ζ springs | ring Hz | v m/s | K N/mm | rms µs | mean µs | bound µs | rms/promised |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for case in grid() {
        let errors = case.errors_s(0..trials);
        let (bound, all) = (case.bound_s(), rms(&errors));
        println!(
            "| {} | {} | {} | {} | {} | {:.0} | {} | {:.1} | {:.0} | {:+.0} | {:.1} | {:.2} |",
            case.pad_n_per_m / 1e3,
            case.body_n_per_m / 1e3,
            case.piece_kg,
            case.damping.0,
            case.damping.1,
            case.ring_hertz(),
            case.speed_m_per_s,
            case.stiffness_n_per_m() / 1e3,
            all * 1e6,
            errors.iter().sum::<f64>() / errors.len() as f64 * 1e6,
            bound * 1e6,
            all / promised_s(bound),
        );
    }
}
