"""Text that is nearly a configuration, and bytes that are nearly a file."""

from random import Random
from typing import Any

from sweep.parameters import PARAMETERS

# What may stand in a file where a value belongs: scalars, collections and stray syntax.
ODD = (
    "", "~", "null", "true", "yes", "no", "on", "off", "0", "-0.0", "1", "-1", "3.5", "1e-3", "60", "[]", "{}",
    "1_000", "0x10", "0o17", "012", "1:30", "2001-01-01", "2001-12-14t21:59:43.10-05:00", "1e400", "1e-400", "1e308",
    "-1e308", "5e-324", ".inf", "-.inf", ".nan", ".NaN", "+.inf", "9" * 19, "9" * 400, "0." + "3" * 400, "١٢", "1,5",
    "[1, 2, 3]", "[1, 1.0]", "[.nan]", "[[1]]", "[{}]", "[a]", "[1, ]", "[reversals]", "[energy_error]", "[a, {}]",
    "{start: 1, stop: 2, num: 3}", "{start: 1, stop: 2, num: 3, spacing: log}", "{start: 2, stop: 1, num: 2}",
    "{start: 1, stop: 2, num: 1000000000}", "{start: -1e308, stop: 1e308, num: 3}", "{start: 1, stop: 2, num: 2.0}",
    "{start: -1, stop: 1, num: 3, spacing: log}", "{start: 1, stop: 1, num: 2}", "{start: 1, stop: 2, num: -1}",
    "{start: 1e-300, stop: 1e-299, num: 4, spacing: log}", "{start: a, stop: 2, num: 3}", "{step: 1}",
    "{start: {}, stop: 2, num: [3]}", "{? [a] : 1}", "{? {a: 1} : 1}", "{<<: {a: 1}}", "<<", "auto", "adams", "word",
    "dopri5", "slip", "noslip", "averaged", "analytic", "linear", "{mu: 60}", "'60'", '"60"', '"\\U00110000"',
    '"\\UFFFFFFFF"', '"\\uD800"', '"\\0"', '"\\e[31m"', '"a\\nb"', '"\\x85"', "'", '"', "`", "@a", "%a", "|", ">-",
    "!!python/object/apply:os.system [echo]", "!!python/name:os.system ''", "!!binary aGk=", "!!str 60", "!x 1",
    "!<tag:yaml.org,2002:float> 1", "!", "!!set {a, b}", "&a 1", "*a", "&a [*a]", "&a {b: *a}", "? ", "- 1", "-", ":",
    "../../x", "/etc/passwd", ".", "..", "loop", "cells.csv", "~root", "a" * 3000,
    "{" * 60, "[" * 400, "[" * 400 + "]" * 400, "{a: " * 300 + "}" * 300, "{at}", "{reason}", "#", "a #b", "\t", "é",
)  # fmt: skip

KEYS = (
    "", "name", "model", "cases", "literal[x]", "mu", "step", "<<", "a b", "~", "1", "null", "é", '"\\n"', "?",
    '"\\uD800"', "k" * 200, "*a", "&a k", "!!str k", "[k]", "{k: 1}", "{}", "at", "config", *PARAMETERS,
)  # fmt: skip

