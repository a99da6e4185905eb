//! Where a robot touches, in which direction, and what the rest of its motion does meanwhile.

use nalgebra::{Isometry3, Point3, Unit, Vector3};
use serde::{Deserialize, Serialize};

/// In whose axes a direction is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Frame {
    /// The base's.
    #[default]
    Base,
    /// The link's that is hit.
    Link,
}

impl Frame {
    /// All frames.
    pub const ALL: [Self; 2] = [Self::Base, Self::Link];

    /// The name that the command line and files use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Base => "base",
            Self::Link => "link",
        }
    }
}

/// What holds the body that is hit, beside its own inertia.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Orientation {
    /// Nothing: it turns and evades as the blow makes it. Equation 8 of the paper.
    #[default]
    Free,
    /// It keeps its orientation and its path: it goes along the direction and nowhere else.
    Held,
    /// It keeps its orientation, but may evade sideways.
    HeldYielding,
}

impl Orientation {
    /// All.
    pub const ALL: [Self; 3] = [Self::Free, Self::Held, Self::HeldYielding];

    /// The name that the command line and files use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Held => "held",
            Self::HeldYielding => "held-yielding",
        }
    }
}

/// A contact with a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// The link that is hit.
    pub link: usize,
    /// Where, in the link's frame, m.
    pub point_m: Point3<f64>,
    /// Along which direction.
    pub direction: Unit<Vector3<f64>>,
    /// In whose axes the direction is.
    pub frame: Frame,
}

impl Contact {
    /// Point and direction in the base's frame, with these poses of the links.
    #[must_use]
    pub fn in_base(&self, poses: &[Isometry3<f64>]) -> (Point3<f64>, Unit<Vector3<f64>>) {
        let pose = &poses[self.link];
        let direction = match self.frame {
            Frame::Base => self.direction,
            Frame::Link => pose.rotation * self.direction,
        };
        (pose * self.point_m, direction)
    }
}

/// A direction from three numbers.
///
/// # Errors
/// Says why there is none: a length of zero, or numbers that are not finite.
pub fn direction(x: f64, y: f64, z: f64) -> Result<Unit<Vector3<f64>>, &'static str> {
    let vector = Vector3::new(x, y, z);
    if !vector.iter().all(|number| number.is_finite()) {
        return Err("the direction has a number that is not finite");
    }
    // Shorter vectors than any that a person means lose their digits in the division.
    Unit::try_new(vector, 1e-12).ok_or("the direction has no length")
}
