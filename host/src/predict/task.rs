//! What is forecast from what: the rows that learners get.

use serde::{Deserialize, Serialize};

use super::dataset::{Dataset, Impact};
use super::learner::Learner;
use super::paper::{self, Printed};

/// What is forecast.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Task {
    /// The force over time.
    Profile,
    /// Its largest value, before the contact.
    Peak,
    /// Its largest value, from the first milliseconds of the rise, the speed unknown.
    Online,
}

impl Task {
    /// All.
    pub const ALL: [Self; 3] = [Self::Profile, Self::Peak, Self::Online];

    /// The name in files and on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Profile => "profile",
            Self::Peak => "peak",
            Self::Online => "online",
        }
    }
}

/// One number that is learned from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Input {
    /// Speed at contact, m/s.
    Speed,
    /// m_R, kg.
    Mass,
    /// K of springs and pad in series, N/m.
    Stiffness,
    /// m_H of the region, kg.
    BodyMass,
    /// Time since the contact, s.
    Time,
    /// Stroke at that instant, m: leaky.
    Stroke,
    /// Largest stroke, m: leaky.
    LargestStroke,
    /// Joint angle 1, degrees.
    Joint1,
    /// Joint angle 2, degrees.
    Joint2,
    /// Joint angle 4, degrees.
    Joint4,
    /// The firmware's inputs of the rise, its steps ([`thud_firmware::forecast::STEPS`]): ω·t₄.
    Argument,
    /// F₂/F₄.
    Second,
    /// F₃/F₄.
    Third,
    /// F₄.
    Last,
    /// m_R.
    MassSteps,
    /// K of the body springs.
    StiffnessSteps,
}

impl Input {
    /// As the tables write it.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Speed => "v",
            Self::Mass | Self::MassSteps => "m_R",
            Self::Stiffness | Self::StiffnessSteps => "K",
            Self::BodyMass => "m_H",
            Self::Time => "t",
            Self::Stroke => "δ",
            Self::LargestStroke => "δ_max",
            Self::Joint1 => "q1",
            Self::Joint2 => "q2",
            Self::Joint4 => "q4",
            Self::Argument => "ωt₄",
            Self::Second => "F₂/F₄",
            Self::Third => "F₃/F₄",
            Self::Last => "F₄",
        }
    }

    /// Whether it is known only when the impact is over: what the force did to the springs is nearly the force.
    #[must_use]
    pub const fn leaky(self) -> bool {
        matches!(self, Self::Stroke | Self::LargestStroke)
    }
}

/// A forecast that is tried: what, from what, by whom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// What.
    pub task: Task,
    /// From what.
    pub inputs: &'static [Input],
    /// By whom; `None`: physics alone.
    pub learner: Option<Learner>,
    /// Whether the learner only has what physics leaves.
    pub physics: bool,
    /// The paper's figure for it.
    pub printed: Option<Printed>,
}

impl Case {
    /// Whether an input is known only afterwards.
    #[must_use]
    pub fn leaky(&self) -> bool {
        self.inputs.iter().any(|input| input.leaky())
    }

    /// How the tables name who forecasts.
    #[must_use]
    pub fn by(&self) -> String {
        match (self.learner, self.physics) {
            (None, _) => "physics".to_owned(),
            (Some(learner), false) => learner.name().to_owned(),
            (Some(learner), true) => format!("physics+{}", learner.name()),
        }
    }

    /// How the tables write what it is from.
    #[must_use]
    pub fn from(&self) -> String {
        if self.inputs == RISE {
            return "rise m_R K".to_owned();
        }
        let symbols: Vec<&str> = self.inputs.iter().map(|input| input.symbol()).collect();
        symbols.join(" ")
    }
}

use Input::{
    Argument, BodyMass, Joint1, Joint2, Joint4, LargestStroke, Last, Mass, MassSteps, Second, Speed, Stiffness,
    StiffnessSteps, Stroke, Third, Time,
};

const EQUATION_26: &[Input] = &[LargestStroke, Stiffness, Mass, Speed];
const PEAK_LEAKY_SVR: &[Input] = &[Mass, Stiffness, BodyMass, LargestStroke];
const PEAK_LEAKY_TREE: &[Input] = &[Mass, Stiffness, LargestStroke];
const PROFILE_LEAKY: &[Input] = &[Mass, Stiffness, BodyMass, Stroke];
/// What is known before the contact.
pub const BEFORE: &[Input] = &[Speed, Mass, Stiffness];
const POSTURE: &[Input] = &[Speed, Joint1, Joint2, Joint4];
const POSTURE_STIFFNESS: &[Input] = &[Speed, Joint1, Joint2, Joint4, Stiffness];
/// The same, and when.
pub const PROFILE: &[Input] = &[Time, Speed, Mass, Stiffness];
/// The firmware's, in its order.
pub const RISE: &[Input] = &[Argument, Second, Third, Last, MassSteps, StiffnessSteps];

const fn case(task: Task, inputs: &'static [Input], learner: Learner, printed: Option<Printed>) -> Case {
    Case { task, inputs, learner: Some(learner), physics: false, printed }
}

const fn physics(task: Task, inputs: &'static [Input], learner: Option<Learner>) -> Case {
    Case { task, inputs, learner, physics: true, printed: None }
}

