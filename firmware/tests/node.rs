//! The sensor as a master on the bus sees it.

mod bench;

use bench::sdo::Abort;
use bench::{Flash, Master, with_sensor};
use embassy_time::Duration;
use thud_firmware::board::{BusState, Received};
use thud_firmware::configuration_lock::{self, Key};
use thud_firmware::dictionary::frame::{Alarm, Assembly, MassFrame, Part};
use thud_firmware::dictionary::{APPLY, PRODUCT_CODE, SAVE, event_record, index};
use thud_firmware::emergency::{Emergency, Fault};
use thud_firmware::event::Verdict;
use thud_firmware::stream::{Force, Samples};
use thud_firmware::tasks::supervisor::{FIRST_PAUSE, PERIOD};
use thud_firmware::units::Kilogram;

const START: u8 = 1;
const STOP: u8 = 2;
const PRE_OPERATIONAL: u8 = 128;
const RESET_COMMUNICATION: u8 = 130;
/// Time in which the detector settles, ms.
const SETTLED: u64 = 4_000;

const TOO_LOW: Abort = Abort(0x0609_0032);
const INVALID: Abort = Abort(0x0609_0030);
const READ_ONLY: Abort = Abort(0x0601_0002);
const WRITE_ONLY: Abort = Abort(0x0601_0001);
const NO_OBJECT: Abort = Abort(0x0602_0000);
const NO_SUB: Abort = Abort(0x0609_0011);
const TOO_LONG: Abort = Abort(0x0607_0012);
const DEVICE_STATE: Abort = Abort(0x0800_0022);
const TOO_SHORT: Abort = Abort(0x0607_0013);
const LOCAL_CONTROL: Abort = Abort(0x0800_0021);
const TIMEOUT: Abort = Abort(0x0504_0000);

/// Lets the detector settle and strikes once; the object of the slot that holds the curve.
async fn one_blow(master: &Master) -> u16 {
    master.wait(SETTLED).await;
    master.blow(20, 60.0);
    master.wait(1_500).await;
    master.slot_of(1).await
}

#[test]
fn it_boots_up_with_state_0_and_beats() {
    with_sensor(&Flash::new(), async |master| {
        master.wait(2_260).await;
        let heard = master.heard();
        assert_eq!((heard[0].1.id, heard[0].1.bytes()), (0x720, &[0][..]));
        let beats: Vec<_> = heard[1..].iter().filter(|(_, frame)| frame.id == 0x720).collect();
        assert_eq!(beats.len(), 4, "{heard:?}");
        assert!(beats.iter().all(|(_, frame)| frame.bytes() == [127]));
        assert!(beats.windows(2).all(|pair| (pair[1].0 - pair[0].0).as_millis().abs_diff(500) <= 1), "{beats:?}");
        master.nmt(START);
        assert_eq!(master.expect(0x720, 600).await.unwrap().bytes(), [5]);
        master.nmt(STOP);
        assert_eq!(master.expect(0x720, 600).await.unwrap().bytes(), [4]);
        // CiA 301: no SDO while stopped.
        master.send(0x620, &[0x40, 0x18, 0x10, 1, 0, 0, 0, 0]);
        assert_eq!(master.expect(0x5A0, 300).await, None);
        master.nmt(RESET_COMMUNICATION);
        assert_eq!(master.expect(0x720, 600).await.unwrap().bytes(), [0]);
    });
}

#[test]
fn every_readable_object_can_be_read_and_no_other_access_is_granted() {
    use thud_firmware::dictionary::object::OBJECTS;
    with_sensor(&Flash::new(), async |master| {
        for object in OBJECTS {
            for sub in object.subs {
                let read = master.read(object.index, sub.sub).await;
                let no_data = Abort(0x0800_0024);
                match read {
                    Ok(bytes) if sub.size() > 0 => {
                        assert_eq!(bytes.len(), sub.size(), "0x{:04X}:{}", object.index, sub.sub);
                    }
                    Ok(bytes) => assert!(!bytes.is_empty()),
                    Err(WRITE_ONLY) => assert!(!sub.access.is_readable()),
                    // Nothing has happened yet: no errors, events, recordings.
                    Err(abort) => {
                        assert_eq!(abort, no_data, "0x{:04X}:{}", object.index, sub.sub);
                        assert!(matches!(object.index, 0x1003 | 0x2200 | 0x2300 | 0x2301));
                    }
                }
                if !sub.access.is_writable() {
                    assert_eq!(master.write(object.index, sub.sub, &[0; 4]).await, Err(READ_ONLY));
                }
            }
            if object.has_count() && object.index != index::ERROR_HISTORY {
                assert_eq!(master.read(object.index, 0).await, Ok(vec![object.highest()]));
                assert_eq!(master.read(object.index, object.highest() + 1).await, Err(NO_SUB));
            }
        }
        assert_eq!(master.read(0x5000, 0).await, Err(NO_OBJECT));
        assert_eq!(master.read_u32(index::IDENTITY, 2).await, PRODUCT_CODE);
        assert_eq!(master.read_u32(index::IDENTITY, 4).await, 0x1234_5678);
        assert_eq!(master.read(index::DEVICE_NAME, 0).await.unwrap(), b"thud impact sensor");
        assert_eq!(master.read_by_blocks(index::DEVICE_NAME, 0, 2).await.unwrap(), b"thud impact sensor");
    });
}

