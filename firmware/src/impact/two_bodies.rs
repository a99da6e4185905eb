//! Robot and moving piece, as two bodies: the force at the cell from the first touch on.
//!
//! ```text
//!   x →                     y →
//!   robot m_R ──v──▶ ( pad k_p, c_p ( piece m )── springs k_b, c_b ──[ cell ]
//!
//!   m_R·ẍ = −P,   m·ÿ = P − k_b·y − c_b·ẏ,   P = k_p·(x − y) + c_p·(ẋ − ẏ),   F = k_b·y + c_b·ẏ
//!   x = y = ẏ = 0, ẋ = v at first touch; nothing pulls: P acts only while x > y and P > 0
//! ```
//!
//! As long as the piece stays with the robot these are two modes, F = A·(sin ωu − (ω/Ω)·sin Ωu) but for the damping. Behind a
//! hard pad, or none, it does not: it is kicked to nearly twice the robot's speed, flies ahead, comes back, and rattles
//! between robot and springs until its ring has died. Both are one motion here.
//!
//! What the force can tell of masses and stiffnesses is six numbers, for all of them may be larger by one factor and the
//! speed smaller. So k_b = 1, displacements are in newtons, times in samples, and the numbers are: slope s and curvature q of
//! the arc that a piece without mass would give, Ω = √((k_p + k_b)/m), the ratio r = k_p/k_b, and the damping ratios of Ω by
//! the pad and by the springs. With K = r/(1 + r)
//!
//! ```text
//! v = s/K,   1/m_R = q/K,   m = (1 + r)/Ω²,   c = 2ζ·(1 + r)/Ω
//! ```
//!
//! A pad that loses energy as it is compressed has P = k_p·(x − y)·(1 + η·(ẋ − ẏ)/v) besides (Hunt and Crossley), with η what
//! the speed of the touch adds.
//!
//! Without that, either form, touching or apart, is linear: one matrix takes the state from one point to the next, the series
//! of an exponential. Where the form changes between two points, the instant of the change is located by two steps of Newton,
//! and the same series leads to it and on from it. The loss is half a kick before each step and half after it (Strang), which is off
//! by the step's square.

/// Displacement and speed of the robot, and of the piece.
type State = [f32; 4];
type Matrix = [[f32; 4]; 4];

/// Terms of the exponential: points are an eighth of a period apart at most, where (τ/8)⁹/9! = 3e-7 is left.
const TERMS: usize = 8;
/// Terms to and from a change of form, which is within a step.
const TERMS_WITHIN: usize = 6;
/// Most changes of form that are followed between two points.
const CHANGES: usize = 4;

/// What the force depends on besides the instant of the touch. Length of time is the sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bodies {
    /// s, N per sample.
    pub slope: f32,
    /// q, 1/sample².
    pub curvature: f32,
    /// Ω, radians per sample.
    pub pulsation: f32,
    /// r: stiffness of the pad over that of the springs.
    pub ratio: f32,
    /// Damping ratio of Ω by the pad alone.
    pub pad_damping: f32,
    /// Damping ratio of Ω by the springs alone.
    pub spring_damping: f32,
    /// η: share by which the speed of the touch makes the pad stiffer.
    pub loss: f32,
}

impl Bodies {
    /// Mass of the piece over that of the robot: m/m_R = (1 + r)/Ω²·q/K = q·(1 + r)²/(r·Ω²).
    pub fn mass_ratio(&self) -> f32 {
        let both = 1.0 + self.ratio;
        self.curvature * both * both / (self.ratio * self.pulsation * self.pulsation)
    }
}

/// The coefficients of the two equations.
#[derive(Clone, Copy)]
struct Equations {
    speed: f32,
    per_robot: f32,
    per_piece: f32,
    stiffness: f32,
    pad_damping: f32,
    spring_damping: f32,
    /// r·η/v.
    loss: f32,
}

