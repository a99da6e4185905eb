//! The tool from the outside: `simulate` makes campaigns, `replay` senses them, `demo` goes the whole way.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;
use tool::{THUD, refused, run_in, told};

mod tool;

fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    told(run_in(folder, arguments))
}

fn refuses(folder: &Path, arguments: &[&str]) -> String {
    refused(run_in(folder, arguments))
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} in {value}"))
}

#[test]
fn what_the_sensor_says_of_a_simulated_campaign_is_what_was_true() {
    let folder = TempDir::new().unwrap();
    succeeds(
        folder.path(),
        &[
            "simulate",
            "--regions",
            "chest,lower-arm",
            "--speeds",
            "0.1,0.25,0.5",
            "--masses",
            "4,8",
            "--repeats",
            "1",
            "--hum",
            "0.5",
            "--drift",
            "0.014",
            "--mechanism",
            "hunt-crossley-damping:alpha_s_per_m=0.2",
            "--seed",
            "3",
            "--out",
            "c",
            "--truth",
            "truth.json",
        ],
    );
    let truth = json(&std::fs::read_to_string(folder.path().join("truth.json")).unwrap());
    let mut squares = Vec::new();
    for campaign in truth["campaigns"].as_array().unwrap() {
        let region = campaign["name"].as_str().unwrap();
        for recording in campaign["recordings"].as_array().unwrap() {
            let file = format!("c/{region}/{}", recording["file"].as_str().unwrap());
            let answer =
                json(&succeeds(folder.path(), &["replay", &file, "--region", region, "--mass", "6", "--json", "-"]));
            let events = answer["events"].as_array().unwrap();
            assert_eq!(events.len(), 1, "{file}: {events:?}");
            let (event, contact) = (&events[0], &recording["contacts"][0]);
            squares.push((number(event, "contact_s") - number(contact, "contact_s")).powi(2));
            let peak = number(contact, "peak_N");
            let error = (number(event, "raw_peak_N") - peak).abs();
            assert!(error < (0.005 * peak).max(0.5), "{file}: peak off by {error} N of {peak} N");
            let impulse = number(event, "impulse_Ns") / number(contact, "impulse_Ns") - 1.0;
            assert!(impulse.abs() < 0.01, "{file}: impulse off by {impulse}");
            assert_eq!(answer["lost"], 0);
        }
    }
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    // The slowest of them, 0.1 m/s on 25 N/mm, rises so slowly that noise alone allows no better than some 60 µs.
    assert!(rms < 75e-6, "contact instant {rms} s rms over {} blows", squares.len());
}

#[test]
fn the_answer_has_the_keys_of_the_contract() {
    let folder = TempDir::new().unwrap();
    succeeds(folder.path(), &["simulate", "--speeds", "0.3", "--masses", "6", "--repeats", "1", "--out", "c"]);
    let answer = json(&succeeds(folder.path(), &["replay", "c/recordings/001.csv", "--json", "-"]));
    let event = answer["events"][0].as_object().unwrap();
    for key in ["contact_s", "peak_s", "peak_N", "raw_peak_N", "impulse_Ns", "duration_s", "scaled_N"] {
        assert!(event[key].is_f64(), "{key}: {event:?}");
    }
    assert_eq!(event["verdict"], "none", "no region, no verdict");
    assert!(event["flags"].is_array());
    assert!(answer["lost"].is_u64());
}

#[test]
fn a_campaign_is_replayed_with_what_is_believed_of_each_recording() {
    let folder = TempDir::new().unwrap();
    succeeds(folder.path(), &["simulate", "--speeds", "0.3", "--masses", "4,8", "--repeats", "1", "--out", "c"]);
    let answer = json(&succeeds(folder.path(), &["replay", "c", "--region", "chest", "--json", "-"]));
    let events = answer["events"].as_array().unwrap();
    assert_eq!(events.len(), 2);
    for (event, mass) in events.iter().zip([4.0_f64, 8.0]) {
        let scaling = (40.0 / (40.0 + mass)).sqrt();
        assert!((number(event, "scaling") - scaling).abs() < 1e-6, "{event}");
    }
    assert!(events[1]["file"].as_str().unwrap().ends_with("002.csv"));
}

