//! What one recording truly was: every body and every imperfection, as numbers.
//!
//! ```text
//!            joint      pad        body springs    cell   feet
//!  ┌──────┐  ┌────┐          ┌───────┐          ┌───────┐
//!  │ link ├─┴┬──┬─┴┤ tip ├─▒▒─┤ piece ├─/\/\/\/─┤ frame ├─/\/─ ground
//!  └──────┘  backlash          └──┬────┘          └───┬───┘
//!                                  └── guide (bristles) ┘
//! ```
//!
//! Positive is into the rig. The cell lies under the springs, so it feels what passes through them; the guide belongs to
//! the cover and leads its friction past the cell.

/// What moves and what it runs into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A robot runs into the fixed rig.
    Impact,
    /// A mass falls on the rig.
    Drop,
    /// A body falls freely.
    Fall,
}

impl Kind {
    /// The word in the campaign.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Impact => "impact",
            Self::Drop => "drop",
            Self::Fall => "fall",
        }
    }
}

/// Everything that acts in one recording.
#[derive(Debug, Clone)]
pub struct World {
    /// Robot, drop or fall.
    pub kind: Kind,
    /// Gravity along the motion, m/s².
    pub gravity_m_per_s2: f64,
    /// Speed at first touch (for a fall: at release), m/s.
    pub speed_m_per_s: f64,
    /// All that moves before the pad, kg.
    pub mass_kg: f64,
    /// The robot behind the tip.
    pub robot: Robot,
    /// The pad.
    pub pad: Pad,
    /// The impact piece.
    pub piece: Piece,
    /// The body springs.
    pub spring: Spring,
    /// The guide of the piece.
    pub guide: Guide,
    /// The frame, where it moves.
    pub frame: Option<Frame>,
    /// The load cell and what its signal passes through.
    pub chain: Chain,
    /// ½·ρ·C_d·A of a falling body, N·s²/m².
    pub drag_n_s2_per_m2: f64,
    /// Acceleration of a wind or spin along a fall, growing with the time of flight, m/s³ (unlisted).
    pub spin_m_per_s3: f64,
}

/// The robot.
#[derive(Debug, Clone, Default)]
pub struct Robot {
    /// Elastic joint.
    pub joint: Option<Joint>,
    /// Sway of the link at contact.
    pub sway: Option<Sway>,
    /// The drive keeps pushing.
    pub push: Option<Push>,
    /// Highest force that the arm passes on before it gives way, N.
    pub ceiling_n: Option<f64>,
    /// The controller reacts to the collision.
    pub reaction: Option<Reaction>,
    /// Cogging of the gears: amplitude N, pitch m, phase rad.
    pub cogging: Option<(f64, f64, f64)>,
    /// The tip slips sideways on the pad: at this share of the peak force (N) by this much (m).
    pub slip: Option<(f64, f64)>,
}

/// Two masses with a spring between.
#[derive(Debug, Clone, Copy)]
pub struct Joint {
    /// Share of the mass behind the joint.
    pub share: f64,
    /// Frequency of the two against each other, Hz.
    pub frequency_hz: f64,
    /// Damping ratio of that mode.
    pub damping_ratio: f64,
    /// Free play, m (unlisted).
    pub backlash_m: f64,
}

/// A link that sways while the robot approaches.
#[derive(Debug, Clone, Copy)]
pub struct Sway {
    /// Amplitude at the tip, m.
    pub amplitude_m: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Phase at contact, rad.
    pub phase_rad: f64,
}

/// A position servo that has not noticed the contact: it pulls the tip after its plan until it saturates.
#[derive(Debug, Clone, Copy)]
pub struct Push {
    /// Stiffness of the servo, N/m.
    pub stiffness_n_per_m: f64,
    /// Where the servo saturates, N.
    pub limit_n: f64,
    /// How long it pushes after contact, s.
    pub until_s: f64,
}

/// Retract after a collision was noticed.
#[derive(Debug, Clone, Copy)]
pub struct Reaction {
    /// Contact force that is noticed, N.
    pub threshold_n: f64,
    /// Time from there to the first effect, s.
    pub delay_s: f64,
    /// Force of the retraction, N.
    pub force_n: f64,
    /// Its rise time, s.
    pub rise_s: f64,
}

