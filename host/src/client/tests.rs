//! The client against the firmware's own SDO server, with frames lost and damaged on the way.

use std::time::Duration;

use miette::Diagnostic as _;
use proptest::prelude::*;
use rand::SeedableRng as _;
use thud_firmware::board::Frame;
use thud_firmware::dictionary::index;

use super::sdo::SdoError;
use super::served::{ServedBus, Table};
use super::{Client, ClientError};

const NODE: u8 = 32;
const LONG: u16 = 0x5000;

fn client(bus: ServedBus) -> Client {
    Client::new(Box::new(bus))
}

fn pattern(length: usize) -> Vec<u8> {
    (0..length).map(|at| (at * 7 + at / 251) as u8).collect()
}

fn with_long(length: usize) -> ServedBus {
    let mut table = Table::of(7);
    table.put(LONG, 1, &pattern(length));
    ServedBus::new(vec![(NODE, table)])
}

#[test]
fn objects_of_every_length_come_whole_in_segments_and_in_blocks() {
    // Around a segment (7), the server's copied values (128) and a block (889).
    for length in [0, 1, 4, 5, 6, 7, 8, 13, 14, 128, 129, 882, 888, 889, 890, 1778, 28_000] {
        let mut client = client(with_long(length));
        assert_eq!(client.sdo(NODE).upload(LONG, 1).unwrap(), pattern(length), "{length} in segments");
        if length > 0 {
            let mut heard = 0;
            let bytes = client.sdo(NODE).upload_blocks(LONG, 1, &mut |come| heard = come).unwrap();
            assert_eq!(bytes, pattern(length), "{length} in blocks");
            assert!((length..length + 7).contains(&heard), "{heard} bytes were told of {length}");
        }
    }
}

#[test]
fn what_is_written_is_read_again() {
    let mut client = client(with_long(1));
    for length in [1, 4, 5, 7, 8, 14, 100] {
        client.sdo(NODE).download(LONG, 1, &pattern(length)).unwrap();
        assert_eq!(client.sdo(NODE).upload(LONG, 1).unwrap(), pattern(length));
    }
}

#[test]
fn a_refusal_carries_its_code_and_a_wrong_type_its_size() {
    let mut client = client(with_long(3));
    let error = client.sdo(NODE).read::<u32>(0x6000, 0).unwrap_err();
    assert_eq!(error.abort_code(), Some(0x0602_0000));
    assert!(error.to_string().contains("0x6000:0: there is no such object"), "{error}");
    let error = client.sdo(NODE).read::<u32>(LONG, 1).unwrap_err();
    assert!(matches!(error, SdoError::Size { expected: 4, found: 3, .. }), "{error}");
}

#[test]
fn a_missing_segment_is_asked_for_again_within_the_transfer() {
    let mut lost = 0;
    let mut number = 0;
    // Two segments of the first block and the last of a later one.
    let bus = with_long(5_000).with(move |frame| {
        number += u32::from(frame.id > 0x580 && frame.id < 0x600);
        let lose = frame.id < 0x600 && [12, 40, 250].contains(&number) && lost < 3;
        lost += u32::from(lose);
        !lose
    });
    let mut client = client(bus);
    let sent_before = client.counters().sent;
    assert_eq!(client.sdo(NODE).upload_blocks(LONG, 1, &mut |_| {}).unwrap(), pattern(5_000));
    assert!(client.counters().sent - sent_before > 8, "some block was confirmed only in part");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever gets lost: the object comes whole or not at all, and the next transfer works.
    #[test]
    fn losses_never_change_what_is_read(seed: u64, length in 1_usize..4_000, percent in 0_u32..10) {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut left = 200;
        let bus = with_long(length).with(move |_| {
            left -= i32::from(left > 0);
            left == 0 || rng.random_range(0..100) >= percent
        });
        let mut client = client(bus);
        for _ in 0..20 {
            if let Ok(bytes) = client.sdo(NODE).upload_blocks(LONG, 1, &mut |_| {}) {
                prop_assert_eq!(bytes, pattern(length));
            }
            if let Ok(bytes) = client.sdo(NODE).upload(LONG, 1) {
                prop_assert_eq!(bytes, pattern(length));
            }
        }
        prop_assert_eq!(client.sdo(NODE).upload(LONG, 1).unwrap(), pattern(length));
    }
}

