use std::cell::{Cell, RefCell};
use std::pin::pin;
use std::rc::Rc;

use embassy_time::Timer;
use embedded_storage_async::nor_flash::{NorFlash as _, ReadNorFlash as _};
use thud_firmware::board::{BLOCK, CanReceive as _, CanTransmit as _, Frame, Received, Samples as _, Watchdog as _};

use super::*;
use crate::bus::{Disturbance, Traffic};
use crate::chain::ChainSettings;
use crate::force::{Blows, Untouched};
use crate::time::by_priority;

/// A toy sensor: sends the largest code of each 125th block, answers 0x123 with 0x7F0, pets the watchdog.
/// On 0x7FE it resets itself, on 0x7FD it goes deaf and dumb.
fn toy(parts: Parts) -> Life {
    Box::pin(async move {
        let Parts { mut samples, can, mut watchdog, identity, .. } = parts;
        let (mut transmit, mut receive) = (can.clone(), can);
        let outbox = RefCell::new(Vec::new());
        let id = 0x100 + identity.serial as u16;
        let deaf = Cell::new(false);
        let sampler = pin!(async {
            let mut block = [0; BLOCK];
            loop {
                if let Ok(info) = samples.next_block(&mut block).await
                    && info.first_index.is_multiple_of(1000)
                {
                    let peak = block.iter().max().copied().unwrap_or(0);
                    outbox.borrow_mut().push(Frame::new(id, &peak.to_le_bytes()).unwrap());
                }
            }
        });
        let sender = pin!(async {
            loop {
                while transmit.free() > 0 {
                    let Some(frame) = outbox.borrow_mut().pop() else { break };
                    transmit.load(&frame).unwrap();
                }
                Timer::after_millis(1).await;
                watchdog.pet();
            }
        });
        let listener = pin!(async {
            loop {
                match receive.receive().await {
                    Received::Frame(Frame { id: 0x7FE, .. }) => return,
                    Received::Frame(Frame { id: 0x7FD, .. }) => {
                        deaf.set(true);
                        return;
                    }
                    Received::Frame(frame) if frame.id == 0x123 => {
                        outbox.borrow_mut().push(Frame::new(0x7F0, frame.bytes()).unwrap());
                    }
                    Received::Frame(_) | Received::Lost(_) => {}
                }
            }
        });
        by_priority([("sampler", sampler), ("sender", sender), ("listener", listener)]).await;
        if deaf.get() {
            std::future::pending::<()>().await;
        }
        ResetCause::Software
    })
}

fn world() -> World {
    World::new(BitRate::MEGABIT, 1)
}

fn arrivals(host: &HostPort) -> Vec<(u64, Frame)> {
    std::iter::from_fn(|| host.receive())
        .map(|arrival| match arrival.received {
            Received::Frame(frame) => (arrival.at.as_micros(), frame),
            Received::Lost(count) => panic!("{count} frames lost"),
        })
        .collect()
}

/// Ten boards on a disturbed and loaded bus, with noise: everything that is random.
fn busy_world(seed: u64) -> Vec<(u64, Frame)> {
    let mut world = World::new(BitRate::MEGABIT, seed);
    let host = world.bus().attach_host("host");
    world.bus().disturb(Disturbance::Probability(0.01));
    world.bus().attach_traffic("others", Traffic { identifiers: 0x200..=0x6FF, ..Traffic::with_load(0.3) });
    for serial in 0..10 {
        let settings = BoardSettings::new(serial, seed + u64::from(serial)).with_chain(ChainSettings::workshop());
        world.add_board(settings, Untouched, toy);
    }
    world.run_until(Instant::from_millis(500)).unwrap();
    arrivals(&host)
}

#[test]
fn the_same_seed_gives_the_same_frames_at_the_same_instants() {
    let first = busy_world(3);
    assert!(first.iter().filter(|(_, frame)| (0x100..0x10A).contains(&frame.id)).count() >= 90);
    assert_eq!(first, busy_world(3));
    assert_ne!(first, busy_world(4));
}

