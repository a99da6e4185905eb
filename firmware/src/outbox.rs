//! Frames on their way to the bus, the most urgent first.
//!
//! ```text
//! push ──▶ [ 0x020 alarm | 0x0A0 EMCY | 0x2A0 event | 0x5A0 SDO 1 | 0x5A0 SDO 2 | … ]  ──▶ mailboxes
//!            smallest identifier first, first in first out within one identifier
//! ```
//!
//! The controller's mailboxes are few and send in their own order, so the queue in front of them is ours. It is
//! bounded: a frame that finds it full takes the place of the least urgent one, if that is less urgent than itself
//! ([`Losses::evicted`]), or is refused ([`Losses::refused`]). [`RESERVED`] places are kept for urgent frames (alarm, EMCY),
//! so that a burst of events or a block upload can never shut them out.

use heapless::Vec;

use crate::board::{CanTransmit, Frame};

/// Identifiers from here on are bulk: stream, SDO, heartbeat. What is before them is events.
const BULK: u16 = 0x500;
/// Free mailboxes that a frame needs, of the three that controllers have: one stays free for the alarm, and one for events. Bulk that
/// others on the bus keep out by their priority would otherwise keep events out of the mailboxes, whatever their own priority.
const fn needed(frame: &Waiting) -> usize {
    if frame.urgent {
        1
    } else if frame.frame.id < BULK {
        2
    } else {
        3
    }
}

/// Places that only urgent frames may take: an alarm and two faults.
pub const RESERVED: usize = 3;

/// Frames that did not get out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Losses {
    /// Gave way to a more urgent one.
    pub evicted: u32,
    /// Found the queue full of more urgent ones.
    pub refused: u32,
}

/// The queue is full of frames that are at least as urgent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Full;

#[derive(Clone, Copy, Debug)]
struct Waiting {
    frame: Frame,
    /// Order of arrival; wraps, but no two waiting frames are 2³¹ apart.
    ticket: u32,
    urgent: bool,
}

impl Waiting {
    /// Whether this one goes before the other.
    fn before(&self, other: &Self) -> bool {
        (self.frame.id, self.ticket.wrapping_sub(other.ticket) as i32) < (other.frame.id, 0)
    }
}

/// The queue; `N` must be larger than [`RESERVED`].
#[derive(Clone, Debug)]
pub struct Outbox<const N: usize> {
    waiting: Vec<Waiting, N>,
    next_ticket: u32,
    losses: Losses,
}

impl<const N: usize> Default for Outbox<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Outbox<N> {
    /// An empty queue.
    #[must_use]
    pub const fn new() -> Self {
        const { assert!(N > RESERVED, "there must be room for ordinary frames") };
        Self { waiting: Vec::new(), next_ticket: 0, losses: Losses { evicted: 0, refused: 0 } }
    }

    /// Queues an ordinary frame.
    ///
    /// # Errors
    /// [`Full`] when only more urgent frames wait; counted.
    pub fn push(&mut self, frame: Frame) -> Result<(), Full> {
        self.insert(frame, false, N - RESERVED)
    }

    /// Queues an alarm or a fault.
    ///
    /// # Errors
    /// [`Full`] when only more urgent frames wait; counted.
    pub fn push_urgent(&mut self, frame: Frame) -> Result<(), Full> {
        self.insert(frame, true, N)
    }

    fn insert(&mut self, frame: Frame, urgent: bool, limit: usize) -> Result<(), Full> {
        let new = Waiting { frame, ticket: self.next_ticket, urgent };
        if self.waiting.len() >= limit {
            // An urgent frame may push out anything less urgent than itself, an ordinary one only ordinary frames.
            let last = (0..self.waiting.len())
                .filter(|place| urgent || !self.waiting[*place].urgent)
                .reduce(|a, b| if self.waiting[a].before(&self.waiting[b]) { b } else { a });
            match last {
                Some(last) if self.waiting[last].frame.id > frame.id => {
                    self.waiting.swap_remove(last);
                    self.losses.evicted = self.losses.evicted.saturating_add(1);
                }
                _ => {
                    self.losses.refused = self.losses.refused.saturating_add(1);
                    return Err(Full);
                }
            }
        }
        self.next_ticket = self.next_ticket.wrapping_add(1);
        self.waiting.push(new).map_err(|_| Full)
    }

    /// How many more ordinary frames fit without pushing anything out.
    #[must_use]
    pub fn room(&self) -> usize {
        (N - RESERVED).saturating_sub(self.waiting.len())
    }

    /// How many more ordinary frames fit that are as urgent as this identifier or more, if less urgent ones give way.
    #[must_use]
    pub fn room_for(&self, id: u16) -> usize {
        let before = self.waiting.iter().filter(|waiting| waiting.urgent || waiting.frame.id <= id).count();
        (N - RESERVED).saturating_sub(before)
    }

    /// How many frames of this identifier wait.
    #[must_use]
    pub fn waiting(&self, id: u16) -> usize {
        self.waiting.iter().filter(|waiting| waiting.frame.id == id).count()
    }

    /// Number of frames that wait.
    #[must_use]
    pub fn len(&self) -> usize {
        self.waiting.len()
    }

    /// Whether nothing waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Frames that did not get out, since power-up.
    #[must_use]
    pub fn losses(&self) -> Losses {
        self.losses
    }

    /// Takes the most urgent frame.
    pub fn pop(&mut self) -> Option<Frame> {
        let first = self.first()?;
        Some(self.waiting.swap_remove(first).frame)
    }

    fn first(&self) -> Option<usize> {
        (0..self.waiting.len()).reduce(|a, b| if self.waiting[a].before(&self.waiting[b]) { a } else { b })
    }

