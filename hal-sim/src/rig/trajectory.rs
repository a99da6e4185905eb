//! The motion as the solver's own dense output: a polynomial for each step, kept for any later instant.
//!
//! The interpolant of a step is a polynomial in time. It is sampled at as many equally spaced nodes as
//! determine it (7 for degree 6, 4 for degree 3) and kept as divided differences (Newton's form), so that
//! nothing is lost and the solver's private coefficients are not needed.

use super::motion::Mode;

/// The steps of a motion, one after the other without gaps.
#[derive(Debug)]
pub(super) struct Trajectory {
    states: usize,
    stretches: Vec<Stretch>,
    /// For each stretch, for each node, the states' divided differences.
    differences: Vec<f64>,
}

/// A stretch of the motion with one form of the equations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    pub(super) start_s: f64,
    /// Where the stretch ends; an event may cut a step short.
    pub(super) end_s: f64,
    /// The length of the step that the polynomial spans.
    step_s: f64,
    nodes: usize,
    first: usize,
    pub(super) mode: Mode,
}

impl Trajectory {
    pub(super) fn new(states: usize) -> Self {
        Self { states, stretches: Vec::with_capacity(64), differences: Vec::with_capacity(64 * 8 * states) }
    }

    /// Adds a step that is given by its states at equally spaced nodes, first and last instant included.
    pub(super) fn push<const N: usize>(
        &mut self,
        start_s: f64,
        step_s: f64,
        end_s: f64,
        nodes: &[[f64; N]],
        mode: Mode,
    ) {
        let first = self.differences.len();
        let count = nodes.len();
        for node in nodes {
            self.differences.extend_from_slice(&node[..self.states]);
        }
        let table = &mut self.differences[first..];
        for order in 1..count {
            let over = (count - 1) as f64 / order as f64;
            for node in (order..count).rev() {
                for state in 0..self.states {
                    let here = node * self.states + state;
                    table[here] = (table[here] - table[here - self.states]) * over;
                }
            }
        }
        self.stretches.push(Stretch { start_s, end_s, step_s, nodes: count, first, mode });
    }

    pub(super) fn stretches(&self) -> &[Stretch] {
        &self.stretches
    }

    /// The number of the stretch that holds this instant; the first or the last one outside of all.
    pub(super) fn find(&self, time_s: f64) -> usize {
        self.stretches.partition_point(|stretch| stretch.end_s <= time_s).min(self.stretches.len() - 1)
    }

    /// The states at an instant of a stretch.
    pub(super) fn state(&self, stretch: usize, time_s: f64, state: &mut [f64]) {
        let stretch = &self.stretches[stretch];
        let part = (time_s - stretch.start_s) / stretch.step_s;
        let table = &self.differences[stretch.first..stretch.first + stretch.nodes * self.states];
        let last = stretch.nodes - 1;
        state[..self.states].copy_from_slice(&table[last * self.states..]);
        for node in (0..last).rev() {
            let factor = part - node as f64 / last as f64;
            let row = &table[node * self.states..(node + 1) * self.states];
            for (value, difference) in state.iter_mut().zip(row) {
                *value = *value * factor + difference;
            }
        }
    }
}
