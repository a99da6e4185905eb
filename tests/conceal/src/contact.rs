//! The pad: an elastic law, Maxwell branches, and what lets go.

use crate::world::Pad;

/// The pad's memory.
#[derive(Debug, Clone)]
pub struct Contact<'a> {
    pad: &'a Pad,
    /// Stretch of each branch's dashpot, m.
    dashpots: Vec<f64>,
    keep: Vec<f64>,
    /// Fastest compression lately, m/s.
    rate: f64,
    rate_keep: f64,
    glued: bool,
}

/// Force on the tip (and, opposite, on the piece): `elastic_n` now and `dashpot` times the speed of approach.
#[derive(Debug, Clone, Copy, Default)]
pub struct Push {
    /// Part that knows the position only, N.
    pub elastic_n: f64,
    /// Part in proportion to the speed of approach, N·s/m.
    pub dashpot_n_s_per_m: f64,
}

/// How long the pad remembers a rate, s: longer than an impact, shorter than the pause to the next.
const RATE_MEMORY_S: f64 = 0.5;

impl<'a> Contact<'a> {
    /// A rested pad.
    #[must_use]
    pub fn new(pad: &'a Pad, step_s: f64) -> Self {
        Self {
            pad,
            dashpots: vec![0.0; pad.branches.len()],
            keep: pad.branches.iter().map(|(_, tau)| (-step_s / tau).exp()).collect(),
            rate: 0.0,
            rate_keep: (-step_s / RATE_MEMORY_S).exp(),
            glued: false,
        }
    }

    /// The elastic law of a compression above zero, N.
    fn elastic(&self, compression: f64) -> f64 {
        let pad = self.pad;
        let k = pad.stiffness_n_per_m;
        // A crowned face: quadratic over the crown, then the same line, shifted by half of it.
        let d = if compression < pad.crown_m {
            compression * compression / (2.0 * pad.crown_m)
        } else {
            compression - pad.crown_m / 2.0
        };
        let mut force = k * d;
        if let Some((lock, exponent)) = pad.lock {
            // Beyond nine tenths of the locking stroke the curve goes on straight: rubber is not a rock.
            let knee = 0.9 * lock;
            let law = |d: f64| k * d / (1.0 - d / lock).powf(exponent);
            force = if d < knee {
                law(d)
            } else {
                let slope = (law(knee) - law(knee * 0.999)) / (knee * 0.001);
                law(knee) + slope * (d - knee)
            };
        }
        if let Some(q) = pad.soft_layer_n_per_m2 {
            // δ = F/k + √(F/q), solved for √F.
            let r = (1.0 / q).sqrt();
            let root = (-r + (r * r + 4.0 * d / k).sqrt()) * k / 2.0;
            force = root * root;
        }
        if let Some((growth, reference)) = pad.rate {
            // A logarithm has no bottom; no pad softens below a third.
            force *= (1.0 + growth * (self.rate / reference).max(1e-6).ln()).max(0.33);
        }
        force
    }

    /// Force at compression `compression` (m, negative when apart) closing with `closing` (m/s), and one step on.
    pub fn step(&mut self, compression: f64, closing: f64) -> Push {
        if compression <= 0.0 {
            for (dashpot, keep) in self.dashpots.iter_mut().zip(&self.keep) {
                *dashpot *= keep;
            }
            if self.glued {
                let pull = -self.pad.stiffness_n_per_m * compression;
                if pull < self.pad.pull_off_n {
                    return Push { elastic_n: -pull, dashpot_n_s_per_m: 0.0 };
                }
                self.glued = false;
            }
            return Push::default();
        }
        self.glued = self.pad.pull_off_n > 0.0;
        self.rate = (self.rate * self.rate_keep).max(closing.abs());
        let elastic = self.elastic(compression);
        let mut force = elastic;
        for ((dashpot, keep), (stiffness, _)) in self.dashpots.iter_mut().zip(&self.keep).zip(&self.pad.branches) {
            force += stiffness * (compression - *dashpot);
            *dashpot = compression + (*dashpot - compression) * keep;
        }
        let dashpot = self.pad.dashpot_n_s_per_m + 1.5 * self.pad.alpha_s_per_m * elastic;
        // Without glue it cannot pull.
        if force + dashpot * closing <= 0.0 && !self.glued {
            return Push::default();
        }
        Push { elastic_n: force, dashpot_n_s_per_m: dashpot }
    }
}
