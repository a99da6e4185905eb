//! One case judged: what was hidden beside what was said.

use serde::Serialize;

use super::comparable;
use super::hidden::{Hidden, PHASES};
use super::said::Said;

/// What became of a diagnosis.
#[derive(Clone, Debug)]
pub enum Ended {
    /// It answered.
    Said(Box<Said>),
    /// It did not, and why. Such a case counts as wrong wherever it counts.
    Failed(String),
}

/// A case judged. Where something does not apply to a case it is absent.
#[derive(Clone, Debug, Serialize)]
pub struct Judged {
    /// Its name.
    pub case: String,
    /// The seed that makes it again.
    pub seed: u64,
    /// Way of concealing.
    pub way: String,
    /// Impact, drop or fall.
    pub kind: String,
    /// What is hidden.
    pub truth: Vec<String>,
    /// Strength of all that is hidden.
    pub d: f64,
    /// The smallest strength of an effect alone, and beside the others.
    pub least_d: [f64; 2],
    /// Lowest R² of the baseline as stated.
    pub stated_r_squared: f64,
    /// The right verdict.
    pub right_verdict: String,
    /// For what is not to be named: whether something of the list resembles it.
    pub resembling: bool,
    /// The verdict; `failed` where there was none.
    pub verdict: String,
    /// What was named.
    pub named: Vec<String>,
    /// What each name cannot be told from.
    pub indistinguishable_from: Vec<Vec<String>>,
    /// Why there was no answer.
    pub failure: Option<String>,
    /// The first name is what is hidden (of two: one of them).
    pub first: bool,
    /// Names and truth are the same set, in an answer that leaves nothing unexplained.
    pub exact: bool,
    /// Everything hidden is named or stands beside a name that it cannot be told from; of one effect: beside the first.
    pub within: bool,
    /// How many mechanisms the first name stands for.
    pub set: Option<usize>,
    /// A name without an alternative, in an answer that leaves nothing unexplained, of something that is not hidden.
    pub wrong_and_confident: bool,
    /// The verdict is the right one; `ambiguous` is right where the truth is within the named set.
    pub right: bool,
    /// The place with the largest share lies in a phase that truly holds at least a quarter of what the baseline leaves.
    pub right_phase: Option<bool>,
    /// Smallest p of a place; 1 where there is none.
    pub p_value: Option<f64>,
    /// Held-out rmse over the true model's.
    pub over_true: Option<f64>,
    /// Held-out rmse over the re-tuned baseline's.
    pub over_baseline: Option<f64>,
    /// Held-out rmse over the noise before contact.
    pub over_noise: Option<f64>,
    /// Where the way from baseline to noise ends: 0 at the baseline, 1 at the noise. Absent where there is no way to speak of.
    pub way_to_noise: Option<f64>,
    /// Parameters with a true value, where the effect was named.
    pub parameters: Vec<Measured>,
    /// Time of a processor, s; wall time where the system does not say it.
    pub seconds: f64,
    /// The most memory that the process held, MB.
    pub memory_mb: Option<f64>,
}

impl Judged {
    /// Each name with what it cannot be told from: `end-stop (or hardening)`.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let name = |(id, others): (&String, &Vec<String>)| match others.as_slice() {
            [] => id.clone(),
            others => format!("{id} (or {})", others.join(", ")),
        };
        self.named.iter().zip(&self.indistinguishable_from).map(name).collect()
    }
}

/// A parameter beside its true value.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// Mechanism.
    pub mechanism: String,
    /// Parameter.
    pub parameter: String,
    /// True value.
    pub truth: f64,
    /// The tool's.
    pub value: f64,
    /// |value ÷ truth − 1|.
    pub error: f64,
    /// Whether the 95 % interval holds the truth; absent where the tool held the parameter fixed.
    pub covered: Option<bool>,
}

/// Share of a phase that makes it one of the right ones.
const PHASE_SHARE: f64 = 0.25;
/// Below this part of the noise there is no way from baseline to noise.
const NO_WAY: f64 = 0.002;

