//! How deep the contact is pressed: measured, or the force integrated twice.
//!
//! ```text
//!   reconstructed:  δ(t) = v₀·t + ½g·t² − (1/m)·∬F        measured:  the column `displacement_m`
//! ```
//!
//! A measured depth is looked at before anything is fitted to it:
//!
//! - **Computed** from the force (δ = F/k): it then contains the force's own noise. Two sensors differ by the noise of both.
//! - **Misaligned** with the force: whatever the law, δ has to be F integrated twice, v₀·t − (1/m)·∬F, with slope and 1/m as known as
//!   speed and mass are. The shift in time that makes it so is the lag. A loop that runs the wrong way (energy gained) says so, too.
//!   A lag τ in a contact of length T moves the restitution by π²τ/(2T): of a half sine, δ late by τ makes a loop of Fδ·(π/2)·sin(πτ/T).

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

use super::blow::Blow;
use super::refusal::NotIdentified;

/// Lags below this are let pass, s: a tenth of a millisecond is what two good filters differ by.
pub(super) const LAG_WORTH_WORDS_S: f64 = 1e-4;
/// A lag of this many standard errors is one.
const SIGNIFICANT: f64 = 4.0;
/// The ends of a contact that a measured depth is not looked at in, as a part of its length: the instant of contact is only
/// about known there.
const ENDS: f64 = 0.02;
/// Half the width of the stretch that a cubic is laid through for depth and rate, as a part of the contact. Of a half sine of length T
/// a cubic over ±h misses (π·h/T)⁴/280 of the depth: less than 10⁻⁵.
const SMOOTHED_OVER: f64 = 1.0 / 14.0;
/// How far speed, mass and the gain of the displacement are doubted beyond what is stated, relative.
const DOUBT: f64 = 0.01;

/// Where the depth comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The column `displacement_m`.
    Measured,
    /// Force, mass and speed, integrated twice.
    Reconstructed,
}

impl Source {
    /// Its name in files and on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Reconstructed => "reconstructed",
        }
    }
}

/// Depth and rate at each sample of the window, from the force: m and m/s. Zero depth before contact.
pub(super) fn reconstructed(
    blow: &Blow,
    contact_s: f64,
    mass_kg: f64,
    speed_m_per_s: f64,
    gravity: f64,
) -> Vec<(f64, f64)> {
    let (times, force) = (&blow.full.times_s, &blow.full.force_n);
    let (mut depth, mut rate) = (0.0, speed_m_per_s);
    let mut before = (contact_s, 0.0);
    let mut all = Vec::with_capacity(times.len());
    for (&time, &force) in times.iter().zip(force) {
        if time <= contact_s {
            all.push((speed_m_per_s * (time - contact_s), speed_m_per_s));
            before = (contact_s, if time == contact_s { force } else { 0.0 });
            continue;
        }
        let step = time - before.0;
        let acceleration = (gravity - before.1 / mass_kg, gravity - force / mass_kg);
        // The acceleration is linear in between.
        depth += rate * step + step * step * (acceleration.0 / 3.0 + acceleration.1 / 6.0);
        rate += 0.5 * step * (acceleration.0 + acceleration.1);
        before = (time, force);
        all.push((depth, rate));
    }
    all
}

/// Puts the measured depth into a blow, from the contact on, and cuts the window to what is surely inside the contact.
pub(super) fn measured(blow: &mut Blow) {
    let times = std::mem::take(&mut blow.full.times_s);
    let force = std::mem::take(&mut blow.full.force_n);
    let stroke = std::mem::take(&mut blow.stroke_m);
    let duration = blow.duration_s();
    let inside = |time: f64| time >= blow.contact_s + ENDS * duration && time <= blow.separation_s - ENDS * duration;
    let from = times.iter().position(|time| *time >= blow.contact_s).unwrap_or(0);
    let to = times.iter().rposition(|time| *time <= blow.separation_s).map_or(times.len(), |last| last + 1);
    let (times, force, stroke) = (&times[from..to], &force[from..to], &stroke[from..to]);
    let half = SMOOTHED_OVER * duration;
    let smoothed = |place: usize| {
        let at = times[place];
        let first = times.partition_point(|time| *time < at - half);
        let last = times.partition_point(|time| *time <= at + half);
        cubic(&times[first..last], &stroke[first..last], at)
    };
    let zero = smoothed(0);
    // From the first sample to the contact.
    let zero_m = zero.0 - zero.1 * (times[0] - blow.contact_s);
    for (place, (&time, &force)) in times.iter().zip(force).enumerate() {
        if inside(time) {
            let (stroke_m, rate) = smoothed(place);
            blow.full.times_s.push(time);
            blow.full.force_n.push(force);
            blow.full.depth.push((stroke_m - zero_m, rate));
        }
    }
    blow.stroke_m = stroke.to_vec();
}

