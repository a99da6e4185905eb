//! The contact instant behind a moving piece. The whole table: `cargo bench -p thud-sim --bench contact_instant`.

mod struck;

use struck::{Case, bare, grid, lossy, promised_s, rms};

const TRIALS: u64 = 8;
/// A root mean square of 8 errors scatters by 1/√16; two deviations of that are allowed beyond the promise.
const SCATTER: f64 = 1.5;

fn off_s(case: &Case) -> f64 {
    rms(&case.errors_s(100..100 + TRIALS))
}

fn keeps_what_is_promised(cases: impl IntoIterator<Item = Case>) {
    for case in cases {
        let (off_s, bound_s) = (off_s(&case), case.bound_s());
        assert!(off_s < SCATTER * promised_s(bound_s), "{case:?}: {off_s:e} s rms, bound {bound_s:e} s");
    }
}

/// Medium and soft pads, behind which the piece stays with the robot.
#[test]
fn a_ringing_piece_does_not_hide_the_instant() {
    keeps_what_is_promised(grid().into_iter().filter(|case| case.pad_n_per_m < 100e3));
}

/// Behind a hard pad the piece flies off after half a period and rattles.
#[test]
fn a_rattling_piece_does_not_hide_the_instant() {
    keeps_what_is_promised(grid().into_iter().filter(|case| case.pad_n_per_m > 100e3));
}

/// Without a pad it is kicked to twice the robot's speed.
#[test]
fn a_kicked_piece_does_not_hide_the_instant() {
    keeps_what_is_promised(bare());
}

/// A pad that loses energy as it is compressed bends the arc, which the ring must not be blamed for.
#[test]
fn a_lossy_pad_misleads_by_less_than_the_lag() {
    for case in lossy().iter().filter(|case| case.further == ["hunt-crossley-damping"]) {
        let (off_s, lag_s) = (off_s(case), 1.0 / (std::f64::consts::TAU * case.ring_hertz()));
        assert!(off_s < 0.2 * lag_s, "{case:?}: {off_s:e} s rms, lag {lag_s:e} s");
    }
}
