//! Follows the motion from event to event.
//!
//! The library's solver (or the exponential, where the form is linear) makes the steps; here each step's interpolant is looked through for the first event, the step
//! is cut there, the form of the equations changes, and the solver begins anew. (The library's own event handling
//! watches one function at a time and does not tell several apart.)

use differential_equations::error::Error;
use differential_equations::interpolate::Interpolation;
use differential_equations::methods::{Adaptive, ExplicitRungeKutta, Ordinary};
use differential_equations::ode::{ODE, OrdinaryNumericalMethod};
use differential_equations::status::Status;
use differential_equations::tolerance::Tolerance;

use super::assembly::Assembly;
use super::impact::Impact;
use super::motion::{CONTACT_EVENT, MOST_EVENTS, MOST_STATES, Mode, System};
use super::propagate::Propagator;
use super::rosenbrock::Rosenbrock;
use super::trajectory::{MOST_NODES, READINGS, Trajectory};
use super::{Kind, RigError};

/// The most events that are followed in one impact.
const MOST_CHANGES: usize = 5_000;
/// The most steps that the solver may try between two events.
const MOST_STEPS: usize = 100_000;
/// And that are kept, for each second that is followed: twenty for each period of a ring at 5 kHz, which is more than recordings show. A
/// hundred thousand would take 40 MB.
const MOST_STEPS_PER_S: f64 = 1e5;
/// However short it is.
const ALWAYS_STEPS: f64 = 2e4;

/// An explicit method that takes so many steps between two events is held up by something that decays: a robot at rest in its own guide. The
/// implicit one goes on from there.
const LABOURS: usize = 200;

/// Verner's method of order 6 has an interpolant of degree 6. (Dormand–Prince 8(5,3) makes longer steps, but its
/// interpolant of degree 7 is a thousand times less exact than the steps' ends, and here only the interpolant counts.)
const VERNER_NODES: usize = 7;
/// The states between Rodas' steps are cubics.
const RODAS_NODES: usize = 4;

/// How exactly the motion is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// Relative error of a step.
    pub relative: f64,
    /// Absolute error of a step, as a force at the cell, N.
    pub force_n: f64,
}

impl Default for Accuracy {
    /// Errors far below any noise: some 10⁻⁷ of the peak, and smooth in every parameter: a difference quotient with a relative
    /// step of 10⁻³ is right to better than a per cent (`cargo bench -p thud-sim --bench rig -- differences`). Coarser ones
    /// gain little, since linear forms are solved in closed form.
    fn default() -> Self {
        Self { relative: 1e-7, force_n: 1e-5 }
    }
}

/// What the solver had to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// Evaluations of the equations.
    pub evaluations: usize,
    /// Steps that were kept.
    pub steps: usize,
    /// Steps that were tried again with a smaller step.
    pub rejected: usize,
    /// Changes of contact, friction, stops and drives.
    pub events: usize,
}

pub(super) fn integrate(assembly: Assembly, until_s: f64, accuracy: Accuracy) -> Result<Impact, RigError> {
    let system = System::new(assembly, accuracy.force_n)?;
    match system.states() {
        0..=2 => by_size::<2>(system, until_s, accuracy),
        3 => by_size::<3>(system, until_s, accuracy),
        4 => by_size::<4>(system, until_s, accuracy),
        5..=6 => by_size::<6>(system, until_s, accuracy),
        7..=8 => by_size::<8>(system, until_s, accuracy),
        _ => by_size::<12>(system, until_s, accuracy),
    }
}

/// A fresh solver for each stretch between two events.
enum Solver<const N: usize> {
    Exact(Box<Propagator<N>>),
    Rodas(Box<Rosenbrock<N>>),
    Verner(Box<Verner<N>>),
}

type Verner<const N: usize> = ExplicitRungeKutta<Ordinary, Adaptive, f64, [f64; N], 6, 9, 12>;

/// A method for stretches that are not stiff.
fn verner<const N: usize>(accuracy: Accuracy, tolerances: &[f64; MOST_STATES]) -> Verner<N> {
    let absolute = Tolerance::Vector(tolerances[..N].to_vec());
    ExplicitRungeKutta::rkv656e().rtol(accuracy.relative).atol(absolute).max_steps(MOST_STEPS)
}

impl<const N: usize> Solver<N> {
    /// For the form that holds over this span; one that decays fast, as the equations say or an explicit method has found, has the implicit one.
    fn new(
        system: &System,
        mode: &Mode,
        span_s: (f64, f64),
        state: &[f64; N],
        accuracy: Accuracy,
        decays: bool,
    ) -> Self {
        let tolerances = system.tolerances(accuracy.force_n);
        if system.is_linear(mode) {
            Self::Exact(Box::new(Propagator::new(system, mode, span_s, state, accuracy.relative, &tolerances)))
        } else if decays || system.is_stiff(mode) {
            let finer = accuracy.relative / Accuracy::default().relative;
            let relative = (accuracy.relative, finer);
            Self::Rodas(Box::new(Rosenbrock::new(system, mode, span_s.0, state, relative, &tolerances)))
        } else {
            Self::Verner(Box::new(verner(accuracy, &tolerances)))
        }
    }

