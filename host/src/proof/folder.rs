//! Where a run lies.
//!
//! ```text
//! DIR/run.json          how many cases, hash of the answers
//! DIR/cases/NAME/       a campaign each, named so that the name says nothing
//! DIR/sealed.bin        the answers, encrypted while the run lasts
//! DIR/diagnoses/NAME.json   what the tool said
//! DIR/journal.jsonl     a line for each case that is done: time, and what went wrong
//! DIR/answers.json      the answers, once everything is said
//! DIR/followed/NAME/    the campaign of an ambiguous answer, with the recordings that it asked for
//! DIR/peers/PEER/NAME.json  what other people's methods say, where `cargo xtask peers` was run
//! ```

use std::collections::HashMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic as _, WrapErr as _, miette};
use serde::{Deserialize, Serialize};

/// A run's folder.
#[derive(Clone, Debug)]
pub struct Folder(PathBuf);

/// What a run is known by: `run.json`. It says nothing of the seed to whoever reads it while the run lasts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Run {
    /// `thud-proof-run/1`.
    pub format: String,
    /// How many cases.
    pub cases: usize,
    /// SHA-256 of seed, composition and number of recordings.
    pub drawn_from_sha256: String,
    /// SHA-256 of the plain answers; absent until all cases are drawn.
    pub answers_sha256: Option<String>,
}

impl Run {
    /// A run of `cases` cases that are about to be drawn.
    #[must_use]
    pub fn new(cases: usize, drawn_from_sha256: String) -> Self {
        Self { format: "thud-proof-run/1".to_owned(), cases, drawn_from_sha256, answers_sha256: None }
    }
}

/// A line of the journal.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Done {
    /// The case.
    pub case: String,
    /// SHA-256 of the program that diagnosed.
    pub program: String,
    /// Whether the answers were under seal.
    pub sealed: bool,
    /// Wall time, s.
    pub seconds: f64,
    /// Time of a processor, s, where the system says it.
    pub processor_s: Option<f64>,
    /// The most memory that the process held, MB, where the system says it.
    pub memory_mb: Option<f64>,
    /// Why it gave no answer.
    pub failure: Option<String>,
}

