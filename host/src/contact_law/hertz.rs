//! An elastic contact whose area grows with depth: F = k·δⁿ, n = 1.5 between spheres.
//!
//! Source: H. Hertz, J. reine angew. Math. 92 (1881) 156; paper 1, eq. 13, with n to be found.

use super::law::{Damping, Law};

pub(super) static LAW: Law = Law {
    id: "hertz",
    name: "Hertz",
    equation: "F = k·δⁿ",
    source: "Hertz, J. reine angew. Math. 92 (1881) 156",
    exponent: true,
    damping: Damping::None,
};