/// Value and slope at an instant of the cubic through points.
fn cubic(times_s: &[f64], values: &[f64], at_s: f64) -> (f64, f64) {
    let scale = (times_s[times_s.len() - 1] - times_s[0]).max(f64::MIN_POSITIVE);
    let mut normal = Matrix4::<f64>::zeros();
    let mut right = Vector4::<f64>::zeros();
    for (time, value) in times_s.iter().zip(values) {
        let u = (time - at_s) / scale;
        let row = Vector4::new(1.0, u, u * u, u * u * u);
        normal += row * row.transpose();
        right += row * *value;
    }
    match normal.cholesky() {
        Some(factor) => {
            let solution = factor.solve(&right);
            (solution[0], solution[1] / scale)
        }
        None => (values[values.len() / 2], 0.0),
    }
}

/// Refuses depths that were computed from the force.
pub(super) fn not_computed(blows: &[Blow]) -> Result<(), NotIdentified> {
    let found: Vec<(&Blow, f64, String)> =
        blows.iter().filter_map(|blow| computed(blow).map(|(k, because)| (blow, k, because))).collect();
    if 2 * found.len() <= blows.len() {
        return Ok(());
    }
    let (blow, stiffness_n_per_m, because) = &found[0];
    Err(NotIdentified::Computed {
        file: blow.file.clone(),
        stiffness_n_per_m: *stiffness_n_per_m,
        because: because.clone(),
    })
}

/// Whether a depth is F/k, and how that shows.
fn computed(blow: &Blow) -> Option<(f64, String)> {
    let duration = blow.duration_s();
    let inside: Vec<(f64, f64)> = (0..blow.full.times_s.len())
        .filter(|&place| {
            (blow.contact_s + ENDS * duration..=blow.separation_s - ENDS * duration).contains(&blow.full.times_s[place])
        })
        .map(|place| (blow.full.force_n[place], blow.stroke_m[place]))
        .collect();
    let count = inside.len() as f64;
    let mean = inside.iter().fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0 / count, sum.1 + pair.1 / count));
    let product = inside.iter().map(|(force, stroke)| (force - mean.0) * (stroke - mean.1)).sum::<f64>();
    let square = inside.iter().map(|(force, _)| (force - mean.0).powi(2)).sum::<f64>();
    // δ = slope·F + offset
    let slope = product / square;
    if slope <= 0.0 {
        return None;
    }
    let rest = inside.iter().map(|(force, stroke)| (stroke - mean.1 - slope * (force - mean.0)).powi(2)).sum::<f64>();
    let rest_m = (rest / count).sqrt();
    let stiffness = 1.0 / slope;
    let span_m = slope * blow.peak_n;
    if rest_m < 2e-6 * span_m {
        return Some((
            stiffness,
            format!("the two are proportional to {:.0e} of the stroke", (rest_m / span_m).max(1e-16)),
        ));
    }
    // The noise that two sensors have.
    let quiet = blow.quiet.len() as f64;
    let force_n = (blow.quiet.iter().map(|(force, _)| force * force).sum::<f64>() / quiet).sqrt();
    let stroke_m = (blow.quiet.iter().map(|(_, stroke)| stroke * stroke).sum::<f64>() / quiet).sqrt();
    let both_m = stroke_m.hypot(force_n / stiffness);
    let shared = blow.quiet.iter().map(|(force, stroke)| force * stroke).sum::<f64>() / quiet / (force_n * stroke_m);
    // Two sensors share none of it, and so differ by the noise of both; a running mean of ten samples is still noticed.
    (rest_m < 0.92 * both_m && shared > 0.3).then(|| {
        let because =
            format!("no loop is between them, and before contact they share their noise (correlation {shared:.2})");
        (stiffness, because)
    })
}

