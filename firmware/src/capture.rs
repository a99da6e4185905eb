//! The force curve of an impact, kept as counts with what went before it.
//!
//! ```text
//! slot A  ring ──onset──▶ keeps the pre-trigger and fills up ──over──▶ finished: evaluated, fetched
//! slot B  finished curve of the impact before        ──A is over──▶ overwritten, becomes the ring, which begins with A's end
//! ```
//!
//! Two slots: one is a ring that always holds the latest pre-trigger and, once an impact has begun, fills up
//! with it; the other keeps the last finished curve for evaluation and download. When a slot is needed whose
//! curve has not been evaluated or not been fetched, the curve is overwritten all the same, and that is counted
//! ([`Captures::lost_curves`]): sensing goes before keeping.
//!
//! A curve that is being uploaded is not overwritten ([`Captures::reserve`]). An impact that ends meanwhile is evaluated from its
//! own slot, which then becomes the ring again, so that events go on; its curve is gone, and counted ([`LostCurves::not_kept`]). Between its end
//! and its evaluation (25 to 150 ms on the board) there is no ring: an impact that begins within that time has no
//! pre-trigger, and the one before it an event without values, marked `lost-samples`, should it not have been evaluated by
//! then. A third slot would cure it and does not fit into the memory that the board grants.
//!
//! A reader that holds a [`Curve`] across such a moment reads nothing from then on; it never gets a mixture of two curves.

use core::cell::{Cell, RefCell};

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

/// So many samples of a finished curve begin the next ring: a blow that comes just as an impact is closed has begun in
/// that curve, and its instant is found from both sides. 12.8 ms at 20 kS/s.
pub const OVERLAP: usize = 256;

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
    /// Copies samples from `offset` on and returns how many. Fewer than asked for: the curve ends there, or has been overwritten.
    fn read(&self, offset: usize, into: &mut [AdcCode]) -> usize;
}

/// Names one of the two slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotId(pub u8);

/// Curves that were overwritten before somebody had seen them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LostCurves {
    /// Never evaluated: the impact has no event.
    pub unevaluated: u32,
    /// Evaluated, but the curve was never fetched by a host.
    pub unfetched: u32,
    /// Evaluated, but never to be had, because another curve was being uploaded.
    pub not_kept: u32,
}

/// Both slots, shared between the sampler (writes) and evaluation and download (read).
///
/// A lock is held for the copy of a block, never longer.
pub struct Captures<const N: usize = CAPTURE> {
    slots: [Mutex<CriticalSectionRawMutex, RefCell<Slot<N>>>; 2],
    lost: Mutex<CriticalSectionRawMutex, RefCell<LostCurves>>,
    /// One more than the slot that must not be overwritten; 0 none.
    reserved: Mutex<CriticalSectionRawMutex, Cell<u8>>,
}

/// What a slot is doing. With this representation an empty slot is all zeros: on the board it lies in memory that is zeroed at
/// reset, instead of 56 KiB of initial values in flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Use {
    /// Keeps the latest samples.
    Ring,
    /// Fills up with an impact.
    Filling,
    /// Holds a finished curve.
    Finished { evaluated: bool, fetched: bool },
}

struct Slot<const N: usize> {
    codes: [AdcCode; N],
    used_for: Use,
    /// Counts how often the slot has been begun anew.
    generation: u32,
    /// Place of the curve's first sample.
    start: usize,
    len: usize,
    /// Number of the curve's first sample since power-up.
    first_index: u64,
    /// Finished, and the ring again as soon as it has been evaluated, because the other slot is reserved.
    returns: bool,
    /// Number of the next sample, while it is neither ring nor filling and yet the slot that is written to.
    next_index: u64,
}

impl<const N: usize> Slot<N> {
    const EMPTY: Self = Self {
        codes: [0; N],
        used_for: Use::Ring,
        generation: 0,
        start: 0,
        len: 0,
        first_index: 0,
        returns: false,
        next_index: 0,
    };