impl Equations {
    fn of(bodies: &Bodies) -> Self {
        let both = 1.0 + bodies.ratio;
        let share = bodies.ratio / both;
        let damping = 2.0 * both / bodies.pulsation;
        Self {
            speed: bodies.slope / share,
            per_robot: bodies.curvature / share,
            per_piece: bodies.pulsation * bodies.pulsation / both,
            stiffness: bodies.ratio,
            pad_damping: damping * bodies.pad_damping,
            spring_damping: damping * bodies.spring_damping,
            loss: bodies.loss * bodies.ratio * share / bodies.slope,
        }
    }

    fn pad_force(&self, [x, x_rate, y, y_rate]: &State) -> f32 {
        self.stiffness * (x - y) + self.pad_damping * (x_rate - y_rate)
    }

    fn cell_force(&self, state: &State) -> f32 {
        state[2] + self.spring_damping * state[3]
    }

    /// Positive while they touch.
    fn margin(&self, state: &State) -> f32 {
        (self.stiffness * (state[0] - state[2])).min(self.pad_force(state))
    }

    fn rates(&self, state: &State, touching: bool) -> State {
        let pad = if touching { self.pad_force(state) } else { 0.0 };
        [state[1], -pad * self.per_robot, state[3], (pad - self.cell_force(state)) * self.per_piece]
    }

    /// What the pad's loss does to the speeds in `time`.
    fn lose(&self, state: &mut State, time: f32) {
        let [x, x_rate, y, y_rate] = *state;
        let impulse = self.loss * (x - y) * (x_rate - y_rate) * time;
        state[1] -= impulse * self.per_robot;
        state[3] += impulse * self.per_piece;
    }

    /// The state `time` later in this form.
    fn after(&self, state: &State, touching: bool, time: f32, terms: usize) -> State {
        let (mut sum, mut term) = (*state, *state);
        for order in 1..=terms {
            let rates = self.rates(&term, touching);
            let share = time / order as f32;
            for ((sum, term), rate) in sum.iter_mut().zip(&mut term).zip(rates) {
                *term = rate * share;
                *sum += *term;
            }
        }
        sum
    }

    fn matrix(&self, touching: bool, time: f32) -> Matrix {
        let mut matrix = [[0.0; 4]; 4];
        for column in 0..4 {
            let mut unit = [0.0; 4];
            unit[column] = 1.0;
            for (row, value) in matrix.iter_mut().zip(self.after(&unit, touching, time, TERMS)) {
                row[column] = value;
            }
        }
        matrix
    }
}

/// The motion, from point to point.
pub struct Walk {
    equations: Equations,
    state: State,
    touching: bool,
    /// Where the motion is, samples after the touch.
    at: f32,
    /// The step that the matrices are for, samples.
    step: f32,
    /// From one point to the next, where it has been needed: touching, and apart.
    touching_step: Option<Matrix>,
    apart_step: Option<Matrix>,
}

impl Walk {
    /// At first touch.
    pub fn new(bodies: &Bodies) -> Self {
        let equations = Equations::of(bodies);
        Self {
            equations,
            state: [0.0, equations.speed, 0.0, 0.0],
            touching: true,
            at: 0.0,
            step: 0.0,
            touching_step: None,
            apart_step: None,
        }
    }

    /// Mean force over the `width` samples about `u` samples after the touch, and its rate: N, and N per sample. Points come in
    /// the order of time.
    pub fn to(&mut self, u: f32, width: usize) -> (f32, f32) {
        let width = width as f32;
        let by = u - self.at;
        self.at = u;
        if self.touching {
            self.equations.lose(&mut self.state, 0.5 * by);
        }
        let next = if (by - width).abs() > 1e-3 {
            None
        } else {
            if self.step != width {
                (self.step, self.touching_step, self.apart_step) = (width, None, None);
            }
            let matrix = if self.touching { &mut self.touching_step } else { &mut self.apart_step };
            Some(product(matrix.get_or_insert_with(|| self.equations.matrix(self.touching, width)), &self.state))
        };
        match next {
            Some(next) if (self.equations.margin(&next) > 0.0) == self.touching => self.state = next,
            _ => self.change(by),
        }
        if self.touching {
            self.equations.lose(&mut self.state, 0.5 * by);
        }
        let rates = self.equations.rates(&self.state, self.touching);
        let force = self.equations.cell_force(&self.state);
        let rate = rates[2] + self.equations.spring_damping * rates[3];
        // The mean of w samples about the point: F + F″·(w² − 1)/24.
        let mean = force + rates[3] * ((width * width - 1.0) * (1.0 / 24.0));
        (mean, rate)
    }

