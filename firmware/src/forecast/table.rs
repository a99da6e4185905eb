//! Written by `thud predict export`.

use super::Table;

/// The trees.
pub static TABLE: Table<'static> = Table { base: 0.0, trees: &[], bounds: [0.5; 4] };