#[test]
fn a_configuration_takes_effect_as_a_whole_and_survives_the_power() {
    let flash = Flash::new();
    let hash = with_sensor(&flash, async |master| {
        assert_eq!(master.write(index::JUDGEMENT, 4, &10.0f32.to_le_bytes()).await, Err(TOO_LOW));
        assert_eq!(master.read_u32(index::REFUSAL, 2).await, 0x2000 << 8 | 4);
        assert_eq!(master.read(index::REFUSAL, 4).await.unwrap(), 1_000.0f32.to_le_bytes());
        assert_eq!(master.write(index::JUDGEMENT, 1, &[13]).await, Err(INVALID));
        assert_eq!(master.write(index::JUDGEMENT, 1, &[1, 2]).await, Err(TOO_LONG));
        master.write(index::JUDGEMENT, 1, &[5]).await.unwrap();
        master.write_by_segments(index::JUDGEMENT, 4, &30_000.0f32.to_le_bytes()).await.unwrap();
        master.write_by_block(index::MASS_SETTINGS, 1, &12.5f32.to_le_bytes()).await.unwrap();
        assert_eq!(master.read_u32(index::TRANSACTION, 3).await, 0, "not applied yet");
        assert_eq!(master.shared.active().configuration.region, None);
        master.write(index::TRANSACTION, 1, &[APPLY]).await.unwrap();
        assert_eq!(master.read_u32(index::TRANSACTION, 3).await, 1);
        master.wait(50).await;
        assert_eq!(master.read(index::TRANSACTION, 2).await.unwrap(), [0], "stored");
        master.read_u32(index::TRANSACTION, 4).await
    });
    with_sensor(&flash, async |master| {
        let active = master.shared.active();
        assert_eq!((active.revision, active.hash), (1, hash));
        assert_eq!(active.configuration.effective_mass, Some(Kilogram(12.5)));
        assert_eq!(active.configuration.body_stiffness.0, 30_000.0);
        master.wires.borrow_mut().flash_fails = true;
        master.write(index::STORE, 1, &SAVE.to_le_bytes()).await.unwrap();
        let emergency = Emergency::decode(master.expect(0x0A0, 100).await.unwrap().bytes()).unwrap();
        assert_eq!(emergency.code, Fault::Storage.code());
        master.wires.borrow_mut().flash_fails = false;
        master.write(index::STORE, 1, &SAVE.to_le_bytes()).await.unwrap();
        let emergency = Emergency::decode(master.expect(0x0A0, 100).await.unwrap().bytes()).unwrap();
        assert_eq!((emergency.code, emergency.register), (0, 0));
    });
}

