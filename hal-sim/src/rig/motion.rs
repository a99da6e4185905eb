//! The equations of motion, in the form that holds between two events.
//!
//! The piece is what makes forms: without a pad and without a mass it is [`Carried`](PieceForm::Carried) by the robot;
//! massless behind a pad it is where the forces balance ([`Balanced`](PieceForm::Balanced), an algebraic equation
//! whose friction is a play operator), or, where a force depends on its rate, it creeps towards that place
//! ([`Creeping`](PieceForm::Creeping), a stiff equation of first order); with a mass it is a body of its own
//! ([`Massive`](PieceForm::Massive)). In each form the guide lets it go freely, holds it, or rubs against its motion.

use super::assembly::{Assembly, Deformation, Element, Motion, Response, Sway};
use super::creep::{Creep, Decay};
use super::trajectory::READINGS;
use super::{Kind, Quantity, RigError};

/// The most states that the solver is built for.
pub(super) const MOST_STATES: usize = 12;
/// The most events that are watched at once: contact, two of friction, two of the robot's coupling, one of the piece's stop, knots and
/// triggers.
pub(super) const MOST_EVENTS: usize = 21;
/// The number of the event that robot and rig touch or part.
pub(super) const CONTACT_EVENT: usize = 0;
/// The numbers of the events that friction changes: rest or direction.
const GUIDE_EVENTS: [usize; 2] = [1, 2];
/// The numbers of the events that the robot's coupling slips or holds again.
const COUPLING_EVENTS: [usize; 2] = [3, 4];
/// The number of the event that a heavy piece comes to its stop or leaves it.
const STOP_EVENT: usize = 5;
/// The number of the first law's knot; after the laws come the triggers.
const FIRST_KNOT: usize = 6;
/// The most drives that may have a trigger.
const MOST_TRIGGERS: usize = 4;

/// Least damping of a massless piece in a force that depends on its rate, N·s/m. It acts on the difference to the
/// velocity that springs without loss would give, so that it loses nothing itself; it only decides how fast the
/// balance is found where the pad's own damping vanishes: within 1 ns on the softest rig.
const PIECE_DRAG_NS_PER_M: f64 = 1e-5;

/// The last moment of a creeping piece's contact, as an angle of the ideal pulse; over it the robot's speed changes by less
/// than 10⁻⁶ of itself.
const CLOSING_RADIANS: f64 = 1e-3;

/// The fastest that a creeping piece may find its balance to be followed by an exponential, 1/s: it begins with steps that much shorter
/// and doubles rounding with them, to 10⁻⁷ N over a contact.
const STIFFEST_PER_S: f64 = 1e8;

/// How fast a creeping piece has to find its balance for its own velocity to count no more than half in the question
/// whether it slides, 1/s.
const FAST_PER_S: f64 = 1e5;

/// How much faster than the swing of a piece something may decay for an explicit method to be the quicker one: that needs 9 evaluations for
/// half a radian, or for 4 of what decays, the implicit one some 70 for a radian.
const MILDLY_STIFF: f64 = 20.0;

/// How many times less exactly than any other force that of bristles is followed: over a contact that adds as much again to the error of the force at
/// the cell (root mean square; 10⁻⁴ N at most), for a fifth less work.
const BRISTLES: f64 = 4.0;

/// What rounding makes of the balance of forces on a massless piece, N.
const ROUNDING_N: f64 = 1e-9;

/// What the piece is in the equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PieceForm {
    Carried,
    Balanced,
    Creeping,
    Massive,
}

/// What the guide does to the piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Guiding {
    Free,
    Sticking,
    /// Sliding in the direction of the sign.
    Sliding(f64),
    /// Held or rubbed by bristles, whose bend is a state.
    Bending,
}

/// Where a heavy piece is from the stop that it returns to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stop {
    Away,
    At,
    /// It stays there until it is pushed again: what is left of its swing is nothing.
    Settled,
}

/// What the coupling between the robot's link and its tip does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Coupling {
    Holding,
    /// The link overtakes the tip (1) or stays behind (−1).
    Slipping(f64),
}

/// The form of the equations between two events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mode {
    pub(super) touching: bool,
    pub(super) guiding: Guiding,
    /// Where the piece is held, while it is.
    pub(super) held_m: f64,
    stop: Stop,
    pub(super) coupling: Coupling,
    /// How far an elastic joint has slipped so far.
    slipped_m: f64,
    /// A bit for each law (contact, then spring): its depth is beyond its knot.
    beyond: u32,
    /// When each triggered drive acts; infinity before the trigger.
    acts_from_s: [f64; MOST_TRIGGERS],
    /// A bit for each triggered drive: it acts.
    acting: u8,
}

/// Everything there is to know at one instant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Instant {
    pub(super) tip_m_per_s: f64,
    pub(super) tip_m_per_s2: f64,
    /// Tip over frame.
    pub(super) over_m: f64,
    over_m_per_s: f64,
    /// Piece over frame: the stroke of the springs.
    pub(super) piece_m: f64,
    pub(super) piece_m_per_s: f64,
    frame_m_per_s2: f64,
    pub(super) contact_n: f64,
    /// With the air, and with what stands beside pad and springs.
    pub(super) spring_n: f64,
    air_n: f64,
    /// Of the dashpot beside pad and springs.
    across_n: f64,
    pub(super) friction_n: f64,
    /// From link to tip.
    coupling_n: f64,
    /// Friction at the piece's speed over friction of fast sliding.
    grip: f64,
}

impl Instant {
    fn depth_m(&self) -> f64 {
        self.over_m - self.piece_m
    }

    fn depth_m_per_s(&self) -> f64 {
        self.over_m_per_s - self.piece_m_per_s
    }
}

/// Where the states of the motion are.
#[derive(Clone, Copy, Debug)]
struct Layout {
    link: Option<usize>,
    piece: Option<usize>,
    frame: Option<usize>,
    bend: Option<usize>,
    contact: usize,
    spring: usize,
    len: usize,
}

/// What an event is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Event {
    Contact,
    Release,
    Coupling,
    Stop,
    Knot { law: usize },
    Trigger { drive: usize },
}

/// The assembled rig with the places of its states.
#[derive(Debug)]
pub(super) struct System {
    pub(super) assembly: Assembly,
    pub(super) form: PieceForm,
    layout: Layout,
    tip_kg: f64,
    link_kg: f64,
    contact_laws: usize,
    /// Forces on a resting piece that differ by less than this are in balance, N; see [`System::held_n`].
    balance_n: f64,
    /// The tension that the contact bears before it parts, N.
    pull_off_n: f64,
    /// Springs and pad in series, N/m.
    pub(super) series_n_per_m: f64,
    /// The angular frequency of the ideal pulse, 1/s.
    pulsation_per_s: f64,
    /// Drives that have a trigger, by number of the drive.
    triggered: Vec<usize>,
}

impl System {
    /// The equations of this rig, for a motion that is followed to `force_n`, N.
    pub(super) fn new(assembly: Assembly, force_n: f64) -> Result<Self, RigError> {
        let depends_on_rate =
            |element: &Element| element.damping_ns_per_m > 0.0 || element.laws.iter().any(|law| law.depends_on_rate());
        let form = match (&assembly.pad, assembly.piece) {
            (_, Some(_)) => PieceForm::Massive,
            (None, None) => PieceForm::Carried,
            (Some(pad), None) if depends_on_rate(pad) || depends_on_rate(&assembly.spring) => PieceForm::Creeping,
            (Some(_), None) => PieceForm::Balanced,
        };
        let states = |element: &Element| element.laws.iter().map(|law| law.states()).sum::<usize>();
        let mut len = 2;
        let mut place = |count: usize| {
            len += count;
            len - count
        };
        let link_fraction = match (assembly.joint, assembly.ceiling) {
            (Some(joint), _) => Some(joint.link_fraction),
            (None, ceiling) => ceiling.map(|ceiling| 1.0 - ceiling.tip_fraction),
        };
        let link = link_fraction.map(|_| place(2));
        let piece = match form {
            PieceForm::Massive => Some(place(2)),
            PieceForm::Creeping => Some(place(1)),
            PieceForm::Carried | PieceForm::Balanced => None,
        };
        let frame = assembly.frame.map(|_| place(2));
        let bend = assembly.guide.bends().then(|| place(1));
        let contact = place(assembly.pad.as_ref().map_or(0, states));
        let spring = place(states(&assembly.spring));
        if len > MOST_STATES {
            return Err(RigError::TooManyStates { states: len, most: MOST_STATES });
        }
        let link_kg = link_fraction.unwrap_or(0.0) * assembly.approach.effective_mass_kg;
        let triggered: Vec<usize> =
            (0..assembly.drives.len()).filter(|drive| assembly.drives[*drive].trigger().is_some()).collect();
        let contact_laws = assembly.pad.as_ref().map_or(0, |pad| pad.laws.len());
        let watched = FIRST_KNOT + contact_laws + assembly.spring.laws.len() + triggered.len();
        if watched > MOST_EVENTS || triggered.len() > MOST_TRIGGERS {
            return Err(RigError::TooManyStates { states: watched, most: MOST_EVENTS });
        }
        let springs = assembly.spring.stiffness_n_per_m;
        let series_n_per_m =
            assembly.pad.as_ref().map_or(springs, |pad| 1.0 / (1.0 / springs + 1.0 / pad.stiffness_n_per_m));
        Ok(Self {
            series_n_per_m,
            pulsation_per_s: (series_n_per_m / assembly.approach.effective_mass_kg).sqrt(),
            form,
            layout: Layout { link, piece, frame, bend, contact, spring, len },
            tip_kg: assembly.approach.effective_mass_kg - link_kg,
            link_kg,
            contact_laws,
            balance_n: if form == PieceForm::Massive { force_n.max(ROUNDING_N) } else { ROUNDING_N },
            pull_off_n: assembly.touched().pull_off_n,
            triggered,
            assembly,
        })
    }

