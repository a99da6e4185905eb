//! Where simulation and recordings differ: phase, band, recordings and conditions, with a p-value for having looked everywhere.
//!
//! ```text
//!  before │ rise │ fall │ after      in each phase the whitened residual is compared with a few smooth forms, bands of
//! ────────┼──╱───┼───╲──┼───────     frequency and short stretches; under the right model the mean square over
//!         contact peak  separation   q forms is to that over r forms of the quiet before contact as F with q, r
//! ```
//!
//! What is in a band is compared with what the quiet has in that band: a spectrum of p coefficients from n samples has a relative
//! variance of 2p/n (K. N. Berk, Consistent autoregressive spectral estimates, Annals of Statistics 2 (1974) 489; 6 from 1200 samples: a
//! tenth), which a thousand forms would take for a difference.
//!
//! The residual is that of the re-tuned baseline, or of any other fit. p-values are Bonferroni's: multiplied by the number of places
//! looked at.

use std::ops::Range;

use statrs::distribution::{ChiSquared, ContinuousCDF as _, FisherSnedecor};

use super::answer::Place;
use super::fit::Fit;
use super::layout::Role;
use super::problem::{FEWEST_QUIET, Problem};
use super::spectrum::{Hum, hum};

/// Smooth forms in a phase of a recording.
const FORMS: usize = 5;
/// Bands of frequency within a phase: edges, Hz.
const BANDS_HZ: [f64; 7] = [0.0, 40.0, 80.0, 160.0, 320.0, 640.0, 1500.0];
/// More lines of a stretch are not looked at.
const MOST_LINES: usize = 240;
/// A place is told below this p.
pub const SIGNIFICANT: f64 = 0.01;
/// The force at which a contact of the model ends, over its peak.
const SEPARATED: f64 = 0.005;
/// Parts of a phase, each of which is looked at, and among which the shortest stretch is sought that holds most of the excess.
const STRETCHES: usize = 20;
/// Equal parts of the strongest force, in each of which all recordings are summed: what goes with the stroke is of many frequencies and comes at
/// another time in each recording (a magnet's detent, teeth, a rough place).
const LEVELS: usize = 64;
/// How much of the excess that stretch holds.
const MOST: f64 = 0.8;

/// A phase of the impact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Before contact.
    Before,
    /// From contact to the peak.
    Rise,
    /// From the peak to separation.
    Fall,
    /// After separation.
    After,
}

impl Phase {
    /// In the order of time.
    pub const ALL: [Self; 4] = [Self::Before, Self::Rise, Self::Fall, Self::After];

    /// The contract's word.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Before => "before",
            Self::Rise => "rise",
            Self::Fall => "fall",
            Self::After => "after",
        }
    }
}

/// Contact, peak and separation in a fit's model of one recording, s in the recording's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    /// Instant of contact.
    pub contact_s: f64,
    /// Instant of the highest force.
    pub peak_s: f64,
    /// Instant at which the force has gone.
    pub separation_s: f64,
}

impl Course {
    /// Of one recording.
    #[must_use]
    pub fn of(problem: &Problem, fit: &Fit, recording: usize) -> Self {
        let prepared = &problem.recordings[recording];
        let contact_s = fit.layout.contact_s(problem, &fit.point, recording);
        let offset = fit.layout.local(&fit.point, recording, Role::Offset(0)).unwrap_or(0.0);
        let model = &fit.model[recording][..prepared.times_s.len().min(fit.model[recording].len())];
        let size = |value: f64| (value - offset).abs();
        let peak = (0..model.len()).max_by(|a, b| size(model[*a]).total_cmp(&size(model[*b]))).unwrap_or(0);
        let highest = model.get(peak).map_or(0.0, |value| size(*value));
        let gone = (peak..model.len()).find(|place| size(model[*place]) < SEPARATED * highest);
        let last_s = prepared.times_s[prepared.times_s.len() - 1];
        Self {
            contact_s,
            peak_s: prepared.times_s[peak],
            separation_s: gone.map_or(last_s, |place| prepared.times_s[place]),
        }
    }

