//! The peak of the unfiltered force, between the samples and free of the noise's own maximum.
//!
//! The largest of many noisy samples is too large: by about 3σ, 1 N at 0.3 N rms. So a parabola is fitted to the samples
//! around the highest place, in stretches of growing width, and the widest whose residual still looks like the tracked noise
//! is taken: 3 samples for a hammer's blow, 127 for a soft pulse, where the vertex is known to σ·1.5/√127 = 0.13σ.

use super::force::Force;
use crate::capture::Curve;

/// Widest stretch, samples.
const WIDEST: usize = 127;
/// The residual's mean square over the noise's may reach 1 + this/√(degrees of freedom): three deviations of χ².
const MISFIT: f32 = 4.24;
/// Misfit that is allowed besides the noise, as a share of the peak: a fifth of the 0.5 % that is asked for.
const MODEL_ERROR: f32 = 1e-3;

/// The peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Position, samples from the curve's first one.
    pub position: f32,
    /// Force, N.
    pub force: f32,
}

/// Finds the peak around `highest_at`, known to `group` samples. It lies in `start..end`.
pub fn find<C: Curve>(
    force: &Force<'_, C>,
    highest_at: usize,
    group: usize,
    range: (usize, usize),
    noise: f32,
) -> Peak {
    let mut samples = [0.0; WIDEST];
    let mut centre = highest_at;
    let mut best = Peak { position: centre as f32, force: 0.0 };
    // The group's centre is off by up to half a group; the second pass starts from where the first one ended.
    for pass in 0..3 {
        let from = centre.saturating_sub(WIDEST / 2);
        let count = force.read(from, &mut samples);
        let samples = &samples[..count];
        if samples.is_empty() {
            return best;
        }
        if pass == 0 {
            centre = highest_near(samples, centre - from, group) + from;
            best = Peak { position: centre as f32, force: samples[centre - from] };
        }
        let Some(found) = widest(samples, centre - from, noise) else { return best };
        best = Peak { position: from as f32 + found.position, force: found.force };
        let vertex = (libm::roundf(best.position).max(0.0) as usize).clamp(range.0, range.1.max(range.0 + 1) - 1);
        if vertex == centre {
            break;
        }
        centre = vertex;
    }
    best
}

fn highest_near(samples: &[f32], centre: usize, group: usize) -> usize {
    let from = centre.saturating_sub(group).min(samples.len() - 1);
    let to = (centre + group + 1).min(samples.len());
    (from..to).fold(from, |highest, at| if samples[at] > samples[highest] { at } else { highest })
}

/// The vertex of the widest parabola around `centre` that fits.
fn widest(samples: &[f32], centre: usize, noise: f32) -> Option<Peak> {
    let room = centre.min(samples.len() - 1 - centre);
    let mut best = None;
    let mut half = 1;
    while half <= room {
        let parabola = Parabola::fit(&samples[centre - half..=centre + half]);
        let floor = MODEL_ERROR * samples[centre];
        let variance = noise * noise + floor * floor;
        let freedom = (2 * half + 1 - 3) as f32;
        // A stretch is judged on its own: at two degrees of freedom one honest stretch in twenty looks wrong.
        let fits = half == 1 || parabola.squares <= variance * (freedom + MISFIT * libm::sqrtf(freedom));
        if fits && let Some((offset, force)) = parabola.vertex(half as f32) {
            best = Some(Peak { position: centre as f32 + offset, force });
        }
        half += half.div_ceil(3);
    }
    best
}

/// a + b·n + c·n² over n = −h … h.
struct Parabola {
    a: f32,
    b: f32,
    c: f32,
    /// Sum of the residual's squares.
    squares: f32,
}

impl Parabola {
    fn fit(samples: &[f32]) -> Self {
        let half = (samples.len() / 2) as f32;
        let count = samples.len() as f32;
        // Sums over the place, its square and its fourth power.
        let s2 = half * (half + 1.0) * (2.0 * half + 1.0) / 3.0;
        let s4 = s2 * (3.0 * half * half + 3.0 * half - 1.0) / 5.0;
        // Around the middle sample, so that the sums stay small.
        let middle = samples[samples.len() / 2];
        let (mut y0, mut y1, mut y2) = (0.0, 0.0, 0.0);
        for (index, sample) in samples.iter().enumerate() {
            let n = index as f32 - half;
            let y = sample - middle;
            y0 += y;
            y1 += n * y;
            y2 += n * n * y;
        }
        let determinant = count * s4 - s2 * s2;
        let a = (s4 * y0 - s2 * y2) / determinant;
        let c = (count * y2 - s2 * y0) / determinant;
        let b = y1 / s2;
        let squares = samples
            .iter()
            .enumerate()
            .map(|(index, sample)| {
                let n = index as f32 - half;
                let rest = sample - middle - (a + b * n + c * n * n);
                rest * rest
            })
            .sum();
        Self { a: a + middle, b, c, squares }
    }

    /// Place and height of the vertex, where it is a maximum inside the stretch.
    fn vertex(&self, half: f32) -> Option<(f32, f32)> {
        if self.c >= 0.0 || self.c.is_nan() {
            return None;
        }
        let place = -0.5 * self.b / self.c;
        (place.abs() <= half).then_some((place, self.a + 0.5 * self.b * place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_itself() {
        let samples: std::vec::Vec<f32> =
            (-20..=20).map(|n| 100.0 - 0.3 * (n as f32 - 2.25) * (n as f32 - 2.25)).collect();
        let parabola = Parabola::fit(&samples);
        let (place, height) = parabola.vertex(20.0).unwrap();
        assert!((place - 2.25).abs() < 1e-3, "{place}");
        assert!((height - 100.0).abs() < 1e-3, "{height}");
        assert!(parabola.squares < 1e-4, "{}", parabola.squares);
    }
}
