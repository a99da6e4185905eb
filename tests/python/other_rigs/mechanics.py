"""Equations of motion of robot, pad, piece, springs and frame, integrated by Runge and Kutta's method of fourth order.

    link (or loose mass) - tip - pad - piece - body spring, its own mass - cell - frame - ground

Every body moves along the impact; positions are zero at first contact and grow into the rig. Metres, seconds, kilograms and newtons
throughout; time counts from first contact. A piece whose inertia is not the effect is given a fraction of a gram: see `light_piece`.
"""

import math
from dataclasses import astuple, dataclass, fields

import numpy as np
from numba import njit

# The lightest piece rings at 2e5 rad/s, which this step resolves 30 times a period. A quarter of the step changes forces by 0.002 N,
# with rate stiffening by 0.05 N at worst, which is no more than the quietest channel's noise.
STEP_S = 1e-6
LIGHT_PIECE_RAD_PER_S = 2e5  # far above what any chain passes on, and still far from the limit of the integration (2.8 / STEP_S)
# Explicit integration of a light mass m with damping c needs c * STEP_S / m below 2.8; this keeps clear of it.
MOST_DAMPING = 1.2

# Widths over which what is sharp in a textbook is smooth, so that the integration keeps its order.
BRISTLE_DAMPING_S = 2e-5  # damping of a friction bristle over its stiffness: it settles within presliding, unseen by the chain
COULOMB_M_PER_S = 5e-3  # speed at which smoothed dry friction has three quarters of its force
BURR_M_PER_S = 1e-2  # the same for a burr of the guide, which is coarser than its surface
PRELOAD_M = 3e-5  # stroke over which a preloaded spring lifts off its seat: the roughness of turned parts
LIFT_M = 5e-6  # by which the feet of a rocking frame lift before its weight is all that holds it
FEET_DAMPING = 10.0  # feet on the floor damp this many times as much as the frame in the air
MOST_LOCKED = 0.93  # of the compression at which a hardening pad would be solid; beyond it the formula has no meaning
RETRACT_M_PER_S, BRAKE_M_PER_S = 2e-2, 1e-2  # speeds about which a reacting drive reaches the commanded speed, or standstill
CABLE_M_PER_S, CABLE_STRETCH = 1e-2, 0.35  # speed at which a dragging cable's friction is there; share that never turns
RELEASED_M = 1e-4  # a robot this far off, and leaving, does not come back

DRY, SMOOTHED, BY_LOAD = 1.0, 2.0, 3.0  # models of the guide's friction: bristles, smoothed Coulomb, bristles that bear a share of the load
RETRACT, BRAKE = 1.0, 2.0  # what a robot does that has noticed the collision


