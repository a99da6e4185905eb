//! When the program goes wrong: every way ends in a reset, and the next start tells why.

use thud_emulator::emulator::Start;
use thud_emulator::image::Image;
use thud_firmware::emergency::Fault;
use thud_sim::chain::ChainSettings;

mod lab;
use lab::Lab;

fn running() -> Lab {
    let mut lab = Lab::new(ChainSettings::quiet());
    lab.run_ms(300);
    let _ = lab.emergencies();
    lab
}

fn last_start(lab: &Lab) -> Start {
    lab.emulator().starts().last().expect("it has started").1
}

#[test]
fn a_processor_that_hangs_is_bitten_and_the_next_start_says_so() {
    let mut lab = running();
    lab.emulator_mut().machine_mut().hang();
    lab.run_ms(900);
    assert_eq!(lab.emulator().starts().len(), 1, "the watchdog waits a second");
    lab.run_ms(400);
    assert_eq!(last_start(&lab), Start::Watchdog);
    assert_eq!(lab.emergencies(), [Fault::Watchdog]);
    assert_eq!(lab.status().reset_cause, "watchdog");
    lab.expect_order(2);
}

/// The sampler then lives no more, and nobody feeds the watchdog although every other task does live.
#[test]
fn samples_that_stop_coming_are_bitten_by_the_watchdog() {
    let mut lab = running();
    lab.emulator_mut().chip_mut().stop_samples();
    lab.run_ms(1_500);
    assert_eq!(last_start(&lab), Start::Watchdog);
    assert_eq!(lab.emergencies(), [Fault::Watchdog]);
    lab.expect_order(2);
}

#[test]
fn a_panic_leaves_a_record_that_the_next_start_tells() {
    let mut lab = running();
    lab.emulator_mut().chip_mut().fail_dma();
    lab.run_ms(200);
    assert_eq!(last_start(&lab), Start::Software);
    let told = lab.told();
    assert_eq!(told.iter().map(|told| told.code).collect::<Vec<_>>(), [Fault::Panic.code()]);
    // Where: the driver's handler, not the machinery of panics that it called.
    let image = Image::read(&Image::usual_place()).unwrap();
    assert_eq!(image.function_at(told[0].detail - 2), "DMA1_CHANNEL1", "0x{:08X}", told[0].detail);
    assert_eq!(lab.status().reset_cause, "panic");
    let first = format!("before the reset: Panic, detail 0x0; cargo xtask where [0x{:x}", told[0].detail);
    assert!(lab.logged(&first) && lab.logged("DMA: error"), "{:#?}", lab.emulator().log());
    lab.expect_order(2);
    // It is told once.
    lab.emulator_mut().press_reset();
    lab.run_ms(200);
    assert_eq!(lab.emergencies(), []);
    assert_eq!(lab.status().reset_cause, "pin");
}

#[test]
fn a_jump_into_nowhere_is_a_hard_fault_with_its_address() {
    let mut lab = running();
    lab.emulator_mut().machine_mut().jump_to(0x6000_0000);
    lab.run_ms(200);
    assert_eq!(last_start(&lab), Start::Software);
    let told = lab.told();
    assert_eq!(
        told.iter().map(|told| (told.code, told.detail)).collect::<Vec<_>>(),
        [(Fault::Panic.code(), 0x6000_0000)]
    );
    assert!(lab.logged("before the reset: HardFault") && lab.logged("0x60000000"), "{:#?}", lab.emulator().log());
    assert_eq!(lab.emulator().machine().faults().len(), 1);
}

#[test]
fn an_undefined_instruction_is_a_hard_fault_with_its_reason() {
    let image = Image::read(&Image::usual_place()).unwrap();
    // UDF #254, with which the compiler ends what must not be reached.
    let undefined = image.find(0xDEFE).expect("the program has one");
    let mut lab = running();
    lab.emulator_mut().machine_mut().jump_to(undefined);
    lab.run_ms(200);
    assert_eq!(last_start(&lab), Start::Software);
    assert_eq!(lab.told().first().map(|told| told.detail), Some(undefined));
    // CFSR: UNDEFINSTR.
    assert!(lab.logged("before the reset: HardFault, detail 0x10000"), "{:#?}", lab.emulator().log());
}

/// Below the stack there is no memory: nothing else is overwritten, the processor locks up and the watchdog bites.
#[test]
fn an_overflow_of_the_stack_harms_nothing_and_ends_in_a_reset() {
    let mut lab = running();
    lab.emulator_mut().machine_mut().exhaust_stack(16);
    lab.run_ms(1_500);
    assert_eq!(lab.emulator().starts().len(), 2, "{:?}", lab.emulator().starts());
    let told = lab.emergencies();
    assert!(told == [Fault::Panic] || told == [Fault::Watchdog], "{told:?}");
    assert!(!lab.emulator().machine().faults().is_empty());
    lab.run_ms(2_000);
    assert_eq!(lab.emulator().starts().len(), 2);
}
