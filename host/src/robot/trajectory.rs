//! Joint values over time, as a robot controller logs them.
//!
//! A recording's CSV (docs/files.md): first column `time_s`, then one column for each joint, named after it with its
//! unit: `A1_rad` or `A1_deg` for a joint that turns, `lift_m` or `lift_mm` for one that slides. Further columns are
//! not looked at. Between two lines the joints go straight.

use super::posture::{Given, Posture, PostureError};
use super::{Motion, Robot};
use crate::recording::{Recording, unit_of};

/// Joint values over time.
#[derive(Clone, Debug)]
pub struct Trajectory {
    times_s: Vec<f64>,
    joints: Vec<(String, Vec<f64>)>,
}

/// Why a recording is no trajectory of a robot.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum TrajectoryError {
    /// No column belongs to a joint.
    #[error("no column is named after a joint of {robot}")]
    #[diagnostic(help("name the columns JOINT_rad, JOINT_deg or JOINT_m; the joints are {}", names.join(", ")))]
    NoJoints {
        /// The robot.
        robot: String,
        /// Its joints.
        names: Vec<String>,
    },
    /// A column's unit is not one of the joint's.
    #[error("column `{column}` gives joint `{joint}` in {unit}")]
    #[diagnostic(help("{right}"))]
    Unit {
        /// The column.
        column: String,
        /// The joint.
        joint: String,
        /// Its unit.
        unit: String,
        /// What would be right.
        right: &'static str,
    },
    /// A posture on the way is not possible.
    #[error("at {time_s} s (sample {sample}): {source}")]
    Posture {
        /// When.
        time_s: f64,
        /// Which line of values, counted from 1.
        sample: usize,
        /// What is wrong with it.
        #[diagnostic_source]
        source: PostureError,
    },
}

impl Trajectory {
    /// The trajectory in a recording.
    ///
    /// # Errors
    /// [`TrajectoryError`]; every line is looked at.
    pub fn new(recording: &Recording, robot: &Robot, link: usize) -> Result<Self, TrajectoryError> {
        let mut joints = Vec::new();
        for channel in recording.channels() {
            let Some(unit) = unit_of(&channel.name) else { continue };
            let name = &channel.name[..channel.name.len() - unit.len() - 1];
            let Some(joint) =
                robot.movable().into_iter().map(|joint| &robot.joints[joint]).find(|joint| joint.name == name)
            else {
                continue;
            };
            let factor = match (joint.motion, unit) {
                (Motion::Turn, "rad") | (Motion::Slide, "m") => 1.0,
                (Motion::Turn, "deg") => std::f64::consts::PI / 180.0,
                (Motion::Slide, "mm") => 1e-3,
                (motion, unit) => {
                    return Err(TrajectoryError::Unit {
                        column: channel.name.clone(),
                        joint: joint.name.clone(),
                        unit: unit.to_owned(),
                        right: if motion == Motion::Turn {
                            "it turns: name the column with _rad or _deg"
                        } else {
                            "it slides: name the column with _m or _mm"
                        },
                    });
                }
            };
            joints.push((joint.name.clone(), channel.values.iter().map(|value| value * factor).collect()));
        }
        if joints.is_empty() {
            let names = robot.movable().into_iter().map(|joint| robot.joints[joint].name.clone()).collect();
            return Err(TrajectoryError::NoJoints { robot: robot.name.clone(), names });
        }
        let trajectory = Self { times_s: recording.times_s().to_vec(), joints };
        for (index, &time_s) in trajectory.times_s.iter().enumerate() {
            trajectory.posture_at(robot, link, time_s).map_err(|source| TrajectoryError::Posture {
                time_s,
                sample: index + 1,
                source,
            })?;
        }
        Ok(trajectory)
    }

    /// When the values were taken, s.
    #[must_use]
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// The posture at a time, straight between two lines; before the first and after the last it stands.
    ///
    /// # Errors
    /// [`PostureError`]; none that [`Trajectory::new`] has not found already, because a range holds what lies between two of its values.
    pub fn posture_at(&self, robot: &Robot, link: usize, time_s: f64) -> Result<Posture, PostureError> {
        let after = self.times_s.partition_point(|&time| time < time_s).min(self.times_s.len() - 1);
        let before = after.saturating_sub(1);
        let span = self.times_s[after] - self.times_s[before];
        let share = if span > 0.0 { ((time_s - self.times_s[before]) / span).clamp(0.0, 1.0) } else { 0.0 };
        let values = self
            .joints
            .iter()
            .map(|(name, values)| {
                // The line itself where the time is its own.
                let value = if share >= 1.0 {
                    values[after]
                } else {
                    values[before] + share * (values[after] - values[before])
                };
                (name.clone(), value)
            })
            .collect();
        Posture::new(robot, link, &Given::Named(values))
    }
}
