//! Why nothing was identified: what is wrong, where, and what would be right.

use super::depth::LAG_WORTH_WORDS_S;

/// Nothing can be identified.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum NotIdentified {
    /// Nothing is touched.
    #[error("the campaign is of the kind `fall`: nothing is touched, so there is no contact law")]
    #[diagnostic(help("contact laws are identified from the kinds `impact` and `drop`"))]
    NoContact,
    /// There is no force.
    #[error("{file} has no column `force_N`")]
    #[diagnostic(help("a contact law is a force over a depth: record the load cell"))]
    NoForce {
        /// The recording.
        file: String,
    },
    /// There is no depth to be had.
    #[error("{file} has no column `displacement_m`, which `--depth measured` asks for")]
    #[diagnostic(help(
        "leave the option out: the depth is then computed from force, mass and speed by integrating twice"
    ))]
    NoDepth {
        /// The recording.
        file: String,
    },
    /// The depth was computed from the force.
    #[error(
        "{file}: `displacement_m` is the force divided by {stiffness_n_per_m:.0} N/m, not a measurement: {because}; fitted to it, every law \
         would come out linear and without loss (n = 1, restitution 1), whatever the truth"
    )]
    #[diagnostic(help(
        "record the stroke with a sensor of its own, or say `--depth reconstructed`: the depth is then the force integrated twice, \
         with the stated mass and speed"
    ))]
    Computed {
        /// The recording.
        file: String,
        /// δ = F over this.
        stiffness_n_per_m: f64,
        /// How that was seen.
        because: String,
    },
    /// Depth and force do not belong to the same instants.
    #[error(
        "`displacement_m` is {:.2} ± {:.2} ms {} against `force_N` ({because}): 1 ms moves a fitted restitution by about 0.13",
        1e3 * lag_s.abs(), 1e3 * se_s, if *lag_s > 0.0 { "late" } else { "early" }
    )]
    #[diagnostic(help(
        "record both on one clock and through the same filter, or move the column by that much, or say `--depth reconstructed`; lags below {:.2} ms \
         are let pass", 1e3 * LAG_WORTH_WORDS_S
    ))]
    Misaligned {
        /// By how much depth is late, s.
        lag_s: f64,
        /// Its standard error over the recordings, s.
        se_s: f64,
        /// How that was seen.
        because: String,
    },
    /// Too little is left.
    #[error(
        "{usable} of {all} recordings can be used, and the simplest law asks for {needed} (one parameter, and one recording to be left out){}",
        first(because)
    )]
    #[diagnostic(help(
        "record more impacts, at several speeds: with a free exponent and damping 4 are the least, 8 at 3 speeds are sound"
    ))]
    TooFew {
        /// How many can be used.
        usable: usize,
        /// How many there are.
        all: usize,
        /// How many are needed.
        needed: usize,
        /// Why others cannot be used, a sentence each.
        because: Vec<String>,
    },
    /// A law that does not exist.
    #[error("no contact law is called `{0}`")]
    #[diagnostic(help(
        "write one of linear, hertz, kelvin-voigt, hunt-crossley, lankarani-nikravesh, flores, gonthier"
    ))]
    NoSuchLaw(String),
    /// An exponent that cannot be.
    #[error("an exponent of {0} is not possible")]
    #[diagnostic(help("write 0.4 to 5; 1 is a linear spring, 1.5 a sphere"))]
    Exponent(f64),
    /// None of the laws that were asked for can be fitted.
    #[error("none of the laws that were asked for can be fitted: {0}")]
    #[diagnostic(help("ask for a simpler law, or for none in particular: then all are tried"))]
    NoLaw(String),
}

fn first(because: &[String]) -> String {
    because.first().map_or(String::new(), |sentence| {
        let more = because.len() - 1;
        let rest = if more > 0 { format!(" (and {more} more)") } else { String::new() };
        format!(": {sentence}{rest}")
    })
}
