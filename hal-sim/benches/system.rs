//! How near the whole system comes to the truth: rig, measuring chain, ADC, firmware, bus, and what a host decodes.
//!
//! `cargo bench -p thud-sim --bench system [-- REPEATS]`, 25 impacts a row if not said otherwise.

#[path = "../tests/system_trial/mod.rs"]
mod system_trial;

#[path = "../tests/struck/mod.rs"]
mod struck;

use struck::{BARE_N_PER_M, Case};
use system_trial::{Hit, MASS_KG, Outcome, rms, worst};
use thud_sim::rig::pad_of;

fn main() {
    let repeats = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(25);
    println!(
        "{repeats} impacts a row of {MASS_KG} kg; 20 kS/s, reference chain with 0.3 N rms noise, 0.5 N hum at 50.03 Hz with"
    );
    println!(
        "harmonics, 14 mN/s drift; CAN at 1 Mbit/s. Contact: against the true first touch, less the anti-alias filter's"
    );
    println!(
        "delay of 28 µs. Bound: Cramér–Rao, of a half sine, or of two bodies where the piece moves (`contact_instant`). Peak: against the force that reached the cell. Alarm: from the"
    );
    println!(
        "true force passing six times the noise to the end of the frame on the bus. Worst: of all impacts of the row."
    );
    for (title, pad, piece) in [
        ("Massless piece, no pad", false, false),
        ("Massless piece behind the region's pad", true, false),
        ("Moving piece of 0.12 kg, no pad", false, true),
        ("Moving piece of 0.12 kg behind the region's pad", true, true),
    ] {
        println!("\n{title}\n");
        println!(
            "| v m/s | K N/mm | peak N | contact rms µs | mean µs | bound µs | peak worst N | worst % | impulse worst % | \
             duration worst ms | S worst 1e-6 | alarm worst ms | events |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
        for (number, hit) in (1..).zip(Hit::grid(pad, piece)) {
            row(&hit, &hit.outcomes(repeats, number));
        }
    }
}

fn row(hit: &Hit, outcomes: &[Outcome]) {
    let all = || outcomes.iter();
    let bound_s = if hit.piece { struck(hit).bound_s() } else { hit.bound_s() };
    let events = |most: bool| {
        let counts = all().map(|outcome| outcome.events);
        if most { counts.max() } else { counts.min() }.unwrap_or(0)
    };
    let events = if events(false) == events(true) {
        events(true).to_string()
    } else {
        format!("{} to {}", events(false), events(true))
    };
    println!(
        "| {} | {} | {:.1} | {:.1} | {:+.1} | {:.1} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {events} |",
        hit.speed_m_per_s,
        hit.region.body().stiffness.0 / 1e3,
        outcomes[0].true_peak_n,
        rms(all().map(|outcome| outcome.contact_s)) * 1e6,
        all().map(|outcome| outcome.contact_s).sum::<f64>() / outcomes.len() as f64 * 1e6,
        bound_s * 1e6,
        worst(all().map(|outcome| outcome.peak_n)),
        worst(all().map(|outcome| outcome.peak_n / outcome.true_peak_n)) * 100.0,
        worst(all().map(|outcome| outcome.impulse)) * 100.0,
        worst(all().map(|outcome| outcome.duration_s)) * 1e3,
        worst(all().map(|outcome| outcome.scaled)) * 1e6,
        all().map(|outcome| outcome.alarm_s).fold(f64::NEG_INFINITY, f64::max) * 1e3,
    );
}

/// The same rig, with the piece as the mechanism `moving-piece-inertia` has it by itself.
fn struck(hit: &Hit) -> Case {
    let pad = pad_of(hit.region).typical_stiffness_n_per_m();
    Case {
        body_n_per_m: f64::from(hit.region.body().stiffness.0),
        pad_n_per_m: if hit.pad { pad } else { BARE_N_PER_M },
        piece_kg: 0.12,
        damping: (0.03, 0.01),
        speed_m_per_s: hit.speed_m_per_s,
        robot_kg: MASS_KG,
        further: &[],
    }
}
