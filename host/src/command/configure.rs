//! `thud configure`.

/// Set body region, stiffness, effective mass, limits, filter and node settings of a sensor
#[derive(clap::Args, Debug)]
pub struct Configure {
    #[command(flatten)]
    json: crate::json::JsonOption,
}

impl Configure {
    pub(super) fn run(self) -> miette::Result<()> {
        miette::bail!("`thud configure` is not built yet")
    }
}