    /// How many equally spaced states determine a step's interpolant.
    fn nodes(&self) -> usize {
        match self {
            Self::Exact(_) => MOST_NODES,
            Self::Verner(_) => VERNER_NODES,
            Self::Rodas(_) => RODAS_NODES,
        }
    }

    fn init(&mut self, form: &Form<'_>, time_s: f64, stop_s: f64, state: &[f64; N]) -> Outcome<usize, N> {
        match self {
            Self::Exact(_) => Ok(form.system.states() + 1),
            Self::Verner(method) => method.init(form, time_s, stop_s, state).map(|evaluations| evaluations.function),
            Self::Rodas(_) => Ok(1),
        }
    }

    /// Tries a step: how often the equations were evaluated, and whether the step is kept.
    fn step(&mut self, form: &Form<'_>) -> Outcome<(usize, bool), N> {
        match self {
            Self::Exact(propagator) => {
                propagator.step();
                Ok((0, true))
            }
            Self::Rodas(method) => Ok(method.step(form.system, &form.mode)),
            Self::Verner(method) => {
                let evaluations = method.step(form)?.function;
                Ok((evaluations, !matches!(method.status(), Status::RejectedStep)))
            }
        }
    }

    /// Begin and end of the last step.
    fn ends_s(&self) -> (f64, f64) {
        match self {
            Self::Exact(propagator) => propagator.ends_s(),
            Self::Verner(method) => (method.t_prev(), method.t()),
            Self::Rodas(method) => method.ends_s(),
        }
    }

    /// The states at the last step's equally spaced nodes.
    fn sample(&mut self, nodes: &mut [[f64; N]]) -> Outcome<(), N> {
        let (from_s, to_s) = self.ends_s();
        let last = nodes.len() - 1;
        (nodes[0], nodes[last]) = match self {
            Self::Exact(propagator) => {
                nodes.copy_from_slice(propagator.nodes());
                return Ok(());
            }
            Self::Rodas(method) => (method.interpolate(from_s), method.interpolate(to_s)),
            Self::Verner(method) => (*method.y_prev(), *method.y()),
        };
        for (number, node) in nodes.iter_mut().enumerate().take(last).skip(1) {
            *node = self.interpolate(from_s + (to_s - from_s) * number as f64 / last as f64)?;
        }
        Ok(())
    }

    fn interpolate(&mut self, time_s: f64) -> Outcome<[f64; N], N> {
        match self {
            Self::Exact(propagator) => Ok(propagator.interpolate(time_s)),
            Self::Verner(method) => method.interpolate(time_s),
            Self::Rodas(method) => Ok(method.interpolate(time_s)),
        }
    }
}

type Outcome<T, const N: usize> = Result<T, Error<f64, [f64; N]>>;

/// The equations between two events, as the solver takes them.
struct Form<'a> {
    system: &'a System,
    mode: Mode,
}

impl<const N: usize> ODE<f64, [f64; N]> for Form<'_> {
    fn diff(&self, time_s: f64, state: &[f64; N], rates: &mut [f64; N]) {
        self.system.rates(time_s, state, &self.mode, rates);
    }
}

