//! The rig against closed forms.

use std::f64::consts::PI;

use thud_sim::mechanism::Effect;
use thud_sim::rig::{Accuracy, Approach, Impact, Quantity, Rig};

fn strike(rig: &Rig, speed: f64, mass: f64, effects: &[&str], until_s: f64) -> Impact {
    let effects: Vec<Effect> = effects.iter().map(|text| text.parse().unwrap()).collect();
    rig.strike(&Approach::new(speed, mass), &effects, until_s, Accuracy::default())
        .unwrap_or_else(|error| panic!("{effects:?}: {error}"))
}

fn assert_near(what: &str, value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value}, expected {expected} ± {tolerance}");
}

/// Peak v·√(k·m), duration π√(m/k), impulse 2mv, and the half sine between.
#[test]
fn the_ideal_impact_is_a_half_sine() {
    for (stiffness, pad, mass, speed) in [
        (10e3, None, 12.0, 0.05),
        (25e3, Some(80e3), 6.08, 0.25),
        (150e3, Some(900e3), 4.0, 0.6),
        (75e3, None, 6.0, 0.4),
    ] {
        let rig = Rig { pad_stiffness_n_per_m: pad, ..Rig::impact(stiffness) };
        let k = rig.effective_stiffness_n_per_m();
        let pulsation = (k / mass).sqrt();
        let peak = speed * (k * mass).sqrt();
        let impact = strike(&rig, speed, mass, &[], 0.4);
        let truth = impact.truth();
        assert_eq!(truth.contacts.len(), 1);
        let contact = truth.contacts[0];
        assert_near("peak", contact.peak_n, peak, 1e-7 * peak);
        assert_near("instant of peak", contact.peak_s, PI / 2.0 / pulsation, 1e-6);
        assert_near("separation", contact.end_s.unwrap(), PI / pulsation, 1e-9);
        assert_near("impulse", contact.impulse_ns, 2.0 * mass * speed, 1e-7 * mass * speed);
        assert_near("speed after", contact.speed_after_m_per_s, -speed, 1e-7 * speed);
        assert_near("loss", contact.loss_j, 0.0, 1e-7 * mass * speed * speed);
        assert_near("stroke", contact.stroke_m, peak / stiffness, 1e-7 * peak / stiffness);
        for part in 1..100 {
            let time = f64::from(part) / 100.0 * PI / pulsation;
            assert_near("force", impact.force_n(time), peak * (pulsation * time).sin(), 2e-7 * peak);
        }
        assert_eq!(impact.force_n(0.39), 0.0);
        assert_eq!(impact.force_n(-0.01), 0.0);
    }
}

/// x̄ = mg/k, amplitude √(x̄² + v²m/k): paper 1's eq. 24 in its corrected form, F = mg(1 + √(1 + 2kh/(mg))).
#[test]
fn a_dropped_mass_peaks_as_the_corrected_formula_says_and_bounces_for_ever() {
    let (mass, height, stiffness) = (0.0412, 0.040, 75e3);
    let rig = Rig::drop(stiffness);
    let weight = mass * rig.gravity_m_per_s2;
    let peak = weight * (1.0 + (1.0 + 2.0 * stiffness * height / weight).sqrt());
    assert_near("the printed figure", peak, 49.7, 0.06);
    let approach = Approach::dropped_from(height, mass);
    let impact = rig.strike(&approach, &[], 1.0, Accuracy::default()).unwrap();
    let truth = impact.truth();
    assert_near("peak", truth.peak_n, peak, 1e-6 * peak);
    // Without loss every bounce is the first one again, a flight of 2v/g and a contact apart.
    let flight = 2.0 * approach.speed_m_per_s / rig.gravity_m_per_s2;
    assert_eq!(truth.contacts.len(), 6);
    for pair in truth.contacts.windows(2) {
        assert_near("flight", pair[1].start_s - pair[0].end_s.unwrap(), flight, 1e-6);
        assert_near("peak again", pair[1].peak_n, peak, 1e-5 * peak);
    }
}

/// One mass on a Hunt–Crossley spring: e solves ln((1+a)/(1−ae)) = a(1+e), a = 1.5·α·v0, from the first integral
/// v dv/(1 + 1.5αv) = −(k/m)·x dx taken in and out. The rule e ≈ 1/(1+αv0) is close to it.
#[test]
fn hunt_crossley_returns_the_restitution_of_its_own_first_integral() {
    for (alpha, speed) in [(0.05, 0.25), (0.2, 0.5), (0.5, 0.6), (1.5, 0.6)] {
        let rig = Rig::impact(40e3);
        let impact = strike(&rig, speed, 6.0, &[&format!("hunt-crossley-damping:alpha_s_per_m={alpha}")], 0.2);
        let contact = impact.truth().contacts[0];
        let restitution = -contact.speed_after_m_per_s / speed;
        let a = 1.5 * alpha * speed;
        let defect = a * (1.0 + restitution) - ((1.0 + a) / (1.0 - a * restitution)).ln();
        assert_near("first integral", defect, 0.0, 1e-6);
        assert_near("rule", restitution, 1.0 / (1.0 + alpha * speed), 0.02);
        let lost = 0.5 * 6.0 * speed * speed * (1.0 - restitution * restitution);
        assert_near("loss", contact.loss_j, lost, 1e-6 * lost);
    }
}

