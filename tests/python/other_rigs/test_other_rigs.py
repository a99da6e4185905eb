"""Checks of the simulator itself: `python test_other_rigs.py`, or pytest."""

import itertools
import os
import tempfile
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np

import campaign
import score
import strength
from effects import FOREIGN, LISTED, kind_of
from mechanics import STEP_S, Parameters, baseline, felt
from rig import Rig, Wishes


def bare_rigs(count, **wishes):
    return [Rig(np.random.default_rng([1, number]), Wishes(**wishes)) for number in range(count)]


def test_bare_peak_is_v_sqrt_km():
    for rig in bare_rigs(5, robot=True):  # without gravity
        recording = rig.recordings[0]
        peak = recording.speed * np.sqrt(rig.in_series(recording.spring) * recording.mass)
        assert abs(rig.force(recording, rig.plain(recording)).max() / peak - 1) < 1e-4


def test_bare_contact_keeps_energy():
    # The impulse of a contact that keeps its energy is 2 m v; what restitution is missing from 1 is missing from it.
    for rig in bare_rigs(5, robot=True):
        recording = max(rig.recordings, key=lambda one: one.times[-1] - one.contact_at - one.lasts)
        impulse = STEP_S * rig.force(recording, rig.plain(recording)).sum()
        assert abs(impulse / (recording.mass * recording.speed) - 2) < 1e-4


def test_bare_rig_is_the_baseline():
    for rig in bare_rigs(8):
        recording = rig.recordings[0]
        force = rig.force(recording, rig.plain(recording))
        stiffness, times = rig.in_series(recording.spring), STEP_S * np.arange(len(force))
        closed = baseline(times, stiffness, recording.mass, recording.speed, 0.0, rig.gravity)
        assert np.max(np.abs(force - closed)) < 0.01 * rig.noise + 1e-3 * rig.peak


def test_damping_across_the_contact():
    # Kelvin and Voigt's contact from robot to frame: a force c v at once, and less than 2 m v of impulse.
    across = Parameters(impact_speed=0.3, tip_mass=5.0, body_stiffness=50e3, pad_stiffness=50e3, contact_damping=40.0)
    force = felt(across, 60_000)
    assert abs(force[1] / 12.0 - 1) < 1e-2
    assert force.min() > -0.1 and STEP_S * force.sum() < 2 * 5.0 * 0.3


def test_steps_are_fine_enough():
    parameters = dict(impact_speed=0.3, tip_mass=5.0, body_stiffness=50e3, pad_stiffness=80e3, piece_mass=0.1, friction=1.0,
                      friction_force=1.0, stop_at=3e-3, stop_stiffness=1e6, stop_toe=1e-4, frame_mass=15.0, frame_stiffness=5e6)
    coarse, fine = felt(Parameters(**parameters), 50_000), felt(Parameters(**parameters), 200_000, STEP_S / 4)
    assert np.max(np.abs(coarse - fine[::4])) < 0.01


def test_every_effect_does_something():
    for one in (set(LISTED) | set(FOREIGN)) - {"air-drag"}:
        kind = kind_of(one)
        rig = Rig(np.random.default_rng(2), Wishes(kind.pad, kind.robot, kind.against_stated, kind.loud))
        effect = kind.drawn(rig)
        strongest = max(rig.recordings, key=lambda recording: recording.peak).number
        assert np.any(rig.kept([(effect, (effect.high * effect.start) ** 0.5)])[strongest] != rig.kept([])[strongest]), one


def test_drawn_strength_is_the_wanted_one():
    for one in ("hunt-crossley-damping", "piezo-discharge", "guide-friction"):
        rig = next(rig for rig in bare_rigs(9, pad=True) if campaign.without_effects(rig) is not None)
        sized = strength.size_for(rig, kind_of(one).drawn(rig), 30.0, campaign.without_effects(rig))
        assert sized is not None and abs(sized.strength / 30.0 - 1) < 0.2


def test_same_seed_same_files():
    dealt = list(itertools.islice(campaign.deal(5), 40))
    assert dealt[:7] == list(itertools.islice(campaign.deal(5), 7))
    with tempfile.TemporaryDirectory() as folder:
        told = [campaign.draw_case(5, 1, "single", ["charge-drift"], Path(folder) / again) for again in ("a", "b")]
        assert told[0] == told[1]
        files = [sorted(path for path in (Path(folder) / again).rglob("*") if path.is_file()) for again in ("a", "b")]
        assert len(files[0]) > 8 and [path.read_bytes() for path in files[0]] == [path.read_bytes() for path in files[1]]


def test_scores():
    def judged(kind, hidden, verdict, *named):
        mechanisms = [{"id": first, "indistinguishable_from": rest} for first, *rest in named]
        told = score.judge({"kind": kind, "effects": [{"id": one} for one in hidden]}, {"verdict": verdict, "mechanisms": mechanisms})
        return tuple(told.values())

    assert judged("single", ["a"], "named", ["a"]) == (True, True, True, True, False)
    assert judged("single", ["a"], "ambiguous", ["b", "a"]) == (True, False, True, False, False)
    assert judged("single", ["a"], "named", ["b"]) == (True, False, False, False, True)
    assert judged("single", ["a"], "unexplained", ["a"]) == (False, True, True, False, False)
    assert judged("pair", ["a", "b"], "ambiguous", ["b"], ["c", "a"]) == (True, True, True, False, False)
    assert judged("absent", [], "consistent") == (True, None, None, True, False)
    assert judged("absent", [], "named", ["a"]) == (False, None, None, False, True)
    assert judged("unlisted", ["a"], "unexplained", ["b"]) == (True, None, None, True, False)
    assert score.share(8, 10) == "8/10 = 80 % (49 to 94)"


if __name__ == "__main__":
    for test in (test_bare_peak_is_v_sqrt_km, test_bare_contact_keeps_energy, test_bare_rig_is_the_baseline,
                 test_damping_across_the_contact, test_steps_are_fine_enough, test_every_effect_does_something,
                 test_drawn_strength_is_the_wanted_one, test_same_seed_same_files, test_scores):
        test()
        print(f"{test.__name__}: as it should")
