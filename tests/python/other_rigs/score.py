"""Has a program diagnose the cases, and scores what it says."""

import json
import math
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

LONGEST_S = 300  # a diagnosis that takes longer counts as wrong
ROWS = {"single": "one effect", "conditional": "one effect", "absorbed": "one effect", "pair": "two effects", "absent": "nothing",
        "unlisted": "not in the list"}
COLUMNS = ("right verdict", "named first", "in the named set", "exact", "wrong and confident")
NAMED = ("named", "ambiguous")  # verdicts that stand by the names given
Z_95 = 1.959964  # standard deviations of a normal distribution's 95 %


def cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def diagnose_all(program: str, out: Path, truths: list[dict]) -> list[dict]:
    """Diagnoses of all cases, as the program wrote them; {"failed": why} of those that came to none."""
    (out / "diagnoses").mkdir(parents=True, exist_ok=True)

    def diagnose(truth):
        answer = out / "diagnoses" / f"{truth['case']}.json"
        answer.unlink(missing_ok=True)
        without = [argument for one in truth["without"] for argument in ("--without", one)]
        command = [program, "diagnose", str(out / "cases" / truth["case"]), "--json", str(answer), *without]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S)
        except subprocess.TimeoutExpired:
            return {"failed": f"not done after {LONGEST_S} s"}
        if done.returncode != 0 or not answer.exists():
            return {"failed": f"exit status {done.returncode}: {' '.join(done.stderr.split())[-200:]}"}
        try:
            return json.loads(answer.read_text(encoding="utf-8"))
        except ValueError as error:
            return {"failed": f"no JSON: {error}"}

    with ThreadPoolExecutor(cores()) as pool:
        running = [pool.submit(diagnose, truth) for truth in truths]
        for count, _ in enumerate(as_completed(running), 1):
            print(f"\r{count} of {len(truths)} diagnosed", end="", file=sys.stderr, flush=True)
        print(file=sys.stderr)
    return [one.result() for one in running]


def judge(truth: dict, diagnosis: dict) -> dict[str, bool | None]:
    """Each column's judgement of a case; None where it does not apply.

    With effects of the list hidden, the right verdict is named or ambiguous, named first is one of them, and exact is those and no other.
    A named set is a mechanism with all it cannot be told from. Wrong and confident is a verdict that stands by its names while one of the
    named sets holds nothing that is there.
    """
    row, hidden = ROWS[truth["kind"]], [effect["id"] for effect in truth["effects"]]
    nameable = row in ("one effect", "two effects")
    if "failed" in diagnosis:
        return dict(zip(COLUMNS, (False, False if nameable else None, False if nameable else None, False, False)))
    verdict, names = diagnosis["verdict"], [one["id"] for one in diagnosis["mechanisms"]]
    sets = [{one["id"], *one["indistinguishable_from"]} for one in diagnosis["mechanisms"]]
    confident = verdict in NAMED and any(one.isdisjoint(hidden) for one in sets)
    if not nameable:
        right = verdict == ("consistent" if row == "nothing" else "unexplained")
        return dict(zip(COLUMNS, (right, None, None, right, confident)))
    if row == "one effect":
        in_set = bool(sets) and hidden[0] in sets[0]
    else:
        in_set = all(any(one in named for named in sets) for one in hidden)
    exact = sorted(names) == sorted(hidden) and verdict != "unexplained"
    return dict(zip(COLUMNS, (verdict in NAMED, bool(names) and names[0] in hidden, in_set, exact, confident)))


def share(hits: int, count: int) -> str:
    """A share in per cent with Wilson's 95 % interval."""
    part, z = hits / count, Z_95**2 / count
    middle = (part + z / 2) / (1 + z)
    half = math.sqrt(part * (1 - part) * z + z * z / 4) / (1 + z)
    low, high = max(0.0, middle - half), min(1.0, middle + half)
    return f"{hits}/{count} = {100 * part:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def line(truth: dict, diagnosis: dict) -> str:
    """What was hidden in a case, how strong it was, and what was said."""
    hidden = " + ".join(effect["id"] for effect in truth["effects"]) or "nothing"
    strong = ", ".join(f"{d:.0f}" for d in truth["d"]) or f"{truth['d_total']:.1f}"
    if "failed" in diagnosis:
        said = diagnosis["failed"]
    else:
        names = [one["id"] + (f" (or {', '.join(one['indistinguishable_from'])})" if one["indistinguishable_from"] else "")
                 for one in diagnosis["mechanisms"]]
        said = f"{diagnosis['verdict']}: {' + '.join(names) or 'no name'}"
    return f"- {truth['case']}, {truth['kind']}: {hidden}, d {strong}; said {said}"


def table(truths: list[dict], diagnoses: list[dict]) -> str:
    """The scores as Markdown, and a line for every case that was not exact."""
    judged = [judge(truth, diagnosis) for truth, diagnosis in zip(truths, diagnoses)]
    text = [f"| | cases | {' | '.join(COLUMNS)} |", "|---" * (2 + len(COLUMNS)) + "|"]
    for row in dict.fromkeys(ROWS.values()):
        of_row = [one for truth, one in zip(truths, judged) if ROWS[truth["kind"]] == row]
        if not of_row:
            continue
        cells = ["–" if of_row[0][column] is None else share(sum(one[column] for one in of_row), len(of_row)) for column in COLUMNS]
        text.append(f"| {row} | {len(of_row)} | {' | '.join(cells)} |")
    inexact = [line(truth, diagnosis) for truth, diagnosis, one in zip(truths, diagnoses, judged) if not one["exact"]]
    text += ["", "Shares with Wilson's 95 % intervals.", "", f"Not exact: {len(inexact)} of {len(truths)}.", "", *inexact]
    return "\n".join(text) + "\n"
