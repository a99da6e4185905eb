//! A case of somebody's own choice: which effects, how strong, concealed how.

use std::path::Path;

use clap::ValueEnum;

use crate::case::{Request, Way};
use crate::effect::{self, Confined, Effect};
use crate::plan::Wish;
use crate::world::Kind;

/// How a chosen effect is concealed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum WayWord {
    /// Among ordinary imperfections
    Unnamed,
    /// What is stated already absorbs it: peaks agree, R² exceeds 0.98
    Absorbed,
    /// It acts in a few recordings only
    Conditional,
}

/// Fewest recordings that make a campaign.
const FEWEST: usize = 4;
/// Strength below which an effect drowns in what every rig has.
const WEAKEST: f64 = 2.0;

/// The effect of this id.
///
/// # Errors
/// There is none; where the list is.
pub fn known(id: &str) -> Result<&'static Effect, String> {
    effect::named(id).ok_or_else(|| {
        let near: Vec<&str> = effect::ALL.iter().map(|e| e.id).filter(|known| alike(known, id)).collect();
        let near = if near.is_empty() { String::new() } else { format!(" (did you mean {}?)", near.join(" or ")) };
        format!("`{id}` is not an effect{near}; `thud-conceal effects` and `thud conceal --list` list those that are")
    })
}

/// Whether one of the words of `id` stands in `known`.
fn alike(known: &str, id: &str) -> bool {
    id.split('-').any(|word| word.len() > 3 && known.contains(word))
}

/// A request for these effects, each of this strength.
///
/// # Errors
/// A sentence: an unknown effect, a strength that drowns, effects that no campaign holds together, a way that does not fit.
pub fn request(ids: &[String], strength: f64, way: WayWord, seed: u64, recordings: usize) -> Result<Request, String> {
    enough(recordings)?;
    if !(strength.is_finite() && strength >= WEAKEST) {
        return Err(format!("a strength of {strength} drowns in what every rig has; choose {WEAKEST} or more"));
    }
    let effects: Vec<&'static Effect> = ids.iter().map(|id| known(id)).collect::<Result<_, _>>()?;
    let kind = [Kind::Impact, Kind::Fall]
        .into_iter()
        .find(|kind| effects.iter().all(|e| e.kinds.contains(kind)))
        .ok_or("no campaign holds all of these: a falling body has no rig")?;
    let way = match way {
        _ if effects.iter().any(|e| !e.listed) => Way::Unlisted,
        WayWord::Unnamed => Way::Unnamed,
        WayWord::Absorbed => Way::Absorbed,
        WayWord::Conditional => Way::Conditional,
    };
    if way == Way::Absorbed && kind == Kind::Fall {
        return Err("a fall states nothing that could absorb the effect; choose another --way".to_owned());
    }
    if let Some(everywhere) = effects.iter().find(|e| way == Way::Conditional && e.confined == Confined::Never) {
        return Err(format!("`{}` belongs to the whole rig; it cannot act in a few recordings only", everywhere.id));
    }
    let effects = effects.into_iter().map(|e| (e, strength)).collect();
    Ok(Request { way, effects, without: Vec::new(), wish: Wish { kind, recordings, long: false }, seed })
}

/// Whether so many recordings make a campaign.
///
/// # Errors
/// They do not; how many do.
pub fn enough(recordings: usize) -> Result<(), String> {
    if recordings < FEWEST {
        return Err(format!("{recordings} recordings are no campaign; choose {FEWEST} or more"));
    }
    Ok(())
}

/// An answer beside the recordings is no secret.
///
/// # Errors
/// It would lie there.
pub fn refuse_answer_inside(answer: &Path, out: &Path) -> Result<(), String> {
    if answer.starts_with(out) {
        return Err(format!("the answer {} lies in the campaign's folder; put it elsewhere", answer.display()));
    }
    Ok(())
}
