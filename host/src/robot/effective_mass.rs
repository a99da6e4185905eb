//! How heavy a robot is at a point, along a direction: m_R.
//!
//! ```text
//! 1/m = nᵀ J M⁻¹ Jᵀ n                                            (7), (8) of the paper; Khatib 1995
//! m   = min { q̇ᵀ M q̇ :  nᵀ J q̇ = 1,  B q̇ = 0 }                  the same where nothing is held (B empty)
//! ```
//!
//! The second line says what the first means: of all motions in which the point goes along n with speed 1, a blow
//! causes the one with the least kinetic energy, and m is twice that. It also holds where the drives keep something
//! fixed: the rows of B are the motions that must not be, ω for a held orientation, and the two sideways velocities too
//! where the path is held. With N a basis of what B leaves, 1/m = wᵀ (NᵀMN)⁺ w,  w = Nᵀ Jᵀ n.
//!
//! **Without inertia.** A link that has none makes M singular. The pseudo-inverse then leaves those motions out that
//! cost no energy. That is right where they do not move the point along n, such as a flange that turns about its own
//! axis with the point on it. Where they do, a model without that inertia cannot say what the robot weighs there (it
//! would be nothing), which is reported as [`Assessed::massless`].

use nalgebra::{DMatrix, DVector, Point3, Unit, Vector3};

use super::Robot;
use super::contact::{Contact, Orientation};
use super::jacobian::{Jacobian, jacobian_with};
use super::joint_inertia::joint_inertia;
use super::posture::Posture;

/// An eigenvalue of M, scaled to a unit diagonal, below this counts as zero. Real arms have 1e-4 and above; rounding
/// makes 1e-15.
const NO_INERTIA: f64 = 1e-10;
/// A joint that carries less than this share of the largest inertia carries none.
const NO_SHARE: f64 = 1e-12;
/// Below this (m, or without unit) a joint does not move the point: rounding of the angles in a file makes 1e-12.
const NO_MOTION: f64 = 1e-9;

/// The effective mass at a contact.
#[derive(Clone, Debug, PartialEq)]
pub struct Assessed {
    /// Nothing held: equation 8. `None` where no joint moves the point in this direction.
    pub free_kg: Option<f64>,
    /// Orientation and path held; `None` where the robot cannot move so.
    pub held_kg: Option<f64>,
    /// Orientation held; `None` where the robot cannot move so.
    pub held_yielding_kg: Option<f64>,
    /// Contact point in the base's frame.
    pub point_m: Point3<f64>,
    /// Direction in the base's frame.
    pub direction: Unit<Vector3<f64>>,
    /// Rank of M, at most the number of free joints.
    pub rank: usize,
    /// Free joints without any inertia behind them that move the point in this direction.
    pub massless: Vec<usize>,
}

impl Assessed {
    /// The value for this kind of holding.
    #[must_use]
    pub fn mass_kg(&self, orientation: Orientation) -> Option<f64> {
        match orientation {
            Orientation::Free => self.free_kg,
            Orientation::Held => self.held_kg,
            Orientation::HeldYielding => self.held_yielding_kg,
        }
    }
}

/// The effective mass of a robot in a posture at a contact.
#[must_use]
pub fn assess(robot: &Robot, posture: &Posture, contact: &Contact) -> Assessed {
    let poses = posture.poses(robot);
    let (point, direction) = contact.in_base(&poses);
    let inertia = joint_inertia(robot, posture);
    let jacobian = jacobian_with(robot, &poses, &posture.free, contact.link, &point);
    let along = jacobian.linear.tr_mul(&direction.into_inner());

    let free = mobility(&inertia, &along);
    let massless = massless(&inertia, &along, &posture.free);
    Assessed {
        free_kg: free.mass_kg(),
        held_kg: held(&inertia, &along, &stack(&jacobian, &sideways(&direction))),
        held_yielding_kg: held(&inertia, &along, &jacobian.angular),
        point_m: point,
        direction,
        rank: free.rank,
        massless,
    }
}

