"""CLEAR, identity and HOTA: against TrackEval, published values, hand calculations and naive oracles."""

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios.export import mot
from scenarios.score.clear import clear
from scenarios.score.hota import ALPHAS, hota
from scenarios.score.identity import identity
from scenarios.score.sequence import Sequence
from tracker.boxes import iou

FIXTURES = Path(__file__).parents[2] / "fixtures"
DOCUMENT = json.loads((FIXTURES / "trackeval.json").read_text())


def sequence_of(case: dict[str, Any]) -> Sequence:
    shaped = [
        np.array(matrix, float).reshape(len(truth), len(track))
        for truth, track, matrix in zip(case["truth"], case["tracks"], case["similarities"], strict=True)
    ]
    return Sequence.of(case["truth"], case["tracks"], shaped)


def tud(name: str) -> Sequence:
    truth, test = (mot.read_tracks(FIXTURES / "tud" / name / file) for file in ("gt.txt", "test.txt"))
    frames = max(len(truth), len(test))
    truth, test = (
        mot.read_tracks(FIXTURES / "tud" / name / file, frames=frames) for file in ("gt.txt", "test.txt")
    )
    return Sequence.of(
        [t.ids for t in truth],
        [p.ids for p in test],
        [iou(t.boxes, p.boxes) for t, p in zip(truth, test, strict=True)],
    )


def all_measures(sequence: Sequence) -> dict[str, Any]:
    """Every number under TrackEval's name."""
    c, h, i = clear(sequence), hota(sequence), identity(sequence)
    return {
        "MOTA": c.mota,
        "MOTP": c.motp,
        "CLR_Re": c.recall,
        "CLR_Pr": c.precision,
        "CLR_TP": c.true_positives,
        "CLR_FN": c.false_negatives,
        "CLR_FP": c.false_positives,
        "IDSW": c.id_switches,
        "MT": c.mostly_tracked,
        "PT": c.partly_tracked,
        "ML": c.mostly_lost,
        "Frag": c.fragmentations,
        "HOTA": h.hota,
        "DetA": h.deta,
        "AssA": h.assa,
        "DetRe": h.detection_recall,
        "DetPr": h.detection_precision,
        "AssRe": h.association_recall,
        "AssPr": h.association_precision,
        "LocA": h.localisation,
        "IDF1": i.idf1,
        "IDR": i.recall,
        "IDP": i.precision,
        "IDTP": i.true_positives,
        "IDFN": i.false_negatives,
        "IDFP": i.false_positives,
    }


@pytest.mark.parametrize("case", DOCUMENT["cases"], ids=lambda case: case["name"])
def test_equal_to_trackeval(case: dict[str, Any]) -> None:
    ours = all_measures(sequence_of(case))
    assert set(ours) == set(case["answers"])
    for name, wanted in case["answers"].items():
        np.testing.assert_allclose(ours[name], wanted, rtol=0, atol=1e-6, err_msg=name)


@pytest.mark.parametrize("name", ["TUD-Campus", "TUD-Stadtmitte"])
def test_equal_to_trackeval_on_tud(name: str) -> None:
    ours = all_measures(tud(name))
    for measure, wanted in DOCUMENT["tud"][name].items():
        np.testing.assert_allclose(ours[measure], wanted, rtol=0, atol=1e-6, err_msg=measure)


@pytest.mark.parametrize(
    ("name", "idf1", "mota", "motp", "fp", "fn", "switches", "three"),
    [
        ("TUD-Campus", 55.8, 52.6, 72.3, 13, 150, 7, (0.39140, 0.41805, 0.36912)),
        ("TUD-Stadtmitte", 64.5, 56.4, 65.4, 45, 452, 7, (0.39785, 0.39227, 0.40884)),
    ],
)
def test_published_values(
    name: str,
    idf1: float,
    mota: float,
    motp: float,
    fp: int,
    fn: int,
    switches: int,
    three: tuple[float, ...],
) -> None:
    """Published by the MOTChallenge devkit (HOTA, DetA, AssA: by TrackEval)."""
    sequence = tud(name)
    c, h = clear(sequence), hota(sequence)
    assert (c.false_positives, c.false_negatives, c.id_switches) == (fp, fn, switches)
    rounded = [round(100 * x, 1) for x in (identity(sequence).idf1, c.mota, c.motp)]
    assert rounded == [idf1, mota, motp]
    assert [round(float(x.mean()), 5) for x in (h.hota, h.deta, h.assa)] == list(three)


