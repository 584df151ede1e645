"""What bounds the kernels on a CPU, by llvm-mca's model of it: the vector loop over the lanes of `run_block`.

    python scripts/kernel_bounds.py METHOD [CPU [LLVM-MCA]]

METHOD is adams or dopri5.  CPU is the name of a processor, by default znver3: for another one than this machine's,
NUMBA_CPU_NAME and NUMBA_CPU_FEATURES have to say the same.  The critical path is that of one step: what each
instruction waits for, with latencies of Zen 3.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile

import numba

from sweep.kernels import measures
from sweep.kernels.methods import make_kernel
from sweep.models import MODELS

LATENCIES = {"vdivpd": 13, "vsqrtpd": 20, "vmulpd": 4, "vfm": 4, "vfn": 4, "vaddpd": 3, "vsubpd": 3, "vmov": 0}
"""In cycles; 1 for all others."""

LOADED, FORWARDED = 4, 8
"""Cycles until a load is there, and one of what was just stored."""

ITERATIONS = 30


def assembly(method: str) -> list[str]:
    """Lines of `run_block` for the paper's model with its default measurements."""
    made = make_kernel(method, MODELS["slip"], measures.default(MODELS["slip"]))
    block = made.stepper.make_run_block(made)
    block.compile((numba.float64[::1],))
    return str(next(iter(block.inspect_asm().values()))).splitlines()


def vector_loop(lines: list[str]) -> list[str]:
    """The instructions of the loop with most vector roots that has no loop inside."""
    places = {line.split(":")[0]: i for i, line in enumerate(lines) if line.startswith(".LBB")}
    loops = []
    for i, line in enumerate(lines):
        jump = re.match(r"\s+j\w+\s+(\.LBB\w+)", line)
        if jump and (first := places.get(jump[1], i)) < i:
            body = lines[first + 1 : i]
            if not any(label.startswith(".LBB") for label in body):
                loops.append([instruction.strip() for instruction in body if re.match(r"\s+[a-z]", instruction)])
    return max(loops, key=lambda body: sum("sqrtpd" in line for line in body))


def critical_path(body: list[str]) -> int:
    """Cycles of the longest chain of instructions of which each waits for the one before."""
    ready: dict[str, int] = {}
    for line in body:
        name, _, rest = line.partition("\t")
        # A register is the same whatever of it is meant; a place in memory is told by how it is written.
        places = [
            re.sub(r"%[xyz](mm\d+).*", r"\1", place.strip()) for place in re.findall(r"(?:[^,(]|\([^)]*\))+", rest)
        ]
        if not places:
            continue
        read = places if name.startswith("vf") else places[:-1]
        waits = [ready.get(p, 0) + (0 if "(" not in p else FORWARDED if p in ready else LOADED) for p in read]
        latency = next((cycles for start, cycles in LATENCIES.items() if name.startswith(start)), 1)
        ready[places[-1]] = max(waits, default=0) + latency
    return max(ready.values())


def main(method: str, cpu: str = "znver3", mca: str = "llvm-mca") -> None:
    body = vector_loop(assembly(method))
    lanes = 8 if any("zmm" in line for line in body) else 4
    kinds = {"fma": "vfn?m", "multiply": "vmulpd", "add": "v(add|sub)pd", "divide": "vdivpd", "root": "vsqrtpd"}
    counts = {kind: sum(bool(re.match(start, line)) for line in body) for kind, start in kinds.items()}
    spills = [line for line in body if re.search(r"\(%r[sb]p", line)]
    stored = sum(bool(re.search(r"\(%r[sb]p\)$", line)) for line in spills)
    print(f"{len(body)} instructions for {lanes} lanes: {counts}; spilled {stored}, read again {len(spills) - stored}")
    with tempfile.NamedTemporaryFile("w", suffix=".s") as file:
        file.write("\n".join([".text", *body, ""]))
        file.flush()
        command = [mca, f"-mcpu={cpu}", f"-iterations={ITERATIONS}", "-instruction-info=0", file.name]
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    cycles = int(re.findall(r"Total Cycles:\s+(\d+)", said)[0]) / ITERATIONS
    ports = float(re.findall(r"Block RThroughput:\s+([\d.]+)", said)[0])
    path = critical_path(body)
    print(f"cycles a step of {lanes} lanes: {cycles:.0f}; ports alone {ports:.0f}; critical path {path}")
    print(f"cycles a step of one lane: {cycles / lanes:.0f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
