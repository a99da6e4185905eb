//! What a rest may grow with from recording to recording: nothing, the speed, the mass.

use super::problem::{Prepared, Problem};

/// A spread below this part of the mean is none.
const LEAST_SPREAD: f64 = 1e-9;

/// A weight for each recording, three times: one; its speed; the logarithm of its mass. Speeds and masses are centred and counted in
/// their own standard deviations; where all recordings have the same, the weights are zero.
#[must_use]
pub fn weights(problem: &Problem) -> [Vec<f64>; 3] {
    let of_each = |value: fn(&Prepared) -> f64| problem.recordings.iter().map(value).collect();
    [
        vec![1.0; problem.recordings.len()],
        centred(of_each(|recording| recording.speed.value)),
        centred(of_each(|recording| recording.mass.value.ln())),
    ]
}

fn centred(values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let spread = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt();
    if spread <= LEAST_SPREAD * mean.abs() {
        vec![0.0; values.len()]
    } else {
        values.iter().map(|value| (value - mean) / spread).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_counted_from_their_mean_in_deviations() {
        assert_eq!(centred(vec![1.0, 3.0]), [-1.0, 1.0]);
        assert_eq!(centred(vec![6.0; 5]), [0.0; 5], "the same everywhere is no condition");
    }
}
