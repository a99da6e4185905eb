//! What the diagnosis is to reach, each line beside what it reached.

use serde::Serialize;

use super::followed::Followed;
use super::interval::{Number, Share};
use super::judged::Judged;
use super::score::{Scores, found, single};
use crate::diagnosis::advice::RAISED;

/// What is demanded of a number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Demand {
    /// At least this.
    AtLeast(f64),
    /// At most this.
    AtMost(f64),
    /// From, to.
    Between(f64, f64),
}

/// How a number is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    /// A share, in per cent.
    Share,
    /// A plain number.
    Plain,
    /// Seconds.
    Seconds,
    /// Millions of bytes.
    Megabytes,
}

/// A line of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Target {
    /// Over which cases.
    pub of: &'static str,
    /// What.
    pub what: &'static str,
    /// How much of it is demanded.
    pub demand: Demand,
    /// What the numbers are.
    pub unit: Unit,
    /// From how many cases.
    pub cases: usize,
    /// What was reached; absent where nothing could be measured.
    pub value: Option<f64>,
    /// 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// Whether the value meets the demand; absent where nothing could be measured.
    pub reached: Option<bool>,
    /// Whether the whole interval is on the demanded side (`reached`), none of it (`missed`), or part of it (`open`).
    pub sure: Option<&'static str>,
    /// What is to be known about it.
    pub note: &'static str,
}

impl Demand {
    /// Whether `value` meets it.
    #[must_use]
    pub fn met(self, value: f64) -> bool {
        match self {
            Self::AtLeast(least) => value >= least,
            Self::AtMost(most) => value <= most,
            Self::Between(low, high) => (low..=high).contains(&value),
        }
    }

    fn sure(self, [low, high]: [f64; 2]) -> &'static str {
        let (whole, none) = match self {
            Self::AtLeast(least) => (low >= least, high < least),
            Self::AtMost(most) => (high <= most, low > most),
            Self::Between(from, to) => (low >= from && high <= to, high < from || low > to),
        };
        if whole {
            "reached"
        } else if none {
            "missed"
        } else {
            "open"
        }
    }
}

fn line(
    of: &'static str,
    what: &'static str,
    demand: Demand,
    unit: Unit,
    number: Number,
    note: &'static str,
) -> Target {
    let interval = number.low.zip(number.high).map(|(low, high)| [low, high]);
    Target {
        of,
        what,
        demand,
        unit,
        cases: number.of,
        value: number.value,
        interval,
        reached: number.value.map(|value| demand.met(value)),
        sure: interval.map(|interval| demand.sure(interval)),
        note,
    }
}

fn share(of: &'static str, what: &'static str, demand: Demand, share: Share, note: &'static str) -> Target {
    let known = share.share.is_some();
    let number =
        Number { of: share.of, value: share.share, low: known.then_some(share.low), high: known.then_some(share.high) };
    line(of, what, demand, Unit::Share, number, note)
}

/// d from which on an effect should be found.
const FINDABLE_D: f64 = 10.0;
/// d below which nobody sees anything.
const VISIBLE_D: f64 = 5.0;
/// d of each of two effects that are to be found both.
const PAIR_D: f64 = 25.0;

