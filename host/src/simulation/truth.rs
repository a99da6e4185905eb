//! What was true in a simulated campaign: written apart, never into the campaign.

use serde::Serialize;

/// What the `format` key says.
pub const FORMAT: &str = "thud-truth/1";

/// Truth of all campaigns of one run.
#[derive(Clone, Debug, Serialize)]
pub struct Truth {
    /// [`FORMAT`].
    pub format: &'static str,
    /// The seed.
    pub seed: u64,
    /// One for each campaign.
    pub campaigns: Vec<CampaignTruth>,
}

/// Truth of one campaign.
#[derive(Clone, Debug, Serialize)]
#[expect(non_snake_case, reason = "the keys carry their units")]
pub struct CampaignTruth {
    /// The campaign's name.
    pub name: String,
    /// Stiffness of the body springs, N/m.
    pub body_stiffness_N_per_m: f64,
    /// Stiffness of the pad, N/m.
    pub pad_stiffness_N_per_m: Option<f64>,
    /// The mechanisms as the command line writes them.
    pub mechanisms: Vec<String>,
    /// One for each recording.
    pub recordings: Vec<RecordingTruth>,
}

/// Truth of one recording; times are the recording's own.
#[derive(Clone, Debug, Serialize)]
#[expect(non_snake_case, reason = "the keys carry their units")]
pub struct RecordingTruth {
    /// The file, as the campaign names it.
    pub file: String,
    /// Instant of first contact, s.
    pub contact_s: f64,
    /// Speed at contact, m/s.
    pub impact_speed_m_per_s: f64,
    /// Effective mass, kg.
    pub effective_mass_kg: f64,
    /// Stiffness of the body springs in this recording, N/m.
    pub body_stiffness_N_per_m: f64,
    /// Each touch of robot and rig.
    pub contacts: Vec<ContactTruth>,
}

/// Truth of one touch; forces at the load cell, before the measuring chain.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(non_snake_case, reason = "the keys carry their units")]
pub struct ContactTruth {
    /// Instant of contact, s.
    pub contact_s: f64,
    /// Instant of separation, s; `None`: it still touched at the end.
    pub separation_s: Option<f64>,
    /// Highest force, N.
    pub peak_N: f64,
    /// When, s.
    pub peak_s: f64,
    /// Time integral of the force, N·s.
    pub impulse_Ns: f64,
    /// Largest stroke of the body springs, m.
    pub stroke_m: f64,
}

impl ContactTruth {
    /// A touch of a simulated impact whose first contact is at `contact_s`.
    #[must_use]
    pub fn new(contact: &thud_sim::rig::Contact, contact_s: f64) -> Self {
        Self {
            contact_s: contact_s + contact.start_s,
            separation_s: contact.end_s.map(|end| contact_s + end),
            peak_N: contact.peak_n,
            peak_s: contact_s + contact.peak_s,
            impulse_Ns: contact.impulse_ns,
            stroke_m: contact.stroke_m,
        }
    }

    /// The same touch on another time axis, `by_s` later.
    #[must_use]
    pub fn shifted(&self, by_s: f64) -> Self {
        Self {
            contact_s: self.contact_s + by_s,
            separation_s: self.separation_s.map(|separation| separation + by_s),
            peak_s: self.peak_s + by_s,
            ..self.clone()
        }
    }
}