    /// The phase at an instant.
    #[must_use]
    pub fn phase(&self, time_s: f64) -> Phase {
        if time_s < self.contact_s {
            Phase::Before
        } else if time_s < self.peak_s {
            Phase::Rise
        } else if time_s < self.separation_s {
            Phase::Fall
        } else {
            Phase::After
        }
    }
}

/// The sum of squares over forms that are one for each place, and how many.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    squares: f64,
    forms: usize,
}

impl Sum {
    fn of(line: f64) -> Self {
        Self { squares: line * line, forms: 1 }
    }

    /// Mean square; 1 of nothing.
    fn level(self) -> f64 {
        if self.forms == 0 { 1.0 } else { self.squares / self.forms as f64 }
    }

    fn excess(self) -> f64 {
        self.squares - self.forms as f64
    }

    /// The probability of that much noise, whose strength the quiet shows: χ² where none does.
    fn p(self, quiet: Self) -> f64 {
        let (count, quiet_count) = (self.forms as f64, quiet.forms as f64);
        let squares = self.squares.max(0.0);
        match (self.forms, quiet.forms) {
            (0, _) => 1.0,
            (_, 0) => ChiSquared::new(count).map_or(1.0, |distribution| distribution.sf(squares)),
            _ => FisherSnedecor::new(count, quiet_count)
                .map_or(1.0, |distribution| distribution.sf(squares / count * quiet_count / quiet.squares)),
        }
    }
}

impl std::ops::AddAssign for Sum {
    fn add_assign(&mut self, other: Self) {
        self.squares += other.squares;
        self.forms += other.forms;
    }
}

impl std::iter::Sum for Sum {
    fn sum<I: Iterator<Item = Self>>(sums: I) -> Self {
        sums.fold(Self::default(), |mut whole, sum| {
            whole += sum;
            whole
        })
    }
}

/// A sum for each band.
type Bands = [Sum; BANDS_HZ.len() - 1];

/// What differs most from a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oddity {
    /// Sum of squares over what was looked at there, less their number.
    pub excess: f64,
    /// Probability of that much under the right model, for all that was looked at.
    pub p_value: f64,
}

impl Oddity {
    const NONE: Self = Self { excess: 0.0, p_value: 1.0 };

    fn of(sum: Sum, p_value: f64) -> Self {
        Self { excess: sum.excess(), p_value }
    }

    /// The less likely one; of what cannot be counted any more the larger.
    fn or(self, other: Self) -> Self {
        let order = self.p_value.total_cmp(&other.p_value).then(other.excess.total_cmp(&self.excess));
        if order.is_le() { self } else { other }
    }
}

/// What all recordings have beside a fit, by phase.
struct Looked<'a> {
    problem: &'a Problem,
    fit: &'a Fit,
    courses: Vec<Course>,
    /// Smooth forms of each phase and recording, and the sum of the first two.
    smooth: Vec<Vec<Sum>>,
    signed: Vec<Vec<f64>>,
    /// Energy of each phase by band.
    bands: [Bands; Phase::ALL.len()],
    /// What each phase has by the force that the fit has there.
    levels: [Sum; Phase::ALL.len()],
    quiet: Quiet,
    level: Sum,
}

impl<'a> Looked<'a> {
    fn at(problem: &'a Problem, fit: &'a Fit) -> Self {
        let count = problem.recordings.len();
        let courses: Vec<Course> = (0..count).map(|number| Course::of(problem, fit, number)).collect();
        let mut smooth = vec![vec![Sum::default(); count]; Phase::ALL.len()];
        let mut bands = [Bands::default(); Phase::ALL.len()];
        let mut signed = vec![vec![0.0; count]; Phase::ALL.len()];
        for (number, recording) in problem.recordings.iter().enumerate() {
            let samples = recording.times_s.len();
            for (row, phase) in Phase::ALL.into_iter().enumerate() {
                let within: Vec<usize> =
                    (0..samples).filter(|place| courses[number].phase(recording.times_s[*place]) == phase).collect();
                let Some((&first, &last)) = within.first().zip(within.last()) else { continue };
                if within.len() < 6 {
                    continue;
                }
                let lines = cosines(&fit.residuals[number][first..=last]);
                smooth[row][number] = lines.iter().take(FORMS).copied().map(Sum::of).sum();
                add_to_bands(&mut bands[row], &lines, 0, recording.times_s[last] - recording.times_s[first]);
                signed[row][number] = lines.iter().take(2).sum();
            }
        }
        let (quiet, level) = (Quiet::of(problem), level(problem));
        let levels = levels(problem, fit, &courses);
        Self { problem, fit, courses, smooth, signed, bands, levels, quiet, level }
    }

