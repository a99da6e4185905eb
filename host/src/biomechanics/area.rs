//! The 29 body areas of ISO/TS 15066:2016, table A.2, with their pressures.
//!
//! The force limit of a region holds for the whole contact; the pressure limit of an area for wherever it is highest.
//! Transient pressures are twice the quasi-static ones, except on skull and face, where transient contact is not
//! permitted at all. Reproduced from public sources, not checked against the printed standard; the palm of the
//! non-dominant hand (23) is from memory of one source and marked so.

use thud_firmware::limits::Region;

/// A body area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// Number in the standard, 1 to 29.
    pub number: u8,
    /// The name that the command line and files use; `-d` is the dominant side of the body, `-nd` the other.
    pub name: &'static str,
    /// The region it belongs to.
    pub region: Region,
    /// Largest quasi-static pressure, N/cm².
    pub quasi_static_n_per_cm2: f64,
    /// The value was found in one source only.
    pub unverified: bool,
}

/// Transient over quasi-static, for pressure as for force.
pub const TRANSIENT_FACTOR: f64 = 2.0;

const fn area(number: u8, name: &'static str, region: Region, quasi_static_n_per_cm2: f64) -> Area {
    Area { number, name, region, quasi_static_n_per_cm2, unverified: false }
}

/// All areas, in the standard's order.
pub const AREAS: [Area; 29] = [
    area(1, "middle-of-forehead", Region::Skull, 130.0),
    area(2, "temple", Region::Skull, 110.0),
    area(3, "masticatory-muscle", Region::Face, 110.0),
    area(4, "neck-muscle", Region::Neck, 140.0),
    area(5, "seventh-neck-muscle", Region::Neck, 210.0),
    area(6, "shoulder-joint", Region::Back, 160.0),
    area(7, "fifth-lumbar-vertebra", Region::Back, 210.0),
    area(8, "sternum", Region::Chest, 120.0),
    area(9, "pectoral-muscle", Region::Chest, 170.0),
    area(10, "abdominal-muscle", Region::Abdomen, 140.0),
    area(11, "pelvic-bone", Region::Pelvis, 210.0),
    area(12, "deltoid-muscle", Region::UpperArm, 190.0),
    area(13, "humerus", Region::UpperArm, 220.0),
    area(14, "radial-bone", Region::LowerArm, 190.0),
    area(15, "forearm-muscle", Region::LowerArm, 180.0),
    area(16, "arm-nerve", Region::LowerArm, 180.0),
    area(17, "forefinger-pad-d", Region::Hand, 300.0),
    area(18, "forefinger-pad-nd", Region::Hand, 270.0),
    area(19, "forefinger-end-joint-d", Region::Hand, 280.0),
    area(20, "forefinger-end-joint-nd", Region::Hand, 220.0),
    area(21, "thenar-eminence", Region::Hand, 200.0),
    area(22, "palm-d", Region::Hand, 260.0),
    Area { unverified: true, ..area(23, "palm-nd", Region::Hand, 260.0) },
    area(24, "back-of-hand-d", Region::Hand, 200.0),
    area(25, "back-of-hand-nd", Region::Hand, 190.0),
    area(26, "thigh-muscle", Region::Thigh, 250.0),
    area(27, "kneecap", Region::Thigh, 220.0),
    area(28, "middle-of-shin", Region::LowerLeg, 220.0),
    area(29, "calf-muscle", Region::LowerLeg, 210.0),
];

impl Area {
    /// The area with this name or number, if there is one.
    #[must_use]
    pub fn find(word: &str) -> Option<&'static Self> {
        AREAS.iter().find(|area| area.name == word || area.number.to_string() == word)
    }

    /// The areas of a region.
    pub fn of(region: Region) -> impl Iterator<Item = &'static Self> {
        AREAS.iter().filter(move |area| area.region == region)
    }

    /// Largest transient pressure, N/cm²; `None` where transient contact is not permitted.
    #[must_use]
    pub fn transient_n_per_cm2(&self) -> Option<f64> {
        let permitted = !matches!(self.region, Region::Skull | Region::Face);
        permitted.then_some(TRANSIENT_FACTOR * self.quasi_static_n_per_cm2)
    }
}
