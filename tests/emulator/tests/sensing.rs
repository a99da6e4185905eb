//! From a force at the cell to frames on the bus.

use thud::client::Nmt;
use thud_emulator::moment::{MICROSECOND, SECOND};
use thud_firmware::dictionary::frame::{ALARM_BASE, Alarm};
use thud_firmware::emergency::Fault;
use thud_sim::chain::{Cable, ChainSettings};

mod lab;
use lab::{Lab, NODE};

/// Samples a second.
const RATE: f64 = 20_000.0;
const ALARM: u16 = ALARM_BASE + NODE as u16;

#[test]
fn an_impact_is_noticed_measured_and_recorded_to_the_last_code() {
    let mut lab = Lab::quiet();
    lab.client.nmt(Nmt::Start, NODE).unwrap();
    lab.run_ms(20);
    let _ = lab.sent(ALARM);
    let contact_s = lab.now_s() + 0.050_017;
    let impact = lab.strike(contact_s, 0.25);
    lab.run_ms(1_500);

    // Quiet, the threshold is its least value, 0.5 N.
    let passes_s = (0..).map(|step| f64::from(step) * 1e-6).find(|at_s| impact.force_n(*at_s) > 0.5).unwrap();
    let alarms = lab.sent(ALARM);
    assert_eq!(alarms.len(), 1, "{alarms:?}");
    let late_s = alarms[0].0.as_micros() as f64 * 1e-6 - contact_s - passes_s;
    assert!((0.0..1e-3).contains(&late_s), "the alarm was on the bus {late_s} s after the force had passed 0.5 N");
    assert!(Alarm::decode(alarms[0].1.bytes()).is_ok());

    let event = lab.client.logged_blow(NODE, 1).unwrap().expect("the impact is in the log");
    let truth = impact.truth();
    assert!((f64::from(event.raw_peak.0) / truth.peak_n - 1.0).abs() < 0.005, "{event:?}\n{}", truth.peak_n);
    let first_s = lab.emulator().chip().first_sample().unwrap() as f64 / SECOND as f64;
    let sensed_s = first_s + (event.contact_instant.index as f64 + f64::from(event.contact_instant.fraction)) / RATE;
    assert!((sensed_s - contact_s).abs() < 50e-6, "sensed {} µs late", (sensed_s - contact_s) * 1e6);

    let (number, slot) = *lab.client.stored_curves(NODE).unwrap().last().expect("a curve");
    let curve = lab.client.download_curve(NODE, slot, number, &mut |_, _| ()).unwrap().expect("still there");
    assert_eq!((number, curve.refetched), (1, 0));
    assert!(curve.codes.len() > 2_000, "{}", curve.codes.len());
    let converted = lab.emulator_mut().chip_mut().front_end.take_codes();
    let first = curve.first_index as usize;
    assert!(curve.codes == converted[first..first + curve.codes.len()], "the recording is not what the ADC converted");
    for (time_s, force) in curve.times_s().zip(curve.forces()) {
        let true_n = impact.force_n(first_s + time_s - contact_s - 28e-6);
        assert!((f64::from(force.0) - true_n).abs() < 1.0 + 0.02 * true_n, "at {time_s} s: {force:?} for {true_n} N");
    }
    assert_eq!(lab.emulator().chip().lost_samples(), 0);
    lab.expect_order(1);
}

#[test]
fn samples_lost_while_the_core_stands_still_are_counted_and_told() {
    let mut lab = Lab::quiet();
    let _ = lab.emergencies();
    let halted_ms = 5;
    lab.emulator_mut().machine_mut().halt_core(halted_ms * 1_000 * MICROSECOND);
    lab.run_ms(200);
    assert_eq!(lab.loss("overruns"), 1);
    let lost = lab.loss("lost samples");
    // 100 samples came meanwhile, and two halves of eight are kept.
    assert!((80..=112).contains(&lost) && lost.is_multiple_of(8), "{lost}");
    assert_eq!(lab.emergencies(), [Fault::SamplesLost]);
    // After the gap samples are named as before it: an impact's recording still is what was converted.
    lab.settle();
    let contact_s = lab.now_s() + 0.2;
    lab.strike(contact_s, 0.25);
    lab.run_ms(1_500);
    let (number, slot) = *lab.client.stored_curves(NODE).unwrap().last().expect("a curve");
    let curve = lab.client.download_curve(NODE, slot, number, &mut |_, _| ()).unwrap().expect("still there");
    let converted = lab.emulator_mut().chip_mut().front_end.take_codes();
    let first = curve.first_index as usize;
    assert!(curve.codes == converted[first..first + curve.codes.len()], "after a gap the samples are misnamed");
    lab.expect_order(1);
}

#[test]
fn a_broken_cable_is_told_by_the_bias_of_the_second_converter() {
    let mut lab = Lab::new(ChainSettings::quiet());
    lab.run_ms(500);
    assert_eq!(lab.emergencies(), []);
    lab.emulator_mut().chip_mut().front_end.set_cable(Cable::Open);
    lab.run_ms(500);
    assert!(lab.emergencies().contains(&Fault::Bias));
    lab.emulator_mut().chip_mut().front_end.set_cable(Cable::Sound);
    lab.run_ms(3_000);
    assert_eq!(lab.status().error_register, 0);
    lab.expect_order(1);
}