    /// How many states the motion has.
    pub(super) fn states(&self) -> usize {
        self.layout.len
    }

    /// The states at first contact (or release).
    pub(super) fn start(&self) -> ([f64; MOST_STATES], Mode) {
        let speed = self.assembly.approach.speed_m_per_s;
        let mut state = [0.0; MOST_STATES];
        state[1] = speed;
        if let Some(link) = self.layout.link {
            let (ahead_m, ahead_m_per_s) = self.assembly.sway.map_or((0.0, 0.0), Sway::link_ahead);
            (state[link], state[link + 1]) = (ahead_m, speed + ahead_m_per_s);
        }
        let touching = self.assembly.kind != Kind::Fall && speed >= 0.0;
        let mode = Mode {
            touching,
            guiding: self.guiding_at_touch(Guiding::Sticking),
            held_m: 0.0,
            stop: Stop::Away,
            coupling: Coupling::Holding,
            slipped_m: 0.0,
            beyond: 0,
            acts_from_s: [f64::INFINITY; MOST_TRIGGERS],
            acting: 0,
        };
        (state, mode)
    }

    /// The contact force at which the last moment of a creeping piece's contact begins, N: as at the
    /// [onset](System::onset), only a ramp is left.
    fn closing_n(&self, instant: &Instant, mode: &Mode) -> f64 {
        let parts_unloaded = self.pull_off_n == 0.0;
        let parts_pressed = self.assembly.across.acts() || self.assembly.spring.damping_ns_per_m > 0.0;
        if self.form != PieceForm::Creeping || mode.guiding == Guiding::Sticking || !parts_unloaded || parts_pressed {
            return 0.0;
        }
        // Not the piece's own velocity: the less the pad damps, the more that one shows the solver's error.
        self.series_n_per_m * (-instant.over_m_per_s).max(0.0) * CLOSING_RADIANS / self.pulsation_per_s()
    }

    /// The last moment of a creeping piece's contact: its length and the states after it. The robot's speed is constant, so
    /// the piece runs straight to where it is left alone: P = 0, S(x_p) = −σ·F_c, and the pad as deep as it
    /// stays. A dashpot ends the contact before that; but it defines the piece's velocity, along which the force is
    /// a ramp to zero.
    pub(super) fn closing(&self, time_s: f64, state: &[f64], mode: &Mode) -> Option<(f64, [f64; MOST_STATES])> {
        let piece = self.layout.piece?;
        let instant = self.instant(time_s, state, mode);
        if !mode.touching || self.closing_n(&instant, mode) <= 0.0 {
            return None;
        }
        let mut rates = [0.0; MOST_STATES];
        self.rates(time_s, state, mode, &mut rates);
        let free_m = self.free_depth_m(state, mode);
        let closing_m_per_s = instant.depth_m_per_s();
        let dashpot = self.pad(free_m, closing_m_per_s, state, mode).damping_ns_per_m > 0.0;
        let moment_s;
        if dashpot {
            moment_s = instant.contact_n / (self.assembly.spring.stiffness_n_per_m * -instant.piece_m_per_s);
        } else {
            let left_n = -self.engaged(state, mode) * instant.grip * self.assembly.guide.coulomb_n;
            let left_m = depth_under(left_n, instant.piece_m, |depth_m| self.spring(depth_m, 0.0, state, mode));
            moment_s = (instant.over_m - left_m - free_m) / -instant.over_m_per_s;
            (rates[0], rates[piece]) = (instant.tip_m_per_s, (left_m - instant.piece_m) / moment_s);
            if let Some(bend) = self.layout.bend {
                rates[bend] = 0.0;
            }
        }
        if rates[piece] > 0.0 || !(1e-15..=5.0 * CLOSING_RADIANS / self.pulsation_per_s()).contains(&moment_s) {
            return None;
        }
        let mut after = [0.0; MOST_STATES];
        for ((after, before), rate) in after.iter_mut().zip(state).zip(rates) {
            *after = before + rate * moment_s;
        }
        Some((moment_s, after))
    }

    /// The angular frequency of the ideal pulse, 1/s.
    pub(super) fn pulsation_per_s(&self) -> f64 {
        self.pulsation_per_s
    }

    /// The first moment of a contact that a creeping piece begins freely, or against unbent bristles: its length and the states after it.
    ///
    /// There the damping is next to nothing, so that the piece's equation is infinitely stiff only to become
    /// milder at once, and a solver that estimates its error with the first moment's stiffness overlooks it. But while
    /// the robot's speed v is constant the balance is a ramp, x_p = u·t with P((v − u)t, v − u) = S(u·t, u). The moment is a
    /// thousandth of a radian of the pulse, over which v changes by less than 10⁻⁶ of itself.
    pub(super) fn onset(&self, time_s: f64, state: &[f64], mode: &Mode) -> Option<(f64, [f64; MOST_STATES])> {
        let (PieceForm::Creeping, Some(pad), Some(piece)) = (self.form, &self.assembly.pad, self.layout.piece) else {
            return None;
        };
        let guide = &self.assembly.guide;
        let unbent = mode.guiding == Guiding::Bending && self.engaged(state, mode) == 0.0;
        if !mode.touching || !(unbent || mode.guiding == Guiding::Free) {
            return None;
        }
        let springs = self.assembly.spring.stiffness_n_per_m;
        let speed = state[1] - self.layout.frame.map_or(0.0, |frame| state[frame + 1]);
        let mut velocity = speed * pad.stiffness_n_per_m / (pad.stiffness_n_per_m + springs);
        let mut moment_s = 1e-3 / self.pulsation_per_s();
        let mut bristles_n_per_m = 0.0;
        if unbent {
            moment_s = moment_s.min(1e-3 * guide.presliding_m / speed);
            bristles_n_per_m = guide.grip(velocity) * guide.coulomb_n / guide.presliding_m;
        }
        for _ in 0..40 {
            let closing = speed - velocity;
            let press = self.pad(closing * moment_s, closing, state, mode);
            let spring = self.spring(velocity * moment_s, velocity, state, mode);
            let slope = (press.stiffness_n_per_m + spring.stiffness_n_per_m + bristles_n_per_m) * moment_s
                + press.damping_ns_per_m
                + spring.damping_ns_per_m;
            let step = (press.force_n - spring.force_n - bristles_n_per_m * velocity * moment_s) / slope;
            velocity += step;
            if step.abs() <= 1e-14 {
                break;
            }
        }
        let mut rates = [0.0; MOST_STATES];
        self.rates(time_s, state, mode, &mut rates);
        rates[piece] = velocity;
        if let Some(bend) = self.layout.bend {
            rates[bend] = guide.bending_per_s(0.0, velocity);
        }
        let mut after = [0.0; MOST_STATES];
        for ((after, before), rate) in after.iter_mut().zip(state).zip(rates) {
            *after = before + rate * moment_s;
        }
        Some((moment_s, after))
    }