#[test]
fn a_blow_is_alarmed_told_logged_and_recorded() {
    with_sensor(&Flash::new(), async |master| {
        master.write(index::JUDGEMENT, 1, &[5]).await.unwrap();
        master.write(index::TRANSACTION, 1, &[APPLY]).await.unwrap();
        master.nmt(START);
        master.wait(SETTLED).await;
        master.send(0x220, &MassFrame { mass: Kilogram(8.0), sequence: 1 }.encode());
        master.heard();
        master.blow(20, 100.0);
        master.wait(2_000).await;
        let heard = master.heard();

        let alarms: Vec<_> = heard.iter().filter(|(_, frame)| frame.id == 0x020).collect();
        assert_eq!(alarms.len(), 1);
        let alarm = Alarm::decode(alarms[0].1.bytes()).unwrap();
        let noticed_us = u64::from(alarm.index) * 50;
        assert!(alarms[0].0.as_micros() - noticed_us < 1_000, "on the bus within 1 ms");

        let mut assembly = Assembly::new();
        let events: Vec<_> = heard
            .iter()
            .filter_map(|(_, frame)| Part::of(frame.id).map(|(part, _)| assembly.push(part, frame.bytes()).unwrap()))
            .flatten()
            .collect();
        assert_eq!(events.len(), 1);
        let told = &events[0];
        assert!((told.raw_peak.0 - 100.0).abs() < 1.0, "{told:?}");
        assert_eq!(told.effective_mass, Some(Kilogram(8.0)));
        assert_eq!(told.verdict, Verdict::Pass, "{told:?}");

        let record = master.read(index::EVENT_LOG, 5).await.unwrap();
        let event = event_record::decode(&record).unwrap();
        assert_eq!((event.number, event.configuration_revision), (1, 1));
        assert!((event.peak.0 - told.peak.0).abs() < 0.051);
        master.write(index::EVENT_LOG, 4, &7u32.to_le_bytes()).await.unwrap();
        assert_eq!(master.read(index::EVENT_LOG, 5).await, Err(Abort(0x0800_0024)));

        let slot = master.slot_of(event.impact).await;
        let begun = embassy_time::Instant::now();
        let by_blocks = master.read_by_blocks(slot, 12, 127).await.unwrap();
        let taken = begun.elapsed();
        // A frame of 130 bits carries 7 bytes: 0.53 s is the least for a full capture of 28 KiB at 1 Mbit/s.
        assert!(taken < Duration::from_millis(1_000), "the download took {taken} of bus time");
        let by_segments = master.read(slot, 12).await.unwrap();
        assert_eq!(by_blocks, by_segments);
        assert_eq!(by_blocks.len() as u32, 2 * master.read_u32(slot, 4).await);
        let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&by_blocks);
        assert_eq!(crc, master.read_u32(slot, 5).await);
        let highest = by_blocks.chunks(2).map(|code| u16::from_le_bytes([code[0], code[1]])).max().unwrap();
        assert!((f32::from(highest) - 32_768.0 - 100.0 / 0.07).abs() < 12.0);
    });
}

#[test]
fn what_happens_before_start_stays_in_the_log() {
    with_sensor(&Flash::new(), async |master| {
        master.wait(SETTLED).await;
        master.blow(20, 60.0);
        master.wait(1_500).await;
        assert_eq!(master.read_u32(index::EVENT_LOG, 2).await, 1);
        assert_eq!(master.read_u32(index::LOSSES, 10).await, 1, "the alarm was withheld, and that is counted");
        master.nmt(START);
        master.wait(500).await;
        let (alarms, parts): (Vec<_>, Vec<_>) = master
            .heard()
            .into_iter()
            .filter(|(_, frame)| frame.id == 0x020 || Part::of(frame.id).is_some())
            .partition(|(_, frame)| frame.id == 0x020);
        assert_eq!((alarms.len(), parts.len()), (0, 0), "the past is not told as news");
        assert!(event_record::decode(&master.read(index::EVENT_LOG, 5).await.unwrap()).is_ok());
    });
}

#[test]
fn the_alarm_passes_a_running_download_and_a_lost_segment_is_repeated() {
    with_sensor(&Flash::new(), async |master| {
        master.nmt(START);
        let slot = one_blow(master).await;
        let whole = master.read(slot, 12).await.unwrap();
        master.heard();
        master.blow(150, 80.0);
        // Three segments are lost on the way.
        let lossy = async {
            for _ in 0..3 {
                master.wait(100).await;
                master.wires.borrow_mut().drop_next.push(0x5A0);
            }
            core::future::pending::<()>().await;
        };
        let download = embassy_futures::select::select(master.read_by_blocks(slot, 12, 50), lossy).await;
        let embassy_futures::select::Either::First(download) = download else { unreachable!() };
        assert!(download.unwrap() == whole, "complete, though segments were lost");
        master.wait(200).await;
        let sent = master.wires.borrow().sent.clone();
        let (at, frame) = *sent.iter().rfind(|(_, frame)| frame.id == 0x020).expect("an alarm in the middle of it");
        let noticed_us = u64::from(Alarm::decode(frame.bytes()).unwrap().index) * 50;
        assert!(at.as_micros() - noticed_us < 1_000, "{} µs", at.as_micros() - noticed_us);
    });
}

