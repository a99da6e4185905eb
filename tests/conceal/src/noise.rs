//! Coloured noise: an autoregressive process, and the whitening that undoes it.

use crate::draw::Draw;

/// e(t) = Σ aᵢ·e(t−i) + s·w(t) with white w.
#[derive(Debug, Clone)]
pub struct Colour {
    coefficients: Vec<f64>,
    innovation: f64,
}

impl Colour {
    /// Draws a colour of the given rms: an AR(2) of two real poles, or of one slow resonance.
    pub fn draw(draw: &mut Draw, rms: f64) -> Self {
        let coefficients = if draw.chance(0.5) {
            let (p, q) = (draw.uniform(0.0, 0.6), draw.uniform(-0.3, 0.3));
            vec![p + q, -p * q]
        } else {
            let (radius, angle) = (draw.uniform(0.2, 0.6), draw.uniform(0.3, 2.5));
            vec![2.0 * radius * angle.cos(), -radius * radius]
        };
        Self::new(coefficients, rms)
    }

    /// The process of these two coefficients and this rms.
    ///
    /// # Panics
    /// Unless there are two coefficients of a stationary process.
    #[must_use]
    pub fn new(coefficients: Vec<f64>, rms: f64) -> Self {
        let [a, b] = coefficients[..] else { panic!("an AR(2) has two coefficients") };
        // Variance of an AR(2) over that of its innovation.
        let ratio = (1.0 - b) / ((1.0 + b) * ((1.0 - b) * (1.0 - b) - a * a));
        assert!(ratio.is_finite() && ratio > 0.0, "this AR(2) is not stationary");
        Self { coefficients, innovation: rms / ratio.sqrt() }
    }

    /// The same colour at another rms.
    #[must_use]
    pub fn at(&self, rms: f64) -> Self {
        Self::new(self.coefficients.clone(), rms)
    }

    /// `count` samples of noise.
    #[must_use]
    pub fn sample(&self, draw: &mut Draw, count: usize) -> Vec<f64> {
        const SETTLE: usize = 64;
        let mut past = vec![0.0; self.coefficients.len()];
        let mut noise = Vec::with_capacity(count);
        for index in 0..count + SETTLE {
            let next =
                self.coefficients.iter().zip(&past).map(|(a, p)| a * p).sum::<f64>() + self.innovation * draw.normal();
            past.rotate_right(1);
            past[0] = next;
            if index >= SETTLE {
                noise.push(next);
            }
        }
        noise
    }

    /// Whitens in place: afterwards this noise would be white of variance one.
    pub fn whiten(&self, signal: &mut [f64]) {
        let [a, b] = self.coefficients[..] else { unreachable!("checked when made") };
        let (mut last, mut before) = (signal.first().copied().unwrap_or(0.0), signal.first().copied().unwrap_or(0.0));
        let scale = 1.0 / self.innovation;
        for value in signal {
            let now = *value;
            *value = (now - a * last - b * before) * scale;
            (before, last) = (last, now);
        }
    }

    /// The coefficients and the innovation's sd.
    #[must_use]
    pub fn parts(&self) -> (&[f64], f64) {
        (&self.coefficients, self.innovation)
    }
}

#[cfg(test)]
mod tests;
