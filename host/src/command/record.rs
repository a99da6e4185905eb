//! `thud record`.

/// Download the captured force curves of a sensor into a campaign
#[derive(clap::Args, Debug)]
pub struct Record {
    #[command(flatten)]
    json: crate::json::JsonOption,
}

impl Record {
    pub(super) fn run(self) -> miette::Result<()> {
        miette::bail!("`thud record` is not built yet")
    }
}
