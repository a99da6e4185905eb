"""Other people's methods on the campaigns of `thud prove`: PySINDy, gradient boosting, a Gaussian process, the lowest BIC.

    peers.py VIEW DIR [JOBS]

VIEW is the program that gives a campaign beside its re-tuned baseline (host/examples/peers_view.rs); DIR is the folder of a finished
run. The answers go to DIR/peers/METHOD/CASE.json, as `thud-diagnosis/1` as far as they go; `thud prove --opened --out DIR` judges them by
the rules by which it judges the diagnosis. Nothing of a case is read but its campaign, and which mechanisms its list is without.
"""

import json
import multiprocessing
import os
import subprocess
import sys
import time
import warnings
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np
import pysindy
from scipy.signal import savgol_filter
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

import library

# Samples are means over blocks, so that a recording has this rate, Hz.
RATE_HZ = 5000.0
# Thresholds of the sequentially thresholded least squares, in units of the noise; the one with the lowest BIC counts.
THRESHOLDS = np.geomspace(0.03, 30.0, 16)
# A ridge keeps terms that are nearly the same from cancelling each other, as part of a column's square.
RIDGE = 1e-3
# The most terms of a forward regression.
MOST_TERMS = 6
# A Gaussian process of more points is slow.
PROCESS_POINTS = 1200
KERNEL_POINTS = 300
# A method that only predicts says that there is something when predicting the residual of recordings left out lowers their mean square by
# more than this many standard errors over the recordings.
SURE = 3.0
# What PySINDy leaves beyond this, as rmse of recordings left out over the noise, it counts as unexplained.
REST = 1.1


class Recording:
    """A recording of the view, as means over blocks, and at its own samples."""

    def __init__(self, seen, view):
        self.seen = seen
        raw = {key: np.asarray(seen[key], dtype=float)
               for key in ("time_s", "observed", "baseline", "held_out", "position_m", "velocity_m_per_s")}
        self.raw = raw
        interval_s = np.median(np.diff(raw["time_s"]))
        block = max(1, round(1.0 / (RATE_HZ * interval_s)))
        count = len(raw["time_s"]) // block
        self.thin = {key: values[: count * block].reshape(count, block).mean(axis=1) for key, values in raw.items()}
        self.stiffness = view["stiffness_N_per_m"]

    def residual(self, values):
        return values["observed"] - values["held_out"]

    def simulated(self, values):
        """The motion of the re-tuned simulation."""
        force = values["baseline"] - self.seen["offset"]
        return library.Motion(values["time_s"], force / self.stiffness, values["velocity_m_per_s"], force, self.seen["order"],
                              self.seen["configuration"])


def rmse(values):
    return float(np.sqrt(np.mean(np.concatenate(values) ** 2)))


def thresholded(count):
    """Sequentially thresholded least squares, PySINDy's default: coefficients for each threshold."""
    for threshold in THRESHOLDS:
        yield pysindy.STLSQ(threshold=threshold, alpha=RIDGE * count, max_iter=20)


def forward(count):
    """Forward regression by orthogonal least squares, PySINDy's FROLS: coefficients for each number of terms."""
    for terms in range(1, MOST_TERMS + 1):
        yield pysindy.FROLS(max_iter=terms, alpha=RIDGE * count)


def sparse(optimizers, matrices, responses, noise):
    """PySINDy with the optimizer's setting that has the lowest BIC, no term at all being one of the models.

    Columns are scaled to unit rms and responses to the noise, so that a coefficient is how much of the noise its term makes up. What least
    squares see of many samples is their triangular factor (theta = QR): it goes to PySINDy in place of them, with the same solutions.
    """
    theta, response = np.vstack(matrices), np.concatenate(responses) / noise
    scale = np.sqrt(np.mean(theta**2, axis=0))
    usable = scale > 1e-12
    count, terms = len(response), int(usable.sum())
    factor = np.linalg.qr(np.column_stack([theta[:, usable] / scale[usable], response]), mode="r")
    scaled, short = factor[:, :terms], factor[:, terms]
    best = (count * np.log(np.sum(short**2) / count), np.zeros(terms))
    for optimizer in optimizers(count):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = pysindy.SINDy(optimizer=optimizer, feature_library=pysindy.IdentityLibrary())
            try:
                model.fit(scaled, t=1.0, x_dot=short[:, None])
                coefficients = np.asarray(model.coefficients())[0]
            except ValueError:
                # Every term is below the threshold.
                continue
        bic = count * np.log(np.sum((short - scaled @ coefficients) ** 2) / count) + np.count_nonzero(coefficients) * np.log(count)
        if bic < best[0]:
            best = (bic, coefficients)
    coefficients, strength = np.zeros(theta.shape[1]), np.zeros(theta.shape[1])
    coefficients[usable] = best[1] * noise / scale[usable]
    strength[usable] = np.abs(best[1])
    return coefficients, strength


