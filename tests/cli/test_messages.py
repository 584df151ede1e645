"""What commands say: what was meant, what was written and kept, and nothing more than one line when one is enough."""

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console
from support import Write
from support.cli import invoke

import sweep
from sweep.config import load_config
from sweep.config.document import parse_value
from sweep.engine.reporter import Progress
from sweep.kernels.status import DIVERGED
from sweep.progress import Terminal
from sweep.studies.trajectory import trajectory

TEXT = "name: quick\nmodel: averaged\nfriction: {mu: [40, 60]}\nintegrator: {t_end: 40}\n"

MEANT = {
    "rnu": "Did you mean 'run'?",
    "run c.yaml --outptu x": "Did you mean '--output'?",
    "run c.yaml --set fricton.mu=3": "--set fricton.mu: fricton: unknown key (did you mean friction?); the keys",
    "trajectory c.yaml --at mux=3": "--at mux: is not a parameter of the averaged model (did you mean mu?); its",
    "trajectory c.yaml --at mu=3 --at mu=-3": "--at mu[1]: must be a finite number >= 0",
    "plot d.nc --variable reversls": "--variable: there is no variable reversls (did you mean reversals?)",
    "plot d.nc --at n9=1": "--at: there is no axis n9; the axes are mu",
    "run c.yaml --set mu": "--set mu: must be NAME=VALUE, such as mu=60 or a=12cm",
    "run c.yaml --set name.first=3": "--set name.first: name is a value, not a section; name a key such as friction.mu",
    "run c.yaml --set mu=1..2:100000 --set n0=1..2:100000": "0 cells are too many",
    "critical c.yaml --set x0=[0.01,0.02]": "--set x0: cannot be an axis of critical spins; give one number",
}  # fmt: skip


@pytest.mark.parametrize("command", MEANT)
def test_a_refusal_says_what_may_be_meant(command: str, write: Write, tmp_path: Path) -> None:
    if "d.nc" in command:
        sweep.run(write(TEXT)).to_netcdf(tmp_path / "d.nc")
    files = {"c.yaml": f"{write(TEXT)} --output {tmp_path / 'out'}", "d.nc": str(tmp_path / "d.nc")}
    result = invoke(*" ".join(files.get(word, word) for word in command.split()).split())
    assert (result.exit_code, MEANT[command] in result.stderr) == (2, True), result.output
    assert "Usage: " in result.stderr or len(result.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "range_"),
    [
        ("20..60:41", (20, 60, 41)), ("-0.1..1e-1:3", (-0.1, 0.1, 3)), (".5..1.:2", (0.5, 1, 2)),
        ("1e1..25:1e3", (10, 25, 1000)), ("-3..-1:5", (-3, -1, 5)),
        *((other, None) for other in ("20..60", "20.60:41", "a..b:3", "20..60:41:2", "20...:3", "'20..60:41'")),
    ],
)  # fmt: skip
def test_a_range_is_set_in_short_and_other_words_are_none(text: str, range_: tuple[float, ...] | None) -> None:
    expected = dict(zip(("start", "stop", "num"), range_, strict=True)) if range_ else text.strip("'")
    assert parse_value(text, "") == expected


@pytest.mark.parametrize("number", ["3", "3.0", "3e0", "+3.", "30e-1"])
def test_a_whole_number_may_be_written_as_any_number(number: str, write: Write) -> None:
    text = f"friction: {{mu: {{start: 1, stop: 2, num: {number}}}}}\nseed: {number}\n"
    config = load_config(write(f"{text}measure: [reversals, {{reversal_times: {number}}}]\n"))
    assert (len(config.axes["mu"]), config.seed, config.measure) == (3, 3, ("reversals", "reversal_times=3"))


@pytest.mark.parametrize(
    "command",
    ["info quick.nc", "run quick.yaml --output . --fresh 2>&1"],
)
def test_a_closed_pipe_ends_a_command_silently(command: str, tmp_path: Path) -> None:
    """As `… | head` does once it has what it wants; also one that shows its progress there."""
    (tmp_path / "quick.yaml").write_text(TEXT, encoding="utf-8")
    sweep.run(tmp_path / "quick.yaml", tmp_path)
    words, both, _ = command.partition(" 2>&1")
    run = [sys.executable, "-m", "sweep", *words.split()]
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        run, cwd=tmp_path, stdout=writing, stderr=writing if both else subprocess.PIPE, text=True, check=False
    )
    os.close(writing)
    assert (done.returncode, done.stderr or "") == (141, "")


def test_a_command_reports_what_it_wrote(write: Write, tmp_path: Path) -> None:
    command, out = ("run", write(TEXT), "--output", tmp_path / "out"), tmp_path / "out" / "quick"
    assert invoke(*command).stdout.endswith(f"\nwrote {out}.nc and .png\n")
    again = invoke(*command)
    assert again.stdout.endswith("\nnothing was written\n")
    assert "already complete, nothing to compute" in again.stderr
    out.with_suffix(".png").unlink()
    assert invoke(*command).stdout.endswith(f"\nwrote {out}.png\n")
    assert invoke(*command, "--fresh").stdout.endswith(f"\nwrote {out}.nc and .png\n")


def test_a_log_reports_now_and_then_how_far_a_run_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rich draws its bar nowhere but on a terminal, and elsewhere once, at the end."""
    screen = io.StringIO()
    with Terminal() as terminal:
        terminal.console = Console(file=screen)
        for seconds, lines in ((60.0, 0), (-1.0, 1)):
            monkeypatch.setattr("sweep.progress._LOGGED", seconds)
            terminal.chunk(Progress(6072, 3036, 0, 0, 10.0))
            assert screen.getvalue().count("3036/6072 cells") == lines


ONE = "name: odd\nfriction: {mu: 60}\nintegrator: {t_end: 30}\n"


def test_a_step_fixed_for_another_method_is_not_used_by_dopri5(write: Write) -> None:
    config = sweep.load_config(write(ONE), {"method": "adams", "step": 0.1, "mu": 400.0})
    series = trajectory(config)
    assert int(series.status) != DIVERGED
    assert float(series.step) < 0.01
    assert series.attrs["integrator"].startswith("dopri5")


def test_brackets_in_a_path_are_not_markup(write: Write, tmp_path: Path) -> None:
    for _ in range(2):
        result = invoke("run", write(ONE), "--output", tmp_path / "o[/red]")
    assert "o[/red]" in result.stderr
    assert result.exit_code == 0


def test_a_changed_table_is_named(write: Write, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("mu\n60\n")
    file = write("name: odd\ncases: t.csv\nintegrator: {t_end: 10}\n")
    assert invoke("run", file, "--output", tmp_path / "o").exit_code == 0
    (tmp_path / "t.csv").write_text("mu\n61\n")
    result = invoke("run", file, "--output", tmp_path / "o")
    assert (result.exit_code, "the table of cases differs" in result.stderr) == (2, True)


def test_reduced_models_that_blow_up_are_diverged(write: Write) -> None:
    """A rattle far beyond what the averaged equations mean, at a step far too long for it."""
    dataset = sweep.run(write(ONE), model="averaged", n0=900.0, x0=9.0, step=0.9, t_end=3000.0)
    assert int(dataset.status) == DIVERGED
