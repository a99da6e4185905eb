//! From forces to a verdict.
//!
//! ```text
//! S = √(m_H / (m_H + m_R))          scaled = S · transient, for a free contact only
//! U = √((u·F)² + (2σ)²)             F + U < limit: pass     F − U > limit: fail     else inconclusive
//! x = F/K,  E = F²/2K               body spring only; the rig's pad is never credited
//! ```
//!
//! S turns the reading of a fixed rig into the force on a body that can recoil (ISO/PAS 5672). It is applied to the transient
//! peak of a free contact and to nothing else: not to a clamped body, not to the quasi-static force, not to skull and face, and it is
//! never clamped. The scaled and the unscaled force stand side by side.
//!
//! **What holds a static force.** A piezo chain forgets: after a held time t it reads e^(−t/τ) of the force, and its −5 % point is
//! f = 0.484/τ. A quasi-static verdict is given only while the droop is at most 5 % (the figure by which the cells
//! themselves are specified), τ ≥ 19.5·t; the −5 % point then lies at 0.025/t, a period of forty times the hold. The droop that
//! remains is added to the uncertainty.

use crate::configuration::{Configuration, ContactKind};
use crate::event::{Flags, Severity, Verdict};
use crate::limits::{Region, TransientLimit};
use crate::units::{Joule, Kilogram, Metre, Newton, Second};

/// Largest droop of a held force with which it is still judged.
pub const LARGEST_DROOP: f32 = 0.05;

/// What was measured of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Largest filtered force in the transient window.
    pub transient: Newton,
    /// Largest filtered force after it, where the contact was held.
    pub quasi_static: Option<Newton>,
    /// How long it was held.
    pub held: Second,
    /// Filtered peak of the contact itself, for stroke and energy.
    pub peak: Newton,
    /// Noise, root mean square.
    pub noise: Newton,
    /// Effective mass of the robot, with its age in ms where it was received.
    pub effective_mass: Option<(Kilogram, Option<u32>)>,
}

/// S = √(m_H / (m_H + m_R)), to half a unit in the last place of `f32` (1e-7).
#[must_use]
pub fn scaling(body: Kilogram, robot: Kilogram) -> f32 {
    libm::sqrtf(body.0 / (body.0 + robot.0))
}

/// Share of a held force that a chain has lost after a time.
#[must_use]
pub fn droop(held: Second, time_constant: Second) -> f32 {
    -libm::expm1f(-held.0 / time_constant.0)
}

/// Judges a contact. Returns the severity and the flags with what judging adds to them.
#[must_use]
pub fn judge(measured: &Measured, configuration: &Configuration, flags: Flags) -> (Severity, Flags) {
    let mut flags = flags;
    let lost = droop(measured.held, configuration.chain.time_constant);
    // Not a number is not a chain that can hold.
    let holds = lost <= LARGEST_DROOP;
    let quasi_static = if holds { measured.quasi_static } else { None };
    flags.set(Flags::NO_QUASI_STATIC, measured.quasi_static.is_some() && !holds);

    let mut severity = Severity {
        verdict: Verdict::None,
        transient: measured.transient,
        scaling: 1.0,
        scaled: measured.transient,
        quasi_static,
        transient_limit: None,
        quasi_static_limit: None,
        effective_mass: measured.effective_mass.map(|(mass, _)| mass),
        effective_mass_age_ms: measured.effective_mass.and_then(|(_, age)| age),
        expanded_uncertainty: Newton::ZERO,
        stroke: Metre(measured.peak.0 / configuration.body_stiffness.0),
        energy: Joule(0.5 * measured.peak.0 * measured.peak.0 / configuration.body_stiffness.0),
    };
    let uncertainty = |force: Newton, relative: f32| {
        let (relative, noise) = (relative * force.0, 2.0 * measured.noise.0);
        Newton(libm::sqrtf(relative * relative + noise * noise))
    };
    if let Some(region) = configuration.region {
        let limits = configuration.limits.limits(region);
        severity.quasi_static_limit = Some(limits.quasi_static);
        if scales(configuration.contact, region)
            && let Some((mass, _)) = measured.effective_mass
        {
            severity.scaling = scaling(region.body().effective_mass, mass);
            severity.scaled = Newton(severity.scaling * measured.transient.0);
        }
        severity.expanded_uncertainty = uncertainty(severity.scaled, configuration.relative_uncertainty);
        severity.verdict = match limits.transient {
            TransientLimit::NotPermitted => {
                flags |= Flags::NOT_PERMITTED;
                Verdict::Fail
            }
            TransientLimit::UpTo(limit) => {
                severity.transient_limit = Some(limit);
                let transient = compare(severity.scaled, severity.expanded_uncertainty, limit);
                let held = quasi_static.map_or(Verdict::Pass, |force| {
                    let guard = uncertainty(force, configuration.relative_uncertainty + lost);
                    compare(force, guard, limits.quasi_static)
                });
                // A held contact whose static force the chain cannot tell has not passed.
                let held = if flags.contains(Flags::NO_QUASI_STATIC) { Verdict::Inconclusive } else { held };
                trusted(worse(transient, held), flags)
            }
        };
    } else {
        severity.expanded_uncertainty = uncertainty(severity.scaled, configuration.relative_uncertainty);
    }
    (severity, flags)
}

