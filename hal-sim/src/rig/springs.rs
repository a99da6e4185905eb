//! Which springs and which pad stand for a body region.
//!
//! Three equal springs stand at the vertices of a triangle and one in its middle, chosen from four kinds, so the
//! rig's stiffness is K = 3·vertex + centre. Swapping the two kinds gives another K (25 becomes 15, 60 becomes
//! 120 N/mm): a fitted K on a wrong 3a + b is a wrongly assembled rig.
//!
//! Source: paper 1, section 3.1; the split for each K computed from it.

use thud_firmware::limits::Region;

/// The kinds of spring, N/m.
pub const SPRINGS_N_PER_M: [f64; 4] = [2_500.0, 7_500.0, 12_500.0, 37_500.0];

/// Three springs at the vertices and one in the middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringSet {
    /// Each of the three, N/m.
    pub vertex_n_per_m: f64,
    /// The one, N/m.
    pub centre_n_per_m: f64,
}

impl SpringSet {
    /// Together, N/m.
    #[must_use]
    pub fn stiffness_n_per_m(self) -> f64 {
        3.0 * self.vertex_n_per_m + self.centre_n_per_m
    }

    /// The same four springs assembled the wrong way: vertex and centre kinds exchanged.
    #[must_use]
    pub fn swapped(self) -> Self {
        Self { vertex_n_per_m: self.centre_n_per_m, centre_n_per_m: self.vertex_n_per_m }
    }

    /// Every set that the four kinds allow, by vertex, then centre.
    pub fn all() -> impl Iterator<Item = Self> {
        SPRINGS_N_PER_M.into_iter().flat_map(|vertex_n_per_m| {
            SPRINGS_N_PER_M.into_iter().map(move |centre_n_per_m| Self { vertex_n_per_m, centre_n_per_m })
        })
    }

    /// The sets whose stiffness is within a relative tolerance of a measured one, nearest first.
    #[must_use]
    pub fn near(stiffness_n_per_m: f64, relative_tolerance: f64) -> Vec<Self> {
        let distance = |set: &Self| (set.stiffness_n_per_m() / stiffness_n_per_m - 1.0).abs();
        let mut sets: Vec<Self> = Self::all().filter(|set| distance(set) <= relative_tolerance).collect();
        sets.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        sets
    }
}

/// The springs for a body region.
#[must_use]
pub fn spring_set_of(region: Region) -> SpringSet {
    let (vertex, centre) = match region {
        Region::Abdomen => (0, 0),
        Region::Chest | Region::Pelvis => (1, 0),
        Region::UpperArm => (1, 1),
        Region::Back => (1, 2),
        Region::LowerArm => (2, 0),
        Region::Neck | Region::Thigh => (2, 2),
        Region::LowerLeg => (1, 3),
        Region::Face | Region::Hand => (2, 3),
        Region::Skull => (3, 3),
    };
    SpringSet { vertex_n_per_m: SPRINGS_N_PER_M[vertex], centre_n_per_m: SPRINGS_N_PER_M[centre] }
}

/// A compliant layer on the impact piece.
///
/// Hardness and thickness are paper 1's; the stiffness follows from Gent's relation of Young's modulus to Shore A
/// hardness, over the tolerance of the hardness and the uncertain area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pad {
    /// Material and hardness.
    pub name: &'static str,
    /// Hardness, Shore A.
    pub shore_a: f64,
    /// Thickness, m.
    pub thickness_m: f64,
    /// Smallest and largest stiffness to be expected, N/m.
    pub stiffness_n_per_m: (f64, f64),
}

impl Pad {
    /// The stiffness to begin with, N/m: the geometric mean of the range.
    #[must_use]
    pub fn typical_stiffness_n_per_m(&self) -> f64 {
        (self.stiffness_n_per_m.0 * self.stiffness_n_per_m.1).sqrt()
    }
}

/// Polyurethane A70, 7 mm: hard regions.
pub const PAD_A70: Pad =
    Pad { name: "polyurethane A70", shore_a: 70.0, thickness_m: 0.007, stiffness_n_per_m: (615e3, 2170e3) };
/// Polyurethane A30, 14 mm: medium regions.
pub const PAD_A30: Pad =
    Pad { name: "polyurethane A30", shore_a: 30.0, thickness_m: 0.014, stiffness_n_per_m: (64e3, 104e3) };
/// Silicone A10, 21 mm: soft regions.
pub const PAD_A10: Pad =
    Pad { name: "silicone A10", shore_a: 10.0, thickness_m: 0.021, stiffness_n_per_m: (15e3, 20e3) };

/// The pad for a body region. Which region takes which is recalled from the standard's text and not verified.
#[must_use]
pub fn pad_of(region: Region) -> Pad {
    match region {
        Region::Skull | Region::Face | Region::Neck | Region::LowerArm | Region::Hand | Region::LowerLeg => PAD_A70,
        Region::Back | Region::Chest | Region::Pelvis | Region::UpperArm | Region::Thigh => PAD_A30,
        Region::Abdomen => PAD_A10,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_springs_of_every_region_give_its_stiffness() {
        for region in Region::ALL {
            let wanted = f64::from(region.body().stiffness.0);
            assert_eq!(spring_set_of(region).stiffness_n_per_m(), wanted, "{region:?}");
        }
    }

    #[test]
    fn swapped_springs_are_recognised_by_their_stiffness() {
        let swapped = |region| spring_set_of(region).swapped().stiffness_n_per_m();
        assert_eq!(swapped(Region::Chest), 15_000.0);
        assert_eq!(swapped(Region::LowerLeg), 120_000.0);
        assert!(SpringSet::near(15_100.0, 0.02).contains(&spring_set_of(Region::Chest).swapped()));
        assert!(SpringSet::near(19_000.0, 0.02).is_empty());
    }
}
