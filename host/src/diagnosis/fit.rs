//! Fits the coordinates of a layout to the recordings: Levenberg and Marquardt's method on whitened residuals, with what is
//! believed as further observations.
//!
//! ```text
//!        global   local of 1  of 2  of 3
//!      ┌        ┬─────────────────────┐
//!      │ A      │  B_1     B_2   B_3  │      each recording's local coordinates meet only the
//! JᵀJ =├────────┼─────────────────────┤      global ones: eliminated recording by recording
//!      │ B_iᵀ   │  D_1 … D_3          │      (Schur complement), what is left is small
//!      └        ┴─────────────────────┘
//! ```
//!
//! Source: D. W. Marquardt, SIAM J. Appl. Math. 11 (1963) 431; further steps along a tangent: J. Fan,
//! Math. Comp. 81 (2012) 447; block elimination: B. Triggs et al., Bundle Adjustment (2000), sec. 6.

use std::borrow::Cow;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use thud_sim::rig::Impact;

use super::layout::{Layout, Point, Role};
use super::predict;
use super::problem::Problem;
use super::series::Series;
use super::work::{following_ns, reading_ns};

/// An iteration that gains less than this in χ², or than this part of it, is the last.
const SMALL_GAIN: f64 = 0.02;
const SMALL_PART: f64 = 1e-6;
/// A step that foretells less than this part of it is not tried.
const FORETOLD: f64 = 0.25;
/// The most steps that are tried with growing damping before a fit is where it can be.
const MOST_TRIES: usize = 7;
/// How strongly the first step is damped.
const DAMPING: f64 = 1e-3;
/// Whitened residuals beyond this count as a spike: they pull with a constant force only (P. J. Huber, 1964).
const SPIKE: f64 = 8.0;

/// A sought instant that gains more than this in χ² was missed.
const TOUCHED: f64 = 1.0;
/// Instants of contact that are tried to either side, and how far they are apart, in samples.
const SHIFTS: i32 = 8;
const SHIFT_SAMPLES: f64 = 0.25;

/// Which coordinates move, and how long.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// The most iterations.
    pub iterations: usize,
    /// Whether the global coordinates move.
    pub globals: bool,
    /// Whether what is believed of each recording moves within its uncertainty.
    pub nuisances: bool,
    /// Whether what bends is looked at from both sides. (One side alone until it leads nowhere is no quicker: it takes more steps.)
    pub central: bool,
    /// The most further steps along one tangent, as long as each gains. (They leave a curved valley that the tangent leads along: a falling
    /// ball's drag was fitted with two thirds of its mass.)
    pub further: usize,
}

impl Effort {
    /// Until it converges.
    pub const FULL: Self = Self { iterations: 25, globals: true, nuisances: true, central: true, further: 0 };
    /// A look at how far it goes. (Along one tangent it costs a tenth of a diagnosis less, and lost the bristles of a real piston's friction.)
    pub const LOOK: Self = Self { iterations: 2, globals: true, nuisances: true, central: false, further: 0 };
    /// From where a fit to nearly the same recordings came to.
    pub const AGAIN: Self = Self { iterations: 4, globals: true, nuisances: true, central: true, further: 0 };
    /// Only what each recording has for itself.
    pub const LOCAL: Self = Self { iterations: 25, globals: false, nuisances: true, central: true, further: 0 };
    /// Only what is not believed at all: contact instants and offsets.
    pub const NOMINAL: Self = Self { iterations: 12, globals: false, nuisances: false, central: true, further: 0 };
}

/// A fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// What was free.
    pub layout: Layout,
    /// Where it came to.
    pub point: Point,
    /// χ²: squares of whitened residuals and of deviations from what is believed.
    pub cost: f64,
    /// Whitened residuals of each recording, all series one after the other: recording minus model.
    pub residuals: Vec<Vec<f64>>,
    /// The model's values of each recording.
    pub model: Vec<Vec<f64>>,
    /// What the last step took off χ²: nothing, where no step makes it better any more.
    pub gaining: f64,
    /// What it costs to follow and read its motions once, ns as [`super::work`] counts.
    pub motions_ns: u64,
    /// Shapes of mechanisms of which the recordings say less than what is likely does, as the last step has seen them.
    pub silent: usize,
}

/// The derivative of everything by all coordinates at a point.
#[derive(Clone, Debug)]
pub struct Tangent {
    recordings: Vec<RecordingTangent>,
    global_prior: DVector<f64>,
}

/// Columns of one recording, whitened.
#[derive(Clone, Debug)]
struct RecordingTangent {
    global: DMatrix<f64>,
    local: DMatrix<f64>,
    local_prior: DVector<f64>,
}

impl RecordingTangent {
    /// Where the recording's own coordinates go to imitate signatures with these Jᵀs, to first order.
    fn locally_imitated(&self, transposed: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        Some(self.local_normal()?.solve(transposed))
    }

