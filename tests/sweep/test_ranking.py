"""A sweep that stops when its best are known: the same ranking as the complete one, from fewer runs, after any kill."""

from collections import Counter
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import sweep_jobs
from sweep_jobs import make_sweep

import bns
from bns.cli.main import main
from bns.errors import SpecError
from bns.spec import RunSpec
from bns.store.record import RunRecord
from bns.sweep.confirm import best
from bns.sweep.expand.grid import parse_sweep
from bns.sweep.expand.order import ordered_specs
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.ranking.betting import capital
from bns.sweep.ranking.confidence import confidences
from bns.sweep.ranking.race import Aim, Results, bar, next_runs, possible
from bns.sweep.ranking.stored import Race
from bns.sweep.ranking.until import run_until_ranked
from bns.sweep.request import Request
from bns.sweep.runner import run_sweep
from tests.sweep.ranking_study import TOP, least_runs, outcome, published_rates, raced, ranked, spread_rates

CERTAIN, SURE = Aim(TOP, confidence=1.0), Aim(TOP)


def tiny(combinations, seeds):
    """A sweep file of short runs."""
    sizes = ", ".join(str(10 + n) for n in range(combinations))
    short = "evaluations: 3, generations_per_evaluation: 1, training_iterations_per_evaluation: 5"
    return f"name: race\nrobot: khepera\nseeds: {seeds}\nfixed: {{{short}}}\ngrid: {{population_size: [{sizes}]}}\n"


def study(draw, combinations=75, seeds=30, spread=2.5, centre=-0.5):
    """Success or not of every run of a complete sweep, and the rates behind it."""
    rate = 1 / (1 + np.exp(-(spread * draw.standard_normal(combinations) + centre)))
    return rate, (draw.random((combinations, seeds)) < rate[:, None]).astype(float)


def one(outcomes):
    """Evidence of the results of one combination, in the order of its seeds."""
    return lambda seeds, total: float(
        capital(np.pad(outcomes, (0, seeds - len(outcomes)))[None], np.arange(seeds)[None] < len(outcomes), total)[0]
    )


@pytest.mark.parametrize(
    ("rates", "studies", "share"),
    [
        pytest.param(spread_rates(-0.5, 75), 100, 0.4, marks=pytest.mark.slow),
        (spread_rates(-2.0, 75), 40, 0.42),
        (spread_rates(-0.5, 500), 3, 0.2),
    ],
    ids=["75", "75-rare", "500"],
)
def test_resampled_studies_have_the_same_winners_in_the_same_order_from_a_part_of_the_runs(rates, studies, share):
    draw, found = np.random.default_rng(1), []
    for _ in range(studies):
        rate = rates(draw)
        found.append(outcome((draw.random((len(rate), 30)) < rate[:, None]).astype(float), SURE))
    assert sum(each.same for each in found) >= 0.95 * studies
    assert np.mean([each.share for each in found]) < share


def test_the_published_study_is_decided_from_fewer_runs_the_more_may_be_let_pass():
    draw = np.random.default_rng(4)
    rate = published_rates("infinity", 200)(draw)
    outcomes = (draw.random((200, 30)) < rate[:, None]).astype(float)
    found = [outcome(outcomes, aim) for aim in (CERTAIN, SURE, Aim(TOP, within=0.1), Aim(TOP, within=0.2))]
    shares = [each.share for each in found]
    assert shares == sorted(shares, reverse=True)
    assert shares[-1] < 0.6 * shares[0]
    assert found[0].same
    assert [each.lost < limit + 1e-9 for each, limit in zip(found[1:], (0.0, 0.1, 0.2), strict=True)] == [True] * 3


def test_what_is_left_out_is_hardly_ever_better_by_more_than_is_let_pass():
    draw, beyond, differ = np.random.default_rng(6), 0, 0
    for _ in range(60):
        rate = draw.beta(2.0, 3.0, 60)
        each = outcome((draw.random((60, 30)) < rate[:, None]).astype(float), Aim(TOP, within=0.1))
        beyond, differ = beyond + (each.lost >= 0.1), differ + (each.lost > 0)
    assert beyond <= 3
    assert differ > 30  # something is let pass indeed


@pytest.mark.parametrize("confidence", [0.5, 0.95])
def test_winners_are_lost_no_oftener_than_the_confidence_says_even_where_all_are_alike(confidence):
    draw, lost = np.random.default_rng(8), 0
    for _ in range(60):
        outcomes = (draw.random((40, 30)) < 0.2).astype(float)
        lost += outcome(outcomes, Aim(TOP, confidence)).lost > 0
    assert lost <= 60 * (1 - confidence)
    assert outcome(outcomes, CERTAIN).share > outcome(outcomes, Aim(TOP, 0.5)).share