    /// How much is looked at: in each phase the smooth forms of all recordings together, of each alone, the bands, the parts of its time and of its
    /// force.
    fn often(&self) -> f64 {
        (Phase::ALL.len() * (1 + self.courses.len() + BANDS_HZ.len() - 1 + STRETCHES + 1)) as f64
    }

    /// All that is in a phase.
    fn total(&self, row: usize) -> Sum {
        self.bands[row].iter().copied().sum()
    }

    fn together(&self, row: usize) -> Sum {
        self.smooth[row].iter().copied().sum()
    }

    fn stretches(&self, row: usize) -> Stretches {
        Stretches::of(self.problem, self.fit, &self.courses, Phase::ALL[row])
    }

    /// Whether the residual of one recording is significant by itself, over a phase or in a row of its parts.
    fn speaks(&self, row: usize, recording: usize, stretches: &Stretches, parts: &Range<usize>) -> bool {
        let there = stretches.within(parts, recording).p(self.quiet.each[recording]);
        self.smooth[row][recording].p(self.level).min(there) * self.often() < SIGNIFICANT
    }

    /// What is oddest in a phase.
    fn oddity(&self, row: usize, stretches: &Stretches) -> Oddity {
        let all = [self.together(row), self.levels[row]].into_iter().chain(self.smooth[row].iter().copied());
        let smooth = all.map(|sum| Oddity::of(sum, sum.p(self.level)));
        let bands = self.bands[row].iter().zip(&self.quiet.bands).map(|(sum, quiet)| Oddity::of(*sum, sum.p(*quiet)));
        let parts = (0..STRETCHES).map(|part| Oddity::of(stretches.part(part), stretches.p(part, &self.quiet)));
        let oddest = smooth.chain(bands).chain(parts).fold(Oddity::NONE, Oddity::or);
        Oddity { p_value: (oddest.p_value * self.often()).min(1.0), ..oddest }
    }
}

/// What is oddest about a fit. The omnibus test looks for what many recordings share over a whole contact; this also sees what one of
/// them has alone, and what is short.
#[must_use]
pub fn oddity(problem: &Problem, fit: &Fit) -> Oddity {
    let looked = Looked::at(problem, fit);
    let rows = 0..Phase::ALL.len();
    rows.map(|row| looked.oddity(row, &looked.stretches(row))).fold(Oddity::NONE, Oddity::or)
}

/// The recordings in which the residual of some phase is significant by itself.
#[must_use]
pub fn speaking(problem: &Problem, fit: &Fit) -> Vec<usize> {
    let looked = Looked::at(problem, fit);
    let stretches: Vec<Stretches> = (0..Phase::ALL.len()).map(|row| looked.stretches(row)).collect();
    let speaks = |number: &usize| {
        let mut phases = stretches.iter().enumerate();
        phases.any(|(row, stretches)| looked.speaks(row, *number, stretches, &stretches.shortest()))
    };
    (0..problem.recordings.len()).filter(speaks).collect()
}