/// The pad alone loses energy: with the springs in series the damping is on the pad's own compression.
#[test]
fn damping_stays_on_the_pad_and_vanishes_smoothly() {
    let rig = Rig::impact(25e3).with_pad(80e3);
    let ideal = strike(&rig, 0.4, 6.0, &[], 0.1).truth().contacts[0];
    let with = |alpha: f64| {
        let effect = format!("hunt-crossley-damping:alpha_s_per_m={alpha:e}");
        strike(&rig, 0.4, 6.0, &[&effect], 0.1).truth().contacts[0]
    };
    assert_near("α → 0", with(1e-7).peak_n, ideal.peak_n, 5e-6 * ideal.peak_n);
    // To first order the loss is ∫1.5·α·k_p·δ·δ̇² over the ideal motion; δ = q·x, q the pad's share of the stroke.
    let alpha = 2e-3;
    let (k, share) = (rig.effective_stiffness_n_per_m(), 25.0 / 105.0);
    let amplitude = 0.4 * (6.0 / k).sqrt();
    let pulsation = (k / 6.0).sqrt();
    let expected = 1.5 * alpha * 80e3 * f64::powi(share, 3) * amplitude.powi(3) * pulsation * 2.0 / 3.0;
    assert_near("loss", with(alpha).loss_j, expected, 2e-3 * expected);
    // A rig without a pad has all of the stroke in the damped element, and loses far more.
    let bare = strike(&Rig::impact(k), 0.4, 6.0, &["hunt-crossley-damping:alpha_s_per_m=0.002"], 0.1);
    assert!(bare.truth().contacts[0].loss_j > 3.0 * expected);
}

/// A massless piece behind a pad is a play operator. Loaded from rest and unloaded, the robot's work on it is known:
/// the piece sticks until k_p·x = F_c, then both springs yield.
#[test]
fn friction_behind_a_pad_is_a_play_operator() {
    let (k_body, k_pad, friction) = (25e3, 80e3, 4.0);
    let rig = Rig::impact(k_body).with_pad(k_pad);
    let impact = strike(&rig, 0.25, 6.0, &["guide-friction:force_N=4"], 0.2);
    let contact = impact.truth().contacts[0];
    let end = contact.end_s.unwrap();
    let mut held = 0.0_f64;
    for part in 1..4000 {
        let time = end * f64::from(part) / 4000.0;
        let x = impact.value(Quantity::Position, time);
        let (low, high) = ((k_pad * x - friction) / (k_pad + k_body), (k_pad * x + friction) / (k_pad + k_body));
        held = held.clamp(low, high);
        let slack = 2.0 * 0.25 * end / 4000.0; // the reference is only as fine as its steps
        assert_near("stroke", impact.value(Quantity::Stroke, time), held, slack * 0.01 + 1e-9);
    }
    // Energy: ½k_eff-like stores aside, what is lost is friction times way, and what the springs keep.
    let top = contact.stroke_m;
    let rest = impact.value(Quantity::Stroke, end + 1e-3);
    assert_near("rest after release", k_body * rest, friction, 1e-6);
    let lost = friction * (top + (top - rest)) + 0.5 * k_body * rest * rest;
    assert_near("loss", contact.loss_j, lost, 1e-6 * lost);
    assert_near("what the cell sees after release", impact.force_n(0.19), friction, 1e-6);
}

/// A piece with some momentum leaves less for the friction to hold, the less the faster it was released; the contact is the same.
#[test]
fn momentum_takes_from_the_rest_that_friction_holds() {
    let rig = Rig::impact(25e3).with_pad(80e3);
    for speed in [0.1, 0.25, 0.4] {
        let without = strike(&rig, speed, 6.0, &["guide-friction:force_N=4"], 0.2);
        let with = strike(&rig, speed, 6.0, &["guide-friction:force_N=4,rest_share=0.6"], 0.2);
        let (contact, same) = (without.truth().contacts[0], with.truth().contacts[0]);
        assert_near("peak", same.peak_n, contact.peak_n, 1e-9);
        let released = contact.speed_after_m_per_s.abs();
        assert_near("rest", with.force_n(0.19), 4.0 * 0.6_f64.powf(released / 0.25), 1e-6);
    }
}

/// Without a pad the guide rubs on the robot itself: m·ẍ = −kx ∓ F_c, two half sines about ∓F_c/k.
#[test]
fn friction_without_a_pad_shifts_the_centre_of_the_half_sines() {
    let (k, mass, speed, friction) = (25e3, 6.0, 0.25, 5.0);
    let impact = strike(&Rig::impact(k), speed, mass, &["guide-friction:force_N=5"], 0.2);
    let contact = impact.truth().contacts[0];
    let offset = friction / k;
    let pulsation = (k / mass).sqrt();
    let amplitude = (offset * offset + speed * speed / pulsation / pulsation).sqrt();
    let top = amplitude - offset;
    assert_near("stroke", contact.stroke_m, top, 1e-9);
    let turning = (PI / 2.0 - (offset / amplitude).asin()) / pulsation;
    // On the way back the centre is +offset; separation where k·x = F_c, that is in the centre: a quarter period.
    assert_near("separation", contact.end_s.unwrap(), turning + PI / 2.0 / pulsation, 1e-8);
    assert_near("speed after", contact.speed_after_m_per_s, -(top - offset) * pulsation, 1e-7);
    // The guide stands on the cell: then the cell sees the contact force, which jumps by 2F_c at the turning point.
    let on_cell = strike(&Rig::impact(k), speed, mass, &["guide-friction:force_N=5,cell_share=1"], 0.2);
    let before = on_cell.force_n(turning - 1e-6);
    let after = on_cell.force_n(turning + 1e-6);
    assert_near("jump", before - after, 2.0 * friction, 1e-3);
}

/// A piece that is pushed with less than the friction never moves: true sticking, not creep.
#[test]
fn what_is_too_weak_to_break_loose_sticks_for_ever() {
    let rig = Rig::impact(25e3).with_pad(80e3);
    let impact = strike(&rig, 0.01, 4.0, &["guide-friction:force_N=20"], 1.0);
    assert!(impact.truth().contacts[0].loss_j.abs() < 1e-10);
    assert_eq!(impact.truth().peak_n, 0.0);
    assert_eq!(impact.value(Quantity::Stroke, 0.01), 0.0);
    let massive = strike(&rig, 0.01, 4.0, &["guide-friction:force_N=20", "moving-piece-inertia:mass_kg=0.1"], 1.0);
    assert_eq!(massive.value(Quantity::Stroke, 0.5), 0.0);
}

