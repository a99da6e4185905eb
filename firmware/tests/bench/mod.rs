//! A sensor on a bench: the real tasks on an in-memory board, in virtual time, with a master at the other end of the bus.

pub mod sdo;

use std::cell::{Cell, RefCell};
use std::collections::{HashMap, VecDeque};
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

use embassy_futures::select::{Either, select, select3};
use embassy_time::{Duration, Instant, Timer};
use embassy_time_driver::Driver;
use embassy_time_queue_utils::Queue;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use thud_firmware::board::{
    AdcCode, AskedFlash, BLOCK, BlockInfo, BusState, BusStatus, CanReceive, CanSupervise, CanTransmit, Frame, Identity,
    MailboxesFull, Overrun, Received, ResetCause, Samples, Watchdog,
};
use thud_firmware::capture::{CAPTURE, Captures};
use thud_firmware::shared::Shared;
use thud_firmware::storage::Store;
use thud_firmware::tasks::{self, Board};
use thud_firmware::units::Volt;

// ---- virtual time ----

thread_local! {
    static NOW: Cell<u64> = const { Cell::new(0) };
    static QUEUE: RefCell<Queue> = const { RefCell::new(Queue::new()) };
}

struct Virtual;

impl Driver for Virtual {
    fn now(&self) -> u64 {
        NOW.get()
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        QUEUE.with_borrow_mut(|queue| queue.schedule_wake(at, waker));
    }
}

embassy_time_driver::time_driver_impl!(static DRIVER: Virtual = Virtual);

struct Woken(AtomicBool);

impl Wake for Woken {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Runs a future; whenever nothing is awake, time jumps to the next alarm.
fn run_virtually<T>(future: impl Future<Output = T>) -> T {
    let woken = Arc::new(Woken(AtomicBool::new(true)));
    let waker = Waker::from(woken.clone());
    let mut future = pin!(future);
    loop {
        while woken.0.swap(false, Ordering::Relaxed) {
            if let Poll::Ready(result) = future.as_mut().poll(&mut Context::from_waker(&waker)) {
                return result;
            }
        }
        let next = QUEUE.with_borrow_mut(|queue| queue.next_expiration(NOW.get()));
        if woken.0.load(Ordering::Relaxed) {
            continue;
        }
        assert_ne!(next, u64::MAX, "deadlock: nothing will ever wake");
        NOW.set(next);
        QUEUE.with_borrow_mut(|queue| queue.next_expiration(next));
    }
}

// ---- the board ----

/// 130 bits of a frame of eight bytes with stuffing, at 1 Mbit/s.
const FRAME_TIME: Duration = Duration::from_micros(130);
const MAILBOXES: usize = 3;

#[derive(Default)]
pub struct Wires {
    pub to_sensor: VecDeque<Received>,
    pub mailboxes: Vec<Frame>,
    /// What crossed the bus, with the time of its end.
    pub sent: Vec<(Instant, Frame)>,
    /// Frames from the sensor that the master does not see.
    pub drop_next: Vec<u16>,
    wakers: Vec<Waker>,
    freed: bool,
    pub state: BusState,
    pub recoveries: Vec<Instant>,
    pub pets: Vec<Instant>,
    pub overrun: Option<u32>,
    pub flash_fails: bool,
}

pub type Shed = Rc<RefCell<Wires>>;

fn wake(wires: &mut Wires) {
    wires.wakers.drain(..).for_each(Waker::wake);
}

struct Half(Shed);

impl CanReceive for Half {
    async fn receive(&mut self) -> Received {
        poll_fn(|context| {
            let mut wires = self.0.borrow_mut();
            match wires.to_sensor.pop_front() {
                Some(received) => Poll::Ready(received),
                None => {
                    wires.wakers.push(context.waker().clone());
                    Poll::Pending
                }
            }
        })
        .await
    }
}

impl CanTransmit for Half {
    fn free(&mut self) -> usize {
        MAILBOXES - self.0.borrow().mailboxes.len()
    }

    fn load(&mut self, frame: &Frame) -> Result<(), MailboxesFull> {
        let mut wires = self.0.borrow_mut();
        if wires.mailboxes.len() == MAILBOXES {
            return Err(MailboxesFull);
        }
        wires.mailboxes.push(*frame);
        wake(&mut wires);
        Ok(())
    }

