//! Normal equations of a weighted least squares with a few unknowns, gathered point by point.
//!
//! ```text
//! (Σ g·gᵀ/σ² + P)·step = Σ g·r/σ² + P·d        g gradient, r residual, P weight and d distance of a prior
//! ```
//!
//! Solved by Cholesky after the diagonal has been scaled to one, which takes the units out and keeps `f32` sufficient.

/// What keeps the scaled matrix positive where points do not tell two unknowns apart.
const RIDGE: f32 = 1e-6;

/// Normal equations for `N` unknowns.
pub struct Normal<const N: usize> {
    matrix: [[f32; N]; N],
    right: [f32; N],
    /// What is minimised: [`Self::squares`] and the same of the priors.
    pub cost: f32,
    /// Sum of the residuals' squares over the noise's.
    pub squares: f32,
    /// Number of points.
    pub points: usize,
}

impl<const N: usize> Normal<N> {
    /// No points yet.
    pub fn new() -> Self {
        Self { matrix: [[0.0; N]; N], right: [0.0; N], cost: 0.0, squares: 0.0, points: 0 }
    }

    /// An unknown is expected `distance` away, give or take `deviation`.
    pub fn expect(&mut self, unknown: usize, distance: f32, deviation: f32) {
        let weight = 1.0 / (deviation * deviation);
        self.matrix[unknown][unknown] += weight;
        self.right[unknown] += weight * distance;
        self.cost += weight * distance * distance;
    }

    /// Adds a point: its gradient by each unknown, and what is left of it.
    pub fn add(&mut self, gradient: [f32; N], residual: f32, variance: f32) {
        let weight = 1.0 / variance;
        for (row, g) in gradient.iter().enumerate() {
            let g = g * weight;
            for (entry, h) in self.matrix[row][..=row].iter_mut().zip(&gradient) {
                *entry += g * h;
            }
            self.right[row] += g * residual;
        }
        self.squares += residual * residual * weight;
        self.cost += residual * residual * weight;
        self.points += 1;
    }

    /// The step after Levenberg and Marquardt: shorter and nearer to the steepest descent, the more it is damped.
    pub fn damped(&self, damping: f32) -> Option<[f32; N]> {
        let mut damped = Self { matrix: self.matrix, ..Self::new() };
        for unknown in 0..N {
            damped.matrix[unknown][unknown] *= 1.0 + damping;
        }
        damped.solve_for(self.right)
    }

    /// The lower triangle's factor, and the scale of each unknown.
    fn factor(&self) -> Option<([[f32; N]; N], [f32; N])> {
        let mut scale = [0.0; N];
        for (row, s) in scale.iter_mut().enumerate() {
            let diagonal = self.matrix[row][row];
            if !(diagonal > 0.0 && diagonal.is_finite()) {
                return None;
            }
            *s = 1.0 / libm::sqrtf(diagonal);
        }
        let mut factor = [[0.0f32; N]; N];
        for row in 0..N {
            for column in 0..=row {
                let mut sum = self.matrix[row][column] * scale[row] * scale[column];
                if row == column {
                    sum += RIDGE;
                }
                sum -= factor[row][..column].iter().zip(&factor[column]).map(|(a, b)| a * b).sum::<f32>();
                if row == column {
                    if sum <= 0.0 || sum.is_nan() {
                        return None;
                    }
                    factor[row][row] = libm::sqrtf(sum);
                } else {
                    factor[row][column] = sum / factor[column][column];
                }
            }
        }
        Some((factor, scale))
    }

    fn solve_for(&self, right: [f32; N]) -> Option<[f32; N]> {
        let (factor, scale) = self.factor()?;
        let mut x = [0.0f32; N];
        for row in 0..N {
            let mut sum = right[row] * scale[row];
            for inner in 0..row {
                sum -= factor[row][inner] * x[inner];
            }
            x[row] = sum / factor[row][row];
        }
        for row in (0..N).rev() {
            let mut sum = x[row];
            for inner in row + 1..N {
                sum -= factor[inner][row] * x[inner];
            }
            x[row] = sum / factor[row][row];
        }
        for row in 0..N {
            x[row] *= scale[row];
        }
        x.iter().all(|value| value.is_finite()).then_some(x)
    }

    /// The step to the least squares; `None` where the points do not determine it.
    pub fn solve(&self) -> Option<[f32; N]> {
        self.solve_for(self.right)
    }

    /// Predicted variance of an unknown.
    pub fn variance(&self, unknown: usize) -> Option<f32> {
        let mut unit = [0.0; N];
        unit[unknown] = 1.0;
        self.solve_for(unit).map(|x| x[unknown].max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polynomial through its own points, in units that differ by ten orders of magnitude.
    #[test]
    fn a_cubic_is_found_whatever_the_units() {
        for unit in [1e-3f32, 1.0, 1e2] {
            let coefficients = [2.0f32, -1.0 / unit, 0.5 / (unit * unit), 0.25 / (unit * unit * unit)];
            let mut normal = Normal::<4>::new();
            for n in -10..=10 {
                let x = n as f32 / 10.0 * unit;
                let gradient = [1.0, x, x * x, x * x * x];
                let value: f32 = gradient.iter().zip(&coefficients).map(|(g, c)| g * c).sum();
                normal.add(gradient, value, 0.01);
            }
            for (found, expected) in normal.solve().unwrap().iter().zip(&coefficients) {
                assert!((found / expected - 1.0).abs() < 1e-3, "{unit}: {found} {expected}");
            }
        }
    }

    /// The mean of n values has the variance σ²/n, and a prior counts as values do.
    #[test]
    fn the_variance_is_that_of_a_mean() {
        let mut normal = Normal::<1>::new();
        for value in [1.0, 2.0, 3.0] {
            normal.add([1.0], value, 0.5);
        }
        assert!((normal.variance(0).unwrap() - 0.5 / 3.0).abs() < 1e-6);
        assert!((normal.solve().unwrap()[0] - 2.0).abs() < 1e-5);
        normal.expect(0, 6.0, libm::sqrtf(0.5));
        assert!((normal.solve().unwrap()[0] - 3.0).abs() < 1e-5);
        assert_eq!(normal.points, 3);
    }

    #[test]
    fn what_no_point_speaks_of_is_not_solved() {
        let mut normal = Normal::<2>::new();
        normal.add([1.0, 0.0], 1.0, 1.0);
        assert_eq!(normal.solve(), None);
    }
}
