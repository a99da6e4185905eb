//! A massless piece that creeps in a force that depends on its rate finds its balance a thousand times faster than the
//! impact goes: a stiff equation. Rodas, a stiffly accurate Rosenbrock method of order 4(3), needs one small linear system
//! and no iteration for a step:
//!
//! ```text
//! (1/(γh) − J)·k_i = f(t + α_i·h, y + Σ a_ij·k_j) + Σ c_ij/h·k_j + d_i·h·∂f/∂t,    y' = y + Σ m_j·k_j
//! ```
//!
//! The workspace's library has only fully implicit methods for this, whose iterations and matrices on the heap take five times
//! as long for three states.
//!
//! Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), section IV.7 and code RODAS, method 1.

use super::motion::{MOST_STATES, Mode, System};

const STAGES: usize = 6;
const GAMMA: f64 = 0.25;
const ALPHA: [f64; STAGES] = [0.0, 0.386, 0.21, 0.63, 1.0, 1.0];
/// The last stages sum their own first four, then also the ones between.
const A: [[f64; STAGES]; STAGES] = [
    [0.0; STAGES],
    [1.544, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.946_678_528_081_582_6, 0.255_701_169_898_328_4, 0.0, 0.0, 0.0, 0.0],
    [3.314_825_187_068_521, 2.896_124_015_972_201, 0.998_641_913_997_781_7, 0.0, 0.0, 0.0],
    [1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895, 0.0, 0.0],
    [1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895, 1.0, 0.0],
];
const C: [[f64; STAGES]; STAGES] = [
    [0.0; STAGES],
    [-5.6688, 0.0, 0.0, 0.0, 0.0, 0.0],
    [-2.430_093_356_833_875, -0.206_359_915_709_191_5, 0.0, 0.0, 0.0, 0.0],
    [-0.107_352_905_815_137_5, -9.594_562_251_023_355, -20.470_286_148_096_16, 0.0, 0.0, 0.0],
    [7.496_443_313_967_647, -10.246_804_314_643_52, -33.999_903_528_199_05, 11.708_908_932_061_6, 0.0, 0.0],
    [
        8.083_246_795_921_522,
        -7.981_132_988_064_893,
        -31.521_594_328_743_71,
        16.319_305_431_231_36,
        -6.058_818_238_834_054,
        0.0,
    ],
];
const D: [f64; STAGES] = [0.25, -0.1043, 0.1035, -0.036_2, 0.0, 0.0];

/// The dense output of order 3: y + s·(y' − y) + s·(1 − s)·(Σ h₂_j·k_j + s·Σ h₃_j·k_j). It takes no rate at the step's end,
/// which the stiff piece has only as exactly as its place times its stiffness.
const DENSE: [[f64; STAGES - 1]; 2] = [
    [
        10.126_235_083_445_86,
        -7.487_995_877_610_167,
        -34.800_918_615_557_47,
        -7.992_771_707_568_823,
        1.025_137_723_295_662,
    ],
    [
        -0.676_280_339_280_125_3,
        6.087_714_651_680_015,
        16.430_843_208_924_78,
        24.767_225_114_183_86,
        -6.594_389_125_716_872,
    ],
];

/// No step is longer than this angle of the ideal pulse at the default accuracy, so that the dense output, whose error the
/// step's own estimate does not see, is as exact.
const STEP_RADIANS: f64 = 0.1;

/// And where the robot has gone, and what creeps home does not swing.
const LEFT_RADIANS: f64 = 1.0;

/// By how much the estimate may be above the tolerance: it is the error of the companion of order 3, which that of the
/// step itself is far below.
const COMPANION: f64 = 3.0;

/// What counts as a small position (m), velocity (m/s) or state of a law in a difference quotient.
const SMALL_STATE: f64 = 1e-4;

/// A time (s) over which a drive changes little and a difference quotient is exact enough.
const SMALL_TIME_S: f64 = 1e-7;

