//! The rig put together for one impact: elements, bodies, drives and chain, with the doors that mechanisms use.

use std::fmt::Debug;

use super::{Approach, Kind, Rig, RigError};
use crate::mechanism::{Effect, Site};

/// The rig for one impact, after all effects have entered.
#[derive(Debug)]
pub struct Assembly {
    /// What kind of rig it is.
    pub kind: Kind,
    /// Speed, mass and place in the campaign; effects may change what really happens.
    pub approach: Approach,
    /// The pad between robot and piece; `None`: the robot touches the piece directly.
    pub pad: Option<Element>,
    /// What acts on the contact: on the pad where there is one, else on the spring (paper 1, eq. 12).
    pub contact_laws: Vec<Box<dyn ForceLaw>>,
    /// What acts on the springs alike where there is a pad: laws of both ([`obey`](Self::obey)).
    alike_laws: Vec<Box<dyn ForceLaw>>,
    /// The body springs.
    pub spring: Element,
    /// What acts beside pad and springs together.
    pub across: Across,
    /// The guide of the piece.
    pub guide: Guide,
    /// The moving piece, where its inertia counts.
    pub piece: Option<Piece>,
    /// What the rig stands on, where it yields.
    pub frame: Option<Frame>,
    /// Splits the robot into tip and link.
    pub joint: Option<Joint>,
    /// The most force that the robot's link passes on to its tip.
    pub ceiling: Option<Ceiling>,
    /// Whether the robot's motion is read on the link behind its joint or its slipping drives, as an encoder at the motor does.
    pub link_bears_gauge: bool,
    /// The robot's own sway.
    pub sway: Option<Sway>,
    /// Forces on the robot besides contact and gravity.
    pub drives: Vec<Box<dyn Drive>>,
    /// Gravity along the direction of the impact, m/s².
    pub gravity_m_per_s2: f64,
    /// The measuring chain, in the order of the signal.
    pub chain: Vec<Box<dyn Stage>>,
    /// What becomes of the samples after the converter, in the order of the signal.
    pub log: Vec<Box<dyn Stage>>,
}

impl Assembly {
    /// What the robot touches.
    #[must_use]
    pub fn touched(&self) -> &Element {
        self.pad.as_ref().unwrap_or(&self.spring)
    }

    /// The same, to be changed.
    pub fn touched_mut(&mut self) -> &mut Element {
        self.pad.as_mut().unwrap_or(&mut self.spring)
    }

