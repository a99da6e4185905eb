//! A campaign's folder: the TOML with its recordings.

use std::path::{Path, PathBuf};

use super::Campaign;
use super::read::parse_placed;
use crate::input::{InputError, read_text};
use crate::recording::{self, Recording};

/// Name of the campaign's own file.
pub const FILE_NAME: &str = "campaign.toml";

/// Share of full scale beyond which a value cannot have come from the stated chain.
const BEYOND_FULL_SCALE: f64 = 1.05;

/// Relative difference of stated and found sample rate that is said.
const RATE_TOLERANCE: f64 = 0.05;

/// A campaign with its recordings read.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The folder.
    pub folder: PathBuf,
    /// What is believed.
    pub campaign: Campaign,
    /// The recordings, in the order of [`Campaign::recordings`]; each has the observed channel.
    pub recordings: Vec<Recording>,
    /// What is odd but can be worked with, one sentence each.
    pub warnings: Vec<String>,
}

/// Reads a campaign's folder, or its `campaign.toml` named directly.
///
/// # Errors
/// The first fault of the TOML or of a recording, with file, line and column: a file that is missing is told at the
/// line that names it, an observed channel that is missing at the recording's header.
pub fn load(path: &Path) -> Result<Loaded, InputError> {
    let (folder, toml_path) = if path.is_file() {
        (path.parent().unwrap_or(Path::new("")).to_owned(), path.to_owned())
    } else {
        (path.to_owned(), path.join(FILE_NAME))
    };
    let file = toml_path.display().to_string();
    let text = read_text(&toml_path)?;
    let placed = parse_placed(&file, &text)?;
    let campaign = placed.campaign;
    let mut warnings = placed.warnings;
    let mut recordings = Vec::with_capacity(campaign.recordings.len());
    for (entry, place) in campaign.recordings.iter().zip(placed.files) {
        let csv_path = folder.join(&entry.file);
        if !csv_path.is_file() {
            return Err(InputError::at(
                &file,
                &text,
                place,
                format!("the recording {} does not exist", csv_path.display()),
                "name a file relative to the campaign's folder, or remove the [[recording]]",
            ));
        }
        let recording = recording::read(&csv_path)?;
        let observed = campaign.chain.observed.column();
        let Some(values) = recording.channel(observed) else {
            let has: Vec<&str> = recording.channels().iter().map(|channel| channel.name.as_str()).collect();
            return Err(InputError::at(
                &file,
                &text,
                placed.observed.clone(),
                format!("the observed channel `{observed}` is no column of {}", csv_path.display()),
                format!(
                    "state as `observed` a column that the recording has ({}), or name the column so",
                    has.join(", ")
                ),
            ));
        };
        let name = csv_path.display();
        if let Some(full_scale) = campaign.chain.full_scale
            && let Some(index) = values.iter().position(|value| value.abs() > BEYOND_FULL_SCALE * full_scale)
        {
            warnings.push(format!(
                "{name}: {} at {} s is beyond the stated full scale of {full_scale}",
                values[index],
                recording.times_s()[index],
            ));
        }
        let found = 1.0 / recording.median_interval_s();
        if (found / campaign.chain.sample_rate_hz - 1.0).abs() > RATE_TOLERANCE {
            warnings.push(format!(
                "{name}: its samples come at {found:.6} Hz (median), the campaign states {} Hz",
                campaign.chain.sample_rate_hz
            ));
        }
        recordings.push(recording);
    }
    Ok(Loaded { folder, campaign, recordings, warnings })
}

impl Campaign {
    /// Writes `campaign.toml` and the recordings into `folder`, which is made if it does not exist.
    ///
    /// # Errors
    /// What the file system says.
    ///
    /// # Panics
    /// When there is not one recording for each entry.
    pub fn write(&self, folder: &Path, recordings: &[Recording]) -> std::io::Result<()> {
        assert_eq!(self.recordings.len(), recordings.len(), "one recording for each entry");
        std::fs::create_dir_all(folder)?;
        for (entry, recording) in self.recordings.iter().zip(recordings) {
            recording.write(&folder.join(&entry.file))?;
        }
        // Last, so that a folder with a campaign.toml has its recordings.
        std::fs::write(folder.join(FILE_NAME), self.to_toml())
    }
}