impl Folder {
    /// The folder at `root`, made where it is not there.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn at(root: &Path) -> miette::Result<Self> {
        let folder = Self(root.to_owned());
        for part in [folder.cases(), folder.diagnoses()] {
            std::fs::create_dir_all(&part)
                .into_diagnostic()
                .wrap_err_with(|| format!("cannot make the folder {}", part.display()))?;
        }
        Ok(folder)
    }

    /// Itself.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.0
    }

    /// Of the campaigns.
    #[must_use]
    pub fn cases(&self) -> PathBuf {
        self.0.join("cases")
    }

    fn diagnoses(&self) -> PathBuf {
        self.0.join("diagnoses")
    }

    /// Of the campaigns that went on as was advised.
    #[must_use]
    pub fn followed(&self) -> PathBuf {
        self.0.join("followed")
    }

    /// What the tool said of a case.
    #[must_use]
    pub fn diagnosis(&self, case: &str) -> PathBuf {
        self.diagnoses().join(format!("{case}.json"))
    }

    /// The sealed answers.
    #[must_use]
    pub fn sealed(&self) -> PathBuf {
        self.0.join("sealed.bin")
    }

    /// The opened answers.
    #[must_use]
    pub fn answers(&self) -> PathBuf {
        self.0.join("answers.json")
    }

    /// Its tables, as Markdown.
    #[must_use]
    pub fn tables(&self) -> PathBuf {
        self.0.join("tables.md")
    }

    /// Of the peers' answers.
    #[must_use]
    pub fn peers(&self) -> PathBuf {
        self.0.join("peers")
    }

    fn journal(&self) -> PathBuf {
        self.0.join("journal.jsonl")
    }

    /// Writes one of its files.
    ///
    /// # Errors
    /// Which, and why not.
    pub fn write(&self, path: &Path, bytes: &[u8]) -> miette::Result<()> {
        std::fs::write(path, bytes).into_diagnostic().wrap_err_with(|| format!("cannot write {}", path.display()))
    }

    /// Reads one of its files.
    ///
    /// # Errors
    /// Which, and why not.
    pub fn read(&self, path: &Path) -> miette::Result<Vec<u8>> {
        std::fs::read(path).into_diagnostic().wrap_err_with(|| format!("cannot read {}", path.display()))
    }

    /// Deletes one of its files, where it is there.
    ///
    /// # Errors
    /// It is there and cannot be deleted.
    pub fn forget(&self, path: &Path) -> miette::Result<()> {
        match std::fs::remove_file(path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(error).into_diagnostic().wrap_err_with(|| format!("cannot delete {}", path.display()))
            }
            _ => Ok(()),
        }
    }

    /// Takes the folder for `run`, or takes it up again.
    ///
    /// # Errors
    /// Another run lies there.
    pub fn claim(&self, run: &Run) -> miette::Result<()> {
        match self.run()? {
            None => self.write_run(run),
            Some(other) if other.cases == run.cases && other.drawn_from_sha256 == run.drawn_from_sha256 => Ok(()),
            Some(other) => Err(miette!(
                help = "choose another --out, or give the seed and the options with which that run began",
                "{} holds another run, of {} cases",
                self.0.display(),
                other.cases
            )),
        }
    }

    /// Notes the hash of the answers that were drawn.
    ///
    /// # Errors
    /// A run that is taken up had others: the concealing simulator is not the one that began it.
    pub fn commit(&self, answers_sha256: &str) -> miette::Result<()> {
        let Some(run) = self.run()? else { return Err(miette!("{} was never claimed", self.0.display())) };
        match &run.answers_sha256 {
            Some(earlier) if earlier != answers_sha256 => Err(miette!(
                help = "choose another --out",
                "the run in {} began with other answers ({earlier}): this program draws other cases from the same seed",
                self.0.display()
            )),
            _ => self.write_run(&Run { answers_sha256: Some(answers_sha256.to_owned()), ..run }),
        }
    }

    fn write_run(&self, run: &Run) -> miette::Result<()> {
        self.write(&self.0.join("run.json"), &serde_json::to_vec_pretty(run).into_diagnostic()?)
    }

    /// The run that lies there.
    ///
    /// # Errors
    /// Something else does.
    pub fn run(&self) -> miette::Result<Option<Run>> {
        let path = self.0.join("run.json");
        if !path.exists() {
            return Ok(None);
        }
        serde_json::from_slice(&self.read(&path)?)
            .into_diagnostic()
            .wrap_err_with(|| format!("{} is not of a run of `thud prove`", path.display()))
            .map(Some)
    }

    /// What this program has already done; `sealed`: while the answers were under seal.
    ///
    /// # Errors
    /// The journal cannot be read.
    pub fn done(&self, program: &str, sealed: bool) -> miette::Result<HashMap<String, Done>> {
        let path = self.journal();
        if !path.exists() {
            return Ok(HashMap::new());
        }
        let text = String::from_utf8_lossy(&self.read(&path)?).into_owned();
        // A line that was being written when the power went is no line.
        let lines = text.lines().filter_map(|line| serde_json::from_str::<Done>(line).ok());
        Ok(lines
            .filter(|done| done.program == program && (done.sealed || !sealed))
            .filter(|done| done.failure.is_some() || self.diagnosis(&done.case).exists())
            .map(|done| (done.case.clone(), done))
            .collect())
    }

    /// Adds a line to the journal.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn note(&self, done: &Done) -> miette::Result<()> {
        let path = self.journal();
        let mut line = serde_json::to_string(done).into_diagnostic()?;
        line.push('\n');
        std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .and_then(|mut file| file.write_all(line.as_bytes()))
            .into_diagnostic()
            .wrap_err_with(|| format!("cannot write {}", path.display()))
    }
}
