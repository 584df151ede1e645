"""A long campaign of odd inputs: `python scripts/fuzz.py --inputs 1000 --seed 1 [KIND …]`.

Prints how many inputs of each kind were tried, accepted and refused; stops at the first that was
answered neither way, with its seed and the folder that holds it.
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

sys.path[:0] = [str(Path(__file__).parent.parent / part) for part in ("", "tests")]

import fuzzing  # noqa: E402

# An input may take so many seconds, and all of them so much memory.
_SECONDS, _BYTES = 20, 6 << 30


class Late(BaseException):
    """No answer in time; not an `Exception`, for nothing is to take it for a damaged file's."""


def _late(*_: object) -> None:
    raise Late


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"of {', '.join(fuzzing.KINDS)} [default: all]")
    parser.add_argument("--inputs", type=int, default=1000, help="of each kind")
    parser.add_argument("--seed", type=int, default=time.time_ns() & 0xFFFFFF)
    arguments = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (_BYTES, _BYTES))
    signal.signal(signal.SIGALRM, _late)
    warnings.simplefilter("error")
    folder = fuzzing.prepare(Path(tempfile.mkdtemp(prefix="fuzz")))
    total = 0
    for kind in arguments.kinds or fuzzing.KINDS:
        began, accepted = time.perf_counter(), 0
        for number in range(arguments.inputs):
            seed = f"{arguments.seed}:{kind}:{number}"
            signal.alarm(_SECONDS)
            try:
                accepted += fuzzing.KINDS[kind](Random(seed), folder)
            except (Exception, Late):
                traceback.print_exc()
                print(f"{kind}: violation at input {number} of seed {arguments.seed}; see {folder}")
                return 1
            signal.alarm(0)
        total += arguments.inputs
        rate = arguments.inputs / (time.perf_counter() - began)
        crashes = f", {len(fuzzing.CRASHES)} crashes of the library" if fuzzing.CRASHES else ""
        print(f"{kind:10} {arguments.inputs} tried, {accepted} accepted, {arguments.inputs - accepted} refused"
              f"{crashes}; {rate:.0f}/s", flush=True)  # fmt: skip
        fuzzing.CRASHES.clear()
    shutil.rmtree(folder)
    print(f"{total} inputs, no violation")
    return 0


if __name__ == "__main__":
    sys.exit(main())