#[test]
fn events_that_arrive_during_a_transfer_are_kept_in_order() {
    let mut bus = with_long(5_000);
    for number in 0..10 {
        bus.hear(Frame::new(0x2A0, &[number]).unwrap());
    }
    let mut client = client(bus);
    client.sdo(NODE).upload_blocks(LONG, 1, &mut |_| {}).unwrap();
    for number in 0..10 {
        let stamped = client.line().next(Duration::ZERO).unwrap().unwrap();
        assert_eq!(stamped.frame.bytes(), [number]);
    }
}

#[test]
fn nobody_is_said_within_two_seconds_with_what_was_tried() {
    for asked in [None, Some(5)] {
        let mut client = client(ServedBus::new(vec![]));
        let error = client.find(asked).unwrap_err();
        assert!(client.line().now() < Duration::from_secs(2));
        assert_eq!(error.to_string(), "no sensor answers on toy bus");
        let help = error.help().unwrap().to_string();
        let ids = if asked.is_some() { "node id 5" } else { "node ids 1 to 127" };
        assert!(
            help.contains(ids) && help.contains("nothing at all was heard") && help.contains("thud sensor"),
            "{help}"
        );
    }
}

#[test]
fn all_sensors_are_found_and_other_devices_are_not() {
    let mut other = Table::of(9);
    other.put(index::IDENTITY, 2, &1_u32.to_le_bytes());
    let nodes = vec![(1, Table::of(11)), (50, other), (127, Table::of(13))];
    let mut client = client(ServedBus::new(nodes));
    let found: Vec<_> = client.find(None).unwrap().iter().map(|sensor| (sensor.node, sensor.serial)).collect();
    assert_eq!(found, [(1, 11), (127, 13)]);
    assert!(matches!(client.the_sensor(None), Err(ClientError::Several { nodes }) if nodes == [1, 127]));
    assert_eq!(client.the_sensor(Some(127)).unwrap().serial, 13);
    let error = client.find(Some(50)).unwrap_err();
    assert!(error.help().unwrap().to_string().contains("node 50 answered, but is another kind of device"));
}

#[test]
fn two_sensors_with_one_id_are_said_with_their_serial_numbers() {
    for (one, other) in [(11, 12), (11, 11)] {
        let mut client = client(ServedBus::new(vec![(NODE, Table::of(one)), (NODE, Table::of(other))]));
        let error = client.find(None).unwrap_err();
        assert_eq!(error.to_string(), format!("2 devices answer as node 32 (serial numbers {one}, {other})"));
    }
}

/// `thud status` while `thud monitor` looks for sensors: each hears the answers to the other.
#[test]
fn another_tool_that_looks_for_sensors_makes_no_double_of_one() {
    let sensors = |serials: &[u32]| serials.iter().map(|serial| (NODE, Table::of(*serial))).collect::<Vec<_>>();
    let found = client(ServedBus::new(sensors(&[11])).echoed()).find(None).unwrap();
    assert_eq!(found.iter().map(|sensor| (sensor.node, sensor.serial)).collect::<Vec<_>>(), [(NODE, 11)]);
    // Its question went by before this one listened: asked again, the sensor answers once.
    let mut bus = ServedBus::new(sensors(&[11]));
    bus.owe(Frame::new(0x5A0, &[0x43, 0x18, 0x10, 4, 11, 0, 0, 0]).unwrap());
    assert_eq!(client(bus).find(None).unwrap().len(), 1);
    // More answers than questions, or two serial numbers: there are two.
    for serials in [[11, 11], [11, 12]] {
        let error = client(ServedBus::new(sensors(&serials)).echoed()).find(None).unwrap_err();
        assert!(error.to_string().contains("devices answer as node 32"), "{error}");
    }
}

#[test]
fn an_answer_that_nobody_asked_for_betrays_a_second_device() {
    let nodes = vec![(NODE, Table::of(11)), (NODE, Table::of(12))];
    let mut client = client(ServedBus::new(nodes));
    client.sdo(NODE).read::<u32>(index::IDENTITY, 4).unwrap();
    client.sdo(NODE).read::<u32>(index::IDENTITY, 4).unwrap();
    assert!(client.line().surplus_answers(NODE) > 0);
}

