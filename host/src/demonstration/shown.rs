//! The demonstration as a report.

use maud::html;

use super::{Blow, Demonstrated, RECORDINGS, Riddle};
use crate::diagnosis::words::short;
use crate::report::{ImpactReport, ImpactTruth, Report, words};

/// The page of a demonstration; `beside` is the file name of the diagnosis' own page.
#[must_use]
pub fn report(demonstrated: &Demonstrated, riddle: &Riddle, beside: &str) -> Report {
    let scenario = &demonstrated.scenario;
    let (serial, node) = demonstrated.sensor;
    let (revision, hash) = demonstrated.stamp;
    let region = words::region_name(scenario.region);
    let mut facts = vec![
        ("seed".to_owned(), format!("{} (the same seed gives the same results)", scenario.seed)),
        ("sensor".to_owned(), format!("serial number {serial}, node {node}, simulated")),
        ("configuration".to_owned(), format!("revision {revision}, hash {hash:08x}")),
        (
            "effective mass of the robot".to_owned(),
            format!(
                "{:.3} kg says its controller over the bus, truly {:.3} kg",
                scenario.believed_mass_kg, scenario.true_mass_kg
            ),
        ),
        (
            "body springs".to_owned(),
            format!(
                "{:.2} N/mm, believed {:.0} N/mm",
                scenario.rig.body_stiffness_n_per_m / 1e3,
                scenario.region.body().stiffness.0 / 1e3
            ),
        ),
    ];
    if let Some(pad) = scenario.rig.pad_stiffness_n_per_m {
        facts.push(("pad".to_owned(), format!("{:.1} N/mm, in series with the springs", pad / 1e3)));
    }
    facts.extend(scenario.effects.iter().map(|effect| {
        let mechanism = effect.mechanism();
        // Which form it has says no more to a reader than its equation would.
        let parameters = mechanism.parameters.iter().zip(effect.values()).enumerate();
        let told = parameters.filter(|(place, (parameter, _))| !parameter.is_form() && effect.takes_part(*place));
        let values: Vec<String> = told
            .map(|(_, (parameter, value))| format!("{}: {} {}", parameter.meaning, short(*value), parameter.unit))
            .collect();
        ("beyond the ideal impact".to_owned(), format!("{} ({})", mechanism.id, values.join(", ")))
    }));
    facts.push((
        "frames over the simulated bus".to_owned(),
        format!(
            "{} received, {} lost, in {:.1} s of virtual time",
            demonstrated.frames.0, demonstrated.frames.1, demonstrated.virtual_s
        ),
    ));
    Report {
        title: format!("A simulated robot hits the {region}"),
        about: vec![
            format!(
                "A robot runs into a test rig {} times, each time faster. The rig stands for the {region} of a person: springs as stiff as the body, a pad like skin and flesh, and a load cell behind them. The impact sensor on the rig says how hard each blow was and whether a person would have borne it.",
                demonstrated.blows.len()
            ),
            "Everything here is simulated, but the sensor's logic is the real one: the firmware's own tasks ran on a simulated board, with noise, mains hum and drift in the signal, and everything below was fetched from it over a simulated CAN bus. Because the rig is simulated, what it truly did is known, and stands beside what was sensed.".to_owned(),
        ],
        facts,
        impacts: demonstrated
            .blows
            .iter()
            .enumerate()
            .map(|(index, blow)| impact(index, blow, demonstrated))
            .collect(),
        configuration: demonstrated.configuration,
        closing: Some(html! {
            h2 { "And what if rig and simulation differ?" }
            p {
                "Another rig was hit " (RECORDINGS) " times, and something was hidden in it: an effect that the seed chose. It was simulated by a
                 program that shares nothing with the one that was then asked what is missing; that one got the recordings and what the experimenter
                 believes, as " code { "thud diagnose" } " does."
            }
            (riddle.telling)
            p { strong { (riddle.resolved()) } " " a href=(beside) { "The whole diagnosis" } " says where, what, how strong, and why nothing else." }
        }),
    }
}

fn impact(index: usize, blow: &Blow, demonstrated: &Demonstrated) -> ImpactReport {
    let sample_rate = demonstrated.configuration.chain.sample_rate;
    let sensed_s = blow.events[0].contact_instant.seconds(sample_rate);
    let truth = &blow.truth;
    let contacts = truth.contacts.iter().map(|contact| contact.shifted(-sensed_s)).collect();
    let alarm = blow.alarm_after_s.map(|after| {
        format!(
            "The alarm frame was with the host {:.2} ms after the true contact, before the peak was known.",
            1e3 * after
        )
    });
    ImpactReport {
        heading: format!("Blow {}, at {:.3} m/s", index + 1, blow.speed_m_per_s),
        curve: blow.curve.clone(),
        events: blow.events.clone(),
        sample_rate,
        clock: (sensed_s, "s after the sensor was switched on".to_owned()),
        truth: Some(ImpactTruth {
            curve: truth.curve.iter().map(|(time, force)| (time - sensed_s, *force)).collect(),
            contacts,
            filtered_peak_n: truth.filtered_peak_n,
            scaled_n: truth.scaled_n(),
        }),
        notes: alarm.into_iter().collect(),
    }
}
