//! How near the sensor comes to the truth: a table over speed and stiffness.
//!
//! `cargo bench -p thud-firmware --bench accuracy [-- TRIALS]`

#[path = "../tests/synthetic/mod.rs"]
mod synthetic;

use synthetic::trial::{Errors, bound, grid, once, rms};

fn main() {
    let trials = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(100u64);
    println!(
        "{trials} hits each; 0.3 N rms white noise, 0.5 N hum at 50 ± 0.2 Hz, drift ± 14 mN/s, 20 kS/s, reference chain."
    );
    println!(
        "Alarm: from the true force passing 1.8 N to the end of the block that raised it; a CAN frame adds 0.15 ms.\n"
    );
    println!(
        "| v m/s | K N/mm | m_R kg | contact rms µs | mean µs | bound µs | rms/max(33 µs, bound) | separation rms µs | peak worst N | worst % | impulse worst % | alarm worst ms |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for hit in grid() {
        let errors: Vec<Errors> = (0..trials).map(|seed| once(hit, seed, None).0).collect();
        let contact = rms(errors.iter().map(|e| e.contact)) * 1e6;
        let mean = errors.iter().map(|e| e.contact).sum::<f64>() / trials as f64 * 1e6;
        let bound = bound(hit) * 1e6;
        let worst = |of: fn(&Errors) -> f64| errors.iter().map(|e| of(e).abs()).fold(0.0, f64::max);
        let peak = hit.v * (hit.k * hit.m).sqrt();
        println!(
            "| {} | {} | {} | {contact:.1} | {mean:+.1} | {bound:.1} | {:.2} | {:.1} | {:.2} | {:.2} | {:.2} | {:.2} |",
            hit.v,
            hit.k / 1e3,
            hit.m,
            contact / bound.max(50.0 / 1.5),
            rms(errors.iter().map(|e| e.separation)) * 1e6,
            worst(|e| e.raw_peak),
            worst(|e| e.raw_peak) / peak * 100.0,
            worst(|e| e.impulse) * 100.0,
            errors.iter().map(|e| e.alarm).fold(f64::NEG_INFINITY, f64::max) * 1e3,
        );
    }
    println!("\nWith a decaying ring of a moving piece (5 % of the peak, τ 10 ms), which the arc does not have:\n");
    println!("| ring Hz | v m/s | K N/mm | contact rms µs | mean µs |");
    println!("|---|---|---|---|---|");
    for hertz in [170.0, 300.0, 600.0] {
        for hit in grid().into_iter().filter(|hit| hit.m == 6.0 && (hit.v == 0.15 || hit.v == 0.6)) {
            let errors: Vec<f64> =
                (0..trials / 4 + 1).map(|seed| once(hit, seed, Some((0.05, hertz))).0.contact).collect();
            let mean = errors.iter().sum::<f64>() / errors.len() as f64 * 1e6;
            println!(
                "| {hertz} | {} | {} | {:.1} | {mean:+.1} |",
                hit.v,
                hit.k / 1e3,
                rms(errors.iter().copied()) * 1e6
            );
        }
    }
}
