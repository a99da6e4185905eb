//! Where the processor spends an impact: the functions in which it is found, looked at every 20 µs.
//!
//! `cargo run -p thud-emulator --features unicorn --example profile`

use std::collections::BTreeMap;

use embassy_time::Duration;
use thud_emulator::emulator::{Emulator, Settings};
use thud_emulator::image::Image;
use thud_sim::chain::ChainSettings;
use thud_sim::force::Blows;

const STEP: Duration = Duration::from_micros(20);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let image = Image::read(&Image::usual_place())?;
    let blows = Blows::new();
    let settings = Settings { chain: ChainSettings::workshop(), ..Settings::default() };
    let mut emulator = Emulator::new(&image, &settings, blows.clone());
    emulator.run_for(Duration::from_secs(1));
    // 5 kg at 0.25 m/s on 25 N/mm.
    blows.strike(1.1, 0.0444, |since_s| 88.4 * (since_s / 0.0444 * std::f64::consts::PI).sin());
    for (name, lasts) in [("idle", 100), ("impact and transient window", 1_000), ("afterwards", 1_000)] {
        let mut found: BTreeMap<(bool, String), u64> = BTreeMap::new();
        let instructions = emulator.machine().instructions();
        let steps = lasts * 1_000 / STEP.as_micros();
        let mut asleep = 0;
        for _ in 0..steps {
            emulator.run_for(STEP);
            if emulator.machine().is_asleep() {
                asleep += 1;
                continue;
            }
            let thread = emulator.chip().nvic.depth() == 0;
            *found.entry((thread, image.function_at(emulator.machine().pc()).to_owned())).or_default() += 1;
        }
        let instructions = emulator.machine().instructions() - instructions;
        println!(
            "{name}: {:.1} % asleep, {:.1} million instructions a second",
            100.0 * asleep as f64 / steps as f64,
            instructions as f64 * 1e-3 / lasts as f64
        );
        let mut found: Vec<_> = found.into_iter().collect();
        found.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        for ((thread, function), count) in found.iter().take(14) {
            let level = if *thread { "thread" } else { "handler" };
            println!("  {:5.1} %  {level:7}  {function}", 100.0 * *count as f64 / steps as f64);
        }
    }
    for line in emulator.log() {
        println!("{line}");
    }
    Ok(())
}