    /// The factorised normal equations of the recording's own coordinates, nothing else moving.
    fn local_normal(&self) -> Option<Cholesky<f64, Dyn>> {
        let mut matrix = self.local.tr_mul(&self.local);
        for place in 0..matrix.ncols() {
            matrix[(place, place)] = matrix[(place, place)] * (1.0 + 1e-9) + self.local_prior[place].powi(2) + 1e-12;
        }
        matrix.cholesky()
    }
}

/// JᵀJ by blocks; what is believed of a recording's own coordinates is in theirs.
struct Products {
    recordings: Vec<RecordingProducts>,
    global_prior: DVector<f64>,
}

struct RecordingProducts {
    global: DMatrix<f64>,
    cross: DMatrix<f64>,
    local: DMatrix<f64>,
}

/// The factorised normal equations of a tangent.
pub struct Normal {
    blocks: Vec<Block>,
    schur: Cholesky<f64, Dyn>,
    scale: DVector<f64>,
}

struct Block {
    local: Cholesky<f64, Dyn>,
    local_scale: DVector<f64>,
    cross: DMatrix<f64>,
}

/// Projection of a signature on a tangent: what the coordinates would move to imitate it, of unit strength.
#[derive(Clone, Debug)]
pub struct Imitation {
    /// Change of each global coordinate.
    pub globals: DVector<f64>,
    /// Change of each recording's local coordinates.
    pub locals: Vec<DVector<f64>>,
}

fn small_gain(cost: f64) -> f64 {
    SMALL_GAIN.max(SMALL_PART * cost)
}

fn robust(residual: f64) -> f64 {
    let size = residual.abs();
    if size <= SPIKE { residual * residual } else { SPIKE * (2.0 * size - SPIKE) }
}

fn weight(residual: f64) -> f64 {
    (SPIKE / residual.abs().max(SPIKE)).sqrt()
}

/// The recordings that take part, by number.
pub type Part<'a> = &'a [usize];

impl Fit {
    /// Fits the recordings in `part` from a start. `None`: the start itself cannot be simulated.
    #[must_use]
    pub fn run(problem: &Problem, layout: Layout, start: Point, part: Part<'_>, effort: Effort) -> Option<Self> {
        let mut fit = Self::at(problem, layout, start, part)?;
        fit.converge(problem, part, effort);
        Some(fit)
    }

    /// The same from instants of contact nearby, where one of them was missed: a step keeps a tangent from finding it.
    #[must_use]
    pub fn touched(self, problem: &Problem, part: Part<'_>) -> Self {
        match Self::touching(problem, self.layout.clone(), self.point.clone(), part) {
            Some(touching) if touching.cost < self.cost - TOUCHED => touching.further(problem, part, Effort::FULL),
            _ => self,
        }
    }

    /// The same after more steps.
    #[must_use]
    pub fn further(mut self, problem: &Problem, part: Part<'_>, effort: Effort) -> Self {
        self.converge(problem, part, effort);
        self
    }

    fn converge(&mut self, problem: &Problem, part: Part<'_>, effort: Effort) {
        let mut damping = DAMPING;
        let mut motions = None;
        for _ in 0..effort.iterations {
            let Some(tangent) = self.tangent_of(problem, part, effort, motions.as_deref()) else { break };
            if effort.globals {
                self.silent = self.silent_in(&tangent);
            }
            let Some((better, moved)) = self.improve(problem, &tangent, part, effort, &mut damping) else {
                self.gaining = 0.0;
                break;
            };
            let gaining = self.cost - better.cost;
            *self = Self { gaining, silent: self.silent, ..better };
            motions = Some(moved);
            damping = (damping / 8.0).max(1e-9);
            if self.is_settled() {
                break;
            }
        }
    }

    /// How many shapes of mechanisms hardly move anything: less than the width of what is likely of them does.
    fn silent_in(&self, tangent: &Tangent) -> usize {
        let of_mechanism = |place: &usize| self.layout.globals[*place].role.entrant().is_some();
        let moves = |place: usize| -> f64 {
            tangent.recordings.iter().map(|recording| recording.global.column(place).norm_squared()).sum()
        };
        let places = (0..self.layout.globals.len()).filter(of_mechanism);
        places.filter(|&place| moves(place) < tangent.global_prior[place].powi(2)).count()
    }

