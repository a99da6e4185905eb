//! What a search has cost and what it may cost, counted alike on every machine, so that the same input has the same answer.
//!
//! ```text
//! all of it ─▶ each stage: half of what is left ─▶ each search: half of that ─▶ each look at its candidates: as many as that pays for, the leading ones first
//! ```
//!
//! A light piece that rings on a bristle takes a thousand times the steps of a mass on a spring; what is hopeless costs most.

use std::sync::atomic::{AtomicU64, Ordering};

use thud_sim::rig::Impact;

/// What one step of a solver, one evaluation of the equations and one value that is read cost, ns of one core of a small server: as a straight line through the
/// times of the stages of a slow campaign (20 to 120 s each) has them; of another it was right to a fifth.
const STEP_NS: u64 = 2500;
const EVALUATION_NS: u64 = 170;
const VALUE_NS: u64 = 18;
/// A motion that was given up has changed contact thousands of times.
const GIVEN_UP_NS: u64 = 10_000_000;
/// What all searches of a diagnosis may cost together: two minutes of one core.
const ALL_NS: u64 = 120_000_000_000;
/// A stage may cost this part of what is left of all, a search of what is left of its stage: what was first met may be wrong, and costs what all that is
/// met instead has to be found with.
const SHARE: u64 = 2;
/// And this, whatever is left: who leads by now has to be known.
const LEAST_NS: u64 = 2_000_000_000;

/// What it costs to follow a motion, ns.
#[must_use]
pub fn following_ns(motion: &Impact) -> u64 {
    let effort = motion.effort();
    effort.steps as u64 * STEP_NS + effort.evaluations as u64 * EVALUATION_NS
}

/// What it costs to read so many values from it, ns.
#[must_use]
pub fn reading_ns(values: usize) -> u64 {
    values as u64 * VALUE_NS
}

/// What has been done.
#[derive(Debug)]
pub struct Work {
    /// What it may cost.
    all_ns: u64,
    spent_ns: AtomicU64,
    /// Up to what the stage may go.
    stage_ns: AtomicU64,
    left_out: AtomicU64,
}

impl Default for Work {
    fn default() -> Self {
        Self::of(ALL_NS)
    }
}

impl Work {
    /// At the beginning of the first stage.
    fn of(all_ns: u64) -> Self {
        let [spent_ns, stage_ns, left_out] = [(); 3].map(|()| AtomicU64::new(0));
        let work = Self { all_ns, spent_ns, stage_ns, left_out };
        work.begin_stage();
        work
    }

    /// Work of its own that may cost half of what is left of this.
    #[must_use]
    pub fn half(&self) -> Self {
        Self::of(self.all_ns.saturating_sub(self.spent_ns()) / 2)
    }

    /// Counts what another has cost, and what was left out of it.
    pub fn add(&self, other: &Self) {
        self.spent_ns.fetch_add(other.spent_ns(), Ordering::Relaxed);
        self.left_out.fetch_add(other.left_out.load(Ordering::Relaxed), Ordering::Relaxed);
    }

    /// Counts a motion that was followed, or given up.
    pub fn follow(&self, motion: Option<&Impact>) {
        // Sums do not depend on who comes first; they are looked at where nothing else is under way.
        self.spent_ns.fetch_add(motion.map_or(GIVEN_UP_NS, following_ns), Ordering::Relaxed);
    }

    /// Counts values that were read from a motion.
    pub fn read(&self, values: usize) {
        self.spent_ns.fetch_add(reading_ns(values), Ordering::Relaxed);
    }

    fn spent_ns(&self) -> u64 {
        self.spent_ns.load(Ordering::Relaxed)
    }

    /// Another stage begins.
    pub fn begin_stage(&self) {
        let spent_ns = self.spent_ns();
        self.stage_ns.store(spent_ns + self.all_ns.saturating_sub(spent_ns) / SHARE, Ordering::Relaxed);
    }

    /// Whether a stage has nothing left to begin anything further with.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.left_ns() == 0
    }

    /// Of what the stage may cost.
    fn left_ns(&self) -> u64 {
        self.stage_ns.load(Ordering::Relaxed).saturating_sub(self.spent_ns())
    }

    /// Up to what a search may go that begins now.
    #[must_use]
    pub fn purse(&self) -> Purse<'_> {
        Purse { work: self, until_ns: self.spent_ns() + (self.left_ns() / SHARE).max(LEAST_NS) }
    }

    /// What of the search was left undone for want of it, in a sentence.
    #[must_use]
    pub fn cut_short(&self) -> Option<String> {
        let left_out = self.left_out.load(Ordering::Relaxed);
        let is_all = self.spent_ns() >= self.all_ns;
        let further = if is_all { ", and nothing further was begun" } else { "" };
        (left_out > 0 || is_all).then(|| {
            format!(
                "these motions take long to follow, and the search is limited: {left_out} times a start was left that did not lead{further}; \
                 with --only the few mechanisms in question are searched as far as it goes"
            )
        })
    }
}

/// What one search may cost.
pub struct Purse<'a> {
    work: &'a Work,
    until_ns: u64,
}

impl Purse<'_> {
    /// How many of these it pays for, in their order, given what each will cost; the first in any case. The others are counted.
    pub fn pays_for(&self, costs_ns: impl ExactSizeIterator<Item = u64>) -> usize {
        let all = costs_ns.len();
        let mut left_ns = self.until_ns.saturating_sub(self.work.spent_ns());
        let paid = costs_ns.take_while(|cost_ns| {
            let is_paid = *cost_ns <= left_ns;
            left_ns = left_ns.saturating_sub(*cost_ns);
            is_paid
        });
        let paid = paid.count().max(1).min(all);
        self.work.left_out.fetch_add((all - paid) as u64, Ordering::Relaxed);
        paid
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half of a stage's half of it all pays for three of four.
    #[test]
    fn who_leads_is_paid_for_and_the_rest_is_counted() {
        let work = Work::default();
        let share_ns = ALL_NS / SHARE / SHARE;
        assert_eq!(work.purse().pays_for([share_ns / 3; 4].into_iter()), 3);
        assert!(work.cut_short().is_some_and(|sentence| sentence.contains("1 times")), "{:?}", work.cut_short());
        assert_eq!(work.purse().pays_for([2 * ALL_NS; 2].into_iter()), 1, "the first in any case");
        assert_eq!(work.purse().pays_for(std::iter::empty()), 0);
    }

    #[test]
    fn what_one_stage_has_spent_is_no_longer_shared_and_another_still_has_its_own() {
        let work = Work::default();
        let before = work.purse();
        work.read((ALL_NS / VALUE_NS) as usize / 4);
        let eighth_ns = ALL_NS / 8;
        assert_eq!(work.purse().pays_for([eighth_ns / 2; 4].into_iter()), 2);
        assert_eq!(before.pays_for([eighth_ns; 4].into_iter()), 1, "that search has had its share");
        assert!(!work.is_done());
        work.read((ALL_NS / VALUE_NS) as usize / 4 + 2);
        assert!(work.is_done());
        assert_eq!(work.purse().pays_for([LEAST_NS / 4; 8].into_iter()), 4, "rivals are still met");
        work.begin_stage();
        assert!(!work.is_done());
        assert_eq!(work.purse().pays_for([eighth_ns / 3; 4].into_iter()), 2);
    }
}
