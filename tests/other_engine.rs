//! Rigs that another engine moves: what MuJoCo was told is what a diagnosis of its recordings finds, or nothing where nothing was.
//!
//! The concealing simulator is ours, and what both of ours leave out neither shows. MuJoCo's bodies, joints, tendons, actuators and air are other
//! people's.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;
use tool::{run_in, told};

mod python;
mod tool;

/// Parameters are found within this part of what the engine was told, or their interval holds it.
const AGREEMENT: f64 = 0.05;

/// Rigs in a folder each, and what is true of them.
fn rigs(folder: &TempDir) -> Option<Value> {
    let python = python::python("mujoco, numpy")?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/mujoco_rigs.py");
    let output = Command::new(python).arg(script).arg(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

/// What is not as the engine has it, in words.
fn disagreements(name: &str, truth: &Value, answer: &Value) -> Vec<String> {
    let mechanisms = answer["mechanisms"].as_array().unwrap();
    let ids: Vec<&Value> = mechanisms.iter().map(|one| &one["id"]).collect();
    let Some(id) = truth["mechanism"].as_str() else {
        let consistent = answer["verdict"] == "consistent";
        return if consistent { Vec::new() } else { vec![format!("{name}: {} {ids:?}", answer["verdict"])] };
    };
    if answer["verdict"] == "unexplained" || ids != [id] {
        return vec![format!("{name}: {} {ids:?}, and it was {id}", answer["verdict"])];
    }
    let wrong = truth["parameters"].as_object().unwrap().iter().filter_map(|(parameter, value)| {
        let found =
            mechanisms[0]["parameters"].as_array().unwrap().iter().find(|one| one["name"] == **parameter).unwrap();
        let of = |key: &str| found[key].as_f64().unwrap();
        let value = value.as_f64().unwrap();
        let agrees = (of("value") / value - 1.0).abs() < AGREEMENT || of("low") <= value && value <= of("high");
        (!agrees).then(|| format!("{name}: {found}, and it was {value}"))
    });
    wrong.collect()
}

#[test]
fn what_another_engine_was_told_is_found() {
    let folder = TempDir::new().unwrap();
    let Some(truth) = rigs(&folder) else { return };
    let mut wrong = Vec::new();
    for (name, truth) in truth.as_object().unwrap() {
        let answer = told(run_in(folder.path(), &["diagnose", name, "--json", "-"]));
        wrong.extend(disagreements(name, truth, &serde_json::from_str(&answer).unwrap()));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
