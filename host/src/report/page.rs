//! The page itself: figures of an impact, order of things.

use maud::{Markup, PreEscaped, html};
use thud_firmware::configuration::Configuration;
use thud_firmware::event::{Event, Verdict};

use super::curve::thinned;
use super::document::{document, glossary};
use super::figure::{Figure, Instant, Level, Line, Spot, Stroke};
use super::{ImpactReport, Report, sheet, words};

/// Share of the time axis before the contact, relative to the duration.
const LEAD: f64 = 0.35;

/// The page as one HTML document without anything outside it.
#[must_use]
pub fn page(report: &Report) -> String {
    let body = html! {
        h1 { (report.title) }
        @for paragraph in &report.about { p { (paragraph) } }
        dl { @for (name, value) in &report.facts { dt { (name) } dd { (value) } } }
        @if report.impacts.is_empty() {
            h2 { "No contact was found" }
            p { "Nothing rose above the onset threshold." }
        }
        @for impact in &report.impacts { (impact_section(impact, &report.configuration)) }
        @if let Some(closing) = &report.closing { (closing) }
        (sheet::configuration(&report.configuration))
        (words_meant())
    };
    document(&report.title, &[], &body)
}

fn impact_section(impact: &ImpactReport, configuration: &Configuration) -> Markup {
    // The first of the worst: it is the one that a person has to know about.
    let Some(worst) = impact.events.iter().rev().max_by_key(|event| event.severity.verdict as u8) else {
        return html! {};
    };
    let verdict = worst.severity.verdict;
    html! {
        h2 { (impact.heading) }
        div class={ "verdict " (verdict.name()) } {
            strong { (verdict_word(verdict)) } " " @if worst.contact > 0 { "In rebound " (worst.contact) ": " }
            (words::explain_verdict(worst))
        }
        p {
            "The blow began at " (format!("{:.6} ", impact.clock.0)) (impact.clock.1) ". All times below count from there."
        }
        @for note in &impact.notes { p { (note) } }
        (figures(impact, configuration))
        h3 { "What was sensed" }
        (sheet::events(impact))
        (sheet::severity(impact))
        (sheet::comparison(impact))
        (sheet::flags(impact))
    }
}

fn verdict_word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::None => "No verdict.",
        Verdict::Pass => "Pass.",
        Verdict::Inconclusive => "Inconclusive.",
        Verdict::Fail => "Fail.",
    }
}

fn figures(impact: &ImpactReport, configuration: &Configuration) -> Markup {
    let Some(curve) = &impact.curve else {
        return html! { p { "The force curve of this impact was not kept." } };
    };
    let origin = impact.events[0].contact_instant;
    let rate = f64::from(curve.sample_rate.0);
    let start_s = curve.start_s(origin);
    let line = |values: &[f32]| -> Vec<(f64, f64)> {
        values
            .iter()
            .enumerate()
            .map(|(index, force)| (1e3 * (start_s + index as f64 / rate), f64::from(*force)))
            .collect()
    };
    let (raw, judged) = (line(&curve.raw), line(&curve.judged));
    let truth: Option<Vec<(f64, f64)>> =
        impact.truth.as_ref().map(|truth| truth.curve.iter().map(|(time, force)| (1e3 * time, *force)).collect());
    let show = Shown { impact, configuration, raw: &raw, judged: &judged, truth: truth.as_deref() };
    let blow = &impact.events[0];
    let duration_ms = (1e3 * f64::from(blow.duration.0)).clamp(0.2, 600.0);
    let close = show.close(-LEAD * duration_ms, 1.5 * duration_ms);
    let end_ms = raw.last().map_or(1.0, |point| point.0);
    let whole = show.whole(raw.first().map_or(0.0, |point| point.0), end_ms);
    let toe = show.toe();
    let (visible, beyond): (Vec<&Level>, Vec<&Level>) =
        close.levels.iter().partition(|level| (close.y.0..=close.y.1).contains(&level.value));
    html! {
        figure {
            (PreEscaped(close.svg()))
            (legend(impact.truth.is_some(), !visible.is_empty()))
            figcaption {
                "The blow. The judged force passes the verdict filter; its largest value in the first 0.5 s, times S, is compared with the limit."
                @for level in beyond { " Far above the figure lies the " (level.label) "." }
            }
        }
        figure {
            (PreEscaped(toe.svg()))
            figcaption {
                "The first instants, enlarged; dots are samples"
                @if impact.truth.is_some() { " as captured, noise and mains hum still in them" }
                ". The sensor notices the force at the threshold and reckons back to the instant of contact, below one sample."
            }
        }
        figure {
            (PreEscaped(whole.svg()))
            figcaption { "The whole captured curve, with the transient window of 0.5 s shaded, in which rebounds are looked for." }
        }
    }
}

