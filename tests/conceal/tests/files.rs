//! What is written is a campaign as the contract has it, and the answer stays apart.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn fresh(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn conceal(arguments: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_thud-conceal")).args(arguments).output().expect("it runs")
}

fn check_campaign(folder: &Path) -> usize {
    let text = fs::read_to_string(folder.join("campaign.toml")).expect("campaign.toml");
    let campaign: toml::Table = text.parse().expect("TOML");
    assert_eq!(campaign["format"].as_str(), Some("thud-campaign/1"));
    let keys: Vec<&str> = campaign.keys().map(String::as_str).collect();
    assert!(keys.iter().all(|k| ["format", "name", "rig", "chain", "recording"].contains(k)), "{keys:?}");
    let kind = campaign["rig"]["kind"].as_str().expect("a kind");
    let chain = &campaign["chain"];
    let observed = chain["observed"].as_str().expect("a channel");
    let rate = chain["sample_rate_Hz"].as_float().expect("a rate");
    let noise = chain["noise_rms_N"].as_float().expect("a noise");
    let full_scale = chain["full_scale_N"].as_float().expect("a full scale");
    let estimate = |value: &toml::Value| {
        let (value, sd) = (value["value"].as_float().expect("value"), value["sd"].as_float().expect("sd"));
        assert!(sd > 0.0);
        value
    };
    if kind == "fall" {
        assert_eq!(observed, "height_m");
    } else {
        assert_eq!(observed, "force_N");
        assert!(estimate(&campaign["rig"]["body_stiffness_N_per_m"]) >= 9e3);
        assert!(estimate(&campaign["rig"]["pad_stiffness_N_per_m"]) >= 9e3);
    }
    let recordings = campaign["recording"].as_array().expect("recordings");
    for recording in recordings {
        let speed = estimate(&recording["impact_speed_m_per_s"]);
        assert!(kind == "fall" || (0.02..1.5).contains(&speed), "{speed}");
        assert!(estimate(&recording["effective_mass_kg"]) > 0.0);
        assert!(recording["configuration"].as_str().is_some());
        let mut reader =
            csv::Reader::from_path(folder.join(recording["file"].as_str().expect("a file"))).expect("a CSV");
        assert_eq!(reader.headers().expect("a header"), &csv::StringRecord::from(vec!["time_s", observed]));
        let rows: Vec<(f64, f64)> = reader.deserialize().map(|row| row.expect("two numbers")).collect();
        assert!(rows.len() > 200);
        assert!(rows.windows(2).all(|w| w[1].0 > w[0].0), "time rises");
        assert!(rows.windows(2).all(|w| ((w[1].0 - w[0].0) * rate - 1.0).abs() < 1e-2));
        assert!(rows.iter().all(|(_, y)| y.abs() <= full_scale));
        // Quiet for the first 25 ms: the noise that is stated, about a zero of its own.
        let quiet: Vec<f64> = rows.iter().take_while(|(t, _)| *t < 0.025).map(|r| r.1).collect();
        let mean = quiet.iter().sum::<f64>() / quiet.len() as f64;
        let rms = (quiet.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / quiet.len() as f64).sqrt();
        assert!(rms > 0.2 * noise && rms < 2.5 * noise, "{rms} where {noise} is stated");
    }
    recordings.len()
}

#[test]
fn a_chosen_effect_makes_a_campaign_and_an_answer() {
    let place = fresh("chosen");
    let (out, answer) = (place.join("riddle"), place.join("answer.json"));
    let run = conceal(&[
        "conceal",
        "--effect",
        "robot-push",
        "--strength",
        "15",
        "--seed",
        "3",
        "--recordings",
        "5",
        "--out",
        out.to_str().expect("UTF-8"),
        "--answer",
        answer.to_str().expect("UTF-8"),
    ]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert_eq!(check_campaign(&out), 5);
    let text = fs::read_to_string(&answer).expect("the answer");
    let answer: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let case = &answer["cases"][0];
    assert_eq!(case["effects"][0]["id"], "robot-push");
    assert_eq!(case["right_verdict"], "named");
    assert!((case["d"].as_f64().expect("d") / 15.0 - 1.0).abs() < 0.05);
    assert!(
        (case["true_model_rmse"].as_f64().expect("rmse") / case["noise_rms"].as_f64().expect("rms") - 1.0).abs() < 0.1
    );
    // The campaign does not say what is hidden in it.
    let campaign = fs::read_to_string(out.join("campaign.toml")).expect("campaign.toml");
    assert!(!campaign.contains("push"));
}

#[test]
fn drawn_cases_of_every_kind_are_campaigns_and_come_again_with_the_seed() {
    let place = fresh("drawn");
    let draw = |name: &str, threads: &str| {
        let (out, answers) = (place.join(name), place.join(format!("{name}.json")));
        let run = conceal(&[
            "draw",
            "--cases",
            "10",
            "--seed",
            "12",
            "--mix",
            "frozen",
            "--recordings",
            "4",
            "--threads",
            threads,
            "--out",
            out.to_str().expect("UTF-8"),
            "--answers",
            answers.to_str().expect("UTF-8"),
        ]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        (out, fs::read_to_string(answers).expect("the answers"))
    };
    let (first, answers) = draw("first", "2");
    let (second, again) = draw("second", "1");
    assert_eq!(answers, again);
    for case in 1..=10 {
        let name = format!("case-{case:04}");
        assert_eq!(check_campaign(&first.join(&name)), 4);
        let file = "recordings/003.csv";
        let read = |folder: &Path| fs::read(folder.join(&name).join(file)).expect("a recording");
        assert_eq!(read(&first), read(&second));
    }
    let answers: serde_json::Value = serde_json::from_str(&answers).expect("JSON");
    let ways: Vec<&str> = (0..10).map(|i| answers["cases"][i]["way"].as_str().expect("a way")).collect();
    for way in ["unnamed", "absorbed", "conditional", "unlisted", "absent"] {
        assert!(ways.contains(&way), "{ways:?}");
    }
}

#[test]
fn what_cannot_be_is_refused_with_a_sentence() {
    let place = fresh("refused");
    let out = place.join("out");
    let out = out.to_str().expect("UTF-8");
    let try_it = |effect: &str, strength: &str, way: &str, answer: &str| {
        let run = conceal(&[
            "conceal",
            "--effect",
            effect,
            "--strength",
            strength,
            "--way",
            way,
            "--seed",
            "1",
            "--out",
            out,
            "--answer",
            answer,
        ]);
        assert_eq!(run.status.code(), Some(2));
        String::from_utf8(run.stderr).expect("UTF-8")
    };
    assert!(try_it("warp-drive", "10", "unnamed", "a.json").contains("`warp-drive` is not an effect"));
    assert!(try_it("adhesion", "1", "unnamed", "a.json").contains("choose 2 or more"));
    assert!(try_it("air-drag,adhesion", "10", "unnamed", "a.json").contains("a falling body has no rig"));
    assert!(try_it("pad-relaxation", "10", "conditional", "a.json").contains("whole rig"));
    assert!(try_it("adhesion", "10", "unnamed", &format!("{out}/a.json")).contains("put it elsewhere"));
}