/// Refuses depths that are late or early against the force. `series`: a pad is in series whose depth is not in the stroke.
pub(super) fn aligned(blows: &[Blow], gravity: f64, series: bool) -> Result<(), NotIdentified> {
    let (lag_s, lag_se) = pooled(blows.iter().filter_map(|blow| lag(blow, gravity, series)));
    let loops = blows.iter().map(|blow| {
        let energy = 0.5 * blow.mass.value * blow.speed.value * blow.speed.value;
        loop_j(blow) / energy
    });
    let (gained, gained_se) = pooled(loops);
    let wrong_way = gained < -0.01 && gained < -SIGNIFICANT * gained_se;
    let loop_words = format!("its loop runs the wrong way and gains {:.1} % of the energy", -100.0 * gained);
    if lag_s.abs() > LAG_WORTH_WORDS_S && lag_s.abs() > SIGNIFICANT * lag_se {
        let mut because = format!(
            "by the momentum that the force takes, the depth turns back {:.2} ms {} in the median of {} recordings",
            1e3 * lag_s.abs(),
            if lag_s > 0.0 { "too late" } else { "too early" },
            blows.len()
        );
        if wrong_way {
            because = format!("{because}, and {loop_words}");
        }
        return Err(NotIdentified::Misaligned { lag_s, se_s: lag_se, because });
    }
    if wrong_way {
        let (duration, _) = pooled(blows.iter().map(Blow::duration_s));
        let per_loss = duration / std::f64::consts::PI.powi(2);
        let (lag_s, se_s) = (gained * per_loss, gained_se * per_loss);
        return Err(NotIdentified::Misaligned { lag_s, se_s, because: loop_words });
    }
    Ok(())
}

/// Median, and its standard error by the scatter.
fn pooled(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut values: Vec<f64> = values.collect();
    if values.is_empty() {
        return (0.0, f64::INFINITY);
    }
    let median = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        0.5 * (values[values.len() / 2] + values[(values.len() - 1) / 2])
    };
    let middle = median(&mut values);
    let mut deviations: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
    // 1.4826: a Gaussian's; 1.2533: the median's efficiency.
    (middle, 1.2533 * 1.4826 * median(&mut deviations) / (values.len() as f64).sqrt())
}

/// ∮F dδ over the contact, J: what is lost.
fn loop_j(blow: &Blow) -> f64 {
    let duration = blow.duration_s();
    let inside = |time: &f64| (blow.contact_s..=blow.separation_s).contains(time);
    let places: Vec<usize> = (0..blow.full.times_s.len()).filter(|&place| inside(&blow.full.times_s[place])).collect();
    // Noise of the depth enters only where it meets noise of the force; but the ends must meet.
    let half =
        ((SMOOTHED_OVER * duration / ((blow.separation_s - blow.contact_s) / places.len() as f64)) as usize).max(1);
    let stroke = |place: usize| {
        let (first, last) = (places[0], places[places.len() - 1]);
        let reach = half.min(place - first).min(last - place);
        let stretch = &blow.stroke_m[place - reach..=place + reach];
        stretch.iter().sum::<f64>() / stretch.len() as f64
    };
    places
        .windows(2)
        .map(|pair| {
            0.5 * (blow.full.force_n[pair[0]] + blow.full.force_n[pair[1]]) * (stroke(pair[1]) - stroke(pair[0]))
        })
        .sum()
}

/// By how much the depth of a blow is late, s. `None`: nothing can be said.
fn lag(blow: &Blow, gravity: f64, series: bool) -> Option<f64> {
    let duration = blow.duration_s();
    // First within wide ends, into which a large lag cannot bring the kink of the contact; then close to the ends.
    let first = best_shift(blow, gravity, series, (0.2 * duration, 0.0, 0.15 * duration))?;
    best_shift(blow, gravity, series, (0.04 * duration + first.abs(), first, 0.03 * duration)).or(Some(first))
}

