//! `thud demo`.

/// A robot hits the simulated rig; see what the sensor makes of it
#[derive(clap::Args, Debug)]
pub struct Demo {
    #[command(flatten)]
    json: crate::json::JsonOption,
}

impl Demo {
    pub(super) fn run(self) -> miette::Result<()> {
        miette::bail!("`thud demo` is not built yet")
    }
}
