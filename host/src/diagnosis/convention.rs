//! What a column shows of the motion, where its name leaves it open.
//!
//! ```text
//!  displacement_m      before contact            while touching         after
//!    position          comes at the speed   ╱    pad and springs ╲      goes away
//!    depth             rest             ────     pad and springs        rest
//!    stroke            rest             ────     springs alone          rest
//! ```
//!
//! A robot's own encoder shows its position, a gauge on the rig's plate how deep pad and springs are pressed, a scale at the moving
//! piece the stroke of the springs. Which of them it is, the recordings say: by the slope just before contact, or just after it where
//! they begin there, then by the height of the peak over what mass, speed and springs let expect. Without a pad, depth and stroke are
//! the same.
//!
//! What is stated of a fall is the speed it is let go with, or the one at its end: the nearer of both to what its way has there.
//!
//! An acceleration is that of the moving body: the rig slows it down. Where the pulse points the other way, the axis of the
//! accelerometer does.

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use thud_sim::rig::Quantity;

use super::problem::{contact_time_s, let_go, median};
use crate::campaign::{Estimate, Loaded, Observed, RigKind};

/// Of the stated speed: what moves faster than this beside contact, comes or goes.
const MOVES: f64 = 0.5;
/// Of the stated speed: what falls and is slower than this so far from contact is not asked.
const SLOWEST: f64 = 0.1;
/// And so sure, in deviations, is that a dropped mass does not fall.
const SURELY: f64 = 6.0;
/// In the last part of the time that a fall from rest takes to the stated speed it is seen to fall, however well that is known.
const SURELY_FALLS: f64 = 0.8;
/// A contact begins half of its duration before its peak and ends as long after it; masses, springs and losses move that by less than another
/// tenth, of which a gauge at rest would still show no half of the speed.
const BESIDE_PEAK: f64 = 0.6;
/// A speed at the end of a fall is stated where it is this part of what is gained on the way at most, beyond what it began with.
const AT_END: f64 = 1.5;
/// A way's scale may be so wrong, as gains are.
const MISREAD: f64 = 0.03;
/// The part of a contact's duration, and the fewest samples, over which it is seen to move.
const SHORTLY: f64 = 0.25;
const FEWEST: usize = 16;

/// What of the motion a column shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Convention {
    pub(super) quantity: Quantity,
    /// 1, or −1 where the column counts the other way round.
    pub(super) sign: f64,
    /// Before contact, m/s²: gravity where the position of a dropped mass comes at a constant speed all the same, as a driven carriage does; else 0.
    pub(super) lift_m_per_s2: f64,
}

/// Reads it from the column's name and, where that leaves it open, from the recordings.
pub(super) fn convention(loaded: &Loaded, column: &str) -> Convention {
    let kind = loaded.campaign.rig.kind;
    let known = |quantity: Quantity, sign: f64| Convention { quantity, sign, lift_m_per_s2: 0.0 };
    match Observed::ALL.into_iter().find(|observed| observed.column() == column) {
        Some(Observed::Displacement) if kind == RigKind::Fall => known(Quantity::Position, bent_downwards(loaded)),
        Some(Observed::Displacement) => {
            let quantity = displacement(loaded);
            let is_lifted = kind == RigKind::Drop && quantity == Quantity::Position && comes_steadily(loaded);
            let lift_m_per_s2 = if is_lifted { loaded.campaign.rig.gravity_along_impact_m_per_s2 } else { 0.0 };
            Convention { lift_m_per_s2, ..known(quantity, 1.0) }
        }
        // A height counts upwards, the motion downwards.
        Some(Observed::Height) => known(Quantity::Position, -1.0),
        Some(Observed::Acceleration) => {
            let sign = if kind == RigKind::Fall { fall_direction(loaded) } else { -direction(loaded) };
            known(Quantity::Acceleration, sign)
        }
        Some(Observed::Force) | None => known(Quantity::CellForce, 1.0),
    }
}

