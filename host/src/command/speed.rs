//! `thud speed`: how fast a robot may be where it can hit somebody.

use std::path::PathBuf;

use serde::Serialize;
use thud_firmware::limits::{LimitsProfile, Region};

use crate::biomechanics::area::{AREAS, Area};
use crate::biomechanics::permission::{Decides, Permission, Question, permit};
use crate::input::{InputError, read_text};
use crate::json::JsonOption;
use crate::robot::stated::StatedMass;
use crate::settings::one_of;
use crate::table::{Side, Table};

/// Say how fast a robot may be where it can hit a body region
///
/// From the force limit, and with --contact-area from the pressure limit too. The region's own stiffness counts and
/// nothing else: a pad on the rig or the robot is credited to nobody. Skull and face are refused: no speed is permitted
/// there.
///
/// The speed is that at which robot and body close in on each other; a body that moves towards the robot takes its
/// share of it.
#[derive(clap::Args, Debug)]
#[command(
    after_long_help = "Examples:\n  thud speed --region chest --mass 6.1\n  thud mass --urdf examples/robots/iiwa14.urdf --at flange --direction 1,0,0 --degrees \\\n      --joints=-56.6,87.6,-90,109.2,2.9,52.5,90 --json mass.json\n  thud speed --region hand --mass-from mass.json --area back-of-hand-nd --contact-area 1.5"
)]
pub struct Speed {
    /// Body region that can be hit
    #[arg(long, value_parser = one_of(&Region::ALL, Region::name))]
    region: Region,
    /// Effective mass of the robot at the contact point, in the direction of its motion
    #[arg(long, value_name = "KG", required_unless_present = "mass_from", conflicts_with = "mass_from")]
    mass: Option<f64>,
    /// Take the effective mass, and where it comes from, out of the JSON of `thud mass`
    #[arg(long, value_name = "FILE")]
    mass_from: Option<PathBuf>,
    /// Smallest area that the robot can touch with: the pressure limit is then looked at
    #[arg(long, value_name = "CM2")]
    contact_area: Option<f64>,
    /// Body area that is touched, by name or number (`thud limits --region …` lists them) [default: the region's weakest]
    #[arg(long, value_name = "AREA", requires = "contact_area", value_parser = area)]
    area: Option<&'static Area>,
    /// Exponent n of the contact law F ∝ δⁿ through the limit; 1 is the standard's spring
    #[arg(long, value_name = "N", default_value_t = 1.0)]
    exponent: f64,
    /// Table of limits
    #[arg(long, default_value = LimitsProfile::IsoTs15066.name(), value_parser = one_of(&LimitsProfile::ALL, LimitsProfile::name))]
    limits: LimitsProfile,
    #[command(flatten)]
    json: JsonOption,
}

fn area(word: &str) -> Result<&'static Area, String> {
    Area::find(word).ok_or_else(|| {
        let names: Vec<&str> = AREAS.iter().map(|area| area.name).collect();
        format!("no such body area; there are 1 to 29, or by name: {}", names.join(", "))
    })
}

/// How far the mass is moved to show what it does to the speed.
const MASS_STEP: f64 = 0.1;

#[derive(Serialize)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
struct Answer {
    region: &'static str,
    limits: &'static str,
    provenance: &'static str,
    effective_mass_kg: f64,
    /// Direction, contact point, posture and model of the mass, where they are known.
    mass_source: Option<StatedMass>,
    exponent: f64,
    permitted_m_per_s: f64,
    decided_by: Decides,
    by_force_m_per_s: f64,
    by_pressure_m_per_s: Option<f64>,
    force_limit_N: f64,
    pressure_limit_N_per_cm2: Option<f64>,
    area: Option<&'static str>,
    contact_area_cm2: Option<f64>,
    /// The force at the permitted speed.
    force_N: f64,
    stroke_mm: f64,
    energy_J: f64,
    stiffness_N_per_mm: f64,
    body_mass_kg: f64,
    reduced_mass_kg: f64,
    scaling: f64,
    /// What a rigid rig with the region's spring may read.
    rig_reading_N: f64,
    sensitivity: Sensitivity,
}

#[derive(Serialize)]
struct Sensitivity {
    /// Relative change of the speed by relative change of the effective mass.
    per_relative_mass: f64,
    /// Permitted with a mass 10 % smaller and 10 % larger.
    with_10_percent_less_m_per_s: f64,
    with_10_percent_more_m_per_s: f64,
}

impl Speed {
    pub(super) fn run(self) -> miette::Result<()> {
        let source = self.mass_from.as_ref().map(|path| read_mass(path)).transpose()?;
        // clap has seen to it that one of both is there.
        let mass = self.mass.or(source.as_ref().map(|source| source.effective_mass_kg)).unwrap_or_default();
        let question = Question {
            region: self.region,
            limits: self.limits,
            robot_kg: mass,
            exponent: self.exponent,
            contact: self.contact_area.map(|cm2| (cm2, self.area)),
        };
        let permission = permit(&question)?;
        let with = |factor: f64| permit(&Question { robot_kg: mass * factor, ..question }).map(|p| p.permitted_m_per_s);
        // At the ends of the masses that are taken there is no further one.
        let beside = |factor: f64| with(factor).unwrap_or(permission.permitted_m_per_s);
        let answer = self.answer(&permission, mass, source, [beside(1.0 - MASS_STEP), beside(1.0 + MASS_STEP)]);
        self.json.write(&answer)?;
        if !self.json.owns_stdout() {
            print(&answer);
        }
        Ok(())
    }

