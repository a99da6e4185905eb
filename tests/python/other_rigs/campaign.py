"""Campaigns: which effects are dealt to which case, how a case is drawn, and the files it is written to."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import chain
import strength
from chain import LEFT_OUT
from effects import FOREIGN, LISTED, Effect, Kind, kind_of
from fall import Fall
from rig import REPEATABILITY, STANDARD_GRAVITY, Recording, Rig, Scene, Wishes, log_uniform, rounded

# Of 20 cases: one effect, two, none, one that is in no list or has been taken out of it.
MIX = ["single"] * 12 + ["pair"] * 3 + ["absent"] * 3 + ["unlisted"] * 2
# On request only: an effect in a few recordings; one whose baseline is stated so that it fits as well as it can.
ON_REQUEST = ["conditional", "absorbed"]
# Strengths are drawn between these: below 8 nobody sees an effect; one of a pair and what has no name need more; beyond 150 all is plain.
WEAKEST = {"single": 8, "pair": 25, "unlisted": 12, "conditional": 8, "absorbed": 8}
STRONGEST, STRONGEST_OF_PAIR, BEYOND = 150, 100, 200
WEAKEST_LOUD = 40  # a piece or a spring heavy enough to be called so is no fainter
STRONGEST_AGAINST_STATED = 25  # more would be no error but a mistake of several standard deviations
# Small imperfections that every rig has, with sizes of the right order; all of a rig's together are below NO_EFFECT.
TRACES = {"hunt-crossley-damping": 0.01, "viscous-damping": 0.5, "guide-friction": 0.03, "pad-relaxation": 0.005, "charge-drift": 0.05,
          "mains-hum": 0.01, "moving-piece-inertia": 0.002, "piezo-discharge": 0.02, "air-damping": 1.0, "frame-compliance": 1e-8}
NO_EFFECT = 1.6
PIECE_TRACE_KG = 0.02  # a heavier piece could not be hidden as a trace
# A rig is given up if its effect cannot be had in the wanted strength; after STRICT ones, less exactness will do.
ATTEMPTS, STRICT = 24, 9
ABSORBED = 1.9  # standard deviations by which stated values are bent at most
FALL_SHARE = 0.04  # of the cases without an effect are falls, about as many as with one


def deal(seed: int, kind: str | None = None, effect: str | None = None) -> Iterator[tuple[str, list[str]]]:
    """Kind and effects of the first case, the second and so on; every mechanism comes once before one comes twice."""
    draw = np.random.default_rng([seed, 0])  # cases count from 1
    listed = [one for one in LISTED.values() if one.id != "air-drag" and not one.against_stated]

    def pick(pool):
        return str(draw.choice([one.id for one in pool]))

    kinds, deck = [], []
    while True:
        if not kinds:
            kinds = [str(one) for one in draw.permutation(MIX)]
        dealt = kind or (("single" if effect in LISTED else "unlisted") if effect else kinds.pop())
        if dealt == "absent":
            ids = []
        elif dealt == "pair":
            first = effect or pick(listed)
            ids = [first, pick(one for one in listed if one.id != first and (not one.place or one.place != kind_of(first).place))]
        elif effect:
            ids = [effect]
        elif dealt == "single":
            if not deck:
                deck = [str(one) for one in draw.permutation(list(LISTED))]
            ids = [deck.pop()]
        elif dealt == "unlisted":
            ids = [pick(FOREIGN.values() if draw.random() < 0.6 else listed)]
        elif dealt == "conditional":  # not what acts in the whole campaign by its nature
            ids = [pick(one for one in listed if one.id not in ("mullins-softening", "rate-stiffening"))]
        else:  # not what no stiffness or mass could imitate
            ids = [pick(one for one in listed if one.id not in ("mains-hum", "charge-drift", "lost-samples"))]
        yield dealt, ids


def draw_case(seed: int, number: int, kind: str, ids: list[str], cases: Path) -> dict:
    """Writes a case's campaign and returns the truth about it."""
    name = f"case-{number:03d}"
    without = [one for one in ids if one in LISTED] if kind == "unlisted" else []
    for attempt in range(ATTEMPTS):
        draw = np.random.default_rng([seed, number, attempt])
        wanted = [log_uniform(draw, weakest(kind, one), STRONGEST_OF_PAIR if kind == "pair" else STRONGEST) for one in ids]
        if ids == ["air-drag"] or (not ids and draw.random() < FALL_SHARE):
            told = draw_fall(draw, wanted, cases / name, name)
        else:
            try:
                told = draw_impacts(draw, kind, ids, wanted, attempt < STRICT, cases / name, name)
            except (FloatingPointError, np.linalg.LinAlgError):  # two effects and the traces together could not be integrated
                told = None
        if told is not None:
            return {"case": name, "kind": kind, **told, "without": without}
    raise RuntimeError(f"{name}: no rig has {' and '.join(ids) or 'nothing'} in it as it should")


