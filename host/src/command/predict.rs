//! `thud predict`: how hard a blow is going to be.

use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use miette::{IntoDiagnostic as _, WrapErr as _, miette};
use serde::Serialize;

use super::step::Steps;
use super::written::write;
use crate::campaign;
use crate::json::JsonOption;
use crate::predict::dataset::{Dataset, folders};
use crate::predict::export::Constants;
use crate::predict::learner::Learner;
use crate::predict::plan::{self, Kind, POSTURES_FILE, postures_csv};
use crate::predict::predictor::{Predictor, train};
use crate::predict::score::{Score, score};
use crate::predict::shown::{Tested, page, table};
use crate::predict::task::{CASES, Task};
use crate::predict::trial::{Whole, folds, trials};
use crate::predict::{beside, paper};
use crate::settings::one_of;
use crate::simulation::simulate;
use crate::table::{Side, Table};

/// Forecast how hard a blow is going to be: make data, test, train and export forecasts
///
/// Before the contact, from speed, mass and stiffness; or from the first milliseconds of the rise, as the sensor does.
/// docs/predict.md explains what is learned from what, and what the figures mean.
#[derive(clap::Args, Debug)]
#[command(
    after_long_help = "Examples:\n  thud predict data --out impacts\n  thud predict test impacts --report predict.html\n  thud predict train impacts --task peak --learner boosted --out peak.json\n  thud predict test --model peak.json chest\n  thud predict data --plan wide --sessions 24 --out wide\n  thud predict train wide --task online --learner table --out online.json\n  thud predict export online.json --out firmware/src/forecast/table.rs"
)]
pub struct Predict {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand, Debug)]
enum What {
    Data(Data),
    Test(Test),
    Train(Train),
    Export(Export),
}

/// Make a simulated data set: campaigns after the paper's plan
///
/// Four configurations, nine speeds and five body regions; springs, pad, damping, friction, the robot's joints and its calibration
/// scatter from session to session. `--plan wide` has all regions, masses and speeds that a sensor may meet.
#[derive(clap::Args, Debug)]
struct Data {
    /// Folder for the campaigns, one in it for each region and session
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Which plan
    #[arg(long, value_name = "PLAN", default_value = Kind::Paper.name(), value_parser = one_of(&Kind::ALL, Kind::name))]
    plan: Kind,
    /// How often each region's rig is put together anew
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    sessions: u32,
    /// Starts the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Replace campaigns that are already in the folder
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    json: JsonOption,
}

/// Test forecasts on impacts that took no part in learning
///
/// Divides the impacts into folds and forecasts each by what was learned from the others; one table, with the paper's figures
/// beside. With --model, a trained forecast is tried on campaigns that it has not seen.
#[derive(clap::Args, Debug)]
struct Test {
    /// Campaigns, or folders of campaigns
    #[arg(value_name = "CAMPAIGN", required = true)]
    campaigns: Vec<PathBuf>,
    /// A trained forecast, instead of folds
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["report", "scikit_learn", "folds", "whole"])]
    model: Option<PathBuf>,
    #[command(flatten)]
    folding: Folding,
    /// What stays together: an impact, or a whole campaign (forecasts for a rig that nothing was learned from)
    #[arg(long, value_name = "WHAT", default_value = Whole::Impact.name(), value_parser = one_of(&Whole::ALL, Whole::name))]
    whole: Whole,
    /// Also run scikit-learn's learners on the same rows and folds, by this Python, which has it
    #[arg(long, value_name = "PYTHON")]
    scikit_learn: Option<PathBuf>,
    /// Write one self-contained HTML page with pictures
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    #[command(flatten)]
    json: JsonOption,
}

