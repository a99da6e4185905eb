//! What the tasks of one sensor share.
//!
//! ```text
//! sampler ──finished impacts──▶ evaluator ──events──▶ log ──▶ node ──frames──▶ outbox ──▶ transmit
//!    │  └───────────── alarm ─────────────────────────────────────────────────────▲
//!    ◀── configuration, effective mass ── node (SDO, RPDO)
//! ```
//!
//! One value per sensor and no process-global statics, so that a simulation can hold many. Locks are critical sections
//! that copy a few bytes; nothing is computed inside. Queues, and why they cannot do harm when they fill:
//! - `finished` holds two impacts, as many as there are capture slots; a third is counted as not evaluated;
//! - events are not queued at all: the node reads them from the log by number;
//! - a new configuration or effective mass replaces one that was not yet taken;
//! - fault reports that do not fit are counted with the refused frames.

use core::cell::{Cell, RefCell};

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_sync::waitqueue::AtomicWaker;

use crate::board::{BusStatus, Frame, Identity};
use crate::capture::{Captures, SlotId};
use crate::configuration_lock::ConfigurationLock;
use crate::detector::{ImpactContext, Stamped};
use crate::dictionary::frame::{Alarm, ForecastFrame, PARTS};
use crate::dictionary::settings::Settings;
use crate::emergency::Fault;
use crate::event::{Event, Onset};
use crate::event_log::EventLog;
use crate::forecast::Forecast;
use crate::outbox::{Full, Outbox};
use crate::storage::Loaded;
use crate::stream;
use crate::units::{Hertz, Kilogram, Newton};

/// Events that the log holds.
pub const EVENTS: usize = 48;
/// Frames that the outbox holds: two events, a few SDO segments and the reserved places.
pub const OUTBOX: usize = 24;

type Lock<T> = Mutex<CriticalSectionRawMutex, T>;

/// What has been lost since power-up, beside what the outbox and the log count; object 0x2400.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Counters {
    /// Gaps in the samples.
    pub overruns: u32,
    /// Samples in these gaps.
    pub lost_samples: u32,
    /// Frames that the receive buffer lost.
    pub not_received: u32,
    /// Curves that were overwritten while they were being downloaded.
    pub torn_downloads: u32,
    /// Times that the controller went bus-off.
    pub bus_off: u32,
    /// Impacts for whose evaluation there was no room.
    pub not_evaluated: u32,
    /// Alarms that were not sent because the node was not Operational or its alarm switched off.
    pub alarms_withheld: u32,
    /// Events that left the log before they could be sent.
    pub not_sent: u32,
    /// Times that the configuration could not be written.
    pub storage_failures: u32,
    /// Fault reports that found no room.
    pub faults_untold: u32,
    /// Frames of the stream that gave way to more urgent ones.
    pub stream_dropped: u32,
    /// Changes of the configuration that were not signed by the key, or replayed.
    pub changes_rejected: u32,
}

/// What the detector says about itself; object 0x2403.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DetectorStatus {
    /// Number of the next sample.
    pub next_index: u64,
    /// Code at no force.
    pub zero: f32,
    /// Noise, root mean square.
    pub noise: Newton,
    /// Amplitude of the hum.
    pub hum: Newton,
    /// Force of an onset now.
    pub threshold: Newton,
    /// Whether it has settled.
    pub settled: bool,
    /// Whether an impact is open.
    pub impact_open: bool,
}

/// What is known about the curve in a slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recording {
    /// Number of the impact.
    pub impact: u32,
    /// Number of the curve's first sample.
    pub first_index: u64,
    /// Samples.
    pub length: u32,
    /// CRC-32 (ISO-HDLC) of the samples as little-endian bytes.
    pub crc: u32,
    /// Samples per second.
    pub sample_rate: Hertz,
    /// Newtons in a code.
    pub newton_per_code: f32,
    /// Code at no force when the impact began.
    pub zero: f32,
    /// Sample of the onset.
    pub onset_index: u64,
    /// Revision of the configuration.
    pub revision: u32,
    /// Hash of the configuration.
    pub hash: u32,
}

/// A fault appeared with a detail, or has gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Report {
    /// It appeared, or the loss happened.
    Raised(Fault, u32),
    /// It has gone.
    Cleared(Fault),
}

