//! The paper's figures (section 5.2), on its own recordings, to stand beside ours. Its data are not public: the comparison is of
//! kind, not of the last newton.

use serde::Serialize;

/// A figure of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[expect(non_snake_case, reason = "the keys carry their units")]
pub struct Printed {
    /// R².
    pub r_squared: f64,
    /// Root of the mean square error.
    pub rmse_N: f64,
}

const fn printed(r_squared: f64, rmse_n: f64) -> Option<Printed> {
    Some(Printed { r_squared, rmse_N: rmse_n })
}

/// (26): δ_max, K, m_R, speed.
pub const LINEAR: Option<Printed> = printed(0.92, 36.1);
/// Force over time: m_R, K, m_H, δ.
pub const PROFILE_SVR: Option<Printed> = printed(0.985, 14.4);
/// The same by a tree.
pub const PROFILE_TREE: Option<Printed> = printed(0.989, 12.1);
/// Peak: m_R, K, m_H, δ_max.
pub const PEAK_SVR: Option<Printed> = printed(0.980, 14.4);
/// Peak: m_R, K, δ_max.
pub const PEAK_TREE: Option<Printed> = printed(0.982, 17.0);
/// Peak: speed, joints 1, 2 and 4.
pub const POSTURE_TREE: Option<Printed> = printed(0.965, 23.4);
