//! A mechanism with values: what a model file lists and the simulation composes.

use std::str::FromStr;

use super::{Mechanism, Needed, Search};

/// A mechanism with a value for each of its parameters.
#[derive(Clone, Debug)]
pub struct Effect {
    mechanism: &'static Mechanism,
    values: Vec<f64>,
}

impl PartialEq for Effect {
    fn eq(&self, other: &Self) -> bool {
        self.mechanism.id == other.mechanism.id && self.values == other.values
    }
}

impl Effect {
    /// The mechanism with this id; parameters that are not named have their typical value.
    ///
    /// # Errors
    /// Unknown id or parameter name, or a value out of the permitted range; the message says what exists.
    pub fn new(id: &str, parameters: &[(&str, f64)]) -> Result<Self, MechanismError> {
        let mut effect = Self::typical(Mechanism::find(id)?);
        for (name, value) in parameters {
            effect.set(name, *value)?;
        }
        Ok(effect)
    }

    pub(super) fn typical(mechanism: &'static Mechanism) -> Self {
        Self { mechanism, values: mechanism.parameters.iter().map(|parameter| parameter.typical).collect() }
    }

    /// The mechanism.
    #[must_use]
    pub fn mechanism(&self) -> &'static Mechanism {
        self.mechanism
    }

    /// All values, in the order of the mechanism's parameters.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The value in the given place of the mechanism's parameters.
    ///
    /// # Panics
    /// When the mechanism has fewer parameters.
    #[must_use]
    pub fn value(&self, place: usize) -> f64 {
        self.values[place]
    }

    /// Which form the parameter in this place chooses.
    ///
    /// # Panics
    /// When the mechanism has fewer parameters.
    #[must_use]
    pub fn form(&self, place: usize) -> u32 {
        self.values[place].round() as u32
    }

    /// The value of the parameter with this name.
    ///
    /// # Errors
    /// [`MechanismError::UnknownParameter`].
    pub fn get(&self, name: &str) -> Result<f64, MechanismError> {
        self.mechanism.parameter(name).map(|(place, _)| self.values[place])
    }

    /// Gives the parameter with this name a value.
    ///
    /// # Errors
    /// Unknown name, or a value out of range; the effect is then unchanged.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), MechanismError> {
        let (place, _) = self.mechanism.parameter(name)?;
        self.set_value(place, value)
    }

    /// Gives the parameter in this place a value.
    ///
    /// # Errors
    /// A value out of range; the effect is then unchanged.
    pub fn set_value(&mut self, place: usize, value: f64) -> Result<(), MechanismError> {
        let parameter = &self.mechanism.parameters[place];
        if !parameter.permits(value) {
            return Err(MechanismError::OutOfRange {
                id: self.mechanism.id,
                name: parameter.name,
                value,
                low: parameter.range.0,
                high: parameter.range.1,
                unit: parameter.unit,
            });
        }
        self.values[place] = value;
        Ok(())
    }

    /// Whether its strength has the null value, so that it does nothing.
    #[must_use]
    pub fn is_null(&self) -> bool {
        self.mechanism.parameters[0].null == Some(self.values[0])
    }

    /// Whether the parameter in this place does anything: what happens again has an instant only where it does, and some mean something in some
    /// forms of their mechanism only.
    #[must_use]
    pub fn takes_part(&self, place: usize) -> bool {
        let parameter = &self.mechanism.parameters[place];
        let is_in_form = |form: &str, values: &[f64]| self.get(form).is_ok_and(|form| values.contains(&form.round()));
        let mut uses = self.mechanism.used_in.iter().filter(|(name, ..)| *name == parameter.name);
        uses.all(|(_, form, values)| is_in_form(form, values))
            && (parameter.search != Search::Again || self.values[place] < parameter.range.1)
    }

    /// Whether every impact has a value of its own for the parameter in this place, in its form.
    #[must_use]
    pub fn is_own(&self, place: usize) -> bool {
        self.mechanism.parameters[place].is_of_each_impact() && self.takes_part(place)
    }

    /// The same of one of its parameters, the first of them.
    #[must_use]
    pub fn first_own(&self) -> Option<usize> {
        (0..self.values.len()).find(|place| self.is_own(*place))
    }

    /// Whether every impact has a value of its own for any of them.
    #[must_use]
    pub fn is_of_each_impact(&self) -> bool {
        self.first_own().is_some()
    }

    /// The same, with the values that it has, in each form that is tried later, of a campaign that has such things.
    pub fn later_forms(&self, has: impl Fn(Needed) -> bool) -> Vec<Self> {
        let mut forms = Vec::new();
        for (place, parameter) in self.mechanism.parameters.iter().enumerate() {
            let here = self.values[place];
            let later: &[f64] = match &parameter.search {
                Search::LaterForm(values) if here == parameter.typical => values,
                Search::FormWithLater(needed, _, _, values) if has(*needed) && !values.contains(&here) => values,
                _ => continue,
            };
            forms.extend(later.iter().map(|value| {
                let mut form = self.clone();
                form.values[place] = *value;
                form
            }));
        }
        forms
    }

    /// The same, with the values that it has, in the form that is usual.
    #[must_use]
    pub fn in_usual_form(&self) -> Self {
        let mut usual = self.clone();
        for (value, parameter) in usual.values.iter_mut().zip(self.mechanism.parameters) {
            if parameter.is_form() {
                *value = parameter.typical;
            }
        }
        usual
    }

    /// Whether both are in the same form of one mechanism, if it has several.
    #[must_use]
    pub fn has_form_of(&self, other: &Self) -> bool {
        let forms = self.mechanism.parameters.iter().enumerate().filter(|(_, one)| one.is_form());
        self.mechanism.id == other.mechanism.id
            && forms.map(|(place, _)| place).all(|place| self.value(place) == other.value(place))
    }
}

