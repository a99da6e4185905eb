//! `thud limits`: what each region of the body bears, and who says so.

use serde::Serialize;
use thud_firmware::limits::{LimitsProfile, Region, TransientLimit};

use crate::biomechanics::area::Area;
use crate::biomechanics::bgia_2011;
use crate::biomechanics::permission::{self, Question};
use crate::decimal::{decimal, significant};
use crate::json::JsonOption;
use crate::settings::one_of;
use crate::table::{Side, Table};

/// List what each body region bears: forces, pressures, stiffness, mass, energy
///
/// With --mass also the scaling S and the speed that the force limit permits. With --region the pressures of its body
/// areas. Skull and face have no transient limit: contact while moving is not permitted there, and what stands beside
/// them is for clamping.
#[derive(clap::Args, Debug)]
#[command(
    after_long_help = "Examples:\n  thud limits\n  thud limits --region hand --mass 6.1\n  thud limits --limits bgia-2011"
)]
pub struct Limits {
    /// Only this region, with its body areas
    #[arg(long, value_parser = one_of(&Region::ALL, Region::name))]
    region: Option<Region>,
    /// Table of limits
    #[arg(long, default_value = LimitsProfile::IsoTs15066.name(), value_parser = one_of(&LimitsProfile::ALL, LimitsProfile::name))]
    limits: LimitsProfile,
    /// Effective mass of the robot
    #[arg(long, value_name = "KG")]
    mass: Option<f64>,
    #[command(flatten)]
    json: JsonOption,
}

#[derive(Serialize)]
struct Answer {
    limits: &'static str,
    provenance: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    effective_mass_kg: Option<f64>,
    regions: Vec<Row>,
    /// The rows of the older table, where that was asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    as_printed: Vec<Printed>,
}

#[derive(Serialize)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
struct Row {
    region: &'static str,
    stiffness_N_per_mm: f64,
    body_mass_kg: f64,
    quasi_static_N: f64,
    /// `null` where transient contact is not permitted.
    transient_N: Option<f64>,
    /// At the transient force; where there is none, at the quasi-static one.
    stroke_mm: f64,
    energy_J: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    scaling: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    permitted_m_per_s: Option<f64>,
    areas: Vec<AreaRow>,
}

#[derive(Serialize)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
struct AreaRow {
    number: u8,
    area: &'static str,
    quasi_static_N_per_cm2: f64,
    /// `null` where transient contact is not permitted.
    transient_N_per_cm2: Option<f64>,
    unverified: bool,
}

#[derive(Serialize)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
struct Printed {
    region: &'static str,
    clamping_N: f64,
    /// `null` for skull and face: whatever that table prints, it is no permission here.
    impact_N: Option<f64>,
    pressure_N_per_cm2: f64,
    stiffness_N_per_mm: f64,
}

impl Limits {
    pub(super) fn run(self) -> miette::Result<()> {
        if let Some(mass) = self.mass
            && !permission::MASSES_KG.contains(&mass)
        {
            return Err(permission::Refusal::Mass(mass).into());
        }
        let older = self.limits == LimitsProfile::Bgia2011;
        let regions = Region::ALL.into_iter().filter(|region| self.region.is_none_or(|only| only == *region));
        let rows = bgia_2011::ROWS.iter().filter(|row| self.region.is_none() || row.stands_for == self.region);
        let answer = Answer {
            limits: self.limits.name(),
            provenance: self.limits.provenance(),
            effective_mass_kg: self.mass,
            regions: regions.map(|region| self.row(region)).collect(),
            as_printed: if older { rows.map(Printed::new).collect() } else { Vec::new() },
        };
        self.json.write(&answer)?;
        if !self.json.owns_stdout() {
            print(&answer, self.region.is_some());
        }
        Ok(())
    }

    fn row(&self, region: Region) -> Row {
        let (body, limits) = (region.body(), self.limits.limits(region));
        let quasi_static = f64::from(limits.quasi_static.0);
        let transient = match limits.transient {
            TransientLimit::UpTo(limit) => Some(f64::from(limit.0)),
            TransientLimit::NotPermitted => None,
        };
        let stiffness = f64::from(body.stiffness.0);
        let force = transient.unwrap_or(quasi_static);
        let permitted = self.mass.and_then(|robot_kg| {
            let question = Question { region, limits: self.limits, robot_kg, exponent: 1.0, contact: None };
            permission::permit(&question).ok()
        });
        // The older table's areas are its own, and it has pressures for its regions only.
        let areas = Area::of(region).filter(|_| self.limits != LimitsProfile::Bgia2011);
        Row {
            region: region.name(),
            stiffness_N_per_mm: stiffness / 1e3,
            body_mass_kg: decimal(body.effective_mass.0),
            quasi_static_N: quasi_static,
            transient_N: transient,
            stroke_mm: significant(1e3 * force / stiffness, 6),
            energy_J: significant(permission::energy_j(force, stiffness, 1.0), 6),
            scaling: permitted.map(|permitted| permitted.scaling),
            permitted_m_per_s: permitted.map(|permitted| permitted.permitted_m_per_s),
            areas: areas
                .map(|area| AreaRow {
                    number: area.number,
                    area: area.name,
                    quasi_static_N_per_cm2: area.quasi_static_n_per_cm2,
                    transient_N_per_cm2: area.transient_n_per_cm2(),
                    unverified: area.unverified,
                })
                .collect(),
        }
    }
}

