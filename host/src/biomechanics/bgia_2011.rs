//! The fifteen regions of the BG/BGIA recommendations of 2011: the table from before ISO/TS 15066.
//!
//! Never mixed with the newer one: its regions are divided otherwise, its impact forces are not twice its clamping
//! forces, its pressures are a fraction of the newer ones, and it has no body masses. The sensor's profile `bgia-2011`
//! takes its forces for the twelve regions (the module
//! [`thud_firmware::limits`] says which row stands for which). As reproduced in public sources.

use thud_firmware::limits::Region;

/// A row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The region in that table's words.
    pub name: &'static str,
    /// Clamping or squeezing force, N.
    pub clamping_n: f64,
    /// Impact force as printed, N. For skull and face thud gives no permission by it.
    pub impact_n: f64,
    /// Pressure, N/cm².
    pub pressure_n_per_cm2: f64,
    /// Stiffness, N/mm.
    pub stiffness_n_per_mm: f64,
    /// The region of the newer table for which the sensor takes this row.
    pub stands_for: Option<Region>,
}

const fn row(name: &'static str, numbers: [f64; 4], stands_for: Option<Region>) -> Row {
    let [clamping_n, impact_n, pressure_n_per_cm2, stiffness_n_per_mm] = numbers;
    Row { name, clamping_n, impact_n, pressure_n_per_cm2, stiffness_n_per_mm, stands_for }
}

/// The table.
pub const ROWS: [Row; 15] = [
    row("skull", [130.0, 175.0, 30.0, 150.0], Some(Region::Skull)),
    row("face", [65.0, 90.0, 20.0, 75.0], Some(Region::Face)),
    row("neck, side", [145.0, 190.0, 50.0, 50.0], Some(Region::Neck)),
    row("larynx", [35.0, 35.0, 10.0, 10.0], None),
    row("back", [210.0, 250.0, 70.0, 35.0], Some(Region::Back)),
    row("chest", [140.0, 210.0, 45.0, 25.0], Some(Region::Chest)),
    row("belly", [110.0, 160.0, 35.0, 10.0], Some(Region::Abdomen)),
    row("pelvis", [180.0, 250.0, 75.0, 25.0], Some(Region::Pelvis)),
    row("buttocks", [210.0, 250.0, 80.0, 15.0], None),
    row("upper arm", [150.0, 190.0, 50.0, 30.0], Some(Region::UpperArm)),
    row("forearm", [160.0, 220.0, 50.0, 40.0], Some(Region::LowerArm)),
    row("hand", [135.0, 180.0, 60.0, 75.0], Some(Region::Hand)),
    row("thigh", [220.0, 250.0, 80.0, 50.0], Some(Region::Thigh)),
    row("lower leg", [140.0, 170.0, 45.0, 60.0], Some(Region::LowerLeg)),
    row("feet", [125.0, 160.0, 45.0, 75.0], None),
];

impl Row {
    /// The impact force that thud permits by this row; `None` for skull and face.
    #[must_use]
    pub fn permitted_impact_n(&self) -> Option<f64> {
        (!matches!(self.stands_for, Some(Region::Skull | Region::Face))).then_some(self.impact_n)
    }
}
