"""A sweep that stops when its best are known: the same ranking as the complete one, from fewer runs, after any kill."""

import numpy as np
import pytest

import bns
from bns.cli.main import main
from bns.errors import SpecError
from bns.sweep.confirm import best
from bns.sweep.expand.grid import parse_sweep
from bns.sweep.ranking.confidence import capital, confidences
from bns.sweep.ranking.race import Results, bar, next_runs, possible
from bns.sweep.ranking.stored import Race

TOP = 10


def tiny(combinations, seeds):
    """A sweep file of short runs."""
    sizes = ", ".join(str(10 + n) for n in range(combinations))
    short = "evaluations: 3, generations_per_evaluation: 1, training_iterations_per_evaluation: 5"
    return f"name: race\nrobot: khepera\nseeds: {seeds}\nfixed: {{{short}}}\ngrid: {{population_size: [{sizes}]}}\n"


def study(draw, combinations=75, seeds=30, spread=2.5, centre=-0.5):
    """Success or not of every run of a complete sweep, and the rates behind it."""
    rate = 1 / (1 + np.exp(-(spread * draw.standard_normal(combinations) + centre)))
    return rate, (draw.random((combinations, seeds)) < rate[:, None]).astype(float)


def empty(outcomes):
    return Results(np.full(outcomes.shape, np.nan), np.zeros(outcomes.shape, bool))


def raced(outcomes, rounds=10**6):
    """What a race reveals of a complete study."""
    results = empty(outcomes)
    while rounds and (batch := next_runs(results, TOP)):
        at = tuple(np.array(batch).T)
        assert not results.seen[at].any()
        results.seen[at], results.success[at] = True, outcomes[at]
        rounds -= 1
    return results


def ranked(means, among=None):
    order = np.argsort(-means, kind="stable")
    return [n for n in order.tolist() if among is None or among[n]][:TOP]


@pytest.mark.parametrize(("combinations", "studies", "share"), [(75, 100, 0.5), (500, 5, 0.25)])
def test_resampled_studies_have_the_same_winners_in_the_same_order_from_a_part_of_the_runs(combinations, studies, share):
    draw, shares = np.random.default_rng(1), []
    rate, _ = study(draw, combinations)
    for _ in range(studies):
        outcomes = (draw.random((combinations, 30)) < rate[:, None]).astype(float)
        results = raced(outcomes)
        assert ranked(outcomes.mean(1), results.whole) == ranked(outcomes.mean(1))
        shares.append(results.seen.mean())
    assert np.mean(shares) < share


def test_equals_of_the_last_place_are_all_run_to_the_end():
    outcomes = np.zeros((40, 10))
    outcomes[5:25, :8] = 1.0
    assert raced(outcomes).whole[5:25].all()


def test_bounds_hold_whatever_the_other_runs_do():
    draw = np.random.default_rng(3)
    _, outcomes = study(draw, 30, 12)
    outcomes[draw.random(outcomes.shape) < 0.1] = np.nan  # runs that failed
    for rounds in range(1, 8):
        results = raced(outcomes, rounds)
        low, high = results.bounds()
        mean = np.nan_to_num(np.nanmean(outcomes, axis=1))
        assert (low <= mean + 1e-12).all()
        assert (mean <= high + 1e-12).all()
        assert possible(results, TOP)[ranked(mean)].all()
        assert bar(results, TOP) <= np.sort(mean)[-TOP] + 1e-12


def test_a_bettor_gains_nothing_from_totals_that_are_reached():
    """Results without replacement of which the total is as supposed: a capital of 20 is rare, at any of thirty looks."""
    draw, rich = np.random.default_rng(5), 0
    for _ in range(2000):
        outcomes = draw.permutation(np.repeat([1.0, 0.0], [20, 10]))
        rich += capital(outcomes[:25], 30, 20) >= 20
    assert rich / 2000 < 0.05
    assert capital(np.array([0.0, 0.0, 1.0]), 10, 9) == np.inf
    assert capital(np.zeros(5), 30, 20) > 20


