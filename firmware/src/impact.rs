//! From a captured curve to events: instant of contact, peaks, impulse, duration, rebounds, verdict.
//!
//! ```text
//! curve ─▶ force ─▶ contacts ─▶ flank (begin, end) ─▶ impulse, duration ─┐
//!            │          └─────▶ peak ────────────────────────────────────┼─▶ event ◀─ severity
//!            └─▶ verdict filter ─▶ filtered peaks ───────────────────────┘
//! ```
//!
//! Runs at low priority when an impact is over and may take tens of milliseconds on the board. It reads the frozen
//! curve in pieces of 128 samples and keeps some 5 KiB on the stack.

use core::cell::Cell;

use heapless::Vec;

use crate::capture::{Curve, OVERLAP};
use crate::configuration::FilterProfile;
use crate::detector::{ImpactContext, TRANSIENT_WINDOW};
use crate::event::{Event, Flags};
use crate::filter::LowPass;
use crate::severity::{self, Measured};
use crate::units::{Newton, NewtonSecond, SampleInstant, Second};

use self::contacts::{Contact, Contacts};
use self::flank::{Direction, Flank};
use self::force::Force;
use self::rests::Rests;

mod arc;
mod contacts;
mod flank;
mod force;
mod impulse;
mod least_squares;
mod peak;
mod rests;
mod ring;
mod stretch;
mod two_bodies;
mod verdict_filter;

/// Most contacts of one impact that become events. Further ones are not lost for the judgement (the blow's transient
/// force is the largest of the whole window), but have no event of their own; the last event is then flagged
/// [`Flags::TRUNCATED`].
pub const CONTACTS: usize = 16;

/// Share that the verdict filter may take off the raw peak before the pulse counts as short.
const SHORT_PULSE: f32 = 0.1;
/// The verdict filter starts this long before the first contact, at rest, s: two periods of 100 Hz.
const LEAD_IN: Second = Second(0.02);

/// Measures and judges every contact of a finished impact.
///
/// `first_number` is the number of the first event; the others follow it. There is at least one event, even when the
/// curve has been overwritten in the meantime: it is then flagged [`Flags::LOST_SAMPLES`] and holds no forces.
///
/// A contact that begins after the transient window is no event of its own; its force belongs to the quasi-static one.
#[must_use]
pub fn evaluate(curve: &impl Curve, context: &ImpactContext, first_number: u32) -> Vec<Event, CONTACTS> {
    let work = Cell::new(0);
    let force = Force::new(curve, context, &work);
    let chain = &context.configuration.configuration.chain;
    let rate = chain.sample_rate;
    let noticed = usize::try_from(context.onset.noticed_at.wrapping_sub(curve.first_index())).unwrap_or(usize::MAX);
    let mut events = Vec::new();
    if noticed >= force.len() {
        let _ = events.push(without_curve(context, first_number));
        return events;
    }
    let window = (TRANSIENT_WINDOW.0 * rate.0) as usize;
    // The limited mean of the onset sees a force up to eight samples late, a slow one passes 2 ms later into the contacts' mean.
    // One that began before the impact before it was closed was noticed at once when it was, and may be as old as that curve's end.
    let at_once = noticed <= OVERLAP + 2 * crate::onset::WINDOW;
    let from = if at_once { 0 } else { noticed.saturating_sub((0.002 * rate.0) as usize) };
    let rests = Rests::find(&force, from, context);
    let mut contacts = Contacts::find(&force, from, context.onset.threshold.0, rate, window, &rests);
    if contacts.found.is_empty() {
        let _ = contacts.found.push(brief(context, noticed));
    }
    let measured = measure(&force, context, &contacts.found);
    let filtered = filter(&force, context, &measured, window);
    let count = measured.len();
    for (index, raw) in measured.iter().enumerate() {
        let last = index + 1 == count;
        let mut flags = context.flags;
        flags.set(Flags::REBOUND, index > 0);
        flags.set(Flags::REST, raw.on_rest);
        flags.set(Flags::HELD, last && context.flags.contains(Flags::HELD));
        flags.set(Flags::TRUNCATED, last && (context.flags.contains(Flags::TRUNCATED) || contacts.further > 0));
        let event = judge(context, curve.first_index(), raw, &filtered, index, flags, first_number);
        let _ = events.push(event);
    }
    events
}

/// What is measured of one contact before it is filtered.
#[derive(Clone, Copy)]
struct Raw {
    begin: f32,
    end: f32,
    /// Whether the contact goes on after the end of the curve.
    goes_on: bool,
    /// Whether it began on a rest or left one.
    on_rest: bool,
    peak: peak::Peak,
    /// N·samples.
    impulse: f32,
}

