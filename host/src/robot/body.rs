//! Mass, centre of mass and inertia of one rigid body, or of several that are held together.
//!
//! ```text
//! c = (m₁c₁ + m₂c₂)/(m₁ + m₂)          I = Σ Iᵢ + mᵢ (|dᵢ|² 1 − dᵢdᵢᵀ),   dᵢ = cᵢ − c      (Huygens and Steiner)
//! ```
//!
//! The inertia is kept about the centre of mass, where the sums lose least to rounding.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

/// A body in some frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Mass, kg; above 0.
    pub mass_kg: f64,
    /// Centre of mass, m.
    pub centre_m: Point3<f64>,
    /// Inertia about the centre of mass in the axes of the frame, kg m².
    pub inertia_kg_m2: Matrix3<f64>,
}

/// Why numbers are no rigid body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoBody {
    /// A number is missing or infinite.
    #[error("a number of its inertia is not finite")]
    NotFinite,
    /// Negative mass.
    #[error("its mass is negative")]
    NegativeMass,
    /// A moment of inertia about an axis of the frame is negative.
    #[error("its inertia is negative about an axis of its frame")]
    NegativeInertia,
    /// Inertia without mass.
    #[error("it has inertia but no mass")]
    InertiaWithoutMass,
}

impl Body {
    /// A body from the numbers of a description: inertia about the centre of mass. `None` for a body without mass.
    ///
    /// # Errors
    /// [`NoBody`].
    pub fn checked(mass_kg: f64, centre_m: Point3<f64>, inertia_kg_m2: Matrix3<f64>) -> Result<Option<Self>, NoBody> {
        if !mass_kg.is_finite() || !centre_m.coords.iter().chain(inertia_kg_m2.iter()).all(|number| number.is_finite())
        {
            return Err(NoBody::NotFinite);
        }
        if mass_kg < 0.0 {
            return Err(NoBody::NegativeMass);
        }
        // A negative moment about some oblique axis, as descriptions of tiny parts have it, is left to `is_possible`.
        if inertia_kg_m2.diagonal().min() < 0.0 {
            return Err(NoBody::NegativeInertia);
        }
        if mass_kg == 0.0 {
            return if inertia_kg_m2.amax() > 0.0 { Err(NoBody::InertiaWithoutMass) } else { Ok(None) };
        }
        Ok(Some(Self { mass_kg, centre_m, inertia_kg_m2 }))
    }

    /// Whether any distribution of mass has this inertia: no principal moment exceeds the sum of the two others.
    #[must_use]
    pub fn is_possible(&self) -> bool {
        let moments = self.inertia_kg_m2.symmetric_eigenvalues();
        // Descriptions are rounded to a few digits.
        2.0 * moments.max() <= moments.sum() * (1.0 + 1e-3)
    }

    /// The same body in another frame, in which this frame has that pose.
    #[must_use]
    pub fn seen_from(&self, pose: &Isometry3<f64>) -> Self {
        let turn = pose.rotation.to_rotation_matrix();
        Self {
            mass_kg: self.mass_kg,
            centre_m: pose * self.centre_m,
            inertia_kg_m2: turn * self.inertia_kg_m2 * turn.inverse(),
        }
    }

    /// Both bodies held together.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        let mass_kg = self.mass_kg + other.mass_kg;
        let centre_m =
            Point3::from((self.mass_kg * self.centre_m.coords + other.mass_kg * other.centre_m.coords) / mass_kg);
        let moved = |body: &Self| body.inertia_kg_m2 + body.mass_kg * about(body.centre_m - centre_m);
        Self { mass_kg, centre_m, inertia_kg_m2: moved(self) + moved(other) }
    }
}

/// |d|² 1 − d dᵀ: the inertia of a unit mass at d.
fn about(d: Vector3<f64>) -> Matrix3<f64> {
    Matrix3::identity() * d.norm_squared() - d * d.transpose()
}