    /// What yields has one more law.
    pub fn obey<L: ForceLaw + Clone + 'static>(&mut self, law: &L, which: Which) {
        if which != Which::Springs || self.pad.is_none() {
            self.contact_laws.push(Box::new(law.clone()));
        }
        if which != Which::Touched && self.pad.is_some() {
            self.alike_laws.push(Box::new(law.clone()));
        }
    }

    /// Multiplies the stiffness of what yields.
    pub fn stiffen(&mut self, factor: f64, which: Which) {
        if let Some(pad) = self.pad.as_mut().filter(|_| which != Which::Springs) {
            pad.stiffness_n_per_m *= factor;
        }
        if which != Which::Touched || self.pad.is_none() {
            self.spring.stiffness_n_per_m *= factor;
        }
    }

    /// Puts the rig together for one impact.
    ///
    /// # Errors
    /// A quantity of the rig or the approach that is not a physical value.
    pub fn new(rig: &Rig, approach: &Approach, effects: &[Effect]) -> Result<Self, RigError> {
        rig.check()?;
        approach.check()?;
        let mut assembly = Self::without_effects(rig, approach);
        let mut effects: Vec<&Effect> = effects.iter().filter(|effect| !effect.is_null()).collect();
        effects.sort_by_key(|effect| turn(effect.mechanism().site));
        for effect in effects {
            (effect.mechanism().enter)(effect, &mut assembly);
        }
        if let Some(sway) = &mut assembly.sway {
            assembly.approach.speed_m_per_s += sway.velocity_m_per_s(0.0);
            // A robot has one joint: where another mechanism says how its mass is split, its links sway as they do.
            if assembly.joint.is_some() || assembly.ceiling.is_some() {
                sway.link_fraction = 0.0;
            }
            assembly.joint = assembly.joint.or_else(|| sway.joint(assembly.approach.effective_mass_kg));
        }
        assembly.approach.check()?;
        let laws = std::mem::take(&mut assembly.contact_laws);
        match &mut assembly.pad {
            Some(pad) => {
                pad.laws.extend(laws);
                assembly.spring.laws.append(&mut assembly.alike_laws);
                let both_n_per_m = pad.stiffness_n_per_m + assembly.spring.stiffness_n_per_m;
                pad.share = assembly.spring.stiffness_n_per_m / both_n_per_m;
                assembly.spring.share = pad.stiffness_n_per_m / both_n_per_m;
            }
            None => assembly.spring.laws.extend(laws),
        }
        Ok(assembly)
    }

    /// The rig as it is stated.
    fn without_effects(rig: &Rig, approach: &Approach) -> Self {
        Self {
            kind: rig.kind,
            approach: *approach,
            pad: rig.pad_stiffness_n_per_m.map(Element::linear),
            contact_laws: Vec::new(),
            alike_laws: Vec::new(),
            spring: Element::linear(rig.body_stiffness_n_per_m),
            across: Across::default(),
            guide: Guide::default(),
            piece: None,
            frame: None,
            joint: None,
            ceiling: None,
            link_bears_gauge: false,
            sway: None,
            drives: Vec::new(),
            gravity_m_per_s2: rig.gravity_m_per_s2,
            chain: Vec::new(),
            log: Vec::new(),
        }
    }

    /// By how much an effect of the measuring chain delays what changes slowly, s.
    #[must_use]
    pub fn delay_s(effect: &Effect) -> f64 {
        if effect.is_null() || !effect.mechanism().is_seen_only() {
            return 0.0;
        }
        let approach = Approach { speed_m_per_s: 1.0, effective_mass_kg: 1.0, configuration: 0, order: 0 };
        let mut bare = Self::without_effects(&Rig::impact(1.0), &approach);
        (effect.mechanism().enter)(effect, &mut bare);
        bare.chain.iter().map(|stage| stage.delay_s()).sum()
    }
}

/// When effects at this site enter: first what says how fast and how heavy the robot is, on which its joint depends,
/// then the piece, which may bring the contact that the pad's effects act on. Effects of one turn keep their order,
/// which for the chain is the way of the signal.
fn turn(site: Site) -> u8 {
    match site {
        Site::InitialCondition => 0,
        Site::Piece => 1,
        _ => 2,
    }
}

/// A spring with laws that add to it.
#[derive(Debug)]
pub struct Element {
    /// Linear stiffness, N/m.
    pub stiffness_n_per_m: f64,
    /// Viscous damping of the material, N·s/m.
    pub damping_ns_per_m: f64,
    /// Its part of what pad and springs together are pressed in, by their linear stiffness; 1 where there is no pad.
    pub share: f64,
    /// The part of its stiffness that bears from the first touch on; what a law takes from it bears later.
    pub without_play: f64,
    /// The tension that it bears before the robot comes off it, N; 0: none.
    pub pull_off_n: f64,
    /// What still pulls once the robot has come off it.
    pub neck: Neck,
    /// Laws that add to the linear force; those that depend on the elastic force come after the elastic ones.
    pub laws: Vec<Box<dyn ForceLaw>>,
}

/// Of which of pad and springs in series something is said; where there is no pad, of the springs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// What the robot touches.
    Touched,
    /// Pad and springs alike, as if they were one.
    Both,
    /// The springs, behind a pad as well.
    Springs,
}

impl Which {
    /// By the number of a form.
    #[must_use]
    pub fn of(form: u32) -> Self {
        match form {
            0 => Self::Touched,
            1 => Self::Both,
            _ => Self::Springs,
        }
    }
}

/// What pulls between a tacky element and a robot that has come off it, at the distance s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neck {
    /// Its highest tension F, N; 0: there is none.
    pub highest_n: f64,
    /// Its length ℓ, m.
    pub length_m: f64,
    /// How it goes along it.
    pub course: NeckCourse,
}

/// How the tension of a neck goes along its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NeckCourse {
    /// It falls from the first, F·(1 − (s/ℓ)^q), by a power q: 1 evenly, a high one holds it until it tears at ℓ.
    Falling(f64),
    /// It rises to its highest at ℓ and falls beyond, F·(s/ℓ)·exp(1 − s/ℓ).
    Rising,
    /// It falls from the first, the less the less there is of it, F·exp(−s/ℓ).
    Peeling,
}

