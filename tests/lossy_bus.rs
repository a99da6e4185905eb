//! The client and the whole firmware in virtual time, with a bus between them that loses and damages frames.

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::rc::Rc;
use std::time::Duration;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use thud::bus::simulated::SimulatedBus;
use thud::bus::{Bus, BusError, Counters, Stamped};
use thud::client::Client;
use thud::client::settings::{Raw, Wanted};
use thud::client::watch::{Happening, SeenEvent, Source, Watch};
use thud::simulated_sensor::{Setup, SimulatedSensor};
use thud_firmware::board::Frame;
use thud_firmware::configuration::Configuration;
use thud_firmware::dictionary::index;
use thud_firmware::event::{Flags, Verdict};
use thud_firmware::limits::Region;
use thud_firmware::units::Kilogram;
use thud_sim::chain::ChainSettings;
use thud_sim::rig::{Approach, Rig};
use virtual_time::{follow, pass};

mod virtual_time;

/// What happens to a frame on its way to the host.
type Fault = Rc<RefCell<dyn FnMut(&mut Frame) -> bool>>;

/// A bus that loses frames (`false`) and damages them.
struct Lossy {
    bus: SimulatedBus,
    fault: Fault,
}

impl Bus for Lossy {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.bus.send(frame)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        let deadline = self.bus.now() + timeout;
        loop {
            let left = deadline.saturating_sub(self.bus.now());
            let Some(mut stamped) = self.bus.receive(left)? else { return Ok(None) };
            if (self.fault.borrow_mut())(&mut stamped.frame) {
                return Ok(Some(stamped));
            }
        }
    }

    fn now(&self) -> Duration {
        self.bus.now()
    }

    fn describe(&self) -> String {
        "a lossy bus".to_owned()
    }

    fn counters(&self) -> Counters {
        self.bus.counters()
    }
}

const NODE: u8 = 32;

fn lab(fault: impl FnMut(&mut Frame) -> bool + 'static) -> (SimulatedSensor, Client) {
    let configuration =
        Configuration { region: Some(Region::Chest), effective_mass: Some(Kilogram(6.0)), ..Configuration::DEFAULT };
    let sensor = SimulatedSensor::new(Setup {
        seed: 1,
        serial: 7,
        configuration,
        chain: ChainSettings::workshop(),
        rig: Rig::impact(25_000.0),
        effects: Vec::new(),
    })
    .unwrap();
    let bus = Lossy { bus: sensor.bus(), fault: Rc::new(RefCell::new(fault)) };
    let mut client = Client::new(Box::new(bus));
    settle(&mut client);
    (sensor, client)
}

/// The sensor settles for about a second after power-up.
fn settle(client: &mut Client) {
    pass(client, Duration::from_secs(2));
}

fn events(happenings: &[Happening]) -> Vec<&SeenEvent> {
    happenings
        .iter()
        .filter_map(|happening| match happening {
            Happening::Event(event) => Some(event.as_ref()),
            _ => None,
        })
        .collect()
}

#[test]
fn with_a_tenth_of_all_frames_lost_every_event_is_told_once() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let loses = Rc::new(Cell::new(false));
    let now_loses = loses.clone();
    let (sensor, mut client) = lab(move |_| !now_loses.get() || rng.random_range(0..10) > 0);
    let sensors = client.find(None).unwrap();
    let mut watch = Watch::new(&mut client, sensors, true).unwrap();
    loses.set(true);
    let mut seen = Vec::new();
    for hit in 0..20 {
        sensor.strike(&Approach::new(0.1 + 0.02 * f64::from(hit), 6.0)).unwrap();
        seen.extend(follow(&mut watch, &mut client, Duration::from_secs(1)));
    }
    seen.extend(follow(&mut watch, &mut client, Duration::from_secs(5)));

    let events = events(&seen);
    let numbers: BTreeSet<u32> = events.iter().map(|event| event.number).collect();
    assert_eq!(events.len(), numbers.len(), "none twice");
    assert_eq!(numbers, (1..=20).collect(), "none missing");
    assert!(events.iter().any(|event| event.source == Source::Log), "some had to be read from the log");
    assert!(!seen.iter().any(|happening| matches!(happening, Happening::Lost { .. })));
    for event in events {
        let truth = (0.1 + 0.02 * f64::from(event.number - 1)) * (25_000.0_f64 * 6.0).sqrt();
        let peak = f64::from(event.peak_n);
        assert!((peak - truth).abs() < 0.005 * truth + 0.6, "event {}: {peak} N, {truth} N", event.number);
    }
}

