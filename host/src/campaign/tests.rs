//! The campaign format: what the contract shows is read, everything else is refused at its place.

use proptest::prelude::*;

use super::*;

/// The example of the contract, word for word.
const CONTRACT: &str = r#"format = "thud-campaign/1"
name = "chest, pose 1 to 4"

[rig]
kind = "impact"                # "impact": a robot runs into the fixed rig. "drop": a mass falls on it, gravity acts. "fall": free flight, no rig.
body_stiffness_N_per_m = { value = 25000.0, sd = 1250.0 }
pad_stiffness_N_per_m  = { value = 80000.0, sd = 20000.0 }       # optional; in series with the body spring
moving_mass_kg         = { value = 0.12, sd = 0.01 }             # optional; the impact piece, whose inertia the baseline ignores
gravity_along_impact_m_per_s2 = 0.0                              # optional

[chain]
sample_rate_Hz = 10000.0
noise_rms_N = 0.3              # of the observed channel, in its own unit
full_scale_N = 2224.0
observed = "force_N"           # "force_N" | "displacement_m" | "height_m" | "acceleration_m_per_s2"

[[recording]]
file = "recordings/001.csv"
impact_speed_m_per_s = { value = 0.250, sd = 0.003 }
effective_mass_kg    = { value = 6.08, sd = 0.18 }
configuration = "1"            # optional; recordings of one configuration share the robot's mass error
"#;

fn contract() -> Campaign {
    Campaign {
        name: "chest, pose 1 to 4".to_owned(),
        rig: Rig {
            kind: RigKind::Impact,
            body_stiffness_n_per_m: Some(Estimate::new(25_000.0, 1_250.0)),
            pad_stiffness_n_per_m: Some(Estimate::new(80_000.0, 20_000.0)),
            moving_mass_kg: Some(Estimate::new(0.12, 0.01)),
            gravity_along_impact_m_per_s2: 0.0,
            spring_repeatability: 0.002,
        },
        chain: Chain { sample_rate_hz: 10_000.0, noise_rms: 0.3, full_scale: Some(2_224.0), observed: Observed::Force },
        recordings: vec![Entry {
            file: "recordings/001.csv".to_owned(),
            impact_speed_m_per_s: Estimate::new(0.25, 0.003),
            effective_mass_kg: Estimate::new(6.08, 0.18),
            configuration: Some("1".to_owned()),
        }],
    }
}

#[test]
fn the_contract_s_example_is_read() {
    assert_eq!(Campaign::parse("campaign.toml", CONTRACT).unwrap(), contract());
}

#[test]
fn optional_keys_have_their_defaults() {
    let text = r#"
        format = "thud-campaign/1"
        name = "n"
        [rig]
        kind = "drop"
        body_stiffness_N_per_m = { value = 75000, sd = 0 }
        [chain]
        sample_rate_Hz = 10000
        noise_rms_N = 0
        observed = "force_N"
        [[recording]]
        file = "a.csv"
        impact_speed_m_per_s = { value = 1, sd = 0 }
        effective_mass_kg = { value = 1, sd = 0 }
    "#;
    let campaign = Campaign::parse("campaign.toml", text).unwrap();
    assert_eq!(campaign.rig.spring_repeatability, 0.002);
    assert_eq!(campaign.rig.gravity_along_impact_m_per_s2, 9.80665);
    assert_eq!(campaign.rig.pad_stiffness_n_per_m, None);
    assert_eq!(campaign.chain.full_scale, None);
    assert_eq!(campaign.recordings[0].configuration, None);
    assert_eq!(Campaign::parse("again.toml", &campaign.to_toml()).unwrap(), campaign);
}