    /// Whether the equations of this form are linear, and no more stiff than their solution by an exponential bears.
    pub(super) fn is_linear(&self, mode: &Mode) -> bool {
        let Assembly { pad, spring, guide, sway, .. } = &self.assembly;
        let pad_is_linear = pad.as_ref().is_none_or(|pad| is_linear(pad, mode.beyond));
        // Branches at no load: friction that grows with a pressing force only.
        let branches = guide.load_coefficient > 0.0 && (self.form == PieceForm::Massive || self.pull_off_n > 0.0);
        let falling = guide.falls_with_speed() && matches!(mode.guiding, Guiding::Sliding(_));
        let damping = spring.damping_ns_per_m + pad.as_ref().map_or(0.0, |pad| pad.damping_ns_per_m);
        let stiffness = spring.stiffness_n_per_m + pad.as_ref().map_or(0.0, |pad| pad.stiffness_n_per_m);
        let stiff = self.form == PieceForm::Creeping && mode.touching && stiffness > STIFFEST_PER_S * damping;
        let moving = mode.touching || self.form == PieceForm::Massive;
        let piece_is_linear = is_linear(spring, mode.beyond >> self.contact_laws) && guide.air_ns2_per_m2 == 0.0;
        !sway.is_some_and(Sway::is_imposed)
            && !self.is_driven(mode)
            && (!mode.touching || pad_is_linear)
            && (!moving || piece_is_linear)
            && !(mode.touching && branches)
            && !falling
            && !stiff
            && (mode.guiding != Guiding::Bending || self.creeps_home(mode))
    }

    /// Whether bristles let a massless piece creep home in a way that is known.
    fn creeps_home(&self, mode: &Mode) -> bool {
        let springs_are_linear = || is_linear(&self.assembly.spring, mode.beyond >> self.contact_laws);
        let springs_recover_at_once = self.layout.len == self.layout.spring;
        let is_let_go = !mode.touching && self.form != PieceForm::Massive && mode.guiding == Guiding::Bending;
        is_let_go && springs_recover_at_once && springs_are_linear()
    }

    /// How it does that from here on.
    pub(super) fn creep(&self, from_s: f64, state: &[f64], mode: &Mode) -> Option<Creep> {
        let bend = self.layout.bend.filter(|_| self.creeps_home(mode))?;
        let guide = &self.assembly.guide;
        let most_n = guide.holding_n(0.0);
        let held_m = self.held_by_bristles_m(state, mode);
        let springs = self.spring(held_m, 0.0, state, mode).stiffness_n_per_m;
        let bristles = most_n / guide.presliding_m;
        let decay = Decay::new(state[bend], springs, bristles, guide.presliding_m, guide.creep_m_per_s);
        let piece = self.layout.piece.map(|place| (place, held_m, -most_n / springs));
        Some(Creep { decay, from_s, bend, piece })
    }

    /// Whether a force may depend on the time itself.
    pub(super) fn is_timed(&self, mode: &Mode) -> bool {
        self.assembly.sway.is_some_and(Sway::is_imposed) || self.is_driven(mode)
    }

    /// Whether a drive acts.
    fn is_driven(&self, mode: &Mode) -> bool {
        let waiting = self.triggered.len() - mode.acting.count_ones() as usize;
        self.assembly.drives.len() > waiting
    }

    /// Whether the equations of this form are stiff: a massless piece that finds its balance, or bristles that forget much faster than a
    /// heavy piece swings.
    pub(super) fn is_stiff(&self, mode: &Mode) -> bool {
        let Assembly { guide, spring, pad, piece, approach, .. } = &self.assembly;
        let forgets_fast = || {
            let Some(piece) = piece else { return true };
            let bristles = guide.holding_n(0.0) / guide.presliding_m;
            let stiffness = spring.stiffness_n_per_m + pad.as_ref().map_or(0.0, |pad| pad.stiffness_n_per_m) + bristles;
            let forgetting_per_s = approach.speed_m_per_s.abs() / guide.presliding_m;
            forgetting_per_s > MILDLY_STIFF * (stiffness / piece.mass_kg).sqrt()
        };
        match mode.guiding {
            Guiding::Bending => forgets_fast(),
            _ => self.form == PieceForm::Creeping && mode.touching,
        }
    }

    /// Whether what the cell feels may swing when the robot has gone.
    pub(super) fn swings(&self) -> bool {
        self.form == PieceForm::Massive || self.layout.frame.is_some()
    }

    /// Absolute tolerances of the states for a tolerance of the force at the cell.
    pub(super) fn tolerances(&self, force_n: f64) -> [f64; MOST_STATES] {
        let stiffness = self.assembly.spring.stiffness_n_per_m;
        let length = force_n / stiffness;
        let pulsation = (stiffness / self.assembly.approach.effective_mass_kg).sqrt();
        let mut tolerances = [length; MOST_STATES];
        tolerances[1] = length * pulsation;
        if let Some(link) = self.layout.link {
            tolerances[link + 1] = length * pulsation;
        }
        if let (Some(place), Some(piece)) = (self.layout.piece, self.assembly.piece) {
            tolerances[place + 1] = length * (stiffness / piece.mass_kg).sqrt();
        }
        if let (Some(place), Some(frame)) = (self.layout.frame, self.assembly.frame) {
            let square = frame.stiffness_n_per_m / frame.mass_kg;
            // A cell that bears the frame's own mass feels its acceleration.
            tolerances[place] = force_n / stiffness.max(frame.on_cell_kg * square);
            tolerances[place + 1] = tolerances[place] * square.sqrt();
        }
        if let Some(bend) = self.layout.bend {
            // Bristles bend for moments only, in many steps: few samples see their error.
            tolerances[bend] = BRISTLES * force_n / self.assembly.guide.holding_n(0.0).max(force_n);
        }
        tolerances
    }

    /// When the form changes by itself: the next triggered drive begins to act.
    pub(super) fn next_switch_s(&self, mode: &Mode) -> f64 {
        (0..self.triggered.len())
            .filter(|place| mode.acting & (1 << place) == 0)
            .map(|place| mode.acts_from_s[place])
            .fold(f64::INFINITY, f64::min)
    }

    /// The form after that instant.
    pub(super) fn switch(&self, mode: &mut Mode, time_s: f64) {
        for place in 0..self.triggered.len() {
            if mode.acts_from_s[place] <= time_s {
                mode.acting |= 1 << place;
            }
        }
    }

    /// Forces, velocities and the rates of all states.
    pub(super) fn rates(&self, time_s: f64, state: &[f64], mode: &Mode, rates: &mut [f64]) {
        rates.fill(0.0);
        let instant = self.instant(time_s, state, mode);
        rates[0] = instant.tip_m_per_s;
        rates[1] = instant.tip_m_per_s2;
        if let Some(link) = self.layout.link {
            rates[link] = state[link + 1];
            rates[link + 1] = self.link_m_per_s2(time_s, link, state, mode, &instant);
        }
        if let Some(frame) = self.layout.frame {
            rates[frame] = state[frame + 1];
            rates[frame + 1] = instant.frame_m_per_s2;
        }
        if let Some(piece) = self.layout.piece {
            rates[piece] = instant.piece_m_per_s;
            if let (PieceForm::Massive, Some(body)) = (self.form, self.assembly.piece)
                && mode.guiding != Guiding::Sticking
            {
                let net_n = instant.contact_n - instant.spring_n - instant.friction_n;
                rates[piece + 1] = net_n / body.mass_kg - instant.frame_m_per_s2;
            }
        }
        if let Some(bend) = self.layout.bend {
            rates[bend] = self.assembly.guide.bending_per_s(state[bend], self.rubbing_m_per_s(&instant, state, mode));
        }
        if self.layout.spring > self.layout.contact {
            let pad = self.assembly.pad.as_ref().expect("laws with states are on a pad");
            let (depth, rate) = if mode.touching {
                (instant.depth_m(), instant.depth_m_per_s())
            } else {
                (self.free_depth_m(state, mode), 0.0)
            };
            law_rates(pad, depth, rate, mode.beyond, &state[self.layout.contact..], &mut rates[self.layout.contact..]);
        }
        if self.layout.len > self.layout.spring {
            law_rates(
                &self.assembly.spring,
                instant.piece_m,
                instant.piece_m_per_s,
                mode.beyond >> self.contact_laws,
                &state[self.layout.spring..],
                &mut rates[self.layout.spring..],
            );
        }
    }

    /// Which state a quantity is, and which one is to be subtracted: a gauge shows what bears it over what it stands on, the
    /// depth (while they touch) the tip over the frame. `None`: it is no state.
    pub(super) fn state_of(&self, quantity: Quantity) -> Option<(usize, Option<usize>)> {
        match quantity {
            Quantity::Position => {
                Some((self.shown(), self.assembly.frame.filter(|frame| frame.bears_gauge).and(self.layout.frame)))
            }
            Quantity::Velocity => Some((self.shown() + 1, None)),
            Quantity::Depth => Some((0, self.layout.frame)),
            _ => None,
        }
    }

    /// The place of what bears the robot's instruments among the states: of the tip, or of the link behind it.
    fn shown(&self) -> usize {
        self.layout.link.filter(|_| self.assembly.link_bears_gauge).unwrap_or(0)
    }

