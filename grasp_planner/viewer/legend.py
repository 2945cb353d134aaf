"""What the colours of the picture mean (HTML)."""

from __future__ import annotations

LEGEND = (
    "<div style='font:12px system-ui,sans-serif;margin:2px 12px 6px;display:flex;flex-wrap:wrap;gap:2px 10px'>"
    + "".join(
        f"<span><span style='color:{colour}'>●</span> {word}</span>"
        for colour, word in (
            ("#d62828", "contact forces"),
            ("#43aa6e", "friction cones"),
            ("#118a4e", "task (drag the ball)"),
            ("#4361ee", "force ellipsoid"),
            ("#545454", "weight"),
        )
    )
    + "</div>"
)
"""The legend."""
