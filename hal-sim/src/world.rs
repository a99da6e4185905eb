//! A bus with boards on it, and the loop that moves them through virtual time.
//!
//! ```text
//! loop: tasks run until quiet ─▶ resets that are due ─▶ the bus, if free, lets the most urgent frame start
//!       ─▶ jump to the next alarm, bus event or watchdog bite
//! ```
//!
//! The world runs only inside its `run_…` methods. Between them a host sends and collects frames through its
//! [`HostPort`], orders blows, breaks cables, cuts power. To live in real time, call [`World::advance_to`] with the
//! time that has passed.
//!
//! ```
//! use embassy_time::Duration;
//! use thud_firmware::board::{Frame, Received};
//! use thud_sim::{board::{BoardSettings, firmware}, bus::BitRate, force::Blows, world::World};
//!
//! # fn main() -> Result<(), thud_sim::time::Stuck> {
//! let mut world = World::new(BitRate::MEGABIT, 1);
//! let host = world.bus().attach_host("host");
//! let blows = Blows::new();
//! world.add_board(BoardSettings::new(1, 1), blows.clone(), firmware);
//! // The first frame is the boot-up message of node 0x20.
//! let arrival = world.run_until_arrival(&host, world.now() + Duration::from_secs(1))?;
//! assert_eq!(arrival.map(|arrival| arrival.received), Some(Received::Frame(Frame { id: 0x720, len: 1, data: [0; 8] })));
//! // A blow of 20 ms and 100 N, 7 s after the start of the world.
//! blows.strike(7.0, 0.020, |since_s| 100.0 * (std::f64::consts::PI * since_s / 0.020).sin());
//! world.run_for(Duration::from_secs(10))
//! # }
//! ```

use embassy_time::{Duration, Instant};
use thud_firmware::board::ResetCause;

use crate::board::{Board, BoardSettings, Due, Life, Parts};
use crate::bus::{Arrival, BitRate, Bus, HostPort};
use crate::force::ForceSource;
use crate::time::{Scheduler, Stuck};

/// More resets at one instant than this: the firmware resets itself as soon as it starts.
const RESETS_AT_ONE_INSTANT: u32 = 1_000;

/// Names a board of a world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoardId(usize);

/// A bus with boards on it.
pub struct World {
    scheduler: Scheduler,
    bus: Bus,
    boards: Vec<Board>,
}

impl World {
    /// A bus without boards at time zero. The seed is for disturbances and generated traffic on the bus.
    #[must_use]
    pub fn new(rate: BitRate, seed: u64) -> Self {
        Self { scheduler: Scheduler::new(), bus: Bus::new(rate, seed), boards: Vec::new() }
    }

    /// The bus: to attach hosts and traffic, disturb it, and read its record.
    #[must_use]
    pub fn bus(&self) -> &Bus {
        &self.bus
    }

    /// Puts a board on the bus and switches it on.
    pub fn add_board(
        &mut self,
        settings: BoardSettings,
        force: impl ForceSource + 'static,
        program: impl Fn(Parts) -> Life + 'static,
    ) -> BoardId {
        let slot = self.scheduler.add(settings.name());
        self.boards.push(Board::new(settings, force, Box::new(program), slot, &self.bus));
        let id = BoardId(self.boards.len() - 1);
        self.start(id, ResetCause::PowerOn);
        id
    }

    /// A board.
    #[must_use]
    pub fn board(&self, id: BoardId) -> &Board {
        &self.boards[id.0]
    }

    /// All boards.
    pub fn boards(&self) -> impl Iterator<Item = (BoardId, &Board)> {
        self.boards.iter().enumerate().map(|(index, board)| (BoardId(index), board))
    }

    /// Cuts the power of a board now.
    pub fn power_off(&mut self, id: BoardId) {
        self.boards[id.0].stop();
        self.scheduler.stop(self.boards[id.0].slot());
    }