    /// The forces and velocities at an instant.
    pub(super) fn instant(&self, time_s: f64, state: &[f64], mode: &Mode) -> Instant {
        let (tip_m, tip_m_per_s) = (state[0], state[1]);
        let (frame_m, frame_m_per_s) = self.layout.frame.map_or((0.0, 0.0), |frame| (state[frame], state[frame + 1]));
        let mut instant = Instant {
            tip_m_per_s,
            over_m: tip_m - frame_m,
            over_m_per_s: tip_m_per_s - frame_m_per_s,
            ..Instant::default()
        };
        instant.grip = self.assembly.guide.grip(match (self.form, self.layout.piece) {
            (PieceForm::Massive, Some(piece)) => state[piece + 1],
            (PieceForm::Carried, _) => instant.over_m_per_s,
            _ => self.shared_m_per_s(&instant),
        });
        // What moves with the tip, and what moves it besides the contact.
        let whole = self.is_whole(mode);
        let body_kg = if whole { self.tip_kg + self.link_kg } else { self.tip_kg };
        let (drive_n, driven_n) = match self.layout.link {
            Some(link) if whole => {
                let drive_n = self.drive_n(time_s, state[link], state[link + 1], mode);
                (drive_n, drive_n)
            }
            Some(link) => {
                instant.coupling_n = self.coupling_n(state[link] - tip_m, state[link + 1] - tip_m_per_s, mode);
                (0.0, instant.coupling_n)
            }
            None => {
                let drive_n = self.drive_n(time_s, tip_m, tip_m_per_s, mode);
                (drive_n, drive_n)
            }
        };
        let driven_n = driven_n + body_kg * self.field_m_per_s2(time_s);
        let frame_n = self
            .assembly
            .frame
            .map_or(0.0, |frame| -frame.stiffness_n_per_m * frame_m - frame.damping_ns_per_m * frame_m_per_s);
        match self.form {
            PieceForm::Massive => self.massive(state, mode, frame_n, &mut instant),
            _ if !mode.touching && mode.guiding == Guiding::Bending => self.let_go(state, mode, &mut instant),
            _ if !mode.touching => {
                let rubs = self.assembly.guide.rubs();
                instant.piece_m = if rubs { mode.held_m } else { self.free_stroke_m(state, mode) };
                instant.spring_n = self.spring(instant.piece_m, 0.0, state, mode).force_n;
                instant.friction_n = if rubs { -instant.spring_n } else { 0.0 };
            }
            PieceForm::Carried => self.carried(driven_n, body_kg, frame_n, state, mode, &mut instant),
            PieceForm::Balanced => self.balanced(time_s, state, mode, &mut instant),
            PieceForm::Creeping => self.creeping(state, mode, &mut instant),
        }
        if mode.touching {
            instant.across_n = self.assembly.across.force_n(instant.over_m_per_s);
            instant.contact_n += instant.across_n;
            instant.spring_n += instant.across_n;
        }
        let held = self.form == PieceForm::Carried && mode.touching && mode.guiding == Guiding::Sticking;
        instant.frame_m_per_s2 = self.frame_m_per_s2(frame_n, mode, &instant);
        instant.tip_m_per_s2 = if held { instant.frame_m_per_s2 } else { (driven_n - instant.contact_n) / body_kg };
        if whole {
            // What the link needs to be as fast as the tip.
            let field_m_per_s2 = self.field_m_per_s2(time_s);
            instant.coupling_n = drive_n + self.link_kg * (field_m_per_s2 - instant.tip_m_per_s2);
        }
        instant
    }

    /// m_link·ẍ_link = D − C, unless it moves as one with the tip.
    fn link_m_per_s2(&self, time_s: f64, link: usize, state: &[f64], mode: &Mode, instant: &Instant) -> f64 {
        if self.is_whole(mode) {
            return instant.tip_m_per_s2;
        }
        let drive_n = self.drive_n(time_s, state[link], state[link + 1], mode);
        self.field_m_per_s2(time_s) + (drive_n - instant.coupling_n) / self.link_kg
    }

    /// m_f·ẍ_f = S + friction − k_f·x_f − c_f·ẋ_f; a heavy piece that friction holds moves with the frame.
    fn frame_m_per_s2(&self, frame_n: f64, mode: &Mode, instant: &Instant) -> f64 {
        let Some(frame) = self.assembly.frame else { return 0.0 };
        let free_m_per_s2 = (frame_n + instant.spring_n + instant.friction_n) / frame.mass_kg;
        match (self.form, self.assembly.piece, mode.guiding) {
            (PieceForm::Massive, Some(piece), Guiding::Sticking) => {
                (frame_n + instant.contact_n) / (frame.mass_kg + piece.mass_kg)
            }
            _ => free_m_per_s2,
        }
    }

    /// Gravity and the robot's sway: what accelerates every body of the robot alike.
    fn field_m_per_s2(&self, time_s: f64) -> f64 {
        let imposed = self.assembly.sway.filter(|sway| sway.is_imposed());
        self.assembly.gravity_m_per_s2 + imposed.map_or(0.0, |sway| sway.acceleration_m_per_s2(time_s))
    }

    /// Whether tip and link are one body at this time: a coupling without elasticity holds.
    fn is_whole(&self, mode: &Mode) -> bool {
        self.layout.link.is_some() && self.assembly.joint.is_none() && mode.coupling == Coupling::Holding
    }

    /// From link to tip, through an elastic joint or a slipping coupling, N.
    fn coupling_n(&self, ahead_m: f64, ahead_m_per_s: f64, mode: &Mode) -> f64 {
        match (mode.coupling, self.assembly.joint, self.assembly.ceiling) {
            (Coupling::Slipping(sign), _, Some(ceiling)) => {
                sign * ceiling.force_n + ceiling.damping_ns_per_m * ahead_m_per_s
            }
            (_, Some(joint), _) => {
                joint.stiffness_n_per_m * (ahead_m - mode.slipped_m) + joint.damping_ns_per_m * ahead_m_per_s
            }
            _ => 0.0,
        }
    }

    /// m·ẍ = D − P, P = S + friction: robot and piece are one.
    fn carried(&self, driven_n: f64, body_kg: f64, frame_n: f64, state: &[f64], mode: &Mode, instant: &mut Instant) {
        instant.piece_m = instant.over_m;
        instant.piece_m_per_s = instant.over_m_per_s;
        let guide = &self.assembly.guide;
        instant.air_n = guide.air_n(instant.piece_m_per_s);
        instant.spring_n = self.spring(instant.piece_m, instant.piece_m_per_s, state, mode).force_n + instant.air_n;
        instant.contact_n = match mode.guiding {
            Guiding::Free | Guiding::Sliding(_) | Guiding::Bending => {
                let sign = self.engaged(state, mode);
                let pressed_n = instant.spring_n + sign * instant.grip * guide.coulomb_n;
                pressed_n / self.rubbed_part(sign, pressed_n, instant.grip)
            }
            Guiding::Sticking => {
                // Held on the frame, the robot takes part in its motion.
                let frame_m_per_s2 =
                    self.assembly.frame.map_or(0.0, |frame| (frame_n + driven_n) / (frame.mass_kg + body_kg));
                driven_n - body_kg * frame_m_per_s2
            }
        };
        instant.friction_n = instant.contact_n - instant.spring_n;
    }

    /// Which part of the friction acts, against the motion if positive: all of it on a sliding piece, as much as they are bent of bristles.
    fn engaged(&self, state: &[f64], mode: &Mode) -> f64 {
        match mode.guiding {
            Guiding::Free | Guiding::Sticking => 0.0,
            Guiding::Sliding(sign) => sign,
            Guiding::Bending => self.layout.bend.map_or(0.0, |bend| state[bend]),
        }
    }

    /// The velocity of a massless piece on bristles, m/s: a·(u − `free_m_per_s`) + b·(u − y·√(u² + v_c²)) = 0, a the stiffness that
    /// brings it to its balance, b that of the bristles. Of the two roots of its square that on which u − free has the sign of y.
    fn bent_m_per_s(&self, bend: f64, stiffness_n_per_m: f64, free_m_per_s: f64, friction_n: f64) -> f64 {
        let guide = &self.assembly.guide;
        let bristles_n_per_m = friction_n / guide.presliding_m;
        let both = stiffness_n_per_m + bristles_n_per_m;
        let bent = bristles_n_per_m * bend;
        let driven = stiffness_n_per_m * free_m_per_s;
        let determinant = both * both - bent * bent;
        let root = (driven * driven + guide.creep_m_per_s * guide.creep_m_per_s * determinant).sqrt();
        (both * driven + bent * root) / determinant
    }

