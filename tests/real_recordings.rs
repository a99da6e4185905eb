//! Recordings of real impacts through the sensor's logic: every blow found once, the rebound separately, nothing before
//! contact.
//!
//! They need the recordings of `shared_recordings.rs`.

use shared_recordings::find;
use thud::recording::{self, FORCE, Recording};
use thud::replay::{Outcome, ReplayError, replay};
use thud_firmware::configuration::Configuration;
use thud_firmware::limits::Region;
use thud_firmware::units::Kilogram;

mod real_campaigns;
mod shared_recordings;
mod tool;

fn configuration() -> Configuration {
    Configuration { region: Some(Region::Chest), effective_mass: Some(Kilogram(6.0)), ..Configuration::DEFAULT }
}

fn replayed(file: &str) -> Option<(Recording, Outcome)> {
    let path = find(file)?;
    let recording = recording::read(&path).unwrap();
    let replayed = replay(file, &recording, &configuration(), None).unwrap();
    let mut outcome = Outcome::default();
    outcome.add(&replayed, None);
    Some((recording, outcome))
}

/// Highest recorded force and when.
fn highest(recording: &Recording) -> (f64, f64) {
    let force = recording.channel(FORCE).unwrap().iter().copied();
    recording.times_s().iter().copied().zip(force).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
}

#[test]
fn each_hammer_blow_is_found_once() {
    for blow in 1..=5 {
        let Some((recording, outcome)) = replayed(&format!("impact_hammer/blow{blow}.csv")) else { return };
        assert_eq!(outcome.events.len(), 1, "blow {blow}: {:?}", outcome.events);
        let event = &outcome.events[0];
        let (at, peak) = highest(&recording);
        // A half sine of half width 0.18 ms, sampled every 0.039 ms, peaks up to 2.6 % above its highest sample.
        let above = event.raw_peak_N / peak - 1.0;
        assert!((-0.002..0.03).contains(&above), "blow {blow}: {} N for {peak} N", event.raw_peak_N);
        assert!((event.peak_s - at).abs() < 1.0 / 25_600.0, "blow {blow}: {} s for {at} s", event.peak_s);
        // The pulse rises in less than 0.4 ms, half of which lies below a tenth of the peak.
        assert!(event.contact_s < event.peak_s && event.contact_s > at - 0.4e-3, "blow {blow}: {event:?}");
        // Half width 0.16 to 0.20 ms and impulse 12 to 15 mN·s, as the recordings' own notes say.
        assert!((0.0115..0.0160).contains(&event.impulse_Ns), "blow {blow}: {} N·s", event.impulse_Ns);
        assert!((0.2e-3..0.6e-3).contains(&event.duration_s), "blow {blow}: {} s", event.duration_s);
        assert!(event.flags.contains(&"short-pulse"), "a pulse of 0.3 ms is too short for 100 Hz");
        assert_eq!(outcome.lost, 0);
    }
}

/// Contact is at t = 0 by the authors' definition; the sample before it is 0.8 ms earlier, and somewhere between them
/// it was.
#[test]
fn each_robot_drive_is_found_once_with_its_rebounds_and_nothing_before_contact() {
    // File, and when the second hit begins, s.
    let drives = [
        ("force_ur_gain1_v0.10.csv", None),
        ("force_ur_gain1_v0.25.csv", Some(0.095..0.105)),
        ("force_acf_ramp0.1s_fzero10N_v0.10.csv", Some(0.036..0.055)),
        ("force_acf_ramp0.1s_fzero10N_v0.25.csv", Some(0.045..0.060)),
    ];
    for (file, second) in drives {
        let Some((recording, outcome)) = replayed(&format!("ur10e_direct_contact/{file}")) else { return };
        let blow = &outcome.events[0];
        assert!((-0.0016..=0.0002).contains(&blow.contact_s), "{file}: {} s", blow.contact_s);
        assert!(outcome.events.iter().all(|event| event.impact == 1), "{file}: {:?}", outcome.events);
        assert!(outcome.events.iter().filter(|event| event.contact == 0).count() == 1, "{file}");
        let (_, peak) = highest(&recording);
        assert!((blow.raw_peak_N / peak - 1.0).abs() < 0.01, "{file}: {} N for {peak} N", blow.raw_peak_N);
        assert!(blow.peak_N < blow.raw_peak_N, "{file}");
        match second {
            None => assert_eq!(outcome.events.len(), 1, "{file}: {:?}", outcome.events),
            Some(second) => {
                let rebound = &outcome.events[1];
                assert!(second.contains(&rebound.contact_s), "{file}: {} s", rebound.contact_s);
                assert!(outcome.events[1..].iter().all(|event| event.flags.contains(&"rebound")), "{file}");
            }
        }
        // The robot goes on pushing until the recording ends: that contact is cut, and said to be.
        let last = outcome.events.last().unwrap();
        assert!(last.flags.contains(&"held") && last.flags.contains(&"truncated"), "{file}: {last:?}");
        assert_ne!(last.verdict, "pass", "{file}");
        assert_eq!(outcome.lost, 0, "{file}");
    }
}