/// The pad between tip and piece.
#[derive(Debug, Clone)]
pub struct Pad {
    /// Long-term stiffness, N/m.
    pub stiffness_n_per_m: f64,
    /// Crowned surface: the first micrometres rise as a parabola, m.
    pub crown_m: f64,
    /// α of F·(1 + 1.5·α·δ̇), s/m.
    pub alpha_s_per_m: f64,
    /// Dashpot in parallel, N·s/m.
    pub dashpot_n_s_per_m: f64,
    /// Maxwell branches: stiffness N/m and relaxation time s.
    pub branches: Vec<(f64, f64)>,
    /// Growth of the stiffness for e-fold rate, and the rate at which there is none, m/s.
    pub rate: Option<(f64, f64)>,
    /// Locking stroke, m, and exponent.
    pub lock: Option<(f64, f64)>,
    /// Pull-off force, N.
    pub pull_off_n: f64,
    /// A layer with F = q·u² in series, N/m² (unlisted).
    pub soft_layer_n_per_m2: Option<f64>,
}

/// The moving impact piece.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Damping ratio of its own vibration between pad and springs, led past the cell.
    pub damping_ratio: f64,
    /// Damping ratio on the springs alone while nothing touches it: the felt of the cover, to which it returns.
    pub rest_damping_ratio: f64,
}

/// The body springs.
#[derive(Debug, Clone)]
pub struct Spring {
    /// Stiffness in this recording, N/m.
    pub stiffness_n_per_m: f64,
    /// Progressive stop: begins at m, final stiffness N/m, stroke over which it comes in m.
    pub stop: Option<(f64, f64, f64)>,
    /// Share of the springs that is loose, and by how much, m.
    pub loose: Option<(f64, f64)>,
    /// Air that is squeezed out, N·s²/m².
    pub air_n_s2_per_m2: f64,
    /// Wave along the springs: moving mass of the coils, kg, and damping ratio (unlisted).
    pub surge: Option<(f64, f64)>,
    /// Creeping printed parts: Maxwell branches on the spring, stiffness N/m and time s (unlisted).
    pub creep: Vec<(f64, f64)>,
    /// Rate-independent loss: share of the spring force, and the stroke over which it turns, m (unlisted).
    pub loss: Option<(f64, f64)>,
}

/// Friction of the guide, as bristles that bend before they slide (LuGre).
#[derive(Debug, Clone, Copy)]
pub struct Guide {
    /// Sliding friction, N.
    pub sliding_n: f64,
    /// Friction at breakaway, N; at least the sliding one.
    pub breakaway_n: f64,
    /// Speed over which the one becomes the other, m/s.
    pub stribeck_m_per_s: f64,
    /// Share of the contact force that the guide turns into friction.
    pub load_share: f64,
    /// Bend of the bristles at breakaway, m.
    pub presliding_m: f64,
}

/// The frame on its feet.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Stiffness of the feet when pressed, N/m.
    pub stiffness_n_per_m: f64,
    /// Stiffness when lifted over that when pressed.
    pub lifted_share: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

/// The load cell and its signal's way to the file.
#[derive(Debug, Clone)]
pub struct Chain {
    /// Stiffness of the cell, N/m.
    pub cell_n_per_m: f64,
    /// Gain over the stated one.
    pub gain: f64,
    /// Relative curvature at full scale (unlisted).
    pub curvature: f64,
    /// Tilt for each metre of stroke, rad/m (unlisted).
    pub tilt_rad_per_m: f64,
    /// Time constant of the discharge, s.
    pub discharge_s: Option<f64>,
    /// Heat of the impact: zero shift in N for each joule, and its time constant, s (unlisted).
    pub heat: Option<(f64, f64)>,
    /// Causal low-pass of the readout, Hz.
    pub lag_hz: Option<f64>,
    /// Anti-alias filter, Hz.
    pub anti_alias_hz: f64,
    /// Ramp of the zero, N/s.
    pub drift_n_per_s: f64,
    /// Hum: amplitude N, frequency Hz, phase rad; and the share of its third harmonic.
    pub hum: [f64; 4],
    /// Level at which the readout saturates, N.
    pub clip_n: f64,
    /// Smallest step of the converter, N.
    pub step_n: f64,
    /// Samples that vanish without a trace: (index, count), rising.
    pub lost: Vec<(usize, usize)>,
}
