//! Dry friction of the piece in its guide.
//!
//! The piece sticks while less than F_c is needed to hold it, and slides against F_c. On a massless piece in
//! series with pad and spring this is a play operator: while it sticks only the pad yields, and the stroke of
//! the spring lags behind the robot's by F_c/k. Whether the cell sees the friction depends on what the guide
//! stands on, which `cell_share` says; the spring's force it always sees. When the robot has gone, friction holds a massless
//! piece where it is, at F_c. A real one is left with some momentum: at F_c − v·√(m·k) as long as that is little, and anywhere
//! between −F_c and F_c beyond. F_c·rest_share^(v/0.25 m/s) is both on average.
//!
//! No guide holds rigidly, and no simulator that steps over friction does. On bristles friction is F_c·y, y the bend of bristles by z, `presliding_m`:
//! z·dy/dt = v − y·√(v² + v_c²). Without v_c, `creep_m_per_s`, that is Dahl's solid, which holds for ever; without z it is friction in
//! proportion to speeds far below v_c, F_c·v/√(v² + v_c²), as good as the tanh(v/v_c) of other simulators, and what it holds creeps home.
//!
//! The robot may have a guide of its own, a rail or its joints: F = −F_c·v/√(v² + v_c²) on the robot, in contact and after it. Nothing rests
//! then when it has gone. (What rubs before the contact is in the speed at contact.)
//!
//! What rubs may be pad and springs together, one loop of both beside the force of the stroke: friction between the robot and what the rig
//! stands on, through the cell, F_c·v/√(v² + v_c²) on the robot while it touches. Nothing is held then; a pad that is still pressed when
//! friction has taken all of its force springs back. (With a piece that has a mass of its own it rubs on that, on the cell.)
//!
//! Source: C. A. Coulomb; play operator: M. Brokate, J. Sprekels, Hysteresis and Phase Transitions (1996), ch. 2; bristles: P. R. Dahl,
//! A solid friction model, Aerospace Corp. TOR-0158 (1968); presliding of 1 to 50 µm: B. Armstrong-Hélouvry et al., Automatica 30 (1994) 1083,
//! of metal on metal. A seal shears as a whole before it slips, by h·µ·p/G: 0.5 mm with a lip of h = 3 mm of rubber of 70 Shore A
//! (G = E/3 = 1.8 MPa; A. N. Gent, Rubber Chem. Technol. 31 (1958) 896) pressed by p = 1 MPa at µ = 0.3.

use super::{Effect, Group, Mechanism, Needed, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Drive, Guide, Motion};

/// Where the friction goes: to the cell or past it.
pub(super) const CELL_SHARE: Parameter = Parameter {
    name: "cell_share",
    unit: "1",
    meaning: "part of the friction that flows through the load cell: 0 when the guide stands beside it, 1 when on it",
    null: None,
    range: (0.0, 1.0),
    plausible: (0.0, 1.0),
    typical: 0.0,
    scale: Scale::Linear,
    // The loop that the cell sees turns round with it.
    search: Search::OneOf(&[0.0, 1.0]),
};

/// What is guided, and how it is held.
pub(super) const GUIDE: Parameter = Parameter {
    name: "guide",
    meaning: "what rubs: 0 the piece, which sticks rigidly, 1 the piece, on bristles that bend before they slide, 2 the robot's own guide, 3 pad and springs together",
    // Without a pad the last is a piece on short bristles.
    search: Search::FormWith(Needed::Pad, &[0.0, 1.0, 2.0, 3.0], 3),
    ..Parameter::ONE_OF_FOUR
};

/// Which of its parameters each of these has a meaning for.
pub(super) const FORMS: &[(&str, &str, &[f64])] = &[
    (CELL_SHARE.name, GUIDE.name, &[0.0, 1.0]),
    (REST_SHARE.name, GUIDE.name, &[0.0, 1.0]),
    (PRESLIDING.name, GUIDE.name, &[1.0]),
    (CREEP.name, GUIDE.name, &[1.0, 2.0, 3.0]),
];

/// How far bristles bend.
pub(super) const PRESLIDING: Parameter = Parameter {
    name: "presliding_m",
    unit: "m",
    meaning: "how far the bristles bend before they slide; next to nothing where friction is dry",
    null: None,
    range: (1e-6, 1e-3),
    plausible: (1e-6, 5e-4),
    typical: 1e-5,
    scale: Scale::Logarithmic,
    search: Search::Typical,
};

