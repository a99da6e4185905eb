//! The robot goes on pushing: its controller still wants to be behind the rig.
//!
//! F = F_0·tanh((K·(s − x) + D·(ds/dt − v))/F_0)·e^(−(t/T)⁸) on the robot from the first contact on: a position controller of
//! stiffness K, with a damper D = 2ζ·√(K·m_R) or none, whose set point s goes on with the speed of approach, so that the rig's
//! holding the robot up is a following error. From t_r on, the time that it takes to react, the set point brakes with a, and stands
//! at v_0·t_r + v_0²/2a, where the controller holds the robot both ways. Its drives give F_0 at most (a force controller gives it at
//! once, as one of very high stiffness does). When its motion is over, or a supervisor stops it, the push goes (the eighth power
//! makes a switch that a solver can follow); a controller that sees the contact end lets go where the robot is back, x = 0.
//!
//! Where no position is wanted, torque is: F = (F_0·(1 − e^(−t/τ)) − D·v)·e^(−(t/T)⁸), a force that the drives come to within their lag τ, while their
//! own friction takes D·v of it, as a controller of a speed F_0/D does.
//!
//! Source: proportional (and derivative) position control with saturation, its corner rounded by tanh; stopping distance v·t_r + v²/2a. Torque
//! control: drives of first order against their viscous friction.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Drive, Motion};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "robot-push",
    group: Group::Robot,
    site: Site::Drive,
    lasting: false,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[
        ("servo_stiffness_N_per_m", "course", &[0.0, 1.0, 2.0]),
        ("duration_s", "course", &[0.0, 2.0, 3.0]),
        ("reaction_s", "course", &[0.0, 1.0, 2.0]),
        ("deceleration_m_per_s2", "course", &[0.0, 1.0, 2.0]),
        ("servo_damping_ratio", "course", &[2.0]),
        ("lag_s", "course", &[3.0]),
        ("drive_damping_Ns_per_m", "course", &[3.0]),
    ],
    sized: &[],
    equation: "F = F_0·tanh((K·(s − x) + D·(ds/dt − v))/F_0)·exp(−(t/T)⁸) on the robot from first contact, D = 2ζ√(K·m_R) or 0, or until x = 0 instead of T; s = v₀·t until t_r, then brakes with a and stands; or F = (F_0·(1 − exp(−t/τ)) − D·v)·exp(−(t/T)⁸)",
    source: "saturating position control; up to about 150 N; from tens of N/m where an arm is impedance-controlled, to a stiff position controller's",
    parameters: &[
        Parameter {
            name: "force_N",
            unit: "N",
            meaning: "the plateau of the push",
            null: Some(0.0),
            range: (0.0, 600.0),
            plausible: (1.0, 150.0),
            typical: 20.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "servo_stiffness_N_per_m",
            unit: "N/m",
            meaning: "stiffness K of the position controller",
            null: None,
            range: (1.0, 1e6),
            plausible: (50.0, 5e5),
            typical: 2e4,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[1e2, 4e2, 2e4, 2e5]),
        },
        Parameter {
            name: "duration_s",
            unit: "s",
            meaning: "how long T it pushes, where the rebound does not end it",
            null: None,
            range: (1e-3, 1e4),
            plausible: (0.03, 10.0),
            typical: 100.0,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[0.08, 0.3, 10.0]),
        },
        Parameter {
            name: "reaction_s",
            unit: "s",
            meaning: "time t_r from contact after which the set point brakes",
            null: None,
            range: (1e-3, 1e4),
            plausible: (0.005, 0.5),
            typical: 0.05,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "deceleration_m_per_s2",
            unit: "m/s²",
            meaning: "deceleration a of the set point",
            null: None,
            range: (0.1, 1e4),
            plausible: (1.0, 1000.0),
            typical: 20.0,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "course",
            meaning: "0 a spring that pushes for T, 1 one that pushes until the robot is back where it touched, 2 a spring and a damper for T, 3 a force for T; others are rounded",
            ..Parameter::ONE_OF_FOUR
        },
        Parameter {
            name: "servo_damping_ratio",
            unit: "1",
            meaning: "damping ratio ζ of the position controller with the robot's effective mass",
            null: None,
            range: (0.0, 5.0),
            plausible: (2.5e-3, 1.0),
            typical: 5e-3,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "lag_s",
            unit: "s",
            meaning: "time constant τ within which the drives come to their force",
            null: None,
            range: (1e-5, 1.0),
            plausible: (5e-4, 0.05),
            typical: 5e-3,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "drive_damping_Ns_per_m",
            unit: "N·s/m",
            meaning: "viscous friction D of the drives, or how strongly they control a speed",
            null: None,
            range: (0.0, 1e5),
            plausible: (0.5, 1000.0),
            typical: 5.0,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
    ],
    signature: "a longer pulse, a higher late force, contact that does not end but comes to rest at F_0, hits again",
    confused_with: &["joint-elasticity", "pose-dependent-mass"],
    separated_by: "stop the robot at contact by command: the plateau goes",
    enter,
};

