use thud_firmware::board::{BusState, CanReceive as _, CanSupervise as _, CanTransmit as _, Frame, Received};

use super::bit_stream::{INTERMISSION, wire_bits};
use super::*;

/// Lets the bus run by itself until `until_us`.
fn run(bus: &Bus, until_us: u64) {
    let mut now = bus.now();
    loop {
        bus.advance(now);
        bus.arbitrate(now);
        match bus.next_event() {
            Some(next) if next.as_micros() <= until_us => now = next,
            _ => break,
        }
    }
    bus.advance(Instant::from_micros(until_us));
}

fn frame(id: u16, bytes: &[u8]) -> Frame {
    Frame::new(id, bytes).unwrap()
}

fn bus() -> Bus {
    let bus = Bus::new(BitRate::MEGABIT, 1);
    bus.keep_record();
    bus
}

fn sent(record: &[Attempt]) -> Vec<u16> {
    record.iter().filter(|attempt| attempt.outcome == Outcome::Sent).map(|attempt| attempt.frame.id).collect()
}

fn frames(port: &HostPort) -> Vec<(u64, u16)> {
    std::iter::from_fn(|| port.receive())
        .filter_map(|arrival| match arrival.received {
            Received::Frame(frame) => Some((arrival.at.as_micros(), frame.id)),
            Received::Lost(_) => None,
        })
        .collect()
}

#[test]
fn the_most_urgent_of_all_nodes_goes_first_and_each_is_as_long_as_its_bits() {
    let bus = bus();
    let mut one = bus.attach("one", ControllerSettings::STM32G474);
    let mut other = bus.attach("other", ControllerSettings::STM32G474);
    let host = bus.attach_host("host");
    for id in [0x300, 0x100, 0x7FF] {
        one.load(&frame(id, &[1, 2, 3])).unwrap();
    }
    for id in [0x200, 0x080] {
        other.load(&frame(id, &[0; 8])).unwrap();
    }
    assert_eq!(one.free(), 0);
    assert!(one.load(&frame(1, &[])).is_err(), "nothing is evicted, even by a more urgent frame");
    run(&bus, 10_000);
    let order = [0x080, 0x100, 0x200, 0x300, 0x7FF];
    let record = bus.take_record();
    assert_eq!(sent(&record), order);
    // All join after 11 recessive bits.
    let mut free_at = 11;
    let mut ends = Vec::new();
    for attempt in &record {
        assert_eq!(attempt.started.as_micros(), free_at);
        let end = free_at + u64::from(wire_bits(&attempt.frame));
        assert_eq!(attempt.ended.as_micros(), end);
        ends.push((end, attempt.frame.id));
        free_at = end + u64::from(INTERMISSION);
    }
    assert_eq!(frames(&host), ends);
    assert_eq!(bus.statistics().busy.as_micros(), free_at - 11);
}

#[test]
fn a_frame_on_the_wire_is_not_interrupted() {
    let bus = bus();
    let mut one = bus.attach("one", ControllerSettings::STM32G474);
    let mut other = bus.attach("other", ControllerSettings::STM32G474);
    one.load(&frame(0x7FF, &[0; 8])).unwrap();
    run(&bus, 20);
    other.load(&frame(0x000, &[])).unwrap();
    run(&bus, 1_000);
    assert_eq!(sent(&bus.take_record()), [0x7FF, 0x000]);
}

#[test]
fn bit_rates_scale_time() {
    let bus = Bus::new(BitRate::per_second(125_000).unwrap(), 1);
    bus.keep_record();
    let (one, _other) = (bus.attach_host("one"), bus.attach_host("other"));
    one.send(&frame(0x123, &[1]));
    run(&bus, 10_000);
    let attempt = &bus.take_record()[0];
    assert_eq!((attempt.ended - attempt.started).as_micros(), 8 * u64::from(wire_bits(&attempt.frame)));
    assert_eq!(BitRate::per_second(800_000), Err(NoSuchBitRate(800_000)));
}

#[test]
fn a_disturbed_frame_is_sent_again_and_counted_by_all() {
    let bus = bus();
    let mut sensor = bus.attach("sensor", ControllerSettings::STM32G474);
    let host = bus.attach_host("host");
    bus.disturb(Disturbance::Next(3));
    sensor.load(&frame(0x181, &[0xAA; 8])).unwrap();
    run(&bus, 2_000);
    let record = bus.take_record();
    assert_eq!(record.iter().filter(|attempt| attempt.outcome == Outcome::Disturbed).count(), 3);
    assert_eq!(sent(&record), [0x181]);
    assert_eq!(frames(&host).len(), 1, "nobody gets it twice");
    assert_eq!(sensor.status().transmit_errors, 3 * 8 - 1);
    assert_eq!(host.status().receive_errors, 3 - 1);
    for pair in record.windows(2) {
        assert_eq!((pair[1].started - pair[0].ended).as_micros(), u64::from(INTERMISSION));
    }
    // Error flags of all together are 6 to 12 bits, the delimiter has 8.
    for attempt in record.iter().filter(|attempt| attempt.outcome == Outcome::Disturbed) {
        assert!((15 + 1 + 6 + 8..=122 + 12 + 8).contains(&attempt.bits), "{attempt:?}");
    }
}

