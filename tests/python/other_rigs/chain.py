"""The measuring chain: from the force on the cell at every step of the integration to the samples of a recording."""

import math
from dataclasses import dataclass, field

import numpy as np
from numba import njit

from mechanics import STEP_S

# Damping ratios of Butterworth sections: the one of a second order, the two of a fourth.
SECOND, FOURTH_A, FOURTH_B = math.sqrt(0.5), math.cos(math.pi / 8), math.sin(math.pi / 8)

LEFT_OUT, REPEATED = "left out, later ones move up", "last value repeated"


@dataclass(slots=True)
class Chain:
    """What the chain does to a recording. Zero means that the thing is not there, unless another value stands here."""

    discharge: float = 0.0  # 1/s, over the chain's time constant
    creep: float = 0.0  # of the force
    creep_time: float = 1.0  # s
    cutoff: float = 0.0  # rad/s of a causal low pass
    order: int = 2  # 1, or Butterworth's 2 or 4
    pickup: float = 0.0  # s: newtons read per newton/second
    gain: float = 1.0
    drift: float = 0.0  # N/s
    drift_time: float = 0.0  # s in which the drift comes to rest; 0 for one that does not
    hum: list = field(default_factory=list)  # (frequency in Hz, amplitude in N, phase in rad) of each line
    clip: float = math.inf  # N
    lost: list = field(default_factory=list)  # (LEFT_OUT or REPEATED, first sample, how many)


@njit(cache=True)
def electronics(force, step, discharge, creep, creep_time, cutoff, order):
    """Creep of the cell, discharge, low pass, one after the other at every step; semi-implicit, cutoffs being far below 1 / step."""
    passed = np.empty(len(force))
    crept = charge = first = first_rate = second = second_rate = 0.0
    ratio = SECOND if order == 2 else FOURTH_A
    for i in range(len(force)):
        value = force[i]
        if creep != 0.0:
            crept += step * (creep * value - crept) / creep_time
            value += crept
        if discharge != 0.0:
            value -= charge
            charge += step * value * discharge
        if cutoff > 0.0 and order == 1:
            first += step * cutoff * (value - first)
            value = first
        elif cutoff > 0.0:
            first_rate += step * (cutoff * cutoff * (value - first) - 2.0 * ratio * cutoff * first_rate)
            first += step * first_rate
            value = first
            if order == 4:
                second_rate += step * (cutoff * cutoff * (value - second) - 2.0 * FOURTH_B * cutoff * second_rate)
                second += step * second_rate
                value = second
        passed[i] = value
    return passed


@njit(cache=True)
def converted(force, step, times, contact_at, aperture):
    """The converter's samples: means over [t - aperture, t] of a force that begins at `contact_at` and is straight between steps."""
    integral = np.zeros(len(force))
    for i in range(1, len(force)):
        integral[i] = integral[i - 1] + 0.5 * step * (force[i - 1] + force[i])
    samples = np.empty(len(times))
    for j in range(len(times)):
        total = 0.0
        for sign, until in ((1.0, times[j]), (-1.0, times[j] - aperture)):
            place = (until - contact_at) / step
            if place > 0.0:
                i = min(int(place), len(force) - 2)
                part = place - i
                total += sign * (integral[i] + step * (part * force[i] + 0.5 * part * part * (force[i + 1] - force[i])))
        samples[j] = total / aperture
    return samples


def read(chain: Chain, force: np.ndarray, times: np.ndarray, contact_at: float, aperture: float) -> np.ndarray:
    """What is read at `times` of a force from first contact on, before noise, clipping and lost samples."""
    if chain.discharge or chain.creep or chain.cutoff:
        force = electronics(force, STEP_S, chain.discharge, chain.creep, chain.creep_time, chain.cutoff, chain.order)
    if chain.pickup:
        force = force + chain.pickup * np.gradient(force, STEP_S)
    reading = chain.gain * converted(force, STEP_S, times, contact_at, aperture)
    if chain.drift_time:
        reading += chain.drift * chain.drift_time * (1 - np.exp(-times / chain.drift_time))
    else:
        reading += chain.drift * times
    for frequency, amplitude, phase in chain.hum:
        reading += amplitude * np.sin(2 * math.pi * frequency * times + phase)
    return reading


def kept(chain: Chain, reading: np.ndarray) -> np.ndarray:
    """What clipping and losses leave of a reading, noise and offset included; its length stays, the end being filled up."""
    reading = np.minimum(reading, chain.clip)
    for how, first, count in chain.lost:
        if how == LEFT_OUT:
            reading[first:-count] = reading[first + count :].copy()
            reading[-count:] = reading[-1]
        else:
            reading[first : first + count] = reading[first - 1]
    return reading