#[test]
fn lost_samples_are_counted_and_never_pass() {
    let folder = TempDir::new().unwrap();
    succeeds(
        folder.path(),
        &[
            "simulate",
            "--speeds",
            "0.3",
            "--masses",
            "6",
            "--repeats",
            "1",
            "--before",
            "1",
            "--out",
            "c",
            "--truth",
            "t.json",
        ],
    );
    let truth = json(&std::fs::read_to_string(folder.path().join("t.json")).unwrap());
    let contact = number(&truth["campaigns"][0]["recordings"][0], "contact_s");
    let text = std::fs::read_to_string(folder.path().join("c/recordings/001.csv")).unwrap();
    let torn: String = text
        .lines()
        .filter(|line| {
            let time = line.split(',').next().and_then(|cell| cell.parse::<f64>().ok());
            !time.is_some_and(|time| (contact + 0.010..contact + 0.015).contains(&time))
        })
        .map(|line| format!("{line}\n"))
        .collect();
    std::fs::write(folder.path().join("torn.csv"), torn).unwrap();
    let answer =
        json(&succeeds(folder.path(), &["replay", "torn.csv", "--region", "chest", "--mass", "6", "--json", "-"]));
    assert_eq!(answer["lost"], 100);
    let event = &answer["events"][0];
    assert!(event["flags"].as_array().unwrap().iter().any(|flag| flag == "lost-samples"), "{event}");
    assert_eq!(event["verdict"], "inconclusive");
}

#[test]
fn a_force_beyond_full_scale_is_flagged() {
    let folder = TempDir::new().unwrap();
    succeeds(folder.path(), &["simulate", "--speeds", "0.5", "--masses", "6", "--repeats", "1", "--out", "c"]);
    let arguments =
        ["replay", "c/recordings/001.csv", "--region", "chest", "--mass", "6", "--full-scale", "100", "--json", "-"];
    let event = &json(&succeeds(folder.path(), &arguments))["events"][0];
    assert!(event["flags"].as_array().unwrap().iter().any(|flag| flag == "clipped"), "{event}");
    assert_ne!(event["verdict"], "pass");
}

#[test]
fn a_model_file_runs_like_its_options() {
    let folder = TempDir::new().unwrap();
    let model = r#"format = "thud-model/1"
name = "chest"
[rig]
kind = "impact"
body_stiffness_N_per_m = { value = 25000.0, sd = 1250.0 }
[[mechanism]]
id = "guide-friction"
[mechanism.parameters]
force_N = { value = 3.0, low = 2.5, high = 3.5 }
"#;
    std::fs::write(folder.path().join("model.toml"), model).unwrap();
    let common = ["--speeds", "0.3", "--masses", "6", "--repeats", "1", "--seed", "5"];
    succeeds(folder.path(), &[&["simulate", "--model", "model.toml", "--out", "a"][..], &common].concat());
    let options = ["simulate", "--region", "chest", "--mechanism", "guide-friction:force_N=3", "--out", "b"];
    succeeds(folder.path(), &[&options[..], &common].concat());
    for file in ["campaign.toml", "recordings/001.csv"] {
        let read = |folder_name: &str| std::fs::read_to_string(folder.path().join(folder_name).join(file)).unwrap();
        assert_eq!(read("a"), read("b"), "{file}");
    }
}

#[test]
fn a_refusal_says_what_where_and_what_would_be_right() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("bad.csv"), "time_s,force_N\n0,0\n0.1,much\n").unwrap();
    std::fs::write(folder.path().join("height.csv"), "time_s,height_m\n0,1\n0.1,0.9\n").unwrap();
    for (arguments, says) in [
        (&["replay", "bad.csv"][..], "bad.csv:3:5: `much` in column `force_N` is not a number"),
        (&["replay", "missing.csv"], "missing.csv: cannot be read"),
        (&["replay", "height.csv"], "there is no column `force_N`; it has height_m"),
        (&["replay", "height.csv", "--mass=-1"], "the effective mass may be 0.05 to 1000 kg"),
        (&["simulate", "--out", "c", "--mechanism", "rust"], "no mechanism is called `rust`; there are"),
        (&["simulate", "--out", "c", "--mechanism", "guide-friction:force_N=1e9"], "0 to 60 N is possible"),
        (&["simulate", "--out", "c", "--speeds", "0.1,fast"], "invalid value 'fast'"),
        (&["simulate", "--out", "c", "--speeds", "99"], "a speed (m/s) is 99; 0.0001 to 20 is possible"),
    ] {
        let said = refuses(folder.path(), arguments);
        assert!(said.contains(says), "{arguments:?}: {said}");
    }
    assert!(!folder.path().join("c").exists(), "a refused plan writes nothing");
    let plan = ["simulate", "--speeds", "0.3", "--masses", "6", "--repeats", "1", "--out", "once"];
    succeeds(folder.path(), &plan);
    assert!(refuses(folder.path(), &plan).contains("there is already a campaign"));
    succeeds(folder.path(), &[&plan[..], &["--replace"]].concat());
}

