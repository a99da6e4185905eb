"""Free fall: a ball in air, whose height is read. Its drag is the one effect that can be hidden here."""

import math

import numpy as np

from rig import STANDARD_GRAVITY, log_uniform, rounded

AIR_KG_PER_M3, AIR_M2_PER_S = 1.2, 1.5e-5  # density and kinematic viscosity at room temperature
DRAG_COEFFICIENT = 0.44  # of a sphere at Reynolds numbers of 1e3 to 1e5
STEP_S = 1e-4  # of the integration; a fall's speeds change over tenths of a second
SPEED_SD, HEIGHT_SD, MASS_SD = 0.03, 0.003, 0.01  # of a release: m/s, m, and relative


class Fall:
    def __init__(self, draw: np.random.Generator):
        self.rate, self.noise = float(draw.choice([200, 500, 1000])), log_uniform(draw, 5e-4, 2e-3)  # Hz, m: a camera, a distance sensor
        self.mass, self.diameter = log_uniform(draw, 0.01, 0.1), float(draw.uniform(0.04, 0.15))  # kg, m: table tennis to foam balls
        self.times = np.arange(int(float(draw.uniform(0.5, 0.8)) * self.rate)) / self.rate
        self.height = float(draw.uniform(2.2, 4.0))  # m
        self.speeds = np.zeros(int(draw.integers(6, 13)))
        self.by_reynolds = bool(draw.random() < 0.4)
        self.speeds = np.abs(draw.normal(0, 0.02, len(self.speeds)))  # m/s, at release
        self.colour = float(draw.choice([0, draw.uniform(0, 0.3)]))
        self.draw = draw

    def fallen(self, drag: float) -> np.ndarray:
        """Metres fallen at every time, a row for each recording. Drag is c u |u|, c in kg/m, or c grows as Schiller and Naumann's does."""

        def gains(speed):
            factor = 1.0
            if self.by_reynolds:
                reynolds = np.abs(speed) * self.diameter / AIR_M2_PER_S + 1e-9
                factor = np.maximum(24 / reynolds * (1 + 0.15 * reynolds**0.687), DRAG_COEFFICIENT) / DRAG_COEFFICIENT
            return STANDARD_GRAVITY - drag * factor * speed * np.abs(speed) / self.mass

        fallen, speed, rows, h = np.zeros(len(self.speeds)), self.speeds.copy(), [np.zeros(len(self.speeds))], STEP_S
        each = round(1 / self.rate / h)
        for i in range(1, (len(self.times) - 1) * each + 1):
            k1 = gains(speed)
            k2 = gains(speed + h / 2 * k1)
            k3 = gains(speed + h / 2 * k2)
            k4 = gains(speed + h * k3)
            fallen = fallen + h * speed + h * h / 6 * (k1 + k2 + k3)
            speed = speed + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            if i % each == 0:
                rows.append(fallen)
        return np.array(rows).T

    def strength(self, drag: float) -> float:
        """What speeds within their stated uncertainty and free heights leave of the drag, in units of the noise."""
        scale = self.noise * math.sqrt(1 - self.colour**2)

        def whitened(values):
            white = values.copy()
            white[1:] -= self.colour * values[:-1]
            white[0] *= math.sqrt(1 - self.colour**2)
            return white / scale

        jacobian = np.vstack([np.column_stack([whitened(self.times), whitened(np.ones(len(self.times)))]), [1 / SPEED_SD, 0]])
        squares = 0.0
        for row in self.fallen(drag) - self.fallen(0.0):
            right = np.append(whitened(row), 0)
            fitted = np.linalg.lstsq(jacobian, right, rcond=None)[0]
            squares += float(np.sum((right - jacobian @ fitted) ** 2))
        return math.sqrt(squares)

    def drag_for(self, wanted: float) -> float:
        """The drag of a wanted strength, which is nearly proportional to it."""
        drag = 0.5 * AIR_KG_PER_M3 * DRAG_COEFFICIENT * math.pi * self.diameter**2 / 4
        for _ in range(6):
            reached = self.strength(drag)
            if abs(reached / wanted - 1) < 0.05:
                break
            drag *= wanted / reached
        return drag

    def told(self, drag: float) -> dict:
        form = "Schiller-Naumann, coefficient at its floor" if self.by_reynolds else "constant c_d"
        return {"coefficient_kg_per_m": drag, "mass_kg": self.mass, "form": form}

    def heights(self, drag: float) -> list[np.ndarray]:
        """Readings of each recording, m."""
        readings = []
        for row in self.fallen(drag):
            noise = self.noise * math.sqrt(1 - self.colour**2) * self.draw.normal(size=len(row))
            noise[0] = self.noise * self.draw.normal()
            for i in range(1, len(row)):
                noise[i] += self.colour * noise[i - 1]
            readings.append(self.height - row + noise + HEIGHT_SD * self.draw.normal())
        return readings

    def stated(self) -> dict:
        """What campaign.toml says: rig, chain, and (speed, sd), (mass, sd) of every recording."""
        return {
            "rig": {"kind": "fall", "gravity_along_impact_m_per_s2": STANDARD_GRAVITY},
            "chain": {"sample_rate_Hz": self.rate, "noise_rms_N": rounded(self.noise, 3), "full_scale_N": 5.0, "observed": "height_m"},
            "recordings": [((0.0, SPEED_SD), (self.mass, MASS_SD * self.mass), "1")] * len(self.speeds),
        }