@dataclass(slots=True)
class Parameters:
    """What the equations of motion need to know of one impact. Zero means that the thing is not there, unless another value stands here."""

    # Robot
    gravity: float = 0.0  # m/s2, along the impact
    impact_speed: float = 0.0  # m/s, of tip and link at first contact
    tip_mass: float = 1.0  # kg
    link_mass: float = 0.0  # kg, behind an elastic joint or loose in a clearance
    link_offset: float = 0.0  # m, of the link against the tip at first contact
    link_speed: float = 0.0  # m/s, likewise
    joint_stiffness: float = 0.0  # N/m
    joint_damping: float = 0.0  # N s/m
    joint_gap: float = 0.0  # m, clearance in which the link is loose
    push: float = 0.0  # N, plateau of the drives' push
    push_rise: float = 1.0  # s
    loop_limit: float = 0.0  # N, at which the position loop saturates
    loop_stiffness: float = 0.0  # N/m
    loop_damping: float = 0.0  # N s/m
    loop_stop: float = 0.0  # s, until which the commanded position goes on at the impact speed
    reaction: float = 0.0  # RETRACT or BRAKE
    reaction_threshold: float = 0.0  # N of contact force
    reaction_delay: float = 0.0  # s
    reaction_ramp: float = 1.0  # s
    reaction_force: float = 0.0  # N
    reaction_speed: float = 0.0  # m/s, at which it retracts
    sway_amplitude: float = 0.0  # m, of the oscillating link, which does not feel the contact
    sway_pulsation: float = 0.0  # rad/s
    sway_phase: float = 0.0  # rad
    sway_decay: float = 0.0  # 1/s
    cable_force: float = 0.0  # N
    cable_length: float = 1.0  # m, over which the cable comes taut
    object_at: float = 0.0  # m, where the robot meets a second object
    object_stiffness: float = 0.0  # N/m
    object_damping: float = 0.0  # s/m, as Hunt and Crossley's
    magnet_force: float = 0.0  # N, at first contact
    magnet_reach: float = 1.0  # m
    # Contact
    pad_stiffness: float = 0.0  # N/m
    pad_damping: float = 0.0  # N s/m
    pad_alpha: float = 0.0  # s/m, Hunt and Crossley's
    pad_lock: float = 0.0  # m, compression at which a hardening pad would be solid
    pad_lock_exponent: float = 1.0
    pad_rate: float = 0.0  # stiffening per e-fold of the rate of compression
    pad_rate_from: float = 1.0  # m/s
    pad_branch_1: float = 0.0  # N/m, Maxwell branches beside the pad's spring
    pad_branch_1_time: float = 1.0  # s
    pad_branch_2: float = 0.0  # N/m
    pad_branch_2_time: float = 1.0  # s
    pad_edge: float = 0.0  # m, compression at which a slanted pad bears with its whole face
    adhesion: float = 0.0  # N, at which the pad comes off
    adhesion_length: float = 1.0  # m, over which it does
    ceiling: float = 0.0  # N, above which the arm gives way like a slipping clutch
    ceiling_damping: float = 1.0  # N s/m of the slip
    contact_damping: float = 0.0  # N s/m from tip to frame, beside pad and springs together
    # Piece
    piece_mass: float = 0.0  # kg
    free_damping: float = 0.0  # N s/m against the frame, while nothing presses on the piece
    ring_damping: float = 0.0  # N s/m against the piece's own mean motion
    ring_time: float = 1.0  # s, of that mean
    # Springs
    body_stiffness: float = 0.0  # N/m
    body_damping: float = 0.0  # N s/m
    body_alpha: float = 0.0  # s/m, Hunt and Crossley's
    stop_at: float = 0.0  # m of stroke
    stop_stiffness: float = 0.0  # N/m
    stop_toe: float = 1.0  # m, over which the stop comes to its stiffness
    stop_damping: float = 0.0  # s/m, as Hunt and Crossley's
    gap: float = 0.0  # m, before all springs bear
    gap_share: float = 1.0  # of the stiffness that bears before
    preload: float = 0.0  # N
    surge_mass: float = 0.0  # kg of the spring's own
    surge_damping: float = 0.0  # as a ratio to critical
    # Guide
    friction: float = 0.0  # DRY, SMOOTHED or BY_LOAD
    friction_force: float = 0.0  # N, while sliding
    friction_static: float = 1.0  # force at rest over that while sliding
    friction_speed: float = 1.0  # m/s, Stribeck's
    friction_load: float = 0.0  # part of the load
    friction_presliding: float = 1e-5  # m
    friction_felt: float = 0.0  # 1 if the cell bears the guide too
    air: float = 0.0  # N s2/m2
    air_time: float = 1.0  # s, in which the air's pressure builds up
    air_felt: float = 0.0  # 1 if the cell feels it
    burr_force: float = 0.0  # N
    burr_at: float = 0.0  # m of stroke
    burr_width: float = 1.0  # m
    # Frame
    frame_mass: float = 0.0  # kg
    frame_stiffness: float = 0.0  # N/m
    frame_damping: float = 0.0  # N s/m
    frame_weight: float = 0.0  # N, of a frame that only stands on its feet
    # What effects add to stiffness (N/m) and damping (N s/m) about the piece, for `light_piece`.
    added_stiffness: float = 0.0
    added_damping: float = 0.0