impl Neck {
    const NONE: Self = Self { highest_n: 0.0, length_m: 0.0, course: NeckCourse::Falling(1.0) };
    /// So many lengths apart one that rises or peels has come to a thousandth.
    const FARTHEST: f64 = 10.0;
    /// Of the way, until the distance is known to a millionth.
    const HALVINGS: usize = 24;

    /// Its tension, N, when the robot has gone a way, m, since the contact ended, from what yields as a spring does. A neck that rises draws that after
    /// the robot, s = way − F(s)/k.
    #[must_use]
    pub fn tension_n(self, way_m: f64, spring_n_per_m: f64) -> f64 {
        let way = way_m / self.length_m;
        let part = match self.course {
            NeckCourse::Falling(power) if way < 1.0 => 1.0 - way.powf(power),
            NeckCourse::Peeling if way < Self::FARTHEST => (-way).exp(),
            NeckCourse::Rising if way < Self::FARTHEST => {
                let yields = self.highest_n / (spring_n_per_m * self.length_m);
                let rising = |lengths: f64| lengths * (1.0 - lengths).exp();
                let (mut near, mut far) = (0.0, way);
                for _ in 0..Self::HALVINGS {
                    let middle = 0.5 * (near + far);
                    if middle + yields * rising(middle) < way { near = middle } else { far = middle }
                }
                rising(far)
            }
            _ => 0.0,
        };
        self.highest_n * part
    }

    /// What it takes to tear it, J.
    #[must_use]
    pub fn work_j(self) -> f64 {
        let part = match self.course {
            NeckCourse::Falling(power) => power / (power + 1.0),
            NeckCourse::Rising => std::f64::consts::E,
            NeckCourse::Peeling => 1.0,
        };
        self.highest_n * self.length_m * part
    }
}

impl Element {
    /// A linear spring without loss.
    #[must_use]
    pub fn linear(stiffness_n_per_m: f64) -> Self {
        Self {
            stiffness_n_per_m,
            damping_ns_per_m: 0.0,
            share: 1.0,
            without_play: 1.0,
            pull_off_n: 0.0,
            neck: Neck::NONE,
            laws: Vec::new(),
        }
    }
}

/// How an element is deformed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deformation {
    /// Compression, m.
    pub depth_m: f64,
    /// Its rate, m/s.
    pub rate_m_per_s: f64,
    /// Linear stiffness of the element, N/m, after every effect has entered; laws that scale with it take it from here,
    /// so that it does not matter which effect entered first.
    pub linear_n_per_m: f64,
    /// The element's part of what pad and springs together are pressed in, by that stiffness; 1 where there is no pad.
    pub share: f64,
    /// Whether the depth is beyond the law's [`ForceLaw::knot_m`]; it holds for a whole smooth stretch of the
    /// motion, so that the solver never steps across a kink.
    pub beyond_knot: bool,
    /// Whether the robot sticks to the element, so that a negative depth is tension and not merely a place where a trial
    /// step looks beyond the end of the contact.
    pub sticks: bool,
}

impl Deformation {
    /// The depth and the rate that a law speaks of are this times the element's: its own, or those of pad and springs together.
    #[must_use]
    pub fn scale(self, which: Which) -> f64 {
        if which == Which::Both { self.share.recip() } else { 1.0 }
    }
}

/// A force with its partial derivatives, which the balance of a massless piece needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Response {
    /// Force, N, positive in compression.
    pub force_n: f64,
    /// Derivative by depth, N/m.
    pub stiffness_n_per_m: f64,
    /// Derivative by rate, N·s/m.
    pub damping_ns_per_m: f64,
    /// Rate of the force at fixed depth and rate of depth, because the law's own states move, N/s.
    pub drift_n_per_s: f64,
}

impl Response {
    /// This times a factor that grows with depth, 1/m.
    #[must_use]
    pub fn times(self, factor: f64, growing_per_m: f64) -> Self {
        Self {
            force_n: factor * self.force_n,
            stiffness_n_per_m: factor * self.stiffness_n_per_m + growing_per_m * self.force_n,
            damping_ns_per_m: factor * self.damping_ns_per_m,
            drift_n_per_s: factor * self.drift_n_per_s,
        }
    }
}