/// A solver for one stiff form, with the same duties as the library's.
pub(super) struct Rosenbrock<const N: usize> {
    absolute: [f64; N],
    relative: f64,
    longest_s: f64,
    next_s: f64,
    /// The last trial was too long: the next step is no longer than the one that is kept now.
    shortened: bool,
    from_s: f64,
    to_s: f64,
    /// States at the step's begin and end, the rates at its end, and what bends the line between them.
    from: [f64; N],
    to: [f64; N],
    rates: [f64; N],
    dense: [[f64; N]; 2],
}

impl<const N: usize> Rosenbrock<N> {
    /// From these states on, with tolerances of the states; `finer` is 1 at the default accuracy and less at a finer one.
    pub(super) fn new(
        system: &System,
        mode: &Mode,
        time_s: f64,
        state: &[f64; N],
        (relative, finer): (f64, f64),
        tolerances: &[f64; MOST_STATES],
    ) -> Self {
        let radians = if mode.touching || system.swings() { STEP_RADIANS } else { LEFT_RADIANS };
        let longest_s = radians * finer.powf(0.25) / system.pulsation_per_s();
        let mut absolute = [0.0; N];
        absolute.copy_from_slice(&tolerances[..N]);
        let mut rates = [0.0; N];
        system.rates(time_s, state, mode, &mut rates);
        Self {
            absolute,
            relative,
            longest_s,
            next_s: 0.02 * longest_s,
            shortened: false,
            from_s: time_s,
            to_s: time_s,
            from: *state,
            to: *state,
            rates,
            dense: [[0.0; N]; 2],
        }
    }

    /// Tries a step: how often the equations were evaluated, and whether the step is kept. A step that can become no shorter is
    /// kept with no length.
    pub(super) fn step(&mut self, system: &System, mode: &Mode) -> (usize, bool) {
        let (time_s, length_s) = (self.to_s, self.next_s);
        if length_s < 4.0 * f64::EPSILON * time_s.max(1e-6) {
            self.from_s = self.to_s;
            return (0, true);
        }
        let (state, rates) = (self.to, self.rates);
        let states = system.states();
        let mut evaluations = 0;
        let mut evaluate = |time_s: f64, state: &[f64; N]| {
            let mut rates = [0.0; N];
            system.rates(time_s, state, mode, &mut rates);
            evaluations += 1;
            rates
        };
        let mut matrix = [[0.0; N]; N];
        for column in 0..states {
            let mut moved = state;
            let by = 1e-7 * state[column].abs().max(SMALL_STATE);
            moved[column] += by;
            let moved_rates = evaluate(time_s, &moved);
            for row in 0..states {
                matrix[row][column] = (rates[row] - moved_rates[row]) / by;
            }
        }
        for (place, row) in matrix.iter_mut().enumerate() {
            row[place] += 1.0 / (GAMMA * length_s);
        }
        let order = decompose(&mut matrix, states);
        let mut by_time = [0.0; N];
        if system.is_timed(mode) {
            let later = evaluate(time_s + SMALL_TIME_S, &state);
            for place in 0..states {
                by_time[place] = (later[place] - rates[place]) / SMALL_TIME_S;
            }
        }
        let mut stages = [[0.0; N]; STAGES];
        for stage in 0..STAGES {
            let mut right = if stage == 0 {
                rates
            } else {
                let mut inner = state;
                for (factor, earlier) in A[stage].iter().zip(&stages[..stage]) {
                    inner.iter_mut().zip(earlier).for_each(|(inner, earlier)| *inner += factor * earlier);
                }
                evaluate(time_s + ALPHA[stage] * length_s, &inner)
            };
            for (factor, earlier) in C[stage].iter().zip(&stages[..stage]) {
                right.iter_mut().zip(earlier).for_each(|(right, earlier)| *right += factor / length_s * earlier);
            }
            for (right, by_time) in right.iter_mut().zip(&by_time) {
                *right += D[stage] * length_s * by_time;
            }
            stages[stage] = solve(&matrix, &order, &right, states);
        }
        let mut after = state;
        for (factor, stage) in A[STAGES - 1].iter().zip(&stages[..STAGES - 1]) {
            after.iter_mut().zip(stage).for_each(|(after, stage)| *after += factor * stage);
        }
        let correction = stages[STAGES - 1];
        let mut error = 0.0_f64;
        for place in 0..states {
            after[place] += correction[place];
            let scale = self.absolute[place] + self.relative * state[place].abs().max(after[place].abs());
            let part = correction[place].abs() / scale;
            error = if part.is_finite() { error.max(part) } else { f64::INFINITY };
        }
        let factor = (0.9 * (error / COMPANION).powf(-0.25)).clamp(0.2, if self.shortened { 1.0 } else { 3.0 });
        self.shortened = error > COMPANION;
        if self.shortened {
            self.next_s = length_s * factor;
            return (evaluations, false);
        }
        let after_s = time_s + length_s;
        let after_rates = evaluate(after_s, &after);
        self.from = self.to;
        self.to = after;
        self.rates = after_rates;
        self.dense = [[0.0; N]; 2];
        for (bend, factors) in self.dense.iter_mut().zip(&DENSE) {
            for (factor, stage) in factors.iter().zip(&stages) {
                bend.iter_mut().zip(stage).for_each(|(bend, stage)| *bend += factor * stage);
            }
        }
        (self.from_s, self.to_s) = (time_s, after_s);
        self.next_s = (length_s * factor).min(self.longest_s);
        (evaluations, true)
    }

