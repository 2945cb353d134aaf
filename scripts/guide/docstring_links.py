"""Griffe extension: names in docstrings become links of the guide.

The docstrings refer to code as :func:`name` and to literature as [Key]; Markdown knows neither. Registered in
mkdocs.yml.
"""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension, Object

ROLE = re.compile(r":(?:func|class|mod|attr|meth|data|exc):`(~?)([\w.]+)`")
KEY = re.compile(r"\[(Mavrogiannis2014)\](?![\[(])")
DOUBLE_TICKS = re.compile(r"``([^`]+)``")


class DocstringLinks(Extension):
    """Turns roles and literature keys of every docstring into Markdown links."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        """Change the docstring of one object."""
        if obj.docstring is None:
            return
        text = ROLE.sub(lambda match: _link(obj, match.group(2)), obj.docstring.value)
        text = KEY.sub(lambda match: f"[{match.group(1)}][{match.group(1).lower()}]", text)
        obj.docstring.value = DOUBLE_TICKS.sub(r"`\1`", text)


def _link(obj: Object, name: str) -> str:
    """Return a name as a link that may stay plain where the guide does not show the object."""
    short = name.rsplit(".", 1)[-1]
    try:
        path = name if name.startswith("grasp_planner.") else obj.resolve(name.lstrip("."))
    except Exception:  # a name the scope does not know stays code
        return f"`{short}`"
    return f'<autoref identifier="{path}" optional>`{short}`</autoref>'
