"""Why networks are wrong, in words."""

from __future__ import annotations

from collections.abc import Iterator

from bns.diagnose.data.variables import LABELS
from bns.diagnose.residuals.network_errors import FEWEST, FEWEST_TRIALS, MEMORY_S, NetworkErrors

_CAUSES = {
    "thin data": "thin data: the run drove too few such commands",
    "unlearned": "not learned, although the inputs determine it",
    "unknowable": "the inputs cannot know",
    "scatter": "scatter: tracking noise, motors, and anything unexplained",
}
VARIABLES = {
    **LABELS,
    "speed_kept_m_s": f"speed kept from before the last command (m/s; memory of {MEMORY_S:g} s)",
    "wheel_difference_kept_m_s": f"right − left kept from before the last command (m/s; memory of {MEMORY_S:g} s)",
    "heading_rad": "heading halfway through the command (rad)",
}


def network_errors_text(why: NetworkErrors) -> str:
    """Verdict first, then the shares and what speaks for them."""
    return "\n".join(_lines(why))


def _lines(why: NetworkErrors) -> Iterator[str]:
    yield f"why the networks are wrong: {', '.join(why.verdict)}"
    outside, commands = why.sparse_coverage.commands, len(why.distance)
    yield (
        f"  {outside} of {commands} commands lie outside the {why.patterns} training patterns (further than "
        f"{why.radius:.2f} from the nearest; inputs run from -1 to 1)"
    )
    if not why.share:
        yield (
            f"  Among them are {commands - outside} commands; from fewer than {FEWEST}, or from fewer than {FEWEST_TRIALS} "
            "trials, no cause is given. Use measurements of commands like those of the run."
        )
        return
    if outside:
        t = why.sparse_coverage
        yield f"  their squared error is {t.ratio:.1f} times that of the others (95 %: {t.low:.1f} to {t.high:.1f})"
    if "thin-data" in why.verdict:
        yield "  Thin data: more evaluations with such commands would reduce it."
    for one in why.missing_inputs:
        yield (
            f"  The inputs cannot know: among the patterns {one.share:.0%} of the squared error follows "
            f"{VARIABLES.get(one.variable, one.variable)} (p {one.p_value:.2g})."
        )
    if why.missing_inputs:
        yield "  More evaluations will not reduce that; `bns diagnose` says which effect it may be."
    yield f"\n  {'cause':66}{'fraction of squared error':>26}"
    yield from (f"  {_CAUSES[name]:66}{share:26.1%}" for name, share in why.share.items())
