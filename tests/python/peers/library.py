"""Terms that PySINDy may choose from, each with the mechanism that it stands for.

The table was fixed before any score was looked at. It is generous: nobody who did not know the list of mechanisms would offer terms
such as the memory of a relaxing pad or the kink of an end stop. What no term stands for (lost samples, a speed's error apart from a
gain's) PySINDy cannot name.
"""

from dataclasses import dataclass

import numpy as np

# Where a kink may be, as part of the largest stroke or force.
KINKS = (0.5, 0.7, 0.8, 0.9)
# Memories of a relaxing pad, s.
MEMORIES_S = (0.005, 0.02, 0.1)
# When a reaction may begin, as part of the contact.
REACTIONS = (0.3, 0.6)


@dataclass(frozen=True)
class Motion:
    """One recording's motion, from the instant of contact."""

    time_s: np.ndarray
    stroke_m: np.ndarray
    velocity_m_per_s: np.ndarray
    force_N: np.ndarray
    order: int
    configuration: int


@dataclass(frozen=True)
class Term:
    name: str
    # What it stands for where its coefficient is positive, and where it is negative; the first is the name, others cannot be told from it.
    positive: tuple[str, ...]
    negative: tuple[str, ...]


def both(*ids: str):
    return ids, ids


def integral(values, time_s):
    steps = np.diff(time_s, prepend=time_s[0])
    return np.cumsum(values * steps)


def fading(values, time_s, memory_s):
    """Convolution with exp(-t / memory)."""
    steps = np.diff(time_s, prepend=time_s[0])
    out = np.zeros_like(values)
    for i in range(1, len(values)):
        out[i] = out[i - 1] * np.exp(-steps[i] / memory_s) + values[i] * steps[i]
    return out


def line_of(frequency_Hz):
    """What a line of the residual stands for, by its frequency (ranges of the list)."""
    if frequency_Hz < 8:
        return ("link-oscillation",)
    if frequency_Hz < 35:
        return ("joint-elasticity",)
    if frequency_Hz < 170:
        return ("frame-compliance",)
    return ("moving-piece-inertia",)


def terms(motions, reach_m, line_Hz):
    """Names of the terms, and for each recording a matrix with a column for each."""
    configurations = sorted({m.configuration for m in motions})
    slowest = 0.05 * max(np.max(np.abs(m.velocity_m_per_s)) for m in motions)
    contact_s = np.median([m.time_s[m.stroke_m > 0][-1] if np.any(m.stroke_m > 0) else 0.1 for m in motions])
    named = [
        Term("x", *both("gain-error", "speed-error")),
        Term("x²", *both("hardening")),
        Term("x³", *both("hardening")),
        Term("v", *both("viscous-damping")),
        Term("x v", *both("hunt-crossley-damping")),
        Term("v|v|", *both("air-damping")),
        Term("sign v", *both("guide-friction")),
        Term("x sign v", *both("load-dependent-friction")),
        Term("sign v, slow", *both("stiction")),
        Term("x ln|v|", *both("rate-stiffening")),
        Term("x exp(-order/3)", *both("mullins-softening")),
        Term("first 0.1 mm", *both("clearance")),
        Term("first 0.3 mm", *both("clearance")),
        Term("after separation", *both("adhesion")),
        Term("acceleration", *both("moving-piece-inertia")),
        Term("∫F dt", *both("piezo-discharge")),
        Term("dF/dt", *both("filter-lag")),
        Term("t", *both("charge-drift")),
        Term("t in contact", *both("robot-push")),
        Term("50 Hz, cos", *both("mains-hum")),
        Term("50 Hz, sin", *both("mains-hum")),
        Term("60 Hz, cos", *both("mains-hum")),
        Term("60 Hz, sin", *both("mains-hum")),
        Term("line, cos", *both(*line_of(line_Hz))),
        Term("line, sin", *both(*line_of(line_Hz))),
    ]
    named += [Term(f"x beyond {k}", ("end-stop", "hardening"), ("force-ceiling", "clipping")) for k in KINKS]
    named += [Term(f"∫v exp(-t/{m})", *both("pad-relaxation")) for m in MEMORIES_S]
    named += [Term(f"t beyond {r} of the contact", *both("collision-reaction")) for r in REACTIONS]
    named += [Term(f"x in configuration {c}", *both("pose-dependent-mass")) for c in configurations[1:]]

    def matrix(m):
        x, v, t, force = np.maximum(m.stroke_m, 0.0), m.velocity_m_per_s, m.time_s, m.force_N
        touching = (m.stroke_m > 0) & (t >= 0)
        v = np.where(touching, v, 0.0)
        ended = t[touching][-1] if np.any(touching) else 0.0
        since = np.maximum(t, 0.0)
        columns = [
            x, x**2, x**3, v, x * v, v * np.abs(v),
            np.sign(v), x * np.sign(v), np.sign(v) * (np.abs(v) < slowest),
            x * np.log(np.maximum(np.abs(v), slowest) / slowest),
            x * np.exp(-m.order / 3.0),
            np.minimum(x, 1e-4), np.minimum(x, 3e-4),
            ((t > ended) & (t < ended + 0.005)).astype(float),
            np.gradient(v, t) * touching,
            integral(force, since),
            np.gradient(force, t),
            t, t * touching,
            np.cos(2 * np.pi * 50 * t), np.sin(2 * np.pi * 50 * t),
            np.cos(2 * np.pi * 60 * t), np.sin(2 * np.pi * 60 * t),
            np.cos(2 * np.pi * line_Hz * t) * (t > 0), np.sin(2 * np.pi * line_Hz * t) * (t > 0),
        ]
        columns += [np.maximum(x - k * reach_m, 0.0) for k in KINKS]
        columns += [fading(v, t, memory) for memory in MEMORIES_S]
        columns += [np.maximum(t - r * contact_s, 0.0) for r in REACTIONS]
        columns += [x * (m.configuration == c) for c in configurations[1:]]
        return np.column_stack(columns)

    return named, [matrix(m) for m in motions]


def terms_of_a_fall(motions):
    """In free flight: acceleration less gravity."""
    named = [Term("v", *both("air-drag")), Term("v|v|", *both("air-drag")), Term("1", *both())]
    return named, [np.column_stack([m.velocity_m_per_s, m.velocity_m_per_s * np.abs(m.velocity_m_per_s), np.ones_like(m.time_s)])
                   for m in motions]