#[test]
fn a_curve_that_is_being_read_stays_and_events_go_on() {
    with_sensor(&Flash::new(), async |master| {
        let slot = one_blow(master).await;
        for after in [100, 2_500, 5_000] {
            master.blow(after, 70.0);
        }
        // 4 096 segments of 3 ms each: the three blows fall into it.
        let curve = master.read_slowly(slot, 12, 3).await.unwrap();
        assert_eq!(crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&curve), master.read_u32(slot, 5).await);
        assert_eq!(master.read_u32(slot, 2).await, 1, "still the curve of the first impact");
        assert_eq!(master.read_u32(index::EVENT_LOG, 2).await, 4, "each blow has its event");
        for number in 2..=4u32 {
            master.write(index::EVENT_LOG, 4, &number.to_le_bytes()).await.unwrap();
            let event = event_record::decode(&master.read(index::EVENT_LOG, 5).await.unwrap()).unwrap();
            assert!((event.peak.0 - 70.0).abs() < 0.5, "{event:?}");
        }
        assert_eq!(master.shared.captures.lost_curves().unevaluated, 0);
        assert_eq!(master.read_u32(index::LOSSES, 7).await, 3, "and that their curves are gone is counted");
        // Nobody reads any more: the next impact has its curve again, in the other slot first.
        master.blow(20, 50.0);
        master.wait(2_000).await;
        master.slot_of(5).await;
    });
}

#[test]
fn a_master_that_vanishes_with_a_curve_half_read_keeps_it_for_five_seconds_only() {
    with_sensor(&Flash::new(), async |master| {
        let slot = one_blow(master).await;
        let [low, high] = slot.to_le_bytes();
        master.sdo([0x40, low, high, 12, 0, 0, 0, 0]).await;
        master.wait(5_500).await;
        for after in [20, 2_000] {
            master.blow(after, 70.0);
        }
        master.wait(4_000).await;
        assert_eq!(master.read_u32(index::EVENT_LOG, 2).await, 3);
        master.slot_of(3).await;
    });
}

#[test]
fn an_armed_sensor_refuses_configuration_and_nothing_else() {
    with_sensor(&Flash::new(), async |master| {
        master.write(index::JUDGEMENT, 1, &[5]).await.unwrap();
        master.nmt(START);
        master.wait(1).await;
        for (object, sub, value) in [
            (index::JUDGEMENT, 1, &[4][..]),
            (index::NODE, 1, &[9]),
            (index::TRANSACTION, 1, &[APPLY]),
            (index::STORE, 1, b"save"),
            (index::RESTORE, 1, b"load"),
            (index::TPDO_ALARM, 1, &[0x90, 1, 0, 0]),
        ] {
            assert_eq!(master.write(object, sub, value).await, Err(DEVICE_STATE), "0x{object:04X}");
        }
        assert_eq!(master.write_by_segments(index::LOCK, 4, &[1; 16]).await, Err(DEVICE_STATE));
        assert_eq!(master.read(index::JUDGEMENT, 1).await.unwrap(), [5], "what was staged before is still there");
        for (object, sub, value) in [
            (index::RECEIVED_MASS, 1, &4.0f32.to_le_bytes()[..]),
            (index::HEARTBEAT, 0, &[0xE8, 3]),
            (index::EVENT_LOG, 4, &[0; 4]),
            (index::ERROR_HISTORY, 0, &[0]),
            (index::STREAM, 1, &[0, 0]),
        ] {
            assert_eq!(master.write(object, sub, value).await, Ok(()), "0x{object:04X}");
        }
        master.nmt(PRE_OPERATIONAL);
        master.write(index::TRANSACTION, 1, &[APPLY]).await.unwrap();
        assert_eq!(master.read_u32(index::TRANSACTION, 3).await, 1);
    });
}

/// A change signed with a key: body region and its stiffness, and a new key if there is one.
fn signed(key: &Key, serial: u32, counter: u32, region: u8, new_key: Option<Key>) -> Vec<u8> {
    let mut settings = vec![0x00, 0x20, 1, region, 0x00, 0x20, 4];
    settings.extend(30_000.0f32.to_le_bytes());
    if let Some(new_key) = new_key {
        settings.extend([0x12, 0x20, 4]);
        settings.extend(new_key);
    }
    let mut change = counter.to_le_bytes().to_vec();
    change.extend(&settings);
    change.extend(configuration_lock::tag(key, serial, counter, &settings));
    change
}

