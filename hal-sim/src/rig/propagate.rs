//! Where the equations between two events are linear, ẏ = A·y + b, the motion is known: y(t + δ) = e^(Aδ)·y(t) + ψ(δ),
//! ψ(δ) = ∫₀^δ e^(As)ds·b.
//!
//! A and b are read off the equations themselves. e^(Aδ) and ψ come from their series for a very short δ and are doubled
//! from there, e^(2Aδ) = (e^(Aδ))², ψ(2δ) = ψ(δ) + e^(Aδ)·ψ(δ) (scaling and squaring: C. Moler, C. Van Loan, SIAM Review 45
//! (2003) 3, method 3), so that all step lengths of a ladder are at hand. A step is seven states, each exact, and the
//! polynomial through them; only the latter has an error, by which the step's length is chosen. What [creeps] home meanwhile is known as well,
//! and nothing else depends on it.
//!
//! [creeps]: super::creep

use super::creep::Creep;
use super::motion::{MOST_STATES, Mode, System};
use super::trajectory::MOST_NODES;

/// The largest |Aδ| at which the series begins; twelve terms are then exact to rounding.
const SERIES_UP_TO: f64 = 0.25;
const SERIES_TERMS: u32 = 12;

/// The error of a polynomial of degree 6 through 7 equally spaced nodes over a length h is at most
/// max|∏(x − k/6)|·h⁷·|y⁗‴|/7!, and the product is largest near the middle of the outer intervals: 2.9·10⁻⁴.
const NODES_PRODUCT: f64 = 2.9e-4 / 5040.0;

/// A step has so many intervals between its nodes.
const INTERVALS: f64 = (MOST_NODES - 1) as f64;

/// A longer step is looked at again after so many steps at the latest.
const MOST_PATIENCE: usize = 32;

/// The part of the tolerance that the polynomial may use.
const SHARE: f64 = 0.2;

type Matrix<const N: usize> = [[f64; N]; N];

/// A solver for one linear form, with the same duties as the library's.
pub(super) struct Propagator<const N: usize> {
    rates: Matrix<N>,
    constant: [f64; N],
    /// A⁶ and A⁷, which give the seventh and eighth derivative.
    sixth: Matrix<N>,
    seventh: Matrix<N>,
    /// The shortest δ of the ladder, s, and for it and each doubling e^(Aδ) and ψ(δ).
    shortest_s: f64,
    rungs: Vec<(Matrix<N>, [f64; N])>,
    /// The rung of the last step.
    taken: usize,
    /// In how many steps a longer one is looked at again, and how many it was after the last look in vain.
    waits: usize,
    patience: usize,
    creep: Option<Creep>,
    absolute: [f64; N],
    relative: f64,
    stop_s: f64,
    from_s: f64,
    to_s: f64,
    nodes: [[f64; N]; MOST_NODES],
    /// Divided differences of the nodes.
    differences: [[f64; N]; MOST_NODES],
}

impl<const N: usize> Propagator<N> {
    /// For the form that holds at this instant, with tolerances of the states.
    pub(super) fn new(
        system: &System,
        mode: &Mode,
        (time_s, stop_s): (f64, f64),
        state: &[f64; N],
        relative: f64,
        tolerances: &[f64; MOST_STATES],
    ) -> Self {
        let mut constant = [0.0; N];
        system.rates(time_s, &[0.0; N], mode, &mut constant);
        let mut rates = [[0.0; N]; N];
        for column in 0..system.states() {
            let (mut unit, mut rate) = ([0.0; N], [0.0; N]);
            unit[column] = 1.0;
            system.rates(time_s, &unit, mode, &mut rate);
            for row in 0..N {
                rates[row][column] = rate[row] - constant[row];
            }
        }
        let creep = system.creep(time_s, state, mode);
        for place in creep.iter().flat_map(Creep::places) {
            (rates[place], constant[place]) = ([0.0; N], 0.0);
        }
        let square = product(&rates, &rates);
        let fourth = product(&square, &square);
        let sixth = product(&fourth, &square);
        let norm = rates.iter().map(|row| row.iter().map(|rate| rate.abs()).sum::<f64>()).fold(1.0, f64::max);
        let norm = creep.as_ref().map_or(norm, |creep| norm.max(creep.decay.fastest_per_s()));
        let shortest_s = (SERIES_UP_TO / norm).log2().floor().exp2();
        let first = series(&rates, &constant, shortest_s);
        let mut absolute = [0.0; N];
        absolute.copy_from_slice(&tolerances[..N]);
        Self {
            seventh: product(&sixth, &rates),
            sixth,
            rates,
            constant,
            creep,
            shortest_s,
            rungs: vec![first],
            taken: 0,
            waits: 0,
            patience: 1,
            absolute,
            relative,
            stop_s,
            from_s: time_s,
            to_s: time_s,
            nodes: [*state; MOST_NODES],
            differences: [[0.0; N]; MOST_NODES],
        }
    }

