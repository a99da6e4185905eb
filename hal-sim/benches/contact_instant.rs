//! How near the sensor comes to the true contact instant behind a moving piece: a table over the rigs of the standard.
//!
//! `cargo bench -p thud-sim --bench contact_instant [-- TRIALS]`

#[path = "../tests/struck/mod.rs"]
mod struck;

use struck::{Case, bare, grid, lossy, promised_s, rms, unexpected};

fn main() {
    let trials = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(40u64);
    println!(
        "{trials} hits each; 0.3 N rms white noise, 0.5 N hum at 50 ± 0.2 Hz, drift, 20 kS/s, 8 kHz anti-alias filter."
    );
    println!(
        "Bound: Cramér–Rao, of two bodies of which neither masses, stiffnesses nor dampings are known. Promised: 50 µs, or 1.5"
    );
    println!("times the bound where that is larger.");
    for (title, cases) in [
        ("The standard's pads", grid()),
        ("No pad", bare()),
        ("Dampings and masses that the fit does not expect; the second is the robot's", unexpected()),
        ("With further mechanisms; the bound is that without them", lossy()),
    ] {
        println!("\n{title}\n");
        table(&cases, trials);
    }
}

fn table(cases: &[Case], trials: u64) {
    println!(
        "| pad N/mm | body N/mm | piece, robot kg | ζ pad | ζ springs | ring Hz | v m/s | K N/mm | rms µs | mean µs | bound µs | rms/promised | further |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let mut within = 0;
    for case in cases {
        let errors = case.errors_s(0..trials);
        let bound = Case { further: &[], ..case.clone() }.bound_s();
        let all = rms(&errors);
        println!(
            "| {} | {} | {}, {} | {} | {} | {:.0} | {} | {:.1} | {:.0} | {:+.0} | {:.1} | {:.2} | {} |",
            case.pad_n_per_m / 1e3,
            case.body_n_per_m / 1e3,
            case.piece_kg,
            case.robot_kg,
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
        within += usize::from(all <= promised_s(bound));
    }
    println!("\n{within} of {} rows within what is promised.", cases.len());
}