    /// Where bristles hold a massless piece when the robot has gone.
    fn held_by_bristles_m(&self, state: &[f64], mode: &Mode) -> f64 {
        let held_n = -self.engaged(state, mode) * self.assembly.guide.holding_n(0.0);
        depth_under(held_n, 0.0, |depth_m| self.spring(depth_m, 0.0, state, mode))
    }

    /// S(x_p) + y·F_s = 0: what bristles hold of a massless piece when the robot has gone, and how fast it creeps home.
    fn let_go(&self, state: &[f64], mode: &Mode, instant: &mut Instant) {
        let bend = self.engaged(state, mode);
        let most_n = self.assembly.guide.holding_n(0.0);
        instant.piece_m = self.held_by_bristles_m(state, mode);
        let spring = self.spring(instant.piece_m, 0.0, state, mode);
        instant.piece_m_per_s = self.bent_m_per_s(bend, spring.stiffness_n_per_m, 0.0, most_n);
        instant.spring_n = spring.force_n;
        instant.friction_n = -spring.force_n;
    }

    /// The velocity of a massless piece if pad and springs alone shared the robot's, m/s.
    fn shared_m_per_s(&self, instant: &Instant) -> f64 {
        let pad = self.assembly.pad.as_ref().map_or(0.0, |pad| pad.stiffness_n_per_m);
        instant.over_m_per_s * pad / (pad + self.assembly.spring.stiffness_n_per_m)
    }

    /// The velocity of a sliding piece, as far as its sign is asked for. That of a creeping one is an error of its place times
    /// how fast it finds its balance; the faster it does, the less its own velocity counts beside the one that pad and
    /// springs would give it, which comes to rest no more than that moment earlier.
    fn sliding_m_per_s(&self, instant: &Instant, state: &[f64], mode: &Mode) -> f64 {
        if self.form != PieceForm::Creeping {
            return instant.piece_m_per_s;
        }
        let pad = self.pad(instant.depth_m(), instant.depth_m_per_s(), state, mode);
        let spring = self.spring(instant.piece_m, instant.piece_m_per_s, state, mode);
        let damping = pad.damping_ns_per_m + spring.damping_ns_per_m;
        let speed = (pad.stiffness_n_per_m + spring.stiffness_n_per_m) / damping.max(PIECE_DRAG_NS_PER_M);
        instead_of_own(instant.piece_m_per_s, self.shared_m_per_s(instant), speed)
    }

    /// The velocity that bends bristles. A creeping piece's own is, as for [sliding](System::sliding_m_per_s), its error times how fast it finds its
    /// balance: so far from it an implicit method's stages are, and the bend is not linear in it.
    fn rubbing_m_per_s(&self, instant: &Instant, state: &[f64], mode: &Mode) -> f64 {
        if self.form != PieceForm::Creeping || !mode.touching {
            return instant.piece_m_per_s;
        }
        let pad = self.pad(instant.depth_m(), instant.depth_m_per_s(), state, mode);
        let spring = self.spring(instant.piece_m, instant.piece_m_per_s, state, mode);
        let (bend, guide) = (self.engaged(state, mode), &self.assembly.guide);
        let part = self.rubbed_part(bend, pad.force_n, instant.grip);
        let balanced_m_per_s = self.balanced_m_per_s(part, &pad, &spring, instant, Some(bend));
        let stiffness = part * pad.stiffness_n_per_m + spring.stiffness_n_per_m;
        let damping = part * pad.damping_ns_per_m + spring.damping_ns_per_m + guide.air_ns_per_m(instant.piece_m_per_s);
        instead_of_own(instant.piece_m_per_s, balanced_m_per_s, stiffness / damping.max(PIECE_DRAG_NS_PER_M))
    }

    /// The velocity of a piece that is in balance at each instant, m/s, as pad and springs there give it, and bristles of this bend, if any.
    fn balanced_m_per_s(
        &self,
        part: f64,
        pad: &Response,
        spring: &Response,
        instant: &Instant,
        bend: Option<f64>,
    ) -> f64 {
        let stiffness = part * pad.stiffness_n_per_m + spring.stiffness_n_per_m;
        let driven_n_per_s =
            part * (pad.stiffness_n_per_m * instant.over_m_per_s + pad.drift_n_per_s) - spring.drift_n_per_s;
        let free_m_per_s = driven_n_per_s / stiffness;
        bend.map_or(free_m_per_s, |bend| {
            let friction_n = instant.grip * self.assembly.guide.sliding_n(pad.force_n);
            self.bent_m_per_s(bend, stiffness, free_m_per_s, friction_n)
        })
    }

    /// Where a creeping piece is in balance at rest, sliding with this sign: there it comes to rest.
    fn resting_m(&self, sign: f64, instant: &Instant, state: &[f64], mode: &Mode) -> f64 {
        let mut piece_m = instant.piece_m;
        let grip = self.assembly.guide.grip(0.0);
        for _ in 0..20 {
            let pad = self.pad(instant.over_m - piece_m, instant.over_m_per_s, state, mode);
            let spring = self.spring(piece_m, 0.0, state, mode);
            let part = self.rubbed_part(sign, pad.force_n, grip);
            let excess_n = part * pad.force_n - spring.force_n - sign * grip * self.assembly.guide.coulomb_n;
            let step_m = excess_n / (part * pad.stiffness_n_per_m + spring.stiffness_n_per_m);
            piece_m += step_m;
            if step_m.abs() <= 1e-15 {
                break;
            }
        }
        piece_m
    }

    /// What is left of a contact force (or of one of its sign) beside the friction that it causes while sliding. Tension
    /// causes none.
    fn rubbed_part(&self, sign: f64, contact_n: f64, grip: f64) -> f64 {
        let pulled = self.pull_off_n > 0.0 && contact_n < 0.0;
        if pulled { 1.0 } else { 1.0 - sign * grip * self.assembly.guide.load_coefficient }
    }

    /// The air's drag on a massless piece behind a pad, N. The piece is set in motion by the pad's growing force: with 2c·u̇·ü =
    /// (k_pad + k_body)·(v_s − u̇), v_s the shared velocity, the drag begins as k_pad·v·t and comes to c·v_s² as
    /// 1 − e^(−2s), s = t·(k_pad + k_body)/(2c·v_s).
    fn air_behind_pad_n(&self, time_s: f64, instant: &Instant) -> f64 {
        let guide = &self.assembly.guide;
        if guide.air_ns2_per_m2 == 0.0 {
            return 0.0;
        }
        let shared_m_per_s = self.shared_m_per_s(instant);
        let pad = self.assembly.pad.as_ref().map_or(0.0, |pad| pad.stiffness_n_per_m);
        let stiffness = pad + self.assembly.spring.stiffness_n_per_m;
        let first_m_per_s = self.assembly.approach.speed_m_per_s.abs() * pad / stiffness;
        let turns = time_s.max(0.0) * stiffness / (guide.air_ns2_per_m2 * first_m_per_s).max(f64::MIN_POSITIVE);
        guide.air_n(shared_m_per_s) * -(-turns).exp_m1()
    }

    /// (1 − σμ)·P(x − x_p) = S(x_p) + σ·F_c, solved for x_p; its derivative by time gives the velocity.
    fn balanced(&self, time_s: f64, state: &[f64], mode: &Mode, instant: &mut Instant) {
        if mode.guiding == Guiding::Sticking {
            instant.piece_m = mode.held_m;
            instant.contact_n = self.pad(instant.over_m - mode.held_m, 0.0, state, mode).force_n;
            instant.spring_n = self.spring(mode.held_m, 0.0, state, mode).force_n;
            instant.friction_n = instant.contact_n - instant.spring_n;
            return;
        }
        let sign = self.engaged(state, mode);
        let air_n = self.air_behind_pad_n(time_s, instant);
        let level = sign * instant.grip * self.assembly.guide.coulomb_n + air_n;
        let mut part = 1.0 - sign * instant.grip * self.assembly.guide.load_coefficient;
        let softness = self.assembly.pad.as_ref().map_or(0.0, |pad| pad.stiffness_n_per_m);
        let mut piece_m =
            (part * softness * instant.over_m - level) / (part * softness + self.assembly.spring.stiffness_n_per_m);
        let (mut pad, mut spring);
        let mut tries = 0;
        loop {
            pad = self.pad(instant.over_m - piece_m, 0.0, state, mode);
            spring = self.spring(piece_m, 0.0, state, mode);
            part = self.rubbed_part(sign, pad.force_n, instant.grip);
            let excess_n = part * pad.force_n - spring.force_n - level;
            let step = excess_n / (part * pad.stiffness_n_per_m + spring.stiffness_n_per_m);
            tries += 1;
            if step.abs() <= 1e-15 + 1e-13 * piece_m.abs() || tries > 40 {
                break;
            }
            piece_m += step;
        }
        instant.piece_m = piece_m;
        let bend = (mode.guiding == Guiding::Bending).then_some(sign);
        instant.piece_m_per_s = self.balanced_m_per_s(part, &pad, &spring, instant, bend);
        instant.contact_n = pad.force_n;
        instant.air_n = air_n;
        instant.spring_n = spring.force_n + air_n;
        instant.friction_n = instant.contact_n - instant.spring_n;
    }

