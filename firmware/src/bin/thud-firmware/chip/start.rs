//! From reset to running tasks.

use defmt::error;
use embassy_executor::Spawner;
use embassy_stm32::flash::Flash;
use thud_firmware::capture::CAPTURE;
use thud_firmware::shared::Shared;
use thud_firmware::storage::Store;
use thud_firmware::tasks;

use super::can::{self, Mailbox, Supervision, Transmission};
use super::flash::BankTwo;
use super::samples::{AdcSamples, Wiring};
use super::watchdog::BoardWatchdog;
use super::{clocks, identity, log, memory, urgent};

type Shares = &'static Shared<CAPTURE>;

/// Of each task there is one, and it is started once.
const ONE: &str = "a task was started twice";

#[embassy_executor::main]
async fn main(thread: Spawner) {
    let watchdog = BoardWatchdog::unleash();
    let identity = identity::read();
    clocks::boost_core_voltage();
    let chip = embassy_stm32::init(clocks::config());
    // Not before: the log reads the time.
    if let Some((end, detail, addresses)) = memory::kept().kept() {
        error!("before the reset: {}, detail {=u32:#x}; cargo xtask where {=[?]:#x}", end, detail, addresses);
    }
    memory::kept().forget();

    let flash = BankTwo::new(Flash::new_blocking(chip.FLASH));
    let whole = flash.whole();
    let mut store = Store::new(flash, whole);
    let loaded = store.load().await;
    let shared: Shares = memory::SHARED.init_with(|| Shared::new(identity, loaded, &memory::CAPTURES));
    log::start(shared);

    let (transmit, receive, supervise) = can::start(chip.FDCAN1, chip.PA11, chip.PA12);
    let samples = AdcSamples::start(Wiring {
        timer: chip.TIM6,
        force_adc: chip.ADC1,
        force: chip.PA0,
        dma: chip.DMA1_CH1,
        bias_adc: chip.ADC2,
        bias: chip.PA1,
    });

    let urgent = urgent::executor();
    urgent.spawn(sampler(samples, shared).expect(ONE));
    urgent.spawn(transmitter(transmit, shared).expect(ONE));
    urgent.spawn(reception(receive, shared).expect(ONE));

    thread.spawn(node(shared).expect(ONE));
    thread.spawn(evaluator(shared).expect(ONE));
    thread.spawn(storage(store, shared).expect(ONE));
    thread.spawn(supervisor(supervise, watchdog, shared).expect(ONE));
    thread.spawn(logger(shared).expect(ONE));
}

#[embassy_executor::task]
async fn sampler(samples: AdcSamples, shared: Shares) -> ! {
    tasks::sampler::run(samples, shared).await
}

#[embassy_executor::task]
async fn transmitter(can: Transmission, shared: Shares) -> ! {
    tasks::transmit::run(can, shared).await
}

#[embassy_executor::task]
async fn reception(can: embassy_stm32::can::CanRx<'static>, shared: Shares) -> ! {
    can::reception(can, shared).await
}

#[embassy_executor::task]
async fn node(shared: Shares) -> ! {
    tasks::node::run(Mailbox, shared).await
}

#[embassy_executor::task]
async fn evaluator(shared: Shares) -> ! {
    tasks::evaluator::run(shared).await
}

#[embassy_executor::task]
async fn storage(store: Store<BankTwo>, shared: Shares) -> ! {
    tasks::storage::run(store, shared).await
}

#[embassy_executor::task]
async fn supervisor(can: Supervision, watchdog: BoardWatchdog, shared: Shares) -> ! {
    tasks::supervisor::run(can, watchdog, shared).await
}

#[embassy_executor::task]
async fn logger(shared: Shares) -> ! {
    log::run(shared).await
}
