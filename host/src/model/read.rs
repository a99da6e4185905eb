//! `model.toml` to [`Model`].

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use thud_sim::mechanism::{Effect, LIST};
use toml::Spanned;

use super::{FORMAT, Interval, Model, ModelMechanism};
use crate::campaign::{RigCheck, RigTable};
use crate::input::{InputError, read_text};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelTable {
    format: Spanned<String>,
    name: String,
    rig: Spanned<RigTable>,
    #[serde(default)]
    mechanism: Vec<MechanismTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MechanismTable {
    id: Spanned<String>,
    configuration: Option<String>,
    #[serde(default)]
    parameters: BTreeMap<Spanned<String>, Spanned<ParameterTable>>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterTable {
    value: f64,
    low: Option<f64>,
    high: Option<f64>,
}

/// Reads a model file.
///
/// # Errors
/// The file could not be read, or is not a model; with line and column.
pub fn read(path: &Path) -> Result<Model, InputError> {
    Model::parse(&path.display().to_string(), &read_text(path)?)
}

impl Model {
    /// Reads the text of a model file; `file` is the name that errors give it.
    ///
    /// # Errors
    /// The first key, id or parameter that is unknown, or value that cannot be, with line and column.
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        let table: ModelTable = toml::from_str(text).map_err(|error| InputError::toml(file, text, &error))?;
        if table.format.get_ref() != FORMAT {
            return Err(InputError::at(
                file,
                text,
                table.format.span(),
                format!("the format is `{}`, not `{FORMAT}`", table.format.get_ref()),
                format!("write `format = \"{FORMAT}\"`; other formats are not read"),
            ));
        }
        let rig = RigCheck { file, text }.rig(&table.rig, &mut Vec::new())?;
        let mut mechanisms: Vec<ModelMechanism> = Vec::with_capacity(table.mechanism.len());
        for mechanism in &table.mechanism {
            let entry = read_mechanism(file, text, mechanism)?;
            let id = entry.effect.mechanism().id;
            let twice = |other: &ModelMechanism| other.effect.mechanism().id == id && other.only_in == entry.only_in;
            if mechanisms.iter().any(twice) {
                return Err(InputError::at(
                    file,
                    text,
                    mechanism.id.span(),
                    format!("`{id}` is there twice"),
                    "state each mechanism once",
                ));
            }
            mechanisms.push(entry);
        }
        Ok(Self { name: table.name, rig, mechanisms })
    }
}

fn read_mechanism(file: &str, text: &str, table: &MechanismTable) -> Result<ModelMechanism, InputError> {
    let refuse = |span, problem: String, remedy: String| InputError::at(file, text, span, problem, remedy);
    let mut effect = Effect::new(table.id.get_ref(), &[]).map_err(|_| {
        let ids: Vec<&str> = LIST.iter().map(|mechanism| mechanism.id).collect();
        refuse(
            table.id.span(),
            format!("no mechanism is called `{}`", table.id.get_ref()),
            format!("write one of {}", ids.join(", ")),
        )
    })?;
    let mechanism = effect.mechanism();
    let mut intervals = vec![None; mechanism.parameters.len()];
    for (name, parameter) in &table.parameters {
        let (place, known) = mechanism.parameter(name.get_ref()).map_err(|_| {
            let names: Vec<&str> = mechanism.parameters.iter().map(|parameter| parameter.name).collect();
            refuse(
                name.span(),
                format!("`{}` has no parameter `{}`", mechanism.id, name.get_ref()),
                format!("write one of {}", names.join(", ")),
            )
        })?;
        let ParameterTable { value, low, high } = *parameter.get_ref();
        effect.set_value(place, value).map_err(|_| {
            refuse(
                parameter.span(),
                format!("`{}` of `{}` is {value}", known.name, mechanism.id),
                format!("write {} to {} {}", known.range.0, known.range.1, known.unit),
            )
        })?;
        intervals[place] = match (low, high) {
            (None, None) => None,
            (Some(low), Some(high)) if low <= value && value <= high => Some(Interval { low, high }),
            _ => {
                return Err(refuse(
                    parameter.span(),
                    format!("the interval of `{}` does not hold its value, {value}", known.name),
                    "write `low` and `high` with the value between them, or neither".to_owned(),
                ));
            }
        };
    }
    Ok(ModelMechanism { effect, intervals, only_in: table.configuration.clone() })
}
