//! Reading a robot from its URDF.
//!
//! `urdf-rs` reads the XML; here the links become a tree, and what no rigid-body model can have is refused with its
//! place. Shapes and meshes are not looked at. Joints of the types `floating`, `planar` and `spherical` are not
//! supported: an arm has none.

use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};

use super::body::Body;
use super::{Joint, Link, Mimic, Motion, Robot, Source};
use crate::input::{InputError, read_text};

/// Reads a robot from a file.
///
/// # Errors
/// The file cannot be read, is not a URDF, or describes no robot; with line and column where they are known.
pub fn read(path: &Path) -> Result<Robot, InputError> {
    parse(&path.display().to_string(), &read_text(path)?)
}

/// Reads a robot from the text of a URDF file; `file` is the name that errors give it.
///
/// # Errors
/// As [`read`].
pub fn parse(file: &str, text: &str) -> Result<Robot, InputError> {
    let reader = Reader { file, text };
    if let Some(at) = outside_comments(text, "<xacro:") {
        return Err(reader.refuse(
            at..at + "<xacro:".len(),
            "the file is a xacro template, not yet a URDF",
            "expand it first: `xacro robot.urdf.xacro > robot.urdf`",
        ));
    }
    let described = urdf_rs::read_from_string(text).map_err(|error| {
        InputError::whole(
            file,
            format!("is no URDF: {}", error.to_string().trim().replace('\n', " ")),
            "give a URDF file: <robot> with <link> and <joint> elements, each link with <inertial> (mass and inertia), \
             each <limit> with a velocity",
        )
    })?;
    reader.robot(&described)
}

/// Where something first stands that is not in a comment.
fn outside_comments(text: &str, what: &str) -> Option<usize> {
    let mut from = 0;
    loop {
        let at = from + text[from..].find(what)?;
        match text[from..at].find("<!--") {
            None => return Some(at),
            Some(opens) => from += opens + text[from + opens..].find("-->")? + "-->".len(),
        }
    }
}

/// Links that one warning names.
const NAMED: usize = 4;

struct Reader<'a> {
    file: &'a str,
    text: &'a str,
}