fn displacement(loaded: &Loaded) -> Quantity {
    let campaign = &loaded.campaign;
    let gravity = if campaign.rig.kind == RigKind::Drop { campaign.rig.gravity_along_impact_m_per_s2 } else { 0.0 };
    let (mut comes, mut goes, mut heights) = (Vec::new(), Vec::new(), Vec::new());
    for (entry, recording) in campaign.recordings.iter().zip(&loaded.recordings) {
        let Some(values) = recording.channel(Observed::Displacement.column()) else { continue };
        let times_s = recording.times_s();
        let speed = entry.impact_speed_m_per_s.value;
        let Some(farthest) = highest(values) else { continue };
        let contact_time_s = contact_time_s(&campaign.rig, entry.effective_mass_kg.value);
        let until = |time_s: f64| times_s.partition_point(|time| *time < time_s);
        let met = until(times_s[farthest] - BESIDE_PEAK * contact_time_s);
        let left = until(times_s[farthest] + BESIDE_PEAK * contact_time_s);
        // What is pushed on may be at its farthest long after it has met the rig.
        let begun = until(times_s[0] + SHORTLY * contact_time_s).max(FEWEST).min(met);
        let gone =
            until(times_s[farthest] + (BESIDE_PEAK + SHORTLY) * contact_time_s).max(left + FEWEST).min(values.len());
        let moves = |between: Range<usize>| Some(slope(&times_s[between.clone()], &values[between])? / speed);
        // What falls is slower before; so far from contact that it hardly has begun to fall, it tells nothing.
        let later_s = times_s[met] - 0.5 * (times_s[0] + times_s[begun]);
        let part = 1.0 - gravity * later_s / speed;
        comes.extend(moves(0..begun).filter(|_| part > SLOWEST).map(|moves| moves / part));
        goes.extend(moves(left..gone).map(|moves| -moves));
        let rest = median(values[..met.max(1)].to_vec()).unwrap_or(0.0);
        heights.push((values[farthest] - rest) / (speed * contact_time_s / PI));
    }
    // Recordings that begin at contact show it only as it goes.
    if median(comes).or_else(|| median(goes)).is_some_and(|slope| slope > MOVES) {
        return Quantity::Position;
    }
    let rig = crate::model::simulated(&campaign.rig);
    let stroke_of_depth = rig.effective_stiffness_n_per_m() / rig.body_stiffness_n_per_m;
    match median(heights) {
        // Nearer to 1 than to the springs' part, on a scale of ratios.
        Some(height) if stroke_of_depth < 1.0 && height > stroke_of_depth.sqrt() => Quantity::Depth,
        _ => Quantity::Stroke,
    }
}

/// Whether the position of a dropped mass comes at a constant speed, surely and nearer to that than to falling.
fn comes_steadily(loaded: &Loaded) -> bool {
    let campaign = &loaded.campaign;
    let mut squares = 0.0;
    let mut weighted = 0.0;
    for (entry, recording) in campaign.recordings.iter().zip(&loaded.recordings) {
        let Some(values) = recording.channel(Observed::Displacement.column()) else { continue };
        let times_s = recording.times_s();
        let Some(farthest) = highest(values) else { continue };
        let beside_s = BESIDE_PEAK * contact_time_s(&campaign.rig, entry.effective_mass_kg.value);
        let until = |time_s: f64| times_s.partition_point(|time| *time < time_s);
        let met_s = times_s[farthest] - beside_s;
        // What falls from rest hangs before.
        let falls_s = SURELY_FALLS * entry.impact_speed_m_per_s.value / campaign.rig.gravity_along_impact_m_per_s2;
        let falling = until(met_s - falls_s)..until(met_s);
        let Some((bend, deviation)) = bend(&times_s[falling.clone()], &values[falling]) else { continue };
        squares += deviation.powi(-2);
        weighted += bend * deviation.powi(-2);
    }
    let (mean, deviation) = (weighted / squares, squares.sqrt().recip());
    let gravity = campaign.rig.gravity_along_impact_m_per_s2;
    squares > 0.0 && mean < 0.5 * gravity && gravity - mean > SURELY * deviation
}

