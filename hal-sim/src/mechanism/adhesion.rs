//! The pad is tacky: the robot has to pull before it comes off.
//!
//! A contact ends where P = −F_a instead of P = 0. Until then pad and springs are stretched, so that the cell sees a
//! brief tension; then the pad lets go, with F_a²/2k less energy, and a massless piece is back at rest (as far
//! as friction lets it). A soft pad does not let go at once: necks and fibrils still pull while the robot is up to ℓ away, the less the
//! farther, F_a·(1 − s/ℓ), and cost F_a·ℓ/2 more. That is over in a millisecond or some, in which the robot's speed is taken as it is. A zone that
//! bears one stress until it tears pulls with F_a nearly all the way: F_a·(1 − (s/ℓ)^q) with a high q, which costs F_a·ℓ·q/(q + 1).
//! Bonds that stretch before they let go pull the more the farther the robot is, up to F_a at ℓ, and less beyond, F_a·(s/ℓ)·exp(1 − s/ℓ): the contact ends
//! at P = 0, and tearing them costs e·F_a·ℓ. A front that peels over a length leaves the less to pull the farther it has gone, F_a·exp(−s/ℓ), and costs F_a·ℓ.
//!
//! Source: pull-off force of adhesive contact, K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. A 324 (1971) 301,
//! whose jump into contact is left out: over millimetres of stroke it is not seen. Necks of tens of micrometres to some millimetres, five to
//! ten times the sticky layer: probe tests of soft adhesives, C. Creton, M. Ciccotti, Rep. Prog. Phys. 79 (2016) 046601. The zone of one stress:
//! D. S. Dugdale, J. Mech. Phys. Solids 8 (1960) 100; D. Maugis, J. Colloid Interface Sci. 150 (1992) 243. Bonds that
//! stretch, and their softening alone: X.-P. Xu, A. Needleman, Modelling Simul. Mater. Sci. Eng. 1 (1993) 111.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Neck, NeckCourse};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "adhesion",
    group: Group::Contact,
    site: Site::Pad,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[("power", "holds", &[1.0])],
    sized: &[],
    equation: "the contact ends at P = −F_a instead of P = 0; then P = −F_a·(1 − (s/ℓ)^q) until the robot is s = ℓ away, q = 1 where it does not hold, or P = −F_a·exp(−s/ℓ); or it ends at P = 0, then P = −F_a·(s/ℓ)·exp(1 − s/ℓ)",
    source: "pull-off force, Johnson, Kendall and Roberts (1971); 2 to 10 N for soft silicone and polyurethane; a zone of one stress, Dugdale (1960); one that rises, Xu and Needleman (1993)",
    parameters: &[
        Parameter {
            name: "pull_off_N",
            unit: "N",
            meaning: "tension F_a at which the robot comes off",
            null: Some(0.0),
            range: (0.0, 200.0),
            plausible: (0.2, 20.0),
            typical: 4.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "neck_m",
            unit: "m",
            meaning: "distance ℓ over which the pad still pulls once it lets go",
            null: None,
            range: (1e-6, 1e-2),
            plausible: (1e-5, 3e-3),
            typical: 1e-4,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[1e-4, 2e-3]),
        },
        Parameter {
            name: "holds",
            meaning: "0: the tension falls evenly with that distance, 1: it holds for longer, 2: it rises first, and is highest there, 3: it peels, to a third there",
            search: Search::LaterForm(&[1.0, 2.0, 3.0]),
            ..Parameter::ONE_OF_FOUR
        },
        Parameter {
            name: "power",
            unit: "1",
            meaning: "power q of the distance with which it falls: a high one is a zone of one stress",
            null: None,
            range: (1.0, 40.0),
            plausible: (1.0, 20.0),
            typical: 2.0,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
    ],
    signature: "the force goes below zero at release, the more slowly the softer the rig, and comes back from one value within a millisecond or some",
    confused_with: &["piezo-discharge", "moving-piece-inertia", "filter-lag"],
    separated_by: "talc on the pad; an undershoot of the chain lasts for seconds and grows with the impulse",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let touched = assembly.touched_mut();
    let course = match effect.form(2) {
        0 => NeckCourse::Falling(1.0),
        1 => NeckCourse::Falling(effect.value(3)),
        2 => NeckCourse::Rising,
        _ => NeckCourse::Peeling,
    };
    touched.neck = Neck { highest_n: effect.value(0), length_m: effect.value(1), course };
    touched.pull_off_n = if course == NeckCourse::Rising { 0.0 } else { effect.value(0) };
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike};
    use crate::rig::Rig;

    /// The half sine goes on below zero to −F_a; what is stretched there is lost.
    #[test]
    fn the_pulse_goes_on_to_the_pull_off_force_and_the_stretch_is_lost() {
        for rig in [Rig::impact(25e3), Rig::impact(25e3).with_pad(80e3)] {
            let (k, mass, speed) = (rig.effective_stiffness_n_per_m(), 6.0, 0.25);
            let impact = strike(rig, speed, mass, &["adhesion:pull_off_N=5,neck_m=2e-4"]);
            let contact = impact.truth().contacts[0];
            let (pulsation, peak) = ((k / mass).sqrt(), speed * (k * mass).sqrt());
            let end = contact.end_s.unwrap();
            near("end", end, (std::f64::consts::PI + (5.0 / peak).asin()) / pulsation, 1e-8);
            near("just before", impact.force_n(end - 1e-7), -5.0, 1e-3);
            near("loss", contact.loss_j, 25.0 / 2.0 / k, 1e-8);
            // The neck falls with the distance, and its work is lost, too.
            let after = impact.value(crate::rig::Quantity::Velocity, end + 1e-7);
            let lost = 0.5 * mass * (speed * speed - after * after);
            near("torn", lost - contact.loss_j, 0.5 * 5.0 * 2e-4, 1e-6);
            near("half way", impact.force_n(end + 1e-4 / after.abs()), -2.5, 1e-3);
            assert_eq!(impact.force_n(end + 2.001e-4 / after.abs()), 0.0);
        }
    }

    /// A zone of one stress pulls as strongly until it tears, and costs nearly twice as much.
    #[test]
    fn a_pull_that_holds_costs_nearly_its_force_times_its_length() {
        let rig = Rig::impact(25e3).with_pad(80e3);
        let impact = strike(rig, 0.25, 6.0, &["adhesion:pull_off_N=5,neck_m=2e-4,holds=1,power=19"]);
        let contact = impact.truth().contacts[0];
        let end = contact.end_s.unwrap();
        let after = impact.value(crate::rig::Quantity::Velocity, end + 1e-7);
        let lost = 0.5 * 6.0 * (0.25 * 0.25 - after * after);
        near("torn", lost - contact.loss_j, 0.95 * 5.0 * 2e-4, 1e-6);
        near("half way", impact.force_n(end + 1e-4 / after.abs()), -5.0, 1e-4);
        assert_eq!(impact.force_n(end + 2.001e-4 / after.abs()), 0.0);
    }

    /// A front that peels has a third left after its length, and costs its force times that.
    #[test]
    fn a_pull_that_peels_falls_to_a_third_over_its_length() {
        let rig = Rig::impact(25e3).with_pad(80e3);
        let impact = strike(rig, 0.25, 6.0, &["adhesion:pull_off_N=5,neck_m=2e-4,holds=3"]);
        let contact = impact.truth().contacts[0];
        let end = contact.end_s.unwrap();
        near("just before", impact.force_n(end - 1e-7), -5.0, 1e-3);
        let after = impact.value(crate::rig::Quantity::Velocity, end + 1e-7);
        near("torn", 0.5 * 6.0 * (0.25 * 0.25 - after * after) - contact.loss_j, 5.0 * 2e-4, 1e-6);
        near("a length away", impact.force_n(end + 2e-4 / after.abs()), -5.0 * (-1.0_f64).exp(), 1e-3);
    }

    /// Bonds that stretch pull most a length away, and cost e times that.
    #[test]
    fn a_pull_that_rises_is_highest_where_it_is_said_to_be() {
        let rig = Rig::impact(25e3).with_pad(80e3);
        let impact = strike(rig, 0.25, 6.0, &["adhesion:pull_off_N=5,neck_m=2e-4,holds=2"]);
        let contact = impact.truth().contacts[0];
        let end = contact.end_s.unwrap();
        near("end", end, std::f64::consts::PI * (6.0 / rig.effective_stiffness_n_per_m()).sqrt(), 1e-8);
        let after = impact.value(crate::rig::Quantity::Velocity, end + 1e-7);
        near("torn", 0.5 * 6.0 * (0.25 * 0.25 - after * after), std::f64::consts::E * 5.0 * 2e-4, 1e-6);
        // What the springs yield comes to the distance.
        let after_s = |lengths: f64| {
            let tension_n = 5.0 * lengths * (1.0 - lengths).exp();
            (2e-4 * lengths + tension_n / rig.effective_stiffness_n_per_m()) / after.abs()
        };
        near("highest", impact.force_n(end + after_s(1.0)), -5.0, 1e-6);
        near("on its way", impact.force_n(end + after_s(0.4)), -5.0 * 0.4 * 0.6_f64.exp(), 1e-4);
        near("beyond", impact.force_n(end + after_s(3.0)), -5.0 * 3.0 * (-2.0_f64).exp(), 1e-4);
        assert_eq!(impact.force_n(end + 12.0 * 2e-4 / after.abs()), 0.0);
    }

    /// With loss on the pad too, the tension is reached and no energy comes from nowhere; friction keeps its hold.
    #[test]
    fn it_pulls_with_damping_friction_and_a_moving_piece() {
        let rig = Rig::impact(25e3).with_pad(80e3);
        for other in ["hunt-crossley-damping", "viscous-damping", "pad-relaxation", "guide-friction", "stiction"] {
            let without = strike(rig, 0.25, 6.0, &[other]).truth().contacts[0];
            let impact = strike(rig, 0.25, 6.0, &[other, "adhesion:pull_off_N=5"]);
            let contact = impact.truth().contacts[0];
            let end = contact.end_s.unwrap();
            near(other, impact.value(crate::rig::Quantity::ContactForce, end - 1e-7), -5.0, 0.01);
            assert!(contact.loss_j > without.loss_j, "{other}: {} {}", contact.loss_j, without.loss_j);
            near("peak", contact.peak_n, without.peak_n, 1e-4);
        }
        // The springs are pulled beyond what friction of 2 N holds, so 2 N of tension remain.
        let held = strike(rig, 0.25, 6.0, &["guide-friction:force_N=2", "adhesion:pull_off_N=8"]);
        near("held", held.force_n(0.29), -2.0, 1e-6);
        let ringing = strike(rig, 0.25, 6.0, &["moving-piece-inertia", "adhesion:pull_off_N=5"]);
        let end = ringing.truth().contacts.last().unwrap().end_s.unwrap();
        near("ringing", ringing.value(crate::rig::Quantity::ContactForce, end - 1e-8), -5.0, 0.01);
    }
}
