//! A robot as a tree of rigid bodies, and how heavy it is where it touches somebody.
//!
//! ```text
//! URDF ─▶ description ─▶ Robot ─┬─▶ posture (joint values, checked) ─▶ pose of every link
//!                               ├─▶ joint_inertia  M(q), by composite rigid bodies
//!                               ├─▶ jacobian       J(q) of the contact point
//!                               └─▶ effective_mass 1/m = nᵀ J M⁻¹ Jᵀ n,  beside it iso_estimate and lumped
//! ```
//!
//! The effective mass m_R is what a push at the contact point along n feels (Khatib 1995). It belongs to a posture, a
//! point, a direction, a model of the masses and to what happens to the rest of the body (`Orientation`), so a bare
//! number is never handed on: [`stated::StatedMass`] carries all of it.
//!
//! Everything here is in metres, kilograms and radians; `base` is the frame of the tree's root link.

use nalgebra::{Isometry3, Vector3};

pub mod body;
pub mod contact;
pub mod description;
pub mod effective_mass;
pub mod elastic_arm;
pub mod iso_estimate;
pub mod jacobian;
pub mod joint_inertia;
pub mod lumped;
pub mod posture;
pub mod stated;
pub mod stream;
#[cfg(test)]
mod tests;
pub mod tool;
pub mod trajectory;

use body::Body;

/// A tree of links; a link comes after its parent.
#[derive(Clone, Debug)]
pub struct Robot {
    /// As its description calls it.
    pub name: String,
    /// Where the description comes from.
    pub source: Source,
    /// The links; the first is the base.
    pub links: Vec<Link>,
    /// The joints; joint `j` moves link `joints[j].child`.
    pub joints: Vec<Joint>,
    /// What is odd in the description but can be worked with, one sentence each.
    pub warnings: Vec<String>,
}

/// Where a description comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// The file, as it was named.
    pub file: String,
    /// CRC-32 of its text (ISO-HDLC, as zip has it), so that another revision is noticed.
    pub crc32: u32,
}

/// One link of the tree.
#[derive(Clone, Debug)]
pub struct Link {
    /// Name.
    pub name: String,
    /// Its mass in its own frame; `None` where the description has no inertia for it, or zero.
    pub body: Option<Body>,
    /// The joint that carries it; `None` for the base.
    pub joint: Option<usize>,
}

/// A joint between two links.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Name.
    pub name: String,
    /// How it moves.
    pub motion: Motion,
    /// Link it is fixed to.
    pub parent: usize,
    /// Link it carries.
    pub child: usize,
    /// The child's frame in the parent's, at 0.
    pub origin: Isometry3<f64>,
    /// Unit vector in the child's frame: the axis of a turn, or the way of a slide.
    pub axis: Vector3<f64>,
    /// Lowest and highest value, rad or m, where the description states them.
    pub range: Option<(f64, f64)>,
    /// It follows another joint.
    pub mimic: Option<Mimic>,
}

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Not at all.
    Fixed,
    /// It turns about its axis, rad.
    Turn,
    /// It slides along its axis, m.
    Slide,
}

impl Motion {
    /// The unit of the joint's value.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Fixed => "",
            Self::Turn => "rad",
            Self::Slide => "m",
        }
    }
}

/// A joint that follows another: value = multiplier · other + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mimic {
    /// The other joint.
    pub joint: usize,
    /// How far it goes with the other.
    pub multiplier: f64,
    /// Its value where the other is at 0.
    pub offset: f64,
}

impl Robot {
    /// The link with this name.
    #[must_use]
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// The joints that have a value of their own, in the order of the tree: neither fixed nor following another.
    #[must_use]
    pub fn movable(&self) -> Vec<usize> {
        (0..self.joints.len())
            .filter(|&joint| self.joints[joint].motion != Motion::Fixed && self.joints[joint].mimic.is_none())
            .collect()
    }

    /// The joints between base and link, from the base on, fixed ones too.
    #[must_use]
    pub fn way_to(&self, link: usize) -> Vec<usize> {
        let mut way = Vec::new();
        let mut at = link;
        while let Some(joint) = self.links[at].joint {
            way.push(joint);
            at = self.joints[joint].parent;
        }
        way.reverse();
        way
    }

    /// Whether some joint moves this link.
    #[must_use]
    pub fn moves(&self, link: usize) -> bool {
        self.way_to(link).iter().any(|&joint| self.joints[joint].motion != Motion::Fixed)
    }

    /// Whether a joint that moves lies behind this link.
    #[must_use]
    pub fn has_joints_behind(&self, link: usize) -> bool {
        self.joints.iter().any(|joint| joint.motion != Motion::Fixed && self.is_behind(joint.child, link))
    }

    /// Whether one link is carried by another, and is not that link itself.
    fn is_behind(&self, link: usize, carrier: usize) -> bool {
        self.way_to(link).iter().any(|&joint| self.joints[joint].parent == carrier)
    }

    /// M of ISO/TS 15066: the mass of all parts that move, kg.
    #[must_use]
    pub fn moving_mass_kg(&self) -> f64 {
        (0..self.links.len())
            .filter(|&link| self.moves(link))
            .filter_map(|link| self.links[link].body.map(|body| body.mass_kg))
            .sum()
    }

    /// Moving links without inertia, those apart that are mere frames: carried by a fixed joint.
    #[must_use]
    pub fn without_inertia(&self) -> Vec<&str> {
        self.links
            .iter()
            .filter(|link| link.body.is_none())
            .filter(|link| link.joint.is_some_and(|joint| self.joints[joint].motion != Motion::Fixed))
            .map(|link| link.name.as_str())
            .collect()
    }
}
