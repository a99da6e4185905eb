//! `thud simulate`.

/// Make a campaign of simulated recordings
#[derive(clap::Args, Debug)]
pub struct Simulate {
    #[command(flatten)]
    json: crate::json::JsonOption,
}

impl Simulate {
    pub(super) fn run(self) -> miette::Result<()> {
        miette::bail!("`thud simulate` is not built yet")
    }
}