/// The whole table.
#[must_use]
#[expect(clippy::too_many_lines, reason = "a table, one line after the other")]
pub fn targets(cases: &[Judged], scores: &Scores, followed: &[Followed]) -> Vec<Target> {
    use Demand::{AtLeast, AtMost, Between};
    const STRONG: &str = "one effect, d ≥ 10";
    const WEAK: &str = "one effect, 5 ≤ d < 10";
    const PAIRS: &str = "two effects, d ≥ 25 each";
    const UNLISTED: &str = "not in the list";
    let strong = || cases.iter().filter(|case| single(case) && case.d >= FINDABLE_D);
    let weak = || cases.iter().filter(|case| single(case) && (VISIBLE_D..FINDABLE_D).contains(&case.d));
    // Strengths are met within five per cent.
    let pairs = || cases.iter().filter(|case| case.truth.len() > 1 && case.least_d[0] >= 0.95 * PAIR_D);
    let unlisted = || cases.iter().filter(|case| case.right_verdict == "unexplained");
    let listed = || cases.iter().filter(|case| case.right_verdict == "named");
    let sets: Vec<f64> = strong().filter_map(|case| case.set).map(|set| set as f64).collect();
    let over_true: Vec<f64> = listed().filter_map(|case| case.over_true).collect();
    vec![
        share(STRONG, "found", AtLeast(0.99), Share::count(strong(), |case| found(case)), ""),
        share(STRONG, "named first", AtLeast(0.95), Share::count(strong(), |case| case.first), ""),
        share(STRONG, "within the named set", AtLeast(0.98), Share::count(strong(), |case| case.within), ""),
        line(
            STRONG,
            "size of the set, mean",
            AtMost(1.4),
            Unit::Plain,
            Number::mean(&sets),
            "of the cases that name something",
        ),
        share(
            STRONG,
            "called unexplained",
            AtMost(0.02),
            Share::count(strong(), |case| case.verdict == "unexplained"),
            "",
        ),
        share(WEAK, "named first", AtLeast(0.60), Share::count(weak(), |case| case.first), ""),
        share(
            WEAK,
            "of the others: consistent or ambiguous",
            AtLeast(1.0),
            Share::count(weak().filter(|case| !case.first), |case| {
                case.verdict == "consistent" || case.verdict == "ambiguous"
            }),
            "",
        ),
        share(PAIRS, "both named, nothing else", AtLeast(0.85), Share::count(pairs(), |case| case.exact), ""),
        share(
            "nothing hidden",
            "consistent",
            AtLeast(0.99),
            Share::count(cases.iter().filter(|case| case.way == "absent"), |case| case.right),
            "",
        ),
        share(
            "not in the list, unlike anything in it",
            "unexplained",
            AtLeast(0.90),
            Share::count(unlisted().filter(|case| !case.resembling), |case| case.right),
            "",
        ),
        share(
            "not in the list, resembling something in it",
            "unexplained",
            AtLeast(0.75),
            Share::count(unlisted().filter(|case| case.resembling), |case| case.right),
            "",
        ),
        share(
            UNLISTED,
            "right phase",
            AtLeast(0.90),
            Share::count(unlisted().filter_map(|case| case.right_phase), |right| *right),
            "the largest place lies in a phase that holds a quarter of what the re-tuned baseline leaves, or in the largest; a fall has one phase",
        ),
        share(
            UNLISTED,
            "held out: halfway from baseline to noise",
            AtLeast(0.90),
            Share::count(unlisted().filter_map(|case| case.way_to_noise), |way| *way >= 0.5),
            "how many are to is not said; taken as nine in ten",
        ),
        line(
            "one or two effects of the list",
            "held-out rmse ÷ true model's, median",
            AtMost(1.01),
            Unit::Plain,
            Number::median(over_true.clone()),
            "the true model's: rms of what was written less the noise-free recordings",
        ),
        share(
            "one or two effects of the list",
            "held-out rmse ÷ true model's at most 1.05",
            AtLeast(0.90),
            Share::count(over_true, |ratio| *ratio <= 1.05),
            "",
        ),
        share(
            "parameters, right answers",
            "95 % interval holds the truth",
            Between(0.90, 0.99),
            scores.all_parameters.covered,
            "parameters that mean the same on both sides",
        ),
        line(
            "parameters, right answers",
            "error, median",
            AtMost(0.05),
            Unit::Share,
            scores.all_parameters.error,
            "the same",
        ),
        share(
            "twins",
            "advised recording separates 1.5 times better",
            AtLeast(0.85),
            Share::count(followed.iter().map(Followed::raised), |times| *times >= RAISED),
            "ambiguous answers that ask for a recording which tells what is hidden from its twin; it is made three times, forty answers at most",
        ),
        share(
            "all cases",
            "wrong and confident",
            AtMost(0.02),
            scores.all.wrong_and_confident,
            "a name without an alternative, in an answer that leaves nothing unexplained, of something that is not hidden",
        ),
        share(
            "all cases",
            "held out no worse than the baseline",
            AtLeast(1.0),
            Share::count(cases.iter().filter_map(|case| case.over_baseline), |ratio| *ratio <= 1.0 + 1e-9),
            "",
        ),
        line(
            "all cases",
            "time for a campaign, median",
            AtMost(5.0),
            Unit::Seconds,
            scores.seconds,
            "of one processor, one thread; two cores are demanded",
        ),
        line(
            "all cases",
            "memory for a campaign, the most",
            AtMost(500.0),
            Unit::Megabytes,
            most(cases.len(), scores.memory_mb),
            "",
        ),
    ]
}

/// The largest value of so many, where there is one: a fact, not an estimate.
fn most(of: usize, value: f64) -> Number {
    let value = (value > 0.0).then_some(value);
    Number { of, value, low: value, high: value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_demand_is_sure_only_where_the_whole_interval_says_so() {
        let two_in_hundred = Demand::AtMost(0.02);
        assert_eq!(two_in_hundred.sure([0.001, 0.015]), "reached");
        assert_eq!(two_in_hundred.sure([0.001, 0.03]), "open");
        assert_eq!(two_in_hundred.sure([0.03, 0.06]), "missed");
        assert_eq!(Demand::Between(0.9, 0.99).sure([0.3, 0.8]), "missed");
        assert!(Demand::Between(0.9, 0.99).met(0.95) && !Demand::Between(0.9, 0.99).met(1.0));
    }

    #[test]
    fn without_cases_every_line_is_unmeasured() {
        let lines = targets(&[], &Scores::of(&[]), &[]);
        assert!(lines.len() >= 20);
        assert!(lines.iter().all(|line| line.reached.is_none()), "{lines:?}");
    }
}
