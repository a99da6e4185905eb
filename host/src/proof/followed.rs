//! The advice, followed: an answer that cannot tell the truth from a twin asks for a recording; it is made, and tells how much better.
//!
//! ```text
//! ambiguous, the truth in the set ─▶ "record 0.62 m/s …" ─▶ concealing simulator: the same rig, as many such recordings more
//!                                                     ─▶ √(χ² of the twin − χ² of the truth), before and after
//! ```
//!
//! It needs the answers, so it comes after they are opened, and no score of the diagnosis itself depends on it.

use std::path::Path;

use miette::{IntoDiagnostic as _, WrapErr as _};
use rayon::prelude::*;
use serde::Serialize;

use super::conceal::{self, Further, Request};
use super::hidden::Hidden;
use super::said::Said;
use crate::campaign::load;
use crate::diagnosis::advice::{Asked, CHANCE, told_apart};

/// No more cases than these are followed: each takes as long as a diagnosis.
pub const MOST: usize = 40;

/// A case in which the advice was followed.
#[derive(Clone, Debug, Serialize)]
pub struct Followed {
    /// The case.
    pub case: String,
    /// What is hidden.
    pub truth: String,
    /// What it was not told from.
    pub twin: String,
    /// The sentence.
    pub advice: String,
    /// How far apart they were, standard deviations.
    pub before: f64,
    /// And are with the advised recordings.
    pub after: f64,
}

impl Followed {
    /// How many times better they are told apart.
    #[must_use]
    pub fn raised(&self) -> f64 {
        self.after / self.before.max(CHANCE)
    }
}

/// An answer whose advice can be followed.
#[derive(Debug)]
pub struct Advised {
    case: String,
    truth: String,
    asked: Asked,
    advice: String,
}

impl Advised {
    /// `None`: not one listed effect alone is hidden, the answer is not ambiguous about it, or asks for nothing that would tell; or it is
    /// a fall, which has no speed to set.
    #[must_use]
    pub fn of(hidden: &Hidden, said: &Said) -> Option<Self> {
        let [effect] = hidden.effects.as_slice() else { return None };
        let [named] = said.mechanisms.as_slice() else { return None };
        if !hidden.single() || hidden.kind == "fall" || said.verdict != "ambiguous" || !named.means(&effect.id) {
            return None;
        }
        let about = |asked: &Asked| [&asked.twins.0, &asked.twins.1].contains(&&effect.id);
        let mut sentences = said.advice.iter().filter_map(|advice| Some((Asked::read(advice)?, advice)));
        let (asked, advice) = sentences.find(|(asked, _)| about(asked))?;
        Some(Self { case: hidden.case.clone(), truth: effect.id.clone(), asked, advice: advice.clone() })
    }

    fn follow(&self, request: &Request, campaigns: &Path, room: &Path) -> miette::Result<Followed> {
        let further = Further {
            speed_m_per_s: self.asked.speed_m_per_s,
            configuration: self.asked.configuration.parse::<usize>().into_diagnostic()? - 1,
            after_s: self.asked.after_s,
        };
        let folder = room.join(&self.case);
        conceal::go_on(request, further, self.asked.times, &folder)?;
        let (one, other) = &self.asked.twins;
        let twin = if *one == self.truth { other } else { one };
        let apart = |folder: &Path| -> miette::Result<f64> { Ok(told_apart(&load(folder)?, &self.truth, twin)?) };
        Ok(Followed {
            case: self.case.clone(),
            truth: self.truth.clone(),
            twin: twin.clone(),
            advice: self.advice.clone(),
            before: apart(&campaigns.join(&self.case))?,
            after: apart(&folder)?,
        })
    }
}

/// Follows the advice of these answers, of [`MOST`] at most. `done` hears of each.
///
/// # Errors
/// A campaign that cannot be written, read or diagnosed.
pub fn follow(
    advised: &[Advised],
    request_of: &(impl Fn(&str) -> Option<Request> + Sync),
    campaigns: &Path,
    room: &Path,
    done: &(impl Fn() + Sync),
) -> miette::Result<Vec<Followed>> {
    advised
        .par_iter()
        .take(MOST)
        .filter_map(|advised| {
            let request = request_of(&advised.case)?;
            let followed = advised.follow(&request, campaigns, room);
            done();
            Some(followed.wrap_err_with(|| format!("case {}", advised.case)))
        })
        .collect()
}