/// How fast bristles forget.
pub(super) const CREEP: Parameter = Parameter {
    name: "creep_m_per_s",
    unit: "m/s",
    meaning: "speed below which friction that does not stick rigidly is proportional to the speed",
    null: None,
    range: (1e-6, 0.1),
    plausible: (1e-5, 1e-2),
    typical: 3e-4,
    scale: Scale::Logarithmic,
    search: Search::Typical,
};

/// A guide that rubs, of the piece or of the robot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rubbing {
    pub(super) coulomb_n: f64,
    pub(super) static_ratio: f64,
    pub(super) stribeck_m_per_s: f64,
    pub(super) cell_share: f64,
    pub(super) rest_share: f64,
    /// The choice of [`GUIDE`].
    pub(super) guide: u32,
    /// The values of [`PRESLIDING`] and [`CREEP`].
    pub(super) bristles: [f64; 2],
}

impl Rubbing {
    pub(super) fn enter(self, assembly: &mut Assembly) {
        let [presliding_m, creep_m_per_s] = self.bristles;
        let smooth = Guide {
            coulomb_n: self.coulomb_n,
            static_ratio: self.static_ratio,
            stribeck_m_per_s: self.stribeck_m_per_s,
            creep_m_per_s: creep_m_per_s.max(SLOWEST_M_PER_S),
            ..Guide::default()
        };
        let cell_share = match self.guide {
            2 => return assembly.drives.push(Box::new(Rail(smooth))),
            3 if assembly.piece.is_none() && !assembly.across.rubbing.rubs() => {
                assembly.across.rubbing = smooth;
                return;
            }
            3 => 1.0,
            _ => self.cell_share,
        };
        assembly.guide.coulomb_n += self.coulomb_n;
        assembly.guide.static_ratio = assembly.guide.static_ratio.max(self.static_ratio);
        assembly.guide.stribeck_m_per_s = self.stribeck_m_per_s.max(assembly.guide.stribeck_m_per_s);
        assembly.guide.stands_on_cell(cell_share);
        assembly.guide.rest_share = self.rest_share;
        if self.guide > 0 {
            assembly.guide.stands_on_bristles(presliding_m, creep_m_per_s);
        }
    }
}

/// The robot's own guide.
#[derive(Debug)]
struct Rail(Guide);

/// The slowest speed below which its friction is proportional to the speed: a solver can follow it.
const SLOWEST_M_PER_S: f64 = 1e-4;

impl Drive for Rail {
    fn force_n(&self, motion: Motion) -> f64 {
        let Self(guide) = self;
        if motion.time_s <= 0.0 { 0.0 } else { -guide.smooth_n(motion.velocity_m_per_s) }
    }
}