#[test]
fn the_demonstration_runs_and_writes_its_page() {
    let folder = TempDir::new().unwrap();
    let outcome = json(&succeeds(folder.path(), &["demo", "--seed", "1", "--report", "page.html", "--json", "-"]));
    assert_eq!(outcome["blows"].as_array().unwrap().len(), 3);
    let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(page.contains("Sensed beside true"));
    let again = json(&succeeds(folder.path(), &["demo", "--seed", "1", "--out", "again", "--json", "-"]));
    assert_eq!(outcome, again, "the same seed gives the same results");
    let other = std::fs::read_to_string(folder.path().join("again/demo.html")).unwrap();
    assert!(
        other.replace("demo-diagnosis.html", "page-diagnosis.html") == page,
        "but for the name of the page beside it"
    );
    for beside in ["page-diagnosis.html", "again/demo-diagnosis.html"] {
        assert!(folder.path().join(beside).is_file(), "{beside}");
    }
}

#[test]
fn the_exit_status_says_who_was_at_fault() {
    let folder = TempDir::new().unwrap();
    // Unusable input, a value out of its range, an option that does not exist: all the same to a script.
    refuses(folder.path(), &["replay", "absent.csv"]);
    assert!(refuses(folder.path(), &["replay", "absent.csv", "--mass", "-3"]).contains("0.05 to 1000 kg"));
    refuses(folder.path(), &["replay", "absent.csv", "--no-such-option"]);
    assert!(succeeds(folder.path(), &["--help"]).contains("Exit status: 0"));
}

/// `thud … | head -1`: the reader has gone before the rest is written.
#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_fault() {
    let folder = TempDir::new().unwrap();
    for arguments in [&["demo"][..], &["demo", "--json", "-"], &["simulate", "--out", "made"]] {
        let mut child = Command::new(THUD)
            .current_dir(folder.path())
            .args(arguments)
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert!(folder.path().join("made/campaign.toml").is_file(), "what was made is there all the same");
}

/// A half sine of 150 N and 20 ms at `contact_s`, at 10 kHz, with a little deterministic noise.
fn pulse_csv(from_s: f64, contact_s: f64, full_scale_n: f64) -> String {
    let mut text = String::from("time_s,force_N\n");
    for index in 0..6_000_u32 {
        let time = from_s + f64::from(index) * 1e-4;
        let since = time - contact_s;
        let force =
            if (0.0..0.02).contains(&since) { 150.0 * (since / 0.02 * std::f64::consts::PI).sin() } else { 0.0 };
        let noise = 0.1 * f64::from(index.wrapping_mul(2_654_435_761) >> 24) / 128.0 - 0.1;
        text.push_str(&format!("{time:.5},{:.4}\n", (force + noise).min(full_scale_n)));
    }
    text
}

#[test]
fn a_recording_that_begins_within_a_pulse_has_that_one_and_no_other() {
    let folder = TempDir::new().unwrap();
    for (name, from_s, known) in [("begun.csv", 0.008, false), ("whole.csv", 0.0, true)] {
        std::fs::write(folder.path().join(name), pulse_csv(from_s, 0.0, 2e3)).unwrap();
        let said = json(&succeeds(folder.path(), &["replay", name, "--region", "chest", "--mass", "6", "--json", "-"]));
        let events = said["events"].as_array().unwrap();
        assert_eq!(events.len(), 1, "{said}");
        assert!((number(&events[0], "contact_s") - from_s).abs() < 1e-3, "{said}");
        assert!((number(&events[0], "raw_peak_N") - 150.0).abs() < 1.0);
        let truncated = events[0]["flags"].as_array().unwrap().contains(&"truncated".into());
        assert_eq!((truncated, events[0]["verdict"] == "pass"), (!known, known), "{said}");
    }
}

/// Three blows of 200 N, half a second apart; after the first friction holds 4 N on the cell, to the end of the recording.
#[test]
fn blows_on_a_rest_that_friction_holds_are_told_one_by_one() {
    let folder = TempDir::new().unwrap();
    let mut text = String::from("time_s,force_N\n");
    for index in 0..25_000_u32 {
        let time = f64::from(index) * 1e-4 - 0.5;
        let pulse = |at: f64| 200.0 * ((time - at) / 0.03 * std::f64::consts::PI).sin();
        let blow =
            [0.0, 0.5, 1.0].into_iter().filter(|at| (0.0..0.03).contains(&(time - at))).map(pulse).fold(0.0, f64::max);
        let rest = if time > 0.015 { 4.0 } else { 0.0 };
        let noise = 0.4 * f64::from(index.wrapping_mul(2_654_435_761) >> 24) / 128.0 - 0.4;
        text.push_str(&format!("{time:.5},{:.4}\n", f64::max(blow, rest) + noise));
    }
    std::fs::write(folder.path().join("rest.csv"), text).unwrap();
    let said =
        json(&succeeds(folder.path(), &["replay", "rest.csv", "--region", "chest", "--mass", "6", "--json", "-"]));
    let events = said["events"].as_array().unwrap();
    assert_eq!(events.len(), 3, "{said}");
    // 4 N of 200 N are reached 0.19 ms after the pulse begins.
    for (event, contact_s) in events.iter().zip([0.0, 0.500_19, 1.000_19]) {
        assert!((number(event, "contact_s") - contact_s).abs() < 100e-6, "{event}");
        assert!((number(event, "duration_s") - 0.029_8).abs() < 300e-6, "{event}");
        assert!((number(event, "raw_peak_N") - 200.0).abs() < 1.0, "{event}");
        assert!((number(event, "impulse_Ns") / 3.82 - 1.0).abs() < 0.01, "{event}");
        assert_eq!(event["flags"], serde_json::json!(["rest"]), "{event}");
        assert_eq!(event["verdict"], "pass", "{event}");
    }
}

