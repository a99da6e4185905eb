//! Whatever a search may try, the rig answers: random effects of plausible strength, alone and together.

use proptest::prelude::*;
use thud_sim::mechanism::{Effect, LIST, Scale};
use thud_sim::rig::{Accuracy, Approach, Quantity, Rig, RigError};

/// A mechanism of the list with plausible values.
fn effect() -> impl Strategy<Value = Effect> {
    (0..LIST.len(), proptest::collection::vec(0.0..=1.0, 4)).prop_map(|(place, parts)| {
        let mut effect = LIST[place].typical();
        for (number, parameter) in LIST[place].parameters.iter().enumerate() {
            let ((low, high), part): (_, f64) = (parameter.plausible, parts[number]);
            let value = match parameter.scale {
                Scale::Linear => low + (high - low) * part,
                Scale::Logarithmic => low * f64::powf(high / low, part),
            };
            effect.set_value(number, value.clamp(low, high)).expect("plausible is possible");
        }
        effect
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]

    #[test]
    fn no_plausible_effects_defeat_the_rig(
        effects in proptest::collection::vec(effect(), 0..4),
        body in 10e3..150e3_f64,
        pad in proptest::option::of(15e3..2e6_f64),
        speed in 0.05..0.6_f64,
        mass in 3.0..13.0_f64,
    ) {
        let rig = Rig { pad_stiffness_n_per_m: pad, ..Rig::impact(body) };
        let approach = Approach::new(speed, mass);
        let names: Vec<String> = effects.iter().map(ToString::to_string).collect();
        let impact = rig.strike(&approach, &effects, 0.3, Accuracy::default());
        // Known limit: a light piece that rubs may rattle against the leaving robot without end. It is reported, not hidden.
        let has = |part: &str| effects.iter().any(|effect| effect.mechanism().id.contains(part));
        let rattles = has("moving-piece") && (has("friction") || has("stiction"));
        if rattles && matches!(impact, Err(RigError::Chattering { .. })) {
            return Ok(());
        }
        let impact = impact.map_err(|error| TestCaseError::fail(format!("{error}: {names:?}")))?;
        let times: Vec<f64> = (-20..3000).map(|index| f64::from(index) * 1e-4).collect();
        prop_assert!(impact.measured_n(&times).iter().all(|force| force.is_finite()));
        let contact = impact.sample(Quantity::ContactForce, &times);
        let peak = impact.truth().peak_n;
        prop_assert!(contact.iter().all(|force| *force >= -1e-4 * (1.0 + peak)), "the robot is never pulled: {names:?}");
        let passive = effects.iter().all(|effect| !["robot-push", "collision-reaction"].contains(&effect.mechanism().id));
        // What one contact left in a ringing piece the next may give back, so only the sum is never negative.
        let loss: f64 = impact.truth().contacts.iter().map(|contact| contact.loss_j).sum();
        let energy = 0.5 * mass * speed * speed;
        prop_assert!(!passive || loss > -1e-4 * energy, "{} J from nothing: {names:?}", -loss);
    }
}
