"""Numbers over seeds."""

import numpy as np
import pytest

from scenarios.score.statistics import interval, over_seeds, paired


def test_mean_and_interval() -> None:
    values = np.random.default_rng(0).normal(0.8, 0.05, 50)
    result = interval(values)
    assert result["n"] == 50
    assert result["mean"] == pytest.approx(values.mean())
    half = 1.96 * values.std() / np.sqrt(50)
    assert result["ci95"] == pytest.approx([values.mean() - half, values.mean() + half], abs=0.003)
    assert interval(values) == result
    assert interval([0.5]) == {"mean": 0.5, "ci95": None, "n": 1}
    assert interval([0.5, 0.5])["ci95"] == [0.5, 0.5]


def test_counts_are_summed_and_nulls_left_out() -> None:
    seeds = [
        {"hota": 0.5, "id_switches": 2, "none": None, "id": {"confusion": {"car": {"car": 3}}, "t": None}},
        {"hota": None, "id_switches": 3, "none": None, "id": {"confusion": {"car": {"car": 4}}, "t": 0.25}},
        {"hota": 0.7, "id_switches": 0, "none": None, "id": {"confusion": None, "t": 0.75}},
    ]
    joined = over_seeds(seeds)
    assert joined["hota"]["mean"] == pytest.approx(0.6)
    assert joined["hota"]["n"] == 2
    assert joined["id_switches"] == 5
    assert joined["none"] is None
    assert joined["id"]["confusion"] == {"car": {"car": 7}}
    assert joined["id"]["t"]["mean"] == 0.5
    assert list(joined) == list(seeds[0])


def test_differences_are_paired() -> None:
    base = [0.2, 0.9, 0.5, 0.7]
    scores = {
        "a": [{"hota": x + 0.1, "n": 3, "id": {"recall": None, "confusion": {"car": 1}}} for x in base],
        "b": [{"hota": x, "n": 1, "id": {"recall": 0.5, "confusion": {"car": 1}}} for x in base],
        "c": [{"hota": None if k == 1 else x, "n": 1, "id": {"recall": 0.25}} for k, x in enumerate(base)],
    }
    ab, ac, bc = paired(scores)
    assert (ab["tracker"], ab["against"], bc["tracker"], bc["against"]) == ("a", "b", "b", "c")
    assert ab["difference"]["hota"]["mean"] == pytest.approx(0.1)
    assert np.ptp(ab["difference"]["hota"]["ci95"]) < 1e-9  # the spread over seeds cancels out
    assert ab["difference"]["n"]["mean"] == 2
    assert "id" not in ab["difference"]
    assert ac["difference"]["hota"]["n"] == 3
    assert bc["difference"]["id"] == {"recall": {"mean": 0.25, "ci95": [0.25, 0.25], "n": 4}}
    assert paired({"a": scores["a"]}) == []
    with pytest.raises(ValueError, match="shorter"):
        paired({"a": scores["a"], "b": scores["b"][:2]})
