//! `thud drop`: known masses fall on the rig.

use std::path::PathBuf;

use serde::Serialize;

use super::step::Steps;
use crate::campaign;
use crate::drop_test::fitness::{Fitness, judge};
use crate::drop_test::plan::{HEIGHTS_M, MASSES_KG, Row, row, stiffnesses_n_per_m};
use crate::json::JsonOption;
use crate::table::{Side, Table};

/// Test the rig with falling masses: what is to be expected, or whether a recorded campaign says that it is fit for use
///
/// Without a campaign: the paper's masses and heights, by its equations (corrected, and as printed) and by simulating
/// the falling mass and the impact piece as two bodies, with Δ %. With a campaign of the kind `drop`: springs, gain of
/// the cell and friction as the drops show them, and what is wrong.
#[derive(clap::Args, Debug)]
#[command(
    after_long_help = "Examples:\n  thud drop --piece 0.08 --stiffness 75000\n  thud simulate --kind drop --speeds 0.89,1.17 --masses 0.5,1 --region hand --pad none --out drops\n  thud drop drops"
)]
pub struct Drop {
    /// A campaign of drops, to be judged
    #[arg(value_name = "CAMPAIGN", conflicts_with_all = ["piece", "stiffness", "masses", "heights"])]
    campaign: Option<PathBuf>,
    /// Mass of the impact piece
    #[arg(long, value_name = "KG", default_value_t = 0.08)]
    piece: f64,
    /// Stiffness of the springs together [default: 75 000 on the screen, all regions' in the JSON]
    #[arg(long, value_name = "N/M")]
    stiffness: Option<f64>,
    /// Falling masses [default: the paper's]
    #[arg(long, value_name = "KG,…", value_delimiter = ',')]
    masses: Option<Vec<f64>>,
    /// Heights of the fall [default: the paper's]
    #[arg(long, value_name = "M,…", value_delimiter = ',')]
    heights: Option<Vec<f64>>,
    #[command(flatten)]
    json: JsonOption,
}

#[derive(Serialize)]
struct Expected {
    drops: Vec<Row>,
}

/// The stiffness that the screen shows where none is chosen: face and hand.
const SHOWN_N_PER_M: f64 = 75_000.0;

impl Drop {
    pub(super) fn run(self) -> miette::Result<()> {
        if let Some(path) = &self.campaign {
            return self.judged(path);
        }
        let masses = self.masses.clone().unwrap_or_else(|| MASSES_KG.to_vec());
        let heights = self.heights.clone().unwrap_or_else(|| HEIGHTS_M.to_vec());
        let all = self.stiffness.map_or_else(stiffnesses_n_per_m, |only| vec![only]);
        for (what, values, unit) in
            [("--masses", &masses, "kg"), ("--heights", &heights, "m"), ("--stiffness", &all, "N/m")]
        {
            if let Some(wrong) = values.iter().find(|value| !(value.is_finite() && **value > 0.0)) {
                miette::bail!("{what} {wrong} {unit} is not possible: above 0 is");
            }
        }
        miette::ensure!(self.piece >= 0.0, "--piece {} kg is not possible: 0 and above is", self.piece);
        let mut drops = Vec::new();
        for &stiffness in &all {
            for &mass in &masses {
                for &height in &heights {
                    let row = row(mass, height, stiffness, self.piece).map_err(|error| {
                        miette::miette!("{mass} kg from {height} m on {stiffness} N/m cannot be simulated: {error}")
                    })?;
                    drops.push(row);
                }
            }
        }
        let answer = Expected { drops };
        self.json.write(&answer)?;
        if !self.json.owns_stdout() {
            print_expected(&answer, self.stiffness.unwrap_or(SHOWN_N_PER_M), self.piece);
        }
        Ok(())
    }

    fn judged(&self, path: &std::path::Path) -> miette::Result<()> {
        let steps = Steps::new()?;
        steps.next("reading the campaign");
        let loaded = campaign::load(path)?;
        steps.next("letting masses fall on every set of springs");
        let fitness = judge(&loaded);
        steps.finish();
        let fitness = fitness?;
        self.json.write(&fitness)?;
        if !self.json.owns_stdout() {
            for warning in &loaded.warnings {
                crate::say!("  Careful: {warning}");
            }
            print_fitness(&fitness);
        }
        Ok(())
    }
}

fn print_expected(answer: &Expected, stiffness: f64, piece: f64) {
    let mut table = Table::new(&[
        ("mass g", Side::Right),
        ("height mm", Side::Right),
        ("two bodies N", Side::Right),
        ("(24) N", Side::Right),
        ("Δ %", Side::Right),
        ("(22) c_r 1", Side::Right),
        ("Δ %", Side::Right),
        ("c_r 0", Side::Right),
        ("Δ %", Side::Right),
        ("(24) printed", Side::Right),
    ]);
    for row in answer.drops.iter().filter(|row| row.stiffness_N_per_m == stiffness) {
        table.row([
            format!("{:.2}", 1e3 * row.mass_kg),
            format!("{:.0}", 1e3 * row.height_m),
            format!("{:.1}", row.two_bodies_N),
            format!("{:.1}", row.alone_N),
            format!("{:+.0}", row.alone_deviation_percent),
            format!("{:.1}", row.together_elastic_N),
            format!("{:+.0}", row.together_elastic_deviation_percent),
            format!("{:.1}", row.together_inelastic_N),
            format!("{:+.0}", row.together_inelastic_deviation_percent),
            format!("{:.1}", row.alone_as_printed_N),
        ]);
    }
    crate::say!("  On {} N/mm, with an impact piece of {} g:\n", stiffness / 1e3, 1e3 * piece);
    crate::standard_output::say(format_args!("{table}"));
    crate::say!(
        "\n  Δ % is against the two bodies. (24) takes the piece for massless; (22) lets both masses stop together."
    );
}

fn print_fitness(fitness: &Fitness) {
    let verdict = if fitness.fit_for_use { "The rig is fit for use." } else { "The rig is NOT fit for use:" };
    crate::say!("  {verdict}");
    let options = textwrap::Options::new(100).initial_indent("  - ").subsequent_indent("    ");
    for finding in &fitness.findings {
        crate::say!("{}", textwrap::fill(finding, &options));
    }
    crate::say!();
    let mut table = Table::new(&[("", Side::Left), ("found", Side::Right), ("stated", Side::Right)]);
    table.row([
        format!("springs N/mm ({})", fitness.springs),
        format!("{:.2} ± {:.2}", fitness.stiffness_N_per_m / 1e3, fitness.stiffness_se_N_per_m / 1e3),
        format!("{:.2}", fitness.stated_stiffness_N_per_m / 1e3),
    ]);
    table.row(["gain of the cell".to_owned(), format!("{:.3} ± {:.3}", fitness.gain, fitness.gain_se), "1".to_owned()]);
    table.row(["friction N".to_owned(), format!("{}", fitness.friction_N), "0".to_owned()]);
    table.row(["unexplained, of the peak".to_owned(), format!("{:.1} %", 100.0 * fitness.rest_share), String::new()]);
    crate::standard_output::say(format_args!("{table}"));
    let worst = fitness.drops.iter().map(|drop| drop.deviation_percent.abs()).fold(0.0, f64::max);
    crate::say!("\n  {} drops; as stated, the peaks would be up to {worst:.0} % off.", fitness.drops.len());
}