    /// How many parameters its mechanisms have of which the recordings say something; one of each impact counts once.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.layout.parameters() - self.silent
    }

    /// Whether more steps would hardly make it better.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.gaining < small_gain(self.cost)
    }

    /// The residuals at a point, nothing moved.
    #[must_use]
    pub fn at(problem: &Problem, layout: Layout, point: Point, part: Part<'_>) -> Option<Self> {
        Self::moving_at(problem, layout, point, part).map(|(fit, _)| fit)
    }

    /// The same with the motions of the recordings in `part`.
    fn moving_at(problem: &Problem, layout: Layout, point: Point, part: Part<'_>) -> Option<(Self, Vec<Impact>)> {
        let moved: Option<Vec<(Vec<f64>, Impact)>> = part
            .par_iter()
            .map(|&recording| {
                let impact = predict::strike(problem, &layout, &point, recording).ok()?;
                let values = predict::read(problem, &layout, &point, recording, &impact, 0.0);
                values.iter().all(|value| value.is_finite()).then_some((values, impact))
            })
            .collect();
        let (model, motions): (Vec<_>, Vec<_>) = moved?.into_iter().unzip();
        let motions_ns = motions.iter().map(following_ns).sum::<u64>() + reading_ns(model.iter().map(Vec::len).sum());
        let mut all = vec![Vec::new(); problem.recordings.len()];
        for (recording, values) in part.iter().zip(model) {
            all[*recording] = values;
        }
        Some((Self { motions_ns, ..Self::showing(problem, layout, point, all, part) }, motions))
    }

    /// What is left where a model shows these values of each recording; none of what takes no part.
    #[must_use]
    pub fn showing(problem: &Problem, layout: Layout, point: Point, model: Vec<Vec<f64>>, part: Part<'_>) -> Self {
        let residuals: Vec<Vec<f64>> = problem
            .recordings
            .iter()
            .zip(&model)
            .map(|(recording, model)| if model.is_empty() { Vec::new() } else { recording.left_by(model) })
            .collect();
        let cost =
            residuals.iter().flatten().map(|r| robust(*r)).sum::<f64>() + prior_cost(problem, &layout, &point, part);
        Self { layout, point, cost, residuals, model, gaining: f64::INFINITY, motions_ns: 0, silent: 0 }
    }

    /// The same with every contact at the instant nearby that fits best, all else as given. A step at contact that moves past a sample is
    /// no smooth function of the instant: a tangent does not find it.
    #[must_use]
    pub fn touching(problem: &Problem, layout: Layout, mut point: Point, part: Part<'_>) -> Option<Self> {
        let contact = layout.locals.iter().position(|coordinate| coordinate.role == Role::Contact)?;
        let nearby: Option<Vec<(f64, Vec<f64>, u64)>> = part
            .par_iter()
            .map(|&recording| {
                let impact = predict::strike(problem, &layout, &point, recording).ok()?;
                let prepared = &problem.recordings[recording];
                let shown = (-SHIFTS..=SHIFTS).map(|shift| {
                    let shift_s = f64::from(shift) * SHIFT_SAMPLES * prepared.sample_s;
                    let values = predict::read(problem, &layout, &point, recording, &impact, shift_s);
                    let cost = prepared.left_by(&values).into_iter().map(robust).sum::<f64>();
                    (cost, shift_s, values)
                });
                let (_, shift_s, values) = shown.min_by(|a, b| a.0.total_cmp(&b.0))?;
                let motion_ns = following_ns(&impact) + reading_ns(values.len());
                values.iter().all(|value| value.is_finite()).then_some((shift_s, values, motion_ns))
            })
            .collect();
        let mut model = vec![Vec::new(); problem.recordings.len()];
        let mut motions_ns = 0;
        for (&recording, (shift_s, values, motion_ns)) in part.iter().zip(nearby?) {
            point.locals[recording][contact] += shift_s;
            model[recording] = values;
            motions_ns += motion_ns;
        }
        Some(Self { motions_ns, ..Self::showing(problem, layout, point, model, part) })
    }

    /// What so much effort would cost at most, ns as [`super::work`] counts: each column of a tangent is a motion, or two of them, and a step is one.
    #[must_use]
    pub fn cost_ns(&self, effort: Effort) -> u64 {
        let sides = if effort.central { 2 } else { 1 };
        let columns = sides * self.layout.globals.len() + self.layout.locals.len() + 1;
        effort.iterations as u64 * columns as u64 * self.motions_ns
    }

    /// What strains the beliefs about rig, masses, speeds and mechanisms.
    #[must_use]
    pub fn tension(&self, problem: &Problem, part: Part<'_>) -> f64 {
        prior_cost(problem, &self.layout, &self.point, part)
    }

    /// The sum of squares of one recording's whitened residual.
    #[must_use]
    pub fn recording_cost(&self, recording: usize) -> f64 {
        self.residuals[recording].iter().map(|r| robust(*r)).sum()
    }

    /// The same of what is observed alone, without further channels.
    #[must_use]
    pub fn observed_cost(&self, problem: &Problem, recording: usize) -> f64 {
        let rows = problem.recordings[recording].times_s.len();
        self.residuals[recording][..rows].iter().map(|r| robust(*r)).sum()
    }

    /// The same with what strains the beliefs about that recording.
    #[must_use]
    pub fn own_cost(&self, problem: &Problem, recording: usize) -> f64 {
        self.recording_cost(recording) + own_prior_cost(problem, &self.layout, &self.point, recording)
    }

    /// How far the most strained belief about rig, masses and filter is from where it was, in its deviations.
    #[must_use]
    pub fn strain(&self) -> f64 {
        self.strain_of(|_| true)
    }

    /// The same of what is stated of rig and masses alone, as far as its mechanisms do not say themselves that it is otherwise.
    #[must_use]
    pub fn strayed(&self) -> f64 {
        self.strain_of(|role| self.layout.holds_stated(role))
    }

    /// The same of a configuration's mass alone.
    #[must_use]
    pub fn strayed_mass(&self, configuration: usize) -> f64 {
        self.strain_of(|role| role == Role::Mass(configuration))
    }

    /// Of some global coordinates.
    fn strain_of(&self, of: impl Fn(Role) -> bool) -> f64 {
        let believed =
            |coordinate: &&super::layout::Coordinate| coordinate.role.entrant().is_none() && of(coordinate.role);
        let deviations = |(coordinate, value): (&super::layout::Coordinate, &f64)| {
            coordinate.prior.filter(|_| believed(&coordinate)).map_or(0.0, |(mean, sd)| ((value - mean) / sd).abs())
        };
        self.layout.globals.iter().zip(&self.point.globals).map(deviations).fold(0.0, f64::max)
    }

    /// The derivative at the fit.
    #[must_use]
    pub fn tangent(&self, problem: &Problem, part: Part<'_>) -> Option<Tangent> {
        self.tangent_of(problem, part, Effort::FULL, None)
    }

    /// The derivative by what moves, along the motions of the recordings that take part, where they are known.
    fn tangent_of(
        &self,
        problem: &Problem,
        part: Part<'_>,
        effort: Effort,
        motions: Option<&[Impact]>,
    ) -> Option<Tangent> {
        let recordings: Option<Vec<RecordingTangent>> = part
            .par_iter()
            .enumerate()
            .map(|(place, &recording)| match motions {
                Some(motions) => self.recording_tangent(problem, recording, effort, &motions[place]),
                None => {
                    let motion = predict::strike(problem, &self.layout, &self.point, recording).ok()?;
                    self.recording_tangent(problem, recording, effort, &motion)
                }
            })
            .collect();
        let inverse = |prior: Option<(f64, f64)>| prior.map_or(0.0, |(_, sd)| 1.0 / sd);
        let global_prior = DVector::from_iterator(
            self.layout.globals.len(),
            self.layout.globals.iter().map(|coordinate| inverse(coordinate.prior)),
        );
        Some(Tangent { recordings: recordings?, global_prior })
    }

    fn recording_tangent(
        &self,
        problem: &Problem,
        recording: usize,
        effort: Effort,
        impact: &Impact,
    ) -> Option<RecordingTangent> {
        let layout = &self.layout;
        let rows = self.model[recording].len();
        let here = &self.model[recording];
        let configuration = problem.recordings[recording].configuration;
        let read = |moved: &Point, impact: &Impact, step: f64| -> Option<Vec<f64>> {
            let values = predict::read(problem, layout, moved, recording, impact, 0.0);
            let mut column: Vec<f64> = values.iter().zip(here).map(|(there, here)| (there - here) / step).collect();
            if column.iter().any(|value| !value.is_finite()) {
                return None;
            }
            problem.recordings[recording].whiten(&mut column);
            Some(column)
        };
        let difference = |moved: &Point, step: f64, role: Role| {
            let moved_impact = if layout.is_seen_only(role) {
                predict::through(problem, layout, moved, recording, impact)
            } else {
                predict::strike(problem, layout, moved, recording)
            };
            read(moved, &moved_impact.ok()?, step)
        };
        let mut global = DMatrix::zeros(rows, layout.globals.len());
        let mut local = DMatrix::zeros(rows, layout.locals.len());
        // Those of body springs and pad, which repeat together.
        let mut springs: Vec<usize> = Vec::new();
        let valley = Series::of(problem, layout).filter(|_| effort.globals).map(|series| series.valley(&self.point));
        let mut places: Vec<usize> = (0..layout.globals.len()).collect();
        // The derivative along the valley builds on that by the softer spring.
        if let Some(valley) = valley.filter(|valley| valley.softer > valley.stiffer) {
            places.swap(valley.softer, valley.stiffer);
        }
        for place in places {
            let coordinate = &layout.globals[place];
            let valley = valley.filter(|valley| valley.stiffer == place);
            let touched = match coordinate.role {
                Role::Mass(number) => number == configuration,
                Role::Mechanism { entrant, .. } => layout.entrants[entrant].scope.includes(recording, configuration),
                Role::InConfiguration { configuration: number, .. } => number == configuration,
                _ => true,
            };
            let is_spring = matches!(coordinate.role, Role::Body | Role::Pad);
            if !touched || !effort.globals {
                continue;
            }
            let quotient = |step: f64| {
                let moved = valley.map_or_else(
                    || {
                        let mut moved = self.point.clone();
                        moved.globals[place] += step;
                        moved
                    },
                    |valley| valley.along(&self.point, step),
                );
                difference(&moved, step, coordinate.role)
            };
            let mut column = stepped(coordinate.step, coordinate.range, self.point.globals[place], quotient)?;
            // Stiffnesses in series and a mass nearly imitate each other: the bend of a one-sided difference would tell them apart.
            // A strength moves jumps, of which one side sees only those that come too soon.
            if effort.central
                && (place < layout.of_rig || coordinate.role.place() == Some(0))
                && let Some(other) = quotient(-coordinate.step)
            {
                column.iter_mut().zip(&other).for_each(|(a, b)| *a = 0.5 * (*a + b));
            }
            if let Some(valley) = valley {
                let softer = global.column(valley.softer);
                column.iter_mut().zip(&softer).for_each(|(column, softer)| *column += valley.ratio * softer);
            }
            global.column_mut(place).copy_from_slice(&column);
            if is_spring {
                springs.push(place);
            }
        }
        for (place, coordinate) in layout.locals.iter().enumerate() {
            if !effort.nuisances && coordinate.prior.is_some() {
                continue;
            }
            let column = match coordinate.role {
                Role::Contact => {
                    let step = coordinate.step;
                    let later = predict::read(problem, layout, &self.point, recording, impact, step);
                    let sooner = predict::read(problem, layout, &self.point, recording, impact, -step);
                    let mut column: Vec<f64> = later.iter().zip(&sooner).map(|(a, b)| (a - b) / (2.0 * step)).collect();
                    problem.recordings[recording].whiten(&mut column);
                    column
                }
                // What the springs themselves move.
                Role::Repeat if !springs.is_empty() => {
                    let row = |row: usize| springs.iter().map(|place| global[(row, *place)]).sum();
                    (0..rows).map(row).collect()
                }
                Role::Offset(channel) => {
                    let samples = rows / problem.channels.len();
                    let mut column = vec![0.0; rows];
                    column[channel * samples..(channel + 1) * samples].fill(1.0);
                    problem.recordings[recording].whiten(&mut column);
                    column
                }
                Role::Mechanism { entrant, .. }
                    if !layout.entrants[entrant].scope.includes(recording, configuration) =>
                {
                    continue;
                }
                _ => {
                    let quotient = |step: f64| {
                        let mut moved = self.point.clone();
                        moved.locals[recording][place] += step;
                        difference(&moved, step, coordinate.role)
                    };
                    let mut column =
                        stepped(coordinate.step, coordinate.range, self.point.locals[recording][place], quotient)?;
                    if effort.central
                        && matches!(coordinate.role, Role::Speed | Role::Repeat)
                        && let Some(other) = quotient(-coordinate.step)
                    {
                        column.iter_mut().zip(&other).for_each(|(a, b)| *a = 0.5 * (*a + b));
                    }
                    column
                }
            };
            local.column_mut(place).copy_from_slice(&column);
        }
        let local_prior = DVector::from_iterator(
            layout.locals.len(),
            (0..layout.locals.len())
                .map(|place| layout.local_prior(problem, recording, place).map_or(0.0, |(_, sd)| 1.0 / sd)),
        );
        Some(RecordingTangent { global, local, local_prior })
    }

    /// Frequencies at which the residual after the rise is strong, Hz, strongest first: peaks of the pooled periodogram.
    #[must_use]
    pub fn lines_hz(&self, problem: &Problem) -> Vec<f64> {
        super::spectrum::lines_hz(problem, self)
    }

    /// One step that makes the cost smaller, with the motions there. `None`: there is none.
    fn improve(
        &self,
        problem: &Problem,
        tangent: &Tangent,
        part: Part<'_>,
        effort: Effort,
        damping: &mut f64,
    ) -> Option<(Self, Vec<Impact>)> {
        let (gradient, local_gradients) = self.gradients(problem, tangent, part);
        let products = self.pulling(tangent, part).products();
        let whole = effort.globals && effort.nuisances;
        for _ in 0..MOST_TRIES {
            let Some(normal) = products.factorised(*damping, effort.globals) else {
                *damping *= 10.0;
                continue;
            };
            let step = normal.solve(&gradient, &local_gradients);
            // Damped, a step foretells no less than this.
            let along_locals: f64 = local_gradients.iter().zip(&step.locals).map(|(pull, step)| pull.dot(step)).sum();
            if whole && gradient.dot(&step.globals) + along_locals < FORETOLD * small_gain(self.cost) {
                return None;
            }
            let after = self.after(problem, &step, part, effort).filter(|(fit, _)| fit.cost < self.cost);
            let Some((mut fit, mut motions)) = after else {
                *damping = (*damping * 8.0).max(1e-6);
                continue;
            };
            for _ in 0..effort.further {
                let (gradient, local_gradients) = fit.gradients(problem, tangent, part);
                let further = fit.after(problem, &normal.solve(&gradient, &local_gradients), part, effort);
                let gains = |better: &Self| better.cost < fit.cost - small_gain(fit.cost);
                let Some(better) = further.filter(|(better, _)| gains(better)) else { break };
                (fit, motions) = better;
            }
            return Some((fit, motions));
        }
        None
    }

    /// Where a step leads, with the motions there.
    fn after(
        &self,
        problem: &Problem,
        step: &Imitation,
        part: Part<'_>,
        effort: Effort,
    ) -> Option<(Self, Vec<Impact>)> {
        let mut moved = self.point.clone();
        if effort.globals {
            for (place, coordinate) in self.layout.globals.iter().enumerate() {
                moved.globals[place] = coordinate.moved(moved.globals[place], step.globals[place]);
            }
        }
        for (number, recording) in part.iter().enumerate() {
            for (place, coordinate) in self.layout.locals.iter().enumerate() {
                if effort.nuisances || coordinate.prior.is_none() {
                    let value = &mut moved.locals[*recording][place];
                    *value = coordinate.moved(*value, step.locals[number][place]);
                }
            }
        }
        let whole = effort.globals && effort.nuisances;
        if let Some(series) = Series::of(problem, &self.layout).filter(|_| whole) {
            series.bend(&self.point, &mut moved);
        }
        Self::moving_at(problem, self.layout.clone(), moved, part)
    }

    /// The tangent with spikes pulling with a constant force.
    fn pulling<'a>(&self, tangent: &'a Tangent, part: Part<'_>) -> Cow<'a, Tangent> {
        let mut pulling = Cow::Borrowed(tangent);
        if part.iter().any(|recording| self.residuals[*recording].iter().any(|r| r.abs() > SPIKE)) {
            for (recording, number) in pulling.to_mut().recordings.iter_mut().zip(part) {
                for (row, residual) in self.residuals[*number].iter().enumerate() {
                    let weight = weight(*residual);
                    if weight < 1.0 {
                        recording.global.row_mut(row).scale_mut(weight);
                        recording.local.row_mut(row).scale_mut(weight);
                    }
                }
            }
        }
        pulling
    }

    /// Jᵀr of everything that is fitted, what is believed included: zero where the fit has converged.
    #[must_use]
    pub fn gradients(&self, problem: &Problem, tangent: &Tangent, part: Part<'_>) -> (DVector<f64>, Vec<DVector<f64>>) {
        let mut global = DVector::zeros(self.layout.globals.len());
        for (place, coordinate) in self.layout.globals.iter().enumerate() {
            if let Some((mean, sd)) = coordinate.prior {
                global[place] -= (self.point.globals[place] - mean) / (sd * sd);
            }
        }
        let locals = part
            .iter()
            .zip(&tangent.recordings)
            .map(|(recording, columns)| {
                let pull = self.residuals[*recording].iter().map(|r| r * weight(*r).powi(2));
                let residual = DVector::from_iterator(self.residuals[*recording].len(), pull);
                global += columns.global.tr_mul(&residual);
                let mut local = columns.local.tr_mul(&residual);
                for place in 0..self.layout.locals.len() {
                    if let Some((mean, sd)) = self.layout.local_prior(problem, *recording, place) {
                        local[place] -= (self.point.locals[*recording][place] - mean) / (sd * sd);
                    }
                }
                local
            })
            .collect();
        (global, locals)
    }
}