/// Judges a case.
#[must_use]
pub fn judge(hidden: &Hidden, ended: &Ended, seconds: f64, memory_mb: Option<f64>) -> Judged {
    let truth: Vec<String> = hidden.truth().map(str::to_owned).collect();
    let least = |d: fn(&super::hidden::Effect) -> f64| hidden.effects.iter().map(d).fold(f64::INFINITY, f64::min);
    let mut judged = Judged {
        case: hidden.case.clone(),
        seed: hidden.seed,
        way: hidden.way.clone(),
        kind: hidden.kind.clone(),
        truth,
        d: hidden.d,
        least_d: if hidden.effects.is_empty() { [0.0; 2] } else { [least(|e| e.d), least(|e| e.d_beside_others)] },
        stated_r_squared: hidden.stated_r_squared,
        right_verdict: hidden.right_verdict.clone(),
        resembling: hidden.resembling(),
        verdict: "failed".to_owned(),
        named: Vec::new(),
        indistinguishable_from: Vec::new(),
        failure: None,
        first: false,
        exact: false,
        within: false,
        set: None,
        wrong_and_confident: false,
        right: false,
        right_phase: None,
        p_value: None,
        over_true: None,
        over_baseline: None,
        over_noise: None,
        way_to_noise: None,
        parameters: Vec::new(),
        seconds,
        memory_mb,
    };
    match ended {
        Ended::Failed(why) => judged.failure = Some(why.clone()),
        Ended::Said(said) => compare(hidden, said, &mut judged),
    }
    judged
}

fn compare(hidden: &Hidden, said: &Said, judged: &mut Judged) {
    let names = said.names();
    let is_hidden = |id: &str| hidden.truth().any(|truth| truth == id);
    judged.verdict.clone_from(&said.verdict);
    judged.named = names.iter().map(|name| (*name).to_owned()).collect();
    judged.indistinguishable_from = said.mechanisms.iter().map(|named| named.indistinguishable_from.clone()).collect();
    let complete = said.verdict == "named" || said.verdict == "ambiguous";
    let nameable = hidden.right_verdict == "named";
    if nameable {
        judged.first = names.first().is_some_and(|name| is_hidden(name));
        let mut sorted = names.clone();
        sorted.sort_unstable();
        let mut truth: Vec<&str> = hidden.truth().collect();
        truth.sort_unstable();
        judged.exact = complete && sorted == truth;
        judged.within = match &hidden.effects[..] {
            [one] => said.mechanisms.first().is_some_and(|named| named.means(&one.id)),
            all => all.iter().all(|effect| said.mechanisms.iter().any(|named| named.means(&effect.id))),
        };
        judged.set = said.mechanisms.first().map(|named| 1 + named.indistinguishable_from.len());
    }
    judged.wrong_and_confident = complete
        && said.mechanisms.iter().any(|named| named.indistinguishable_from.is_empty() && !is_hidden(&named.id));
    judged.right = match hidden.right_verdict.as_str() {
        "named" => complete && judged.within,
        verdict => said.verdict == verdict,
    };
    judged.p_value = Some(said.places.iter().filter_map(|place| place.p_value).fold(1.0, f64::min));
    // A fall has one phase only.
    if !hidden.effects.is_empty() && hidden.kind != "fall" {
        judged.right_phase = Some(said.first_place().is_some_and(|place| {
            let share = PHASES.iter().position(|phase| *phase == place.phase).map(|at| hidden.rest.shares[at]);
            place.phase == hidden.rest.phase || share.is_some_and(|share| share >= PHASE_SHARE)
        }));
    }
    if let Some(rmse) = said.held_out_rmse() {
        let over = |other: Option<f64>| other.filter(|other| *other > 0.0).map(|other| rmse / other);
        judged.over_true = over(Some(hidden.true_model_rmse));
        judged.over_baseline = over(said.baseline.held_out_rmse);
        judged.over_noise = over(said.baseline.noise_rms);
        let noise = hidden.true_model_rmse;
        judged.way_to_noise = said
            .baseline
            .held_out_rmse
            .filter(|baseline| baseline - noise > NO_WAY * noise)
            .map(|baseline| (baseline - rmse) / (baseline - noise));
    }
    if nameable {
        judged.parameters = measured(hidden, said);
    }
}

fn measured(hidden: &Hidden, said: &Said) -> Vec<Measured> {
    let mut all = Vec::new();
    for comparable in comparable::ALL {
        let Some(truth) = comparable.truth(hidden) else { continue };
        let Some(named) = said.mechanisms.iter().find(|named| named.id == comparable.mechanism) else { continue };
        let Some(parameter) = named.parameters.iter().find(|p| p.name == comparable.parameter) else { continue };
        let Some(value) = parameter.value else { continue };
        let covered = match (parameter.low, parameter.high) {
            (Some(low), Some(high)) if low < high => Some(low <= truth && truth <= high),
            _ => None,
        };
        all.push(Measured {
            mechanism: comparable.mechanism.to_owned(),
            parameter: comparable.parameter.to_owned(),
            truth,
            value,
            error: (value / truth - 1.0).abs(),
            covered,
        });
    }
    all
}

#[cfg(test)]
mod tests;