/// The acceleration of a way, m/s², and its standard deviation if what is left scatters by itself; `None` of too few samples.
fn bend(times_s: &[f64], values: &[f64]) -> Option<(f64, f64)> {
    let (powers, inverse, way) = course(times_s, values, 3)?;
    let variance = (DVector::from_column_slice(values) - powers * &way).norm_squared() / (times_s.len() - 3) as f64;
    Some((2.0 * way[2], 2.0 * (variance * inverse[(2, 2)]).sqrt().max(f64::MIN_POSITIVE)))
}

/// A way as a polynomial of the time since its first instant: the powers at its instants, the inverse of their products and the coefficients; `None` of too
/// few samples.
fn course(times_s: &[f64], values: &[f64], coefficients: usize) -> Option<(DMatrix<f64>, DMatrix<f64>, DVector<f64>)> {
    if times_s.len() < FEWEST {
        return None;
    }
    let power = |row: usize, power: usize| (times_s[row] - times_s[0]).powi(power as i32);
    let powers = DMatrix::from_fn(times_s.len(), coefficients, power);
    let inverse = powers.tr_mul(&powers).try_inverse()?;
    let way = &inverse * powers.tr_mul(&DVector::from_column_slice(values));
    Some((powers, inverse, way))
}

/// With what speed each recording's body was let go, where the stated speeds are those at the end of the fall; `None` where they are not, or no way is seen.
pub(super) fn released(loaded: &Loaded, column: &str, convention: Convention) -> Option<Vec<Estimate>> {
    if loaded.campaign.rig.kind != RigKind::Fall || convention.quantity != Quantity::Position {
        return None;
    }
    let ways = loaded.campaign.recordings.iter().zip(&loaded.recordings).map(|(entry, recording)| {
        let (begins, ends) = speeds(recording.times_s(), recording.channel(column)?)?;
        Some((entry.impact_speed_m_per_s, convention.sign * begins, convention.sign * ends))
    });
    let ways: Vec<(Estimate, f64, f64)> = ways.collect::<Option<_>>()?;
    let part = |(stated, begins, ends): &(Estimate, f64, f64)| (stated.value - begins) / (ends - begins);
    let is_at_end = median(ways.iter().map(part).collect()).is_some_and(|part| (0.5..AT_END).contains(&part));
    let of_release = |(stated, begins, ends): (Estimate, f64, f64)| {
        let (value, sd) = (stated.value - (ends - begins), stated.sd.hypot(MISREAD * (ends - begins)));
        // From rest.
        Estimate { value: if value.abs() < sd { 0.0 } else { value }, sd }
    };
    is_at_end.then(|| ways.into_iter().map(of_release).collect())
}

/// The velocities of a way where it is let go and at its end, by a cubic; `None` of too few samples.
fn speeds(times_s: &[f64], values: &[f64]) -> Option<(f64, f64)> {
    let release = let_go(times_s, values, false);
    let (times_s, values) = (&times_s[release..], &values[release..]);
    let (.., way) = course(times_s, values, 4)?;
    let lasts_s = times_s[times_s.len() - 1] - times_s[0];
    Some((way[1], way[1] + (2.0 * way[2] + 3.0 * way[3] * lasts_s) * lasts_s))
}

/// 1 or −1: whereto the pulses of the observed channel point.
fn direction(loaded: &Loaded) -> f64 {
    let column = loaded.campaign.chain.observed.column();
    let signs = loaded
        .recordings
        .iter()
        .filter_map(|recording| recording.channel(column))
        .filter_map(|values| {
            let rest = median(values[..a_twentieth(values)].to_vec())?;
            values.iter().map(|value| value - rest).max_by(|a, b| a.abs().total_cmp(&b.abs()))
        })
        .map(f64::signum);
    of_most(signs)
}