#[derive(clap::Args, Debug)]
struct Folding {
    /// Into how many parts the impacts are divided
    #[arg(long, value_name = "N", default_value_t = 5)]
    folds: usize,
    /// Draws which impact is in which part
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

/// Train a forecast on all impacts and write it to a file
#[derive(clap::Args, Debug)]
struct Train {
    /// Campaigns, or folders of campaigns
    #[arg(value_name = "CAMPAIGN", required = true)]
    campaigns: Vec<PathBuf>,
    /// What it forecasts: the force over time (profile) or the peak, before the contact; or the peak from the rise (online)
    #[arg(long, default_value = Task::Peak.name(), value_parser = one_of(&Task::ALL, Task::name))]
    task: Task,
    /// Who learns; `table`: what the sensor has room for
    #[arg(long, default_value = Learner::Boosted.name(), value_parser = one_of(&Learner::ALL, Learner::name))]
    learner: Learner,
    /// Learn the force itself, not what physics leaves of it
    #[arg(long)]
    without_physics: bool,
    #[command(flatten)]
    folding: Folding,
    /// The file
    #[arg(long, value_name = "FILE.json")]
    out: PathBuf,
    #[command(flatten)]
    json: JsonOption,
}

/// Write a trained forecast of the rise as the constants that the sensor carries
#[derive(clap::Args, Debug)]
struct Export {
    /// What `thud predict train --task online --learner table` wrote
    #[arg(value_name = "FILE.json")]
    predictor: PathBuf,
    /// The Rust file
    #[arg(long, value_name = "FILE.rs")]
    out: PathBuf,
    #[command(flatten)]
    json: JsonOption,
}

impl Predict {
    pub(super) fn run(self) -> miette::Result<()> {
        match self.what {
            What::Data(data) => data.run(),
            What::Test(test) => test.run(),
            What::Train(train) => train.run(),
            What::Export(export) => export.run(),
        }
    }
}

/// What `data --json` gives.
#[derive(Serialize)]
struct Made {
    seed: u64,
    plan: &'static str,
    campaigns: Vec<String>,
    impacts: usize,
}

impl Data {
    fn run(self) -> miette::Result<()> {
        let kind = self.plan;
        let plans = plan::campaigns(kind, self.sessions as usize, self.seed);
        for (folder, _) in &plans {
            let present = self.out.join(folder).join(campaign::FILE_NAME);
            if present.exists() && !self.replace {
                return Err(miette!(
                    help = "choose another folder, or say `--replace`",
                    "there is already a campaign: {}",
                    present.display()
                ));
            }
        }
        let impacts: usize = plans.iter().map(|(_, plan)| plan.speeds_m_per_s.len() * plan.masses_kg.len()).sum();
        // Drawn on standard error, and only on a terminal.
        let bar = ProgressBar::new(impacts as u64)
            .with_style(ProgressStyle::with_template("  simulating {bar:32} {pos}/{len}").into_diagnostic()?);
        let mut made = Made { seed: self.seed, plan: self.plan.name(), campaigns: Vec::new(), impacts };
        for (name, plan) in &plans {
            let folder = self.out.join(name);
            let simulated = simulate(plan, || bar.inc(1))?;
            simulated
                .campaign
                .write(&folder, &simulated.recordings)
                .into_diagnostic()
                .wrap_err_with(|| format!("cannot write the campaign to {}", folder.display()))?;
            made.campaigns.push(folder.display().to_string());
        }
        if kind == Kind::Paper {
            write(&self.out.join(POSTURES_FILE), &postures_csv())?;
        }
        bar.finish_and_clear();
        self.json.write(&made)?;
        if !self.json.owns_stdout() {
            crate::say!("{}: {} campaigns, {impacts} impacts", self.out.display(), made.campaigns.len());
        }
        Ok(())
    }
}

fn read_all(paths: &[PathBuf], steps: &Steps) -> miette::Result<Dataset> {
    let mut dataset = Dataset::default();
    for path in paths {
        for folder in folders(path)? {
            steps.next(&format!("reading {}", folder.display()));
            dataset.add(&campaign::load(&folder)?)?;
        }
    }
    Ok(dataset)
}

/// What `test --json` gives.
#[derive(Serialize)]
#[expect(non_snake_case, reason = "the keys carry their units")]
struct Results {
    format: &'static str,
    impacts: usize,
    folds: usize,
    whole: &'static str,
    seed: u64,
    peak_sd_N: f64,
    forecasts: Vec<Line>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Line {
    task: Task,
    inputs: Vec<&'static str>,
    by: String,
    leaky: bool,
    impacts: usize,
    rows: usize,
    score: Score,
    #[serde(skip_serializing_if = "Option::is_none")]
    paper: Option<paper::Printed>,
    #[serde(skip_serializing_if = "Option::is_none")]
    scikit_learn: Option<Score>,
}

impl Test {
    fn run(self) -> miette::Result<()> {
        if let Some(model) = &self.model {
            return self.tried(model);
        }
        let steps = Steps::new()?;
        let dataset = read_all(&self.campaigns, &steps)?;
        let whole = self.whole;
        let fold_of = folds(&dataset, whole, self.folding.folds, self.folding.seed)?;
        let mut trials = trials(&dataset, &CASES, &fold_of, |case| {
            steps.next(&format!("{} from {} by {}", case.task.name(), case.from(), case.by()));
        })?;
        if let Some(python) = &self.scikit_learn {
            steps.next("the same by scikit-learn");
            beside::compare(python, &mut trials, &fold_of)?;
        }
        steps.finish();
        let tested = Tested {
            dataset,
            trials,
            folds: self.folding.folds,
            whole,
            seed: self.folding.seed,
            from: self.campaigns.iter().map(|path| path.display().to_string()).collect(),
        };
        if let Some(path) = &self.report {
            write(path, &page(&tested))?;
        }
        self.json.write(&results(&tested))?;
        if !self.json.owns_stdout() {
            say(&tested);
        }
        Ok(())
    }

