//! What bristles hold of a massless piece when the robot has gone creeps home, and on linear springs it is known how.
//!
//! The springs press on the bend y alone, S(x_p) + y·F = 0, so that of z·dy/dt = v − y·√(v² + v_c²) the velocity v = dx_p/dt can be told. With
//! a the springs' stiffness and b = F/z that of the bristles
//!
//! ```text
//! dy/dt = −(a·v_c/z)·y/√((a + b)² − b²·y²),    q = b·|y|/(a + b):    g(q) = √(1 − q²) − ln((1 + √(1 − q²))/q),    dg/dt = −a·v_c/((a + b)·z)
//! ```
//!
//! Source: the bristles' own law (`assembly.rs`, `Guide::bending_per_s`), integrated.

/// The bend of bristles that springs press on, over time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decay {
    begun: f64,
    /// q at the beginning; 0 where nothing is held.
    part: f64,
    held: f64,
    rate_per_s: f64,
}

/// The most of q: at 1 the bend begins with an infinite rate, which no step could follow.
const MOST_PART: f64 = 1.0 - 1e-6;

impl Decay {
    /// From this bend on; stiffnesses of springs and bristles in N/m, z in m and v_c in m/s.
    pub(super) fn new(bend: f64, springs: f64, bristles: f64, presliding_m: f64, creep_m_per_s: f64) -> Self {
        let both = springs + bristles;
        let part = (bristles * bend.abs() / both).min(MOST_PART);
        Self { begun: bend, part, held: held(part), rate_per_s: springs * creep_m_per_s / (both * presliding_m) }
    }

    /// What it does fastest, 1/s: to begin with q changes with time to the power of ⅔ where it is nearly 1.
    pub(super) fn fastest_per_s(&self) -> f64 {
        self.rate_per_s / (1.0 - self.part * self.part).powf(1.5)
    }

    /// The bend after so many seconds.
    pub(super) fn bend(&self, since_s: f64) -> f64 {
        if self.part == 0.0 {
            return self.begun;
        }
        let wanted = self.held - self.rate_per_s * since_s;
        // g(q) is below its asymptote 1 − ln(2/q) and concave in ln q: from there Newton's rule comes up to it from one side.
        let mut logarithm = wanted - 1.0 + std::f64::consts::LN_2;
        for _ in 0..60 {
            let part = logarithm.exp();
            let step = (wanted - held(part)) / (1.0 - part * part).sqrt();
            logarithm += step;
            if step <= 1e-14 * logarithm.abs() {
                break;
            }
        }
        self.begun * (logarithm.exp() / self.part)
    }
}

/// g(q).
fn held(part: f64) -> f64 {
    let root = (1.0 - part * part).max(0.0).sqrt();
    root - ((1.0 + root) / part).ln()
}

/// The states of a massless piece that creeps home.
#[derive(Clone, Copy, Debug)]
pub(super) struct Creep {
    pub(super) decay: Decay,
    /// When it began, s.
    pub(super) from_s: f64,
    /// Which state the bend is.
    pub(super) bend: usize,
    /// Which state the piece's place is, if any, where it was (m), and by how much it moves with the bend (m).
    pub(super) piece: Option<(usize, f64, f64)>,
}

impl Creep {
    /// Which states creep.
    pub(super) fn places(&self) -> impl Iterator<Item = usize> + use<> {
        [Some(self.bend), self.piece.map(|(place, ..)| place)].into_iter().flatten()
    }

    /// Puts them where they are at an instant.
    pub(super) fn put(&self, time_s: f64, state: &mut [f64]) {
        let bend = self.decay.bend(time_s - self.from_s);
        state[self.bend] = bend;
        if let Some((place, held_m, by_bend_m)) = self.piece {
            state[place] = held_m + by_bend_m * (bend - self.decay.begun);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The closed form against its equation, from hardly bent to bent as far as bristles can be, short and long ones.
    #[test]
    fn it_falls_as_its_equation_says() {
        for (springs, bristles, presliding_m) in [(25e3, 1e6, 1e-5), (150e3, 5e3, 1e-3), (25e3, 3e7, 1e-6)] {
            for begun in [1.0, -0.999, 0.3, -1e-4] {
                let creep_m_per_s = 3e-4;
                let decay = Decay::new(begun, springs, bristles, presliding_m, creep_m_per_s);
                assert!((decay.bend(0.0) / begun - 1.0).abs() < 1e-6, "{begun}: {}", decay.bend(0.0));
                for since_s in [1e-3, 0.01, 0.1, 0.5] {
                    let step_s = 1e-5 * since_s;
                    let [before, here, after] = [-1.0, 0.0, 1.0].map(|steps| decay.bend(since_s + steps * step_s));
                    let both = springs + bristles;
                    let root = (both * both - (bristles * here).powi(2)).sqrt();
                    let expected = -springs * creep_m_per_s / presliding_m * here / root;
                    let rate = (after - before) / (2.0 * step_s);
                    assert!((rate / expected - 1.0).abs() < 1e-5, "{begun} after {since_s} s: {rate} for {expected}");
                }
            }
        }
    }

    #[test]
    fn what_holds_nothing_stays_as_it_is() {
        let decay = Decay::new(0.7, 25e3, 0.0, 1e-5, 3e-4);
        assert!((decay.bend(1.0) - 0.7).abs() < f64::EPSILON);
    }
}
