//! How near the sensor comes to the true contact instant behind a moving piece: a table over the rigs of the standard.
//!
//! `cargo bench -p thud-sim --bench contact_instant [-- TRIALS]`

#[path = "../tests/struck/mod.rs"]
mod struck;

use struck::{Case, grid, lossy, promised_s, rms};

fn main() {
    let trials = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(40u64);
    println!(
        "{trials} hits each; robot of 6 kg, 0.3 N rms white noise, 0.5 N hum at 50 ± 0.2 Hz, drift, 20 kS/s, 8 kHz anti-alias filter.\n"
    );
    table(&grid(), trials);
    println!("\nWith further mechanisms; the bound is that without them.\n");
    table(&lossy(), trials);
}

fn table(cases: &[Case], trials: u64) {
    println!(
        "| pad N/mm | body N/mm | piece kg | ζ pad | ζ springs | ring Hz | v m/s | K N/mm | rms µs | mean µs | bound µs | rms/promised | further |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for case in cases {
        let errors = case.errors_s(0..trials);
        let bound = Case { further: &[], ..case.clone() }.bound_s();
        let all = rms(&errors);
        println!(
            "| {} | {} | {} | {} | {} | {:.0} | {} | {:.1} | {:.0} | {:+.0} | {:.1} | {:.2} | {} |",
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
            case.further.join(", "),
        );
    }
}