/// The contract's example with one line replaced, and what must be said about it.
#[test]
fn every_fault_is_placed_and_named() {
    let fall = CONTRACT.replacen("\"impact\"", "\"fall\"", 1).replacen("_s2 = 0.0", "_s2 = 9.81", 1);
    let error = Campaign::parse("campaign.toml", &fall).unwrap_err();
    assert!(error.problem().contains("a fall has no rig"), "{error}");
    assert_eq!((error.line(), error.column()), (Some(15), Some(12)));
    let two = format!("{CONTRACT}{}", &CONTRACT[CONTRACT.find("[[recording]]").unwrap()..]);
    for (from, to, place, problem) in [
        ("thud-campaign/1", "thud-campaign/2", (1, 10), "the format is `thud-campaign/2`"),
        ("name = ", "naem = ", (2, 1), "unknown field `naem`"),
        ("\"impact\" ", "\"crash\" ", (5, 8), "`kind` is \"crash\""),
        ("moving_mass_kg ", "moving_mass_g ", (8, 1), "unknown field `moving_mass_g`"),
        ("25000.0, sd = 1250.0", "25000.0", (6, 26), "missing field `sd`"),
        ("value = 25000.0", "value = -25000.0", (6, 26), "is -25000"),
        ("value = 25000.0", "value = nan", (6, 26), "is NaN"),
        ("sd = 1250.0", "sd = -1", (6, 26), "sd of `body_stiffness_N_per_m` is -1"),
        ("sd = 1250.0", "sd = inf", (6, 26), "sd of `body_stiffness_N_per_m` is inf"),
        ("sd = 1250.0", "sd = \"5 %\"", (6, 50), "invalid type"),
        ("{ value = 25000.0, sd = 1250.0 }", "25000.0", (6, 26), "invalid type"),
        ("sample_rate_Hz = 10000.0", "sample_rate_Hz = 0", (12, 18), "`sample_rate_Hz` is 0"),
        ("noise_rms_N = 0.3", "noise_rms_N = 3000", (13, 15), "not below the full scale"),
        ("observed = \"force_N\"", "observed = \"force\"", (15, 12), "`observed` is \"force\""),
        ("0.250", "0.0", (19, 24), "`impact_speed_m_per_s` is 0"),
        ("6.08", "0", (20, 24), "`effective_mass_kg` is 0"),
        ("configuration = \"1\"", "configuration = 1", (21, 17), "invalid type"),
        ("\"recordings/001.csv\"", "\"\"", (18, 8), "`file` is empty"),
        ("kind = \"impact\"", "kind = \"fall\"", (9, 33), "gravity acts"),
        ("kind = \"impact\"", "kind = \"drop\"", (9, 33), "gravity acts"),
        ("[chain]", "[chain", (11, 7), ""),
    ] {
        assert!(CONTRACT.contains(from), "{from}");
        let text = CONTRACT.replacen(from, to, 1);
        let error = Campaign::parse("campaign.toml", &text).expect_err(to);
        assert!(error.problem().contains(problem), "{to}: {error}");
        assert_eq!((error.line(), error.column()), (Some(place.0), Some(place.1)), "{to}: {error}");
    }
    let error = Campaign::parse("campaign.toml", &two).unwrap_err();
    assert!(error.problem().contains("already recording 1"), "{error}");
    assert_eq!(error.line(), Some(23));
    let none = &CONTRACT[..CONTRACT.find("[[recording]]").unwrap()];
    assert!(Campaign::parse("campaign.toml", none).unwrap_err().problem().contains("no recording"));
    let no_spring: String =
        CONTRACT.lines().filter(|line| !line.starts_with("body_stiffness")).map(|line| format!("{line}\n")).collect();
    let error = Campaign::parse("campaign.toml", &no_spring).unwrap_err();
    assert!(error.problem().contains("has a body spring"), "{error}");
    assert_eq!(error.line(), Some(4));
}

fn estimate() -> impl Strategy<Value = Estimate> {
    (1e-3..1e6f64, 0.0..1e3f64).prop_map(|(value, sd)| Estimate::new(value, sd))
}

