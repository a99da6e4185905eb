use super::*;
use crate::effect;

fn request(way: Way, ids: &[(&str, f64)], kind: Kind, recordings: usize, seed: u64) -> Request {
    let effects = ids.iter().map(|(id, d)| (effect::named(id).expect("an effect"), *d)).collect();
    Request { way, effects, without: Vec::new(), wish: Wish { kind, recordings, long: false }, seed }
}

#[test]
fn nothing_hidden_is_nothing_to_see() {
    for (kind, seed) in [(Kind::Impact, 1), (Kind::Impact, 2), (Kind::Drop, 3), (Kind::Fall, 4)] {
        let case = make(&request(Way::Absent, &[], kind, 12, seed));
        assert!(case.retuned.d < 2.0, "{kind:?}: {}", case.retuned.d);
        assert!(case.hidden.is_empty());
    }
}

#[test]
fn a_case_has_the_strength_that_was_asked_for() {
    for (id, kind, target) in [
        ("guide-friction", Kind::Impact, 12.0),
        ("joint-elasticity", Kind::Impact, 40.0),
        ("viscous-damping", Kind::Drop, 20.0),
        ("air-drag", Kind::Fall, 30.0),
        ("gain-error", Kind::Impact, 8.0),
    ] {
        let case = make(&request(Way::Unnamed, &[(id, target)], kind, 6, 11));
        assert!((case.retuned.d / target - 1.0).abs() < 0.05, "{id}: {} instead of {target}", case.retuned.d);
    }
}

#[test]
fn strength_predicts_what_noise_leaves_of_a_fit() {
    // The misfit of the noisy recordings is chi-square: as many as samples where nothing is hidden, d² more where
    // something is. The scatter of the former is √(2·n).
    let excess = |case: &Case| {
        let mut draw = Draw::new(5);
        let mut noisy = case.traces.clone();
        let mut count = 0.0;
        for trace in &mut noisy {
            let noise = case.plan.colour.sample(&mut draw, trace.readings.len());
            for (reading, noise) in trace.readings.iter_mut().zip(noise) {
                *reading += noise;
                count += 1.0;
            }
        }
        let d = retune(&case.plan, &noisy, false).d;
        (d * d - count, (2.0f64 * count).sqrt())
    };
    let (nothing, scatter) = excess(&make(&request(Way::Absent, &[], Kind::Impact, 6, 21)));
    assert!(nothing.abs() < 4.0 * scatter, "{nothing} of ±{scatter}");
    let (something, scatter) =
        excess(&make(&request(Way::Unnamed, &[("joint-elasticity", 60.0)], Kind::Impact, 6, 22)));
    assert!((something - 3600.0).abs() < 4.0 * scatter + 400.0, "{something} of 3600 ± {scatter}");
}

#[test]
fn what_is_absorbed_agrees_with_what_is_stated() {
    let case = make(&request(Way::Absorbed, &[("hunt-crossley-damping", 20.0)], Kind::Impact, 6, 31));
    assert!(case.stated.r_squared > 0.98, "{:?}", case.stated);
    assert!(case.stated.peak_error_over_noise < 2.0, "{:?}", case.stated);
    assert!((case.retuned.d / 20.0 - 1.0).abs() < 0.05, "{}", case.retuned.d);
}

#[test]
fn what_is_confined_leaves_the_other_recordings_alone() {
    for id in ["end-stop", "collision-reaction", "mains-hum"] {
        let case = make(&request(Way::Conditional, &[(id, 20.0)], Kind::Impact, 12, 41));
        let touched = &case.hidden[0].touched;
        assert!(touched.iter().filter(|t| **t).count() <= 6, "{id}: {touched:?}");
        for (index, touched) in touched.iter().enumerate() {
            let same = case.traces[index].readings == case.clean[index].readings;
            assert!(*touched || same, "{id}: recording {index} changed");
        }
        assert!(case.traces.iter().zip(&case.clean).any(|(a, b)| a.readings != b.readings));
    }
}

#[test]
fn two_effects_have_their_strength_beside_each_other() {
    // A stop behind a pad that hardens comes earlier than alone.
    let case = make(&request(Way::Unnamed, &[("hardening", 30.0), ("end-stop", 40.0)], Kind::Impact, 6, 51));
    assert!((case.hidden[0].d / 30.0 - 1.0).abs() < 0.06, "{}", case.hidden[0].d);
    assert!((case.hidden[1].d / 40.0 - 1.0).abs() < 0.06, "{}", case.hidden[1].d);
    assert!(case.hidden.iter().all(|h| h.d_beside_others <= h.d));
}

#[test]
fn the_same_seed_makes_the_same_case() {
    let request = request(Way::Unnamed, &[("lost-samples", 15.0)], Kind::Impact, 4, 61);
    let (a, b) = (make(&request), make(&request));
    assert_eq!(a.traces[0].readings, b.traces[0].readings);
    assert_eq!(a.plan.recordings[1].stated_speed.value, b.plan.recordings[1].stated_speed.value);
}

/// Long recordings of a fast chain, and masses that fall: what once was drawn in vain until the draw gave up.
#[test]
fn a_noisier_amplifier_covers_what_no_plan_keeps_out_of_sight() {
    for (kind, long, seed) in [(Kind::Drop, false, 14_129_905_852_317_410_895), (Kind::Impact, true, 3)] {
        let wish = Wish { kind, recordings: 12, long };
        let (plan, benign_d) = quiet(&mut Draw::new(seed), &wish);
        assert!(benign_d < BENIGN_D, "{benign_d}");
        assert!((0.1..5.0).contains(&plan.noise_rms), "{}", plan.noise_rms);
    }
}

#[test]
fn a_case_that_goes_on_keeps_what_it_had() {
    let mut case = make(&request(Way::Unnamed, &[("mullins-softening", 30.0)], Kind::Impact, 6, 51));
    let (before, _) = crate::files::render(&case, "campaign");
    let further = Further { speed_m_per_s: 0.31, configuration: 1, after_s: 0.2 };
    go_on(&mut case, &[further; 2]);
    let folder = std::env::temp_dir().join(format!("thud-conceal-{}", std::process::id()));
    crate::files::write_campaign(&case, &folder, "campaign").expect("a folder to write to");
    for (path, text) in before.into_iter().skip(1) {
        assert_eq!(std::fs::read_to_string(folder.join(&path)).expect("it is there"), text, "{path}");
    }
    let latest = std::fs::read_to_string(folder.join("recordings/008.csv")).expect("two more");
    let highest = |text: &str| -> f64 {
        let forces = text.lines().skip(1).filter_map(|line| line.split_once(',')?.1.parse::<f64>().ok());
        forces.fold(0.0, f64::max)
    };
    let expected = case.plan.true_baseline(7).peak_n();
    assert!((highest(&latest) / expected - 1.0).abs() < 0.2, "{} of about {expected} N", highest(&latest));
    assert!((case.plan.recordings[7].speed_m_per_s - 0.31).abs() < 0.02);
    std::fs::remove_dir_all(&folder).expect("it was there");
}
