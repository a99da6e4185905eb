//! A tool or a load on the robot: mass that the robot's description does not have.

use nalgebra::{Matrix3, Point3};

use super::Robot;
use super::body::{Body, NoBody};

/// A tool on a link, in the link's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// The link that carries it.
    pub link: usize,
    /// The tool.
    pub body: Body,
}

impl Tool {
    /// A tool of this mass, with its centre of mass in the link's frame and its inertia about it:
    /// ixx, iyy, izz, ixy, ixz, iyz. `None` without mass.
    ///
    /// # Errors
    /// [`NoBody`].
    pub fn new(link: usize, mass_kg: f64, centre_m: [f64; 3], inertia_kg_m2: [f64; 6]) -> Result<Option<Self>, NoBody> {
        let [xx, yy, zz, xy, xz, yz] = inertia_kg_m2;
        let inertia = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        Ok(Body::checked(mass_kg, Point3::from(centre_m), inertia)?.map(|body| Self { link, body }))
    }

    /// The robot with this tool on it.
    #[must_use]
    pub fn mounted_on(&self, robot: &Robot) -> Robot {
        let mut robot = robot.clone();
        let link = &mut robot.links[self.link];
        link.body = Some(link.body.map_or(self.body, |body| body.with(&self.body)));
        robot
    }
}