/// A difference quotient that stays inside the range, and turns round where the other side cannot be simulated.
fn stepped(
    step: f64,
    (low, high): (f64, f64),
    here: f64,
    difference: impl Fn(f64) -> Option<Vec<f64>>,
) -> Option<Vec<f64>> {
    let forward = if here + step > high && here - step >= low { -step } else { step };
    difference(forward).or_else(|| difference(-forward))
}

fn prior_cost(problem: &Problem, layout: &Layout, point: &Point, part: Part<'_>) -> f64 {
    let globals = layout.globals.iter().zip(&point.globals);
    let global: f64 = globals.map(|(coordinate, value)| strain_cost(*value, coordinate.prior)).sum();
    let local: f64 = part.iter().map(|&recording| own_prior_cost(problem, layout, point, recording)).sum();
    global + local
}

/// What a model that shows these values leaves of one recording, with what strains the beliefs about that recording.
#[must_use]
pub fn cost_of_one(problem: &Problem, layout: &Layout, point: &Point, recording: usize, values: &[f64]) -> f64 {
    let left = problem.recordings[recording].left_by(values);
    left.into_iter().map(robust).sum::<f64>() + own_prior_cost(problem, layout, point, recording)
}

/// What strains the beliefs about one recording's own coordinates.
fn own_prior_cost(problem: &Problem, layout: &Layout, point: &Point, recording: usize) -> f64 {
    let prior = |place| layout.local_prior(problem, recording, place);
    point.locals[recording].iter().enumerate().map(|(place, value)| strain_cost(*value, prior(place))).sum()
}

