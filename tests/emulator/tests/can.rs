//! The controller on a bus that is loaded, disturbed or deserted.

use thud_firmware::board::{BusState, Frame};
use thud_firmware::emergency::Fault;
use thud_sim::bus::Disturbance;
use thud_sim::chain::ChainSettings;

mod lab;
use lab::{Lab, NODE};

#[test]
fn bus_off_ends_by_itself_and_is_told() {
    let mut lab = Lab::new(ChainSettings::quiet());
    lab.run_ms(300);
    let _ = lab.emergencies();
    let bus = lab.emulator().bus().clone();
    bus.disturb(Disturbance::Probability(1.0));
    // The next heartbeat is tried until the transmit error counter passes 255.
    lab.run_ms(700);
    assert!(lab.emulator().chip().can.was_bus_off(), "it never went off");
    bus.disturb(Disturbance::None);
    lab.run_ms(5_000);
    assert!(lab.emergencies().contains(&Fault::BusOff));
    let status = lab.status();
    assert_eq!(status.bus_state, "error active");
    assert!(lab.loss("bus-off") >= 1);
    lab.expect_order(1);
}

#[test]
fn a_receiver_that_hears_errors_becomes_passive_and_active_again() {
    let mut lab = Lab::new(ChainSettings::quiet());
    lab.run_ms(300);
    let _ = lab.emergencies();
    let node = lab.emulator().node();
    let other = lab.emulator().bus().attach_host("other");
    lab.emulator().bus().disturb(Disturbance::Receiver { node, attempts: 20 });
    for _ in 0..20 {
        other.send(&Frame::new(0x700, &[]).unwrap());
        lab.run_ms(2);
    }
    lab.run_ms(300);
    assert!(lab.emergencies().contains(&Fault::BusPassive));
    lab.emulator().bus().disturb(Disturbance::None);
    for _ in 0..200 {
        other.send(&Frame::new(0x700, &[]).unwrap());
        lab.run_ms(2);
    }
    lab.run_ms(300);
    assert_eq!(lab.status().bus_state, "error active");
    lab.expect_order(1);
}

/// The controller holds three frames; the core stands still until five have come.
#[test]
fn frames_that_found_no_room_are_counted_and_told() {
    let mut lab = Lab::new(ChainSettings::quiet());
    lab.run_ms(300);
    let _ = lab.emergencies();
    let other = lab.emulator().bus().attach_host("other");
    lab.emulator_mut().machine_mut().halt_core(700_000_000);
    for number in 0..5 {
        other.send(&Frame::new(0x600 + u16::from(NODE), &[0x80, 0, 0, 0, number, 0, 0, 0]).unwrap());
    }
    lab.run_ms(300);
    assert_eq!(lab.emulator().chip().can.lost(), 2);
    assert!(lab.emergencies().contains(&Fault::ReceiveOverrun));
    assert!(lab.loss("frames not received") >= 1);
    lab.expect_order(1);
}

/// Nobody acknowledges: error passive, never bus-off, and all is well when somebody comes.
#[test]
fn alone_on_the_bus_it_waits_for_company() {
    let image = thud_emulator::image::Image::read(&thud_emulator::image::Image::usual_place()).unwrap();
    let settings = thud_emulator::emulator::Settings::default();
    let mut emulator = thud_emulator::emulator::Emulator::new(&image, &settings, thud_sim::force::Untouched);
    emulator.run_for(embassy_time::Duration::from_millis(600));
    assert_eq!(emulator.chip().can.state(), BusState::ErrorPassive);
    let host = emulator.bus().attach_host("company");
    emulator.run_for(embassy_time::Duration::from_millis(100));
    assert!(host.has_arrivals(), "the frame that waited comes as soon as somebody acknowledges");
    assert_eq!(emulator.chip().violations(), [] as [String; 0]);
}
