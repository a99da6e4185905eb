//! Mechanisms: the physics that a rig may have beyond the ideal impact, one file each.
//!
//! A [`Mechanism`] is knowledge (its equation with its source, its parameters with unit and range, where its
//! mismatch shows, what it is confused with, what separates them) and one function, `enter`, which puts an
//! [`Effect`] (the mechanism with values) into an [`Assembly`]. The simulation composes effects; the diagnosis
//! tries them. Adding a mechanism is adding a file and a line in [`LIST`].
//!
//! # Where a mechanism may enter
//!
//! The walls of the assembly are few, and every id of the campaign contract has a door:
//!
//! | site | door | mechanisms |
//! |---|---|---|
//! | pad | [`ForceLaw`](crate::rig::ForceLaw) on `assembly.contact_laws`, or by `assembly.obey` on pad and springs alike: force from depth, rate and states of its own; a knot where its form changes | `hunt-crossley-damping`, `viscous-damping` (depend on the rate), `pad-relaxation` (a state: the strain of the viscous branch), `hardening` (elastic) |
//! | pad, spring | `assembly.stiffen`, of the pad or of both alike, once with the approach's speed and order number in hand | `rate-stiffening` (with a law for what it forgets; by the rate at each instant it is a `ForceLaw`), `mullins-softening`, spring repeatability, a wrong spring |
//! | contact | `pull_off_n` and `neck` of the element that the robot touches: it holds at negative depth until then, and a little longer | `adhesion` |
//! | contact | `assembly.across`: a dashpot and friction beside pad and springs together | `viscous-damping`, `guide-friction`, `stiction` (one of their forms each) |
//! | spring | `ForceLaw` on `assembly.spring`, with a knot | `end-stop`, `clearance` (a part bears only beyond a gap) |
//! | guide | numbers of [`Guide`](crate::rig::Guide): Coulomb level, static ratio, Stribeck's speed, load coefficient, share through the cell, drag of the air and its share | `guide-friction`, `stiction`, `load-dependent-friction`, `air-damping` |
//! | piece, base | a body: `assembly.piece`; `assembly.frame`, a second body below the springs | `moving-piece-inertia`, `frame-compliance` |
//! | robot | `assembly.joint` splits the robot's mass in tip and link; `assembly.ceiling` lets them slip; `assembly.sway` accelerates all of it | `joint-elasticity`, `force-ceiling`, `link-oscillation` |
//! | drive | [`Drive`](crate::rig::Drive): force on the robot from time since contact, position, velocity, and time since a trigger (a force passed for a delay) | `robot-push`, `collision-reaction`, `air-drag` |
//! | initial condition | `assembly.approach`, changed before anything else enters: speed, mass by configuration | `speed-error`, `pose-dependent-mass` |
//! | chain | [`Stage`](crate::rig::Stage): works on the sampled signal, in order | `piezo-discharge`, `charge-drift`, `clipping`, `filter-lag`, `mains-hum`, `gain-error`; in `assembly.log` `lost-samples`, when samples are numbers |
//!
//! A new site (say, a second robot joint) is a change of the assembly; a new mechanism at a known site is not.

mod adhesion;
mod air_damping;
mod air_drag;
mod charge_drift;
mod clearance;
mod clipping;
mod collision_reaction;
mod effect;
mod end_stop;
mod filter_lag;
mod force_ceiling;
mod frame_compliance;
mod gain_error;
mod guide_friction;
mod hardening;
mod hunt_crossley_damping;
mod joint_elasticity;
mod link_oscillation;
mod load_dependent_friction;
mod lost_samples;
mod mains_hum;
mod moving_piece_inertia;
mod mullins_softening;
mod pad_relaxation;
mod parameter;
mod piezo_discharge;
mod pose_dependent_mass;
mod rate_stiffening;
mod robot_push;
mod speed_error;
mod stiction;
mod viscous_damping;

use crate::rig::Assembly;

pub use effect::{Effect, MechanismError};
pub use parameter::{Needed, Parameter, Scale, Search};

