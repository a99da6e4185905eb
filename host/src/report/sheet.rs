//! The page's tables: what was sensed, what was true, what it was judged by.

use maud::{Markup, html};
use thud_firmware::configuration::Configuration;
use thud_firmware::event::{Event, Flags};
use thud_firmware::limits::TransientLimit;

use super::{ImpactReport, words};

/// What was sensed of each contact.
pub(super) fn events(impact: &ImpactReport) -> Markup {
    let blow = &impact.events[0];
    let rate = impact.sample_rate;
    html! {
        table {
            thead { tr {
                th { "contact" }
                th.number { "at, ms" }
                th.number { "raw peak, N" }
                th.number { "judged peak, N" }
                th.number { "peak after, ms" }
                th.number { "impulse, N·s" }
                th.number { "duration, ms" }
                th.number { "scaled force, N" }
                th { "verdict" }
                th { "flags" }
            } }
            tbody {
                @for event in &impact.events {
                    tr {
                        td { @if event.contact == 0 { "blow" } @else { "rebound " (event.contact) } }
                        td.number { (format!("{:.3}", 1e3 * event.contact_instant.since(blow.contact_instant, rate).0)) }
                        td.number { (format!("{:.2}", event.raw_peak.0)) }
                        td.number { (format!("{:.2}", event.peak.0)) }
                        td.number { (format!("{:.3}", 1e3 * event.time_to_peak(rate).0)) }
                        td.number { (format!("{:.4}", event.impulse.0)) }
                        td.number { (format!("{:.2}", 1e3 * event.duration.0)) }
                        td.number { (format!("{:.2}", event.severity.scaled.0)) }
                        td { strong { (event.severity.verdict.name()) } }
                        td { (event.flags.names().collect::<Vec<_>>().join(", ")) }
                    }
                }
            }
        }
    }
}

/// What else was sensed of the impact, and how the verdict came about.
pub(super) fn severity(impact: &ImpactReport) -> Markup {
    let event = &impact.events[0];
    let severity = &event.severity;
    // It belongs to the contact that was held, the last one.
    let quasi_static = impact.events.iter().find_map(|event| event.severity.quasi_static);
    let newton = |force: thud_firmware::units::Newton| format!("{:.1} N", force.0);
    html! {
        dl {
            dt { "largest judged force in the first 0.5 s" } dd { (newton(severity.transient)) }
            dt { "scaling factor S" }
            dd {
                (format!("{:.4}", severity.scaling))
                @if let Some(mass) = severity.effective_mass {
                    ", from an effective mass of the robot of " (format!("{:.2} kg", mass.0))
                    @match severity.effective_mass_age_ms {
                        Some(age) => { " received " (age) " ms before the contact" }
                        None => { " as configured" }
                    }
                } @else {
                    ", as no effective mass is known"
                }
            }
            dt { "scaled force" } dd { (newton(severity.scaled)) }
            dt { "transient limit" }
            dd { @match severity.transient_limit { Some(limit) => { (newton(limit)) } None => { "none" } } }
            dt { "largest force after 0.5 s (quasi-static)" }
            dd {
                @match quasi_static { Some(force) => { (newton(force)) } None => { "none: the contact did not last that long, or the chain cannot hold it" } }
            }
            dt { "quasi-static limit" }
            dd { @match severity.quasi_static_limit { Some(limit) => { (newton(limit)) } None => { "none" } } }
            dt { "expanded uncertainty (k = 2), the guard band" } dd { "±" (newton(severity.expanded_uncertainty)) }
            dt { "stroke and energy of the body spring at the peak" }
            dd { (format!("{:.2} mm, {:.3} J", 1e3 * severity.stroke.0, severity.energy.0)) }
            dt { "noise before the contact" } dd { (format!("{:.3} N rms", event.noise.0)) }
        }
    }
}

