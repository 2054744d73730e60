"""The page that says how many mutants the tests kill."""

import argparse
from collections.abc import Mapping, Sequence

HEAD = """# Mutation testing

Written by `make mutants`: cosmic-ray changes one comparison, operator, number or truth value at a time in the modules
where numbers are made, and the tests nearest to each must fail. A sample (seed {seed}, {minutes:g} minutes), drawn in
turn from all groups of modules.

| modules | mutation sites | mutants | killed | fraction |
|---|---|---|---|---|
"""


def written(
    sizes: Mapping[str, int], killed: Mapping[str, int], survivors: Mapping[str, Sequence[str]], options: argparse.Namespace
) -> str:
    """The page, as Markdown."""
    rows = [(group, sizes[group], killed[group] + len(survivors[group]), killed[group]) for group in sizes]
    rows.append(("all", *(sum(column) for column in zip(*(row[1:] for row in rows), strict=True))))
    table = [f"| {group} | {size} | {tried} | {found} | {found / max(tried, 1):.0%} |" for group, size, tried, found in rows]
    listed = [f"{group}: {text}" for group, texts in survivors.items() for text in texts]
    page = [*table, "", "## Survivors", "", "```text", *listed, "```"]
    return HEAD.format(seed=options.seed, minutes=options.minutes) + "\n".join(page) + "\n"