/// Every mechanism, in the order of the campaign contract.
pub static LIST: &[&Mechanism] = &[
    &hunt_crossley_damping::MECHANISM,
    &viscous_damping::MECHANISM,
    &pad_relaxation::MECHANISM,
    &rate_stiffening::MECHANISM,
    &mullins_softening::MECHANISM,
    &hardening::MECHANISM,
    &end_stop::MECHANISM,
    &clearance::MECHANISM,
    &adhesion::MECHANISM,
    &air_damping::MECHANISM,
    &guide_friction::MECHANISM,
    &load_dependent_friction::MECHANISM,
    &stiction::MECHANISM,
    &moving_piece_inertia::MECHANISM,
    &frame_compliance::MECHANISM,
    &joint_elasticity::MECHANISM,
    &link_oscillation::MECHANISM,
    &robot_push::MECHANISM,
    &force_ceiling::MECHANISM,
    &collision_reaction::MECHANISM,
    &pose_dependent_mass::MECHANISM,
    &speed_error::MECHANISM,
    &piezo_discharge::MECHANISM,
    &charge_drift::MECHANISM,
    &clipping::MECHANISM,
    &filter_lag::MECHANISM,
    &mains_hum::MECHANISM,
    &gain_error::MECHANISM,
    &lost_samples::MECHANISM,
    &air_drag::MECHANISM,
];

/// What is known of one mechanism, and how it enters a rig.
#[derive(Debug)]
pub struct Mechanism {
    /// Its name in files and on the command line; fixed, so that results can be compared.
    pub id: &'static str,
    /// The part of the rig that the contract files it under.
    pub group: Group,
    /// Where in the assembly it acts.
    pub site: Site,
    /// Whether it is a property of the rig, which stays from one recording to the next; not what the robot does or what happens to the chain
    /// in one and not in another.
    pub lasting: bool,
    /// Whether its equation is what happens, to the last digit: a number that is not what was stated, a reading that is cut off. Of the others
    /// no rig is quite like the equation.
    pub exact: bool,
    /// Which of its parameters may be others in each configuration: they are of the object that falls, of a pose or of the place that is hit.
    pub by_configuration: &'static [&'static str],
    /// And which in each recording, without any rule: a speed that a controller misses, a zero that warms.
    pub by_recording: &'static [&'static str],
    /// Parameters that do something in some of its forms only: which, and in which forms by which choice.
    pub used_in: &'static [(&'static str, &'static str, &'static [f64])],
    /// Strengths that are the size of a thing, as a gap is: far below anything likely there is no such thing, while a force may be as small as one likes.
    pub sized: &'static [&'static str],
    /// Its equation, as text.
    pub equation: &'static str,
    /// Where the equation and the ranges come from.
    pub source: &'static str,
    /// Its parameters. The first one is its strength: at that one's null value the mechanism is absent.
    pub parameters: &'static [Parameter],
    /// Where its mismatch shows in a recording.
    pub signature: &'static str,
    /// Ids of the mechanisms it is confused with, in the contract's list.
    pub confused_with: &'static [&'static str],
    /// What separates it from those.
    pub separated_by: &'static str,
    /// Puts it into the rig. The effect's values are within range.
    pub enter: fn(&Effect, &mut Assembly),
}

/// The contract's groups of mechanisms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Group {
    /// Between robot and piece, and in the springs.
    Contact,
    /// Where the piece slides.
    Guide,
    /// Masses that the baseline neglects.
    Bodies,
    /// The robot behind the contact.
    Robot,
    /// From the cell to the sample.
    Measuring,
    /// Free flight.
    Fall,
}

impl Group {
    /// The name in files and tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Contact => "contact",
            Self::Guide => "guide",
            Self::Bodies => "bodies",
            Self::Robot => "robot",
            Self::Measuring => "measuring",
            Self::Fall => "fall",
        }
    }
}

/// Where in the assembly a mechanism acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Site {
    /// The compliant layer between robot and piece.
    Pad,
    /// The body springs.
    Spring,
    /// The guide of the piece.
    Guide,
    /// The moving piece.
    Piece,
    /// The robot's own bodies.
    Robot,
    /// The forces on the robot.
    Drive,
    /// What the rig stands on.
    Base,
    /// The measuring chain.
    Chain,
    /// Speed and mass at the instant of contact.
    InitialCondition,
}

impl Site {
    /// The name in files and tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pad => "pad",
            Self::Spring => "spring",
            Self::Guide => "guide",
            Self::Piece => "piece",
            Self::Robot => "robot",
            Self::Drive => "drive",
            Self::Base => "base",
            Self::Chain => "chain",
            Self::InitialCondition => "initial condition",
        }
    }
}

