"""Strength: d, the norm of what the best re-tuned baseline leaves of an effect, in units of the noise; and the size of a wanted strength.

Re-tuned are the stiffnesses and a mass for each configuration, and for each recording its speed, contact instant, spring and offset: all
that the experimenter believes, each within its stated uncertainty, which pulls it back as an observation of its own would.
"""

import math
from dataclasses import dataclass

import numpy as np

from effects import Effect
from mechanics import baseline
from rig import REPEATABILITY, Recording, Rig

# Contact instant (s) and offset (N) are not stated: these standard deviations are far beyond what can be.
INSTANT_SD, OFFSET_SD = 2e-2, 100.0
RELATIVE_STEP, INSTANT_STEP_S = 1e-5, 1e-6  # of the differences by which the baseline is linearised
LONGEST_STEP = 0.3  # of a logarithm in one iteration: further off the linearisation says nothing


class Layout:
    """Where the re-tuned quantities stand: body, pad if there is one, masses; then speed, instant, spring, offset of each recording.

    All are deviations from the true values, logarithms except for instants (s) and offsets (N).
    """

    def __init__(self, rig: Rig):
        self.masses = 1 + rig.has_pad
        self.recordings = self.masses + len(rig.masses)
        self.count = self.recordings + 4 * len(rig.recordings)
        common = [rig.body_sd, *([rig.pad_sd] if rig.has_pad else []), *[rig.mass_sd] * len(rig.masses)]
        self.sd = np.array(common + [rig.speed_sd, INSTANT_SD, REPEATABILITY, OFFSET_SD] * len(rig.recordings))
        self.offsets = slice(self.recordings + 3, None, 4)

    def of(self, recording: Recording) -> list[int]:
        """Places of what bears on a recording: stiffnesses, its mass, its own four."""
        first = self.recordings + 4 * recording.number
        return [*range(self.masses), self.masses + recording.configuration, *range(first, first + 4)]


@dataclass
class Retuned:
    strength: float  # norm of residuals and pulls together
    residual_only: float
    deviations: np.ndarray  # as the layout has them
    residuals: list[np.ndarray]  # whitened


def simulated(rig: Rig, recording: Recording, own: np.ndarray) -> tuple[np.ndarray, tuple]:
    """The baseline of a recording with deviations `own`, and what it was computed of."""
    *stiffnesses, mass, speed, instant, spring, offset = own
    body = recording.spring * math.exp(stiffnesses[0] + spring)
    stiffness = rig.in_series(body, math.exp(stiffnesses[1]) if rig.has_pad else 1.0)
    of = (stiffness, recording.mass * math.exp(mass), recording.speed * math.exp(speed), recording.contact_at + instant)
    return baseline(recording.times, *of, rig.gravity) + offset, of


def tangent(rig: Rig, recording: Recording, own: np.ndarray) -> np.ndarray:
    """Whitened derivatives of a recording's baseline, by central differences, in the order of `Layout.of`."""
    _, of = simulated(rig, recording, own)
    columns = []
    for place, value in enumerate(of):
        step = INSTANT_STEP_S if place == 3 else RELATIVE_STEP * value
        either = [baseline(recording.times, *of[:place], value + way * step, *of[place + 1 :], rig.gravity) for way in (1, -1)]
        columns.append((either[0] - either[1]) / (2 * (step if place == 3 else RELATIVE_STEP)))
    by_stiffness, by_mass, by_speed, by_instant = columns
    in_body = of[0] / (rig.body * recording.spring * math.exp(own[0] + own[-2])) if rig.has_pad else 1.0  # share of the compliance
    stiffnesses = [in_body * by_stiffness, (1 - in_body) * by_stiffness] if rig.has_pad else [by_stiffness]
    all_columns = [*stiffnesses, by_mass, by_speed, by_instant, in_body * by_stiffness, np.ones(len(recording.times))]
    return np.column_stack([rig.whitened(column) for column in all_columns])


