//! What can be hidden: the contract's list, and physics that no list has.
//!
//! An effect is drawn once for a campaign (its shape: time constants, frequencies, where it sits) and then scaled: at
//! scale 0 it is absent, and the scale is bisected until the campaign has the wanted strength.

mod bodies;
mod contact;
mod fall;
mod guide;
mod measuring;
mod robot;
mod unlisted;

use serde::Serialize;

use crate::draw::Draw;
use crate::plan::Plan;
use crate::world::{Kind, World};

/// A number of the answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// What it is.
    pub name: String,
    /// Its unit; empty where it has none.
    pub unit: String,
    /// Its true value.
    pub value: f64,
}

/// A parameter.
#[must_use]
pub fn parameter(name: &str, unit: &str, value: f64) -> Parameter {
    Parameter { name: name.to_owned(), unit: unit.to_owned(), value }
}

/// Puts the effect at a scale into the world of a recording.
pub type Apply = Box<dyn Fn(f64, usize, &mut World) + Send>;

/// An effect whose shape is drawn.
pub struct Shaped {
    /// A scale of ordinary size, where the search begins.
    pub typical: f64,
    /// The largest scale that still could be.
    pub largest: f64,
    /// Puts it into a recording.
    pub apply: Apply,
    /// Its parameters at a scale.
    pub parameters: Box<dyn Fn(f64) -> Vec<Parameter> + Send>,
}

impl Shaped {
    fn new(
        (typical, largest): (f64, f64),
        apply: impl Fn(f64, usize, &mut World) + Send + 'static,
        parameters: impl Fn(f64) -> Vec<Parameter> + Send + 'static,
    ) -> Self {
        Self { typical, largest, apply: Box::new(apply), parameters: Box::new(parameters) }
    }
}

/// Which recordings an effect may be confined to, where it acts in a few only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Confined {
    /// Where the force (or stroke) is highest: the law itself sees to it.
    Highest,
    /// One configuration.
    Configuration,
    /// From some recording on.
    Late,
    /// A few, without order.
    Scattered,
    /// It cannot be: it belongs to the rig.
    Never,
}

/// An effect that can be hidden.
pub struct Effect {
    /// Its id, the contract's where it is in the contract's list.
    pub id: &'static str,
    /// One line.
    pub about: &'static str,
    /// Whether the contract's list has it.
    pub listed: bool,
    /// For one that the list has not: what of the list it resembles, empty where nothing.
    pub resembles: &'static [&'static str],
    /// In which campaigns it can act.
    pub kinds: &'static [Kind],
    /// How it can be confined to a few recordings.
    pub confined: Confined,
    /// Whether re-tuning can absorb it, so that peak forces agree.
    pub absorbable: bool,
    /// Draws its shape for the recordings that it may touch.
    pub shape: fn(&mut Draw, &Plan, &[bool]) -> Shaped,
}

const IMPACTS: &[Kind] = &[Kind::Impact, Kind::Drop];
const ROBOT: &[Kind] = &[Kind::Impact];
const FALL: &[Kind] = &[Kind::Fall];

impl Effect {
    const fn listed(
        id: &'static str,
        about: &'static str,
        kinds: &'static [Kind],
        confined: Confined,
        absorbable: bool,
        shape: fn(&mut Draw, &Plan, &[bool]) -> Shaped,
    ) -> Self {
        Self { id, about, listed: true, resembles: &[], kinds, confined, absorbable, shape }
    }

    const fn unlisted(
        id: &'static str,
        about: &'static str,
        kinds: &'static [Kind],
        resembles: &'static [&'static str],
        shape: fn(&mut Draw, &Plan, &[bool]) -> Shaped,
    ) -> Self {
        Self { id, about, listed: false, resembles, kinds, confined: Confined::Never, absorbable: false, shape }
    }
}