#[test]
fn in_steps_or_in_one_go_the_world_is_the_same() {
    let run = |steps_us: u64| {
        let mut world = world();
        let host = world.bus().attach_host("host");
        world.add_board(BoardSettings::new(1, 9).with_chain(ChainSettings::workshop()), Untouched, toy);
        let mut at_us = 0;
        while at_us < 400_000 {
            at_us += steps_us;
            world.advance_to(std::time::Duration::from_micros(at_us.min(400_000))).unwrap();
        }
        arrivals(&host)
    };
    let whole = run(400_000);
    assert_eq!(whole.len(), 8);
    assert_eq!(whole, run(7));
    assert_eq!(whole, run(1_009));
}

#[test]
fn a_host_talks_with_a_board_between_two_runs() {
    let mut world = world();
    let host = world.bus().attach_host("host");
    world.add_board(BoardSettings::new(1, 0), Untouched, toy);
    world.run_until(Instant::from_micros(1_500)).unwrap();
    arrivals(&host);
    host.send(&Frame::new(0x123, &[1, 2, 3]).unwrap());
    let answer = world.run_until_arrival(&host, Instant::from_millis(10)).unwrap().unwrap();
    assert_eq!(answer.received, Received::Frame(Frame::new(0x7F0, &[1, 2, 3]).unwrap()));
    assert_eq!(world.now(), answer.at);
    assert_eq!(world.run_until_arrival(&host, Instant::from_millis(20)).unwrap(), None);
    assert_eq!(world.now(), Instant::from_millis(20));
}

#[test]
fn a_blow_ordered_while_it_runs_reaches_the_codes() {
    let mut world = world();
    let host = world.bus().attach_host("host");
    let blows = Blows::new();
    let settings = BoardSettings::new(1, 0);
    let newton_per_code = settings.chain.front_end.newton_per_code();
    world.add_board(settings, blows.clone(), toy);
    world.run_until(Instant::from_millis(70)).unwrap();
    blows.strike(0.09, 0.02, |_| 100.0);
    world.run_until(Instant::from_millis(160)).unwrap();
    let peaks: Vec<_> =
        arrivals(&host).iter().map(|(_, frame)| u16::from_le_bytes([frame.data[0], frame.data[1]])).collect();
    let struck = 32_768 + (100.0 / newton_per_code).round() as u16;
    assert_eq!(peaks, [32_768, 32_768, struck, 32_768]);
}

#[test]
fn a_reset_that_the_program_asks_for_starts_it_again() {
    let mut world = world();
    let host = world.bus().attach_host("host");
    let board = world.add_board(BoardSettings::new(1, 0), Untouched, toy);
    world.run_for(Duration::from_millis(100)).unwrap();
    host.send(&Frame::new(0x7FE, &[]).unwrap());
    world.run_for(Duration::from_millis(100)).unwrap();
    let causes: Vec<_> = world.board(board).starts().iter().map(|(_, cause)| *cause).collect();
    assert_eq!(causes, [ResetCause::PowerOn, ResetCause::Software]);
    world.reset(board);
    assert_eq!(world.board(board).starts().last(), Some(&(world.now(), ResetCause::Pin)));
}

#[test]
fn a_watchdog_that_is_not_petted_bites_at_its_instant() {
    let mut world = world();
    let host = world.bus().attach_host("host");
    let settings = BoardSettings { watchdog_patience: Duration::from_millis(50), ..BoardSettings::new(1, 0) };
    let board = world.add_board(settings, Untouched, toy);
    world.run_for(Duration::from_millis(500)).unwrap();
    assert_eq!(world.board(board).starts().len(), 1, "who pets it lives");
    host.send(&Frame::new(0x7FD, &[]).unwrap());
    world.run_for(Duration::from_millis(200)).unwrap();
    let starts = world.board(board).starts();
    assert_eq!(starts.len(), 2);
    assert_eq!(starts[1].1, ResetCause::Watchdog);
    // It was petted last in the millisecond before the frame arrived.
    let silence = starts[1].0 - Instant::from_millis(500);
    assert!((49_000..=51_000).contains(&silence.as_micros()), "{silence:?}");
}

