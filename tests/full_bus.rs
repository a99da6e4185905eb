//! What a bus does to sensors and sensors to a bus, in virtual time: full load, destroyed frames, bus-off, ten sensors at once,
//! and a recording that is fetched while impacts go on.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

use thud::bus::simulated::SimulatedBus;
use thud::client::Client;
use thud::client::watch::{Happening, SeenEvent, Watch};
use thud_firmware::dictionary::frame::{ALARM_BASE, Part};
use thud_firmware::dictionary::index;
use thud_sim::board::{BoardSettings, commission, firmware};
use thud_sim::bus::bit_stream::INTERMISSION;
use thud_sim::bus::{BitRate, Disturbance, Outcome, Traffic};
use thud_sim::chain::ChainSettings;
use thud_sim::force::Blows;
use thud_sim::world::World;
use virtual_time::{follow, pass};

mod virtual_time;

/// Seconds of a blow.
const BLOW_S: f64 = 0.030;
/// A frame of eight bytes with the most stuff bits that there can be: 8 + 64 data, 39 others, a stuff bit for every four of
/// the 98 that are stuffed (ISO 11898-1).
const LONGEST_FRAME_BITS: u64 = 135;

/// Sensors with the node ids 1 to 10 at most, struck all at once.
struct Lab {
    world: Rc<RefCell<World>>,
    blows: Blows,
}

impl Lab {
    fn new(sensors: u8, seed: u64) -> Self {
        let mut world = World::new(BitRate::MEGABIT, seed);
        let blows = Blows::new();
        for node in 1..=sensors {
            let settings =
                BoardSettings::new(u32::from(node), seed + u64::from(node)).with_chain(ChainSettings::workshop());
            let board = world.add_board(settings, blows.clone(), firmware);
            let mut configuration = thud_firmware::configuration::Configuration::DEFAULT;
            configuration.node.node_id = node;
            commission(world.board(board).flash(), configuration).unwrap();
        }
        Self { world: Rc::new(RefCell::new(world)), blows }
    }

    fn client(&self) -> Client {
        let mut client = Client::new(Box::new(SimulatedBus::new(self.world.clone())));
        pass(&mut client, Duration::from_secs(3));
        client
    }

    /// A blow 10 ms from now.
    fn strike(&self, peak_n: f64) {
        let contact_s = self.world.borrow().now().as_micros() as f64 * 1e-6 + 0.01;
        self.blows.strike(contact_s, BLOW_S, move |since_s| peak_n * (std::f64::consts::PI * since_s / BLOW_S).sin());
    }
}

/// Events by node, each node's in the order in which they were told.
fn events(happenings: &[Happening]) -> BTreeMap<u8, Vec<&SeenEvent>> {
    let mut events = BTreeMap::<u8, Vec<&SeenEvent>>::new();
    for happening in happenings {
        if let Happening::Event(event) = happening {
            events.entry(event.node).or_default().push(event);
        }
    }
    events
}

fn numbers(events: &[&SeenEvent]) -> Vec<u32> {
    let mut numbers: Vec<u32> = events.iter().map(|event| event.number).collect();
    numbers.sort_unstable();
    numbers
}

#[test]
fn ten_sensors_are_one_table_and_tell_every_event() {
    let lab = Lab::new(10, 3);
    let mut client = lab.client();
    let sensors = client.find(None).unwrap();
    assert_eq!(sensors.iter().map(|sensor| sensor.node).collect::<Vec<_>>(), (1..=10).collect::<Vec<_>>());
    let mut watch = Watch::new(&mut client, sensors.clone(), true).unwrap();
    let mut seen = Vec::new();
    for blow in 0..6 {
        lab.strike(60.0 + 20.0 * f64::from(blow));
        seen.extend(follow(&mut watch, &mut client, Duration::from_secs(2)));
    }
    let alarms = seen.iter().filter(|happening| matches!(happening, Happening::Alarm { .. })).count();
    assert_eq!(alarms, 60, "an alarm for each blow on each sensor");
    let events = events(&seen);
    for node in 1..=10 {
        let events = &events[&node];
        assert_eq!(numbers(events), [1, 2, 3, 4, 5, 6], "node {node}");
        for event in events {
            let truth = 60.0 + 20.0 * f64::from(event.number - 1);
            assert!((f64::from(event.peak_n) - truth).abs() < 0.005 * truth + 0.5, "{event:?}");
        }
    }
    assert!(!seen.iter().any(|happening| matches!(happening, Happening::Lost { .. } | Happening::Doubled { .. })));
    for sensor in &sensors {
        let status = client.status(sensor).unwrap();
        assert_eq!((status.node, status.events), (sensor.node, 6));
        assert!(status.losses.iter().all(|loss| loss.count == 0), "{:?}", status.losses);
    }
    assert_eq!(lab.world.borrow().bus().statistics().failures, 0);
}

