"""Runs in threads and in forked processes, which kill a process or hang for ever in some threading layers of Numba."""

import os
import subprocess
import sys

import pytest

RUN = """
import multiprocessing, threading
import sweep

SCENE = {"name": "small", "model": "averaged", "friction": {"mu": [40, 60]}, "integrator": {"t_end": 4000}}

def counts(n0):
    return sweep.run(SCENE, n0=n0).reversals.values.tolist()

def in_threads():
    expected = [counts(0.02 + 0.005 * i) for i in range(6)]
    found = [None] * 6
    def one(i):
        found[i] = counts(0.02 + 0.005 * i)
    all_ = [threading.Thread(target=one, args=(i,)) for i in range(6)]
    for each in all_: each.start()
    for each in all_: each.join()
    print(found == expected)

def in_forks():
    expected = [counts(0.05)]
    with multiprocessing.get_context("fork").Pool(1) as pool:
        try:
            print(pool.map_async(counts, [0.05]).get(60) == expected)
        except sweep.Error as error:
            print(error)
"""


def said(layer: str, what: str) -> str:
    """What a program prints that runs sweeps in this threading layer."""
    result = subprocess.run(
        [sys.executable, "-c", f"{RUN}\n{what}()"],
        env=os.environ | {"NUMBA_THREADING_LAYER": layer}, capture_output=True, text=True, timeout=240, check=False,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


@pytest.mark.parametrize("layer", ["workqueue", "omp"])
def test_runs_in_several_threads_take_turns(layer: str) -> None:
    assert said(layer, "in_threads") == "True"


@pytest.mark.parametrize(("layer", "words"), [("workqueue", "True"), ("omp", "start processes by 'spawn'")])
def test_a_process_forked_after_a_run_runs_or_says_how_to_start_it(layer: str, words: str) -> None:
    assert words in said(layer, "in_forks")
