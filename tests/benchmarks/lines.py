"""What the benchmarks measured, line by line, against what is wanted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One measurement.

    Attributes:
        what: What was measured, with its unit.
        measured: The number.
        least: It should be no less; None where nothing is wanted of it.
        most: It should be no more; likewise.
    """

    what: str
    measured: float
    least: float | None = None
    most: float | None = None

    @property
    def wanted(self) -> str:
        """What is wanted, in words; empty if nothing is."""
        if self.least is not None:
            return f">= {self.least:g}"
        return f"<= {self.most:g}" if self.most is not None else ""

    @property
    def verdict(self) -> str:
        """``ok`` or ``MISSED``; empty if nothing is wanted."""
        if not self.wanted:
            return ""
        low = self.least is None or self.measured >= self.least
        return "ok" if low and (self.most is None or self.measured <= self.most) else "MISSED"


def table(lines: Sequence[Line]) -> str:
    """Lay lines out in columns: what, measured, wanted, verdict."""
    rows = [("what", "measured", "wanted", "")]
    rows += [(line.what, f"{line.measured:.2f}", line.wanted, line.verdict) for line in lines]
    widths = [max(len(row[k]) for row in rows) for k in range(4)]
    return "\n".join(
        f"{a:<{widths[0]}}  {b:>{widths[1]}}  {c:>{widths[2]}}  {d}".rstrip() for a, b, c, d in rows
    )