/// What was sensed beside what was true.
pub(super) fn comparison(impact: &ImpactReport) -> Markup {
    let Some(truth) = &impact.truth else { return html! {} };
    let blow = &impact.events[0];
    html! {
        h3 { "Sensed beside true" }
        p {
            "The rig is simulated, so the force that really reached the load cell is known."
        }
        table {
            thead { tr { th { "contact" } th { "quantity" } th.number { "sensed" } th.number { "true" } th.number { "error" } } }
            tbody {
                @for (number, contact) in truth.contacts.iter().enumerate() {
                    @let name = if number == 0 { "blow".to_owned() } else { format!("touch {}", number + 1) };
                    @match sensed(impact, contact.contact_s) {
                        Some((event, sensed_s)) => {
                            @let instant_error_us = 1e6 * (sensed_s - contact.contact_s);
                            tr {
                                td rowspan="3" { (name) }
                                td { "contact instant" }
                                td.number { (format!("{:.3} ms", 1e3 * sensed_s)) }
                                td.number { (format!("{:.3} ms", 1e3 * contact.contact_s)) }
                                td.number { (format!("{instant_error_us:+.1} µs")) }
                            }
                            (row("raw peak", f64::from(event.raw_peak.0), contact.peak_N, "N", 2))
                            (row("impulse", f64::from(event.impulse.0), contact.impulse_Ns, "N·s", 4))
                        }
                        None => {
                            tr {
                                td { (name) }
                                td { "peak" }
                                td.number { "no event of its own" }
                                td.number { (format!("{:.2} N", contact.peak_N)) }
                                td {}
                            }
                        }
                    }
                }
                tr {
                    td rowspan="2" { "impact" }
                    td { "largest judged force" }
                    (cells(f64::from(blow.severity.transient.0), truth.filtered_peak_n, "N", 2))
                }
                (row("scaled force", f64::from(blow.severity.scaled.0), truth.scaled_n, "N", 2))
            }
        }
    }
}

/// The event that belongs to a true touch: it begins within 5 ms of it; with its instant in seconds after the blow's.
fn sensed(impact: &ImpactReport, contact_s: f64) -> Option<(&Event, f64)> {
    const WITHIN_S: f64 = 0.005;
    let blow = impact.events.first()?;
    impact
        .events
        .iter()
        .map(|event| (event, f64::from(event.contact_instant.since(blow.contact_instant, impact.sample_rate).0)))
        .filter(|(_, at)| (at - contact_s).abs() < WITHIN_S)
        .min_by(|a, b| (a.1 - contact_s).abs().total_cmp(&(b.1 - contact_s).abs()))
}

fn row(name: &str, sensed: f64, truth: f64, unit: &str, decimals: usize) -> Markup {
    html! { tr { td { (name) } (cells(sensed, truth, unit, decimals)) } }
}

fn cells(sensed: f64, truth: f64, unit: &str, decimals: usize) -> Markup {
    let error = sensed - truth;
    html! {
        td.number { (format!("{sensed:.decimals$} {unit}")) }
        td.number { (format!("{truth:.decimals$} {unit}")) }
        td.number { (format!("{error:+.decimals$} {unit} ({:+.2} %)", 100.0 * error / truth)) }
    }
}

/// The flags of an impact in words.
pub(super) fn flags(impact: &ImpactReport) -> Markup {
    let all = impact.events.iter().fold(Flags::empty(), |all, event| all | event.flags);
    let explained = words::explain_flags(all);
    html! {
        @if !explained.is_empty() {
            h3 { "Flags" }
            dl { @for (name, sentence) in explained { dt { (name) } dd { (sentence) } } }
        }
    }
}

/// What everything was judged by.
pub(super) fn configuration(configuration: &Configuration) -> Markup {
    let chain = &configuration.chain;
    html! {
        h2 { "What it was judged by" }
        dl {
            dt { "body region" }
            dd {
                @match configuration.region {
                    Some(region) => {
                        (words::region_name(region))
                        (format!(", effective mass of the body part {} kg", region.body().effective_mass.0))
                    }
                    None => { "none chosen, so there is no verdict" }
                }
            }
            dt { "limits" } dd { (configuration.limits.provenance()) }
            @if let Some(region) = configuration.region {
                @let limits = configuration.limits.limits(region);
                dt { "limits of this region" }
                dd {
                    "quasi-static " (format!("{} N", limits.quasi_static.0)) ", transient "
                    @match limits.transient {
                        TransientLimit::UpTo(limit) => { (format!("{} N", limit.0)) }
                        TransientLimit::NotPermitted => { "not permitted at any force" }
                    }
                }
            }
            dt { "contact" } dd { (words::contact_name(configuration.contact)) }
            dt { "body spring in the rig" } dd { (format!("{} N/mm (the pad is never credited)", configuration.body_stiffness.0 / 1e3)) }
            dt { "filter of the judged force" } dd { (words::filter_description(configuration.filter)) }
            dt { "uncertainty of the force" }
            dd { (format!("{} % (k = 2), with twice the noise in squares", 100.0 * configuration.relative_uncertainty)) }
            dt { "onset" }
            dd { (format!("{} times the noise, at least {} N", configuration.onset_multiple, configuration.onset_minimum.0)) }
            dt { "measuring chain" }
            dd {
                (format!(
                    "{} samples per second, {:.4} N per code, full scale ±{:.0} N, time constant {} s",
                    chain.sample_rate.0,
                    chain.newton_per_code,
                    chain.newton_per_code * f32::from(chain.zero_code),
                    chain.time_constant.0
                ))
            }
        }
    }
}
