//! Scores of many cases, and of parts of them.

use std::collections::BTreeMap;

use serde::Serialize;

use super::interval::{Number, Share};
use super::judged::Judged;

/// How a group of cases did. Shares of naming are over the cases whose effects the tool may name.
#[derive(Clone, Debug, Serialize)]
pub struct Group {
    /// What the cases have in common.
    pub name: String,
    /// How many they are.
    pub cases: usize,
    /// The verdict is the right one.
    pub right: Share,
    /// Something was said.
    pub found: Share,
    /// The first name is right.
    pub first: Share,
    /// The names are right, all of them and no other.
    pub exact: Share,
    /// The truth is within the named set.
    pub within: Share,
    /// Mean size of the first name's set.
    pub set: Number,
    /// `unexplained`.
    pub unexplained: Share,
    /// Wrong and confident.
    pub wrong_and_confident: Share,
    /// The right phase.
    pub right_phase: Share,
    /// Median of the held-out rmse over the true model's.
    pub over_true: Number,
}

impl Group {
    /// How these cases did.
    pub fn of<'a>(name: &str, cases: impl IntoIterator<Item = &'a Judged>) -> Self {
        let cases: Vec<&Judged> = cases.into_iter().collect();
        let nameable = || cases.iter().filter(|case| case.right_verdict == "named");
        let sets: Vec<f64> = nameable().filter_map(|case| case.set).map(|set| set as f64).collect();
        Self {
            name: name.to_owned(),
            cases: cases.len(),
            right: Share::count(&cases, |case| case.right),
            found: Share::count(&cases, |case| found(case)),
            first: Share::count(nameable(), |case| case.first),
            exact: Share::count(nameable(), |case| case.exact),
            within: Share::count(nameable(), |case| case.within),
            set: Number::mean(&sets),
            unexplained: Share::count(&cases, |case| case.verdict == "unexplained"),
            wrong_and_confident: Share::count(&cases, |case| case.wrong_and_confident),
            right_phase: Share::count(cases.iter().filter_map(|case| case.right_phase), |right| *right),
            over_true: Number::median(cases.iter().filter_map(|case| case.over_true).collect()),
        }
    }
}

/// Whether anything was said to be there.
#[must_use]
pub fn found(case: &Judged) -> bool {
    case.verdict != "consistent" && case.verdict != "failed"
}

/// Whether one effect is hidden that the tool may name.
#[must_use]
pub fn single(case: &Judged) -> bool {
    case.truth.len() == 1 && case.right_verdict == "named"
}

/// Bands of strength.
pub const BANDS: [(f64, f64, &str); 5] = [
    (0.0, 5.0, "d below 5"),
    (5.0, 10.0, "5 to 10"),
    (10.0, 25.0, "10 to 25"),
    (25.0, 60.0, "25 to 60"),
    (60.0, f64::INFINITY, "60 and more"),
];

/// How often something was said of something that was hidden.
#[derive(Clone, Debug, Serialize)]
pub struct Confusion {
    /// What was hidden; two effects are a row of their own.
    pub truth: String,
    /// Whether the tool was to name it.
    pub nameable: bool,
    /// What was said first, and how often.
    pub said: BTreeMap<String, usize>,
}

/// How the tool's p compares with how often it is wrong where nothing is hidden.
#[derive(Clone, Debug, Serialize)]
pub struct Calibration {
    /// The tool's smallest p of a place is at most this.
    pub p: f64,
    /// In this share of the cases with nothing hidden.
    pub happened: Share,
}

/// A parameter over all cases.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterScore {
    /// Mechanism.
    pub mechanism: String,
    /// Parameter.
    pub parameter: String,
    /// Median relative error.
    pub error: Number,
    /// How often the 95 % interval held the truth.
    pub covered: Share,
}

/// All scores.
#[derive(Clone, Debug, Serialize)]
pub struct Scores {
    /// Every case.
    pub all: Group,
    /// By way of concealing; pairs apart.
    pub by_way: Vec<Group>,
    /// One effect, by strength.
    pub by_strength: Vec<Group>,
    /// One effect, by effect; then what the tool was not to name.
    pub by_effect: Vec<Group>,
    /// Who was taken for whom.
    pub confusion: Vec<Confusion>,
    /// The tool's p against what happened.
    pub calibration: Vec<Calibration>,
    /// Parameters with a true value.
    pub parameters: Vec<ParameterScore>,
    /// All of them together.
    pub all_parameters: ParameterScore,
    /// Held-out rmse over the noise before contact, median.
    pub over_noise: Number,
    /// Held-out rmse over the re-tuned baseline's, median, where something is hidden.
    pub over_baseline: Number,
    /// What is not to be named, was named as something else, and is described by that as well as by the truth.
    pub imitated: Share,
    /// Time of a processor for a case, s, median.
    pub seconds: Number,
    /// The longest, s.
    pub longest_s: f64,
    /// All together, s.
    pub all_s: f64,
    /// The most memory that a case took, MB; 0 where the system does not say it.
    pub memory_mb: f64,
}

/// Held-out rmse over the true model's up to which a description is as good as the truth.
const AS_WELL: f64 = 1.005;

/// Ps that a calibration looks at: a place is told below the largest.
const PS: [f64; 3] = [1e-4, 1e-3, 0.01];

