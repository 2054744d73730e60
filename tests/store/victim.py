"""A process that is killed in the middle of a fold or compaction: victim.py RESULTS ACTION MOMENT NUMBER.

MOMENT is "before" or "after" call NUMBER (from 1) of the function that moves a finished file to its place
(os.replace) or, with "unlink", before removal NUMBER.
"""

import os
import signal
import sys
from pathlib import Path

from bns.store import Writer, compact

sys.path.insert(0, str(Path(__file__).parent))
from synthetic import failed, records, specs


def deadly(function, moment, number):
    """``function``, but its call ``number`` kills the process."""
    calls = 0

    def call(*arguments, **options):
        nonlocal calls
        calls += 1
        if calls == number and moment != "after":
            os.kill(os.getpid(), signal.SIGKILL)
        result = function(*arguments, **options)
        if calls == number:
            os.kill(os.getpid(), signal.SIGKILL)
        return result

    return call


def sample():
    """Eleven runs that went well and one that did not."""
    return [*records(11), failed(next(specs(1, 3, seed=77)))]


def main(results, action, moment, number):
    if moment == "unlink":
        Path.unlink = deadly(Path.unlink, "before", int(number))
    elif moment != "never":
        os.replace = deadly(os.replace, moment, int(number))
    if action == "compact":
        print(compact(results))
        return
    with Writer(results, "s") as writer:
        for run in sample():
            writer.append(run)
        print("appended", flush=True)
        if action == "append":
            os.kill(os.getpid(), signal.SIGKILL)


if __name__ == "__main__":
    main(*sys.argv[1:])