#[test]
fn a_recording_that_its_own_chain_clipped_never_passes() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("clipped.csv"), pulse_csv(-0.3, 0.0, 100.0)).unwrap();
    let judged = ["--region", "chest", "--mass", "6", "--json", "-"];
    let said = json(&succeeds(folder.path(), &[&["replay", "clipped.csv"][..], &judged].concat()));
    assert_eq!(said["events"][0]["verdict"], "inconclusive");
    assert!(said["events"][0]["flags"].as_array().unwrap().contains(&"clipped".into()), "{said}");
    assert!(said["notes"].to_string().contains("stand at 100 N"), "{said}");

    // A campaign states the full scale.
    let full = ["--full-scale", "60", "--speeds", "0.3", "--masses", "6", "--repeats", "1", "--noise", "0.05"];
    succeeds(folder.path(), &[&["simulate", "--out", "campaign"][..], &full].concat());
    let said = json(&succeeds(folder.path(), &["replay", "campaign", "--region", "chest", "--json", "-"]));
    assert_eq!(said["events"][0]["verdict"], "inconclusive", "{said}");
    assert!(said["events"][0]["flags"].as_array().unwrap().contains(&"clipped".into()), "{said}");
}

#[test]
fn a_fall_is_a_campaign_of_heights() {
    let folder = TempDir::new().unwrap();
    let fall = ["simulate", "--kind", "fall", "--speeds", "0", "--masses", "0.06", "--repeats", "1", "--after", "1"];
    let rest = ["--sample-rate", "1000", "--height-noise", "0", "--mass-error", "0"];
    succeeds(folder.path(), &[&fall[..], &rest, &["--out", "vacuum"]].concat());
    succeeds(folder.path(), &[&fall[..], &rest, &["--mechanism", "air-drag", "--out", "air"]].concat());
    let height = |campaign: &str, index: usize| -> f64 {
        let loaded = thud::campaign::load(&folder.path().join(campaign)).unwrap();
        assert_eq!(loaded.campaign.rig.kind, thud::campaign::RigKind::Fall);
        loaded.recordings[0].channel("height_m").unwrap()[index]
    };
    // From rest: s = g·t²/2, and less in air.
    assert!((height("vacuum", 0) - height("vacuum", 500) - 0.5 * 9.806_65 * 0.25).abs() < 2e-6);
    assert!(height("air", 999) > height("vacuum", 999) + 1e-3);
    assert!(refuses(folder.path(), &["replay", "vacuum"]).contains("height_m"));
}

#[test]
fn a_drop_bounces_and_states_its_moving_piece() {
    let folder = TempDir::new().unwrap();
    let drop = ["simulate", "--kind", "drop", "--pad", "region", "--mechanism", "moving-piece-inertia:mass_kg=0.1"];
    let rest = ["--masses", "5", "--speeds", "0.5", "--repeats", "1", "--after", "0.4", "--truth", "truth.json"];
    succeeds(folder.path(), &[&drop[..], &rest, &["--out", "drop"]].concat());
    let campaign = thud::campaign::load(&folder.path().join("drop")).unwrap().campaign;
    assert_eq!(campaign.rig.gravity_along_impact_m_per_s2, 9.806_65);
    assert_eq!(campaign.rig.moving_mass_kg.unwrap().value, 0.1);
    let truth = json(&std::fs::read_to_string(folder.path().join("truth.json")).unwrap());
    let truth = &truth["campaigns"][0]["recordings"][0]["contacts"];
    let said = json(&succeeds(folder.path(), &["replay", "drop", "--region", "chest", "--json", "-"]));
    let events = said["events"].as_array().unwrap();
    assert_eq!(events.len(), truth.as_array().unwrap().len(), "{said}");
    assert!((number(&events[0], "raw_peak_N") / number(&truth[0], "peak_N") - 1.0).abs() < 0.005, "{said} {truth}");
    assert!((number(&events[0], "impulse_Ns") / number(&truth[0], "impulse_Ns") - 1.0).abs() < 0.01, "{said} {truth}");
}