/// 1 or −1: whether an acceleration counts downwards. Where the release is recorded it steps by gravity, whether the body is at rest before and
/// gravity's after, as it moves, or gravity's before and at rest after, as an accelerometer in it feels. Recorded in flight alone a
/// body shows gravity; an accelerometer in it shows nothing, and then what the air takes, which the offset of the channel and
/// this sign make an acceleration of.
fn fall_direction(loaded: &Loaded) -> f64 {
    let gravity = loaded.campaign.rig.gravity_along_impact_m_per_s2;
    let signs = loaded
        .recordings
        .iter()
        .filter_map(|recording| recording.channel(Observed::Acceleration.column()))
        .filter_map(|values| {
            let end = a_twentieth(values);
            let middles = values.chunks(end).map(|chunk| median(chunk.to_vec()));
            let middles: Vec<f64> = middles.collect::<Option<_>>()?;
            let (first, last) = (middles.first()?, middles.last()?);
            // The step may lie within a chunk.
            let released = middles.windows(3).map(|three| three[2] - three[0]).find(|step| step.abs() > gravity / 2.0);
            let in_flight = if first.abs() > gravity / 2.0 { *first } else { first - last };
            Some(released.unwrap_or(in_flight).signum())
        });
    of_most(signs)
}

/// 1 or −1: whether a displacement of what falls counts downwards: gravity bends its course, whatever it began with.
fn bent_downwards(loaded: &Loaded) -> f64 {
    let bends = loaded.recordings.iter().filter_map(|recording| {
        let values = recording.channel(Observed::Displacement.column())?;
        let times_s = recording.times_s();
        let half_s = 0.5 * (times_s.first()? + times_s.last()?);
        let half = times_s.partition_point(|time| *time < half_s);
        Some((slope(&times_s[half..], &values[half..])? - slope(&times_s[..half], &values[..half])?).signum())
    });
    of_most(bends)
}

/// The sign of most; 1 where there are as many of either.
fn of_most(signs: impl Iterator<Item = f64>) -> f64 {
    if signs.sum::<f64>() < 0.0 { -1.0 } else { 1.0 }
}

/// How many values are a twentieth of all; one at least, where there is one.
fn a_twentieth(values: &[f64]) -> usize {
    (values.len() / 20).max(1).min(values.len())
}

/// The place of the highest value; `None` of none.
fn highest(values: &[f64]) -> Option<usize> {
    (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b]))
}