    fn place(&self, offset: usize) -> usize {
        let place = self.start + offset;
        if place >= N { place - N } else { place }
    }

    fn begin(&mut self, next_index: u64) {
        self.used_for = Use::Ring;
        self.generation = self.generation.wrapping_add(1);
        self.start = 0;
        self.len = 0;
        self.first_index = next_index;
        self.returns = false;
    }

    fn drop_front(&mut self, count: usize) {
        let count = count.min(self.len);
        self.start = self.place(count);
        self.len -= count;
        self.first_index += count as u64;
    }

    fn append(&mut self, codes: &[AdcCode]) {
        let codes = match self.used_for {
            Use::Finished { .. } => {
                self.next_index += codes.len() as u64;
                return;
            }
            Use::Filling => &codes[..codes.len().min(N - self.len)],
            Use::Ring => {
                self.drop_front((self.len + codes.len()).saturating_sub(N));
                codes
            }
        };
        // Two runs at most: up to the end of the array, and from its beginning.
        let place = self.place(self.len);
        let first = codes.len().min(N - place);
        self.codes[place..place + first].copy_from_slice(&codes[..first]);
        if first < codes.len() {
            self.codes[..codes.len() - first].copy_from_slice(&codes[first..]);
        }
        self.len += codes.len();
    }

    fn read(&self, offset: usize, into: &mut [AdcCode]) -> usize {
        let count = into.len().min(self.len.saturating_sub(offset));
        if count == 0 {
            return 0;
        }
        let place = self.place(offset);
        let first = count.min(N - place);
        into[..first].copy_from_slice(&self.codes[place..place + first]);
        into[first..count].copy_from_slice(&self.codes[..count - first]);
        count
    }
}

