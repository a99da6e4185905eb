//! [`Model`] to `model.toml`, with what each parameter means beside it.

use std::fmt::Write as _;

use super::{FORMAT, Model};
use crate::campaign::{number_toml, push_rig, string_toml};

impl Model {
    /// The text of its file; every parameter is written out, numbers in the shortest digits that read back as the same.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "format = \"{FORMAT}\"\nname = {}\n", string_toml(&self.name));
        push_rig(&mut text, &self.rig);
        for entry in &self.mechanisms {
            let mechanism = entry.effect.mechanism();
            let _ = writeln!(text, "\n# {}\n[[mechanism]]\nid = \"{}\"", mechanism.equation, mechanism.id);
            if let Some(configuration) = &entry.only_in {
                let _ = writeln!(text, "configuration = {}", string_toml(configuration));
            }
            text.push_str("[mechanism.parameters]\n");
            for (place, parameter) in mechanism.parameters.iter().enumerate() {
                let _ = write!(text, "{} = {{ value = {}", parameter.name, number_toml(entry.effect.value(place)));
                if let Some(interval) = entry.intervals.get(place).copied().flatten() {
                    let _ =
                        write!(text, ", low = {}, high = {}", number_toml(interval.low), number_toml(interval.high));
                }
                let _ = writeln!(text, " }}  # {}", parameter.meaning);
            }
        }
        text
    }
}
