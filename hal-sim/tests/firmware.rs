//! The whole firmware with its tasks on the simulated board: alarm, events, storage, resets, in virtual time.

use embassy_time::{Duration, Instant};
use thud_firmware::board::{Frame, Received, ResetCause};
use thud_firmware::configuration::{Configuration, NodeSettings};
use thud_firmware::dictionary::frame::{ALARM_BASE, Part};
use thud_firmware::limits::Region;
use thud_sim::board::{BoardSettings, commission, firmware};
use thud_sim::bus::{Attempt, BitRate, Disturbance, HostPort, Outcome, Traffic};
use thud_sim::chain::{Cable, ChainSettings, Hum, Spikes};
use thud_sim::force::{Blows, Untouched};
use thud_sim::world::{BoardId, World};

const NODE: u8 = Configuration::DEFAULT.node.node_id;
const ALARM: u16 = ALARM_BASE + NODE as u16;
const HEARTBEAT: u16 = 0x700 + NODE as u16;
const EMERGENCY: u16 = 0x080 + NODE as u16;
const SDO_REQUEST: u16 = 0x600 + NODE as u16;
const SDO_ANSWER: u16 = 0x580 + NODE as u16;

/// The detector has settled by then.
const SETTLED: Duration = Duration::from_secs(6);

/// How long an ordinary blow lasts.
const BLOW_S: f64 = 0.030;

struct Scene {
    world: World,
    host: HostPort,
    blows: Blows,
    board: BoardId,
}

impl Scene {
    fn new(seed: u64, chain: ChainSettings) -> Self {
        let mut world = World::new(BitRate::MEGABIT, seed);
        world.bus().keep_record();
        let host = world.bus().attach_host("host");
        let blows = Blows::new();
        let settings = BoardSettings::new(1, seed).with_chain(chain);
        let board = world.add_board(settings, blows.clone(), firmware);
        Self { world, host, blows, board }
    }

    fn started(seed: u64, chain: ChainSettings) -> Self {
        let mut scene = Self::new(seed, chain);
        scene.world.run_for(Duration::from_millis(10)).unwrap();
        scene.start_node();
        scene.world.run_for(SETTLED).unwrap();
        scene
    }

    fn start_node(&self) {
        self.host.send(&Frame::new(0x000, &[0x01, NODE]).unwrap());
    }

    /// Strikes after this time with a half sine; gives the instant of contact, s.
    fn strike(&self, after: Duration, peak_newton: f64, lasts_s: f64) -> f64 {
        let contact_s = (self.world.now() + after).as_micros() as f64 * 1e-6;
        self.blows
            .strike(contact_s, lasts_s, move |since_s| peak_newton * (std::f64::consts::PI * since_s / lasts_s).sin());
        contact_s
    }

    fn run(&mut self, duration: Duration) -> Vec<Attempt> {
        self.world.run_for(duration).unwrap();
        self.world.bus().take_record()
    }

    /// Answer to an SDO request within 100 ms.
    fn sdo(&mut self, request: [u8; 8]) -> Option<[u8; 8]> {
        while self.host.receive().is_some() {}
        self.host.send(&Frame::new(SDO_REQUEST, &request).unwrap());
        let deadline = self.world.now() + Duration::from_millis(100);
        loop {
            match self.world.run_until_arrival(&self.host, deadline).unwrap()?.received {
                Received::Frame(frame) if frame.id == SDO_ANSWER => return Some(frame.data),
                _ => {}
            }
        }
    }

    fn write_byte(&mut self, index: u16, subindex: u8, value: u8) -> Option<[u8; 8]> {
        let [low, high] = index.to_le_bytes();
        self.sdo([0x2F, low, high, subindex, value, 0, 0, 0])
    }

    fn read_byte(&mut self, index: u16, subindex: u8) -> u8 {
        let [low, high] = index.to_le_bytes();
        let answer = self.sdo([0x40, low, high, subindex, 0, 0, 0, 0]).unwrap();
        assert_eq!(answer[0], 0x4F, "abort {answer:02X?}");
        answer[4]
    }
}

fn sent(record: &[Attempt], id: u16) -> Vec<&Attempt> {
    record.iter().filter(|attempt| attempt.frame.id == id && attempt.outcome == Outcome::Sent).collect()
}

