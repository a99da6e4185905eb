//! What these recordings cannot tell, said with what would tell it.

use super::blow::Blow;
use super::law::{Damping, Law};

/// Peaks (or speeds) within this of each other are of one height (or one speed), relative.
const ALIKE: f64 = 0.1;

/// What the recordings can tell.
#[derive(Clone, Debug)]
pub(super) struct Identifiable {
    /// Whether the peaks differ enough for an exponent.
    pub(super) exponent: bool,
    /// Whether the speeds differ enough to say how a loss depends on them.
    pub(super) speeds: bool,
    /// A sentence for each thing that cannot be told.
    pub(super) sentences: Vec<String>,
}

/// Looks at what was recorded; `held`: the exponent is given.
pub(super) fn identifiable(blows: &[Blow], held: bool) -> Identifiable {
    let peaks = span(blows.iter().map(|blow| blow.peak_n));
    let speeds = span(blows.iter().map(|blow| blow.speed.value));
    let alike = |(low, high): (f64, f64)| high / low - 1.0 < ALIKE;
    let mut found = Identifiable { exponent: true, speeds: true, sentences: Vec::new() };
    if alike(peaks) {
        found.exponent = false;
        if !held {
            found.sentences.push(format!(
                "The exponent cannot be identified: all peaks are of one height ({:.1} to {:.1} N). It is held at 1; record impacts at half and at \
                 twice the speed, or state it with --exponent",
                peaks.0, peaks.1
            ));
        }
    }
    if alike(speeds) {
        found.speeds = false;
        found.sentences.push(format!(
            "How the loss depends on speed cannot be identified: all impacts are at one speed ({}). Damping of the material (Hunt–Crossley) and a \
             restitution that is the same at every speed (Lankarani–Nikravesh, Flores, Gonthier) are then one law, and no restitution holds \
             beyond that speed; record impacts at half and at twice it",
            if speeds.0 == speeds.1 { format!("{} m/s", speeds.0) } else { format!("{} to {} m/s", speeds.0, speeds.1) }
        ));
    }
    found
}

/// Why a law is not fitted to so few recordings, if it is not.
pub(super) fn too_few(law: &Law, held: bool, recordings: usize) -> Option<String> {
    let parameters = law.parameters(held);
    (recordings < parameters + 1).then(|| {
        format!(
            "{} parameter{} ask for {} recordings (one of them to be left out), and {recordings} can be used; record {} more",
            parameters,
            if parameters == 1 { "" } else { "s" },
            parameters + 1,
            parameters + 1 - recordings
        )
    })
}

/// Why a law says nothing of its own here, if it does not.
pub(super) fn adds_nothing(law: &Law, held_exponent: Option<f64>) -> Option<&'static str> {
    let elastic = matches!(law.damping, Damping::None);
    (law.exponent && elastic && held_exponent == Some(1.0))
        .then_some("with its exponent held at 1 it is the linear law")
}

fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, 0.0), |(low, high), value| (low.min(value), high.max(value)))
}
