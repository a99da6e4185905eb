//! Laws and their motions against closed forms, against the equation of motion integrated anew, and against the equations as printed.

use super::law::{Damping, Law, Values};
use super::{LAWS, loss_of_restitution, restitution, restitution_of_loss};

fn values(exponent: f64, damping: f64) -> Values {
    Values { reference_m: 0.01, reference_n: 250.0, exponent, damping }
}

fn law(id: &str) -> &'static Law {
    Law::named(id).unwrap_or_else(|| panic!("{id}"))
}

/// e of k·δⁿ·(1 + λ·δ̇) by the trapezoidal rule in δ̇ (m·v·dv = −F dδ), which shares nothing with the motion in time.
fn by_energy(loss: f64) -> f64 {
    const STEPS: usize = 200_000;
    // ∫ v/(1 + λv) dv from 0 to the speed, with v₀ = 1.
    let integral = |to: f64, sign: f64| {
        let step = to / STEPS as f64;
        let at = |v: f64| v / (1.0 + sign * loss * v);
        (0..STEPS).map(|place| 0.5 * step * (at(place as f64 * step) + at((place as f64 + 1.0) * step))).sum::<f64>()
    };
    let stored = integral(1.0, 1.0);
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if integral(middle, -1.0) < stored { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Paper 1, eq. 10 to 12: χ = (3/2)·α·k, and c_r = 1 − α·v₀ printed.
#[test]
fn hunt_and_crossley_give_another_restitution_than_is_printed() {
    let speed = 0.5;
    for (alpha_v, printed, right) in [(0.1, 0.90, 0.909), (0.3, 0.70, 0.768), (0.5, 0.50, 0.663)] {
        let values = values(1.3, alpha_v / speed);
        let law = law("hunt-crossley");
        let moves = restitution(law, &values, 6.0, speed);
        assert!((moves - right).abs() < 6e-4, "{alpha_v}: {moves}");
        assert!((moves - restitution_of_loss(1.5 * alpha_v)).abs() < 1e-4);
        assert!((restitution_of_loss(1.5 * alpha_v) - by_energy(1.5 * alpha_v)).abs() < 1e-6);
        // The printed one is what the law claims, and it is wrong.
        let claims = law.claimed_restitution(&values, speed).unwrap_or_default();
        assert!((claims - printed).abs() < 1e-12 && moves - claims > 0.008, "{claims}");
        // 1/(1 + α·v₀) is right within 0.004; so α = (1 − e)/(e·v₀).
        assert!((moves - 1.0 / (1.0 + alpha_v)).abs() < 5e-3);
        let alpha = (1.0 - moves) / (moves * speed);
        let printed_alpha = (1.0 - moves) / speed;
        assert!((alpha * speed / alpha_v - 1.0).abs() < 0.02 && (printed_alpha * speed / alpha_v - 1.0).abs() > 0.08);
    }
}

/// The same restitution for any mass, stiffness and exponent, which the implicit equation says.
#[test]
fn the_restitution_of_a_hysteresis_asks_for_neither_mass_nor_exponent() {
    for (mass, exponent, stiffer) in [(1.0, 1.0, 1.0), (12.0, 1.5, 1.0), (6.0, 2.2, 30.0), (6.0, 0.8, 0.2)] {
        let mut values = values(exponent, 0.4);
        values.reference_n *= stiffer;
        let moves = restitution(law("flores"), &values, mass, 0.3);
        assert!((moves - restitution_of_loss(0.4)).abs() < 5e-4, "{mass} kg, n = {exponent}: {moves}");
    }
    for loss in [-0.3, -1e-3, 1e-9, 1e-3, 0.1, 1.0, 30.0] {
        let e = restitution_of_loss(loss);
        let rest = |x: f64| x - x.ln_1p();
        // Where e·x is all but 1, its logarithm has few digits.
        let digits = if loss > 10.0 { 1e-4 } else { 1e-8 };
        assert!((rest(loss) - rest(-e * loss)).abs() < digits * rest(loss).abs().max(1e-8), "{loss}: {e}");
        if loss > 0.0 {
            assert!((loss_of_restitution(e) / loss - 1.0).abs() < 1e-4, "{loss}");
        }
    }
}

#[test]
fn laws_of_a_claimed_restitution_have_the_published_losses_and_back() {
    for (id, c, published) in [
        ("lankarani-nikravesh", 0.8, 0.75 * 0.36),
        ("lankarani-nikravesh", 0.0, 0.75),
        ("flores", 0.8, 8.0 * 0.2 / (5.0 * 0.8)),
        ("flores", 0.2, 8.0 * 0.8 / (5.0 * 0.2)),
        ("gonthier", 0.8, 0.36 / 0.8),
        ("gonthier", 0.2, 0.96 / 0.2),
    ] {
        let Damping::OverSpeed { loss, restitution } = law(id).damping else { panic!("{id}") };
        assert!((loss(c) - published).abs() < 1e-12, "{id}");
        assert!((restitution(published) - c).abs() < 1e-12, "{id}");
    }
    // How honest they are where the loss is large: e that the law gives for a claimed one of 0.5.
    let gives = |id: &str| {
        let Damping::OverSpeed { loss, .. } = law(id).damping else { panic!("{id}") };
        restitution_of_loss(loss(0.5))
    };
    assert!((gives("flores") - 0.5).abs() < 0.05, "{}", gives("flores"));
    assert!(gives("lankarani-nikravesh") > 0.7, "for nearly elastic impacts only");
    assert!((gives("gonthier") - 0.5).abs() < 0.05, "{}", gives("gonthier"));
}

#[test]
fn a_linear_contact_is_a_half_sine() {
    let motion = law("linear").motion(&values(1.0, 0.0), 4.0, 0.3, 0.0);
    let omega = (25_000.0_f64 / 4.0).sqrt();
    assert!((motion.peak_n() / (0.3 * (25_000.0_f64 * 4.0).sqrt()) - 1.0).abs() < 2e-5);
    assert!((motion.end_s / (std::f64::consts::PI / omega) - 1.0).abs() < 1e-6, "{}", motion.end_s);
    assert!((motion.restitution() - 1.0).abs() < 1e-5 && motion.separates, "{}", motion.restitution());
    for part in [0.1, 0.5, 0.77] {
        let time = part * motion.end_s;
        let half_sine = 0.3 * (25_000.0_f64 * 4.0).sqrt() * (omega * time).sin();
        assert!((motion.force_at(time) - half_sine).abs() < 1e-4 * motion.peak_n());
    }
    assert_eq!((motion.force_at(-1e-9), motion.force_at(1.0)), (0.0, 0.0));
}

/// Peak and duration of δⁿ in closed form: δ_max by energy; T = 2·(δ_max/v₀)·∫dx/√(1 − x^(n+1)), 2.9432·δ_max/v₀ for n = 1.5.
#[test]
fn an_elastic_contact_has_hertz_peak_and_duration() {
    let values = values(1.5, 0.0);
    let (mass, speed) = (6.0, 0.25);
    let motion = law("hertz").motion(&values, mass, speed, 0.0);
    let deepest = (1.25 * mass * speed * speed / values.stiffness()).powf(0.4);
    assert!((motion.peak_n() / (values.stiffness() * deepest.powf(1.5)) - 1.0).abs() < 1e-4);
    assert!((motion.end_s * speed / deepest - 2.9432).abs() < 1e-3, "{}", motion.end_s * speed / deepest);
    assert!((motion.restitution() - 1.0).abs() < 1e-5);
}

/// The closed form that the law's own page states; a law that pulls would lose more.
#[test]
fn a_dashpot_that_lets_go_rebounds_by_its_closed_form() {
    let mass = 4.0;
    for damping in [10.0, 60.0, 200.0] {
        let zeta: f64 = damping / (2.0 * (25_000.0_f64 * mass).sqrt());
        let root = (1.0 - zeta * zeta).sqrt();
        let closed = (-zeta / root * 2.0 * (root / zeta).atan()).exp();
        let pulling = (-std::f64::consts::PI * zeta / root).exp();
        for speed in [0.1, 0.5] {
            let values = values(1.0, damping);
            let motion = law("kelvin-voigt").motion(&values, mass, speed, 0.0);
            assert!((motion.restitution() - closed).abs() < 1e-4, "{damping}: {} {closed}", motion.restitution());
            assert!(closed > pulling && motion.force_n.iter().all(|force| *force >= 0.0));
            assert!((motion.force_n[0] - damping * speed).abs() < 1e-9, "it begins with a step");
            assert!(motion.depth_m.last().is_some_and(|depth| *depth > 0.0), "it ends while it is pressed in");
        }
    }
}

#[test]
fn every_law_is_described_once_and_pushes_only() {
    for (place, law) in LAWS.iter().enumerate() {
        assert!(LAWS[..place].iter().all(|other| other.id != law.id));
        assert!(law.equation.starts_with("F = ") && !law.source.is_empty());
        assert!(law.contains(law) && law.same_force(law));
        let force = law.force(&values(1.5, 3.0), 0.2);
        for (depth, rate) in [(-0.001, 0.2), (0.0, -0.2), (0.001, -5.0), (0.01, -0.3), (0.01, 0.3)] {
            assert!(force.at(depth, rate) >= 0.0, "{} pulls", law.id);
        }
        assert_eq!(force.at(-1e-6, 0.2), 0.0, "{} acts before contact", law.id);
    }
    let same = |a: &str, b: &str| law(a).same_force(law(b));
    assert!(same("flores", "gonthier") && same("flores", "lankarani-nikravesh") && !same("flores", "hunt-crossley"));
    assert!(law("hunt-crossley").contains(law("hertz")) && law("kelvin-voigt").contains(law("linear")));
    assert!(!law("kelvin-voigt").contains(law("hertz")) && !law("hertz").contains(law("hunt-crossley")));
}

/// Gravity lets a drop go deeper: mg + √((mg)² + k·m·v²) at the top, paper 1, eq. 24 corrected.
#[test]
fn a_drop_goes_deeper() {
    let motion = law("linear").motion(&values(1.0, 0.0), 0.5, 0.9, 9.81);
    let weight = 0.5 * 9.81;
    let peak = weight + (weight * weight + 25_000.0 * 0.5 * 0.81_f64).sqrt();
    assert!((motion.peak_n() / peak - 1.0).abs() < 1e-4, "{} {peak}", motion.peak_n());
}