/// Below the stop nothing; beyond it a steeper half sine, continuous in force and speed.
#[test]
fn an_end_stop_is_two_half_sines() {
    let (k, mass, stroke, ratio) = (25e3, 6.0, 0.003, 20.0);
    let rig = Rig::impact(k);
    let stop = format!("end-stop:stroke_m={stroke},stiffness_ratio={ratio}");
    let soft = strike(&rig, 0.15, mass, &[&stop], 0.2).truth();
    assert_near("not reached", soft.peak_n, 0.15 * (k * mass).sqrt(), 1e-5);
    let speed = 0.4;
    let hard = strike(&rig, speed, mass, &[&stop], 0.2).truth().contacts[0];
    // Energy: ½mv² = ½kx² + ½κk(x − x_b)²
    let (a, b, c) = (1.0 + ratio, -2.0 * ratio * stroke, ratio * stroke * stroke - mass * speed * speed / k);
    let top = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    assert_near("stroke", hard.stroke_m, top, 1e-9);
    assert_near("peak", hard.peak_n, k * top + ratio * k * (top - stroke), 1e-4);
    assert_near("speed after", hard.speed_after_m_per_s, -speed, 1e-7);
    let pulsation = (k / mass).sqrt();
    let to_stop = (stroke * pulsation / speed).asin() / pulsation;
    let steep = pulsation * (1.0 + ratio).sqrt();
    let centre = ratio * stroke / (1.0 + ratio);
    let within = 2.0 * ((stroke - centre) / (top - centre)).acos() / steep;
    assert_near("duration", hard.end_s.unwrap(), 2.0 * to_stop + within, 1e-8);
}

/// What comes to a stop at v leaves it at v − αv²: nearly all of this contact is the stop's.
#[test]
fn an_end_stop_gives_back_what_its_loss_leaves() {
    let (speed, alpha) = (0.2, 0.1);
    let stop = format!("end-stop:stroke_m=1e-4,stiffness_ratio=1000,loses=1,alpha_s_per_m={alpha}");
    let contact = strike(&Rig::impact(25e3), speed, 6.0, &[&stop], 0.05).truth().contacts[0];
    assert_near(
        "speed after",
        -contact.speed_after_m_per_s,
        speed - alpha * speed * speed,
        0.05 * alpha * speed * speed,
    );
}

/// Two bodies without loss keep energy; momentum changes by the base's impulse; the piece rings at √((k_p+k_b)/m_p).
#[test]
fn a_moving_piece_rings_at_its_frequency_and_loses_nothing_without_damping() {
    let (k_body, k_pad, piece) = (25e3, 80e3, 0.12);
    let rig = Rig::impact(k_body).with_pad(k_pad);
    let inertia = "moving-piece-inertia:mass_kg=0.12,pad_damping_ratio=0,spring_damping_ratio=0,stop_ratio=0";
    let impact = strike(&rig, 0.25, 6.0, &[inertia], 0.2);
    let ideal = strike(&rig, 0.25, 6.0, &[], 0.2);
    let contacts = impact.truth().contacts;
    let lost: f64 = contacts.iter().map(|contact| contact.loss_j).sum();
    // After release the piece swings on k_body alone, with what the robot has not taken along.
    let frequency = (k_body / piece).sqrt() / (2.0 * PI);
    let end = contacts.last().unwrap().end_s.unwrap();
    let stroke = |time: f64| impact.value(Quantity::Stroke, time);
    let period = 1.0 / frequency;
    for part in 0..20 {
        let time = end + 0.01 + f64::from(part) * 1e-4;
        assert_near("ring", stroke(time + 5.0 * period), stroke(time), 2e-7);
    }
    let energy = |time: f64| {
        let step = 1e-6;
        let speed = (stroke(time + step) - stroke(time - step)) / (2.0 * step);
        0.5 * piece * speed * speed + 0.5 * k_body * stroke(time).powi(2)
    };
    assert_near("energy", energy(0.15), lost, 1e-6 * 0.5 * 6.0 * 0.25 * 0.25);
    // While touching, the deviation from the ideal pulse changes its sign twice a period of the ring.
    let ring = ((k_body + k_pad) / piece).sqrt() / (2.0 * PI);
    let deviations: Vec<f64> =
        (0..3000).map(|part| f64::from(part) * 1e-5).map(|time| impact.force_n(time) - ideal.force_n(time)).collect();
    let crossings = deviations.windows(2).filter(|pair| pair[0].signum() != pair[1].signum()).count() as f64;
    assert_near("crossings in 30 ms", crossings, 2.0 * ring * 0.03, 3.0);
}

/// m_p → 0 is the massless piece, with friction and with damping too.
#[test]
fn a_very_light_piece_is_no_piece() {
    let rig = Rig::impact(25e3).with_pad(80e3);
    let light = "moving-piece-inertia:mass_kg=0.001,pad_damping_ratio=0.5,spring_damping_ratio=0.0";
    for effects in [&[][..], &["guide-friction:force_N=4"], &["hunt-crossley-damping:alpha_s_per_m=0.3"]] {
        let massless = strike(&rig, 0.25, 6.0, effects, 0.1);
        let with: Vec<&str> = effects.iter().copied().chain([light]).collect();
        let massive = strike(&rig, 0.25, 6.0, &with, 0.1);
        for part in 2..54 {
            let time = f64::from(part) * 1e-3;
            assert_near(&format!("{effects:?} at {time}"), massive.force_n(time), massless.force_n(time), 0.6);
        }
    }
}

