"""Matplotlib figures as SVG that goes into the page and takes its colours from there."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Callable

from markupsafe import Markup
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

_INK, _RULE = "#010203", "#010204"  # stand-ins: the page's own ink and rules take their place
_STYLE: dict[str, object] = {
    "axes.edgecolor": _RULE,
    "axes.facecolor": "none",
    "axes.grid": True,
    "axes.labelcolor": _INK,
    "axes.labelsize": 8.5,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "figure.facecolor": "none",
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "grid.color": _RULE,
    "grid.linewidth": 0.5,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "svg.fonttype": "none",
    "svg.hashsalt": "testtrack",
    "text.color": _INK,
    "xtick.color": _RULE,
    "xtick.labelcolor": _INK,
    "xtick.labelsize": 8,
    "ytick.color": _RULE,
    "ytick.labelcolor": _INK,
    "ytick.labelsize": 8,
}
_DPI = 144


def draw_svg(
    draw: Callable[[Axes], None], *, size: tuple[float, float], margins: tuple[float, float, float, float]
) -> tuple[Markup, tuple[float, float, float, float]]:
    """Return a figure's SVG, and where its axes stand in it: left, bottom, right, top as shares.

    ``size`` and ``margins`` (left, right, bottom, top) are inches. They are fixed, since an automatic layout
    takes as long as the drawing.
    """
    (width, height), (left, right, bottom, top) = size, margins
    with rc_context(_STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=size, dpi=_DPI)
        figure.subplots_adjust(left / width, bottom / height, 1 - right / width, 1 - top / height)
        axes = figure.subplots()
        draw(axes)
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", dpi=_DPI, metadata={"Date": None, "Creator": None})
        extents = axes.get_position().extents
    return _inline(buffer.getvalue()), (extents[0], extents[1], extents[2], extents[3])


def _inline(text: str) -> Markup:
    """Turn a matplotlib SVG file into an element: no prolog or metadata, the page's colours, own ids."""
    digest = hashlib.sha256(text.encode()).hexdigest()[:8]
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'<g id="[^"]*">', "<g>", text)
    text = re.sub(r'^<svg [^>]*viewBox="([^"]*)"[^>]*>', r'<svg viewBox="\1" role="img">', text)
    text = re.sub(r'( id="|url\(#|href="#)', rf"\g<1>{digest}-", text)
    text = text.replace(_INK, "currentColor").replace(_RULE, "var(--rule)")
    # It is matplotlib's own output, with every text in it escaped, so it need not be escaped again.
    return Markup(text)
