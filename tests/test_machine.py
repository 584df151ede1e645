"""Any combination of features holds what each promises: a machine draws them, from what the program says of itself.

The same ones each time.  In a campaign, `SWEEP_MACHINE_SEED` draws others (a number, or `new`); a number that is given
also shrinks what fails, which takes minutes.  `SWEEP_MACHINE_RUNS` and `SWEEP_MACHINE_KERNELS` make it larger.  What
must hold is in tests/machine/.
"""

import os
from itertools import islice
from random import Random, SystemRandom
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, Phase, settings
from hypothesis.internal.conjecture.providers import AVAILABLE_PROVIDERS, PrimitiveProvider
from hypothesis.stateful import run_state_machine_as_test
from machine import draws, oracles, words
from machine.meetings import Meetings
from machine.rules import Machine
from support.kernels import SHARED

import sweep
from sweep.cli import main
from sweep.config import load_config
from sweep.config.schema import PATHS

POOL = {(method, model, draws.compiled(measure)) for method, model, measure in SHARED}
STEPS = 6


class Even(PrimitiveProvider):
    """Draws each choice evenly: what the seed alone decides, and no examples that change little in earlier ones."""

    seed = 0

    def __init__(self, data: Any) -> None:
        super().__init__(data)
        self.random = Random(self.seed)

    def draw_boolean(self, p: float = 0.5) -> bool:
        return self.random.random() < p

    def draw_integer(self, min_value: Any = None, max_value: Any = None, **_: Any) -> int:
        return self.random.randint(min_value, max_value)

    def draw_float(self, *, min_value: float, max_value: float, **_: Any) -> float:
        return self.random.uniform(min_value, max_value)

    def draw_string(self, *_: Any, **__: Any) -> str:
        raise NotImplementedError

    def draw_bytes(self, *_: Any, **__: Any) -> bytes:
        raise NotImplementedError


def run_machine(number: int, runs: int, kernels: int = 0, **parts: Any) -> int:
    """Let the machine do `STEPS` things with each of `runs` configurations; returns how many it has done.

    `kernels` configurations more than tests share have kernels of their own.
    """
    print(f"SWEEP_MACHINE_SEED={number}")
    pool = POOL.union(*islice(draws.further(Random(number)), kernels))
    kind = type("TheMachine", (Machine,), {"pool": pool, "bases": draws.bases(pool), "meetings": Meetings(), **parts})
    AVAILABLE_PROVIDERS["even"] = type("Seeded", (Even,), {"seed": number})
    how = settings(
        max_examples=runs, stateful_step_count=STEPS, deadline=None, database=None, backend="even", derandomize=False,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.generate, *([Phase.shrink] if os.environ.get("SWEEP_MACHINE_SEED", "new") != "new" else [])],
    )  # fmt: skip
    try:
        run_state_machine_as_test(kind, settings=how)
    finally:
        print(f"{kind.done} combinations")
    return kind.done


def asked(name: str, usual: int) -> int:
    given = os.environ.get(f"SWEEP_MACHINE_{name}", usual)
    return SystemRandom().randrange(10**6) if given == "new" else int(given)


def test_some_combinations() -> None:
    assert run_machine(9, 8) >= 8 * STEPS


@pytest.mark.campaign
def test_many_combinations(client: Any) -> None:
    """With kills and a cluster."""
    run_machine(asked("SEED", 1), asked("RUNS", 12), asked("KERNELS", 2), far=True, client=client)


@pytest.mark.browser
def test_many_combinations_in_the_explorer() -> None:
    run_machine(asked("SEED", 2), asked("RUNS", 8), browser=True)


@pytest.mark.parametrize("path", sorted(PATHS))
def test_each_key_of_a_configuration_is_drawn(path: str) -> None:
    """With a shipped configuration, or with one choice that differs from the paper's, some drawn value is accepted."""
    others = [(name, flat) for name, flat in draws.shipped().items()]
    words = [(key, word) for key, field in draws.fields().items() for word in field.get("enum", ())]
    others += [("paper", draws.shipped()["paper"] | {key: word}) for key, word in words]
    some = (draws.accepted(flat | {path: draws.setting(path, n)}, base) for n in range(9) for base, flat in others)
    assert any(path in flat for flat, _ in some)


def test_each_verb_is_drawn() -> None:
    """A new command or function is, unless it is entered among those that are not."""
    assert main.commands.keys() - words.VERBS.keys() == {"reproduce", "bench", "explore"}
    public = {name for name in sweep.__all__ if callable(getattr(sweep, name)) and name.islower()}
    assert public == words.FUNCTIONS.keys()


@pytest.mark.parametrize("verb", words.VERBS)
def test_each_option_is_drawn(verb: str) -> None:
    """With some value that the command takes."""
    left = set(words.OPTIONS[verb])
    for name in words.OPTIONS[verb]:
        for number in range(20):
            line = words.option(verb, name, number)
            context = words.VERBS[verb].make_context(verb, line, resilient_parsing=True)
            if context.params[name] not in (None, (), False):
                left.discard(name)
    assert not left


def test_features_that_have_met_least_are_taken() -> None:
    """A rare one, though a draw with more features has more new pairs; and the same ones whenever they are offered."""
    meetings, common = Meetings(), frozenset({"a", "b", "c"})
    assert meetings.newest([1], [common]) == 1
    offered = [common | {"d"}, frozenset({"a", "e"}), common]
    assert [meetings.newest([1, 2, 3], offered) for _ in range(2)] == [2, 2]


def test_oracles_see_what_is_wrong() -> None:
    config = load_config({"friction": {"mu": 60}, "start": {"n0": [0.02, 0.05]}, "integrator": {"method": "dopri5"}})
    found = sweep.run(config)
    oracles.sound(config, found)
    wrong: dict[str, xr.Dataset] = {
        "parity": found.assign(reversals=found.reversals + 1),
        "t_end": found.assign(t_stop=found.t_stop * 0 + 1e9),
        "finite": found.assign(spin_final=found.spin_final * np.nan),
    }
    for name, dataset in wrong.items():
        with pytest.raises(AssertionError):
            oracles.sound(config, dataset)
        if name == "parity":
            for compare in (oracles.same, oracles.alike):
                with pytest.raises(AssertionError):
                    compare(oracles.rows(found), oracles.rows(dataset))
