"""All scripts that a page of the viewer runs besides its library."""

from __future__ import annotations

from .drop_script import drop_script
from .glossary_script import glossary_script
from .narrow_script import narrow_script
from .page_script import page_script
from .tour import tour_script


def page_scripts(title: str) -> tuple[str, ...]:
    """Return them.

    Args:
        title: Title of the page.
    """
    return page_script(title), narrow_script(), tour_script(), drop_script(), glossary_script()
