use serde_json::json;

use super::super::hidden;
use super::*;

/// A case that hides these effects with d of 30 each, in the rise.
fn hides(effects: &[&str], right_verdict: &str) -> Hidden {
    let effects: Vec<_> = effects
        .iter()
        .map(|id| {
            json!({ "id": id, "listed": true, "resembles": [], "d": 30.0, "d_beside_others": 30.0, "recordings": ["001"],
                "parameters": [{ "name": "force", "value": 2.0 }] })
        })
        .collect();
    let place = json!({ "phase": "rise", "shares": [0.0, 0.7, 0.3, 0.0], "recordings": ["001"] });
    let answers = json!({ "format": "thud-answers/1", "seed": 1, "cases": [{
        "case": "a", "way": if effects.is_empty() { "absent" } else { "unnamed" }, "kind": "impact", "seed": 2, "without": [],
        "right_verdict": right_verdict, "d": 30.0, "benign_d": 1.0, "effects": effects, "rest": place,
        "stated_r_squared": 0.99, "true_model_rmse": 0.3 }] });
    hidden::read(answers.to_string().as_bytes()).unwrap().cases.remove(0)
}

/// An answer that names these, each with what it cannot be told from.
fn says(verdict: &str, named: &[(&str, &[&str])], phase: &str) -> Ended {
    let mechanisms: Vec<_> = named
        .iter()
        .map(|(id, others)| {
            json!({ "id": id, "indistinguishable_from": others, "parameters": [
                { "name": "force_N", "value": 2.2, "low": 1.9, "high": 2.5 }, { "name": "cell_share", "value": 0.0, "low": 0.0, "high": 0.0 }] })
        })
        .collect();
    let said = json!({ "verdict": verdict, "baseline": { "held_out_rmse": 0.6, "noise_rms": 0.3 },
        "where": [{ "phase": "after", "recordings": ["001"], "share": 0.1, "p_value": 0.2 },
                  { "phase": phase, "recordings": ["001"], "share": 0.9, "p_value": 0.001 }],
        "mechanisms": mechanisms, "model": { "held_out_rmse": 0.303 }, "unexplained": { "held_out_rmse": 0.45 } });
    Ended::Said(Box::new(serde_json::from_value(said).unwrap()))
}

#[test]
fn the_right_name_is_first_exact_and_within() {
    let judged =
        judge(&hides(&["guide-friction"], "named"), &says("named", &[("guide-friction", &[])], "rise"), 1.0, None);
    assert!(judged.first && judged.exact && judged.within && judged.right && !judged.wrong_and_confident);
    assert_eq!((judged.set, judged.right_phase, judged.p_value), (Some(1), Some(true), Some(0.001)));
    assert!((judged.over_true.unwrap() - 1.01).abs() < 1e-9);
    assert!((judged.way_to_noise.unwrap() - 0.99).abs() < 1e-9);
    // One parameter has a true value, and it lies in its interval.
    let [one] = &judged.parameters[..] else { panic!("{:?}", judged.parameters) };
    assert!((one.error - 0.1).abs() < 1e-9 && one.covered == Some(true));
}

#[test]
fn a_wrong_name_is_confident_unless_it_comes_with_others() {
    let hidden = hides(&["guide-friction"], "named");
    let wrong = judge(&hidden, &says("named", &[("stiction", &[])], "rise"), 1.0, None);
    assert!(wrong.wrong_and_confident && !wrong.first && !wrong.within && !wrong.right);
    let set = judge(&hidden, &says("ambiguous", &[("stiction", &["guide-friction"])], "rise"), 1.0, None);
    assert!(!set.wrong_and_confident && set.within && set.right && !set.first);
    assert_eq!(set.set, Some(2));
    // A second name that is not hidden is one too many.
    let second = judge(&hidden, &says("named", &[("guide-friction", &[]), ("mains-hum", &[])], "rise"), 1.0, None);
    assert!(second.first && !second.exact && second.wrong_and_confident);
    // Who says that something has no name is not confident.
    let unexplained = judge(&hidden, &says("unexplained", &[("stiction", &[])], "rise"), 1.0, None);
    assert!(!unexplained.wrong_and_confident && !unexplained.right);
}

#[test]
fn of_two_both_must_be_named() {
    let hidden = hides(&["guide-friction", "end-stop"], "named");
    let both = judge(&hidden, &says("named", &[("end-stop", &[]), ("guide-friction", &[])], "rise"), 1.0, None);
    assert!(both.exact && both.within && both.first);
    let one = judge(&hidden, &says("named", &[("end-stop", &[])], "rise"), 1.0, None);
    assert!(!one.exact && !one.within && one.first && !one.wrong_and_confident);
}

#[test]
fn where_nothing_is_hidden_only_consistent_is_right() {
    let hidden = hides(&[], "consistent");
    assert!(judge(&hidden, &says("consistent", &[], "rise"), 1.0, None).right);
    let alarm = judge(&hidden, &says("named", &[("end-stop", &[])], "rise"), 1.0, None);
    assert!(!alarm.right && alarm.wrong_and_confident && alarm.right_phase.is_none());
}

#[test]
fn what_is_not_in_the_list_is_to_be_unexplained_and_modelled() {
    let hidden = hides(&["tip-slip"], "unexplained");
    let judged = judge(&hidden, &says("unexplained", &[], "fall"), 1.0, None);
    assert!(judged.right && judged.right_phase == Some(true), "the fall holds three tenths");
    assert!((judged.way_to_noise.unwrap() - 0.5).abs() < 1e-9, "the map's own rmse counts");
    assert_eq!(judge(&hidden, &says("unexplained", &[], "after"), 1.0, None).right_phase, Some(false));
}

#[test]
fn no_answer_is_wrong_everywhere() {
    let judged = judge(&hides(&["guide-friction"], "named"), &Ended::Failed("it crashed".to_owned()), 3.0, None);
    assert!(!judged.first && !judged.exact && !judged.within && !judged.right && judged.over_true.is_none());
    assert_eq!(judged.verdict, "failed");
}