#[test]
fn the_chosen_attempt_is_disturbed() {
    let bus = bus();
    let (one, _other) = (bus.attach_host("one"), bus.attach_host("other"));
    bus.disturb(Disturbance::After(2));
    (0..4).for_each(|count| one.send(&frame(0x100 + count, &[])));
    run(&bus, 10_000);
    let outcomes: Vec<_> = bus.take_record().iter().map(|attempt| attempt.outcome).collect();
    assert_eq!(outcomes, [Outcome::Sent, Outcome::Sent, Outcome::Disturbed, Outcome::Sent, Outcome::Sent]);
}

#[test]
fn bus_off_after_32_failures_and_back_after_128_times_11_bits() {
    let bus = bus();
    let mut sensor = bus.attach("sensor", ControllerSettings::STM32G474);
    let host = bus.attach_host("host");
    bus.disturb(Disturbance::Probability(1.0));
    sensor.load(&frame(0x181, &[1])).unwrap();
    run(&bus, 100_000);
    let record = bus.take_record();
    assert_eq!(record.len(), 32);
    assert_eq!(sensor.status().state, BusState::BusOff);
    // From the 16th failure on it is passive and waits 8 bits more after the intermission.
    let pauses: Vec<_> = record.windows(2).map(|pair| (pair[1].started - pair[0].ended).as_micros()).collect();
    assert_eq!(pauses[..15], [3; 15]);
    assert_eq!(pauses[15..], [11; 16]);

    // It does not come back by itself.
    bus.disturb(Disturbance::None);
    run(&bus, 1_000_000);
    assert_eq!(sensor.status().state, BusState::BusOff);
    sensor.recover();
    run(&bus, 1_000_000 + 128 * 11 - 1);
    assert_eq!(sensor.status().state, BusState::BusOff);
    run(&bus, 1_002_000);
    assert_eq!(sensor.status().state, BusState::ErrorActive);
    assert_eq!(sensor.status().transmit_errors, 0);
    let again = bus.take_record();
    assert_eq!(again[0].started.as_micros(), 1_000_000 + 128 * 11, "what waited goes out in the first free bit");
    assert_eq!(frames(&host).len(), 1);
}

#[test]
fn on_a_busy_bus_recovery_counts_one_sequence_per_frame() {
    let bus = bus();
    let mut sensor = bus.attach("sensor", ControllerSettings::STM32G474);
    let _host = bus.attach_host("host");
    bus.disturb(Disturbance::Probability(1.0));
    sensor.load(&frame(0x181, &[1])).unwrap();
    run(&bus, 100_000);
    bus.disturb(Disturbance::None);
    bus.attach_traffic("others", Traffic::with_load(1.0));
    run(&bus, 110_000);
    sensor.recover();
    let _ = bus.take_record();
    run(&bus, 200_000);
    let record = bus.take_record();
    let first_own = record.iter().position(|attempt| attempt.senders == [sensor.number()]).unwrap();
    // Each frame's tail and intermission are exactly 11 recessive bits; the frame that was on the wire when recovery
    // was asked for gives the first of them.
    assert_eq!(first_own, 128);
}

#[test]
fn alone_on_the_bus_nobody_acknowledges_and_it_goes_on_trying() {
    let bus = bus();
    let mut sensor = bus.attach("sensor", ControllerSettings::STM32G474);
    sensor.load(&frame(0x701, &[0])).unwrap();
    run(&bus, 50_000);
    assert_eq!(sensor.status().state, BusState::ErrorPassive);
    assert_eq!(sensor.status().transmit_errors, 128);
    assert!(bus.take_record().iter().all(|attempt| attempt.outcome == Outcome::NotAcknowledged));
    let host = bus.attach_host("host");
    run(&bus, 60_000);
    assert_eq!(frames(&host).len(), 1);
    assert_eq!(sensor.free(), 3);
}

#[test]
fn two_nodes_with_one_identifier_and_different_data_destroy_each_other() {
    let bus = bus();
    let mut one = bus.attach("one", ControllerSettings::STM32G474);
    let mut other = bus.attach("other", ControllerSettings::STM32G474);
    let host = bus.attach_host("host");
    one.load(&frame(0x701, &[5])).unwrap();
    other.load(&frame(0x701, &[4])).unwrap();
    run(&bus, 100_000);
    assert_eq!(one.status().state, BusState::BusOff);
    assert_eq!(other.status().state, BusState::BusOff);
    let record = bus.take_record();
    assert!(record.iter().all(|attempt| attempt.outcome == Outcome::Collided && attempt.senders == [0, 1]));
    assert_eq!(frames(&host), []);
}

