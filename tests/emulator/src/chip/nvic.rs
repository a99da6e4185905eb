//! Interrupt controller and system control block, ARMv7-M B3.
//!
//! ```text
//! line of a peripheral ─┐
//! ISPR, STIR ───────────┴▶ pending ─ enabled? ─ more urgent than what is active? ─ not masked? ─▶ taken
//!                              ▲                                                                     │
//!                              └──────── the line is still high when the handler returns ◀───────────┘
//! ```

use super::map::interrupt::COUNT;

/// Priority of thread mode: less urgent than any exception.
const THREAD: i16 = 256;

/// Number of an exception; 16 and more are interrupts.
pub type Exception = usize;

/// The non-maskable interrupt.
pub const NMI: Exception = 2;
/// What every fault becomes, because the others are not enabled.
pub const HARD_FAULT: Exception = 3;
/// First interrupt.
pub const FIRST_INTERRUPT: Exception = 16;

const WORDS: usize = COUNT.div_ceil(32);
/// The G4 has four bits of priority.
const PRIORITY_BITS: u8 = 0xF0;

/// State of the controller.
#[derive(Clone, Debug)]
pub struct Nvic {
    enabled: [u32; WORDS],
    pending: [u32; WORDS],
    lines: [u32; WORDS],
    priority: [u8; COUNT],
    nmi_pending: bool,
    active: Vec<Exception>,
    vector_table: u32,
    shpr: [u8; 12],
    cfsr: u32,
    hfsr: u32,
    cpacr: u32,
    reset_requested: bool,
}

/// What masks exceptions now.
#[derive(Clone, Copy, Debug, Default)]
pub struct Masks {
    /// PRIMASK: all with a priority that can be set.
    pub primask: bool,
    /// FAULTMASK: the hard fault too.
    pub faultmask: bool,
    /// BASEPRI: those of this priority and less urgent ones; 0 is none.
    pub basepri: u8,
}

impl Default for Nvic {
    fn default() -> Self {
        Self {
            enabled: [0; WORDS],
            pending: [0; WORDS],
            lines: [0; WORDS],
            priority: [0; COUNT],
            nmi_pending: false,
            active: Vec::new(),
            vector_table: 0,
            shpr: [0; 12],
            cfsr: 0,
            hfsr: 0,
            cpacr: 0,
            reset_requested: false,
        }
    }
}

impl Nvic {
    /// Sets the level of a peripheral's line.
    pub fn set_line(&mut self, interrupt: usize, high: bool) {
        let (word, bit) = (interrupt / 32, 1 << (interrupt % 32));
        let was_high = self.lines[word] & bit != 0;
        if high {
            self.lines[word] |= bit;
            // A line that stays high while its handler runs pends it again at its end.
            if !was_high || !self.active.contains(&(FIRST_INTERRUPT + interrupt)) {
                self.pending[word] |= bit;
            }
        } else {
            self.lines[word] &= !bit;
        }
    }

    /// Pends the NMI.
    pub fn pend_nmi(&mut self) {
        self.nmi_pending = true;
    }

    fn priority_of(&self, exception: Exception) -> i16 {
        match exception {
            NMI => -2,
            HARD_FAULT => -1,
            4..FIRST_INTERRUPT => i16::from(self.shpr[exception - 4]),
            _ => i16::from(self.priority[exception - FIRST_INTERRUPT]),
        }
    }

    /// Priority that the processor runs at, masks left aside.
    fn running(&self) -> i16 {
        self.active.iter().map(|active| self.priority_of(*active)).min().unwrap_or(THREAD)
    }

    fn most_urgent(&self) -> Option<Exception> {
        if self.nmi_pending {
            return Some(NMI);
        }
        let mut best: Option<(u8, usize)> = None;
        for word in 0..WORDS {
            let mut ready = self.pending[word] & self.enabled[word];
            while ready != 0 {
                let interrupt = word * 32 + ready.trailing_zeros() as usize;
                ready &= ready - 1;
                let candidate = (self.priority[interrupt], interrupt);
                if best.is_none_or(|best| candidate < best) {
                    best = Some(candidate);
                }
            }
        }
        best.map(|(_, interrupt)| FIRST_INTERRUPT + interrupt)
    }

