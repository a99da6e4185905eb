//! `thud sensor`.

/// Run a simulated sensor in real time on a bus
#[derive(clap::Args, Debug)]
pub struct Sensor {
    #[command(flatten)]
    json: crate::json::JsonOption,
}

impl Sensor {
    pub(super) fn run(self) -> miette::Result<()> {
        miette::bail!("`thud sensor` is not built yet")
    }
}
