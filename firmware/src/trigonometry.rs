//! Sine and cosine in single precision alone.
//!
//! ```text
//! x = n·π/2 + r,  |r| ≤ π/4        sin r ≈ r − r³/6 + …,  cos r ≈ 1 − r²/2 + …        n mod 4 says which, and with which sign
//! ```
//!
//! `libm`'s, right to the last bit, compute in double precision, which the board's processor has to emulate: 600 instructions
//! and 6 KiB of flash against 40 and 0.2. The polynomials are those of Moshier's *Cephes* (single/sinf.c), and π/2 comes off in three
//! parts, of which the first two leave no rounding for |n| < 2¹³.

use core::f32::consts::FRAC_2_PI;

/// π/2 in three parts: eight bits, eleven bits, the rest.
const HALF_PI: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];
/// sin r = r + r³·(S₀ + r²·(S₁ + r²·S₂)).
const SINE: [f32; 3] = [-1.666_665_5e-1, 8.332_161e-3, -1.951_529_6e-4];
/// cos r = 1 − r²/2 + r⁴·(C₀ + r²·(C₁ + r²·C₂)).
const COSINE: [f32; 3] = [4.166_664_6e-2, -1.388_731_6e-3, 2.443_315_7e-5];

/// Sine and cosine of an angle in radians. Within 1.5e-7 for |x| < 10, 3e-7 up to 1,000; less exact beyond 10,000.
#[must_use]
pub fn sin_cos(x: f32) -> (f32, f32) {
    let quarters = x * FRAC_2_PI;
    // Rounded to the nearest; the conversion saturates.
    let n = (if quarters < 0.0 { quarters - 0.5 } else { quarters + 0.5 }) as i32;
    let turns = n as f32;
    let r = ((x - turns * HALF_PI[0]) - turns * HALF_PI[1]) - turns * HALF_PI[2];
    let z = r * r;
    let sine = r + r * z * (SINE[0] + z * (SINE[1] + z * SINE[2]));
    let cosine = 1.0 - 0.5 * z + z * z * (COSINE[0] + z * (COSINE[1] + z * COSINE[2]));
    let (s, c) = if n & 1 == 0 { (sine, cosine) } else { (cosine, sine) };
    (if n & 2 == 0 { s } else { -s }, if (n + 1) & 2 == 0 { c } else { -c })
}

/// Tangent, for |x| well below π/2. Relative error below 4e-7.
#[must_use]
pub fn tan(x: f32) -> f32 {
    let (sine, cosine) = sin_cos(x);
    sine / cosine
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worst(to: f32) -> f64 {
        (-200_000..=200_000)
            .map(|step| to * step as f32 / 200_000.0)
            .map(|x| {
                let (sine, cosine) = sin_cos(x);
                let exact = (libm::sin(f64::from(x)), libm::cos(f64::from(x)));
                (f64::from(sine) - exact.0).abs().max((f64::from(cosine) - exact.1).abs())
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn the_errors_are_as_stated() {
        let found = (worst(10.0), worst(1_000.0));
        assert!(found.0 < 1.5e-7 && found.1 < 3e-7, "{found:?}");
    }

    #[test]
    fn a_small_angle_is_its_own_sine_and_tangent() {
        for x in [0.0f32, 1e-20, 1e-6, 3e-4] {
            assert_eq!(sin_cos(x).0, libm::sinf(x));
            assert!((tan(x) - libm::tanf(x)).abs() <= 4e-7 * x);
        }
    }

    #[test]
    fn the_tangent_holds_as_far_as_a_corner_may_lie() {
        for step in 1..=300 {
            let x = core::f32::consts::PI * 0.001 * step as f32;
            let exact = libm::tan(f64::from(x));
            assert!((f64::from(tan(x)) / exact - 1.0).abs() < 4e-7, "{x}");
        }
    }
}
