//! A linear spring without loss: F = k·δ. What ISO/TS 15066 takes a body region for.
//!
//! Source: R. Hooke (1678); ISO/TS 15066:2016, annex A.

use super::law::{Damping, Law};

pub(super) static LAW: Law = Law {
    id: "linear",
    name: "linear",
    equation: "F = k·δ",
    source: "ISO/TS 15066:2016, annex A",
    exponent: false,
    damping: Damping::None,
};
