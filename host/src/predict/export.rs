//! A trained forecast of the rise as the constants that the sensor carries ([`thud_firmware::forecast`]).

use std::fmt::Write as _;

use thud_firmware::forecast::{CLASSES, DECISIONS, DEPTH, INPUTS, LEAF_STEPS, LEAVES, Table, Tree};

use super::learner::{Learned, Node};
use super::predictor::Predictor;
use super::task::{RISE, Task};

/// The constants, owned.
#[derive(Clone, Debug, PartialEq)]
pub struct Constants {
    /// Where the sum begins.
    pub base: f32,
    /// The trees.
    pub trees: Vec<Tree>,
    /// Bounds of the classes of F₄.
    pub bounds: [f32; CLASSES.len() + 1],
}

/// Why a forecast fits no sensor.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum NoTable {
    /// Another task, learner or set of inputs.
    #[error("the sensor evaluates trees of the task `online` on top of physics; this is {0}")]
    #[diagnostic(help("train one: thud predict train CAMPAIGNS --task online --learner table --out FILE.json"))]
    Other(String),
    /// A tree that is too deep.
    #[error("a tree asks more than {DEPTH} questions in a row")]
    #[diagnostic(help("train with `--learner table`, whose trees are that shallow"))]
    TooDeep,
    /// A number beyond what 16 bits hold.
    #[error("{what} {value} is beyond {low} to {high}, which is what the table's numbers hold")]
    #[diagnostic(help("train on recordings whose forces rise as contacts do"))]
    Beyond {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Smallest.
        low: f64,
        /// Largest.
        high: f64,
    },
}

impl Constants {
    /// From a predictor.
    ///
    /// # Errors
    /// [`NoTable`].
    pub fn new(predictor: &Predictor) -> Result<Self, NoTable> {
        let other = || {
            let physics = if predictor.physics { " on top of physics" } else { "" };
            NoTable::Other(format!("`{}` by `{}`{physics}", predictor.task.name(), predictor.learner.name()))
        };
        let (Learned::Trees { base, rate, trees }, Task::Online, true) =
            (&predictor.learned, predictor.task, predictor.physics)
        else {
            return Err(other());
        };
        let bounds: Vec<f32> = predictor.bounds.iter().map(|bound| *bound as f32).collect();
        let bounds = <[f32; CLASSES.len() + 1]>::try_from(bounds).map_err(|_| other())?;
        if predictor.inputs != RISE || predictor.learned.inputs() > INPUTS {
            return Err(other());
        }
        let trees = trees.iter().map(|tree| table_tree(tree, *rate)).collect::<Result<_, _>>()?;
        Ok(Self { base: *base as f32, trees, bounds })
    }

    /// As the firmware evaluates them.
    #[must_use]
    pub fn table(&self) -> Table<'_> {
        Table { base: self.base, trees: &self.trees, bounds: self.bounds }
    }

    /// A Rust file with them. `about`: where they come from, one line each.
    #[must_use]
    pub fn rust(&self, about: &[String]) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "//! The trees of the forecast. Written by `thud predict export`, not by hand:\n//!");
        for line in about {
            let _ = writeln!(text, "//! {line}");
        }
        let _ = writeln!(text, "\nuse super::{{Table, Tree}};\n\n/// Trees and bounds.");
        let _ = writeln!(
            text,
            "pub static TABLE: Table<'static> =\n    Table {{ base: {:?}, trees: &TREES, bounds: {:?} }};\n\n#[rustfmt::skip]",
            self.base, self.bounds
        );
        let _ = writeln!(text, "static TREES: [Tree; {}] = [", self.trees.len());
        for Tree { input, threshold, leaf } in &self.trees {
            let _ = writeln!(text, "    Tree {{ input: {input:?}, threshold: {threshold:?}, leaf: {leaf:?} }},");
        }
        text.push_str("];\n");
        text
    }
}

fn table_tree(root: &Node, rate: f64) -> Result<Tree, NoTable> {
    let mut tree = Tree { input: [0; DECISIONS], threshold: [i16::MAX; DECISIONS], leaf: [0; LEAVES] };
    fill(&mut tree, Some(root), root.value, 0, rate)?;
    Ok(tree)
}

/// Lays a node and all below it into the places from `at` on. Where a branch ends early, both its children are its leaf.
fn fill(tree: &mut Tree, node: Option<&Node>, value: f64, at: usize, rate: f64) -> Result<(), NoTable> {
    let split = node.and_then(|node| node.split.as_ref());
    if at >= DECISIONS {
        if split.is_some() {
            return Err(NoTable::TooDeep);
        }
        tree.leaf[at - DECISIONS] = sixteen("a leaf", rate * value * f64::from(LEAF_STEPS))?;
        return Ok(());
    }
    match split {
        None => {
            fill(tree, None, value, 2 * at + 1, rate)?;
            fill(tree, None, value, 2 * at + 2, rate)
        }
        Some(split) => {
            tree.input[at] = split.input as u8;
            // Inputs are whole numbers, so that "at most 7.5" and "at most 7" are the same.
            tree.threshold[at] = sixteen("a threshold", split.threshold.floor())?;
            fill(tree, Some(&split.low), split.low.value, 2 * at + 1, rate)?;
            fill(tree, Some(&split.high), split.high.value, 2 * at + 2, rate)
        }
    }
}

fn sixteen(what: &'static str, value: f64) -> Result<i16, NoTable> {
    let (low, high) = (f64::from(i16::MIN), f64::from(i16::MAX));
    if (low..=high).contains(&value.round()) {
        Ok(value.round() as i16)
    } else {
        Err(NoTable::Beyond { what, value, low, high })
    }
}
