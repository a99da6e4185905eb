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
//! piece the stroke of the springs. Which of them it is, the recordings say: by the slope before contact, then by the height of
//! the peak over what mass, speed and springs let expect. Without a pad, depth and stroke are the same.
//!
//! An acceleration is that of the moving body: the rig slows it down. Where the pulse points the other way, the axis of the
//! accelerometer does.

use std::f64::consts::PI;

use thud_sim::rig::Quantity;

use super::problem::{contact_time_s, median};
use crate::campaign::{Loaded, Observed, RigKind};

/// Of the stated speed: what moves faster than this before contact, comes.
const COMES: f64 = 0.5;

/// What of the motion a column shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Convention {
    pub(super) quantity: Quantity,
    /// 1, or −1 where the column counts the other way round.
    pub(super) sign: f64,
}

/// Reads it from the column's name and, where that leaves it open, from the recordings.
pub(super) fn convention(loaded: &Loaded, column: &str) -> Convention {
    let kind = loaded.campaign.rig.kind;
    match Observed::ALL.into_iter().find(|observed| observed.column() == column) {
        Some(Observed::Displacement) if kind == RigKind::Fall => {
            Convention { quantity: Quantity::Position, sign: bent_downwards(loaded) }
        }
        Some(Observed::Displacement) => Convention { quantity: displacement(loaded), sign: 1.0 },
        // A height counts upwards, the motion downwards.
        Some(Observed::Height) => Convention { quantity: Quantity::Position, sign: -1.0 },
        Some(Observed::Acceleration) => {
            let sign = if kind == RigKind::Fall { fall_direction(loaded) } else { -direction(loaded) };
            Convention { quantity: Quantity::Acceleration, sign }
        }
        Some(Observed::Force) | None => Convention { quantity: Quantity::CellForce, sign: 1.0 },
    }
}

fn displacement(loaded: &Loaded) -> Quantity {
    let campaign = &loaded.campaign;
    let mut slopes = Vec::new();
    let mut heights = Vec::new();
    for (entry, recording) in campaign.recordings.iter().zip(&loaded.recordings) {
        let Some(values) = recording.channel(Observed::Displacement.column()) else { continue };
        let times_s = recording.times_s();
        let speed = entry.impact_speed_m_per_s.value;
        let Some(farthest) = (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b])) else { continue };
        // From the beginning to half a contact before contact.
        let contact_time_s = contact_time_s(&campaign.rig, entry.effective_mass_kg.value);
        let end = times_s.partition_point(|time| *time < times_s[farthest] - contact_time_s);
        if let Some(slope) = slope(&times_s[..end], &values[..end]) {
            slopes.push(slope / speed);
        }
        let rest = median(values[..end.max(1)].to_vec()).unwrap_or(0.0);
        heights.push((values[farthest] - rest) / (speed * contact_time_s / PI));
    }
    if median(slopes).is_some_and(|slope| slope > COMES) {
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
