"""Trials with faults at random: `python -m tests.hardware.soak khepera 200` counts how they end."""

import sys
import tempfile
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from importlib import resources
from io import StringIO
from pathlib import Path

import numpy as np
import yaml

from bns.cli.main import main
from bns.hardware.link.hardware_log import events
from bns.trial.folder import past_evaluations

QUICK = [
    *("--no-figures", "--population-size", "20", "--training-iterations-per-evaluation", "20"),
    *("--generations-per-evaluation", "2"),
]
SEEN = {"lost-marker": 0.05, "stuck-marker": 0.05, "reflection": 0.3}


@dataclass(frozen=True)
class Kind:
    """How trials of a robot are soaked: options, evaluations, faults at a rate and at a time."""

    task: str
    evaluations: int
    options: list
    rates: dict
    at: dict
    servos: int = 0


KINDS = {
    "khepera": Kind(
        "circle", 5, [],
        {"lost-request": 0.05, "lost-reply": 0.05, "corrupt-reply": 0.05, "bus-fault": 0.05, "late-reply": 0.03,
         "swapped-markers": 0.3, **SEEN},
        {"hang-up": 2.5, "brown-out": 3.0, "lost-marker": 4.0, "stuck-marker": 4.0, "bus-fault": 1.5},
    ),
    "snake": Kind(
        "two-regions", 1, ["--min-commands", "1", "--max-commands", "1", "--repeats", "1"],
        {"lost-request": 0.01, "lost-reply": 0.01, "corrupt-reply": 0.01, **SEEN},
        {"hang-up": 2.5, "lost-marker": 4.0, "stuck-marker": 4.0, "silent-servo": 1.0, "overload": 1.0, "overheat": 2.0},
        servos=12,
    ),
}  # fmt: skip
OF_A_SERVO = {"silent-servo", "overload", "overheat"}


def plan(seed, kind):
    """A fault plan drawn at random: some kinds at a rate, some once, for a while."""
    draw = np.random.default_rng([seed, 2026])
    kinds = list(draw.choice(list(kind.rates), size=draw.integers(0, 4), replace=False))
    faults = [{"kind": str(k), "rate": float(draw.uniform(0, kind.rates[k]))} for k in kinds]
    for name in draw.choice(list(kind.at), size=draw.integers(0, 3), replace=False):
        at_s, for_s = draw.uniform(0.5, 60.0 if not kind.servos else 20.0), draw.uniform(0.1, kind.at[name])
        faults.append({"kind": str(name), "at_s": float(at_s), "for_s": float(for_s)})
        if name in OF_A_SERVO:
            faults[-1]["id"] = int(draw.integers(1, kind.servos + 1))
    return {"seed": seed, "faults": faults}


def trial(robot, seed, results, *more):
    """Exit code and what was said on stderr."""
    faults, kind = results / f"faults-{seed}.yaml", KINDS[robot]
    faults.write_text(yaml.safe_dump(plan(seed, kind)))
    rig = results / f"rig-{robot}-{seed}.yaml"
    rig.write_text(rig_text(robot, seed))
    said = StringIO()
    with redirect_stderr(said), redirect_stdout(StringIO()):
        code = main(
            ["trial", "--robot", robot, "--emulated", "--yes", "--speed", "inf", "--seed", str(seed), *QUICK, *kind.options,
             "--rig", str(rig), "--evaluations", str(kind.evaluations), "--faults", str(faults), "--results", str(results), *more]
        )  # fmt: skip
    return code, said.getvalue()


def rig_text(robot, seed):
    """The shipped rig; of the snake four of five with the servos behind a bridge, which is asked twelve times less often."""
    text = (resources.files("bns.hardware") / "rigs" / f"{robot}.yaml").read_text()
    return text.replace("wiring: bus", "wiring: bridge") if seed % 5 else text


def judged(seed, results, robot="khepera"):
    """How a trial ended, in a word; AssertionError if it did not end as one may."""
    code, said = trial(robot, seed, results)
    assert "Traceback" not in said, said
    folders = list((results / "trials").glob(f"{robot}-{KINDS[robot].task}-{seed}-*-emulated"))
    journals = [f / "journal.jsonl" for f in folders if (f / "journal.jsonl").exists()]
    if code == 2:
        assert not any(past_evaluations(j) for j in journals), said
        return "refused before it moved"
    [journal] = journals
    *_, last = events(journal, "stop")
    assert last["confirmed"] == (code != 4), said
    kept = past_evaluations(journal)
    if code == 4:
        assert "CUT THE POWER" in said
        return "stop not confirmed, and shouted"
    if code == 0:
        assert len(kept) == KINDS[robot].evaluations
        return "done"
    assert code == 3, (code, said)
    driven = {e["evaluation"] for e in events(journal, "driven")}
    assert len(kept) >= len(driven) - 1, "an evaluation was lost"
    again, _ = trial(robot, seed, results, "--resume")
    assert again in {0, 3, 4}
    assert len(past_evaluations(journal)) >= len(kept)
    return "paused, resumed"


def soak(robot, count, first=0):
    """Endings of so many trials, counted."""
    ends = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            ends[judged(seed, Path(folder), robot)] += 1
    return ends


if __name__ == "__main__":
    for end, times in soak(sys.argv[1], int(sys.argv[2])).most_common():
        print(f"{times:5d}  {end}")