/// The free two-mass robot keeps momentum, and a stiff joint is no joint.
#[test]
fn a_stiff_joint_is_no_joint_and_a_soft_one_leaves_the_tip_alone() {
    let rig = Rig::impact(75e3);
    let ideal = strike(&rig, 0.3, 8.0, &[], 0.15).truth().contacts[0];
    let stiff =
        strike(&rig, 0.3, 8.0, &["joint-elasticity:link_fraction=0.3,frequency_Hz=200,damping_ratio=0.7"], 0.15);
    assert_near("stiff", stiff.truth().peak_n, ideal.peak_n, 0.03 * ideal.peak_n);
    let soft = strike(&rig, 0.3, 8.0, &["joint-elasticity:link_fraction=0.5,frequency_Hz=1,damping_ratio=0"], 0.15);
    let tip_alone = 0.3 * (75e3_f64 * 4.0).sqrt();
    assert_near("soft", soft.truth().contacts[0].peak_n, tip_alone, 0.01 * tip_alone);
    // Two masses on one spring: the impulse of all hits is the change of momentum of both.
    let contacts = soft.truth().contacts;
    assert!(contacts.iter().map(|contact| contact.impulse_ns).sum::<f64>() < 2.0 * 8.0 * 0.3);
}

/// The push comes to rest at F_0 when there is something that loses energy, and adds F_0/k to the stroke.
#[test]
fn a_push_ends_in_a_held_contact() {
    let rig = Rig::impact(25e3);
    let impact = strike(
        &rig,
        0.2,
        6.0,
        &[
            "robot-push:force_N=40,servo_stiffness_N_per_m=10000,reaction_s=100",
            "hunt-crossley-damping:alpha_s_per_m=4",
        ],
        6.0,
    );
    let last = *impact.truth().contacts.last().unwrap();
    assert_eq!(last.end_s, None);
    assert_near("plateau", impact.force_n(6.0), 40.0, 0.5);
}

/// ẏ = Ḟ − y/τ after a half sine leaves the closed-form undershoot.
#[test]
fn a_discharging_cell_undershoots_by_the_closed_form() {
    let (k, mass, speed, tau) = (25e3_f64, 6.0, 0.25, 0.8);
    let impact = strike(&Rig::impact(k), speed, mass, &["piezo-discharge:time_constant_s=0.8"], 0.5);
    let times: Vec<f64> = (-20..=5000).map(|index| f64::from(index) * 1e-4).collect();
    let measured = impact.measured_n(&times);
    let pulsation = (k / mass).sqrt();
    let (peak, length) = (speed * (k * mass).sqrt(), PI / pulsation);
    for (time, value) in times.iter().zip(&measured).filter(|(time, _)| **time > length) {
        // y = −(1/τ)∫F e^(−(t−s)/τ) ds with ∫₀ᵀ sin(ωs)e^(s/τ) ds = ω(1 + e^(T/τ))/(ω² + 1/τ²)
        let integral = pulsation * (1.0 + (length / tau).exp()) / (pulsation * pulsation + 1.0 / tau / tau);
        let expected = -peak / tau * integral * (-time / tau).exp();
        assert_near("undershoot", *value, expected, 2e-5 * peak);
    }
    assert_eq!(measured[0], 0.0);
}

/// Free flight: no rig, so no contact, and x = ½gt².
#[test]
fn a_fall_meets_nothing() {
    let approach = Approach::new(0.0, 0.06);
    let impact = Rig::fall().strike(&approach, &[], 1.2, Accuracy::default()).unwrap();
    assert!(impact.contact_intervals().is_empty());
    let gravity = thud_sim::rig::STANDARD_GRAVITY_M_PER_S2;
    for time in [0.0, 0.1, 0.73, 1.2] {
        assert_near("fallen", impact.value(Quantity::Position, time), 0.5 * gravity * time * time, 1e-9);
        assert_near("speed", impact.value(Quantity::Velocity, time), gravity * time, 1e-9);
    }
}

/// The same impact is followed far more exactly, and nothing visible changes; twice the same is the same to the bit.
#[test]
fn a_tighter_tolerance_changes_nothing_that_counts() {
    let rigs = [Rig::impact(25e3).with_pad(80e3), Rig::impact(75e3), Rig::impact(10e3).with_pad(18e3)];
    let tight = Accuracy { relative: 1e-10, force_n: 1e-8 };
    let mut tried = vec![vec![]];
    tried.extend(thud_sim::mechanism::LIST.iter().map(|mechanism| vec![mechanism.typical()]));
    tried.push(thud_sim::mechanism::LIST.iter().map(|mechanism| mechanism.typical()).collect());
    for rig in rigs {
        for effects in &tried {
            let approach = Approach::new(0.3, 7.0);
            let names: Vec<String> = effects.iter().map(ToString::to_string).collect();
            let usual = rig
                .strike(&approach, effects, 0.3, Accuracy::default())
                .unwrap_or_else(|error| panic!("{names:?}: {error}"));
            let again = rig.strike(&approach, effects, 0.3, Accuracy::default()).unwrap();
            let exact = rig.strike(&approach, effects, 0.3, tight).unwrap_or_else(|error| panic!("{names:?}: {error}"));
            let times: Vec<f64> = (-10..3000).map(|index| f64::from(index) * 1e-4).collect();
            let (a, b, c) = (usual.measured_n(&times), again.measured_n(&times), exact.measured_n(&times));
            assert_eq!(a, b, "{names:?}");
            let peak = c.iter().copied().fold(0.0, f64::max);
            for ((time, usual), exact) in times.iter().zip(a).zip(c) {
                assert_near(&format!("{names:?} at {time} s"), usual, exact, 5e-5 * peak);
            }
        }
    }
}

/// Where the equations are linear they are solved by an exponential; a drag that is too weak to be seen makes the same
/// equations another method's.
#[test]
fn the_exponential_and_the_solver_tell_the_same() {
    let rigs = [Rig::impact(25e3).with_pad(80e3), Rig::impact(75e3), Rig::drop(10e3).with_pad(18e3)];
    let effects: Vec<&str> = thud_sim::mechanism::LIST.iter().map(|mechanism| mechanism.id).collect();
    for rig in rigs {
        for effect in &effects {
            let linear = strike(&rig, 0.3, 7.0, &[effect], 0.15);
            let other = strike(&rig, 0.3, 7.0, &[effect, "air-damping:drag_Ns2_per_m2=1e-12"], 0.15);
            let peak = linear.truth().peak_n;
            for part in 0..1500 {
                let time = f64::from(part) * 1e-4;
                assert_near(&format!("{effect} at {time} s"), other.force_n(time), linear.force_n(time), 2e-6 * peak);
            }
        }
    }
}