def names_of(named, coefficients, strength, without):
    """Mechanisms in the order of their terms' shares; what is left out of the list is no answer."""
    said = {}
    for place in np.argsort(-strength):
        if strength[place] <= 0:
            break
        ids = named[place].positive if coefficients[place] > 0 else named[place].negative
        ids = [one for one in ids if one not in without]
        if ids and ids[0] not in said:
            said[ids[0]] = ids[1:]
    return said


def line_Hz(recordings):
    """The strongest line of the residual while it touches and after."""
    power, frequencies = 0.0, None
    for recording in recordings:
        values = recording.thin
        part = values["time_s"] > 0
        residual = recording.residual(values)[part]
        interval_s = np.median(np.diff(values["time_s"]))
        size = 4096
        spectrum = np.abs(np.fft.rfft(residual * np.hanning(len(residual)), size)) ** 2
        frequencies = np.fft.rfftfreq(size, interval_s)
        power = power + np.interp(np.linspace(1, 600, 1200), frequencies, spectrum)
    return float(np.linspace(1, 600, 1200)[np.argmax(power)])


def answer(view, verdict, said, held_out):
    return {
        "format": "thud-diagnosis/1",
        "verdict": verdict,
        "baseline": {"held_out_rmse": view["baseline_held_out_rmse"], "noise_rms": view["noise_rms"]},
        "where": [],
        "mechanisms": [{"id": id, "parameters": [], "indistinguishable_from": list(others)} for id, others in said.items()],
        "model": {"held_out_rmse": held_out},
        "unexplained": {"held_out_rmse": None},
    }


def lowest_bic(view):
    best = view["candidates"][0]
    said = {best["id"]: []} if best["id"] else {}
    return answer(view, "named" if said else "consistent", said, view["lowest_bic_held_out_rmse"])


def sparse_answer(view, recordings, optimizers, without):
    """PySINDy: terms from all recordings, rmse from fits without the recordings that are left out."""
    motions = [one.simulated(one.thin) for one in recordings]
    reach_m = max(np.max(m.stroke_m) for m in motions)
    line = line_Hz(recordings)
    named, matrices = library.terms(motions, reach_m, line)
    responses = [one.residual(one.thin) for one in recordings]
    block = len(recordings[0].raw["time_s"]) / len(recordings[0].thin["time_s"])
    noise = view["noise_rms"] / np.sqrt(block)
    coefficients, strength = sparse(optimizers, matrices, responses, noise)
    said = names_of(named, coefficients, strength, without)
    left = []
    for fold in {one.seen["fold"] for one in recordings}:
        train = [i for i, one in enumerate(recordings) if one.seen["fold"] != fold]
        test = [i for i, one in enumerate(recordings) if one.seen["fold"] == fold]
        if not train:
            train = test
        fitted, _ = sparse(optimizers, [matrices[i] for i in train], [responses[i] for i in train], noise)
        for i in test:
            one = recordings[i]
            correction = np.interp(one.raw["time_s"], one.thin["time_s"], matrices[i] @ fitted)
            left.append(one.residual(one.raw) - correction)
    held_out = rmse(left)
    verdict = "consistent" if not said else "unexplained" if held_out > REST * view["noise_rms"] else "named"
    return answer(view, verdict, said, held_out)