#[test]
fn it_boots_and_its_heart_beats() {
    let mut scene = Scene::new(1, ChainSettings::quiet());
    let record = scene.run(Duration::from_secs(5));
    let beats = sent(&record, HEARTBEAT);
    assert_eq!(beats[0].frame.bytes(), [0], "boot-up");
    assert!(beats[0].ended < Instant::from_millis(10));
    let NodeSettings { heartbeat_ms, .. } = Configuration::DEFAULT.node;
    assert!(beats.len() >= 5_000 / usize::from(heartbeat_ms), "{} beats", beats.len());
    assert_eq!(scene.world.board(scene.board).starts().len(), 1, "the watchdog did not bite");
}

/// From the slowest blow on the softest spring to the hardest, at all phases of sample clock and bus, which others
/// fill.
#[test]
fn the_alarm_is_out_a_millisecond_after_the_force_passes_six_times_the_noise() {
    let mut scene = Scene::started(2, ChainSettings::workshop());
    scene.world.bus().attach_traffic("others", Traffic { identifiers: 0x100..=0x27F, ..Traffic::with_load(1.0) });
    for (peak_newton, lasts_s) in [(12.0, 0.077), (150.0, 0.030), (440.0, 0.019)] {
        for phase in 0..8 {
            let _ = scene.world.bus().take_record();
            let contact_s = scene.strike(Duration::from_micros(100_000 + 37 * phase), peak_newton, lasts_s);
            let record = scene.run(Duration::from_millis(1_500));
            let passed_s = contact_s + lasts_s / std::f64::consts::PI * (6.0 * 0.3 / peak_newton).asin();
            let alarms = sent(&record, ALARM);
            assert_eq!(alarms.len(), 1);
            let out_s = alarms[0].ended.as_micros() as f64 * 1e-6;
            assert!(
                (contact_s..=passed_s + 1e-3).contains(&out_s),
                "{peak_newton} N, phase {phase}: {:.0} µs after the force passed the threshold",
                (out_s - passed_s) * 1e6
            );
            // It waits for at most the frame on the wire: 135 bits and the intermission.
            let waited = alarms[0].started - alarms[0].loaded;
            assert!(waited.as_micros() <= 138, "{waited:?}");
        }
    }
}

#[test]
fn an_event_has_all_its_parts_and_the_peak_that_reached_the_cell() {
    let mut scene = Scene::started(3, ChainSettings::workshop());
    let _ = scene.world.bus().take_record();
    let contact_s = scene.strike(Duration::from_micros(100_017), 150.0, BLOW_S);
    let record = scene.run(Duration::from_secs(3));
    let parts = Part::ALL.map(|part| sent(&record, part.base() + u16::from(NODE)).len());
    assert_eq!(parts, [1; 5]);
    let force = sent(&record, Part::Force.base() + u16::from(NODE))[0].frame.data;
    let raw_peak = f64::from(u16::from_le_bytes([force[4], force[5]])) * 0.1;
    assert!((raw_peak - 150.0).abs() < 1.0, "{raw_peak} N");
    // The contact, on the world's time axis; the sensor has taken off what the anti-alias filter delays.
    let instant = sent(&record, Part::Instant.base() + u16::from(NODE))[0].frame.data;
    let sample = u32::from_le_bytes([instant[4], instant[5], instant[6], instant[7]]);
    let board = scene.world.board(scene.board);
    let sensed_s =
        board.instant_of(u64::from(sample)).as_micros() as f64 * 1e-6 + f64::from(instant[3]) / 256.0 / 20_000.0;
    let error_s = sensed_s - contact_s;
    assert!(error_s.abs() < 50e-6, "{:.0} µs", error_s * 1e6);
}

#[test]
fn the_same_seed_gives_the_same_frames_bit_by_bit() {
    let run = |seed| {
        let chain = ChainSettings {
            spikes: Some(Spikes { rate: thud_firmware::units::Hertz(2.0), height: thud_firmware::units::Newton(20.0) }),
            ..ChainSettings::workshop()
        };
        let mut scene = Scene::started(seed, chain);
        scene.world.bus().disturb(Disturbance::Probability(0.02));
        scene.world.bus().attach_traffic("others", Traffic::with_load(0.4));
        for count in 1..=5 {
            scene.strike(Duration::from_secs(count), 40.0 * count as f64, BLOW_S);
        }
        scene.run(Duration::from_secs(8))
    };
    let first = run(11);
    assert_eq!(sent(&first, ALARM).len(), 5);
    assert_eq!(first, run(11));
    assert_ne!(first, run(12));
}