    /// The exception that would interrupt what runs, if nothing masked it.
    #[must_use]
    pub fn preempting(&self) -> Option<Exception> {
        self.most_urgent().filter(|exception| self.priority_of(*exception) < self.running())
    }

    /// Whether masks hold an exception back.
    #[must_use]
    pub fn masked(&self, exception: Exception, masks: Masks) -> bool {
        let priority = self.priority_of(exception);
        let limit = if masks.faultmask {
            -1
        } else if masks.primask {
            0
        } else if masks.basepri & PRIORITY_BITS != 0 {
            i16::from(masks.basepri & PRIORITY_BITS)
        } else {
            THREAD
        };
        priority >= limit
    }

    /// The handler of an exception begins.
    pub fn enter(&mut self, exception: Exception) {
        match exception {
            NMI => self.nmi_pending = false,
            FIRST_INTERRUPT.. => {
                let interrupt = exception - FIRST_INTERRUPT;
                self.pending[interrupt / 32] &= !(1 << (interrupt % 32));
            }
            _ => {}
        }
        self.active.push(exception);
    }

    /// The innermost handler ends.
    pub fn leave(&mut self) {
        if let Some(exception @ FIRST_INTERRUPT..) = self.active.pop() {
            let (word, bit) = ((exception - FIRST_INTERRUPT) / 32, 1 << ((exception - FIRST_INTERRUPT) % 32));
            self.pending[word] |= self.lines[word] & bit;
        }
    }

    /// What runs; 0 is thread mode.
    #[must_use]
    pub fn current(&self) -> Exception {
        self.active.last().copied().unwrap_or(0)
    }

    /// Handlers that are under way.
    #[must_use]
    pub fn depth(&self) -> usize {
        self.active.len()
    }

    /// Whether a fault can still be handled; if not, the processor locks up.
    #[must_use]
    pub fn can_fault(&self) -> bool {
        self.running() > -1
    }

    /// Notes why a hard fault comes, for its handler to read.
    pub fn note_fault(&mut self, cfsr: u32) {
        self.cfsr |= cfsr;
        // FORCED: a fault that could be handled, but is not enabled.
        self.hfsr |= 1 << 30;
    }

    /// Where the handlers' addresses are. The flash also appears at 0.
    #[must_use]
    pub fn vector_table(&self) -> u32 {
        if self.vector_table < super::map::BANK_1 { self.vector_table + super::map::BANK_1 } else { self.vector_table }
    }

    /// Whether software has asked for a reset.
    #[must_use]
    pub fn reset_requested(&self) -> bool {
        self.reset_requested
    }

    /// Priority of an interrupt, 0 to 15.
    #[must_use]
    pub fn priority(&self, interrupt: usize) -> u8 {
        self.priority[interrupt] >> 4
    }

    pub(super) fn read(&self, offset: u32) -> Option<u32> {
        let word = |base: u32| (offset - base) as usize / 4;
        Some(match offset {
            0x100..=0x10F => self.enabled[word(0x100)],
            0x180..=0x18F => self.enabled[word(0x180)],
            0x200..=0x20F => self.pending[word(0x200)],
            0x280..=0x28F => self.pending[word(0x280)],
            0x400..0x468 => {
                let first = (offset - 0x400) as usize;
                (0..4).fold(0, |value, byte| {
                    value | u32::from(*self.priority.get(first + byte).unwrap_or(&0)) << (8 * byte)
                })
            }
            // CPUID: Cortex-M4 r0p1.
            0xD00 => 0x410F_C241,
            0xD04 => self.current() as u32 | self.preempting().map_or(0, |pending| (pending as u32) << 12 | 1 << 22),
            0xD08 => self.vector_table,
            0xD0C => 0xFA05_0000,
            // SCR, CCR with STKALIGN.
            0xD10 => 0,
            0xD14 => 0x200,
            0xD18..=0xD23 => {
                let first = (offset - 0xD18) as usize;
                (0..4).fold(0, |value, byte| value | u32::from(self.shpr[first + byte]) << (8 * byte))
            }
            0xD24 => 0,
            0xD28 => self.cfsr,
            0xD2C => self.hfsr,
            0xD88 => self.cpacr,
            // DHCSR: no debugger. DEMCR.
            0xDF0 | 0xDFC => 0,
            // FPCCR: automatic and lazy saving.
            0xF34 => 0xC000_0000,
            _ => return None,
        })
    }

