//! Body springs and pad in series, of which the force shows one stiffness.
//!
//! 1/k = 1/k_b + 1/k_p is known to a few parts in 10⁵ where the noise is low; how the two share it, only by what is stated of each. In
//! ln k_b and ln k_p that valley is narrow and curved. A straight step leaves it, and difference quotients by both logarithms differ in
//! their last digits, which looks like a slope across it: fits crept along the valley and stopped many stated deviations from where they
//! were going. So a step is bent until k changes by what the straight one promised, ∂ln k/∂ln k_b = k/k_b and ∂ln k/∂ln k_p = k/k_p, and
//! the derivative by one of the two is taken along the valley. What a recording's springs differ from the others' is a factor on both,
//! and on k.

use super::layout::{Layout, Point, Role};
use super::problem::Problem;

/// Where a point has the logarithms of both springs, and what is stated.
#[derive(Clone, Copy, Debug)]
pub struct Series {
    body: usize,
    pad: usize,
    stated: Springs,
}

/// Both springs as they are somewhere, N/m.
#[derive(Clone, Copy, Debug)]
struct Springs {
    body: f64,
    pad: f64,
}

/// The derivative by the stiffer spring, of which less is seen, from that by the softer one.
#[derive(Clone, Copy, Debug)]
pub struct Valley {
    /// The coordinate that is moved along the valley.
    pub stiffer: usize,
    /// The one that makes room for it.
    pub softer: usize,
    /// ∂ln k/∂ of the stiffer one over that of the softer one, which is how much of the softer one's compliance it has: so much of the
    /// derivative by the softer one is missing along the valley.
    pub ratio: f64,
}

impl Springs {
    fn in_series(self) -> f64 {
        1.0 / (1.0 / self.body + 1.0 / self.pad)
    }

    /// ln k after a change of both logarithms, as the tangent has it.
    fn promised(self, body: f64, pad: f64) -> f64 {
        let series = self.in_series();
        series.ln() + series / self.body * body + series / self.pad * pad
    }
}

impl Series {
    /// Of this layout; `None` where there is one spring only.
    #[must_use]
    pub fn of(problem: &Problem, layout: &Layout) -> Option<Self> {
        let global = |role| layout.globals.iter().position(|coordinate| coordinate.role == role);
        let stated =
            Springs { body: problem.rig.body_stiffness_n_per_m?.value, pad: problem.rig.pad_stiffness_n_per_m?.value };
        Some(Self { body: global(Role::Body)?, pad: global(Role::Pad)?, stated })
    }

    fn springs(&self, point: &Point) -> Springs {
        Springs {
            body: self.stated.body * point.globals[self.body].exp(),
            pad: self.stated.pad * point.globals[self.pad].exp(),
        }
    }

    /// The valley at a point.
    #[must_use]
    pub fn valley(&self, point: &Point) -> Valley {
        let springs = self.springs(point);
        if springs.body > springs.pad {
            Valley { stiffer: self.body, softer: self.pad, ratio: springs.pad / springs.body }
        } else {
            Valley { stiffer: self.pad, softer: self.body, ratio: springs.body / springs.pad }
        }
    }

    /// Bends the step from one point to another.
    pub fn bend(&self, from: &Point, to: &mut Point) {
        let by_body = to.globals[self.body] - from.globals[self.body];
        let by_pad = to.globals[self.pad] - from.globals[self.pad];
        // Both by the same moves k by as much.
        let missing = self.springs(from).promised(by_body, by_pad) - self.springs(to).in_series().ln();
        to.globals[self.body] += missing;
        to.globals[self.pad] += missing;
    }
}

impl Valley {
    /// A point further along: the stiffer spring moved, the softer one so that both together stay as they are.
    #[must_use]
    pub fn along(&self, point: &Point, step: f64) -> Point {
        let mut moved = point.clone();
        moved.globals[self.stiffer] += step;
        moved.globals[self.softer] -= (self.ratio * -(-step).exp_m1()).ln_1p();
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATED: Series = Series { body: 0, pad: 1, stated: Springs { body: 75e3, pad: 25e3 } };

    fn at(body: f64, pad: f64) -> Point {
        Point { globals: vec![body, pad], locals: Vec::new() }
    }

    #[test]
    fn the_valley_keeps_what_both_are_together() {
        for (point, stiffer) in [(at(0.1, -0.2), 0), (at(-0.8, 0.9), 1)] {
            let valley = STATED.valley(&point);
            assert_eq!(valley.stiffer, stiffer);
            let moved = valley.along(&point, 0.05);
            let series = |point: &Point| STATED.springs(point).in_series();
            assert!((series(&moved) / series(&point) - 1.0).abs() < 1e-14);
            assert!((moved.globals[stiffer] - point.globals[stiffer] - 0.05).abs() < 1e-15);
        }
    }

    #[test]
    fn a_bent_step_changes_both_together_by_what_the_tangent_promised() {
        let (from, mut to) = (at(0.1, -0.2), at(-0.15, 0.02));
        let promised = STATED.springs(&from).promised(-0.25, 0.22);
        let straight = STATED.springs(&to).in_series().ln();
        STATED.bend(&from, &mut to);
        let bent = STATED.springs(&to).in_series().ln();
        assert!((straight - promised).abs() > 1e-3 && (bent - promised).abs() < 1e-14);
    }
}