    /// Loads mailboxes while there are frames and room; the last free mailbox is for urgent frames only and the last but one for
    /// events, so that neither waits behind frames of lower priority. Returns how many were loaded.
    pub fn load(&mut self, can: &mut impl CanTransmit) -> usize {
        let mut loaded = 0;
        while let Some(first) = self.first() {
            let waiting = self.waiting[first];
            if can.free() < needed(&waiting) || can.load(&waiting.frame).is_err() {
                break;
            }
            self.waiting.swap_remove(first);
            loaded += 1;
        }
        loaded
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec as StdVec;

    use proptest::prelude::*;

    use super::*;
    use crate::board::MailboxesFull;

    fn frame(id: u16, mark: u8) -> Frame {
        Frame::new(id, &[mark]).unwrap()
    }

    #[test]
    fn the_alarm_finds_room_in_a_full_queue_and_goes_first() {
        let mut outbox = Outbox::<8>::new();
        for mark in 0..5 {
            outbox.push(frame(0x5A0, mark)).unwrap();
        }
        assert_eq!(outbox.push(frame(0x5A0, 5)), Err(Full));
        outbox.push_urgent(frame(0x0A0, 9)).unwrap();
        outbox.push_urgent(frame(0x020, 8)).unwrap();
        assert_eq!(outbox.pop(), Some(frame(0x020, 8)));
        assert_eq!(outbox.pop(), Some(frame(0x0A0, 9)));
        assert_eq!(outbox.losses(), Losses { evicted: 0, refused: 1 });
    }

    #[test]
    fn a_more_urgent_frame_pushes_out_the_youngest_of_the_least_urgent() {
        let mut outbox = Outbox::<6>::new();
        for mark in 0..3 {
            outbox.push(frame(0x5A0, mark)).unwrap();
        }
        outbox.push(frame(0x2A0, 7)).unwrap();
        let order: StdVec<Frame> = core::iter::from_fn(|| outbox.pop()).collect();
        assert_eq!(order, [frame(0x2A0, 7), frame(0x5A0, 0), frame(0x5A0, 1)]);
        assert_eq!(outbox.losses(), Losses { evicted: 1, refused: 0 });
    }

    #[test]
    fn bulk_that_cannot_get_out_leaves_room_for_events() {
        let mut outbox = Outbox::<12>::new();
        while outbox.push(frame(0x720, 0)).is_ok() {}
        assert_eq!((outbox.room(), outbox.room_for(0x4A0)), (0, 9));
        for id in [0x2A0, 0x3A0, 0x4A0, 0x320, 0x420] {
            outbox.push(frame(id, 0)).unwrap();
        }
        assert_eq!(outbox.room_for(0x4A0), 4);
        assert_eq!(outbox.losses().evicted, 5);
    }

    struct Mailboxes {
        free: usize,
        loaded: StdVec<Frame>,
    }

    impl CanTransmit for Mailboxes {
        fn free(&mut self) -> usize {
            self.free
        }

        fn load(&mut self, frame: &Frame) -> Result<(), MailboxesFull> {
            self.free = self.free.checked_sub(1).ok_or(MailboxesFull)?;
            self.loaded.push(*frame);
            Ok(())
        }

        async fn freed(&mut self) {}
    }

    #[test]
    fn a_mailbox_stays_free_for_the_alarm_and_one_for_events() {
        let mut outbox = Outbox::<8>::new();
        let mut mailboxes = Mailboxes { free: 3, loaded: StdVec::new() };
        for mark in 0..4 {
            outbox.push(frame(0x5A0, mark)).unwrap();
        }
        assert_eq!(outbox.load(&mut mailboxes), 1, "bulk only into empty mailboxes");
        outbox.push(frame(0x2A0, 0)).unwrap();
        outbox.push(frame(0x3A0, 0)).unwrap();
        assert_eq!(outbox.load(&mut mailboxes), 1);
        outbox.push_urgent(frame(0x020, 0)).unwrap();
        assert_eq!(outbox.load(&mut mailboxes), 1);
        assert_eq!(mailboxes.loaded.iter().map(|frame| frame.id).collect::<StdVec<_>>(), [0x5A0, 0x2A0, 0x020]);
    }

    proptest! {
        // Against a plain model: a list sorted by (identifier, arrival).
        #[test]
        fn the_order_is_by_identifier_and_then_by_arrival_and_nothing_vanishes_uncounted(
            steps in prop::collection::vec(prop::option::weighted(0.7, (0u16..6, any::<bool>())), 1..200),
        ) {
            let mut outbox = Outbox::<9>::new();
            let mut out = StdVec::new();
            let mut pushed = 0u32;
            for (mark, step) in steps.iter().enumerate() {
                match step {
                    Some((id, urgent)) => {
                        let frame = Frame::new(*id, &(mark as u32).to_le_bytes()).unwrap();
                        pushed += 1;
                        let _ = if *urgent { outbox.push_urgent(frame) } else { outbox.push(frame) };
                    }
                    None => out.extend(outbox.pop()),
                }
                prop_assert!(outbox.len() <= 9);
            }
            let rest: StdVec<Frame> = core::iter::from_fn(|| outbox.pop()).collect();
            let key = |frame: &Frame| (frame.id, u32::from_le_bytes(frame.data[..4].try_into().unwrap()));
            prop_assert!(rest.windows(2).all(|pair| key(&pair[0]) < key(&pair[1])));
            for id in 0..6 {
                let marks: StdVec<u32> =
                    out.iter().chain(&rest).map(key).filter(|key| key.0 == id).map(|key| key.1).collect();
                prop_assert!(marks.windows(2).all(|pair| pair[0] < pair[1]), "segments stay in order");
            }
            let losses = outbox.losses();
            prop_assert_eq!(pushed, (out.len() + rest.len()) as u32 + losses.evicted + losses.refused);
        }
    }
}