/// `id` or `id:name=value,name=value`, as the command line takes it.
impl FromStr for Effect {
    type Err = MechanismError;

    fn from_str(text: &str) -> Result<Self, MechanismError> {
        let (id, list) = text.split_once(':').unwrap_or((text, ""));
        let mut effect = Self::typical(Mechanism::find(id.trim())?);
        for part in list.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            let (name, value) =
                part.split_once('=').ok_or_else(|| MechanismError::NotAnAssignment { text: part.to_owned() })?;
            let number = value.trim().parse::<f64>().map_err(|_| MechanismError::NotANumber {
                name: name.trim().to_owned(),
                text: value.trim().to_owned(),
            })?;
            effect.set(name.trim(), number)?;
        }
        Ok(effect)
    }
}

/// The same form that [`Effect::from_str`] reads, with every parameter written out.
impl std::fmt::Display for Effect {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.mechanism.id)?;
        for (place, (parameter, value)) in self.mechanism.parameters.iter().zip(&self.values).enumerate() {
            write!(f, "{}{}={value}", if place == 0 { ':' } else { ',' }, parameter.name)?;
        }
        Ok(())
    }
}

/// Why a mechanism cannot be had as asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MechanismError {
    /// No mechanism of this name.
    #[error("no mechanism is called `{id}`; there are {known}")]
    Unknown {
        /// What was asked for.
        id: String,
        /// What there is.
        known: String,
    },
    /// The mechanism has no parameter of this name.
    #[error("`{id}` has no parameter `{name}`; it has {known}")]
    UnknownParameter {
        /// The mechanism.
        id: &'static str,
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// A value that is physically impossible, or not a number.
    #[error("`{id}`: {name} = {value} {unit} is out of range; {low} to {high} {unit} is possible")]
    OutOfRange {
        /// The mechanism.
        id: &'static str,
        /// The parameter.
        name: &'static str,
        /// The value that was refused.
        value: f64,
        /// Smallest possible value.
        low: f64,
        /// Largest possible value.
        high: f64,
        /// Their unit.
        unit: &'static str,
    },
    /// Text that should be `name=value`.
    #[error("`{text}` should be `name=value`, as in `guide-friction:force_N=2.5`")]
    NotAnAssignment {
        /// The text.
        text: String,
    },
    /// A value that is not a number.
    #[error("{name}: `{text}` is not a number")]
    NotANumber {
        /// The parameter.
        name: String,
        /// The text.
        text: String,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_effect_are_the_same_thing() {
        let effect: Effect = "guide-friction: force_N = 2.5".parse().unwrap();
        assert_eq!(effect.get("force_N"), Ok(2.5));
        assert_eq!(effect.to_string().parse::<Effect>().unwrap(), effect);
    }

    #[test]
    fn a_refusal_says_what_would_be_right() {
        let message = |text: &str| text.parse::<Effect>().unwrap_err().to_string();
        assert!(message("rust").contains("guide-friction"), "{}", message("rust"));
        assert!(message("guide-friction:force=1").contains("it has force_N"), "{}", message("guide-friction:force=1"));
        let refused = message("guide-friction:force_N=-1");
        assert!(refused.contains("0 to") && refused.contains(" N is possible"), "{refused}");
        assert!(message("guide-friction:force_N=nan").contains("out of range"));
        assert!(message("guide-friction:force_N=much").contains("not a number"));
        assert!(message("guide-friction:force_N").contains("name=value"));
    }

    #[test]
    fn a_refused_value_changes_nothing() {
        let mut effect = Effect::new("guide-friction", &[("force_N", 3.0)]).unwrap();
        assert!(effect.set("force_N", 1e6).is_err());
        assert_eq!(effect.value(0), 3.0);
    }
}
