//! `campaign.toml` to [`Campaign`]: every key known, every value possible, nothing contradictory.

use std::collections::HashMap;
use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::{Campaign, Chain, Entry, Estimate, FORMAT, Observed, Rig, RigKind, SPRING_REPEATABILITY};
use crate::input::InputError;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CampaignTable {
    format: Spanned<String>,
    name: String,
    rig: Spanned<RigTable>,
    chain: ChainTable,
    #[serde(default)]
    recording: Vec<RecordingTable>,
}

/// `{ value = …, sd = … }`
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EstimateTable {
    value: f64,
    sd: f64,
}

/// The `[rig]` table, which campaigns and models share.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
pub(crate) struct RigTable {
    kind: Spanned<String>,
    body_stiffness_N_per_m: Option<Spanned<EstimateTable>>,
    pad_stiffness_N_per_m: Option<Spanned<EstimateTable>>,
    moving_mass_kg: Option<Spanned<EstimateTable>>,
    gravity_along_impact_m_per_s2: Option<Spanned<f64>>,
    spring_repeatability: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
struct ChainTable {
    sample_rate_Hz: Spanned<f64>,
    noise_rms_N: Spanned<f64>,
    full_scale_N: Option<Spanned<f64>>,
    observed: Spanned<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RecordingTable {
    file: Spanned<String>,
    impact_speed_m_per_s: Spanned<EstimateTable>,
    effective_mass_kg: Spanned<EstimateTable>,
    configuration: Option<String>,
}

/// A campaign with the places of its recordings in the text, to say later which line a fault belongs to.
pub(super) struct Placed {
    pub(super) campaign: Campaign,
    pub(super) files: Vec<Range<usize>>,
    pub(super) observed: Range<usize>,
    pub(super) warnings: Vec<String>,
}

impl Campaign {
    /// Reads the text of a `campaign.toml`; `file` is the name that errors give it. Whether the recordings exist is
    /// not looked at; see [`super::load`].
    ///
    /// # Errors
    /// The first key that is unknown or missing, value that cannot be, or contradiction, with line and column.
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        parse_placed(file, text).map(|placed| placed.campaign)
    }
}

pub(super) fn parse_placed(file: &str, text: &str) -> Result<Placed, InputError> {
    let table: CampaignTable = toml::from_str(text).map_err(|error| InputError::toml(file, text, &error))?;
    let check = RigCheck { file, text };
    if table.format.get_ref() != FORMAT {
        return Err(check.refuse(
            table.format.span(),
            format!("the format is `{}`, not `{FORMAT}`", table.format.get_ref()),
            format!("write `format = \"{FORMAT}\"`; other formats are not read"),
        ));
    }
    let mut warnings = Vec::new();
    let rig = check.rig(&table.rig, &mut warnings)?;
    let chain = check.chain(&table.chain, &rig)?;
    if table.recording.is_empty() {
        return Err(check.refuse(
            text.len()..text.len(),
            "the campaign has no recording",
            "add a [[recording]] table with `file`, `impact_speed_m_per_s` and `effective_mass_kg` for each",
        ));
    }
    let mut first_use: HashMap<&str, usize> = HashMap::new();
    let mut recordings = Vec::with_capacity(table.recording.len());
    for (index, recording) in table.recording.iter().enumerate() {
        let entry = check.recording(recording, &rig)?;
        if let Some(first) = first_use.insert(recording.file.get_ref(), index) {
            return Err(check.refuse(
                recording.file.span(),
                format!("`{}` is already recording {} of this campaign", entry.file, first + 1),
                "name each file once; two beliefs about one recording contradict each other",
            ));
        }
        recordings.push(entry);
    }
    check.masses_of_one_configuration(&recordings, &mut warnings);
    Ok(Placed {
        campaign: Campaign { name: table.name, rig, chain, recordings },
        files: table.recording.iter().map(|recording| recording.file.span()).collect(),
        observed: table.chain.observed.span(),
        warnings,
    })
}

/// Checks the tables of a campaign; the `[rig]` table is a model's too.
pub(crate) struct RigCheck<'a> {
    pub(crate) file: &'a str,
    pub(crate) text: &'a str,
}

