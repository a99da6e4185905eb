//! The sensor at its busiest: impacts, a bus that others load to 90 %, a master that goes on sending configurations.
//!
//! Twelve impacts; a thousand are `cargo bench -p thud-emulator --features unicorn`.

mod lab;
mod load_trial;

/// Stack that must never be used: the CCM less this is the budget.
const RESERVE: u32 = 8 * 1024;

#[test]
fn the_alarm_is_out_within_a_millisecond_and_no_sample_is_lost() {
    let impacts = 12;
    let (outcome, mut lab) = load_trial::run(impacts, |_| ());
    assert!(load_trial::worst(&outcome.alarms_s) < 1e-3, "{outcome:?}");
    assert!(outcome.load > 0.88, "{outcome:?}");
    assert_eq!(outcome.lost_samples, 0, "{outcome:?}");
    // An armed sensor refuses what the master sends, so that nothing is due to be written while an alarm may be.
    assert_eq!(outcome.revision, 0, "no configuration was applied: {outcome:?}");
    assert!(outcome.stack < thud_emulator::chip::map::CCM_SIZE - RESERVE, "{outcome:?}");
    // A handler, the urgent tasks, a more urgent handler.
    assert!(outcome.nesting >= 2, "{outcome:?}");
    let events = lab.client.logged_events(lab::NODE).expect("the sensor answers");
    assert_eq!(events.last().map(|event| event.impact), Some(impacts));
    lab.expect_order(1);
    println!("{outcome:#?}");
}