/// Bad input is refused with what would be right.
#[test]
fn impossible_rigs_are_refused() {
    let refused =
        |rig: Rig, approach: Approach| rig.strike(&approach, &[], 0.1, Accuracy::default()).unwrap_err().to_string();
    let good = Approach::new(0.2, 6.0);
    assert!(refused(Rig::impact(-3.0), good).contains("body springs is -3 N/m; 1 to"));
    assert!(refused(Rig::impact(25e3).with_pad(f64::NAN), good).contains("pad"));
    assert!(refused(Rig::impact(25e3), Approach::new(0.2, 0.0)).contains("effective mass is 0 kg"));
    assert!(refused(Rig::impact(25e3), Approach::new(f64::INFINITY, 6.0)).contains("speed"));
}

/// From rest v = v_t·tanh(g·t/v_t), v_t = √(m·g/c).
#[test]
fn a_fall_in_air_follows_the_hyperbolic_tangent() {
    let (mass, drag) = (0.06_f64, 0.005);
    let effect = "air-drag:coefficient_kg_per_m=0.005".parse().unwrap();
    let impact = Rig::fall().strike(&Approach::new(0.0, mass), &[effect], 2.0, Accuracy::default()).unwrap();
    let gravity = thud_sim::rig::STANDARD_GRAVITY_M_PER_S2;
    let terminal = (mass * gravity / drag).sqrt();
    for time in [0.05, 0.4, 1.1, 2.0] {
        let expected = terminal * (gravity * time / terminal).tanh();
        assert_near("speed", impact.value(Quantity::Velocity, time), expected, 1e-6);
    }
}

/// On a bare spring, kx + c·ẋ: the force begins with c·v0 and the contact ends while the spring is still pressed.
#[test]
fn a_dashpot_begins_with_a_step() {
    let (k, mass, speed, damping) = (40e3_f64, 6.0, 0.3, 60.0);
    let impact = strike(&Rig::impact(k), speed, mass, &["viscous-damping:damping_Ns_per_m=60"], 0.2);
    let (pulsation, decay) = ((k / mass).sqrt(), damping / 2.0 / mass);
    let damped = (pulsation * pulsation - decay * decay).sqrt();
    let force = |time: f64| {
        let (sin, cos) = (damped * time).sin_cos();
        let x = speed / damped * sin;
        let v = speed * (cos - decay / damped * sin);
        (-decay * time).exp() * (k * x + damping * v)
    };
    for time in [0.0, 0.001, 0.01, 0.02, 0.03] {
        assert_near("force", impact.force_n(time), force(time), 1e-4);
    }
    let end = impact.contact_intervals()[0].1.unwrap();
    assert_near("no force at separation", force(end), 0.0, 1e-4);
    assert!(impact.value(Quantity::Position, end) > 0.0);
    assert_eq!(impact.contact_intervals().len(), 1);
}

/// A dashpot's force is there at once, c·v, and with it what it brakes: F″ = k·v − c·(c·v)/m. Springs alone begin with their slope. Either ends with one.
#[test]
fn a_curve_jumps_and_bends_where_its_equations_change() {
    let (stiffness, damping, mass, speed) = (50e3, 40.0, 8.0, 0.4);
    let rig = Rig::impact(stiffness);
    for (effects, jump, slope) in [
        (vec![], 0.0, stiffness * speed),
        (
            vec!["viscous-damping:damping_Ns_per_m=40"],
            damping * speed,
            stiffness * speed - damping * damping * speed / mass,
        ),
    ] {
        let impact = strike(&rig, speed, mass, &effects, 0.2);
        let kinks = impact.kinks(Quantity::CellForce, 1e-6);
        let [begin, end] = kinks[..] else { panic!("{kinks:?}") };
        assert_near("begins", begin.at_s, 0.0, 0.0);
        assert_near("jumps", begin.jump, jump, 1e-4);
        assert_near("bends", begin.slope, slope, 1e-3 * slope);
        assert_near("ends", end.at_s, impact.contact_intervals()[0].1.unwrap(), 0.0);
        assert_near("leaves", end.jump, 0.0, 1e-4);
        assert!(end.slope > 0.5 * slope, "{kinks:?}");
    }
    // Coulomb's friction turns round with the piece.
    let impact = strike(&rig, speed, mass, &["guide-friction:force_N=5,cell_share=1"], 0.2);
    let kinks = impact.kinks(Quantity::CellForce, 1e-6);
    assert!(kinks.iter().any(|kink| (kink.jump + 10.0).abs() < 0.01), "{kinks:?}");
}

/// τ → 0 relaxes at once to k, τ → ∞ never: k(1 + κ).
#[test]
fn a_relaxing_pad_lies_between_its_two_stiffnesses() {
    let rig = Rig::impact(25e3).with_pad(80e3);
    let peak = |tau: f64| {
        let effect = format!("pad-relaxation:ratio=0.5,time_constant_s={tau}");
        strike(&rig, 0.3, 6.0, &[&effect], 0.1).truth().contacts[0]
    };
    let ideal = |pad: f64| 0.3 * (6.0 * Rig::impact(25e3).with_pad(pad).effective_stiffness_n_per_m()).sqrt();
    assert_near("at once", peak(1e-4).peak_n, ideal(80e3), 0.005 * ideal(80e3));
    assert_near("never", peak(100.0).peak_n, ideal(120e3), 1e-3 * ideal(120e3));
    assert!(peak(0.01).loss_j > 10.0 * peak(100.0).loss_j);
}