/// The places where a fit differs from the recordings, the largest share first.
#[must_use]
pub fn locate(problem: &Problem, fit: &Fit) -> Vec<Place> {
    let looked = Looked::at(problem, fit);
    let Looked { smooth, signed, bands, .. } = &looked;
    let hum = Some(hum(problem, fit)).filter(Hum::is_there);
    let of_mains = |row: usize| hum.filter(|_| Phase::ALL[row] == Phase::Before);
    let excess = |row: usize| looked.total(row).excess().max(of_mains(row).map_or(0.0, |hum| hum.excess));
    let all_excess: f64 = (0..Phase::ALL.len()).map(excess).sum();
    let mut places = Vec::new();
    for (row, phase) in Phase::ALL.into_iter().enumerate() {
        let together = looked.together(row);
        let stretches = looked.stretches(row);
        let hum = of_mains(row);
        let in_line = hum.map_or(1.0, |hum| (hum.p_value * looked.often()).min(1.0));
        let p_value = looked.oddity(row, &stretches).p_value.min(in_line);
        if p_value > SIGNIFICANT {
            continue;
        }
        let shortest = stretches.shortest();
        let speaks = |number: &usize| looked.speaks(row, *number, &stretches, &shortest);
        let speaking: Vec<usize> = (0..problem.recordings.len()).filter(speaks).collect();
        let touched = if speaking.is_empty() { fullest(&smooth[row], together) } else { speaking };
        places.push(Place {
            phase: phase.word(),
            time_from_contact_s: stretches.ends_s(&shortest),
            frequency_Hz: hum.map_or_else(|| strongest_bands(&bands[row]), |hum| hum.band_hz),
            recordings: touched.iter().map(|number| problem.recordings[*number].name.clone()).collect(),
            depends_on: depends_on(problem, &signed[row], &smooth[row]),
            share: if all_excess > 0.0 { excess(row) / all_excess } else { 0.0 },
            p_value,
        });
    }
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places
}

/// What each phase of the contact has in parts of the force that the fit has there, one form each: the sum of all recordings.
fn levels(problem: &Problem, fit: &Fit, courses: &[Course]) -> [Sum; Phase::ALL.len()] {
    let sizes: Vec<Vec<f64>> = (0..courses.len())
        .map(|number| {
            let offset = fit.layout.local(&fit.point, number, Role::Offset(0)).unwrap_or(0.0);
            let samples = problem.recordings[number].times_s.len();
            fit.model[number].iter().take(samples).map(|value| (value - offset).abs()).collect()
        })
        .collect();
    let strongest = sizes.iter().flatten().copied().fold(0.0, f64::max);
    Phase::ALL.map(|phase| {
        if !matches!(phase, Phase::Rise | Phase::Fall) {
            return Sum::default();
        }
        let within = sizes.iter().enumerate().flat_map(|(number, sizes)| {
            let samples = problem.recordings[number].times_s.iter().zip(sizes).zip(&fit.residuals[number]);
            let there = samples.filter(move |((time_s, _), _)| courses[number].phase(**time_s) == phase);
            there.map(|((_, size), residual)| (size / strongest, *residual))
        });
        by_level(within)
    })
}

/// Residuals beside the level from 0 to 1 at which each stands: one form in each part.
fn by_level(residuals: impl Iterator<Item = (f64, f64)>) -> Sum {
    let mut parts = [(0.0, 0_u32); LEVELS];
    for (level, residual) in residuals {
        let (sum, count) = &mut parts[((LEVELS as f64 * level) as usize).min(LEVELS - 1)];
        *sum += residual;
        *count += 1;
    }
    parts.iter().filter(|(_, count)| *count > 0).map(|(sum, count)| Sum::of(sum / f64::from(*count).sqrt())).sum()
}

/// The strength of the noise over all frequencies, as the quiet shows it: where it is known least.
fn level(problem: &Problem) -> Sum {
    let samples = problem.recordings.iter().map(|recording| recording.noise[0].samples()).min().unwrap_or(0);
    Sum { squares: samples as f64, forms: samples }
}

/// The quiet before contact, whitened and free of its mean.
struct Quiet {
    /// What all recordings have in the bands; a piece's mean is no part of it.
    bands: Bands,
    /// What each has over all frequencies; what all have where it is too short to tell.
    each: Vec<Sum>,
}

