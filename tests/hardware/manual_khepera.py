"""A Khepera III's serial server written from its manual's list of commands alone; it shares no code and no number with `bns`.

A command is a line; its answer begins with the same letter, in lower case, and ends with CR LF. What is unknown is answered `$`.
Numbers of `D` and `I` carry a letter, `l` or `d`; the first character of one without is lost.
"""

import math

UNITS_A_M_S = 144_010.0
"""Of speed, in firmware before 3.0."""
MOST_UNITS = 43_000
M_A_PULSE = 0.1288 / 2764
QUANTUM = 53
"""Speeds that are read come in steps of this."""


class ManualKhepera:
    """Wheels follow their orders with a lag of `lag_s`."""

    def __init__(self, lag_s=0.05):
        self.ordered, self.wheels_m_s, self._pulses = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        self._lag_s, self._then_s, self._heard = lag_s, 0.0, b""

    def turn(self, now_s):
        """Let the wheels turn up to now."""
        passed_s, self._then_s = now_s - self._then_s, now_s
        share = 1.0 - math.exp(-passed_s / self._lag_s)
        for wheel in (0, 1):
            self.wheels_m_s[wheel] += share * (self.ordered[wheel] - self.wheels_m_s[wheel])
            self._pulses[wheel] += passed_s * self.wheels_m_s[wheel] / M_A_PULSE

    def hears(self, data):
        """The answers to the lines that are whole by now."""
        *lines, self._heard = (self._heard + data).replace(b"\r", b"\n").split(b"\n")
        return b"".join(self._answer(line.decode("latin-1")) + b"\r\n" for line in lines if line)

    def _answer(self, line):
        letter, *words = line.split(",")
        try:
            return self._carried_out(letter, words).encode()
        except ValueError:
            return b"$"

    def _carried_out(self, letter, words):
        if letter == "D" and len(words) == 2:
            units = [max(-MOST_UNITS, min(MOST_UNITS, int(word[1:] or 0))) for word in words]
            self.ordered = [unit / UNITS_A_M_S for unit in units]
            return "d"
        if letter == "I" and len(words) == 2:
            self._pulses = [float(word[1:] or 0) for word in words]
            return "i"
        if letter == "V" and words:
            return {"0": "v,8,1023"}.get(words[0], "v,0,120")
        told = {
            "E": lambda: [round(speed * UNITS_A_M_S / QUANTUM) * QUANTUM for speed in self.wheels_m_s],
            "R": lambda: [int(pulses) for pulses in self._pulses],
            "B": lambda: [2, 4],
            "N": lambda: [100] * 11 + [int(self._then_s * 1000) % 65536],
            "O": lambda: [200] * 11 + [int(self._then_s * 1000) % 65536],
            "M": list,
            "H": list,
        }
        return ",".join([letter.lower(), *(str(number) for number in told[letter]())]) if letter in told else "$"