impl Mechanism {
    /// In which recordings it is to be expected, for people.
    #[must_use]
    pub const fn occurrence(&self) -> &'static str {
        if self.lasting {
            "in all recordings, from one on, in some poses, or from some strength on"
        } else {
            "in any of the recordings"
        }
    }

    /// Whether one of both is said to be confused with the other.
    #[must_use]
    pub fn is_confused_with(&self, other: &Self) -> bool {
        self.confused_with.contains(&other.id) || other.confused_with.contains(&self.id)
    }

    /// What a person is to know of one of its parameters beside the ranges; mostly nothing.
    #[must_use]
    pub fn remark(&self, parameter: &Parameter) -> String {
        if let Some((_, choice, values)) = self.used_in.iter().find(|(name, ..)| *name == parameter.name) {
            let values: Vec<String> = values.iter().map(f64::to_string).collect();
            let own = if parameter.is_of_each_impact() { "each impact has its own, " } else { "" };
            return format!("{own}{choice} {} only", values.join(", "));
        }
        let remark =
            match (self.by_configuration.contains(&parameter.name), self.by_recording.contains(&parameter.name)) {
                (true, true) => "may be another in each configuration or recording",
                (true, false) => "may be another in each configuration",
                (false, true) => "may be another in each recording",
                (false, false) => parameter.search.remark(),
            };
        remark.to_owned()
    }

    /// The mechanism with this id.
    ///
    /// # Errors
    /// [`MechanismError::Unknown`] with the ids that exist.
    pub fn find(id: &str) -> Result<&'static Self, MechanismError> {
        LIST.iter().copied().find(|mechanism| mechanism.id == id).ok_or_else(|| MechanismError::Unknown {
            id: id.to_owned(),
            known: LIST.iter().map(|mechanism| mechanism.id).collect::<Vec<_>>().join(", "),
        })
    }

    /// Its parameter with this name, and that one's place in an effect's values.
    ///
    /// # Errors
    /// [`MechanismError::UnknownParameter`] with the names that exist.
    pub fn parameter(&self, name: &str) -> Result<(usize, &'static Parameter), MechanismError> {
        self.parameters.iter().enumerate().find(|(_, parameter)| parameter.name == name).ok_or_else(|| {
            MechanismError::UnknownParameter {
                id: self.id,
                name: name.to_owned(),
                known: self.parameters.iter().map(|parameter| parameter.name).collect::<Vec<_>>().join(", "),
            }
        })
    }

    /// Whether it leaves the motion as it is: the measuring chain alone has it.
    #[must_use]
    pub fn is_seen_only(&self) -> bool {
        self.site == Site::Chain
    }

    /// Whether the place of what falls can show it, as a video or a laser gives it: of the measuring chain neither what is in newtons (but the
    /// mains, which hum in a laser's chain as well), nor the charge of a piezoelectric cell.
    #[must_use]
    pub fn is_seen_in_place(&self) -> bool {
        !self.is_seen_only() || self.id == "mains-hum" || !(self.is_in_newtons() || self.id == "piezo-discharge")
    }

    /// Whether it acts on one channel alone, what is observed. (A block that a log has lost is missing from every channel.)
    #[must_use]
    pub fn is_of_one_channel(&self) -> bool {
        self.is_seen_only() && self.is_in_newtons()
    }

    fn is_in_newtons(&self) -> bool {
        self.parameters.iter().any(|parameter| matches!(parameter.unit, "N" | "N/s"))
    }

    /// Whether it is of one configuration alone, by its number.
    fn is_of_one_configuration(&self) -> bool {
        self.parameters.iter().any(|parameter| matches!(parameter.search, Search::Whole(_)))
    }

    /// Whether it can be in an experiment of this kind.
    #[must_use]
    pub fn concerns(&self, kind: crate::rig::Kind) -> bool {
        use crate::rig::Kind;
        match (kind, self.group) {
            // What falls has no pose, and its mass is seen by its drag alone, which each body has for itself.
            (Kind::Fall, group) => {
                group == Group::Fall
                    || self.site == Site::Chain
                    || self.site == Site::InitialCondition && !self.is_of_one_configuration()
            }
            (Kind::Impact, group) => group != Group::Fall,
            (Kind::Drop, group) => group != Group::Robot || self.site == Site::InitialCondition,
        }
    }

    /// The mechanism with every parameter at its typical value.
    #[must_use]
    pub fn typical(&'static self) -> Effect {
        Effect::typical(self)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::rig::{Accuracy, Approach, Impact, Rig};

    /// One impact of 0.3 s at this speed (m/s) of this mass (kg).
    pub(crate) fn strike(rig: Rig, speed_m_per_s: f64, mass_kg: f64, effects: &[&str]) -> Impact {
        strike_as(rig, Approach::new(speed_m_per_s, mass_kg), effects)
    }

    /// The same with a place in its campaign.
    pub(crate) fn strike_as(rig: Rig, approach: Approach, effects: &[&str]) -> Impact {
        let effects: Vec<Effect> = effects.iter().map(|text| text.parse().expect("a listed mechanism")).collect();
        rig.strike(&approach, &effects, 0.3, Accuracy::default()).unwrap_or_else(|error| panic!("{effects:?}: {error}"))
    }

    pub(crate) fn near(what: &str, value: f64, expected: f64, tolerance: f64) {
        assert!((value - expected).abs() <= tolerance, "{what}: {value}, expected {expected} ± {tolerance}");
    }

    /// The ids of the campaign contract, in its order; results are compared by them.
    #[test]
    fn the_list_is_that_of_the_contract() {
        let contract = "hunt-crossley-damping viscous-damping pad-relaxation rate-stiffening mullins-softening hardening \
            end-stop clearance adhesion air-damping guide-friction load-dependent-friction stiction moving-piece-inertia \
            frame-compliance joint-elasticity link-oscillation robot-push force-ceiling collision-reaction \
            pose-dependent-mass speed-error piezo-discharge charge-drift clipping filter-lag mains-hum gain-error \
            lost-samples air-drag";
        let ids: Vec<&str> = LIST.iter().map(|mechanism| mechanism.id).collect();
        assert_eq!(ids, contract.split_whitespace().collect::<Vec<_>>());
        for mechanism in LIST {
            for rival in mechanism.confused_with {
                assert!(ids.contains(rival) && *rival != mechanism.id, "{}: {rival}", mechanism.id);
            }
        }
    }

    /// What is said to do nothing in a form of a mechanism does nothing there, and something where it is said to.
    #[test]
    fn parameters_do_something_in_their_forms_only() {
        let rig = Rig::impact(25e3).with_pad(80e3);
        let times_s: Vec<f64> = (-10..190).map(|number| f64::from(number) * 1e-3).collect();
        for mechanism in LIST {
            for (name, choice, values) in mechanism.used_in {
                let (place, parameter) = mechanism.parameter(name).unwrap();
                let (forms_at, forms) = mechanism.parameter(choice).unwrap();
                let (first, last) = forms.range;
                for form in (first as u32..=last as u32).map(f64::from) {
                    // A push that is at its limit all through a quick blow shows where its set point brakes in a slow one.
                    let force_n = |value: f64| -> Vec<Vec<f64>> {
                        let mut effect = mechanism.typical();
                        effect.set_value(forms_at, form).unwrap();
                        effect.set_value(place, value).unwrap();
                        assert_eq!(effect.takes_part(place), values.contains(&form), "{name} of {effect}");
                        let second = |speed: f64| Approach { order: 1, ..Approach::new(speed, 6.0) };
                        let struck = |speed: f64| strike_as(rig, second(speed), &[&effect.to_string()]);
                        [1.2, 0.1].map(|speed| struck(speed).measured_n(&times_s)).to_vec()
                    };
                    let (low, high) = parameter.plausible;
                    let does_something = force_n(low) != force_n(high);
                    assert_eq!(does_something, values.contains(&form), "{}: {name} in {choice} {form}", mechanism.id);
                }
            }
        }
    }

    #[test]
    fn every_mechanism_is_described_once_and_within_its_own_ranges() {
        for (place, mechanism) in LIST.iter().enumerate() {
            assert!(LIST[..place].iter().all(|other| other.id != mechanism.id), "{} twice", mechanism.id);
            assert!(!mechanism.parameters.is_empty(), "{} has no strength", mechanism.id);
            assert!(!mechanism.equation.is_empty() && !mechanism.source.is_empty(), "{}", mechanism.id);
            for parameter in mechanism.parameters {
                let (low, high) = parameter.range;
                assert!(low < high, "{} {}", mechanism.id, parameter.name);
                assert!((low..=high).contains(&parameter.typical), "{} {}", mechanism.id, parameter.name);
                let (likely_low, likely_high) = parameter.plausible;
                assert!(low <= likely_low && likely_low <= likely_high && likely_high <= high, "{}", parameter.name);
                assert!(parameter.scale == Scale::Linear || likely_low > 0.0, "{}: log of zero", parameter.name);
            }
            for name in mechanism.sized {
                assert!(mechanism.parameter(name).unwrap().1.null.is_some(), "{}: {name} is a shape", mechanism.id);
            }
            for (name, choice, values) in mechanism.used_in {
                assert!(mechanism.parameter(name).is_ok(), "{}: {name}", mechanism.id);
                let (_, forms) = mechanism.parameter(choice).unwrap();
                assert!(forms.is_form() && !values.is_empty() && values.iter().all(|value| forms.permits(*value)));
            }
            let strength = &mechanism.parameters[0];
            let null = strength.null.unwrap_or_else(|| panic!("{} cannot vanish", mechanism.id));
            assert!(strength.permits(null), "{}: its absence is out of range", mechanism.id);
        }
    }
}