RECORD = np.dtype([(field.name, np.float64) for field in fields(Parameters)])

# Places in the state.
(LINK, LINK_SPEED, TIP, TIP_SPEED, PIECE, PIECE_SPEED, FRAME, FRAME_SPEED, SURGE, SURGE_SPEED,
 BRISTLE, BRANCH_1, BRANCH_2, AIR, SLIP, PIECE_MEAN, STATES) = range(17)
# Places in what has happened: the pad has touched and not come off since (0 or 1); when the robot begins to react.
STICKS, REACTS, EVENTS = range(3)
NEVER_S = 1e9

# Without numba's runtime (`_nrt`) no references to the state are counted, which would take four fifths of the time.
FAST = {"cache": True, "fastmath": {"contract", "arcp", "nsz", "reassoc"}, "error_model": "numpy"}
compiled = njit(forceinline=True, _nrt=False, **FAST)


@compiled
def contact(p, y, rate, happened):
    """Force of the pad, which is never a pull unless it sticks."""
    squeeze = y[TIP] - y[SLIP] - y[PIECE]
    elastic = 0.0
    if squeeze > 0.0:
        if p.pad_lock > 0.0:
            elastic = p.pad_stiffness * squeeze / (1.0 - min(squeeze / p.pad_lock, MOST_LOCKED)) ** p.pad_lock_exponent
        elif squeeze < p.pad_edge:
            elastic = 0.5 * p.pad_stiffness * squeeze * squeeze / p.pad_edge
        else:
            elastic = p.pad_stiffness * (squeeze - 0.5 * p.pad_edge)
    rate[SLIP] = (elastic - p.ceiling) / p.ceiling_damping if p.ceiling > 0.0 and elastic > p.ceiling else 0.0
    squeezing = y[TIP_SPEED] - rate[SLIP] - y[PIECE_SPEED]
    rate[BRANCH_1] = -y[BRANCH_1] / p.pad_branch_1_time
    rate[BRANCH_2] = -y[BRANCH_2] / p.pad_branch_2_time
    force = 0.0
    if squeeze > 0.0:
        rate[BRANCH_1] += p.pad_branch_1 * squeezing
        rate[BRANCH_2] += p.pad_branch_2 * squeezing
        force = elastic * (1.0 + 1.5 * p.pad_alpha * squeezing)
        if p.pad_rate > 0.0:
            force += elastic * p.pad_rate * math.log(1.0 + abs(squeezing) / p.pad_rate_from)
        force += p.pad_damping * squeezing + y[BRANCH_1] + y[BRANCH_2]
        if force < 0.0 and p.adhesion == 0.0:
            force = 0.0
    elif p.adhesion > 0.0 and happened[STICKS] > 0.5:
        stretch, elastic_stretch = -squeeze, p.adhesion / p.pad_stiffness
        if stretch < elastic_stretch:
            force = -p.pad_stiffness * stretch
        elif stretch < elastic_stretch + p.adhesion_length:
            force = -p.adhesion * (1.0 - (stretch - elastic_stretch) / p.adhesion_length)
    return force


@compiled
def springs(p, y, rate):
    """Force of the springs on the piece and on the cell, which differ if the spring's own mass surges."""
    stroke, speed = y[PIECE] - y[FRAME], y[PIECE_SPEED] - y[FRAME_SPEED]
    if p.surge_mass > 0.0:
        # Half of the spring on either side of its mass: twice the stiffness each.
        upper, lower = 2.0 * p.body_stiffness * (y[PIECE] - y[SURGE]), 2.0 * p.body_stiffness * (y[SURGE] - y[FRAME])
        damping = 2.0 * p.surge_damping * math.sqrt(4.0 * p.body_stiffness * p.surge_mass)
        rate[SURGE] = y[SURGE_SPEED]
        rate[SURGE_SPEED] = (upper - lower - damping * (y[SURGE_SPEED] - 0.5 * (y[PIECE_SPEED] + y[FRAME_SPEED]))) / p.surge_mass
        return upper, lower
    force = p.body_stiffness * stroke
    if p.gap > 0.0:
        force = p.body_stiffness * (p.gap_share * stroke + (1.0 - p.gap_share) * max(0.0, stroke - p.gap))
    if p.body_alpha > 0.0 and stroke > 0.0:
        force *= 1.0 + 1.5 * p.body_alpha * speed
    force += p.body_damping * speed
    into = stroke - p.stop_at
    if p.stop_stiffness > 0.0 and into > 0.0:
        stop = p.stop_stiffness * (0.5 * into * into / p.stop_toe if into < p.stop_toe else into - 0.5 * p.stop_toe)
        force += stop * max(0.0, 1.0 + p.stop_damping * speed)
    return force, force


