"""How well a foreground mask fits, how soon it lets go of what stands, and how soon it gets over a flash."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenarios.log import EpisodeLog
from scenarios.score.frames import ScoredFrame
from scenarios.score.params import ScoringParams
from scenarios.shown import NO_MASK
from sim.truth.standing import Standing


def foreground_f(log: EpisodeLog, frames: Sequence[ScoredFrame], params: ScoringParams) -> float | None:
    """Give the F measure of all masks; shadows are background, what has long stood does not count."""
    hits, marked, wanted = total_counts(log, frames, params)
    return 2 * hits / (marked + wanted) if marked + wanted else None


def total_counts(
    log: EpisodeLog, frames: Sequence[ScoredFrame], params: ScoringParams
) -> tuple[int, int, int]:
    """Sum `mask_counts` over frames."""
    counts = [found for frame in frames if (found := mask_counts(log, frame, params)) is not None]
    hits, marked, wanted = np.array(counts, np.int64).reshape(-1, 3).sum(axis=0).tolist()
    return hits, marked, wanted


def mask_counts(log: EpisodeLog, frame: ScoredFrame, params: ScoringParams) -> tuple[int, int, int] | None:
    """Count pixels of riders in the mask of one frame, of the mask, and of riders; None without a mask."""
    mask_px, object_px = log.shown.mask_px, log.shown.object_px
    if mask_px is None or object_px is None or mask_px[frame.index] == NO_MASK:
        return None
    moving = frame.standing < params.standing_seconds
    inside = object_px[frame.index]
    return (
        int(inside[moving].sum()),
        int(mask_px[frame.index] - inside[~moving].sum()),
        int(frame.truth.visible_px[moving].sum()),
    )


def absorption_seconds(log: EpisodeLog, params: ScoringParams) -> float | None:
    """Give the mean seconds from a rider's standstill until it has left the mask for as long as it stands.

    Riders that stand for `ScoringParams.standing_seconds` count; those that were not in the mask at all, or
    are never absorbed, do not, and None is given where there is no other.
    """
    if log.shown.mask_px is None or log.shown.object_px is None:
        return None
    clock = Standing(log.rate)
    spells: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for index, truth in enumerate(log.truth):
        seconds = clock.seconds(truth)
        for row in np.flatnonzero((seconds > 0) & (truth.visible >= params.min_visible)):
            begun = index - round(seconds[row] * log.rate)
            share = float(log.shown.object_px[index][row] / truth.visible_px[row])
            if log.shown.mask_px[index] != NO_MASK:
                spells.setdefault((int(truth.ids[row]), begun), []).append((float(seconds[row]), share))
    found = []
    for spell in spells.values():
        after, shares = np.array(spell).T
        if after[-1] < params.standing_seconds or shares[-1] > params.absorbed_share:
            continue
        held = np.flatnonzero(shares > params.absorbed_share)
        if len(held):
            found.append(float(after[held[-1] + 1]))
    return float(np.mean(found)) if found else None


def recovery_seconds(log: EpisodeLog, params: ScoringParams) -> float | None:
    """Give the mean seconds from a sudden change of light until the mask holds little background again.

    One that it never gets over counts with all the seconds until the next change or the end. None where the
    light never changes at once.
    """
    mask_px, object_px = log.shown.mask_px, log.shown.object_px
    sudden = [k for k in flashes(log.light, params.flash_change) if k >= params.training_frames]
    if mask_px is None or object_px is None or not sudden:
        return None
    visible = np.array([truth.visible_px.sum() for truth in log.truth])
    inside = np.array([counts.sum() for counts in object_px])
    false = (mask_px - inside) / (log.width * log.height - visible)
    calm = (false <= params.recovered_share) & (mask_px != NO_MASK)
    span = max(1, round(params.recovered_seconds * log.rate))
    found = []
    for first, end in zip(sudden, [*sudden[1:], len(log.truth)], strict=True):
        good = [k for k in range(first, end) if calm[k : min(k + span, end)].all()]
        found.append(((good[0] if good else end) - first) / log.rate)
    return float(np.mean(found))


def flashes(light: NDArray[np.float64], change: float) -> list[int]:
    """Return the frames in which the light (T,) has changed by more than a part ``change`` of it at once."""
    if len(light) < 2:
        return []
    jump = np.abs(np.diff(light)) > change * light[:-1]
    return [int(k) + 1 for k in np.flatnonzero(jump)]
