from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scenarios.report.summary import write_summary
from scenarios.report.tables import flat, number
from scenarios.score.statistics import over_seeds, paired
from tests.scenarios import report_episode as episode
from tests.scenarios.test_report import Page

TRACKERS = ("in-car", "in-car:paper", "me:Mine <i>")
SEEDS = range(3, 7)


def shaken(value: Any, rng: np.random.Generator, gain: float) -> Any:
    if isinstance(value, dict):
        return {key: shaken(item, rng, gain) for key, item in value.items()}
    return value * gain + rng.normal(0, 0.01) if isinstance(value, float) else value


@pytest.fixture
def document() -> dict[str, Any]:
    rng = np.random.default_rng(11)
    scores = {
        name: [shaken(episode.scores()["scores"], rng, 1 - 0.2 * k) for _ in SEEDS]
        for k, name in enumerate(TRACKERS)
    }
    for found in scores["in-car:paper"]:
        found["hota"] = None
    scores["in-car"][0]["identification"]["median_seconds_to_identify"] = 0.5
    scores["in-car"][2]["identification"]["median_seconds_to_identify"] = 0.7
    runs = [
        {
            "scenario": "in-car-day",
            "tracker": name,
            "seeds": list(SEEDS),
            "frames": 4 * episode.FRAMES,
            "scores": over_seeds(found),
            "difficulty": over_seeds([episode.scores()["difficulty"]] * len(SEEDS)),
            "details": over_seeds([shaken(episode.scores()["details"], rng, 1.0) for _ in SEEDS]),
        }
        for name, found in scores.items()
    ]
    return {"runs": runs, "paired": paired(scores)}


def places(directory: Path) -> dict[str, dict[int, Path]]:
    return {
        name: {seed: directory / f"seed-{seed}" / f"tracker {k}" / "report.html" for seed in SEEDS}
        for k, name in enumerate(TRACKERS)
    }


def test_summary_has_every_mean_interval_and_link(document: dict[str, Any], tmp_path: Path) -> None:
    path = write_summary(tmp_path, document, places(tmp_path), description="By day & night")
    page = Page(path.read_text("utf-8"))
    words = {word.strip() for word in page.words}
    for run in document["runs"]:
        assert run["tracker"] in words
        for keys, value in flat(run["scores"]):
            assert number(value) in words, keys
            if isinstance(value, dict):
                interval = f"{number(value['ci95'][0])} to {number(value['ci95'][1])}"
                assert interval + (", n = 2" if value["n"] == 2 else "") in words, keys
    for pair in document["paired"]:
        assert f"{pair['tracker']} less {pair['against']}" in words
        for keys, value in flat(pair["difference"]):
            assert ("+" if value["mean"] > 0 else "") + number(value["mean"]) in words, keys
    links = [link for link in page.links if not link.startswith(("data:", "#"))]
    assert len(links) == len(TRACKERS) * len(SEEDS)
    assert "seed-4/tracker%201/report.html" in links
    assert "i" not in page.tags or "Mine" not in page.words
    assert [file.name for file in tmp_path.iterdir()] == ["summary.html"]


def test_summary_looks_closer_at_every_tracker_that_has_boxes(
    document: dict[str, Any], tmp_path: Path
) -> None:
    document["runs"][1]["details"]["conventions"]["amodal"]["hota"] = None
    document["runs"][2]["details"]["consistency"] = None
    page = Page(write_summary(tmp_path, document, {}).read_text("utf-8"))
    words = [word.strip() for word in page.words]
    for run in document["runs"]:
        shown = run["tracker"] != "in-car:paper"
        assert (f"{run['tracker']}: recall" in words) == shown
        assert (f"{run['tracker']}: visible boxes" in words) == shown
        for keys, value in flat(run["details"]["strata"]):
            if keys[-1] != "boxes" and shown:
                assert number(value) in words, keys
    assert {"–", str(4 * 211), "n = 7108"} <= set(words), "boxes are summed over seeds"
    assert words.count("mean NEES") == 1


def test_one_seed_of_several_trackers(document: dict[str, Any], tmp_path: Path) -> None:
    alone = deepcopy(document)
    scores = {name: [episode.scores()["scores"]] for name in TRACKERS}
    for run in alone["runs"]:
        run |= {"seeds": [3], "scores": scores[run["tracker"]][0]}
    alone["paired"] = paired(scores)
    path = write_summary(tmp_path, alone, {})
    words = {word.strip() for word in Page(path.read_text("utf-8")).words}
    assert "n = 1" in words
    assert number(0.612345) in words


def test_one_tracker_over_seeds(document: dict[str, Any], tmp_path: Path) -> None:
    page = Page(write_summary(tmp_path, document["runs"][0], {}).read_text("utf-8"))
    assert "Differences" not in " ".join(page.words)


def test_failure_leaves_nothing(document: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not in the subpath"):
        write_summary(tmp_path, document, {"in-car": {3: Path("/elsewhere/report.html")}})
    assert not list(tmp_path.iterdir())
