//! A run's outcome: `thud-proof/1`.

use serde::Serialize;

use super::followed::Followed;
use super::hidden::Hidden;
use super::judged::Judged;
use super::peers::compared::Compared;
use super::score::Scores;
use super::story::{Story, choose};
use super::target::{Target, targets};

/// What the `format` key says.
pub const FORMAT: &str = "thud-proof/1";

/// Everything that a run came to.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// [`FORMAT`].
    pub format: &'static str,
    /// Where it came from.
    #[serde(flatten)]
    pub origin: Origin,
    /// What is to be reached, and what was.
    pub targets: Vec<Target>,
    /// All scores.
    pub scores: Scores,
    /// Telling ones.
    pub stories: Vec<Story>,
    /// Answers that asked for a recording to tell the truth from its twin, and what it told.
    pub followed: Vec<Followed>,
    /// The diagnosis beside other people's methods on the same cases; nothing where those have not been run.
    pub peers: Vec<Compared>,
    /// Each case.
    pub cases: Vec<Judged>,
}

/// Where a run came from.
#[derive(Clone, Debug, Serialize)]
pub struct Origin {
    /// The seed; the same one draws the same cases again.
    pub seed: u64,
    /// Which cases, in words.
    pub composition: String,
    /// Whether the answers were under seal while the cases were diagnosed.
    pub sealed: bool,
    /// SHA-256 of the plain answers, printed before anything was diagnosed.
    pub answers_sha256: String,
    /// SHA-256 of the program that diagnosed.
    pub program_sha256: String,
    /// Processes side by side.
    pub jobs: usize,
}

impl Outcome {
    /// Scores judged cases.
    #[must_use]
    pub fn of(origin: Origin, cases: Vec<(Hidden, Judged)>, followed: Vec<Followed>) -> Self {
        let stories = choose(&cases);
        let cases: Vec<Judged> = cases.into_iter().map(|(_, judged)| judged).collect();
        let scores = Scores::of(&cases);
        let targets = targets(&cases, &scores, &followed);
        Self { format: FORMAT, origin, targets, scores, stories, followed, peers: Vec::new(), cases }
    }
}