    /// Goes on by `time`, from one form to the other where it must.
    fn change(&mut self, mut time: f32) {
        for _ in 0..CHANGES {
            let end = self.equations.after(&self.state, self.touching, time, TERMS_WITHIN);
            let (before, after) = (self.equations.margin(&self.state), self.equations.margin(&end));
            if (after > 0.0) == self.touching {
                self.state = end;
                return;
            }
            let mut until = time * (before / (before - after)).clamp(0.0, 1.0);
            let mut there = self.equations.after(&self.state, self.touching, until, TERMS_WITHIN);
            for _ in 0..2 {
                let [_, x_rate, _, y_rate] = there;
                let [_, x_second, _, y_second] = self.equations.rates(&there, self.touching);
                let (margin, slope) = if self.touching {
                    let slope = self.equations.stiffness * (x_rate - y_rate)
                        + self.equations.pad_damping * (x_second - y_second);
                    (self.equations.pad_force(&there), slope)
                } else {
                    (there[0] - there[2], x_rate - y_rate)
                };
                let step = margin / slope;
                if !step.is_finite() {
                    break;
                }
                until = (until - step).max(0.0).min(time);
                there = self.equations.after(&self.state, self.touching, until, TERMS_WITHIN);
            }
            self.state = there;
            self.touching = !self.touching;
            time -= until;
        }
        self.state = self.equations.after(&self.state, self.touching, time, TERMS_WITHIN);
    }
}

