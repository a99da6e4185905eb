//! A fast part of the table of the whole system, with the promised bounds. All of it:
//! `cargo bench -p thud-sim --bench system`.

mod system_trial;

use embassy_time::Instant;
use system_trial::{Hit, Idling, Outcome, REGIONS, SPEEDS_M_PER_S, rms, worst};

const REPEATS: u32 = 16;
/// A root mean square of 16 errors scatters by 1/√32; three deviations of that are allowed beyond the promise.
const SCATTER: f64 = 1.0 + 3.0 * 0.177;

/// Slowest and fastest on softest and hardest springs, and one in the middle.
fn corners(pad: bool, piece: bool) -> impl Iterator<Item = (Hit, Vec<Outcome>)> {
    let all = [(0, 0), (3, 0), (1, 1), (0, 3), (3, 3)];
    all.into_iter().zip(1..).map(move |((speed, region), seed)| {
        let hit = Hit { speed_m_per_s: SPEEDS_M_PER_S[speed], region: REGIONS[region], pad, piece };
        (hit, hit.outcomes(REPEATS, seed))
    })
}

/// What is promised of any impact, with or without a moving piece; of the peak, `least_n` or 0.5 %.
fn assert_promised(hit: &Hit, outcomes: &[Outcome], least_n: f64) {
    for outcome in outcomes {
        let peak = outcome.true_peak_n;
        assert!(outcome.peak_n.abs() <= f64::max(0.005 * peak, least_n), "{hit:?}: {} N of {peak} N", outcome.peak_n);
        assert!(outcome.impulse.abs() <= 0.01, "{hit:?}: impulse {} %", outcome.impulse * 100.0);
        assert!(outcome.scaled.abs() <= 1e-6, "{hit:?}: S {}", outcome.scaled);
        assert!(outcome.alarm_s <= 1e-3, "{hit:?}: alarm {} s after six times the noise", outcome.alarm_s);
        assert_eq!((outcome.events, outcome.alarms), (1, 1), "{hit:?}");
    }
}

#[test]
fn what_the_host_decodes_is_what_the_rig_did() {
    for pad in [false, true] {
        for (hit, outcomes) in corners(pad, false) {
            assert_promised(&hit, &outcomes, 0.5);
            let contact_s = rms(outcomes.iter().map(|outcome| outcome.contact_s));
            let promised_s = f64::max(50e-6, 1.5 * hit.bound_s());
            assert!(contact_s <= promised_s * SCATTER, "{hit:?}: {contact_s:e} s rms, promised {promised_s:e} s");
            let duration_s = worst(outcomes.iter().map(|outcome| outcome.duration_s));
            assert!(duration_s < 0.5e-3, "{hit:?}: duration off by {duration_s} s");
        }
    }
}

/// The force of a piece with a mass begins at the cell with a horizontal tangent and rings; height, impulse and alarm
/// are promised all the same. Where it rings at 650 Hz (no pad) fewer samples make the peak, and 0.3 N of noise move a single
/// one by more than the promised 0.5 N, which the root mean square keeps.
#[test]
fn a_moving_piece_changes_neither_height_nor_impulse_nor_alarm() {
    for pad in [false, true] {
        for (hit, outcomes) in corners(pad, true) {
            assert_promised(&hit, &outcomes, 0.8);
            let peak_n = rms(outcomes.iter().map(|outcome| outcome.peak_n));
            assert!(peak_n <= f64::max(0.005 * outcomes[0].true_peak_n, 0.5), "{hit:?}: {peak_n} N rms");
        }
    }
}

/// With hum, drift, warming and a spike a second; ten hours of it: `cargo bench -p thud-sim --bench idle_hours`.
#[test]
fn twenty_idle_minutes_raise_no_alarm() {
    let mut idling = Idling::new(1);
    idling.run_until(Instant::from_secs(20 * 60));
    assert_eq!(idling.alarms_s(), [0.0; 0]);
}
