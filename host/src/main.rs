//! `thud`, the command line.
//!
//! This file only chooses the command; each command is one file in [`thud::command`].

use clap::Parser;

fn main() -> miette::Result<()> {
    thud::command::Thud::parse().run()
}
