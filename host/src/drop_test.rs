//! The rig's own test: known masses fall on it from known heights (section 3.2 of the paper).
//!
//! ```text
//! closed_form   what the paper's equations 18 to 24 say, corrected, and as printed
//! two_bodies    what happens where the falling mass and the impact piece are two bodies that part again
//! plan          the paper's masses, heights and stiffnesses, as a table with Δ %
//! fitness       a campaign of drops: is this rig fit for use, and if not, what is wrong
//! ```

pub mod closed_form;
pub mod fitness;
pub mod plan;
#[cfg(test)]
mod tests;
pub mod two_bodies;
