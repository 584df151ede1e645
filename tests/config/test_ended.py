"""What has ended: each name gets a line with what to do instead, and datasets that name it are still of use."""

from pathlib import Path

import pytest
from support import Write
from support.cli import invoke

import sweep
from sweep.ended import ENDED
from sweep.results.configuration import configuration

TEXT = "friction: {mu: 60}\nintegrator: {t_end: 5}\n"


@pytest.mark.parametrize("name", ENDED)
def test_what_has_ended_says_what_to_do_instead(name: str, write: Write, tmp_path: Path) -> None:
    words = f"has ended; {ENDED[name]}"
    verb, dashes, option = name.rpartition("--")
    if dashes:
        result = invoke(verb.strip() or "run", "--" + option, "x")
        assert (result.exit_code, result.stderr) == (2, f"--{option}: {words}\n")
        return
    section, _, key = name.rpartition(".")
    file = write(TEXT + (f"{section}: {{{key}: 1}}\n" if section else f"{key}: 1\n"))
    result = invoke("run", file)
    line = f"{file}:3:{len(section) + 4 if section else 1}: {name}: {words}\n"
    assert (result.exit_code, result.stderr) == (2, line)
    file = write(TEXT + f"measure: [reversals, {name}]\n")
    assert invoke("run", file).stderr == f"{file}:3:22: measure[1]: {name} {words}\n"
    (tmp_path / "film.csv").write_text("time,spin\n" + "".join(f"{i},{i % 3}\n" for i in range(9)))
    for call in (
        lambda: sweep.load_config(write(TEXT), {name: 1}),
        lambda: sweep.fit(write(TEXT), tmp_path / "film.csv", [name]),
    ):
        with pytest.raises(sweep.InputError, match=f"^{name}: {words}$"):
            call()


def test_a_dataset_that_names_what_has_ended_is_followed(write: Write) -> None:
    """As one of an older program does: it opens, and its trajectories are run."""
    found = sweep.run(write(TEXT), measure=["reversals"])
    config = configuration(found)
    keys = [name for name in ENDED if "--" not in name]
    lines = "".join(f"{name}: 0.1\n" for name in keys if "." not in name)
    named = ", ".join(name if i % 2 else f"{{{name}: 2}}" for i, name in enumerate(keys))
    found.attrs["config"] = found.attrs["config"].replace("- reversals", f"[reversals, {named}]") + lines
    assert configuration(found) == config
    assert int(found.sweep.trajectory(t_end=1).sizes["trajectory"]) == 1
