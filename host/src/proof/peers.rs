//! Other people's methods on the same cases: what they get ([`view`]), and how they did beside the diagnosis ([`compared`]).
//!
//! ```text
//! DIR/cases/NAME ─▶ view: recordings, re-tuned baseline, χ² of every candidate ─▶ tests/python/peers ─▶ DIR/peers/PEER/NAME.json
//! DIR/answers.json ───────────────────────────────────────────────────────────────────────────────────▶ judged as the diagnosis is
//! ```
//!
//! A peer's answer is written as a diagnosis, as far as it goes, and judged by the very code that judges the diagnosis.

pub mod compared;
pub mod view;