prop_compose! {
    fn campaign()(
        name in "\\PC{0,20}",
        drop in any::<bool>(),
        body in estimate(),
        pad in prop::option::of(estimate()),
        piece in prop::option::of(estimate()),
        gravity in 0.1..20.0f64,
        spring_repeatability in prop_oneof![Just(0.002), 0.0..0.5f64],
        sample_rate_hz in 10.0..1e6f64,
        noise_rms in 0.0..10.0f64,
        observed in 0..2usize,
        recordings in prop::collection::vec((estimate(), estimate(), prop::option::of("\\PC{0,5}")), 1..5),
    ) -> Campaign {
        Campaign {
            name,
            rig: Rig {
                kind: if drop { RigKind::Drop } else { RigKind::Impact },
                body_stiffness_n_per_m: Some(body),
                pad_stiffness_n_per_m: pad,
                moving_mass_kg: piece,
                gravity_along_impact_m_per_s2: gravity,
                spring_repeatability,
            },
            chain: Chain { sample_rate_hz, noise_rms, full_scale: Some(2_224.0), observed: Observed::ALL[observed] },
            recordings: recordings
                .into_iter()
                .enumerate()
                .map(|(index, (speed, mass, configuration))| Entry {
                    file: format!("recordings/{index:03}.csv"),
                    impact_speed_m_per_s: speed,
                    effective_mass_kg: mass,
                    configuration,
                })
                .collect(),
        }
    }
}

proptest! {
    #[test]
    fn what_is_written_is_read_back(campaign in campaign()) {
        let text = campaign.to_toml();
        prop_assert_eq!(Campaign::parse("campaign.toml", &text).unwrap(), campaign, "{}", text);
    }

    #[test]
    fn no_text_makes_it_panic(at in 0..2000usize, insert in "\\PC{0,12}", cut in 0..40usize) {
        let mut text = CONTRACT.to_owned();
        let mut start = at.min(text.len());
        while !text.is_char_boundary(start) { start -= 1; }
        let end = (start + cut).min(text.len());
        if text.is_char_boundary(end) { text.replace_range(start..end, &insert); }
        if let Err(error) = Campaign::parse("campaign.toml", &text) {
            let _ = format!("{:?}", miette::Report::new(error));
        }
    }
}

fn force(values: [f64; 3]) -> recording::Recording {
    let times = vec![0.0, 1e-4, 2e-4];
    let channel = recording::Channel { name: recording::FORCE.to_owned(), values: values.to_vec() };
    recording::Recording::new(times, vec![channel]).unwrap()
}

#[test]
fn a_folder_is_written_and_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let recording = force([0.0, 1.0, -0.07]);
    contract().write(folder.path(), std::slice::from_ref(&recording)).unwrap();
    let loaded = load(folder.path()).unwrap();
    assert_eq!(loaded.campaign, contract());
    assert_eq!(loaded.recordings, [recording]);
    assert_eq!(loaded.warnings, [] as [String; 0]);
    assert_eq!(load(&folder.path().join(FILE_NAME)).unwrap().campaign, contract());
}

#[test]
fn missing_files_and_channels_are_said_where_they_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let error = load(folder.path()).unwrap_err();
    assert!(error.to_string().contains("campaign.toml"), "{error}");

    contract().write(folder.path(), &[force([0.0; 3])]).unwrap();
    let csv = folder.path().join("recordings/001.csv");
    std::fs::write(&csv, "time_s,height_m\n0,0\n0.0001,0\n").unwrap();
    let error = load(folder.path()).unwrap_err();
    assert!(error.problem().contains("`force_N` is no column of"), "{error}");
    assert!(error.remedy().contains("height_m"));

    std::fs::remove_file(&csv).unwrap();
    let error = load(folder.path()).unwrap_err();
    assert!(error.problem().contains("001.csv does not exist"), "{error}");
    let line = contract().to_toml().lines().position(|line| line.starts_with("file = ")).unwrap() + 1;
    assert_eq!(error.line(), Some(line));
}

#[test]
fn what_contradicts_the_stated_chain_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let mut campaign = contract();
    campaign.chain.sample_rate_hz = 20_000.0;
    campaign.write(folder.path(), &[force([0.0, 5_000.0, 0.0])]).unwrap();
    let warnings = load(folder.path()).unwrap().warnings;
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(warnings[0].contains("full scale") && warnings[1].contains("10000"), "{warnings:?}");
}