#[test]
fn a_locked_configuration_is_read_by_all_and_changed_by_the_key_alone_and_once() {
    const KEY: Key = *b"sixteen bytes..!";
    const SERIAL: u32 = 0x1234_5678;
    let flash = Flash::new();
    let used = with_sensor(&flash, async |master| {
        assert_eq!(master.read(index::LOCK, 1).await.unwrap(), [0]);
        assert_eq!(
            master.write_by_segments(index::LOCK, 3, &signed(&KEY, SERIAL, 1, 5, None)).await,
            Err(LOCAL_CONTROL)
        );
        assert_eq!(master.write_by_segments(index::LOCK, 4, &KEY[..15]).await, Err(TOO_SHORT));
        master.write_by_segments(index::LOCK, 4, &KEY).await.unwrap();
        assert_eq!(master.read(index::LOCK, 1).await.unwrap(), [1]);
        assert_eq!(master.read(index::LOCK, 4).await, Err(WRITE_ONLY), "nobody reads the key");
        for (object, sub, value) in [
            (index::JUDGEMENT, 1, &[4][..]),
            (index::TRANSACTION, 1, &[APPLY]),
            (index::RESTORE, 1, b"load"),
            (index::TPDO_ALARM, 1, &[0x90, 1, 0, 0]),
        ] {
            assert_eq!(master.write(object, sub, value).await, Err(LOCAL_CONTROL), "0x{object:04X}");
        }
        assert_eq!(master.write_by_segments(index::LOCK, 4, &[7; 16]).await, Err(LOCAL_CONTROL));
        assert_eq!(master.read(index::JUDGEMENT, 1).await.unwrap(), [0], "reading works");

        let counter = master.read_u32(index::LOCK, 2).await + 1;
        let good = signed(&KEY, SERIAL, counter, 5, None);
        let mut truncated = good.clone();
        truncated.truncate(good.len() - 8);
        let mut other_value = good.clone();
        other_value[7] = 4;
        for forged in [
            truncated,
            other_value,
            signed(&[0; 16], SERIAL, counter, 5, None),
            signed(&KEY, SERIAL + 1, counter, 5, None),
            signed(&KEY, SERIAL, counter - 1, 5, None),
        ] {
            assert_eq!(master.write_by_segments(index::LOCK, 3, &forged).await, Err(LOCAL_CONTROL));
        }
        assert_eq!(master.write_by_segments(index::LOCK, 3, &good[..10]).await, Err(TOO_SHORT));
        assert_eq!(master.read_u32(index::LOSSES, 14).await, 6);
        assert_eq!(master.read_u32(index::TRANSACTION, 3).await, 0, "nothing has changed");

        master.write_by_segments(index::LOCK, 3, &good).await.unwrap();
        assert_eq!(master.read(index::JUDGEMENT, 1).await.unwrap(), [5]);
        assert_eq!(master.read_u32(index::TRANSACTION, 3).await, 1);
        assert_eq!(master.write_by_segments(index::LOCK, 3, &good).await, Err(LOCAL_CONTROL), "once");
        // A value that is out of range: the whole change is refused, and its counter is used all the same.
        let impossible = signed(&KEY, SERIAL, counter + 1, 99, None);
        assert_eq!(master.write_by_segments(index::LOCK, 3, &impossible).await, Err(INVALID));
        assert_eq!(master.write_by_segments(index::LOCK, 3, &impossible).await, Err(LOCAL_CONTROL));
        assert_eq!(master.read_u32(index::TRANSACTION, 3).await, 1);
        // Nor does LSS get round it.
        master.send(0x7E5, &[0x04, 1, 0, 0, 0, 0, 0, 0]);
        master.send(0x7E5, &[0x11, 0x42, 0, 0, 0, 0, 0, 0]);
        master.wait(5).await;
        master.heard();
        master.send(0x7E5, &[0x17, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(master.expect(0x7E4, 10).await.unwrap().bytes(), [0x17, 2, 0, 0, 0, 0, 0, 0]);
        master.wait(50).await;
        good
    });
    // The lock and its counter outlive the power.
    with_sensor(&flash, async |master| {
        assert_eq!(master.read_u32(index::BOARD, 8).await, 2, "the second start");
        assert_eq!(master.read(index::LOCK, 1).await.unwrap(), [1]);
        assert_eq!(master.read_u32(index::TRANSACTION, 3).await, 1);
        assert_eq!(master.write_by_segments(index::LOCK, 3, &used).await, Err(LOCAL_CONTROL));
        assert_eq!(master.write(index::JUDGEMENT, 1, &[4]).await, Err(LOCAL_CONTROL));
        // Unlocked by a change that sets a key of zeros.
        let counter = master.read_u32(index::LOCK, 2).await + 1;
        let unlocking = signed(&KEY, SERIAL, counter, 3, Some([0; 16]));
        master.write_by_segments(index::LOCK, 3, &unlocking).await.unwrap();
        assert_eq!(master.read(index::LOCK, 1).await.unwrap(), [0]);
        master.write(index::JUDGEMENT, 1, &[4]).await.unwrap();
    });
}

#[test]
fn samples_are_streamed_gaplessly_at_the_rate_asked_for_and_give_way_to_alarm_and_event() {
    with_sensor(&Flash::new(), async |master| {
        master.nmt(START);
        master.wait(SETTLED).await;
        assert_eq!(master.write(index::STREAM, 1, &[0x11, 0x27]).await, Err(Abort(0x0609_0031)), "10 001 is too many");
        master.write(index::STREAM, 1, &[4, 0]).await.unwrap();
        master.heard();
        master.blow(100, 80.0);
        master.wait(3_000).await;
        master.write(index::STREAM, 1, &[0, 0]).await.unwrap();
        let heard = master.heard();
        let frames: Vec<Samples> = heard
            .iter()
            .filter(|(_, frame)| frame.id == 0x520)
            .filter_map(|(_, frame)| Samples::decode(frame.bytes()))
            .collect();
        // 3 s at 20 kS/s, four samples a value, three values a frame.
        assert!((4_990..=5_010).contains(&frames.len()), "{}", frames.len());
        assert!(frames.windows(2).all(|pair| pair[1].number == pair[0].number.wrapping_add(3)));
        assert_eq!(master.read_u32(index::LOSSES, 13).await, 0);
        let peak = frames.iter().flat_map(|frame| frame.forces).fold(0.0_f32, |peak, force| match force {
            Force::Is(force) => peak.max(force.0),
            _ => f32::NAN,
        });
        assert!((peak - 80.0).abs() < 1.0, "{peak} N");
        assert_eq!(heard.iter().filter(|(_, frame)| frame.id == 0x020).count(), 1);
        let alarm = Alarm::decode(heard.iter().find(|(_, frame)| frame.id == 0x020).unwrap().1.bytes()).unwrap();
        let at = heard.iter().find(|(_, frame)| frame.id == 0x020).unwrap().0;
        assert!(at.as_micros() - (u64::from(alarm.index) + 1) * 50 < 1_000);
        for part in Part::ALL {
            assert_eq!(heard.iter().filter(|(_, frame)| frame.id == part.base() + 0x20).count(), 1, "{part:?}");
        }
        // Switched off, and by a reset of communication as well.
        master.wait(100).await;
        master.heard();
        master.wait(100).await;
        assert!(master.heard().iter().all(|(_, frame)| frame.id != 0x520));
    });
}

#[test]
fn a_stream_that_the_bus_cannot_take_is_thinned_and_counted_and_a_curve_still_comes() {
    with_sensor(&Flash::new(), async |master| {
        master.nmt(START);
        let slot = one_blow(master).await;
        // Every sample: with the upload beside it more than the bus can carry.
        master.write(index::STREAM, 1, &[1, 0]).await.unwrap();
        master.heard();
        let curve = master.read_by_blocks(slot, 12, 127).await.unwrap();
        assert_eq!(crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&curve), master.read_u32(slot, 5).await);
        let frames: Vec<Samples> = master
            .heard()
            .iter()
            .filter(|(_, frame)| frame.id == 0x520)
            .filter_map(|(_, frame)| Samples::decode(frame.bytes()))
            .collect();
        master.write(index::STREAM, 1, &[0, 0]).await.unwrap();
        let missing: u32 =
            frames.windows(2).map(|pair| u32::from(pair[1].number.wrapping_sub(pair[0].number)) / 3 - 1).sum();
        let dropped = master.read_u32(index::LOSSES, 13).await;
        assert!(missing <= dropped && dropped <= missing + 10, "{missing} are missing, {dropped} are counted");
        println!("{} frames came, {dropped} were dropped", frames.len());
    });
}

#[test]
fn a_slow_master_is_waited_for_and_a_vanished_one_blocks_nobody() {
    with_sensor(&Flash::new(), async |master| {
        assert_eq!(master.read_slowly(index::DEVICE_NAME, 0, 1_500).await.unwrap(), b"thud impact sensor");
        // One vanishes in the middle of a segmented read, the next is served at once.
        master.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]).await;
        assert_eq!(master.read_u32(index::IDENTITY, 2).await, PRODUCT_CODE);
        // One vanishes in the middle of a block, likewise.
        master.send(0x620, &[0xA4, 0x08, 0x10, 0, 2, 0, 0, 0]);
        master.wait(5).await;
        master.send(0x620, &[0xA3, 0, 0, 0, 0, 0, 0, 0]);
        master.wait(5).await;
        assert_eq!(master.read_u32(index::IDENTITY, 2).await, PRODUCT_CODE);
        // And one who never comes back is told.
        master.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]).await;
        let abort = master.expect(0x5A0, 6_000).await.unwrap();
        assert_eq!(Abort(u32::from_le_bytes(abort.data[4..].try_into().unwrap())), TIMEOUT);
        // An abort is not answered; a block of no segments and a wrong toggle are refused.
        master.send(0x620, &[0x80, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(master.expect(0x5A0, 100).await, None);
        assert_eq!(master.read_by_blocks(index::DEVICE_NAME, 0, 0).await, Err(Abort(0x0504_0002)));
        master.sdo([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]).await;
        assert_eq!(master.sdo([0x70, 0, 0, 0, 0, 0, 0, 0]).await[0], 0x80);
    });
}

