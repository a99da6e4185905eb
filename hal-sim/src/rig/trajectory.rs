//! The motion as the solver's own dense output: a polynomial for each step, kept for any later instant.
//!
//! The interpolant of a step is a polynomial in time. It is sampled at as many equally spaced nodes as
//! determine it (7 for degree 6, 4 for degree 3) and kept as divided differences (Newton's form), so that
//! nothing is lost and the solver's private coefficients are not needed. What instruments read is kept beside the states
//! in the same way, so that sampling it costs one polynomial and not the balance of the whole rig.

use super::motion::Mode;

/// The most nodes that a step has.
pub(super) const MOST_NODES: usize = 7;

/// What instruments read beside the states.
pub(super) const READINGS: usize = 3;

/// One of them.
#[derive(Clone, Copy, Debug)]
pub(super) enum Reading {
    /// The force at the cell, N.
    Cell,
    /// The robot's acceleration, m/s².
    Acceleration,
    /// The stroke of the springs, m.
    Stroke,
}

/// The steps of a motion, one after the other without gaps.
#[derive(Debug)]
pub(super) struct Trajectory {
    /// The states, then the readings.
    columns: usize,
    stretches: Vec<Stretch>,
    /// For each stretch, for each node, the columns' divided differences.
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
        let columns = states + READINGS;
        Self { columns, stretches: Vec::with_capacity(64), differences: Vec::with_capacity(64 * 8 * columns) }
    }

    /// Adds a step that is given by its states and readings at equally spaced nodes, first and last instant included.
    pub(super) fn push<const N: usize>(
        &mut self,
        start_s: f64,
        step_s: f64,
        end_s: f64,
        nodes: &[[f64; N]],
        readings: &[[f64; READINGS]],
        mode: Mode,
    ) {
        let first = self.differences.len();
        let count = nodes.len();
        for (node, readings) in nodes.iter().zip(readings) {
            self.differences.extend_from_slice(&node[..self.columns - READINGS]);
            self.differences.extend_from_slice(readings);
        }
        let table = &mut self.differences[first..];
        for order in 1..count {
            let over = (count - 1) as f64 / order as f64;
            for node in (order..count).rev() {
                for column in 0..self.columns {
                    let here = node * self.columns + column;
                    table[here] = (table[here] - table[here - self.columns]) * over;
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
        let table = &self.differences[stretch.first..stretch.first + stretch.nodes * self.columns];
        let last = stretch.nodes - 1;
        let states = self.columns - READINGS;
        state[..states].copy_from_slice(&table[last * self.columns..][..states]);
        for node in (0..last).rev() {
            let factor = part - node as f64 / last as f64;
            let row = &table[node * self.columns..][..states];
            for (value, difference) in state.iter_mut().zip(row) {
                *value = *value * factor + difference;
            }
        }
    }

    /// What an instrument reads at instants of a stretch.
    pub(super) fn reading(&self, stretch: usize, reading: Reading, times_s: &[f64], values: &mut [f64]) {
        self.column(stretch, self.columns - READINGS + reading as usize, times_s, values);
    }

    /// One of the states at instants of a stretch, or of the readings behind them.
    pub(super) fn column(&self, stretch: usize, column: usize, times_s: &[f64], values: &mut [f64]) {
        let stretch = &self.stretches[stretch];
        let table = &self.differences[stretch.first..stretch.first + stretch.nodes * self.columns];
        let last = stretch.nodes - 1;
        let mut differences = [0.0; MOST_NODES];
        let mut places = [0.0; MOST_NODES];
        for (node, row) in table.chunks_exact(self.columns).enumerate() {
            differences[node] = row[column];
            places[node] = node as f64 / last as f64;
        }
        if differences[1..].iter().all(|difference| *difference == 0.0) {
            values.fill(differences[0]);
            return;
        }
        for (time_s, value) in times_s.iter().zip(values) {
            let part = (time_s - stretch.start_s) / stretch.step_s;
            let mut sum = 0.0;
            // All nodes, also those that a shorter polynomial leaves at zero, so that the loop is unrolled.
            for node in (0..MOST_NODES).rev() {
                sum = sum * (part - places[node]) + differences[node];
            }
            *value = sum;
        }
    }
}