/// The way of a case, pairs apart.
#[must_use]
pub fn way(case: &Judged) -> &str {
    if case.truth.len() > 1 { "pairs" } else { &case.way }
}

/// Ways in the order in which they are shown.
pub const WAYS: [&str; 6] = ["unnamed", "pairs", "absorbed", "conditional", "unlisted", "absent"];

impl Scores {
    /// Scores of these cases.
    #[must_use]
    pub fn of(cases: &[Judged]) -> Self {
        let by_way = WAYS.iter().map(|name| Group::of(name, cases.iter().filter(|case| way(case) == *name)));
        let by_strength = BANDS.iter().map(|(low, high, name)| {
            Group::of(name, cases.iter().filter(|case| single(case) && (*low..*high).contains(&case.d)))
        });
        let mut effects: Vec<(bool, &str)> = cases
            .iter()
            .filter(|case| case.truth.len() == 1)
            .map(|case| (case.right_verdict != "named", case.truth[0].as_str()))
            .collect();
        effects.sort_unstable();
        effects.dedup();
        let by_effect = effects.iter().map(|(unnameable, id)| {
            let name = if *unnameable { format!("{id} (not in the list)") } else { (*id).to_owned() };
            let of = |case: &&Judged| {
                case.truth.len() == 1 && case.truth[0] == *id && (case.right_verdict != "named") == *unnameable
            };
            Group::of(&name, cases.iter().filter(of))
        });
        let absent = || cases.iter().filter(|case| case.way == "absent");
        let calibration = PS.iter().map(|p| Calibration {
            p: *p,
            happened: Share::count(absent(), |case| case.p_value.is_none_or(|said| said <= *p)),
        });
        let hidden = || cases.iter().filter(|case| case.way != "absent");
        Self {
            all: Group::of("all", cases),
            by_way: by_way.filter(|group| group.cases > 0).collect(),
            by_strength: by_strength.filter(|group| group.cases > 0).collect(),
            by_effect: by_effect.collect(),
            confusion: confusion(cases),
            calibration: calibration.collect(),
            parameters: parameters(cases),
            all_parameters: parameter("all", "", cases, |_| true),
            over_noise: Number::median(cases.iter().filter_map(|case| case.over_noise).collect()),
            over_baseline: Number::median(hidden().filter_map(|case| case.over_baseline).collect()),
            imitated: Share::count(cases.iter().filter(|case| case.right_verdict == "unexplained"), |case| {
                !case.right && found(case) && case.over_true.is_some_and(|ratio| ratio <= AS_WELL)
            }),
            seconds: Number::median(cases.iter().map(|case| case.seconds).collect()),
            all_s: cases.iter().map(|case| case.seconds).sum(),
            memory_mb: cases.iter().filter_map(|case| case.memory_mb).fold(0.0, f64::max),
            longest_s: cases.iter().map(|case| case.seconds).fold(0.0, f64::max),
        }
    }
}

/// Measured parameters are scored where the tool's answer is the truth and nothing else: of a wrong model no number is right.
fn measured(cases: &[Judged]) -> impl Iterator<Item = &super::judged::Measured> {
    cases.iter().filter(|case| case.exact).flat_map(|case| &case.parameters)
}

fn parameter(
    mechanism: &str,
    name: &str,
    cases: &[Judged],
    is_so: impl Fn(&super::judged::Measured) -> bool,
) -> ParameterScore {
    let of = || measured(cases).filter(|one| is_so(one));
    ParameterScore {
        mechanism: mechanism.to_owned(),
        parameter: name.to_owned(),
        error: Number::median(of().map(|one| one.error).collect()),
        covered: Share::count(of().filter_map(|one| one.covered), |covered| *covered),
    }
}

fn parameters(cases: &[Judged]) -> Vec<ParameterScore> {
    let mut names: Vec<(&str, &str)> =
        measured(cases).map(|one| (one.mechanism.as_str(), one.parameter.as_str())).collect();
    names.sort_unstable();
    names.dedup();
    names
        .into_iter()
        .map(|(mechanism, name)| {
            parameter(mechanism, name, cases, |one| one.mechanism == mechanism && one.parameter == name)
        })
        .collect()
}

/// What a case said first.
fn said(case: &Judged) -> &str {
    match case.verdict.as_str() {
        "consistent" | "unexplained" | "failed" => &case.verdict,
        _ => case.named.first().map_or("unexplained", String::as_str),
    }
}

fn confusion(cases: &[Judged]) -> Vec<Confusion> {
    let mut rows: BTreeMap<(usize, String), BTreeMap<String, usize>> = BTreeMap::new();
    for case in cases {
        let key = match (&case.truth[..], case.right_verdict.as_str()) {
            ([], _) => (2, "nothing".to_owned()),
            ([one], "named") => (0, one.clone()),
            ([one], _) => (1, one.clone()),
            // Who of a pair comes first is no confusion; the exact set says how pairs did.
            _ => continue,
        };
        *rows.entry(key).or_default().entry(said(case).to_owned()).or_default() += 1;
    }
    rows.into_iter().map(|((part, truth), said)| Confusion { truth, nameable: part == 0, said }).collect()
}