#[test]
fn losses_are_told_and_counted() {
    with_sensor(&Flash::new(), async |master| {
        master.wait(500).await;
        master.wires.borrow_mut().overrun = Some(800);
        let emergency = Emergency::decode(master.expect(0x0A0, 100).await.unwrap().bytes()).unwrap();
        assert_eq!((emergency.code, emergency.detail), (Fault::SamplesLost.code(), 800));
        assert_eq!(master.read_u32(index::LOSSES, 1).await, 1);
        assert_eq!(master.read_u32(index::LOSSES, 2).await, 800);
        master.wires.borrow_mut().to_sensor.push_back(Received::Lost(3));
        master.wait(60).await;
        assert_eq!(master.read_u32(index::LOSSES, 5).await, 3);
        assert_eq!(master.read_u32(index::ERROR_HISTORY, 1).await & 0xFFFF, u32::from(Fault::ReceiveOverrun.code()));
        master.write(index::ERROR_HISTORY, 0, &[0]).await.unwrap();
        assert_eq!(master.read(index::ERROR_HISTORY, 0).await.unwrap(), [0]);
    });
}

#[test]
fn the_effective_mass_is_taken_only_while_operational_and_its_gaps_are_counted() {
    with_sensor(&Flash::new(), async |master| {
        let send = |mass: f32, sequence| master.send(0x220, &MassFrame { mass: Kilogram(mass), sequence }.encode());
        send(5.0, 1);
        master.wait(10).await;
        assert_eq!(master.read_u32(index::RECEIVED_MASS, 4).await, 0, "not yet Operational, and not kept for later");
        master.nmt(START);
        master.wait(10).await;
        assert_eq!(master.read_u32(index::RECEIVED_MASS, 4).await, 0);
        for (mass, sequence) in [(5.0, 7), (6.0, 8), (-1.0, 9), (f32::NAN, 10), (7.0, 13)] {
            send(mass, sequence);
            master.wait(2).await;
        }
        assert_eq!(master.read_u32(index::RECEIVED_MASS, 4).await, 3);
        assert_eq!(master.read_u32(index::RECEIVED_MASS, 5).await, 2);
        assert_eq!(master.read_u32(index::RECEIVED_MASS, 6).await, 2);
        assert_eq!(master.read(index::RECEIVED_MASS, 1).await.unwrap(), 7.0f32.to_le_bytes());
        assert_eq!(master.write(index::RECEIVED_MASS, 1, &0.0f32.to_le_bytes()).await, Err(TOO_LOW));
        master.send(0x220, &[1, 2, 3]);
        let emergency = Emergency::decode(master.expect(0x0A0, 100).await.unwrap().bytes()).unwrap();
        assert_eq!((emergency.code, emergency.detail), (Fault::PdoLength.code(), 3));
    });
}

