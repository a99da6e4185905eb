//! The arc that a flank is fitted with.

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
