"""Sound files of each kind, and how they are spoilt: hypothesis strategies."""

from __future__ import annotations

from hypothesis import strategies as st

SWEEP = """name: demo
robot: khepera
seeds: 2
fixed:
  evaluations: 3
grid:
  mutation_rate: [0.1, 0.2]
  task: [circle, infinity]
zip:
  population_size: [100, 200]
  tournament_size: [0.4, 0.5]
exclude:
  - {mutation_rate: 0.1, task: circle}
include:
  - {mutation_rate: 0.3}
"""
MODEL = """base: differential-drive
wheelbase_m: 0.0884
dt_s: 0.005
jitter: {wheel_speed_relative: 0.01, basis: guess, reason: as others}
noise: {position_m: 0.001, heading_rad: 0.01, basis: guess, reason: as others}
effects:
  - name: motor-lag
    values: {tau_s: 0.1}
    intervals: {tau_s: [0.05, 0.2]}
    basis: guess
    reason: seen
  - {name: rub, term: k * v * abs(w), on: v, values: {k: 0.1}, basis: fitted, reason: seen}
provenance: {data: log.csv}
"""
MAPPING = """columns:
  t_s: {from: time, unit: ms}
  x_m: {from: X, unit: cm, scale: -1, offset: 0.5}
  heading_rad: {from: yaw, unit: deg, clockwise: true, zero_deg: 90}
  left_m_s: {from: l, scale: 0.00009, counts: true}
also:
  - file: other.csv
    columns: {t_s: {from: t}, right_m_s: {from: r}}
wheelbase_m: 0.1
hold_commands_s: 0.5
trials: {gap_s: 2}
repeated_poses: lost
"""
RIG = """robot: khepera
port: /dev/rfcomm0
surface_m: {x: [-0.9, 0.9], y: [-0.7, 0.7]}
tracker: {kind: wii, device: x, height_m: 2.4, view_rad: 0.75}
lost_s: 0.3
late_s: 0.2
placed_within_m: 0.1
driver: {speed: 3}
"""
FAULTS = """seed: 3
faults:
  - {kind: lost-reply, rate: 0.02}
  - {kind: hang-up, at_s: 40, for_s: 1.5}
  - {kind: silent-servo, rate: 0.1, id: 3}
"""
CSV = "trial,t_s,left_m_s,right_m_s,x_m,y_m,heading_rad,battery_v\n" + "".join(
    f"{trial},{step / 5:g},0.1,0.12,{step / 50:g},{step * step / 9000:g},{step / 100:g},8\n"
    for trial in (1, 2, 3)
    for step in range(15)
)
FORMULA = "k * v * abs(w) + min(v, c) / (1 + exp(-w)) ** 2"

ODD = (
    "''", "~", "[]", "{}", "[1, 2]", "{a: 1}", "0", "-1", "1e308", "1e-400", "1e400", ".nan", ".inf", "-.inf", "9**9", "true",
    "on",
    "999999999999999999999999", "2026-01-01", "!!int ''", "!!binary x", "!!python/object:os.system {}", "&a [*a]", "*b", "'\\0'",
    "x" * 3000, "[" * 40 + "]" * 40, "é", "0x10", "1:30", "\t", "|", "? a", "<<: {a: 1}", "nan", "inf", "-", "", "1,5", '"',
)  # fmt: skip
PIECES = (
    "k", "v", "w", "1", "0", "2.5", "1e300", "9**9**9", "+", "-", "*", "/", "**", "(", ")", ",", "abs(", "max(", "log(", "sqrt(",
    "if", "lambda", "'a'", "[", "]", ".", "=", ":", "True", "1j", "not", "__import__", "\n", "é", "0x1F", "{", "}", "%", "//",
    "@",
)  # fmt: skip


@st.composite
def spoilt(draw: st.DrawFn, text: str) -> bytes:
    """``text`` after one to four changes: values replaced, lines lost, doubled or moved, letters and bytes put in, cut off."""
    for _ in range(draw(st.integers(1, 4))):
        lines = text.split("\n")
        at = draw(st.integers(0, len(lines) - 1))
        what = draw(st.sampled_from(("value", "value", "cell", "lose", "double", "indent", "letters", "cut", "swap")))
        if what == "value":
            lines[at] = lines[at].split(":")[0] + ": " + draw(st.sampled_from(ODD))
        elif what == "cell":
            cells = lines[at].split(",")
            cells[draw(st.integers(0, len(cells) - 1))] = draw(st.sampled_from(ODD))
            lines[at] = ",".join(cells)
        elif what == "lose":
            del lines[at]
        elif what == "double":
            lines[at:at] = [lines[at]] * draw(st.integers(1, 30))
        elif what == "indent":
            lines[at] = " " * draw(st.integers(0, 5)) + lines[at].lstrip()
        elif what == "letters":
            place = draw(st.integers(0, len(lines[at])))
            lines[at] = lines[at][:place] + draw(st.text(max_size=6)) + lines[at][place:]
        elif what == "swap":
            other = draw(st.integers(0, len(lines) - 1))
            lines[at], lines[other] = lines[other], lines[at]
        text = "\n".join(lines)
        if what == "cut":
            text = text[: draw(st.integers(0, len(text)))]
    data = text.encode("utf-8", "surrogatepass")
    if draw(st.integers(0, 9)) == 0 and data:
        place = draw(st.integers(0, len(data) - 1))
        data = data[:place] + draw(st.binary(min_size=1, max_size=4)) + data[place:]
    return data


def formulas() -> st.SearchStrategy[str]:
    """Formulas of pieces at random, and a sound one with pieces put in."""
    loose = st.lists(st.sampled_from(PIECES), max_size=40).map(" ".join)
    put_in = st.tuples(st.integers(0, len(FORMULA)), st.sampled_from(PIECES)).map(
        lambda change: FORMULA[: change[0]] + change[1] + FORMULA[change[0] :]
    )
    return st.one_of(loose, put_in)