impl<const N: usize> Captures<N> {
    /// Both slots empty.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            slots: [const { Mutex::new(RefCell::new(Slot::EMPTY)) }; 2],
            lost: Mutex::new(RefCell::new(LostCurves { unevaluated: 0, unfetched: 0, not_kept: 0 })),
            reserved: Mutex::new(Cell::new(0)),
        }
    }

    /// The curve in a slot as it is now.
    #[must_use]
    pub fn curve(&self, slot: SlotId) -> impl Curve + '_ {
        let slot = self.slot(slot);
        slot.lock(|slot_cell| {
            let inner = slot_cell.borrow();
            CapturedCurve { slot, generation: inner.generation, len: inner.len, first_index: inner.first_index }
        })
    }

    /// Says that the curve in a slot has been evaluated: its impact has its events.
    pub fn mark_evaluated(&self, slot: SlotId) {
        self.mark(slot, |evaluated, _| *evaluated = true);
        let lost = self.slot(slot).lock(|slot| {
            let mut slot = slot.borrow_mut();
            let returns = slot.returns;
            if returns {
                let next_index = slot.next_index;
                slot.begin(next_index);
            }
            returns
        });
        if lost {
            self.lost.lock(|lost| {
                let mut lost = lost.borrow_mut();
                lost.not_kept = lost.not_kept.saturating_add(1);
            });
        }
    }

    /// Keeps the curve in this slot from being overwritten, and that of the other one no longer; `None` keeps none.
    pub fn reserve(&self, slot: Option<SlotId>) {
        self.reserved.lock(|reserved| reserved.set(slot.map_or(0, |slot| 1 + (slot.0 & 1))));
    }

    /// Says that the curve in a slot has been fetched by a host.
    pub fn mark_fetched(&self, slot: SlotId) {
        self.mark(slot, |_, fetched| *fetched = true);
    }

    /// Curves that were overwritten unseen, since power-up.
    #[must_use]
    pub fn lost_curves(&self) -> LostCurves {
        self.lost.lock(|lost| *lost.borrow())
    }

    /// Appends a block to the slot that is being written.
    pub(crate) fn append(&self, slot: SlotId, codes: &[AdcCode]) {
        // A block longer than the slot could only be its own last part.
        let codes = &codes[codes.len().saturating_sub(N)..];
        self.slot(slot).lock(|slot| slot.borrow_mut().append(codes));
    }

    /// An impact begins: everything from the pre-trigger before `onset` on is kept. Returns the number of the curve's first sample.
    pub(crate) fn open(&self, slot: SlotId, onset: u64) -> u64 {
        self.slot(slot).lock(|slot| {
            let mut slot = slot.borrow_mut();
            if let Use::Finished { .. } = slot.used_for {
                // Not evaluated yet, and already the next impact: that one goes before.
                let next_index = slot.next_index;
                self.count(slot.used_for);
                slot.begin(next_index);
            }
            let wanted = onset.saturating_sub(pre_trigger(N) as u64);
            let surplus = wanted.saturating_sub(slot.first_index);
            slot.drop_front(usize::try_from(surplus).unwrap_or(usize::MAX));
            slot.used_for = Use::Filling;
            slot.first_index
        })
    }

    /// The curve is complete. Returns the other slot, which becomes the ring, from `next_index` on.
    pub(crate) fn finish(&self, finished: SlotId, next_index: u64) -> SlotId {
        self.slot(finished).lock(|slot| {
            slot.borrow_mut().used_for = Use::Finished { evaluated: false, fetched: false };
        });
        let other = SlotId(finished.0 ^ 1);
        if self.reserved.lock(Cell::get) == 1 + (other.0 & 1) {
            self.slot(finished).lock(|slot| {
                let mut slot = slot.borrow_mut();
                slot.returns = true;
                slot.next_index = next_index;
            });
            return finished;
        }
        let before = self.slot(other).lock(|slot| {
            let mut slot = slot.borrow_mut();
            let before = slot.used_for;
            slot.begin(next_index);
            before
        });
        self.count(before);
        self.overlap(finished, other, next_index);
        other
    }

    /// Counts a curve that goes, if somebody has not seen it yet.
    fn count(&self, before: Use) {
        if let Use::Finished { evaluated, fetched } = before {
            self.lost.lock(|lost| {
                let mut lost = lost.borrow_mut();
                if !evaluated {
                    lost.unevaluated = lost.unevaluated.saturating_add(1);
                } else if !fetched {
                    lost.unfetched = lost.unfetched.saturating_add(1);
                }
            });
        }
    }

    /// Begins a ring with the end of the curve before it, where that reaches to `next_index`.
    fn overlap(&self, finished: SlotId, ring: SlotId, next_index: u64) {
        let mut piece = [0; 64];
        let mut left = self.slot(finished).lock(|slot| {
            let slot = slot.borrow();
            let reaches = slot.first_index + slot.len as u64 == next_index;
            if reaches { OVERLAP.min(pre_trigger(N)).min(slot.len) } else { 0 }
        });
        let from = next_index - left as u64;
        self.slot(ring).lock(|slot| slot.borrow_mut().first_index = from);
        while left > 0 {
            let wanted = left.min(piece.len());
            self.slot(finished).lock(|slot| {
                let slot = slot.borrow();
                slot.read(slot.len - left, &mut piece[..wanted])
            });
            self.append(ring, &piece[..wanted]);
            left -= wanted;
        }
    }

    /// Samples were lost: a ring starts anew after the gap; a curve that is filling ends before it.
    pub(crate) fn gap(&self, slot: SlotId, next_index: u64) {
        self.slot(slot).lock(|slot| {
            let mut slot = slot.borrow_mut();
            match slot.used_for {
                Use::Ring => slot.begin(next_index),
                Use::Filling => slot.used_for = Use::Finished { evaluated: false, fetched: false },
                Use::Finished { .. } => slot.next_index = next_index,
            }
        });
    }

    fn slot(&self, slot: SlotId) -> &Mutex<CriticalSectionRawMutex, RefCell<Slot<N>>> {
        &self.slots[usize::from(slot.0 & 1)]
    }

    fn mark(&self, slot: SlotId, set: impl FnOnce(&mut bool, &mut bool)) {
        self.slot(slot).lock(|slot| {
            if let Use::Finished { evaluated, fetched } = &mut slot.borrow_mut().used_for {
                set(evaluated, fetched);
            }
        });
    }
}

