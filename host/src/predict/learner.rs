//! What learns: `smartcore`'s learners with fixed settings, and what they have learned as plain numbers.
//!
//! smartcore keeps the nodes of its trees and the support vectors to itself; they come out through its serialised form. So a
//! predictor can be written to a file, read again, and exported, and one evaluation serves all of them. A test holds it to
//! smartcore's own.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use smartcore::linalg::basic::matrix::DenseMatrix;
use smartcore::linear::linear_regression::{LinearRegression, LinearRegressionParameters};
use smartcore::svm::Kernels;
use smartcore::svm::svr::{SVR, SVRParameters};
use smartcore::tree::decision_tree_regressor::{DecisionTreeRegressor, DecisionTreeRegressorParameters};
use smartcore::xgboost::{XGRegressor, XGRegressorParameters};
use thud_firmware::forecast::DEPTH;

/// A learner with its settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Learner {
    /// Ordinary least squares with an intercept.
    Linear,
    /// ε-insensitive support vector regression with a Gaussian kernel, on standardised values.
    Svr,
    /// One regression tree.
    Tree,
    /// Gradient-boosted trees.
    Boosted,
    /// The same, few and shallow: what the sensor has room for.
    Table,
}

impl Learner {
    /// All.
    pub const ALL: [Self; 5] = [Self::Linear, Self::Svr, Self::Tree, Self::Boosted, Self::Table];

    /// The name in files and on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Svr => "svr",
            Self::Tree => "tree",
            Self::Boosted => "boosted",
            Self::Table => "table",
        }
    }
}

/// ε, in standard deviations of what is learned: a third of the repeatability of a peak.
pub const SVR_EPSILON: f64 = 0.01;
/// Weight of what is outside ε.
pub const SVR_C: f64 = 30.0;
/// Most rows that support vectors are sought among: its kernel has their square, and smartcore gives up after 50,000 steps. Of more
/// rows, every so many-th is taken.
pub const SVR_ROWS: usize = 1_500;
/// Fewest rows of a leaf.
pub const TREE_LEAF: usize = 2;
/// Fewest rows that a tree divides.
pub const TREE_SPLIT: usize = 6;
/// Boosted trees.
pub const BOOSTED_TREES: usize = 250;
/// Their depth.
pub const BOOSTED_DEPTH: u16 = 4;
/// How much of each is taken.
pub const BOOSTED_RATE: f64 = 0.08;
/// Share of the rows that each sees.
pub const BOOSTED_SUBSAMPLE: f64 = 0.8;
/// Pull of the leaves towards nothing, in rows.
pub const BOOSTED_LAMBDA: f64 = 1.0;

/// Trees of the sensor's table: 80 bytes of flash each.
pub const TABLE_TREES: usize = 18;
/// How much of each is taken: few trees must take more.
pub const TABLE_RATE: f64 = 0.3;

/// How trees are boosted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Boosting {
    /// How many.
    pub trees: usize,
    /// Their depth.
    pub depth: u16,
    /// How much of each is taken.
    pub rate: f64,
}

impl Default for Boosting {
    fn default() -> Self {
        Self { trees: BOOSTED_TREES, depth: BOOSTED_DEPTH, rate: BOOSTED_RATE }
    }
}

/// What was learned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Learned {
    /// ŷ = intercept + Σ coefficient·x.
    Linear {
        /// At zero.
        intercept: f64,
        /// One for each input.
        coefficients: Vec<f64>,
    },
    /// ŷ = mean + sd·(offset + Σ wᵢ·exp(−γ·|z − zᵢ|²)), z = (x − centre)/scale.
    Svr {
        /// Of each input.
        centre: Vec<f64>,
        /// Of each input.
        scale: Vec<f64>,
        /// Of what was learned.
        mean: f64,
        /// Of what was learned.
        sd: f64,
        /// γ.
        gamma: f64,
        /// b.
        offset: f64,
        /// wᵢ.
        weights: Vec<f64>,
        /// zᵢ.
        vectors: Vec<Vec<f64>>,
    },
    /// ŷ = base + rate·Σ leaf.
    Trees {
        /// Where the sum begins.
        base: f64,
        /// How much of each tree is taken.
        rate: f64,
        /// The trees.
        trees: Vec<Node>,
    },
}

