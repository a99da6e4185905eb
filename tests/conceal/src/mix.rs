//! Which cases a run has: the composition of the frozen set, and simpler ones for work on the diagnosis.

use crate::case::{Request, Way};
use crate::draw::Draw;
use crate::effect::{self, Confined, Effect};
use crate::plan::Wish;
use crate::world::Kind;

/// A composition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Mix {
    /// 30 % nothing, 15 % pairs and twins, 10 % a few recordings, 10 % absorbed, 15 % unlisted, the rest every effect at four strengths.
    Frozen,
    /// One listed effect each, every effect at four strengths.
    Single,
    /// Two effects, a third of them twins.
    Pairs,
    /// Nothing hidden.
    Absent,
    /// One effect that the list has not.
    Unlisted,
    /// One effect in a few recordings.
    Conditional,
    /// One effect that the stated values absorb.
    Absorbed,
}

/// Strengths from barely detectable to strong; a case draws one within its range.
pub const STRENGTHS: [(f64, f64); 4] = [(5.0, 10.0), (10.0, 25.0), (25.0, 60.0), (60.0, 150.0)];

fn listed() -> impl Iterator<Item = &'static Effect> {
    effect::ALL.iter().filter(|e| e.listed)
}

fn kind(draw: &mut Draw, effects: &[&Effect]) -> Kind {
    let fits = |kind: Kind| effects.iter().all(|e| e.kinds.contains(&kind));
    if effects.is_empty() {
        return if draw.chance(0.06) {
            Kind::Fall
        } else if draw.chance(0.08) {
            Kind::Drop
        } else {
            Kind::Impact
        };
    }
    if fits(Kind::Drop) && draw.chance(0.08) {
        Kind::Drop
    } else if fits(Kind::Impact) {
        Kind::Impact
    } else {
        Kind::Fall
    }
}

