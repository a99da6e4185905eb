//! The paper's own model: four point masses, at shoulder, elbow, wrist and end effector.
//!
//! ```text
//! M_l(q) = Σ mᵢ Jᵢᵀ Jᵢ          no body has a rotational inertia
//! a link between A and B:  s = (c − A)·(B − A)/|B − A|²   gives  (1 − s) m to A and s m to B,   0 ≤ s ≤ 1
//! ```
//!
//! The paper names the four places and no more (its reference for the masses is not public), so the masses are divided
//! by the lever rule above, which keeps each link's centre of mass along the line. Shoulder, elbow and wrist are the
//! origins of three joints: the second, fourth and sixth of a seven-axis arm, the second, third and fifth of a six-axis
//! one, or those that are named. What lies between base and shoulder goes to the shoulder as far as it is there. The
//! end effector is the contact point.

use nalgebra::{DMatrix, Point3};

use super::contact::Contact;
use super::effective_mass::mobility;
use super::jacobian::jacobian_with;
use super::posture::Posture;
use super::{Motion, Robot};

/// Names of the lumps.
pub const NAMES: [&str; 4] = ["shoulder", "elbow", "wrist", "end effector"];

/// The lumped model in a posture.
#[derive(Clone, Debug, PartialEq)]
pub struct Lumped {
    /// Effective mass along the contact's direction, kg; nothing is held. `None` where no joint moves the point so.
    pub mass_kg: Option<f64>,
    /// Masses, kg, in the order of [`NAMES`].
    pub lumps_kg: [f64; 4],
    /// The joints at shoulder, elbow and wrist.
    pub joints: [usize; 3],
}

/// Why there is no lumped model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoLumps {
    /// It is not known which joints are shoulder, elbow and wrist.
    #[error("an arm with {turning} turning joints has no known shoulder, elbow and wrist")]
    Unknown {
        /// Joints that turn between base and contact.
        turning: usize,
    },
    /// The contact is not behind the wrist.
    #[error("the contact is on {link}, which is not behind the wrist ({wrist})")]
    BeforeTheWrist {
        /// The link.
        link: String,
        /// The wrist's joint.
        wrist: String,
    },
    /// They do not follow each other.
    #[error("{first} is not followed by {second} on the way to {link}")]
    Order {
        /// This joint
        first: String,
        /// should come before this one
        second: String,
        /// on the way to this link.
        link: String,
    },
}

/// Shoulder, elbow and wrist of the usual arms.
///
/// # Errors
/// [`NoLumps::Unknown`].
pub fn usual_joints(robot: &Robot, link: usize) -> Result<[usize; 3], NoLumps> {
    let turning: Vec<usize> =
        robot.way_to(link).into_iter().filter(|&joint| robot.joints[joint].motion == Motion::Turn).collect();
    match turning.len() {
        7 => Ok([turning[1], turning[3], turning[5]]),
        6 => Ok([turning[1], turning[2], turning[4]]),
        turning => Err(NoLumps::Unknown { turning }),
    }
}

/// The lumped model of a robot with its tool, with these joints at shoulder, elbow and wrist.
///
/// # Errors
/// [`NoLumps`].
pub fn lumped(robot: &Robot, posture: &Posture, contact: &Contact, joints: [usize; 3]) -> Result<Lumped, NoLumps> {
    let name = |joint: usize| robot.joints[joint].name.clone();
    let link = || robot.links[contact.link].name.clone();
    let way = robot.way_to(contact.link);
    let place = |joint: usize| way.iter().position(|&other| other == joint);
    let Some(_) = place(joints[2]) else {
        return Err(NoLumps::BeforeTheWrist { link: link(), wrist: name(joints[2]) });
    };
    for pair in joints.windows(2) {
        if place(pair[0]).is_none() || place(pair[0]) >= place(pair[1]) {
            return Err(NoLumps::Order { first: name(pair[0]), second: name(pair[1]), link: link() });
        }
    }
    let poses = posture.poses(robot);
    let origin = |joint: usize| Point3::from(poses[robot.joints[joint].child].translation.vector);
    let (end, direction) = contact.in_base(&poses);
    let points = [origin(joints[0]), origin(joints[1]), origin(joints[2]), end];
    let carriers = [joints[0], joints[1], joints[2]].map(|joint| robot.joints[joint].child);
    let carriers = [carriers[0], carriers[1], carriers[2], contact.link];

    let mut lumps_kg = [0.0; 4];
    for (index, body) in robot.links.iter().enumerate().filter_map(|(index, link)| Some((index, link.body?))) {
        if !robot.moves(index) {
            continue;
        }
        let on_way = robot.way_to(index);
        let segment = joints.iter().filter(|joint| on_way.contains(joint)).count();
        // What lies before the shoulder hangs between the foot of the first moving joint and the shoulder.
        let first = on_way.iter().find(|&&joint| robot.joints[joint].motion != Motion::Fixed);
        let from = if segment == 0 { first.map_or(points[0], |&joint| origin(joint)) } else { points[segment - 1] };
        let along = points[segment] - from;
        let length = along.norm_squared();
        let centre = poses[index] * body.centre_m;
        let share = if length > 0.0 { ((centre - from).dot(&along) / length).clamp(0.0, 1.0) } else { 1.0 };
        lumps_kg[segment] += share * body.mass_kg;
        if segment > 0 {
            lumps_kg[segment - 1] += (1.0 - share) * body.mass_kg;
        }
    }
    let mut inertia = DMatrix::zeros(posture.free.len(), posture.free.len());
    for ((point, carrier), mass) in points.iter().zip(carriers).zip(lumps_kg) {
        let linear = jacobian_with(robot, &poses, &posture.free, carrier, point).linear;
        inertia += mass * linear.tr_mul(&linear);
    }
    let along = jacobian_with(robot, &poses, &posture.free, contact.link, &end).linear.tr_mul(&direction.into_inner());
    Ok(Lumped { mass_kg: mobility(&inertia, &along).mass_kg(), lumps_kg, joints })
}
