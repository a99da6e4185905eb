//! From reset to a node on the bus.

use embassy_time::Instant;
use thud_emulator::chip::map::interrupt;
use thud_emulator::emulator::Start;
use thud_emulator::moment::MICROSECOND;

mod lab;
use lab::{Lab, NODE};
use thud_sim::chain::ChainSettings;

/// The interrupt of the CORDIC, which the firmware uses for its urgent tasks.
const CORDIC: usize = 100;

#[test]
fn the_board_starts_at_its_clocks_and_says_who_it_is() {
    let mut lab = Lab::new(ChainSettings::quiet());
    lab.run_ms(50);
    lab.expect_order(1);
    {
        let emulator = lab.emulator();
        let chip = emulator.chip();
        assert_eq!(chip.rcc.core_hz(), 160_000_000);
        assert_eq!(chip.rcc.fdcan_hz(), Some(80_000_000));
        assert_eq!(chip.can.bit_rate(80_000_000), 1_000_000);
        assert_eq!(chip.sample_period(), 50 * MICROSECOND);
        assert_eq!(chip.watchdog.patience() / 1_000_000 / MICROSECOND, 1, "a second of patience");
        let priority = |interrupt| emulator.machine().priority(interrupt);
        assert_eq!(priority(interrupt::TIM15), 0);
        assert_eq!(priority(interrupt::DMA1_CHANNEL1), 1);
        assert_eq!((priority(interrupt::FDCAN1_IT0), priority(interrupt::FDCAN1_IT1)), (2, 2));
        assert_eq!(priority(CORDIC), 4);
    }
    assert!(lab.logged("started by PowerOn"), "{:#?}", lab.emulator().log());
    let status = lab.status();
    assert_eq!((status.node, status.reset_cause), (NODE, "power"));
    assert_eq!((status.bus_state, status.stored_configuration), ("error active", "default"));
    assert!(status.losses.iter().all(|loss| loss.count == 0), "{:?}", status.losses);
    // CRC-32 of the unique id.
    let id = thud_emulator::emulator::Settings::default().unique_id;
    assert_eq!(status.serial, crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&id));
}

#[test]
fn the_same_board_gives_the_same_frames_at_the_same_microsecond() {
    let frames = || {
        let mut lab = Lab::new(ChainSettings::workshop());
        let bus = lab.emulator().bus().clone();
        bus.keep_record();
        lab.run_ms(700);
        let instructions = lab.emulator().machine().instructions();
        (bus.take_record(), instructions)
    };
    let (first, instructions) = frames();
    assert!(first.len() >= 2, "a boot-up and a heartbeat: {first:?}");
    assert_eq!((first, instructions), frames());
}

#[test]
fn resets_are_told_apart() {
    let mut lab = Lab::new(ChainSettings::quiet());
    lab.run_ms(100);
    lab.emulator_mut().press_reset();
    lab.run_ms(100);
    assert_eq!(lab.status().reset_cause, "pin");
    lab.emulator_mut().brown_out();
    lab.run_ms(100);
    assert_eq!(lab.status().reset_cause, "brown-out");
    lab.client.nmt(thud::client::Nmt::ResetNode, NODE).unwrap();
    lab.run_ms(200);
    lab.emulator_mut().power_off();
    lab.run_ms(10);
    lab.emulator_mut().power_on();
    lab.run_ms(100);
    assert_eq!(lab.status().reset_cause, "power");
    let starts: Vec<Start> = lab.emulator().starts().iter().map(|(_, start)| *start).collect();
    assert_eq!(starts[..3], [Start::Power, Start::Pin, Start::BrownOut]);
    assert_eq!(starts.last(), Some(&Start::Power));
    lab.expect_order(starts.len());
}

/// The crystal is waited for in a loop without end; the watchdog was started before.
#[test]
fn a_dead_crystal_is_bitten_by_the_watchdog() {
    let mut lab = Lab::new(ChainSettings::quiet());
    lab.run_ms(50);
    lab.emulator_mut().chip_mut().set_crystal(false);
    lab.emulator_mut().press_reset();
    lab.run_ms(2_500);
    let starts: Vec<(Instant, Start)> = lab.emulator().starts().to_vec();
    assert_eq!(starts.iter().filter(|(_, start)| *start == Start::Watchdog).count(), 2, "{starts:?}");
    lab.emulator_mut().chip_mut().set_crystal(true);
    lab.run_ms(1_200);
    assert_eq!(lab.status().reset_cause, "watchdog");
    lab.expect_order(5);
}