impl std::ops::AddAssign for Response {
    fn add_assign(&mut self, other: Self) {
        self.force_n += other.force_n;
        self.stiffness_n_per_m += other.stiffness_n_per_m;
        self.damping_ns_per_m += other.damping_ns_per_m;
        self.drift_n_per_s += other.drift_n_per_s;
    }
}

/// A force that a mechanism adds to an element.
pub trait ForceLaw: Debug + Send + Sync {
    /// The force that it adds. `elastic` is what linear stiffness and the laws before it give at this depth.
    fn respond(&self, deformation: Deformation, elastic: Response, states: &[f64]) -> Response;

    /// Whether the force depends on the rate of depth.
    fn depends_on_rate(&self) -> bool {
        false
    }

    /// Whether its force and the rates of its states are linear in depth, rate and states on this side of its knot.
    fn is_linear(&self, _beyond_knot: bool) -> bool {
        false
    }

    /// A depth at which the law changes its form, m, of an element that has this part of what pad and springs together are pressed in.
    fn knot_m(&self, _share: f64) -> Option<f64> {
        None
    }

    /// How many states of its own it has; they are zero at the start.
    fn states(&self) -> usize {
        0
    }

    /// The rates of its states.
    fn state_rates(&self, _deformation: Deformation, _states: &[f64], _rates: &mut [f64]) {}
}

/// What the guide does to the piece.
///
/// Dry friction: it sticks as long as less than
/// `(coulomb_n + load_coefficient·P)·static_ratio` is needed to hold it, and slides against
/// `coulomb_n + load_coefficient·P`, P being the contact force; in between friction falls with the speed v as e^(−(v/v_s)²), v_s =
/// `stribeck_m_per_s`. Where `presliding_m` is not zero, it does not stick rigidly: bristles bend by about that much before they slide,
/// and what they hold creeps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guide {
    /// Sliding friction without load, N.
    pub coulomb_n: f64,
    /// Friction per contact force.
    pub load_coefficient: f64,
    /// Friction at rest over friction while sliding, at least 1.
    pub static_ratio: f64,
    /// The speed at which friction has fallen most of the way from rest to sliding, m/s; 0: at once.
    pub stribeck_m_per_s: f64,
    /// How far the bristles bend before they slide, m; 0: the piece sticks rigidly.
    pub presliding_m: f64,
    /// The speed below which the bristles' friction is proportional to the speed, m/s: so fast creeps what they hold by all they have.
    pub creep_m_per_s: f64,
    /// Drag of the air in the housing, N·s²/m²: `air_ns2_per_m2·v·|v|` against the piece.
    pub air_ns2_per_m2: f64,
    /// Which part of that there is as the springs come back: 1 where the air passes the same opening both ways.
    pub air_back_share: f64,
    /// Which part of it presses on the load cell: 1 when the housing stands on the cell, 0 beside it.
    pub air_cell_share: f64,
    /// Which part of the friction reaches the load cell; 0 when the guide stands beside the cell, 1 when it
    /// stands on it.
    pub cell_share: f64,
    /// Which part of the friction the springs press with after the robot has left a piece without a mass of its own at
    /// [`Approach::REDUCED_SPEED_M_PER_S`].
    pub rest_share: f64,
}

impl Default for Guide {
    fn default() -> Self {
        Self {
            coulomb_n: 0.0,
            load_coefficient: 0.0,
            static_ratio: 1.0,
            stribeck_m_per_s: 0.0,
            presliding_m: 0.0,
            creep_m_per_s: 0.0,
            air_ns2_per_m2: 0.0,
            air_back_share: 1.0,
            air_cell_share: 1.0,
            cell_share: 0.0,
            rest_share: 1.0,
        }
    }
}

impl Guide {
    /// The guide stands on the cell with this part of its friction. It is one guide whatever rubs in it: of two that say it the larger one
    /// holds, in whatever order they enter.
    pub fn stands_on_cell(&mut self, share: f64) {
        self.cell_share = self.cell_share.max(share);
    }

    /// It holds on bristles that bend so far before they slide, m, and forget below such a speed, m/s. It is one guide whatever rubs in it:
    /// of two that say it the softer bristles hold.
    pub fn stands_on_bristles(&mut self, presliding_m: f64, creep_m_per_s: f64) {
        if presliding_m > self.presliding_m {
            (self.presliding_m, self.creep_m_per_s) = (presliding_m, creep_m_per_s);
        }
    }

