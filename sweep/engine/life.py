"""Takes a cell from its start to a result that can be trusted.

run → is it over → is its failure genuine → companion → is it within its tolerance → repeat with shorter steps, or done

Each stage decides for all cells at once that have reached its end, and each cell by its own results alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sweep.engine import ending, errors, failures
from sweep.engine.cells import APPROACH, COMPANION, DONE, RUN, Cells, Lives
from sweep.engine.executor import keep_busy
from sweep.grid import Array
from sweep.kernels.methods import METHODS


def begin(parts: Sequence[Cells]) -> list[Lives]:
    """Set up the lives of cells whose state rows are at t = 0."""
    lives = [Lives(part) for part in parts]
    for each in lives:
        every = np.arange(len(each.cells.cells))
        ending.begin(each, every, each.cells.rows.copy())
    return lives


def live(lives: Sequence[Lives], after_chunk: Callable[[], None] = lambda: None) -> None:
    """Take all cells through their lives; `after_chunk` as for `keep_busy`."""
    keep_busy(lives, proceed, after_chunk)


def proceed(lives: Lives, which: Array) -> None:
    """Move the cells `which`, whose stages have ended, to their next stages."""
    stage = lives.stage[which]
    over = ending.over(lives, which[stage == RUN])
    known = [failures.look_at(lives, over), failures.after_approach(lives, which[stage == APPROACH])]
    run = np.concatenate(known)
    failures.deny_unsound(lives, run)
    failed = lives.take(run).failed
    sound, done = run[~failed], [run[failed]]
    if lives.cells.rules.twice:
        errors.accompany(lives, sound)
    else:
        done.append(sound)
    done.append(errors.after_companion(lives, which[stage == COMPANION]))
    lives.notes["stage"][np.concatenate(done)] = DONE


def progress(lives: Sequence[Lives]) -> tuple[float, int]:
    """Return the completed share of the work, as a number of cells, and the number of failed cells.

    The length of a run that has not ended is guessed from those that have.
    """
    cells = failed = 0
    done, left = 0.0, 0.0
    for each in lives:
        kernel, stage = each.cells.kernel, each.stage
        now, before = kernel.table(each.cells.rows), kernel.table(each.aside)["done"]
        first = np.isin(stage, (RUN, APPROACH))
        again = 1 / METHODS[each.cells.method].longer if each.cells.rules.twice else 0.0
        ended = np.where(stage == COMPANION, before, now["done"])[~first]
        usual = np.maximum(ended.mean() if len(ended) else now["goal"][first].mean(), now["done"][first])
        done += now["done"].sum() + before[stage == COMPANION].sum() + again * now["done"][stage == DONE].sum()
        left += ((1 + again) * usual - now["done"][first]).sum()
        usual = np.minimum(now["goal"], again * before)
        left += np.maximum(usual - now["done"], 0)[stage == COMPANION].sum()
        cells, failed = cells + len(stage), failed + int((each.cells.failed & (stage == DONE)).sum())
    return cells * (done / (done + left) if done else 0.0), failed
