//! Five blows of an instrumented hammer on a structure that is not described (pyFRF's example data): force at 25.6 kHz.
//!
//! Baseline: a head against a spring. Neither is documented: 20 g at 0.33 m/s (13 mN s of impulse there and back) and 2 N/µm make a pulse of 0.3 ms;
//! all of it to 30 %.

use super::{Belief, Campaign, Entry, Expected, Real, channel, series};

/// The blow is over 10 ms after the recording begins; what follows is silence.
const UNTIL_S: f64 = 0.02;

pub fn all() -> Vec<Real> {
    vec![Real {
        name: "hammer".to_owned(),
        about: "five blows of a hammer on a structure, force",
        documented: "real measurements, nothing else is said; the structure rings at 0.8 to 4.4 kHz",
        expected: Expected::Open,
        make: Box::new(|recordings, folder| {
            let entries = (1..=5)
                .map(|blow| {
                    let force = channel(&recordings.join(format!("impact_hammer/blow{blow}.csv")), "force_N");
                    let file = format!("{blow:03}.csv");
                    series(
                        &folder.join(&file),
                        "force_N",
                        force.into_iter().take_while(|(time_s, _)| *time_s <= UNTIL_S),
                    );
                    Entry { file, speed_m_per_s: Belief(0.33, 0.1), mass_kg: Belief(0.02, 0.006), configuration: None }
                })
                .collect();
            Campaign {
                kind: "impact",
                body_n_per_m: Some(Belief(2e6, 6e5)),
                sample_rate_hz: 25_600.0,
                noise_rms: 0.1,
                full_scale: 220.0,
                observed: "force_N",
                entries,
            }
        }),
    }]
}
