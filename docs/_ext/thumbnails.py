"""```{thumbnails} shows small copies of all pictures that the build has made; each leads to its page."""

from __future__ import annotations

from collections.abc import Iterator

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class _Thumbnails(nodes.container):
    """The place of the pictures, which are known once all pages are read."""


class _Directive(SphinxDirective):
    def run(self) -> list[nodes.Node]:
        return [_Thumbnails(classes=["thumbnails"])]


def _fill(app: Sphinx, doctree: nodes.document, docname: str) -> None:
    for place in doctree.findall(_Thumbnails):
        small = nodes.container("", *_links(app, docname), classes=place["classes"])
        place.replace_self(small)


def _links(app: Sphinx, here: str) -> Iterator[nodes.Node]:
    """A link for the first picture of each other page that a command or a cell has drawn."""
    for docname in sorted(app.env.found_docs - {here}):
        tree = app.env.get_doctree(docname)
        drawn = [image for image in tree.findall(nodes.image) if _is_drawn(image)]
        for image in drawn[:1]:
            title = app.env.titles[docname].astext()
            copy = image.deepcopy()
            copy.attributes.update(alt=title, classes=[])
            address = app.builder.get_relative_uri(here, docname)
            linked = nodes.reference("", "", copy, internal=True, refuri=address)
            yield nodes.container("", linked, nodes.paragraph("", title))


def _is_drawn(image: nodes.Node) -> bool:
    parent = image.parent
    while parent is not None and not {"cell_output", "output"} & {*parent.get("classes", ())}:
        parent = parent.parent
    return parent is not None


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_node(_Thumbnails)
    app.add_directive("thumbnails", _Directive)
    app.connect("doctree-resolved", _fill)
    return {"parallel_read_safe": True}