    /// Goes on by one step.
    pub(super) fn step(&mut self) {
        let state = self.nodes[MOST_NODES - 1];
        // How what creeps bends is not foretold.
        let foretold = if self.creep.is_some() { 0 } else { self.rung(&state) };
        self.from_s = self.to_s;
        let longest = self.rung_within(self.stop_s - self.from_s);
        self.waits = self.waits.saturating_sub(1);
        let wanted = (self.taken + usize::from(self.waits == 0)).min(longest);
        let mut rung = wanted;
        while rung > foretold && !self.try_rung(&state, rung) {
            rung -= 1;
        }
        if rung <= foretold {
            rung = foretold;
            self.follow(&state, rung);
        }
        if rung < wanted {
            // What rings is foretold as it is: ever more seldom it is worth a look.
            self.patience = (2 * self.patience).min(MOST_PATIENCE);
            self.waits = self.patience;
        } else if rung > foretold {
            self.patience = 1;
        }
        self.taken = rung;
        self.to_s = self.from_s + self.step_s(rung);
    }

    /// How long a step along a rung is, s.
    fn step_s(&self, rung: usize) -> f64 {
        INTERVALS * self.shortest_s * (rung as f64).exp2()
    }

    /// Steps along a rung; whether the polynomial meets the states between the outer nodes.
    fn try_rung(&mut self, state: &[f64; N], rung: usize) -> bool {
        self.follow(state, rung);
        let step_s = self.step_s(rung);
        let between = |node: usize| {
            let mut state = self.along(&self.nodes[node], rung - 1);
            if let Some(creep) = &self.creep {
                creep.put(self.from_s + (node as f64 + 0.5) / INTERVALS * step_s, &mut state);
            }
            state
        };
        let meets = |node: usize| {
            let (exact, met) = (between(node), self.at((node as f64 + 0.5) / INTERVALS));
            (0..N).all(|place| {
                let error = SHARE * (self.absolute[place] + self.relative * exact[place].abs());
                (exact[place] - met[place]).abs() <= error
            })
        };
        meets(0) && meets(MOST_NODES - 2)
    }

    /// Nodes along a rung, and the polynomial through them.
    fn follow(&mut self, state: &[f64; N], rung: usize) {
        while self.rungs.len() <= rung {
            let (transition, gain) = &self.rungs[self.rungs.len() - 1];
            let mut twice = apply(transition, gain);
            twice.iter_mut().zip(gain).for_each(|(twice, gain)| *twice += gain);
            let squared = product(transition, transition);
            self.rungs.push((squared, twice));
        }
        let step_s = self.step_s(rung);
        self.nodes[0] = *state;
        for node in 1..MOST_NODES {
            self.nodes[node] = self.along(&self.nodes[node - 1], rung);
            if let Some(creep) = &self.creep {
                creep.put(self.from_s + node as f64 / INTERVALS * step_s, &mut self.nodes[node]);
            }
        }
        self.differences = self.nodes;
        for order in 1..MOST_NODES {
            let over = INTERVALS / order as f64;
            for node in (order..MOST_NODES).rev() {
                for state in 0..N {
                    self.differences[node][state] =
                        (self.differences[node][state] - self.differences[node - 1][state]) * over;
                }
            }
        }
    }