/// A task that the supervisor waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[expect(missing_docs, reason = "each is the task of the same name")]
pub enum Task {
    Sampler = 0,
    Evaluator = 1,
    Node = 2,
    Transmit = 3,
    Storage = 4,
    /// What empties a controller, where a task does that.
    Reception = 5,
    Log = 6,
}

/// Bits of the tasks that every board has; the others are waited for from [`Shared::watch`] on.
const EVERYWHERE: u8 = 0b1_1111;

/// The parts that the tasks of one sensor share.
pub struct Shared<const N: usize> {
    /// What the board knows about itself.
    pub identity: Identity,
    /// What storage held at start.
    pub loaded: Loaded,
    /// The force curves.
    pub captures: &'static Captures<N>,
    pub(crate) settings: Lock<RefCell<Settings>>,
    pub(crate) log: Lock<RefCell<EventLog<EVENTS>>>,
    pub(crate) recordings: Lock<Cell<[Option<Recording>; 2]>>,
    pub(crate) detector: Lock<Cell<DetectorStatus>>,
    pub(crate) bus: Lock<Cell<BusStatus>>,
    pub(crate) finished: Channel<CriticalSectionRawMutex, ImpactContext, 2>,
    pub(crate) configure: Signal<CriticalSectionRawMutex, Stamped>,
    pub(crate) mass: Signal<CriticalSectionRawMutex, Kilogram>,
    pub(crate) store: Signal<CriticalSectionRawMutex, ()>,
    pub(crate) reports: Channel<CriticalSectionRawMutex, Report, 16>,
    pub(crate) node_wake: Signal<CriticalSectionRawMutex, ()>,
    /// Woken when an impact is over, and while it is open as often as a task must live.
    pub(crate) impact_over: AtomicWaker,
    pub(crate) outbox_filled: Signal<CriticalSectionRawMutex, ()>,
    outbox: Lock<RefCell<Outbox<OUTBOX>>>,
    counters: Lock<Cell<Counters>>,
    alarm_id: Lock<Cell<Option<u16>>>,
    last_alarm: Lock<Cell<[u8; 8]>>,
    last_forecast: Lock<Cell<[u8; 8]>>,
    forecast_id: Lock<Cell<Option<u16>>>,
    /// Samples in a value of the stream (0 off) and where it goes.
    streamed: Lock<Cell<(u16, u16)>>,
    last_samples: Lock<Cell<[u8; 8]>>,
    /// `None` until it has been read from flash.
    configuration_lock: Lock<Cell<Option<ConfigurationLock>>>,
    start: Lock<Cell<u32>>,
    watched: Lock<Cell<u8>>,
    alive: Lock<Cell<u8>>,
}

impl<const N: usize> Shared<N> {
    /// The shared parts of a sensor that has just started.
    #[must_use]
    pub fn new(identity: Identity, loaded: Loaded, captures: &'static Captures<N>) -> Self {
        Self {
            identity,
            loaded,
            captures,
            settings: Mutex::new(RefCell::new(Settings::new(loaded.or_default()))),
            log: Mutex::new(RefCell::new(EventLog::new())),
            recordings: Mutex::new(Cell::new([None; 2])),
            detector: Mutex::new(Cell::new(DetectorStatus::default())),
            bus: Mutex::new(Cell::new(BusStatus::default())),
            finished: Channel::new(),
            configure: Signal::new(),
            mass: Signal::new(),
            store: Signal::new(),
            reports: Channel::new(),
            node_wake: Signal::new(),
            impact_over: AtomicWaker::new(),
            outbox_filled: Signal::new(),
            outbox: Mutex::new(RefCell::new(Outbox::new())),
            counters: Mutex::new(Cell::new(Counters::default())),
            alarm_id: Mutex::new(Cell::new(None)),
            last_alarm: Mutex::new(Cell::new([0; 8])),
            forecast_id: Mutex::new(Cell::new(None)),
            last_forecast: Mutex::new(Cell::new([0; 8])),
            streamed: Mutex::new(Cell::new((0, 0))),
            last_samples: Mutex::new(Cell::new([0; 8])),
            configuration_lock: Mutex::new(Cell::new(None)),
            start: Mutex::new(Cell::new(0)),
            watched: Mutex::new(Cell::new(EVERYWHERE)),
            alive: Mutex::new(Cell::new(0)),
        }
    }