/// Joints that alone have no inertia and yet move the point.
fn massless(inertia: &DMatrix<f64>, along: &DVector<f64>, free: &[usize]) -> Vec<usize> {
    let least = NO_SHARE * inertia.diagonal().amax();
    (0..free.len())
        .filter(|&joint| inertia[(joint, joint)] <= least && along[joint].abs() > NO_MOTION)
        .map(|joint| free[joint])
        .collect()
}

/// Two unit vectors at right angles to a direction and to each other.
fn sideways(direction: &Unit<Vector3<f64>>) -> [Vector3<f64>; 2] {
    // The axis that is least along the direction.
    let other = Vector3::ith(direction.iamin(), 1.0);
    let one = direction.cross(&other).normalize();
    [one, direction.cross(&one)]
}

/// B for a held path: the angular velocity and the two sideways velocities.
fn stack(jacobian: &Jacobian, sideways: &[Vector3<f64>; 2]) -> DMatrix<f64> {
    let columns = jacobian.linear.ncols();
    let mut rows = DMatrix::zeros(5, columns);
    rows.rows_mut(0, 3).copy_from(&jacobian.angular);
    for (row, vector) in sideways.iter().enumerate() {
        rows.set_row(3 + row, &jacobian.linear.tr_mul(vector).transpose());
    }
    rows
}

/// The effective mass among motions that B does not forbid.
fn held(inertia: &DMatrix<f64>, along: &DVector<f64>, forbidden: &DMatrix<f64>) -> Option<f64> {
    let left = null_space(forbidden);
    mobility(&(left.transpose() * inertia * &left), &left.tr_mul(along)).mass_kg()
}

/// An orthonormal basis of what a matrix maps to nothing, as columns.
fn null_space(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let columns = matrix.ncols();
    // Rows of zeros make it square, so that all right singular vectors come out.
    let mut square = DMatrix::zeros(columns.max(matrix.nrows()), columns);
    square.rows_mut(0, matrix.nrows()).copy_from(matrix);
    let svd = square.svd(false, true);
    let Some(right) = svd.v_t else { return DMatrix::zeros(columns, 0) };
    let least = NO_MOTION * svd.singular_values.amax();
    let free: Vec<_> =
        (0..columns).filter(|&row| svd.singular_values[row] <= least).map(|row| right.row(row)).collect();
    DMatrix::from_fn(columns, free.len(), |row, column| free[column][row])
}

/// 1/m, and of what rank the inertia behind it is.
pub(super) struct Mobility {
    per_kg: f64,
    rank: usize,
    moved: bool,
}

impl Mobility {
    pub(super) fn mass_kg(&self) -> Option<f64> {
        (self.moved && self.per_kg > 0.0).then(|| 1.0 / self.per_kg)
    }
}

/// wᵀ M⁺ w. M is first scaled to a unit diagonal, so that joints that turn and that slide, large ones and small, count
/// alike.
pub(super) fn mobility(inertia: &DMatrix<f64>, along: &DVector<f64>) -> Mobility {
    let least = NO_SHARE * if inertia.is_empty() { 0.0 } else { inertia.diagonal().amax() };
    let carrying: Vec<usize> = (0..along.len()).filter(|&joint| inertia[(joint, joint)] > least).collect();
    let scale: Vec<f64> = carrying.iter().map(|&joint| inertia[(joint, joint)].sqrt()).collect();
    let n = carrying.len();
    let scaled =
        DMatrix::from_fn(n, n, |row, column| inertia[(carrying[row], carrying[column])] / (scale[row] * scale[column]));
    let along = DVector::from_fn(n, |row, _| along[carrying[row]]);
    let moved = along.iter().any(|share| share.abs() > NO_MOTION);
    let weighted = DVector::from_fn(n, |row, _| along[row] / scale[row]);
    if n == 0 {
        return Mobility { per_kg: 0.0, rank: 0, moved: false };
    }
    let eigen = scaled.symmetric_eigen();
    let mut mobility = Mobility { per_kg: 0.0, rank: 0, moved };
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > NO_INERTIA {
            mobility.per_kg += vector.dot(&weighted).powi(2) / value;
            mobility.rank += 1;
        }
    }
    mobility
}