def test_no_rule_needs_less_than_the_bound():
    """Two totals of two seeds: one look tells 0 from 2; without errors a rule that must tell 0 from 1 looks at both."""
    assert least_runs(0, 2, 2, 0.0) == pytest.approx(1.0)
    assert least_runs(0, 1, 2, 0.0) == pytest.approx(2.0)
    assert least_runs(0, 1, 2, 0.5) == pytest.approx(0.0)
    assert 0.0 < least_runs(6, 18, 30, 0.05) < least_runs(12, 18, 30, 0.05) < least_runs(17, 18, 30, 0.05) <= 30.0


def test_equals_of_the_last_place_are_all_run_to_the_end():
    outcomes = np.zeros((40, 10))
    outcomes[5:25, :8] = 1.0
    assert raced(outcomes).whole[5:25].all()


def test_bounds_hold_whatever_the_other_runs_do():
    draw = np.random.default_rng(3)
    _, outcomes = study(draw, 30, 12)
    outcomes[draw.random(outcomes.shape) < 0.1] = np.nan  # runs that failed
    for rounds in range(1, 8):
        results = raced(outcomes, CERTAIN, rounds)
        low, high = results.bounds()
        mean = np.nan_to_num(np.nanmean(outcomes, axis=1))
        assert (low <= mean + 1e-12).all()
        assert (mean <= high + 1e-12).all()
        assert possible(results, CERTAIN)[ranked(mean)].all()
        assert bar(results, CERTAIN) <= np.sort(mean)[-TOP] + 1e-12


def test_a_bettor_gains_nothing_from_totals_that_are_reached():
    """Results without replacement of which the total is as supposed: a capital of 20 is rare, at any of thirty looks."""
    draw, rich = np.random.default_rng(5), 0
    for _ in range(2000):
        outcomes = draw.permutation(np.repeat([1.0, 0.0], [20, 10]))
        rich += one(outcomes[:25])(30, 20) >= 20
    assert rich / 2000 < 0.05
    assert one(np.array([0.0, 0.0, 1.0]))(10, 9) == np.inf
    assert one(np.zeros(5))(30, 20) > 20
    assert one(np.ones(5))(30, 20) == 1.0
    totals = [one(outcomes[:12])(30, total) for total in range(5, 29)]
    assert totals == sorted(totals)


def test_confidence_of_a_ranking_cut_short_is_kept_and_grows_to_certainty():
    draw, told, right = np.random.default_rng(7), [], []
    for _ in range(60):
        _, outcomes = study(draw, 60, 30)
        for rounds in (10, 15, 20, 25):
            results = raced(outcomes, SURE, rounds)
            mine = ranked(results.bounds()[0], results.whole)
            told += confidences(results, mine, SURE)
            kth = np.sort(outcomes.mean(1))[-TOP]
            right += [outcomes[n].mean() >= kth for n in mine]
    told, right = np.array(told), np.array(right)
    assert (told >= 0.9).sum() > 50
    assert right[told >= 0.9].mean() >= 0.9
    assert min(confidences(raced(outcomes, SURE), ranked(outcomes.mean(1)), SURE)) >= 0.95
    assert confidences(raced(outcomes), ranked(outcomes.mean(1)), CERTAIN) == [1.0] * TOP


def test_the_last_of_the_best_is_as_sure_as_what_is_known_of_its_rivals():
    results = Results(np.full((11, 10), np.nan), np.zeros((11, 10), bool))
    results.success[:10], results.seen[:10] = 1.0, True
    results.success[:10, 5:] = 0.0
    assert confidences(results, list(range(10)), SURE) == [1.0] * 9 + [0.0]
    results.success[10, :5], results.seen[10, :5] = 0.0, True
    *sure, last = confidences(results, list(range(10)), SURE)
    assert (sure, last) == ([1.0] * 9, pytest.approx(1 - 10 / one(np.zeros(5))(10, 5)))
    assert 0.5 < last < 1.0
    assert confidences(results, list(range(10)), Aim(TOP, within=0.1))[-1] == 1.0


def test_a_failed_run_is_no_evidence_against_its_combination():
    outcomes = np.zeros((30, 20))
    outcomes[:9], outcomes[9:, :8] = 1.0, 1.0
    outcomes[20, 8:], outcomes[20, :8] = 1.0, np.nan  # fails first, succeeds in all else: the tenth
    results = raced(outcomes, SURE)
    assert results.whole[[*range(9), 20]].all()
    assert not results.whole.all()


def test_what_is_certain_to_be_among_the_best_is_run_on_however_badly_it_began():
    results = Results(np.full((11, 30), np.nan), np.zeros((11, 30), bool))
    results.success[:10], results.seen[:10] = 0.0, True
    results.success[:10, :12] = 1.0
    results.success[10, :14], results.success[10, 14:27], results.seen[10, :27] = 0.0, 1.0, True
    assert capital(results.hopeful, results.seen, 12.0)[10] > SURE.level
    assert possible(results, SURE)[10]
    assert next_runs(results, SURE)[0] == (10, 27)


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