impl Quiet {
    fn of(problem: &Problem) -> Self {
        let level = level(problem);
        let mut quiet = Self { bands: Bands::default(), each: vec![level; problem.recordings.len()] };
        for (recording, each) in problem.recordings.iter().zip(&mut quiet.each) {
            let values = recording.quiet.first().map_or(&[][..], Vec::as_slice);
            if values.len() < FEWEST_QUIET {
                continue;
            }
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let mut residual: Vec<f64> = values.iter().map(|value| value - mean).collect();
            recording.noise[0].whiten(&mut residual);
            let squares = residual.iter().map(|residual| residual * residual).sum();
            *each = Sum { squares, forms: residual.len() - 1 };
            let times_s = &recording.times_s;
            let step_s = (times_s[times_s.len() - 1] - times_s[0]) / (times_s.len() - 1) as f64;
            for piece in residual.chunks(MOST_LINES).filter(|piece| piece.len() > FORMS) {
                add_to_bands(&mut quiet.bands, &cosines(piece), 1, step_s * (piece.len() - 1) as f64);
            }
        }
        quiet
    }
}

/// Adds lines of a stretch that lasts so long to their bands, from this order on.
fn add_to_bands(bands: &mut Bands, lines: &[f64], from: usize, lasts_s: f64) {
    for (order, line) in lines.iter().enumerate().skip(from) {
        let hz = order as f64 / (2.0 * lasts_s);
        if let Some(band) = (0..bands.len()).find(|band| hz >= BANDS_HZ[*band] && hz < BANDS_HZ[band + 1]) {
            bands[band] += Sum::of(*line);
        }
    }
}

/// Coefficients of the orthonormal cosines (the discrete cosine transform, type II), as many as there are samples, up to the last
/// band's; those of white noise are again independent with unit variance.
fn cosines(values: &[f64]) -> Vec<f64> {
    let count = values.len();
    let scale = (2.0 / count as f64).sqrt();
    (0..count.min(MOST_LINES))
        .map(|order| {
            let step = std::f64::consts::PI * order as f64 / count as f64;
            // cos((n + 1/2)·step) by its recurrence.
            let (mut before, mut here, double) = ((step * 0.5).cos(), (step * 0.5).cos(), 2.0 * step.cos());
            let mut sum = 0.0;
            for value in values {
                sum += value * here;
                let next = double * here - before;
                before = here;
                here = next;
            }
            if order == 0 { sum * scale / std::f64::consts::SQRT_2 } else { sum * scale }
        })
        .collect()
}

/// The recordings that hold most of the excess over the smooth forms.
fn fullest(smooth: &[Sum], together: Sum) -> Vec<usize> {
    let mut order: Vec<usize> = (0..smooth.len()).collect();
    order.sort_by(|a, b| smooth[*b].excess().total_cmp(&smooth[*a].excess()));
    let mut held = 0.0;
    let mut most = Vec::new();
    for number in order {
        if held > MOST * together.excess() || smooth[number].excess() <= 0.0 {
            break;
        }
        held += smooth[number].excess();
        most.push(number);
    }
    most.sort_unstable();
    most
}

/// A phase, cut into equal parts of time.
struct Stretches {
    /// Where the phase begins, s from contact.
    from_s: f64,
    /// How long a part is, s.
    width_s: f64,
    /// What each recording has in them.
    each: Vec<[Sum; STRETCHES]>,
}

impl Stretches {
    fn of(problem: &Problem, fit: &Fit, courses: &[Course], phase: Phase) -> Self {
        let mut ends = (f64::INFINITY, f64::NEG_INFINITY);
        let mut residuals: Vec<(f64, f64, usize)> = Vec::new();
        for (number, recording) in problem.recordings.iter().enumerate() {
            for (place, time) in recording.times_s.iter().enumerate() {
                if courses[number].phase(*time) == phase {
                    let since = time - courses[number].contact_s;
                    ends = (ends.0.min(since), ends.1.max(since));
                    residuals.push((since, fit.residuals[number][place], number));
                }
            }
        }
        let width_s = (ends.1 - ends.0) / STRETCHES as f64;
        let mut each = vec![[Sum::default(); STRETCHES]; problem.recordings.len()];
        for (since, residual, number) in residuals {
            let part = ((since - ends.0) / width_s.max(1e-12)) as usize;
            each[number][part.min(STRETCHES - 1)] += Sum::of(residual);
        }
        Self { from_s: ends.0, width_s, each }
    }