@compiled
def guide(p, y, rate, load):
    """Friction of the guide, force of the air, and what else acts along the stroke, all against the motion."""
    stroke, speed = y[PIECE] - y[FRAME], y[PIECE_SPEED] - y[FRAME_SPEED]
    friction = 0.0
    if p.friction == BY_LOAD:  # Dahl's bristle
        rate[BRISTLE] = speed - abs(speed) * y[BRISTLE] / p.friction_presliding
        friction = p.friction_load * abs(load) * y[BRISTLE] / p.friction_presliding
    elif p.friction > 0.0:
        level = p.friction_force * (1.0 + (p.friction_static - 1.0) * math.exp(-((speed / p.friction_speed) ** 2)))
        if p.friction == DRY:  # LuGre
            bristle = p.friction_force / p.friction_presliding
            rate[BRISTLE] = speed - bristle * abs(speed) * y[BRISTLE] / level
            friction = bristle * (y[BRISTLE] + BRISTLE_DAMPING_S * rate[BRISTLE])
        else:
            friction = level * math.tanh(speed / COULOMB_M_PER_S)
    air = 0.0
    if p.air > 0.0:
        rate[AIR] = (p.air * speed * abs(speed) - y[AIR]) / p.air_time
        air = y[AIR]
    other = 0.0
    if p.preload > 0.0:
        other += p.preload * math.tanh(stroke / PRELOAD_M)
    if p.burr_force > 0.0:
        other += p.burr_force * math.exp(-(((stroke - p.burr_at) / p.burr_width) ** 2)) * math.tanh(speed / BURR_M_PER_S)
    return friction, air, other


@compiled
def drives(t, p, y, happened):
    """What acts on the tip from the robot's side and its surroundings, without contact, joint and weight."""
    tip, speed, force = y[TIP], y[TIP_SPEED], 0.0
    if p.push > 0.0:
        force += p.push * (1.0 - math.exp(-t / p.push_rise))
    if p.loop_limit > 0.0:
        ahead = p.impact_speed * min(t, p.loop_stop) - tip
        faster = (p.impact_speed if t < p.loop_stop else 0.0) - speed
        force += p.loop_limit * math.tanh((p.loop_stiffness * ahead + p.loop_damping * faster) / p.loop_limit)
    if p.reaction > 0.0 and t > happened[REACTS]:
        ramp = min(1.0, (t - happened[REACTS]) / p.reaction_ramp)
        ramp = ramp * ramp * (3.0 - 2.0 * ramp)
        if p.reaction == RETRACT:
            force -= p.reaction_force * ramp * 0.5 * (1.0 + math.tanh((speed + p.reaction_speed) / RETRACT_M_PER_S))
        else:
            force -= p.reaction_force * ramp * math.tanh(speed / BRAKE_M_PER_S)
    if p.sway_amplitude > 0.0:
        swing = math.exp(-p.sway_decay * t) * math.sin(p.sway_pulsation * t + p.sway_phase)
        force += p.tip_mass * p.sway_amplitude * p.sway_pulsation**2 * swing
    if p.cable_force > 0.0:
        taut = 1.0 - math.exp(-max(0.0, tip) / p.cable_length)
        force -= p.cable_force * taut * (CABLE_STRETCH + (1.0 - CABLE_STRETCH) * math.tanh(speed / CABLE_M_PER_S))
    if p.object_stiffness > 0.0 and tip > p.object_at:
        force -= p.object_stiffness * (tip - p.object_at) * max(0.0, 1.0 + p.object_damping * speed)
    if p.magnet_force > 0.0:
        force += p.magnet_force / (1.0 + abs(tip) / p.magnet_reach) ** 2
    return force


