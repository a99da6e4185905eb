//! Quiet before and after a recording.
//!
//! The firmware learns zero, hum and noise before it is armed, and closes an impact when the force has been gone for a
//! while. A recording that begins shortly before the contact, or ends with it, gives no time for either. What is
//! missing is made of its own idle samples, walked to and fro (a mirror at either end), so that level, noise and
//! slow tones are those of the recording and there is no step:
//!
//! ```text
//!   … i₂ i₁ i₀ i₁ i₂ … i_m … i₁ | i₀ i₁ i₂ … i_m contact
//!   ─────── made ─────────────── ─── recorded ──────────
//! ```

/// Least number of samples to take noise from.
const LEAST_IDLE: usize = 8;

/// A sample this many standard deviations from the level of the samples before it is no longer idle.
const DEPARTURE: f64 = 6.0;

/// The last part of the idle stretch that is not mirrored: the toe of the contact is in it before it stands out.
const TOE_SHARE: f64 = 0.2;

/// How many of the first samples are idle: nothing touches, and they can be mirrored.
///
/// Grows from the first [`LEAST_IDLE`] samples on until one departs from the mean of those before it by more than
/// [`DEPARTURE`] standard deviations (and `resolution`, the step of the values), then gives up a fifth for the toe.
/// `None` when there are too few.
#[must_use]
pub fn idle_samples(values: &[f64], resolution: f64) -> Option<usize> {
    if values.len() < LEAST_IDLE {
        return None;
    }
    let (mut mean, mut squares) = (0.0, 0.0);
    for (index, value) in values.iter().enumerate() {
        if index >= LEAST_IDLE {
            let deviation = (squares / index as f64).sqrt();
            if (value - mean).abs() > DEPARTURE * deviation + resolution {
                let idle = index - (index as f64 * TOE_SHARE).ceil() as usize;
                return (idle >= LEAST_IDLE / 2).then_some(idle);
            }
        }
        // Welford's recurrence.
        let difference = value - mean;
        mean += difference / (index + 1) as f64;
        squares += difference * (value - mean);
    }
    Some(values.len())
}

/// `length` samples that go before `idle[0]`, in the order of time.
#[must_use]
pub fn before(idle: &[f64], length: usize) -> Vec<f64> {
    let mut made: Vec<f64> = walk(idle).take(length).collect();
    made.reverse();
    made
}

/// `length` samples that go after a recording whose own idle samples are these.
#[must_use]
pub fn after(idle: &[f64], length: usize) -> Vec<f64> {
    walk(idle).take(length).collect()
}

/// idle[1], idle[2], … idle[m], idle[m−1], … idle[0], idle[1], …
fn walk(idle: &[f64]) -> impl Iterator<Item = f64> {
    let turn = (2 * idle.len()).saturating_sub(2).max(1);
    (1_usize..).map(move |step| {
        let place = step % turn;
        idle[place.min(turn - place).min(idle.len() - 1)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mirror_has_no_step() {
        let idle = [1.0, 2.0, 3.0];
        assert_eq!(before(&idle, 5), [2.0, 1.0, 2.0, 3.0, 2.0]);
        assert_eq!(after(&idle, 5), [2.0, 3.0, 2.0, 1.0, 2.0]);
        assert_eq!(before(&[4.0], 2), [4.0, 4.0]);
    }

    #[test]
    fn idle_ends_where_the_contact_begins() {
        let mut values: Vec<f64> = (0..100).map(|index| 0.01 * f64::from(index % 3)).collect();
        values.extend([0.02, 0.5, 3.0, 10.0]);
        let idle = idle_samples(&values, 0.0).unwrap();
        assert!((70..=101).contains(&idle), "{idle}");
    }

    #[test]
    fn a_recording_that_begins_in_contact_has_no_idle_stretch() {
        let values: Vec<f64> = (0..5).map(|index| f64::from(index).powi(2)).collect();
        assert_eq!(idle_samples(&values, 0.0), None);
    }

    #[test]
    fn a_recording_without_contact_is_all_idle() {
        assert_eq!(idle_samples(&[0.5; 50], 0.01), Some(50));
    }
}