#[test]
fn two_nodes_that_send_the_same_bits_send_one_frame() {
    let bus = bus();
    let mut one = bus.attach("one", ControllerSettings::STM32G474);
    let mut other = bus.attach("other", ControllerSettings::STM32G474);
    let host = bus.attach_host("host");
    one.load(&frame(0x701, &[5])).unwrap();
    other.load(&frame(0x701, &[5])).unwrap();
    run(&bus, 1_000);
    assert_eq!(frames(&host).len(), 1);
    assert_eq!((one.free(), other.free()), (3, 3));
}

#[test]
fn a_receiver_that_misreads_stops_the_frame_while_it_is_active() {
    let bus = bus();
    let mut sensor = bus.attach("sensor", ControllerSettings::STM32G474);
    let host = bus.attach_host("host");
    let deaf = bus.attach_host("deaf");
    bus.disturb(Disturbance::Receiver { node: deaf.number(), attempts: 1 });
    sensor.load(&frame(0x181, &[1])).unwrap();
    run(&bus, 1_000);
    assert_eq!(sensor.status().transmit_errors, 7);
    assert_eq!(deaf.status().receive_errors, 8);
    assert_eq!((frames(&host).len(), frames(&deaf).len()), (1, 1));
    // Sixteen in a row make it passive: from then on the frame goes through, past its ears.
    bus.disturb(Disturbance::Receiver { node: deaf.number(), attempts: 100 });
    sensor.load(&frame(0x182, &[1])).unwrap();
    run(&bus, 10_000);
    assert_eq!(deaf.status().state, BusState::ErrorPassive);
    assert_eq!((frames(&host).len(), frames(&deaf).len()), (1, 0));
}

#[test]
fn a_sender_that_dies_in_the_middle_leaves_an_error_frame_and_the_bus_goes_on() {
    let bus = bus();
    let mut dying = bus.attach("dying", ControllerSettings::STM32G474);
    let sensor = bus.attach_host("sensor");
    let host = bus.attach_host("host");
    dying.load(&frame(0x001, &[0; 8])).unwrap();
    run(&bus, 50);
    dying.connect(false);
    sensor.send(&frame(0x181, &[]));
    run(&bus, 1_000);
    let record = bus.take_record();
    assert_eq!(record[0].outcome, Outcome::Cut);
    assert_eq!(sent(&record), [0x181]);
    assert_eq!(frames(&host).iter().map(|(_, id)| *id).collect::<Vec<_>>(), [0x181]);
}

#[test]
fn what_the_receive_buffer_cannot_hold_is_counted_at_its_place() {
    let bus = bus();
    let mut sensor = bus.attach("sensor", ControllerSettings::STM32G474);
    let host = bus.attach_host("host");
    (0..8).for_each(|count| host.send(&frame(0x600 + count, &[])));
    run(&bus, 10_000);
    assert_eq!(bus.statistics().lost, 5);
    let received: Vec<_> = (0..4).map(|_| embassy_futures::block_on(sensor.receive())).collect();
    let stored = [0x600, 0x601, 0x602].map(|id| Received::Frame(frame(id, &[])));
    assert_eq!(received[..3], stored);
    assert_eq!(received[3], Received::Lost(5));
    host.send(&frame(0x610, &[]));
    run(&bus, 20_000);
    assert_eq!(embassy_futures::block_on(sensor.receive()), Received::Frame(frame(0x610, &[])));
}

#[test]
fn traffic_loads_the_bus_as_asked_and_a_full_bus_has_no_gap() {
    for load in [0.2, 0.7] {
        let bus = bus();
        let _host = bus.attach_host("host");
        bus.attach_traffic("others", Traffic::with_load(load));
        run(&bus, 4_000_000);
        let measured = bus.statistics().load_since(&Statistics::default(), embassy_time::Duration::from_secs(4));
        // 20 % of 4 s are about 6000 frames at random instants: a standard deviation of 1.3 %.
        assert!((measured / load - 1.0).abs() < 0.06, "{measured} for {load}");
    }
    let bus = bus();
    let _host = bus.attach_host("host");
    bus.attach_traffic("others", Traffic::with_load(1.0));
    run(&bus, 100_000);
    for pair in bus.take_record().windows(2) {
        assert_eq!((pair[1].started - pair[0].ended).as_micros(), u64::from(INTERMISSION));
    }
}

#[test]
fn the_same_seed_disturbs_the_same_bits() {
    let record = |seed| {
        let bus = Bus::new(BitRate::MEGABIT, seed);
        bus.keep_record();
        let _host = bus.attach_host("host");
        bus.attach_traffic("others", Traffic { load: 0.5, identifiers: 0..=0x7FF, lengths: 0..=8 });
        bus.disturb(Disturbance::Probability(0.1));
        run(&bus, 200_000);
        bus.take_record()
    };
    assert_eq!(record(7), record(7));
    assert_ne!(record(7), record(8));
}
