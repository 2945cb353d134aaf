"""What the colours of the picture mean (HTML)."""

from __future__ import annotations

MEANINGS = (
    ("#d62828", "contact forces"),
    ("#43aa6e", "friction cones"),
    ("#118a4e", "task"),
    ("#4361ee", "force ellipsoid"),
    ("#808080", "weight"),
)
"""Colours, and what has them."""
LEGEND = (
    "<div style='font:12px system-ui,sans-serif;margin:2px 12px 6px;display:flex;flex-wrap:wrap;gap:2px 10px'>"
    + "".join(f"<span><span style='color:{colour}'>●</span> {word}</span>" for colour, word in MEANINGS)
    + "</div>"
)
"""The legend."""
