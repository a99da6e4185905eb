//! Campaigns from recordings that other people made and whose cause they documented.
//!
//! Each gets the baseline that somebody would state who knows the experiment's plan and nothing of its outcome, with an uncertainty that he
//! would bet on. Nothing in a campaign hints at a cause. The recordings themselves stay where they are (`shared_recordings.rs`).
//!
//! | module | recordings | kind |
//! |---|---|---|
//! | [`balls`] | eleven balls that fell 35 m | fall |
//! | [`robot`] | a UR10e that drives onto a force sensor | impact |
//! | [`piston`] | the friction loop of a pneumatic piston | impact, see there |
//! | [`drone`] | a quadcopter dropped on concrete | drop |
//! | [`hammer`] | blows of an instrumented hammer | impact |

use std::fmt::Write as _;
use std::path::Path;

use serde_json::Value;

mod balls;
mod drone;
mod hammer;
mod piston;
mod robot;

/// Writes the recordings of a campaign into a folder (the second) from the folder of all recordings, and gives its stated side.
pub type Make = Box<dyn Fn(&Path, &Path) -> Campaign>;

/// A campaign of real recordings.
pub struct Real {
    /// Its folder's name.
    pub name: String,
    /// What was recorded.
    pub about: &'static str,
    /// What is known of the cause, by whom.
    pub documented: &'static str,
    /// What the diagnosis should say if that is so.
    pub expected: Expected,
    /// Makes it.
    pub make: Make,
}

/// What the diagnosis should say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// At least one of these, and nothing else.
    Names(&'static [&'static str]),
    /// Nothing.
    Nothing,
    /// The authors do not say.
    Open,
}

/// Whether the diagnosis says what is documented.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Agreement {
    /// It does.
    Yes,
    /// What is documented is named, and more is said.
    InPart,
    /// It does not.
    No,
    /// There is nothing to agree with.
    Open,
}

impl Expected {
    /// What an answer (`thud-diagnosis/1`) comes to. A mechanism counts as named where it stands in the answer or beside a name that the
    /// answer cannot tell from it.
    pub fn agrees(self, answer: &Value) -> Agreement {
        let verdict = answer["verdict"].as_str().unwrap_or_default();
        match self {
            Self::Open => Agreement::Open,
            Self::Nothing if verdict == "consistent" => Agreement::Yes,
            // No physics is invented, but what is left is not taken for noise.
            Self::Nothing if named(answer).is_empty() => Agreement::InPart,
            Self::Nothing => Agreement::No,
            Self::Names(ids) => {
                let meant = |names: &Vec<String>| names.iter().any(|name| ids.contains(&name.as_str()));
                let named = named(answer);
                match (named.iter().any(meant), named.iter().all(meant)) {
                    (true, true) if verdict != "unexplained" => Agreement::Yes,
                    (true, _) => Agreement::InPart,
                    (false, _) => Agreement::No,
                }
            }
        }
    }
}

/// The answer's mechanisms in their order, each with what it cannot be told from behind it.
pub fn named(answer: &Value) -> Vec<Vec<String>> {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    answer["mechanisms"].as_array().map_or_else(Vec::new, |all| {
        all.iter()
            .map(|one| {
                let others = one["indistinguishable_from"].as_array().into_iter().flatten();
                std::iter::once(text(&one["id"])).chain(others.map(text)).collect()
            })
            .collect()
    })
}

/// A value with its standard deviation.
#[derive(Clone, Copy)]
pub struct Belief(pub f64, pub f64);

/// One recording of a campaign.
pub struct Entry {
    pub file: String,
    pub speed_m_per_s: Belief,
    pub mass_kg: Belief,
    pub configuration: Option<&'static str>,
}

/// A campaign's stated side; its recordings are written by [`series`].
pub struct Campaign {
    pub kind: &'static str,
    /// None in a fall.
    pub body_n_per_m: Option<Belief>,
    pub sample_rate_hz: f64,
    pub noise_rms: f64,
    pub full_scale: f64,
    pub observed: &'static str,
    pub entries: Vec<Entry>,
}

impl Campaign {
    /// Writes `campaign.toml` into the folder in which the recordings are.
    pub fn write(&self, folder: &Path) {
        let belief = |Belief(value, sd): Belief| format!("{{ value = {value:?}, sd = {sd:?} }}");
        let mut text = format!("format = \"thud-campaign/1\"\nname = \"real\"\n\n[rig]\nkind = \"{}\"\n", self.kind);
        if let Some(body) = self.body_n_per_m {
            writeln!(text, "body_stiffness_N_per_m = {}", belief(body)).unwrap();
        }
        write!(
            text,
            "\n[chain]\nsample_rate_Hz = {:?}\nnoise_rms_N = {:?}\nfull_scale_N = {:?}\nobserved = \"{}\"\n",
            self.sample_rate_hz, self.noise_rms, self.full_scale, self.observed
        )
        .unwrap();
        for entry in &self.entries {
            write!(
                text,
                "\n[[recording]]\nfile = \"{}\"\nimpact_speed_m_per_s = {}\neffective_mass_kg = {}\n",
                entry.file,
                belief(entry.speed_m_per_s),
                belief(entry.mass_kg)
            )
            .unwrap();
            if let Some(configuration) = entry.configuration {
                writeln!(text, "configuration = \"{configuration}\"").unwrap();
            }
        }
        std::fs::write(folder.join("campaign.toml"), text).unwrap();
    }
}

/// Writes one recording.
pub fn series(path: &Path, column: &str, samples: impl IntoIterator<Item = (f64, f64)>) {
    let mut text = format!("time_s,{column}\n");
    for (time_s, value) in samples {
        writeln!(text, "{time_s:.9},{value:.9}").unwrap();
    }
    std::fs::write(path, text).unwrap();
}

/// A channel of a recording, with its instants.
pub fn channel(path: &Path, column: &str) -> Vec<(f64, f64)> {
    let recording = thud::recording::read(path).unwrap();
    let values = recording.channel(column).unwrap_or_else(|| panic!("{} has no {column}", path.display()));
    recording.times_s().iter().copied().zip(values.iter().copied()).collect()
}

/// All of them.
pub fn all() -> Vec<Real> {
    let mut all = balls::all();
    all.extend(robot::all());
    all.extend(piston::all());
    all.extend(drone::all());
    all.extend(hammer::all());
    all
}
