//! A guide that rubs leaves some newtons on the cell; the blows that follow are sensed all the same.

mod system_trial;

use system_trial::Rubbing;
use thud_firmware::event::{Flags, Verdict};

#[test]
fn every_blow_on_a_rubbing_guide_is_an_event_of_its_own() {
    let rubbing = Rubbing { sliding_n: 4.0, piece_kg: 0.0, speed_m_per_s: 0.25, every_s: 0.9 };
    let (struck, alarms) = rubbing.blows(20, 120.0, 1);
    assert_eq!((struck.len(), alarms), (20, 20));
    for (number, blow) in struck.iter().enumerate() {
        let event = &blow.event;
        assert_eq!((event.impact as usize, event.contact, event.flags), (number + 1, 0, Flags::REST), "blow {number}");
        assert_eq!(event.severity.verdict, Verdict::Pass);
        assert!(blow.contact_s.abs() < 100e-6, "blow {number}: contact off by {} s", blow.contact_s);
        assert!(blow.separation_s.abs() < 500e-6, "blow {number}: separation off by {} s", blow.separation_s);
        assert!(blow.peak_n.abs() < 0.5, "blow {number}: peak off by {} N", blow.peak_n);
        assert!(blow.impulse.abs() < 0.01, "blow {number}: impulse off by {}", blow.impulse);
    }
}

/// Slow blows are hardly more than what friction takes of them, fast ones come before the transient window is over.
#[test]
fn weak_blows_and_quick_ones_are_sensed_too() {
    for (sliding_n, speed_m_per_s, every_s) in [(4.0, 0.05, 1.0), (9.0, 0.5, 0.65), (2.0, 0.1, 3.0)] {
        let (struck, alarms) = Rubbing { sliding_n, piece_kg: 0.0, speed_m_per_s, every_s }.blows(5, 0.0, 2);
        assert_eq!((struck.len(), alarms), (5, 5), "{sliding_n} N at {speed_m_per_s} m/s every {every_s} s");
        for blow in &struck {
            assert_eq!((blow.event.flags, blow.event.severity.verdict), (Flags::REST, Verdict::Pass));
            assert!(blow.peak_n.abs() < 0.5, "{blow:?}");
            assert!(blow.impulse.abs() < 0.01, "{blow:?}");
        }
    }
}

/// A piece with a mass swings before friction holds it, on one side of its place of rest or on the other.
#[test]
fn what_swings_until_friction_holds_it_is_no_blow() {
    let mut pulls = 0;
    for (sliding_n, piece_kg, speed_m_per_s) in [(4.0, 0.12, 0.25), (4.0, 0.12, 0.5), (8.0, 0.3, 0.25), (8.0, 0.3, 0.5)]
    {
        let rubbing = Rubbing { sliding_n, piece_kg, speed_m_per_s, every_s: 1.0 };
        pulls += u32::from(rubbing.rest_n() < -1.0);
        let (struck, alarms) = rubbing.blows(1, 60.0, 3);
        assert_eq!((struck.len(), alarms), (1, 1), "{rubbing:?}: {struck:?}");
        assert_eq!((struck[0].event.flags, struck[0].event.severity.verdict), (Flags::REST, Verdict::Pass));
        assert!(struck[0].peak_n.abs() < 0.5, "{struck:?}");
        assert!(struck[0].impulse.abs() < 0.01, "{struck:?}");
    }
    assert!(pulls > 0, "there is a rest that pulls among them");
}
