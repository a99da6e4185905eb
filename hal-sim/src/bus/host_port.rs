//! The bus as a host sees it.

use embassy_time::Instant;
use thud_firmware::board::{BusStatus, CanSupervise as _, Frame, Received};

use super::Controller;

/// A frame, or the news of a loss, with the instant at which it was complete on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// When.
    pub at: Instant,
    /// What.
    pub received: Received,
}

/// A CAN adapter for code that is not a task of the world: it sends and collects between two runs of the world.
///
/// Frames leave in the order in which they were given; what arrives waits here, 65536 frames of it, and beyond
/// that the number of those lost.
pub struct HostPort {
    controller: Controller,
}

impl HostPort {
    pub(super) fn new(controller: Controller) -> Self {
        Self { controller }
    }

    /// Queues a frame; it goes out when the world runs.
    pub fn send(&self, frame: &Frame) {
        self.controller.queue(frame);
    }

    /// The next arrival, if there is one.
    #[must_use]
    pub fn receive(&self) -> Option<Arrival> {
        self.controller.arrival()
    }

    /// Frames that wait to be sent.
    #[must_use]
    pub fn unsent(&self) -> usize {
        self.controller.unsent()
    }

    /// Whether something has arrived.
    #[must_use]
    pub fn has_arrivals(&self) -> bool {
        self.controller.has_arrivals()
    }

    /// Error state of its controller.
    #[must_use]
    pub fn status(&self) -> BusStatus {
        self.controller.clone().status()
    }

    /// Starts recovery from bus-off.
    pub fn recover(&self) {
        self.controller.clone().recover();
    }

    /// Number of the node, as in [`super::Attempt::senders`].
    #[must_use]
    pub fn number(&self) -> usize {
        self.controller.number()
    }

    /// Pulls the plug, or puts it back; whatever waited to be sent is dropped.
    pub fn connect(&self, connected: bool) {
        self.controller.connect(connected);
    }
}
