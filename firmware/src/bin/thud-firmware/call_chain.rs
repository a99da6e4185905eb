//! Who had called whom, read off the stack without debug information.
//!
//! ```text
//! stack pointer ▶ │ saved register   │
//!                 │ return address   │  odd, within the program, and the instruction before it is a call
//!                 │ local variable   │
//!                 │ return address   │
//! ```
//!
//! Rust keeps no frame pointers here, so every word of the stack is looked at. A word that a function has left there and nobody
//! has overwritten may pass for a call that has long returned: the chain may name too many, never too few.

use core::ops::Range;

/// Whether a word is the address to which a call would return. `code` gives the half-word at an address of the program.
pub fn is_return_address(word: u32, program: &Range<u32>, code: impl Fn(u32) -> u16) -> bool {
    // Thumb: bit 0 is set in an address to go to.
    let after = word & !1;
    if word & 1 == 0 || after < program.start + 4 || after >= program.end {
        return false;
    }
    // ARMv7-M ARM, A7.7.18 and A7.7.19: BL is 11110S… 11.1.…, BLX Rm is 010001111 Rm 000.
    let (first, second) = (code(after - 4), code(after - 2));
    (first & 0xF800 == 0xF000 && second & 0xD000 == 0xD000) || second & 0xFF87 == 0x4780
}

#[cfg(test)]
mod tests {
    use super::*;

    /// push; bl (two half-words); movs; blx r3; b; and its length.
    const CODE: [u16; 6] = [0xB580, 0xF7FF, 0xFFFE, 0x2000, 0x4798, 0xE7FE];
    const START: u32 = 0x0800_0200;

    fn returns_to(word: u32) -> bool {
        let program = START..START + 2 * CODE.len() as u32;
        is_return_address(word, &program, |at| CODE[((at - START) / 2) as usize])
    }

    #[test]
    fn only_what_follows_a_call_is_a_return_address() {
        let found: Vec<u32> = (START - 8..START + 32).filter(|word| returns_to(*word)).collect();
        assert_eq!(found, [START + 6 + 1, START + 10 + 1]);
    }

    #[test]
    fn what_lies_elsewhere_is_never_looked_up() {
        for word in [0, 1, 3, u32::MAX, 0x2000_0001, 0x1000_7FFF] {
            assert!(!returns_to(word));
        }
    }
}
