//! Which of the controller's three transmit buffers a frame may take.
//!
//! In queue mode the controller sends the pending buffer with the lowest identifier, and of two with the same identifier the one
//! with the lower *number* (Bosch M_CAN, 3.5.4), whichever came first. Two segments of one upload would thus change places. So
//! a frame goes into a buffer above every pending one of its identifier, and where there is none it waits.
//!
//! Not used: FIFO mode, in which an alarm would wait behind two ordinary frames that themselves wait for a busy bus; and
//! `embassy-stm32`'s own writing, which takes any free buffer and, where none is free, cancels a pending frame after comparing the
//! identifiers the wrong way round.

use thud_firmware::board::Frame;

/// Transmit buffers of the FDCAN.
pub const BUFFERS: usize = 3;

/// The identifiers that the buffers were last loaded with.
#[derive(Debug, Default)]
pub struct TransmitBuffers {
    loaded: [u16; BUFFERS],
}

impl TransmitBuffers {
    /// The buffer for this frame, given which are pending (bit by bit); `None` when it must wait.
    pub fn place(&mut self, frame: &Frame, pending: u32) -> Option<usize> {
        let is_pending = |buffer: &usize| pending & 1 << buffer != 0;
        let above = (0..BUFFERS).rev().find(|buffer| is_pending(buffer) && self.loaded[*buffer] == frame.id);
        let buffer = (above.map_or(0, |last| last + 1)..BUFFERS).find(|buffer| !is_pending(buffer))?;
        self.loaded[buffer] = frame.id;
        Some(buffer)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use proptest::prelude::*;

    use super::*;

    fn frame(id: u16, mark: u8) -> Frame {
        Frame::new(id, &[mark]).unwrap()
    }

    /// What the controller sends next.
    fn send(buffers: &mut [Option<Frame>; BUFFERS]) -> Option<Frame> {
        let next = (0..BUFFERS).filter(|at| buffers[*at].is_some()).min_by_key(|at| buffers[*at].unwrap().id)?;
        buffers[next].take()
    }

    fn pending(buffers: &[Option<Frame>; BUFFERS]) -> u32 {
        (0..BUFFERS).filter(|at| buffers[*at].is_some()).fold(0, |bits, at| bits | 1 << at)
    }

    proptest! {
        #[test]
        fn frames_of_one_identifier_keep_their_order_and_none_is_overwritten(
            steps in prop::collection::vec((any::<bool>(), 0u16..4), 0..200),
        ) {
            let mut places = TransmitBuffers::default();
            let mut buffers = [None; BUFFERS];
            let mut accepted: [VecDeque<u8>; 4] = Default::default();
            for (mark, (sends, id)) in steps.into_iter().enumerate() {
                if sends {
                    if let Some(sent) = send(&mut buffers) {
                        prop_assert_eq!(accepted[usize::from(sent.id)].pop_front(), Some(sent.data[0]));
                        prop_assert!(buffers.iter().flatten().all(|waiting| waiting.id >= sent.id));
                    }
                } else if let Some(at) = places.place(&frame(id, mark as u8), pending(&buffers)) {
                    prop_assert!(buffers[at].replace(frame(id, mark as u8)).is_none());
                    accepted[usize::from(id)].push_back(mark as u8);
                }
            }
            while let Some(sent) = send(&mut buffers) {
                prop_assert_eq!(accepted[usize::from(sent.id)].pop_front(), Some(sent.data[0]));
            }
            prop_assert!(accepted.iter().all(VecDeque::is_empty));
        }
    }

    #[test]
    fn an_urgent_frame_takes_any_free_buffer_and_a_second_of_its_kind_one_above() {
        let mut places = TransmitBuffers::default();
        assert_eq!(places.place(&frame(0x5A0, 0), 0b000), Some(0));
        assert_eq!(places.place(&frame(0x5A0, 1), 0b001), Some(1));
        assert_eq!(places.place(&frame(0x020, 2), 0b011), Some(2));
        // The first has gone; a third segment may not overtake the second, an event may go there.
        assert_eq!(places.place(&frame(0x5A0, 3), 0b110), None);
        assert_eq!(places.place(&frame(0x2A0, 4), 0b110), Some(0));
    }
}
