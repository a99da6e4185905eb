//! The page's words, for someone who has never seen the tool.

use maud::Markup;

use crate::report::document;

/// What the words and numbers of the page mean.
pub(super) fn glossary() -> Markup {
    let words: [(&str, &str); 13] = [
        (
            "simulation",
            "what the standard implies: the robot's effective mass meets body springs and pad in series, F = k·x while touching, seen by an ideal measuring chain.",
        ),
        (
            "re-tuned",
            "before anything is called a misfit, all that is stated as uncertain (stiffnesses, masses, speeds, springs from one recording to the next) is re-estimated within its uncertainty, together with each recording's instant of contact and zero.",
        ),
        ("noise", "standard deviation of the observed channel in the quiet before contact."),
        ("rest", "observed minus simulated; divided by the noise it should stay within ±2 for 95 % of the time."),
        (
            "rmse",
            "root mean square of the rest, at the recordings' own sample rate; over the noise, 1 is as good as can be.",
        ),
        (
            "held out",
            "whole recordings that took no part: rig and mechanisms are fitted to the others, and of these only contact instant, zero, and speed and spring within their uncertainty are estimated.",
        ),
        (
            "χ²",
            "sum of squares of the rest over the noise, freed of the noise's colour, and of the moves of what was stated over their uncertainty.",
        ),
        (
            "BIC",
            "χ² plus a price of ln(number of samples) for each parameter of a mechanism. Of two models the one with the lower BIC is to be preferred; 10 is strong evidence. Rivals within 12 are not told apart; of those the first is the one that would foretell best, where a parameter costs 2 (Akaike), so that another one may be ahead in BIC.",
        ),
        (
            "by chance",
            "noise alone lowers χ², too, the more parameters a mechanism has to bend: this is the part of trials in which it does as much (Wilks). A first mechanism must do more than chance does in three trials of a hundred thousand, since many are tried.",
        ),
        (
            "score",
            "how well a mechanism's signature, freed of all that re-tuning can imitate, agrees with the rest of the re-tuned simulation, in standard deviations: χ² would fall by about its square. Chance alone hardly reaches 5.5.",
        ),
        (
            "hidden",
            "the part of a mechanism's signature that re-tuning imitates, so that it does not show as a misfit.",
        ),
        (
            "p",
            "the probability of a misfit this large if there were none, corrected for all the places that were looked at.",
        ),
        (
            "interval",
            "95 %: from the noise, and from the tenth by which an equation that is not quite the rig's may be off.",
        ),
    ];
    document::glossary(&words)
}