#[test]
fn events_that_the_log_has_overwritten_are_told_as_lost() {
    let deaf = Rc::new(Cell::new(false));
    let now_deaf = deaf.clone();
    let (sensor, mut client) = lab(move |_| !now_deaf.get());
    let sensors = client.find(None).unwrap();
    let mut watch = Watch::new(&mut client, sensors, true).unwrap();
    deaf.set(true);
    let hits = thud_firmware::shared::EVENTS as u32 + 5;
    for _ in 0..hits {
        sensor.strike(&Approach::new(0.2, 6.0)).unwrap();
        settle(&mut client);
    }
    deaf.set(false);
    let seen = follow(&mut watch, &mut client, Duration::from_secs(10));

    let told: BTreeSet<u32> = events(&seen).iter().map(|event| event.number).collect();
    let lost: BTreeSet<u32> = seen
        .iter()
        .flat_map(|happening| match happening {
            Happening::Lost { numbers, .. } => numbers.clone(),
            _ => Vec::new(),
        })
        .collect();
    assert_eq!(lost, (1..=5).collect());
    assert_eq!(told, (6..=hits).collect());
}

#[test]
fn a_curve_is_the_same_over_a_good_and_over_a_bad_bus() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let bad = Rc::new(Cell::new(false));
    let now_bad = bad.clone();
    let (sensor, mut client) = lab(move |frame| {
        if now_bad.get() {
            // One frame in three hundred gets lost, and one in three thousand comes with another bit.
            if rng.random_range(0..3000) == 0 {
                frame.data[5] ^= 0x04;
            }
            return rng.random_range(0..300) > 0;
        }
        true
    });
    sensor.strike(&Approach::new(0.3, 6.0)).unwrap();
    settle(&mut client);
    let stored = client.stored_curves(NODE).unwrap();
    let (impact, slot) = stored[0];
    let good = client.download_curve(NODE, slot, impact, &mut |_, _| {}).unwrap().unwrap();
    let peak = good.forces().fold(0.0_f32, |peak, force| peak.max(force.0));
    assert!((peak - 116.2).abs() < 2.0, "0.3 √(25 000 · 6) = 116.2 N, not {peak}");

    bad.set(true);
    let mut refetched = 0;
    for _ in 0..5 {
        // Given up after some attempts, it is asked for again; what comes is never another curve.
        let again = loop {
            if let Ok(Some(curve)) = client.download_curve(NODE, slot, impact, &mut |_, _| {}) {
                break curve;
            }
        };
        assert_eq!(again.codes, good.codes);
        refetched += again.refetched;
    }
    assert!(refetched > 0, "nothing was damaged; the test proves nothing");
}

#[test]
fn a_curve_of_0_7_s_takes_less_than_3_s_of_bus_time() {
    let (sensor, mut client) = lab(|_| true);
    sensor.strike(&Approach::new(0.3, 6.0)).unwrap();
    settle(&mut client);
    let (impact, slot) = client.stored_curves(NODE).unwrap()[0];
    let began = client.line().now();
    let curve = client.download_curve(NODE, slot, impact, &mut |_, _| {}).unwrap().unwrap();
    let seconds = (client.line().now() - began).as_secs_f64();
    let per_sample = seconds / curve.codes.len() as f64;
    println!("{} samples in {seconds:.3} s of bus time", curve.codes.len());
    assert!(per_sample * 14_000.0 < 3.0, "{seconds} s for {} samples", curve.codes.len());
}

#[test]
fn a_refusal_by_the_real_firmware_leaves_revision_and_settings_as_they_were() {
    let (_sensor, mut client) = lab(|_| true);
    let before = client.read_configuration(NODE).unwrap();
    let mut wanted = Wanted::default();
    wanted.set("region", Raw::U8(10));
    wanted.set("onset multiple", Raw::F32(2.0));
    let error = client.configure(NODE, &wanted, None).unwrap_err().to_string();
    assert!(
        error.starts_with("onset multiple 2 times the noise is too low: 3 to 50 times the noise is permitted"),
        "{error}"
    );
    assert_eq!(client.read_configuration(NODE).unwrap(), before);
    assert_eq!(client.sdo(NODE).read::<u8>(index::TRANSACTION, 2).unwrap(), 0, "nothing stays staged");
}

