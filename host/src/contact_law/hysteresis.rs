//! The restitution that F = k·δⁿ·(1 + λ·δ̇) really gives.
//!
//! From m·v·dv/dδ = −k·δⁿ·(1 + λ·v): the integral of v/(1 + λ·v) from v₀ down to 0 is the elastic integral up to the largest
//! depth, and from 0 to −e·v₀ it is the same one on the way back. With x = λ·v₀:
//!
//! ```text
//!   x − ln(1 + x) = −e·x − ln(1 − e·x)
//! ```
//!
//! Mass, stiffness and exponent have dropped out. Without gravity; its work over a few millimetres is not seen.

/// e for a loss x = λ·v₀ ≥ 0; for a gain (x < 0) above 1.
#[must_use]
pub fn restitution_of_loss(loss: f64) -> f64 {
    if loss.abs() < 1e-6 {
        // Second order: e = 1 − 2x/3.
        return 1.0 - loss / 1.5;
    }
    if loss <= -1.0 {
        return f64::INFINITY;
    }
    let elastic = loss - loss.ln_1p();
    // y = e·x with −y − ln(1 − y) = elastic; the left side rises with |y|.
    let rest = |y: f64| -y - (-y).ln_1p() - elastic;
    let (mut low, mut high) = if loss > 0.0 { (0.0, 1.0) } else { (loss * 1e6, 0.0) };
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        // Below 0 it falls, above 0 it rises.
        if (rest(middle) > 0.0) == (loss > 0.0) {
            high = middle;
        } else {
            low = middle;
        }
    }
    0.5 * (low + high) / loss
}

/// The loss x = λ·v₀ that gives the restitution `restitution` in (0, 1].
#[must_use]
pub fn loss_of_restitution(restitution: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1e6);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if restitution_of_loss(middle) > restitution {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
