//! A replay as a report.

use thud_firmware::configuration::Configuration;

use super::Replayed;
use crate::report::{ImpactReport, Report};

/// The page of one or more replayed recordings, each with the name of its file; `configuration` is what they were judged by.
#[must_use]
pub fn report(recordings: &[(String, Replayed)], configuration: &Configuration) -> Report {
    let mut facts = Vec::new();
    let mut impacts = Vec::new();
    for (file, replayed) in recordings {
        facts.push(("recording".to_owned(), file.clone()));
        facts.extend(replayed.prepared.notes.iter().map(|note| (String::new(), note.clone())));
        if replayed.prepared.lost > 0 {
            facts.push((String::new(), format!("{} samples of it are missing", replayed.prepared.lost)));
        }
        for sensed in &replayed.impacts {
            let Some(blow) = sensed.events.first() else { continue };
            let instant = blow.contact_instant;
            let heading = format!("Impact {}", sensed.context.impact);
            impacts.push(ImpactReport {
                heading: if recordings.len() > 1 { format!("{heading} of {file}") } else { heading },
                curve: Some(sensed.curve.clone()),
                events: sensed.events.clone(),
                sample_rate: replayed.configuration.chain.sample_rate,
                clock: (
                    replayed.prepared.time_s(instant.index as f64 + f64::from(instant.fraction)),
                    "s in the recording's own time".to_owned(),
                ),
                truth: None,
                notes: Vec::new(),
            });
        }
    }
    // One recording has one rate; with several the rate of each is in its notes.
    let configuration = recordings.first().map_or(*configuration, |(_, replayed)| replayed.configuration);
    Report {
        title: "Replay of a force recording".to_owned(),
        about: vec![
            "A recorded force was pushed through the logic that runs in the thud impact sensor: the same code that a board runs found the contacts, measured and judged them.".to_owned(),
        ],
        facts,
        impacts,
        configuration,
        closing: None,
    }
}