    /// The state after one of these.
    fn along(&self, state: &[f64; N], rung: usize) -> [f64; N] {
        let (transition, gain) = &self.rungs[rung];
        let mut after = apply(transition, state);
        after.iter_mut().zip(gain).for_each(|(after, gain)| *after += gain);
        after
    }

    /// The rung whose step is short enough for its polynomial and no longer than needed, by the derivatives here.
    fn rung(&self, state: &[f64; N]) -> usize {
        let mut rate = apply(&self.rates, state);
        rate.iter_mut().zip(&self.constant).for_each(|(rate, constant)| *rate += constant);
        let (seventh, eighth) = (apply(&self.sixth, &rate), apply(&self.seventh, &rate));
        let mut longest_s = self.stop_s - self.to_s;
        for place in 0..N {
            let error = SHARE * (self.absolute[place] + self.relative * state[place].abs()) / NODES_PRODUCT;
            // Of an oscillation at least one of both is not near zero.
            longest_s = longest_s.min((error / seventh[place].abs()).powf(1.0 / 7.0));
            longest_s = longest_s.min((error / eighth[place].abs()).powf(1.0 / 8.0));
        }
        self.rung_within(longest_s)
    }

    /// The rung whose step is no longer than this, as far as there is one.
    fn rung_within(&self, longest_s: f64) -> usize {
        (longest_s / INTERVALS / self.shortest_s).log2().floor().max(0.0) as usize
    }

    /// Begin and end of the last step.
    pub(super) fn ends_s(&self) -> (f64, f64) {
        (self.from_s, self.to_s)
    }

    /// The states at the last step's equally spaced nodes.
    pub(super) fn nodes(&self) -> &[[f64; N]; MOST_NODES] {
        &self.nodes
    }

    /// The states within the last step.
    pub(super) fn interpolate(&self, time_s: f64) -> [f64; N] {
        self.at((time_s - self.from_s) / (self.to_s - self.from_s))
    }

    /// The polynomial after a part of the step.
    fn at(&self, part: f64) -> [f64; N] {
        let mut state = self.differences[MOST_NODES - 1];
        for node in (0..MOST_NODES - 1).rev() {
            let factor = part - node as f64 / INTERVALS;
            for (value, difference) in state.iter_mut().zip(&self.differences[node]) {
                *value = *value * factor + difference;
            }
        }
        state
    }
}

/// e^(Aδ) and ψ(δ) = δ·Σ (Aδ)ⁿ/(n + 1)!·b from their series.
fn series<const N: usize>(rates: &Matrix<N>, constant: &[f64; N], duration_s: f64) -> (Matrix<N>, [f64; N]) {
    let mut transition = [[0.0; N]; N];
    let mut term = [[0.0; N]; N];
    for place in 0..N {
        transition[place][place] = 1.0;
        term[place][place] = 1.0;
    }
    let mut sum = [[0.0; N]; N];
    for order in 1..=SERIES_TERMS {
        for row in 0..N {
            for column in 0..N {
                sum[row][column] += term[row][column] * duration_s / f64::from(order);
            }
        }
        term = product(&term, rates);
        for row in 0..N {
            for column in 0..N {
                term[row][column] *= duration_s / f64::from(order);
                transition[row][column] += term[row][column];
            }
        }
    }
    (transition, apply(&sum, constant))
}

fn product<const N: usize>(left: &Matrix<N>, right: &Matrix<N>) -> Matrix<N> {
    let mut product = [[0.0; N]; N];
    for (row, left) in product.iter_mut().zip(left) {
        for (factor, right) in left.iter().zip(right) {
            for (value, right) in row.iter_mut().zip(right) {
                *value += factor * right;
            }
        }
    }
    product
}

fn apply<const N: usize>(matrix: &Matrix<N>, vector: &[f64; N]) -> [f64; N] {
    let mut result = [0.0; N];
    for (value, row) in result.iter_mut().zip(matrix) {
        *value = row.iter().zip(vector).map(|(factor, value)| factor * value).sum();
    }
    result
}