/// Everything that can be hidden, the contract's list first.
pub static ALL: &[Effect] = &[
    Effect::listed(
        "hunt-crossley-damping",
        "the pad's force grows with the speed of compression",
        IMPACTS,
        Confined::Configuration,
        true,
        contact::hunt_crossley,
    ),
    Effect::listed("viscous-damping", "a dashpot beside the pad", IMPACTS, Confined::Late, true, contact::viscous),
    Effect::listed(
        "pad-relaxation",
        "three Maxwell branches beside the pad",
        IMPACTS,
        Confined::Never,
        true,
        contact::relaxation,
    ),
    Effect::listed(
        "rate-stiffening",
        "the pad is stiffer when it is hit faster",
        IMPACTS,
        Confined::Never,
        true,
        contact::rate_stiffening,
    ),
    Effect::listed(
        "mullins-softening",
        "a new pad softens over the first hits",
        IMPACTS,
        Confined::Never,
        true,
        contact::mullins,
    ),
    Effect::listed(
        "hardening",
        "the pad locks as it is compressed",
        IMPACTS,
        Confined::Never,
        true,
        contact::hardening,
    ),
    Effect::listed("end-stop", "the springs meet a soft stop", IMPACTS, Confined::Highest, false, contact::end_stop),
    Effect::listed(
        "clearance",
        "part of the springs is loose at first",
        IMPACTS,
        Confined::Late,
        true,
        contact::clearance,
    ),
    Effect::listed(
        "adhesion",
        "the pad sticks to the tip until it is torn off",
        IMPACTS,
        Confined::Late,
        false,
        contact::adhesion,
    ),
    Effect::listed(
        "air-damping",
        "air is squeezed out from under the piece",
        IMPACTS,
        Confined::Late,
        true,
        contact::air,
    ),
    Effect::listed("guide-friction", "bristle friction of the guide", IMPACTS, Confined::Late, true, guide::friction),
    Effect::listed(
        "load-dependent-friction",
        "friction in proportion to the contact force",
        IMPACTS,
        Confined::Configuration,
        true,
        guide::load_dependent,
    ),
    Effect::listed("stiction", "friction that breaks away", IMPACTS, Confined::Late, false, guide::stiction),
    Effect::listed("moving-piece-inertia", "the impact piece has mass", IMPACTS, Confined::Never, false, bodies::piece),
    Effect::listed("frame-compliance", "the frame swings on its feet", IMPACTS, Confined::Late, true, bodies::frame),
    Effect::listed(
        "joint-elasticity",
        "part of the mass hangs behind an elastic joint",
        ROBOT,
        Confined::Configuration,
        true,
        robot::joint,
    ),
    Effect::listed(
        "link-oscillation",
        "the link sways when it arrives",
        ROBOT,
        Confined::Configuration,
        true,
        robot::sway,
    ),
    Effect::listed(
        "robot-push",
        "the drive pushes on after contact",
        ROBOT,
        Confined::Configuration,
        true,
        robot::push,
    ),
    Effect::listed("force-ceiling", "the arm gives way at a force", ROBOT, Confined::Highest, false, robot::ceiling),
    Effect::listed(
        "collision-reaction",
        "the controller retracts after a delay",
        ROBOT,
        Confined::Configuration,
        false,
        robot::reaction,
    ),
    Effect::listed(
        "pose-dependent-mass",
        "a pose has another mass than stated",
        ROBOT,
        Confined::Configuration,
        false,
        robot::pose_mass,
    ),
    Effect::listed(
        "speed-error",
        "the speeds are not those stated",
        IMPACTS,
        Confined::Late,
        false,
        robot::speed_error,
    ),
    Effect::listed("piezo-discharge", "the charge leaks", IMPACTS, Confined::Late, true, measuring::discharge),
    Effect::listed("charge-drift", "the zero runs away", IMPACTS, Confined::Late, false, measuring::drift),
    Effect::listed("clipping", "the readout saturates", IMPACTS, Confined::Highest, false, measuring::clipping),
    Effect::listed("filter-lag", "a causal low-pass in the readout", IMPACTS, Confined::Never, true, measuring::lag),
    Effect::listed("mains-hum", "a line of the mains", IMPACTS, Confined::Scattered, false, measuring::hum),
    Effect::listed(
        "gain-error",
        "the cell's gain is not the stated one",
        IMPACTS,
        Confined::Late,
        false,
        measuring::gain,
    ),
    Effect::listed(
        "lost-samples",
        "samples vanish without a trace",
        IMPACTS,
        Confined::Scattered,
        false,
        measuring::lost,
    ),
    Effect::listed("air-drag", "the air holds the falling body", FALL, Confined::Configuration, false, fall::drag),
    Effect::unlisted(
        "spring-surge",
        "a wave runs along the springs",
        IMPACTS,
        &["moving-piece-inertia"],
        unlisted::surge,
    ),
    Effect::unlisted(
        "thermal-shift",
        "the impact's heat moves the cell's zero",
        IMPACTS,
        &["charge-drift"],
        unlisted::heat,
    ),
    Effect::unlisted("tilting-cell", "the force leans as the stroke grows", IMPACTS, &[], unlisted::tilt),
    Effect::unlisted(
        "printed-part-creep",
        "printed parts creep in series with the springs",
        IMPACTS,
        &["pad-relaxation"],
        unlisted::creep,
    ),
    Effect::unlisted(
        "joint-backlash",
        "the joint has play and knocks",
        ROBOT,
        &["joint-elasticity"],
        unlisted::backlash,
    ),
    Effect::unlisted("gear-cogging", "the gears' friction ripples with the way", ROBOT, &[], unlisted::cogging),
    Effect::unlisted("curved-cell", "the cell is not linear", IMPACTS, &["hardening"], unlisted::curved),
    Effect::unlisted("tip-slip", "the tip slips on the pad under load", ROBOT, &[], unlisted::slip),
    Effect::unlisted(
        "soft-skin",
        "a second layer with quadratic stiffness",
        IMPACTS,
        &["hardening", "clearance"],
        unlisted::soft_skin,
    ),
    Effect::unlisted(
        "rocking-base",
        "the base lifts off one foot as it swings back",
        IMPACTS,
        &["frame-compliance"],
        unlisted::rocking,
    ),
    Effect::unlisted(
        "spring-hysteresis",
        "the springs lose a share of every stroke",
        IMPACTS,
        &["load-dependent-friction"],
        unlisted::hysteresis,
    ),
    Effect::unlisted(
        "spin-lift",
        "spin carries the falling body, the more the longer it falls",
        FALL,
        &["air-drag"],
        fall::spin,
    ),
];

