//! Where in the curve the force stands still: no contact, but perhaps a rest that friction holds.
//!
//! The detector knows how the last contact ended. What lay between two contacts of the impact is found here by the same measure
//! ([`crate::rest`]), from the mean of the last 2 ms instead of the verdict filter.

use heapless::Vec;

use super::force::{Force, PIECE};
use crate::capture::Curve;
use crate::detector::ImpactContext;
use crate::rest::{STILL, Stillness, largest};

/// Time over which the force is averaged: as the contacts'.
const MEAN_S: f32 = 0.002;
/// Most stretches: as many as contacts, one after each. Later ones are taken for contacts.
const STRETCHES: usize = super::CONTACTS;

/// A stretch in which nothing touches. Positions are samples from the curve's first one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// First sample.
    pub from: usize,
    /// First sample after it.
    pub to: usize,
    /// What stays on the cell there, N; zero within half the threshold.
    pub level: f32,
}

/// All of them, in the order of time, and what stood before the first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rests {
    /// The rest on which the impact began, N.
    pub before: f32,
    /// The stretches.
    pub found: Vec<Rest, STRETCHES>,
    /// The rest that stayed after the impact, N.
    pub after: f32,
    /// The last position at which the detector saw something touch.
    pub last_touch: usize,
}

impl Rests {
    /// Finds the stretches from position `from` on.
    pub fn find<C: Curve>(force: &Force<'_, C>, from: usize, context: &ImpactContext) -> Self {
        let rate = context.configuration.configuration.chain.sample_rate;
        let step = (libm::roundf(MEAN_S * rate.0) as usize).clamp(1, PIECE);
        let span = (libm::roundf(STILL.0 * rate.0 / step as f32) as u32).max(1);
        let release = 0.5 * context.onset.threshold.0;
        let (before, after) = (context.rest_before.0, context.rest_after.0);
        let last_touch = context.last_touch.wrapping_sub(force.first_index());
        let last_touch = usize::try_from(last_touch).unwrap_or(usize::MAX);
        let mut rests = Self { before, found: Vec::new(), after, last_touch };
        let mut still = Stillness::default();
        let mut highest = 0.0f32;
        let mut piece = [0.0; PIECE];
        let mut at = from;
        while at + step <= force.len() && force.read(at, &mut piece[..step]) == step {
            let mean = piece[..step].iter().sum::<f32>() / step as f32;
            highest = highest.max(mean);
            still.take(mean, at as u64, release, span);
            at += step;
            if let Some(level) = still.level()
                && level.abs() <= largest(highest, before, release)
            {
                rests.stands(still.since() as usize, at, if level.abs() > release { level } else { 0.0 });
            }
        }
        // How the impact ended the detector has decided, with the future after the curve in view.
        if after != 0.0
            && last_touch < force.len()
            && rests.found.last().is_none_or(|last| last.to + step < force.len())
        {
            let begins = rests.found.last().map_or(from, |last| last.to);
            rests.stands(last_touch.max(begins), force.len(), after);
        }
        rests
    }

    /// The force stands still at a level from `from` to `to` at least.
    fn stands(&mut self, from: usize, to: usize, level: f32) {
        match self.found.last_mut() {
            Some(last) if last.from == from => *last = Rest { from, to, level },
            _ => {
                let _ = self.found.push(Rest { from, to, level });
            }
        }
    }

    /// The stretch that holds a position, or the next one after it.
    pub fn at_or_after(&self, position: usize) -> Option<&Rest> {
        self.found.iter().find(|rest| rest.to > position)
    }
}