impl Reader<'_> {
    fn refuse(&self, place: Range<usize>, problem: impl Into<String>, remedy: impl Into<String>) -> InputError {
        InputError::at(self.file, self.text, place, problem, remedy)
    }

    /// The opening tag of the element with this name; `urdf-rs` does not say where it was.
    fn element(&self, tag: &str, name: &str) -> Range<usize> {
        let opening = format!("<{tag}");
        let mut from = 0;
        while let Some(at) = self.text[from..].find(&opening).map(|at| from + at) {
            let end = self.text[at..].find('>').map_or(self.text.len(), |end| at + end + 1);
            let found = &self.text[at..end];
            if [format!("name=\"{name}\""), format!("name='{name}'")].iter().any(|name| found.contains(name)) {
                return at..end;
            }
            from = at + opening.len();
        }
        0..0
    }

    fn robot(&self, described: &urdf_rs::Robot) -> Result<Robot, InputError> {
        let mut links: HashMap<&str, &urdf_rs::Link> = HashMap::new();
        for link in &described.links {
            if links.insert(&link.name, link).is_some() {
                return Err(self.refuse(
                    self.element("link", &link.name),
                    format!("two links are named `{}`", link.name),
                    "give every link a name of its own",
                ));
            }
        }
        let mut carried: HashMap<&str, &urdf_rs::Joint> = HashMap::new();
        for joint in &described.joints {
            for link in [&joint.parent.link, &joint.child.link] {
                if !links.contains_key(link.as_str()) {
                    return Err(self.refuse(
                        self.element("joint", &joint.name),
                        format!("joint `{}` names a link `{link}` that is not there", joint.name),
                        "add the link, or correct its name",
                    ));
                }
            }
            if let Some(other) = carried.insert(&joint.child.link, joint) {
                return Err(self.refuse(
                    self.element("joint", &joint.name),
                    format!("link `{}` hangs on two joints, `{}` and `{}`", joint.child.link, other.name, joint.name),
                    "a robot is a tree here; leave the joint out that closes the loop",
                ));
            }
        }
        let roots: Vec<&urdf_rs::Link> =
            described.links.iter().filter(|link| !carried.contains_key(link.name.as_str())).collect();
        let root = match roots[..] {
            [root] => root,
            [] => {
                return Err(InputError::whole(
                    self.file,
                    "no link is the base: every one hangs on a joint, or there is none",
                    "give a tree of links, one of which hangs on none",
                ));
            }
            [_, second, ..] => {
                let names: Vec<&str> = roots.iter().map(|link| link.name.as_str()).collect();
                return Err(self.refuse(
                    self.element("link", &second.name),
                    format!("{} links hang on no joint: {}", roots.len(), names.join(", ")),
                    "only the base does; join the others to the tree",
                ));
            }
        };

        let mut robot = Robot {
            name: if described.name.is_empty() { root.name.clone() } else { described.name.clone() },
            source: Source {
                file: self.file.to_owned(),
                crc32: crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(self.text.as_bytes()),
            },
            links: Vec::new(),
            joints: Vec::new(),
            warnings: Vec::new(),
        };
        // Depth first, children in the order of the file: a parent comes before its children.
        let mut impossible = Vec::new();
        let mut waiting: Vec<(&urdf_rs::Link, Option<(usize, &urdf_rs::Joint)>)> = vec![(root, None)];
        while let Some((link, hangs_on)) = waiting.pop() {
            let index = robot.links.len();
            let body = self.body(link)?;
            if body.is_some_and(|body| !body.is_possible()) {
                impossible.push(link.name.as_str());
            }
            let joint = hangs_on.map(|(parent, joint)| self.joint(joint, parent, index)).transpose()?;
            robot.links.push(Link {
                name: link.name.clone(),
                body,
                joint: joint.is_some().then_some(robot.joints.len()),
            });
            robot.joints.extend(joint);
            let children = described.joints.iter().filter(|joint| joint.parent.link == link.name).rev();
            waiting.extend(children.map(|joint| (links[joint.child.link.as_str()], Some((index, joint)))));
        }
        if robot.links.len() < described.links.len() {
            return Err(InputError::whole(
                self.file,
                "some links hang on each other in a ring",
                "a robot is a tree here; leave the joint out that closes the loop",
            ));
        }
        if !impossible.is_empty() {
            let more = impossible.len().saturating_sub(NAMED);
            let names = impossible[..impossible.len().min(NAMED)].join(", ");
            let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
            robot.warnings.push(format!(
                "{names}{rest}: an inertia that no body has (one principal moment exceeds the sum of the two others)"
            ));
        }
        self.followers(described, &mut robot)?;
        Ok(robot)
    }

    fn body(&self, link: &urdf_rs::Link) -> Result<Option<Body>, InputError> {
        let inertial = &link.inertial;
        let i = &inertial.inertia;
        let inertia = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
        let body = Body::checked(inertial.mass.value, Point3::origin(), inertia).map_err(|no| {
            self.refuse(
                self.element("link", &link.name),
                format!("link `{}` is no rigid body: {no}", link.name),
                "correct its <inertial>: a mass in kg and a positive inertia about the centre of mass in kg m²",
            )
        })?;
        let pose = pose(&inertial.origin);
        if !pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|number| number.is_finite()) {
            return Err(self.refuse(
                self.element("link", &link.name),
                format!("the centre of mass of link `{}` is not finite", link.name),
                "correct the <origin> of its <inertial>",
            ));
        }
        Ok(body.map(|body| body.seen_from(&pose)))
    }

    fn joint(&self, joint: &urdf_rs::Joint, parent: usize, child: usize) -> Result<Joint, InputError> {
        use urdf_rs::JointType;
        let place = || self.element("joint", &joint.name);
        let motion = match joint.joint_type {
            JointType::Fixed => Motion::Fixed,
            JointType::Revolute | JointType::Continuous => Motion::Turn,
            JointType::Prismatic => Motion::Slide,
            JointType::Floating | JointType::Planar | JointType::Spherical => {
                return Err(self.refuse(
                    place(),
                    format!("joint `{}` is of a type with several degrees of freedom", joint.name),
                    "write it as several joints of type revolute or prismatic, or fix it",
                ));
            }
        };
        let axis = Vector3::from(*joint.axis.xyz);
        let axis = match (motion, axis.try_normalize(1e-12)) {
            (Motion::Fixed, _) => Vector3::x(),
            (_, Some(axis)) if axis.iter().all(|number| number.is_finite()) => axis,
            _ => {
                return Err(self.refuse(
                    place(),
                    format!("the axis of joint `{}` has no length", joint.name),
                    "give it a direction, such as <axis xyz=\"0 0 1\"/>",
                ));
            }
        };
        let origin = pose(&joint.origin);
        if !origin.translation.vector.iter().chain(origin.rotation.coords.iter()).all(|number| number.is_finite()) {
            return Err(self.refuse(
                place(),
                format!("the origin of joint `{}` is not finite", joint.name),
                "correct its <origin>",
            ));
        }
        let limit = (joint.limit.lower, joint.limit.upper);
        // Without <limit>, urdf-rs says 0 and 0; no joint that moves has that range.
        let stated = limit.0 < limit.1 && joint.joint_type != JointType::Continuous;
        if limit.0 > limit.1 {
            return Err(self.refuse(
                place(),
                format!("the range of joint `{}` ends before it begins: {} to {}", joint.name, limit.0, limit.1),
                "lower must be below upper",
            ));
        }
        Ok(Joint {
            name: joint.name.clone(),
            motion,
            parent,
            child,
            origin,
            axis,
            range: (stated && motion != Motion::Fixed).then_some(limit),
            mimic: None,
        })
    }

    /// Resolves who follows whom to the joint that leads.
    fn followers(&self, described: &urdf_rs::Robot, robot: &mut Robot) -> Result<(), InputError> {
        let follows: HashMap<&str, &urdf_rs::Mimic> =
            described.joints.iter().filter_map(|joint| Some((joint.name.as_str(), joint.mimic.as_ref()?))).collect();
        for index in 0..robot.joints.len() {
            let name = robot.joints[index].name.clone();
            if robot.joints[index].motion == Motion::Fixed || !follows.contains_key(name.as_str()) {
                continue;
            }
            let (mut multiplier, mut offset, mut at) = (1.0, 0.0, name.as_str());
            for _ in 0..=follows.len() {
                let Some(mimic) = follows.get(at) else { break };
                offset += multiplier * mimic.offset.unwrap_or(0.0);
                multiplier *= mimic.multiplier.unwrap_or(1.0);
                at = &mimic.joint;
            }
            let leads = robot.joints.iter().position(|joint| joint.name == at);
            let leads = leads.filter(|&joint| robot.joints[joint].motion != Motion::Fixed && !follows.contains_key(at));
            let Some(joint) = leads else {
                return Err(self.refuse(
                    self.element("joint", &name),
                    format!("joint `{name}` follows `{at}`, which is no joint that leads"),
                    "let it follow a joint that moves and does not follow another",
                ));
            };
            robot.joints[index].mimic = Some(Mimic { joint, multiplier, offset });
        }
        Ok(())
    }
}

/// Fixed axes: first roll about x, then pitch about y, then yaw about z.
fn pose(pose: &urdf_rs::Pose) -> Isometry3<f64> {
    let [roll, pitch, yaw] = *pose.rpy;
    Isometry3::from_parts(
        Translation3::from(Vector3::from(*pose.xyz)),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}