fn measure<C: Curve>(force: &Force<'_, C>, context: &ImpactContext, found: &[Contact]) -> Vec<Raw, CONTACTS> {
    let rate = context.configuration.configuration.chain.sample_rate;
    let group = (libm::roundf(0.000_25 * rate.0) as usize).max(1);
    let noise = context.noise.0;
    let mut measured: Vec<Raw, CONTACTS> = Vec::new();
    for (index, contact) in found.iter().enumerate() {
        let peak = peak::find(force, contact.highest_at, group, (contact.start, contact.end), noise);
        let before = measured.last().map_or(0, |raw| libm::ceilf(raw.end).max(0.0) as usize);
        let after = found.get(index + 1).map_or(force.len(), |next| next.start);
        let contact = &contact.without_precursors(force, group);
        let (first, last) = edges(force, contact, peak.force, group);
        let flank = |direction, inside: usize, reach: usize, peak_force: f32| {
            let to_peak = (peak.position - inside as f32).abs();
            let to_end = last.saturating_sub(first);
            Flank { direction, inside, to_peak, to_end, reach, peak: peak_force, noise, rate: rate.0 }
        };
        let reach = first.saturating_sub(before).min(reach(contact, rate.0));
        // A flank begins and ends at the rest that stands there.
        let rising = flank(Direction::Begin, first, reach, peak.force - contact.before);
        let begin = rising.instant(&force.above(contact.before)).position;
        let goes_on = contact.outlasts_curve;
        let end = if goes_on {
            force.len().saturating_sub(1) as f32
        } else {
            let reach = after.saturating_sub(last).min(self::reach(contact, rate.0));
            let falling = flank(Direction::End, last, reach, peak.force - contact.after);
            falling.instant(&force.above(contact.after)).position
        };
        let end = end.max(begin);
        let impulse = impulse::between(force, begin, end, (contact.before, contact.after));
        let on_rest = contact.before != 0.0 || contact.after != 0.0;
        let _ = measured.push(Raw { begin, end, goes_on, on_rest, peak, impulse });
    }
    measured
}

/// How far outside its threshold a contact may begin or end: as long as the contact itself, and 20 ms at most.
fn reach(contact: &Contact, rate: f32) -> usize {
    (contact.end - contact.start).clamp(8, ((0.02 * rate) as usize).max(8))
}

/// First and last sample above the threshold, to a sample, in a contact whose edges are known to a group. The threshold stands
/// on the rest at that edge, and at most halfway to the peak.
fn edges<C: Curve>(force: &Force<'_, C>, contact: &Contact, peak: f32, group: usize) -> (usize, usize) {
    let level = |rest: f32| rest + contact.threshold.min(0.5 * (peak - rest));
    let (before, after) = (level(contact.before), level(contact.after));
    let mut first = None;
    force.for_each(contact.start.saturating_sub(group), contact.start + 2 * group, |at, x| {
        if x > before && first.is_none() {
            first = Some(at);
        }
    });
    let mut last = None;
    force.for_each(contact.end.saturating_sub(2 * group), contact.end + group, |at, x| {
        if x > after {
            last = Some(at);
        }
    });
    let first = first.unwrap_or(contact.start);
    (first, last.unwrap_or(contact.end.saturating_sub(1)).max(first))
}

/// A force that the contacts' slower mean does not see: a few samples around the onset.
fn brief(context: &ImpactContext, noticed: usize) -> Contact {
    Contact {
        start: noticed.saturating_sub(crate::onset::WINDOW - 1),
        end: noticed + 1,
        highest_at: noticed.saturating_sub(crate::onset::WINDOW / 2),
        highest: context.onset.force.0,
        threshold: context.onset.threshold.0,
        before: context.rest_before.0,
        after: context.rest_after.0,
        outlasts_curve: false,
    }
}

/// Filtered maxima.
struct Filtered {
    /// Of each contact.
    contacts: [f32; CONTACTS],
    /// Of the transient window.
    transient: f32,
    /// After it, as far as the curve goes.
    later: f32,
    /// Where it ends.
    window_end: usize,
}