/// From here on tanh is 1 in double precision: 1 − tanh(x) < 2·e^(−2x) < 2⁻⁵³.
const SATURATED: f64 = 19.0;

/// Within so much of where it touched, m, a push that ends there has gone: less than a gauge tells, and more than a solver steps over.
const BACK_WITHIN_M: f64 = 1e-5;

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let approach = assembly.approach;
    let controls = |ends: Ends, damping_ratio: f64| Push {
        force_n: effect.value(0),
        servo_n_per_m: effect.value(1),
        ends,
        reaction_s: effect.value(3),
        deceleration_m_per_s2: effect.value(4),
        speed_m_per_s: approach.speed_m_per_s,
        servo_ns_per_m: 2.0 * damping_ratio * (effect.value(1) * approach.effective_mass_kg).sqrt(),
    };
    let lasts = Ends::After(effect.value(2));
    assembly.drives.push(match effect.form(5) {
        0 => Box::new(controls(lasts, 0.0)),
        1 => Box::new(controls(Ends::Back, 0.0)),
        2 => Box::new(controls(lasts, effect.value(6))),
        _ => Box::new(Torque {
            force_n: effect.value(0),
            lag_s: effect.value(7),
            duration_s: effect.value(2),
            damping_ns_per_m: effect.value(8),
        }),
    });
}

/// When a push goes.
#[derive(Debug)]
enum Ends {
    /// After so long, s.
    After(f64),
    /// Where the robot is back at where it touched.
    Back,
}

#[derive(Debug)]
struct Push {
    force_n: f64,
    servo_n_per_m: f64,
    ends: Ends,
    reaction_s: f64,
    deceleration_m_per_s2: f64,
    speed_m_per_s: f64,
    servo_ns_per_m: f64,
}

impl Push {
    /// Where the controller wants the robot to be, m, and how fast, m/s.
    fn set_point(&self, time_s: f64) -> (f64, f64) {
        let stops_s = (self.speed_m_per_s / self.deceleration_m_per_s2).max(0.0);
        let braking_s = (time_s - self.reaction_s).clamp(0.0, stops_s);
        let moving_s = time_s.min(self.reaction_s) + braking_s;
        let place_m = self.speed_m_per_s * moving_s - 0.5 * self.deceleration_m_per_s2 * braking_s * braking_s;
        (place_m, self.speed_m_per_s - self.deceleration_m_per_s2 * braking_s)
    }
}

impl Drive for Push {
    fn force_n(&self, motion: Motion) -> f64 {
        if motion.time_s <= 0.0 {
            return 0.0;
        }
        let left = match self.ends {
            Ends::After(duration_s) => lasting(motion.time_s, duration_s),
            Ends::Back => (1.0 + (-motion.position_m / BACK_WITHIN_M).exp()).recip(),
        };
        let (place_m, speed_m_per_s) = self.set_point(motion.time_s);
        let wanted_n = self.servo_n_per_m * (place_m - motion.position_m)
            + self.servo_ns_per_m * (speed_m_per_s - motion.velocity_m_per_s);
        let wanted = wanted_n / self.force_n.max(f64::MIN_POSITIVE);
        self.force_n * if wanted.abs() < SATURATED { wanted.tanh() } else { wanted.signum() } * left
    }
}

/// A force that the drives come to, and lose some of to their own friction.
#[derive(Debug)]
struct Torque {
    force_n: f64,
    lag_s: f64,
    duration_s: f64,
    damping_ns_per_m: f64,
}

impl Drive for Torque {
    fn force_n(&self, motion: Motion) -> f64 {
        if motion.time_s <= 0.0 {
            return 0.0;
        }
        let comes = -(-motion.time_s / self.lag_s).exp_m1();
        (self.force_n * comes - self.damping_ns_per_m * motion.velocity_m_per_s)
            * lasting(motion.time_s, self.duration_s)
    }
}

