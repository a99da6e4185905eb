//! The same counts through the same logic on this machine and on a Cortex-M4F in QEMU: the events must be the same bytes, and
//! the per-sample path must fit into its instructions.
//!
//! `cargo xtask qemu` builds the program for the target, says where it lies (`THUD_CORTEX_M4`), and runs this.

use std::collections::HashMap;
use std::path::PathBuf;
use std::process::Command;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use thud_cortex_m4::{Run, Uncounted};
use thud_firmware::board::BLOCK;
use thud_firmware::units::{Hertz, Newton};
use thud_sim::chain::{ChainSettings, Hum, MeasuringChain, Noise};
use thud_sim::rig::{Accuracy, Approach, Impact, Quantity, Rig};

const RATE: f64 = 20_000.0;
/// Instructions a sample for the whole path.
const BUDGET: f64 = 150.0;

/// Blows a second and a half apart, from slow and soft to fast and hard: body springs N/m, pad N/m, speed m/s, piece kg.
const BLOWS: [(f64, f64, f64, f64); 6] = [
    (10e3, 17e3, 0.1, 0.05),
    (25e3, 17e3, 0.35, 0.12),
    (75e3, 1000e3, 0.25, 0.12),
    (150e3, 1000e3, 0.6, 0.05),
    (35e3, 80e3, 0.6, 0.3),
    // Beyond the chain's range: it clips.
    (150e3, 1000e3, 5.0, 0.05),
];
const FIRST_S: f64 = 2.2;
const APART_S: f64 = 1.5;

/// What the ADC gives while the rig is struck.
fn counts(seed: u64) -> Vec<u16> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let blows: Vec<(f64, Impact)> = BLOWS
        .iter()
        .zip(0..)
        .map(|(&(body, pad, speed, piece_kg), nth)| {
            let piece = format!("moving-piece-inertia:mass_kg={piece_kg}").parse().unwrap();
            let impact = Rig::impact(body)
                .with_pad(pad)
                .strike(&Approach::new(speed, 6.0), &[piece], 1.2, Accuracy::default())
                .unwrap();
            (FIRST_S + APART_S * f64::from(nth) + random.random_range(0.0..0.05), impact)
        })
        .collect();
    let mut settings = ChainSettings::workshop();
    settings.noise = Noise { white: Newton(0.3), coloured: None };
    settings.hum = Some(Hum { fundamental: Hertz(50.03), amplitude: Newton(0.5), harmonics: Vec::new() });
    let mut chain = MeasuringChain::new(&settings, seed);
    let samples = ((FIRST_S + APART_S * (BLOWS.len() as f64 + 0.5)) * RATE) as usize / BLOCK * BLOCK;
    let mut codes = vec![0; samples];
    for (nth, block) in codes.chunks_mut(BLOCK).enumerate() {
        let mut newtons = vec![0.0; BLOCK];
        for (contact_s, impact) in &blows {
            let times: Vec<f64> = (0..BLOCK).map(|at| (nth * BLOCK + at) as f64 / RATE - contact_s).collect();
            // Before the contact and after what was simulated nothing touches.
            if times[0] > -0.1 && times[BLOCK - 1] < 1.2 {
                for (sum, force) in newtons.iter_mut().zip(impact.sample(Quantity::CellForce, &times)) {
                    *sum += force;
                }
            }
        }
        chain.convert(&mut newtons, block);
    }
    codes
}

/// The events as this machine finds them.
fn on_the_desktop(codes: &[u16]) -> Vec<String> {
    let mut run = Box::new(Run::new());
    let mut events = Vec::new();
    for block in codes.chunks_exact(BLOCK) {
        run.push(block, &mut Uncounted, |record| {
            events.push(record.iter().map(|byte| format!("{byte:02x}")).collect());
        });
    }
    events
}

/// What the program in QEMU prints; `None` where there is no such program.
fn in_qemu(codes: &[u16]) -> Option<String> {
    let Some(program) = std::env::var_os("THUD_CORTEX_M4").map(PathBuf::from) else {
        eprintln!("SKIPPED: no program for the Cortex-M4F (THUD_CORTEX_M4); `cargo xtask qemu` builds it");
        return None;
    };
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let bytes: Vec<u8> = codes.iter().flat_map(|code| code.to_le_bytes()).collect();
    std::fs::write(folder.join("counts"), bytes).unwrap();
    let output = Command::new("qemu-system-arm")
        .args(["-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native", "-icount", "shift=6", "-kernel"])
        .arg(&program)
        .current_dir(&folder)
        .output()
        .unwrap_or_else(|error| panic!("qemu-system-arm: {error}"));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}: {text}{}", output.status, String::from_utf8_lossy(&output.stderr));
    Some(text)
}

#[test]
fn the_events_are_the_desktops_and_a_sample_fits_into_its_instructions() {
    let codes = counts(1);
    let Some(text) = in_qemu(&codes) else { return };

    let events: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("event ")).collect();
    let expected = on_the_desktop(&codes);
    assert!(expected.len() >= BLOWS.len(), "every blow is an event: {}", expected.len());
    assert_eq!(events, expected, "the same counts must give the same bytes");

    let numbers = |kind: &str| -> HashMap<&str, Vec<f64>> {
        let lines = text.lines().filter_map(|line| line.strip_prefix(kind)?.strip_prefix(' '));
        lines
            .map(|line| {
                let mut words = line.split(' ');
                (words.next().unwrap(), words.map(|word| word.parse().unwrap()).collect())
            })
            .collect()
    };
    let counted = numbers("count");
    let a_sample = |part: &str| counted[part][1] / counted[part][0];
    let most = |part: &str| numbers("most")[part][0] / BLOCK as f64;

    println!("| part of the path | instructions a sample |\n|---|---|");
    for part in ["calibrate", "track", "detect", "filter", "filter-in-c"] {
        println!("| {part} | {:.1} |", a_sample(part));
    }
    for part in ["idle", "open"] {
        println!("| all of it, {part} | {:.1}, in the costliest block {:.0} |", a_sample(part), most(part));
    }
    // 160 MHz, half of them for samples.
    let worst = a_sample("idle").max(a_sample("open"));
    println!("\nHighest sample rate at half load: {:.0} kS/s.", 80e3 / worst);

    for part in ["idle", "open"] {
        assert!(a_sample(part) <= BUDGET, "{part}: {:.1} instructions a sample of {BUDGET}", a_sample(part));
    }
    assert!(
        a_sample("filter") <= a_sample("filter-in-c"),
        "the filter takes {:.1} instructions a sample, in C {:.1}",
        a_sample("filter"),
        a_sample("filter-in-c")
    );
    let difference: f64 = text.lines().find_map(|line| line.strip_prefix("difference ")).unwrap().parse().unwrap();
    assert!(difference < 0.01, "both filters are the same filter, but differ by {difference} N");
}