fn request(draw: &mut Draw, way: Way, effects: Vec<(&'static Effect, f64)>, recordings: usize) -> Request {
    let bare: Vec<&Effect> = effects.iter().map(|(e, _)| *e).collect();
    // Peaks agree exactly only where no mass comes down a second time.
    let kind = if way == Way::Absorbed { Kind::Impact } else { kind(draw, &bare) };
    // What is dropped bounces without end in the baseline; nobody records that for seconds.
    let long = draw.chance(0.1) && kind == Kind::Impact;
    let wish = Wish { kind, recordings, long };
    Request { way, effects, without: Vec::new(), wish, seed: draw.seed() }
}

/// Effects that are only a wrong number.
const WRONG_NUMBERS: [&str; 3] = ["gain-error", "pose-dependent-mass", "speed-error"];

/// A strength in one of the four ranges. What is only a wrong number (gain, mass, speed) has strength in units of its stated
/// uncertainty; its ranges end where nobody would believe the number any more.
fn strong(draw: &mut Draw, effect: &Effect, range: usize) -> f64 {
    let (low, high) = if WRONG_NUMBERS.contains(&effect.id) {
        [(5.0, 8.0), (8.0, 12.0), (12.0, 17.0), (17.0, 24.0)][range]
    } else {
        STRENGTHS[range]
    };
    draw.log_uniform(low, high)
}

/// `count` requests of one composition other than the frozen one.
fn plain(draw: &mut Draw, mix: Mix, count: usize, recordings: usize) -> Vec<Request> {
    let all: Vec<&'static Effect> = listed().collect();
    // Never in the list, or taken out of it; a wrong number is no shape that one could describe.
    let unlisted: Vec<&'static Effect> = effect::ALL
        .iter()
        .filter(|e| !e.listed || (!WRONG_NUMBERS.contains(&e.id) && e.id != "lost-samples"))
        .collect();
    let confinable: Vec<&'static Effect> = listed().filter(|e| e.confined != Confined::Never).collect();
    let absorbable: Vec<&'static Effect> = listed().filter(|e| e.absorbable).collect();
    let mut order: Vec<usize> = Vec::new();
    (0..count)
        .map(|index| {
            let pool = match mix {
                Mix::Single => &all,
                Mix::Unlisted => &unlisted,
                Mix::Conditional => &confinable,
                Mix::Absorbed => &absorbable,
                _ => &all,
            };
            // Every effect comes once before one comes twice; with each round the strength moves on.
            let round = index / pool.len();
            if index % pool.len() == 0 {
                order = (0..pool.len()).collect();
                draw.shuffle(&mut order);
            }
            let place = order[index % pool.len()];
            let effect = pool[place];
            let strength = (place + round) % 4;
            match mix {
                Mix::Absent => request(draw, Way::Absent, Vec::new(), recordings),
                Mix::Pairs => {
                    let pair = if index % 3 == 2 {
                        let (a, b) = draw.pick(effect::TWINS);
                        [a, b].map(|id| effect::named(id).expect("twins are listed"))
                    } else {
                        unlike_pair(draw, &all)
                    };
                    let with = pair.iter().map(|e| (*e, draw.log_uniform(25.0, 100.0))).collect();
                    request(draw, Way::Unnamed, with, recordings)
                }
                Mix::Single => {
                    let d = strong(draw, effect, strength);
                    request(draw, Way::Unnamed, vec![(effect, d)], recordings)
                }
                Mix::Unlisted => {
                    let d = strong(draw, effect, 1 + (place + round) % 3);
                    let mut request = request(draw, Way::Unlisted, vec![(effect, d)], recordings);
                    if effect.listed {
                        request.without = vec![effect.id];
                    }
                    request
                }
                Mix::Conditional => {
                    let d = strong(draw, effect, 1 + (place + round) % 3);
                    request(draw, Way::Conditional, vec![(effect, d)], recordings)
                }
                Mix::Absorbed => {
                    let d = strong(draw, effect, 1 + (place + round) % 3);
                    request(draw, Way::Absorbed, vec![(effect, d)], recordings)
                }
                Mix::Frozen => unreachable!("composed of the others"),
            }
        })
        .collect()
}

/// Leaves something out of the tool's list in cases where it does not matter, so that leaving out says nothing.
fn decoys(draw: &mut Draw, all: &mut [Request]) {
    let listed: Vec<&'static Effect> = listed().collect();
    for request in all.iter_mut().filter(|r| r.way != Way::Unlisted) {
        let kin = |id: &str| request.effects.iter().any(|(e, _)| e.id == id || effect::alike(e.id).contains(&id));
        let decoy = draw.pick(&listed).id;
        if draw.chance(0.12) && !kin(decoy) {
            request.without = vec![decoy];
        }
    }
}

fn unlike_pair(draw: &mut Draw, all: &[&'static Effect]) -> [&'static Effect; 2] {
    loop {
        let (a, b) = (draw.pick(all), draw.pick(all));
        let twins = effect::TWINS.iter().any(|(x, y)| (a.id, b.id) == (*x, *y) || (b.id, a.id) == (*x, *y));
        // Frictions are one kind of thing; a fall has no rig; both must fit one campaign.
        let together = [Kind::Impact, Kind::Drop].iter().any(|k| a.kinds.contains(k) && b.kinds.contains(k));
        let numbers = WRONG_NUMBERS.contains(&a.id) || WRONG_NUMBERS.contains(&b.id);
        if a.id != b.id && !twins && together && !numbers {
            return [a, b];
        }
    }
}

/// The requests of a run: the same for the same seed.
#[must_use]
pub fn requests(mix: Mix, count: usize, seed: u64, recordings: usize) -> Vec<Request> {
    let mut draw = Draw::new(seed);
    if mix != Mix::Frozen {
        return plain(&mut draw, mix, count, recordings);
    }
    // Parts of the frozen set, in thousandths; what rounding leaves goes to the single effects.
    let parts =
        [(Mix::Absent, 300), (Mix::Pairs, 150), (Mix::Conditional, 100), (Mix::Absorbed, 100), (Mix::Unlisted, 150)];
    let mut all = Vec::with_capacity(count);
    for (mix, thousandths) in parts {
        let part = (count * thousandths).div_ceil(1000).min(count - all.len());
        all.extend(plain(&mut draw, mix, part, recordings));
    }
    let rest = count - all.len();
    all.extend(plain(&mut draw, Mix::Single, rest, recordings));
    decoys(&mut draw, &mut all);
    // The number of a case says nothing about it.
    draw.shuffle(&mut all);
    all
}

/// `count` requests that hide `effect` alone, at the strengths in turn.
#[must_use]
pub fn only(effect: &'static Effect, count: usize, seed: u64, recordings: usize) -> Vec<Request> {
    let mut draw = Draw::new(seed);
    let way = if effect.listed { Way::Unnamed } else { Way::Unlisted };
    (0..count)
        .map(|index| {
            let d = strong(&mut draw, effect, index % 4);
            request(&mut draw, way, vec![(effect, d)], recordings)
        })
        .collect()
}

#[cfg(test)]
mod tests;