fn strain_cost(value: f64, prior: Option<(f64, f64)>) -> f64 {
    prior.map_or(0.0, |(mean, sd)| ((value - mean) / sd).powi(2))
}

impl Tangent {
    /// The same of some recordings only.
    #[must_use]
    pub fn only(&self, recordings: &[usize]) -> Self {
        Self {
            recordings: recordings.iter().map(|number| self.recordings[*number].clone()).collect(),
            global_prior: self.global_prior.clone(),
        }
    }

    /// Of how many recordings it is.
    #[must_use]
    pub fn recordings(&self) -> usize {
        self.recordings.len()
    }

    /// With the recordings of another tangent of the same coordinates after its own.
    #[must_use]
    pub fn and(mut self, more: Self) -> Self {
        self.recordings.extend(more.recordings);
        self
    }

    /// Standard deviation of one of a recording's own coordinates, nothing that is shared moving.
    #[must_use]
    pub fn local_deviation(&self, recording: usize, place: usize) -> Option<f64> {
        let inverse = self.recordings[recording].local_normal()?.inverse();
        Some(inverse[(place, place)].sqrt())
    }

    /// What one recording's own coordinates leave of a whitened residual, to first order.
    #[must_use]
    pub fn local_rest(&self, recording: usize, residual: &[f64]) -> Vec<f64> {
        let columns = &self.recordings[recording];
        let values = DMatrix::from_column_slice(residual.len(), 1, residual);
        match columns.locally_imitated(&columns.local.tr_mul(&values)) {
            Some(moved) => (values - &columns.local * moved).as_slice().to_vec(),
            None => residual.to_vec(),
        }
    }

