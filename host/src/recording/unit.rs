//! Units in column names: `force_N`, `tcp_speed_m_per_s`, `pressure_gauge_Pa`.

/// Units without a prefix. `count`, `ratio` and `percent` stand for numbers that have none.
const PLAIN: [&str; 11] = ["kg", "degC", "deg", "rad", "count", "ratio", "percent", "min", "h", "bar", "sample"];
/// Units that take a decimal prefix.
const PREFIXED: [&str; 14] = ["Nm", "Ns", "Hz", "Pa", "N", "s", "m", "g", "V", "A", "K", "J", "W", "C"];
/// Decimal prefixes, none first.
const PREFIXES: [&str; 7] = ["", "k", "M", "G", "m", "u", "n"];

/// The unit that a column's name ends in: `m_per_s` for `tcp_speed_m_per_s`.
///
/// A unit is a factor (`N`, `mm`, `s2`), or factors with `per` between them; before it stands `_` and what is measured.
/// `None` when the name does not end in a unit, or has nothing before it.
#[must_use]
pub fn unit_of(name: &str) -> Option<&str> {
    let (mut what, last) = name.rsplit_once('_')?;
    if !is_factor(last) {
        return None;
    }
    while let Some(before_per) = what.strip_suffix("_per") {
        let (before, factor) = before_per.rsplit_once('_')?;
        if !is_factor(factor) {
            return None;
        }
        what = before;
    }
    let named = !what.is_empty() && !what.ends_with('_');
    named.then(|| &name[what.len() + 1..])
}

/// A unit, with a prefix where it takes one, with a power from 2 to 4.
fn is_factor(text: &str) -> bool {
    let base = text.strip_suffix(['2', '3', '4']).unwrap_or(text);
    PLAIN.contains(&base)
        || PREFIXES.iter().any(|prefix| base.strip_prefix(prefix).is_some_and(|rest| PREFIXED.contains(&rest)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_found_at_the_end_of_a_name() {
        for (name, unit) in [
            ("time_s", "s"),
            ("force_N", "N"),
            ("force_desired_N", "N"),
            ("acceleration_m_per_s2", "m_per_s2"),
            ("tcp_speed_m_per_s", "m_per_s"),
            ("pressure_gauge_Pa", "Pa"),
            ("current_desired_axis1_A", "A"),
            ("stiffness_N_per_mm", "N_per_mm"),
            ("angle_rad_per_s", "rad_per_s"),
            ("overrun_count", "count"),
        ] {
            assert_eq!(unit_of(name), Some(unit), "{name}");
        }
    }

    #[test]
    fn a_name_without_a_unit_has_none() {
        for name in ["", "_", "N", "_N", "force", "force_", "force_n", "Force [N]", "_per_s", "x_per_s", "force__N"] {
            assert_eq!(unit_of(name), None, "{name}");
        }
    }
}