    /// Whether there is any friction.
    #[must_use]
    pub fn rubs(&self) -> bool {
        self.coulomb_n > 0.0 || self.load_coefficient > 0.0
    }

    /// Whether bristles bend before it slides.
    #[must_use]
    pub fn bends(&self) -> bool {
        self.rubs() && self.presliding_m > 0.0
    }

    /// How fast the bend of bristles changes at this velocity, 1/s; the bend is the part of the friction that they have: a Dahl solid that forgets,
    /// `dy/dt = (v − y·√(v² + v_c²))/z`, z being `presliding_m` and `v_c` being `creep_m_per_s`. Sliding steadily they have v/√(v² + v_c²).
    #[must_use]
    pub fn bending_per_s(&self, bend: f64, velocity_m_per_s: f64) -> f64 {
        let slowed = (velocity_m_per_s * velocity_m_per_s + self.creep_m_per_s * self.creep_m_per_s).sqrt();
        (velocity_m_per_s - bend * slowed) / self.presliding_m
    }

    /// Drag of the air on a piece of this velocity, N.
    #[must_use]
    pub fn air_n(&self, velocity_m_per_s: f64) -> f64 {
        0.5 * self.air_ns_per_m(velocity_m_per_s) * velocity_m_per_s
    }

    /// By how much that grows with the velocity, N·s/m.
    #[must_use]
    pub fn air_ns_per_m(&self, velocity_m_per_s: f64) -> f64 {
        let share = if velocity_m_per_s < 0.0 { self.air_back_share } else { 1.0 };
        2.0 * share * self.air_ns2_per_m2 * velocity_m_per_s.abs()
    }

    /// Which part of the friction the springs press with after the robot has left at this velocity: 1 − v·√(m·k)/F_c for a slow piece
    /// of a small mass m, and nothing on average for a fast one, which swings to and fro.
    #[must_use]
    pub fn left_share(&self, velocity_m_per_s: f64) -> f64 {
        self.rest_share.powf(velocity_m_per_s.abs() / Approach::REDUCED_SPEED_M_PER_S)
    }

    /// Friction at a speed over friction of fast sliding.
    #[must_use]
    pub fn grip(&self, velocity_m_per_s: f64) -> f64 {
        if self.falls_with_speed() {
            1.0 + (self.static_ratio - 1.0) * (-(velocity_m_per_s / self.stribeck_m_per_s).powi(2)).exp()
        } else {
            1.0
        }
    }

    /// Friction without load against what moves at a velocity and never sticks, N: in proportion to speeds below `creep_m_per_s`.
    #[must_use]
    pub fn smooth_n(&self, velocity_m_per_s: f64) -> f64 {
        if self.coulomb_n == 0.0 {
            return 0.0;
        }
        let part = velocity_m_per_s / velocity_m_per_s.hypot(self.creep_m_per_s);
        self.coulomb_n * self.grip(velocity_m_per_s) * part
    }

    /// Whether friction falls with the speed of sliding.
    #[must_use]
    pub fn falls_with_speed(&self) -> bool {
        self.static_ratio > 1.0 && self.stribeck_m_per_s > 0.0
    }

    /// Friction of fast sliding under a contact force, N.
    #[must_use]
    pub fn sliding_n(&self, contact_n: f64) -> f64 {
        self.coulomb_n + self.load_coefficient * contact_n.max(0.0)
    }

    /// Friction that can be had at rest under a contact force, N.
    #[must_use]
    pub fn holding_n(&self, contact_n: f64) -> f64 {
        self.static_ratio * self.sliding_n(contact_n)
    }
}

/// A dashpot and friction beside pad and springs together, from the robot to what the rig stands on, through the cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Across {
    /// The dashpot, N·s/m.
    pub damping_ns_per_m: f64,
    /// The friction, in proportion to speeds below its `creep_m_per_s`.
    pub rubbing: Guide,
}

impl Across {
    /// Whether there is any of either.
    #[must_use]
    pub fn acts(&self) -> bool {
        self.damping_ns_per_m > 0.0 || self.rubbing.rubs()
    }

    /// Against a robot of this velocity, N.
    #[must_use]
    pub fn force_n(&self, velocity_m_per_s: f64) -> f64 {
        self.damping_ns_per_m * velocity_m_per_s + self.rubbing.smooth_n(velocity_m_per_s)
    }
}

