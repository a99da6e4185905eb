//! What the page and the screenful promise.

use super::*;
use crate::campaign::{Estimate, Loaded, Rig, RigKind, SPRING_REPEATABILITY};
use crate::diagnosis::answer::{Answer, answer};
use crate::diagnosis::{Diagnosis, Options, diagnose};
use crate::simulation::{Doubt, Imperfection, Plan, simulate};

/// Six recordings of a rig with this mechanism, and what the diagnosis with few mechanisms says.
fn diagnosed(effect: Option<&str>, only: &[&str]) -> (Diagnosis, Answer) {
    let plan = Plan {
        name: "a <b> rig".to_owned(),
        rig: Rig {
            kind: RigKind::Impact,
            body_stiffness_n_per_m: Some(Estimate::new(25_000.0, 1_250.0)),
            pad_stiffness_n_per_m: Some(Estimate::new(80_000.0, 20_000.0)),
            moving_mass_kg: None,
            gravity_along_impact_m_per_s2: 0.0,
            spring_repeatability: SPRING_REPEATABILITY,
        },
        effects: effect.iter().map(|text| text.parse().unwrap()).collect(),
        limited: Vec::new(),
        speeds_m_per_s: vec![0.1, 0.2, 0.3],
        masses_kg: vec![4.0, 8.0],
        repeats: 1,
        doubt: Doubt { speed: 0.01, mass: 0.03 },
        sample_rate_hz: 2_000.0,
        full_scale_n: 2_224.0,
        imperfection: Imperfection { noise_n: 0.3, hum_n: 0.0, drift_n_per_s: 0.0 },
        before_s: 0.1,
        after_s: 0.15,
        displacement_noise_m: None,
        height_noise_m: 0.001,
        seed: 5,
    };
    let simulated = simulate(&plan, || {}).unwrap();
    let loaded = Loaded {
        folder: std::path::PathBuf::new(),
        campaign: simulated.campaign,
        recordings: simulated.recordings,
        warnings: Vec::new(),
    };
    let options = Options { without: Vec::new(), only: only.iter().map(|id| (*id).to_owned()).collect() };
    let diagnosis = diagnose(&loaded, &options, &mut |_| {}).unwrap();
    let answer = answer(&diagnosis);
    (diagnosis, answer)
}

/// A hidden loss, its nearest rival, and one that is far off.
fn damped() -> (Diagnosis, Answer) {
    diagnosed(
        Some("hunt-crossley-damping:alpha_s_per_m=0.3"),
        &["hunt-crossley-damping", "guide-friction", "clipping", "robot-push"],
    )
}

