"""A rig as it is drawn: its true values, what is stated of them and with which spread, and the recordings that are made on it."""

import math
from dataclasses import dataclass, field

import numpy as np

import chain
import mechanics
from chain import Chain
from mechanics import STEP_S, Parameters

STANDARD_GRAVITY = 9.81  # m/s2
# N/m, of ISO/TS 15066's body regions; the chest's, at which most is measured, twice.
BODIES = (10e3, 25e3, 25e3, 30e3, 35e3, 40e3, 50e3, 60e3, 75e3, 150e3)
# Hz, of common loggers, the middle ones more often.
RATES, RATE_SHARES = (2e3, 5e3, 8e3, 1e4, 12.8e3, 2e4, 5e4), (0.05, 0.16, 0.1, 0.35, 0.15, 0.14, 0.05)
RANGES_N = (100.0, 222.4, 500.0, 1000.0, 2224.0, 4448.0)  # full scales of piezoelectric cells, 50 to 1000 pound-force among them
REPEATABILITY = 0.002  # of the springs, as the contract's default
# Without a pad the contact is this many times as stiff as the body spring, which is made stiffer by as much as the two lose in series.
HARD_CONTACT = 20.0
# A force beyond this many times the baseline's largest peak is no simulation but a failure of one.
ABSURD = 50.0


def log_uniform(draw: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(draw.uniform(math.log(low), math.log(high))))


