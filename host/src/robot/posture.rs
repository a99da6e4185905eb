//! The values of the joints, checked against the robot; and where every link is with them.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion};

use super::{Motion, Robot};

/// Values as a person gave them.
#[derive(Clone, Debug, PartialEq)]
pub enum Given {
    /// One after the other, in the order of the tree.
    InOrder(Vec<f64>),
    /// By the names of the joints.
    Named(Vec<(String, f64)>),
}

/// Why values are no posture of a robot.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum PostureError {
    /// Too few or too many values.
    #[error("{given} joint values were given, and {robot} has {} joints that move: {}", names.len(), names.join(", "))]
    #[diagnostic(help("{help}"))]
    Count {
        /// The robot.
        robot: String,
        /// How many there were.
        given: usize,
        /// The joints there are.
        names: Vec<String>,
        /// What would be right.
        help: String,
    },
    /// There is no such joint.
    #[error("{robot} has no joint `{name}` that has a value of its own")]
    #[diagnostic(help("its joints: {}", names.join(", ")))]
    NoSuchJoint {
        /// The robot.
        robot: String,
        /// What was asked for.
        name: String,
        /// The joints there are.
        names: Vec<String>,
    },
    /// The same joint twice.
    #[error("joint `{name}` was given twice")]
    #[diagnostic(help("give every joint one value"))]
    Twice {
        /// The joint.
        name: String,
    },
    /// A value that is no number.
    #[error("the value of joint `{name}` is {value}, which is no place to be")]
    #[diagnostic(help("give a finite number"))]
    NotFinite {
        /// The joint.
        name: String,
        /// The value.
        value: f64,
    },
    /// A value beyond the joint's range.
    #[error("joint `{name}` cannot be at {}: it goes from {} to {}", shown(*value, *motion), shown(range.0, *motion), shown(range.1, *motion))]
    #[diagnostic(help("values are in radians and metres; with --degrees, angles are in degrees"))]
    OutOfRange {
        /// The joint.
        name: String,
        /// The value, rad or m.
        value: f64,
        /// What is possible, rad or m.
        range: (f64, f64),
        /// How it moves.
        motion: Motion,
    },
}

fn shown(value: f64, motion: Motion) -> String {
    match motion {
        Motion::Turn => format!("{value:.4} rad ({:.2}°)", value.to_degrees()),
        Motion::Slide | Motion::Fixed => format!("{value:.4} m"),
    }
}

/// Room for values that were rounded at the end of a range, rad or m.
const ROUNDING: f64 = 1e-4;

/// A posture: a value for every joint, and which of them give way to a push.
#[derive(Clone, Debug, PartialEq)]
pub struct Posture {
    /// Value of every joint of the robot, rad or m; 0 for fixed ones.
    pub values: Vec<f64>,
    /// The joints that move freely, in the order of the tree.
    pub free: Vec<usize>,
    /// The joints that have a value of their own and stand still, because none was given for them.
    pub locked: Vec<usize>,
}

impl Posture {
    /// The posture that the values mean.
    ///
    /// In order there must be one for every joint with a value of its own, or one for each of those between base and
    /// `link`. Joints that were given none stand still at 0, or at the end of their range that is nearest to 0.
    ///
    /// # Errors
    /// [`PostureError`].
    pub fn new(robot: &Robot, link: usize, given: &Given) -> Result<Self, PostureError> {
        let movable = robot.movable();
        let name = |joint: &usize| robot.joints[*joint].name.clone();
        let names = || movable.iter().map(name).collect::<Vec<_>>();
        let chosen: Vec<(usize, f64)> = match given {
            Given::InOrder(values) => {
                let way: Vec<usize> = robot.way_to(link).into_iter().filter(|joint| movable.contains(joint)).collect();
                let joints = match values.len() {
                    all if all == movable.len() => movable.clone(),
                    some if some == way.len() => way,
                    given => {
                        let mut help = "give one for each, in this order, or some by name: NAME=VALUE,…".to_owned();
                        if way.len() < movable.len() {
                            help = format!(
                                "give one for each, or one for each of the {} on the way to {} ({}); the others then stand \
                                 still. Or by name: NAME=VALUE,…",
                                way.len(),
                                robot.links[link].name,
                                way.iter().map(name).collect::<Vec<_>>().join(", ")
                            );
                        }
                        return Err(PostureError::Count { robot: robot.name.clone(), given, names: names(), help });
                    }
                };
                joints.into_iter().zip(values.iter().copied()).collect()
            }
            Given::Named(values) => {
                let mut chosen: Vec<(usize, f64)> = Vec::new();
                for (name, value) in values {
                    let Some(joint) = movable.iter().copied().find(|&joint| robot.joints[joint].name == *name) else {
                        let robot = robot.name.clone();
                        return Err(PostureError::NoSuchJoint { robot, name: name.clone(), names: names() });
                    };
                    if chosen.iter().any(|(other, _)| *other == joint) {
                        return Err(PostureError::Twice { name: name.clone() });
                    }
                    chosen.push((joint, *value));
                }
                chosen
            }
        };
        let mut values = vec![0.0; robot.joints.len()];
        for &joint in &movable {
            let (low, high) = robot.joints[joint].range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
            values[joint] = 0.0_f64.max(low).min(high);
        }
        for &(joint, value) in &chosen {
            let it = &robot.joints[joint];
            if !value.is_finite() {
                return Err(PostureError::NotFinite { name: it.name.clone(), value });
            }
            if let Some(range) = it.range
                && !(range.0 - ROUNDING..=range.1 + ROUNDING).contains(&value)
            {
                return Err(PostureError::OutOfRange { name: it.name.clone(), value, range, motion: it.motion });
            }
            values[joint] = value;
        }
        for joint in 0..robot.joints.len() {
            if let Some(mimic) = robot.joints[joint].mimic {
                // `description` has resolved chains of followers to the joint that leads them.
                values[joint] = mimic.multiplier * values[mimic.joint] + mimic.offset;
            }
        }
        let given = |joint: &usize| chosen.iter().any(|(other, _)| other == joint);
        let (free, locked) = movable.iter().copied().partition(given);
        Ok(Self { values, free, locked })
    }

    /// The frame of every link in the base's.
    #[must_use]
    pub fn poses(&self, robot: &Robot) -> Vec<Isometry3<f64>> {
        let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(robot.links.len());
        for link in &robot.links {
            let pose = link.joint.map_or_else(Isometry3::identity, |index| {
                let joint = &robot.joints[index];
                let moved = match joint.motion {
                    Motion::Fixed => Isometry3::identity(),
                    Motion::Turn => Isometry3::from_parts(
                        Translation3::identity(),
                        UnitQuaternion::from_axis_angle(&Unit::new_unchecked(joint.axis), self.values[index]),
                    ),
                    Motion::Slide => Isometry3::from_parts(
                        Translation3::from(joint.axis * self.values[index]),
                        UnitQuaternion::identity(),
                    ),
                };
                // A parent comes before its child.
                poses[joint.parent] * joint.origin * moved
            });
            poses.push(pose);
        }
        poses
    }
}