/// A load-dependent loop: on a bare spring P = kx/(1 ∓ μ), so that the work out over the work in is (1−μ)/(1+μ).
#[test]
fn friction_that_grows_with_load_returns_a_fixed_part_of_the_energy() {
    let impact = strike(&Rig::impact(25e3), 0.3, 6.0, &["load-dependent-friction:coefficient=0.05"], 0.2);
    let contact = impact.truth().contacts[0];
    let returned = (contact.speed_after_m_per_s / 0.3).powi(2);
    assert_near("returned", returned, 0.95 / 1.05, 1e-6);
}

/// What breaks loose jumps: at the first moment of sliding the friction falls from F_s to F_c.
#[test]
fn stiction_lets_go_with_a_jump() {
    let rig = Rig::impact(25e3).with_pad(80e3);
    let impact = strike(&rig, 0.25, 6.0, &["stiction:force_N=4,static_ratio=1.5"], 0.2);
    let friction: Vec<f64> = (0..2000).map(|part| impact.value(Quantity::Friction, f64::from(part) * 1e-6)).collect();
    let most = friction.iter().copied().fold(0.0, f64::max);
    assert_near("held", most, 6.0, 0.03);
    assert_near("slides", friction[1999], 4.0, 1e-9);
}

/// Nothing is different until the threshold and the delay are over; impacts below the threshold never are.
#[test]
fn a_reaction_comes_after_its_threshold_and_its_delay() {
    let rig = Rig::impact(25e3);
    let reaction = "collision-reaction:force_N=80,threshold_N=60,delay_s=0.01,rise_s=0.002";
    let (k, mass, speed) = (25e3_f64, 6.0, 0.3);
    let ideal = strike(&rig, speed, mass, &[], 0.2);
    let impact = strike(&rig, speed, mass, &[reaction], 0.2);
    let pulsation = (k / mass).sqrt();
    let acts = (60.0 / (speed * (k * mass).sqrt())).asin() / pulsation + 0.01;
    assert_near("just before", impact.force_n(acts - 1e-5), ideal.force_n(acts - 1e-5), 1e-4);
    let acceleration = |impact: &Impact, after: f64| impact.value(Quantity::Acceleration, acts + after);
    let grown = acceleration(&impact, 0.002) - acceleration(&ideal, 0.002);
    assert_near("grown for one time constant", grown, -80.0 / mass * (1.0 - (-1.0_f64).exp()), 0.1);
    let at_once = reaction.replace("=0.002", "=0.000001");
    let impact = strike(&rig, speed, mass, &[&at_once], 0.2);
    let jump = acceleration(&impact, 2e-5) - acceleration(&impact, -1e-6);
    assert_near("jump of the acceleration", jump, -80.0 / mass, 0.02);
    let gentle = strike(&rig, 0.1, mass, &[reaction], 0.2);
    assert_eq!(gentle.truth().peak_n, strike(&rig, 0.1, mass, &[], 0.2).truth().peak_n);
}

/// A slow robot is pulled back until it is as fast as it may retreat; a rebound that is faster is left alone.
#[test]
fn a_reaction_retreats_no_faster_than_it_may() {
    let (rig, mass) = (Rig::impact(25e3), 6.0);
    let reaction = "collision-reaction:force_N=80,threshold_N=10,delay_s=0.01,retreat_m_per_s=0.2";
    let after = |speed: f64| strike(&rig, speed, mass, &[reaction], 0.2).value(Quantity::Velocity, 0.2);
    assert_near("slow", after(0.05), -0.2, 0.1);
    // The springs make it faster than that, less what it lost to the pull on its way in.
    assert!((-0.4..-0.25).contains(&after(0.4)), "{}", after(0.4));
    let unlimited = reaction.replace("=0.2", "=50");
    let pulled = strike(&rig, 0.4, mass, &[&unlimited], 0.2).value(Quantity::Velocity, 0.2);
    assert!(pulled < after(0.4) - 1.0, "{pulled}");
}

/// Brakes that hold from 1 ms after the first touch on take their force times the way, in and out: ½·m·v₀² = ½·k·x² + F·(x − v₀·1 ms) and
/// ½·k·x² − F·x = ½·m·v₁². Stronger ones hold the robot against the springs.
#[test]
fn a_reaction_that_stops_brakes_the_rebound_too() {
    let (k, mass, speed) = (25e3_f64, 6.0, 0.3);
    let struck = |force_n: f64| {
        let reaction = format!(
            "collision-reaction:force_N={force_n},threshold_N=0.1,delay_s=0.001,response=1,braking_m_per_s=0.001,rise_s=0.00001"
        );
        strike(&Rig::impact(k), speed, mass, &[&reaction], 0.2)
    };
    let force = 20.0;
    let energy = 0.5 * mass * speed * speed + force * speed * 1e-3;
    let stroke = ((force * force + 2.0 * k * energy).sqrt() - force) / k;
    let after = ((k * stroke - 2.0 * force) * stroke / mass).sqrt();
    let contact = struck(force).truth().contacts[0];
    assert_near("stroke", contact.stroke_m, stroke, 2e-5);
    assert_near("speed after", contact.speed_after_m_per_s, -after, 1e-3);
    let held = struck(150.0);
    assert!(held.force_n(0.2) > 30.0 && held.value(Quantity::Velocity, 0.2).abs() < 1e-3);
    // One that retracts at a controlled speed is there whatever the springs have given it.
    for speed in [0.05, 0.4] {
        let reaction = "collision-reaction:force_N=80,threshold_N=10,delay_s=0.01,retreat_m_per_s=0.2,response=2";
        let impact = strike(&Rig::impact(k), speed, mass, &[reaction], 0.2);
        assert_near("retreat", impact.value(Quantity::Velocity, 0.2), -0.2, 1e-3);
    }
}

