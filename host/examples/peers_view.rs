//! Prints as JSON what the peers of `cargo xtask peers` get of a campaign: `peers_view CAMPAIGN [--without MECHANISM]…`.

use std::path::PathBuf;

use miette::{IntoDiagnostic as _, miette};
use thud::proof::peers::view::view;

fn main() -> miette::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().map(PathBuf::from).ok_or_else(|| miette!("which campaign?"))?;
    let mut without = Vec::new();
    while let Some(argument) = arguments.next() {
        match (argument.as_str(), arguments.next()) {
            ("--without", Some(mechanism)) => without.push(mechanism),
            _ => return Err(miette!("`{argument}` is no option; peers_view CAMPAIGN [--without MECHANISM]…")),
        }
    }
    serde_json::to_writer(std::io::stdout().lock(), &view(&folder, &without)?).into_diagnostic()
}