impl RigCheck<'_> {
    fn refuse(&self, span: Range<usize>, problem: impl Into<String>, remedy: impl Into<String>) -> InputError {
        InputError::at(self.file, self.text, span, problem, remedy)
    }

    fn one_of<T: Copy>(
        &self,
        key: &str,
        word: &Spanned<String>,
        choices: &[T],
        name: impl Fn(T) -> &'static str,
    ) -> Result<T, InputError> {
        choices.iter().copied().find(|choice| name(*choice) == word.get_ref()).ok_or_else(|| {
            let names: Vec<String> = choices.iter().map(|choice| format!("\"{}\"", name(*choice))).collect();
            self.refuse(
                word.span(),
                format!("`{key}` is \"{}\", which is not one of its words", word.get_ref()),
                format!("write one of {}", names.join(", ")),
            )
        })
    }

    fn positive(&self, key: &str, value: &Spanned<f64>) -> Result<f64, InputError> {
        let number = *value.get_ref();
        if number.is_finite() && number > 0.0 {
            return Ok(number);
        }
        Err(self.refuse(value.span(), format!("`{key}` is {number}"), "write a finite number above 0"))
    }

    fn not_negative(&self, key: &str, value: &Spanned<f64>) -> Result<f64, InputError> {
        let number = *value.get_ref();
        if number.is_finite() && number >= 0.0 {
            return Ok(number);
        }
        Err(self.refuse(value.span(), format!("`{key}` is {number}"), "write a finite number, 0 or more"))
    }

    /// An estimate; above zero unless `sign_free`.
    fn estimate(&self, key: &str, table: &Spanned<EstimateTable>, sign_free: bool) -> Result<Estimate, InputError> {
        let EstimateTable { value, sd } = *table.get_ref();
        let estimate = Estimate { value, sd };
        if !estimate.value.is_finite() || (!sign_free && estimate.value <= 0.0) {
            return Err(self.refuse(
                table.span(),
                format!("the value of `{key}` is {}", estimate.value),
                if sign_free { "write a finite number" } else { "write a finite number above 0" },
            ));
        }
        if !estimate.sd.is_finite() || estimate.sd < 0.0 {
            return Err(self.refuse(
                table.span(),
                format!("the sd of `{key}` is {}", estimate.sd),
                "write one standard deviation: a finite number, 0 or more",
            ));
        }
        Ok(estimate)
    }

    /// Checks the rig; what is odd but harmless goes to `warnings`.
    pub(crate) fn rig(&self, table: &Spanned<RigTable>, warnings: &mut Vec<String>) -> Result<Rig, InputError> {
        let span = table.span();
        let table = table.get_ref();
        let kind = self.one_of("kind", &table.kind, &RigKind::ALL, RigKind::name)?;
        let optional = |key: &str, value: &Option<Spanned<EstimateTable>>| {
            value.as_ref().map(|value| self.estimate(key, value, false)).transpose()
        };
        let body = optional("body_stiffness_N_per_m", &table.body_stiffness_N_per_m)?;
        let pad = optional("pad_stiffness_N_per_m", &table.pad_stiffness_N_per_m)?;
        let piece = optional("moving_mass_kg", &table.moving_mass_kg)?;
        match kind {
            RigKind::Impact | RigKind::Drop if body.is_none() => {
                // The table's span begins at its header.
                return Err(self.refuse(
                    span,
                    format!("a rig of kind \"{}\" has a body spring, but none is stated", kind.name()),
                    "add `body_stiffness_N_per_m = { value = 25000.0, sd = 1250.0 }` to [rig]",
                ));
            }
            RigKind::Fall if body.is_some() || pad.is_some() || piece.is_some() => {
                warnings.push(format!(
                    "{}: a fall has no rig; its springs, pad and moving mass are stated but not used",
                    self.file
                ));
            }
            _ => {}
        }
        let gravity = match &table.gravity_along_impact_m_per_s2 {
            None => kind.default_gravity_m_per_s2(),
            Some(gravity) => {
                let value = *gravity.get_ref();
                if !value.is_finite() {
                    return Err(self.refuse(
                        gravity.span(),
                        format!("`gravity_along_impact_m_per_s2` is {value}"),
                        "write a finite number",
                    ));
                }
                if value <= 0.0 && kind != RigKind::Impact {
                    return Err(self.refuse(
                        gravity.span(),
                        format!("gravity acts in a rig of kind \"{}\", but it is stated as {value}", kind.name()),
                        "leave the key out for 9.80665, or state a value above 0 (positive is the direction of motion)",
                    ));
                }
                value
            }
        };
        let spring_repeatability = match &table.spring_repeatability {
            None => SPRING_REPEATABILITY,
            Some(value) => {
                let number = self.not_negative("spring_repeatability", value)?;
                if number >= 1.0 {
                    return Err(self.refuse(
                        value.span(),
                        format!("`spring_repeatability` is {number}"),
                        "write it relative to the stiffness: 0.002 is 0.2 %",
                    ));
                }
                number
            }
        };
        Ok(Rig {
            kind,
            body_stiffness_n_per_m: body,
            pad_stiffness_n_per_m: pad,
            moving_mass_kg: piece,
            gravity_along_impact_m_per_s2: gravity,
            spring_repeatability,
        })
    }

    fn chain(&self, table: &ChainTable, rig: &Rig) -> Result<Chain, InputError> {
        let sample_rate_hz = self.positive("sample_rate_Hz", &table.sample_rate_Hz)?;
        let noise_rms = self.not_negative("noise_rms_N", &table.noise_rms_N)?;
        let full_scale = table.full_scale_N.as_ref().map(|stated| self.positive("full_scale_N", stated)).transpose()?;
        let observed = self.one_of("observed", &table.observed, &Observed::ALL, Observed::column)?;
        if let Some(full_scale) = full_scale.filter(|full_scale| noise_rms >= *full_scale) {
            return Err(self.refuse(
                table.noise_rms_N.span(),
                format!("the noise, {noise_rms}, is not below the full scale, {full_scale}"),
                "state both in the unit of the observed channel",
            ));
        }
        if rig.kind == RigKind::Fall && observed == Observed::Force {
            return Err(self.refuse(
                table.observed.span(),
                "a fall has no rig, so there is no `force_N` to observe",
                "observe `height_m`, `displacement_m` or `acceleration_m_per_s2`, or state the kind of the rig as \"impact\" or \"drop\"",
            ));
        }
        Ok(Chain { sample_rate_hz, noise_rms, full_scale, observed })
    }

    fn recording(&self, table: &RecordingTable, rig: &Rig) -> Result<Entry, InputError> {
        if table.file.get_ref().is_empty() {
            return Err(self.refuse(
                table.file.span(),
                "`file` is empty",
                "name the CSV, relative to the campaign's folder: \"recordings/001.csv\"",
            ));
        }
        // What falls may start from rest, or be thrown upwards.
        let sign_free = rig.kind == RigKind::Fall;
        Ok(Entry {
            file: table.file.get_ref().clone(),
            impact_speed_m_per_s: self.estimate("impact_speed_m_per_s", &table.impact_speed_m_per_s, sign_free)?,
            effective_mass_kg: self.estimate("effective_mass_kg", &table.effective_mass_kg, false)?,
            configuration: table.configuration.clone(),
        })
    }

    /// Recordings of one configuration share the robot's mass error, so their masses must agree within it.
    fn masses_of_one_configuration(&self, recordings: &[Entry], warnings: &mut Vec<String>) {
        let mut first: HashMap<&str, &Entry> = HashMap::new();
        for entry in recordings {
            let Some(configuration) = &entry.configuration else { continue };
            let earlier = *first.entry(configuration).or_insert(entry);
            let (a, b) = (earlier.effective_mass_kg, entry.effective_mass_kg);
            if (a.value - b.value).abs() > 3.0 * a.sd.max(b.sd) {
                warnings.push(format!(
                    "{}: `{}` and `{}` are of configuration \"{configuration}\", but their masses, {} kg and {} kg, \
                     differ by more than three standard deviations",
                    self.file, earlier.file, entry.file, a.value, b.value
                ));
            }
        }
    }
}
