//! The sensor at its busiest: armed with a configuration still to be stored, struck, on a bus that others load to 90 %.
//!
//! Sixteen impacts; a thousand are `cargo bench -p thud-emulator --features unicorn`.

mod lab;
mod load_trial;

use thud_emulator::chip::map::CCM_SIZE;
use thud_emulator::stack_depth;

#[test]
fn the_alarm_is_out_within_a_millisecond_no_sample_is_lost_and_flash_waits() {
    let impacts = 16;
    let (outcome, mut lab) = load_trial::run(1, impacts, |_| ());
    println!("{outcome:#?}");
    assert!(load_trial::worst(&outcome.alarms_s) < 1e-3, "{outcome:?}");
    assert!(outcome.load > 0.88, "{outcome:?}");
    assert_eq!(outcome.lost, 0, "{outcome:?}");
    assert!(outcome.due >= impacts / 4, "at too few impacts anything was to be written: {outcome:?}");
    assert_eq!(outcome.disturbed, 0, "flash was changed while an impact was open: {outcome:?}");
    assert_eq!(lab.emulator().chip().flash.interruptible(), 0, "an impact could have opened before an operation began");
    // Of the whole load nothing but the master's frames has come to the processor.
    assert_eq!(outcome.accepted, u64::from(load_trial::FRAMES * impacts), "{outcome:?}");
    assert!(outcome.filtered > 10_000, "{outcome:?}");
    assert!(outcome.stack < CCM_SIZE - stack_depth::RESERVE, "{outcome:?}");
    // A handler, the urgent tasks, a more urgent handler.
    assert!(outcome.nesting >= 2, "{outcome:?}");
    stack_depth::note(outcome.stack).expect("beside the program a file can be written");
    let events = lab.client.logged_events(lab::NODE).expect("the sensor answers");
    assert_eq!(events.last().map(|event| event.impact), Some(impacts));
    lab.expect_order(1);
    assert_eq!(load_trial::stored(&mut lab), impacts, "what was held back was not stored in the end");
    lab.expect_order(2);
}
