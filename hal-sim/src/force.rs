//! What presses on the load cell.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

/// The force at the cell over time.
///
/// Asked for in slices, because one call for each sample would cost more than the sample.
pub trait ForceSource {
    /// Writes the force at the cell: element `i` of `newtons` is the force, in N, at `first_s + i·period_s`, in
    /// seconds of the world's time.
    ///
    /// Instants never go backwards from call to call; they may skip, when a board was off.
    fn fill(&mut self, first_s: f64, period_s: f64, newtons: &mut [f64]);
}

/// A formula: seconds in, newtons out.
impl<F: FnMut(f64) -> f64> ForceSource for F {
    fn fill(&mut self, first_s: f64, period_s: f64, newtons: &mut [f64]) {
        for (index, newton) in newtons.iter_mut().enumerate() {
            *newton = self(first_s + index as f64 * period_s);
        }
    }
}

/// Nobody touches the cell.
#[derive(Clone, Copy, Debug, Default)]
pub struct Untouched;

impl ForceSource for Untouched {
    fn fill(&mut self, _: f64, _: f64, newtons: &mut [f64]) {
        newtons.fill(0.0);
    }
}

/// A force that lasts for some time: seconds since it began in, newtons out.
pub type Pulse = Box<dyn FnMut(f64) -> f64>;

struct Blow {
    begins_s: f64,
    lasts_s: f64,
    pulse: Pulse,
}

/// Blows that can be ordered while the world runs; clones are the same blows. Those that overlap add up.
#[derive(Clone, Default)]
pub struct Blows {
    ordered: Rc<RefCell<VecDeque<Blow>>>,
}

impl Blows {
    /// None ordered.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Orders a blow that begins at `begins_s`, seconds of the world's time, and lasts `lasts_s`. What would have been
    /// before the present is missed.
    pub fn strike(&self, begins_s: f64, lasts_s: f64, pulse: impl FnMut(f64) -> f64 + 'static) {
        self.ordered.borrow_mut().push_back(Blow { begins_s, lasts_s, pulse: Box::new(pulse) });
    }

    /// Orders a blow from its samples, `rate_per_s` of them a second, the first one at `begins_s`; straight lines
    /// between.
    pub fn strike_sampled(&self, begins_s: f64, rate_per_s: f64, newtons: Vec<f64>) {
        let lasts_s = newtons.len().saturating_sub(1) as f64 / rate_per_s;
        self.strike(begins_s, lasts_s, move |since_s| interpolated(&newtons, since_s * rate_per_s));
    }

    /// Blows that are not over.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.ordered.borrow().len()
    }
}

fn interpolated(newtons: &[f64], position: f64) -> f64 {
    let index = position as usize;
    match (newtons.get(index), newtons.get(index + 1)) {
        (Some(before), Some(after)) => before + (after - before) * position.fract(),
        (Some(last), None) => *last,
        _ => 0.0,
    }
}

impl ForceSource for Blows {
    fn fill(&mut self, first_s: f64, period_s: f64, newtons: &mut [f64]) {
        newtons.fill(0.0);
        let mut ordered = self.ordered.borrow_mut();
        if ordered.is_empty() {
            return;
        }
        let end_s = first_s + newtons.len() as f64 * period_s;
        for blow in ordered.iter_mut().filter(|blow| blow.begins_s < end_s) {
            for (index, newton) in newtons.iter_mut().enumerate() {
                let since_s = first_s + index as f64 * period_s - blow.begins_s;
                if (0.0..=blow.lasts_s).contains(&since_s) {
                    *newton += (blow.pulse)(since_s);
                }
            }
        }
        ordered.retain(|blow| blow.begins_s + blow.lasts_s >= end_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blows_begin_between_samples_add_up_and_end() {
        let blows = Blows::new();
        blows.strike(1.5, 2.0, |since_s| 10.0 + since_s);
        blows.strike_sampled(3.0, 2.0, vec![0.0, 100.0, 0.0]);
        let mut newtons = [f64::NAN; 8];
        let mut source = blows.clone();
        for (piece, first_s) in newtons.chunks_mut(2).zip([0.0, 2.0, 4.0, 6.0]) {
            source.fill(first_s, 1.0, piece);
        }
        assert_eq!(newtons, [0.0, 0.0, 10.5, 11.5, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(blows.pending(), 0);
        blows.strike_sampled(10.0, 2.0, vec![0.0, 100.0, 0.0]);
        source.fill(10.0, 0.25, &mut newtons);
        assert_eq!(newtons, [0.0, 50.0, 100.0, 50.0, 0.0, 0.0, 0.0, 0.0]);
    }
}