    /// How signatures go along with what one recording leaves, and their products with each other, freed of what the recording's own
    /// coordinates can do, beliefs about them included: what strains a belief speaks for what would relieve it. The gradient is that
    /// of the recording's own coordinates.
    #[must_use]
    pub fn local_scores(
        &self,
        recording: usize,
        signatures: &[&[f64]],
        fit: &Fit,
        gradient: &DVector<f64>,
    ) -> (DVector<f64>, DMatrix<f64>) {
        let columns = &self.recordings[recording];
        let residual = &fit.residuals[recording];
        let signatures = DMatrix::from_fn(residual.len(), signatures.len(), |row, which| signatures[which][row]);
        let along = columns.local.tr_mul(&signatures);
        let scores = signatures.tr_mul(&DVector::from_column_slice(residual));
        let products = signatures.tr_mul(&signatures);
        match columns.locally_imitated(&along) {
            Some(moved) => (scores - moved.tr_mul(gradient), products - moved.tr_mul(&along)),
            None => (scores, products),
        }
    }

    /// Jᵀs of a signature: whitened, one vector for each recording of the part (empty: nothing there).
    #[must_use]
    pub fn transposed(&self, signature: &[Vec<f64>]) -> (DVector<f64>, Vec<DVector<f64>>) {
        let mut global = DVector::zeros(self.global_prior.len());
        let locals = self
            .recordings
            .iter()
            .zip(signature)
            .map(|(columns, values)| {
                if values.is_empty() {
                    return DVector::zeros(columns.local.ncols());
                }
                let values = DVector::from_column_slice(values);
                global += columns.global.tr_mul(&values);
                columns.local.tr_mul(&values)
            })
            .collect();
        (global, locals)
    }