impl<const N: usize> Default for Captures<N> {
    fn default() -> Self {
        Self::new()
    }
}

struct CapturedCurve<'a, const N: usize> {
    slot: &'a Mutex<CriticalSectionRawMutex, RefCell<Slot<N>>>,
    generation: u32,
    len: usize,
    first_index: u64,
}

impl<const N: usize> Curve for CapturedCurve<'_, N> {
    fn len(&self) -> usize {
        self.len
    }

    fn first_index(&self) -> u64 {
        self.first_index
    }

    fn read(&self, offset: usize, into: &mut [AdcCode]) -> usize {
        self.slot.lock(|slot| {
            let slot = slot.borrow();
            if slot.generation == self.generation && slot.first_index == self.first_index {
                slot.read(offset, into)
            } else {
                0
            }
        })
    }
}

/// Codes as a curve from sample 0 on.
#[cfg(test)]
impl Curve for std::vec::Vec<AdcCode> {
    fn len(&self) -> usize {
        self.as_slice().len()
    }

    fn first_index(&self) -> u64 {
        0
    }

    fn read(&self, offset: usize, into: &mut [AdcCode]) -> usize {
        let rest = self.get(offset..).unwrap_or_default();
        let count = into.len().min(rest.len());
        into[..count].copy_from_slice(&rest[..count]);
        count
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    const A: SlotId = SlotId(0);
    const B: SlotId = SlotId(1);

    fn codes(range: core::ops::Range<u16>) -> Vec<AdcCode> {
        range.collect()
    }

    fn all(curve: &impl Curve) -> Vec<AdcCode> {
        let mut into = std::vec![0; curve.len() + 5];
        let count = curve.read(0, &mut into);
        into.truncate(count);
        into
    }

    #[test]
    fn a_curve_keeps_its_pre_trigger_and_fills_up() {
        let captures = Captures::<70>::new();
        captures.append(A, &codes(0..50));
        captures.append(A, &codes(50..100));
        captures.open(A, 95);
        captures.append(A, &codes(100..130));
        captures.append(A, &codes(130..200));
        let curve = captures.curve(A);
        assert_eq!(curve.first_index(), 85);
        assert_eq!(all(&curve), codes(85..155));
        let mut piece = [0; 4];
        assert_eq!(curve.read(40, &mut piece), 4);
        assert_eq!(piece, [125, 126, 127, 128]);
    }

    #[test]
    fn an_overwritten_curve_is_counted_and_never_mixed() {
        let captures = Captures::<70>::new();
        captures.append(A, &codes(0..30));
        captures.open(A, 25);
        assert_eq!(captures.finish(A, 30), B);
        let stale = captures.curve(A);
        assert_eq!(all(&stale).len(), 15);
        captures.append(B, &codes(30..60));
        captures.open(B, 55);
        assert_eq!(captures.finish(B, 60), A);
        captures.append(A, &codes(60..70));
        assert_eq!(captures.lost_curves(), LostCurves { unevaluated: 1, ..LostCurves::default() });
        assert_eq!(all(&stale), []);
        captures.mark_evaluated(B);
        captures.open(A, 65);
        captures.finish(A, 70);
        assert_eq!(captures.lost_curves(), LostCurves { unevaluated: 1, unfetched: 1, not_kept: 0 });
        captures.mark_evaluated(A);
        captures.mark_fetched(A);
        captures.finish(B, 70);
        assert_eq!(captures.lost_curves(), LostCurves { unevaluated: 1, unfetched: 1, not_kept: 0 });
    }

    /// What begins just as an impact is closed has its own beginning in its curve.
    #[test]
    fn a_ring_begins_with_the_end_of_the_curve_before() {
        let captures = Captures::<70>::new();
        captures.append(A, &codes(0..30));
        captures.open(A, 25);
        captures.append(A, &codes(30..60));
        assert_eq!(captures.finish(A, 60), B);
        captures.append(B, &codes(60..68));
        captures.open(B, 62);
        let curve = captures.curve(B);
        assert_eq!((curve.first_index(), all(&curve)), (52, codes(52..68)));
        // A curve that was full before the impact was over leaves a gap: the ring begins after it.
        captures.append(B, &codes(68..200));
        assert_eq!(captures.finish(B, 200), A);
        captures.append(A, &codes(200..210));
        assert_eq!((captures.curve(A).first_index(), all(&captures.curve(A))), (200, codes(200..210)));
    }

    #[test]
    fn a_reserved_curve_stays_while_impacts_go_on() {
        let captures = Captures::<70>::new();
        captures.append(A, &codes(0..30));
        captures.open(A, 25);
        assert_eq!(captures.finish(A, 30), B);
        captures.mark_evaluated(A);
        captures.reserve(Some(A));
        let uploaded = captures.curve(A);
        let mut next = 30;
        for _ in 0..5 {
            captures.append(B, &codes(next..next + 30));
            assert_eq!(captures.open(B, u64::from(next) + 25), u64::from(next) + 15);
            assert_eq!(captures.finish(B, u64::from(next) + 30), B, "the other one is reserved");
            // While it waits for its evaluation, samples pass by.
            captures.append(B, &codes(next + 30..next + 40));
            assert_eq!(all(&captures.curve(B)), codes(next + 15..next + 30));
            captures.mark_evaluated(B);
            next += 40;
        }
        assert_eq!(captures.curve(B).first_index(), u64::from(next), "the ring goes on with the next sample");
        assert_eq!(all(&uploaded), codes(15..30));
        assert_eq!(captures.lost_curves(), LostCurves { not_kept: 5, ..LostCurves::default() });
        captures.reserve(None);
        captures.append(B, &codes(next..next + 30));
        captures.open(B, u64::from(next) + 25);
        assert_eq!(captures.finish(B, u64::from(next) + 30), A);
        assert_eq!(all(&uploaded), []);
    }

    #[test]
    fn an_impact_before_the_last_one_was_evaluated_goes_before_it_and_that_is_counted() {
        let captures = Captures::<70>::new();
        captures.append(A, &codes(0..30));
        captures.open(A, 25);
        captures.finish(A, 30);
        captures.mark_evaluated(A);
        captures.reserve(Some(A));
        captures.append(B, &codes(30..60));
        captures.open(B, 55);
        captures.finish(B, 60);
        let unevaluated = captures.curve(B);
        captures.append(B, &codes(60..70));
        assert_eq!(captures.open(B, 69), 70);
        captures.append(B, &codes(70..80));
        assert_eq!((all(&unevaluated), all(&captures.curve(B))), (codes(0..0), codes(70..80)));
        // Its evaluation, had it begun, marks nothing of the new curve.
        captures.mark_evaluated(B);
        assert_eq!(captures.finish(B, 80), B);
        assert_eq!(captures.lost_curves(), LostCurves { unevaluated: 1, ..LostCurves::default() });
    }

    #[test]
    fn a_gap_restarts_the_ring_and_ends_a_filling_curve() {
        let captures = Captures::<70>::new();
        captures.append(A, &codes(0..30));
        captures.gap(A, 100);
        captures.append(A, &codes(100..110));
        assert_eq!(captures.curve(A).first_index(), 100);
        captures.open(A, 108);
        captures.gap(A, 200);
        captures.append(A, &codes(200..210));
        assert_eq!(all(&captures.curve(A)), codes(100..110));
    }
}