def rounded(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


@dataclass
class Wishes:
    """What the effects to be hidden need of a rig."""

    pad: bool = False  # they act in the pad
    robot: bool = False  # a falling mass cannot have them
    well_known: bool = False  # they show against the stated uncertainties only, which have to be small
    loud: bool = False  # they are too strong for a quiet channel


@dataclass
class Recording:
    """One impact: what is true of it. Errors of effects that vary from impact to impact come from `phases` and `variations`."""

    number: int  # place in time, from 0
    configuration: int
    stated_speed: float  # m/s
    speed: float  # m/s
    mass: float  # kg
    spring: float  # body spring's factor in this impact
    offset: float  # N
    contact_at: float  # s
    lasts: float  # s, contact of the baseline
    peak: float  # N, of the baseline
    times: np.ndarray  # s
    phases: np.ndarray  # rad, six of them
    variations: np.ndarray  # four of a standard normal distribution


@dataclass
class Scene:
    """Mechanics and chain of one recording, whose parameters effects change by name."""

    mechanics: Parameters
    chain: Chain = field(default_factory=Chain)

    def _change(self, change, values: dict) -> "Scene":
        for name, value in values.items():
            part = self.mechanics if hasattr(self.mechanics, name) else self.chain
            setattr(part, name, change(getattr(part, name), value))
        return self

    def sets(self, **values) -> "Scene":
        return self._change(lambda old, new: new, values)

    def adds(self, **values) -> "Scene":
        return self._change(lambda old, more: old + more, values)

    def scales(self, **values) -> "Scene":
        return self._change(lambda old, factor: old * factor, values)


class Rig:
    def __init__(self, draw: np.random.Generator, wishes: Wishes):
        self.draw = draw
        self.drops = bool(draw.random() < 0.18) and not wishes.robot  # about one rig in six
        self.gravity = STANDARD_GRAVITY if self.drops else 0.0
        self.has_pad = bool(draw.random() < 0.78) or wishes.pad
        self.stated_body = float(draw.choice(BODIES))
        self.stated_pad = log_uniform(draw, 20e3, 300e3)  # N/m, PU A30 to A70
        if wishes.pad:  # a pad much stiffer than the body would do nothing
            self.stated_pad = min(self.stated_pad, log_uniform(draw, 1, 3) * self.stated_body)
        self.stated_pad = rounded(self.stated_pad, 2)
        # One standard deviation each, relative: calibrated springs to those off a data sheet, pads by their hardness, a robot's mass by its
        # model, speed by a light barrier.
        self.body_sd, self.pad_sd = float(draw.uniform(0.01, 0.05)), float(draw.uniform(0.05, 0.25))
        self.mass_sd, self.speed_sd = float(draw.uniform(0.01, 0.03)), float(draw.uniform(0.005, 0.015))
        if wishes.well_known:
            self.body_sd, self.pad_sd = float(draw.uniform(0.005, 0.015)), float(draw.uniform(0.02, 0.06))
            self.mass_sd, self.speed_sd = float(draw.uniform(0.004, 0.012)), float(draw.uniform(0.003, 0.008))
        configurations = int(draw.integers(2, 5))
        lightest = log_uniform(draw, 2, 7 if self.drops else 9)  # kg
        span = log_uniform(draw, 1.3, min(4.0, 19.9 / lightest))  # heaviest over lightest; 20 kg is the most a cobot weighs at its tip
        self.stated_masses = [rounded(lightest * span ** (i / (configurations - 1)), 3) for i in range(configurations)]
        if draw.random() < 0.3:
            draw.shuffle(self.stated_masses)
        each = {2: 6, 3: 4, 4: 3}[configurations] + int(draw.integers(0, 2))  # about 12 recordings altogether
        fastest = float(draw.uniform(0.25, 0.6))  # m/s
        speeds = np.round(np.linspace(max(0.1, fastest / float(draw.uniform(2, 5))), fastest, each), 3)
        self.rate = float(draw.choice(RATES, p=RATE_SHARES))
        self.noise = log_uniform(draw, 0.25 if wishes.loud else 0.05, 0.5)  # N, root mean square
        self.colour = float(draw.choice([0.0, draw.uniform(0.03, 0.35)]))  # correlation of a sample's noise with that of the one before
        self.body = self.stated_body * (1 + self.body_sd * draw.normal())
        self.pad = self.stated_pad * max(0.4, 1 + self.pad_sd * draw.normal()) if self.has_pad else HARD_CONTACT * self.body
        self.masses = [mass * (1 + self.mass_sd * draw.normal()) for mass in self.stated_masses]
        order = int(draw.integers(0, 3))  # speeds rising, speeds mixed, everything mixed
        plan = [(c, float(speed)) for c in range(configurations) for speed in (draw.permutation(speeds) if order else speeds)]
        if order == 2:
            plan = [plan[i] for i in draw.permutation(len(plan))]
        self.aperture = float(draw.uniform(0.1, 1.0)) / self.rate  # s, over which the converter averages
        self.recordings = [self._recording(number, *planned) for number, planned in enumerate(plan)]
        self.peak = max(recording.peak for recording in self.recordings)  # N
        self.fastest = max(recording.speed for recording in self.recordings)
        self.middle_speed = math.exp(np.mean([math.log(recording.speed) for recording in self.recordings]))
        self.stroke, self.squeeze = self.peak / self.body, self.peak / self.pad  # m, the largest of springs and pad
        self.full_scale = min(full for full in RANGES_N if full > 1.35 * self.peak)
        # Codes finer than a third of the noise, so that rounding is no effect of its own.
        bits = next(bits for bits in (16, 18, 20, 24) if 2 * self.full_scale / 2**bits < 0.3 * self.noise)
        self.code = 2 * self.full_scale / 2 ** max(bits, int(draw.choice([16, 16, 24])))  # N

    def _recording(self, number: int, configuration: int, stated_speed: float) -> Recording:
        draw = self.draw
        speed = stated_speed * (1 + self.speed_sd * draw.normal())
        mass, spring = self.masses[configuration], 1 + REPEATABILITY * draw.normal()
        offset, contact_at = float(draw.normal(0, 0.3)), float(draw.uniform(0.05, 0.2))
        stiffness = self.in_series(spring)
        pulsation = math.sqrt(stiffness / mass)
        lasts = (math.pi + 2 * math.atan2(self.gravity / pulsation, speed)) / pulsation
        after = float(draw.uniform(0.03, 0.15))
        if draw.random() < 0.1:  # cut short
            after = -lasts * float(draw.uniform(0.05, 0.4))
        times = np.arange(int((contact_at + lasts + after) * self.rate)) / self.rate
        peak = stiffness * math.hypot(speed / pulsation, self.gravity / pulsation**2) + self.gravity * mass
        return Recording(number, configuration, stated_speed, speed, mass, spring, offset, contact_at, lasts, peak, times,
                         draw.uniform(0, 2 * math.pi, 6), draw.normal(size=4))

    def in_series(self, body_factor: float = 1.0, pad_factor: float = 1.0) -> float:
        """Stiffness of body spring and pad together, N/m."""
        body = self.body * body_factor
        return 1 / (1 / body + 1 / (self.pad * pad_factor)) if self.has_pad else body

    def plain(self, recording: Recording) -> Scene:
        """A recording with nothing in it."""
        body, pad = self.body * recording.spring, self.pad
        if not self.has_pad:
            body, pad = body / (1 - 1 / HARD_CONTACT), HARD_CONTACT * body
        return Scene(Parameters(gravity=self.gravity, impact_speed=recording.speed, tip_mass=recording.mass, body_stiffness=body,
                                pad_stiffness=pad))

    def force(self, recording: Recording, scene: Scene) -> np.ndarray:
        """What the cell feels at every step from first contact until after the last sample."""
        steps = int((recording.times[-1] - recording.contact_at + 2 / self.rate) / STEP_S) + 3
        force = mechanics.felt(scene.mechanics, steps)
        if not np.all(np.isfinite(force)) or np.max(np.abs(force)) > ABSURD * self.peak:
            raise FloatingPointError("the motion could not be integrated")
        return force

    def read(self, effects: list, forces: dict | None = None) -> tuple[list[Scene], list[np.ndarray]]:
        """Scenes and noise-free readings with `effects`, pairs of an effect and its size; before clipping and losses.

        `forces` keeps what the cell feels of the plain rig, for effects of the chain alone.
        """
        scenes, readings = [], []
        moving = any(not effect.chain_only for effect, _ in effects)
        for recording in self.recordings:
            scene = self.plain(recording)
            for effect, size in effects:
                if effect.only is None or recording.number in effect.only:
                    effect.put(scene, recording, size)
            force = None if moving or forces is None else forces.get(recording.number)
            if force is None:
                force = self.force(recording, scene)
                if not moving and forces is not None:
                    forces[recording.number] = force
            scenes.append(scene)
            readings.append(chain.read(scene.chain, force, recording.times, recording.contact_at, self.aperture))
        return scenes, readings

    def kept(self, effects: list, forces: dict | None = None) -> list[np.ndarray]:
        """Noise-free readings with `effects`, after clipping and losses."""
        return [chain.kept(scene.chain, reading) for scene, reading in zip(*self.read(effects, forces))]

    def whitened(self, values: np.ndarray) -> np.ndarray:
        """Values in units of the noise, its colour taken out."""
        white = values.copy()
        white[1:] -= self.colour * values[:-1]
        white[0] *= math.sqrt(1 - self.colour**2)
        return white / (self.noise * math.sqrt(1 - self.colour**2))

    def noisy(self, count: int) -> np.ndarray:
        """Noise of `count` samples, N."""
        noise = self.noise * math.sqrt(1 - self.colour**2) * self.draw.normal(size=count)
        noise[0] = self.noise * self.draw.normal()
        for i in range(1, count if self.colour else 0):
            noise[i] += self.colour * noise[i - 1]
        return noise
