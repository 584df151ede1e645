"""Compare answers with the references of this benchmark; the standard library is enough.

    python score.py ANSWERS.csv

ANSWERS.csv has the columns case, t and spin, and may have seconds and reversals, which are those of the whole case.
"""

import argparse
import csv
import math
import statistics
import sys
from pathlib import Path

HERE = Path(__file__).parent
LIMITS = (1e-6, 1e-8, 1e-10)
SAME_TIME = 1e-9


class Wrong(Exception):
    """What is wrong with a file, in words."""


def read(path, needed):
    """The rows of a file, each with its line in the file."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            table = csv.DictReader(stream)
            rows = [(table.line_num, row) for row in table]
    except OSError as error:
        raise Wrong(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise Wrong(f"{path}: this is not a text file in UTF-8") from error
    missing = [name for name in needed if name not in (table.fieldnames or ())]
    if missing:
        raise Wrong(f"{path}: the first line must name the columns {', '.join(needed)}; {', '.join(missing)} missing")
    return rows


def number(path, line, row, name):
    """A number of a row."""
    try:
        return float(row[name])
    except (TypeError, ValueError):
        raise Wrong(f"{path}, line {line}: {name} should be a number, not {row[name]!r}") from None


def read_references():
    """{case: {t: spin}}, {case: the largest error bound} and {case: reversals} of the cases whose count is firm."""
    spins, bounds = {}, {}
    for line, row in read(HERE / "references.csv", ("case", "t", "spin", "error_bound")):
        t, spin, bound = (number(HERE / "references.csv", line, row, name) for name in ("t", "spin", "error_bound"))
        spins.setdefault(row["case"], {})[t] = spin
        bounds[row["case"]] = max(bound, bounds.get(row["case"], 0.0))
    rows = read(HERE / "reversals.csv", ("case", "reversals"))
    return spins, bounds, {row["case"]: int(row["reversals"]) for _, row in rows}


def read_answers(path, references):
    """{case: {t: spin}}, and {case: number} of the seconds and of the reversals, where told."""
    spins, seconds, reversals = {}, {}, {}
    for line, row in read(path, ("case", "t", "spin")):
        case = row["case"]
        if case not in references:
            raise Wrong(f"{path}, line {line}: there is no case {case!r} in cases.csv")
        t, spin = number(path, line, row, "t"), number(path, line, row, "spin")
        known = [time for time in references[case] if abs(time - t) <= SAME_TIME * time]
        if not known:
            times = ", ".join(f"{time:g}" for time in references[case])
            raise Wrong(f"{path}, line {line}: {case} has no reference at t = {t:g}, but at {times}")
        if known[0] in spins.setdefault(case, {}):
            raise Wrong(f"{path}, line {line}: {case} at t = {t:g} is answered twice")
        spins[case][known[0]] = spin
        for name, found in (("seconds", seconds), ("reversals", reversals)):
            if row.get(name):
                found[case] = number(path, line, row, name)
    if not spins:
        raise Wrong(f"{path}: there are no answers in it")
    return spins, seconds, reversals


def largest_error(answers, references):
    """The largest error of a case, infinite if an answer is missing or is not a number."""
    errors = [abs(answers.get(t, math.inf) - spin) for t, spin in references.items()]
    return max(math.inf if math.isnan(error) else error for error in errors)


def verdict(error):
    """The tightest limit that the error keeps."""
    kept = [limit for limit in LIMITS if error <= limit]
    return f"within {min(kept):g}" if kept else "NOT WITHIN 1e-06"


def score(path):
    """The lines to print."""
    references, bounds, counts = read_references()
    spins, seconds, reversals = read_answers(path, references)
    errors = {case: largest_error(spins[case], references[case]) for case in references if case in spins}
    lines = [f"{'case':28s}{'times':>7s}{'error':>10s}{'bound':>10s}{'seconds':>10s}  verdict"]
    for case, error in errors.items():
        answered = f"{len(spins[case])}/{len(references[case])}"
        spent = f"{seconds[case]:.3g}" if case in seconds else ""
        wrong = case in reversals and case in counts and reversals[case] != counts[case]
        count = f", {reversals[case]:g} reversals where there are {counts[case]}" if wrong else ""
        line = f"{case:28s}{answered:>7s}{error:10.1e}{bounds[case]:10.1e}{spent:>10s}  {verdict(error)}{count}"
        lines.append(line)
    kept = [sum(error <= limit for error in errors.values()) for limit in LIMITS]
    lines += ["", *(f"within {limit:g}: {n} of {len(errors)} cases" for limit, n in zip(LIMITS, kept, strict=True))]
    lines.append(f"median error: {statistics.median(errors.values()):.1e}")
    if seconds:
        lines.append(f"median seconds: {statistics.median(seconds.values()):.3g}, all: {sum(seconds.values()):.4g}")
    told = [case for case in reversals if case in counts]
    if told:
        right = sum(reversals[case] == counts[case] for case in told)
        lines.append(f"reversals: {right} of {len(told)} counts are right")
    if left := [case for case in references if case not in spins]:
        lines.append(f"not answered: {', '.join(left)}")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("answers", type=Path)
    try:
        print("\n".join(score(parser.parse_args().answers)))
    except Wrong as wrong:
        sys.exit(f"error: {wrong}")


if __name__ == "__main__":
    main()