/// What is left of a push that goes after so long.
fn lasting(time_s: f64, duration_s: f64) -> f64 {
    (-(time_s / duration_s).powi(8)).exp()
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike};
    use crate::rig::Rig;

    /// Pushed for longer than its rebound takes the robot comes back; let go before that it does not.
    #[test]
    fn who_is_let_go_early_does_not_come_back() {
        let hits = |push: &str| {
            let impact = strike(Rig::impact(25e3), 0.1, 6.0, &[push]);
            // After the pulse of 49 ms.
            let later: Vec<f64> = (60..300).map(|ms| f64::from(ms) * 1e-3).collect();
            1 + usize::from(later.iter().any(|time| impact.force_n(*time) > 5.0))
        };
        assert!(hits("robot-push:force_N=8,servo_stiffness_N_per_m=100000") > 1);
        assert_eq!(hits("robot-push:force_N=8,servo_stiffness_N_per_m=100000,duration_s=0.08"), 1);
        assert_eq!(hits("robot-push:force_N=8,servo_stiffness_N_per_m=100000,course=1"), 1);
    }

    /// A push that lasts past the contact and one that ends with it are the same while the robot touches.
    #[test]
    fn until_it_is_back_the_push_is_one_that_lasts() {
        let of = |course: &str| {
            let push = format!("robot-push:force_N=8,servo_stiffness_N_per_m=20000,{course}");
            strike(Rig::impact(25e3), 0.1, 6.0, &[&push])
        };
        let (lasts, ends) = (of("duration_s=1000"), of("course=1"));
        let separates_s = lasts.truth().contacts[0].end_s.unwrap();
        for part in 1..20 {
            let time = separates_s * f64::from(part) / 20.0;
            near("force", ends.force_n(time), lasts.force_n(time), 5e-3);
        }
        let speed = |time: f64| ends.value(crate::rig::Quantity::Velocity, time);
        near("free", speed(separates_s + 0.1), speed(separates_s + 0.005), 1e-6);
    }

    /// Momentum: what the push gave in its time is missing in the speed after.
    #[test]
    fn the_push_takes_its_impulse_from_the_rebound() {
        let pushed =
            strike(Rig::impact(25e3), 0.3, 6.0, &["robot-push:force_N=2,servo_stiffness_N_per_m=1e6,duration_s=0.2"]);
        let speed = pushed.value(crate::rig::Quantity::Velocity, 0.4);
        // The integral of e^(−(t/T)⁸) is T·Γ(9/8); a controller as stiff as this is at its limit at once.
        let impulse = 2.0 * 0.2 * 0.941_742_7;
        let contact = pushed.truth().contacts[0];
        let during = 2.0 * contact.end_s.unwrap();
        near("speed", speed, contact.speed_after_m_per_s + (impulse - during) / 6.0, 1e-3);
    }

    /// The drives' force and the springs' are in balance in the end; a free robot would have come to F/D.
    #[test]
    fn a_force_leans_on_the_springs_and_is_a_speed_where_nothing_holds() {
        let push = "robot-push:force_N=20,course=3,lag_s=0.005,drive_damping_Ns_per_m=200";
        let impact = strike(Rig::impact(1e4), 0.2, 6.0, &[push]);
        near("force at rest", impact.force_n(0.29), 20.0, 0.02 * 20.0);
        // Let go, it flies from rest as what was pressed in lets it.
        let gone = strike(Rig::impact(1e4), 0.2, 6.0, &[&format!("{push},duration_s=0.1")]);
        assert!(gone.truth().contacts[0].end_s.is_some());
        // Against friction that the drives do not have a force is a force, whatever the speed.
        let plain = "robot-push:force_N=20,course=3,lag_s=1e-5,drive_damping_Ns_per_m=0";
        let peak = |speed: f64| strike(Rig::impact(1e4), speed, 6.0, &[plain]).truth().peak_n;
        // ½mv² + F·x = ½kx².
        for speed in [0.1_f64, 0.3] {
            near("peak", peak(speed), 20.0 + (400.0 + 1e4 * 6.0 * speed * speed).sqrt(), 0.05);
        }
    }

    /// The set point stops after v·t_r + v²/2a; there the robot comes to rest, whatever damps it, and the springs lean on it.
    #[test]
    fn it_comes_to_rest_at_its_stopping_distance() {
        let push = "robot-push:force_N=600,servo_stiffness_N_per_m=1e5,reaction_s=0.03,deceleration_m_per_s2=10";
        let damped = format!("{push},course=2,servo_damping_ratio=0.5");
        let stops_m = 0.2 * 0.03 + 0.2 * 0.2 / (2.0 * 10.0);
        // K and the rig's springs in series divide the distance; the saturation's bend takes less than a hundredth.
        let leans_n = stops_m / (1.0 / 1e5 + 1.0 / 1e4);
        for effects in [&[push, "viscous-damping:damping_Ns_per_m=800"][..], &[damped.as_str()]] {
            let impact = strike(Rig::impact(1e4), 0.2, 6.0, effects);
            near("force at rest", impact.force_n(0.29), leans_n, 0.02 * leans_n);
        }
    }
}