#[test]
fn the_alarm_goes_where_it_is_told_to() {
    with_sensor(&Flash::new(), async |master| {
        assert_eq!(master.read_u32(index::TPDO_ALARM, 1).await, 0x020);
        assert_eq!(master.write(index::TPDO_ALARM, 1, &0x600u32.to_le_bytes()).await, Err(INVALID));
        master.write(index::TPDO_ALARM, 1, &0x1A0u32.to_le_bytes()).await.unwrap();
        master.nmt(START);
        master.wait(SETTLED).await;
        assert_eq!(master.write(index::TPDO_ALARM, 1, &0x1A1u32.to_le_bytes()).await, Err(DEVICE_STATE));
        master.blow(10, 50.0);
        assert!(master.expect(0x1A0, 100).await.is_some());
        master.nmt(PRE_OPERATIONAL);
        master.wait(2_000).await;
        // Bit 31: not used.
        master.write(index::TPDO_ALARM, 1, &(1u32 << 31 | 0x1A0).to_le_bytes()).await.unwrap();
        master.nmt(START);
        master.heard();
        master.blow(10, 50.0);
        assert_eq!(master.expect(0x1A0, 1_000).await, None);
    });
}

#[test]
fn lss_assigns_a_node_id_that_lasts() {
    let flash = Flash::new();
    with_sensor(&flash, async |master| {
        let number = |code: u8, number: u32| {
            let mut frame = [0; 8];
            frame[0] = code;
            frame[1..5].copy_from_slice(&number.to_le_bytes());
            frame
        };
        master.wait(10).await;
        for (code, value) in [(0x40, 0), (0x41, PRODUCT_CODE), (0x42, 0x0001_0000), (0x43, 0x1234_5678)] {
            master.send(0x7E5, &number(code, value));
        }
        assert_eq!(master.expect(0x7E4, 50).await.unwrap().data[0], 0x44, "selected");
        master.send(0x7E5, &[0x11, 0x31, 0, 0, 0, 0, 0, 0]);
        assert_eq!(master.expect(0x7E4, 50).await.unwrap().data[..2], [0x11, 0]);
        master.send(0x7E5, &[0x17, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(master.expect(0x7E4, 50).await.unwrap().data[..2], [0x17, 0]);
        // Under the old id, which it has until then.
        master.send(0x000, &[0x82, master.node]);
        assert_eq!(master.expect(0x731, 50).await.unwrap().bytes(), [0], "boots up under its new id");
        master.wait(200).await;
    });
    with_sensor(&flash, async |master| {
        assert_eq!(master.node, 0x31);
        assert_eq!(master.expect(0x731, 50).await.unwrap().bytes(), [0]);
    });
}

#[test]
fn bus_off_ends_after_a_growing_pause_and_the_watchdog_is_petted_meanwhile() {
    with_sensor(&Flash::new(), async |master| {
        master.wait(3_000).await;
        let mut pauses = Vec::new();
        for count in 1..=4 {
            let at = embassy_time::Instant::now();
            master.wires.borrow_mut().state = BusState::BusOff;
            master.wait(700).await;
            pauses.push(*master.wires.borrow().recoveries.last().unwrap() - at);
            assert_eq!(master.read_u32(index::LOSSES, 8).await, count);
        }
        for (place, pause) in pauses.iter().enumerate() {
            let due = FIRST_PAUSE * (1 << place);
            assert!(*pause >= due && *pause <= due + PERIOD * 2, "{pauses:?}");
        }
        let pets = master.wires.borrow().pets.clone();
        assert!(pets.windows(2).all(|pair| pair[1] - pair[0] <= Duration::from_millis(120)));
    });
}

#[test]
fn a_configuration_applied_inside_an_impact_waits_for_its_end_and_so_does_flash() {
    with_sensor(&Flash::new(), async |master| {
        master.nmt(START);
        master.wait(SETTLED).await;
        master.blow(20, 60.0);
        assert!(master.expect(0x020, 100).await.is_some());
        master.nmt(PRE_OPERATIONAL);
        master.write(index::JUDGEMENT, 1, &[5]).await.unwrap();
        master.write(index::TRANSACTION, 1, &[APPLY]).await.unwrap();
        assert_eq!(master.read(index::DETECTOR, 5).await.unwrap(), [1], "the impact is open");
        assert_eq!(master.read(index::TRANSACTION, 2).await.unwrap(), [2], "applied, not stored");
        while master.read(index::DETECTOR, 5).await.unwrap() == [1] {
            assert_eq!(master.read(index::TRANSACTION, 2).await.unwrap(), [2], "nothing is written meanwhile");
            master.wait(20).await;
        }
        master.wait(100).await;
        assert_eq!(master.read(index::TRANSACTION, 2).await.unwrap(), [0], "stored");
        master.blow(20, 60.0);
        master.wait(1_500).await;
        let mut revisions = Vec::new();
        for number in 1..=2u32 {
            master.write(index::EVENT_LOG, 4, &number.to_le_bytes()).await.unwrap();
            let event = event_record::decode(&master.read(index::EVENT_LOG, 5).await.unwrap()).unwrap();
            revisions.push((event.configuration_revision, event.severity.verdict));
        }
        assert_eq!(revisions[0], (0, Verdict::None), "judged by what held when it began");
        assert_eq!(revisions[1].0, 1);
        assert_ne!(revisions[1].1, Verdict::None);
    });
}
