"""Vehicles that vanish from an aerial camera's sight and come back (scoring.md 10)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.score.params import ScoringParams
from sim.truth.events import occlusion_events
from sim.truth.types import AerialTruth

COLOUR = 0.08
"""Vehicles of one kind look alike if no channel of their paints differs by more, in sRGB, ..."""
SIZE = 0.05
"""... and none of their sizes by more, as a part of it."""
CHANGE = 0.2
"""A change of speed counts if it is a larger part of the speed before."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Disappearance:
    """One vehicle that was scored, then hidden, then scored again.

    Attributes:
        vehicle: Its id.
        occluder: Id of what hid most of it; 0 where it was out of view.
        first: First hidden tick.
        last: Last hidden tick.
        before: Ticks in which it was scored since it last came back, ascending.
        after: Ticks in which it is scored until it vanishes again.
        speeds: M/s before and after.
        together: Ids of those among the other disappearances that were hidden at the same time.
        lookalikes: Those of them that look like it.
    """

    vehicle: int
    occluder: int
    first: int
    last: int
    before: tuple[int, ...]
    after: tuple[int, ...]
    speeds: tuple[float, float]
    together: tuple[int, ...] = ()
    lookalikes: tuple[int, ...] = ()

    @property
    def frames(self) -> int:
        """For how many frames it was hidden."""
        return self.last - self.first + 1

    @property
    def changed_speed(self) -> bool:
        """Whether it came back faster or slower by more than `CHANGE`."""
        before, after = self.speeds
        return abs(after - before) > CHANGE * max(before, 1.0)


def disappearances(
    truths: Sequence[AerialTruth], rate: int, params: ScoringParams
) -> tuple[Disappearance, ...]:
    """Find the events that re-acquisition is scored by, whether or not anybody tracked them.

    Args:
        truths: Every frame of the episode, in order, from tick 0.
        rate: Frames a second.
        params: Thresholds.

    Returns:
        The events, by their first frame, then by vehicle.
    """
    rows = [{vehicle: k for k, vehicle in enumerate(truth.ids.tolist())} for truth in truths]
    scored: dict[int, list[int]] = {}
    for truth in truths:
        for vehicle in truth.ids[truth.visible >= params.min_visible].tolist():
            scored.setdefault(vehicle, []).append(truth.tick)
    spans: dict[int, list[tuple[int, int, int, bool]]] = {}
    for event in occlusion_events(truths, rate):
        if event.last - event.first + 1 >= params.min_hidden_frames:
            span = (event.first, event.last, event.occluder, event.returned is not None)
            spans.setdefault(event.hidden, []).append(span)
    found = []
    for vehicle, own in spans.items():
        ticks = np.array(scored.get(vehicle, []), np.int64)
        ends = [-1, *(last for _, last, _, _ in own)]
        starts = [*(first for first, _, _, _ in own), len(truths)]
        for k, (first, last, occluder, returned) in enumerate(own):
            before = ticks[(ticks > ends[k]) & (ticks < first)]
            after = ticks[(ticks > last) & (ticks < starts[k + 1])]
            if not returned or min(len(before), len(after)) < params.min_scored_frames:
                continue
            speeds = tuple(
                float(np.hypot(*truths[tick].world_velocities[rows[tick][vehicle], :2]))
                for tick in (int(before[-1]), int(after[0]))
            )
            found.append(
                Disappearance(
                    vehicle=vehicle,
                    occluder=occluder,
                    first=first,
                    last=last,
                    before=tuple(before.tolist()),
                    after=tuple(after.tolist()),
                    speeds=(speeds[0], speeds[1]),
                )
            )
    found.sort(key=lambda one: (one.first, one.vehicle))
    return tuple(_with_company(one, found, truths, rows) for one in found)


def _with_company(
    one: Disappearance,
    found: Sequence[Disappearance],
    truths: Sequence[AerialTruth],
    rows: Sequence[dict[int, int]],
) -> Disappearance:
    """Note who was hidden at the same time, and who of them looks alike."""
    others = {
        other.vehicle: other
        for other in found
        if other.vehicle != one.vehicle and other.first <= one.last and one.first <= other.last
    }
    looks = _look(one, truths, rows)
    alike = tuple(vehicle for vehicle, other in others.items() if _same(looks, _look(other, truths, rows)))
    return replace(one, together=tuple(others), lookalikes=alike)


def _look(
    one: Disappearance, truths: Sequence[AerialTruth], rows: Sequence[dict[int, int]]
) -> tuple[int, NDArray[np.float64], NDArray[np.float64]]:
    tick = one.before[-1]
    truth, row = truths[tick], rows[tick][one.vehicle]
    return int(truth.kinds[row]), truth.sizes[row], np.asarray(truth.colours[row], np.float64)


def _same(
    a: tuple[int, NDArray[np.float64], NDArray[np.float64]],
    b: tuple[int, NDArray[np.float64], NDArray[np.float64]],
) -> bool:
    return (
        a[0] == b[0]
        and bool((np.abs(a[1] - b[1]) <= SIZE * np.maximum(a[1], b[1])).all())
        and bool((np.abs(a[2] - b[2]) <= COLOUR).all())
    )


def summary(found: Sequence[Disappearance], rate: int) -> dict[str, Any]:
    """Say how many there are of each kind, and what makes them hard.

    Returns:
        For ``occluded`` and ``out_of_view``: ``count`` and ``median_hidden_s``; of all together the median,
        ``hidden_s``, and as shares ``changed_speed``, ``together`` (two or more hidden at once) and
        ``lookalikes``.
    """
    kinds = {
        "occluded": [one for one in found if one.occluder],
        "out_of_view": [one for one in found if not one.occluder],
    }
    counts = {
        kind: {"count": len(chosen), "median_hidden_s": _median([one.frames / rate for one in chosen])}
        for kind, chosen in kinds.items()
    }
    return counts | {
        "count": len(found),
        "median_hidden_s": _median([one.frames / rate for one in found]),
        "changed_speed": _share([one.changed_speed for one in found]),
        "together": _share([bool(one.together) for one in found]),
        "lookalikes": _share([bool(one.lookalikes) for one in found]),
    }


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def _share(flags: Sequence[bool]) -> float | None:
    return float(np.mean(flags)) if flags else None