    /// Begin and end of the last step.
    pub(super) fn ends_s(&self) -> (f64, f64) {
        (self.from_s, self.to_s)
    }

    /// The states within the last step.
    pub(super) fn interpolate(&self, time_s: f64) -> [f64; N] {
        let part = (time_s - self.from_s) / (self.to_s - self.from_s);
        let rest = 1.0 - part;
        std::array::from_fn(|place| {
            let bend = self.dense[0][place] + part * self.dense[1][place];
            self.from[place] * rest + part * (self.to[place] + rest * bend)
        })
    }
}

/// Gauss's elimination in place, with the order of the rows. A matrix without an inverse gives a step that is not a number
/// and is tried again.
fn decompose<const N: usize>(matrix: &mut [[f64; N]; N], states: usize) -> [usize; N] {
    let mut order = std::array::from_fn(|place| place);
    for column in 0..states {
        let best = (column..states).max_by(|a, b| matrix[*a][column].abs().total_cmp(&matrix[*b][column].abs()));
        let best = best.unwrap_or(column);
        matrix.swap(column, best);
        order.swap(column, best);
        let pivot = matrix[column];
        for row in &mut matrix[column + 1..states] {
            let factor = row[column] / pivot[column];
            for place in column + 1..states {
                row[place] -= factor * pivot[place];
            }
            row[column] = factor;
        }
    }
    order
}

fn solve<const N: usize>(matrix: &[[f64; N]; N], order: &[usize; N], right: &[f64; N], states: usize) -> [f64; N] {
    let mut solution = [0.0; N];
    for row in 0..states {
        let known: f64 = (0..row).map(|place| matrix[row][place] * solution[place]).sum();
        solution[row] = right[order[row]] - known;
    }
    for row in (0..states).rev() {
        let known: f64 = (row + 1..states).map(|place| matrix[row][place] * solution[place]).sum();
        solution[row] = (solution[row] - known) / matrix[row][row];
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_of_equations_is_solved_with_its_rows_in_any_order() {
        let rows = [[0.0, 2.0, 1.0], [4.0, -1.0, 0.5], [1.0, 1.0, -3.0]];
        let wanted = [1.5, -2.0, 0.25];
        let right = rows.map(|row| row.iter().zip(wanted).map(|(factor, value)| factor * value).sum::<f64>());
        let mut matrix = rows;
        let order = decompose(&mut matrix, 3);
        for (value, wanted) in solve(&matrix, &order, &right, 3).iter().zip(wanted) {
            assert!((value - wanted).abs() < 1e-14);
        }
    }
}