#[test]
fn at_full_load_the_alarm_waits_for_at_most_one_frame() {
    let lab = Lab::new(1, 5);
    let bus = lab.world.borrow().bus().clone();
    let mut client = lab.client();
    client.nmt(thud::client::Nmt::Start, 1).unwrap();
    pass(&mut client, Duration::from_secs(1));
    // All of them more urgent than events, none more than the alarm; and always one waiting.
    bus.attach_traffic("others", Traffic { identifiers: 0x080..=0x1FF, ..Traffic::with_load(1.0) });
    bus.keep_record();
    let before = bus.statistics();
    let began = lab.world.borrow().now();
    let blows = 40;
    for _ in 0..blows {
        lab.strike(90.0);
        // Not at the same place of a foreign frame every time.
        lab.world.borrow_mut().run_for(embassy_time::Duration::from_micros(1_100_037)).unwrap();
    }
    let load = bus.statistics().load_since(&before, lab.world.borrow().now() - began);
    assert!(load > 0.999, "the bus is busy all the time: {load}");
    let record = bus.take_record();
    let alarms: Vec<_> = record
        .iter()
        .filter(|attempt| attempt.frame.id == ALARM_BASE + 1 && attempt.outcome == Outcome::Sent)
        .collect();
    assert_eq!(alarms.len(), blows);
    let waited: Vec<u64> = alarms.iter().map(|alarm| (alarm.started - alarm.loaded).as_micros()).collect();
    let longest = *waited.iter().max().unwrap();
    println!("alarms waited {} µs on average, {longest} µs at most", waited.iter().sum::<u64>() / waited.len() as u64);
    assert!(longest <= LONGEST_FRAME_BITS + u64::from(INTERMISSION), "{waited:?}");
    assert!(longest > 20, "the test would prove nothing on a free bus");
}

#[test]
fn at_full_load_of_less_urgent_frames_every_event_is_told() {
    let lab = Lab::new(3, 6);
    let mut client = lab.client();
    let sensors = client.find(None).unwrap();
    let mut watch = Watch::new(&mut client, sensors, true).unwrap();
    // Behind everything of a sensor but its heartbeat, which holds a mailbox for ever.
    let others = Traffic { identifiers: 0x680..=0x6CF, ..Traffic::with_load(1.0) };
    lab.world.borrow().bus().attach_traffic("others", others);
    let mut seen = Vec::new();
    for _ in 0..5 {
        lab.strike(90.0);
        seen.extend(follow(&mut watch, &mut client, Duration::from_secs(2)));
    }
    // Heartbeats do not get through, and the tool spends its time with asking why.
    seen.extend(follow(&mut watch, &mut client, Duration::from_secs(20)));
    let events = events(&seen);
    for node in 1..=3 {
        assert_eq!(numbers(&events[&node]), [1, 2, 3, 4, 5], "node {node}");
    }
}

#[test]
fn with_one_frame_in_a_hundred_destroyed_nothing_is_lost_and_nothing_comes_twice() {
    let lab = Lab::new(3, 7);
    let mut client = lab.client();
    let sensors = client.find(None).unwrap();
    let mut watch = Watch::new(&mut client, sensors, true).unwrap();
    let bus = lab.world.borrow().bus().clone();
    bus.disturb(Disturbance::Probability(0.01));
    bus.keep_record();
    let mut seen = Vec::new();
    for _ in 0..20 {
        lab.strike(90.0);
        seen.extend(follow(&mut watch, &mut client, Duration::from_millis(1_500)));
    }
    let events = events(&seen);
    for node in 1..=3 {
        assert_eq!(numbers(&events[&node]), (1..=20).collect::<Vec<_>>(), "node {node}");
    }
    assert!(!seen.iter().any(|happening| matches!(happening, Happening::Lost { .. } | Happening::Malformed { .. })));
    // A curve as well, complete by its CRC.
    let (impact, slot) = *client.stored_curves(2).unwrap().last().unwrap();
    let curve = client.download_curve(2, slot, impact, &mut |_, _| {}).unwrap().unwrap();
    assert_eq!(curve.refetched, 0, "the controller repeats what was destroyed");
    let record = bus.take_record();
    let destroyed = record.iter().filter(|attempt| attempt.outcome != Outcome::Sent).count();
    assert!(destroyed * 200 > record.len(), "{destroyed} of {} were destroyed", record.len());
    // Nor did any frame of an event cross the bus twice.
    let mut sent = BTreeMap::<(u16, [u8; 8]), u32>::new();
    for attempt in record.iter().filter(|attempt| attempt.outcome == Outcome::Sent) {
        if Part::of(attempt.frame.id).is_some() {
            *sent.entry((attempt.frame.id, attempt.frame.data)).or_default() += 1;
        }
    }
    assert_eq!(sent.len(), 3 * 20 * Part::ALL.len());
    assert!(sent.values().all(|times| *times == 1));
}

