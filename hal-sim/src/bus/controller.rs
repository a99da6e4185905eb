//! A CAN controller: mailboxes to send, a buffer to receive, error counters.

use std::cell::RefCell;
use std::future::poll_fn;
use std::rc::Rc;
use std::task::Poll;

use thud_firmware::board::{BusStatus, CanReceive, CanSupervise, CanTransmit, Frame, MailboxesFull, Received};

use super::host_port::Arrival;
use super::wire::Wire;

/// In which order a controller sends what its mailboxes hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SendingOrder {
    /// The lowest identifier first; of equal ones the older.
    Urgency,
    /// The lowest identifier first; of equal ones the lower number of the buffer, whichever is older (Bosch M_CAN, 3.5.4).
    Buffer,
    /// As they were loaded, like a computer's adapter.
    Loading,
}

/// What a controller has seen go wrong on the wire, as its register for the last error code tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeenError {
    /// As a sender: the bus did not carry the bit that was sent.
    Bit,
    /// As a sender: nobody acknowledged.
    Acknowledge,
    /// As a receiver: six equal bits, another node's error flag.
    Stuff,
    /// As a receiver: the checksum was wrong.
    Crc,
}

/// What kind of controller it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControllerSettings {
    /// Frames that can wait to be sent.
    pub mailboxes: usize,
    /// Which of them goes first.
    pub order: SendingOrder,
    /// Frames that can wait to be read; further ones are lost and counted.
    pub receive_depth: usize,
}

impl ControllerSettings {
    /// The FDCAN of an STM32G474: three transmit buffers, a receive FIFO of three (RM0440, 44.3.3).
    pub const STM32G474: Self = Self { mailboxes: 3, order: SendingOrder::Urgency, receive_depth: 3 };
    /// An adapter on a computer with plenty of memory behind it.
    pub const HOST_ADAPTER: Self = Self { mailboxes: usize::MAX, order: SendingOrder::Loading, receive_depth: 65_536 };
}

/// A node's controller; clones are the same controller, so that each half can go to another task.
#[derive(Clone)]
pub struct Controller {
    wire: Rc<RefCell<Wire>>,
    node: usize,
}

impl Controller {
    pub(super) fn new(wire: Rc<RefCell<Wire>>, node: usize) -> Self {
        Self { wire, node }
    }

    /// Number of the node on the bus.
    #[must_use]
    pub fn number(&self) -> usize {
        self.node
    }

    /// Switches the controller on or off. Either way it forgets everything; a frame of its own on the wire is cut.
    pub fn connect(&self, connected: bool) {
        self.wire.borrow_mut().connect(self.node, connected);
    }

    /// Requests transmission from a numbered buffer, as a chip's registers do; see [`SendingOrder::Buffer`].
    ///
    /// # Errors
    /// [`MailboxesFull`] when as many wait as there are mailboxes.
    pub fn load_buffer(&self, buffer: u8, frame: &Frame) -> Result<(), MailboxesFull> {
        self.wire.borrow_mut().load_buffer(self.node, buffer, frame)
    }

    /// The numbered buffers whose frames have not been sent, bit by bit.
    #[must_use]
    pub fn waiting_buffers(&self) -> u32 {
        self.wire.borrow().waiting_buffers(self.node)
    }

    /// The next frame that has arrived, without waiting for it.
    #[must_use]
    pub fn arrival(&self) -> Option<Arrival> {
        self.wire.borrow_mut().take(self.node)
    }

    /// What it last saw go wrong since this was last asked.
    #[must_use]
    pub fn take_error(&self) -> Option<SeenError> {
        self.wire.borrow_mut().take_error(self.node)
    }

    pub(super) fn queue(&self, frame: &Frame) {
        // A host's queue has no end.
        let _ = self.wire.borrow_mut().load(self.node, frame);
    }

    pub(super) fn unsent(&self) -> usize {
        self.wire.borrow().unsent(self.node)
    }

    pub(super) fn has_arrivals(&self) -> bool {
        self.wire.borrow().has_arrivals(self.node)
    }
}

impl CanTransmit for Controller {
    fn free(&mut self) -> usize {
        self.wire.borrow().free(self.node)
    }

    fn load(&mut self, frame: &Frame) -> Result<(), MailboxesFull> {
        self.wire.borrow_mut().load(self.node, frame)
    }

    async fn freed(&mut self) {
        poll_fn(|context| {
            if self.wire.borrow_mut().take_freed(self.node, context.waker()) { Poll::Ready(()) } else { Poll::Pending }
        })
        .await;
    }
}

impl CanReceive for Controller {
    async fn receive(&mut self) -> Received {
        poll_fn(|context| match self.wire.borrow_mut().take_or_wake(self.node, context.waker()) {
            Some(arrival) => Poll::Ready(arrival.received),
            None => Poll::Pending,
        })
        .await
    }
}

impl CanSupervise for Controller {
    fn status(&mut self) -> BusStatus {
        self.wire.borrow().status(self.node)
    }

    fn recover(&mut self) {
        self.wire.borrow_mut().recover(self.node);
    }
}