    /// The active configuration with its stamp.
    #[must_use]
    pub fn active(&self) -> Stamped {
        self.settings.lock(|settings| settings.borrow().active())
    }

    /// What has been lost.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters.lock(Cell::get)
    }

    pub(crate) fn count(&self, change: impl FnOnce(&mut Counters)) {
        self.counters.lock(|cell| {
            let mut counters = cell.get();
            change(&mut counters);
            cell.set(counters);
        });
    }

    /// What the detector says about itself.
    #[must_use]
    pub fn detector(&self) -> DetectorStatus {
        self.detector.lock(Cell::get)
    }

    /// What is known about the curve in a slot.
    #[must_use]
    pub fn recording(&self, slot: SlotId) -> Option<Recording> {
        self.recordings.lock(Cell::get).get(usize::from(slot.0)).copied().flatten()
    }

    pub(crate) fn set_recording(&self, slot: SlotId, recording: Recording) {
        self.recordings.lock(|cell| {
            let mut recordings = cell.get();
            if let Some(place) = recordings.get_mut(usize::from(slot.0)) {
                *place = Some(recording);
            }
            cell.set(recordings);
        });
    }

    /// The event with this number, if the log still holds it.
    #[must_use]
    pub fn event(&self, number: u32) -> Option<Event> {
        self.log.lock(|log| log.borrow().get(number).copied())
    }

    /// Lets the watchdog bite if this task, which not every board has, does not live.
    pub fn watch(&self, task: Task) {
        self.watched.lock(|watched| watched.set(watched.get() | 1 << task as u8));
    }

    /// Says that a task has lived.
    pub fn lives(&self, task: Task) {
        self.alive.lock(|alive| alive.set(alive.get() | 1 << task as u8));
    }

    /// Whether every task has lived since this was last true.
    pub(crate) fn all_have_lived(&self) -> bool {
        self.alive.lock(|alive| {
            let all = alive.get() == self.watched.lock(Cell::get);
            if all {
                alive.set(0);
            }
            all
        })
    }

    /// Queues the alarm of an onset, at once and past everything else.
    pub(crate) fn raise_alarm(&self, onset: &Onset) {
        let data = Alarm::encode(onset);
        self.last_alarm.lock(|last| last.set(data));
        match self.alarm_id.lock(Cell::get).and_then(|id| Frame::new(id, &data)) {
            // Refused only when the whole queue is alarms; the outbox counts it.
            Some(frame) => drop(self.send_urgent(frame)),
            None => self.count(|counters| counters.alarms_withheld = counters.alarms_withheld.saturating_add(1)),
        }
    }

    /// Queues the forecast of an impact.
    pub(crate) fn tell_forecast(&self, impact: u32, forecast: &Forecast, samples: u16) {
        let data = ForecastFrame::encode(impact, forecast, samples);
        self.last_forecast.lock(|last| last.set(data));
        if let Some(frame) = self.forecast_id.lock(Cell::get).and_then(|id| Frame::new(id, &data)) {
            // Refused only when the outbox is full of more urgent frames; it counts that.
            let _ = self.send(frame);
        }
    }

    pub(crate) fn last_forecast(&self) -> [u8; 8] {
        self.last_forecast.lock(Cell::get)
    }

    /// Where forecasts go; `None` while they must not.
    pub(crate) fn route_forecast(&self, id: Option<u16>) {
        self.forecast_id.lock(|cell| cell.set(id));
    }

    pub(crate) fn last_alarm(&self) -> [u8; 8] {
        self.last_alarm.lock(Cell::get)
    }

    /// Where alarms go; `None` while they must not.
    pub(crate) fn route_alarm(&self, id: Option<u16>) {
        self.alarm_id.lock(|cell| cell.set(id));
    }

    /// Where the stream goes and how many samples a value of it has; `None` while it must not.
    pub(crate) fn route_stream(&self, to: Option<(u16, u16)>) {
        self.streamed.lock(|cell| cell.set(to.unwrap_or((0, 0))));
    }

    /// Samples in a value of the stream; 0 while there is none.
    pub(crate) fn decimation(&self) -> u16 {
        self.streamed.lock(|cell| cell.get().0)
    }

    /// Queues a frame of the stream, unless more urgent ones need the room.
    pub(crate) fn send_samples(&self, data: [u8; 8]) {
        let (decimation, id) = self.streamed.lock(Cell::get);
        let Some(frame) = Frame::new(id, &data).filter(|_| decimation > 0) else { return };
        self.last_samples.lock(|last| last.set(data));
        let queued = self.outbox.lock(|outbox| {
            let mut outbox = outbox.borrow_mut();
            // What an event takes stays free, and an upload gets its turn.
            let may = outbox.waiting(id) < stream::WAITING && outbox.room() > PARTS;
            may && outbox.push(frame).is_ok()
        });
        if queued {
            self.outbox_filled.signal(());
        } else {
            self.count(|counters| counters.stream_dropped = counters.stream_dropped.saturating_add(1));
        }
    }

    pub(crate) fn last_samples(&self) -> [u8; 8] {
        self.last_samples.lock(Cell::get)
    }

    /// The lock on the configuration; `None` until it has been read from flash.
    #[must_use]
    pub fn lock(&self) -> Option<ConfigurationLock> {
        self.configuration_lock.lock(Cell::get)
    }

    pub(crate) fn with_lock<R>(&self, with: impl FnOnce(&mut Option<ConfigurationLock>) -> R) -> R {
        self.configuration_lock.lock(|cell| {
            let mut lock = cell.get();
            let result = with(&mut lock);
            cell.set(lock);
            result
        })
    }

    /// How often the board has started, this time included; 0 until that has been read from flash. Event numbers begin anew
    /// with each start.
    #[must_use]
    pub fn start(&self) -> u32 {
        self.start.lock(Cell::get)
    }

    pub(crate) fn set_start(&self, start: u32) {
        self.start.lock(|cell| cell.set(start));
    }

    /// Tells the node about a fault.
    pub(crate) fn report(&self, report: Report) {
        if self.reports.try_send(report).is_err() {
            self.count(|counters| counters.faults_untold = counters.faults_untold.saturating_add(1));
        }
        self.node_wake.signal(());
    }

    pub(crate) fn send(&self, frame: Frame) -> Result<(), Full> {
        let queued = self.outbox.lock(|outbox| outbox.borrow_mut().push(frame));
        self.outbox_filled.signal(());
        queued
    }

    pub(crate) fn send_urgent(&self, frame: Frame) -> Result<(), Full> {
        let queued = self.outbox.lock(|outbox| outbox.borrow_mut().push_urgent(frame));
        self.outbox_filled.signal(());
        queued
    }

    /// Empties the outbox and says how many frames waited, as a board without a bus would; for fuzzing.
    #[doc(hidden)]
    pub fn forget_frames(&self) -> usize {
        self.with_outbox(|outbox| core::iter::from_fn(|| outbox.pop()).count())
    }

    pub(crate) fn with_outbox<R>(&self, with: impl FnOnce(&mut Outbox<OUTBOX>) -> R) -> R {
        self.outbox.lock(|outbox| with(&mut outbox.borrow_mut()))
    }
}