def test_confidence_of_a_ranking_cut_short_is_kept_and_grows_to_certainty():
    draw, told, right = np.random.default_rng(7), [], []
    for _ in range(60):
        _, outcomes = study(draw, 60, 30)
        for rounds in (10, 15, 20, 25):
            results = raced(outcomes, rounds)
            mine = ranked(results.bounds()[0], results.whole)
            told += confidences(results, mine, TOP)
            kth = np.sort(outcomes.mean(1))[-TOP]
            right += [outcomes[n].mean() >= kth for n in mine]
    told, right = np.array(told), np.array(right)
    assert (told >= 0.9).sum() > 50
    assert right[told >= 0.9].mean() >= 0.9
    results = raced(outcomes)
    assert confidences(results, ranked(outcomes.mean(1), results.whole), TOP) == [1.0] * TOP


def test_the_last_of_the_best_is_as_sure_as_what_is_known_of_its_rivals():
    results = Results(np.full((11, 10), np.nan), np.zeros((11, 10), bool))
    results.success[:10], results.seen[:10] = 1.0, True
    results.success[:10, 5:] = 0.0
    assert confidences(results, list(range(10)), TOP) == [1.0] * 9 + [0.0]
    results.success[10, :5], results.seen[10, :5] = [0.0, 0.0, 1.0, 0.0, 0.0], True
    *sure, last = confidences(results, list(range(10)), TOP)
    assert (sure, last) == ([1.0] * 9, pytest.approx(1 - 1 / capital(results.success[10, :5], 10, 5)))
    assert 0.5 < last < 1.0


def small_sweep(combinations=19, seeds=12):
    rates = ", ".join(f"{0.02 + 0.05 * n:.2f}" for n in range(combinations))
    return parse_sweep(f"name: race\nrobot: khepera\nseeds: {seeds}\ngrid:\n  mutation_rate: [{rates}]\n", "race.yaml")


def test_a_race_killed_anywhere_goes_the_same_way():
    sweep, draw = small_sweep(), np.random.default_rng(2)
    outcomes = (draw.random((19, 12)) < np.linspace(0, 1.5, 19)[:, None]).astype(float)

    def asked(kills):
        """Runs in the order in which they are asked for; a kill leaves a part of a round."""
        stored, order = {}, []
        race = Race(sweep)
        while runs := race.todo(dict.fromkeys(stored, "ok"), stored):
            if kills and draw.random() < 0.5:
                keep = draw.random(len(runs)) < 0.5
                runs, race = [run for run, kept in zip(runs, keep, strict=True) if kept], Race(sweep)
            stored |= {race.run_id(n, seed): outcomes[n, seed] for n, seed in runs}
            order += runs
        return order

    whole = asked(kills=False)
    for _ in range(4):
        assert sorted(asked(kills=True)) == sorted(whole)
    assert len(whole) < 19 * 12


@pytest.mark.slow
def test_from_the_command_line(tmp_path, capsys):
    """Eleven combinations of tiny runs: what is run has the numbers of the complete sweep, and the ranking is its."""
    file = tmp_path / "race.yaml"
    file.write_text(tiny(11, 2))
    assert main(["sweep", str(file), "--jobs", "1", "--until", "ranking", "--results", str(tmp_path / "a")]) == 0
    said = capsys.readouterr()
    assert "the 10 best of each task are decided" in said.out
    assert "100.0%" in said.out
    result = bns.Sweep.from_file(file).run(tmp_path / "a", jobs=1, until="ranking")
    assert (result.counts.new, result.finished, len(result.ranking.best)) == (0, True, 10)
    whole = bns.Sweep.from_file(file).run(tmp_path / "b", jobs=1)
    described = bns.Sweep.from_file(file).described
    assert [one.combination for one in result.ranking.best] == best(described, tmp_path / "b", 10)
    assert whole.done == 22
    a, b = (bns.load(tmp_path / store).set_index(["run_id", "evaluation"]).sort_index() for store in "ab")
    same = [name for name in a.columns if not name.endswith("_s")]
    assert a[same].equals(b.loc[a.index, same])


@pytest.mark.parametrize("more", [["--shard", "1/2"], ["--confirm-top", "3"], ["--dry-run"]])
def test_what_does_not_go_together_is_refused(tmp_path, capsys, more):
    file = tmp_path / "race.yaml"
    file.write_text(tiny(2, 1))
    assert main(["sweep", str(file), "--until", "ranking", "--results", str(tmp_path / "a"), *more]) == 2
    assert "--until ranking" in capsys.readouterr().err
    with pytest.raises(SpecError, match="ranking"):
        bns.Sweep.from_file(file).run(tmp_path / "a", until="tomorrow")