/// The shift around `around` within `reach` that makes the depth the force's second integral, `ends` away from both ends.
fn best_shift(blow: &Blow, gravity: f64, series: bool, (ends, around, reach): (f64, f64, f64)) -> Option<f64> {
    const SIDE: i32 = 20;
    let rest = |shift: f64| misfit(blow, gravity, series, ends, shift);
    let shifts: Vec<f64> = (-SIDE..=SIDE).map(|step| around + reach * f64::from(step) / f64::from(SIDE)).collect();
    let rests: Option<Vec<f64>> = shifts.iter().map(|shift| rest(*shift)).collect();
    let rests = rests?;
    let best = (0..rests.len()).min_by(|a, b| rests[*a].total_cmp(&rests[*b]))?;
    if best == 0 || best + 1 == rests.len() {
        return Some(shifts[best]);
    }
    let (left, here, right) = (rests[best - 1], rests[best], rests[best + 1]);
    let bend = left - 2.0 * here + right;
    let step = shifts[1] - shifts[0];
    Some(shifts[best] + if bend > 0.0 { 0.5 * step * (left - right) / bend } else { 0.0 })
}

/// Least squares of δ(t) = a + b·t + g·t²/2 − c·∬F(t − τ) − d·F(t − τ) at a shift τ, with b and c as known as speed and mass are, d only
/// where something is in series: what is left, in squares of the noise.
fn misfit(blow: &Blow, gravity: f64, series: bool, ends: f64, shift: f64) -> Option<f64> {
    const MOST: usize = 240;
    let (times, force) = (&blow.full.times_s, &blow.full.force_n);
    let (mass, speed) = (blow.mass, blow.speed);
    let duration = blow.duration_s();
    let integral: Vec<f64> = reconstructed(blow, blow.contact_s, 1.0, 0.0, 0.0)
        .iter()
        .zip(times)
        .map(|((depth, _), time)| if *time <= blow.contact_s { 0.0 } else { -depth })
        .collect();
    let at = |values: &[f64], time: f64| {
        let place = times.partition_point(|other| *other <= time).clamp(1, times.len() - 1);
        let part = (time - times[place - 1]) / (times[place] - times[place - 1]);
        values[place - 1] + part * (values[place] - values[place - 1])
    };
    let inside: Vec<usize> = (0..times.len())
        .filter(|&place| (blow.contact_s + ends..=blow.separation_s - ends).contains(&times[place]))
        .collect();
    let stride = inside.len().div_ceil(MOST).max(1);
    if inside.len() < 16 {
        return None;
    }
    let quiet = blow.quiet.len() as f64;
    let own_m = (blow.quiet.iter().map(|(_, stroke)| stroke * stroke).sum::<f64>() / quiet).sqrt();
    // Not below what a recording resolves, and as many samples as are skipped make one that is better.
    let deep = speed.value * duration / std::f64::consts::PI;
    let noise_m = own_m.max(1e-5 * deep) / (stride as f64).sqrt();
    let columns = 4 + usize::from(series);
    let unknowns = [1.0, speed.value, 1.0, 1.0 / mass.value, deep / blow.peak_n];
    let mut rows: Vec<([f64; 5], f64)> = inside
        .chunks_exact(stride)
        .map(|chunk| {
            let count = chunk.len() as f64;
            let mut row = [0.0; 5];
            let mut value = 0.0;
            for &place in chunk {
                let time = times[place] - blow.contact_s - shift;
                let early = times[place] - shift;
                let here = [1.0, time, 0.5 * time * time, -at(&integral, early), -at(force, early)];
                for (sum, part) in row.iter_mut().zip(here) {
                    *sum += part / count / noise_m;
                }
                value += blow.stroke_m[place] / count / noise_m;
            }
            (row, value)
        })
        .collect();
    let known = |value: f64, sd: f64| (DOUBT * value).hypot(sd);
    let mut belief = |column: usize, value: f64, sd: f64| {
        let mut row = [0.0; 5];
        row[column] = 1.0 / sd;
        rows.push((row, value / sd));
    };
    belief(1, speed.value, known(speed.value, speed.sd));
    belief(3, 1.0 / mass.value, known(1.0 / mass.value, mass.sd / mass.value.powi(2)));
    // A robot's own brake or push over the contact.
    belief(2, gravity, 0.05 * speed.value / duration);
    let design = DMatrix::from_fn(rows.len(), columns, |row, column| rows[row].0[column] * unknowns[column]);
    let values = DVector::from_fn(rows.len(), |row, _| rows[row].1);
    let mut normal = design.tr_mul(&design);
    for place in 0..columns {
        normal[(place, place)] *= 1.0 + 1e-10;
    }
    let solution = normal.cholesky()?.solve(&design.tr_mul(&values));
    Some((values - design * solution).norm_squared())
}
