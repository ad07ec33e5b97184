"""All scores of one episode, from its log."""

from __future__ import annotations

from typing import Any

from scenarios.log import EpisodeLog
from scenarios.score.clear import clear
from scenarios.score.consistency import consistency
from scenarios.score.difficulty import difficulty
from scenarios.score.frames import box_sequence
from scenarios.score.hota import hota
from scenarios.score.identification import identification, judge_traces
from scenarios.score.identity import identity
from scenarios.score.lane import lane_scores
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.prediction import prediction
from scenarios.score.reacquisition import reacquisition
from scenarios.score.strata import strata

DEFAULTS = ScoringParams()


def score(
    log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams = DEFAULTS
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Score one tracker on one episode, as its scene wants it.

    Args:
        log: The episode.
        boxes: Which truth is scored.
        params: Thresholds.

    Returns:
        The scores and the difficulty, as they are printed: fractions, seconds and counts as plain numbers,
        and None where what a score is computed from is missing.
    """
    traces = judge_traces(log, params)
    if log.scene == "motorcycle-lane":
        special = lane_scores(log, boxes=boxes, params=params)
    elif log.scene == "aerial":
        special = {
            "reacquisition": reacquisition(log, boxes=boxes, params=params),
            **prediction(log, boxes=boxes, params=params),
        }
    else:
        special = {"identification": identification(log, traces, boxes=boxes, params=params)}
    scores = box_scores(log, boxes=boxes, params=params) | special
    return scores, difficulty(log, traces, boxes=boxes, params=params)


def details(log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams = DEFAULTS) -> dict[str, Any]:
    """Look closer at one tracker on one episode.

    Args:
        log: The episode.
        boxes: Which truth is scored.
        params: Thresholds.

    Returns:
        ``conventions``: what is scored with either truth, so that it can be seen how much is convention;
        ``strata`` by visible share, distance and apparent speed (`scenarios.score.strata`); ``consistency``
        of the covariances (`scenarios.score.consistency`).
    """
    conventions: tuple[Boxes, ...] = ("amodal", "visible")
    return {
        "conventions": {which: box_scores(log, boxes=which, params=params) for which in conventions},
        "strata": strata(log, boxes=boxes, params=params),
        "consistency": consistency(log, boxes=boxes, params=params),
    }


def box_scores(
    log: EpisodeLog, *, boxes: Boxes = "amodal", params: ScoringParams = DEFAULTS
) -> dict[str, Any]:
    """Compute HOTA, CLEAR and identity.

    All are null for a tracker without boxes; all but the precision where there is nothing to be tracked, and
    the precision where nothing was claimed.
    """
    names = ("hota", "deta", "assa", "mota", "idf1", "id_switches", "precision", "recall")
    scores: dict[str, Any] = dict.fromkeys(names)
    if not log.has_boxes:
        return scores
    sequence = box_sequence(log, boxes=boxes, params=params)
    by_frame = clear(sequence, threshold=params.match_iou)
    if sequence.track_boxes:
        scores["precision"] = by_frame.precision
    if sequence.truth_boxes:
        overall = hota(sequence)
        scores |= {
            "hota": float(overall.hota.mean()),
            "deta": float(overall.deta.mean()),
            "assa": float(overall.assa.mean()),
            "mota": by_frame.mota,
            "idf1": identity(sequence, threshold=params.match_iou).idf1,
            "id_switches": by_frame.id_switches,
            "recall": by_frame.recall,
        }
    return scores