#[test]
fn bus_off_is_survived_with_every_event_told_once() {
    let lab = Lab::new(2, 8);
    let mut client = lab.client();
    let sensors = client.find(None).unwrap();
    let mut watch = Watch::new(&mut client, sensors, true).unwrap();
    let bus = lab.world.borrow().bus().clone();
    lab.strike(90.0);
    let mut seen = follow(&mut watch, &mut client, Duration::from_secs(2));
    bus.disturb(Disturbance::Probability(1.0));
    lab.strike(80.0);
    lab.world.borrow_mut().run_for(embassy_time::Duration::from_millis(900)).unwrap();
    bus.disturb(Disturbance::None);
    seen.extend(follow(&mut watch, &mut client, Duration::from_secs(4)));
    lab.strike(70.0);
    seen.extend(follow(&mut watch, &mut client, Duration::from_secs(4)));
    let events = events(&seen);
    for node in 1..=2 {
        assert_eq!(numbers(&events[&node]), [1, 2, 3], "node {node}");
        let off: u32 = client.sdo(node).read(index::LOSSES, 8).unwrap();
        assert!(off >= 1, "node {node} was bus-off");
    }
}

#[test]
fn a_curve_comes_whole_and_in_time_while_impacts_go_on() {
    let lab = Lab::new(2, 9);
    let mut client = lab.client();
    let sensors = client.find(None).unwrap();
    let mut watch = Watch::new(&mut client, sensors, true).unwrap();
    lab.strike(90.0);
    let mut seen = follow(&mut watch, &mut client, Duration::from_secs(2));
    let (impact, slot) = client.stored_curves(1).unwrap()[0];
    let bus = lab.world.borrow().bus().clone();
    // Beside 60 % of foreign load the download lasts long enough for whole impacts to fall into it.
    bus.attach_traffic("others", Traffic { identifiers: 0x081..=0x0FF, ..Traffic::with_load(0.6) });
    let (before, began) = (bus.statistics(), client.line().now());
    let mut blows = 0;
    let mut next = began;
    let curve = client
        .download_curve(1, slot, impact, &mut |_, _| {
            let now = Duration::from_micros(lab.world.borrow().now().as_micros());
            if now >= next {
                next = now + Duration::from_millis(700);
                lab.strike(60.0);
                blows += 1;
            }
        })
        .unwrap()
        .unwrap();
    let seconds = (client.line().now() - began).as_secs_f64();
    let after = bus.statistics();
    println!("{} samples in {seconds:.3} s, {} bits on the bus meanwhile", curve.codes.len(), after.bits - before.bits);
    assert_eq!(curve.refetched, 0);
    assert!(curve.codes.len() > 12_000, "the impact has ended before the slot was full: {}", curve.codes.len());
    assert!(seconds / curve.codes.len() as f64 * 14_000.0 < 3.0, "{seconds} s");
    assert!(blows >= 2, "{blows} blows fell into it");
    seen.extend(follow(&mut watch, &mut client, Duration::from_secs(3)));
    let events = events(&seen);
    for node in 1..=2 {
        assert_eq!(numbers(&events[&node]), (1..=1 + blows).collect::<Vec<_>>(), "node {node}");
    }
    // The curves of impacts that ended meanwhile were not kept, and that is counted; nobody read from the other sensor.
    let not_kept: u32 = client.sdo(1).read(index::LOSSES, 7).unwrap();
    let stored = client.stored_curves(1).unwrap().len() as u32;
    assert!(
        not_kept >= 1 && (blows..=1 + blows).contains(&(not_kept + stored)),
        "{not_kept} of {blows}, {stored} stored"
    );
    assert_eq!(client.sdo(2).read::<u32>(index::LOSSES, 7).unwrap(), 0);
}
