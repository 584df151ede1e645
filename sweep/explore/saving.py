"""What the visitor handles to save what is seen."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from bokeh.models import Button, Column, ColumnDataSource, CustomJS, Row

from sweep.explore.slices import Source


class Saving:
    """Buttons that save what is seen: the map in the column `plots`, and the other figures."""

    def __init__(
        self, source: Source, netcdf: Callable[[], bytes], yaml: Callable[[], bytes] | None, plots: Column,
        figures: Sequence[Any],
    ) -> None:  # fmt: skip
        # What a name may be in a configuration, whatever the title of the dataset is.
        words = re.sub(r"[^A-Za-z0-9_-]", "", str(source.dataset.attrs.get("title", "")).split(":")[0])
        self.stem = f"{words or 'sweep'}_explored"
        self._file = ColumnDataSource({"bytes": [], "name": [], "type": []}, name="file")
        code = "if (cb_obj.data.name.length) sweep.save(cb_obj.data.bytes[0], cb_obj.data.name[0], cb_obj.data.type[0])"
        self._file.js_on_change("data", CustomJS(code=code))
        png = Button(label="PNG", name="png", width=64)
        args = {"plots": plots, "figures": list(figures), "name": f"{self.stem}.png"}
        png.js_on_click(CustomJS(args=args, code="sweep.picture([...plots.children, ...figures], name)"))
        link = Button(label="Copy link", name="link", width=92)
        link.js_on_click(CustomJS(args={"button": link}, code="sweep.copy(button)"))
        buttons = [link, png, self._button("netCDF", f"{self.stem}.nc", "application/x-netcdf", netcdf)]
        if yaml:
            buttons.append(self._button("YAML", f"{self.stem}.yaml", "application/yaml", yaml))
        link.tags = [self._file]
        self.root = Row(*buttons, name="save")

    def _button(self, label: str, name: str, mime: str, content: Callable[[], bytes]) -> Button:
        button = Button(label=label, name=label, width=76)

        def send() -> None:
            bytes_ = np.frombuffer(content(), "uint8")
            self._file.data = {"bytes": [bytes_], "name": [name], "type": [mime]}
            self._file.data = {"bytes": [], "name": [], "type": []}

        button.on_click(send)
        return button
