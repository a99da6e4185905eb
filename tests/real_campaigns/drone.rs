//! A quadcopter of 0.24 kg dropped flat on concrete (de Azambuja et al., arXiv 2103.04423): from 0.30 m on its rigid battery holder, from 1.00 m
//! on its flexible frame. Acceleration at 1 kHz; the five flattest landings of each.
//!
//! Baseline: a rigid body on a spring. On the frame the one that the authors measured at rest, 7040 N/m (10 %); on the rigid holder whatever
//! concrete and plastic are, 0.5 N/µm to a factor of two. Mass times acceleration stands for the force of the floor, so that the chain's mechanisms
//! are in question too.

use super::{Belief, Campaign, Entry, Expected, Real, channel, series};

fn campaign(
    set: &'static str,
    height_m: f64,
    mass_kg: f64,
    body: Belief,
) -> impl Fn(&std::path::Path, &std::path::Path) -> Campaign {
    move |recordings, folder| {
        let entries = (1..=5)
            .map(|number| {
                let path = recordings.join(format!("cognifly_crash_landing/{set}_flat{number:02}.csv"));
                let force = channel(&path, "acc_z_m_per_s2").into_iter().map(|(time_s, a)| (time_s, mass_kg * a));
                let file = format!("{number:03}.csv");
                series(&folder.join(&file), "force_N", force);
                // Dropped by hand: the height is good to 5 cm.
                let speed = (2.0 * 9.81 * height_m).sqrt();
                Entry {
                    file,
                    speed_m_per_s: Belief(speed, speed * 0.025 / height_m),
                    mass_kg: Belief(mass_kg, 0.002),
                    configuration: None,
                }
            })
            .collect();
        Campaign {
            kind: "drop",
            body_n_per_m: Some(body),
            sample_rate_hz: 1000.0,
            noise_rms: 0.6,
            full_scale: 500.0,
            observed: "force_N",
            entries,
        }
    }
}

pub fn all() -> Vec<Real> {
    vec![
        Real {
            name: "drone-on-its-frame".to_owned(),
            about: "a quadcopter dropped 1.00 m on its flexible frame, acceleration",
            documented: "a damper of 46 N s/m beside the spring; a stop after 16 mm, met from 1.5 m; a sensor of 500 Hz; tilted landings, contact after contact",
            expected: Expected::Names(&["viscous-damping", "hunt-crossley-damping", "end-stop", "filter-lag"]),
            make: Box::new(campaign("SoftBottom_100cm", 1.0, 0.241, Belief(7040.0, 704.0))),
        },
        Real {
            name: "drone-on-its-battery-holder".to_owned(),
            about: "a quadcopter dropped 0.30 m on its rigid battery holder, acceleration",
            documented: "a sensor of 500 Hz, sampled at 1 kHz: the hit is 3 to 4 samples wide",
            expected: Expected::Names(&["filter-lag"]),
            make: Box::new(campaign("RigidBottom_30cm", 0.3, 0.239, Belief(5e5, 3e5))),
        },
    ]
}