    /// The factorised normal equations; `damping` adds that part of the diagonal.
    #[must_use]
    pub fn normal(&self, damping: f64) -> Option<Normal> {
        self.products().factorised(damping, true)
    }

    /// Standard deviations of the global coordinates.
    #[must_use]
    pub fn deviations(&self) -> Option<DVector<f64>> {
        self.normal(0.0).map(|normal| normal.global_deviations())
    }

    /// The same, with nothing believed about some of them.
    #[must_use]
    pub fn deviations_without_beliefs(&self, about: impl Fn(usize) -> bool) -> Option<DVector<f64>> {
        let prior = |place: usize| if about(place) { 0.0 } else { self.global_prior[place] };
        let global_prior = DVector::from_fn(self.global_prior.len(), |place, _| prior(place));
        let normal = Products { global_prior, ..self.products() }.factorised(0.0, true);
        normal.map(|normal| normal.global_deviations())
    }

    fn products(&self) -> Products {
        let of_recording = |columns: &RecordingTangent| {
            // A product of matrices is several times quicker than nalgebra's `tr_mul`.
            let (globals, locals) = (columns.global.transpose(), columns.local.transpose());
            let mut local = locals * &columns.local;
            for place in 0..local.ncols() {
                local[(place, place)] += columns.local_prior[place].powi(2);
            }
            RecordingProducts { global: &globals * &columns.global, cross: globals * &columns.local, local }
        };
        let recordings = self.recordings.par_iter().map(of_recording).collect();
        Products { recordings, global_prior: self.global_prior.clone() }
    }
}