def repeat(frames: list[tuple[list[int], list[int], Any]]) -> Sequence:
    return Sequence.of(*zip(*frames, strict=True))


EYE = np.eye(2)


def test_a_perfect_tracker_scores_one() -> None:
    sequence = repeat([([5, 9], [1, 2], EYE)] * 10 + [([9], [2], [[1.0]])])
    c, h, i = clear(sequence), hota(sequence), identity(sequence)
    assert c.mota == c.motp == c.recall == c.precision == i.idf1 == 1
    assert c.id_switches == c.fragmentations == 0
    assert c.mostly_tracked == 2
    assert (h.hota == 1).all()


def test_a_swap_by_hand() -> None:
    """Two tracks change places after 6 of 10 frames."""
    sequence = repeat([([5, 9], [1, 2], EYE)] * 6 + [([5, 9], [1, 2], EYE[::-1])] * 4)
    c, h, i = clear(sequence), hota(sequence), identity(sequence)
    assert c.id_switches == 2
    assert c.mota == pytest.approx(1 - 2 / 20)
    assert i.idf1 == pytest.approx(12 / 20)
    # Each box's pair has 6 (or 4) matches of 10 + 10 - 6 (- 4) frames.
    assa = (12 * 6 / 14 + 8 * 4 / 16) / 20
    np.testing.assert_allclose(h.assa, assa)
    np.testing.assert_allclose(h.hota, np.sqrt(assa))


def test_a_drop_by_hand() -> None:
    """One of two objects is lost for 3 of 10 frames and comes back under a new id."""
    sequence = repeat(
        [([5, 9], [1, 2], EYE)] * 4 + [([5, 9], [1], EYE[:, :1])] * 3 + [([5, 9], [1, 3], EYE)] * 3
    )
    c, h, i = clear(sequence), hota(sequence), identity(sequence)
    assert (c.true_positives, c.false_negatives, c.false_positives) == (17, 3, 0)
    assert (c.id_switches, c.fragmentations, c.mostly_tracked, c.partly_tracked) == (1, 1, 1, 1)
    assert c.mota == pytest.approx(16 / 20)
    assert i.idf1 == pytest.approx(2 * 14 / (20 + 17))
    assa = (10 * 1 + 4 * 4 / 10 + 3 * 3 / 10) / 17
    np.testing.assert_allclose(h.hota, np.sqrt(17 / 20 * assa))


def test_a_shift_by_hand() -> None:
    """Boxes of 40 x 20 moved by 8 px overlap by 32/48; by 16 px by 24/56, too little to count."""
    truth = np.array([[0.0, 0.0, 40.0, 20.0]])
    near, far = (iou(truth, truth + np.array([shift, 0, shift, 0])) for shift in (8.0, 16.0))
    sequence = repeat([([1], [1], near)] * 5 + [([1], [1], far)] * 5)
    c, h = clear(sequence), hota(sequence)
    assert (c.true_positives, c.false_negatives, c.false_positives) == (5, 5, 5)
    assert c.motp == pytest.approx(2 / 3)
    assert c.mota == 0
    wanted = np.where(ALPHAS <= 24 / 56, 1.0, np.where(ALPHAS <= 2 / 3, 1 / 3, 0.0))
    np.testing.assert_allclose(h.deta, wanted)
    np.testing.assert_allclose(h.assa, wanted)


def test_clear_keeps_last_frames_partner() -> None:
    """The old partner is kept at .6 although another is better; a similarity-only matching would switch."""
    sequence = repeat([([1], [1], [[0.9]]), ([1], [1, 2], [[0.6, 0.9]])])
    assert clear(sequence).id_switches == 0
    assert clear(sequence).motp == pytest.approx(0.75)
    assert clear(sequence, threshold=0.7).id_switches == 1


def test_bad_input() -> None:
    with pytest.raises(ValueError, match="twice"):
        Sequence.of([[1, 1]], [[]], [np.zeros((2, 0))])
    with pytest.raises(ValueError, match="wanted"):
        Sequence.of([[1]], [[1]], [np.zeros((1, 2))])
    with pytest.raises(ValueError, match="frames"):
        Sequence.of([[1]], [[1], [2]], [np.ones((1, 1))])


# Naive oracles: every assignment is tried, nothing is vectorised.


