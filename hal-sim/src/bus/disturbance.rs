//! What goes wrong on the wire.

/// Which attempts to send a frame are destroyed.
///
/// A disturbance flips one bit between the control field and the end of the CRC, at a place drawn from the bus's
/// seed; the sender sees it at once, because it listens to itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Disturbance {
    /// None.
    #[default]
    None,
    /// Each attempt with this probability, 0 to 1. At 1 every sender ends in bus-off.
    Probability(f64),
    /// The next attempts, this many of them.
    Next(u32),
    /// One attempt, after this many that succeed.
    After(u32),
    /// The receiver of one node misreads the next attempts of others: it alone finds their CRC wrong.
    Receiver {
        /// Number of the node, [`super::Controller::number`].
        node: usize,
        /// How many attempts.
        attempts: u32,
    },
}
