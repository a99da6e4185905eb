//! Which stretches of an impact are contacts: the blow, and each time it comes back.
//!
//! The curve is read in groups of 0.25 ms and judged by the mean of the last eight groups (2 ms). A contact is where that
//! mean is above
//!
//! ```text
//! max( onset threshold, 5 % of the highest force so far, 1.2 times the lowest pull so far )      the latter two fade with 0.25 s
//! ```
//!
//! The first guards against noise, the second against what the blow leaves behind: a cell and its mount ring for
//! a tenth of a second at a few per cent of the peak, both ways, so that their mean over 2 ms is lower still. The third
//! guards against a moving piece that swings on its springs after the robot has left: it pulls before it pushes, and pushes
//! less than it has pulled. A robot cannot pull.
//!
//! All of it counts from the rest that friction holds ([`super::rests`]): the one before, until the contact has risen beyond the
//! one that comes after it, and then from that. Where the force stands still there is no contact.
//!
//! Two contacts are told apart when the force has been gone for 5 ms: half a period of the verdict filter's
//! 100 Hz. What comes back sooner is one pulse to that filter, and to the limit it is compared with.

use heapless::Vec;

use super::CONTACTS;
use super::force::{Force, PIECE};
use super::rests::Rests;
use crate::capture::Curve;
use crate::units::{Hertz, Second};

/// Length of a group.
const GROUP: Second = Second(0.000_25);
/// Groups in the running mean.
const GROUPS: usize = 8;
/// The force must be gone this long between two contacts.
pub const GAP: Second = Second(0.005);
/// Share of the highest force so far that is taken for ringing.
const RINGING: f32 = 0.05;
/// A push up to this many times the pull before it is the same swing.
const SWING: f32 = 1.2;
/// Time in which both fade to 1/e.
const FADING: Second = Second(0.25);

/// One contact. Positions are samples from the curve's first one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// First sample of the first group above the threshold.
    pub start: usize,
    /// First sample after the last group above the threshold.
    pub end: usize,
    /// Centre of the highest group.
    pub highest_at: usize,
    /// Mean force of the highest group, N.
    pub highest: f32,
    /// The threshold that was passed, above the rest, N.
    pub threshold: f32,
    /// The rest from which the force rises, N.
    pub before: f32,
    /// The rest to which it comes back, N.
    pub after: f32,
    /// Whether the curve ends before the force has gone.
    pub outlasts_curve: bool,
}

impl Contact {
    /// The contact without what came before it: a robot that moves shakes the sensor, and just before the blow the noise can pass the
    /// threshold here and there. The contact begins where the rise to its first 5 % leaves the threshold for good.
    pub fn without_precursors<C: Curve>(&self, force: &Force<'_, C>, group: usize) -> Self {
        let mut piece = [0.0; PIECE];
        let mut start = None;
        let mut at = self.start;
        while at < self.highest_at && force.read(at, &mut piece[..group]) == group {
            let mean = piece[..group].iter().sum::<f32>() / group as f32 - self.before;
            if mean <= self.threshold {
                start = None;
            } else if start.is_none() {
                start = Some(at);
            }
            if mean > RINGING * (self.highest - self.before) && mean > self.threshold {
                break;
            }
            at += group;
        }
        Self { start: start.unwrap_or(self.start), ..*self }
    }
}

/// The contacts of an impact.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contacts {
    /// The first ones, in the order of time.
    pub found: Vec<Contact, CONTACTS>,
    /// How many more there were.
    pub further: u32,
}