    /// Gives a board its power back; one that has it is reset by the brown-out in between.
    pub fn power_on(&mut self, id: BoardId) {
        let cause = if self.boards[id.0].is_powered() { ResetCause::BrownOut } else { ResetCause::PowerOn };
        self.start(id, cause);
    }

    /// Presses a board's reset button.
    pub fn reset(&mut self, id: BoardId) {
        self.start(id, ResetCause::Pin);
    }

    /// What time it is.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.scheduler.clock().now()
    }

    /// Runs until `limit`; whatever happens at that very instant has happened.
    ///
    /// # Errors
    /// [`Stuck`], when the firmware waits for what cannot come, or spins.
    pub fn run_until(&mut self, limit: Instant) -> Result<(), Stuck> {
        while self.step(limit)? {}
        Ok(())
    }

    /// Runs for some time.
    ///
    /// # Errors
    /// As [`Self::run_until`].
    pub fn run_for(&mut self, duration: Duration) -> Result<(), Stuck> {
        self.run_until(self.now() + duration)
    }

    /// Runs until this much time has passed since the world began; if it has already, only what is due now happens.
    ///
    /// # Errors
    /// As [`Self::run_until`].
    pub fn advance_to(&mut self, elapsed: std::time::Duration) -> Result<(), Stuck> {
        let elapsed_us = u64::try_from(elapsed.as_micros()).unwrap_or(u64::MAX);
        self.run_until(Instant::from_micros(elapsed_us).max(self.now()))
    }

    /// Runs until something has arrived at a host, or until `deadline`.
    ///
    /// # Errors
    /// As [`Self::run_until`].
    pub fn run_until_arrival(&mut self, host: &HostPort, deadline: Instant) -> Result<Option<Arrival>, Stuck> {
        loop {
            if let Some(arrival) = host.receive() {
                return Ok(Some(arrival));
            }
            if !self.step(deadline)? {
                return Ok(host.receive());
            }
        }
    }

    /// Lets everything happen that is to happen now, then jumps to the next event, `limit` at the latest. Gives whether
    /// there is more to do before `limit`.
    ///
    /// # Errors
    /// As [`Self::run_until`].
    pub fn step(&mut self, limit: Instant) -> Result<bool, Stuck> {
        let alarm = self.settle()?;
        self.bus.arbitrate(self.now());
        let watchdog = self.boards.iter().filter_map(Board::next_event).min();
        let Some(next) = [alarm, self.bus.next_event(), watchdog].into_iter().flatten().min() else {
            self.scheduler.nothing_will_come()?;
            self.jump_to(limit);
            return Ok(false);
        };
        if next <= limit {
            self.jump_to(next);
            return Ok(true);
        }
        self.jump_to(limit);
        Ok(false)
    }

    fn jump_to(&mut self, instant: Instant) {
        // The bus first: what arrives at this instant is there when the tasks look.
        self.bus.advance(instant);
        self.scheduler.clock().jump_to(instant);
    }

    fn settle(&mut self) -> Result<Option<Instant>, Stuck> {
        for _ in 0..RESETS_AT_ONE_INSTANT {
            let alarm = self.scheduler.settle()?;
            let now = self.now();
            let due = self.boards.iter().enumerate().find_map(|(index, board)| Some((index, board.due(now)?)));
            match due {
                None => return Ok(alarm),
                Some((index, Due::Reset(cause))) => self.start(BoardId(index), cause),
                Some((index, Due::PowerLost)) => self.power_off(BoardId(index)),
            }
        }
        let awake = self.boards.iter().map(|board| board.settings().name()).collect();
        Err(Stuck::Livelock { at_us: self.now().as_micros(), awake })
    }

    fn start(&mut self, id: BoardId, cause: ResetCause) {
        let now = self.now();
        let board = &mut self.boards[id.0];
        // First everything of the old life ends, so that a flash operation under way is torn before the new life reads.
        self.scheduler.stop(board.slot());
        board.stop();
        let life = board.start(now, cause);
        self.scheduler.start(board.slot(), life);
    }
}

#[cfg(test)]
mod tests;