def weakest(kind: str, effect: str) -> float:
    return WEAKEST_LOUD if kind_of(effect).loud and kind in ("single", "unlisted") else WEAKEST[kind]


def draw_fall(draw: np.random.Generator, wanted: list[float], folder: Path, name: str) -> dict:
    fall = Fall(draw)
    drag = fall.drag_for(wanted[0]) if wanted else 0.0
    write(folder, name, fall.stated(), [(fall.times, heights) for heights in fall.heights(drag)])
    d = rounded(fall.strength(drag), 4) if wanted else 0.0
    return {"effects": [{"id": "air-drag", "parameters": fall.told(drag)}] if wanted else [], "d": [d] if wanted else [], "d_total": d}


def draw_impacts(draw: np.random.Generator, kind: str, ids: list[str], wanted: list[float], strict: bool, folder: Path,
                 name: str) -> dict | None:
    """A case on a rig, or None if this rig cannot have these effects in the strengths wanted."""
    kinds = [kind_of(one) for one in ids]
    rig = Rig(draw, Wishes(*(any(getattr(one, trait) for one in kinds) for trait in ("pad", "robot", "against_stated", "loud"))))
    plain = without_effects(rig)
    if plain is None:
        return None
    hidden = hide(rig, kind, kinds, wanted, strict, plain)
    if hidden is None:
        return None
    acting = [(one.effect, one.size) for one in hidden] + traces(rig, ids, plain)
    scenes, readings = rig.read(acting)
    kept = [chain.kept(scene.chain, reading) for scene, reading in zip(scenes, readings)]
    total = strength.retune(rig, kept)
    alone = math.sqrt(sum(one.strength**2 for one in hidden))
    if kind == "absent" and total.strength > NO_EFFECT:
        return None
    if strict and kind in ("single", "unlisted", "conditional") and abs(total.strength - alone) > 0.2 * alone + 1.0:
        return None  # the traces change it too much
    stated = {"body": rig.stated_body, "pad": rig.stated_pad, "masses": list(rig.stated_masses),
              "speeds": [recording.stated_speed for recording in rig.recordings], "piece": None}
    if kind == "absorbed":
        centre = bend(rig, kept, stated)
        total = strength.retune(rig, kept, centre=centre)
        if strict and total.strength < 0.75 * WEAKEST[kind]:
            return None
    for one in hidden:
        if one.effect.id == "moving-piece-inertia" and draw.random() < 0.5:  # somebody has weighed it
            stated["piece"] = (one.size * (1 + 0.08 * draw.normal()), 0.08 * one.size)
    rows = [recorded(rig, *each) for each in zip(rig.recordings, scenes, readings)]
    write(folder, name, stated_of(rig, stated), rows)
    return {
        "effects": [truth_of(rig, one) for one in hidden],
        "d": [rounded(one.strength, 4) for one in hidden],
        "d_total": rounded(total.strength, 4),
        "d_residual_only": [rounded(one.residual_only, 4) for one in hidden],
        "traces": [{"id": effect.id, "parameters": effect.tell(size)} for effect, size in acting[len(hidden) :]],
        "rig": {"kind": "drop" if rig.drops else "impact", "body_N_per_m": rig.body, "pad_N_per_m": rig.pad if rig.has_pad else None,
                "masses_kg": rig.masses, "noise_N": rig.noise, "noise_colour": rig.colour, "aperture_s": rig.aperture,
                "sample_rate_Hz": rig.rate, "peak_N": rig.peak},
    }