/// Slope of the straight line; `None` of fewer than eight samples.
fn slope(times_s: &[f64], values: &[f64]) -> Option<f64> {
    if times_s.len() < 8 {
        return None;
    }
    let count = times_s.len() as f64;
    let (time, value) = (times_s.iter().sum::<f64>() / count, values.iter().sum::<f64>() / count);
    let along: f64 = times_s.iter().zip(values).map(|(t, v)| (t - time) * (v - value)).sum();
    let square: f64 = times_s.iter().map(|t| (t - time).powi(2)).sum();
    Some(along / square)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::Campaign;
    use crate::diagnosis::problem::Problem;
    use crate::recording::{Channel, Recording};

    /// 6 kg at 0.5 m/s on 10 kN/m, with and without a pad of 40 kN/m in series; a displacement at 5 kHz from so long before contact on, s.
    fn loaded(pad: bool, before_s: f64, displacement_m: impl Fn(f64) -> f64) -> Loaded {
        let pad = if pad { "pad_stiffness_N_per_m = { value = 4e4, sd = 4e3 }\n" } else { "" };
        let text = format!(
            "format = \"thud-campaign/1\"\nname = \"read\"\n[rig]\nkind = \"impact\"\n\
             body_stiffness_N_per_m = {{ value = 1e4, sd = 3e2 }}\n{pad}\
             [chain]\nsample_rate_Hz = 5e3\nnoise_rms_N = 1e-5\nfull_scale_N = 0.1\nobserved = \"displacement_m\"\n\
             [[recording]]\nfile = \"1.csv\"\nimpact_speed_m_per_s = {{ value = 0.5, sd = 0.01 }}\n\
             effective_mass_kg = {{ value = 6.0, sd = 0.2 }}\n"
        );
        let campaign = Campaign::parse("campaign.toml", &text).expect("a campaign");
        let times_s: Vec<f64> = (0..600).map(|sample| f64::from(sample) * 2e-4).collect();
        let values = times_s.iter().map(|time| displacement_m(time - before_s)).collect();
        let channel = Channel { name: "displacement_m".to_owned(), values };
        let recordings = vec![Recording::new(times_s, vec![channel]).expect("a recording")];
        Loaded { folder: "read".into(), campaign, recordings, warnings: Vec::new() }
    }

    /// A half sine of the stroke; before and after it the speed times what is given.
    fn pulse(stiffness_n_per_m: f64, moves: f64) -> impl Fn(f64) -> f64 {
        let (pulsation, speed) = ((stiffness_n_per_m / 6.0).sqrt(), 0.5);
        let end_s = PI / pulsation;
        move |time_s| match time_s {
            time_s if time_s < 0.0 => moves * speed * time_s,
            time_s if time_s > end_s => -moves * speed * (time_s - end_s),
            time_s => speed / pulsation * (pulsation * time_s).sin(),
        }
    }

    #[test]
    fn what_comes_or_goes_is_a_position_however_short_the_quiet_is() {
        for before_s in [0.05, 0.02, 0.01, 0.0] {
            assert_eq!(displacement(&loaded(false, before_s, pulse(1e4, 1.0))), Quantity::Position, "{before_s} s");
            assert_eq!(displacement(&loaded(true, before_s, pulse(8e3, 1.0))), Quantity::Position, "{before_s} s");
        }
    }

    #[test]
    fn a_gauge_that_is_at_rest_shows_a_depth_or_a_stroke() {
        for before_s in [0.05, 0.02, 0.01, 0.0] {
            assert_eq!(displacement(&loaded(true, before_s, pulse(8e3, 0.0))), Quantity::Depth, "{before_s} s");
            let springs = pulse(8e3, 0.0);
            let alone = displacement(&loaded(true, before_s, |time_s| 0.8 * springs(time_s)));
            assert_eq!(alone, Quantity::Stroke, "{before_s} s");
        }
    }

    /// It is at zero when it meets the rig, and nobody has seen when that was.
    #[test]
    fn the_way_of_what_comes_shows_no_zero() {
        for (moves, is_seen) in [(1.0, false), (0.0, true)] {
            let loaded = loaded(false, 0.03, pulse(1e4, moves));
            let problem = Problem::new(&loaded, &mut Vec::new()).expect("a problem");
            assert_eq!(problem.zero_deviation(0, 0).is_some(), is_seen, "{moves}");
        }
    }

    /// Let go at 0.4 m/s and met at 3.3 m/s by the ground, or from rest: whichever of both is stated.
    #[test]
    fn the_stated_speed_of_a_fall_is_the_nearer_of_its_ends() {
        let fall = |stated: f64, begins: f64, sign: f64| {
            let mut loaded = loaded(false, 0.0, |time_s| sign * (begins * time_s + 0.5 * 9.81 * time_s * time_s));
            loaded.campaign.rig.kind = RigKind::Fall;
            loaded.campaign.recordings[0].impact_speed_m_per_s.value = stated;
            let convention = Convention { quantity: Quantity::Position, sign, lift_m_per_s2: 0.0 };
            released(&loaded, "displacement_m", convention).map(|released| released[0].value)
        };
        let gained = 9.81 * 599.0 * 2e-4;
        for sign in [1.0, -1.0] {
            assert_eq!(fall(0.41, 0.4, sign), None);
            assert_eq!(fall(0.0, 0.0, sign), None);
            let at_end = fall(0.41 + gained, 0.4, sign).expect("at the end");
            assert!((at_end - 0.41).abs() < 0.02, "{at_end}");
            assert_eq!(fall(0.01 + gained, 0.0, sign), Some(0.0));
        }
    }

    /// Where it leans on the rig it is at its farthest as long as it is recorded.
    #[test]
    fn what_does_not_go_again_has_come() {
        let pulse = pulse(1e4, 1.0);
        let leans = |time_s: f64| if time_s > 0.02 { pulse(0.02) + 1e-3 * (time_s - 0.02) } else { pulse(time_s) };
        assert_eq!(displacement(&loaded(false, 0.03, leans)), Quantity::Position);
    }
}