    /// One part of all recordings.
    fn part(&self, part: usize) -> Sum {
        self.each.iter().map(|parts| parts[part]).sum()
    }

    /// The probability of what is in a part, beside the quiet of the recordings that have samples there, each as strong as they count.
    fn p(&self, part: usize, quiet: &Quiet) -> f64 {
        let there = || self.each.iter().zip(&quiet.each).filter(|(parts, _)| parts[part].forms > 0);
        let forms: usize = there().map(|(_, quiet)| quiet.forms).sum();
        let noise: f64 = there().map(|(parts, quiet)| parts[part].forms as f64 * quiet.level()).sum();
        let sum = self.part(part);
        sum.p(Sum { squares: noise / sum.forms.max(1) as f64 * forms as f64, forms })
    }

    /// The shortest row of parts that holds most of the excess.
    fn shortest(&self) -> Range<usize> {
        let excess: [f64; STRETCHES] = std::array::from_fn(|part| self.part(part).excess().max(0.0));
        let whole: f64 = excess.iter().sum();
        let mut best = 0..STRETCHES;
        for from in 0..STRETCHES {
            let mut held = 0.0;
            for to in from + 1..=STRETCHES {
                held += excess[to - 1];
                if held >= MOST * whole && to - from < best.len() {
                    best = from..to;
                }
            }
        }
        best
    }

    /// What one recording has in a row of parts.
    fn within(&self, row: &Range<usize>, recording: usize) -> Sum {
        self.each[recording][row.clone()].iter().copied().sum()
    }

    /// A row of parts, s from contact.
    fn ends_s(&self, row: &Range<usize>) -> [f64; 2] {
        [row.start, row.end].map(|part| self.from_s + part as f64 * self.width_s)
    }
}

/// The band, Hz, from the lowest to the highest of those that hold most of the excess.
fn strongest_bands(bands: &[Sum]) -> [f64; 2] {
    let whole: f64 = bands.iter().map(|band| band.excess().max(0.0)).sum();
    let mut order: Vec<usize> = (0..bands.len()).collect();
    order.sort_by(|a, b| bands[*b].excess().total_cmp(&bands[*a].excess()));
    let mut held = 0.0;
    let mut ends = (usize::MAX, 0);
    for band in order {
        if held >= MOST * whole {
            break;
        }
        held += bands[band].excess().max(0.0);
        ends = (ends.0.min(band), ends.1.max(band));
    }
    if ends.0 == usize::MAX { [0.0, 0.0] } else { [BANDS_HZ[ends.0], BANDS_HZ[ends.1 + 1]] }
}

/// Conditions that the residual's size or sign goes with: regression on speed, ln mass and order, differences between configurations.
/// F-tests, Bonferroni over what is asked.
fn depends_on(problem: &Problem, signed: &[f64], smooth: &[Sum]) -> Vec<&'static str> {
    let size: Vec<f64> = smooth.iter().map(|sum| sum.squares.max(0.0).sqrt()).collect();
    let speed: Vec<f64> = problem.recordings.iter().map(|recording| recording.speed.value).collect();
    let mass: Vec<f64> = problem.recordings.iter().map(|recording| recording.mass.value.ln()).collect();
    let order: Vec<f64> = problem.recordings.iter().map(|recording| f64::from(recording.order)).collect();
    let asked = 8.0;
    let mut found = Vec::new();
    for (name, condition) in [("speed", &speed), ("mass", &mass), ("order", &order)] {
        let p = slope_p(condition, signed).min(slope_p(condition, &size));
        if p * asked < 0.05 {
            found.push(name);
        }
    }
    let groups: Vec<usize> = problem.recordings.iter().map(|recording| recording.configuration).collect();
    if groups_p(&groups, signed).min(groups_p(&groups, &size)) * asked < 0.05 && !found.contains(&"mass") {
        found.push("configuration");
    }
    found
}

