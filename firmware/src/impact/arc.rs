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

/// Terms of the series, and |z| below which fewer do.
const TERMS: usize = 10;
const SHORT: f32 = 2.5;
/// 1/((2k + 2)·(2k + 3)) and 1/((2k + 1)·(2k + 2)): a division costs a Cortex-M4F fourteen multiplications.
const ODD: [f32; TERMS] = reciprocals(2);
const EVEN: [f32; TERMS] = reciprocals(1);

const fn reciprocals(first: usize) -> [f32; TERMS] {
    let mut all = [0.0; TERMS];
    let mut k = 0;
    while k < TERMS {
        all[k] = 1.0 / ((2 * k + first) * (2 * k + first + 1)) as f32;
        k += 1;
    }
    all
}

impl Shape {
    /// The arc of curvature `p` at `x`.
    pub fn at(x: f32, p: f32) -> Self {
        let z = -p * x * x;
        // Up to the peak |z| stays below (π/2)², where six terms do.
        let terms = if (-SHORT..SHORT).contains(&z) { 6 } else { TERMS };
        let (mut sine, mut cosine, mut slope) = (0.0, 0.0, 0.0);
        // Horner: sine = Σ z^k/(2k+1)!, cosine = Σ z^k/(2k)!, slope = dsine/dz.
        for k in (0..terms).rev() {
            slope = (sine + z * slope) * ODD[k];
            sine = 1.0 + z * sine * ODD[k];
            cosine = 1.0 + z * cosine * EVEN[k];
        }
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