struct Shown<'a> {
    impact: &'a ImpactReport,
    configuration: &'a Configuration,
    raw: &'a [(f64, f64)],
    judged: &'a [(f64, f64)],
    truth: Option<&'a [(f64, f64)]>,
}

impl Shown<'_> {
    fn blow(&self) -> &Event {
        &self.impact.events[0]
    }

    /// Milliseconds from the blow's contact to an instant.
    fn ms(&self, instant: thud_firmware::units::SampleInstant) -> f64 {
        1e3 * f64::from(instant.since(self.blow().contact_instant, self.impact.sample_rate).0)
    }

    /// The curves between two times, ms, each thinned to about so many points; the samples themselves where they are few.
    fn lines(&self, from: f64, to: f64, points: usize) -> Vec<Line> {
        const FEW: usize = 80;
        let within = |line: &[(f64, f64)]| -> Vec<(f64, f64)> {
            line.iter().copied().filter(|point| (from..=to).contains(&point.0)).collect()
        };
        let raw = within(self.raw);
        let mut lines = Vec::new();
        if raw.len() <= FEW {
            lines.push(Line { stroke: Stroke::Samples, points: raw.clone() });
        }
        lines.push(Line { stroke: Stroke::Raw, points: thinned(&raw, points) });
        lines.push(Line { stroke: Stroke::Judged, points: thinned(&within(self.judged), points) });
        if let Some(truth) = self.truth {
            lines.push(Line { stroke: Stroke::Truth, points: thinned(&within(truth), points) });
        }
        lines
    }

    /// The limits as forces on the rig: what the sensor compares is S times the force, so the line stands at limit/S.
    fn levels(&self, to_ms: f64) -> Vec<Level> {
        let severity = &self.blow().severity;
        let scaling = f64::from(severity.scaling);
        let relative = f64::from(self.configuration.relative_uncertainty);
        let mut levels = Vec::new();
        if let Some(limit) = severity.transient_limit {
            let limit = f64::from(limit.0);
            let guard = (limit / (1.0 + relative) / scaling, limit / (1.0 - relative) / scaling);
            let label = if (scaling - 1.0).abs() < 1e-6 {
                format!("transient limit {limit:.0} N")
            } else {
                format!("transient limit {limit:.0} N ÷ S {scaling:.3} = {:.0} N on the rig", limit / scaling)
            };
            levels.push(Level { from: 0.0, to: to_ms.min(500.0), value: limit / scaling, guard: Some(guard), label });
        }
        if let Some(limit) = severity.quasi_static_limit
            && to_ms > 520.0
        {
            let limit = f64::from(limit.0);
            let guard = Some((limit / (1.0 + relative), limit / (1.0 - relative)));
            levels.push(Level {
                from: 500.0,
                to: to_ms,
                value: limit,
                guard,
                label: format!("quasi-static {limit:.0} N"),
            });
        }
        levels
    }

    /// The range of forces that shows curves and limit, if the limit is not far away.
    fn y(&self, levels: &[Level]) -> (f64, f64) {
        let all = self.raw.iter().chain(self.judged).map(|point| point.1);
        let (low, high) = all.fold((0.0_f64, 1.0_f64), |(low, high), force| (low.min(force), high.max(force)));
        let top = levels.iter().filter_map(|level| level.guard.map(|guard| guard.1)).fold(high, f64::max);
        let top = if top > 3.0 * high { high } else { top };
        let room = 0.08 * (top - low);
        (low - room, top + room)
    }

    fn close(&self, from: f64, to: f64) -> Figure {
        let blow = self.blow();
        let levels = self.levels(to);
        let separation = 1e3 * f64::from(blow.duration.0);
        let peak_ms = self.ms(blow.peak_instant);
        let mut spots = vec![Spot {
            at: (peak_ms, f64::from(blow.raw_peak.0)),
            label: format!("raw peak {:.1} N", blow.raw_peak.0),
        }];
        let judged = self.judged.iter().filter(|point| (0.0..=separation.max(1.0)).contains(&point.0));
        if let Some(top) = judged.max_by(|a, b| a.1.total_cmp(&b.1))
            && (top.1 - f64::from(blow.raw_peak.0)).abs() > 0.08 * f64::from(blow.raw_peak.0)
        {
            spots.push(Spot { at: *top, label: format!("judged peak {:.1} N", blow.peak.0) });
        }
        Figure {
            size: (940, 430),
            x: (from, to),
            y: self.y(&levels),
            x_label: "time since contact, ms",
            y_label: "force, N",
            window: Some((0.0, to.min(500.0), "transient window")),
            lines: self.lines(from, to, 2_000),
            levels,
            instants: vec![
                Instant { at: 0.0, label: "contact".to_owned(), truth: false, row: 0, tick: false },
                Instant {
                    at: separation,
                    label: format!("separation {separation:.2} ms"),
                    truth: false,
                    row: 0,
                    tick: false,
                },
            ],
            spots,
        }
    }

    fn whole(&self, from: f64, to: f64) -> Figure {
        let levels = self.levels(to);
        let instants = self.impact.events.iter().enumerate().map(|(index, event)| Instant {
            at: self.ms(event.contact_instant),
            label: match index {
                0 => "contact".to_owned(),
                1 => "rebound 1".to_owned(),
                // They come close upon one another.
                _ => index.to_string(),
            },
            truth: false,
            row: i32::from(index > 0),
            tick: true,
        });
        Figure {
            size: (940, 330),
            x: (from, to),
            y: self.y(&levels),
            x_label: "time since contact, ms",
            y_label: "force, N",
            window: Some((0.0, 500.0, "transient window, 0.5 s")),
            lines: self.lines(from, to, 2_000),
            levels,
            instants: instants.collect(),
            spots: Vec::new(),
        }
    }

    /// The beginning of the blow: from before the contact until the force is well above the threshold.
    fn toe(&self) -> Figure {
        let threshold = (f64::from(self.configuration.onset_multiple) * f64::from(self.blow().noise.0))
            .max(f64::from(self.configuration.onset_minimum.0));
        let reached = self.raw.iter().find(|point| point.0 > 0.0 && point.1 > 4.0 * threshold);
        // A hard blow is there within a sample: then five samples and the first two of the rise are shown.
        let sample_ms = 1e3 / f64::from(self.impact.sample_rate.0);
        let span = reached.map_or(2.0, |point| point.0).clamp(5.0 * sample_ms, 50.0);
        let first = self.raw.iter().filter(|point| (0.0..2.0 * sample_ms).contains(&point.0)).map(|point| point.1);
        let high = first.fold(4.0 * threshold, f64::max);
        let (from, to) = (-1.2 * span, 1.15 * span);
        let mut instants =
            vec![Instant { at: 0.0, label: "contact as sensed".to_owned(), truth: false, row: 0, tick: false }];
        if let Some(truth) = &self.impact.truth
            && let Some(contact) = truth.contacts.first()
        {
            let at = 1e3 * contact.contact_s;
            instants.push(Instant { at, label: "contact as it was".to_owned(), truth: true, row: 1, tick: false });
        }
        let within = |points: &[(f64, f64)]| -> Vec<(f64, f64)> {
            points.iter().copied().filter(|point| (from..=to).contains(&point.0)).collect()
        };
        let mut lines = vec![Line { stroke: Stroke::Samples, points: thinned(&within(self.raw), 600) }];
        if let Some(truth) = self.truth {
            lines.push(Line { stroke: Stroke::Truth, points: thinned(&within(truth), 600) });
        }
        Figure {
            size: (940, 280),
            x: (from, to),
            y: (-1.5 * threshold - 0.05 * high, 1.3 * high),
            x_label: "time since contact, ms",
            y_label: "force, N",
            window: None,
            lines,
            levels: vec![Level {
                from,
                to,
                value: threshold,
                guard: None,
                label: format!("threshold {threshold:.2} N"),
            }],
            instants,
            spots: Vec::new(),
        }
    }
}

