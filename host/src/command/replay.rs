//! `thud replay`.

/// Push a recording through the sensor's firmware and show its events
#[derive(clap::Args, Debug)]
pub struct Replay {
    #[command(flatten)]
    json: crate::json::JsonOption,
}

impl Replay {
    pub(super) fn run(self) -> miette::Result<()> {
        miette::bail!("`thud replay` is not built yet")
    }
}
