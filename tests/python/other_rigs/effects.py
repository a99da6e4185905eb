"""The table of effects that can be hidden: how each is drawn for a rig, how its size enters, and what the truth says of it.

The name of a function below is the effect's id, its docstring the equation; it returns the effect as drawn. `put` writes an effect of a
given size into the scene of one impact: it sets parameters, adds to them or scales them; `tell` gives the parameters of that size in SI.
The three numbers are the size from which a search starts, and those between which the effect is still what it is called.
Those under `listed` are mechanisms of the contract; those under `foreign` are in no list, and the right answer to them is unexplained.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from chain import LEFT_OUT, REPEATED
from mechanics import BRAKE, BRISTLE_DAMPING_S, BURR_M_PER_S, BY_LOAD, COULOMB_M_PER_S, DRY, PRELOAD_M, RETRACT, SMOOTHED
from rig import Recording, Rig, Scene, log_uniform

CELL_FEELS = 0.35  # of the rigs have their guide on the cell, which then bears friction and air too
VARIES = 0.15  # standard deviation, relative, of what is not quite the same from impact to impact


@dataclass
class Effect:
    put: Callable[[Scene, Recording, float], object]
    tell: Callable[[float], dict]
    start: float
    low: float
    high: float
    chain_only: bool = False  # it leaves the motion alone
    whole: bool = False  # sizes are whole numbers
    only: set[int] | None = None  # recordings it acts in; None for all
    id: str = ""


@dataclass
class Kind:
    id: str
    drawing: Callable[[Rig, np.random.Generator], Effect]
    pad: bool = False  # it acts in the pad
    robot: bool = False  # a falling mass cannot have it
    against_stated: bool = False  # re-tuning imitates it: it shows against the stated uncertainties only
    loud: bool = False  # too strong for a quiet channel
    place: str = ""  # two effects of one place are never hidden together: they share parameters, or one hides the other

    def drawn(self, rig: Rig) -> Effect:
        effect = self.drawing(rig, rig.draw)
        effect.id = self.id
        return effect


LISTED: dict[str, Kind] = {}
FOREIGN: dict[str, Kind] = {}


def _into(table: dict[str, Kind], **traits):
    def add(drawing):
        name = drawing.__name__.replace("_", "-")
        table[name] = Kind(name, drawing, **traits)
        return drawing

    return add


def listed(**traits):
    return _into(LISTED, **traits)


def foreign(**traits):
    return _into(FOREIGN, **traits)


def kind_of(name: str) -> Kind:
    return LISTED.get(name) or FOREIGN[name]


def sign(draw: np.random.Generator) -> float:
    return float(draw.choice([-1, 1]))


# Contact


@listed()
def hunt_crossley_damping(rig, draw):
    """F = k d (1 + 3/2 alpha d'), of the pad, or of the body spring where there is no pad."""
    site = "pad" if rig.has_pad else "body"
    return Effect(lambda scene, impact, size: scene.adds(**{f"{site}_alpha": size}, added_damping=1.6 * size * rig.peak),
                  lambda size: {"alpha_s_per_m": size, "site": site}, 0.15, 1e-3, 0.8 / rig.fastest)


@listed()
def viscous_damping(rig, draw):
    """F = c v: in the pad, in the body spring, or across the whole contact, from robot to frame beside both, felt by the cell too."""
    site = str(draw.choice(["pad", "body", "contact"] if rig.has_pad else ["body", "contact"]))
    on_piece = 0.0 if site == "contact" else 1.0
    return Effect(lambda scene, impact, size: scene.adds(**{f"{site}_damping": size}, added_damping=on_piece * size),
                  lambda size: {"damping_N_s_per_m": size, "site": site}, 8.0, 0.02, 400.0)


@listed(pad=True)
def pad_relaxation(rig, draw):
    """Maxwell branches beside the pad's spring, F1' = k1 d' - F1 / tau: one, or two of which the other takes two to four times as long."""
    time, share = log_uniform(draw, 5e-3, 1.0), (1.0 if draw.random() < 0.6 else float(draw.uniform(0.4, 0.7)))
    longer = time * float(draw.uniform(2, 4))

    def put(scene, impact, size):
        added = size * scene.mechanics.pad_stiffness
        scene.sets(pad_branch_1=share * added, pad_branch_1_time=time, pad_branch_2=(1 - share) * added, pad_branch_2_time=longer)
        scene.adds(added_stiffness=added)

    told = {"tau_s": time, "branches": 1} if share == 1 else {"tau_s": time, "branches": 2, "share_1": share, "tau_2_s": longer}
    return Effect(put, lambda size: {"ratio": size, **told}, 0.1, 1e-3, 1.0)


@listed(pad=True, place="pad")
def rate_stiffening(rig, draw):
    """k (1 + a ln(1 + |d'| / 0.05 m/s)) at every instant, or k (1 + a ln(v / v_mid)) for each impact."""
    instant, slowest = draw.random() < 0.5, 0.05

    def put(scene, impact, size):
        if instant:
            scene.sets(pad_rate=size, pad_rate_from=slowest).adds(added_damping=size * rig.peak / slowest)
        else:
            scene.scales(pad_stiffness=max(0.2, 1 + size * math.log(impact.speed / rig.middle_speed)))

    told = {"form": "k*(1+a*ln(1+|rate|/0.05))"} if instant else {"form": "k*(1+a*ln(v/v_mid))", "v_mid_m_per_s": rig.middle_speed}
    return Effect(put, lambda size: {"a": size, **told}, 0.05, 1e-3, 0.35)


@listed(pad=True)
def mullins_softening(rig, draw):
    """k (1 + f e^(-N / N0)) in impact N of the campaign."""
    impacts = float(draw.uniform(2, 5))
    return Effect(lambda scene, impact, size: scene.scales(pad_stiffness=1 + size * math.exp(-impact.number / impacts)),
                  lambda size: {"fraction": size, "N0": impacts}, 0.1, 2e-3, 0.5)


@listed(pad=True, place="pad")
def hardening(rig, draw):
    """F = k d / (1 - d / d_lock)^p; the size is the baseline's largest compression over d_lock."""
    exponent = float(draw.choice([0.5, 1.0, 1.0, 2.0]))

    def put(scene, impact, size):
        scene.sets(pad_lock=rig.squeeze / size, pad_lock_exponent=exponent).adds(added_stiffness=8 * scene.mechanics.pad_stiffness)

    return Effect(put, lambda size: {"lock_m": rig.squeeze / size, "exponent": exponent}, 0.2, 0.005, 0.8)


@listed()
def end_stop(rig, draw):
    """A stiff spring beyond a stroke, with a toe and Hunt-Crossley damping. The size is the part of the largest stroke it takes away."""
    stiffness, toe, damping = rig.body * log_uniform(draw, 10, 60), log_uniform(draw, 2e-5, 2e-4), float(draw.uniform(0, 0.6))

    def put(scene, impact, size):
        scene.sets(stop_at=rig.stroke * (1 - size), stop_stiffness=stiffness, stop_toe=toe, stop_damping=damping)
        scene.adds(added_stiffness=stiffness, added_damping=damping * rig.peak)

    told = {"stiffness_N_per_m": stiffness, "toe_m": toe, "damping_s_per_m": damping}
    return Effect(put, lambda size: {"at_m": rig.stroke * (1 - size), **told}, 0.1, 0.003, 0.6)


@listed()
def clearance(rig, draw):
    """Within the gap only a part of the springs bears: the longest of several, or a spring that tilts on its seat."""
    share = float(draw.uniform(0.05, 0.4))
    return Effect(lambda scene, impact, size: scene.sets(gap=size, gap_share=share),
                  lambda size: {"gap_m": size, "share_of_spring_inside_gap": share}, 2e-4, 2e-6, 2e-3)


@listed(pad=True, place="piece")
def adhesion(rig, draw):
    """The pad sticks: it pulls as its spring does up to the size, and comes off over the length of a neck."""
    neck = log_uniform(draw, 3e-5, 6e-4)
    return Effect(lambda scene, impact, size: scene.sets(adhesion=size, adhesion_length=neck).adds(added_stiffness=size / neck),
                  lambda size: {"pull_off_N": size, "neck_m": neck}, 3.0, 0.05, 40.0)


@listed()
def air_damping(rig, draw):
    """Air that the piece squeezes out: c v |v|, behind a volume in which its pressure builds up."""
    lag, felt = log_uniform(draw, 1e-4, 1e-3), bool(draw.random() < CELL_FEELS)
    return Effect(lambda scene, impact, size: scene.sets(air=size, air_time=lag, air_felt=float(felt)),
                  lambda size: {"coefficient_N_s2_per_m2": size, "lag_s": lag, "felt_by_cell": felt}, 16.0, 0.1, 600.0)


# Guide


def dry_friction(rig, draw, model, static=1.0, stribeck=1.0):
    """LuGre bristles or smoothed Coulomb friction, with Stribeck's fall from rest to sliding."""
    presliding, felt = log_uniform(draw, 6e-6, 3e-5), bool(draw.random() < CELL_FEELS)  # asperities of some micrometres

    def put(scene, impact, size):
        scene.sets(friction=model, friction_force=size, friction_static=static, friction_speed=stribeck)
        scene.sets(friction_presliding=presliding, friction_felt=float(felt))
        if model == DRY:
            scene.adds(added_stiffness=size / presliding, added_damping=BRISTLE_DAMPING_S * size / presliding)
        else:
            scene.adds(added_damping=size * static / COULOMB_M_PER_S)

    told = {"model": "LuGre" if model == DRY else "tanh", "presliding_m": presliding, "felt_by_cell": felt}
    told |= {} if static == 1 else {"static_over_kinetic": static, "stribeck_speed_m_per_s": stribeck}
    return Effect(put, lambda size: {"force_N": size, **told}, 0.8, 0.01, 15.0)


@listed(place="guide")
def guide_friction(rig, draw):
    """A force of constant size against the motion."""
    return dry_friction(rig, draw, DRY if draw.random() < 0.65 else SMOOTHED)


@listed(place="guide")
def stiction(rig, draw):
    """As guide friction, but 1.4 to 2 times as large at rest."""
    return dry_friction(rig, draw, DRY, float(draw.uniform(1.4, 2.0)), log_uniform(draw, 0.01, 0.06))


@listed(place="guide")
def load_dependent_friction(rig, draw):
    """mu |F| against the motion, of the force of the springs, by Dahl's bristle."""
    presliding, felt = log_uniform(draw, 6e-6, 3e-5), bool(draw.random() < CELL_FEELS)

    def put(scene, impact, size):
        scene.sets(friction=BY_LOAD, friction_load=size, friction_presliding=presliding, friction_felt=float(felt))
        scene.adds(added_stiffness=size * rig.peak / presliding)

    return Effect(put, lambda size: {"coefficient": size, "presliding_m": presliding, "felt_by_cell": felt}, 0.01, 2e-4, 0.3)


# Bodies


@listed(pad=True, loud=True, place="piece")
def moving_piece_inertia(rig, draw):
    """The impact piece is a body between pad and springs, each of which damps its ringing by half."""
    ratio = log_uniform(draw, 0.02, 0.2)

    def put(scene, impact, size):
        each = ratio * math.sqrt((scene.mechanics.body_stiffness + scene.mechanics.pad_stiffness) * size)
        scene.sets(piece_mass=size, free_damping=each).adds(pad_damping=each, body_damping=each)

    return Effect(put, lambda size: {"mass_kg": size, "damping_ratio": ratio}, 0.05, 5e-4, 0.4)


@listed()
def frame_compliance(rig, draw):
    """The frame is a body on a spring; the size is that spring's compliance."""
    mass, ratio = float(draw.uniform(10, 30)), log_uniform(draw, 0.01, 0.05)

    def put(scene, impact, size):
        scene.sets(frame_mass=mass, frame_stiffness=1 / size, frame_damping=2 * ratio * math.sqrt(mass / size))

    return Effect(put, lambda size: {"compliance_m_per_N": size, "mass_kg": mass, "damping_ratio": ratio}, 2e-7, 5e-9, 2e-6)


# Robot


def behind_joint(scene, fraction, frequency, ratio):
    """Takes a fraction of the robot's mass behind a joint of that frequency."""
    mass, pulsation = scene.mechanics.tip_mass, 2 * math.pi * frequency
    reduced = mass * fraction * (1 - fraction)
    return scene.sets(tip_mass=mass * (1 - fraction), link_mass=mass * fraction, joint_stiffness=reduced * pulsation**2,
                      joint_damping=2 * ratio * reduced * pulsation)


@listed(robot=True, place="link")
def joint_elasticity(rig, draw):
    """A fraction of the mass sits behind an elastic joint of 10 to 28 Hz."""
    frequency, ratio = float(draw.uniform(10, 28)), log_uniform(draw, 0.01, 0.08)
    return Effect(lambda scene, impact, size: behind_joint(scene, size, frequency, ratio),
                  lambda size: {"fraction_behind_joint": size, "frequency_Hz": frequency, "damping_ratio": ratio}, 0.05, 5e-4, 0.6)


@listed(robot=True, place="link")
def link_oscillation(rig, draw):
    """The link sways when it hits, each time at another phase: at 2 to 13 Hz, as an acceleration of the whole robot that the contact does
    not change; or as a mode of 2 to 6 % of the mass, which answers the contact. A mode is slow and sways by centimetres: a faster one would
    first of all be an elastic joint."""
    share = float(draw.uniform(0.02, 0.06)) if draw.random() < 0.5 else 0.0
    frequency, ratio = float(draw.uniform(2, 4 if share else 13)), (0.0 if draw.random() < 0.5 else float(draw.uniform(0.01, 0.15)))
    pulsation = 2 * math.pi * frequency

    def put(scene, impact, size):
        amplitude, phase = size * (1 + VARIES * impact.variations[0]), impact.phases[0]
        if share:
            behind_joint(scene, share, frequency, ratio)
            scene.sets(link_offset=amplitude * math.sin(phase), link_speed=amplitude * pulsation * math.cos(phase))
        else:
            scene.sets(sway_amplitude=amplitude, sway_pulsation=pulsation, sway_phase=phase, sway_decay=ratio * pulsation)

    told = {"frequency_Hz": frequency, "decay_ratio": ratio, **({"mass_of_mode": share} if share else {})}
    return Effect(put, lambda size: {"amplitude_m": size, **told}, *((0.02, 0.01, 0.1) if share else (3e-4, 1e-7, 0.03)))


@listed(robot=True, place="drive")
def robot_push(rig, draw):
    """The drives go on pushing: a plateau that rises in milliseconds, or a position loop that saturates at the size."""
    loop, rise = draw.random() < 0.4, log_uniform(draw, 2e-3, 2e-2)
    stiffness, ratio, stop = float(draw.uniform(2e3, 8e3)), float(draw.uniform(0.3, 1)), float(draw.uniform(0.02, 0.3))

    def put(scene, impact, size):
        if loop:
            damping = 2 * ratio * math.sqrt(stiffness * impact.mass)
            scene.sets(loop_limit=size, loop_stiffness=stiffness, loop_damping=damping, loop_stop=stop)
        else:
            scene.sets(push=size, push_rise=rise)

    told = {"reading": "plateau", "rise_s": rise}
    if loop:
        told = {"reading": "saturating loop", "loop_N_per_m": stiffness, "loop_damping_ratio": ratio, "commanded_stop_s": stop}
    return Effect(put, lambda size: {"force_N": size, **told}, 5.0, 0.1, 150.0)


@listed(robot=True, place="top")
def force_ceiling(rig, draw):
    """Above the torque limit the arm gives way like a slipping clutch; the size is the part of the largest peak that is beyond it."""
    damping = log_uniform(draw, 100, 1500)
    return Effect(lambda scene, impact, size: scene.sets(ceiling=rig.peak * (1 - size), ceiling_damping=damping),
                  lambda size: {"force_N": rig.peak * (1 - size), "slip_damping_N_s_per_m": damping}, 0.1, 0.003, 0.7)


@listed(robot=True, place="drive")
def collision_reaction(rig, draw):
    """Some milliseconds after a threshold of force the drives retract until they move faster than the rebound, or brake."""
    retracts, threshold = draw.random() < 0.6, float(draw.uniform(0.05, 0.3)) * min(impact.peak for impact in rig.recordings)
    delay, ramp, faster = float(draw.uniform(5e-3, 30e-3)), log_uniform(draw, 2e-3, 2e-2), float(draw.uniform(0.05, 0.25))
    delay = min(delay, 0.6 * max(impact.lasts for impact in rig.recordings))  # later it would be over

    def put(scene, impact, size):
        scene.sets(reaction=RETRACT if retracts else BRAKE, reaction_threshold=threshold, reaction_delay=delay, reaction_ramp=ramp)
        scene.sets(reaction_force=size, reaction_speed=faster + impact.speed)

    told = {"threshold_N": threshold, "delay_s": delay, "ramp_s": ramp, "reaction": "retract" if retracts else "stop"}
    told |= {"retract_speed_over_rebound_m_per_s": faster} if retracts else {}
    return Effect(put, lambda size: {"force_N": size, **told}, 10.0, 0.2, 400.0)


@listed(robot=True, against_stated=True)
def pose_dependent_mass(rig, draw):
    """The mass is off by a factor in half of the configurations, beyond what is stated."""
    pattern = np.zeros(len(rig.masses))
    hit = draw.permutation(len(pattern))[: max(1, len(pattern) // 2)]
    pattern[hit] = draw.choice([-1, 1], len(hit)) * draw.uniform(0.6, 1, len(hit))
    pattern[hit[0]] = np.sign(pattern[hit[0]])
    return Effect(lambda scene, impact, size: scene.scales(tip_mass=math.exp(size * pattern[impact.configuration])),
                  lambda size: {"mass_factor": {str(i + 1): math.exp(size * part) for i, part in enumerate(pattern)}}, 0.1, 0.01, 0.7)


@listed(against_stated=True)
def speed_error(rig, draw):
    """All speeds are off, by a factor or by an offset, beyond what is stated."""
    offset, way = draw.random() < 0.4, sign(draw)

    def put(scene, impact, size):
        error = way * size * (rig.middle_speed if offset else impact.speed)
        scene.sets(impact_speed=max(impact.speed + error, 0.3 * impact.speed))

    return Effect(put, lambda size: {"offset_m_per_s": way * size * rig.middle_speed} if offset else {"relative": way * size},
                  0.06, 0.01, 0.35)


# Measuring


@listed()
def piezo_discharge(rig, draw):
    """A high pass of first order; the size is one over its time constant."""
    return Effect(lambda scene, impact, size: scene.sets(discharge=size), lambda size: {"tau_s": 1 / size}, 0.5, 1e-3, 12.0, True)


@listed()
def charge_drift(rig, draw):
    """A ramp from the recording's start, or one that comes to rest in a second or so."""
    time, way = (0.0 if draw.random() < 0.7 else log_uniform(draw, 0.3, 3)), sign(draw)
    return Effect(lambda scene, impact, size: scene.sets(drift=way * size * (1 + VARIES * impact.variations[1]), drift_time=time),
                  lambda size: {"rate_N_per_s": way * size, **({"tau_s": time} if time else {})}, 1.0, 0.01, 100.0, True)


@listed(place="top")
def clipping(rig, draw):
    """Nothing is read above a level; the size is the part of the largest peak that is beyond it."""
    return Effect(lambda scene, impact, size: scene.sets(clip=rig.peak * (1 - size)),
                  lambda size: {"level_N": rig.peak * (1 - size)}, 0.05, 0.001, 0.7, True)


@listed()
def filter_lag(rig, draw):
    """A causal low pass of first order, or Butterworth's of second or fourth; the size is one over its cutoff."""
    order = int(draw.choice([1, 2, 2, 4]))
    return Effect(lambda scene, impact, size: scene.sets(cutoff=2 * math.pi / size, order=order),
                  lambda size: {"cutoff_Hz": 1 / size, "order": order}, 1 / 400, 1 / 8000, 1 / 30, True)


@listed()
def mains_hum(rig, draw):
    """50 or 60 Hz, as the grid has it, with two harmonics; at any phase in each recording."""
    frequency, parts = float(draw.choice([50, 50, 60])) + float(draw.normal(0, 0.03)), (1.0, draw.uniform(0, 0.25), draw.uniform(0, 0.5))

    def put(scene, impact, size):
        amplitude = size * (1 + 0.05 * impact.variations[2])
        scene.adds(hum=[(frequency * (i + 1), amplitude * part, impact.phases[1 + i]) for i, part in enumerate(parts)])

    told = {"frequency_Hz": frequency, "harmonic_2": parts[1], "harmonic_3": parts[2]}
    return Effect(put, lambda size: {"amplitude_N": size, **told}, 0.1, 0.002, 20.0, True)


@listed(against_stated=True)
def gain_error(rig, draw):
    """Every force is off by a factor, beyond what is stated of springs and mass."""
    way = sign(draw)
    return Effect(lambda scene, impact, size: scene.scales(gain=math.exp(way * size)), lambda size: {"factor": math.exp(way * size)},
                  0.1, 0.01, 0.7, True)


@listed()
def lost_samples(rig, draw):
    """In most recordings a run of samples is missing during the contact: left out, or the last value repeated."""
    how = LEFT_OUT if draw.random() < 0.6 else REPEATED
    places = [float(draw.uniform(0.1, 0.85)) for _ in rig.recordings]  # of the contact
    loses = [bool(draw.random() < 0.7) for _ in rig.recordings]
    loses[int(draw.integers(len(loses)))] = True

    def put(scene, impact, size):
        first = int((impact.contact_at + places[impact.number] * impact.lasts) * rig.rate)
        if loses[impact.number] and first + round(size) + 5 < len(impact.times):
            scene.sets(lost=[(how, first, round(size))])

    return Effect(put, lambda size: {"samples": round(size), "kind": how}, 3, 1, 200, chain_only=True, whole=True)


@listed()
def air_drag(rig, draw):
    """Of a falling ball, which has a rig of its own: see fall.py."""
    raise NotImplementedError("air-drag is drawn by fall.py")


# In no list


@foreign()
def rocking_base(rig, draw):
    """The frame only stands on its feet and lifts off at a force; the size is the part of the largest peak that is beyond it."""
    mass = float(draw.uniform(10, 30))
    return Effect(lambda scene, impact, size: scene.sets(frame_mass=mass, frame_damping=150.0, frame_weight=rig.peak * (1 - size)),
                  lambda size: {"lifts_at_N": rig.peak * (1 - size), "mass_kg": mass}, 0.3, 0.01, 0.9)


@foreign(robot=True, place="link")
def loose_mass(rig, draw):
    """A fraction of the robot's mass slides in a clearance and strikes its ends."""
    gap, stiffness = log_uniform(draw, 2e-4, 3e-3), log_uniform(draw, 1e5, 8e5)

    def put(scene, impact, size):
        mass = scene.mechanics.tip_mass
        scene.sets(tip_mass=mass * (1 - size), link_mass=mass * size, link_offset=0.5 * gap * math.sin(impact.phases[0]), joint_gap=gap,
                   joint_stiffness=stiffness, joint_damping=2 * 0.15 * math.sqrt(stiffness * mass * size))

    return Effect(put, lambda size: {"fraction": size, "clearance_m": gap, "stop_N_per_m": stiffness}, 0.02, 5e-4, 0.4)


@foreign()
def cell_creep(rig, draw):
    """The cell goes on to read more under load, by a fraction that builds up in milliseconds to tenths of a second."""
    time = log_uniform(draw, 8e-3, 0.2)
    return Effect(lambda scene, impact, size: scene.sets(creep=size, creep_time=time), lambda size: {"fraction": size, "tau_s": time},
                  0.02, 2e-4, 0.5, True)


@foreign(robot=True)
def dragging_cable(rig, draw):
    """A cable comes taut behind the robot: it pulls back on the way in and, by its friction, less so on the way out."""
    length = log_uniform(draw, 2e-3, 8e-3)
    return Effect(lambda scene, impact, size: scene.sets(cable_force=size, cable_length=length),
                  lambda size: {"force_N": size, "length_m": length}, 3.0, 0.05, 80.0)


@foreign(robot=True)
def second_object(rig, draw):
    """The robot meets something else beyond a travel; the size is the part of the largest travel that this takes away."""
    stiffness, damping, furthest = rig.body * log_uniform(draw, 0.2, 2), float(draw.uniform(0, 1)), rig.stroke + rig.squeeze
    told = {"stiffness_N_per_m": stiffness, "damping_s_per_m": damping}

    def put(scene, impact, size):
        scene.sets(object_at=furthest * (1 - size), object_stiffness=stiffness, object_damping=damping)

    return Effect(put, lambda size: {"at_m": furthest * (1 - size), **told}, 0.2, 0.005, 0.9)


@foreign(pad=True, loud=True, place="piece")
def spring_surge(rig, draw):
    """The body spring has a mass of its own, half-way along it."""
    ratio = log_uniform(draw, 0.005, 0.05)
    return Effect(lambda scene, impact, size: scene.sets(surge_mass=size, surge_damping=ratio),
                  lambda size: {"spring_mass_kg": size, "damping_ratio": ratio}, 0.05, 1e-3, 0.6)


@foreign()
def magnetic_pull(rig, draw):
    """A magnet pulls the robot towards first contact, by an inverse square."""
    reach = log_uniform(draw, 2e-3, 1e-2)
    return Effect(lambda scene, impact, size: scene.sets(magnet_force=size, magnet_reach=reach),
                  lambda size: {"force_N": size, "reach_m": reach}, 5.0, 0.1, 150.0)


@foreign(pad=True)
def edge_contact(rig, draw):
    """The pad meets the robot with an edge first; the size is the part of the largest compression until the whole face bears."""
    return Effect(lambda scene, impact, size: scene.sets(pad_edge=size * rig.squeeze),
                  lambda size: {"full_contact_at_m": size * rig.squeeze}, 0.2, 0.003, 1.0)


@foreign()
def spring_preload(rig, draw):
    """The springs are preloaded against a seat, which the first force has to overcome."""
    return Effect(lambda scene, impact, size: scene.sets(preload=size).adds(added_stiffness=size / PRELOAD_M),
                  lambda size: {"force_N": size}, 5.0, 0.05, 40.0)


@foreign()
def guide_burr(rig, draw):
    """Friction at one place of the guide only."""
    at, width = float(draw.uniform(0.25, 0.6)) * rig.stroke, float(draw.uniform(0.03, 0.12)) * rig.stroke

    def put(scene, impact, size):
        scene.sets(burr_force=size, burr_at=at, burr_width=width)
        scene.adds(added_stiffness=2 * size / width, added_damping=size / BURR_M_PER_S)

    return Effect(put, lambda size: {"force_N": size, "at_m": at, "width_m": width}, 2.0, 0.05, 15.0)


@foreign()
def velocity_pickup(rig, draw):
    """The cell's cable picks up a part of the speed of the springs."""
    return Effect(lambda scene, impact, size: scene.sets(pickup=size / scene.mechanics.body_stiffness),
                  lambda size: {"N_s_per_m": size}, 2.0, 0.02, 300.0, True)


@foreign()
def pad_warming(rig, draw):
    """Pad, or springs where there is none, soften from impact to impact."""
    stiffness = "pad_stiffness" if rig.has_pad else "body_stiffness"
    return Effect(lambda scene, impact, size: scene.scales(**{stiffness: 1 - size * impact.number / len(rig.recordings)}),
                  lambda size: {"softening_over_campaign": size}, 0.05, 2e-3, 0.5)
