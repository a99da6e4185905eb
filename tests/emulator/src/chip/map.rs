//! Where things lie in the STM32G474RE, RM0440 chapters 2 and 3.

/// Bank 1 of the flash: the program.
pub const BANK_1: u32 = 0x0800_0000;
/// Bank 2 of the flash: the storage.
pub const BANK_2: u32 = 0x0804_0000;
/// Bytes in a bank.
pub const BANK: u32 = 256 * 1024;
/// Bytes in a page, in dual-bank mode.
pub const PAGE: u32 = 2048;
/// Core-coupled memory: the stack.
pub const CCM: u32 = 0x1000_0000;
/// Bytes of it.
pub const CCM_SIZE: u32 = 32 * 1024;
/// SRAM1 and SRAM2.
pub const RAM: u32 = 0x2000_0000;
/// Bytes of both.
pub const RAM_SIZE: u32 = 96 * 1024;
/// System memory with the factory's data.
pub const INFORMATION: u32 = 0x1FFF_0000;
/// Bytes of it.
pub const INFORMATION_SIZE: u32 = 0x1_0000;
/// The unique id.
pub const UNIQUE_ID: u32 = 0x1FFF_7590;

pub(super) const TIM6: u32 = 0x4000_1000;
pub(super) const IWDG: u32 = 0x4000_3000;
pub(super) const FDCAN1: u32 = 0x4000_6400;
pub(super) const PWR: u32 = 0x4000_7000;
pub(crate) const MESSAGE_RAM: u32 = 0x4000_A400;
pub(crate) const MESSAGE_RAM_SIZE: u32 = 0x350;
pub(super) const SYSCFG: u32 = 0x4001_0000;
pub(super) const EXTI: u32 = 0x4001_0400;
pub(super) const TIM15: u32 = 0x4001_4000;
pub(super) const DMA1: u32 = 0x4002_0000;
pub(super) const DMA2: u32 = 0x4002_0400;
pub(super) const DMAMUX: u32 = 0x4002_0800;
pub(super) const RCC: u32 = 0x4002_1000;
pub(super) const FLASH: u32 = 0x4002_2000;
pub(super) const GPIOA: u32 = 0x4800_0000;
pub(super) const GPIO_END: u32 = 0x4800_1C00;
pub(super) const ADC1: u32 = 0x5000_0000;
pub(super) const ADC2: u32 = 0x5000_0100;
pub(super) const ADC12_COMMON: u32 = 0x5000_0300;
pub(super) const SYSTEM_CONTROL: u32 = 0xE000_E000;
pub(super) const DBGMCU: u32 = 0xE004_2000;

/// Interrupts, RM0440 table 97.
pub mod interrupt {
    /// Flash.
    pub const FLASH: usize = 4;
    /// DMA1, channel 1.
    pub const DMA1_CHANNEL1: usize = 11;
    /// ADC1 and ADC2.
    pub const ADC1_2: usize = 18;
    /// FDCAN1, line 0.
    pub const FDCAN1_IT0: usize = 21;
    /// FDCAN1, line 1.
    pub const FDCAN1_IT1: usize = 22;
    /// TIM1 break and TIM15.
    pub const TIM15: usize = 24;
    /// TIM6 and DAC underrun.
    pub const TIM6: usize = 54;
    /// How many there are.
    pub const COUNT: usize = 102;
}