/// The moving piece between pad and spring, where its inertia counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Stiffness of the stop that it returns to, beside the springs', N/m; 0: it swings through its place of rest.
    pub stop_n_per_m: f64,
    /// Damping of that stop, N·s/m. The guide's housing bears both, not the cell.
    pub stop_ns_per_m: f64,
    /// Whether the cell is in front of it and bears the contact, not behind the springs.
    pub cell_in_front: bool,
}

impl Piece {
    /// What the stop does against the piece, N: it only pushes, so less than nothing until the piece leaves it.
    #[must_use]
    pub fn stop_n(self, piece_m: f64, piece_m_per_s: f64) -> f64 {
        self.stop_n_per_m * piece_m + self.stop_ns_per_m * piece_m_per_s
    }
}

/// The frame (table, stand) under the rig: a body on a spring of its own.
///
/// ```text
///  body springs ──[ mass on cell ][ load cell ]──[ frame m ]──k,c── ground
/// ```
///
/// The cell stands between springs and frame, so that it bears the springs' force, and it swings with the frame, so that
/// the inertia of what is screwed onto its measuring side is in its signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Mass that moves with the frame, the mass on the cell included, kg.
    pub mass_kg: f64,
    /// Stiffness towards the ground, N/m.
    pub stiffness_n_per_m: f64,
    /// Damping towards the ground, N·s/m.
    pub damping_ns_per_m: f64,
    /// Mass between the springs and the cell's sensing element, kg.
    pub on_cell_kg: f64,
    /// Whether a gauge of the robot's position stands on it.
    pub bears_gauge: bool,
}

/// A coupling in the robot that slips: tip and link are one until it has to pass on more than it can, and then it passes
/// on just that, and what its own friction in proportion to the slip adds, until they are equally fast again. Where the robot has an elastic [`Joint`], it is that
/// joint which slips.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ceiling {
    /// The most force that the coupling passes on, N, of either sign.
    pub force_n: f64,
    /// The part of the effective mass before the coupling, where there is no elastic joint that says it, 0 to 1.
    pub tip_fraction: f64,
    /// What it passes on beyond that for each metre per second of slip, N·s/m.
    pub damping_ns_per_m: f64,
}

/// A sway of the robot that it would have without the rig as well: an acceleration on all of its bodies, like gravity's, or the motion
/// of its tip against a link behind a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sway {
    /// The part of the effective mass that sways behind a joint and answers the contact; 0: links too heavy to feel it.
    pub link_fraction: f64,
    /// Amplitude of its velocity, m/s.
    pub amplitude_m_per_s: f64,
    /// Angular frequency, 1/s.
    pub pulsation_per_s: f64,
    /// Phase at first contact, rad: 0 where the sway is fastest towards the rig.
    pub phase_rad: f64,
    /// Damping ratio ζ; 0: it does not die away.
    pub damping_ratio: f64,
}

impl Sway {
    /// Whether it goes on whatever the tip meets.
    #[must_use]
    pub fn is_imposed(self) -> bool {
        self.link_fraction == 0.0
    }

    /// The joint behind which a link sways.
    fn joint(self, effective_mass_kg: f64) -> Option<Joint> {
        let Self { link_fraction, pulsation_per_s, damping_ratio, .. } = self;
        (!self.is_imposed()).then(|| Joint::of_mode(effective_mass_kg, link_fraction, pulsation_per_s, damping_ratio))
    }

    /// How far the link is ahead of the tip at first contact, m, and how much faster it is, m/s: momentum is kept between them.
    #[must_use]
    pub fn link_ahead(self) -> (f64, f64) {
        if self.is_imposed() {
            return (0.0, 0.0);
        }
        let behind_m = self.off_middle_m(0.0) / self.link_fraction;
        (-behind_m, -self.velocity_m_per_s(0.0) / self.link_fraction)
    }

    /// With which it dies away and turns, 1/s: ζω and ω·√(1 − ζ²).
    fn rates_per_s(self) -> (f64, f64) {
        let Self { pulsation_per_s, damping_ratio, .. } = self;
        (damping_ratio * pulsation_per_s, pulsation_per_s * (1.0 - damping_ratio * damping_ratio).sqrt())
    }