def hide(rig: Rig, kind: str, kinds: list[Kind], wanted: list[float], strict: bool, plain: list[np.ndarray]) -> list[strength.Sized] | None:
    """Effects of these kinds in the strengths wanted, each as it is alone."""
    hidden = []
    for one, aim in zip(kinds, wanted):
        effect = one.drawn(rig)
        if kind == "conditional":
            effect.only = some_recordings(rig)
        if one.against_stated:
            aim = min(aim, log_uniform(rig.draw, WEAKEST["single"], STRONGEST_AGAINST_STATED))
        sized = strength.size_for(rig, effect, aim, plain)
        if sized is None or sized.strength < 0.8 * weakest(kind, one.id) or (sized.strength > BEYOND and kind != "conditional"):
            return None
        if strict and abs(sized.strength / aim - 1) > 0.2 and not (one.against_stated or effect.whole):
            return None
        hidden.append(sized)
    return hidden


def without_effects(rig: Rig) -> list[np.ndarray] | None:
    """Readings of the bare rig. The converter's averaging is an imperfection too: shortened where it has a strength of its own."""
    forces: dict = {}
    for _ in range(5):
        readings = rig.kept([], forces)
        found = strength.retune(rig, readings).strength
        if found < 0.8:
            return readings
        rig.aperture *= max(0.1, 0.6 / found)
    return None


def some_recordings(rig: Rig) -> set[int]:
    """One configuration, or two to four recordings."""
    draw = rig.draw
    if draw.random() < 0.5:
        configuration = int(draw.integers(len(rig.masses)))
        return {recording.number for recording in rig.recordings if recording.configuration == configuration}
    return {int(i) for i in draw.choice(len(rig.recordings), int(draw.integers(2, 5)), replace=False)}


def traces(rig: Rig, hidden: list[str], plain: list[np.ndarray]) -> list[tuple[Effect, float]]:
    """One to four small imperfections, or none on one rig in eight, of a strength that is as good as nothing."""
    draw = rig.draw
    if draw.random() < 0.12:
        return []
    taken = set(hidden) | {kind_of(one).place for one in hidden if kind_of(one).place}
    pool = [one for one in TRACES if one not in taken and kind_of(one).place not in taken and (rig.has_pad or not kind_of(one).pad)]
    chosen = [str(one) for one in draw.permutation(pool)[: int(draw.integers(1, 5))]]
    small = [(kind_of(one).drawn(rig), TRACES[one] * log_uniform(draw, 0.5, 2)) for one in chosen]
    wanted = float(draw.uniform(0.2, 1.35))
    for _ in range(3):
        found = strength.strength(rig, rig.kept(small), plain).strength
        if 0.6 * wanted < found < min(1.1 * wanted, 1.5):
            break
        factor = min(wanted / max(found, 1e-3), 15.0)
        small = [(effect, min(size * factor, PIECE_TRACE_KG) if effect.id == "moving-piece-inertia" else size * factor)
                 for effect, size in small]
    return small