/// Friction of the robot's own guide takes its force times the way, like brakes, and leaves nothing behind in the springs; with a static level it
/// takes more.
#[test]
fn the_robots_own_guide_rubs_in_and_out() {
    let (k, mass, speed, force) = (25e3_f64, 6.0, 0.3, 5.0);
    let struck = |friction: &str| strike(&Rig::impact(k), speed, mass, &[friction], 0.2);
    let impact = struck("guide-friction:force_N=5,guide=2,creep_m_per_s=0.0001");
    let stroke = ((force * force + k * mass * speed * speed).sqrt() - force) / k;
    let after = ((k * stroke - 2.0 * force) * stroke / mass).sqrt();
    let contact = impact.truth().contacts[0];
    assert_near("stroke", contact.stroke_m, stroke, 1e-6);
    assert_near("speed after", contact.speed_after_m_per_s, -after, 1e-4);
    assert_near("rest", impact.force_n(0.2), 0.0, 1e-9);
    let stuck = struck("stiction:force_N=5,static_ratio=2,stribeck_m_per_s=0.1,guide=2,creep_m_per_s=0.0001");
    assert!(stuck.truth().contacts[0].speed_after_m_per_s > contact.speed_after_m_per_s + 1e-3);
}

/// Without a pad the springs themselves relax. Left alone they are without force at once, and recover behind the robot.
#[test]
fn relaxing_springs_leave_the_cell_without_force_when_the_robot_has_gone() {
    let impact = strike(&Rig::impact(25e3), 0.3, 6.0, &["pad-relaxation:ratio=0.5,time_constant_s=0.01"], 0.2);
    let end = impact.contact_intervals()[0].1.unwrap();
    let stroke = |since_s: f64| impact.value(Quantity::Stroke, end + since_s);
    assert!(stroke(0.0) > 1e-4);
    for since_s in [1e-6, 1e-3, 0.01, 0.1] {
        assert_near("force", impact.force_n(end + since_s), 0.0, 1e-6);
        // F = 0: x = κz/(1 + κ), so ż = −z/(τ(1 + κ)).
        assert_near("stroke", stroke(since_s), stroke(0.0) * (-since_s / 0.01 / 1.5).exp(), 1e-7);
    }
}

/// It falls from rest: v/g before contact it was let go, and hung at −v²/2g until then.
#[test]
fn what_is_dropped_hangs_until_it_is_let_go() {
    let impact = strike(&Rig::drop(40e3), 0.3, 5.0, &[], 0.1);
    let g = 9.806_65;
    assert_near("let go", impact.released_s(), -0.3 / g, 1e-9);
    let at = |quantity| impact.sample(quantity, &[-0.1, -0.3 / g - 1e-6, -0.01]);
    let height = -0.045 / g;
    for (position, expected) in at(Quantity::Position).into_iter().zip([height, height, -3e-3 + 0.5e-4 * g]) {
        assert_near("position", position, expected, 1e-6);
    }
    assert_eq!(at(Quantity::Velocity)[..2], [0.0, 0.0]);
    assert_eq!(at(Quantity::Acceleration), [0.0, 0.0, g]);
}

/// Energy, p = 1: ½mv² = k·(−L·x − L²·ln(1 − x/L)); the force is k·x/(1 − x/L).
#[test]
fn a_hardening_spring_stops_the_robot_where_its_energy_is_used_up() {
    let (k, mass, speed, lock) = (25e3, 6.0, 0.3, 0.012);
    let contact = strike(&Rig::impact(k), speed, mass, &["hardening:growth_per_m=83.333333333333333,exponent=1"], 0.1)
        .truth()
        .contacts[0];
    let top = contact.stroke_m;
    let stored = k * (-lock * top - lock * lock * (1.0 - top / lock).ln());
    assert_near("energy", stored, 0.5 * mass * speed * speed, 1e-7);
    assert_near("peak", contact.peak_n, k * top / (1.0 - top / lock), 1e-4);
    assert_near("speed after", contact.speed_after_m_per_s, -speed, 1e-7);
    // Far beyond the lock the tangent holds it, behind a pad too.
    let hard = Rig::impact(150e3).with_pad(15e3);
    let bottomed =
        strike(&hard, 0.6, 12.0, &["hardening:growth_per_m=666.66666666666667,exponent=2"], 0.1).truth().contacts[0];
    assert_near("speed after", bottomed.speed_after_m_per_s, -0.6, 1e-5);
}

/// Energy: of Duffing's spring ½k·x²·(1 + (g·x)²/2), of a power law k·x²·(x/L)^q/(2 + q).
#[test]
fn springs_of_duffing_and_hertz_stop_the_robot_where_its_energy_is_used_up() {
    let (k, mass, speed) = (25e3, 6.0, 0.3);
    let of = |law: &str| {
        let contact = strike(&Rig::impact(k), speed, mass, &[&format!("hardening:{law}")], 0.1).truth().contacts[0];
        assert_near("speed after", contact.speed_after_m_per_s, -speed, 1e-7);
        (contact.stroke_m, contact.peak_n)
    };
    let energy = 0.5 * mass * speed * speed;
    let (x, peak) = of("growth_per_m=120,law=1");
    let square = (120.0 * x).powi(2);
    assert_near("Duffing's energy", 0.5 * k * x * x * (1.0 + 0.5 * square), energy, 1e-7);
    assert_near("Duffing's peak", peak, k * x * (1.0 + square), 1e-4);
    let (x, peak) = of("growth_per_m=50,reference_m=0.01,law=2");
    let stiffer = (x / 0.01).sqrt();
    // Below a micrometre it is linear: 10⁻⁴ of the force at that depth.
    assert_near("Hertz' energy", k * x * x * stiffer / 2.5, energy, 1e-6);
    assert_near("Hertz' peak", peak, k * x * stiffer, 1e-3);
}

/// A law that softens takes from what bears: springs of which nine tenths have play push all the same, and give back what they took, but for what
/// following the rate costs.
#[test]
fn what_softens_leaves_springs_with_play_something_to_push_with() {
    let padded = Rig::impact(40e3).with_pad(870e3);
    for (law, lost) in [
        ("hardening:growth_per_m=50,law=2,whole=1", 1e-5),
        ("rate-stiffening:per_e_fold=0.15,delay_s=1e-4,law=1,whole=1", 2e-3),
    ] {
        for effects in [["clearance:gap_m=0.0003,share=0.9", law], [law, "clearance:gap_m=0.0003,share=0.9"]] {
            let contact = strike(&padded, 0.3, 6.0, &effects, 0.1).truth().contacts[0];
            assert_near(law, contact.speed_after_m_per_s, -0.3, lost);
        }
    }
}