    /// (1 − σμ)·P(δ, v − v_p) = S(x_p, v_p) + σ·F_c + c·(v_p − v_e), solved for v_p; v_e is the velocity that springs
    /// without loss would give. c is next to nothing, except beyond the end of a contact, where a trial
    /// step may look: there it keeps the damping positive, and with it the equation tame.
    fn creeping(&self, state: &[f64], mode: &Mode, instant: &mut Instant) {
        let piece_m = state[self.layout.piece.expect("a creeping piece has a place")];
        let depth_m = instant.over_m - piece_m;
        let sign = self.engaged(state, mode);
        let level = sign * instant.grip * self.assembly.guide.coulomb_n;
        let sticking = mode.guiding == Guiding::Sticking;
        let likely = self.shared_m_per_s(instant);
        let guide = &self.assembly.guide;
        let mut velocity = if sticking { 0.0 } else { likely };
        let mut drag = None;
        let (mut pad, mut spring);
        let mut tries = 0;
        loop {
            pad = self.pad(depth_m, instant.over_m_per_s - velocity, state, mode);
            spring = self.spring(piece_m, velocity, state, mode);
            tries += 1;
            if sticking || tries > 40 {
                break;
            }
            let part = self.rubbed_part(sign, pad.force_n, instant.grip);
            let air_ns_per_m = guide.air_ns_per_m(velocity);
            let damping = part * pad.damping_ns_per_m + spring.damping_ns_per_m + air_ns_per_m;
            let drag = *drag.get_or_insert_with(|| {
                (damping * damping + PIECE_DRAG_NS_PER_M * PIECE_DRAG_NS_PER_M).sqrt() - damping
            });
            let air_n = guide.air_n(velocity);
            let excess_n = part * pad.force_n - spring.force_n - air_n - level - drag * (velocity - likely);
            let step = excess_n / (damping + drag);
            if step.abs() <= 1e-12 + 1e-10 * velocity.abs() {
                break;
            }
            velocity += step;
        }
        instant.piece_m = piece_m;
        instant.piece_m_per_s = velocity;
        instant.contact_n = pad.force_n;
        instant.air_n = guide.air_n(velocity);
        instant.spring_n = spring.force_n + instant.air_n;
        instant.friction_n = instant.contact_n - instant.spring_n;
    }

    /// m_p·(ẍ_p + ẍ_f) = P − S − friction, x_p over the frame.
    fn massive(&self, state: &[f64], mode: &Mode, frame_n: f64, instant: &mut Instant) {
        let place = self.layout.piece.expect("a massive piece has a place");
        instant.piece_m = state[place];
        instant.piece_m_per_s = if mode.guiding == Guiding::Sticking { 0.0 } else { state[place + 1] };
        if mode.touching {
            instant.contact_n = self.pad(instant.depth_m(), instant.depth_m_per_s(), state, mode).force_n;
        }
        instant.air_n = self.assembly.guide.air_n(instant.piece_m_per_s);
        instant.spring_n = self.spring(instant.piece_m, instant.piece_m_per_s, state, mode).force_n + instant.air_n;
        let stop_n = match self.assembly.piece {
            Some(piece) if mode.stop != Stop::Away => piece.stop_n(instant.piece_m, instant.piece_m_per_s),
            _ => 0.0,
        };
        instant.friction_n = match mode.guiding {
            Guiding::Free => stop_n,
            Guiding::Sliding(sign) => stop_n + sign * instant.grip * self.assembly.guide.sliding_n(instant.contact_n),
            Guiding::Bending => stop_n + self.bristles_n(state, mode, instant),
            Guiding::Sticking => {
                let swung_kg = self.assembly.piece.map_or(0.0, |piece| piece.mass_kg);
                let swing_n = swung_kg * self.frame_m_per_s2(frame_n, mode, instant);
                instant.contact_n - instant.spring_n - swing_n
            }
        };
    }

    /// What bent bristles do against a heavy piece, N: F·(y + √(m·z/F)·dy/dt), F the friction of sliding and z the bend; the piece would
    /// ring on them for ever without their own damping, which is half of critical (C. Canudas de Wit et al., IEEE Trans. Autom. Control
    /// 40 (1995) 419).
    fn bristles_n(&self, state: &[f64], mode: &Mode, instant: &Instant) -> f64 {
        let guide = &self.assembly.guide;
        let (bend, friction_n) = (self.engaged(state, mode), instant.grip * guide.sliding_n(instant.contact_n));
        let swung_kg = self.assembly.piece.map_or(0.0, |piece| piece.mass_kg);
        let damping_ns = (swung_kg * guide.presliding_m * friction_n).sqrt();
        friction_n * bend + damping_ns * guide.bending_per_s(bend, instant.piece_m_per_s)
    }

    /// What the cell bears.
    pub(super) fn cell_n(&self, instant: &Instant) -> f64 {
        if self.assembly.piece.is_some_and(|piece| piece.cell_in_front) {
            return instant.contact_n;
        }
        let inertia_n = self.assembly.frame.map_or(0.0, |frame| frame.on_cell_kg * instant.frame_m_per_s2);
        let guide = &self.assembly.guide;
        let past_n = (1.0 - guide.air_cell_share) * instant.air_n;
        instant.spring_n - past_n + guide.cell_share * instant.friction_n - inertia_n
    }

    /// What instruments read, in the order of [`Reading`](super::trajectory::Reading).
    pub(super) fn readings(&self, time_s: f64, state: &[f64], mode: &Mode, instant: &Instant) -> [f64; READINGS] {
        let shown_m_per_s2 = match self.shown() {
            0 => instant.tip_m_per_s2,
            link => self.link_m_per_s2(time_s, link, state, mode, instant),
        };
        [self.cell_n(instant), shown_m_per_s2, instant.piece_m]
    }

    /// For each event that this form can end with, a number that is positive until it happens.
    /// With how many there are, what instruments read.
    pub(super) fn margins(
        &self,
        time_s: f64,
        state: &[f64],
        mode: &Mode,
        margins: &mut [f64; MOST_EVENTS],
    ) -> (usize, [f64; READINGS]) {
        let instant = self.instant(time_s, state, mode);
        margins.fill(1.0);
        if mode.touching {
            margins[CONTACT_EVENT] = instant.contact_n + self.pull_off_n - self.closing_n(&instant, mode);
        } else if self.assembly.kind != Kind::Fall {
            margins[CONTACT_EVENT] = self.gap_m(&instant, state, mode);
        }
        if mode.touching || self.form == PieceForm::Massive {
            match mode.guiding {
                Guiding::Free | Guiding::Bending => {}
                Guiding::Sliding(sign) => margins[GUIDE_EVENTS[0]] = sign * self.sliding_m_per_s(&instant, state, mode),
                Guiding::Sticking => {
                    let holding_n = self.held_n(&instant, 2.0);
                    margins[GUIDE_EVENTS[0]] = holding_n - instant.friction_n;
                    margins[GUIDE_EVENTS[1]] = holding_n + instant.friction_n;
                }
            }
        }
        if let (Some(ceiling), Some(link)) = (self.assembly.ceiling, self.layout.link) {
            let [first, second] = COUPLING_EVENTS;
            match mode.coupling {
                Coupling::Holding => {
                    let most_n = ceiling.force_n * (1.0 + 1e-9) + self.balance_n;
                    margins[first] = most_n - instant.coupling_n;
                    margins[second] = most_n + instant.coupling_n;
                }
                Coupling::Slipping(sign) => margins[first] = sign * (state[link + 1] - state[1]),
            }
        }
        if let Some(piece) = self.assembly.piece.filter(|piece| piece.stop_n_per_m > 0.0) {
            let pulsation_per_s = (piece.stop_n_per_m / piece.mass_kg).sqrt();
            match mode.stop {
                // At first contact it lies at its stop; only what has been pushed away returns to it.
                Stop::Away if !mode.touching => {
                    margins[STOP_EVENT] = (pulsation_per_s * instant.piece_m).max(instant.piece_m_per_s);
                }
                Stop::At => margins[STOP_EVENT] = -piece.stop_n(instant.piece_m, instant.piece_m_per_s),
                Stop::Away | Stop::Settled => {}
            }
        }
        let mut count = FIRST_KNOT;
        let mut watch = |law: Option<f64>, depth_m: f64, watched: bool| {
            if let (Some(knot_m), true) = (law, watched) {
                let beyond = mode.beyond & (1 << (count - FIRST_KNOT)) != 0;
                margins[count] = if beyond { depth_m - knot_m } else { knot_m - depth_m };
            }
            count += 1;
        };
        if let Some(pad) = &self.assembly.pad {
            for law in &pad.laws {
                watch(law.knot_m(pad.share), instant.depth_m(), mode.touching);
            }
        }
        for law in &self.assembly.spring.laws {
            watch(law.knot_m(self.assembly.spring.share), instant.piece_m, true);
        }
        for (place, drive) in self.triggered.iter().enumerate() {
            if let (Some(trigger), true) =
                (self.assembly.drives[*drive].trigger(), mode.acts_from_s[place].is_infinite())
            {
                margins[count] = trigger.force_n - instant.contact_n;
            }
            count += 1;
        }
        (count, self.readings(time_s, state, mode, &instant))
    }

