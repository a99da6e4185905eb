//! Campaigns of the concealing simulator, which shares nothing with the tool's own: nothing hidden is `consistent`, and one plain effect
//! is named. A sample; the seeds were not chosen for their outcome.

use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;
use thud_conceal::effect;
use thud_conceal::mix::{self, Mix};
use thud_conceal::{case, files};
use tool::json;

mod tool;

/// What the tool says to a campaign, in a process that has nothing but the campaign.
fn diagnosed(campaign: &Path) -> Value {
    json(&["diagnose", campaign.to_str().unwrap()])
}

fn named(answer: &Value) -> Vec<String> {
    answer["mechanisms"].as_array().unwrap().iter().map(|m| m["id"].as_str().unwrap().to_owned()).collect()
}

/// Every mechanism that the answer could mean: the named ones and those it cannot tell from them.
fn meant(answer: &Value) -> Vec<String> {
    let mut all = named(answer);
    for mechanism in answer["mechanisms"].as_array().unwrap() {
        all.extend(
            mechanism["indistinguishable_from"].as_array().unwrap().iter().map(|id| id.as_str().unwrap().to_owned()),
        );
    }
    all
}

#[test]
fn where_nothing_is_hidden_the_simulation_holds() {
    let folder = TempDir::new().unwrap();
    for request in mix::requests(Mix::Absent, 4, 20, 8) {
        let name = format!("{:x}", request.seed);
        files::write(&case::make(&request), &folder.path().join(&name), &name).unwrap();
        let answer = diagnosed(&folder.path().join(&name));
        assert_eq!(answer["verdict"], "consistent", "seed {}: {:?}", request.seed, named(&answer));
    }
}

/// The fourth request of an effect is a plain one (d of 60 and more). Four of five: a pad that relaxes in three branches at once is
/// taken for an elastic joint (docs/diagnosis-open.md).
#[test]
fn one_plain_effect_is_named() {
    let folder = TempDir::new().unwrap();
    let effects = ["hunt-crossley-damping", "guide-friction", "pad-relaxation", "piezo-discharge", "joint-elasticity"];
    let mut missed = Vec::new();
    for id in effects {
        let request = mix::only(effect::named(id).unwrap(), 4, 20, 8).pop().unwrap();
        let campaign = folder.path().join(id);
        files::write(&case::make(&request), &campaign, id).unwrap();
        let answer = diagnosed(&campaign);
        let (before, after) = (&answer["baseline"]["held_out_rmse"], &answer["model"]["held_out_rmse"]);
        assert!(after.as_f64() < before.as_f64(), "{id}: {before} N to {after} N");
        if !meant(&answer).iter().any(|meant| meant == id) {
            missed.push(format!("{id}: {} {:?}", answer["verdict"], meant(&answer)));
        }
    }
    assert!(missed.len() <= 1, "{missed:?}");
}
