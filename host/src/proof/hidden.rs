//! What was hidden: the answers of the concealing simulator (`thud-answers/1`), as far as judging needs them.

use miette::{IntoDiagnostic as _, WrapErr as _, miette};
use serde::Deserialize;

/// What the `format` key says.
const FORMAT: &str = "thud-answers/1";

/// All answers of a run.
#[derive(Clone, Debug, Deserialize)]
pub struct Answers {
    format: String,
    /// Seed of the run.
    pub seed: u64,
    /// Each case.
    pub cases: Vec<Hidden>,
}

/// What is true of a case.
#[derive(Clone, Debug, Deserialize)]
pub struct Hidden {
    /// Its name.
    pub case: String,
    /// `unnamed`, `absorbed`, `conditional`, `unlisted`, `absent`.
    pub way: String,
    /// `impact`, `drop`, `fall`.
    pub kind: String,
    /// The seed that makes this case again.
    pub seed: u64,
    /// Mechanisms left out of the tool's list.
    pub without: Vec<String>,
    /// `consistent`, `named`, `unexplained`.
    pub right_verdict: String,
    /// Strength of all that is hidden.
    pub d: f64,
    /// Strength of what every rig has.
    pub benign_d: f64,
    /// What is hidden.
    pub effects: Vec<Effect>,
    /// Where the re-tuned baseline leaves something.
    pub rest: Place,
    /// R² of the baseline as stated, the lowest of all recordings.
    pub stated_r_squared: f64,
    /// Rms of the written readings less the noise-free ones: the true model's rmse.
    pub true_model_rmse: f64,
}

/// An effect that is hidden.
#[derive(Clone, Debug, Deserialize)]
pub struct Effect {
    /// Id.
    pub id: String,
    /// Whether the contract's list has it.
    pub listed: bool,
    /// What of the list resembles it.
    pub resembles: Vec<String>,
    /// Strength alone.
    pub d: f64,
    /// Strength beside any amount of the other hidden ones.
    pub d_beside_others: f64,
    /// True parameters.
    pub parameters: Vec<Parameter>,
    /// Recordings that it may touch.
    pub recordings: Vec<String>,
}

impl Effect {
    /// The true value of a parameter.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        self.parameters.iter().find(|parameter| parameter.name == name).map(|parameter| parameter.value)
    }
}

/// A true number.
#[derive(Clone, Debug, Deserialize)]
pub struct Parameter {
    /// Name in the concealing simulator.
    pub name: String,
    /// Value in SI units.
    pub value: f64,
}

/// Where something is.
#[derive(Clone, Debug, Deserialize)]
pub struct Place {
    /// The phase with the largest share.
    pub phase: String,
    /// Shares before, rise, fall, after.
    pub shares: [f64; 4],
    /// Recordings with at least a twentieth of it.
    pub recordings: Vec<String>,
}

/// Phases in the order of [`Place::shares`].
pub const PHASES: [&str; 4] = ["before", "rise", "fall", "after"];

impl Hidden {
    /// Ids of what is hidden.
    pub fn truth(&self) -> impl Iterator<Item = &str> {
        self.effects.iter().map(|effect| effect.id.as_str())
    }

    /// Whether one effect that the tool may name is hidden, and nothing else.
    #[must_use]
    pub fn single(&self) -> bool {
        self.effects.len() == 1 && self.right_verdict == "named"
    }

    /// Whether something of the list resembles all that is hidden and not to be named.
    #[must_use]
    pub fn resembling(&self) -> bool {
        self.effects.iter().any(|effect| !effect.resembles.is_empty())
    }
}

/// Reads answers.
///
/// # Errors
/// They are none, or of another format.
pub fn read(text: &[u8]) -> miette::Result<Answers> {
    let answers: Answers = serde_json::from_slice(text).into_diagnostic().wrap_err("these are no answers of thud")?;
    if answers.format != FORMAT {
        return Err(miette!("the answers are of format `{}`; this tool reads `{FORMAT}`", answers.format));
    }
    Ok(answers)
}
