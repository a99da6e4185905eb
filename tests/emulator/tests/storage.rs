//! Configuration in the second bank of the flash, over power cycles and power cuts.

use thud::client::settings::{Raw, Wanted};
use thud_sim::chain::ChainSettings;

mod lab;
use lab::{Lab, NODE};

fn stiffness(newton_per_metre: f32) -> Wanted {
    let mut wanted = Wanted::default();
    wanted.set("body stiffness", Raw::F32(newton_per_metre));
    wanted
}

fn power_cycle(lab: &mut Lab) {
    lab.emulator_mut().power_off();
    lab.run_ms(50);
    lab.emulator_mut().power_on();
    lab.run_ms(200);
}

#[test]
fn a_configuration_is_kept_without_power() {
    let mut lab = Lab::new(ChainSettings::quiet());
    lab.run_ms(200);
    let configured = lab.client.configure(NODE, &stiffness(75_000.0), None).unwrap();
    assert!(configured.stored);
    power_cycle(&mut lab);
    let status = lab.status();
    assert_eq!((status.stored_configuration, status.reset_cause), ("stored", "power"));
    let after = lab.client.read_configuration(NODE).unwrap();
    assert_eq!((after.configuration.body_stiffness.0, after.revision), (75_000.0, configured.after.revision));
    assert_eq!(after.hash, configured.after.hash);
    lab.expect_order(2);
}

/// More often than the four pages have room for: a page is erased, which takes 22 ms, while samples go on.
#[test]
fn storing_a_hundred_times_erases_pages_and_loses_no_sample() {
    let mut lab = Lab::new(ChainSettings::quiet());
    lab.run_ms(200);
    for number in 0..100 {
        let configured = lab.client.configure(NODE, &stiffness(20_000.0 + number as f32), None).unwrap();
        assert!(configured.stored, "configuration {number}");
    }
    let wear = lab.emulator().chip().flash.wear();
    assert!(wear.erased >= 1, "{wear:?}");
    assert_eq!(
        lab.emulator().chip().flash.interruptible(),
        0,
        "of {wear:?}: an impact could have opened before it began"
    );
    assert_eq!(lab.emulator().chip().lost_samples(), 0);
    assert_eq!(lab.loss("overruns"), 0);
    lab.expect_order(1);
}

/// At each operation of storing once: the old configuration is there or the new one, and the board starts.
#[test]
fn a_power_cut_in_any_flash_operation_leaves_the_old_or_the_new() {
    let mut lab = Lab::new(ChainSettings::quiet());
    lab.run_ms(200);
    assert!(lab.client.configure(NODE, &stiffness(30_000.0), None).unwrap().stored);
    let before = lab.emulator().chip().flash.wear();
    assert!(lab.client.configure(NODE, &stiffness(31_000.0), None).unwrap().stored);
    let after = lab.emulator().chip().flash.wear();
    let operations = (after.programmed - before.programmed + after.erased - before.erased) as u32;
    assert!((5..200).contains(&operations), "{operations}");

    let (mut old, mut torn) = (31_000.0, 0);
    for operation in 0..operations {
        let new = 40_000.0 + 10.0 * operation as f32;
        lab.emulator_mut().chip_mut().flash.cut_power_after(operation);
        // The answer may come before the power goes, or never.
        let _ = lab.client.configure(NODE, &stiffness(new), None);
        lab.run_ms(100);
        assert!(!lab.emulator().is_powered(), "the power did not go in operation {operation}");
        torn = torn.max(lab.emulator().chip().flash.bank_2.torn());
        lab.emulator_mut().power_on();
        lab.run_ms(200);
        let status = lab.status();
        assert_eq!(status.stored_configuration, "stored", "after a cut in operation {operation}");
        let now = lab.client.read_configuration(NODE).unwrap().configuration.body_stiffness.0;
        assert!(now == old || now == new, "after a cut in operation {operation}: {now}, not {old} or {new}");
        old = now;
    }
    assert!(torn > 0, "words were torn, and reading them is an NMI");
    assert!(lab.client.configure(NODE, &stiffness(12_345.0), None).unwrap().stored);
    lab.expect_order(1 + operations as usize);
}
