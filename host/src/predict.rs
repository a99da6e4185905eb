//! How hard a blow is going to be: forecasts from what is known before the contact, and from the first milliseconds of the rise.
//!
//! ```text
//! plan ─▶ campaigns ─▶ dataset (impacts) ─▶ task (rows: inputs, force) ─▶ trial (k folds over impacts) ─▶ score, page
//!                                                 │                          └─ beside: scikit-learn on the same folds
//!                                                 └─▶ learner ─▶ predictor (file) ─▶ export ─▶ the firmware's table
//! ```
//!
//! Section 5.2 of the paper, with three things put right. Folds are of impacts: the samples of one impact resemble each other, so
//! that a fold over samples is tested on what it was trained with. The largest stroke δ_max, and the stroke δ of an instant, are
//! what the impact did (F ≈ K·δ); inputs with them are `leaky` here and stand only beside the paper's. And what can be known
//! beforehand (speed, posture or m_R, K) has rows of its own.
//!
//! Learners are [`smartcore`]'s; nothing is learned by code of our own. The last column of learners multiplies what physics
//! expects, v·√(K·m_R) or the half sine of the rise, by 1 + a learned remainder.

pub mod beside;
pub mod dataset;
pub mod export;
pub mod learner;
pub mod paper;
pub mod plan;
pub mod predictor;
pub mod score;
pub mod shown;
pub mod task;
#[cfg(test)]
mod tests;
pub mod trial;