    /// The form (and the states) after the event with this number.
    pub(super) fn pass(&self, number: usize, time_s: f64, state: &mut [f64], mode: &mut Mode) {
        match self.event(number) {
            Event::Contact if mode.touching => self.part(time_s, state, mode),
            Event::Contact => {
                mode.touching = true;
                mode.guiding = self.guiding_at_touch(mode.guiding);
                if mode.stop == Stop::Settled {
                    mode.stop = Stop::Away;
                }
            }
            Event::Release => self.change_guiding(time_s, state, mode),
            Event::Coupling => self.change_coupling(time_s, state, mode),
            Event::Stop => mode.stop = self.stop_after(mode.stop, state),
            Event::Knot { law } => mode.beyond ^= 1 << law,
            Event::Trigger { drive } => {
                let delay_s = self.assembly.drives[self.triggered[drive]].trigger().map_or(0.0, |t| t.delay_s);
                mode.acts_from_s[drive] = time_s + delay_s;
                self.switch(mode, time_s);
            }
        }
    }

    /// The piece comes to its stop, or leaves it, if it still swings by a force that counts.
    fn stop_after(&self, before: Stop, state: &[f64]) -> Stop {
        let (Some(place), Some(piece)) = (self.layout.piece, self.assembly.piece) else { return before };
        let swings_n = state[place + 1].abs() * (self.assembly.spring.stiffness_n_per_m * piece.mass_kg).sqrt();
        match before {
            Stop::At if swings_n > self.balance_n => Stop::Away,
            Stop::At => Stop::Settled,
            Stop::Away | Stop::Settled => Stop::At,
        }
    }

    fn event(&self, number: usize) -> Event {
        let laws = self.contact_laws + self.assembly.spring.laws.len();
        match number {
            CONTACT_EVENT => Event::Contact,
            _ if GUIDE_EVENTS.contains(&number) => Event::Release,
            _ if COUPLING_EVENTS.contains(&number) => Event::Coupling,
            STOP_EVENT => Event::Stop,
            _ if number < FIRST_KNOT + laws => Event::Knot { law: number - FIRST_KNOT },
            _ => Event::Trigger { drive: number - FIRST_KNOT - laws },
        }
    }

    fn guiding_at_touch(&self, before: Guiding) -> Guiding {
        match self.form {
            _ if !self.assembly.guide.rubs() => Guiding::Free,
            _ if self.assembly.guide.bends() => Guiding::Bending,
            PieceForm::Carried => Guiding::Sliding(1.0),
            PieceForm::Massive => before,
            PieceForm::Balanced | PieceForm::Creeping => Guiding::Sticking,
        }
    }

    /// The robot leaves; a massless piece stays where friction holds it, or is at rest at once.
    fn part(&self, time_s: f64, state: &mut [f64], mode: &mut Mode) {
        let instant = self.instant(time_s, state, mode);
        mode.touching = false;
        // What the neck takes until it breaks, it takes at once: a millisecond in which the robot hardly slows.
        let torn_j = self.assembly.touched().neck.work_j();
        let left_m2_per_s2 = (state[1] * state[1] - 2.0 * torn_j / self.tip_kg).max(0.0);
        state[1] = left_m2_per_s2.sqrt().copysign(state[1]);
        if self.form == PieceForm::Massive {
            return;
        }
        mode.held_m = if self.assembly.guide.rubs() { self.left_m(&instant, state, mode) } else { 0.0 };
        if let Some(piece) = self.layout.piece {
            state[piece] = mode.held_m;
        }
        if let (Some(bend), most_n @ 1e-12..) = (self.layout.bend, self.assembly.guide.holding_n(0.0)) {
            state[bend] = -self.spring(mode.held_m, 0.0, state, mode).force_n / most_n;
        }
        // What lay beyond a knot of the springs does so no longer, where the piece has jumped back.
        let spring = &self.assembly.spring;
        for (law, spring_law) in spring.laws.iter().enumerate() {
            if spring_law.knot_m(spring.share).is_some_and(|knot_m| mode.held_m < knot_m) {
                mode.beyond &= !(1 << (self.contact_laws + law));
            }
        }
    }

    /// Where friction holds the piece when the robot has gone: where it is, or, if it was pulled out by more than that, as
    /// far out as friction holds; less what its momentum takes from that.
    fn left_m(&self, instant: &Instant, state: &[f64], mode: &Mode) -> f64 {
        let most_n = self.assembly.guide.coulomb_n;
        let spring_n = instant.spring_n - instant.across_n;
        // A robot that pulls, or that leaves a pad which is still pressed, leaves more than friction holds.
        let parts_loaded = self.pull_off_n != 0.0 || self.assembly.across.acts();
        let held_n = if parts_loaded && spring_n.abs() > most_n { most_n.copysign(spring_n) } else { spring_n };
        let left_n = self.assembly.guide.left_share(instant.over_m_per_s) * held_n;
        // Drag and dashpots press while the piece moves; at rest the springs alone do.
        if left_n == self.spring(instant.piece_m, 0.0, state, mode).force_n {
            return instant.piece_m;
        }
        depth_under(left_n, instant.piece_m, |depth_m| self.spring(depth_m, 0.0, state, mode))
    }

    /// The coupling slips with the force that it can pass on, until link and tip are equally fast.
    fn change_coupling(&self, time_s: f64, state: &mut [f64], mode: &mut Mode) {
        let (Some(link), Some(ceiling)) = (self.layout.link, self.assembly.ceiling) else { return };
        match mode.coupling {
            Coupling::Holding => {
                mode.coupling = Coupling::Slipping(self.instant(time_s, state, mode).coupling_n.signum());
            }
            Coupling::Slipping(sign) => {
                state[link + 1] = state[1];
                if let Some(joint) = self.assembly.joint {
                    mode.slipped_m = state[link] - state[0] - sign * ceiling.force_n / joint.stiffness_n_per_m;
                }
                mode.coupling = Coupling::Holding;
                // It may have to pass on as much in the other direction at once.
                if -sign * self.instant(time_s, state, mode).coupling_n
                    > ceiling.force_n * (1.0 + 1e-9) + self.balance_n
                {
                    mode.coupling = Coupling::Slipping(-sign);
                }
            }
        }
    }

    /// Sticking breaks loose, or sliding comes to rest: there it sticks, or slides back.
    fn change_guiding(&self, time_s: f64, state: &mut [f64], mode: &mut Mode) {
        let instant = self.instant(time_s, state, mode);
        match mode.guiding {
            Guiding::Free | Guiding::Bending => {}
            Guiding::Sticking => {
                mode.guiding = Guiding::Sliding(instant.friction_n.signum());
            }
            Guiding::Sliding(sign) => {
                let mut sticking = Mode { guiding: Guiding::Sticking, held_m: instant.piece_m, ..*mode };
                if self.form == PieceForm::Carried {
                    state[1] -= instant.over_m_per_s;
                    if let (Some(link), true) = (self.layout.link, self.is_whole(mode)) {
                        state[link + 1] = state[1];
                    }
                } else if let (PieceForm::Massive, Some(piece)) = (self.form, self.layout.piece) {
                    state[piece + 1] = 0.0;
                }
                if let (PieceForm::Creeping, Some(piece)) = (self.form, self.layout.piece) {
                    state[piece] = self.resting_m(sign, &instant, state, mode);
                    sticking.held_m = state[piece];
                }
                let at_rest = self.instant(time_s, state, &sticking);
                // What comes to rest is not pushed on: where it seems so, it is by less than the motion is exact.
                let pushed_back_n = -sign * at_rest.friction_n;
                if pushed_back_n > self.held_n(&at_rest, 1.0) {
                    sticking.guiding = Guiding::Sliding(-sign);
                }
                *mode = sticking;
            }
        }
    }