fn by_size<const N: usize>(system: System, until_s: f64, accuracy: Accuracy) -> Result<Impact, RigError> {
    let (start, mode) = system.start();
    let mut state = [0.0; N];
    state.copy_from_slice(&start[..N]);
    let mut intervals = Vec::new();
    if mode.touching {
        intervals.push((0.0, None));
    }
    let mut trajectory = Trajectory::new(system.states());
    let most_steps = ALWAYS_STEPS.max(MOST_STEPS_PER_S * until_s) as usize;
    let mut effort = Effort::default();
    let mut form = Form { system: &system, mode };
    let mut time_s = 0.0;
    let mut touched = false;
    while time_s < until_s {
        let begun_s = time_s;
        let failed =
            move |error: Error<f64, [f64; N]>| RigError::Solver { time_s: begun_s, reason: reason(&error).to_owned() };
        if !touched && let Some(ramp) = system.onset(time_s, &state, &form.mode) {
            pass_ramp(&system, &mut trajectory, &mut time_s, &mut state, form.mode, ramp);
        }
        let stop_s = system.next_switch_s(&form.mode).min(until_s);
        let mut solver = Solver::new(&system, &form.mode, (time_s, stop_s), &state, accuracy, false);
        if stop_s > time_s {
            effort.evaluations += solver.init(&form, time_s, stop_s, &state).map_err(failed)?;
        }
        let mut event = None;
        let begun_steps = effort.steps;
        while event.is_none() && time_s < stop_s {
            if matches!(solver, Solver::Verner(_)) && effort.steps - begun_steps > LABOURS {
                solver = Solver::new(&system, &form.mode, (time_s, stop_s), &state, accuracy, true);
            }
            let (evaluations, kept) = solver.step(&form).map_err(failed)?;
            effort.evaluations += evaluations;
            if !kept {
                effort.rejected += 1;
                continue;
            }
            effort.steps += 1;
            if effort.steps > most_steps {
                return Err(RigError::Solver { time_s, reason: "it takes too many steps".to_owned() });
            }
            let (from_s, to_s) = solver.ends_s();
            if to_s <= from_s {
                return Err(RigError::Solver { time_s, reason: "the step became too small".to_owned() });
            }
            let mut nodes = [[0.0; N]; MOST_NODES];
            let nodes = &mut nodes[..solver.nodes()];
            solver.sample(nodes).map_err(failed)?;
            // The last step may go beyond the end of this form: its interpolant is cut there, as at an event.
            let mut readings = [[0.0; READINGS]; MOST_NODES];
            let readings = &mut readings[..nodes.len()];
            event =
                first_event(&mut solver, &form, (from_s, to_s), nodes, readings).filter(|(_, at_s)| *at_s <= stop_s);
            time_s = event.map_or(stop_s.min(to_s), |(_, at_s)| at_s);
            trajectory.push(from_s, to_s - from_s, time_s, nodes, readings, form.mode);
            state = if time_s < to_s { solver.interpolate(time_s).map_err(failed)? } else { nodes[nodes.len() - 1] };
        }
        effort.events += 1;
        if effort.events > MOST_CHANGES {
            return Err(RigError::Chattering { time_s, most: MOST_CHANGES });
        }
        touched = form.mode.touching;
        if matches!(event, Some((CONTACT_EVENT, _)))
            && let Some(ramp) = system.closing(time_s, &state, &form.mode)
        {
            pass_ramp(&system, &mut trajectory, &mut time_s, &mut state, form.mode, ramp);
        }
        match event {
            Some((number, _)) => system.pass(number, time_s, &mut state, &mut form.mode),
            None => system.switch(&mut form.mode, time_s),
        }
        match (touched, form.mode.touching) {
            (false, true) => intervals.push((time_s, None)),
            (true, false) => {
                if let Some(interval) = intervals.last_mut() {
                    interval.1 = Some(time_s);
                }
            }
            _ => {}
        }
    }
    effort.events -= 1; // the end of the simulation is none
    debug_assert!(system.assembly.kind != Kind::Fall || intervals.is_empty());
    Ok(Impact::new(system, trajectory, intervals, until_s, effort))
}

/// The motion over a moment in which all states run straight to the given ones.
fn pass_ramp<const N: usize>(
    system: &System,
    trajectory: &mut Trajectory,
    time_s: &mut f64,
    state: &mut [f64; N],
    mode: Mode,
    (moment_s, after): (f64, [f64; MOST_STATES]),
) {
    let mut nodes = [*state; 2];
    nodes[1].copy_from_slice(&after[..N]);
    let readings = [0, 1].map(|node| {
        let (time_s, state) = (*time_s + moment_s * f64::from(node), &nodes[node as usize]);
        system.readings(time_s, state, &mode, &system.instant(time_s, state, &mode))
    });
    trajectory.push(*time_s, moment_s, *time_s + moment_s, &nodes, &readings, mode);
    *state = nodes[1];
    *time_s += moment_s;
}

/// What the solver says, without the state that it prints at length.
fn reason<const N: usize>(error: &Error<f64, [f64; N]>) -> &'static str {
    match error {
        Error::MaxSteps { .. } => "too many steps between two events",
        Error::StepSize { .. } => "the step became too small",
        Error::Stiffness { .. } => "the equations are too stiff for the explicit method",
        Error::OutOfBounds { .. } => "its interpolant was asked outside of the step",
        _ => "its linear algebra failed",
    }
}