    /// Whether there is such a register.
    pub(super) fn write(&mut self, offset: u32, value: u32) -> bool {
        let word = |base: u32| (offset - base) as usize / 4;
        match offset {
            0x100..=0x10F => self.enabled[word(0x100)] |= value,
            0x180..=0x18F => self.enabled[word(0x180)] &= !value,
            0x200..=0x20F => self.pending[word(0x200)] |= value,
            0x280..=0x28F => {
                let word = word(0x280);
                self.pending[word] &= !value;
                self.pending[word] |= self.lines[word] & value;
            }
            0x400..0x468 => {
                for (byte, value) in value.to_le_bytes().into_iter().enumerate() {
                    if let Some(priority) = self.priority.get_mut((offset - 0x400) as usize + byte) {
                        *priority = value & PRIORITY_BITS;
                    }
                }
            }
            0xD04 => self.nmi_pending |= value >> 31 != 0,
            0xD08 => self.vector_table = value & !0x1FF,
            0xD0C => self.reset_requested |= value == 0x05FA_0004,
            0xD10 | 0xD14 | 0xD24 | 0xDFC | 0xF34 => {}
            0xD18..=0xD23 => {
                for (byte, value) in value.to_le_bytes().into_iter().enumerate() {
                    self.shpr[(offset - 0xD18) as usize + byte] = value & PRIORITY_BITS;
                }
            }
            0xD28 => self.cfsr &= !value,
            0xD2C => self.hfsr &= !value,
            0xD88 => self.cpacr = value,
            0xF00 => {
                let interrupt = value as usize & 0x1FF;
                if interrupt < COUNT {
                    self.pending[interrupt / 32] |= 1 << (interrupt % 32);
                }
            }
            _ => return false,
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(interrupts: &[(usize, u8)]) -> Nvic {
        let mut nvic = Nvic::default();
        for (interrupt, priority) in interrupts {
            nvic.priority[*interrupt] = priority << 4;
            nvic.enabled[interrupt / 32] |= 1 << (interrupt % 32);
        }
        nvic
    }

    #[test]
    fn the_more_urgent_interrupts_the_less_urgent_and_never_its_equal() {
        let mut nvic = with(&[(11, 1), (21, 2), (22, 2), (100, 4)]);
        nvic.write(0xF00, 100);
        assert_eq!(nvic.preempting(), Some(116));
        nvic.enter(116);
        nvic.set_line(22, true);
        nvic.set_line(21, true);
        assert_eq!(nvic.preempting(), Some(37), "of equals the lower number");
        nvic.enter(37);
        assert_eq!(nvic.preempting(), None);
        nvic.set_line(11, true);
        assert_eq!(nvic.preempting(), Some(27));
    }

    #[test]
    fn a_line_that_stays_high_pends_again_and_one_that_fell_does_not() {
        let mut nvic = with(&[(21, 2)]);
        nvic.set_line(21, true);
        nvic.enter(37);
        nvic.leave();
        assert_eq!(nvic.preempting(), Some(37));
        nvic.enter(37);
        nvic.set_line(21, false);
        nvic.leave();
        assert_eq!(nvic.preempting(), None);
    }

    #[test]
    fn masks_hold_back_what_they_should() {
        let nvic = with(&[(11, 1), (21, 2)]);
        let primask = Masks { primask: true, ..Masks::default() };
        assert!(nvic.masked(27, primask) && !nvic.masked(HARD_FAULT, primask) && !nvic.masked(NMI, primask));
        let basepri = Masks { basepri: 0x20, ..Masks::default() };
        assert!(nvic.masked(37, basepri) && !nvic.masked(27, basepri));
        assert!(!nvic.masked(37, Masks::default()));
    }
}