#[test]
fn a_quiet_minute_on_the_bus_has_no_alarm() {
    let chain = ChainSettings {
        hum: Some(Hum {
            fundamental: thud_firmware::units::Hertz(49.9),
            amplitude: thud_firmware::units::Newton(0.5),
            harmonics: vec![0.2, 0.3],
        }),
        ..ChainSettings::workshop()
    };
    let mut scene = Scene::started(4, chain);
    let record = scene.run(Duration::from_secs(60));
    assert!(sent(&record, ALARM).is_empty());
}

#[test]
fn a_configuration_outlives_the_power() {
    let mut scene = Scene::started(5, ChainSettings::quiet());
    assert_eq!(scene.write_byte(0x2000, 1, Region::Chest as u8).unwrap()[0], 0x80, "armed, it refuses");
    scene.host.send(&Frame::new(0x000, &[0x80, NODE]).unwrap());
    assert_eq!(scene.write_byte(0x2000, 1, Region::Chest as u8).unwrap()[0], 0x60);
    assert_eq!(scene.write_byte(0x2010, 1, 1).unwrap()[0], 0x60);
    scene.run(Duration::from_millis(500));
    scene.world.power_off(scene.board);
    scene.run(Duration::from_millis(100));
    assert_eq!(scene.sdo([0x40, 0x00, 0x20, 1, 0, 0, 0, 0]), None, "nobody answers without power");
    scene.world.power_on(scene.board);
    scene.run(Duration::from_millis(100));
    assert_eq!(scene.read_byte(0x2000, 1), Region::Chest as u8);
}

/// The old configuration or the new one, whichever byte the power goes at, and the board always starts again.
#[test]
fn power_cut_at_any_byte_of_storing_leaves_the_old_configuration_or_the_new() {
    let mut reached_the_end = false;
    let mut outcomes = [0, 0];
    for cut in 0_u64.. {
        let mut scene = Scene::started_briefly(cut);
        for region in [Region::Chest, Region::Hand] {
            if region == Region::Hand {
                scene.world.board(scene.board).flash().cut_power_after(cut);
            }
            scene.write_byte(0x2000, 1, region as u8).unwrap();
            // The answer to `apply` may be cut off by the power.
            let _ = scene.write_byte(0x2010, 1, 1);
            scene.run(Duration::from_millis(300));
        }
        if scene.world.board(scene.board).is_powered() {
            reached_the_end = true;
            break;
        }
        scene.world.power_on(scene.board);
        scene.run(Duration::from_millis(100));
        let region = scene.read_byte(0x2000, 1);
        assert!([Region::Chest as u8, Region::Hand as u8].contains(&region), "cut after {cut} bytes: region {region}");
        assert_eq!(scene.read_byte(0x2012, 1), 0, "cut after {cut} bytes: nobody locked it");
        outcomes[usize::from(region == Region::Hand as u8)] += 1;
    }
    assert!(reached_the_end);
    assert!(outcomes[0] > 8, "{outcomes:?}: the cuts did hit the write");
}

impl Scene {
    /// Without waiting for the detector.
    fn started_briefly(seed: u64) -> Self {
        let mut scene = Self::new(seed, ChainSettings::quiet());
        scene.run(Duration::from_millis(20));
        scene
    }
}

#[test]
fn a_reset_button_starts_it_again() {
    let mut scene = Scene::started(6, ChainSettings::quiet());
    let _ = scene.world.bus().take_record();
    scene.world.reset(scene.board);
    let record = scene.run(Duration::from_millis(100));
    assert_eq!(sent(&record, HEARTBEAT)[0].frame.bytes(), [0], "boot-up");
    assert_eq!(scene.world.board(scene.board).starts()[1].1, ResetCause::Pin);
}

#[test]
fn it_comes_back_from_bus_off_by_itself() {
    let mut scene = Scene::started(7, ChainSettings::quiet());
    scene.world.bus().disturb(Disturbance::Probability(1.0));
    scene.run(Duration::from_secs(2));
    scene.world.bus().disturb(Disturbance::None);
    let record = scene.run(Duration::from_secs(5));
    assert!(!sent(&record, HEARTBEAT).is_empty());
    assert_eq!(scene.world.board(scene.board).starts().len(), 1, "the watchdog did not bite");
}

#[test]
fn lost_samples_are_told() {
    let mut scene = Scene::started(8, ChainSettings::quiet());
    let _ = scene.world.bus().take_record();
    scene.world.board(scene.board).lose_samples(0, 40);
    let record = scene.run(Duration::from_millis(200));
    let emergency = sent(&record, EMERGENCY);
    assert_eq!(emergency.len(), 1, "an EMCY");
}

