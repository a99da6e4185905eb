//! The proof of the diagnosis: a sample of the frozen set over every way of concealing, sealed, diagnosed in processes of its own,
//! opened and scored; its quality must not fall below a floor. And the sceptic's own case.

use std::path::{Path, PathBuf};

use serde_json::Value;
use tool::{refused, run_in, told};

mod tool;

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("thud-proof-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// Cases of the frozen set that the test runs: at least one of each of its ten parts.
const SAMPLE: &str = "14";
/// The least that of these cases must have the right verdict. In the whole set it is more; docs/proof.md has it.
const FLOOR: usize = 7;

#[test]
fn a_sample_of_the_frozen_set_is_sealed_diagnosed_opened_and_scored() {
    let folder = Folder::new("sample");
    let screen = told(run_in(
        &folder.0,
        &["prove", "--sample", SAMPLE, "--out", "run", "--json", "scores.json", "--report", "page.html"],
    ));
    let scores = json(&folder.0.join("scores.json"));
    assert_eq!(scores["sealed"], true);
    let cases = scores["cases"].as_array().unwrap();
    assert_eq!(cases.len().to_string(), SAMPLE);

    // What was opened is what was hashed before anything was diagnosed, and what lay sealed was not to be read.
    let answers = std::fs::read(folder.0.join("run/answers.json")).unwrap();
    let hash = scores["answers_sha256"].as_str().unwrap();
    assert_eq!(thud::proof::seal::sha256(&answers), hash);
    let (hashed, diagnosed) = (screen.find(hash).unwrap(), screen.find("are diagnosed by processes").unwrap());
    assert!(hashed < diagnosed, "{screen}");
    let sealed = std::fs::read(folder.0.join("run/sealed.bin")).unwrap();
    let readable = |bytes: &[u8], word: &[u8]| bytes.windows(word.len()).any(|window| window == word);
    assert!(readable(&answers, b"right_verdict") && !readable(&sealed, b"right_verdict"));

    // Every way of concealing is in it, each case has an answer, and neither names nor campaigns say what is hidden.
    for way in ["unnamed", "absorbed", "conditional", "unlisted", "absent"] {
        assert!(cases.iter().any(|case| case["way"] == way), "no case is {way}");
    }
    for case in cases {
        assert_eq!(case["failure"], Value::Null, "{case}");
        let name = case["case"].as_str().unwrap();
        assert!(name.len() == 12 && name.bytes().all(|byte| byte.is_ascii_hexdigit()), "{name}");
        let campaign = std::fs::read_to_string(folder.0.join("run/cases").join(name).join("campaign.toml")).unwrap();
        for hidden in case["truth"].as_array().unwrap() {
            assert!(!campaign.contains(hidden.as_str().unwrap()), "{campaign}");
        }
    }

    // The scores are those of the cases.
    let right = cases.iter().filter(|case| case["right"] == true).count();
    assert_eq!(scores["scores"]["all"]["right"]["hits"], right);
    assert!(right >= FLOOR, "{right} of {SAMPLE} are right, {FLOOR} is the least: {screen}");
    assert!(scores["targets"].as_array().unwrap().len() >= 20);
    let page = std::fs::read_to_string(folder.0.join("page.html")).unwrap();
    assert!(page.contains("Who was taken for whom") && !page.contains("src=") && !page.contains("http-equiv"));

    // Judged again from what lies there, without diagnosing anything, the outcome is the same but for the seal.
    told(run_in(&folder.0, &["prove", "--opened", "--out", "run", "--json", "again.json"]));
    let again = json(&folder.0.join("again.json"));
    assert_eq!((&again["cases"], &again["sealed"]), (&scores["cases"], &Value::Bool(false)));
}

#[test]
fn a_run_is_taken_up_with_its_seed_and_refused_with_another() {
    let folder = Folder::new("taken-up");
    let run = |seed: &str| {
        run_in(
            &folder.0,
            &[
                "prove",
                "--mix",
                "absent",
                "--cases",
                "2",
                "--recordings",
                "4",
                "--seed",
                seed,
                "--out",
                "run",
                "--json",
                "s.json",
            ],
        )
    };
    told(run("5"));
    let first = json(&folder.0.join("s.json"));
    let screen = told(run("5"));
    assert!(screen.contains("2 of 2 cases are already done"), "{screen}");
    assert_eq!(json(&folder.0.join("s.json"))["cases"], first["cases"]);
    let said = refused(run("6"));
    assert!(said.contains("holds another run"), "{said}");
}

#[test]
fn a_sceptic_hides_an_effect_for_someone_else() {
    let folder = Folder::new("sceptic");
    let conceal = |effect: &str, strength: &str, answer: &str| {
        run_in(
            &folder.0,
            &[
                "conceal",
                "--effect",
                effect,
                "--strength",
                strength,
                "--recordings",
                "6",
                "--out",
                "riddle",
                "--answer",
                answer,
            ],
        )
    };
    let screen = told(conceal("piezo-discharge", "40", "answer.json"));
    let answer = std::fs::read(folder.0.join("answer.json")).unwrap();
    assert!(screen.contains(&thud::proof::seal::sha256(&answer)), "{screen}");
    let answer: Value = serde_json::from_slice(&answer).unwrap();
    assert_eq!(answer["cases"][0]["effects"][0]["id"], "piezo-discharge");
    let diagnosis: Value =
        serde_json::from_str(&told(run_in(&folder.0, &["diagnose", "riddle", "--json", "-"]))).unwrap();
    assert_ne!(diagnosis["verdict"], "consistent");

    assert!(refused(conceal("piezo-discharge", "40", "answer.json")).contains("holds a campaign already"));
    assert!(refused(conceal("friction", "40", "answer.json")).contains("did you mean guide-friction"));
    assert!(refused(conceal("adhesion", "40", "riddle/answer.json")).contains("put it elsewhere"));
    assert!(refused(conceal("adhesion", "1", "answer.json")).contains("choose 2 or more"));
    assert!(told(run_in(&folder.0, &["conceal", "--list"])).contains("gear-cogging"));
}

/// The house keeps them apart: what fits names nothing of what conceals, and in the tool only `prove` and `conceal` do.
#[test]
fn what_diagnoses_never_names_what_conceals() {
    fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                sources(&path, found);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                found.push(path);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for part in ["src", "../hal-sim", "../firmware"] {
        sources(&root.join(part), &mut files);
    }
    let mut naming: Vec<String> = files
        .into_iter()
        .filter(|file| std::fs::read_to_string(file).unwrap().contains("thud_conceal"))
        .map(|file| file.strip_prefix(root).unwrap().display().to_string())
        .collect();
    naming.sort();
    assert_eq!(naming, ["src/command/conceal.rs", "src/proof/conceal.rs"]);
}