/// 0.25 m/s hits harder than 0.10 m/s, with robot control and with the active flange.
#[test]
fn a_faster_drive_is_a_harder_one() {
    for control in ["ur_gain1", "acf_ramp0.1s_fzero10N"] {
        let file = |speed: &str| format!("ur10e_direct_contact/force_{control}_v{speed}.csv");
        let (Some((_, slow)), Some((_, fast))) = (replayed(&file("0.10")), replayed(&file("0.25"))) else { return };
        let ratio = fast.events[0].peak_N / slow.events[0].peak_N;
        assert!((1.8..3.2).contains(&ratio), "{control}: {ratio}");
    }
}

#[test]
fn a_recording_without_force_is_refused_with_what_it_has() {
    let Some(path) = find("ball_drops/baseball_drop1.csv") else { return };
    let recording = recording::read(&path).unwrap();
    let error = replay("baseball_drop1.csv", &recording, &configuration(), None).unwrap_err();
    assert!(matches!(&error, ReplayError::NoForce { has, .. } if has == "height_m, velocity_m_per_s"), "{error}");
}

/// Every time series among the recordings is read; the one table that is none is refused at its header.
#[test]
fn every_recording_is_read() {
    let Some(folder) = find("") else { return };
    let mut read = 0;
    for set in std::fs::read_dir(folder).unwrap() {
        let set = set.unwrap().path();
        if !set.is_dir() {
            continue;
        }
        for file in std::fs::read_dir(set).unwrap() {
            let file = file.unwrap().path();
            if file.extension().is_none_or(|extension| extension != "csv") {
                continue;
            }
            match recording::read(&file) {
                Ok(recording) => {
                    assert!(!recording.comments().is_empty(), "{}", file.display());
                    read += 1;
                }
                Err(error) => assert!(error.problem().contains("first column is `point_index`"), "{error}"),
            }
        }
    }
    assert!(read > 30, "{read} recordings");
}

/// What the tool says to a campaign of real recordings, in a process that has nothing but the campaign.
fn diagnosed(real: &real_campaigns::Real, recordings: &std::path::Path, out: &std::path::Path) -> serde_json::Value {
    let campaign = out.join(&real.name);
    std::fs::create_dir_all(&campaign).unwrap();
    (real.make)(recordings, &campaign).write(&campaign);
    tool::json(&["diagnose", campaign.to_str().unwrap()])
}

/// Every real campaign can be made and is read without complaint. `cargo run --release -p thud --example real`
/// diagnoses all of them; docs/proof.md has its table.
#[test]
fn every_real_campaign_is_a_campaign() {
    let Some(recordings) = find("") else { return };
    let out = tempfile::TempDir::new().unwrap();
    let all = real_campaigns::all();
    assert!(all.len() > 15);
    for real in all {
        assert!(!real.about.is_empty() && !real.documented.is_empty(), "{}", real.name);
        let folder = out.path().join(&real.name);
        std::fs::create_dir_all(&folder).unwrap();
        (real.make)(&recordings, &folder).write(&folder);
        let loaded = thud::campaign::load(&folder).unwrap_or_else(|error| panic!("{}: {error}", real.name));
        assert!(loaded.warnings.is_empty(), "{}: {:?}", real.name, loaded.warnings);
    }
}

/// The friction of a real piston is found in the motion that it leaves, at 1 and 7 bar of pressure. Its authors measured it: half the width of
/// the loop, freed of the pressure, is 3.9 N and 7.8 N.
#[test]
fn the_friction_of_a_real_piston_is_named_and_measured() {
    let Some(recordings) = find("") else { return };
    let out = tempfile::TempDir::new().unwrap();
    for (name, half_width_n) in [("piston-1-bar", 3.9), ("piston-7-bar", 7.8)] {
        let real = real_campaigns::all().into_iter().find(|real| real.name == name).unwrap();
        let answer = diagnosed(&real, &recordings, out.path());
        let named = real_campaigns::named(&answer);
        assert_eq!(
            real.expected.agrees(&answer),
            real_campaigns::Agreement::Yes,
            "{name}: {} {named:?}",
            answer["verdict"]
        );
        let force_n = answer["mechanisms"][0]["parameters"][0]["value"].as_f64().unwrap();
        assert!((force_n / half_width_n - 1.0).abs() < 0.2, "{name}: {force_n} N");
    }
}

/// Balls that fell 35 m: drag slows the light ones, each with its own mass, and cannot be seen on golf and bowling balls; nor does it take all
/// of them for one.
#[test]
fn light_balls_show_air_drag_and_heavy_ones_nothing() {
    let Some(recordings) = find("") else { return };
    let out = tempfile::TempDir::new().unwrap();
    let mut balls = 0;
    for real in real_campaigns::all().into_iter().filter(|real| real.about.contains("35 m")) {
        let first = match real.expected {
            real_campaigns::Expected::Names(names) => Some(names[0]),
            real_campaigns::Expected::Nothing => None,
            real_campaigns::Expected::Open => continue,
        };
        let named = real_campaigns::named(&diagnosed(&real, &recordings, out.path()));
        assert_eq!(named.first().map(|names| names[0].as_str()), first, "{}", real.name);
        balls += 1;
    }
    assert_eq!(balls, 11);
}