impl Products {
    /// The normal equations with that part of the diagonal more, all coordinates moving or only what each recording has for itself.
    fn factorised(&self, damping: f64, globals: bool) -> Option<Normal> {
        let count = self.global_prior.len();
        let mut a = DMatrix::from_diagonal(&self.global_prior.component_mul(&self.global_prior));
        for recording in &self.recordings {
            a += &recording.global;
        }
        let scale = DVector::from_iterator(count, (0..count).map(|place| unit_scale(a[(place, place)])));
        let mut schur = scaled(&a, &scale, &scale);
        ridge(&mut schur, damping);
        let mut blocks = Vec::with_capacity(self.recordings.len());
        for RecordingProducts { cross, local, .. } in &self.recordings {
            let local_scale = DVector::from_iterator(
                local.ncols(),
                (0..local.ncols()).map(|place| unit_scale(local[(place, place)])),
            );
            let mut local = scaled(local, &local_scale, &local_scale);
            ridge(&mut local, damping);
            let local = local.cholesky()?;
            let cross =
                if globals { scaled(cross, &scale, &local_scale) } else { DMatrix::zeros(count, local_scale.len()) };
            if globals {
                schur -= &cross * local.solve(&cross.transpose());
            }
            blocks.push(Block { local, local_scale, cross });
        }
        ridge(&mut schur, 1e-12);
        Some(Normal { blocks, schur: schur.cholesky()?, scale })
    }
}

fn unit_scale(diagonal: f64) -> f64 {
    if diagonal > 0.0 { 1.0 / diagonal.sqrt() } else { 1.0 }
}

fn scaled(matrix: &DMatrix<f64>, rows: &DVector<f64>, columns: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| matrix[(row, column)] * rows[row] * columns[column])
}

/// Scaled diagonals are 1, or 0 where a coordinate does nothing here: those stay where they are.
fn ridge(matrix: &mut DMatrix<f64>, damping: f64) {
    for place in 0..matrix.ncols() {
        let diagonal = matrix[(place, place)];
        matrix[(place, place)] = if diagonal == 0.0 { 1.0 } else { diagonal * (1.0 + damping) + 1e-11 };
    }
}

impl Normal {
    /// Solves (JᵀJ)·x = g.
    #[must_use]
    pub fn solve(&self, global: &DVector<f64>, locals: &[DVector<f64>]) -> Imitation {
        let mut right = global.component_mul(&self.scale);
        let scaled: Vec<DVector<f64>> = self
            .blocks
            .iter()
            .zip(locals)
            .map(|(block, local)| {
                let local = local.component_mul(&block.local_scale);
                right -= &block.cross * block.local.solve(&local);
                local
            })
            .collect();
        let globals = self.schur.solve(&right);
        let locals = self
            .blocks
            .iter()
            .zip(&scaled)
            .map(|(block, local)| {
                block.local.solve(&(local - block.cross.transpose() * &globals)).component_mul(&block.local_scale)
            })
            .collect();
        Imitation { globals: globals.component_mul(&self.scale), locals }
    }

    /// Standard deviations of the global coordinates: the roots of the diagonal of (JᵀJ)⁻¹.
    #[must_use]
    pub fn global_deviations(&self) -> DVector<f64> {
        let inverse = self.schur.inverse();
        DVector::from_iterator(self.scale.len(), (0..self.scale.len()).map(|p| inverse[(p, p)].sqrt() * self.scale[p]))
    }
}

impl Tangent {
    /// J·x, for each recording.
    #[must_use]
    pub fn times(&self, imitation: &Imitation) -> Vec<Vec<f64>> {
        self.recordings
            .iter()
            .zip(&imitation.locals)
            .map(|(columns, local)| (&columns.global * &imitation.globals + &columns.local * local).as_slice().to_vec())
            .collect()
    }
}