def bend(rig: Rig, readings: list[np.ndarray], stated: dict) -> np.ndarray:
    """Bends what is stated towards what fits the readings best. Returns it as deviations from the truth."""
    layout = strength.Layout(rig)
    centre = np.clip(strength.retune(rig, readings, loosened=3.0).deviations, -ABSORBED * layout.sd, ABSORBED * layout.sd)
    for place in (1, 2, 3):  # instants, springs and offsets of the recordings are not stated
        centre[layout.recordings + place :: 4] = 0.0
    stated["body"] = rig.body * math.exp(centre[0])
    stated["pad"] = rig.pad * math.exp(centre[1])  # the first mass, unused, where there is no pad
    stated["masses"] = [mass * math.exp(centre[layout.masses + i]) for i, mass in enumerate(rig.masses)]
    stated["speeds"] = [r.speed * math.exp(centre[layout.recordings + 4 * r.number]) for r in rig.recordings]
    return centre


def recorded(rig: Rig, recording: Recording, scene: Scene, reading: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and samples as they are logged: with offset and noise, clipped, in whole codes, without what is left out."""
    samples = chain.kept(scene.chain, reading + recording.offset + rig.noisy(len(reading)))
    left = len(samples) - sum(count for how, _, count in scene.chain.lost if how == LEFT_OUT)
    return recording.times[:left], rig.code * np.round(samples[:left] / rig.code)


def truth_of(rig: Rig, hidden: strength.Sized) -> dict:
    truth = {"id": hidden.effect.id, "parameters": hidden.effect.tell(hidden.size)}
    if hidden.effect.only is not None or len(hidden.shows_in) <= 0.6 * len(rig.recordings):
        truth["recordings"] = [f"{number + 1:03d}" for number in hidden.shows_in]
    return truth


def stated_of(rig: Rig, stated: dict) -> dict:
    """What campaign.toml says of a rig."""
    told = {"kind": "drop" if rig.drops else "impact", "body_stiffness_N_per_m": (stated["body"], rig.body_sd * stated["body"])}
    if rig.has_pad:
        told["pad_stiffness_N_per_m"] = (stated["pad"], rig.pad_sd * stated["pad"])
    if stated["piece"]:
        told["moving_mass_kg"] = stated["piece"]
    if rig.drops:
        told["gravity_along_impact_m_per_s2"] = STANDARD_GRAVITY
    told["spring_repeatability"] = REPEATABILITY
    noise = rounded(rig.noise * (1 + 0.04 * rig.draw.normal()), 3)  # as somebody has measured it
    return {
        "rig": told,
        "chain": {"sample_rate_Hz": rig.rate, "noise_rms_N": noise, "full_scale_N": rig.full_scale, "observed": "force_N"},
        "recordings": [((stated["speeds"][r.number], rig.speed_sd * stated["speeds"][r.number]),
                        (stated["masses"][r.configuration], rig.mass_sd * stated["masses"][r.configuration]), str(r.configuration + 1))
                       for r in rig.recordings],
    }


def toml(value) -> str:
    if isinstance(value, tuple):
        return f"{{ value = {value[0]:.6g}, sd = {value[1]:.3g} }}"
    return f'"{value}"' if isinstance(value, str) else str(value)


def write(folder: Path, name: str, stated: dict, rows: list[tuple[np.ndarray, np.ndarray]]) -> None:
    """campaign.toml, and a CSV of times and readings for each recording."""
    (folder / "recordings").mkdir(parents=True, exist_ok=True)
    text = ['format = "thud-campaign/1"', f"name = {toml(name)}", ""]
    for table in ("rig", "chain"):
        text += [f"[{table}]", *(f"{key} = {toml(value)}" for key, value in stated[table].items()), ""]
    for number, ((times, samples), (speed, mass, configuration)) in enumerate(zip(rows, stated["recordings"]), 1):
        file = f"recordings/{number:03d}.csv"
        np.savetxt(folder / file, np.column_stack([times, samples]), fmt=["%.7f", "%.6f"], delimiter=",",
                   header=f"time_s,{stated['chain']['observed']}", comments="")
        text += ["[[recording]]", f"file = {toml(file)}", f"impact_speed_m_per_s = {toml(speed)}", f"effective_mass_kg = {toml(mass)}",
                 f"configuration = {toml(configuration)}", ""]
    (folder / "campaign.toml").write_text("\n".join(text), encoding="utf-8")
