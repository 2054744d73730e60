"""What takes the place of an accepted effect: which exchanges are fitted, and which are far behind."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.select import acceptance, exchanges, forwards, look_back, stepwise
from bns.diagnose.select.acceptance import MIN_GAIN, Acceptance
from bns.diagnose.select.exchanges import BEHIND, BEHIND_LOSS, SCREEN, Entry, Exchanges
from bns.diagnose.select.forwards import Forwards
from bns.diagnose.select.look_back import LookBack
from bns.diagnose.select.result import Candidate
from bns.diagnose.select.stepwise import StepwiseSelection
from bns.physics.decoys import DECOYS
from bns.physics.effects import effect_named
from tests.diagnose.worlds import NOMINAL


def in_place(monkeypatch, start, fitted, lacking=1000.0, reached=0.0, known=()):
    """The loss of an exchange whose start and fit have these losses; None where it is not tried to the end."""
    begin = SimpleNamespace(loss=start, model="start", jacobian_by_parameter={})
    monkeypatch.setattr(exchanges, "best_start", lambda *_: begin)
    loose = SimpleNamespace(fit=lambda *_, **__: SimpleNamespace(loss=fitted, model="fitted"))
    problem = SimpleNamespace(fit=lambda model, nearby: SimpleNamespace(loss=fitted, model=model))
    one = Exchanges(None, {}, {}, lambda _: None)
    fit, without = SimpleNamespace(jacobian_by_parameter={}), SimpleNamespace(loss=lacking)
    found = one._in_place(problem, fit, loose, without, reached, dict(known), SimpleNamespace(name="e"))
    return None if found is None else found.model


def test_what_does_too_little_from_its_best_start_is_not_fitted(monkeypatch):
    enough = 1000.0 * SCREEN
    assert in_place(monkeypatch, 1000.0 - 1.01 * enough, 0.0) == "fitted"
    assert in_place(monkeypatch, 1000.0 - 0.99 * enough, 0.0) is None


@pytest.mark.parametrize("whole", [1e3, 1e-3])
def test_what_ends_far_behind_is_dropped_by_the_wider_of_a_share_and_a_loss(monkeypatch, whole):
    far = max(BEHIND * whole, BEHIND_LOSS)
    assert in_place(monkeypatch, 0.0, 0.99 * far, lacking=whole) == "fitted"
    assert in_place(monkeypatch, 0.0, 1.01 * far, lacking=whole) is None


def test_what_was_fitted_in_the_round_before_is_not_looked_for_again(monkeypatch):
    known = SimpleNamespace(loss=0.0, model="known")
    assert in_place(monkeypatch, 1000.0, 1000.0, known={"e": known}) == "known"


def test_exchanges_are_kept_for_the_same_problem_and_the_same_effects_alone(monkeypatch):
    one = Exchanges(SimpleNamespace(screening=None), {}, {}, lambda _: None)
    asked = []
    lacking = SimpleNamespace(fit=lambda model: None, loss=lambda model: 0.0)
    monkeypatch.setattr(exchanges, "problem_for", lambda _, model: asked.append(model) or lacking)
    fit, problem, other = SimpleNamespace(model=SimpleNamespace(without=lambda name: name)), SimpleNamespace(), SimpleNamespace()
    for where, accepted in ((problem, ("a",)), (problem, ("a",)), (problem, ("a", "b")), (other, ("a", "b"))):
        assert one.of(where, fit, accepted) == []
    assert asked == ["a", "a", "b", "a", "b"]
    one.forget()
    one.of(other, fit, ("a", "b"))
    assert asked[5:] == ["a", "b"]


def test_a_round_is_of_an_effect_that_came_in_then_beside_the_same_others():
    entry = Entry(None, None, ("a",), SimpleNamespace(selected="b"))
    assert entry.of("b", ("b", "a"))
    assert not entry.of("a", ("a", "b"))
    assert not entry.of("b", ("a", "b", "c"))
    assert not entry.of("b", ("b",))


@pytest.mark.parametrize(("gained", "ends"), [(0.4, ("a", "b")), (0.6, ("a", "c"))])
def test_an_effect_is_exchanged_only_for_what_loses_less_on_held_out_trials_by_more_than_half(monkeypatch, gained, ends):
    search = LookBack.__new__(LookBack)
    fit, tried = (SimpleNamespace(held_out=np.array([6.0, 4.0 - less]), model=None) for less in (0.0, gained))
    exchanged = {("a", "b"): [("b", "c", tried)], ("a", "c"): []}
    search._exchanges = SimpleNamespace(of=lambda _problem, _fit, accepted: exchanged[accepted], longer=lambda *_: [])
    yes = {"may_stay": lambda *_: True, "better_than_part": lambda *_: True}
    search._acceptance = SimpleNamespace(rejected=lambda *_, **__: "", **yes)
    search._predictor = None
    monkeypatch.setattr(look_back, "settled_problem", lambda *_: ("settled", tried))
    problem = SimpleNamespace(pose_filter=SimpleNamespace(noise=None))
    assert search.exchange_step(problem, fit, ("a", "b"))[2] == ends


def test_an_exchange_that_asks_for_too_much_once_it_has_settled_gives_way_to_the_next_best(monkeypatch):
    search = LookBack.__new__(LookBack)
    fit, best, second = (SimpleNamespace(held_out=np.array([6.0, 4.0 - less]), model=less) for less in (0.0, 3.0, 2.0))
    exchanged = {("a", "b"): [("b", "c", best), ("b", "d", second)], ("a", "d"): [("d", "c", best)]}
    search._exchanges = SimpleNamespace(of=lambda _problem, _fit, accepted: exchanged[accepted], longer=lambda *_: [])
    problem = SimpleNamespace(pose_filter=SimpleNamespace(noise=None))
    monkeypatch.setattr(look_back, "settled_problem", lambda _predictor, model, _: (problem, SimpleNamespace(model=model)))
    search._predictor, yes = None, {"may_stay": lambda *_: True, "better_than_part": lambda *_: True}
    search._acceptance = SimpleNamespace(
        rejected=lambda settled, name, **_: "too much" if (settled.model, name) == (3.0, "c") else "", **yes
    )
    assert search.exchange_step(problem, fit, ("a", "b"))[2] == ("a", "d")


@pytest.mark.parametrize(
    ("change", "earned"),
    [
        ({}, True),
        ({"gain": 0.99}, False),  # too little beside what a trial loses on average
        ({"decoy": 2.0}, False),
        ({"decoy": 2.0, "gain": 2.01}, True),
        ({"p_value": 0.01}, False),
        ({"z": 2.0}, False),
    ],
)
def test_what_comes_in_is_certain_does_better_than_decoys_and_gains_enough(change, earned):
    given = {"gain": 1.01, "decoy": 0.0, "p_value": 0.009, "z": 2.1} | change
    asked = Acceptance({}, level=0.01, least_z=2.0)
    before, least = SimpleNamespace(held_out=np.array([6.0, 10.0])), 8.0 * MIN_GAIN
    comparison = SimpleNamespace(p_value=given["p_value"], z=given["z"], elpd_diff=given["gain"] * least)
    assert asked.earned(SimpleNamespace(paired_comparison=comparison), before, given["decoy"] * least) is earned


@pytest.mark.parametrize(
    ("beside", "tried", "told"),
    [
        ((), "lag", True),
        (("given",), "lag", True),
        (("given", "slip"), "lag", False),  # one that the search has taken already
        (("given",), "decoy", False),
    ],
)
def test_of_every_effect_beside_the_given_ones_alone_is_told_and_of_no_decoy(monkeypatch, beside, tried, told):
    def model_with(names):
        return SimpleNamespace(effects=[SimpleNamespace(effect=SimpleNamespace(name=name)) for name in names])

    search, heard = Forwards.__new__(Forwards), []
    search.given, search._catalogue = model_with(["given"]), {"lag": None}
    search._tick, search._alone = lambda _: None, heard.append
    monkeypatch.setattr(forwards, "fit_with", lambda *_: "added")
    search._acceptance = SimpleNamespace(candidate=lambda _problem, _fit, added, name: (added, name))
    assert search._tried(None, SimpleNamespace(model=model_with(beside)), {}, SimpleNamespace(name=tried)) == ("added", tried)
    assert heard == [("added", tried)] * told


@pytest.mark.parametrize(("given", "stays"), [(["slip", "lag"], True), (["slip"], False), ([], False)])
def test_a_longer_effect_takes_the_place_of_what_was_found_and_stands_beside_what_was_given(monkeypatch, given, stays):
    """What a user's model has is not the search's to take away."""
    search, asked = Forwards.__new__(Forwards), []
    search.given = SimpleNamespace(effects=[SimpleNamespace(effect=SimpleNamespace(name=name)) for name in given])
    search._tick, search._catalogue = lambda _: None, {}
    monkeypatch.setattr(forwards, "fit_extended", lambda *asked_with: asked.append(asked_with) or "added")
    search._acceptance = SimpleNamespace(candidate=lambda _problem, _fit, added, name: (added, name))
    longer = SimpleNamespace(name="longer-lag")
    fit = SimpleNamespace(model=search.given)
    place = {"longer-lag": (str(b"lag", "ascii"), "with the lag")}  # equal to the name above, and another object
    search._exchanges = SimpleNamespace(fitted=lambda *_: None)
    assert search._tried("problem", fit, place, longer) == ("added", "longer-lag")
    assert asked == [("problem", "with the lag", longer, stays)]
    search._exchanges = SimpleNamespace(fitted=lambda *asked_of: asked_of)
    assert search._tried("problem", fit, place, longer) == (("problem", fit, "lag", "longer-lag"), "longer-lag")
    assert len(asked) == 1


def test_a_look_back_asks_of_every_effect_but_the_newest_whether_it_stays(monkeypatch):
    search, asked = LookBack.__new__(LookBack), []
    search._catalogue = {}
    monkeypatch.setattr(search, "_shortened", lambda *state: state)
    search._acceptance = SimpleNamespace(
        rejected=lambda *_, **__: "", stays=lambda _problem, _simpler, _fit, name: asked.append(name) or True
    )
    monkeypatch.setattr(look_back, "at_bound", lambda *_: False)
    monkeypatch.setattr(look_back, "reduced", lambda *_: None)
    fit = SimpleNamespace(model=SimpleNamespace(effects=()))
    assert search.backward_step(None, fit, ("a", "b", "c"))[2] == ("a", "b", "c")
    assert asked == ["a", "b"]


@pytest.mark.parametrize(("numbers", "anything", "competes"), [(2, True, False), (2, False, True), (1, True, True)])
def test_no_explanation_competes_by_one_more_number_that_may_be_anything(monkeypatch, numbers, anything, competes):
    search = StepwiseSelection.__new__(StepwiseSelection)
    fit, tried = SimpleNamespace(free=[1]), SimpleNamespace(free=[1] * numbers)
    search._exchanges = SimpleNamespace(of=lambda *_: [("b", "c", tried)])
    search._acceptance = SimpleNamespace(rejected=lambda *_, **__: "", earned_over=lambda *_: True)
    asked = {"limiting": anything, "half_as_far": None, "indistinguishable": True, "fit_without": None, "believable": None}
    for name, answer in asked.items():
        monkeypatch.setattr(stepwise, name, lambda *_, answer=answer: answer)
    found = search._competing_models(None, fit, ("a", "b", "d"))
    assert found == ([(("a", "c", "d"), tried)] if competes else [])


@pytest.mark.parametrize("competes", [True, False])
def test_a_cable_as_far_away_as_any_competes_if_one_half_as_far_away_does(monkeypatch, competes):
    search = StepwiseSelection.__new__(StepwiseSelection)
    fit, found = SimpleNamespace(free=[1]), SimpleNamespace(free=[1, 2], name="as far")
    nearer = SimpleNamespace(free=[1, 2], name="nearer")
    search._exchanges = SimpleNamespace(of=lambda *_: [("b", "c", found)])
    search._acceptance = SimpleNamespace(rejected=lambda *_, **__: "", earned_over=lambda *_: True)
    alike = {"as far": True, "nearer": competes}
    asked = {"limiting": lambda *_: True, "half_as_far": lambda *_: "bounded", "believable": lambda *_: None}
    asked |= {"indistinguishable": lambda one, *_: alike[one.name], "negligibly_worse": lambda *_: False}
    asked["fit_without"] = lambda *_: None
    for name, answer in asked.items():
        monkeypatch.setattr(stepwise, name, answer)
    problem = SimpleNamespace(fit=lambda model: {"bounded": nearer}[model])
    assert search._competing_models(problem, fit, ("a", "b")) == ([(("a", "c"), nearer)] if competes else [])


@pytest.mark.parametrize(("alike", "competes"), [("as found", False), ("held", True)])
def test_a_number_that_no_robot_has_competes_by_the_best_plausible_one(monkeypatch, alike, competes):
    search = StepwiseSelection.__new__(StepwiseSelection)
    fit, tried = SimpleNamespace(free=[1]), SimpleNamespace(free=[1], name="as found")
    search._exchanges = SimpleNamespace(of=lambda *_: [("b", "c", tried)])
    search._acceptance = SimpleNamespace(rejected=lambda *_, **__: "", earned_over=lambda *_: True)
    monkeypatch.setattr(stepwise, "fit_without", lambda *_: None)
    monkeypatch.setattr(stepwise, "believable", lambda *_: "model")
    monkeypatch.setattr(stepwise, "indistinguishable", lambda one, *_: one.name == alike)
    monkeypatch.setattr(stepwise, "negligibly_worse", lambda *_: False)
    problem = SimpleNamespace(fit=lambda model: SimpleNamespace(name={"model": "held"}[model]))
    found = search._competing_models(problem, fit, ("a", "b"))
    assert found == ([(("a", "c"), tried)] if competes else [])


@pytest.mark.parametrize(("nearly", "competes"), [("held", True), ("as found", False), ("nobody", False)])
def test_one_that_does_nearly_all_competes_too_with_its_plausible_number(monkeypatch, nearly, competes):
    search = StepwiseSelection.__new__(StepwiseSelection)
    fit, tried = SimpleNamespace(free=[1]), SimpleNamespace(free=[1], name="as found")
    search._exchanges = SimpleNamespace(of=lambda *_: [("b", "c", tried)])
    search._acceptance = SimpleNamespace(rejected=lambda *_, **__: "", earned_over=lambda *_: True)
    for name, answer in (("fit_without", None), ("believable", "model"), ("indistinguishable", False)):
        monkeypatch.setattr(stepwise, name, lambda *_, answer=answer: answer)
    monkeypatch.setattr(stepwise, "negligibly_worse", lambda _, one, *__: one.name == nearly)
    problem = SimpleNamespace(fit=lambda model: SimpleNamespace(name={"model": "held"}[model]))
    assert search._competing_models(problem, fit, ("a", "b")) == ([(("a", "c"), tried)] if competes else [])


def test_the_best_of_the_decoys_sets_the_threshold(monkeypatch):
    search = Forwards.__new__(Forwards)
    search._predictor, search._worth = SimpleNamespace(screening=None), {}
    earns = dict(zip([decoy.name for decoy in DECOYS], np.random.default_rng(0).permutation(len(DECOYS)), strict=True))

    def tried(_problem, _fit, _place, effect):
        return Candidate(effect.name, None, SimpleNamespace(elpd_diff=float(earns[effect.name])))

    monkeypatch.setattr(search, "_worth_a_fit", lambda *_: [])
    monkeypatch.setattr(search, "_tried", tried)
    search._acceptance = SimpleNamespace(earned=lambda *_: False)
    search._catalogue = {}
    step, _, _ = search._forward_step(None, SimpleNamespace(model=SimpleNamespace(effects=())), ())
    assert step.decoy_threshold == len(DECOYS) - 1 > 0


@pytest.mark.parametrize(
    ("numbers", "ends", "competing"),
    [
        ({"b": 3, "c": 3}, "a", [("b",), ("c",)]),
        ({"b": 2, "c": 1}, "c", [("a",), ("b",)]),
        ({"b": 4, "c": 2}, "c", [("a",), ("b",)]),
        ({}, "a", []),
    ],
)
def test_of_explanations_that_cannot_be_told_apart_the_one_with_fewest_numbers_is_named(monkeypatch, numbers, ends, competing):
    """The one that was found has three, and is named where none has fewer."""
    search = StepwiseSelection.__new__(StepwiseSelection)
    search.model = None
    fits = {name: SimpleNamespace(free=[0] * count, name=name) for name, count in ({"a": 3} | numbers).items()}
    monkeypatch.setattr(search, "_competing_models", lambda *_: [((name,), fits[name]) for name in numbers])
    found = search._ended(SimpleNamespace(fit=lambda _model: None), fits["a"], ("a",), [])
    assert (found.accepted, found.fit.name) == ((ends,), ends)
    assert list(found.competing_models) == competing


@pytest.mark.parametrize(
    ("better", "earns", "kept"),
    [(True, True, ("longer", "b")), (False, True, ("b", "lag")), (True, False, ("longer", "b")), (False, False, ("b",))],
)
def test_a_longer_effect_that_lowers_no_error_goes_back_to_the_one_that_it_extends(monkeypatch, better, earns, kept):
    search = LookBack.__new__(LookBack)
    search._catalogue = {name: SimpleNamespace(extends=part) for name, part in (("lag", ""), ("longer", "lag"), ("b", ""))}
    fit = SimpleNamespace(model=SimpleNamespace(effects=()))
    monkeypatch.setattr(search, "_shortened", lambda *state: state)
    search._acceptance = SimpleNamespace(rejected=lambda *_, **__: "", stays=lambda *_: True, may_stay=lambda *_: earns)
    search._predictor = None
    monkeypatch.setattr(look_back, "settled_problem", lambda _predictor, model, _: (problem, SimpleNamespace(model=model)))
    for name, answer in (("at_bound", False), ("variant", False), ("certainly_better", better), ("reduced", fit)):
        monkeypatch.setattr(look_back, name, lambda *_, answer=answer: answer)
    problem = SimpleNamespace(pose_filter=SimpleNamespace(noise=None))
    assert search.backward_step(problem, fit, ("longer", "b"))[2] == kept


def an_effect(name, numbers, extends="", contains=(), lookalikes=()):
    parts = (*contains, extends) if extends else contains
    return SimpleNamespace(
        name=name, parameters=[None] * numbers, extends=extends, contains=contains, parts=parts, lookalikes=lookalikes
    )


def with_effects(*effects, **more):
    return SimpleNamespace(model=SimpleNamespace(effects=[SimpleNamespace(effect=effect) for effect in effects]), **more)


def test_an_effect_is_exchanged_for_one_with_no_more_numbers_that_extends_what_could_nearly_stand_there(monkeypatch):
    """A friction that slides (three numbers) and a clock (one) for a friction of both wheels, and for what extends that one."""
    extending = [an_effect("unlike", 2, "friction"), an_effect("cold", 3, "friction"), an_effect("in-gears", 4, "friction")]
    fit = with_effects(sliding := an_effect("sliding", 3), clock := an_effect("clock", 1))
    known = {effect.name: effect for effect in (*extending, sliding, clock)}
    one, begun = Exchanges(None, known, known, lambda _: None), []
    near = [("clock", "friction", "friction for the clock"), ("sliding", "friction", "friction for sliding")]
    near.append(("sliding", "lag", "a lag for sliding"))
    monkeypatch.setattr(one, "of", lambda *_: near)

    def extended(_problem, base, effect):
        begun.append(base)
        return f"{effect.name} from {base}"

    monkeypatch.setattr(exchanges, "fit_extended", extended)
    accepted, problem = ("sliding", "clock"), SimpleNamespace()
    found = [("sliding", name, f"{name} from friction for sliding") for name in ("unlike", "cold")]
    assert one.longer(problem, fit, accepted) == one.longer(problem, fit, accepted) == found
    assert begun == ["friction for sliding"] * 2
    assert one.fitted(problem, fit, "sliding", "cold") == "cold from friction for sliding"
    for other in ((problem, fit, "clock", "cold"), (problem, with_effects(), "sliding", "cold"), (None, fit, "sliding", "cold")):
        assert one.fitted(*other) is None
    one.forget()
    assert one.fitted(problem, fit, "sliding", "cold") is None


@pytest.mark.parametrize(("better", "ends"), [(True, ("a", "longer")), (False, ("a", "b"))])
def test_an_exchange_for_a_longer_effect_must_lower_the_error_of_the_one_that_it_extends(monkeypatch, better, ends):
    search = LookBack.__new__(LookBack)
    catalogue = {"longer": SimpleNamespace(extends="lag"), "lag": SimpleNamespace(extends="")}
    search._predictor, search._acceptance = None, Acceptance(catalogue, level=0.01, least_z=2.0)
    fit, tried = (SimpleNamespace(held_out=np.array([10.0 - less]), model=None) for less in (0.0, 3.0))
    longer = {("a", "b"): [("b", "longer", tried)], ("a", "longer"): []}
    search._exchanges = SimpleNamespace(of=lambda *_: [], longer=lambda _problem, _fit, accepted: longer[accepted])
    monkeypatch.setattr(search._acceptance, "may_stay", lambda *_: True)
    monkeypatch.setattr(search._acceptance, "rejected", lambda *_, **__: "")
    monkeypatch.setattr(search._acceptance, "needed", lambda *_: better)
    monkeypatch.setattr(look_back, "settled_problem", lambda *_: ("settled", tried))
    problem = SimpleNamespace(pose_filter=SimpleNamespace(noise=None))
    assert search.exchange_step(problem, fit, ("a", "b"))[2] == ends


def ranked(**gains):
    """Candidates by name, each with its gain."""
    named = ((name.replace("_", "-"), SimpleNamespace(model=name), gain) for name, gain in gains.items())
    return [Candidate(name, fit, SimpleNamespace(elpd_diff=gain)) for name, fit, gain in named]


def choosing(monkeypatch, lower):
    """A search that knows friction, what is in gears (it extends a lag), a lag and a slip; ``lower``: what lowers the error."""
    search = Forwards.__new__(Forwards)
    search._predictor = SimpleNamespace(screening=None)
    names = (("friction", "", ()), ("lag", "", ()), ("gears", "lag", ("turn-lag",)), ("turn-lag", "lag", ()), ("slip", "", ()))
    search._catalogue = {name: an_effect(name, 1, extends, contains) for name, extends, contains in names}
    monkeypatch.setattr(forwards, "variant", lambda *_: False)
    monkeypatch.setattr(forwards, "certainly_better", lambda _before, settled: settled[1] in lower)
    always = {"earned": lambda *_: True, "needed": lambda *_: True}
    search._acceptance = SimpleNamespace(rejected=lambda *_, **__: "", refused=lambda _: False, **always)
    monkeypatch.setattr(forwards, "settled_problem", lambda _predictor, model, _: ("problem", model))
    problem = SimpleNamespace(pose_filter=SimpleNamespace(noise=None))
    return lambda tried, place: search._chosen(problem, None, tried, 0.0, place, 0)[0].selected


@pytest.mark.parametrize(
    ("lag", "instead_of", "selected"), [(9.0, "friction", "lag"), (7.0, "friction", "gears"), (9.0, "lag", "gears")]
)
def test_what_takes_a_thirds_place_waits_where_the_simpler_one_gains_nearly_as_much(monkeypatch, lag, instead_of, selected):
    chosen = choosing(monkeypatch, {"gears", "lag"})
    assert chosen(ranked(gears=10.0, lag=lag), {"gears": (instead_of, None)}) == selected
    assert chosen(ranked(gears=10.0, lag=lag), {"gears": (instead_of, None), "lag": ("slip", None)}) == "gears"


@pytest.mark.parametrize(("lower", "selected"), [((), ""), (("slip",), "slip"), (("turn_lag",), "turn-lag")])
def test_behind_one_that_lowers_no_error_nothing_comes_in_that_lowers_none_either(monkeypatch, lower, selected):
    """Turns that lag less than straight lines look a little like a slip; the lag that says so comes before it."""
    chosen = choosing(monkeypatch, lower)
    assert chosen(ranked(turn_lag=2.0, slip=1.0), {"turn-lag": ("lag", None)}) == selected
    assert chosen(ranked(slip=2.0, turn_lag=1.0), {"turn-lag": ("lag", None)}) == "slip"


@pytest.mark.parametrize(
    ("held_out", "stays", "certain", "ends"),
    [
        ({"lag": 9.4}, True, False, ("c", "lag")),
        ({"lag": 9.6}, True, True, ("a", "b", "c")),
        ({"lag": 9.4}, False, True, ("a", "b", "c")),
        ({"lag": 9.4, "turn-lag": 8.8}, True, False, ("c", "turn-lag")),
        ({"lag": 9.4, "gears": 8.0}, True, True, ("c", "lag")),  # four numbers in the place of two
        ({"lag": 9.4, "scrub": 8.0}, True, True, ("c", "scrub")),  # one more than two, and better for certain
        ({"lag": 9.4, "scrub": 8.0}, True, False, ("c", "lag")),
    ],
)
def test_one_effect_takes_the_place_of_two_that_look_like_it(monkeypatch, held_out, stays, certain, ends):
    search = LookBack.__new__(LookBack)
    search._predictor, search._tick = SimpleNamespace(screening=None), lambda _: None
    search._catalogue = {
        "a": an_effect("a", 1, lookalikes=("lag", "b")),
        "b": an_effect("b", 1, lookalikes=("lag", "slip")),
        "c": an_effect("c", 1, lookalikes=("slip",)),
        "lag": an_effect("lag", 1),
        "turn-lag": an_effect("turn-lag", 2, "lag"),
        "gears": an_effect("gears", 4, "lag"),
        "scrub": an_effect("scrub", 3, "lag"),
    }
    search._worth = search._catalogue
    free = {name: "x" * (1 + len(effect.parameters)) for name, effect in search._catalogue.items()}  # and that of c
    fits = {n: SimpleNamespace(held_out=np.array([one]), loss=one, model=n, free=free[n]) for n, one in held_out.items()}
    worse = SimpleNamespace(held_out=np.array([99.0]), loss=99.0, model="")
    monkeypatch.setattr(look_back, "fit_with", lambda _problem, _base, effect: fits.get(effect.name, worse))
    monkeypatch.setattr(look_back, "fit_extended", lambda _problem, _base, effect: fits.get(effect.name, worse))
    monkeypatch.setattr(look_back, "_from_their_numbers", lambda *_: None)
    search._acceptance = SimpleNamespace(rejected=lambda *_, **__: "", may_stay=lambda *_: stays, certain=lambda *_: certain)
    monkeypatch.setattr(look_back, "settled_problem", lambda _predictor, model, _: ("problem", fits[model]))
    without = SimpleNamespace(without=lambda _: without)
    fit = SimpleNamespace(held_out=np.array([10.0]), model=without, free="abc")
    problem = SimpleNamespace(fit=lambda _: None, pose_filter=SimpleNamespace(noise=None))
    assert search.merge_step(problem, fit, ("a", "b", "c"))[2] == ends
    search._predictor = SimpleNamespace(screening=object())
    assert search.merge_step(problem, fit, ("a", "b", "c"))[2] == ("a", "b", "c")


def test_one_effect_in_the_place_of_two_begins_from_their_numbers():
    model = NOMINAL.with_effect("motor-lag", tau_s=0.1)
    model = model.with_active(effect_named("inertia-lag"), (0.02, 0.7)).with_effect("turn-dead-zone", width_rad_s=0.4)
    fit, problem = SimpleNamespace(model=model), SimpleNamespace(fit=lambda one: one)
    for pair in (("inertia-lag", "turn-dead-zone"), ("turn-dead-zone", "inertia-lag")):
        begun = look_back._from_their_numbers(problem, fit, pair, effect_named("scrub-friction"))
        assert [a.effect.name for a in begun.effects] == ["scrub-friction"]
        assert begun.values_of("scrub-friction") == {"tau_s": 0.02, "turn_ratio": 0.7, "width_rad_s": 0.4}
    begun = look_back._from_their_numbers(problem, fit, pair, effect_named("lag-mismatch"))
    assert begun.values_of("lag-mismatch") == {"tau_s": 0.02, "ratio": 1.0}
    assert look_back._from_their_numbers(problem, fit, pair, effect_named("speed-gain")) is None


def test_a_number_of_the_same_name_that_an_effect_cannot_have_is_none_of_its_own():
    """left_share of a sliding contact says where it is, and may be negative; that of a dead zone may not."""
    model = NOMINAL.with_effect("sliding-contact", friction_m_s=0.01, distance_share=0.5, left_share=-0.005)
    model, pair = model.with_effect("dead-zone", width_m_s=0.02), ("sliding-contact", "dead-zone")
    fit, problem = SimpleNamespace(model=model), SimpleNamespace(fit=lambda one: one)
    effect = effect_named("dead-zone-mismatch")
    begun = look_back._from_their_numbers(problem, fit, pair, effect)
    assert begun.values_of("dead-zone-mismatch") == {"width_m_s": 0.02, "left_share": 1.0}
    alone = SimpleNamespace(model=model.without("dead-zone").with_effect("speed-gain", gain=0.9))
    assert look_back._from_their_numbers(problem, alone, ("sliding-contact", "speed-gain"), effect) is None


def test_the_lower_of_both_beginnings_counts(monkeypatch):
    catalogue = {name: an_effect(name, 1) for name in ("a", "b", "lag")} | {"scrub": an_effect("scrub", 3, "lag")}
    search = LookBack.__new__(LookBack)
    search._catalogue = search._worth = catalogue
    without = SimpleNamespace(without=lambda _: without)
    fit, problem = SimpleNamespace(model=without), SimpleNamespace(fit=lambda _: None)
    monkeypatch.setattr(look_back, "fit_with", lambda *_: "lag alone")
    for extended, theirs, best in ((5.0, 3.0, 3.0), (2.0, 3.0, 2.0), (5.0, None, 5.0)):
        of = [SimpleNamespace(loss=loss) if loss is not None else None for loss in (extended, theirs)]
        monkeypatch.setattr(look_back, "fit_extended", lambda *_, found=of[0]: found)
        monkeypatch.setattr(look_back, "_from_their_numbers", lambda *_, found=of[1]: found)
        (_, simple), (name, found) = search._merged(problem, fit, ("a", "b"), "lag")
        assert (simple, name, found.loss) == ("lag alone", "scrub", best)


@pytest.mark.parametrize(("p_value", "z", "certain"), [(0.001, 3.0, True), (0.02, 3.0, False), (0.001, 1.9, False)])
def test_a_gain_is_certain_by_the_signs_of_trials_and_by_its_standard_error_however_small_it_is(p_value, z, certain):
    gain = SimpleNamespace(p_value=p_value, z=z, elpd_diff=1e-9)
    problem = SimpleNamespace(paired_comparison=lambda before, after: gain if (before, after) == ("before", "after") else None)
    assert Acceptance({}, level=0.01, least_z=2.0).certain(problem, "before", "after") == certain


def test_where_nothing_comes_in_two_effects_may_give_way_to_one_and_the_search_goes_on(monkeypatch):
    search = StepwiseSelection.__new__(StepwiseSelection)
    search.model, search._exchanges, search._doubted = None, SimpleNamespace(entry=None), None
    search._acceptance = SimpleNamespace(doubts=0, all_believed=False)
    came, asked = {(): "a", ("a",): "b", ("c",): "d"}, []
    fit, problem = SimpleNamespace(free=(), model=SimpleNamespace(effects=())), SimpleNamespace()

    def next_step(_problem, _fit, accepted):
        step = SimpleNamespace(selected=came.get(accepted, ""), instead_of="")
        step.slim = lambda: step
        return step, problem, fit

    def merged(_problem, _fit, accepted):
        asked.append(accepted)
        return problem, fit, ("c",) if accepted == ("a", "b") else accepted

    monkeypatch.setattr(search, "_refit_with_noise", lambda *_: (problem, fit))
    search._forwards = SimpleNamespace(next_step=next_step)
    same = {"exchange_step": lambda *state: state, "backward_step": lambda *state: state}
    search._look_back = SimpleNamespace(merge_step=merged, **same)
    monkeypatch.setattr(search, "_ended", lambda _problem, _fit, accepted, _steps: accepted)
    assert search._select() == ("c", "d")
    assert asked == [("a", "b"), ("c", "d")]
    monkeypatch.setattr(stepwise, "MOST", 2)  # as many effects as may be are merged, too
    assert search._select() == ("c", "d")


def test_a_search_that_believes_all_numbers_goes_on_where_one_was_first_not_believed(monkeypatch):
    """Rounds before it would come out the same; the round itself is asked again, from where it began."""
    search = StepwiseSelection.__new__(StepwiseSelection)
    search.model, search._exchanges, search._doubted = "model", SimpleNamespace(entry=None), None
    search._acceptance = SimpleNamespace(doubts=0, all_believed=False)
    asked, begun = [], []

    def next_step(problem, _fit, accepted):
        asked.append(accepted)
        doubted = len(accepted) == 2 and not search._acceptance.all_believed
        search._acceptance.doubts += doubted
        step = SimpleNamespace(selected="" if doubted or len(accepted) == 3 else "abc"[len(accepted)], instead_of="")
        step.slim = lambda: step
        return step, problem, SimpleNamespace(model=SimpleNamespace(effects=()))

    monkeypatch.setattr(search, "_refit_with_noise", lambda *_: begun.append("begun") or ("problem", SimpleNamespace(free=())))
    monkeypatch.setattr(stepwise, "accepted_with", lambda accepted, step, _fit: (*accepted, step.selected))
    search._forwards = SimpleNamespace(next_step=next_step)
    same = dict.fromkeys(("exchange_step", "backward_step", "merge_step"), lambda *state: state)
    search._look_back = SimpleNamespace(**same)
    monkeypatch.setattr(search, "_ended", lambda _problem, _fit, accepted, steps: (accepted, len(steps)))
    assert search._select() == (("a", "b"), 3)
    search._acceptance.all_believed = True
    search._exchanges.entry = "another"
    assert search._select() == (("a", "b", "c"), 4)
    assert asked == [(), ("a",), ("a", "b"), ("a", "b"), ("a", "b", "c")]
    assert begun == ["begun"]
    search.model = "another model"
    search._select()
    assert asked[-4:] == [(), ("a",), ("a", "b"), ("a", "b", "c")]


def test_only_a_number_that_could_be_believed_is_a_doubt(monkeypatch):
    fit = SimpleNamespace()
    for bound, unknown, doubts in ((False, "", 1), (True, "", 0), (False, "not determined", 0)):
        asked = Acceptance({}, level=0.01, least_z=2.0)
        for name, answer in (("implausible", "too far"), ("at_bound", bound), ("undetermined", unknown)):
            monkeypatch.setattr(acceptance, name, lambda *_, answer=answer: answer)
        assert asked.rejected(fit, "e") == (unknown or "too far")
        assert asked.doubts == doubts
        asked.all_believed = True
        assert asked.rejected(fit, "e") == (unknown or ("too far" if bound else ""))
        assert asked.doubts == doubts
