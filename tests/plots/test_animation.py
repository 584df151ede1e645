"""Moving pictures of trajectories."""

import re
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from PIL import Image
from support import ROOT, Write
from support.cli import invoke, refused
from support.runs import Stop

import sweep
from sweep.config import InputError
from sweep.plots import animation, body


def turning(bodies: int = 1, **given: float) -> xr.Dataset:
    """Bodies that lean, turn and travel as `sweep.trajectory` computes it."""
    time = np.linspace(0, 10, 101)
    motion = {
        "spin": 0.3 - 0.0601 * time, "ripple_free_spin": 0.3 - 0.0601 * time, "heading": 0.3 * time - 0.03 * time**2,
        "roll_angle": 0.1 * np.cos(time), "pitch_angle": 0.2 * np.sin(time), "table_x": time, "table_y": -0.2 * time,
    }  # fmt: skip
    series = {name: (("trajectory", "time"), np.tile(values, (bodies, 1))) for name, values in motion.items()}
    shape = {"a": 4.0, "b": 2.0, "c": 1.0, "delta": 0.2, "n0": 0.3} | given
    constants = {name: ("trajectory", np.full(bodies, value)) for name, value in shape.items()}
    return xr.Dataset(
        {**series, **constants}, {"time": time}, {"surface": "paraboloid"} if "paraboloid" in given else {}
    )


@pytest.mark.parametrize("given", [{}, {"offset": 0.3}, {"paraboloid": 1, "a": 0.1, "b": 0.3}], ids=str)
def test_the_lowest_point_of_the_body_is_where_it_touches_the_table(given: dict[str, float]) -> None:
    times = np.array([0.0, 3.0, 7.0])
    moving = body.moving(turning(**given).isel(trajectory=0), times)
    for frame, time in enumerate(times):
        points = np.einsum("ij,jkl->ikl", moving.turns[frame], moving.points - moving.contacts[frame][:, None, None])
        assert -1e-12 < points[2].min() < 0.06  # the points are apart
        at = points[:2].reshape(2, -1)[:, points[2].argmin()]
        assert np.abs(at).max() < 1.0
        assert moving.path[:, frame] == pytest.approx([time, -0.2 * time])


def test_a_body_turns_by_its_heading() -> None:
    upright = body.rotation(0.5, 0, 0)
    np.testing.assert_allclose(upright[:, 0], [np.cos(0.5), np.sin(0.5), 0], atol=1e-15)
    np.testing.assert_allclose(upright[:, 2], [0, 0, -1], atol=1e-15)
    up = [np.cos(0.1) * np.sin(0.2), -np.sin(0.1), -np.cos(0.1) * np.cos(0.2)]
    np.testing.assert_allclose(body.rotation(0.5, 0.1, 0.2)[2], up)


def test_a_clip_lasts_as_asked_and_moves(tmp_path: Path) -> None:
    animation.animate(turning(2), tmp_path / "clip.gif", begin=2, end=4, speed=10)
    with Image.open(tmp_path / "clip.gif") as clip:
        assert (clip.n_frames, clip.info["duration"]) == (5, 50)
        frames = []
        for i in range(5):
            clip.seek(i)
            frames.append(np.asarray(clip.convert("L"), float))
    assert np.abs(frames[0] - frames[-1]).max() > 50


def test_ffmpeg_is_given_all_frames_of_a_film(tmp_path: Path) -> None:
    """A stand-in for ffmpeg, which not every machine has, writes down its arguments and how much it is given."""
    program = tmp_path / "ffmpeg"
    program.write_text(
        f"#!{sys.executable}\nimport sys\nfrom pathlib import Path\n"
        "Path(sys.argv[-1]).write_text(' '.join([*sys.argv, str(len(sys.stdin.buffer.read()))]))\n"
    )
    program.chmod(0o755)
    with mpl.rc_context({"animation.ffmpeg_path": str(program)}):
        animation.animate(turning(3), tmp_path / "clip.mp4", begin=2, end=4, speed=10)
    given = (tmp_path / "clip.mp4").read_text().split()
    width, height = map(int, given[given.index("-s") + 1].split("x"))
    assert (width % 2, height % 2) == (0, 0)  # or its usual codec refuses them
    assert given[given.index("-framerate") + 1] == "20"
    assert int(given[-1]) == 5 * width * height * 4


def test_the_first_reversal_is_in_the_middle_of_the_clip() -> None:
    """The spins vanish near t = 5."""
    assert animation._until(turning(2).assign_attrs(model_brings="a model")) == pytest.approx(10, rel=3e-3)


def test_reversals_are_counted_as_they_happen() -> None:
    """The spins vanish near t = 5; a film, which has a name, counts nothing."""
    own = turning(2, n0=0.3).assign_attrs(model_brings="a model").assign(reversals=("trajectory", [1, 1]))
    for dataset, name in ((own, "n₀ = 0.3"), (own.assign_coords(trajectory=["film", "fit"]), "film")):
        scene = animation._Scene(dataset, np.linspace(0, 10, 11))
        shown = []
        for frame in (0, 4, 6, 10):
            scene.show(frame)
            shown.append(scene.bodies[0].axes.get_title())
        counts = ["0 reversals", "0 reversals", "1 reversal", "1 reversal"]
        assert shown == ([f"{name}: {count}" for count in counts] if name != "film" else ["film"] * 4)