    async fn freed(&mut self) {
        poll_fn(|context| {
            let mut wires = self.0.borrow_mut();
            if std::mem::take(&mut wires.freed) {
                return Poll::Ready(());
            }
            wires.wakers.push(context.waker().clone());
            Poll::Pending
        })
        .await;
    }
}

impl CanSupervise for Half {
    fn status(&mut self) -> BusStatus {
        BusStatus { state: self.0.borrow().state, transmit_errors: 0, receive_errors: 0 }
    }

    fn recover(&mut self) {
        let mut wires = self.0.borrow_mut();
        wires.recoveries.push(Instant::now());
        wires.state = BusState::ErrorActive;
    }
}

impl Watchdog for Half {
    fn pet(&mut self) {
        self.0.borrow_mut().pets.push(Instant::now());
    }
}

/// The bus: one frame at a time, the most urgent of the mailboxes first.
async fn bus(wires: Shed) {
    loop {
        let frame = {
            let mut wires = wires.borrow_mut();
            let first = (0..wires.mailboxes.len()).min_by_key(|place| wires.mailboxes[*place].id);
            let off = wires.state == BusState::BusOff;
            first.filter(|_| !off).map(|first| wires.mailboxes.remove(first))
        };
        match frame {
            Some(frame) => {
                Timer::after(FRAME_TIME).await;
                let mut wires = wires.borrow_mut();
                wires.freed = true;
                match wires.drop_next.iter().position(|id| *id == frame.id) {
                    Some(place) => drop(wires.drop_next.remove(place)),
                    None => wires.sent.push((Instant::now(), frame)),
                }
                wake(&mut wires);
            }
            None => Timer::after(Duration::from_micros(20)).await,
        }
    }
}

/// Half-sine blows of 20 ms on a quiet signal with two codes of noise.
struct Scripted {
    wires: Shed,
    blows: Rc<RefCell<Vec<(u64, f32)>>>,
    next: u64,
    seed: u32,
}

/// Seconds of a blow.
const BLOW_SAMPLES: u64 = 400;

impl Samples for Scripted {
    async fn next_block(&mut self, block: &mut [AdcCode; BLOCK]) -> Result<BlockInfo, Overrun> {
        if let Some(lost) = self.wires.borrow_mut().overrun.take() {
            self.next += u64::from(lost);
            return Err(Overrun { lost });
        }
        let first_index = self.next;
        self.next += BLOCK as u64;
        Timer::at(Instant::from_micros(self.next * 50)).await;
        for (index, code) in (first_index..).zip(block) {
            self.seed = self.seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = ((self.seed >> 24) as f32 / 256.0 + (self.seed >> 16 & 0xFF) as f32 / 256.0 - 1.0) * 4.0;
            let blow: f32 = self
                .blows
                .borrow()
                .iter()
                .filter(|(start, _)| (*start..start + BLOW_SAMPLES).contains(&index))
                .map(|(start, peak)| peak * (std::f32::consts::PI * (index - start) as f32 / BLOW_SAMPLES as f32).sin())
                .sum();
            *code = (32_768.0 + noise + blow / 0.07).round() as u16;
        }
        Ok(BlockInfo { first_index, bias: Volt(11.0) })
    }
}

/// A flash that outlives the sensor.
#[derive(Clone)]
pub struct Flash(pub Rc<RefCell<Vec<u8>>>, Option<Shed>);

impl Flash {
    pub fn new() -> Self {
        Self(Rc::new(RefCell::new(vec![0xFF; 8192])), None)
    }
}

#[derive(Debug)]
pub struct Failed;

impl NorFlashError for Failed {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Flash {
    type Error = Failed;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failed> {
        bytes.copy_from_slice(&self.0.borrow()[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        8192
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 8;
    const ERASE_SIZE: usize = 2048;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Failed> {
        self.0.borrow_mut()[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failed> {
        if self.1.as_ref().is_some_and(|wires| wires.borrow().flash_fails) {
            return Err(Failed);
        }
        let mut flash = self.0.borrow_mut();
        for (place, byte) in flash[offset as usize..].iter_mut().zip(bytes) {
            *place &= byte;
        }
        Ok(())
    }
}

impl AskedFlash for Flash {}

// ---- the master ----

pub struct Master {
    pub wires: Shed,
    pub blows: Rc<RefCell<Vec<(u64, f32)>>>,
    pub shared: &'static Shared<CAPTURE>,
    pub node: u8,
    seen: Cell<usize>,
    /// Up to where the frames of an identifier have been expected.
    expected: RefCell<HashMap<u16, usize>>,
}

impl Master {
    pub fn send(&self, id: u16, bytes: &[u8]) {
        let mut wires = self.wires.borrow_mut();
        wires.to_sensor.push_back(Received::Frame(Frame::new(id, bytes).unwrap()));
        wake(&mut wires);
    }

    pub async fn wait(&self, milliseconds: u64) {
        Timer::after(Duration::from_millis(milliseconds)).await;
    }

    /// Everything that crossed the bus since this was last asked.
    pub fn heard(&self) -> Vec<(Instant, Frame)> {
        let wires = self.wires.borrow();
        let from = self.seen.replace(wires.sent.len());
        wires.sent[from..].to_vec()
    }

    /// The next frame with this identifier that was not heard or expected yet, within so many ms.
    pub async fn expect(&self, id: u16, within_ms: u64) -> Option<Frame> {
        let found = async {
            loop {
                {
                    let wires = self.wires.borrow();
                    let mut expected = self.expected.borrow_mut();
                    let next = expected.entry(id).or_default();
                    *next = self.seen.get().max(*next);
                    while let Some((_, frame)) = wires.sent.get(*next) {
                        *next += 1;
                        if frame.id == id {
                            return *frame;
                        }
                    }
                }
                Timer::after(Duration::from_micros(50)).await;
            }
        };
        match select(found, Timer::after(Duration::from_millis(within_ms))).await {
            Either::First(frame) => Some(frame),
            Either::Second(()) => None,
        }
    }

    pub async fn sdo(&self, request: [u8; 8]) -> [u8; 8] {
        let answer = 0x580 + u16::from(self.node);
        self.expected.borrow_mut().insert(answer, self.wires.borrow().sent.len());
        self.send(0x600 + u16::from(self.node), &request);
        self.expect(answer, 1_000).await.expect("an answer to the SDO").data
    }

    pub fn nmt(&self, command: u8) {
        self.send(0, &[command, self.node]);
    }

    pub fn blow(&self, after_ms: u64, peak: f32) {
        let at = (Instant::now() + Duration::from_millis(after_ms)).as_micros() / 50;
        self.blows.borrow_mut().push((at, peak));
    }
}

/// Runs a sensor with this flash, and the script at the other end of its bus.
pub fn with_sensor<T>(flash: &Flash, script: impl AsyncFnOnce(&Master) -> T) -> T {
    NOW.set(0);
    QUEUE.with_borrow_mut(|queue| *queue = Queue::new());
    let wires = Shed::default();
    let blows = Rc::default();
    let flash = Flash(flash.0.clone(), Some(wires.clone()));
    run_virtually(async {
        let mut store = Store::new(flash, 0..8192);
        let loaded = store.load().await;
        let identity = Identity {
            serial: 0x1234_5678,
            hardware_revision: 0,
            build: 0,
            reset_cause: ResetCause::PowerOn,
            ended_at: 0,
        };
        let captures: &'static Captures<CAPTURE> = Box::leak(Box::new(Captures::new()));
        let shared: &'static Shared<CAPTURE> = Box::leak(Box::new(Shared::new(identity, loaded, captures)));
        let half = || Half(wires.clone());
        let board = Board {
            samples: Scripted { wires: wires.clone(), blows: Rc::clone(&blows), next: 0, seed: 1 },
            receive: half(),
            transmit: half(),
            supervise: half(),
            watchdog: half(),
            store,
        };
        let node = shared.active().configuration.node.node_id;
        let master = Master {
            wires: wires.clone(),
            blows: Rc::clone(&blows),
            shared,
            node,
            seen: Cell::new(0),
            expected: RefCell::default(),
        };
        let sensor = tasks::run(board, shared);
        // A master has never been quicker than the sensor's reading of its flash.
        let script = async {
            master.wait(1).await;
            script(&master).await
        };
        match select3(script, sensor, bus(wires.clone())).await {
            embassy_futures::select::Either3::First(result) => result,
            _ => unreachable!("neither the sensor nor the bus ends"),
        }
    })
}