#[test]
fn flash_survives_resets_and_power_cuts_and_an_operation_under_way_is_torn() {
    let mut world = world();
    let read = Rc::new(RefCell::new(Vec::new()));
    let log = read.clone();
    let program = move |parts: Parts| -> Life {
        let log = log.clone();
        Box::pin(async move {
            let mut flash = parts.flash;
            let mut bytes = [0; 8];
            flash.read(0, &mut bytes).await.unwrap();
            log.borrow_mut().push(bytes);
            let lives = log.borrow().len();
            match parts.identity.reset_cause {
                ResetCause::PowerOn if lives == 1 => {
                    flash.write(0, &[0x11; 16]).await.unwrap();
                    ResetCause::Software
                }
                ResetCause::Software => {
                    flash.erase(0, flash.capacity() as u32).await.unwrap();
                    unreachable!("the power goes");
                }
                _ => std::future::pending().await,
            }
        })
    };
    let board = world.add_board(BoardSettings::new(1, 0), Untouched, program);
    world.board(board).flash().cut_power_after(16 + 100);
    world.run_until(Instant::from_millis(100)).unwrap();
    assert!(!world.board(board).is_powered());
    assert_eq!(read.borrow()[..], [[0xFF; 8], [0x11; 8]]);
    world.power_on(board);
    world.run_until(Instant::from_millis(200)).unwrap();
    assert_eq!(read.borrow()[2], [0xFF; 8], "100 bytes of the page were erased");
    assert_eq!(world.board(board).flash().operations().torn, 1);
}

#[test]
fn a_program_that_waits_for_what_cannot_come_is_a_deadlock() {
    let mut world = world();
    let program = |parts: Parts| -> Life {
        Box::pin(async move {
            parts.watchdog.stop();
            let mut can = parts.can;
            can.receive().await;
            ResetCause::Software
        })
    };
    world.add_board(BoardSettings::new(7, 0), Untouched, program);
    let stuck = world.run_for(Duration::from_secs(1)).unwrap_err();
    assert!(stuck.to_string().contains("board 7") && stuck.to_string().contains("deadlock"), "{stuck}");
}

#[test]
fn a_program_that_resets_itself_at_once_is_a_livelock() {
    let mut world = world();
    world.add_board(BoardSettings::new(7, 0), Untouched, |_| Box::pin(async { ResetCause::Software }));
    assert!(matches!(world.run_for(Duration::from_secs(1)), Err(Stuck::Livelock { at_us: 0, .. })));
}

#[test]
fn lost_samples_show_as_a_gap_of_the_same_size() {
    let mut world = world();
    let seen = Rc::new(RefCell::new((0, Vec::new())));
    let log = seen.clone();
    let program = move |parts: Parts| -> Life {
        let (log, mut samples, mut watchdog) = (log.clone(), parts.samples, parts.watchdog);
        Box::pin(async move {
            let mut block = [0; BLOCK];
            let mut expected = 0;
            loop {
                watchdog.pet();
                match samples.next_block(&mut block).await {
                    Ok(info) => {
                        assert_eq!(info.first_index, expected);
                        expected += BLOCK as u64;
                        log.borrow_mut().0 += 1;
                    }
                    Err(overrun) => {
                        expected += u64::from(overrun.lost);
                        log.borrow_mut().1.push(overrun.lost);
                    }
                }
            }
        })
    };
    let board = world.add_board(BoardSettings::new(1, 0), Untouched, program);
    world.board(board).lose_samples(1_000, 37);
    world.board(board).lose_samples(10_000, 5);
    world.run_until(Instant::from_secs(60)).unwrap();
    let (blocks, gaps) = seen.take();
    assert_eq!(gaps, [37, 5]);
    assert_eq!(world.board(board).lost_samples(), 42);
    assert_eq!(blocks, (60 * 20_000 - 42) / 8);
}