def fall_answer(view, recordings, optimizers, without):
    """PySINDy in free flight: acceleration less gravity from smoothed heights, over the smoothed velocity."""
    motions, responses = [], []
    for one in recordings:
        t, height = one.raw["time_s"], one.raw["observed"]
        even = np.linspace(t[0], t[-1], max(15, len(t)))
        window = max(7, 2 * (len(even) // 12) + 1)
        smooth = {d: -savgol_filter(np.interp(even, t, height), window, 3, deriv=d, delta=even[1] - even[0]) for d in (1, 2)}
        motions.append(library.Motion(even, even * 0, smooth[1], even * 0, one.seen["order"], one.seen["configuration"]))
        responses.append(smooth[2] - view["gravity_m_per_s2"])
    named, matrices = library.terms_of_a_fall(motions)
    noise = float(np.std(np.concatenate([np.diff(r) for r in responses])) / np.sqrt(2)) or 1e-9
    coefficients, strength = sparse(optimizers, matrices, responses, noise)
    said = names_of(named, coefficients, strength, without)
    left = []
    for fold in {one.seen["fold"] for one in recordings}:
        train = [i for i, one in enumerate(recordings) if one.seen["fold"] != fold] or list(range(len(recordings)))
        fitted, _ = sparse(optimizers, [matrices[i] for i in train], [responses[i] for i in train], noise)
        for i, one in enumerate(recordings):
            if one.seen["fold"] != fold:
                continue
            t = one.raw["time_s"]
            steps = np.diff(motions[i].time_s, prepend=motions[i].time_s[0])
            fallen = np.cumsum(np.cumsum(matrices[i] @ fitted * steps) * steps)
            rest = one.raw["observed"] - one.raw["held_out"] + np.interp(t, motions[i].time_s, fallen)
            # Start and speed of a recording that is left out are estimated from it, as for the diagnosis.
            left.append(rest - np.polyval(np.polyfit(t, rest, 1), t))
    return answer(view, "named" if said else "consistent", said, rmse(left))


def features(one, values):
    columns = [values["time_s"], values["position_m"], values["velocity_m_per_s"], values["baseline"]]
    columns += [np.full_like(values["time_s"], one.seen[key]) for key in ("speed_m_per_s", "mass_kg", "order")]
    return np.column_stack(columns)


def boosting(inputs, residual, _noise, _known):
    model = HistGradientBoostingRegressor(max_iter=120, learning_rate=0.1, min_samples_leaf=60, early_stopping=True, random_state=1)
    return model.fit(inputs, residual).predict


def process(inputs, residual, noise, known):
    """`known` keeps the kernel that the first part was given: finding it takes nearly all the time."""
    # Most points from where it moves: from the contact on, as long again as the baseline touches.
    touching = inputs[:, 3] > 5 * noise
    near = (inputs[:, 0] > 0) & (inputs[:, 0] < 2 * np.max(inputs[touching, 0], initial=0.05))
    weight = np.where(near, 1.0, 0.1)
    rng = np.random.default_rng(1)
    mean, spread = inputs.mean(axis=0), inputs.std(axis=0) + 1e-12

    def fitted(kernel, count, **how):
        pick = rng.choice(len(residual), min(count, len(residual)), replace=False, p=weight / weight.sum())
        return GaussianProcessRegressor(kernel, **how).fit((inputs[pick] - mean) / spread, residual[pick] / noise)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if "kernel" not in known:
            first = ConstantKernel(1.0, (1e-3, 1e4)) * RBF(np.ones(inputs.shape[1]), (0.02, 100.0)) + WhiteKernel(1.0, (1e-2, 1e2))
            known["kernel"] = fitted(first, KERNEL_POINTS).kernel_
        model = fitted(known["kernel"], PROCESS_POINTS, optimizer=None)
    return lambda new: noise * model.predict((new - mean) / spread)


def predicting_answer(view, recordings, method):
    """A method that predicts the residual and names nothing."""
    left, gains, known = [], [], {}
    block = len(recordings[0].raw["time_s"]) / len(recordings[0].thin["time_s"])
    noise = view["noise_rms"] / np.sqrt(block)
    for fold in {one.seen["fold"] for one in recordings}:
        train = [one for one in recordings if one.seen["fold"] != fold] or recordings
        inputs = np.vstack([features(one, one.thin) for one in train])
        residual = np.concatenate([one.residual(one.thin) for one in train])
        # Quiet stretches tell nothing; a tenth of them is enough.
        part = np.random.default_rng(2).random(len(residual)) < np.where(inputs[:, 0] < 0, 0.1, 1.0)
        predict = method(inputs[part], residual[part], noise, known)
        for one in recordings:
            if one.seen["fold"] == fold:
                correction = np.interp(one.raw["time_s"], one.thin["time_s"], predict(features(one, one.thin)))
                before = one.residual(one.raw)
                left.append(before - correction)
                gains.append(np.mean(before**2) - np.mean(left[-1] ** 2))
    gains = np.asarray(gains)
    error = gains.std(ddof=1) / np.sqrt(len(gains)) if len(gains) > 1 else np.inf
    return answer(view, "unexplained" if gains.mean() > SURE * error else "consistent", {}, rmse(left))


def one_case(arguments):
    program, root, case, without = arguments
    begun = time.time()
    command = [program, str(root / "cases" / case)]
    for mechanism in without:
        command += ["--without", mechanism]
    view = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    recordings = [Recording(seen, view) for seen in view["recordings"]]
    said = {"lowest-bic": lowest_bic(view)}
    sindy = fall_answer if view["kind"] == "fall" else sparse_answer
    said["pysindy"] = sindy(view, recordings, thresholded, without)
    said["pysindy-forward"] = sindy(view, recordings, forward, without)
    said["gradient-boosting"] = predicting_answer(view, recordings, boosting)
    said["gaussian-process"] = predicting_answer(view, recordings, process)
    for method, answered in said.items():
        folder = root / "peers" / method
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{case}.json").write_text(json.dumps(answered, indent=1))
    return case, time.time() - begun


def main():
    program, root = sys.argv[1], Path(sys.argv[2])
    jobs = int(sys.argv[3]) if len(sys.argv) > 3 else max(1, (os.cpu_count() or 1))
    # Of the answers only what the list of each case is without, which the diagnosis is told too.
    answers = json.loads((root / "answers.json").read_text())
    work = [(program, root, case["case"], case["without"]) for case in answers["cases"]]
    done = [all((root / "peers" / m / f"{w[2]}.json").exists() for m in ("lowest-bic", "gaussian-process")) for w in work]
    work = [one for one, ready in zip(work, done) if not ready]
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        for number, (case, seconds) in enumerate(pool.imap_unordered(one_case, work), 1):
            print(f"  {number} of {len(work)}: {case}, {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    main()