/// The effect of this id.
#[must_use]
pub fn named(id: &str) -> Option<&'static Effect> {
    ALL.iter().find(|effect| effect.id == id)
}

/// Pairs that a few recordings hardly tell apart.
pub const TWINS: &[(&str, &str)] = &[
    ("hunt-crossley-damping", "pad-relaxation"),
    ("hunt-crossley-damping", "joint-elasticity"),
    ("pad-relaxation", "joint-elasticity"),
    ("guide-friction", "piezo-discharge"),
    ("guide-friction", "load-dependent-friction"),
    ("hunt-crossley-damping", "load-dependent-friction"),
    ("viscous-damping", "air-damping"),
    ("hardening", "end-stop"),
    ("robot-push", "charge-drift"),
    ("moving-piece-inertia", "frame-compliance"),
    ("clipping", "force-ceiling"),
    ("filter-lag", "moving-piece-inertia"),
];

/// Further kin, which one would not hide together.
const KIN: &[(&str, &str)] = &[
    ("guide-friction", "stiction"),
    ("load-dependent-friction", "stiction"),
    ("hunt-crossley-damping", "viscous-damping"),
    ("pad-relaxation", "viscous-damping"),
    ("joint-elasticity", "frame-compliance"),
    ("link-oscillation", "speed-error"),
    ("pose-dependent-mass", "speed-error"),
    ("gain-error", "speed-error"),
    ("gain-error", "pose-dependent-mass"),
    ("rate-stiffening", "hardening"),
    ("piezo-discharge", "charge-drift"),
];

/// What of the list resembles the listed `id`.
#[must_use]
pub fn alike(id: &str) -> Vec<&'static str> {
    TWINS.iter().chain(KIN).filter_map(|(a, b)| if *a == id { Some(*b) } else { (*b == id).then_some(*a) }).collect()
}

#[cfg(test)]
mod tests;