#[test]
fn a_screenful_is_one_and_says_what_was_found() {
    for (diagnosis, answer) in [damped(), diagnosed(None, &["guide-friction"])] {
        let text = screenful(&diagnosis, &answer, "rig");
        assert!(text.lines().count() <= 40, "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
        for part in ["Where", "What", "Show"] {
            assert!(text.lines().any(|line| line.starts_with(part)), "{part}: {text}");
        }
        if let Some(named) = answer.mechanisms.first() {
            assert!(text.contains("hunt-crossley-damping: alpha_s_per_m = 0."), "{text}");
            assert!(named.because.contains("χ² falls by"), "{}", named.because);
        } else {
            assert!(text.contains("The simulation holds"), "{text}");
        }
    }
}

#[test]
fn every_mechanism_that_was_tried_is_accounted_for_once() {
    let (diagnosis, answer) = damped();
    let named = answer.mechanisms.iter().map(|named| named.id);
    let twins = answer.mechanisms.iter().flat_map(|named| named.indistinguishable_from.iter().copied());
    let mut all: Vec<String> = named.chain(twins).map(str::to_owned).collect();
    all.extend(answer.rejected.iter().map(|rejected| rejected.id.clone()));
    all.sort();
    let mut tried: Vec<String> = diagnosis.tried.iter().map(|mechanism| mechanism.id.to_owned()).collect();
    tried.sort();
    assert_eq!(all, tried);
    assert!(answer.rejected.iter().all(|rejected| rejected.because.len() > 10), "{:?}", answer.rejected);
}

#[test]
fn the_page_needs_nothing_else_and_has_no_colour() {
    let (diagnosis, answer) = damped();
    let page = page(&diagnosis, &answer, "a <b> rig");
    let inner = page.replace("http://www.w3.org/2000/svg", "");
    for outside in ["http://", "https://", "src=", "href=", "@import", "url(", "<script"] {
        assert!(!inner.contains(outside), "{outside}");
    }
    assert!(page.contains("a &lt;b&gt; rig"), "names are not markup");
    for (at, _) in page.match_indices("\"#") {
        let digits: String = page[at + 2..].chars().take_while(char::is_ascii_hexdigit).collect();
        if digits.len() == 6 {
            let level = |from: usize| i32::from_str_radix(&digits[from..from + 2], 16).unwrap();
            let spread = (level(0) - level(2)).abs().max((level(2) - level(4)).abs());
            assert!(spread <= 4, "#{digits}");
        }
    }
}

#[test]
fn the_page_shows_every_recording_and_every_mechanism() {
    let (diagnosis, answer) = damped();
    let page = page(&diagnosis, &answer, "rig");
    for recording in &diagnosis.problem.recordings {
        assert!(page.contains(&format!("<strong>{}</strong>", recording.name)), "{}", recording.name);
    }
    for mechanism in &diagnosis.tried {
        assert!(page.contains(&format!("<td>{}</td>", mechanism.id)), "{}", mechanism.id);
    }
    // One large, six small, the map, the spectrum, and two legends of seven swatches.
    assert_eq!(page.matches("<svg").count(), 1 + 6 + 1 + 1 + 2 * 7);
    assert!(!page.contains("could not be drawn"));
    let value = super::terminal::value(&answer.mechanisms[0].parameters[0]);
    let digits = value.split(' ').nth(2).unwrap();
    assert!(page.contains(digits), "{digits}");
}

/// Noise alone is drawn at 1, at every frequency.
#[test]
fn the_spectrum_of_a_right_model_is_that_of_the_noise() {
    let (diagnosis, _) = diagnosed(None, &["guide-friction"]);
    let (frequencies, power) =
        crate::diagnosis::spectrum::periodogram(&diagnosis.problem, &diagnosis.selection.best.fit.residuals);
    for (from_hz, to_hz) in [(50.0, 300.0), (300.0, 900.0)] {
        let band = frequencies.partition_point(|hz| *hz < from_hz)..frequencies.partition_point(|hz| *hz < to_hz);
        let mean = power[band.clone()].iter().sum::<f64>() / band.len() as f64;
        assert!((mean - 1.0).abs() < 0.2, "{from_hz} to {to_hz} Hz: {mean}");
    }
}

/// Where samples were lost is a number of each recording.
#[test]
fn the_page_says_what_each_impact_has_for_itself() {
    let (diagnosis, answer) = diagnosed(Some("lost-samples:lost_s=0.004,at_s=0.0123"), &["lost-samples"]);
    let page = page(&diagnosis, &answer, "rig");
    assert!(page.contains("each its own"));
    let (_, values) = page.split_once("<dt>at_s</dt><dd>").expect("the instants");
    let values: Vec<&str> = values.split_once(".</dd>").unwrap().0.split(", ").collect();
    assert_eq!(values.len(), diagnosis.problem.recordings.len(), "{values:?}");
    let fit = &diagnosis.selection.best.fit;
    for (number, (value, recording)) in values.iter().zip(&diagnosis.problem.recordings).enumerate() {
        let at_s = fit.layout.effect_at(&diagnosis.problem, 0, &fit.point, number).get("at_s").unwrap();
        assert_eq!(**value, format!("{} s in {}", crate::diagnosis::words::short(at_s), recording.name));
    }
}
