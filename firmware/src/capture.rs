//! The force curve of an impact, kept as counts with what went before it.
//!
//! Two slots: one is a ring that always holds the latest pre-trigger and, once an impact has begun, fills up
//! with it; the other keeps the last finished curve for evaluation and download. When a slot is needed and the
//! other's curve has not been fetched, the older curve is overwritten, and that is counted.

use core::cell::RefCell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;

use crate::board::AdcCode;

/// Samples of one captured curve on the board: 0.717 s at 20 kS/s, 28 KiB.
pub const CAPTURE: usize = 14_336;

/// The part of a capture that lies before the onset: 1/7 of it, 0.1024 s at 20 kS/s, five periods of 50 Hz mains.
#[must_use]
pub const fn pre_trigger(capture: usize) -> usize {
    capture / 7
}

/// A finished force curve that can be read in pieces, as evaluation and download do.
pub trait Curve {
    /// Number of samples.
    fn len(&self) -> usize;
    /// Whether it holds no sample.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Sample number, since power-up, of its first sample.
    fn first_index(&self) -> u64;
    /// Copies samples from `offset` on and returns how many.
    fn read(&self, offset: usize, into: &mut [AdcCode]) -> usize;
}

/// Names one of the two slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotId(pub u8);

/// Both slots, shared between the sampler (writes) and evaluation and download (read).
///
/// A lock is held for the copy of a block, never longer.
pub struct Captures<const N: usize = CAPTURE> {
    slots: [Mutex<CriticalSectionRawMutex, RefCell<Slot<N>>>; 2],
}

struct Slot<const N: usize> {
    codes: [AdcCode; N],
}

impl<const N: usize> Captures<N> {
    /// Both slots empty.
    #[must_use]
    pub const fn new() -> Self {
        Self { slots: [const { Mutex::new(RefCell::new(Slot { codes: [0; N] })) }; 2] }
    }

    /// The curve in a slot.
    #[must_use]
    pub fn curve(&self, slot: SlotId) -> impl Curve + '_ {
        let _ = (&self.slots, slot);
        todo_curve()
    }
}

impl<const N: usize> Default for Captures<N> {
    fn default() -> Self {
        Self::new()
    }
}

fn todo_curve() -> Empty {
    Empty
}

struct Empty;
impl Curve for Empty {
    fn len(&self) -> usize {
        0
    }
    fn first_index(&self) -> u64 {
        0
    }
    fn read(&self, _: usize, _: &mut [AdcCode]) -> usize {
        0
    }
}