def retune(rig: Rig, readings: list[np.ndarray], loosened: float = 1.0, centre: np.ndarray | None = None) -> Retuned:
    """Fits the baseline to readings, by Levenberg and Marquardt's method.

    `loosened` widens the stated uncertainties; `centre` is what is stated, as deviations from the truth, if it is not the truth itself.
    """
    layout = Layout(rig)
    sd = layout.sd * loosened
    centre = np.zeros(layout.count) if centre is None else centre

    def at(deviations):
        residuals = [rig.whitened(readings[recording.number] - simulated(rig, recording, deviations[layout.of(recording)])[0])
                     for recording in rig.recordings]
        return residuals, sum(float(r @ r) for r in residuals) + float(np.sum(((deviations - centre) / sd) ** 2))

    deviations = np.zeros(layout.count)
    residuals, squares = at(deviations)
    damping = 1e-4
    for _ in range(9):
        matrix, right = np.diag(1 / sd**2), -(deviations - centre) / sd**2
        for recording in rig.recordings:
            places = layout.of(recording)
            jacobian = tangent(rig, recording, deviations[places])
            matrix[np.ix_(places, places)] += jacobian.T @ jacobian
            right[places] += jacobian.T @ residuals[recording.number]
        settled = True
        for _ in range(6):
            step = np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), right)
            tried = deviations + np.clip(step, -LONGEST_STEP, LONGEST_STEP)
            tried[layout.offsets] = (deviations + step)[layout.offsets]
            tried_residuals, tried_squares = at(tried)
            if tried_squares <= squares:
                settled = squares - tried_squares < min(1e-3 * max(1.0, squares), 0.3)
                deviations, residuals, squares = tried, tried_residuals, tried_squares
                damping = max(damping / 10, 1e-9)
                break
            damping *= 10
        if settled:
            break
    alone = sum(float(r @ r) for r in residuals)
    return Retuned(math.sqrt(max(squares, 0.0)), math.sqrt(alone), deviations, residuals)


def strength(rig: Rig, readings: list[np.ndarray], plain: list[np.ndarray]) -> Retuned:
    """Of effects, from noise-free readings with and without them."""
    ideal = [baseline(r.times, rig.in_series(r.spring), r.mass, r.speed, r.contact_at, rig.gravity) for r in rig.recordings]
    return retune(rig, [one + reading - without for one, reading, without in zip(ideal, readings, plain)])


@dataclass
class Sized:
    """An effect at the size that has the wanted strength when it is alone."""

    effect: Effect
    size: float
    strength: float
    residual_only: float
    shows_in: list[int]  # recordings that it changes by more than one standard deviation of their noise altogether


def size_for(rig: Rig, effect: Effect, wanted: float, plain: list[np.ndarray]) -> Sized | None:
    """Looks for the size at which the effect alone has the strength `wanted`, to an eighth; the nearest that ten tries come to."""
    best, tried, forces = None, [], {}
    low, high = effect.low, effect.high  # the wanted size is between them
    low_known = high_known = False
    size = effect.start
    for _ in range(10):
        size = min(max(size, effect.low), effect.high)
        if effect.whole:
            size = float(max(1, round(size)))
        try:
            readings = rig.kept([(effect, size)], forces)
            found = strength(rig, readings, plain)
        except (FloatingPointError, np.linalg.LinAlgError):
            found = None
        if found is None or not math.isfinite(found.strength):
            high, high_known = size, True
            size = math.sqrt(size * low)
            continue
        reached = max(found.strength, 1e-3)
        tried.append((size, reached))
        if best is None or abs(math.log(reached / wanted)) < abs(math.log(best.strength / wanted)):
            shows = [r.number for r in rig.recordings if np.linalg.norm(rig.whitened(readings[r.number] - plain[r.number])) > 1.0]
            best = Sized(effect, size, reached, found.residual_only, shows)
        if abs(reached / wanted - 1) < 0.12:
            break
        if reached < wanted:
            low, low_known = size, True
        else:
            high, high_known = size, True
        if (reached < wanted and size >= effect.high * 0.999) or (reached > wanted and size <= effect.low * 1.001):
            break
        power = 1.0  # strength grows like this power of the size, as far as the last two tries tell
        if len(tried) > 1:
            (size_a, reached_a), (size_b, reached_b) = tried[-2:]
            if size_a != size_b and reached_a != reached_b:
                power = min(max(math.log(reached_a / reached_b) / math.log(size_a / size_b), 0.25), 4.0)
        size *= min(max((wanted / reached) ** (1 / power), 0.03), 30.0)
        if low_known and high_known and not low * 1.001 < size < high * 0.999:
            size = math.sqrt(low * high)
        size = min(max(size, low), high)
        if effect.whole and len(tried) > 1 and round(size) == round(tried[-1][0]):
            break
    return best