@st.composite
def tiny(draw: st.DrawFn) -> Sequence:
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    frames = []
    for _ in range(draw(st.integers(0, 5))):
        truth = draw(st.lists(st.integers(0, 3), unique=True, max_size=3))
        track = draw(st.lists(st.integers(0, 3), unique=True, max_size=3))
        frames.append((truth, track, rng.random((len(truth), len(track)))))
    return Sequence.of([f[0] for f in frames], [f[1] for f in frames], [f[2] for f in frames])


def matchings(rows: int, columns: int) -> Any:
    """Every one-to-one partial matching."""
    for size in range(min(rows, columns) + 1):
        for left in itertools.combinations(range(rows), size):
            for right in itertools.permutations(range(columns), size):
                yield list(zip(left, right, strict=True))


@settings(max_examples=150, deadline=None)
@given(tiny())
def test_clear_against_a_naive_oracle(sequence: Sequence) -> None:
    last: dict[int, int] = {}
    before: dict[int, int] = {}
    counts = {"tp": 0, "fn": 0, "fp": 0, "switches": 0}
    total = 0.0
    for truth, track, similarity in zip(sequence.truths, sequence.tracks, sequence.similarities, strict=True):
        allowed = [m for m in matchings(len(truth), len(track)) if all(similarity[r, c] >= 0.5 for r, c in m)]
        best = max(
            allowed,
            key=lambda m: (
                sum(before.get(truth[r]) == track[c] for r, c in m),
                sum(similarity[r, c] for r, c in m),
            ),
        )
        pairs = {int(truth[r]): int(track[c]) for r, c in best}
        counts["tp"] += len(pairs)
        counts["fn"] += len(truth) - len(pairs)
        counts["fp"] += len(track) - len(pairs)
        counts["switches"] += sum(g in last and last[g] != p for g, p in pairs.items())
        total += sum(similarity[r, c] for r, c in best)
        last |= pairs
        if len(truth) and len(track):
            before = pairs
    c = clear(sequence)
    assert counts == {
        "tp": c.true_positives,
        "fn": c.false_negatives,
        "fp": c.false_positives,
        "switches": c.id_switches,
    }
    assert c.similarity == pytest.approx(total)


@settings(max_examples=100, deadline=None)
@given(tiny())
def test_identity_against_a_naive_oracle(sequence: Sequence) -> None:
    frames = list(zip(sequence.truths, sequence.tracks, sequence.similarities, strict=True))
    best = 0
    for matching in matchings(sequence.truth_count, sequence.track_count):
        agreeing = 0
        for truth, track, similarity in frames:
            for g, p in matching:
                if g in truth and p in track:
                    agreeing += similarity[list(truth).index(g), list(track).index(p)] >= 0.5
        best = max(best, int(agreeing))
    assert identity(sequence).true_positives == best


@settings(max_examples=60, deadline=None)
@given(tiny())
def test_hota_against_a_naive_oracle(sequence: Sequence) -> None:
    frames = list(zip(sequence.truths, sequence.tracks, sequence.similarities, strict=True))
    g_frames = {g: sum(g in t for t, _, _ in frames) for g in range(sequence.truth_count)}
    p_frames = {p: sum(p in t for _, t, _ in frames) for p in range(sequence.track_count)}
    soft = {(g, p): 0.0 for g in g_frames for p in p_frames}
    for truth, track, s in frames:
        for (r, g), (c, p) in itertools.product(enumerate(truth), enumerate(track)):
            soft[g, p] += s[r, c] / (s[r].sum() + s[:, c].sum() - s[r, c])
    chosen = []
    for truth, track, s in frames:
        worth = {
            (r, c): s[r, c] * soft[g, p] / (g_frames[g] + p_frames[p] - soft[g, p])
            for (r, g), (c, p) in itertools.product(enumerate(truth), enumerate(track))
        }
        best = max(matchings(len(truth), len(track)), key=lambda m: sum(worth[pair] for pair in m))
        chosen += [(int(truth[r]), int(track[c]), s[r, c]) for r, c in best]
    boxes = sequence.truth_boxes + sequence.track_boxes
    for k, alpha in enumerate(ALPHAS):
        pairs = [(g, p) for g, p, similarity in chosen if similarity >= alpha]
        deta = len(pairs) / max(1, boxes - len(pairs))
        assa = sum(
            pairs.count(pair) / (g_frames[pair[0]] + p_frames[pair[1]] - pairs.count(pair)) for pair in pairs
        ) / max(1, len(pairs))
        assert hota(sequence).hota[k] == pytest.approx(np.sqrt(deta * assa))
