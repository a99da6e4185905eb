//! The arc that a flank is fitted with, and the least squares of its three unknowns.
//!
//! Lengths are in units of the fitted stretch, so that all three unknowns are of order one and `f32` is enough.

/// sin(√p·x)/√p and its derivatives, as series: |p·x²| stays below 11, where nine terms are exact in `f32`.
pub struct Shape {
    /// The arc.
    pub value: f32,
    /// Its derivative by x.
    pub by_x: f32,
    /// Its derivative by p.
    pub by_curvature: f32,
}

impl Shape {
    /// The arc of curvature `p` at `x`.
    pub fn at(x: f32, p: f32) -> Self {
        let z = -p * x * x;
        let (mut sine, mut cosine, mut slope) = (0.0, 0.0, 0.0);
        let mut k = 9.0;
        // Horner: sine = Σ z^k/(2k+1)!, cosine = Σ z^k/(2k)!, slope = dsine/dz.
        while k >= 1.0 {
            slope = (sine + z * slope) / ((2.0 * k + 2.0) * (2.0 * k + 3.0));
            sine = 1.0 + z * sine / ((2.0 * k + 2.0) * (2.0 * k + 3.0));
            cosine = 1.0 + z * cosine / ((2.0 * k + 1.0) * (2.0 * k + 2.0));
            k -= 1.0;
        }
        slope = (sine + z * slope) / 6.0;
        sine = 1.0 + z * sine / 6.0;
        cosine = 1.0 + z * cosine / 2.0;
        Self { value: x * sine, by_x: cosine, by_curvature: -x * x * x * slope }
    }
}

/// Normal equations for slope, curvature and begin.
pub struct Normal {
    matrix: [[f32; 3]; 3],
    right: [f32; 3],
    /// Sum of the residuals' squares over the noise's.
    pub squares: f32,
    /// Number of points.
    pub points: usize,
}

impl Normal {
    /// No points yet; the curvature is expected `distance` away, give or take `deviation`.
    pub fn with_prior(distance: f32, deviation: f32) -> Self {
        let weight = 1.0 / (deviation * deviation);
        let mut normal = Self { matrix: [[0.0; 3]; 3], right: [0.0; 3], squares: 0.0, points: 0 };
        normal.matrix[1][1] = weight;
        normal.right[1] = weight * distance;
        normal
    }

    /// Adds a point: the gradient by slope, curvature and begin, and what is left of it.
    pub fn add(&mut self, gradient: [f32; 3], residual: f32, variance: f32) {
        for (row, g) in gradient.iter().enumerate() {
            for (column, h) in gradient.iter().enumerate() {
                self.matrix[row][column] += g * h / variance;
            }
            self.right[row] += g * residual / variance;
        }
        self.squares += residual * residual / variance;
        self.points += 1;
    }

    /// Cholesky after scaling the diagonal to one, which keeps `f32` sufficient.
    fn factor(&self) -> Option<([[f32; 3]; 3], [f32; 3])> {
        let mut scale = [0.0; 3];
        for (row, s) in scale.iter_mut().enumerate() {
            let diagonal = self.matrix[row][row];
            if !(diagonal > 0.0 && diagonal.is_finite()) {
                return None;
            }
            *s = 1.0 / libm::sqrtf(diagonal);
        }
        let mut factor = [[0.0f32; 3]; 3];
        for row in 0..3 {
            for column in 0..=row {
                let mut sum = self.matrix[row][column] * scale[row] * scale[column];
                if row == column {
                    sum += 1e-6;
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

    fn solve_for(&self, right: [f32; 3]) -> Option<[f32; 3]> {
        let (factor, scale) = self.factor()?;
        let mut x = [0.0f32; 3];
        for row in 0..3 {
            let mut sum = right[row] * scale[row];
            for inner in 0..row {
                sum -= factor[row][inner] * x[inner];
            }
            x[row] = sum / factor[row][row];
        }
        for row in (0..3).rev() {
            let mut sum = x[row];
            for inner in row + 1..3 {
                sum -= factor[inner][row] * x[inner];
            }
            x[row] = sum / factor[row][row];
        }
        for row in 0..3 {
            x[row] *= scale[row];
        }
        x.iter().all(|value| value.is_finite()).then_some(x)
    }

    /// The step to the least squares; `None` where the points do not determine it.
    pub fn solve(&self) -> Option<[f32; 3]> {
        self.solve_for(self.right)
    }

    /// Variance of the begin, in squares of the stretch's length.
    pub fn variance_of_begin(&self) -> Option<f32> {
        self.solve_for([0.0, 0.0, 1.0]).map(|x| x[2].max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_is_the_sine() {
        for p in [-4.0f32, -0.5, 1e-6, 0.5, 3.0, 9.8] {
            for x in [0.1f32, 0.5, 1.0] {
                let shape = Shape::at(x, p);
                let root = libm::sqrt(f64::from(p.abs()));
                let argument = root * f64::from(x);
                let (value, by_x) = if p > 0.0 {
                    (libm::sin(argument) / root, libm::cos(argument))
                } else {
                    (libm::sinh(argument) / root, libm::cosh(argument))
                };
                assert!((f64::from(shape.value) - value).abs() < 1e-6, "{p} {x}");
                assert!((f64::from(shape.by_x) - by_x).abs() < 1e-5, "{p} {x}");
                let h = 1e-3;
                let numeric = (Shape::at(x, p + h).value - Shape::at(x, p - h).value) / (2.0 * h);
                assert!((shape.by_curvature - numeric).abs() < 2e-4, "{p} {x}");
            }
        }
    }
}