/// A node of a tree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// Said here where it is a leaf.
    pub value: f64,
    /// Where it is none.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub split: Option<Box<Split>>,
}

/// A decision.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Split {
    /// Which input.
    pub input: usize,
    /// At most this: `low`, else `high`.
    pub threshold: f64,
    /// Not above.
    pub low: Node,
    /// Above.
    pub high: Node,
}

/// Why nothing was learned.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum NotLearned {
    /// Too few rows.
    #[error("{rows} impacts are too few to learn {inputs} numbers from")]
    #[diagnostic(help("give at least {least}; `thud predict data` makes some"))]
    TooFew {
        /// How many there are.
        rows: usize,
        /// Inputs.
        inputs: usize,
        /// What would do.
        least: usize,
    },
    /// The learner refused.
    #[error("the learner gave up: {0}")]
    Refused(String),
}

type Matrix = DenseMatrix<f64>;

/// Learns y from the rows of x.
///
/// # Errors
/// Too few rows, or what the learner says.
pub fn learn(learner: Learner, x: &[Vec<f64>], y: &[f64]) -> Result<Learned, NotLearned> {
    let inputs = x.first().map_or(0, Vec::len);
    let least = 4 * (inputs + 1);
    if x.len() < least {
        return Err(NotLearned::TooFew { rows: x.len(), inputs, least });
    }
    match learner {
        Learner::Linear => linear(x, y),
        Learner::Svr => support_vectors(x, y),
        Learner::Tree => tree(x, y),
        Learner::Boosted => boosted(x, y, Boosting::default()),
        Learner::Table => boosted(x, y, Boosting { trees: TABLE_TREES, depth: DEPTH as u16, rate: TABLE_RATE }),
    }
}

fn matrix(x: &[Vec<f64>]) -> Result<Matrix, NotLearned> {
    let columns = x.first().map_or(0, Vec::len);
    DenseMatrix::new(x.len(), columns, x.concat(), false).map_err(refused)
}

fn refused(error: impl std::fmt::Display) -> NotLearned {
    NotLearned::Refused(error.to_string())
}

/// A part of smartcore's serialised form that has another shape than this version has.
fn changed() -> NotLearned {
    NotLearned::Refused("what smartcore writes has another shape than expected".to_owned())
}

fn numbers(value: &Value) -> Result<Vec<f64>, NotLearned> {
    value.as_array().and_then(|all| all.iter().map(Value::as_f64).collect()).ok_or_else(changed)
}

fn linear(x: &[Vec<f64>], y: &[f64]) -> Result<Learned, NotLearned> {
    // Standardised, or stiffnesses of 1e5 beside speeds of 0.1 make the decomposition lose digits.
    let scaling = Scaling::of(x);
    let rows: Vec<Vec<f64>> = x.iter().map(|row| scaling.applied(row)).collect();
    let fitted = LinearRegression::fit(&matrix(&rows)?, &y.to_vec(), LinearRegressionParameters::default());
    let fitted: LinearRegression<f64, f64, Matrix, Vec<f64>> = fitted.map_err(refused)?;
    let slopes: Vec<f64> = {
        use smartcore::linalg::basic::arrays::Array as _;
        fitted.coefficients().iterator(0).copied().collect()
    };
    let coefficients: Vec<f64> = slopes.iter().zip(&scaling.scale).map(|(slope, scale)| slope / scale).collect();
    let shift: f64 = coefficients.iter().zip(&scaling.centre).map(|(slope, centre)| slope * centre).sum();
    Ok(Learned::Linear { intercept: fitted.intercept() - shift, coefficients })
}

