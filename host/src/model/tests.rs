//! The model format.

use super::*;
use crate::campaign::Estimate;

const TEXT: &str = r#"format = "thud-model/1"
name = "chest rig, as diagnosed"

[rig]
kind = "impact"
body_stiffness_N_per_m = { value = 25120.0, sd = 60.0 }

[[mechanism]]
id = "guide-friction"
[mechanism.parameters]
force_N = { value = 2.1, low = 1.9, high = 2.3 }
cell_share = { value = 0.0 }
"#;

#[test]
fn a_model_is_read_and_written_back() {
    let model = Model::parse("model.toml", TEXT).unwrap();
    assert_eq!(model.rig.body_stiffness_n_per_m, Some(Estimate::new(25_120.0, 60.0)));
    assert_eq!(model.effects(), [Effect::new("guide-friction", &[("force_N", 2.1), ("cell_share", 0.0)]).unwrap()]);
    let mut intervals = vec![None; model.mechanisms[0].intervals.len()];
    intervals[0] = Some(Interval { low: 1.9, high: 2.3 });
    assert_eq!(model.mechanisms[0].intervals, intervals);
    assert_eq!(Model::parse("again.toml", &model.to_toml()).unwrap(), model);
}

#[test]
fn a_mechanism_may_act_in_one_configuration_only() {
    let text =
        TEXT.replace("id = \"guide-friction\"", "id = \"guide-friction\"\nconfiguration = \"arm \\\"stretched\\\"\"");
    let model = Model::parse("model.toml", &text).unwrap();
    assert!(model.effects().is_empty());
    assert_eq!(model.limited()[0].1, "arm \"stretched\"");
    assert_eq!(Model::parse("again.toml", &model.to_toml()).unwrap(), model);
    // The same mechanism elsewhere is another statement.
    assert!(Model::parse("both.toml", &format!("{text}\n[[mechanism]]\nid = \"guide-friction\"\n")).is_ok());
}

#[test]
fn every_mechanism_with_its_typical_values_goes_through_a_file() {
    let rig = Model::parse("model.toml", TEXT).unwrap().rig;
    let mechanisms =
        thud_sim::mechanism::LIST.iter().map(|mechanism| ModelMechanism::held(mechanism.typical())).collect();
    let model = Model { name: "all \"of\" them".to_owned(), rig, mechanisms };
    assert_eq!(Model::parse("model.toml", &model.to_toml()).unwrap(), model);
}

#[test]
fn every_fault_is_placed_and_named() {
    for (from, to, line, column, problem) in [
        ("model/1", "model/9", 1, 10, "the format is"),
        ("guide-friction", "rust", 9, 6, "no mechanism is called `rust`"),
        ("force_N", "force_kN", 11, 1, "no parameter `force_kN`"),
        ("value = 2.1", "value = -2.1", 11, 11, "is -2.1"),
        ("low = 1.9", "low = 2.2", 11, 11, "does not hold its value"),
        (", high = 2.3", "", 11, 11, "does not hold its value"),
        ("kind = \"impact\"", "kind = \"crash\"", 5, 8, "`kind` is \"crash\""),
        ("name", "title", 2, 1, "unknown field `title`"),
    ] {
        let text = TEXT.replacen(from, to, 1);
        let error = Model::parse("model.toml", &text).expect_err(to);
        assert!(error.problem().contains(problem), "{to}: {error}");
        assert_eq!((error.line(), error.column()), (Some(line), Some(column)), "{to}: {error}");
    }
    let twice = format!("{TEXT}\n[[mechanism]]\nid = \"guide-friction\"\n");
    assert!(Model::parse("model.toml", &twice).unwrap_err().problem().contains("twice"));
}