    /// The most friction that holds a resting piece, N, with `times` the slack that its balance needs.
    ///
    /// A massless piece comes to rest on the very edge of what can be held, and a light one whose springs are overdamped
    /// creeps up to it for ever, so neither rounding nor the solver's error may decide: it is taken hold of with
    /// one slack and let go with two.
    fn held_n(&self, instant: &Instant, times: f64) -> f64 {
        self.assembly.guide.holding_n(instant.contact_n) * (1.0 + times * 1e-9) + times * self.balance_n
    }

    fn drive_n(&self, time_s: f64, position_m: f64, velocity_m_per_s: f64, mode: &Mode) -> f64 {
        let mut force_n = 0.0;
        for (number, drive) in self.assembly.drives.iter().enumerate() {
            let since_trigger_s = self
                .triggered
                .iter()
                .position(|triggered| *triggered == number)
                .filter(|place| mode.acting & (1 << place) != 0)
                .map(|place| time_s - mode.acts_from_s[place]);
            force_n += drive.force_n(Motion { time_s, position_m, velocity_m_per_s, since_trigger_s });
        }
        force_n
    }

    fn pad(&self, depth_m: f64, rate_m_per_s: f64, state: &[f64], mode: &Mode) -> Response {
        self.assembly
            .pad
            .as_ref()
            .map(|pad| respond(pad, depth_m, rate_m_per_s, mode.beyond, &state[self.layout.contact..]))
            .unwrap_or_default()
    }

    fn spring(&self, depth_m: f64, rate_m_per_s: f64, state: &[f64], mode: &Mode) -> Response {
        let beyond = mode.beyond >> self.contact_laws;
        respond(&self.assembly.spring, depth_m, rate_m_per_s, beyond, &state[self.layout.spring..])
    }

    /// Positive while robot and rig do not touch. A pad with damping lets go before it has recovered; until then
    /// the robot may be where the pad was, and touches again only if it comes fast enough to press.
    fn gap_m(&self, instant: &Instant, state: &[f64], mode: &Mode) -> f64 {
        let depth_m = instant.depth_m();
        let gap_m = self.free_depth_m(state, mode) - depth_m;
        if gap_m > 0.0 {
            return gap_m;
        }
        let rate_m_per_s = instant.depth_m_per_s();
        let would_press = match self.form {
            PieceForm::Carried => self.spring(instant.over_m, instant.over_m_per_s, state, mode),
            _ => self.pad(depth_m, rate_m_per_s, state, mode),
        };
        let press_n = would_press.force_n + self.assembly.across.force_n(instant.over_m_per_s);
        // Air, oil and bristles let a massless piece back more slowly than the robot leaves it, and a dashpot across lets go of a pressed pad;
        // until that turns there is nothing to touch.
        let slowed = self.assembly.guide.air_ns2_per_m2 > 0.0
            || self.assembly.across.acts()
            || self.assembly.spring.damping_ns_per_m > 0.0
            || mode.guiding == Guiding::Bending;
        let leaving_m = if slowed && self.form != PieceForm::Massive {
            -instant.over_m_per_s / self.pulsation_per_s()
        } else {
            f64::NEG_INFINITY
        };
        gap_m.max(-press_n / would_press.stiffness_n_per_m.abs().max(1.0)).max(leaving_m)
    }

    /// How deep the pad stays when nothing presses on it: it has not recovered while its states have not.
    fn free_depth_m(&self, state: &[f64], mode: &Mode) -> f64 {
        if self.layout.spring == self.layout.contact {
            return 0.0;
        }
        depth_under(0.0, 0.0, |depth_m| self.pad(depth_m, 0.0, state, mode))
    }

    /// How fast springs come back from a stroke when the robot has left, in m/s, and what the cell bears meanwhile, in N: their force and the
    /// drag of oil and air on a piece without a mass balance, S(x, v) + C(v) = 0. `None`: they are back at once, or friction holds them.
    pub(super) fn returning(&self, stroke_m: f64, state: &[f64], mode: &Mode) -> Option<(f64, f64)> {
        let guide = &self.assembly.guide;
        if self.form == PieceForm::Massive || guide.rubs() {
            return None;
        }
        // A dashpot across a pad as well meets the stroke's share of its way.
        let across_ns_per_m =
            self.assembly.across.damping_ns_per_m * self.assembly.spring.stiffness_n_per_m / self.series_n_per_m;
        let mut velocity_m_per_s = -stroke_m * self.pulsation_per_s;
        for _ in 0..40 {
            let spring = self.spring(stroke_m, velocity_m_per_s, state, mode);
            let damping = spring.damping_ns_per_m + guide.air_ns_per_m(velocity_m_per_s) + across_ns_per_m;
            let air_n = guide.air_n(velocity_m_per_s);
            let force_n = spring.force_n + air_n + across_ns_per_m * velocity_m_per_s;
            let step_m_per_s = force_n / damping;
            if !step_m_per_s.is_finite() {
                return None;
            }
            velocity_m_per_s -= step_m_per_s;
            if step_m_per_s.abs() <= 1e-12 * velocity_m_per_s.abs() {
                return (velocity_m_per_s < 0.0).then(|| (velocity_m_per_s, -(1.0 - guide.air_cell_share) * air_n));
            }
        }
        None
    }

    /// The stroke of springs that nothing presses on and no friction holds: zero, unless they recover slowly.
    pub(super) fn free_stroke_m(&self, state: &[f64], mode: &Mode) -> f64 {
        if self.layout.len == self.layout.spring {
            return 0.0;
        }
        depth_under(0.0, 0.0, |stroke_m| self.spring(stroke_m, 0.0, state, mode))
    }
}

/// What counts as the velocity of a creeping piece: the faster it finds its balance (1/s), the less its own beside this other one.
fn instead_of_own(own_m_per_s: f64, other_m_per_s: f64, speed_per_s: f64) -> f64 {
    let own = 1.0 / (1.0 + (speed_per_s / FAST_PER_S).powi(2));
    other_m_per_s + own * (own_m_per_s - other_m_per_s)
}

/// The depth at which an element's force is this one, by Newton's rule from a depth near it.
fn depth_under(force_n: f64, near_m: f64, respond: impl Fn(f64) -> Response) -> f64 {
    let mut depth_m = near_m;
    for _ in 0..40 {
        let response = respond(depth_m);
        let step_m = (response.force_n - force_n) / response.stiffness_n_per_m;
        depth_m -= step_m;
        if step_m.abs() <= 1e-15 {
            break;
        }
    }
    depth_m
}

/// Whether the element's force is linear, and all of its states' rates.
fn is_linear(element: &Element, beyond: u32) -> bool {
    element.laws.iter().enumerate().all(|(number, law)| law.is_linear(beyond & (1 << number) != 0))
}

/// The element's force: linear, then laws that do not depend on the rate, then those that do.
fn respond(element: &Element, depth_m: f64, rate_m_per_s: f64, beyond: u32, states: &[f64]) -> Response {
    let mut elastic = Response {
        force_n: element.stiffness_n_per_m * depth_m,
        stiffness_n_per_m: element.stiffness_n_per_m,
        ..Response::default()
    };
    let mut total = Response {
        force_n: element.damping_ns_per_m * rate_m_per_s,
        damping_ns_per_m: element.damping_ns_per_m,
        ..Response::default()
    };
    for with_rate in [false, true] {
        let mut first = 0;
        for (number, law) in element.laws.iter().enumerate() {
            let states = &states[first..first + law.states()];
            first += states.len();
            if law.depends_on_rate() == with_rate {
                let deformation = deformation(element, depth_m, rate_m_per_s, beyond, number);
                let added = law.respond(deformation, elastic, states);
                if with_rate { total += added } else { elastic += added }
            }
        }
    }
    total += elastic;
    total
}

/// The deformation as the element's law with this number sees it.
fn deformation(element: &Element, depth_m: f64, rate_m_per_s: f64, beyond: u32, number: usize) -> Deformation {
    let beyond_knot = beyond & (1 << number) != 0;
    Deformation {
        depth_m,
        rate_m_per_s,
        linear_n_per_m: element.stiffness_n_per_m,
        share: element.share,
        beyond_knot,
        sticks: element.pull_off_n > 0.0,
    }
}

fn law_rates(element: &Element, depth_m: f64, rate_m_per_s: f64, beyond: u32, states: &[f64], rates: &mut [f64]) {
    let mut first = 0;
    for (number, law) in element.laws.iter().enumerate() {
        let end = first + law.states();
        let deformation = deformation(element, depth_m, rate_m_per_s, beyond, number);
        law.state_rates(deformation, &states[first..end], &mut rates[first..end]);
        first = end;
    }
}