#[cfg(test)]
mod tests {
    use std::boxed::Box;

    use super::*;
    use crate::board::ResetCause;

    #[test]
    fn the_watchdog_is_fed_only_when_each_task_that_there_is_has_lived() {
        let identity =
            Identity { serial: 1, hardware_revision: 0, build: 0, reset_cause: ResetCause::PowerOn, ended_at: 0 };
        let shared = Shared::<64>::new(identity, Loaded::Nothing, Box::leak(Box::new(Captures::new())));
        let everywhere = [Task::Sampler, Task::Evaluator, Task::Node, Task::Transmit, Task::Storage];
        let live = |tasks: &[Task]| tasks.iter().for_each(|task| shared.lives(*task));
        for missing in 0..everywhere.len() {
            live(&everywhere[..missing]);
            live(&everywhere[missing + 1..]);
            assert!(!shared.all_have_lived(), "without {:?}", everywhere[missing]);
            live(&everywhere[missing..=missing]);
            assert!(shared.all_have_lived());
            assert!(!shared.all_have_lived(), "each time anew");
        }
        shared.watch(Task::Reception);
        live(&everywhere);
        assert!(!shared.all_have_lived(), "without what this board has beside");
        live(&[Task::Reception]);
        assert!(shared.all_have_lived());
    }
}
