"""Any combination of features holds what each promises: a machine draws them, from what the program says of itself.

The same ones each time.  Of a campaign, `SWEEP_MACHINE_SEED` draws others (a number, or `new`); a number that is given
also shrinks what fails, which takes minutes.  `SWEEP_MACHINE_RUNS` and `SWEEP_MACHINE_KERNELS` make it larger.  What
must hold is in tests/machine/.
"""

import os
from itertools import islice
from random import Random, SystemRandom
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis.stateful import run_state_machine_as_test
from machine import draws, oracles, words
from machine.rules import Machine
from support.kernels import SHARED

import sweep
from sweep.cli import main
from sweep.config import load_config
from sweep.config.schema import PATHS

POOL = [(method, model, draws.compiled(measure)) for method, model, measure in SHARED]
STEPS, BATCH = 12, 9


def run_machine(number: int, runs: int, kernels: int = 0, **parts: Any) -> None:
    """Let the machine do `runs` times `STEPS` things, with so many kernels more than tests share."""
    print(f"SWEEP_MACHINE_SEED={number}")
    pool = [*POOL, *islice(draws.further(Random(number)), kernels)]
    # Of each ten and more, Hypothesis makes most by changing little in others.
    for batch in range(0, runs, BATCH):
        kind = seed(number + 10**6 * batch)(type("TheMachine", (Machine,), {"pool": pool, **parts}))
        how = settings(
            max_examples=min(BATCH, runs - batch), stateful_step_count=STEPS, deadline=None, database=None,
            derandomize=False, suppress_health_check=list(HealthCheck),
            phases=[Phase.generate, *([Phase.shrink] if os.environ.get("SWEEP_MACHINE_SEED", "new") != "new" else [])],
        )  # fmt: skip
        # Hypothesis draws constants of the modules that happen to be loaded, which other tests change.
        constant = "hypothesis.internal.conjecture.providers.HypothesisProvider._maybe_draw_constant"
        with patch(constant, lambda *_, **__: None):
            run_state_machine_as_test(kind, settings=how)


def asked(name: str, usual: int) -> int:
    given = os.environ.get(f"SWEEP_MACHINE_{name}", usual)
    return SystemRandom().randrange(10**6) if given == "new" else int(given)


def test_some_combinations() -> None:
    run_machine(9, 5)


@pytest.mark.campaign
def test_many_combinations(client: Any) -> None:
    """With kills and a cluster."""
    run_machine(asked("SEED", 1), asked("RUNS", 6), asked("KERNELS", 2), far=True, client=client)


@pytest.mark.browser
def test_many_combinations_in_the_explorer() -> None:
    run_machine(asked("SEED", 2), asked("RUNS", 4), browser=True)


# Each refers to what only a user can bring.
NOT_ALONE = {"model_sha256"}


@pytest.mark.parametrize("path", sorted(PATHS.keys() - NOT_ALONE))
def test_each_key_of_a_configuration_is_drawn(path: str) -> None:
    """With a shipped configuration, or with one other choice beside the paper's, some drawn value is accepted."""
    others = [(name, flat) for name, flat in draws.shipped().items()]
    others += [("paper", draws.shipped()["paper"] | {key: value}) for key, value in draws.choices()]
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
    left = set(words.options(verb))
    for name in words.options(verb):
        for number in range(20):
            line = words.option(verb, name, number)
            context = words.VERBS[verb].make_context(verb, line, resilient_parsing=True)
            if context.params[name] not in (None, (), False):
                left.discard(name)
    assert not left


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
