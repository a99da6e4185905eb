//! The sensor's settings on the command line, and why one is refused, in words.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use thud_firmware::configuration::{Configuration, ContactKind, FilterProfile, Invalid, Setting};
use thud_firmware::limits::{LimitsProfile, Region};
use thud_firmware::units::{Kilogram, Newton, NewtonPerMetre};

/// What the sensor judges by; the options that `replay` and `demo` share.
#[derive(clap::Args, Debug, Clone, Default)]
#[command(next_help_heading = "What is judged, and by what")]
pub struct JudgeOptions {
    /// Body region that was hit; without it there is no verdict
    #[arg(long, value_parser = one_of(&Region::ALL, Region::name))]
    pub region: Option<Region>,
    /// Effective mass of the robot; without it the force is not scaled
    #[arg(long, value_name = "KG")]
    pub mass: Option<f32>,
    /// Stiffness of the body spring in the rig [default: that of the region]
    #[arg(long, value_name = "N/M")]
    pub stiffness: Option<f32>,
    /// Whether the body part can recoil (free) or not (clamped)
    #[arg(long, default_value = "free", value_parser = one_of(&[ContactKind::Free, ContactKind::Clamped], contact_word))]
    pub contact: ContactKind,
    /// Table of limits
    #[arg(long, default_value = LimitsProfile::IsoTs15066.name(), value_parser = one_of(&LimitsProfile::ALL, LimitsProfile::name))]
    pub limits: LimitsProfile,
    /// Filter of the judged force
    #[arg(long, default_value = FilterProfile::IsoPas5672.name(), value_parser = one_of(&FilterProfile::ALL, FilterProfile::name))]
    pub filter: FilterProfile,
    /// A contact is what rises above this many times the noise
    #[arg(long, value_name = "N", default_value_t = Configuration::DEFAULT.onset_multiple)]
    pub onset_multiple: f32,
    /// A contact is what rises above this force, however quiet the signal is
    #[arg(long, value_name = "NEWTON", default_value_t = Configuration::DEFAULT.onset_minimum.0)]
    pub onset_minimum: f32,
    /// Relative expanded uncertainty (k = 2) of the force: the guard band on both sides of a limit
    #[arg(long, value_name = "RATIO", default_value_t = Configuration::DEFAULT.relative_uncertainty)]
    pub uncertainty: f32,
    /// Full scale of the measuring chain [default: that of the reference chain, 2293 N]
    #[arg(long, value_name = "NEWTON")]
    pub full_scale: Option<f32>,
}

impl JudgeOptions {
    /// The configuration that these options make of the default one.
    ///
    /// # Errors
    /// The first setting out of its range, with the range.
    pub fn configuration(&self) -> miette::Result<Configuration> {
        let mut configuration = Configuration {
            region: self.region,
            contact: self.contact,
            limits: self.limits,
            effective_mass: self.mass.map(Kilogram),
            filter: self.filter,
            onset_multiple: self.onset_multiple,
            onset_minimum: Newton(self.onset_minimum),
            relative_uncertainty: self.uncertainty,
            ..Configuration::DEFAULT
        };
        configuration.body_stiffness = match (self.stiffness, self.region) {
            (Some(stiffness), _) => NewtonPerMetre(stiffness),
            (None, Some(region)) => region.body().stiffness,
            (None, None) => configuration.body_stiffness,
        };
        if let Some(full_scale) = self.full_scale {
            configuration.chain.newton_per_code = full_scale / f32::from(configuration.chain.zero_code);
        }
        configuration.validate().map_err(|invalid| miette::miette!("{}", explain_invalid(invalid)))?;
        Ok(configuration)
    }
}

/// An option that is one of some things, each with a name.
pub fn one_of<T: Copy + Send + Sync>(
    choices: &'static [T],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let named = move |word: String| choices.iter().copied().find(|choice| name(*choice) == word);
    PossibleValuesParser::new(choices.iter().map(|choice| name(*choice)))
        .try_map(move |word| named(word).ok_or("no such name"))
}

/// The word for a kind of contact on the command line.
#[must_use]
pub const fn contact_word(contact: ContactKind) -> &'static str {
    match contact {
        ContactKind::Free => "free",
        ContactKind::Clamped => "clamped",
    }
}

/// What the codes and the bias of a chain must fulfil.
pub const CHAIN_RANGE: &str = "clip low < zero code < clip high, and bias low < bias high, must hold";

/// Which setting is wrong, and what it may be.
#[must_use]
pub fn explain_invalid(invalid: Invalid) -> String {
    let range = |setting: Setting| {
        let (name, unit) = setting_name(setting);
        match setting.range() {
            Some((low, high)) => format!("{name} may be {low} to {high} {unit}").trim_end().to_owned(),
            None => format!("{name} has no such value"),
        }
    };
    match invalid {
        Invalid::TooLow(setting) => format!("too low: {}", range(setting)),
        Invalid::TooHigh(setting) => format!("too high: {}", range(setting)),
        Invalid::NoSuchValue(setting) => format!("not a value: {}", range(setting)),
        Invalid::Contradiction(Setting::SampleRate) => {
            "the sample rate must be at least ten times the corner of the filter: choose a higher rate or a lower filter".to_owned()
        }
        Invalid::Contradiction(Setting::ChainRange) => CHAIN_RANGE.to_owned(),
        Invalid::Contradiction(setting) => {
            format!("{} contradicts the other settings", setting_name(setting).0)
        }
    }
}

fn setting_name(setting: Setting) -> (&'static str, &'static str) {
    match setting {
        Setting::BodyStiffness => ("the stiffness of the body spring", "N/m"),
        Setting::EffectiveMass => ("the effective mass", "kg"),
        Setting::EffectiveMassMaxAge => ("the highest age of the effective mass", "ms"),
        Setting::OnsetMultiple => ("the onset multiple", ""),
        Setting::OnsetMinimum => ("the least onset", "N"),
        Setting::RelativeUncertainty => ("the relative uncertainty", ""),
        Setting::SampleRate => ("the sample rate", "Hz"),
        Setting::NewtonPerCode => ("the force per code (full scale / 32768)", "N"),
        Setting::TimeConstant => ("the time constant of the chain", "s"),
        Setting::ChainDelay => ("the delay of the chain", "s"),
        Setting::ChainRange => ("the range of the chain", ""),
        Setting::NodeId => ("the node id", ""),
        Setting::Heartbeat => ("the heartbeat period", "ms"),
        Setting::Region => ("the region", ""),
        Setting::Contact => ("the kind of contact", ""),
        Setting::Limits => ("the table of limits", ""),
        Setting::Filter => ("the filter", ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_region_brings_its_stiffness_and_a_refusal_its_range() {
        let mut options = JudgeOptions {
            region: Some(Region::LowerArm),
            onset_multiple: 6.0,
            onset_minimum: 0.5,
            uncertainty: 0.03,
            ..JudgeOptions::default()
        };
        assert_eq!(options.configuration().unwrap().body_stiffness, NewtonPerMetre(40_000.0));
        options.mass = Some(-1.0);
        let refusal = options.configuration().unwrap_err().to_string();
        assert!(refusal.contains("effective mass may be 0.05 to 1000 kg"), "{refusal}");
    }
}
