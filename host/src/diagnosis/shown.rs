//! A diagnosis for people: one screenful on the terminal, one HTML page that needs nothing else.
//!
//! ```text
//! Diagnosis ─┬─▶ answer (JSON, the contract's) ─┬─▶ terminal   verdict, where, what, shown, next
//!            └─▶ pictured (curves, residuals) ──┴─▶ page ── figure, map, spectrum; sheet (tables); glossary
//! ```
//!
//! Both say what the JSON says, in the same digits, so that every number can be traced.

mod figure;
mod glossary;
mod map;
mod page;
mod pictured;
mod sheet;
mod spectrum;
mod terminal;

pub use page::{page, telling};
pub use terminal::screenful;

#[cfg(test)]
mod tests;