/// Everything that `test` tries, in the order of its table.
pub const CASES: [Case; 28] = [
    case(Task::Profile, PROFILE_LEAKY, Learner::Svr, paper::PROFILE_SVR),
    case(Task::Profile, PROFILE_LEAKY, Learner::Tree, paper::PROFILE_TREE),
    case(Task::Profile, PROFILE, Learner::Linear, None),
    case(Task::Profile, PROFILE, Learner::Svr, None),
    case(Task::Profile, PROFILE, Learner::Tree, None),
    case(Task::Profile, PROFILE, Learner::Boosted, None),
    physics(Task::Profile, PROFILE, None),
    physics(Task::Profile, PROFILE, Some(Learner::Boosted)),
    case(Task::Peak, EQUATION_26, Learner::Linear, paper::LINEAR),
    case(Task::Peak, PEAK_LEAKY_SVR, Learner::Svr, paper::PEAK_SVR),
    case(Task::Peak, PEAK_LEAKY_TREE, Learner::Tree, paper::PEAK_TREE),
    case(Task::Peak, BEFORE, Learner::Linear, None),
    case(Task::Peak, BEFORE, Learner::Svr, None),
    case(Task::Peak, BEFORE, Learner::Tree, None),
    case(Task::Peak, BEFORE, Learner::Boosted, None),
    physics(Task::Peak, BEFORE, None),
    physics(Task::Peak, BEFORE, Some(Learner::Boosted)),
    case(Task::Peak, POSTURE, Learner::Tree, paper::POSTURE_TREE),
    case(Task::Peak, POSTURE_STIFFNESS, Learner::Tree, None),
    case(Task::Peak, POSTURE_STIFFNESS, Learner::Boosted, None),
    case(Task::Online, RISE, Learner::Linear, None),
    case(Task::Online, RISE, Learner::Svr, None),
    case(Task::Online, RISE, Learner::Tree, None),
    case(Task::Online, RISE, Learner::Boosted, None),
    physics(Task::Online, RISE, None),
    physics(Task::Online, RISE, Some(Learner::Tree)),
    physics(Task::Online, RISE, Some(Learner::Boosted)),
    physics(Task::Online, RISE, Some(Learner::Table)),
];

/// Rows of numbers with what they should give.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Inputs of each row.
    pub x: Vec<Vec<f64>>,
    /// True force, N.
    pub y: Vec<f64>,
    /// What physics expects, N.
    pub expected: Vec<f64>,
    /// What the remainder is measured in, N: the peak that physics expects.
    pub unit: Vec<f64>,
    /// Which impact the row is of.
    pub impact: Vec<usize>,
}

impl Rows {
    /// Of all impacts that have every input.
    #[must_use]
    pub fn new(task: Task, inputs: &[Input], dataset: &Dataset) -> Self {
        let mut rows = Self::default();
        for (number, impact) in dataset.impacts.iter().enumerate() {
            match task {
                Task::Peak => rows.push(number, impact, inputs, None),
                Task::Online => rows.push_online(number, impact, inputs),
                Task::Profile => (0..impact.profile.len()).for_each(|at| rows.push(number, impact, inputs, Some(at))),
            }
        }
        rows
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.y.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.y.is_empty()
    }

    /// Number of impacts that have rows.
    #[must_use]
    pub fn impacts(&self) -> usize {
        self.impact.chunk_by(|a, b| a == b).count()
    }

    fn push(&mut self, number: usize, impact: &Impact, inputs: &[Input], at: Option<usize>) {
        let sample = at.map(|at| impact.profile[at]);
        let value = |input: &Input| match input {
            Input::Speed => Some(impact.speed_m_per_s),
            Input::Mass => Some(impact.mass_kg),
            Input::Stiffness => Some(impact.stiffness_n_per_m),
            Input::BodyMass => impact.body_mass_kg,
            Input::Time => sample.map(|sample| sample.time_s),
            Input::Stroke => sample.and_then(|sample| sample.stroke_m),
            Input::LargestStroke => impact.stroke_m,
            Input::Joint1 => impact.joints_deg.map(|joints| joints[0]),
            Input::Joint2 => impact.joints_deg.map(|joints| joints[1]),
            Input::Joint4 => impact.joints_deg.map(|joints| joints[2]),
            _ => None,
        };
        let Some(x) = inputs.iter().map(value).collect::<Option<Vec<f64>>>() else { return };
        let ideal = impact.ideal_peak_n();
        self.x.push(x);
        self.unit.push(ideal);
        self.impact.push(number);
        match sample {
            None => {
                self.y.push(impact.peak_n);
                self.expected.push(ideal);
            }
            Some(sample) => {
                let phase = impact.pulsation() * sample.time_s;
                self.y.push(sample.force_n);
                self.expected.push(if phase < std::f64::consts::PI { ideal * phase.sin() } else { 0.0 });
            }
        }
    }

    fn push_online(&mut self, number: usize, impact: &Impact, inputs: &[Input]) {
        // Too late for a forecast, or nothing that the sensor would take for a rise.
        let Some((steps, expected)) = impact.rise.inputs(&impact.known()).filter(|_| impact.ahead_s > 0.0) else {
            return;
        };
        let value = |input: &Input| {
            let place = RISE.iter().position(|known| known == input)?;
            steps.get(place).map(|step| f64::from(*step))
        };
        let Some(x) = inputs.iter().map(value).collect::<Option<Vec<f64>>>() else { return };
        self.x.push(x);
        self.y.push(impact.peak_n);
        self.expected.push(f64::from(expected));
        self.unit.push(f64::from(expected));
        self.impact.push(number);
    }

    /// What a learner is to learn in these rows: the force, or what physics leaves of it.
    #[must_use]
    pub fn wanted(&self, physics: bool, rows: &[usize]) -> Vec<f64> {
        rows.iter()
            .map(|&row| if physics { (self.y[row] - self.expected[row]) / self.unit[row] } else { self.y[row] })
            .collect()
    }

    /// The force that a learner's answer means, N.
    #[must_use]
    pub fn force_n(&self, physics: bool, row: usize, answer: f64) -> f64 {
        if physics { self.expected[row] + self.unit[row] * answer } else { answer }
    }
}
