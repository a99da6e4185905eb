//! [`Campaign`] to `campaign.toml`, in the order and the manner in which a person would write it.

use std::fmt::Write as _;

use super::{Campaign, Estimate, FORMAT, Rig, SPRING_REPEATABILITY};

impl Campaign {
    /// The text of its `campaign.toml`; numbers in the shortest digits that read back as the same number. Optional
    /// keys at their default are left out.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "format = \"{FORMAT}\"\nname = {}\n", string_toml(&self.name));
        push_rig(&mut text, &self.rig);
        let _ = writeln!(
            text,
            "\n[chain]\nsample_rate_Hz = {}\nnoise_rms_N = {}",
            number_toml(self.chain.sample_rate_hz),
            number_toml(self.chain.noise_rms),
        );
        if let Some(full_scale) = self.chain.full_scale {
            let _ = writeln!(text, "full_scale_N = {}", number_toml(full_scale));
        }
        let _ = writeln!(text, "observed = \"{}\"", self.chain.observed.column());
        for entry in &self.recordings {
            let _ = writeln!(
                text,
                "\n[[recording]]\nfile = {}\nimpact_speed_m_per_s = {}\neffective_mass_kg    = {}",
                string_toml(&entry.file),
                estimate_toml(entry.impact_speed_m_per_s),
                estimate_toml(entry.effective_mass_kg),
            );
            if let Some(configuration) = &entry.configuration {
                let _ = writeln!(text, "configuration = {}", string_toml(configuration));
            }
        }
        text
    }
}

/// The `[rig]` table of a campaign or a model.
pub(crate) fn push_rig(text: &mut String, rig: &Rig) {
    let _ = writeln!(text, "[rig]\nkind = \"{}\"", rig.kind.name());
    for (key, estimate) in [
        ("body_stiffness_N_per_m", rig.body_stiffness_n_per_m),
        ("pad_stiffness_N_per_m", rig.pad_stiffness_n_per_m),
        ("moving_mass_kg", rig.moving_mass_kg),
    ] {
        if let Some(estimate) = estimate {
            let _ = writeln!(text, "{key} = {}", estimate_toml(estimate));
        }
    }
    if rig.gravity_along_impact_m_per_s2 != rig.kind.default_gravity_m_per_s2() {
        let _ = writeln!(text, "gravity_along_impact_m_per_s2 = {}", number_toml(rig.gravity_along_impact_m_per_s2));
    }
    if rig.spring_repeatability != SPRING_REPEATABILITY {
        let _ = writeln!(text, "spring_repeatability = {}", number_toml(rig.spring_repeatability));
    }
}

/// A number that TOML reads as a float.
pub(crate) fn number_toml(value: f64) -> String {
    format!("{value:?}")
}

/// `{ value = …, sd = … }`
fn estimate_toml(estimate: Estimate) -> String {
    format!("{{ value = {}, sd = {} }}", number_toml(estimate.value), number_toml(estimate.sd))
}

/// A quoted string.
pub(crate) fn string_toml(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
