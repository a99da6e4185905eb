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
    /// Where a search for it begins, and whether it is the same in every impact.
    pub search: Search,
}

/// Where a search for a parameter's value begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Search {
    /// It is the strength: what one signature shows tells it to first order.
    Strength,
    /// At its typical value.
    Typical,
    /// At each of these.
    OneOf(&'static [f64]),
    /// At each of these, and held there: the number of a configuration. The lower end of the range is every one.
    Whole(&'static [f64]),
    /// At each of these, and held there: a form of its own, which is followed beside the others.
    Form(&'static [f64]),
    /// The same, of a campaign that has what it is about: without that some forms are like others, and there are only so many of them.
    FormWith(Needed, &'static [f64], usize),
    /// The same, and others that are tried as a [`Search::LaterForm`] is, where the campaign has what they are about.
    FormWithLater(Needed, &'static [f64], usize, &'static [f64]),
    /// At its typical value, and held there; at each of these where the best model with that leaves something, or where it is one value for all
    /// impacts instead of one for each: a form that is not worth a search of its own.
    LaterForm(&'static [f64]),
    /// Spread over the plausible range.
    Plausible,
    /// At parts of the strokes that the springs have made.
    OfStroke,
    /// At and beyond the depths that the pad has been pressed to.
    OfDepth,
    /// At parts of the peak forces.
    OfPeak,
    /// At parts and multiples of the contact time.
    OfContactTime,
    /// At parts of it: what comes later is not seen.
    WithinContact,
    /// At the lines that stand in the spectrum of what is unexplained, and spread over the plausible range.
    OfLines,
    /// Where a resonance with it meets such a line: a mass on the springs, or a compliance under the mechanism's mass.
    Resonance,
    /// Every impact has a value of its own: an angle, the phase of something that runs on between impacts.
    EachImpact,
    /// Every impact has a value of its own: an instant during its contact, s after the first touch.
    EachInstant,
    /// Such an instant of what happens again: sought where recordings ask for it. At the end of the range it does not.
    Again,
    /// It is not sought but held at its value: a whole number, a choice.
    Held,
}

/// What a form of a mechanism is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needed {
    /// A pad before the springs.
    Pad,
    /// A gauge that shows where the robot is.
    Position,
    /// An instrument that shows how the robot moves: where it is, its speed or its acceleration.
    Motion,
    /// Speeds of approach that differ.
    Speeds,
}

/// How the values of a parameter are spaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences.
    Linear,
    /// Equal ratios.
    Logarithmic,
}

impl Search {
    /// What a person is to know of it beside the ranges; mostly nothing.
    #[must_use]
    pub const fn remark(self) -> &'static str {
        match self {
            Self::Held
            | Self::Whole(_)
            | Self::Form(_)
            | Self::FormWith(..)
            | Self::FormWithLater(..)
            | Self::LaterForm(_) => "held, not fitted",
            Self::EachImpact | Self::EachInstant | Self::Again => "each impact has its own",
            _ => "",
        }
    }
}

impl Parameter {
    /// An angle; its name, meaning and search are its mechanism's.
    pub(super) const ANGLE: Self = Self {
        name: "",
        unit: "rad",
        meaning: "",
        null: None,
        range: (-7.0, 7.0),
        plausible: (-3.2, 3.2),
        typical: 0.0,
        scale: Scale::Linear,
        search: Search::EachImpact,
    };

    /// A choice between two forms, 0 and 1, each held where it is tried; its name and meaning are its mechanism's.
    pub(super) const EITHER: Self = Self {
        name: "",
        unit: "1",
        meaning: "",
        null: None,
        range: (0.0, 1.0),
        plausible: (0.0, 1.0),
        typical: 0.0,
        scale: Scale::Linear,
        search: Search::Form(&[0.0, 1.0]),
    };

    /// The same between three, 0, 1 and 2.
    pub(super) const ONE_OF_THREE: Self =
        Self { range: (0.0, 2.0), plausible: (0.0, 2.0), search: Search::Form(&[0.0, 1.0, 2.0]), ..Self::EITHER };

    /// The same between four, 0 to 3.
    pub(super) const ONE_OF_FOUR: Self =
        Self { range: (0.0, 3.0), plausible: (0.0, 3.0), search: Search::Form(&[0.0, 1.0, 2.0, 3.0]), ..Self::EITHER };

    /// Whether what is said of the pad holds of the springs behind it as well.
    pub const WHOLE: Self = Self {
        name: "whole",
        meaning: "0: the pad alone, 1: pad and springs alike, as if they were one, 2: the springs behind it alone",
        search: Search::FormWithLater(Needed::Pad, &[0.0, 1.0], 1, &[2.0]),
        ..Self::ONE_OF_THREE
    };

    /// Which part of the robot bears what shows its motion; its meaning is its mechanism's. Without such an instrument both are alike.
    pub(super) const GAUGE: Self =
        Self { name: "gauge", search: Search::FormWith(Needed::Motion, &[0.0, 1.0], 1), ..Self::EITHER };

    /// Whether it is held at its value when a mechanism is fitted.
    #[must_use]
    pub fn is_held(&self) -> bool {
        matches!(self.search, Search::Held | Search::Whole(_)) || self.is_form()
    }

    /// Whether it is a choice between forms of its mechanism.
    #[must_use]
    pub fn is_form(&self) -> bool {
        matches!(self.search, Search::Form(_) | Search::FormWith(..) | Search::FormWithLater(..) | Search::LaterForm(_))
    }

    /// Whether every impact has a value of its own.
    #[must_use]
    pub fn is_of_each_impact(&self) -> bool {
        matches!(self.search, Search::EachImpact) || self.is_instant()
    }

    /// Whether that is an instant, which may lie beyond what a recording shows: there it never comes.
    #[must_use]
    pub fn is_instant(&self) -> bool {
        matches!(self.search, Search::EachInstant | Search::Again)
    }

    /// Whether this value is possible: within the range, or the null value.
    #[must_use]
    pub fn permits(&self, value: f64) -> bool {
        (self.range.0..=self.range.1).contains(&value) || self.null == Some(value)
    }
}
