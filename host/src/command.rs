//! The commands, one file each.

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

mod conceal;
mod configure;
mod demo;
mod diagnose;
mod drop;
mod evaluate;
mod hit;
mod identify;
mod limits;
mod log;
mod mass;
mod mechanisms;
mod monitor;
mod predict;
mod prove;
mod record;
mod replay;
mod sensor;
mod simulate;
mod speed;
mod status;
mod step;
mod written;

/// Impact sensor for testing robots that work next to people.
///
/// Start with `thud demo`: a simulated robot hits the simulated rig, and the sensor's own firmware says how hard
/// it was and whether a person would have borne it.
#[derive(Parser, Debug)]
#[command(
    version,
    about,
    propagate_version = true,
    after_help = "Exit status: 0 it ran, whatever the verdict; 2 unusable input, a refusal, or no answer; 1 a fault of thud itself."
)]
pub struct Thud {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    Demo(demo::Demo),
    Simulate(simulate::Simulate),
    Replay(replay::Replay),
    Sensor(sensor::Sensor),
    Diagnose(diagnose::Diagnose),
    Evaluate(evaluate::Evaluate),
    Identify(identify::Identify),
    Mechanisms(mechanisms::Mechanisms),
    Mass(mass::Mass),
    Limits(limits::Limits),
    Speed(speed::Speed),
    Drop(drop::Drop),
    Predict(predict::Predict),
    Prove(prove::Prove),
    Conceal(conceal::Conceal),
    Hit(hit::Hit),
    Configure(configure::Configure),
    Monitor(monitor::Monitor),
    Log(log::Log),
    Record(record::Record),
    Status(status::Status),
}

impl Thud {
    /// Reads the command line; ends the program with a usage message, and status 2, when it cannot be read.
    #[must_use]
    pub fn from_arguments() -> Self {
        // A negative number is a value, to be judged with its range, not an unknown option.
        let command = Self::command().mut_subcommands(|command| command.allow_negative_numbers(true));
        let matches = command.get_matches();
        Self::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
    }

    /// Runs the chosen command.
    ///
    /// # Errors
    /// A sentence that says what was wrong, where, and what would be right.
    pub fn run(self) -> miette::Result<()> {
        match self.command {
            Command::Demo(command) => command.run(),
            Command::Simulate(command) => command.run(),
            Command::Replay(command) => command.run(),
            Command::Sensor(command) => command.run(),
            Command::Diagnose(command) => command.run(),
            Command::Evaluate(command) => command.run(),
            Command::Identify(command) => command.run(),
            Command::Mechanisms(command) => command.run(),
            Command::Mass(command) => command.run(),
            Command::Limits(command) => command.run(),
            Command::Speed(command) => command.run(),
            Command::Drop(command) => command.run(),
            Command::Predict(command) => command.run(),
            Command::Prove(command) => command.run(),
            Command::Conceal(command) => command.run(),
            Command::Hit(command) => command.run(),
            Command::Configure(command) => command.run(),
            Command::Monitor(command) => command.run(),
            Command::Log(command) => command.run(),
            Command::Record(command) => command.run(),
            Command::Status(command) => command.run(),
        }
    }
}