struct Scaling {
    centre: Vec<f64>,
    scale: Vec<f64>,
}

impl Scaling {
    fn of(x: &[Vec<f64>]) -> Self {
        let columns = x.first().map_or(0, Vec::len);
        let (centre, scale) = (0..columns).map(|column| spread(x.iter().map(|row| row[column]))).unzip();
        Self { centre, scale }
    }

    fn applied(&self, row: &[f64]) -> Vec<f64> {
        standardised(row, &self.centre, &self.scale)
    }
}

fn standardised(row: &[f64], centre: &[f64], scale: &[f64]) -> Vec<f64> {
    row.iter().zip(centre).zip(scale).map(|((value, centre), scale)| (value - centre) / scale).collect()
}

/// Mean and standard deviation; 1 for the latter where all are the same.
fn spread(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    let sd = (values.map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt();
    (mean, if sd > 1e-12 * mean.abs().max(1e-300) { sd } else { 1.0 })
}

/// Every so many-th, so that at most [`SVR_ROWS`] remain.
pub fn thinned(rows: usize) -> impl Iterator<Item = usize> {
    (0..rows).step_by(rows.div_ceil(SVR_ROWS).max(1))
}

fn support_vectors(x: &[Vec<f64>], y: &[f64]) -> Result<Learned, NotLearned> {
    let x: Vec<Vec<f64>> = thinned(x.len()).map(|row| x[row].clone()).collect();
    let y: Vec<f64> = thinned(y.len()).map(|row| y[row]).collect();
    let scaling = Scaling::of(&x);
    let (mean, sd) = spread(y.iter().copied());
    let rows: Vec<Vec<f64>> = x.iter().map(|row| scaling.applied(row)).collect();
    let wanted: Vec<f64> = y.iter().map(|value| (value - mean) / sd).collect();
    let gamma = 1.0 / scaling.centre.len() as f64;
    let parameters =
        SVRParameters::default().with_eps(SVR_EPSILON).with_c(SVR_C).with_kernel(Kernels::rbf().with_gamma(gamma));
    let rows = matrix(&rows)?;
    let fitted = SVR::fit(&rows, &wanted, &parameters).map_err(refused)?;
    let written = serde_json::to_value(&fitted).map_err(refused)?;
    let vectors = written["instances"].as_array().ok_or_else(changed)?;
    Ok(Learned::Svr {
        centre: scaling.centre,
        scale: scaling.scale,
        mean,
        sd,
        gamma,
        offset: written["b"].as_f64().ok_or_else(changed)?,
        weights: numbers(&written["w"])?,
        vectors: vectors.iter().map(numbers).collect::<Result<_, _>>()?,
    })
}

fn tree(x: &[Vec<f64>], y: &[f64]) -> Result<Learned, NotLearned> {
    let parameters =
        DecisionTreeRegressorParameters::default().with_min_samples_leaf(TREE_LEAF).with_min_samples_split(TREE_SPLIT);
    let fitted: DecisionTreeRegressor<f64, f64, Matrix, Vec<f64>> =
        DecisionTreeRegressor::fit(&matrix(x)?, &y.to_vec(), parameters).map_err(refused)?;
    let written = serde_json::to_value(&fitted).map_err(refused)?;
    let nodes = written["tree_regressor"]["nodes"].as_array().ok_or_else(changed)?;
    Ok(Learned::Trees { base: 0.0, rate: 1.0, trees: vec![flat_node(nodes, 0)?] })
}

/// A node of smartcore's list with all below it.
fn flat_node(nodes: &[Value], at: usize) -> Result<Node, NotLearned> {
    let node = nodes.get(at).ok_or_else(changed)?;
    let child = |key: &str| node[key].as_u64().map(|child| child as usize);
    let split = match (child("true_child"), child("false_child"), node["split_value"].as_f64()) {
        (Some(low), Some(high), Some(threshold)) => Some(Box::new(Split {
            input: child("split_feature").ok_or_else(changed)?,
            threshold,
            low: flat_node(nodes, low)?,
            high: flat_node(nodes, high)?,
        })),
        _ => None,
    };
    Ok(Node { value: node["output"].as_f64().ok_or_else(changed)?, split })
}

/// Gradient-boosted trees with these settings.
///
/// # Errors
/// What the learner says.
pub fn boosted(x: &[Vec<f64>], y: &[f64], boosting: Boosting) -> Result<Learned, NotLearned> {
    let base = y.iter().sum::<f64>() / y.len().max(1) as f64;
    let parameters = XGRegressorParameters::default()
        .with_n_estimators(boosting.trees)
        .with_max_depth(boosting.depth)
        .with_learning_rate(boosting.rate)
        .with_subsample(BOOSTED_SUBSAMPLE)
        .with_min_child_weight(TREE_LEAF)
        .with_lambda(BOOSTED_LAMBDA)
        .with_base_score(base)
        .with_seed(0);
    let fitted: XGRegressor<f64, f64, Matrix, Vec<f64>> =
        XGRegressor::fit(&matrix(x)?, &y.to_vec(), parameters).map_err(refused)?;
    let written = serde_json::to_value(&fitted).map_err(refused)?;
    let trees = written["regressors"].as_array().ok_or_else(changed)?;
    let trees = trees.iter().map(nested_node).collect::<Result<_, _>>()?;
    Ok(Learned::Trees { base, rate: boosting.rate, trees })
}

fn nested_node(node: &Value) -> Result<Node, NotLearned> {
    let split = if node["left"].is_null() || node["right"].is_null() {
        None
    } else {
        Some(Box::new(Split {
            input: node["split_feature_idx"].as_u64().ok_or_else(changed)? as usize,
            threshold: node["threshold"].as_f64().ok_or_else(changed)?,
            low: nested_node(&node["left"])?,
            high: nested_node(&node["right"])?,
        }))
    };
    Ok(Node { value: node["value"].as_f64().ok_or_else(changed)?, split })
}

impl Node {
    fn leaf(&self, row: &[f64]) -> f64 {
        let mut at = self;
        while let Some(split) = &at.split {
            at = if row[split.input] <= split.threshold { &split.low } else { &split.high };
        }
        at.value
    }

    /// The largest number of an input that it asks for, plus one.
    fn inputs(&self) -> usize {
        self.split.as_ref().map_or(0, |split| (split.input + 1).max(split.low.inputs()).max(split.high.inputs()))
    }
}

impl Learned {
    /// ŷ of one row.
    ///
    /// # Panics
    /// When the row has fewer inputs than were learned from.
    #[must_use]
    pub fn forecast(&self, row: &[f64]) -> f64 {
        match self {
            Self::Linear { intercept, coefficients } => {
                intercept + coefficients.iter().zip(row).map(|(slope, value)| slope * value).sum::<f64>()
            }
            Self::Svr { centre, scale, mean, sd, gamma, offset, weights, vectors } => {
                let at = standardised(row, centre, scale);
                let near = |vector: &Vec<f64>| {
                    let distance: f64 = vector.iter().zip(&at).map(|(one, other)| (one - other).powi(2)).sum();
                    (-gamma * distance).exp()
                };
                mean + sd
                    * (offset + weights.iter().zip(vectors).map(|(weight, vector)| weight * near(vector)).sum::<f64>())
            }
            Self::Trees { base, rate, trees } => base + rate * trees.iter().map(|tree| tree.leaf(row)).sum::<f64>(),
        }
    }

    /// How many inputs it needs at least.
    #[must_use]
    pub fn inputs(&self) -> usize {
        match self {
            Self::Linear { coefficients, .. } => coefficients.len(),
            Self::Svr { centre, .. } => centre.len(),
            Self::Trees { trees, .. } => trees.iter().map(Node::inputs).max().unwrap_or(0),
        }
    }
}