@compiled
def joint(p, y):
    """Force of the link on the tip: through an elastic joint, or at either end of a clearance."""
    offset, speed = y[LINK] - y[TIP], y[LINK_SPEED] - y[TIP_SPEED]
    if p.joint_gap == 0.0:
        return p.joint_stiffness * offset + p.joint_damping * speed
    if offset > 0.5 * p.joint_gap:
        return max(0.0, p.joint_stiffness * (offset - 0.5 * p.joint_gap) + p.joint_damping * speed)
    if offset < -0.5 * p.joint_gap:
        return min(0.0, p.joint_stiffness * (offset + 0.5 * p.joint_gap) + p.joint_damping * speed)
    return 0.0


@compiled
def rates(t, y, p, happened, rate):
    """The state's rates of change. Returns what the cell feels and the force between tip and pad."""
    pad = contact(p, y, rate, happened)
    across = 0.0
    if p.contact_damping > 0.0 and y[TIP] - y[SLIP] > y[PIECE]:
        across = max(-max(pad, 0.0), p.contact_damping * (y[TIP_SPEED] - y[FRAME_SPEED]))
    body, cell = springs(p, y, rate)
    friction, air, other = guide(p, y, rate, body)
    speed = y[PIECE_SPEED] - y[FRAME_SPEED]
    rate[PIECE_MEAN] = (speed - y[PIECE_MEAN]) / p.ring_time
    beside = friction + air + other + p.ring_damping * (speed - y[PIECE_MEAN])
    if pad <= 0.0:
        beside += p.free_damping * speed
    rate[PIECE] = y[PIECE_SPEED]
    rate[PIECE_SPEED] = (pad - body - beside) / p.piece_mass
    if p.frame_mass > 0.0:
        held = p.frame_stiffness * y[FRAME] + p.frame_damping * y[FRAME_SPEED]
        if p.frame_weight > 0.0 and y[FRAME] > 0.0:
            held += p.frame_weight * min(1.0, y[FRAME] / LIFT_M)
        elif p.frame_weight > 0.0:
            held = p.frame_weight * y[FRAME] / LIFT_M + FEET_DAMPING * p.frame_damping * y[FRAME_SPEED]
        rate[FRAME] = y[FRAME_SPEED]
        rate[FRAME_SPEED] = (cell + beside + across - held) / p.frame_mass
    force = drives(t, p, y, happened) - pad - across + p.gravity * p.tip_mass
    if p.link_mass > 0.0:
        through = joint(p, y)
        force += through
        rate[LINK] = y[LINK_SPEED]
        rate[LINK_SPEED] = p.gravity - through / p.link_mass
    rate[TIP] = y[TIP_SPEED]
    rate[TIP_SPEED] = force / p.tip_mass
    return cell + across + p.friction_felt * friction + p.air_felt * air, pad + across


