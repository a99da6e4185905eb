//! The demonstration keeps what the sensor promises.

use super::*;

/// A riddle in a folder of its own.
fn posed(seed: u64) -> Riddle {
    let folder = tempfile::tempdir().unwrap();
    riddle(seed, folder.path(), &mut |_| {}).unwrap()
}
use crate::report::page;

#[test]
fn what_is_sensed_is_what_was_true_and_the_page_says_so() {
    let demonstrated = demonstrate(Scenario::from_seed(0).unwrap(), |_| {}).unwrap();
    let riddle = posed(0);
    let outcome = Outcome::new(&demonstrated, &riddle);
    assert_eq!(outcome.blows.len(), 3);
    assert_eq!(outcome.frames_lost, 0);
    for blow in &outcome.blows {
        assert!(blow.error.contact_s.abs() < 150e-6, "{blow:?}");
        assert!(blow.error.raw_peak_N.abs() < (0.005 * blow.truth.raw_peak_N).max(0.5), "{blow:?}");
        assert!(blow.error.peak_N.abs() < (0.005 * blow.truth.peak_N).max(0.5), "{blow:?}");
        assert!(blow.error.impulse_Ns.abs() < 0.01 * blow.truth.impulse_Ns, "{blow:?}");
        assert!(blow.alarm_after_s.is_some_and(|after| after < 0.02), "{blow:?}");
    }
    assert_eq!(outcome.blows[0].verdict, "pass");
    assert_eq!(outcome.blows[2].verdict, "fail");
    assert!(demonstrated.blows.iter().all(|blow| blow.curve.is_some()));
    let page = page(&report(&demonstrated, &riddle, "diagnosis.html"));
    for says in [
        "Sensed beside true",
        "Pass.",
        "Fail.",
        "<svg",
        "ISO/TS 15066:2016",
        "Hidden was hunt-crossley-damping: it was found.",
    ] {
        assert!(page.contains(says), "{says}");
    }
}

#[test]
fn the_same_seed_gives_the_same_results() {
    let json = |seed| {
        let demonstrated = demonstrate(Scenario::from_seed(seed).unwrap(), |_| {}).unwrap();
        serde_json::to_string(&Outcome::new(&demonstrated, &posed(seed))).unwrap()
    };
    assert_eq!(json(3), json(3));
}

#[test]
fn no_seed_asks_for_a_permission_that_there_is_not() {
    for seed in 0..200 {
        let scenario = Scenario::from_seed(seed).unwrap();
        assert!(!["skull", "face"].contains(&scenario.region.name()));
        assert!(scenario.speeds_m_per_s.windows(2).all(|pair| pair[1] > pair[0]), "{scenario:?}");
        assert!(scenario.speeds_m_per_s.iter().all(|speed| (0.05..5.0).contains(speed)), "{scenario:?}");
    }
}
