//! An effective mass with all that it belongs to: what is written to files and handed on.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::Robot;
use super::contact::{Contact, Frame, Orientation};
use super::posture::Posture;
use super::tool::Tool;

/// Where the masses of a model come from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModelSource {
    /// The robot's name in its description.
    pub robot: String,
    /// File of the description.
    pub file: String,
    /// CRC-32 of that file, eight hexadecimal digits.
    pub crc32: String,
}

/// A tool, as it was given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StatedTool {
    /// The link that carries it.
    pub link: String,
    /// Mass.
    pub mass_kg: f64,
    /// Centre of mass in the link's frame.
    pub centre_m: [f64; 3],
    /// Inertia about it: ixx, iyy, izz, ixy, ixz, iyz.
    #[serde(rename = "inertia_kg_m2")]
    pub inertia_kg_m2: [f64; 6],
}

/// A joint and its value, rad or m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StatedJoint {
    /// Name.
    pub joint: String,
    /// Value.
    pub value: f64,
    /// `rad` or `m`.
    pub unit: String,
}

/// What a value of the effective mass belongs to, the posture apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// The masses' source.
    pub model: ModelSource,
    /// The link that is hit.
    pub link: String,
    /// Where, in the link's frame.
    pub point_m: [f64; 3],
    /// Unit vector, in the axes of `frame`.
    pub direction: [f64; 3],
    /// In whose axes it is.
    pub frame: Frame,
    /// What is held.
    pub orientation: Orientation,
    /// Tool on the robot.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub tool: Option<StatedTool>,
}

impl Setting {
    /// What values at this contact belong to.
    #[must_use]
    pub fn new(robot: &Robot, contact: &Contact, orientation: Orientation, tool: Option<&Tool>) -> Self {
        let tool = tool.map(|tool| {
            let i = tool.body.inertia_kg_m2;
            StatedTool {
                link: robot.links[tool.link].name.clone(),
                mass_kg: tool.body.mass_kg,
                centre_m: tool.body.centre_m.into(),
                inertia_kg_m2: [i.m11, i.m22, i.m33, i.m12, i.m13, i.m23],
            }
        });
        Self {
            model: ModelSource {
                robot: robot.name.clone(),
                file: robot.source.file.clone(),
                crc32: format!("{:08x}", robot.source.crc32),
            },
            link: robot.links[contact.link].name.clone(),
            point_m: contact.point_m.into(),
            direction: contact.direction.into_inner().into(),
            frame: contact.frame,
            orientation,
            tool,
        }
    }
}

/// One value with all that it belongs to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Flat")]
pub struct StatedMass {
    /// The value.
    pub effective_mass_kg: f64,
    /// Where it comes from and what it is for.
    #[serde(flatten)]
    pub setting: Setting,
    /// Contact point in the base's frame.
    pub point_in_base_m: [f64; 3],
    /// Direction in the base's frame.
    pub direction_in_base: [f64; 3],
    /// The posture: joints that give way.
    pub joints: Vec<StatedJoint>,
    /// Joints that were given no value and stand still.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub locked: Vec<StatedJoint>,
}

/// As it is read: flattened by hand, for `flatten` cannot read numbers where serde_json keeps them exactly as written, which a build
/// with the emulator's log decoder does.
#[derive(Deserialize)]
struct Flat {
    effective_mass_kg: f64,
    model: ModelSource,
    link: String,
    point_m: [f64; 3],
    direction: [f64; 3],
    frame: Frame,
    orientation: Orientation,
    #[serde(default)]
    tool: Option<StatedTool>,
    point_in_base_m: [f64; 3],
    direction_in_base: [f64; 3],
    joints: Vec<StatedJoint>,
    #[serde(default)]
    locked: Vec<StatedJoint>,
}

impl From<Flat> for StatedMass {
    fn from(flat: Flat) -> Self {
        let Flat { model, link, point_m, direction, frame, orientation, tool, .. } = flat;
        Self {
            effective_mass_kg: flat.effective_mass_kg,
            setting: Setting { model, link, point_m, direction, frame, orientation, tool },
            point_in_base_m: flat.point_in_base_m,
            direction_in_base: flat.direction_in_base,
            joints: flat.joints,
            locked: flat.locked,
        }
    }
}

impl StatedMass {
    /// A value in its posture.
    #[must_use]
    pub fn new(
        robot: &Robot,
        posture: &Posture,
        setting: Setting,
        effective_mass_kg: f64,
        point: &Point3<f64>,
        direction: &Vector3<f64>,
    ) -> Self {
        let stated = |joint: &usize| StatedJoint {
            joint: robot.joints[*joint].name.clone(),
            value: posture.values[*joint],
            unit: robot.joints[*joint].motion.unit().to_owned(),
        };
        Self {
            effective_mass_kg,
            setting,
            point_in_base_m: (*point).into(),
            direction_in_base: (*direction).into(),
            joints: posture.free.iter().map(stated).collect(),
            locked: posture.locked.iter().map(stated).collect(),
        }
    }
}