/// What friction still holds when the robot has gone.
pub(super) const REST_SHARE: Parameter = Parameter {
    name: "rest_share",
    unit: "1",
    meaning: "part of the sliding friction that the springs still press with after a release at 0.25 m/s: 1 for a piece without mass",
    null: None,
    range: (0.0, 1.0),
    plausible: (0.0, 1.0),
    typical: 1.0,
    scale: Scale::Linear,
    search: Search::Typical,
};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "guide-friction",
    group: Group::Guide,
    site: Site::Guide,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: FORMS,
    sized: &[],
    equation: "F_f = F_c·sgn(dx_p/dt) while sliding, |F_f| ≤ F_c while sticking; on bristles F_f = F_c·y, z·dy/dt = v − y·√(v² + v_c²)",
    source: "Coulomb friction with true sticking, or Dahl's bristles, which may forget; 0.5 to 10 N for a printed guide",
    parameters: &[
        Parameter {
            name: "force_N",
            unit: "N",
            meaning: "sliding friction",
            null: Some(0.0),
            range: (0.0, 60.0),
            plausible: (0.1, 10.0),
            typical: 2.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        CELL_SHARE,
        REST_SHARE,
        GUIDE,
        PRESLIDING,
        CREEP,
    ],
    signature: "a loop of constant width in force over stroke, a short plateau at the turning point, a rest of up to F_c after release",
    confused_with: &["hunt-crossley-damping", "load-dependent-friction", "stiction", "piezo-discharge"],
    separated_by: "the loop's width depends neither on speed nor on force; the sign of the rest after release",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let rubbing = Rubbing {
        coulomb_n: effect.value(0),
        static_ratio: 1.0,
        stribeck_m_per_s: 0.0,
        cell_share: effect.value(1),
        rest_share: effect.value(2),
        guide: effect.form(3),
        bristles: [4, 5].map(|place| effect.value(place)),
    };
    rubbing.enter(assembly);
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike};
    use crate::rig::{Quantity, Rig};

    /// The shorter the bristles, the nearer they are to a piece that sticks: carried, in balance, creeping and heavy.
    #[test]
    fn short_bristles_stick() {
        let bare = Rig::impact(25e3);
        let padded = Rig::impact(25e3).with_pad(80e3);
        let cases: [(&Rig, &[&str]); 8] = [
            (&bare, &[]),
            (&padded, &[]),
            (&padded, &["viscous-damping:damping_Ns_per_m=5"]),
            (&bare, &["viscous-damping:damping_Ns_per_m=20"]),
            (&bare, &["air-damping:drag_Ns2_per_m2=20"]),
            (&padded, &["air-damping:drag_Ns2_per_m2=5"]),
            (&padded, &["load-dependent-friction:coefficient=0.05"]),
            (&padded, &["moving-piece-inertia:mass_kg=0.1,pad_damping_ratio=0.05"]),
        ];
        for (rig, others) in cases {
            for share in [0, 1] {
                let run = |shape: &str| {
                    let friction = format!("guide-friction:force_N=5,cell_share={share},{shape}");
                    strike(*rig, 0.25, 6.0, &[&[friction.as_str()], others].concat())
                };
                let rigid = run("guide=0");
                let bent = run("guide=1,presliding_m=1e-6,creep_m_per_s=1e-6");
                let (contact, expected) = (bent.truth().contacts[0], rigid.truth().contacts[0]);
                near("peak", contact.stroke_m / expected.stroke_m, 1.0, 1e-4);
                near("end", contact.end_s.unwrap() / expected.end_s.unwrap(), 1.0, 2e-3);
                near("loss", contact.loss_j / expected.loss_j, 1.0, 1e-2);
                for time_s in [0.01, 0.02, 0.03, 0.04, 0.1] {
                    near("force", bent.force_n(time_s), rigid.force_n(time_s), 0.3);
                }
            }
        }
    }

    /// A dashpot that takes next to nothing lets a massless piece find its balance at once: bristles beside it are followed as without it, and it costs no more.
    #[test]
    fn a_weak_dashpot_beside_bristles_is_hardly_there() {
        for friction in ["guide-friction:force_N=3,guide=1", "load-dependent-friction:coefficient=0.03,bristles=1"] {
            for bristles in ["presliding_m=6e-6,creep_m_per_s=0.04", "presliding_m=6e-6,creep_m_per_s=3e-4"] {
                let friction = format!("{friction},{bristles},cell_share=0.5");
                let rig = Rig::impact(39e3).with_pad(80e3);
                let without = strike(rig, 0.29, 5.8, &[&friction]);
                for damping in [0.01, 0.1, 0.3] {
                    let dashpot = format!("viscous-damping:damping_Ns_per_m={damping}");
                    let with = strike(rig, 0.29, 5.8, &[&friction, &dashpot]);
                    assert!(with.effort().evaluations < 4_000, "{friction}, {damping}: {:?}", with.effort());
                    for number in 1..100 {
                        let time_s = 1e-3 * f64::from(number);
                        near("force", with.force_n(time_s), without.force_n(time_s), 0.3 * damping + 0.01);
                    }
                }
            }
        }
    }

    /// What a moving dashpot or the air has carried beside the friction, the springs do not: they go on until friction holds all of their force. The
    /// cell, which feels springs and drag, sees no step.
    #[test]
    fn a_drag_does_not_hold_what_friction_lets_go() {
        let damped = ["viscous-damping:damping_Ns_per_m=20", "air-damping:drag_Ns2_per_m2=80"];
        for drag in damped {
            for guide in ["0", "1,presliding_m=1e-6,creep_m_per_s=1e-6"] {
                let friction = format!("guide-friction:force_N=3,cell_share=0,rest_share=1,guide={guide}");
                let impact = strike(Rig::impact(25e3), 0.25, 6.0, &[&friction, drag]);
                let end_s = impact.truth().contacts[0].end_s.unwrap();
                let [before, after, later] = [-1e-7, 1e-7, 0.1].map(|since_s| impact.force_n(end_s + since_s));
                near("step", after, before, 2e-3);
                near("rest", later, 3.0, 0.02);
            }
        }
    }

    /// Pad and springs rub together like the springs in series of a rig without a pad, ∮F·dx = F_c·(2·x − F_c/k) with what is left in the springs, ½F_c²/k.
    #[test]
    fn across_pad_and_springs_it_is_one_loop() {
        let (force, speed, mass) = (3.0, 0.3, 6.0);
        let padded = Rig::impact(25e3).with_pad(80e3);
        let stiffness = padded.effective_stiffness_n_per_m();
        for sticking in ["guide-friction:", "stiction:static_ratio=1.5,stribeck_m_per_s=1e-4,"] {
            let effect = format!("{sticking}force_N={force},guide=3,creep_m_per_s=1e-4");
            let [with, without] = [padded, Rig::impact(stiffness)].map(|rig| strike(rig, speed, mass, &[&effect]));
            let [contact, series] = [&with, &without].map(|impact| impact.truth().contacts[0]);
            near("step", with.force_n(1e-6), force, 0.02);
            near("end", contact.end_s.unwrap(), series.end_s.unwrap(), 1e-6);
            for time_s in [0.002, 0.01, 0.02, 0.03, 0.04] {
                near("force", with.force_n(time_s), without.force_n(time_s), 1e-3);
            }
            let loss_j = force * (2.0 * series.stroke_m - 0.5 * force / stiffness);
            near("loss", contact.loss_j / loss_j, 1.0, 0.01);
            near("nothing is held", with.force_n(contact.end_s.unwrap() + 0.01), 0.0, 1e-9);
        }
    }

    /// What bristles hold creeps home: −y/√(1 − y²)·v_c is its speed, y = k·x/F, as long as the springs are soft beside them.
    #[test]
    fn what_is_held_creeps_home() {
        let (force, creep) = (2.0, 2e-3);
        let rig = Rig::impact(25e3).with_pad(80e3);
        let effect = format!("guide-friction:force_N={force},guide=1,presliding_m=1e-6,creep_m_per_s={creep}");
        let impact = strike(rig, 0.25, 6.0, &[&effect]);
        let end = impact.truth().contacts[0].end_s.unwrap();
        for after in [0.03, 0.05, 0.07] {
            let (y, step) = (impact.force_n(end + after) / force, 1e-4);
            let rate = (impact.force_n(end + after + step) - impact.force_n(end + after - step)) / (2.0 * step);
            let expected = -creep * 25e3 * y / (1.0 - y * y).sqrt();
            near("rate", rate / expected, 1.0, 0.03);
        }
        let held = impact.value(Quantity::Stroke, end + 0.05);
        near("the springs press with what is left", 25e3 * held, impact.force_n(end + 0.05), 1e-6);
    }

    /// What has fallen and bounced is held by its own guide above the rig: it creeps down at v with F_c·v/√(v² + v_c²) = m·g, towards which it decays
    /// thousands of times faster than the springs swing. That takes no steps as short.
    #[test]
    fn what_the_robots_guide_holds_is_followed_in_few_steps() {
        let (mass, force, creep) = (0.24, 60.0, 3e-4);
        let effect = format!("guide-friction:force_N={force},guide=2,creep_m_per_s={creep}");
        let impact = strike(Rig::drop(7e3), 4.4, mass, &[&effect]);
        assert!(impact.effort().steps < 500, "{:?}", impact.effort());
        let y = mass * crate::rig::STANDARD_GRAVITY_M_PER_S2 / force;
        let [before, after] = [0.1, 0.2].map(|at_s| impact.value(Quantity::Position, at_s));
        near("speed", (after - before) / 0.1 / (creep * y / (1.0 - y * y).sqrt()), 1.0, 1e-3);
    }
}