fn filter<C: Curve>(force: &Force<'_, C>, context: &ImpactContext, measured: &[Raw], window: usize) -> Filtered {
    let configuration = &context.configuration.configuration;
    let begin = measured.first().map_or(0, |first| first.begin.max(0.0) as usize);
    let window_end = begin + window;
    let mut filtered = Filtered {
        contacts: [f32::NEG_INFINITY; CONTACTS],
        transient: f32::NEG_INFINITY,
        later: f32::NEG_INFINITY,
        window_end,
    };
    // A contact's stretch reaches to the middle of the pauses beside it.
    let mut until = [usize::MAX; CONTACTS];
    for (index, pair) in measured.windows(2).enumerate() {
        until[index] = (0.5 * (pair[0].end + pair[1].begin)).max(0.0) as usize;
    }
    let take = |at: usize, y: f32| {
        if at < window_end {
            filtered.transient = filtered.transient.max(y);
        } else {
            filtered.later = filtered.later.max(y);
        }
        let contact = until.iter().position(|until| at < *until).unwrap_or(0).min(measured.len() - 1);
        if at < window_end {
            filtered.contacts[contact] = filtered.contacts[contact].max(y);
        }
    };
    let Some(corner) = configuration.filter.corner() else {
        // Without a filter the raw peak is judged. What is held is judged without the noise's own maximum.
        for (raw, peak) in measured.iter().zip(&mut filtered.contacts) {
            *peak = raw.peak.force;
            filtered.transient = filtered.transient.max(raw.peak.force);
        }
        return filtered;
    };
    debug_assert!(configuration.filter != FilterProfile::None);
    let rate = configuration.chain.sample_rate;
    let low_pass = LowPass::of_two_passes(corner, rate);
    let lead_in = (LEAD_IN.0 * rate.0) as usize;
    verdict_filter::backward(force, &low_pass, begin.saturating_sub(lead_in), force.len(), take);
    filtered
}

fn judge(
    context: &ImpactContext,
    origin: u64,
    raw: &Raw,
    filtered: &Filtered,
    index: usize,
    flags: Flags,
    first_number: u32,
) -> Event {
    let configuration = &context.configuration.configuration;
    let rate = configuration.chain.sample_rate;
    // What the codes show happened a little earlier at the cell.
    let delay = configuration.chain.delay.0 * rate.0;
    let seen = SampleInstant::from_offset(origin, raw.begin);
    let mut impulse = raw.impulse / rate.0;
    let mut duration = (raw.end - raw.begin) / rate.0;
    if raw.goes_on {
        impulse += context.impulse_after_curve.0;
        let released = SampleInstant { index: context.last_touch, fraction: 0.0 };
        duration = duration.max(released.since(seen, rate).0);
    }
    let peak = Newton(finite(filtered.contacts[index]));
    let transient = if index == 0 { Newton(finite(filtered.transient)) } else { peak };
    let held = flags.contains(Flags::HELD);
    // As far as the curve goes without phase, after it through the detector's causal filter.
    let later = context.quasi_static.map_or(f32::NEG_INFINITY, |force| force.0).max(filtered.later);
    let measured = Measured {
        transient,
        quasi_static: (held && later.is_finite()).then_some(Newton(later)),
        held: Second(duration),
        peak,
        noise: context.noise,
        effective_mass: context.effective_mass,
    };
    let mut flags = flags;
    // A force that still rises when the window ends is no pulse.
    let within = raw.peak.position < filtered.window_end as f32;
    flags.set(Flags::SHORT_PULSE, within && peak.0 < (1.0 - SHORT_PULSE) * raw.peak.force);
    let (severity, flags) = severity::judge(&measured, configuration, flags);
    Event {
        number: first_number.wrapping_add(index as u32),
        impact: context.impact,
        contact: index as u8,
        flags,
        contact_instant: SampleInstant::from_offset(origin, raw.begin - delay),
        peak_instant: SampleInstant::from_offset(origin, raw.peak.position.max(raw.begin) - delay),
        raw_peak: Newton(raw.peak.force),
        peak,
        impulse: NewtonSecond(impulse),
        duration: Second(duration),
        noise: context.noise,
        severity,
        configuration_revision: context.configuration.revision,
        configuration_hash: context.configuration.hash,
    }
}

/// The event of an impact whose curve is gone.
fn without_curve(context: &ImpactContext, number: u32) -> Event {
    let flags = context.flags | Flags::LOST_SAMPLES;
    let measured = Measured {
        transient: Newton::ZERO,
        quasi_static: context.quasi_static.filter(|_| flags.contains(Flags::HELD)),
        held: Second::ZERO,
        peak: Newton::ZERO,
        noise: context.noise,
        effective_mass: context.effective_mass,
    };
    let (severity, flags) = severity::judge(&measured, &context.configuration.configuration, flags);
    let instant = SampleInstant { index: context.onset.noticed_at, fraction: 0.0 };
    Event {
        number,
        impact: context.impact,
        contact: 0,
        flags,
        contact_instant: instant,
        peak_instant: instant,
        raw_peak: Newton::ZERO,
        peak: Newton::ZERO,
        impulse: NewtonSecond::ZERO,
        duration: Second::ZERO,
        noise: context.noise,
        severity,
        configuration_revision: context.configuration.revision,
        configuration_hash: context.configuration.hash,
    }
}

fn finite(force: f32) -> f32 {
    if force.is_finite() { force } else { 0.0 }
}
