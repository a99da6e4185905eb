//! One number of a mechanism: what it means and what it may be.

/// A parameter of a mechanism.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name with its unit, as files and the command line write it (`force_N`).
    pub name: &'static str,
    /// Its unit's symbol; `1` for a pure number.
    pub unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// The value at which the mechanism is absent; `None` where the parameter only shapes it.
    pub null: Option<f64>,
    /// The physically possible values, both ends included. Anything else is refused.
    pub range: (f64, f64),
    /// The values that a rig of this kind is likely to have.
    pub plausible: (f64, f64),
    /// A value to begin with.
    pub typical: f64,
    /// How its values are spaced when one searches over them.
    pub scale: Scale,
}

/// How the values of a parameter are spaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences.
    Linear,
    /// Equal ratios.
    Logarithmic,
}

impl Parameter {
    /// Whether this value is possible: within the range, or the null value.
    #[must_use]
    pub fn permits(&self, value: f64) -> bool {
        (self.range.0..=self.range.1).contains(&value) || self.null == Some(value)
    }
}
