"""Trials with faults at random: `python -m tests.hardware.soak 200` counts how they end."""

import sys
import tempfile
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import yaml

from bns.cli import main
from bns.hardware.journal import events
from bns.trial.folder import past_evaluations

EVALUATIONS = 5
QUICK = ["--population-size", "20", "--training-iterations-per-evaluation", "20", "--generations-per-evaluation", "2"]
RATES = {
    "lost-request": 0.05, "lost-reply": 0.05, "corrupt-reply": 0.05, "bus-fault": 0.05, "late-reply": 0.03,
    "lost-marker": 0.05, "stuck-marker": 0.05, "swapped-markers": 0.3, "reflection": 0.3,
}  # fmt: skip
AT = {"hang-up": 2.5, "brown-out": 3.0, "lost-marker": 4.0, "stuck-marker": 4.0, "bus-fault": 1.5}


def plan(seed):
    """A fault plan drawn at random: some kinds at a rate, some once, for a while."""
    draw = np.random.default_rng([seed, 2026])
    kinds = list(draw.choice(list(RATES), size=draw.integers(0, 4), replace=False))
    faults = [{"kind": str(k), "rate": float(draw.uniform(0, RATES[k]))} for k in kinds]
    for kind in draw.choice(list(AT), size=draw.integers(0, 3), replace=False):
        at_s, for_s = draw.uniform(0.5, 60.0), draw.uniform(0.1, AT[kind])
        faults.append({"kind": str(kind), "at_s": float(at_s), "for_s": float(for_s)})
    return {"seed": seed, "faults": faults}


def trial(seed, results, *more):
    """Exit code and what was said on stderr."""
    faults = results / f"faults-{seed}.yaml"
    faults.write_text(yaml.safe_dump(plan(seed)))
    said = StringIO()
    with redirect_stderr(said), redirect_stdout(StringIO()):
        code = main(
            ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--seed", str(seed), *QUICK,
             "--evaluations", str(EVALUATIONS), "--faults", str(faults), "--results", str(results), *more]
        )  # fmt: skip
    return code, said.getvalue()


def judged(seed, results):
    """How a trial ended, in a word; AssertionError if it did not end as one may."""
    code, said = trial(seed, results)
    assert "Traceback" not in said, said
    folders = list((results / "trials").glob(f"khepera-circle-{seed}-*-emulated"))
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
        assert len(kept) == EVALUATIONS
        return "done"
    assert code == 3, (code, said)
    driven = {e["evaluation"] for e in events(journal, "driven")}
    assert len(kept) >= len(driven) - 1, "an evaluation was lost"
    again, _ = trial(seed, results, "--resume")
    assert again in {0, 3, 4}
    assert len(past_evaluations(journal)) >= len(kept)
    return "paused, gone on with"


def soak(count, first=0):
    """Endings of so many trials, counted."""
    ends = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            ends[judged(seed, Path(folder))] += 1
    return ends


if __name__ == "__main__":
    for end, times in soak(int(sys.argv[1])).most_common():
        print(f"{times:5d}  {end}")
