//! The rig against closed forms.

use std::f64::consts::PI;

use thud_sim::mechanism::Effect;
use thud_sim::rig::{Accuracy, Approach, Impact, Rig};

fn strike(rig: &Rig, speed: f64, mass: f64, effects: &[&str], until_s: f64) -> Impact {
    let effects: Vec<Effect> = effects.iter().map(|text| text.parse().unwrap()).collect();
    rig.strike(&Approach::new(speed, mass), &effects, until_s, Accuracy::default()).unwrap()
}

fn assert_near(what: &str, value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value}, expected {expected} ± {tolerance}");
}

/// Peak v·√(k·m), duration π√(m/k), impulse 2mv, and the half sine between.
#[test]
fn the_ideal_impact_is_a_half_sine() {
    for (stiffness, pad, mass, speed) in [
        (10e3, None, 12.0, 0.05),
        (25e3, Some(80e3), 6.08, 0.25),
        (150e3, Some(900e3), 4.0, 0.6),
        (75e3, None, 6.0, 0.4),
    ] {
        let rig = Rig { pad_stiffness_n_per_m: pad, ..Rig::impact(stiffness) };
        let k = rig.effective_stiffness_n_per_m();
        let pulsation = (k / mass).sqrt();
        let peak = speed * (k * mass).sqrt();
        let impact = strike(&rig, speed, mass, &[], 0.4);
        let truth = impact.truth();
        assert_eq!(truth.contacts.len(), 1);
        let contact = truth.contacts[0];
        assert_near("peak", contact.peak_n, peak, 1e-7 * peak);
        assert_near("instant of peak", contact.peak_s, PI / 2.0 / pulsation, 1e-6);
        assert_near("separation", contact.end_s.unwrap(), PI / pulsation, 1e-9);
        assert_near("impulse", contact.impulse_ns, 2.0 * mass * speed, 1e-7 * mass * speed);
        assert_near("speed after", contact.speed_after_m_per_s, -speed, 1e-8 * speed);
        assert_near("loss", contact.loss_j, 0.0, 1e-8 * mass * speed * speed);
        assert_near("stroke", contact.stroke_m, peak / stiffness, 1e-7 * peak / stiffness);
        for part in 1..100 {
            let time = f64::from(part) / 100.0 * PI / pulsation;
            assert_near("force", impact.force_n(time), peak * (pulsation * time).sin(), 2e-7 * peak);
        }
        assert_eq!(impact.force_n(0.39), 0.0);
        assert_eq!(impact.force_n(-0.01), 0.0);
    }
}
