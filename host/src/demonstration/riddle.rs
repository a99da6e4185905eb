//! The end of the demonstration: something is hidden in the rig, and the diagnosis finds it.
//!
//! ```text
//! seed ─▶ which effect ─▶ concealing simulator ─▶ campaign (files) ─▶ diagnosis ─▶ what was found ─┐
//!                │                                                                                 ├▶ beside each other
//!                └──────────────────────────── what was hidden ────────────────────────────────────┘
//! ```
//!
//! The diagnosis gets the campaign's folder and nothing else; the simulator that hides shares no code with the one that it fits.

use std::path::Path;

use serde::Serialize;

use crate::campaign;
use crate::diagnosis::answer::{Answer, answer};
use crate::diagnosis::{self, Options, shown, words};
use crate::proof::conceal;

/// What the rig may hide: each of these shows in an impact.
const EFFECTS: [&str; 10] = [
    "hunt-crossley-damping",
    "guide-friction",
    "pad-relaxation",
    "moving-piece-inertia",
    "joint-elasticity",
    "piezo-discharge",
    "mullins-softening",
    "hardening",
    "frame-compliance",
    "clearance",
];
/// How strong: plain to a diagnosis, and hardly to be seen by eye (`docs/proof.md` says what d is).
const STRENGTH: f64 = 40.0;
/// Recordings in the campaign.
pub const RECORDINGS: usize = 12;

/// What was hidden, and what was said to it.
#[derive(Clone, Debug, Serialize)]
pub struct Riddle {
    /// The effect that the rig hid.
    pub hidden: &'static str,
    /// Whether the diagnosis named it, or holds it possible.
    pub found: bool,
    /// What the diagnosis said, as `thud diagnose --json` writes it.
    pub diagnosis: Answer,
    /// The page of the diagnosis.
    #[serde(skip)]
    pub page: String,
    /// Its verdict with the most telling recording, for the demonstration's own page.
    #[serde(skip)]
    pub telling: maud::Markup,
    /// Its verdict in a sentence.
    #[serde(skip)]
    pub verdict: String,
    /// How much better recordings are shown that took no part, in a sentence.
    #[serde(skip)]
    pub gain: String,
}

/// Hides an effect that the seed chooses in a campaign, which is written to the folder, and diagnoses it.
///
/// # Errors
/// A folder that cannot be written.
pub fn riddle(seed: u64, folder: &Path, progress: &mut dyn FnMut(&str)) -> miette::Result<Riddle> {
    progress("hiding something in a rig");
    let hidden = EFFECTS[(seed % EFFECTS.len() as u64) as usize];
    conceal::hide(hidden, STRENGTH, seed, RECORDINGS, folder)?;
    let loaded = campaign::load(folder)?;
    let found =
        diagnosis::diagnose(&loaded, &Options::default(), &mut |step| progress(&format!("diagnosing it: {step}")))?;
    let said = answer(&found);
    let named = said.mechanisms.first();
    let possible = named.is_some_and(|named| named.id == hidden || named.indistinguishable_from.contains(&hidden));
    Ok(Riddle {
        hidden,
        found: possible,
        page: shown::page(&found, &said, &loaded.campaign.name),
        telling: shown::telling(&found, &said),
        verdict: words::verdict(&found, &said),
        gain: words::gain(&found, &said),
        diagnosis: said,
    })
}

impl Riddle {
    /// What was hidden and whether it was found, in a sentence.
    #[must_use]
    pub fn resolved(&self) -> String {
        let found = if self.found { "it was found" } else { "it was not found" };
        format!("Hidden was {}: {found}.", self.hidden)
    }
}
