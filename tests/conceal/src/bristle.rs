//! Friction of the guide: bristles that bend like springs before they slide (LuGre, Canudas de Wit et al. 1995).

use crate::world::Guide;

/// The bristles' bend.
#[derive(Debug, Clone, Copy)]
pub struct Bristles {
    guide: Guide,
    bend_m: f64,
    piece_kg: f64,
}

impl Bristles {
    /// Unbent bristles that guide a piece of `piece_kg`.
    #[must_use]
    pub const fn new(guide: Guide, piece_kg: f64) -> Self {
        Self { guide, bend_m: 0.0, piece_kg }
    }

    /// Force against the motion (N) and the micro-damping (N·s/m), sliding at `speed` (m/s) under `load_n`; one step on.
    pub fn step(&mut self, speed: f64, load_n: f64, step_s: f64) -> (f64, f64) {
        let g = &self.guide;
        let load = g.load_share * load_n.abs();
        let slow = if g.stribeck_m_per_s > 0.0 { (-(speed / g.stribeck_m_per_s).powi(2)).exp() } else { 0.0 };
        let limit = g.sliding_n + load + (g.breakaway_n - g.sliding_n) * slow;
        let highest = g.breakaway_n.max(g.sliding_n) + load;
        if highest <= 0.0 {
            self.bend_m = 0.0;
            return (0.0, 0.0);
        }
        let stiffness = highest / g.presliding_m;
        // z' = v − σ₀·|v|·z/g(v), implicit in z, so that it cannot overshoot.
        self.bend_m = (self.bend_m + step_s * speed) / (1.0 + step_s * stiffness * speed.abs() / limit.max(1e-9));
        // Micro-damping of the bristles, gone once they slide faster than millimetres a second.
        let micro = (stiffness * self.piece_kg).sqrt() / (1.0 + (speed / 0.002).powi(2)).powi(2);
        (stiffness * self.bend_m, micro)
    }
}