impl Printed {
    fn new(row: &bgia_2011::Row) -> Self {
        Self {
            region: row.name,
            clamping_N: row.clamping_n,
            impact_N: row.permitted_impact_n(),
            pressure_N_per_cm2: row.pressure_n_per_cm2,
            stiffness_N_per_mm: row.stiffness_n_per_mm,
        }
    }
}

/// The word where a limit does not exist.
const NONE: &str = "none";

fn print(answer: &Answer, with_areas: bool) {
    if answer.as_printed.is_empty() {
        print_regions(answer);
    } else {
        print_older(answer);
    }
    if with_areas && answer.as_printed.is_empty() {
        let mut table = Table::new(&[
            ("area", Side::Right),
            ("", Side::Left),
            ("held N/cm²", Side::Right),
            ("hit N/cm²", Side::Right),
            ("", Side::Left),
        ]);
        for area in answer.regions.iter().flat_map(|region| &region.areas) {
            table.row([
                area.number.to_string(),
                area.area.to_owned(),
                area.quasi_static_N_per_cm2.to_string(),
                area.transient_N_per_cm2.map_or_else(|| NONE.to_owned(), |limit| limit.to_string()),
                if area.unverified { "one source only".to_owned() } else { String::new() },
            ]);
        }
        crate::say!();
        crate::standard_output::say(format_args!("{table}"));
    }
    crate::say!();
    let options = textwrap::Options::new(100).initial_indent("  ").subsequent_indent("  ");
    crate::say!("{}", textwrap::fill(answer.provenance, &options));
    if answer.regions.iter().any(|region| region.transient_N.is_none()) {
        let words = "Skull and face: a moving robot may not hit them at any force. Their stroke and energy are those of the force \
                     that may clamp.";
        crate::say!("{}", textwrap::fill(words, &options));
    }
}

fn print_regions(answer: &Answer) {
    let mut columns = vec![
        ("region", Side::Left),
        ("K N/mm", Side::Right),
        ("mass kg", Side::Right),
        ("held N", Side::Right),
        ("hit N", Side::Right),
        ("stroke mm", Side::Right),
        ("energy J", Side::Right),
    ];
    if answer.effective_mass_kg.is_some() {
        columns.extend([("S", Side::Right), ("speed m/s", Side::Right)]);
    }
    let mut table = Table::new(&columns);
    for row in &answer.regions {
        let mut cells = vec![
            row.region.to_owned(),
            row.stiffness_N_per_mm.to_string(),
            row.body_mass_kg.to_string(),
            row.quasi_static_N.to_string(),
            row.transient_N.map_or_else(|| NONE.to_owned(), |limit| limit.to_string()),
            format!("{:.1}", row.stroke_mm),
            format!("{:.3}", row.energy_J),
        ];
        if answer.effective_mass_kg.is_some() {
            cells.push(row.scaling.map_or_else(String::new, |s| format!("{s:.3}")));
            cells.push(row.permitted_m_per_s.map_or_else(|| NONE.to_owned(), |v| format!("{v:.2}")));
        }
        table.row(cells);
    }
    crate::standard_output::say(format_args!("{table}"));
}

fn print_older(answer: &Answer) {
    let mut table = Table::new(&[
        ("region", Side::Left),
        ("clamped N", Side::Right),
        ("hit N", Side::Right),
        ("N/cm²", Side::Right),
        ("K N/mm", Side::Right),
    ]);
    for row in &answer.as_printed {
        table.row([
            row.region.to_owned(),
            row.clamping_N.to_string(),
            row.impact_N.map_or_else(|| NONE.to_owned(), |limit| limit.to_string()),
            row.pressure_N_per_cm2.to_string(),
            row.stiffness_N_per_mm.to_string(),
        ]);
    }
    crate::standard_output::say(format_args!("{table}"));
}