#[test]
fn another_masters_transfer_is_not_broken_off_and_its_answers_are_no_double() {
    let mut bus = with_long(4);
    // Another master asks, and is answered, just before us.
    bus.hear(Frame::new(0x620, &[0x40, 0x18, 0x10, 4, 0, 0, 0, 0]).unwrap());
    bus.hear(Frame::new(0x5A0, &[0x43, 0x18, 0x10, 4, 7, 0, 0, 0]).unwrap());
    let mut client = client(bus);
    client.sdo(NODE).upload(LONG, 1).unwrap();
    assert!(client.line().now() > Duration::from_millis(50), "a quiet moment was waited for");
    assert_eq!(client.line().surplus_answers(NODE), 0);
}

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

fn with_curve(samples: usize) -> Table {
    let bytes = pattern(samples * 2);
    let mut table = Table::of(7);
    table.put(index::RECORDING + 1, 1, &[0]);
    let object = index::RECORDING;
    table.put(object, 1, &[1]);
    table.put(object, 2, &41_u32.to_le_bytes());
    table.put(object, 3, &1_000_u64.to_le_bytes());
    table.put(object, 4, &(samples as u32).to_le_bytes());
    table.put(object, 5, &CRC.checksum(&bytes).to_le_bytes());
    for (sub, value) in [(6, 20_000.0_f32), (7, 0.07), (8, 32_768.5)] {
        table.put(object, sub, &value.to_le_bytes());
    }
    table.put(object, 9, &1_100_u64.to_le_bytes());
    table.put(object, 10, &3_u32.to_le_bytes());
    table.put(object, 11, &4_u32.to_le_bytes());
    table.put(object, 12, &bytes);
    table
}

#[test]
fn a_curve_comes_with_its_time_and_its_force() {
    let mut client = client(ServedBus::new(vec![(NODE, with_curve(14_000))]));
    assert_eq!(client.stored_curves(NODE).unwrap(), [(41, 0)]);
    let began = client.line().now();
    let mut heard = (0, 0);
    let curve = client.download_curve(NODE, 0, 41, &mut |come, of| heard = (come, of)).unwrap().unwrap();
    assert_eq!((curve.codes.len(), curve.refetched), (14_000, 0));
    assert_eq!(heard, (28_000, 28_000));
    assert_eq!(curve.times_s().next(), Some(0.05));
    let code = u16::from_le_bytes([pattern(2)[0], pattern(2)[1]]);
    assert_eq!(curve.forces().next().unwrap().0, (f32::from(code) - 32_768.5) * 0.07);
    // The physical limit of 28 000 bytes in 7-byte segments at 1 Mbit/s is 0.52 s.
    assert!(client.line().now() - began < Duration::from_millis(700));
    assert_eq!(client.download_curve(NODE, 0, 40, &mut |_, _| {}).unwrap(), None, "another impact's curve");
}

/// Damages a segment in the middle of the curve in such a way that its sequence number stays right.
fn damage(times: u32) -> impl FnMut(&mut Frame) -> bool {
    let mut left = times;
    move |frame| {
        let segment_77 = frame.id == 0x5A0 && frame.data[0] == 77;
        if segment_77 && left > 0 {
            frame.data[3] ^= 0x10;
            left -= 1;
        }
        true
    }
}

#[test]
fn a_damaged_curve_is_fetched_again_whole() {
    let bus = ServedBus::new(vec![(NODE, with_curve(300))]).with(damage(2));
    let mut client = client(bus);
    let curve = client.download_curve(NODE, 0, 41, &mut |_, _| {}).unwrap().unwrap();
    assert_eq!(curve.refetched, 2);
    let bytes: Vec<u8> = curve.codes.iter().flat_map(|code| code.to_le_bytes()).collect();
    assert_eq!(bytes, pattern(600));
}

#[test]
fn a_curve_that_never_comes_whole_is_an_error_not_a_curve() {
    let bus = ServedBus::new(vec![(NODE, with_curve(300))]).with(damage(u32::MAX));
    let error = client(bus).download_curve(NODE, 0, 41, &mut |_, _| {}).unwrap_err();
    assert!(error.to_string().contains("impact 41 could not be fetched from node 32 in 5 attempts"), "{error}");
}
