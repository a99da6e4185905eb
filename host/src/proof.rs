//! The proof: data in which an effect is concealed, diagnosed by a process that cannot know it, and scored.
//!
//! ```text
//!            thud-conceal (shares no code with what fits)
//! seed ─▶ requests ─▶ campaigns ──────────────▶ process of its own for each ─▶ what it said ──┐
//!                └──▶ answers ─▶ hash, printed                                                  ▼
//!                        └─────▶ sealed (key in this process only) ─▶ opened, hash checked ─▶ judged ─▶ scores ─▶ targets
//!                                                                              └─▶ advice, followed
//! ```
//!
//! [`conceal`] is the only module that names the concealing simulator; what judges reads answers and diagnoses as JSON, so that
//! anyone can judge anew with another program.

pub mod comparable;
pub mod conceal;
pub mod folder;
pub mod followed;
pub mod hidden;
pub mod interval;
pub mod judged;
pub mod lighter;
pub mod outcome;
pub mod peers;
pub mod prober;
pub mod said;
pub mod score;
pub mod seal;
pub mod shown;
pub mod story;
pub mod target;
pub mod usage;
