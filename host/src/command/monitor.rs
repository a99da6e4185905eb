//! `thud monitor`.

/// Show the events of the sensors on a bus as they happen
#[derive(clap::Args, Debug)]
pub struct Monitor {
    #[command(flatten)]
    json: crate::json::JsonOption,
}

impl Monitor {
    pub(super) fn run(self) -> miette::Result<()> {
        miette::bail!("`thud monitor` is not built yet")
    }
}