fn product(matrix: &Matrix, state: &State) -> State {
    let row = |row: &[f32; 4]| row[0] * state[0] + row[1] * state[1] + row[2] * state[2] + row[3] * state[3];
    [row(&matrix[0]), row(&matrix[1]), row(&matrix[2]), row(&matrix[3])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const SOFT: Bodies = Bodies {
        slope: 0.3,
        curvature: 8e-6,
        pulsation: 0.05,
        ratio: 2.3,
        pad_damping: 0.03,
        spring_damping: 0.01,
        loss: 0.0,
    };
    /// It lets go of the piece again and again.
    const HARD: Bodies = Bodies { ratio: 25.0, pulsation: 0.147, curvature: 1.6e-5, ..SOFT };
    const LOSSY: Bodies = Bodies { loss: 0.15, ..SOFT };

    fn walked(bodies: &Bodies, first: f32, width: usize, points: usize) -> Vec<f32> {
        let mut walk = Walk::new(bodies);
        (0..points).map(|point| walk.to(first + (point * width) as f32, width).0).collect()
    }

    /// The forces at `first`, `first` + 1, …, by Runge and Kutta in double precision and small steps.
    fn integrated(bodies: &Bodies, first: f64, samples: usize) -> Vec<f64> {
        const PER_SAMPLE: usize = 500;
        let [ratio, pulsation, loss] = [bodies.ratio, bodies.pulsation, bodies.loss].map(f64::from);
        let (both, share) = (1.0 + ratio, ratio / (1.0 + ratio));
        let speed = f64::from(bodies.slope) / share;
        let per_robot = f64::from(bodies.curvature) / share;
        let mass = both / (pulsation * pulsation);
        let c = 2.0 * both / pulsation;
        let (pad, spring) = (c * f64::from(bodies.pad_damping), c * f64::from(bodies.spring_damping));
        let rates = |[x, x_rate, y, y_rate]: [f64; 4]| {
            let (depth, closing) = (x - y, x_rate - y_rate);
            let elastic = ratio * depth + pad * closing;
            let touching = depth >= 0.0 && elastic >= 0.0;
            let contact = if touching { elastic + ratio * depth * loss * closing / speed } else { 0.0 };
            [x_rate, -contact * per_robot, y_rate, (contact - y - spring * y_rate) / mass]
        };
        let step = |state: [f64; 4], h: f64| {
            let along = |rates: [f64; 4], h: f64| core::array::from_fn(|i| state[i] + h * rates[i]);
            let a = rates(state);
            let b = rates(along(a, h / 2.0));
            let c = rates(along(b, h / 2.0));
            let d = rates(along(c, h));
            core::array::from_fn(|i| state[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
        };
        let mut state = [0.0, speed, 0.0, 0.0];
        let mut forces = Vec::new();
        let mut by = first;
        for _ in 0..samples {
            for _ in 0..PER_SAMPLE {
                state = step(state, by / PER_SAMPLE as f64);
            }
            forces.push(state[2] + spring * state[3]);
            by = 1.0;
        }
        forces
    }

    #[test]
    fn in_128_steps_it_strays_little_from_double_precision() {
        for (bodies, near) in [(SOFT, 1e-5), (HARD, 5e-4), (LOSSY, 1e-3)] {
            for width in [1, 5] {
                let first = 0.4 + (width - 1) as f32 / 2.0;
                let found = walked(&bodies, first, width, 128);
                let expected = integrated(&bodies, 0.4f32.into(), 128 * width);
                let peak = expected.iter().copied().fold(0.0, f64::max);
                for (point, (found, samples)) in found.iter().zip(expected.chunks(width)).enumerate() {
                    let mean = samples.iter().sum::<f64>() / width as f64;
                    let off = (f64::from(*found) - mean).abs() / peak;
                    assert!(off < near, "{bodies:?}, width {width}, point {point}: {found} is {mean}");
                }
            }
        }
    }

    /// The rate is that of the force.
    #[test]
    fn a_later_touch_is_the_rate_backward() {
        for bodies in [SOFT, HARD, LOSSY] {
            let (early, late) = (walked(&bodies, 0.5, 1, 100), walked(&bodies, 0.52, 1, 100));
            let mut walk = Walk::new(&bodies);
            for point in 0..100 {
                let rate = walk.to(0.51 + point as f32, 1).1;
                let numeric = (late[point] - early[point]) / 0.02;
                assert!((rate - numeric).abs() < 0.02 * bodies.slope, "{bodies:?}, point {point}: {rate} {numeric}");
            }
        }
    }

    /// A robot, a piece and two springs without damping: two modes, in closed form from the 2×2 eigenvalue problem.
    #[test]
    fn without_damping_it_is_two_modes() {
        let (robot, piece, pad, body, speed, rate) = (6.0f64, 0.12, 80e3, 35e3, 0.25, 20_000.0);
        let (a, b) = (pad / robot, (pad + body) / piece);
        let root = libm::sqrt((a - b) * (a - b) + 4.0 * pad * pad / (robot * piece));
        let (slow, fast) = (libm::sqrt(0.5 * (a + b - root)), libm::sqrt(0.5 * (a + b + root)));
        // y⃛(0) = k_p·v/m and ẏ(0) = 0 fix both heights.
        let height = body * pad * speed / piece / (slow * (fast * fast - slow * slow));
        let series = pad * body / (pad + body);
        let bodies = Bodies {
            slope: (series * speed / rate) as f32,
            curvature: (series / robot / rate / rate) as f32,
            pulsation: (libm::sqrt(b) / rate) as f32,
            ratio: (pad / body) as f32,
            pad_damping: 0.0,
            spring_damping: 0.0,
            loss: 0.0,
        };
        assert!((bodies.mass_ratio() - 0.12 / 6.0).abs() < 1e-6, "{}", bodies.mass_ratio());
        for (n, found) in (1..).zip(walked(&bodies, 1.0, 1, 400)) {
            let t = f64::from(n) / rate;
            let force = height * (libm::sin(slow * t) - slow / fast * libm::sin(fast * t));
            assert!((f64::from(found) - force).abs() < 2e-5 * height, "{n}: {found} {force}");
        }
    }
}