@njit(**FAST)
def integrate(p, start, step, cell):
    """Fills `cell` with what the cell feels at every step from first contact on. Returns the last state."""
    y, happened, middle = start.copy(), np.array([0.0, NEVER_S]), np.zeros(STATES)
    k1, k2, k3, k4 = np.zeros(STATES), np.zeros(STATES), np.zeros(STATES), np.zeros(STATES)
    leaves = (p.gravity == 0.0 and p.push == 0.0 and p.loop_limit == 0.0 and p.magnet_force == 0.0 and p.sway_amplitude == 0.0
              and p.link_mass == 0.0 and p.reaction == 0.0)  # for good, once it is off
    for i in range(len(cell)):
        t = i * step
        cell[i], force = rates(t, y, p, happened, k1)
        squeeze = y[TIP] - y[SLIP] - y[PIECE]
        if squeeze > 0.0:
            happened[STICKS] = 1.0
        elif p.adhesion > 0.0 and -squeeze > p.adhesion / p.pad_stiffness + p.adhesion_length:
            happened[STICKS] = 0.0
        if p.reaction > 0.0 and happened[REACTS] == NEVER_S and force > p.reaction_threshold:
            happened[REACTS] = t + p.reaction_delay
        # Nothing moves any more that the cell could feel: below a micronewton.
        if (leaves and squeeze < -RELEASED_M and y[TIP_SPEED] < 0.0 and abs(cell[i]) < 1e-6 and abs(y[PIECE_SPEED]) < 1e-7
                and abs(y[FRAME_SPEED]) < 1e-8):
            cell[i + 1 :] = 0.0
            break
        for j in range(STATES):
            middle[j] = y[j] + 0.5 * step * k1[j]
        rates(t + 0.5 * step, middle, p, happened, k2)
        for j in range(STATES):
            middle[j] = y[j] + 0.5 * step * k2[j]
        rates(t + 0.5 * step, middle, p, happened, k3)
        for j in range(STATES):
            middle[j] = y[j] + step * k3[j]
        rates(t + step, middle, p, happened, k4)
        for j in range(STATES):
            y[j] += step / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j])
    return y


def light_piece(p: Parameters) -> None:
    """Gives a piece without inertia of its own the least mass that can be integrated, damped so that only its ringing loses energy.

    Its damper works against the mean motion over 2 / omega, where omega is the piece's own pulsation; while nothing presses on the piece,
    a critical damper brings it to rest.
    """
    stiffness = p.body_stiffness + p.pad_stiffness + p.added_stiffness
    least = max(stiffness / LIGHT_PIECE_RAD_PER_S**2, p.added_damping * STEP_S / MOST_DAMPING)
    if p.piece_mass > 0.0:
        p.piece_mass = max(p.piece_mass, least)
        return
    p.piece_mass = least
    p.free_damping = 2.0 * math.sqrt(p.body_stiffness * least)
    p.ring_damping, p.ring_time = math.sqrt(stiffness * least), 2.0 * math.sqrt(least / stiffness)


def felt(p: Parameters, steps: int, step: float = STEP_S) -> np.ndarray:
    """What the cell feels at `steps` instants from first contact on. A piece without inertia starts as fast as a massless one would."""
    start = np.zeros(STATES)
    start[TIP_SPEED], start[LINK], start[LINK_SPEED] = p.impact_speed, p.link_offset, p.impact_speed + p.link_speed
    if p.piece_mass == 0.0:
        start[PIECE_SPEED] = start[PIECE_MEAN] = p.impact_speed * p.pad_stiffness / (p.pad_stiffness + p.body_stiffness)
    start[SURGE_SPEED] = 0.5 * start[PIECE_SPEED]
    light_piece(p)
    cell = np.zeros(steps)
    integrate(np.array(astuple(p), dtype=RECORD)[()], start, step, cell)
    return cell


@njit(cache=True)
def baseline(times, stiffness, mass, speed, contact_at, gravity):
    """What the standard implies, in closed form: a mass meets a spring, and comes back for as long as gravity makes it."""
    pulsation = math.sqrt(stiffness / mass)
    sag = gravity / pulsation**2  # m, at which the spring bears the weight
    phase = math.atan2(sag * pulsation, speed)
    amplitude = math.sqrt((speed / pulsation) ** 2 + sag**2)
    lasts = (math.pi + 2.0 * phase) / pulsation
    period = lasts + (2.0 * speed / gravity if gravity > 0.0 else NEVER_S)
    force = np.zeros(len(times))
    for i in range(len(times)):
        since = times[i] - contact_at
        if since > 0.0:
            since -= math.floor(since / period) * period
            if since < lasts:
                force[i] = stiffness * (amplitude * math.sin(pulsation * since - phase) + sag)
    return force
