"""Makes the buttons that copy the address and save what is seen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from bokeh.models import Button, Column, CustomJS, Row

from sweep.explorer.controls import WIDGETS

_TYPES = {"csv": ("CSV", "text/csv"), "nc": ("netCDF", "application/x-netcdf"), "yaml": ("YAML", "application/yaml")}


def buttons(
    name: str, plots: Column, figures: Sequence[Any], files: Mapping[str, Callable[[], bytes]],
    call: Callable[..., None],
) -> Row:  # fmt: skip
    """Buttons that copy the address and save what is seen.

    Parameters
    ----------
    name : of all files, without its ending
    plots, figures : what is in the picture: the map in the column `plots`, and the others
    files : by its ending, what makes the content of a file
    call : calls a function of page.js with arguments
    """
    link = Button(label="Copy link", name="link", width=92)
    link.js_on_click(CustomJS(args={"button": link}, code="sweep.copy(button)"))
    png = Button(label="PNG", name="png", width=64)
    args = {"plots": plots, "figures": list(figures), "name": f"{name}.png"}
    png.js_on_click(CustomJS(args=args, code="sweep.picture([...plots.children, ...figures], name)"))
    made = []
    for ending, content in files.items():
        label, mime = _TYPES[ending]
        made.append(button := Button(label=label, name=label, width=76))
        button.on_click(partial(_send, f"{name}.{ending}", mime, content, call))
    return Row(link, png, *made, name="save", stylesheets=[WIDGETS], styles={"flex-wrap": "wrap"})


def _send(name: str, mime: str, content: Callable[[], bytes], call: Callable[..., None]) -> None:
    call("save", np.frombuffer(content(), "uint8"), name, mime)
