"""Commands, their output and pictures: ```{console} runs its lines that begin with `$ ` while the pages are built.

The commands of a page run one after the other, in a folder of its own that holds the repository's `configs` and films.
Progress, on standard error, is left out.  What a command prints goes to a file if it ends with `> FILE`, and a
```{code-block} with a caption is a file.  ```{picture} shows an image file that an earlier command of the page has
written.  ```{python} runs a complete program in the same folder and shows the picture that it draws with pyplot.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

from docutils import nodes
from docutils.parsers.rst.directives.images import Image
from sphinx.application import Sphinx
from sphinx.directives.code import CodeBlock
from sphinx.util.docutils import SphinxDirective

_CONFIGS, _DATA = (Path(__file__).parents[2] / name for name in ("configs", "data"))

_SAVE = "import matplotlib.pyplot\nmatplotlib.pyplot.savefig({!r}, bbox_inches='tight')"


class Picture(Image):
    def run(self) -> list[nodes.Node]:
        env = self.state.document.settings.env
        path = env.current_document["console"] / self.arguments[0]
        self.arguments[0] = os.path.relpath(path, Path(env.doc2path(env.docname)).parent)
        return [nodes.container("", *super().run(), classes=["cell_output"])]


class _Running(SphinxDirective):
    """A directive that runs Python in the folder of its page."""

    has_content = True

    def _python(self, shown: str, *arguments: str) -> str:
        """Return the output; a failure is reported with the text that the page shows."""
        done = subprocess.run([sys.executable, *arguments], cwd=self._folder(), capture_output=True, text=True)
        if done.returncode:
            raise self.error(f"{shown}:\n{done.stdout}{done.stderr}")
        return done.stdout

    def _block(self, text: str, language: str) -> nodes.literal_block:
        block = nodes.literal_block(text, text, language=language)
        self.set_source_info(block)
        return block

    def _folder(self) -> Path:
        """The page's own folder, which the next build begins anew."""
        folder = Path(self.env.doctreedir) / "console" / self.env.docname
        if self.env.current_document.get("console") is None:
            shutil.rmtree(folder, ignore_errors=True)
            shutil.copytree(_CONFIGS, folder / "configs")
            shutil.copytree(_DATA, folder / "data", ignore=shutil.ignore_patterns("benchmark", "reference*"))
            self.env.current_document["console"] = folder
        return folder


class File(CodeBlock, _Running):
    def run(self) -> list[nodes.Node]:
        if name := self.options.get("caption"):
            (self._folder() / name).write_text("\n".join([*self.content, ""]), encoding="utf-8")
        return super().run()


class Python(_Running):
    option_spec = Image.option_spec

    def run(self) -> list[nodes.Node]:
        program = "\n".join(self.content)
        name = f"line{self.lineno}.png"
        self._python(program, "-c", f"import matplotlib\nmatplotlib.use('agg')\n{program}\n{_SAVE.format(name)}")
        picture = Picture(
            "picture", [name], self.options, self.content, self.lineno, self.content_offset, "", self.state,
            self.state_machine,
        )  # fmt: skip
        return [self._block(program, "python"), *picture.run()]


class Console(_Running):
    def run(self) -> list[nodes.Node]:
        lines = list[str]()
        for line in self.content:
            command = line.removeprefix("$ ")
            lines += [line, *self._output(command)]
        return [self._block("\n".join(lines), "console")]

    def _output(self, command: str) -> list[str]:
        words = shlex.split(command, comments=True)
        if words[:3] != ["python", "-m", "sweep"]:
            raise self.error(f"{command}: only commands of sweep are run; write ```console without braces")
        words, target = (words[:-2], words[-1]) if words[-2] == ">" else (words, "")
        output = self._python(command, *words[1:])
        if target:
            (self._folder() / target).write_text(output, encoding="utf-8")
        return [] if target else output.splitlines()


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("code-block", File, override=True)
    app.add_directive("console", Console)
    app.add_directive("picture", Picture)
    app.add_directive("python", Python)
    return {"parallel_read_safe": True}