#[test]
fn when_the_adc_stands_still_the_watchdog_bites_and_the_fault_is_told() {
    let mut scene = Scene::started(12, ChainSettings::quiet());
    let _ = scene.world.bus().take_record();
    scene.world.board(scene.board).hang_adc();
    let hung = scene.world.now();
    let record = scene.run(Duration::from_secs(3));
    let starts = scene.world.board(scene.board).starts();
    assert_eq!(starts.len(), 2);
    assert_eq!(starts[1].1, ResetCause::Watchdog);
    let patience = scene.world.board(scene.board).settings().watchdog_patience;
    assert!((patience..patience + Duration::from_millis(100)).contains(&(starts[1].0 - hung)));
    assert!(!sent(&record, EMERGENCY).is_empty(), "an EMCY");
}

#[test]
fn a_broken_cable_is_told() {
    for cable in [Cable::Open, Cable::Shorted] {
        let mut scene = Scene::started(13, ChainSettings::quiet());
        let _ = scene.world.bus().take_record();
        scene.world.board(scene.board).set_cable(cable);
        let record = scene.run(Duration::from_secs(1));
        assert!(!sent(&record, EMERGENCY).is_empty(), "an EMCY for {cable:?}");
    }
}

#[test]
fn a_reset_over_nmt_starts_the_node_again() {
    let mut scene = Scene::started(10, ChainSettings::quiet());
    let _ = scene.world.bus().take_record();
    scene.host.send(&Frame::new(0x000, &[0x81, NODE]).unwrap());
    let record = scene.run(Duration::from_millis(100));
    assert_eq!(sent(&record, HEARTBEAT)[0].frame.bytes(), [0], "boot-up");
}

/// Ten sensors under their own node ids, all struck at the same instant: every alarm and every event arrives.
#[test]
fn ten_sensors_share_a_bus() {
    let mut world = World::new(BitRate::MEGABIT, 9);
    world.bus().keep_record();
    let host = world.bus().attach_host("host");
    let blows = Blows::new();
    for serial in 1..=10 {
        let settings = BoardSettings::new(serial, u64::from(serial)).with_chain(ChainSettings::workshop());
        let id = world.add_board(settings, blows.clone(), firmware);
        let mut configuration = Configuration::DEFAULT;
        configuration.node.node_id = 0x40 + serial as u8;
        commission(world.board(id).flash(), configuration).unwrap();
    }
    world.run_for(Duration::from_millis(20)).unwrap();
    host.send(&Frame::new(0x000, &[0x01, 0]).unwrap());
    world.run_for(SETTLED).unwrap();
    let _ = world.bus().take_record();
    let contact_s = world.now().as_micros() as f64 * 1e-6 + 0.01;
    blows.strike(contact_s, BLOW_S, move |since_s| 200.0 * (std::f64::consts::PI * since_s / BLOW_S).sin());
    world.run_for(Duration::from_secs(3)).unwrap();
    let record = world.bus().take_record();
    for node in 0x41..=0x4A {
        assert_eq!(sent(&record, ALARM_BASE + node).len(), 1, "alarm of node {node:#x}");
        for part in Part::ALL {
            assert_eq!(sent(&record, part.base() + node).len(), 1, "{part:?} of node {node:#x}");
        }
    }
    assert_eq!(world.bus().statistics().failures, 0);
}

/// Two sensors that nobody has given a node id, switched on together.
#[test]
fn two_sensors_with_one_node_id_are_both_heard() {
    let mut world = World::new(BitRate::MEGABIT, 9);
    world.bus().keep_record();
    let _host = world.bus().attach_host("host");
    let boards = [1, 2].map(|serial| world.add_board(BoardSettings::new(serial, 0), Untouched, firmware));
    world.run_for(Duration::from_secs(2)).unwrap();
    // At the same microsecond they send the same heartbeat, bit by bit: one frame with two senders.
    let record = world.bus().take_record();
    let beats = sent(&record, HEARTBEAT);
    assert!(beats.iter().all(|beat| beat.senders == boards.map(|board| world.board(board).node())));
    // The other one reset, they are apart, and the bus carries both.
    world.run_for(Duration::from_millis(33)).unwrap();
    world.reset(boards[1]);
    let _ = world.bus().take_record();
    world.run_for(Duration::from_secs(2)).unwrap();
    let record = world.bus().take_record();
    for board in boards {
        let node = world.board(board).node();
        assert!(sent(&record, HEARTBEAT).iter().any(|beat| beat.senders == [node]));
    }
}
