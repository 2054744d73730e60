"""A process with an installed bns that carries out one command after the other: Python and its libraries are loaded once."""

import json
import subprocess
import sys
import threading
from pathlib import Path

LONGEST_S = 600  # for hangs alone
_PROGRAM = """
import json, os, sys, tempfile, traceback
import bns
from bns.__main__ import main
asked, answers = os.fdopen(os.dup(0)), os.fdopen(os.dup(1), "w")
sys.stdin = open(os.devnull)
print(bns.__file__, file=answers, flush=True)
for line in asked:
    order = json.loads(line)
    os.chdir(order["folder"])
    sys.argv, code, said = ["bns", *order["words"]], 1, {}
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        for number, file in enumerate((out, err), start=1):
            os.dup2(file.fileno(), number)
        try:
            code = main()
        except SystemExit as end:
            code = end.code or 0
        except BaseException:
            traceback.print_exc()
        for name, stream, file in (("out", sys.stdout, out), ("err", sys.stderr, err)):
            stream.flush()
            file.seek(0)
            said[name] = file.read()
    print(json.dumps({"code": code, **said}), file=answers, flush=True)
"""


class Typist:
    """``type(words, folder)``: exit code, output and errors of ``bns words``, typed in a folder; ``package``: which bns it is."""

    def __init__(self, environment):
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _PROGRAM], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.package = Path(self._process.stdout.readline()).parent

    def type(self, words, folder):
        """Of a command line without its first word; one that hangs ends the process, and with it the test."""
        guard = threading.Timer(LONGEST_S, self._process.kill)
        guard.start()
        try:
            print(json.dumps({"words": list(words), "folder": str(folder)}), file=self._process.stdin, flush=True)
            answer = self._process.stdout.readline()
        finally:
            guard.cancel()
        assert answer, f"bns {' '.join(words)}: the process ended with {self._process.wait()}"
        said = json.loads(answer)
        return said["code"], said["out"], said["err"]

    def close(self):
        """The process ends."""
        self._process.stdin.close()
        self._process.wait(60)
        self._process.stdout.close()
