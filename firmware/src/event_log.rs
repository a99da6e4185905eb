//! The last events, numbered, so that they can be read again.
//!
//! A ring: a new event takes the place of the oldest one, and that is counted. Numbers are consecutive
//! from 1 after power-up; a reader that has seen number n asks for n + 1 and learns whether it is still there.

use heapless::Deque;

use crate::event::Event;

/// The ring of the last `N` events.
#[derive(Clone, Debug)]
pub struct EventLog<const N: usize> {
    events: Deque<Event, N>,
    last: u32,
    overwritten: u32,
}

impl<const N: usize> Default for EventLog<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> EventLog<N> {
    /// An empty log; the first event will have number 1.
    #[must_use]
    pub const fn new() -> Self {
        Self { events: Deque::new(), last: 0, overwritten: 0 }
    }

    /// The number that the next event must have.
    #[must_use]
    pub fn next_number(&self) -> u32 {
        self.last.wrapping_add(1)
    }

    /// Keeps an event under the next number, which it gets.
    pub fn push(&mut self, mut event: Event) {
        self.last = self.next_number();
        event.number = self.last;
        if self.events.is_full() {
            self.events.pop_front();
            self.overwritten = self.overwritten.saturating_add(1);
        }
        // There is room now.
        let _ = self.events.push_back(event);
    }

    /// The event with this number, if it is still there.
    #[must_use]
    pub fn get(&self, number: u32) -> Option<&Event> {
        let behind = self.last.wrapping_sub(number) as usize;
        let place = self.events.len().checked_sub(1)?.checked_sub(behind)?;
        self.events.iter().nth(place)
    }

    /// Number of the oldest event that is still there; 0 for none.
    #[must_use]
    pub fn first(&self) -> u32 {
        self.events.front().map_or(0, |event| event.number)
    }

    /// Number of the newest event; 0 for none.
    #[must_use]
    pub fn last(&self) -> u32 {
        self.last
    }

    /// Events that gave way to newer ones.
    #[must_use]
    pub fn overwritten(&self) -> u32 {
        self.overwritten
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dictionary::event_record;

    fn event(impact: u32) -> Event {
        let mut record = [0; event_record::LENGTH];
        record[0] = event_record::VERSION;
        record[8..12].copy_from_slice(&impact.to_le_bytes());
        let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&record[..event_record::LENGTH - 4]);
        record[event_record::LENGTH - 4..].copy_from_slice(&crc.to_le_bytes());
        event_record::decode(&record).unwrap()
    }

    #[test]
    fn the_oldest_gives_way_and_is_counted() {
        let mut log = EventLog::<4>::new();
        assert_eq!((log.first(), log.last(), log.get(0), log.get(1)), (0, 0, None, None));
        for impact in 10..16 {
            log.push(event(impact));
        }
        assert_eq!((log.first(), log.last(), log.overwritten()), (3, 6, 2));
        assert_eq!(log.get(2), None);
        assert_eq!(log.get(3).map(|event| (event.number, event.impact)), Some((3, 12)));
        assert_eq!(log.get(6).map(|event| event.impact), Some(15));
        assert_eq!(log.get(7), None);
    }
}
