//! Balls that fell 35 m: height at 15 to 30 Hz, one drop of each (de Silva et al., doi 10.3389/frai.2020.00025).
//!
//! Each by itself, and all in one campaign, each its own configuration. Baseline: gravity. Masses are the authors' (a volleyball's is not
//! given: 0.27 kg, as the rules of the game have it). A start of 1 m/s up or down is allowed, since the release is not at t = 0; the heights scatter by 0.08 to 0.14 m even where the ball is heavy, and 0.15 m is stated.

use std::path::Path;

use super::{Belief, Campaign, Entry, Expected, Real, channel, series};

const DRAGS: Expected = Expected::Names(&["air-drag"]);
const STRONG: &str = "air drag, strong";
const SOME: &str = "air drag";
const NONE: &str = "nothing beyond gravity can be seen";

/// Ball, mass in kg, what the authors say, what that makes of the answer.
const BALLS: [(&str, f64, &str, Expected); 11] = [
    ("whiffle_ball_1", 0.0283, STRONG, DRAGS),
    ("whiffle_ball_2", 0.0283, STRONG, DRAGS),
    ("orange_whiffle_ball", 0.0425, STRONG, DRAGS),
    ("yellow_whiffle_ball", 0.0425, STRONG, DRAGS),
    ("tennis_ball", 0.0567, SOME, DRAGS),
    ("volleyball", 0.27, SOME, DRAGS),
    ("green_basketball", 0.4536, SOME, DRAGS),
    ("blue_basketball", 0.5103, SOME, DRAGS),
    ("baseball", 0.1417, "not said whether anything can be seen", Expected::Open),
    ("golf_ball", 0.0459, NONE, Expected::Nothing),
    ("bowling_ball", 2.2963, NONE, Expected::Nothing),
];

/// Heights of one ball, and what is stated of it.
fn entry(
    recordings: &Path,
    folder: &Path,
    ball: &'static str,
    mass_kg: f64,
    configuration: Option<&'static str>,
) -> Entry {
    let file = format!("{ball}.csv");
    let heights = channel(&recordings.join(format!("ball_drops/{ball}_drop1.csv")), "height_m");
    series(&folder.join(&file), "height_m", heights);
    Entry { file, speed_m_per_s: Belief(0.0, 1.0), mass_kg: Belief(mass_kg, 0.02 * mass_kg), configuration }
}

fn campaign(entries: Vec<Entry>) -> Campaign {
    Campaign {
        kind: "fall",
        body_n_per_m: None,
        sample_rate_hz: 15.0,
        noise_rms: 0.15,
        full_scale: 60.0,
        observed: "height_m",
        entries,
    }
}

pub fn all() -> Vec<Real> {
    let alone = |(ball, mass_kg, documented, expected): (&'static str, f64, &'static str, Expected)| Real {
        name: ball.replace('_', "-"),
        about: "a ball falls 35 m, height",
        documented,
        expected,
        make: Box::new(move |recordings, folder| campaign(vec![entry(recordings, folder, ball, mass_kg, None)])),
    };
    let together = Real {
        name: "all-balls".to_owned(),
        about: "eleven balls fall 35 m, height",
        documented: "air drag of the light ones",
        expected: DRAGS,
        make: Box::new(|recordings, folder| {
            let each = BALLS.iter().map(|(ball, mass_kg, ..)| entry(recordings, folder, ball, *mass_kg, Some(ball)));
            campaign(each.collect())
        }),
    };
    BALLS.into_iter().map(alone).chain([together]).collect()
}
