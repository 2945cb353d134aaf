"""MkDocs hook: equations become MathML while the guide is built, so that the pages need no script and no network.

Registered in mkdocs.yml. An equation that can't be converted ends the build.
"""

from __future__ import annotations

import html
import re
from typing import Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError

EQUATION = re.compile(r'<(span|div) class="arithmatex">\s*\\([(\[])(.*?)\\[)\]]\s*</\1>', re.S)
"""What pymdownx.arithmatex makes of $…$ and $$…$$ in its generic mode."""
NUMBER = re.compile(r"\\tag\{([^}]*)\}")


def on_page_content(content: str, page: Any, **_: Any) -> str:
    """Return the HTML of a page with its equations as MathML."""

    def replace(match: re.Match[str]) -> str:
        return as_mathml(html.unescape(match.group(3)), match.group(2) == "[", page.file.src_uri)

    return EQUATION.sub(replace, content)


def as_mathml(latex: str, block: bool, where: str = "") -> str:
    """Return an equation as MathML.

    Args:
        latex: The equation, without its delimiters.
        block: Whether it stands alone.
        where: Page, for the error.

    Raises:
        PluginError: If it holds something that the converter does not know.
    """
    numbers = NUMBER.findall(latex)
    try:
        mathml = convert(NUMBER.sub("", latex).strip(), display="block" if block else "inline")
    except Exception as error:  # the converter raises many kinds
        raise PluginError(f"{where}: equation {latex!r}: {error!r}") from None
    if "\\" in mathml:
        raise PluginError(f"{where}: equation {latex!r}: an unknown command is left: {mathml}")
    if not block:
        return mathml
    label = "".join(f'<span class="equation-number">({number})</span>' for number in numbers)
    return f'<div class="equation">{mathml}{label}</div>'