def test_all_bodies_have_one_scale() -> None:
    """Also a film's, whose contact point is not known to travel."""
    bodies = turning(2)
    bodies["table_x"][1], bodies["table_y"][1] = 0.0, 0.0
    scene = animation._Scene(bodies, np.linspace(0, 10, 11))
    travelling, still = ((each.axes.get_xlim(), each.axes.get_ylim()) for each in scene.bodies)
    assert np.ptp(travelling, axis=1) == pytest.approx(np.ptp(still, axis=1))
    assert travelling != still


def test_a_page_asks_nothing_of_the_network(tmp_path: Path) -> None:
    animation.animate(turning(), tmp_path / "clip.html", end=1, speed=10)
    page = (tmp_path / "clip.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64") == 3
    assert not re.search(r"https?://|fa-", page.split("data:image")[0])


def test_a_dataset_is_shown_as_its_configuration_is(write: Write, tmp_path: Path) -> None:
    config, setting, clips = write(), {"mu": 60, "b": 3, "n0": 0.05, "t_end": 20}, []
    sweep.trajectory(config, **setting).to_netcdf(tmp_path / "one.nc")
    for source, values in ((config, setting), (tmp_path / "one.nc", {}), (sweep.open_dataset(tmp_path / "one.nc"), {})):
        sweep.animate(source, tmp_path / "clip.gif", begin=2, end=4, speed=10, **values)
        clips.append((tmp_path / "clip.gif").read_bytes())
    stretch = ("--begin", "2", "--end", "4", "--speed", "10")
    assert invoke("animate", tmp_path / "one.nc", *stretch).exit_code == 0
    assert {*clips} == {(tmp_path / "one.gif").read_bytes()}
    refused(
        invoke("animate", tmp_path / "one.nc", "--at", "mu=60"),
        "--at: cannot be used with a dataset; give the configuration",
    )


def test_what_cannot_be_shown_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^source: has no attitude"):
        animation.animate(turning().drop_vars("heading"))
    for part in ({"trajectory": []}, {"time": []}):
        with pytest.raises(InputError, match=r"^source: has an axis without values"):
            animation.animate(turning().isel(part))
    with pytest.raises(InputError, match=r"^source: .*at most 6"):
        animation.animate(turning(7))
    with pytest.raises(InputError, match=r"^begin: nothing lies between"):
        animation.animate(turning(), begin=11)
    with pytest.raises(InputError, match=r"^begin: nothing lies between"):
        animation.animate(turning(), begin=-np.inf, end=-1)
    for name, speed, words in (
        ("clip.gif", 0.1, "80 s, and may last 60 s; give a speed of 0.133 or more, or write an mp4$"),
        (None, 1e-300, r"8e\+300 s, and may last 3600 s; give a speed of 0.00222 or more$"),
    ):
        with pytest.raises(InputError, match=f"speed: the clip would last {words}"):
            animation.animate(turning(), name and tmp_path / name, end=8, speed=speed)
    without = mpl.rc_context({"animation.ffmpeg_path": "no-such-program"})
    with without, pytest.raises(InputError, match="ffmpeg, which is not installed"):
        animation.check(tmp_path / "clip.mp4", 0.0, None, None)
    refused(invoke("animate", ROOT / "configs" / "mu.yaml", "--output", "clip.avi"), "clip.avi: unknown format")


@pytest.mark.parametrize(
    ("argument", "values", "said"),
    [
        ("speed", (0, -5, np.nan, np.inf, "fast", True), "a finite number > 0"),
        ("begin", (np.nan, np.inf, None), "a finite number"),
        ("end", (np.nan, np.inf, -1, "1"), "a finite number above begin, 0"),
    ],
)
def test_a_wrong_number_is_refused_before_anything_is_simulated(
    argument: str, values: tuple[Any, ...], said: str, write: Write
) -> None:
    for value in values:
        with pytest.raises(InputError, match=f"^{argument}: must be {said}, not "):
            sweep.animate(write(), progress=Stop(0), **{argument: value})
        if isinstance(value, float):
            refused(invoke("animate", write(), f"--{argument}={value}"), f"--{argument}: must be {said}, not {value}")


def test_a_dataset_takes_no_cells_and_no_settings(tmp_path: Path) -> None:
    for name, values in {"at": {"at": {"mu": 60}}, "t_end": {"t_end": 3.0}}.items():
        with pytest.raises(InputError, match=f"^{name}: cannot be used with a dataset; give the configuration"):
            sweep.animate(turning(), tmp_path / "clip.gif", **values)


def test_a_model_without_an_attitude_is_refused_before_it_is_simulated() -> None:
    with pytest.raises(InputError, match="model: the bodies of effective have no attitude; animate slip or noslip"):
        sweep.animate({"model": "effective", "friction": {"mu": 60}}, progress=Stop(0))