/// What the lines mean, drawn as in the figures.
fn legend(with_truth: bool, with_limit: bool) -> Markup {
    let swatch = |style: &str| {
        PreEscaped(format!("<svg viewBox=\"0 0 44 14\"><line x1=\"0\" y1=\"7\" x2=\"44\" y2=\"7\" {style}/></svg>"))
    };
    html! {
        div.legend {
            span { (swatch("stroke=\"#7d7d7d\" stroke-width=\"1\"")) "force as measured (raw)" }
            span { (swatch("stroke=\"#000\" stroke-width=\"3\"")) "force as judged (filtered)" }
            @if with_truth {
                span { (swatch("stroke=\"#000\" stroke-width=\"2\" stroke-dasharray=\"2 4\"")) "force that truly reached the cell" }
            }
            @if with_limit {
                span { (swatch("stroke=\"#000\" stroke-width=\"2\" stroke-dasharray=\"9 5\"")) "limit, with its guard band in grey" }
            }
        }
    }
}

fn words_meant() -> Markup {
    glossary(&[
        (
            "contact instant",
            "When the robot first touched, reckoned back from the rise of the force to where it was zero.",
        ),
        ("raw peak", "The largest force as measured, between samples."),
        ("judged peak", "The largest force behind the verdict filter, which takes away what is too fast to matter."),
        ("impulse", "The force added up over the contact: the momentum that the robot lost."),
        (
            "S",
            "√(m_H / (m_H + m_R)): a fixed rig is hit harder than a person who can recoil. S brings the reading to the person; the pad of the rig is never credited.",
        ),
        (
            "transient, quasi-static",
            "The first 0.5 s of a contact, and what is left of it after that. Each has its own limit.",
        ),
        ("guard band", "Within the uncertainty of a limit nothing is certain: there the verdict is inconclusive."),
    ])
}
