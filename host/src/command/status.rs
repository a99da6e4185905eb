//! `thud status`.

/// Show who is on the bus and how it is
#[derive(clap::Args, Debug)]
pub struct Status {
    #[command(flatten)]
    json: crate::json::JsonOption,
}

impl Status {
    pub(super) fn run(self) -> miette::Result<()> {
        miette::bail!("`thud status` is not built yet")
    }
}
