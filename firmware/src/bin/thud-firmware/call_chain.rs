//! Who had called whom, by the frame pointers, without debug information.
//!
//! ```text
//!                 ┌──────────────────▶ │ caller's r7    │ ──▶ … up to the bottom of the stack
//!       │ r7 of the caller │           │ return address │
//! r7 ▶ ─┴ return address   │           one frame for each function, the innermost first (AAPCS32)
//! ```
//!
//! Rust compiles for `thumbv7em-none-eabihf` with frame pointers, `core` included; the emulator's tests see whether that is still so. A
//! handler's return address is no address but says that the processor has pushed eight words above the frame (ARMv7-M
//! ARM, B1.5.6), of which the seventh is where the program was interrupted.

use core::ops::Range;

/// The least of the return addresses that stand for a return from an exception.
const EXCEPTION_RETURN: u32 = 0xFFFF_FFE0;
/// From a handler's frame to the address at which it interrupted: its own two words, and R0 to R3, R12, LR.
const TO_INTERRUPTED: u32 = 8 + 24;

/// The addresses to which the calls in progress would return: odd, as is every address to go to. What an interrupt has interrupted is
/// the address of an instruction, even.
pub struct CallChain<W> {
    /// Frame of the innermost call, from register 7.
    pub frame: u32,
    /// Where frames can lie.
    pub stack: Range<u32>,
    /// Where calls can come from; what lies elsewhere is left out.
    pub program: Range<u32>,
    /// The word at an address of the stack.
    pub word: W,
}

impl<W: Fn(u32) -> u32> Iterator for CallChain<W> {
    type Item = u32;

    fn next(&mut self) -> Option<u32> {
        loop {
            let frame = self.frame;
            let last = self.stack.end.checked_sub(TO_INTERRUPTED + 4)?;
            if !frame.is_multiple_of(4) || frame < self.stack.start || frame > last {
                return None;
            }
            let (caller, back) = ((self.word)(frame), (self.word)(frame + 4));
            // The stack grows down. What does not lie above is no caller's, and ends the chain next time.
            self.frame = if caller > frame { caller } else { u32::MAX };
            let (told, instruction) = if back >= EXCEPTION_RETURN {
                let interrupted = (self.word)(frame + TO_INTERRUPTED);
                (interrupted, interrupted)
            } else {
                // The call lies before, and may be the last instruction of all.
                (back, (back & !1).wrapping_sub(2))
            };
            if self.program.contains(&instruction) {
                return Some(told);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STACK: Range<u32> = 0x1000_0000..0x1000_0080;
    const PROGRAM: Range<u32> = 0x0800_0200..0x0800_1000;

    /// The chain through a stack with these words at these offsets.
    fn chain(from: u32, words: &[(u32, u32)]) -> Vec<u32> {
        let word = |at: u32| {
            assert!(STACK.contains(&at) && at.is_multiple_of(4), "0x{at:08X} is no word of the stack");
            words.iter().find(|(offset, _)| STACK.start + offset == at).map_or(0, |(_, word)| *word)
        };
        CallChain { frame: from, stack: STACK, program: PROGRAM, word }.collect()
    }

    #[test]
    fn each_frame_leads_to_its_caller_s_and_what_lies_between_does_not_count() {
        let words = [
            (0x00, 0x1000_0018),
            (0x04, 0x0800_0401),
            // Left by a call that has long returned.
            (0x10, 0x0800_0777),
            (0x18, 0x1000_0030),
            // Outside of what is looked at: the machinery of panics.
            (0x1C, 0x0800_2001),
            (0x30, 0),
            // After the last instruction of the program.
            (0x34, 0x0800_1001),
        ];
        assert_eq!(chain(STACK.start, &words), [0x0800_0401, 0x0800_1001]);
    }

    #[test]
    fn a_handler_s_frame_tells_what_it_interrupted() {
        let words = [(0x00, 0x1000_0040), (0x04, 0xFFFF_FFF9), (0x20, 0x0800_0500), (0x40, 0), (0x44, 0x0800_0601)];
        assert_eq!(chain(STACK.start, &words), [0x0800_0500, 0x0800_0601]);
    }

    #[test]
    fn a_stack_that_is_damaged_is_not_left_and_is_followed_no_further() {
        for caller in [0, 1, 0x1000_0002, STACK.start, STACK.end, STACK.end - 4, u32::MAX] {
            assert_eq!(chain(STACK.start, &[(0, caller), (4, 0x0800_0401)]), [0x0800_0401]);
        }
        for from in [0, STACK.start - 4, STACK.start + 1, STACK.end - 4, STACK.end, u32::MAX] {
            assert_eq!(chain(from, &[]), [0; 0]);
        }
    }
}
