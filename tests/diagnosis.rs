//! The tool from the outside: `diagnose` on simulated campaigns, its model in `simulate` and `evaluate`, and what bad input gets.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde_json::Value;
use tempfile::TempDir;
use tool::{refused, run_in, told};

mod tool;

fn read(folder: &TempDir, file: &str) -> String {
    std::fs::read_to_string(folder.path().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

fn succeeds(folder: &TempDir, arguments: &[&str]) -> String {
    told(run_in(folder.path(), arguments))
}

fn refuses(folder: &TempDir, arguments: &[&str]) -> String {
    refused(run_in(folder.path(), arguments))
}

/// Six recordings at 2 kHz of a rig with a pad, and what else is asked for.
fn campaign(folder: &TempDir, name: &str, more: &[&str]) {
    let mut arguments = vec!["simulate", "--speeds", "0.1,0.2,0.3", "--masses", "4,8"];
    arguments.extend(["--sample-rate", "2000", "--after", "0.2", "--out", name]);
    if !more.contains(&"--repeats") {
        arguments.extend(["--repeats", "1"]);
    }
    arguments.extend(more);
    succeeds(folder, &arguments);
}

const RIG: [&str; 4] = ["--body-stiffness", "25000", "--pad", "80000"];
const DAMPED: &str = "hunt-crossley-damping:alpha_s_per_m=0.3";
/// Few mechanisms are enough for the form of an answer, and quick.
const FEW: [&str; 6] = ["--only", "hunt-crossley-damping", "--only", "guide-friction", "--only", "clipping"];

/// Every last value of a CSV made another.
fn change(file: &Path, made: impl Fn(f64) -> f64) {
    let changed = |line: &str| match line.rsplit_once(',').map(|(others, value)| (others, value.parse::<f64>())) {
        Some((others, Ok(value))) => format!("{others},{}\n", made(value)),
        _ => format!("{line}\n"),
    };
    let text: String = std::fs::read_to_string(file).unwrap().lines().map(changed).collect();
    std::fs::write(file, text).unwrap();
}

/// So many samples of a CSV lost, from one on: those that follow stand too early, and the last ones are gone.
fn lose(file: &Path, from: usize, count: usize) {
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let (times, values): (Vec<&str>, Vec<&str>) = lines.map(|line| line.split_once(',').unwrap()).unzip();
    let kept = values[..from].iter().chain(&values[from + count..]);
    let closed: Vec<String> = times.iter().zip(kept).map(|(time, value)| format!("{time},{value}")).collect();
    std::fs::write(file, format!("{header}\n{}\n", closed.join("\n"))).unwrap();
}

/// The files of a campaign's recordings, in order.
fn recordings(folder: &TempDir, name: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder.path().join(name).join("recordings")).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// The number of a recording's highest value.
fn highest(file: &Path) -> usize {
    let text = std::fs::read_to_string(file).unwrap();
    let values = text.lines().skip(1).map(|line| line.rsplit_once(',').unwrap().1.parse::<f64>().unwrap());
    values.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0
}

/// Some keys of a campaign stated otherwise.
fn restate(folder: &TempDir, name: &str, stated: &[(&str, &str)]) {
    let file = folder.path().join(name).join("campaign.toml");
    let restated = |line: &str| match stated.iter().find(|(key, _)| line.split(' ').next() == Some(key)) {
        Some((key, value)) => format!("{key} = {value}\n"),
        None => format!("{line}\n"),
    };
    let text: String = std::fs::read_to_string(&file).unwrap().lines().map(restated).collect();
    std::fs::write(&file, text).unwrap();
}

/// What a diagnosis names, in order.
fn names(folder: &TempDir, arguments: &[&str]) -> Vec<String> {
    let text = succeeds(folder, &[&["diagnose", "--json", "-"], arguments].concat());
    let answer: Value = serde_json::from_str(&text).unwrap();
    let named = answer["mechanisms"].as_array().unwrap();
    assert_ne!(answer["verdict"], "unexplained", "{answer}");
    named.iter().map(|named| named["id"].as_str().unwrap().to_owned()).collect()
}

fn keys(value: &Value) -> BTreeSet<&str> {
    value.as_object().unwrap_or_else(|| panic!("no object: {value}")).keys().map(String::as_str).collect()
}

fn has_keys(value: &Value, expected: &[&str]) {
    assert_eq!(keys(value), expected.iter().copied().collect(), "{value}");
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} in {value}"))
}

/// A parameter of a named mechanism.
fn value_of(named: &Value, parameter: &str) -> f64 {
    let parameters = named["parameters"].as_array().unwrap();
    number(parameters.iter().find(|one| one["name"] == parameter).expect("a parameter"), "value")
}

fn parameters_are(list: &Value) {
    for parameter in list.as_array().unwrap() {
        has_keys(parameter, &["name", "unit", "value", "low", "high"]);
        let value = number(parameter, "value");
        assert!(number(parameter, "low") <= value && value <= number(parameter, "high"), "{parameter}");
    }
}

#[test]
fn an_answer_has_the_contracts_form_and_the_model_lives_on() {
    let folder = TempDir::new().unwrap();
    let mut damped: Vec<&str> = RIG.into();
    damped.extend(["--mechanism", DAMPED, "--seed", "4"]);
    campaign(&folder, "damped", &damped);
    let mut arguments = vec!["diagnose", "damped", "--json", "-", "--report", "page.html", "--model", "better.toml"];
    arguments.extend(FEW);
    let text = succeeds(&folder, &arguments);
    assert_eq!(succeeds(&folder, &arguments), text, "the same input gives the same bytes");

    let answer: Value = serde_json::from_str(&text).unwrap();
    has_keys(
        &answer,
        &["format", "verdict", "baseline", "where", "mechanisms", "model", "rejected", "unexplained", "advice"],
    );
    assert_eq!(answer["format"], "thud-diagnosis/1");
    assert_eq!(answer["verdict"], "named", "{answer}");
    has_keys(&answer["baseline"], &["nominal_rmse", "retuned_rmse", "held_out_rmse", "noise_rms", "parameters"]);
    parameters_are(&answer["baseline"]["parameters"]);
    assert_eq!(answer["baseline"]["parameters"].as_array().unwrap().len(), 2 + 2, "body, pad, two masses");
    for place in answer["where"].as_array().unwrap() {
        has_keys(
            place,
            &["phase", "time_from_contact_s", "frequency_Hz", "recordings", "depends_on", "share", "p_value"],
        );
    }
    let named = &answer["mechanisms"][0];
    has_keys(named, &["id", "parameters", "held_out_gain", "indistinguishable_from", "because"]);
    assert_eq!(named["id"], "hunt-crossley-damping");
    parameters_are(&named["parameters"]);
    // Wide: it is known as well as the pad's stiffness is, whose rate it acts on.
    let alpha = &named["parameters"][0];
    assert!(number(alpha, "low") < 0.3 && number(alpha, "high") > 0.3, "{named}");
    has_keys(&answer["model"], &["rmse", "held_out_rmse", "noise_ratio", "residual_is_white"]);
    has_keys(&answer["unexplained"], &["share", "depends_on", "form", "held_out_rmse"]);
    let rejected: Vec<&str> =
        answer["rejected"].as_array().unwrap().iter().map(|rejected| rejected["id"].as_str().unwrap()).collect();
    assert_eq!(rejected.iter().copied().collect::<BTreeSet<_>>(), ["clipping", "guide-friction"].into());
    assert_eq!(rejected.len(), 2, "one line each");
    answer["rejected"].as_array().unwrap().iter().for_each(|rejected| has_keys(rejected, &["id", "because"]));
    assert!(number(&answer["model"], "held_out_rmse") < number(&answer["baseline"], "held_out_rmse"));
    assert!(read(&folder, "page.html").contains("hunt-crossley-damping"));

    // What was found is in the simulation from then on, and still holds on recordings that it makes.
    campaign(&folder, "next", &["--model", "better.toml", "--seed", "9"]);
    let text = succeeds(&folder, &["evaluate", "better.toml", "next", "--json", "-"]);
    let evaluation: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(evaluation["format"], "thud-evaluation/1");
    assert_eq!(evaluation["verdict"], "holds", "{evaluation}");
    assert!(number(&evaluation, "noise_ratio") < 1.1, "{evaluation}");
    assert!(number(&evaluation, "rmse") > 0.0);
    let recordings = evaluation["recordings"].as_array().unwrap();
    assert_eq!(recordings.len(), 6);
    for recording in recordings {
        assert!(["file", "rmse", "noise_ratio"].iter().all(|key| keys(recording).contains(key)), "{recording}");
        // Quiet of 0.15 to 0.165 s precedes the contact.
        assert!((0.149..0.166).contains(&number(recording, "contact_s")), "{recording}");
    }

    // Without the damping, on the damped recordings, it does not.
    let bare = read(&folder, "better.toml");
    let bare = &bare[..bare.find("[[mechanism]]").unwrap()];
    std::fs::write(folder.path().join("bare.toml"), bare).unwrap();
    let text = succeeds(&folder, &["evaluate", "bare.toml", "damped", "--json", "-"]);
    let evaluation: Value = serde_json::from_str(&text).unwrap();
    assert_ne!(evaluation["verdict"], "holds", "{evaluation}");
    assert!(number(&evaluation, "noise_ratio") > 1.02, "{evaluation}");
}

#[test]
fn a_rig_that_hides_nothing_is_consistent_in_a_screenful() {
    let folder = TempDir::new().unwrap();
    campaign(&folder, "plain", &[&RIG[..], &["--seed", "8"]].concat());
    let mut arguments = vec!["diagnose", "plain"];
    arguments.extend(FEW);
    let text = succeeds(&folder, &arguments);
    assert!(text.contains("The simulation holds"), "{text}");
    assert!(text.lines().count() <= 40 && text.lines().all(|line| line.chars().count() <= 100), "{text}");
    // A stiffer spring is no new physics, but no longer this model.
    std::fs::write(
        folder.path().join("soft.toml"),
        "format = \"thud-model/1\"\nname = \"soft\"\n[rig]\nkind = \"impact\"\n\
         body_stiffness_N_per_m = { value = 15000.0, sd = 30.0 }\n\
         pad_stiffness_N_per_m = { value = 80000.0, sd = 20000.0 }\n",
    )
    .unwrap();
    let text = succeeds(&folder, &["evaluate", "soft.toml", "plain", "--json", "-"]);
    let evaluation: Value = serde_json::from_str(&text).unwrap();
    assert_ne!(evaluation["verdict"], "holds", "{evaluation}");
}

/// Stiffness and masses imitate a gain of nearly a half; only the long way back from there shows it, and its twin too.
#[test]
fn a_gain_that_re_tuning_imitates_keeps_its_twin() {
    let folder = TempDir::new().unwrap();
    campaign(&folder, "loud", &[&RIG[..], &["--mechanism", "gain-error:relative=0.45", "--seed", "5"]].concat());
    let few = ["--only", "gain-error", "--only", "speed-error", "--only", "pose-dependent-mass"];
    let text = succeeds(&folder, &[&["diagnose", "loud", "--json", "-"], &few[..]].concat());
    let answer: Value = serde_json::from_str(&text).unwrap();
    let named = &answer["mechanisms"][0];
    let mut twins = [named["id"].as_str(), named["indistinguishable_from"][0].as_str()];
    twins.sort_unstable();
    assert_eq!(twins, [Some("gain-error"), Some("speed-error")], "{answer}");
}

/// A mechanism that is another in each of three poses, as the model file says it and as it is found: what was named, its set included.
fn found_in_each_pose(id: &str, more: &str, values: [(&str, f64); 3]) -> BTreeSet<String> {
    let folder = TempDir::new().unwrap();
    let rig = "format = \"thud-model/1\"\nname = \"three poses\"\n[rig]\nkind = \"impact\"\n\
               body_stiffness_N_per_m = { value = 25000.0, sd = 500.0 }\n";
    let table = |(configuration, relative): (&str, f64)| {
        format!(
            "[[mechanism]]\nid = \"{id}\"\nconfiguration = \"{configuration}\"\n\
             [mechanism.parameters]\nrelative = {{ value = {relative} }}\n{more}"
        )
    };
    let model: String = values.map(table).concat();
    std::fs::write(folder.path().join("poses.toml"), format!("{rig}{model}")).unwrap();
    let simulated = |model: &str, seed: &str, name: &str| {
        let mut arguments = vec!["simulate", "--model", model, "--speeds", "0.1,0.2,0.3", "--masses", "4,6,8"];
        arguments.extend(["--speed-error", "0.01", "--mass-error", "0.01", "--sample-rate", "2000", "--after", "0.2"]);
        arguments.extend(["--repeats", "1", "--seed", seed, "--out", name]);
        succeeds(&folder, &arguments);
    };
    simulated("poses.toml", "5", "poses-1");
    let few = ["--only", "gain-error", "--only", "speed-error", "--only", "pose-dependent-mass"];
    let arguments = [&["diagnose", "poses-1", "--json", "-", "--model", "found.toml"], &few[..]].concat();
    let answer: Value = serde_json::from_str(&succeeds(&folder, &arguments)).unwrap();
    let [only] = &answer["mechanisms"].as_array().unwrap()[..] else { panic!("{answer}") };
    parameters_are(&only["parameters"]);
    for ((configuration, relative), parameter) in values.iter().zip(only["parameters"].as_array().unwrap()) {
        assert_eq!(parameter["name"], format!("relative[{configuration}]"));
        assert!(number(parameter, "low") < *relative && *relative < number(parameter, "high"), "{parameter}");
    }

    // The model has one for each pose, and holds.
    simulated("found.toml", "9", "poses-2");
    let text = succeeds(&folder, &["evaluate", "found.toml", "poses-2", "--json", "-"]);
    assert_eq!(serde_json::from_str::<Value>(&text).unwrap()["verdict"], "holds", "{text}");
    let twins = only["indistinguishable_from"].as_array().unwrap();
    twins.iter().chain([&only["id"]]).map(|id| id.as_str().unwrap().to_owned()).collect()
}

/// A robot that lets go in one pose only has a lighter mass there, by fifteen of its stated deviations; beside a pad that loses energy everywhere what fits that mass
/// best is no reaction.
#[test]
fn what_acts_in_one_pose_is_sought_beside_the_others() {
    let folder = TempDir::new().unwrap();
    let model = "format = \"thud-model/1\"\nname = \"lets go\"\n[rig]\nkind = \"impact\"\n\
                 body_stiffness_N_per_m = { value = 33900.0, sd = 680.0 }\npad_stiffness_N_per_m = { value = 56500.0, sd = 5650.0 }\n\
                 [[mechanism]]\nid = \"collision-reaction\"\nconfiguration = \"1\"\n[mechanism.parameters]\nforce_N = { value = 16.0 }\n\
                 threshold_N = { value = 11.0 }\ndelay_s = { value = 0.007 }\nretreat_m_per_s = { value = 0.41 }\nrise_s = { value = 0.003 }\n\
                 [[mechanism]]\nid = \"hunt-crossley-damping\"\n[mechanism.parameters]\nalpha_s_per_m = { value = 0.125 }\n";
    std::fs::write(folder.path().join("model.toml"), model).unwrap();
    let mut simulated = vec!["simulate", "--model", "model.toml", "--speeds", "0.11,0.2,0.27", "--masses", "8.3,6,4"];
    simulated.extend(["--speed-error", "0.01", "--mass-error", "0.015", "--noise", "0.2", "--repeats", "1"]);
    succeeds(&folder, &[&simulated[..], &["--sample-rate", "10000", "--seed", "5", "--out", "pose"]].concat());
    let few = ["collision-reaction", "hunt-crossley-damping", "link-oscillation", "pose-dependent-mass"];
    let few = few.iter().flat_map(|id| ["--only", id]);
    let answer = names(&folder, &std::iter::once("pose").chain(few).collect::<Vec<_>>());
    assert_eq!(answer, ["collision-reaction", "hunt-crossley-damping"]);
}

/// A blow beside the axis reads otherwise in every pose: one gain, of a strength of its own in each.
#[test]
fn a_gain_may_be_another_in_each_pose() {
    let set = found_in_each_pose("gain-error", "", [("1", 0.06), ("2", -0.05), ("3", 0.12)]);
    // Force alone does not tell a gain from a speed.
    assert_eq!(set, ["gain-error", "speed-error"].map(str::to_owned).into());
}

/// An arm's mass is another in every pose, where it was stated from one.
#[test]
fn a_mass_may_be_another_in_each_pose() {
    let everywhere = "configuration = { value = -1.0 }\n";
    let set = found_in_each_pose("pose-dependent-mass", everywhere, [("1", 0.2), ("2", -0.15), ("3", 0.1)]);
    assert_eq!(set, ["pose-dependent-mass"].map(str::to_owned).into());
}

/// Three speeds of six are not what was stated, each in its own way; and a cell that has lost a fifth of its gain before the last two blows.
#[test]
fn a_speed_or_a_gain_may_be_off_in_some_recordings() {
    let folder = TempDir::new().unwrap();
    campaign(
        &folder,
        "missed",
        &[&RIG[..2], &["--speed-error", "0.01", "--mass-error", "0.02", "--seed", "5"]].concat(),
    );
    let path = |file: &str| folder.path().join("missed").join(file);
    let stated = std::fs::read_to_string(path("campaign.toml")).unwrap();
    let few = ["--only", "gain-error", "--only", "speed-error", "--only", "link-oscillation"];
    let page = ["--report", "missed.html"];
    let named = || {
        let text = succeeds(
            &folder,
            &[&["diagnose", "missed", "--json", "-", "--model", "found.toml"][..], &page[..], &few[..]].concat(),
        );
        let answer: Value = serde_json::from_str(&text).unwrap();
        let [named] = answer["mechanisms"].as_array().unwrap().as_slice() else { panic!("{answer}") };
        let twins = [&named["id"], &named["indistinguishable_from"][0]].map(|id| id.as_str().unwrap());
        assert_eq!(BTreeSet::from(twins), ["gain-error", "speed-error"].into(), "{answer}");
        parameters_are(&named["parameters"]);
        named["parameters"].clone()
    };

    let off = [("002", 0.1), ("004", -0.12), ("005", 0.15)];
    let mut campaign: toml::Table = stated.parse().unwrap();
    for recording in campaign["recording"].as_array_mut().unwrap() {
        let file = recording["file"].as_str().unwrap().to_owned();
        if let Some((_, part)) = off.iter().find(|(name, _)| file.ends_with(&format!("{name}.csv"))) {
            let speed = recording["impact_speed_m_per_s"].get_mut("value").unwrap();
            *speed = (speed.as_float().unwrap() / (1.0 + part)).into();
        }
    }
    std::fs::write(path("campaign.toml"), toml::to_string(&campaign).unwrap()).unwrap();
    let parameters = named();
    for ((recording, part), parameter) in off.iter().zip(parameters.as_array().unwrap()) {
        assert_eq!(parameter["name"], format!("relative[{recording}]"));
        assert!(read(&folder, "missed.html").contains(&format!("<td>relative[{recording}]</td>")));
        assert!(number(parameter, "low") < *part && *part < number(parameter, "high"), "{parameter}");
    }
    assert!(read(&folder, "found.toml").contains("every impact has its own relative"));

    std::fs::write(path("campaign.toml"), stated).unwrap();
    for name in ["005", "006"] {
        change(&path(&format!("recordings/{name}.csv")), |force| 0.8 * force);
    }
    let parameters = named();
    let relative = &parameters[0];
    assert_eq!(relative["name"], "relative");
    assert!(number(relative, "low") < -0.2 && -0.2 < number(relative, "high"), "{relative}");
}

/// By BIC what is rubbing and more never comes before rubbing.
#[test]
fn what_foretells_best_comes_first() {
    let folder = TempDir::new().unwrap();
    let sticking = "stiction:force_N=0.8,static_ratio=2,cell_share=0.2,rest_share=0.9,stribeck_m_per_s=0.02";
    let mut more: Vec<&str> = RIG.into();
    more.extend(["--mechanism", sticking, "--seed", "3"]);
    campaign(&folder, "sticking", &more);
    let friction = ["--only", "guide-friction", "--only", "stiction"];
    succeeds(&folder, &[&["diagnose", "sticking", "--json", "a.json"], friction.as_slice()].concat());
    let answer: Value = serde_json::from_str(&read(&folder, "a.json")).unwrap();
    let first = &answer["mechanisms"][0];
    assert_eq!((&first["id"], &first["indistinguishable_from"][0]), (&"stiction".into(), &"guide-friction".into()));
    assert!(first["because"].as_str().unwrap().contains("ahead in BIC, but leaves χ²"), "{first}");
}

#[test]
fn a_hum_that_the_list_does_not_know_is_no_noise() {
    let folder = TempDir::new().unwrap();
    let mut more: Vec<&str> = RIG.into();
    more.extend(["--mechanism", "mains-hum:amplitude_N=0.5", "--seed", "5"]);
    campaign(&folder, "hum", &more);
    succeeds(&folder, &["diagnose", "hum", "--without", "mains-hum", "--json", "a.json"]);
    let answer: Value = serde_json::from_str(&read(&folder, "a.json")).unwrap();
    assert_eq!(answer["verdict"], "unexplained");
    assert_eq!(answer["unexplained"]["form"], "a line at 50 Hz that is there before contact, too");
    let place = &answer["where"][0];
    let band = [0, 1].map(|end| place["frequency_Hz"][end].as_f64().unwrap());
    assert!(place["phase"] == "before" && band[0] < 50.0 && band[1] > 50.0, "{place}");
}

/// Other springs than the stated ones fit perfectly, and the simulation does not hold.
#[test]
fn a_rig_that_is_not_the_stated_one_is_no_re_tuning() {
    let folder = TempDir::new().unwrap();
    campaign(&folder, "stiff", &["--body-stiffness", "32000", "--seed", "5"]);
    let stated =
        read(&folder, "stiff/campaign.toml").replace("value = 32000.0, sd = 1600.0", "value = 25000.0, sd = 500.0");
    std::fs::write(folder.path().join("stiff/campaign.toml"), stated).unwrap();
    let text = succeeds(&folder, &[&["diagnose", "stiff", "--json", "a.json"], &FEW[..]].concat());
    let answer: Value = serde_json::from_str(&read(&folder, "a.json")).unwrap();
    assert_eq!((&answer["verdict"], &answer["mechanisms"]), (&"unexplained".into(), &Value::Array(Vec::new())));
    assert!(answer["model"]["residual_is_white"].as_bool().unwrap(), "{answer}");
    let form = answer["unexplained"]["form"].as_str().unwrap();
    assert!(
        form.starts_with("the model asks for the body springs' stiffness 2") && form.contains(" higher than stated, "),
        "{form}"
    );
    assert!(
        text.split_whitespace().collect::<Vec<_>>().join(" ").contains("are not of the rig that is stated"),
        "{text}"
    );
    // What breaks the stated uncertainty has a name where the list has one.
    let whole = succeeds(&folder, &["diagnose", "stiff", "--only", "gain-error", "--only", "speed-error"]);
    assert!(whole.contains("The simulation leaves something out"), "{whole}");
}

/// A detent that the force shows, 1.4 times its noise, beside a dashpot of which a gauge of 1 µm is told a hundred times as much: less than a fiftieth
/// of everything is a rest of the force all the same.
#[test]
fn what_the_force_shows_is_a_rest_whatever_a_gauge_gains() {
    let folder = TempDir::new().unwrap();
    let more = ["--displacement", "1e-6", "--mechanism", "viscous-damping:damping_Ns_per_m=30,across=2", "--seed", "5"];
    campaign(&folder, "gauge", &[&RIG, &more[..]].concat());
    let detent = |force_n: f64| (std::f64::consts::TAU * force_n / 25e3 / 0.8e-3).sin();
    for file in recordings(&folder, "gauge") {
        let text = std::fs::read_to_string(&file).unwrap();
        let (header, rows) = text.split_once('\n').unwrap();
        let changed = |row: &str| {
            let [time, force, displacement] = row.split(',').collect::<Vec<_>>()[..] else { panic!("{row}") };
            let force_n: f64 = force.parse().unwrap();
            let force_n = if force_n > 3.0 { force_n + detent(force_n) } else { force_n };
            format!("{time},{force_n},{displacement}\n")
        };
        let rows: String = rows.lines().map(changed).collect();
        std::fs::write(&file, format!("{header}\n{rows}")).unwrap();
    }
    let text = succeeds(&folder, &["diagnose", "gauge", "--only", "viscous-damping", "--json", "-"]);
    let answer: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(
        (&answer["verdict"], &answer["mechanisms"][0]["id"]),
        (&"unexplained".into(), &"viscous-damping".into())
    );
    assert!(number(&answer["unexplained"], "share") > 0.2, "{answer}");
    assert!(answer["unexplained"]["form"].as_str().unwrap().contains("sin(2πx/"), "{answer}");
}

/// 300 N/µm is no table, whatever swings on it: the springs' own mass does, or a plate. 10 N/µm is one.
#[test]
fn what_hardly_yields_is_a_name_for_something_else() {
    let folder = TempDir::new().unwrap();
    for (name, compliance, verdict) in [("plate", "3e-9", "unexplained"), ("table", "1e-7", "named")] {
        let frame = format!("frame-compliance:compliance_m_per_N={compliance},mass_kg=30,mass_on_cell_kg=6");
        let more = ["--mechanism", &frame, "--noise", "0.03", "--seed", "5"];
        campaign(&folder, name, &[&RIG, &more[..]].concat());
        let text = succeeds(&folder, &["diagnose", name, "--only", "frame-compliance", "--json", "-"]);
        let answer: Value = serde_json::from_str(&text).unwrap();
        assert_eq!((&answer["verdict"], &answer["mechanisms"][0]["id"]), (&verdict.into(), &"frame-compliance".into()));
        assert!(answer["model"]["residual_is_white"].as_bool().unwrap(), "{name}: {answer}");
        let because = answer["mechanisms"][0]["because"].as_str().unwrap();
        assert_eq!(because.contains("compliance_m_per_N = "), name == "plate", "{because}");
    }
}

/// The damping of a piece on its springs is a dashpot's law: one that is damped as nothing is has a dashpot beside it.
#[test]
fn a_piece_that_nothing_is_like_is_a_piece_and_a_dashpot() {
    let folder = TempDir::new().unwrap();
    let piece = "moving-piece-inertia:mass_kg=0.045,spring_damping_ratio=0.02";
    let dashpot = "viscous-damping:damping_Ns_per_m=55,across=2";
    let more = ["--repeats", "2", "--mechanism", piece, "--mechanism", dashpot, "--seed", "5"];
    campaign(&folder, "piece", &[&RIG, &more[..]].concat());
    let few = ["--only", "moving-piece-inertia", "--only", "viscous-damping", "--only", "hunt-crossley-damping"];
    let text = succeeds(&folder, &[&["diagnose", "piece", "--json", "-"], &few[..]].concat());
    let answer: Value = serde_json::from_str(&text).unwrap();
    let [piece, dashpot] = &answer["mechanisms"].as_array().unwrap()[..] else { panic!("{answer}") };
    assert_eq!((&answer["verdict"], &piece["id"]), (&"named".into(), &"moving-piece-inertia".into()), "{answer}");
    assert_eq!(dashpot["id"], "viscous-damping", "{answer}");
    let because = dashpot["because"].as_str().unwrap();
    assert!(because.contains("another has a shape that nothing has"), "{because}");
}

/// What starting leaves behind is larger after a fast start.
#[test]
fn a_sway_that_grows_with_the_speed_is_told_from_one_that_does_not() {
    let folder = TempDir::new().unwrap();
    for with_speed in [0.0, 1.0] {
        let sway = format!(
            "link-oscillation:amplitude_m_per_s=0.02,frequency_Hz=7,phase_rad=0.5,phase_step_rad=1,with_speed={with_speed}"
        );
        let name = format!("sway{with_speed}");
        campaign(&folder, &name, &[&RIG, &["--mechanism", &sway, "--seed", "5"][..]].concat());
        let text = succeeds(&folder, &["diagnose", &name, "--only", "link-oscillation", "--json", "-"]);
        let answer: Value = serde_json::from_str(&text).unwrap();
        let named = &answer["mechanisms"][0];
        assert_eq!((value_of(named, "with_speed"), &answer["verdict"]), (with_speed, &"named".into()), "{answer}");
        let amplitude = value_of(named, "amplitude_m_per_s");
        assert!((amplitude - 0.02).abs() < 0.005, "{amplitude}");
    }
}

/// A sway that is met at the same moment each time has three numbers, not one more for each impact: a weak one is found, too.
#[test]
fn a_sway_that_the_program_always_meets_alike_is_told_as_that() {
    let folder = TempDir::new().unwrap();
    let sway = "link-oscillation:amplitude_m_per_s=0.006,frequency_Hz=5,repeats=1,common_phase_rad=-1";
    campaign(&folder, "sway", &[&RIG, &["--mechanism", sway, "--seed", "5"][..]].concat());
    let text = succeeds(&folder, &["diagnose", "sway", "--only", "link-oscillation", "--json", "-"]);
    let answer: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(answer["verdict"], "named", "{answer}");
    let named = &answer["mechanisms"][0];
    let [repeats, hz] = ["repeats", "frequency_Hz"].map(|name| value_of(named, name));
    assert!(repeats == 1.0 && (hz - 5.0).abs() < 0.5, "{repeats} {hz}");
    assert!(named["parameters"].as_array().unwrap().iter().all(|one| one["name"] != "phase_rad"), "{answer}");
}

/// A zone of one stress pulls as much until it tears; a neck whose pull falls with the distance leaves something of it.
#[test]
fn a_pull_may_hold_until_it_tears() {
    let folder = TempDir::new().unwrap();
    let tacky = "adhesion:pull_off_N=4,neck_m=3e-4,holds=1,power=20";
    let more = ["--repeats", "2", "--noise", "0.1", "--mechanism", tacky, "--seed", "5"];
    campaign(&folder, "tacky", &[&RIG, &more[..]].concat());
    let text = succeeds(&folder, &["diagnose", "tacky", "--only", "adhesion", "--json", "-"]);
    let answer: Value = serde_json::from_str(&text).unwrap();
    let named = &answer["mechanisms"][0];
    let [pull_n, neck_m, holds] = ["pull_off_N", "neck_m", "holds"].map(|name| value_of(named, name));
    assert_eq!((holds, &answer["verdict"]), (1.0, &"named".into()), "{answer}");
    assert!((pull_n - 4.0).abs() < 0.4 && (neck_m - 3e-4).abs() < 5e-5, "{pull_n} {neck_m}");
}

/// Drives that are told a force come to it within their lag and lose some to their own friction; no position is wanted.
#[test]
fn a_force_that_goes_on_is_told_from_a_position_that_is_wanted() {
    let folder = TempDir::new().unwrap();
    let push = "robot-push:course=3,force_N=20,lag_s=0.006,drive_damping_Ns_per_m=150";
    campaign(
        &folder,
        "push",
        &[&RIG, &["--repeats", "2", "--noise", "0.1", "--mechanism", push, "--seed", "5"][..]].concat(),
    );
    let text = succeeds(&folder, &["diagnose", "push", "--only", "robot-push", "--json", "-"]);
    let answer: Value = serde_json::from_str(&text).unwrap();
    let named = &answer["mechanisms"][0];
    let [course, force_n] = ["course", "force_N"].map(|name| value_of(named, name));
    let [lag_s, damping] = ["lag_s", "drive_damping_Ns_per_m"].map(|name| value_of(named, name));
    assert_eq!((course, &answer["verdict"]), (3.0, &"named".into()), "{answer}");
    assert!((force_n / 20.0 - 1.0).abs() < 0.05 && (damping / 150.0 - 1.0).abs() < 0.1, "{force_n} {damping}");
    assert!((lag_s / 0.006 - 1.0).abs() < 0.3, "{lag_s}");
}

/// A filter of four poles at 600 Hz delays by 0.7 ms, nearly three samples; what it does besides is no fiftieth of that. A zero drifts from the first sample on,
/// which is long before the fit begins, and is no noise.
#[test]
fn what_comes_late_on_a_drifting_zero_is_told_from_an_instant() {
    let folder = TempDir::new().unwrap();
    for kind in ["impact", "drop"] {
        let rig =
            ["simulate", "--kind", kind, "--body-stiffness", "50000", "--speeds", "0.1,0.2,0.3", "--masses", "1,2"];
        let chain = ["--sample-rate", "4000", "--before", "0.12", "--after", "0.1", "--noise", "0.1", "--seed", "5"];
        let late = ["--mechanism", "filter-lag:corner_Hz=600,poles=4", "--mechanism", "charge-drift:rate_N_per_s=1.5"];
        succeeds(&folder, &[&rig[..], &["--repeats", "2", "--out", kind], &chain, &late].concat());
        let few = ["--only", "filter-lag", "--only", "charge-drift", "--json", "-"];
        let text = succeeds(&folder, &[&["diagnose", kind], &few[..]].concat());
        let answer: Value = serde_json::from_str(&text).unwrap();
        let named = answer["mechanisms"].as_array().unwrap();
        let of = |id: &str| named.iter().find(|named| named["id"] == id).unwrap_or_else(|| panic!("{id}: {answer}"));
        assert_eq!((named.len(), &answer["verdict"]), (2, &"named".into()), "{answer}");
        let [corner_hz, poles] = ["corner_Hz", "poles"].map(|name| value_of(of("filter-lag"), name));
        assert!((corner_hz - 600.0).abs() < 15.0 && poles == 4.0, "{corner_hz} {poles}");
        assert!((value_of(of("charge-drift"), "rate_N_per_s") - 1.5).abs() < 0.1);
        let ratio = number(&answer["model"], "noise_ratio");
        assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
    }
}

/// A hum is on the force alone, and is worth its name by what the force shows, whatever a gauge is told of friction.
#[test]
fn a_hum_need_not_outweigh_what_a_gauge_gains() {
    let folder = TempDir::new().unwrap();
    let rubs = "load-dependent-friction:coefficient=0.03";
    let hums = "mains-hum:amplitude_N=0.2,frequency_Hz=50";
    let more = ["--displacement", "1e-6", "--mechanism", rubs, "--mechanism", hums, "--seed", "5"];
    campaign(&folder, "gauge", &[&RIG, &more[..]].concat());
    let few = ["--only", "load-dependent-friction", "--only", "mains-hum"];
    assert_eq!(names(&folder, &[&["gauge"], &few[..]].concat()), ["mains-hum", "load-dependent-friction"]);
}

/// A stop that loses energy is, without its loss, many times as stiff, and comes sooner; what that leaves is little beside what it explains.
#[test]
fn a_stop_may_lose_energy() {
    let folder = TempDir::new().unwrap();
    let stop = "end-stop:stroke_m=0.0025,stiffness_ratio=15,loses=1,alpha_s_per_m=1";
    // How stiff pad and stop are and what the stop loses is one flat valley of χ²: the pad is known here.
    let more = ["--repeats", "2", "--pad-error", "0.03", "--mechanism", stop, "--seed", "5"];
    campaign(&folder, "stop", &[&RIG, &more[..]].concat());
    let text = succeeds(&folder, &["diagnose", "stop", "--only", "end-stop", "--json", "-"]);
    let answer: Value = serde_json::from_str(&text).unwrap();
    let named = &answer["mechanisms"][0];
    let [ratio, alpha, loses] = ["stiffness_ratio", "alpha_s_per_m", "loses"].map(|name| value_of(named, name));
    assert_eq!((loses, &answer["verdict"]), (1.0, &"named".into()), "{answer}");
    assert!((10.0..25.0).contains(&ratio) && (0.5..2.0).contains(&alpha), "{ratio} {alpha}");
}

/// A tacky pad pulls for a few milliseconds: next to nothing beside all that the contacts show.
#[test]
fn what_is_odd_for_a_moment_only_is_not_passed_over() {
    let folder = TempDir::new().unwrap();
    campaign(&folder, "tacky", &[&RIG[..], &["--mechanism", "adhesion:pull_off_N=3", "--seed", "5"]].concat());
    succeeds(&folder, &["diagnose", "tacky", "--only", "hunt-crossley-damping", "--json", "a.json"]);
    let answer: Value = serde_json::from_str(&read(&folder, "a.json")).unwrap();
    assert_eq!((&answer["verdict"], &answer["where"][0]["phase"]), (&"unexplained".into(), &"after".into()));
}

/// A magnet's detent, less than the noise: it comes at another time and with another frequency in each recording, and is told by the way.
#[test]
fn what_comes_back_along_the_stroke_is_no_noise() {
    let folder = TempDir::new().unwrap();
    campaign(&folder, "detent", &["--body-stiffness", "25000", "--repeats", "2", "--noise", "0.3", "--seed", "8"]);
    let pitch_m = 0.8e-3;
    for file in recordings(&folder, "detent") {
        let detent = |force_n: f64| 0.26 * (std::f64::consts::TAU * force_n / 25e3 / pitch_m).sin();
        change(&file, |force_n| if force_n > 3.0 { force_n + detent(force_n) } else { force_n });
    }
    let text = succeeds(&folder, &[&["diagnose", "detent", "--json", "-"][..], &FEW[..]].concat());
    let answer: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(answer["verdict"], "unexplained", "{answer}");
    let form = answer["unexplained"]["form"].as_str().unwrap();
    assert!(form.contains("(2πx/0.8"), "{form}");
}

/// A gain that was wrong in two recordings of twelve: a fit to all of them spreads it, and a sway of the robot with a phase for each impact bends
/// to what is left.
#[test]
fn what_acts_in_few_recordings_is_found_where_the_others_do_not_foretell_them() {
    let folder = TempDir::new().unwrap();
    campaign(&folder, "few", &[&RIG[..], &["--repeats", "2", "--seed", "5"]].concat());
    for number in ["011", "012"] {
        let file = format!("few/recordings/{number}.csv");
        let weaker: Vec<String> = read(&folder, &file)
            .lines()
            .map(|line| {
                let row = line.split_once(',').and_then(|(time, force)| Some((time, force.parse::<f64>().ok()?)));
                row.map_or(line.to_owned(), |(time, force)| format!("{time},{:.4}", 0.85 * force))
            })
            .collect();
        std::fs::write(folder.path().join(file), weaker.join("\n") + "\n").unwrap();
    }
    let rivals = ["--only", "gain-error", "--only", "link-oscillation", "--only", "filter-lag"];
    succeeds(&folder, &[&["diagnose", "few", "--json", "a.json"], &rivals[..]].concat());
    let answer: Value = serde_json::from_str(&read(&folder, "a.json")).unwrap();
    let named = &answer["mechanisms"];
    assert_eq!((&named[0]["id"], &named[1]), (&"gain-error".into(), &Value::Null), "{answer}");
    assert!(named[0]["because"].as_str().unwrap().contains("it acts in recordings 011 and 012 only"), "{named}");
    let gain = &named[0]["parameters"][0];
    assert!(number(gain, "low") < -0.15 && number(gain, "high") > -0.15, "{gain}");
}

/// A pad that loses energy in three recordings of twelve that have nothing else in common is believed only where nothing else can be it.
#[test]
fn what_lasts_does_not_choose_its_recordings() {
    let folder = TempDir::new().unwrap();
    let plain = [&RIG[..], &["--repeats", "2", "--seed", "5"]].concat();
    let verdict = |alpha: &str, damped: &[&str], name: &str| {
        let hidden = format!("hunt-crossley-damping:alpha_s_per_m={alpha}");
        let whole = format!("{name}-whole");
        campaign(&folder, &whole, &[&plain[..], &["--mechanism", &hidden]].concat());
        campaign(&folder, name, &plain);
        for number in damped {
            let file = format!("recordings/{number}.csv");
            std::fs::copy(folder.path().join(&whole).join(&file), folder.path().join(name).join(&file)).unwrap();
        }
        let two = ["--only", "hunt-crossley-damping", "--only", "viscous-damping"];
        succeeds(&folder, &[&["diagnose", name, "--json", "a.json"], &two[..]].concat());
        let answer: Value = serde_json::from_str(&read(&folder, "a.json")).unwrap();
        assert_eq!(answer["mechanisms"][0]["id"], "hunt-crossley-damping", "{answer}");
        let because = answer["mechanisms"][0]["because"].as_str().unwrap().to_owned();
        (answer["verdict"].as_str().unwrap().to_owned(), because)
    };
    let scattered = ["002", "005", "009"];
    let (weak, because) = verdict("0.3", &scattered, "weak");
    assert!(weak == "unexplained" && because.contains("it is a thing that lasts;"), "{weak}: {because}");
    let (strong, because) = verdict("1", &scattered, "strong");
    assert!(strong == "named" && because.contains("but nothing else of the list comes near it"), "{strong}: {because}");
    // A pad that was changed before the last three.
    let (late, because) = verdict("1", &["010", "011", "012"], "late");
    assert!(late == "named" && because.contains("it acts in recordings 010, 011 and 012 only;"), "{late}: {because}");
    assert!(!because.contains("nothing else in common"), "{because}");
}

/// A gate that is late reads every speed too low by the same: no part of it, and no sway of the robot.
#[test]
fn a_speed_that_is_off_by_the_same_everywhere_is_told_from_a_part_of_it() {
    let folder = TempDir::new().unwrap();
    let late = ["--speed-error", "0.005", "--mechanism", "speed-error:relative=0.12,exponent=1", "--seed", "5"];
    campaign(&folder, "late", &[&RIG[..], &late].concat());
    let few = ["--only", "gain-error", "--only", "speed-error", "--only", "link-oscillation"];
    let text = succeeds(&folder, &[&["diagnose", "late", "--json", "-"], &few[..]].concat());
    let answer: Value = serde_json::from_str(&text).unwrap();
    let named = &answer["mechanisms"];
    assert_eq!((&named[0]["id"], &named[1]), (&"speed-error".into(), &Value::Null), "{answer}");
    assert_eq!(number(&named[0]["parameters"][1], "value"), 1.0);
    assert!((number(&named[0]["parameters"][0], "value") - 0.12).abs() < 0.02, "{named}");
}

/// At 100 kS/s contact and release lie within means of many samples; a corner is no curve.
#[test]
fn a_quick_recorder_shows_no_more_physics_than_a_slow_one() {
    let folder = TempDir::new().unwrap();
    let quick = ["--sample-rate", "100000", "--after", "0.03", "--noise", "0.1", "--speeds", "0.2,0.4,0.6"];
    let mut arguments = vec!["simulate", "--masses", "5,12", "--repeats", "1", "--out", "quick"];
    arguments.extend(["--body-stiffness", "40000", "--pad", "1500000"]);
    arguments.extend(quick);
    succeeds(&folder, &arguments);
    let few = ["--only", "clearance", "--only", "adhesion", "--only", "lost-samples"];
    let text = succeeds(&folder, &[&["diagnose", "quick", "--json", "-"], &few[..]].concat());
    let answer: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(answer["verdict"], "consistent", "{answer}");
}

/// A position controller holds a robot at its stopping distance. What comes after the first contact depends on how it was left: a fit to whole
/// recordings ends in a valley a thousand times too high, one that grows with them does not.
#[test]
fn a_robot_that_stays_is_followed_from_its_first_contact() {
    let folder = TempDir::new().unwrap();
    let push = "robot-push:force_N=100,servo_stiffness_N_per_m=3000,reaction_s=0.01,deceleration_m_per_s2=50";
    let rig = ["--body-stiffness", "35000", "--repeats", "2", "--seed", "7", "--mechanism", push];
    let mut arguments = vec!["simulate", "--speeds", "0.15,0.3", "--masses", "4,8", "--after", "0.3", "--out", "held"];
    arguments.extend(rig);
    succeeds(&folder, &arguments);
    succeeds(&folder, &["diagnose", "held", "--only", "robot-push", "--json", "a.json"]);
    let answer: Value = serde_json::from_str(&read(&folder, "a.json")).unwrap();
    assert_eq!((&answer["verdict"], &answer["mechanisms"][0]["id"]), (&"named".into(), &"robot-push".into()));
    let estimated = |name: &str| value_of(&answer["mechanisms"][0], name);
    assert!(
        (estimated("force_N") - 100.0).abs() < 15.0 && (estimated("servo_stiffness_N_per_m") - 3000.0).abs() < 900.0
    );
}

/// A dashpot's step at contact and that of a drag take from each other: beside the one that comes first the other promises nothing, and by
/// itself a dashpot of another form comes nearer.
#[test]
fn two_steps_at_contact_are_told_from_one() {
    for (damping, drag, within) in [("130", "45", 0.05), ("90", "60", 0.08)] {
        let folder = TempDir::new().unwrap();
        let mut arguments = vec!["simulate", "--speeds", "0.1,0.2,0.3,0.45", "--masses", "4,6,8", "--repeats", "1"];
        arguments.extend(["--body-stiffness", "32000", "--pad", "93000", "--after", "0.2", "--seed", "1"]);
        let dashpot = format!("viscous-damping:damping_Ns_per_m={damping}");
        let air = format!("air-damping:drag_Ns2_per_m2={drag},cell_share=1");
        arguments.extend(["--mechanism", &dashpot, "--mechanism", &air, "--out", "two"]);
        succeeds(&folder, &arguments);
        let few = ["--only", "viscous-damping", "--only", "air-damping"];
        let text = succeeds(&folder, &[&["diagnose", "two", "--json", "-"], &few[..]].concat());
        let answer: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(answer["verdict"], "named", "{answer}");
        let mechanisms = answer["mechanisms"].as_array().unwrap();
        for (id, strength) in [("viscous-damping", damping), ("air-damping", drag)] {
            let found = mechanisms.iter().find(|one| one["id"] == id).expect("both are named");
            let value = number(&found["parameters"][0], "value");
            assert!((value / strength.parse::<f64>().unwrap() - 1.0).abs() < within, "{id}: {value}");
        }
    }
}

/// What a cleared buffer reads is nought, not the last value.
#[test]
fn samples_that_read_nought_are_lost_ones() {
    let folder = TempDir::new().unwrap();
    let lost = ["--mechanism", "lost-samples:lost_s=0.003,at_s=0.015,filled=2", "--seed", "3"];
    campaign(&folder, "cleared", &[&RIG[..], &lost].concat());
    let few = ["--only", "clearance", "--only", "adhesion", "--only", "lost-samples"];
    let text = succeeds(&folder, &[&["diagnose", "cleared", "--json", "-"], &few[..]].concat());
    let answer: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((&answer["verdict"], &answer["mechanisms"][0]["id"]), (&"named".into(), &"lost-samples".into()));
    let value = |name: &str| value_of(&answer["mechanisms"][0], name);
    assert!((value("lost_s") / 0.003 - 1.0).abs() < 0.05, "{answer}");
    assert_eq!(value("filled"), 2.0, "{answer}");
}

/// A diagnosis that names lost samples and nothing else.
fn lost_samples_alone(folder: &TempDir, name: &str) -> Value {
    let few = ["--only", "clearance", "--only", "pad-relaxation", "--only", "hardening", "--only", "lost-samples"];
    let text = succeeds(folder, &[&["diagnose", name, "--json", "-"], &few[..]].concat());
    let answer: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(answer["verdict"], "named", "{answer}");
    let [only] = &answer["mechanisms"].as_array().unwrap()[..] else { panic!("{answer}") };
    assert_eq!(only["id"], "lost-samples", "{answer}");
    answer
}

/// In half of the recordings, and in each another number of them.
#[test]
fn each_recording_loses_as_many_samples_as_it_does() {
    let folder = TempDir::new().unwrap();
    campaign(&folder, "dropped", &[&RIG[..], &["--seed", "3"]].concat());
    let files = recordings(&folder, "dropped");
    let name = |file: &Path| file.file_stem().unwrap().to_str().unwrap().to_owned();
    // On the way up, at the peak and on the way down.
    let lost = [(0, -12, 4), (2, -6, 9), (3, 8, 6)].map(|(file, from, count)| {
        let file = &files[file];
        lose(file, highest(file).strict_add_signed(from), count);
        (name(file), count)
    });
    let answer = lost_samples_alone(&folder, "dropped");
    let only = &answer["mechanisms"][0];
    parameters_are(&only["parameters"]);
    for (name, count) in lost {
        let lost_s = value_of(only, &format!("lost_s[{name}]"));
        assert!((lost_s * 2000.0 - f64::from(u8::try_from(count).unwrap())).abs() < 0.3, "{name}: {answer}");
    }
    assert_eq!(value_of(only, "filled"), 0.0, "{answer}");
    assert!(number(&answer["model"], "noise_ratio") < 1.05, "{answer}");
}

/// A block of nine samples each time: twice in one recording, three times in another, once in a third and never in the fourth.
#[test]
fn a_recording_may_lose_samples_several_times() {
    let folder = TempDir::new().unwrap();
    campaign(&folder, "dropped", &[&RIG[..], &["--seed", "3"]].concat());
    let files = recordings(&folder, "dropped");
    // The last first: what is lost moves what comes later.
    for (file, gaps) in [(0, &[12, -12][..]), (1, &[14, 2, -14]), (2, &[6])] {
        let peak = highest(&files[file]);
        gaps.iter().for_each(|from| lose(&files[file], peak.strict_add_signed(*from), 9));
    }
    let answer = lost_samples_alone(&folder, "dropped");
    let only = &answer["mechanisms"][0];
    assert!((value_of(only, "lost_s") * 2000.0 - 9.0).abs() < 0.3, "{answer}");
    let mut instants_s = ["at_s", "second_s", "third_s"].map(|name| value_of(only, name));
    instants_s.sort_by(f64::total_cmp);
    assert!(instants_s[2] < 0.1, "all three are within the contact: {answer}");
    assert!(number(&answer["model"], "noise_ratio") < 1.05, "{answer}");
}

/// Where samples were lost is each recording's own: the model's instant is not theirs.
#[test]
fn a_model_with_an_instant_of_each_impact_finds_it_in_each_recording() {
    let folder = TempDir::new().unwrap();
    std::fs::write(
        folder.path().join("lossy.toml"),
        "format = \"thud-model/1\"\nname = \"lossy\"\n[rig]\nkind = \"impact\"\n\
         body_stiffness_N_per_m = { value = 25000.0, sd = 1250.0 }\n\
         pad_stiffness_N_per_m = { value = 80000.0, sd = 20000.0 }\n\
         [[mechanism]]\nid = \"lost-samples\"\n[mechanism.parameters]\n\
         lost_s = { value = 0.004, low = 0.0039, high = 0.0041 }\nat_s = { value = 0.005 }\n",
    )
    .unwrap();
    let evaluated = |more: &[&str], folder: &TempDir| -> Value {
        campaign(folder, "next", &[&RIG[..], &["--seed", "3", "--replace"], more].concat());
        serde_json::from_str(&succeeds(folder, &["evaluate", "lossy.toml", "next", "--json", "-"])).unwrap()
    };
    for at_s in ["0.02", "0.03"] {
        let lost = format!("lost-samples:lost_s=0.004,at_s={at_s}");
        let evaluation = evaluated(&["--mechanism", &lost], &folder);
        // From the model's own instant alone a fit leaves twice the noise.
        assert!(number(&evaluation, "noise_ratio") < 1.1, "lost at {at_s} s: {evaluation}");
    }
    // Where nothing was lost, nothing has to be.
    let evaluation = evaluated(&[], &folder);
    assert_eq!(evaluation["verdict"], "holds", "{evaluation}");
}

#[test]
fn what_cannot_be_used_is_refused_with_a_sentence() {
    let folder = TempDir::new().unwrap();
    campaign(&folder, "plain", &RIG);
    for option in ["--without", "--only"] {
        let words = refuses(&folder, &["diagnose", "plain", option, "rust"]);
        assert!(words.contains("no mechanism is called `rust`") && words.contains("thud mechanisms"), "{words}");
    }
    assert!(refuses(&folder, &["mechanisms", "rust"]).contains("no mechanism is called `rust`"));
    assert!(refuses(&folder, &["diagnose", "nowhere"]).contains("give the path of an existing file"));

    let toml = read(&folder, "plain/campaign.toml");
    std::fs::write(folder.path().join("plain/campaign.toml"), toml.replacen("sd = ", "sd = -", 1)).unwrap();
    let words = refuses(&folder, &["diagnose", "plain"]);
    assert!(words.contains("campaign.toml") && words.contains("one standard deviation"), "{words}");

    // Nothing in any recording rises above its noise.
    std::fs::write(folder.path().join("plain/campaign.toml"), &toml).unwrap();
    for number in 1..=6 {
        let path = folder.path().join(format!("plain/recordings/{number:03}.csv"));
        let quiet: String = (0..400)
            .fold("time_s,force_N\n".to_owned(), |text, n| text + &format!("{},{}\n", f64::from(n) * 5e-4, n % 2));
        std::fs::write(path, quiet).unwrap();
    }
    let words = refuses(&folder, &["diagnose", "plain"]);
    assert!(words.contains("rises above its noise"), "{words}");

    // A model of another experiment.
    let model = "format = \"thud-model/1\"\nname = \"fall\"\n[rig]\nkind = \"fall\"\n";
    std::fs::write(folder.path().join("fall.toml"), model).unwrap();
    let words = refuses(&folder, &["evaluate", "fall.toml", "plain"]);
    assert!(words.contains("\"fall\"") && words.contains("\"impact\""), "{words}");
}

#[test]
fn every_mechanism_can_be_looked_up() {
    let folder = TempDir::new().unwrap();
    let list: Value = serde_json::from_str(&succeeds(&folder, &["mechanisms", "--json", "-"])).unwrap();
    let table = succeeds(&folder, &["mechanisms"]);
    assert!(list.as_array().unwrap().len() >= 26);
    for mechanism in list.as_array().unwrap() {
        let id = mechanism["id"].as_str().unwrap();
        assert!(table.contains(id), "{id}");
    }
    let one = succeeds(&folder, &["mechanisms", "piezo-discharge"]);
    for word in ["time_constant", "confused with", "separated by", "source", "thud simulate --mechanism"] {
        assert!(one.contains(word), "{word}: {one}");
    }
    assert!(one.lines().all(|line| line.chars().count() <= 110), "{one}");
}

/// What `thud simulate` writes as a displacement, the diagnosis reads as that, with a pad and without, beside the force and alone.
#[test]
fn a_displacement_is_read_as_it_was_simulated() {
    let folder = TempDir::new().unwrap();
    for (name, rig) in [("padded", &RIG[..]), ("bare", &RIG[..2])] {
        campaign(&folder, name, &[rig, &["--displacement", "1e-5", "--seed", "5"]].concat());
        let mut arguments = vec!["diagnose", name, "--json", "-"];
        arguments.extend(FEW);
        let beside: Value = serde_json::from_str(&succeeds(&folder, &arguments)).unwrap();
        assert_eq!(beside["verdict"], "consistent", "{name}: {beside}");
        restate(&folder, name, &ALONE);
        let only: Value = serde_json::from_str(&succeeds(&folder, &arguments)).unwrap();
        assert_eq!(only["verdict"], "consistent", "{name}: {only}");
        assert!(number(&only["baseline"], "retuned_rmse") < 1.2e-5, "{name}: {only}");
    }
}

/// A dashpot that only a fine displacement shows, and no force, is one of the usual imperfections, beside a wrong mass as by itself: it neither joins
/// the mass nor stands for it.
#[test]
fn what_only_a_finer_channel_shows_is_a_trace() {
    let folder = TempDir::new().unwrap();
    let few = ["--only", "pose-dependent-mass", "--only", "viscous-damping", "--only", "hunt-crossley-damping"];
    let trace = ["--displacement", "2e-7", "--mechanism", "viscous-damping:damping_Ns_per_m=0.6", "--seed", "5"];
    let wrong_mass = ["--mechanism", "pose-dependent-mass:relative=0.3,configuration=1"];
    let fine = ["simulate", "--speeds", "0.1,0.2,0.3", "--masses", "4,8", "--repeats", "1", "--sample-rate", "10000"];
    for (name, more, named) in [("alone", &[][..], &[][..]), ("beside", &wrong_mass, &["pose-dependent-mass"])] {
        succeeds(&folder, &[&fine[..], &["--after", "0.2", "--out", name], &RIG, &trace, more].concat());
        assert_eq!(names(&folder, &[&[name], &few[..]].concat()), named, "{name}");
        let answer: Value =
            serde_json::from_str(&succeeds(&folder, &[&["diagnose", name, "--json", "-"], &few[..]].concat())).unwrap();
        let because = |list: &str, id: &str| {
            let found = answer[list].as_array().unwrap().iter().find(|entry| entry["id"] == id).cloned();
            found.map(|entry| entry["because"].as_str().unwrap().to_owned()).unwrap_or_default()
        };
        assert!(because("rejected", "viscous-damping").starts_with("what is observed hardly shows it"), "{answer}");
        assert!(!because("mechanisms", "pose-dependent-mass").contains("too little"), "{answer}");
    }
}

/// A displacement that came through no filter, or through another instrument, is read a sample sooner or later than the force: that is no lag
/// of the force's chain. A real lag is, beside it.
#[test]
fn another_channel_may_be_read_a_sample_later() {
    let folder = TempDir::new().unwrap();
    let few = ["--only", "filter-lag", "--only", "viscous-damping", "--only", "guide-friction"];
    for (name, lag, named) in
        [("prompt", &[][..], &[][..]), ("lagging", &["--mechanism", "filter-lag:corner_Hz=60"], &["filter-lag"])]
    {
        campaign(&folder, name, &[&RIG, &["--displacement", "1e-5", "--seed", "5"], lag].concat());
        for recording in 1..=6 {
            later(&folder.path().join(format!("{name}/recordings/00{recording}.csv")));
        }
        assert_eq!(names(&folder, &[&[name], &few[..]].concat()), named, "{name}");
        let page = succeeds(&folder, &[&["diagnose", name], &few[..]].concat());
        let words: Vec<&str> = page.split_whitespace().collect();
        let told = words.windows(4).find(|words| words[..3] == ["`displacement_m`", "is", "read"]).expect(&page);
        let later_ms: f64 = told[3].parse().unwrap();
        assert!((later_ms - 0.5).abs() < 0.03 && page.contains("later than"), "{page}");
    }
}

/// Every last value of a CSV one line further down.
fn later(file: &Path) {
    let text = std::fs::read_to_string(file).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    let (others, lasts): (Vec<&str>, Vec<&str>) = rows.lines().map(|line| line.rsplit_once(',').unwrap()).unzip();
    let shifted = lasts[..1].iter().chain(&lasts);
    let rows: Vec<String> = others.iter().zip(shifted).map(|(others, last)| format!("{others},{last}")).collect();
    std::fs::write(file, format!("{header}\n{}\n", rows.join("\n"))).unwrap();
}

/// Once the robot has left, a gauge may show what the force does not feel any more (its plate sinks back by 0.5 mm): that is neither a name nor a rest.
#[test]
fn a_gauge_is_asked_beside_contact() {
    let folder = TempDir::new().unwrap();
    campaign(&folder, "sinking", &[&RIG, &["--displacement", "1e-5", "--seed", "5"][..]].concat());
    for file in recordings(&folder, "sinking") {
        let text = std::fs::read_to_string(&file).unwrap();
        let peak = highest(&file);
        let time_of = |row: &str| row.split(',').next().and_then(|time| time.parse::<f64>().ok());
        let (_, peak_s) = text.lines().filter_map(time_of).enumerate().find(|(row, _)| *row == peak).unwrap();
        // The contact of 8 kg takes 64 ms: it ends half of that after the peak, at the latest.
        let sinks = |row: &str| match (time_of(row), row.rsplit_once(',')) {
            (Some(time_s), Some((others, stroke))) => {
                let since_s = (time_s - peak_s - 0.09).max(0.0);
                format!("{others},{}\n", stroke.parse::<f64>().unwrap() - 0.1 * since_s.powi(2))
            }
            _ => format!("{row}\n"),
        };
        std::fs::write(&file, text.lines().map(sinks).collect::<String>()).unwrap();
    }
    succeeds(&folder, &["diagnose", "sinking", "--json", "sinking.json"]);
    let answer: Value = serde_json::from_str(&read(&folder, "sinking.json")).unwrap();
    assert_eq!(answer["verdict"], "consistent", "{}", answer["mechanisms"]);
}

/// A displacement alone.
const ALONE: [(&str, &str); 3] =
    [("observed", "\"displacement_m\""), ("noise_rms_N", "1e-5"), ("full_scale_N", "0.05")];

/// Rails are there for a displacement as for a force, and its limit is the force of the stated springs at that stroke.
#[test]
fn a_gauge_that_is_no_force_has_a_chain_too() {
    let folder = TempDir::new().unwrap();
    campaign(&folder, "gauge", &[&RIG[..2], &["--displacement", "1e-5", "--seed", "5"]].concat());
    restate(&folder, "gauge", &ALONE);
    for recording in 1..=6 {
        let file = folder.path().join(format!("gauge/recordings/00{recording}.csv"));
        change(&file, |stroke_m| stroke_m.min(4e-3));
        // Beside a force the chain would be that of the force.
        let without_force = |line: &str| match *line.split(',').collect::<Vec<_>>() {
            [time, _, stroke] => format!("{time},{stroke}\n"),
            _ => format!("{line}\n"),
        };
        let text: String = std::fs::read_to_string(&file).unwrap().lines().map(without_force).collect();
        std::fs::write(&file, text).unwrap();
    }
    let only = ["--only", "clipping", "--only", "end-stop", "--only", "force-ceiling"];
    let text = succeeds(&folder, &[&["diagnose", "gauge", "--json", "-"], &only[..]].concat());
    let answer: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((&answer["verdict"], &answer["mechanisms"][0]["id"]), (&"named".into(), &"clipping".into()), "{answer}");
    let limit = &answer["mechanisms"][0]["parameters"][0];
    assert!((number(limit, "value") / (25_000.0 * 4e-3) - 1.0).abs() < 0.01, "{limit}");
}

/// An amplifier bends just below its rails; what bends from a third of them on is no rail, but a curve of the cell.
#[test]
fn a_cell_that_bends_is_no_rail() {
    let folder = TempDir::new().unwrap();
    for (name, limit, knee, verdict) in [("rail", 80, 0.005, "named"), ("cell", 200, 0.2, "unexplained")] {
        let bends = format!("clipping:limit_N={limit},knee={knee}");
        campaign(&folder, name, &[&RIG[..2], &["--mechanism", &bends, "--noise", "0.03", "--seed", "5"]].concat());
        let text = succeeds(&folder, &["diagnose", name, "--only", "clipping", "--json", "-"]);
        let answer: Value = serde_json::from_str(&text).unwrap();
        let named = &answer["mechanisms"][0];
        assert_eq!((&answer["verdict"], &named["id"]), (&verdict.into(), &"clipping".into()), "{answer}");
        assert_eq!(named["because"].as_str().unwrap().contains("knee = "), name == "cell", "{answer}");
        assert_eq!(named["because"].as_str().unwrap().contains(" to 0.02 that are likely"), name == "cell", "{answer}");
    }
}

/// Behind drives that slip an accelerometer shows what they bear, and not how the light tip stops.
#[test]
fn an_accelerometer_may_be_behind_what_slips() {
    let folder = TempDir::new().unwrap();
    let ceiling = "force-ceiling:force_N=80,tip_fraction=1e-4,slip_damping_Ns_per_m=1";
    campaign(&folder, "slips", &[&RIG[..2], &["--mechanism", ceiling, "--noise", "0.1", "--seed", "5"]].concat());
    let stated = read(&folder, "slips/campaign.toml");
    let masses = stated.lines().filter(|line| line.starts_with("effective_mass_kg"));
    let masses = masses.map(|line| line.split_once("value = ").unwrap().1.split(',').next().unwrap());
    let masses: Vec<f64> = masses.map(|mass| mass.parse().unwrap()).collect();
    for (file, mass_kg) in recordings(&folder, "slips").iter().zip(masses) {
        change(file, |force_n| force_n / mass_kg);
        let text = std::fs::read_to_string(file).unwrap();
        std::fs::write(file, text.replacen("force_N", "acceleration_m_per_s2", 1)).unwrap();
    }
    let shown = [("observed", "\"acceleration_m_per_s2\""), ("noise_rms_N", "0.02"), ("full_scale_N", "100")];
    restate(&folder, "slips", &shown);
    let few = ["--only", "force-ceiling", "--only", "clipping", "--only", "guide-friction", "--only", "end-stop"];
    assert_eq!(names(&folder, &[&["slips"], &few[..]].concat()), ["force-ceiling"]);
}

/// What is cut is the reading with the chain's zero, which is another in each recording.
#[test]
fn rails_cut_the_reading_with_its_zero() {
    let folder = TempDir::new().unwrap();
    campaign(&folder, "railed", &[&RIG[..2], &["--seed", "5"]].concat());
    for (recording, zero_n) in (1..=6).zip([6.0, -6.0, 5.0, -5.0, 4.0, -3.0]) {
        let read = |force_n: f64| (force_n + zero_n).min(70.0);
        change(&folder.path().join(format!("railed/recordings/00{recording}.csv")), read);
    }
    let few = ["--only", "clipping", "--only", "gain-error", "--only", "frame-compliance", "--only", "force-ceiling"];
    assert_eq!(names(&folder, &[&["railed"], &few[..]].concat()), ["clipping"]);
}

/// What shows a fall.
#[derive(Clone, Copy, Debug)]
enum Shows {
    /// The acceleration of its motion.
    Motion,
    /// What an accelerometer in it feels, upwards.
    Weight,
    /// The way that it has come.
    Way,
    /// How high it still is.
    Height,
}

impl Shows {
    /// Its column and the noise there, in its unit.
    fn column(self) -> (&'static str, f64) {
        match self {
            Self::Motion | Self::Weight => ("acceleration_m_per_s2", 0.2),
            Self::Way => ("displacement_m", 0.002),
            Self::Height => ("height_m", 0.002),
        }
    }
}

const GRAVITY: f64 = 9.806_65;

/// Acceleration and way of what has fallen for so long, v = v_t·tanh(g·t/v_t); without air v_t is infinite.
fn fallen(since_s: f64, terminal_m_per_s: f64) -> (f64, f64) {
    if terminal_m_per_s.is_infinite() {
        return (GRAVITY, 0.5 * GRAVITY * since_s.powi(2));
    }
    let along = GRAVITY * since_s / terminal_m_per_s;
    (GRAVITY / along.cosh().powi(2), terminal_m_per_s.powi(2) / GRAVITY * along.cosh().ln())
}

/// Three falls from rest, each with its release, at 500 Hz.
fn falls(folder: &TempDir, name: &str, shows: Shows, terminal_m_per_s: f64, chance: &mut ChaCha8Rng) {
    let path = folder.path().join(name);
    std::fs::create_dir_all(path.join("recordings")).unwrap();
    let (column, noise_rms) = shows.column();
    let mut stated = format!(
        "format = \"thud-campaign/1\"\nname = \"{name}\"\n[rig]\nkind = \"fall\"\ngravity_along_impact_m_per_s2 = {GRAVITY}\n\
         [chain]\nsample_rate_Hz = 500.0\nnoise_rms_N = {noise_rms}\nobserved = \"{column}\"\n"
    );
    for recording in 1..=3 {
        let file = format!("recordings/{recording}.csv");
        stated += &format!(
            "[[recording]]\nfile = \"{file}\"\nimpact_speed_m_per_s = {{ value = 0.0, sd = 0.01 }}\n\
             effective_mass_kg = {{ value = 0.2, sd = 0.002 }}\n"
        );
        let release_s = 0.2 + 0.0307 * f64::from(recording);
        let mut text = format!("time_s,{column}\n");
        for sample in 0..450 {
            let time_s = f64::from(sample) / 500.0;
            let (acceleration, way_m) =
                if time_s < release_s { (0.0, 0.0) } else { fallen(time_s - release_s, terminal_m_per_s) };
            let shown = match shows {
                Shows::Motion => acceleration,
                Shows::Weight => GRAVITY - acceleration,
                Shows::Way => way_m,
                Shows::Height => 5.0 - way_m,
            };
            let noise: f64 = StandardNormal.sample(chance);
            text += &format!("{time_s:.4},{:.6}\n", shown + noise_rms * noise);
        }
        std::fs::write(path.join(file), text).unwrap();
    }
    std::fs::write(path.join("campaign.toml"), stated).unwrap();
}

/// A fall is told by whatever shows it, and an air drag in it.
#[test]
fn a_fall_is_read_from_whatever_shows_it() {
    let folder = TempDir::new().unwrap();
    let mut chance = ChaCha8Rng::seed_from_u64(1);
    for shows in [Shows::Motion, Shows::Weight, Shows::Way, Shows::Height] {
        falls(&folder, "vacuum", shows, f64::INFINITY, &mut chance);
        assert_eq!(names(&folder, &["vacuum"]), [""; 0], "{shows:?}");
        falls(&folder, "air", shows, 8.0, &mut chance);
        assert_eq!(names(&folder, &["air"]), ["air-drag"], "{shows:?}");
    }
}

/// Each body has its own drag; that one of them were two or three times as heavy as it was weighed would do as much, and so would a scale
/// that is wrong for it.
#[test]
fn each_body_of_a_fall_has_its_own_drag() {
    let folder = TempDir::new().unwrap();
    let mut chance = ChaCha8Rng::seed_from_u64(2);
    falls(&folder, "bodies", Shows::Height, 8.0, &mut chance);
    falls(&folder, "others", Shows::Height, 14.0, &mut chance);
    let of = |configuration: &str, text: &str| {
        text.replace("effective_mass_kg", &format!("configuration = \"{configuration}\"\neffective_mass_kg"))
    };
    let others = read(&folder, "others/campaign.toml");
    let (_, others) = others.split_at(others.find("[[recording]]").unwrap());
    let both =
        of("ball", &read(&folder, "bodies/campaign.toml")) + &of("box", &others.replace("recordings/", "recordings/o"));
    std::fs::write(folder.path().join("bodies/campaign.toml"), both).unwrap();
    for file in recordings(&folder, "others") {
        let name = format!("bodies/recordings/o{}", file.file_name().unwrap().to_str().unwrap());
        std::fs::copy(&file, folder.path().join(name)).unwrap();
    }
    let text = succeeds(&folder, &["diagnose", "bodies", "--json", "-"]);
    let answer: Value = serde_json::from_str(&text).unwrap();
    let [drag] = &answer["mechanisms"].as_array().unwrap()[..] else { panic!("{answer}") };
    assert_eq!((&answer["verdict"], &drag["id"]), (&"named".into(), &"air-drag".into()), "{answer}");
    let coefficients: Vec<f64> =
        drag["parameters"].as_array().unwrap().iter().map(|parameter| number(parameter, "value")).collect();
    assert!((coefficients[0] / coefficients[1] - (14.0_f64 / 8.0).powi(2)).abs() < 0.3, "{coefficients:?}");
}

/// At two samples a second one is longer than any gap in a log may be.
#[test]
fn a_slow_recorder_shows_a_fall_too() {
    let folder = TempDir::new().unwrap();
    let fall = ["simulate", "--kind", "fall", "--speeds", "0", "--masses", "5", "--repeats", "3", "--seed", "3"];
    succeeds(&folder, &[&fall[..], &["--sample-rate", "10", "--after", "20", "--out", "slow"]].concat());
    for recording in 1..=3 {
        let file = folder.path().join(format!("slow/recordings/00{recording}.csv"));
        let text = std::fs::read_to_string(&file).unwrap();
        let (header, rows) = text.split_once('\n').unwrap();
        let fewer: Vec<&str> = rows.lines().step_by(5).collect();
        std::fs::write(&file, format!("{header}\n{}\n", fewer.join("\n"))).unwrap();
    }
    restate(&folder, "slow", &[("sample_rate_Hz", "2.0")]);
    assert_eq!(names(&folder, &["slow", "--only", "lost-samples", "--only", "air-drag"]), [""; 0]);
}

/// A scale that is wrong by 4 % in the picture of a fall is wrong in nothing else.
#[test]
fn a_wrong_scale_of_a_fall_is_a_gain() {
    let folder = TempDir::new().unwrap();
    let fall = [
        "--kind",
        "fall",
        "--speeds",
        "0",
        "--masses",
        "0.5",
        "--repeats",
        "4",
        "--sample-rate",
        "240",
        "--after",
        "0.6",
    ];
    succeeds(&folder, &[&["simulate", "--height-noise", "0.002", "--seed", "4", "--out", "video"], &fall[..]].concat());
    for recording in 1..=4 {
        change(&folder.path().join(format!("video/recordings/00{recording}.csv")), |height_m| 1.04 * height_m);
    }
    assert_eq!(names(&folder, &["video"])[0], "gain-error");
}

/// A drag that leaves a body little over its own speed is no scale of the picture, no slow camera and no leaking charge.
#[test]
fn a_strong_drag_in_a_picture_is_told_from_what_no_camera_does() {
    let folder = TempDir::new().unwrap();
    let mut chance = ChaCha8Rng::seed_from_u64(2);
    falls(&folder, "feather", Shows::Height, 3.0, &mut chance);
    assert_eq!(names(&folder, &["feather"]), ["air-drag"]);
}

/// Frames are lost anywhere in a fall, in each at another place, and those that follow stand too early, the last ones, too. Many at once are
/// a jump, which is no noise.
#[test]
fn frames_that_a_fall_has_lost_are_named_and_counted() {
    for lost in [2, 8] {
        frames_are_counted(lost);
    }
}

fn frames_are_counted(lost: usize) {
    let folder = TempDir::new().unwrap();
    let mut chance = ChaCha8Rng::seed_from_u64(3);
    falls(&folder, "video", Shows::Height, f64::INFINITY, &mut chance);
    for (recording, frame) in [(1, 230), (2, 260), (3, 330)] {
        lose(&folder.path().join(format!("video/recordings/{recording}.csv")), frame, lost);
    }
    let text = succeeds(&folder, &["diagnose", "video", "--json", "-"]);
    let answer: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(answer["verdict"], "named", "{lost} lost: {answer}");
    let [only] = &answer["mechanisms"].as_array().unwrap()[..] else { panic!("{lost} lost: {answer}") };
    assert_eq!(only["id"], "lost-samples", "{lost} lost: {answer}");
    assert!((value_of(only, "lost_s") * 500.0 / lost as f64 - 1.0).abs() < 0.15, "{lost} lost: {answer}");
    // A jump of a few standard deviations passes for noise in part.
    let ratio = number(&answer["model"], "noise_ratio");
    assert!((0.7..1.1).contains(&ratio), "{lost} lost: {answer}");
}