SCRAPS = (
    b"\0", b"\xff", b"\xef\xbb\xbf", b"\xff\xfe", b"\r", b"\r\n", b"\t", b"\n", b"---\n", b"...\n", b"%YAML 1.1\n",
    b"\xc2\x85", b"\xe2\x80\xa8", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\x1b[2J", b": ", b"- ", b"? ", b"[",
    b"]", b"{", b"}", b",", b"#", b"&a ", b"*a ", b"!!", b"|\n", b">\n", b"'", b'"', b"\\", b"<<", b"1e999", b"\x7f",
)  # fmt: skip


def tree(random: Random) -> list[list[Any]]:
    """A valid configuration: pairs of a key and either text or more pairs."""
    choose = random.choice
    axis = ("[2.0, 3.0, 5.0]", "{start: 2, stop: 5, num: 4}", "{start: 2, stop: 5, num: 3, spacing: log}", "3", "4.5e0")
    pairs = [
        ["body", [["a", choose(("10.0", "[9, 10]"))], ["b", choose(axis)], ["delta", choose(("0.03", "[0, .01]"))]]],
        ["friction", [["mu", choose(("60", "[40, 60]", "{start: 20, stop: 200, num: 3}"))]]],
        ["start", [["n0", choose(("0.05", "[0.02, -0.05]"))], ["x0", choose(("0.01", "[0.0, 0.01]"))], ["y0", "1e-2"]]],
        ["integrator", [["t_end", "1500"], ["method", choose(("dopri5", "auto"))], ["tolerance", "1e-6"]]],
        ["name", "x"], ["max_failed_fraction", "0.01"],
        # As of a run by default, whose kernels are compiled already.
        ["measure", "[reversals, energy_error, resting_spin]"],
        ["model", choose(("slip", "slip", "noslip", "analytic"))],
    ]  # fmt: skip
    kept = [pair for pair in pairs if pair[0] == "friction" or random.random() < 0.7]
    random.shuffle(kept)
    return kept


def _change(random: Random, pairs: list[list[Any]]) -> None:
    inner = [value for _, value in pairs if isinstance(value, list) and value]
    level = random.choice([pairs, *inner])
    if not level:
        return
    pair = random.choice(level)
    match random.randrange(8):
        case 0:
            level.remove(pair)
        case 1:
            level.insert(random.randrange(len(level) + 1), list(pair))
        case 2:
            pair[0] = random.choice(KEYS)
        case 3:
            pair[1] = [[random.choice(KEYS), pair[1]]]
        case 4:
            level.append([random.choice(KEYS), random.choice(ODD)])
        case 5 if isinstance(pair[1], str):
            pair[1] = f"[{pair[1]}, {random.choice(ODD)}]"
        case _:
            pair[1] = random.choice(ODD)


def _flow(pairs: list[list[Any]]) -> str:
    return "{" + ", ".join(f"{key}: {_flow(v) if isinstance(v, list) else v}" for key, v in pairs) + "}"


def block(pairs: list[list[Any]], random: Random, indent: str = "") -> str:
    """The pairs as YAML, some of them in flow style."""
    lines = []
    for key, value in pairs:
        if not isinstance(value, list):
            lines.append(f"{indent}{key}: {value}\n")
        elif random.random() < 0.5:
            lines.append(f"{indent}{key}: {_flow(value)}\n")
        else:
            lines.append(f"{indent}{key}:\n{block(value, random, indent + '  ')}")
    return "".join(lines)


def near_valid(random: Random) -> bytes:
    """A configuration with up to three parts changed."""
    pairs = tree(random)
    for _ in range(random.choice((0, 1, 1, 1, 2, 3))):
        _change(random, pairs)
    return block(pairs, random).encode()


def damage(random: Random, data: bytes, scraps: tuple[bytes, ...] = SCRAPS) -> bytes:
    """`data` with a few bytes changed, lost, doubled or inserted, or in another encoding."""
    if random.random() < 0.05:
        text = data.decode("utf-8", "replace")
        ends = (text.replace("\n", "\r\n"), text.replace("\n", "\r"), text.replace(" ", "\t"), "", text * 2)
        return random.choice((text.encode("utf-16"), text.encode("utf-8-sig"), *map(str.encode, ends)))
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 1, 2, 4, 16))):
        at = random.randrange(len(out) + 1)
        match random.randrange(6):
            case 0:
                out[at : at + 1] = bytes([random.randrange(256)])
            case 1:
                del out[at : at + random.choice((1, 1, 4, 64))]
            case 2:
                out[at:at] = random.choice(scraps)
            case 3:
                end = at + random.choice((1, 8, 64))
                out[at:at] = out[at:end] * random.choice((1, 1, 50))
            case 4:
                out[at : at + 1] = bytes([(out[at] if at < len(out) else 0) ^ (1 << random.randrange(8))])
            case _ if random.random() < 0.2:
                del out[at:]
    return bytes(out)
