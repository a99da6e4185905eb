//! How long a diagnosis takes, every mechanism tried: campaigns of the concealing simulator with 12 and 60 recordings, each diagnosed in
//! a process of its own on two threads.
//!
//! `cargo bench -p thud --bench diagnosis`. A second is noisy: the last column is the same time counted in simulations of one impact on
//! the same rig on the same machine.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use thud_conceal::mix::{self, Mix};
use thud_conceal::{case, effect, files};
use thud_sim::rig::{Accuracy, Approach, Rig};

/// The seed of all campaigns.
const SEED: u64 = 60;
/// How many simulations make a unit of time.
const UNIT: u32 = 2000;

fn main() {
    let unit_s = one_simulation_s();
    println!("Two threads; one simulated impact of 0.15 s with a damped pad takes {:.1} us on one.\n", unit_s * 1e6);
    println!("| hidden | recordings | kS | s | MB | in thousands of simulations |\n|---|---|---|---|---|---|");
    for recordings in [12, 60] {
        for hidden in [None, Some("hunt-crossley-damping"), Some("guide-friction"), Some("moving-piece-inertia")] {
            let request = match hidden {
                None => mix::requests(Mix::Absent, 1, SEED, recordings).pop(),
                Some(id) => effect::named(id).and_then(|effect| mix::only(effect, 2, SEED, recordings).pop()),
            };
            let folder = std::env::temp_dir().join(format!("thud-bench-{}", std::process::id()));
            let _ = std::fs::remove_dir_all(&folder);
            files::write(&case::make(&request.expect("a request")), &folder, "bench")
                .expect("a folder for temporary files");
            let (seconds, megabytes) = diagnosed(&folder);
            println!(
                "| {} | {recordings} | {:.0} | {seconds:.1} | {megabytes:.0} | {:.0} |",
                hidden.unwrap_or("nothing"),
                samples(&folder) as f64 / 1000.0,
                seconds / unit_s / 1000.0
            );
            let _ = std::fs::remove_dir_all(&folder);
        }
    }
}

fn one_simulation_s() -> f64 {
    let rig = Rig::impact(25e3).with_pad(80e3);
    let effect = "hunt-crossley-damping".parse().expect("a listed mechanism");
    let begin = Instant::now();
    for number in 0..UNIT {
        let approach = Approach::new(0.25 + f64::from(number) * 1e-6, 6.0);
        let _ = rig.strike(&approach, std::slice::from_ref(&effect), 0.15, Accuracy { relative: 1e-7, force_n: 1e-5 });
    }
    begin.elapsed().as_secs_f64() / f64::from(UNIT)
}

/// Seconds and the most memory of one diagnosis.
fn diagnosed(campaign: &Path) -> (f64, f64) {
    let tool = Command::new(env!("CARGO_BIN_EXE_thud"))
        .arg("diagnose")
        .arg(campaign)
        .env("RAYON_NUM_THREADS", "2")
        .stdout(std::process::Stdio::null())
        .spawn();
    let begin = Instant::now();
    let mut tool = tool.expect("the tool that cargo has built");
    let mut most = 0.0f64;
    while tool.try_wait().expect("a child process").is_none() {
        most = most.max(peak_mb(tool.id()).unwrap_or(0.0));
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    (begin.elapsed().as_secs_f64(), most)
}

/// The kernel's high-water mark of a process's memory, where there is one.
fn peak_mb(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kilobytes| kilobytes / 1024.0)
}

fn samples(campaign: &Path) -> usize {
    let recordings = std::fs::read_dir(campaign.join("recordings")).into_iter().flatten().flatten();
    recordings.map(|file| std::fs::read_to_string(file.path()).map_or(0, |text| text.lines().count())).sum()
}