/// The first event of a step and its instant, and what instruments read at each node: a margin that was positive at one node (or at the step's start, where
/// rounding may have put it on either side of zero) and is negative at the next.
fn first_event<const N: usize>(
    solver: &mut Solver<N>,
    form: &Form<'_>,
    (from_s, to_s): (f64, f64),
    nodes: &[[f64; N]],
    readings: &mut [[f64; READINGS]],
) -> Option<(usize, f64)> {
    let mut before = [1.0; MOST_EVENTS];
    let mut after = [1.0; MOST_EVENTS];
    let count;
    (count, readings[0]) = form.system.margins(from_s, &nodes[0], &form.mode, &mut before);
    let at_s = |number: usize| from_s + (to_s - from_s) * number as f64 / (nodes.len() - 1) as f64;
    let mut contact = [0.0; VERNER_NODES];
    contact[0] = before[CONTACT_EVENT];
    let mut found = None;
    let mut seen = 1;
    for (number, node) in nodes.iter().enumerate().skip(1) {
        (_, readings[number]) = form.system.margins(at_s(number), node, &form.mode, &mut after);
        if found.is_some() {
            // Only the readings are still wanted.
            continue;
        }
        let mut first: Option<(usize, f64)> = None;
        for event in 0..count {
            if after[event] < 0.0 {
                let low_s = at_s(number - 1);
                let mut margin = |time_s: f64| {
                    let state = solver.interpolate(time_s.clamp(from_s, to_s)).unwrap_or(*node);
                    let mut margins = [1.0; MOST_EVENTS];
                    form.system.margins(time_s, &state, &form.mode, &mut margins);
                    margins[event]
                };
                let high_s = at_s(number).min(to_s);
                let time_s = if before[event] > 0.0 {
                    root(&mut margin, low_s, high_s, before[event], after[event])
                } else {
                    // It begins on the edge. It may leave it and be back before the next node: look closer and closer.
                    let closer = (1..24).map(|halvings| low_s + (high_s - low_s) * 0.5_f64.powi(halvings));
                    let inside = closer.map(|at_s| (at_s, margin(at_s))).find(|(_, value)| *value > 0.0);
                    inside.map_or(low_s, |(at_s, value)| root(&mut margin, at_s, high_s, value, after[event]))
                };
                if first.is_none_or(|(_, first_s)| time_s < first_s) {
                    first = Some((event, time_s));
                }
            }
        }
        if first.is_some() {
            found = first;
            continue;
        }
        contact[number] = after[CONTACT_EVENT];
        seen = number + 1;
        before = after;
    }
    if form.mode.touching && contact[0] > 0.0 {
        let mut margin = |time_s: f64| {
            let state = solver.interpolate(time_s).unwrap_or(nodes[0]);
            let mut margins = [1.0; MOST_EVENTS];
            form.system.margins(time_s, &state, &form.mode, &mut margins);
            margins[CONTACT_EVENT]
        };
        let lost_s = dip(&mut margin, &contact[..seen], at_s).map(|at_s| (CONTACT_EVENT, at_s));
        return lost_s.or(found);
    }
    found
}

/// Where a margin that is positive at all nodes is negative for a moment between two of them, as when a ringing piece
/// just lets go of the robot: the lowest point of the parabola through three nodes is looked at, and if it is negative,
/// the zero before it is taken.
fn dip(margin: &mut impl FnMut(f64) -> f64, values: &[f64], at_s: impl Fn(usize) -> f64) -> Option<f64> {
    (1..values.len().saturating_sub(1)).find_map(|middle| {
        let [left, low, right] = [values[middle - 1], values[middle], values[middle + 1]];
        let (slope, curvature) = (0.5 * (right - left), right - 2.0 * low + left);
        let vertex = -slope / curvature;
        // Nothing near zero, or lowest where another three nodes look.
        if curvature <= 0.0 || vertex.abs() > 1.0 || low + 0.5 * slope * vertex > 0.1 * low {
            return None;
        }
        let step_s = at_s(middle) - at_s(middle - 1);
        let lowest_s = at_s(middle) + vertex * step_s;
        let lowest = margin(lowest_s);
        let (from_s, from) = if vertex > 0.0 { (at_s(middle), low) } else { (at_s(middle - 1), left) };
        (lowest < 0.0 && from > 0.0).then(|| root(margin, from_s, lowest_s, from, lowest))
    })
}

/// The zero of a falling function between `low` and `high`, by regula falsi with the Illinois rule,
/// until the bracket is 10⁻¹³ s or the value is zero. Of the bracket the later end is returned, so that the new form
/// begins on its own side.
fn root(margin: &mut impl FnMut(f64) -> f64, mut low: f64, mut high: f64, mut at_low: f64, mut at_high: f64) -> f64 {
    let mut side = 0;
    for _ in 0..100 {
        if high - low <= 1e-13 + 4.0 * f64::EPSILON * high.abs() {
            break;
        }
        let mut middle = (low * at_high - high * at_low) / (at_high - at_low);
        if !(middle > low && middle < high) {
            middle = 0.5 * (low + high);
        }
        let value = margin(middle);
        if value == 0.0 {
            return middle;
        }
        if value > 0.0 {
            (low, at_low) = (middle, value);
            if side == 1 {
                at_high *= 0.5;
            }
            side = 1;
        } else {
            (high, at_high) = (middle, value);
            if side == -1 {
                at_low *= 0.5;
            }
            side = -1;
        }
    }
    high
}
