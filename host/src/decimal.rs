//! REAL32 values as a person wrote them.

/// The shortest decimal that stands for this value: 6.1, not 6.099999904632568.
#[must_use]
pub fn decimal(value: f32) -> f64 {
    // A float's shortest form always parses.
    value.to_string().parse().unwrap_or_else(|_| value.into())
}

/// The value with so many significant digits.
#[must_use]
pub fn significant(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_stays_as_it_was_written() {
        assert_eq!(decimal(6.1), 6.1);
        assert_eq!(decimal(-1e-9), -1e-9);
        assert!(decimal(f32::NAN).is_nan());
        assert_eq!(significant(0.277_829_15, 4), 0.2778);
    }
}
