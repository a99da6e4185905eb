//! J(q): how a point of a link moves with the joints.
//!
//! ```text
//! ẋ = J_v q̇     column of a joint that turns: a × (x − p)     that slides: a
//! ω = J_ω q̇                                    a                           0
//! ```

use nalgebra::{DMatrix, Isometry3, Point3};

use super::Robot;
use super::joint_inertia::{axes, follow};
use super::posture::Posture;

/// The two halves of the geometric Jacobian, in the base's frame; columns are the posture's free joints.
#[derive(Clone, Debug)]
pub struct Jacobian {
    /// Velocity of the point, 3 × n.
    pub linear: DMatrix<f64>,
    /// Angular velocity of the link, 3 × n.
    pub angular: DMatrix<f64>,
}

/// The Jacobian of a point that is fixed to a link; `point` is in the base's frame.
#[must_use]
pub fn jacobian(robot: &Robot, posture: &Posture, link: usize, point: &Point3<f64>) -> Jacobian {
    jacobian_with(robot, &posture.poses(robot), &posture.free, link, point)
}

pub(super) fn jacobian_with(
    robot: &Robot,
    poses: &[Isometry3<f64>],
    free: &[usize],
    link: usize,
    point: &Point3<f64>,
) -> Jacobian {
    let axes = axes(robot, poses);
    let mut linear = DMatrix::zeros(3, robot.joints.len());
    let mut angular = DMatrix::zeros(3, robot.joints.len());
    for joint in robot.way_to(link) {
        linear.set_column(joint, &axes[joint].velocity_at(point));
        angular.set_column(joint, &axes[joint].spin());
    }
    let follow = follow(robot, free);
    Jacobian { linear: linear * &follow, angular: angular * &follow }
}
