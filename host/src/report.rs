//! The report: one HTML page that needs nothing else, for someone who has never seen the tool.

pub mod words;

/// tmp
#[must_use]
pub fn replay_page(_: &[(String, crate::replay::Replayed)]) -> String {
    String::new()
}