    /// A trained forecast on campaigns that it has not seen.
    fn tried(&self, model: &Path) -> miette::Result<()> {
        let predictor = Predictor::read(model)?;
        let steps = Steps::new()?;
        let dataset = read_all(&self.campaigns, &steps)?;
        steps.finish();
        let said: Vec<_> = dataset.impacts.iter().flat_map(|impact| predictor.forecast(impact)).collect();
        miette::ensure!(
            said.len() >= 2,
            help = "give campaigns that have the inputs that it was trained with",
            "of {} impacts, {} can be forecast by {}",
            dataset.impacts.len(),
            said.len(),
            model.display()
        );
        let (forecast, truth): (Vec<f64>, Vec<f64>) = said.iter().map(|(said, truth)| (said.force_n, *truth)).unzip();
        let inside = said.iter().filter(|(said, truth)| (said.force_n - truth).abs() <= said.bound_n).count();
        let tried = Tried {
            task: predictor.task,
            by: predictor.learner.name(),
            impacts: dataset.impacts.len(),
            rows: said.len(),
            score: score(&forecast, &truth),
            within_bounds: inside as f64 / said.len() as f64,
            promised: predictor.covered,
            notes: dataset.notes,
        };
        self.json.write(&tried)?;
        if !self.json.owns_stdout() {
            let mut table = Table::new(&[("", Side::Left), ("", Side::Right)]);
            for (what, value) in [
                ("R²", format!("{:.3}", tried.score.r_squared)),
                ("RMSE N", format!("{:.1}", tried.score.rmse_N)),
                ("forecast less truth, mean N", format!("{:+.1}", tried.score.bias_N)),
                ("within the bounds", format!("{:.1} %", 100.0 * tried.within_bounds)),
                ("promised", format!("{:.0} %", 100.0 * tried.promised)),
            ] {
                table.row([what.to_owned(), value]);
            }
            crate::say!("  {} of {} impacts, {} forecasts:", predictor.task.name(), tried.impacts, tried.rows);
            crate::standard_output::say(format_args!("{table}"));
            notes(&tried.notes);
        }
        Ok(())
    }
}

/// What `test --model --json` gives.
#[derive(Serialize)]
struct Tried {
    task: Task,
    by: &'static str,
    impacts: usize,
    rows: usize,
    score: Score,
    /// Share of the forecasts.
    within_bounds: f64,
    promised: f64,
    notes: Vec<String>,
}

fn results(tested: &Tested) -> Results {
    Results {
        format: "thud-predict-test/1",
        impacts: tested.dataset.impacts.len(),
        folds: tested.folds,
        whole: tested.whole.name(),
        seed: tested.seed,
        peak_sd_N: tested.peak_sd_n(),
        forecasts: tested
            .trials
            .iter()
            .map(|trial| Line {
                task: trial.case.task,
                inputs: trial.case.inputs.iter().map(|input| input.symbol()).collect(),
                by: trial.case.by(),
                leaky: trial.case.leaky(),
                impacts: trial.impacts,
                rows: trial.rows.len(),
                score: trial.score,
                paper: trial.case.printed,
                scikit_learn: trial.beside,
            })
            .collect(),
        notes: tested.dataset.notes.clone(),
    }
}

fn say(tested: &Tested) {
    let (low, high) = tested.peaks_n();
    crate::say!(
        "  {} impacts in {} folds of whole {}s; peaks {low:.0} to {high:.0} N, standard deviation {:.0} N\n",
        tested.dataset.impacts.len(),
        tested.folds,
        tested.whole.name(),
        tested.peak_sd_n()
    );
    crate::standard_output::say(format_args!("{}", table(tested)));
    let options = textwrap::Options::new(100).initial_indent("\n  ").subsequent_indent("  ");
    let leaky = "leaky: from an input that is known only when the impact is over; the force is nearly stiffness times stroke. Such a forecast stands here beside the paper's and is of use to nobody.";
    if tested.trials.iter().any(|trial| trial.case.leaky()) {
        crate::say!("{}", textwrap::fill(leaky, options));
    }
    for task in Task::ALL {
        if CASES.iter().filter(|case| case.task == task).count()
            > tested.trials.iter().filter(|trial| trial.case.task == task).count()
        {
            crate::say!(
                "  Of `{}`, forecasts are left out for which these campaigns lack inputs (stroke, posture, region or rise).",
                task.name()
            );
        }
    }
    notes(&tested.dataset.notes);
}

/// Most notes that the terminal shows.
const NOTES: usize = 8;

fn notes(notes: &[String]) {
    for note in notes.iter().take(NOTES) {
        crate::say!("  Careful: {note}");
    }
    if notes.len() > NOTES {
        crate::say!("  … and {} more, all in the JSON", notes.len() - NOTES);
    }
}

impl Train {
    fn run(self) -> miette::Result<()> {
        let task = self.task;
        let learner = self.learner;
        let steps = Steps::new()?;
        let dataset = read_all(&self.campaigns, &steps)?;
        steps.next("learning");
        let predictor = train(&dataset, task, learner, !self.without_physics, (self.folding.folds, self.folding.seed))?;
        steps.finish();
        write(&self.out, &(serde_json::to_string_pretty(&predictor).into_diagnostic()? + "\n"))?;
        self.json.write(&predictor)?;
        if !self.json.owns_stdout() {
            let bounds: Vec<String> = predictor.bounds.iter().map(|bound| format!("±{:.1} %", 100.0 * bound)).collect();
            crate::say!(
                "{}: {} by {} from {} impacts; on folds R² {:.3}, RMSE {:.1} N, {:.0} % within {}",
                self.out.display(),
                task.name(),
                learner.name(),
                predictor.impacts,
                predictor.r_squared,
                predictor.rmse_N,
                100.0 * predictor.covered,
                bounds.join(", ")
            );
            notes(&dataset.notes);
        }
        Ok(())
    }
}

/// What `export --json` gives.
#[derive(Serialize)]
struct Exported {
    file: String,
    trees: usize,
    bytes: usize,
    bounds: Vec<f32>,
}

impl Export {
    fn run(self) -> miette::Result<()> {
        let predictor = Predictor::read(&self.predictor)?;
        let constants = Constants::new(&predictor)?;
        let about = [
            format!(
                "{} trees, trained on {} impacts. On {} folds of them: R² {:.3}, RMSE {:.1} N; the bounds",
                constants.trees.len(),
                predictor.impacts,
                predictor.folds,
                predictor.r_squared,
                predictor.rmse_N
            ),
            format!("covered {:.0} % of the peaks.", 100.0 * predictor.covered),
        ];
        write(&self.out, &constants.rust(&about))?;
        let exported = Exported {
            file: self.out.display().to_string(),
            trees: constants.trees.len(),
            bytes: constants.table().size(),
            bounds: constants.bounds.to_vec(),
        };
        self.json.write(&exported)?;
        if !self.json.owns_stdout() {
            crate::say!("{}: {} trees, {} bytes", exported.file, exported.trees, exported.bytes);
        }
        Ok(())
    }
}