/// Whether S applies: the body can recoil, and it is neither skull nor face.
fn scales(contact: ContactKind, region: Region) -> bool {
    contact == ContactKind::Free && !matches!(region, Region::Skull | Region::Face)
}

fn compare(force: Newton, uncertainty: Newton, limit: Newton) -> Verdict {
    if force.0 + uncertainty.0 < limit.0 {
        Verdict::Pass
    } else if force.0 - uncertainty.0 > limit.0 {
        Verdict::Fail
    } else {
        Verdict::Inconclusive
    }
}

fn worse(one: Verdict, other: Verdict) -> Verdict {
    if (one as u8) > (other as u8) { one } else { other }
}

/// What a verdict is worth when the curve or its interpretation is touched: clipping and a cut-off end only ever hide force,
/// so beyond them a failure is still a failure; everything else is inconclusive.
fn trusted(verdict: Verdict, flags: Flags) -> Verdict {
    let void = flags.intersection(Flags::VOID);
    let hides_force_only = (Flags::CLIPPED | Flags::TRUNCATED).contains(void);
    if void.is_empty() || (verdict == Verdict::Fail && hides_force_only) { verdict } else { Verdict::Inconclusive }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::limits::LimitsProfile;

    fn configuration(region: Region, contact: ContactKind) -> Configuration {
        Configuration { region: Some(region), contact, ..Configuration::DEFAULT }
    }

    fn measured(transient: f32) -> Measured {
        Measured {
            transient: Newton(transient),
            quasi_static: None,
            held: Second(0.1),
            peak: Newton(transient),
            noise: Newton(0.3),
            effective_mass: Some((Kilogram(6.1), None)),
        }
    }

    /// Column S of the check values at 6.1 and 12.8 kg.
    #[test]
    fn scaling_matches_the_published_check_values() {
        for (region, light, heavy) in [
            (Region::Neck, 0.41, 0.29),
            (Region::Back, 0.93, 0.87),
            (Region::UpperArm, 0.57, 0.44),
            (Region::LowerArm, 0.50, 0.37),
            (Region::Hand, 0.30, 0.21),
            (Region::Thigh, 0.96, 0.92),
        ] {
            let body = region.body().effective_mass;
            assert!((scaling(body, Kilogram(6.1)) - light).abs() < 0.0051, "{}", region.name());
            assert!((scaling(body, Kilogram(12.8)) - heavy).abs() < 0.0051, "{}", region.name());
        }
    }

    #[test]
    fn stroke_and_energy_match_the_published_check_values() {
        for (region, millimetres, joule) in
            [(Region::Chest, 11.2, 1.57), (Region::Hand, 3.7, 0.52), (Region::LowerLeg, 4.3, 0.56)]
        {
            let TransientLimit::UpTo(limit) = LimitsProfile::IsoTs15066.limits(region).transient else { panic!() };
            let mut configuration = configuration(region, ContactKind::Free);
            configuration.body_stiffness = region.body().stiffness;
            let (severity, _) = judge(&measured(limit.0), &configuration, Flags::empty());
            assert!((severity.stroke.0 * 1000.0 - millimetres).abs() < 0.051, "{} mm", severity.stroke.0 * 1000.0);
            assert!((severity.energy.0 - joule).abs() < 0.0051, "{} J", severity.energy.0);
        }
    }

    #[test]
    fn the_guard_band_lies_on_both_sides() {
        let clamped = configuration(Region::Chest, ContactKind::Clamped);
        for (force, verdict) in [
            (270.0, Verdict::Pass),
            (273.0, Verdict::Inconclusive),
            (288.0, Verdict::Inconclusive),
            (290.0, Verdict::Fail),
        ] {
            assert_eq!(judge(&measured(force), &clamped, Flags::empty()).0.verdict, verdict, "{force} N");
        }
    }

    #[test]
    fn only_a_free_transient_is_scaled() {
        let held = Measured { quasi_static: Some(Newton(100.0)), held: Second(1.0), ..measured(200.0) };
        let (free, _) = judge(&held, &configuration(Region::Hand, ContactKind::Free), Flags::empty());
        assert!((free.scaled.0 - 200.0 * free.scaling).abs() < 1e-4 && free.scaling < 0.31);
        assert_eq!(free.quasi_static, Some(Newton(100.0)));
        let (clamped, _) = judge(&held, &configuration(Region::Hand, ContactKind::Clamped), Flags::empty());
        assert_eq!((clamped.scaling, clamped.scaled), (1.0, Newton(200.0)));
        let (face, flags) = judge(&held, &configuration(Region::Face, ContactKind::Free), Flags::empty());
        assert_eq!((face.scaling, face.verdict, face.transient_limit), (1.0, Verdict::Fail, None));
        assert!(flags.contains(Flags::NOT_PERMITTED));
    }

    #[test]
    fn a_chain_that_forgets_gives_no_quasi_static_verdict() {
        let mut configuration = configuration(Region::Chest, ContactKind::Clamped);
        configuration.chain.time_constant = Second(1.59);
        let held = Measured { quasi_static: Some(Newton(50.0)), held: Second(0.5), ..measured(60.0) };
        let (severity, flags) = judge(&held, &configuration, Flags::empty());
        assert_eq!((severity.quasi_static, severity.verdict), (None, Verdict::Inconclusive));
        assert!(flags.contains(Flags::NO_QUASI_STATIC));
        // −27 % at 0.5 s, −47 % at 1 s: the published check values.
        assert!((droop(Second(0.5), Second(1.59)) - 0.27).abs() < 0.005);
        assert!((droop(Second(1.0), Second(1.59)) - 0.47).abs() < 0.005);
    }

    proptest! {
        #[test]
        fn scaling_is_within_1e_6_of_double_precision(body in 0.05f32..1000.0, robot in 0.05f32..1000.0) {
            let exact = libm::sqrt(f64::from(body) / (f64::from(body) + f64::from(robot)));
            prop_assert!((f64::from(scaling(Kilogram(body), Kilogram(robot))) - exact).abs() < 1e-6);
        }

        #[test]
        fn nothing_void_and_no_skull_or_face_ever_passes(
            bits in 0u16..(1 << 13), region in 1u8..=12, profile in 0u8..3, clamped: bool,
            force in 0.0f32..1000.0, held in 0.0f32..20.0, quasi_static in proptest::option::of(0.0f32..500.0),
        ) {
            let region = Region::from_number(region).unwrap();
            let flags = Flags::from_bits_truncate(bits);
            let mut configuration = configuration(region, if clamped { ContactKind::Clamped } else { ContactKind::Free });
            configuration.limits = LimitsProfile::from_number(profile).unwrap();
            let measured = Measured { quasi_static: quasi_static.map(Newton), held: Second(held), ..measured(force) };
            let (severity, after) = judge(&measured, &configuration, flags);
            if after.intersects(Flags::VOID) || matches!(region, Region::Skull | Region::Face) {
                prop_assert_ne!(severity.verdict, Verdict::Pass);
            }
        }
    }
}