#[test]
fn a_mass_that_is_streamed_judges_the_hit_and_a_stale_one_voids_it() {
    let (sensor, mut client) = lab(|_| true);
    let sensors = client.find(None).unwrap();
    let mut watch = Watch::new(&mut client, sensors, true).unwrap();
    let mut seen = Vec::new();
    for sequence in 0..10 {
        client.send_effective_mass(NODE, Kilogram(3.0), sequence).unwrap();
        seen.extend(follow(&mut watch, &mut client, Duration::from_millis(20)));
    }
    sensor.strike(&Approach::new(0.3, 6.0)).unwrap();
    seen.extend(follow(&mut watch, &mut client, Duration::from_secs(2)));
    // Two seconds later the last mass is far older than the permitted 100 ms.
    sensor.strike(&Approach::new(0.3, 6.0)).unwrap();
    seen.extend(follow(&mut watch, &mut client, Duration::from_secs(2)));
    let events = events(&seen);
    assert_eq!(events.len(), 2);
    assert_eq!(events[0].effective_mass_kg, Some(3.0));
    assert!(events[0].effective_mass_age_ms.is_some_and(|age| age <= 50), "{:?}", events[0]);
    assert_eq!(events[0].verdict, Verdict::Pass);
    assert!(events[1].flags.contains(Flags::STALE_MASS), "{:?}", events[1]);
    assert_ne!(events[1].verdict, Verdict::Pass);
}

#[test]
fn the_time_that_is_sent_arrives() {
    let (_sensor, mut client) = lab(|_| true);
    // 2026-11-21 12:00:00 UTC: 15 665 days after 1984-01-01.
    client.set_time(Duration::from_secs(1_795_262_400)).unwrap();
    settle(&mut client);
    assert_eq!(client.sdo(NODE).read::<u32>(index::TIME, 1).unwrap(), 12 * 3_600_000);
    assert_eq!(client.sdo(NODE).read::<u16>(index::TIME, 2).unwrap(), 15_665);
}

#[test]
fn a_sensor_that_falls_silent_is_told_and_so_is_its_return() {
    let (sensor, mut client) = lab(|_| true);
    let sensors = client.find(None).unwrap();
    let mut watch = Watch::new(&mut client, sensors, true).unwrap();
    follow(&mut watch, &mut client, Duration::from_secs(1));
    sensor.world().borrow_mut().power_off(sensor.board());
    let seen = follow(&mut watch, &mut client, Duration::from_secs(4));
    assert!(seen.contains(&Happening::Silent { node: NODE }), "{seen:?}");
    sensor.world().borrow_mut().power_on(sensor.board());
    let seen = follow(&mut watch, &mut client, Duration::from_secs(4));
    assert!(seen.contains(&Happening::Started { node: NODE, serial: 7 }), "{seen:?}");
    // It was started again by us, and its numbers begin at 1.
    sensor.strike(&Approach::new(0.3, 6.0)).unwrap();
    let seen = follow(&mut watch, &mut client, Duration::from_secs(3));
    assert_eq!(events(&seen).iter().map(|event| event.number).collect::<Vec<_>>(), [1]);
}

#[test]
fn a_reset_of_communication_tells_no_event_twice_and_no_second_device() {
    let (sensor, mut client) = lab(|_| true);
    let sensors = client.find(None).unwrap();
    let mut watch = Watch::new(&mut client, sensors, true).unwrap();
    sensor.strike(&Approach::new(0.3, 6.0)).unwrap();
    let mut seen = follow(&mut watch, &mut client, Duration::from_secs(2));
    // Another master on the same bus orders it.
    let mut other = sensor.bus();
    other.send(&Frame::new(0, &[130, NODE]).unwrap()).unwrap();
    seen.extend(follow(&mut watch, &mut client, Duration::from_secs(2)));
    sensor.strike(&Approach::new(0.3, 6.0)).unwrap();
    seen.extend(follow(&mut watch, &mut client, Duration::from_secs(2)));
    assert_eq!(events(&seen).iter().map(|event| event.number).collect::<Vec<_>>(), [1, 2]);
    assert!(!seen.iter().any(|happening| matches!(happening, Happening::Doubled { .. })), "{seen:?}");
}

#[test]
fn a_boot_up_of_somebody_else_under_the_same_id_is_told() {
    let (sensor, mut client) = lab(|_| true);
    let sensors = client.find(None).unwrap();
    let mut watch = Watch::new(&mut client, sensors, true).unwrap();
    let mut other = sensor.bus();
    other.send(&Frame::new(0x700 + u16::from(NODE), &[0]).unwrap()).unwrap();
    let seen = follow(&mut watch, &mut client, Duration::from_secs(2));
    assert!(seen.contains(&Happening::Doubled { node: NODE, serials: vec![7] }), "{seen:?}");
}
