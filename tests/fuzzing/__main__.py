"""A long campaign of odd inputs.

Prints how many inputs of each kind were tried, accepted and refused.  Stops at the first violation, with its seed and
the folder that holds the input.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from pathlib import Path
from random import Random

from . import KINDS, prepare

SECONDS = 20
"""Allowed to one input."""

BYTES = 6 << 30
"""Memory allowed to the campaign."""


class Late(BaseException):
    """No answer in time.  Not an `Exception`: handlers for damaged files must not catch it."""


def _late(*_: object) -> None:
    raise Late


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzzing", description=__doc__)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"kinds to try, of {', '.join(KINDS)} (default: all)")
    parser.add_argument("--inputs", type=int, default=1000, help="inputs of each kind (default 1000)")
    parser.add_argument("--seed", type=int, default=time.time_ns() & 0xFFFFFF, help="(default: from the clock)")
    arguments = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    signal.signal(signal.SIGALRM, _late)
    warnings.simplefilter("error")
    folder = prepare(Path(tempfile.mkdtemp(prefix="fuzz")))
    total = 0
    for kind in arguments.kinds or KINDS:
        began, accepted = time.perf_counter(), 0
        for number in range(arguments.inputs):
            seed = f"{arguments.seed}:{kind}:{number}"
            signal.alarm(SECONDS)
            try:
                accepted += KINDS[kind](Random(seed), folder)
            except (Exception, Late):
                traceback.print_exc()
                print(f"{kind}: violation at input {number} of seed {arguments.seed}; see {folder}")
                return 1
            signal.alarm(0)
        total += arguments.inputs
        rate = arguments.inputs / (time.perf_counter() - began)
        refused = arguments.inputs - accepted
        print(f"{kind:10} {arguments.inputs} tried, {accepted} accepted, {refused} refused; {rate:.0f}/s", flush=True)
    shutil.rmtree(folder)
    print(f"{total} inputs, no violation")
    return 0


if __name__ == "__main__":
    sys.exit(main())
