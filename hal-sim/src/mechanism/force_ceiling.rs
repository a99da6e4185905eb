//! The robot cannot press harder than its drives: what stands behind them slips.
//!
//! ```text
//!  [link m_R·(1 − μ)]──slips at F_max──[tip m_R·μ]→ )pad)
//! ```
//!
//! Until the coupling would have to pass on more than F_max, link and tip are one mass. Then it passes on C = F_max + c·(v_link −
//! v_tip), as an overload clutch, a ratcheting gear or a current-limited drive that is pushed back does (c is the drives' own
//! viscous friction), and the link slips on; it holds again when both are equally fast. The contact force is C and what the tip's own
//! inertia adds, which swings about C: a flat top, sloping with c, with a ring that is the flatter the lighter the tip and that c
//! damps. What slips may be a joint that half of the arm lies before, or a finger's cap of a few grams. F_max times the way that it
//! slipped is lost, so that the unloading side starts from rest at F_max. Of a massless tip (a simulated robot may have one) a ten-thousandth
//! is left: its ring is faster than recordings show.
//!
//! A gauge of the robot's position shows the tip; the robot's own encoders, behind what slips, show the link.
//!
//! Behind an elastic joint (`joint-elasticity`) it is that joint which slips, and its link fraction that counts.
//!
//! Source: Coulomb slip in series with an inertia; torque limits of a KUKA iiwa 14, 320 Nm over 0.6 m: about 540 N
//! along x, less with the arm stretched or with reduced limits.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Ceiling};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "force-ceiling",
    group: Group::Robot,
    site: Site::Robot,
    lasting: false,
    exact: false,
    by_configuration: &["force_N"],
    by_recording: &[],
    used_in: &[],
    sized: &[],
    equation: "m_link·a_link = D − C, m_tip·a_tip = C − P, a_link = a_tip while |C| ≤ F_max, else C = ±F_max + c·slip rate",
    source: "slipping coupling; about 540 N from the joint torques of an iiwa 14, less by pose and settings",
    parameters: &[
        Parameter {
            name: "force_N",
            unit: "N",
            meaning: "the most F_max that the robot's drives can bear at the contact",
            null: Some(f64::INFINITY),
            range: (1.0, 1e5),
            plausible: (40.0, 1000.0),
            typical: 200.0,
            scale: Scale::Logarithmic,
            search: Search::OfPeak,
        },
        Parameter {
            name: "tip_fraction",
            unit: "1",
            meaning: "part of the effective mass before the drives that slip",
            null: None,
            range: (1e-4, 0.9),
            plausible: (1e-4, 0.4),
            typical: 0.08,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[0.01, 0.05, 0.2]),
        },
        Parameter {
            name: "slip_damping_Ns_per_m",
            unit: "N·s/m",
            meaning: "viscous friction c of the drives that slip",
            null: None,
            range: (0.0, 1e4),
            plausible: (1.0, 300.0),
            typical: 0.0,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[3.0, 60.0]),
        },
        Parameter {
            meaning: "where the robot's motion is read: 0 at the tip, 1 behind what slips",
            ..Parameter::GAUGE
        },
    ],
    signature: "a top that is flat but for a slow ring, in the strongest recordings only, then a fall as from rest: the impulse is short",
    confused_with: &["clipping", "robot-push", "end-stop"],
    separated_by: "the log of the joints' torques; behind clipping the pulse is as long as ever, here the robot comes back slower",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.ceiling =
        Some(Ceiling { force_n: effect.value(0), tip_fraction: effect.value(1), damping_ns_per_m: effect.value(2) });
    assembly.link_bears_gauge |= effect.form(3) == 1;
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike};
    use crate::rig::{Impact, Quantity, Rig};

    fn hit(rig: Rig, fraction: f64) -> Impact {
        let effect = format!("force-ceiling:force_N=60,tip_fraction={fraction}");
        strike(rig, 0.3, 6.0, &[&effect])
    }

    /// A very light tip: a half sine up to F_max, F_max until the robot stands, a quarter cosine from there.
    #[test]
    fn a_light_tip_gives_a_flat_top_of_known_length() {
        let (k, mass, speed, most) = (25e3_f64, 6.0, 0.3, 60.0);
        let impact = hit(Rig::impact(k), 0.01);
        let (pulsation, peak) = ((k / mass).sqrt(), speed * (k * mass).sqrt());
        let slips_s = (most / peak).asin() / pulsation;
        let slip_m_per_s = speed * (pulsation * slips_s).cos();
        let stands_s = slips_s + slip_m_per_s * mass / most;
        let contact = impact.truth().contacts[0];
        near("end", contact.end_s.unwrap(), stands_s + std::f64::consts::FRAC_PI_2 / pulsation, 2e-3);
        near("speed after", contact.speed_after_m_per_s, -most / (k * mass).sqrt(), 0.02);
        // The tip of 60 g swings by v·√(k·m_t) about it, on springs without loss.
        let top: Vec<f64> = (0..1000).map(|part| slips_s + (stands_s - slips_s) * f64::from(part) / 1000.0).collect();
        let mean = top.iter().map(|time| impact.force_n(*time)).sum::<f64>() / 1000.0;
        near("mean of the top", mean, most, 0.05 * most);
        near("just before", impact.force_n(slips_s - 1e-4), peak * (pulsation * (slips_s - 1e-4)).sin(), 1e-3);
    }

    /// An impact that stays below it is the ideal one, to the last digits; so is one with a ceiling behind a joint.
    #[test]
    fn nothing_slips_below_the_ceiling() {
        let rig = Rig::impact(25e3).with_pad(80e3);
        for others in [&[][..], &["joint-elasticity"], &["guide-friction"], &["hunt-crossley-damping"]] {
            let without = strike(rig, 0.3, 6.0, others);
            let with: Vec<&str> = others.iter().copied().chain(["force-ceiling:force_N=400"]).collect();
            let impact = strike(rig, 0.3, 6.0, &with);
            for part in 0..100 {
                let time = f64::from(part) * 1e-3;
                near(&format!("{others:?}"), impact.force_n(time), without.force_n(time), 2e-4);
            }
        }
    }

    /// What is read behind the drives goes on while they slip, by what slipped once they hold again; its speed and acceleration are its own.
    #[test]
    fn instruments_behind_what_slips_show_the_link() {
        let [tip, link] = [0, 1].map(|gauge| {
            let effect = format!("force-ceiling:force_N=60,tip_fraction=0.05,gauge={gauge}");
            strike(Rig::impact(25e3), 0.3, 6.0, &[&effect])
        });
        let slipped = |time_s: f64| link.value(Quantity::Position, time_s) - tip.value(Quantity::Position, time_s);
        let rate = |of: &Impact, quantity: Quantity| {
            let [before, after] = [0.02 - 1e-6, 0.02 + 1e-6].map(|time_s| of.value(quantity, time_s));
            (after - before) / 2e-6
        };
        for shown in [&tip, &link] {
            near("speed", rate(shown, Quantity::Position), shown.value(Quantity::Velocity, 0.02), 1e-4);
            near("acceleration", rate(shown, Quantity::Velocity), shown.value(Quantity::Acceleration, 0.02), 1e-3);
        }
        // The drives bear no more on the link than they can.
        near("link", link.value(Quantity::Acceleration, 0.02), -60.0 / (0.95 * 6.0), 1e-9);
        near(
            "its tip's contact",
            link.truth().contacts[0].speed_after_m_per_s,
            tip.truth().contacts[0].speed_after_m_per_s,
            1e-12,
        );
        near("before", slipped(-0.01), 0.0, 1e-12);
        near("while it holds", slipped(5e-3), 0.0, 1e-9);
        assert!(slipped(0.02) > 1e-4, "{}", slipped(0.02));
        // The energy that the tip's ring does not keep: 60 N times the way.
        let after = tip.truth().contacts[0].speed_after_m_per_s;
        near("lost", 60.0 * slipped(0.1), 0.5 * 6.0 * (0.3 * 0.3 - after * after), 0.05);
    }

    /// Viscous friction of the drives: the force passed on falls with the slip from F_max + c·v to F_max, and the tip rings no more.
    #[test]
    fn a_viscous_coupling_gives_a_sloping_top_that_does_not_ring() {
        let impact = strike(
            Rig::impact(25e3),
            0.3,
            6.0,
            &["force-ceiling:force_N=60,tip_fraction=0.01,slip_damping_Ns_per_m=150"],
        );
        let (k, mass) = (25e3_f64, 6.0);
        let slips_s = (60.0 / (0.3 * (k * mass).sqrt())).asin() / (k / mass).sqrt();
        let times: Vec<f64> = (0..400).map(|part| slips_s + 2e-3 + f64::from(part) * 2e-5).collect();
        let force: Vec<f64> = times.iter().map(|time| impact.force_n(*time)).collect();
        let top = force.iter().copied().fold(0.0, f64::max);
        let after = force.iter().position(|f| *f == top).unwrap();
        assert!(top > 66.0, "{top}");
        assert!(force[after..].windows(2).all(|pair| pair[1] <= pair[0]), "once past its top the force only falls");
        assert!(force[after..].iter().all(|f| *f > 59.9));
    }

    /// Momentum: the contact's impulse is what tip and link together lose. Energy: the loss is at most F_max times a way.
    #[test]
    fn momentum_is_kept_and_the_elastic_joint_slips_too() {
        // The link behind the elastic joint is 0.3 of the mass, so that less of the force passes through it.
        for (ceiling, others) in [
            ("force-ceiling:force_N=50,tip_fraction=0.3", &[][..]),
            ("force-ceiling:force_N=10", &["joint-elasticity"]),
            ("force-ceiling:force_N=50,tip_fraction=0.3", &["moving-piece-inertia"]),
            ("force-ceiling:force_N=50,tip_fraction=0.3", &["guide-friction", "pad-relaxation"]),
        ] {
            let with: Vec<&str> = others.iter().copied().chain([ceiling]).collect();
            let rig = Rig::impact(25e3).with_pad(80e3);
            let (ideal, impact) = (strike(rig, 0.3, 6.0, others), strike(rig, 0.3, 6.0, &with));
            let impulse = |impact: &Impact| -> f64 {
                (0..30_000).map(|part| impact.value(Quantity::ContactForce, f64::from(part) * 1e-5) * 1e-5).sum()
            };
            assert!(impulse(&impact) < 0.97 * impulse(&ideal), "{others:?}: a slipping robot comes back slower");
            assert!(impulse(&impact) > 6.0 * 0.3, "{others:?}: it has to be stopped all the same");
            assert!(impact.truth().peak_n < ideal.truth().peak_n);
        }
    }
}