/// The p-value of a straight line through the points.
fn slope_p(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len() as f64;
    if x.len() < 4 {
        return 1.0;
    }
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let sxx: f64 = x.iter().map(|x| (x - mx).powi(2)).sum();
    let sxy: f64 = x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum();
    let syy: f64 = y.iter().map(|y| (y - my).powi(2)).sum();
    if sxx <= 1e-12 || syy <= 1e-12 {
        return 1.0;
    }
    let explained = sxy * sxy / sxx;
    let rest = (syy - explained).max(1e-12) / (n - 2.0);
    FisherSnedecor::new(1.0, n - 2.0).map_or(1.0, |distribution| distribution.sf(explained / rest))
}

/// The p-value of an analysis of variance.
fn groups_p(groups: &[usize], y: &[f64]) -> f64 {
    let count = groups.iter().max().map_or(0, |most| most + 1);
    let n = y.len();
    if count < 2 || n < count + 2 {
        return 1.0;
    }
    let mean = y.iter().sum::<f64>() / n as f64;
    let (mut between, mut within) = (0.0, 0.0);
    for group in 0..count {
        let values: Vec<f64> = groups.iter().zip(y).filter(|(g, _)| **g == group).map(|(_, y)| *y).collect();
        if values.is_empty() {
            continue;
        }
        let here = values.iter().sum::<f64>() / values.len() as f64;
        between += values.len() as f64 * (here - mean).powi(2);
        within += values.iter().map(|value| (value - here).powi(2)).sum::<f64>();
    }
    let (a, b) = ((count - 1) as f64, (n - count) as f64);
    FisherSnedecor::new(a, b).map_or(1.0, |distribution| distribution.sf((between / a) / (within / b).max(1e-12)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_that_few_forms_show_excuses_more() {
        let seen = Sum { squares: 386.0, forms: 270 };
        assert!((seen.p(Sum::default()) - 4.427e-6).abs() < 1e-9, "{}", seen.p(Sum::default()));
        // As strong in the quiet: no difference. Known from very much of it: that of χ² again.
        assert!(seen.p(Sum { squares: 143.0, forms: 100 }) > 0.4);
        assert!((seen.p(Sum { squares: 1e7, forms: 10_000_000 }) - 4.43e-6).abs() < 1e-8);
        assert_eq!(Sum::default().p(seen), 1.0);
    }

    #[test]
    fn cosines_keep_the_energy_and_find_the_line() {
        let values: Vec<f64> =
            (0..64).map(|n| (std::f64::consts::PI * 5.0 * (f64::from(n) + 0.5) / 64.0).cos()).collect();
        let lines = cosines(&values);
        assert!((lines[5].powi(2) - 32.0).abs() < 1e-9, "{lines:?}");
        assert!(lines.iter().enumerate().all(|(order, line)| order == 5 || line.abs() < 1e-9));
    }

    /// A wave along the stroke of a third of the noise, passed at many speeds: no line in time, but one along the level.
    #[test]
    fn what_goes_with_the_stroke_adds_up_there() {
        let scatter = |n: u32| 2.0_f64.sqrt() * (f64::from(n) * f64::from(n) * 0.7 + 37.0).sin();
        let passed = |wave: f64| {
            let at = move |n: u32| {
                let level = (f64::from(n) * 0.618_033_988_749_895).fract();
                (level, scatter(n) + wave * (std::f64::consts::TAU * 12.0 * level).sin())
            };
            by_level((0..6000).map(at)).p(Sum::default())
        };
        assert!(passed(0.0) > 0.01, "{}", passed(0.0));
        assert!(passed(0.33) < 1e-12, "{}", passed(0.33));
    }

    #[test]
    fn a_line_is_told_from_scatter() {
        let x: Vec<f64> = (0..12).map(f64::from).collect();
        let straight: Vec<f64> = x.iter().map(|x| 2.0 * x + (x * 7.0).sin()).collect();
        let scatter: Vec<f64> = x.iter().map(|x| (x * 37.0).sin()).collect();
        assert!(slope_p(&x, &straight) < 1e-6);
        assert!(slope_p(&x, &scatter) > 0.05);
    }
}
