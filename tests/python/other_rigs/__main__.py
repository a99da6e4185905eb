"""Test campaigns for the diagnosis, from a simulator that shares nothing with it, and what a program makes of them.

    python other_rigs OUT [--seed S] [--cases N] [--kind KIND] [--effect ID] [--thud PROGRAM] [--jobs J]

Draws N cases into OUT/cases/NAME and the truth into OUT/truth.json. With --thud, PROGRAM diagnoses every case into
OUT/diagnoses/NAME.json, and its scores are printed and written to OUT/table.md.
"""

import argparse
import itertools
import json
import multiprocessing
import os
import secrets
import sys
from pathlib import Path

# Cases are drawn side by side; threads of the linear algebra would only get in each other's way, and could round differently.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[name] = "1"

import campaign
import score
from effects import FOREIGN, LISTED


def drawn(task: tuple) -> dict | None:
    try:
        return campaign.draw_case(*task)
    except RuntimeError as error:
        print(f"\n{error}", file=sys.stderr)
        return None


def draw_all(seed: int, count: int, kind: str | None, effect: str | None, jobs: int, cases: Path) -> list[dict]:
    """The truth about `count` cases. Case k depends on the seed and on k only."""
    dealt = itertools.islice(campaign.deal(seed, kind, effect), count)
    tasks = [(seed, number, *what, cases) for number, what in enumerate(dealt, 1)]
    truths = []
    with multiprocessing.Pool(jobs) as pool:
        for done, truth in enumerate(pool.imap(drawn, tasks), 1):
            print(f"\r{done} of {count} drawn", end="", file=sys.stderr, flush=True)
            truths.append(truth)
    print(file=sys.stderr)
    return [truth for truth in truths if truth is not None]


def main() -> None:
    parser = argparse.ArgumentParser(prog="other_rigs", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, help="without it, one from the operating system, which is printed")
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--kind", choices=[*dict.fromkeys(campaign.MIX), *campaign.ON_REQUEST], help="of all cases; a mix without it")
    parser.add_argument("--effect", choices=[*LISTED, *FOREIGN], metavar="ID", help="to be hidden in all cases")
    parser.add_argument("--thud", metavar="PROGRAM", help="that is to diagnose the cases")
    parser.add_argument("--jobs", type=int, default=score.cores(), help="processes that draw; as many as there are cores")
    asked = parser.parse_args()
    if asked.effect in FOREIGN and asked.kind not in (None, "unlisted"):
        parser.error(f"{asked.effect} is in no list: it can only be of the kind unlisted")
    if asked.effect and asked.kind == "absent":
        parser.error("nothing is hidden in a case of the kind absent")
    if asked.effect == "air-drag" and asked.kind not in (None, "single", "unlisted"):
        parser.error(f"air-drag has a rig of its own: it cannot be of the kind {asked.kind}")
    seed = secrets.randbits(32) if asked.seed is None else asked.seed
    print(f"seed {seed}")
    truths = draw_all(seed, asked.cases, asked.kind, asked.effect, asked.jobs, asked.out / "cases")
    (asked.out / "truth.json").write_text(json.dumps(truths, indent=1) + "\n", encoding="utf-8")
    if asked.thud:
        text = score.table(truths, score.diagnose_all(asked.thud, asked.out, truths))
        (asked.out / "table.md").write_text(text, encoding="utf-8")
        print(text)


if __name__ == "__main__":
    main()