/// Where the damping is in proportion to 1/v₀ the speed is but a scale, of which the restitution does not depend.
#[test]
fn lankarani_and_nikravesh_return_the_same_part_at_every_speed() {
    let returned = |speed: f64| {
        let effect = "hunt-crossley-damping:alpha_s_per_m=0.4,law=1";
        -strike(&Rig::impact(25e3), speed, 6.0, &[effect], 0.2).truth().contacts[0].speed_after_m_per_s / speed
    };
    let hunt_and_crossley = strike(&Rig::impact(25e3), 0.25, 6.0, &["hunt-crossley-damping:alpha_s_per_m=0.4"], 0.2);
    assert_near("at 0.25 m/s", returned(0.25), -hunt_and_crossley.truth().contacts[0].speed_after_m_per_s / 0.25, 1e-9);
    for speed in [0.05, 0.6] {
        assert_near("restitution", returned(speed), returned(0.25), 1e-6);
    }
}

/// What pad and springs do alike they do as one spring of their stiffness in series.
#[test]
fn pad_and_springs_that_are_alike_are_one_spring() {
    let padded = Rig::impact(25e3).with_pad(80e3);
    let one = Rig::impact(padded.effective_stiffness_n_per_m());
    for law in [
        "hardening:growth_per_m=60,exponent=1.2",
        "hardening:growth_per_m=80,law=1",
        "hardening:growth_per_m=50,reference_m=0.01,law=2",
        "rate-stiffening:per_e_fold=0.06,memory_s=0.5",
        "rate-stiffening:per_e_fold=0.03,law=1",
        "mullins-softening:excess=0.2,hits=3",
        "hunt-crossley-damping:alpha_s_per_m=0.2",
        "hunt-crossley-damping:alpha_s_per_m=0.3,law=1",
    ] {
        let whole = strike(&padded, 0.3, 6.0, &[&format!("{law},whole=1")], 0.1);
        let alone = strike(&one, 0.3, 6.0, &[law], 0.1);
        let pad_only = strike(&padded, 0.3, 6.0, &[law], 0.1);
        let peak = alone.truth().peak_n;
        assert_near(law, whole.truth().peak_n, peak, 1e-5 * peak);
        assert!((pad_only.truth().peak_n / peak - 1.0).abs() > 1e-3, "{law}: the pad alone is something else");
        for part in 1..10 {
            let time = 0.005 * f64::from(part);
            assert_near(law, whole.force_n(time), alone.force_n(time), 2e-5 * peak);
        }
    }
}

/// What the chain does to a half sine can be written down for every sample.
#[test]
fn drift_rails_hum_and_gain_act_on_every_sample_as_written() {
    let (k, mass, speed) = (25e3_f64, 6.0, 0.25);
    let peak = speed * (k * mass).sqrt();
    let times: Vec<f64> = (-100..1000).map(|index| f64::from(index) * 1e-4).collect();
    let ideal = strike(&Rig::impact(k), speed, mass, &[], 0.2).measured_n(&times);
    let with = |effect: &str| strike(&Rig::impact(k), speed, mass, &[effect], 0.2).measured_n(&times);
    let drift = with("charge-drift:rate_N_per_s=0.5");
    let rails = with("clipping:limit_N=60,knee=0.00001");
    let hum = with("mains-hum:amplitude_N=0.7,frequency_Hz=60,phase_rad=1");
    let gain = with("gain-error:relative=-0.03");
    for (number, time) in times.iter().enumerate() {
        let force = ideal[number];
        assert_near("drift", drift[number], force + 0.5 * (time + 0.01), 1e-9);
        assert_near("rails", rails[number], force.min(60.0), 1e-3);
        assert_near("hum", hum[number], force + 0.7 * (2.0 * PI * 60.0 * time + 1.0).sin(), 1e-9);
        assert_near("gain", gain[number], 0.97 * force, 1e-9);
    }
    let flat = rails.iter().filter(|force| **force == 60.0).count() as f64 * 1e-4;
    assert_near("flat top", flat, (mass / k).sqrt() * (PI - 2.0 * (60.0 / peak).asin()), 2e-4);
    let faster = strike(&Rig::impact(k), speed, mass, &["speed-error:relative=0.05"], 0.2);
    assert_near("faster", faster.truth().peak_n, 1.05 * peak, 1e-5);
    let ahead = strike(&Rig::impact(k), speed, mass, &["speed-error:relative=0.05,exponent=1"], 0.2);
    assert_near("ahead", ahead.truth().peak_n, (1.0 + 0.05 * 0.25 / speed) * peak, 1e-5);
    let short = strike(&Rig::impact(k), speed, mass, &["speed-error:relative=-0.05,exponent=-2"], 0.2);
    assert_near("too short a way", short.truth().peak_n, (1.0 - 0.05 * (speed / 0.25).powi(2)) * peak, 1e-5);
}

/// A log that counts samples shows at its end what came later, though no sample of that time was asked for.
#[test]
fn a_recording_that_has_lost_samples_ends_later_than_it_says() {
    let times: Vec<f64> = (-100..200).map(|index| f64::from(index) * 1e-4).collect();
    let lost =
        strike(&Rig::impact(25e3), 0.25, 6.0, &["lost-samples:lost_s=0.01,at_s=0.0105"], 0.02).measured_n(&times);
    let ideal = strike(&Rig::impact(25e3), 0.25, 6.0, &[], 0.2);
    for (time, force) in times.iter().zip(lost) {
        let happened = if *time < 0.0105 { *time } else { time + 0.01 };
        assert_near("shown", force, ideal.force_n(happened), if (time - 0.0105).abs() < 1e-6 { 20.0 } else { 0.02 });
    }
}
