"""Plots of a run, as SVG text for a page."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from .report_tables import Share

COLOURS = ("#4361ee", "#e76f51", "#2a9d8f", "#e9c46a", "#8d5a97", "#5c677d")
BINS = 30
Values = Mapping[str, Sequence[float]]
"""Numbers by group."""


def share_bars(shares: Mapping[str, Share], label: str) -> str:
    """Return a bar chart of success shares with their 95 % intervals.

    Args:
        shares: Share of each group.
        label: What the groups are.
    """
    figure, axes = _figure(label, "feasible [%]")
    names = list(shares)
    middle = np.array([100 * share.value for share in shares.values()])
    ends = 100 * np.array([share.interval for share in shares.values()]).reshape(-1, 2)
    errors = np.maximum(np.abs(ends.T - middle), 0.0)
    axes.bar(names, middle, yerr=errors, color=COLOURS[0], ecolor="black", capsize=3, width=0.6)
    axes.set_ylim(0, 105)
    return svg(figure)


def histograms(values: Values, label: str) -> str:
    """Return histograms of some groups over the same bins, drawn as steps."""
    figure, axes = _figure(label, "grasps")
    everything = np.concatenate([np.asarray(numbers, dtype=float) for numbers in values.values()])
    low, high = np.percentile(everything, [0, 99])
    edges = np.linspace(low, high if high > low else low + 1.0, BINS + 1)
    for index, (name, numbers) in enumerate(values.items()):
        counts, _ = np.histogram(np.clip(numbers, edges[0], edges[-1]), edges)
        axes.stairs(counts, edges, label=name, color=COLOURS[index % len(COLOURS)], linewidth=1.6)
    axes.legend(fontsize=8)
    return svg(figure)


def boxes(values: Values, label: str, unit_label: str) -> str:
    """Return boxes (quartiles, 5 % and 95 %) of some groups side by side."""
    figure, axes = _figure(label, unit_label)
    axes.boxplot([np.asarray(numbers) for numbers in values.values()], whis=(5, 95), showfliers=False, widths=0.5)
    axes.set_xticks(range(1, len(values) + 1), list(values))
    return svg(figure)


def svg(figure: Figure) -> str:
    """Return a figure as an SVG element."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :]


def png_data(figure: Figure) -> str:
    """Return a figure as the address of an image that holds its data."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=70)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()


def _figure(x_label: str, y_label: str) -> tuple[Figure, Any]:
    """Return an empty figure."""
    figure = Figure(figsize=(4.6, 3.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_xlabel(x_label, fontsize=9)
    axes.set_ylabel(y_label, fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(axis="y", alpha=0.3)
    return figure, axes
