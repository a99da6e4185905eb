//! What a simulated campaign promises.

use super::*;
use crate::campaign::{Estimate, RigKind, SPRING_REPEATABILITY};
use crate::recording::FORCE;

fn plan() -> Plan {
    Plan {
        name: "chest".to_owned(),
        rig: Rig {
            kind: RigKind::Impact,
            body_stiffness_n_per_m: Some(Estimate::new(25_000.0, 1_250.0)),
            pad_stiffness_n_per_m: None,
            moving_mass_kg: None,
            gravity_along_impact_m_per_s2: 0.0,
            spring_repeatability: SPRING_REPEATABILITY,
        },
        effects: Vec::new(),
        limited: Vec::new(),
        speeds_m_per_s: vec![0.1, 0.3],
        masses_kg: vec![5.0, 8.0],
        repeats: 2,
        doubt: Doubt { speed: 0.01, mass: 0.03 },
        sample_rate_hz: 10_000.0,
        full_scale_n: 2_224.0,
        imperfection: Imperfection { noise_n: 0.3, hum_n: 0.2, drift_n_per_s: 0.01 },
        before_s: 0.1,
        after_s: 0.15,
        displacement_noise_m: None,
        height_noise_m: 0.001,
        seed: 7,
    }
}

fn bytes(simulated: &Simulated) -> String {
    let recordings: String = simulated.recordings.iter().map(Recording::to_csv).collect();
    simulated.campaign.to_toml() + &recordings
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_one_others() {
    let once = bytes(&simulate(&plan(), || {}).unwrap());
    assert_eq!(once, bytes(&simulate(&plan(), || {}).unwrap()));
    assert_ne!(once, bytes(&simulate(&Plan { seed: 8, ..plan() }, || {}).unwrap()));
}

#[test]
fn what_is_written_is_believed_and_what_is_true_lies_within_the_doubt() {
    let simulated = simulate(&plan(), || {}).unwrap();
    assert_eq!(simulated.campaign.recordings.len(), 8);
    assert_eq!(simulated.campaign.rig, plan().rig);
    let text = simulated.campaign.to_toml();
    assert_eq!(Campaign::parse("campaign.toml", &text).unwrap(), simulated.campaign);
    let mut off = 0;
    for (entry, truth) in simulated.campaign.recordings.iter().zip(&simulated.truth.recordings) {
        for (believed, truth) in [
            (entry.impact_speed_m_per_s, truth.impact_speed_m_per_s),
            (entry.effective_mass_kg, truth.effective_mass_kg),
        ] {
            let deviations = (truth - believed.value).abs() / believed.sd;
            assert!(deviations <= 2.5, "{deviations}");
            off += usize::from(deviations > 0.1);
        }
    }
    assert!(off > 8, "hardly anything is off");
    let of = |configuration: &str| -> Vec<f64> {
        simulated
            .campaign
            .recordings
            .iter()
            .zip(&simulated.truth.recordings)
            .filter(|(entry, _)| entry.configuration.as_deref() == Some(configuration))
            .map(|(_, truth)| truth.effective_mass_kg)
            .collect()
    };
    assert!(of("1").windows(2).all(|pair| pair[0] == pair[1]), "one configuration shares its mass error");
}

/// Without error, noise and mechanisms it is the half sine of the baseline: v·√(k·m) at the peak.
#[test]
fn the_ideal_rig_is_the_baseline() {
    let mut plan = plan();
    plan.doubt = Doubt { speed: 0.0, mass: 0.0 };
    plan.rig.body_stiffness_n_per_m = Some(Estimate::new(25_000.0, 0.0));
    plan.rig.spring_repeatability = 0.0;
    plan.imperfection = Imperfection { noise_n: 0.0, hum_n: 0.0, drift_n_per_s: 0.0 };
    let simulated = simulate(&plan, || {}).unwrap();
    for (recording, truth) in simulated.recordings.iter().zip(&simulated.truth.recordings) {
        let expected = truth.impact_speed_m_per_s * (25_000.0 * truth.effective_mass_kg).sqrt();
        let peak = recording.channel(FORCE).unwrap().iter().copied().fold(0.0, f64::max);
        assert!((peak - expected).abs() < 0.1, "{peak} {expected}");
        assert!((truth.contacts[0].peak_N - expected).abs() < 1e-3, "{} {expected}", truth.contacts[0].peak_N);
        let before = recording.times_s().iter().zip(recording.channel(FORCE).unwrap());
        assert!(before.take_while(|(time, _)| **time < truth.contact_s).all(|(_, force)| *force == 0.0));
    }
}

#[test]
fn a_mechanism_shows_in_the_recordings_and_not_in_the_campaign() {
    let effect: Effect = "guide-friction:force_N=8".parse().unwrap();
    let with = simulate(&Plan { effects: vec![effect], ..plan() }, || {}).unwrap();
    let without = simulate(&plan(), || {}).unwrap();
    assert_eq!(with.campaign, without.campaign);
    assert_ne!(with.recordings, without.recordings);
    assert!(with.truth.mechanisms[0].starts_with("guide-friction:force_N=8"));
}

#[test]
fn a_force_beyond_full_scale_is_cut() {
    let simulated = simulate(&Plan { full_scale_n: 50.0, ..plan() }, || {}).unwrap();
    let top = simulated.recordings[7].channel(FORCE).unwrap().iter().copied().fold(0.0, f64::max);
    assert!((top - 50.0).abs() < 0.01, "{top}");
}

#[test]
fn a_plan_that_cannot_be_is_refused_with_the_range() {
    for (plan, says) in [
        (Plan { speeds_m_per_s: vec![0.1, -0.2], ..plan() }, "a speed (m/s) is -0.2; 0.0001 to 20"),
        (Plan { masses_kg: vec![], ..plan() }, "there is no mass"),
        (Plan { repeats: 0, ..plan() }, "repeats is 0"),
        (Plan { sample_rate_hz: f64::NAN, ..plan() }, "sample rate (Hz) is NaN"),
        (Plan { after_s: 99.0, sample_rate_hz: 1e6, ..plan() }, "number of samples"),
        (
            Plan { rig: Rig { kind: RigKind::Fall, ..plan().rig }, displacement_noise_m: Some(1e-5), ..plan() },
            "a fall meets no springs",
        ),
    ] {
        let error = simulate(&plan, || {}).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn a_limited_mechanism_acts_in_its_configuration_only() {
    let effect: Effect = "gain-error:relative=0.2".parse().unwrap();
    let ideal = simulate(&plan(), || {}).unwrap();
    let with = simulate(&Plan { limited: vec![(effect, "2".to_owned())], ..plan() }, || {}).unwrap();
    for (number, entry) in with.campaign.recordings.iter().enumerate() {
        let same = with.recordings[number] == ideal.recordings[number];
        assert_eq!(same, entry.configuration.as_deref() == Some("1"), "{number}");
    }
}
