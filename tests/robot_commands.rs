//! `thud mass`, `limits`, `speed` and `drop` as a person runs them; the mass on its way to a simulated sensor in
//! another process.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use multicast::group;
use serde_json::Value;
use tool::{THUD, folder, json, refusal, run};

mod multicast;
mod tool;

fn iiwa() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/robots/iiwa14.urdf")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// `thud mass` of the example at its flange.
fn mass<'a>(urdf: &'a str, rest: &[&'a str]) -> Vec<&'a str> {
    [&["mass", "--urdf", urdf, "--at", "flange"], rest].concat()
}

const POSTURE: &str = "--joints=-56.6,87.6,-90,109.2,2.9,52.5,90";

#[test]
fn a_mass_travels_with_all_that_it_belongs_to_into_a_speed() {
    let (iiwa, folder) = (iiwa().display().to_string(), folder("mass-to-speed"));
    let file = folder.join("mass.json").display().to_string();
    let rest = [
        "--direction",
        "2,0,0",
        POSTURE,
        "--degrees",
        "--point",
        "0,0,0.00835",
        "--tool-mass",
        "0.0176",
        "--tool-com",
        "0,0,0.004",
        "--json",
        &file,
    ];
    let output = run(&mass(&iiwa, &rest));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let screen = String::from_utf8(output.stdout).unwrap();
    assert!(screen.contains("6.078") && screen.contains("12.82") && screen.contains("◀"), "{screen}");
    assert!(screen.lines().count() <= 20 && screen.lines().all(|line| line.chars().count() <= 100), "{screen}");
    let answer: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    assert!((number(&answer["effective_mass_kg"]) - 6.08).abs() < 0.01);
    assert_eq!(
        (&answer["link"], &answer["frame"], &answer["orientation"]),
        (&"flange".into(), &"base".into(), &"free".into())
    );
    assert_eq!(answer["direction"], serde_json::json!([1.0, 0.0, 0.0]));
    assert_eq!(answer["model"]["robot"], "iiwa14");
    assert_eq!(answer["model"]["crc32"].as_str().unwrap().len(), 8);
    assert_eq!(number(&answer["tool"]["mass_kg"]), 0.0176);
    assert_eq!(answer["joints"].as_array().unwrap().len(), 7);
    let beside = &answer["beside"];
    assert!((number(&beside["held_kg"]) - 8.38).abs() < 0.01 && (number(&beside["iso_kg"]) - 12.82).abs() < 0.01);
    assert!(number(&beside["lumped"]["mass_kg"]) > 1.0);

    let speed = json(&["speed", "--region", "chest", "--mass-from", &file, "--contact-area", "0.5"]);
    assert_eq!(speed["mass_source"]["model"], answer["model"]);
    assert_eq!(speed["mass_source"]["point_m"], answer["point_m"]);
    assert_eq!((&speed["decided_by"], &speed["area"]), (&"pressure".into(), &"sternum".into()));
    assert!((number(&speed["by_force_m_per_s"]) - 0.77).abs() < 0.01);
    let sensitivity = &speed["sensitivity"];
    assert!(number(&sensitivity["with_10_percent_more_m_per_s"]) < number(&speed["permitted_m_per_s"]));
    // What is no mass is refused with its place.
    std::fs::write(&file, "{\n  \"effective_mass_kg\": \"six\"\n}").unwrap();
    let said = refusal(&["speed", "--region", "chest", "--mass-from", &file]);
    assert!(said.contains("mass.json:2:") && said.contains("thud mass --json"), "{said}");
}

#[test]
fn every_way_to_hold_can_be_asked_for() {
    let iiwa = iiwa().display().to_string();
    let with = |orientation| {
        number(
            &json(&mass(&iiwa, &["--direction", "1,0,0", POSTURE, "--degrees", "--orientation", orientation]))["effective_mass_kg"],
        )
    };
    let (free, yielding, held) = (with("free"), with("held-yielding"), with("held"));
    assert!(free < yielding && yielding < held, "{free} {yielding} {held}");
    // Degrees and radians, order and names say the same.
    let radians: Vec<String> =
        [-56.6_f64, 87.6, -90.0, 109.2, 2.9, 52.5, 90.0].iter().map(|value| value.to_radians().to_string()).collect();
    let by_order = format!("--joints={}", radians.join(","));
    let named: Vec<String> = radians.iter().enumerate().map(|(axis, value)| format!("A{}={value}", axis + 1)).collect();
    let by_name = format!("--joints={}", named.join(","));
    for posture in [by_order, by_name] {
        let again = number(&json(&mass(&iiwa, &["--direction", "1,0,0", &posture]))["effective_mass_kg"]);
        assert!((again - free).abs() < 1e-9, "{again} and {free}");
    }
}

#[test]
fn bad_input_gets_a_sentence() {
    let (iiwa, folder) = (iiwa().display().to_string(), folder("bad-robots"));
    for (rest, words) in [
        (vec!["--direction", "0,0,0", POSTURE, "--degrees"], "the direction has no length"),
        (vec!["--direction", "1,0", POSTURE, "--degrees"], "three numbers are needed"),
        (
            vec!["--direction", "1,0,0", "--joints=1,2,3"],
            "3 joint values were given, and iiwa14 has 7 joints that move",
        ),
        (
            vec!["--direction", "1,0,0", POSTURE],
            "joint `A1` cannot be at -56.6000 rad (-3242.94°): it goes from -2.9671 rad (-170.00°)",
        ),
        (vec!["--direction", "1,0,0", "--joints=A8=1"], "has no joint `A8`"),
        (vec!["--direction", "1,0,0"], "--joints"),
        (vec!["--direction", "0,0,1", "--joints=0,0,0,0,0,0,0"], "its effective mass is infinite"),
        (
            vec!["--direction", "1,0,0", POSTURE, "--degrees", "--tool-mass", "-1"],
            "the tool is no rigid body: its mass is negative",
        ),
        (
            vec!["--direction", "1,0,0", POSTURE, "--degrees", "--tool-mass", "1", "--tool-at", "hook"],
            "iiwa14 has no link `hook`",
        ),
        (vec!["--direction", "1,0,0", POSTURE, "--degrees", "--lumps", "A2,A4,x"], "has no joint `x`"),
    ] {
        let said = refusal(&mass(&iiwa, &rest));
        assert!(said.contains(words), "{rest:?}: {said}");
    }
    let said = refusal(&["mass", "--urdf", &iiwa, "--at", "base", "--direction", "1,0,0", POSTURE, "--degrees"]);
    assert!(said.contains("link `base` of iiwa14 does not move"), "{said}");
    let said = refusal(&[
        "mass",
        "--urdf",
        &iiwa,
        "--at",
        "link4",
        "--direction",
        "1,0,0",
        POSTURE,
        "--degrees",
        "--tool-mass",
        "1",
    ]);
    assert!(said.contains("joints lie behind link `link4`") && said.contains("--tool-at"), "{said}");
    // A robot for display only: no link has an inertia.
    let bare = std::fs::read_to_string(&iiwa).unwrap();
    let mut pieces = bare.split("<inertial>");
    let mut text = pieces.next().unwrap().to_owned();
    for piece in pieces {
        text += piece.split_once("</inertial>").unwrap().1;
    }
    let shown = folder.join("shown.urdf").display().to_string();
    std::fs::write(&shown, text).unwrap();
    let said = refusal(&mass(&shown, &["--direction", "1,0,0", POSTURE, "--degrees"]));
    assert!(said.contains("shown.urdf: no link that moves has a mass") && said.contains("link1, link2"), "{said}");
    let broken = folder.join("broken.urdf").display().to_string();
    std::fs::write(&broken, "<robot><link name=\"a\"></robot>").unwrap();
    let said = refusal(&mass(&broken, &["--direction", "1,0,0", POSTURE]));
    assert!(said.contains("broken.urdf: is no URDF"), "{said}");
    assert!(refusal(&mass("nowhere.urdf", &["--direction", "1,0,0", POSTURE])).contains("nowhere.urdf"));
}

#[test]
fn limits_are_complete_and_say_whose_they_are() {
    let answer = json(&["limits", "--mass", "6.1"]);
    let regions = answer["regions"].as_array().unwrap();
    assert_eq!(regions.len(), 12);
    assert_eq!(regions.iter().map(|region| region["areas"].as_array().unwrap().len()).sum::<usize>(), 29);
    assert!(answer["provenance"].as_str().unwrap().contains("ISO/TS 15066:2016"));
    for region in regions {
        let head = matches!(region["region"].as_str().unwrap(), "skull" | "face");
        assert_eq!(region["transient_N"].is_null(), head);
        assert_eq!(region.get("permitted_m_per_s").is_none(), head, "{region}");
    }
    let older = json(&["limits", "--limits", "bgia-2011"]);
    assert_eq!(older["as_printed"].as_array().unwrap().len(), 15);
    assert!(older["as_printed"][0]["impact_N"].is_null());
    let unverified = json(&["limits", "--limits", "iso-10218-2-2025-unverified"]);
    assert!(unverified["provenance"].as_str().unwrap().contains("UNVERIFIED"));
    for arguments in
        [&["limits"][..], &["limits", "--region", "hand", "--mass", "6.1"], &["limits", "--limits", "bgia-2011"]]
    {
        let screen = String::from_utf8(run(arguments).stdout).unwrap();
        assert!(screen.lines().count() <= 24 && screen.lines().all(|line| line.chars().count() <= 100), "{screen}");
    }
    for region in ["skull", "face"] {
        let said = refusal(&["speed", "--region", region, "--mass", "0.1"]);
        assert!(said.contains("is not permitted at any speed"), "{said}");
    }
    let said = refusal(&["speed", "--region", "chest", "--mass", "0"]);
    assert!(said.contains("0.05 to 1000 kg"), "{said}");
}

/// `thud` in another process; it ends with the test.
struct Running(Child);

impl Running {
    /// Starts it and waits until it says these words.
    fn until(words: &str, arguments: &[&str]) -> Self {
        let mut child = Command::new(THUD).args(arguments).stdout(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        assert!(lines.by_ref().map_while(Result::ok).any(|line| line.contains(words)), "{arguments:?} never said it");
        std::thread::spawn(move || lines.for_each(drop));
        Self(child)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_motion_is_streamed_to_the_sensor_and_judged_with() {
    let (iiwa, folder) = (iiwa().display().to_string(), folder("motion"));
    let bus = format!("udp:{}:43541", group());
    let motion = folder.join("motion.csv").display().to_string();
    // Ever further down, with a column that is nobody's joint.
    let rows: String = (0..=20)
        .map(|n| format!("{},-56.6,{},-90,109.2,2.9,52.5,90,{n}\n", f64::from(n) * 0.1, 87.6 - f64::from(n)))
        .collect();
    let head = "time_s,A1_deg,A2_deg,A3_deg,A4_deg,A5_deg,A6_deg,A7_deg,step_count\n";
    std::fs::write(&motion, format!("{head}{rows}")).unwrap();

    let sweep = json(&mass(&iiwa, &["--direction", "1,0,0", "--trajectory", &motion]));
    let samples = sweep["samples"].as_array().unwrap();
    assert_eq!((samples.len(), &sweep["frame"], &sweep["model"]["robot"]), (21, &"base".into(), &"iiwa14".into()));
    let masses: Vec<f64> = samples.iter().map(|sample| number(&sample["effective_mass_kg"])).collect();
    let one = json(&mass(&iiwa, &["--direction", "1,0,0", POSTURE, "--degrees"]));
    assert!((masses[0] - number(&one["effective_mass_kg"])).abs() < 1e-9);
    assert!(samples.iter().all(|sample| sample["direction_in_base"] == serde_json::json!([1.0, 0.0, 0.0])));

    let _sensor = Running::until("lives as node", &["sensor", "--region", "chest", "--bus", &bus]);
    let to_bus = ["--direction", "1,0,0", "--trajectory", &motion, "--bus", &bus];
    // It is armed by whoever watches. Nobody else asks meanwhile: of two who ask at once each hears the other's answers.
    let armed = Running::until("Following node", &["monitor", "--bus", &bus, "--duration", "300"]);
    let sent = json(&mass(&iiwa, &[&to_bus[..], &["--rate", "100"]].concat()))["sent"].clone();
    assert_eq!((number(&sent["frames"]), number(&sent["sensor"]["taken"])), (201.0, 201.0), "{sent}");
    assert_eq!((number(&sent["sensor"]["refused"]), number(&sent["sensor"]["missed"])), (0.0, 0.0), "{sent}");
    drop(armed);

    // What is wrong with a motion is said with its instant.
    for (name, text, words) in [
        (
            "beyond",
            "time_s,A2_deg\n0,0\n0.5,200\n",
            "at 0.5 s (sample 2): joint `A2` cannot be at 3.4907 rad (200.00°)",
        ),
        ("nobody", "time_s,B2_deg\n0,0\n0.5,200\n", "no column is named after a joint of iiwa14"),
        ("unit", "time_s,A2_mm\n0,0\n0.5,1\n", "column `A2_mm` gives joint `A2` in mm"),
        ("torn", "time_s,A2_deg\n0,0\n0.5\n", "torn.csv:3:4: the line has 1 values"),
    ] {
        let path = folder.join(format!("{name}.csv")).display().to_string();
        std::fs::write(&path, text).unwrap();
        let said = refusal(&mass(&iiwa, &["--direction", "1,0,0", "--trajectory", &path]));
        assert!(said.contains(words), "{name}: {said}");
    }
}

/// A simulated campaign of drops, of which something else is believed than what was done.
fn drops(name: &str, simulate: &[&str], believed: Option<&str>) -> Value {
    let campaign = folder(name).join("drops").display().to_string();
    let fixed = [
        "simulate",
        "--kind",
        "drop",
        "--speeds",
        "0.9,1.2",
        "--masses",
        "0.5,1",
        "--mass-error",
        "0.001",
        "--speed-error",
        "0.001",
        "--stiffness-error",
        "0.001",
        "--noise",
        "0.1",
        "--seed",
        "4",
        "--out",
        &campaign,
    ];
    let output = run(&[&fixed[..], simulate].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    if let Some(stated) = believed {
        let file = Path::new(&campaign).join("campaign.toml");
        let text = std::fs::read_to_string(&file).unwrap();
        let line = text.lines().find(|line| line.starts_with("body_stiffness")).unwrap().to_owned();
        std::fs::write(
            &file,
            text.replace(&line, &format!("body_stiffness_N_per_m = {{ value = {stated}, sd = 100.0 }}")),
        )
        .unwrap();
    }
    json(&["drop", &campaign])
}

#[test]
fn a_drop_test_says_what_is_wrong_with_a_rig() {
    let fit = drops("fit", &["--body-stiffness", "60000"], None);
    assert_eq!(fit["fit_for_use"], true, "{fit}");
    assert!(
        (number(&fit["stiffness_N_per_m"]) / 6e4 - 1.0).abs() < 0.02 && (number(&fit["gain"]) - 1.0).abs() < 0.01,
        "{fit}"
    );

    let said = |answer: &Value| answer["findings"].to_string();
    let swapped = drops("swapped", &["--body-stiffness", "120000"], Some("60000.0"));
    assert_eq!(swapped["fit_for_use"], false);
    assert!(said(&swapped).contains("the springs are in the wrong places: K is 1"), "{swapped}");

    let gain = drops("gain", &["--body-stiffness", "60000", "--mechanism", "gain-error:relative=0.08"], None);
    assert!(said(&gain).contains("the cell reads +8"), "{gain}");
    assert!((number(&gain["stiffness_N_per_m"]) / 6e4 - 1.0).abs() < 0.02, "{gain}");

    let rubs = drops("rubs", &["--body-stiffness", "25000", "--mechanism", "guide-friction:force_N=4"], None);
    assert!(said(&rubs).contains("the guide rubs"), "{rubs}");
    assert!((2.0..=8.0).contains(&number(&rubs["friction_N"])), "{rubs}");
}

#[test]
fn a_drop_is_expected_by_every_model_and_only_drops_are_judged() {
    let answer = json(&["drop", "--piece", "0.08"]);
    let rows = answer["drops"].as_array().unwrap();
    assert_eq!(rows.len(), 3 * 2 * 9);
    let row = rows
        .iter()
        .find(|row| number(&row["stiffness_N_per_m"]) == 75e3 && number(&row["mass_kg"]) == 0.04124)
        .unwrap();
    assert!(
        (number(&row["alone_N"]) - 49.7).abs() < 0.1 && (number(&row["alone_as_printed_N"]) - 16.1).abs() < 0.1,
        "{row}"
    );
    let screen = String::from_utf8(run(&["drop"]).stdout).unwrap();
    assert!(screen.lines().count() <= 14 && screen.lines().all(|line| line.chars().count() <= 110), "{screen}");
    let campaign = folder("no-drop").join("hits").display().to_string();
    assert!(run(&["simulate", "--speeds", "0.2", "--masses", "4", "--out", &campaign]).status.success());
    assert!(refusal(&["drop", &campaign]).contains("of the kind `impact`, not of drops"));
    assert!(refusal(&["drop", "--masses", "0"]).contains("above 0"));
    assert!(refusal(&["drop", "--piece", "9"]).contains("cannot be simulated"));
}