def test_a_run_that_always_fails_is_tried_once_a_call_when_failed_ones_are_to_be_retried(tmp_path):
    sweep, tried = make_sweep(combos=12), Counter()
    broken = ordered_specs(sweep)[0].run_id

    def job(spec):
        tried[spec.run_id] += 1
        if tried[spec.run_id] > 3:
            raise RuntimeError(f"{spec.run_id} is tried again and again")
        well = sweep_jobs.ok(spec)
        return RunRecord(spec, {**well.run, "status": "failed", "error": "ValueError: no"}) if spec.run_id == broken else well

    def carry_out(part, request):
        return run_sweep(part, request.results, job=job, executor=SerialExecutor(job), retry_failed=request.retry_failed)

    for call in (1, 2):
        request = Request(tmp_path, retry_failed=True)
        summary, ranking = run_until_ranked(SimpleNamespace(carry_out=carry_out), sweep, request)
        assert (tried[broken], summary.failed, summary.new_failed, ranking.open) == (call, 1, 1, 0)


def test_a_first_round_cut_short_counts_its_runs_and_saves_nothing(tmp_path):
    sweep = make_sweep(combos=12)

    def carry_out(part, request):
        few, executor = replace(part, chosen=part.chosen[:3]), SerialExecutor(sweep_jobs.ok)
        return replace(run_sweep(few, request.results, job=sweep_jobs.ok, executor=executor), stopped_by="budget")

    summary, ranking = run_until_ranked(SimpleNamespace(carry_out=carry_out), sweep, Request(tmp_path))
    assert (summary.done, ranking.runs, ranking.best) == (3, 3, ())
    first, *_, last = ranking.in_words().splitlines()
    assert first == "no combination has all of its runs yet, so none is ranked"
    assert f"not decided: {ranking.open} more combinations may be among them" in last
    assert last.endswith(f"; 3 of {sweep.total} runs so far")


@pytest.mark.parametrize(
    ("good", "shown", "said"),
    [
        ((), ["tie"] * 10, "circle: places 1 to 10 tie: 2 more combinations have the same success (0.000)"),
        ((3, 4), ["100.0%"] * 2 + ["tie"] * 8, "circle: places 3 to 10 tie: 2 more combinations have the same success (0.000)"),
        (range(2, 12), ["100.0%"] * 10, "the 10 best of each task are decided (at 0.95 confidence for each task); "),
        (range(1, 12), ["tie"] * 10, "circle: places 1 to 10 tie: 1 more combination has the same success (1.000)"),
    ],
)
def test_combinations_that_tie_are_not_said_to_be_decided(tmp_path, good, shown, said):
    sweep = make_sweep(combos=12)
    well = {RunSpec(robot="khepera", seed=seed, **sweep.combos[n]).run_id for n in good for seed in sweep.all_seeds}

    def job(spec):
        done = sweep_jobs.ok(spec)
        success = np.full_like(done.tables["evals"]["success"], spec.run_id in well)
        return replace(done, tables={**done.tables, "evals": {**done.tables["evals"], "success": success}})

    def carry_out(part, request):
        return run_sweep(part, request.results, job=job, executor=SerialExecutor(job))

    _, ranking = run_until_ranked(SimpleNamespace(carry_out=carry_out), sweep, Request(tmp_path))
    lines = ranking.in_words().splitlines()
    assert [line.split()[3] for line in lines[1:11]] == shown
    assert any(line.startswith(said) for line in lines)
    assert ("decided (" in ranking.in_words()) == ("tie" not in shown)


@pytest.mark.slow
def test_from_the_command_line(tmp_path, capsys):
    """Eleven combinations of tiny runs: what is run has the numbers of the complete sweep, and the ranking is its."""
    file = tmp_path / "race.yaml"
    file.write_text(tiny(11, 2))
    assert main(["sweep", str(file), "--jobs", "1", "--until", "ranking", "--results", str(tmp_path / "a")]) == 0
    said = capsys.readouterr()
    assert "the 10 best of each task are decided but for ties (" in said.out  # runs so short never succeed
    assert "circle: places 1 to 10 tie: 1 more combination has the same success (0.000)" in said.out
    assert "100.0%" not in said.out
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


@pytest.mark.parametrize(("option", "value", "said"), [("confidence", 0.2, "0.5 to 1"), ("within", -0.1, "0 to less than 1")])
def test_an_aim_that_cannot_be_is_refused(tmp_path, capsys, option, value, said):
    file = tmp_path / "race.yaml"
    file.write_text(tiny(2, 1))
    asked = ["sweep", str(file), "--results", str(tmp_path / "a"), f"--{option}={value}"]
    assert main([*asked, "--until", "ranking"]) == 2
    assert said in capsys.readouterr().err
    assert main(asked) == 2
    assert f"--{option}: only with --until ranking" in capsys.readouterr().err
    with pytest.raises(SpecError, match=said):
        bns.Sweep.from_file(file).run(tmp_path / "a", until="ranking", **{option: value})
    with pytest.raises(SpecError, match='until="ranking"'):
        bns.Sweep.from_file(file).run(tmp_path / "a", **{option: value})
