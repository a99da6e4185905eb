//! When the rig is hit, on the time axis of a sampled board: the force at the cell for any sample.

use super::Impact;

/// Impacts that are due at given times, sampled at a board's rate.
///
/// The force is zero where nothing is due. Impacts may overlap; their forces add, as a linear cell adds them.
#[derive(Clone, Debug, PartialEq)]
pub struct HitSchedule {
    sample_rate_hz: f64,
    /// In rising order of their first sample.
    hits: Vec<Hit>,
}

#[derive(Clone, Debug, PartialEq)]
struct Hit {
    first: u64,
    force_n: Vec<f64>,
}

impl HitSchedule {
    /// Nothing is due, on a board with this sample rate.
    #[must_use]
    pub fn new(sample_rate_hz: f64) -> Self {
        Self { sample_rate_hz, hits: Vec::new() }
    }

    /// Lets an impact begin: first contact at `contact_s` after sample 0, which may lie between two samples.
    ///
    /// The force is sampled here, once, through the impact's own measuring chain; after the end of the simulated
    /// time there is none.
    pub fn add(&mut self, contact_s: f64, impact: &Impact) {
        let rate = self.sample_rate_hz;
        let first = (contact_s * rate).floor().max(0.0) as u64;
        let last = ((contact_s + impact.end_s()) * rate).floor().max(0.0) as u64;
        let times_s: Vec<f64> = (first..=last).map(|index| index as f64 / rate - contact_s).collect();
        let hit = Hit { first, force_n: impact.measured_n(&times_s) };
        let place = self.hits.partition_point(|other| other.first <= first);
        self.hits.insert(place, hit);
    }

    /// Force at the cell at a sample, N.
    #[must_use]
    pub fn force_n(&self, index: u64) -> f64 {
        let begun = self.hits.partition_point(|hit| hit.first <= index);
        self.hits[..begun]
            .iter()
            .filter_map(|hit| usize::try_from(index - hit.first).ok().and_then(|place| hit.force_n.get(place)))
            .sum()
    }

    /// Forgets impacts that are over before this sample, so that a long life does not fill the memory.
    pub fn forget_before(&mut self, index: u64) {
        self.hits.retain(|hit| hit.first + hit.force_n.len() as u64 > index);
    }

    /// The first sample after the last impact that is due; 0 if none is.
    #[must_use]
    pub fn end(&self) -> u64 {
        self.hits.iter().map(|hit| hit.first + hit.force_n.len() as u64).max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::{Accuracy, Approach, Rig};

    #[test]
    fn an_impact_is_there_when_it_is_due_and_only_then() {
        let impact = Rig::impact(25_000.0).strike(&Approach::new(0.25, 6.0), &[], 0.2, Accuracy::default()).unwrap();
        let mut schedule = HitSchedule::new(20_000.0);
        assert_eq!(schedule.force_n(7), 0.0);
        let contact_s = 1.000_02; // 0.4 of a sample after sample 20,000
        schedule.add(contact_s, &impact);
        schedule.add(0.3, &impact);
        assert_eq!(schedule.force_n(20_000), 0.0);
        assert_eq!(schedule.force_n(20_001), impact.force_n(20_001.0 / 20_000.0 - contact_s));
        assert!(schedule.force_n(20_001) > 0.0);
        assert!((schedule.force_n(6_100) - impact.force_n(0.005)).abs() < 1e-9);
        assert_eq!(schedule.force_n(schedule.end()), 0.0);
        schedule.forget_before(15_000);
        assert_eq!(schedule.force_n(6_100), 0.0);
        assert!(schedule.force_n(20_100) > 0.0);
    }
}