impl Contacts {
    /// Finds the contacts from position `from` on that begin within `window` samples of the first one.
    pub fn find<C: Curve>(
        force: &Force<'_, C>,
        from: usize,
        threshold: f32,
        rate: Hertz,
        window: usize,
        rests: &Rests,
    ) -> Self {
        let group = (libm::roundf(GROUP.0 * rate.0) as usize).clamp(1, PIECE);
        let gap_groups = (libm::ceilf(GAP.0 * rate.0 / group as f32) as usize).saturating_sub(GROUPS).max(1);
        let fade = libm::expf(-(group as f32) / (FADING.0 * rate.0));
        let mut contacts = Self::default();
        let mut search = Search {
            rests,
            base: rests.before,
            means: [rests.before; GROUPS],
            next: 0,
            highest_so_far: 0.0,
            pull_so_far: 0.0,
            fade,
            threshold,
            gap_groups,
            group,
            open: None,
            quiet: 0,
        };
        let mut piece = [0.0; PIECE];
        let mut at = from;
        while at + group <= force.len() && force.read(at, &mut piece[..group]) == group {
            let mean = piece[..group].iter().sum::<f32>() / group as f32;
            let late = contacts.found.first().is_some_and(|first: &Contact| at > first.start + window);
            if late && search.open.is_none() {
                break;
            }
            if let Some(contact) = search.take(at, mean) {
                contacts.add(contact);
            }
            at += group;
        }
        // What began after the detector had seen the last contact end is the next impact's.
        if let Some(mut contact) = search.open.filter(|contact| contact.start <= rests.last_touch) {
            contact.outlasts_curve = true;
            contacts.add(contact);
        }
        contacts
    }

    fn add(&mut self, contact: Contact) {
        if self.found.push(contact).is_err() {
            self.further += 1;
        }
    }
}

struct Search<'a> {
    rests: &'a Rests,
    /// The rest from which the force is counted now.
    base: f32,
    means: [f32; GROUPS],
    next: usize,
    highest_so_far: f32,
    pull_so_far: f32,
    fade: f32,
    threshold: f32,
    gap_groups: usize,
    group: usize,
    open: Option<Contact>,
    quiet: usize,
}

impl Search<'_> {
    /// Takes the group at `at`; gives a contact that is over.
    fn take(&mut self, at: usize, mean: f32) -> Option<Contact> {
        self.means[self.next] = mean;
        self.next = (self.next + 1) % GROUPS;
        let coming = self.rests.at_or_after(at);
        let after = coming.map_or(self.rests.after, |rest| rest.level);
        if coming.is_some_and(|rest| rest.from <= at) {
            self.base = after;
            self.fade();
            // One that has begun where nothing touches was the ringing's.
            let began = coming.map_or(at, |rest| rest.from);
            return self.open.take().filter(|contact| contact.start < began);
        }
        let mean = mean - self.base;
        self.highest_so_far = (self.highest_so_far * self.fade).max(mean);
        let running = self.means.iter().sum::<f32>() / GROUPS as f32 - self.base;
        self.pull_so_far = (self.pull_so_far * self.fade).max(-running);
        let level = self.threshold.max(RINGING * self.highest_so_far).max(SWING * self.pull_so_far);
        let end = at + self.group;
        // Once it is beyond the rest that it will leave, it ends there and not at the one from which it rose.
        if self.open.is_some() && running + self.base > after + level {
            self.base = after;
        }
        let Some(contact) = &mut self.open else {
            if running > level {
                self.open = Some(self.begin(end, level, after));
                self.quiet = 0;
            }
            return None;
        };
        if mean > level {
            contact.end = end;
        }
        if mean + self.base > contact.highest {
            contact.highest = mean + self.base;
            contact.highest_at = at + self.group / 2;
        }
        self.quiet = if running > level { 0 } else { self.quiet + 1 };
        if self.quiet >= self.gap_groups { self.open.take() } else { None }
    }

    /// A group in which nothing touches.
    fn fade(&mut self) {
        self.highest_so_far *= self.fade;
        self.pull_so_far *= self.fade;
        self.quiet = 0;
    }

    /// A contact whose running mean has just passed the level: it began with the first group in the mean that did.
    fn begin(&self, end: usize, level: f32, after: f32) -> Contact {
        let mut contact = Contact {
            start: end - self.group,
            end,
            highest_at: end - self.group / 2,
            highest: f32::NEG_INFINITY,
            threshold: level,
            before: self.base,
            after,
            outlasts_curve: false,
        };
        let mut begun = false;
        for age in (0..GROUPS).rev() {
            let mean = self.means[(self.next + GROUPS - 1 - age) % GROUPS];
            let start = end.saturating_sub((age + 1) * self.group);
            if mean - self.base > level && !begun {
                begun = true;
                contact.start = start;
            }
            if mean > contact.highest {
                contact.highest = mean;
                contact.highest_at = start + self.group / 2;
            }
        }
        contact
    }
}
