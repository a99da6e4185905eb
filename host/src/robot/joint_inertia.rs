//! M(q): the inertia that the drives of a robot feel, by composite rigid bodies.
//!
//! ```text
//! T = ½ q̇ᵀ M q̇
//! C_j = everything that joint j carries, as one body (mass m, centre c, inertia I about c)
//! q̇_j = 1 alone gives C_j the momentum  h = m v_c  and the spin  I ω  about c
//! M_ij = a_i · (I ω + (c − p_i) × h)     i turns;      M_ij = a_i · h     i slides;      i carries j, or is j
//! ```
//!
//! Featherstone, Rigid Body Dynamics Algorithms, 6.2; written with vectors about each composite's own centre of mass,
//! so that a small body far from the base loses nothing to rounding. A joint that follows another, or that stands
//! still, is taken in by M = Gᵀ M_all G, where q̇_all = G q̇.

use nalgebra::{DMatrix, Isometry3, Point3, Vector3};

use super::body::Body;
use super::posture::Posture;
use super::{Motion, Robot};

/// The axis of a joint in the base's frame: its direction and a point on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    pub(super) motion: Motion,
    pub(super) direction: Vector3<f64>,
    pub(super) point: Point3<f64>,
}

impl Axis {
    /// Velocity that a unit of the joint's speed gives to a point of what it carries.
    pub(super) fn velocity_at(&self, point: &Point3<f64>) -> Vector3<f64> {
        match self.motion {
            Motion::Fixed => Vector3::zeros(),
            Motion::Turn => self.direction.cross(&(point - self.point)),
            Motion::Slide => self.direction,
        }
    }

    /// Angular velocity that a unit of the joint's speed gives to what it carries.
    pub(super) fn spin(&self) -> Vector3<f64> {
        if self.motion == Motion::Turn { self.direction } else { Vector3::zeros() }
    }
}

/// The axes of all joints with these poses of the links.
pub(super) fn axes(robot: &Robot, poses: &[Isometry3<f64>]) -> Vec<Axis> {
    robot
        .joints
        .iter()
        .map(|joint| {
            let pose = &poses[joint.child];
            // The joint turns about, or slides along, an axis that its own motion leaves where it is.
            Axis {
                motion: joint.motion,
                direction: pose.rotation * joint.axis,
                point: Point3::from(pose.translation.vector),
            }
        })
        .collect()
}

/// G: how fast every joint goes when a free one goes with speed 1. Rows: joints of the robot; columns: free joints.
pub(super) fn follow(robot: &Robot, free: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(robot.joints.len(), free.len(), |joint, column| match robot.joints[joint].mimic {
        Some(mimic) if mimic.joint == free[column] => mimic.multiplier,
        None if joint == free[column] => 1.0,
        _ => 0.0,
    })
}

/// M(q), kg m², kg m and kg by whether joints turn or slide; rows and columns are the posture's free joints.
#[must_use]
pub fn joint_inertia(robot: &Robot, posture: &Posture) -> DMatrix<f64> {
    let poses = posture.poses(robot);
    let axes = axes(robot, &poses);
    let mut composite: Vec<Option<Body>> =
        robot.links.iter().zip(&poses).map(|(link, pose)| link.body.map(|body| body.seen_from(pose))).collect();
    for link in (1..robot.links.len()).rev() {
        // All that this link carries is in its composite by now: children come after their parents.
        let Some(joint) = robot.links[link].joint else { continue };
        let parent = robot.joints[joint].parent;
        composite[parent] = match (composite[parent], composite[link]) {
            (Some(one), Some(other)) => Some(one.with(&other)),
            (one, other) => one.or(other),
        };
    }
    let mut all = DMatrix::zeros(robot.joints.len(), robot.joints.len());
    for (j, joint) in robot.joints.iter().enumerate() {
        let Some(carried) = composite[joint.child] else { continue };
        let momentum = carried.mass_kg * axes[j].velocity_at(&carried.centre_m);
        let spin = carried.inertia_kg_m2 * axes[j].spin();
        for i in robot.way_to(joint.child) {
            let work = match axes[i].motion {
                Motion::Fixed => 0.0,
                Motion::Turn => {
                    let arm = carried.centre_m - axes[i].point;
                    axes[i].direction.dot(&(spin + arm.cross(&momentum)))
                }
                Motion::Slide => axes[i].direction.dot(&momentum),
            };
            all[(i, j)] = work;
            all[(j, i)] = work;
        }
    }
    let follow = follow(robot, &posture.free);
    follow.transpose() * all * follow
}
