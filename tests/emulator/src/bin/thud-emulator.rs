//! The firmware's ELF file on an emulated board, in real time on a bus: for the host tool it is a sensor like any other.
//!
//! ```text
//! cargo run -p thud-emulator --features unicorn -- --hit-every 5      in one terminal
//! thud status, thud monitor, thud configure, thud hit                 in another
//! ```

use std::path::PathBuf;
use std::time::Duration;

use clap::Parser;
use miette::IntoDiagnostic as _;
use thud::bus::option::BusOption;
use thud::interrupt;
use thud_emulator::bridge::Bridge;
use thud_emulator::emulator::{Emulator, Settings};
use thud_emulator::image::Image;
use thud_sim::chain::ChainSettings;
use thud_sim::force::Blows;
use thud_sim::mechanism::Effect;
use thud_sim::rig::{Approach, Rig};

/// Run the firmware of the board on an emulated STM32G474, in real time on a bus
#[derive(Parser, Debug)]
#[command(version)]
struct Options {
    #[command(flatten)]
    bus: BusOption,
    /// The program [default: what `cargo xtask size` has built]
    #[arg(long, value_name = "ELF")]
    image: Option<PathBuf>,
    /// Stiffness of the body springs
    #[arg(long, value_name = "N/M", default_value_t = 25_000.0)]
    stiffness: f64,
    /// Speed of the robot at contact
    #[arg(long, value_name = "M/S", default_value_t = 0.25)]
    speed: f64,
    /// Effective mass of the robot
    #[arg(long, value_name = "KG", default_value_t = 6.0)]
    mass: f64,
    /// A mechanism that the rig has beyond the ideal impact; repeatable
    #[arg(long = "mechanism", value_name = "MECHANISM")]
    mechanisms: Vec<Effect>,
    /// Hit it every so many seconds
    #[arg(long, value_name = "S")]
    hit_every: Option<f64>,
    /// No noise, hum or drift
    #[arg(long)]
    quiet: bool,
    /// End after so many seconds
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
}

fn main() -> miette::Result<()> {
    let options = Options::parse();
    let duration = interrupt::span(options.duration)?;
    let every = interrupt::span(options.hit_every)?;
    let image = Image::read(&options.image.unwrap_or_else(Image::usual_place)).into_diagnostic()?;
    let blows = Blows::new();
    let chain = if options.quiet { ChainSettings::quiet() } else { ChainSettings::workshop() };
    let emulator = Emulator::new(&image, &Settings { chain, ..Settings::default() }, blows.clone());
    let approach = Approach::new(options.speed, options.mass);
    let mut bridge = Bridge::new(emulator, options.bus.bus.open()?, blows, Rig::impact(options.stiffness), approach)
        .with_effects(options.mechanisms);
    interrupt::catch();
    println!("The firmware runs on an emulated board on {}. Ctrl-C ends.", bridge.bus().describe());
    let mut next = every;
    let mut told = 0;
    while !interrupt::asked() && duration.is_none_or(|duration| bridge.age() < duration) {
        bridge.live()?;
        if let (Some(at), Some(every)) = (next, every)
            && bridge.age() >= at
        {
            next = Some(at + every.max(Duration::from_millis(1)));
            let peak_n = bridge.hit(None, None).into_diagnostic()?;
            println!("hit: {peak_n:.1} N truly reach the cell");
        }
        let lines = bridge.emulator().log();
        for line in &lines[told..] {
            println!("{line}");
        }
        told = lines.len();
    }
    for violation in bridge.emulator().chip().violations() {
        println!("the chip does not permit: {violation}");
    }
    println!("It was up to {:.2} s behind real time.", bridge.behind().as_secs_f64());
    Ok(())
}