    /// e^(−ζωt)·(p·cos + q·sin) of where it has turned to.
    fn turned(self, time_s: f64, [p, q]: [f64; 2]) -> f64 {
        let (dying_per_s, turning_per_s) = self.rates_per_s();
        let (sine, cosine) = (turning_per_s * time_s + self.phase_rad).sin_cos();
        (-dying_per_s * time_s).exp() * (p * cosine + q * sine)
    }

    /// Its position, m, from the middle of the sway.
    fn off_middle_m(self, time_s: f64) -> f64 {
        let (dying_per_s, turning_per_s) = self.rates_per_s();
        let of_square = self.amplitude_m_per_s / self.pulsation_per_s / self.pulsation_per_s;
        self.turned(time_s, [-dying_per_s * of_square, turning_per_s * of_square])
    }

    /// Its position, m, from where it is at first contact.
    #[must_use]
    pub fn position_m(self, time_s: f64) -> f64 {
        self.off_middle_m(time_s) - self.off_middle_m(0.0)
    }

    /// Its velocity, m/s.
    #[must_use]
    pub fn velocity_m_per_s(self, time_s: f64) -> f64 {
        self.turned(time_s, [self.amplitude_m_per_s, 0.0])
    }

    /// Its acceleration, m/s².
    #[must_use]
    pub fn acceleration_m_per_s2(self, time_s: f64) -> f64 {
        let (dying_per_s, turning_per_s) = self.rates_per_s();
        self.turned(time_s, [-self.amplitude_m_per_s * dying_per_s, -self.amplitude_m_per_s * turning_per_s])
    }
}

/// The elastic joint between the robot's tip, which touches, and the link behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// The part of the effective mass behind the joint, 0 to 1.
    pub link_fraction: f64,
    /// Stiffness, N/m, as seen at the contact.
    pub stiffness_n_per_m: f64,
    /// Damping, N·s/m.
    pub damping_ns_per_m: f64,
}

impl Joint {
    /// With this mode of tip against link in free air: its angular frequency, 1/s, and its damping ratio.
    #[must_use]
    pub fn of_mode(effective_mass_kg: f64, link_fraction: f64, pulsation_per_s: f64, damping_ratio: f64) -> Self {
        let reduced_kg = effective_mass_kg * link_fraction * (1.0 - link_fraction);
        Self {
            link_fraction,
            stiffness_n_per_m: pulsation_per_s * pulsation_per_s * reduced_kg,
            damping_ns_per_m: 2.0 * damping_ratio * pulsation_per_s * reduced_kg,
        }
    }
}

/// What a drive may know of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Time since the first contact (kind `fall`: since release), s.
    pub time_s: f64,
    /// Position of the driven body, m; 0 at first contact.
    pub position_m: f64,
    /// Its velocity, m/s.
    pub velocity_m_per_s: f64,
    /// Time since the drive's trigger took effect, s; `None` before.
    pub since_trigger_s: Option<f64>,
}

/// A force on the robot (on the link, where there is a joint), positive towards the rig.
pub trait Drive: Debug + Send + Sync {
    /// The force, N.
    fn force_n(&self, motion: Motion) -> f64;

    /// A contact force that triggers the drive, and the delay until it acts; before, it does nothing.
    fn trigger(&self) -> Option<Trigger> {
        None
    }
}

/// When a drive that reacts to the contact begins to act.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trigger {
    /// The contact force that is noticed, N.
    pub force_n: f64,
    /// From there to the reaction, s.
    pub delay_s: f64,
}

/// A stage of the measuring chain.
pub trait Stage: Debug + Send + Sync {
    /// Changes the signal (N), sampled at rising times (s).
    fn apply(&self, times_s: &[f64], signal_n: &mut [f64]);

    /// Whether what it works on is the signal with the chain's zero.
    fn reads_zero(&self) -> bool {
        false
    }

    /// By how much it delays what changes slowly, s.
    fn delay_s(&self) -> f64 {
        0.0
    }

    /// How much later than a sample's time what it shows may have happened, s.
    fn ahead_s(&self) -> f64 {
        0.0
    }
}

/// How much later than a sample's time what a log shows there may have happened, s: each of its stages adds its own.
pub(super) fn ahead_s(log: &[Box<dyn Stage>]) -> f64 {
    log.iter().map(|stage| stage.ahead_s()).sum()
}