    fn answer(&self, permission: &Permission, mass: f64, source: Option<StatedMass>, beside: [f64; 2]) -> Answer {
        let body = self.region.body();
        Answer {
            region: self.region.name(),
            limits: self.limits.name(),
            provenance: self.limits.provenance(),
            effective_mass_kg: mass,
            mass_source: source,
            exponent: self.exponent,
            permitted_m_per_s: permission.permitted_m_per_s,
            decided_by: permission.decides,
            by_force_m_per_s: permission.by_force_m_per_s,
            by_pressure_m_per_s: permission.by_pressure_m_per_s,
            force_limit_N: permission.force_limit_n,
            pressure_limit_N_per_cm2: permission.pressure.map(|(limit, _)| limit),
            area: permission.pressure.map(|(_, area)| area.name),
            contact_area_cm2: self.contact_area,
            force_N: permission.force_n,
            stroke_mm: 1e3 * permission.stroke_m,
            energy_J: permission.energy_j,
            stiffness_N_per_mm: f64::from(body.stiffness.0) / 1e3,
            body_mass_kg: crate::decimal::decimal(body.effective_mass.0),
            reduced_mass_kg: permission.reduced_mass_kg,
            scaling: permission.scaling,
            rig_reading_N: permission.rig_reading_n,
            sensitivity: Sensitivity {
                per_relative_mass: permission.sensitivity,
                with_10_percent_less_m_per_s: beside[0],
                with_10_percent_more_m_per_s: beside[1],
            },
        }
    }
}

/// The value of `thud mass --json`, with all that it belongs to.
fn read_mass(path: &std::path::Path) -> Result<StatedMass, InputError> {
    let text = read_text(path)?;
    serde_json::from_str(&text).map_err(|error| {
        let line = error.line().saturating_sub(1);
        let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
        let at = start + error.column().saturating_sub(1);
        let remedy = "give the file that `thud mass --json FILE` wrote for one posture";
        InputError::at(&path.display().to_string(), &text, at..at + 1, format!("is no effective mass: {error}"), remedy)
    })
}

fn print(answer: &Answer) {
    let by = match answer.decided_by {
        Decides::Force => "the force limit of the region decides",
        Decides::Pressure => "the pressure limit of the body area decides",
    };
    crate::say!("  Up to {:.3} m/s towards the {}: {by}.\n", answer.permitted_m_per_s, answer.region);
    let mut table = Table::new(&[("", Side::Left), ("", Side::Right), ("", Side::Left)]);
    let mut row = |what: &str, value: String, note: String| table.row([what.to_owned(), value, note]);
    row("by force", format!("{:.3} m/s", answer.by_force_m_per_s), format!("limit {} N", answer.force_limit_N));
    if let (Some(speed), Some(limit), Some(area), Some(cm2)) =
        (answer.by_pressure_m_per_s, answer.pressure_limit_N_per_cm2, answer.area, answer.contact_area_cm2)
    {
        row("by pressure", format!("{speed:.3} m/s"), format!("limit {limit} N/cm² ({area}) on {cm2} cm²"));
    }
    row("robot", format!("{:.3} kg", answer.effective_mass_kg), source_words(answer));
    row(
        "body",
        format!("{} kg", answer.body_mass_kg),
        format!("spring {} N/mm; no pad is credited", answer.stiffness_N_per_mm),
    );
    let law = if answer.exponent == 1.0 { String::new() } else { format!(", F ∝ δ^{}", answer.exponent) };
    row("energy", format!("{:.3} J", answer.energy_J), format!("{:.1} mm deep{law}", answer.stroke_mm));
    row("S", format!("{:.3}", answer.scaling), format!("a rigid rig may read up to {:.0} N", answer.rig_reading_N));
    let beside = &answer.sensitivity;
    row(
        "mass ±10 %",
        format!("{:.3} m/s", beside.with_10_percent_more_m_per_s),
        format!("to {:.3} m/s; a larger mass permits less", beside.with_10_percent_less_m_per_s),
    );
    // The columns need no headings.
    let text = table.to_string();
    crate::standard_output::say(format_args!("{}", text.split_once('\n').map_or("", |(_, rows)| rows)));
    let options = textwrap::Options::new(100).initial_indent("  ").subsequent_indent("  ");
    crate::say!("\n{}", textwrap::fill(answer.provenance, &options));
}

fn source_words(answer: &Answer) -> String {
    answer.mass_source.as_ref().map_or_else(
        || "as given".to_owned(),
        |mass| {
            let setting = &mass.setting;
            let [x, y, z] = setting.direction;
            format!(
                "{} at {}, along {x:.3}, {y:.3}, {z:.3} of the {}, {}",
                setting.model.robot,
                setting.link,
                setting.frame.name(),
                setting.orientation.name()
            )
        },
    )
}
