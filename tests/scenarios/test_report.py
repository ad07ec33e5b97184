from __future__ import annotations

import base64
import io
import re
from html.parser import HTMLParser
from pathlib import Path

import av
import numpy as np
import pytest

from scenarios.report.annotate import STRIP, annotate
from scenarios.report.film import Film
from scenarios.report.history import MAX_ROWS, History, ProfileRows, Thinned
from scenarios.report.palette import LABELS, identity, rgb
from scenarios.report.pictures import Picture
from scenarios.report.recorder import Recorder
from scenarios.report.tables import flat, number
from tests.scenarios import report_episode as episode
from tracker.types import Label, Status, Traces, Tracks


class Page(HTMLParser):
    """Gathers what a test asks of a page."""

    LINKS = ("src", "href", "xlink:href", "poster", "data", "action", "srcset")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.tags: list[str] = []
        self.words: list[str] = []
        self.ids: list[str] = []
        self.styles = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.links += [value or "" for name, value in attrs if name in self.LINKS]
        self.ids += [value or "" for name, value in attrs if name == "id"]
        self.styles += " ".join(value or "" for name, value in attrs if name == "style")

    def handle_data(self, data: str) -> None:
        if self.tags and self.tags[-1] == "style":
            self.styles += data
        self.words.append(data)

    def film(self) -> bytes:
        head = "data:video/mp4;base64,"
        return base64.b64decode(next(link for link in self.links if link.startswith(head))[len(head) :])


@pytest.fixture(scope="module")
def found() -> list[episode.Step]:
    return episode.steps()


@pytest.fixture(scope="module")
def report(found: list[episode.Step], tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("report") / "out"
    with recorder(directory) as running:
        episode.record(running, found)
        return running.finish(episode.episode_log(found), episode.scores(), episode.scenario())


@pytest.fixture(scope="module")
def page(report: Path) -> Page:
    return Page(report.read_text("utf-8"))


def recorder(directory: Path, title: str = "A drive") -> Recorder:
    return Recorder(directory, width=episode.WIDTH, height=episode.HEIGHT, rate=episode.RATE, title=title)


def decode(data: bytes) -> list[np.ndarray]:
    with av.open(io.BytesIO(data)) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def test_page_is_one_file_that_loads_nothing(report: Path, page: Page) -> None:
    assert [path.name for path in report.parent.iterdir()] == ["report.html"]
    assert all(link.startswith(("data:", "#")) for link in page.links)
    assert not re.search(r"url\((?!#)|@import", page.styles)
    text = report.read_text("utf-8")
    assert set(re.findall(r'https?://[^"\s<)]+', text)) <= {
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xlink",
    }
    assert len(page.ids) == len(set(page.ids))


def test_every_score_and_parameter_is_printed(page: Page) -> None:
    words = {word.strip() for word in page.words}
    printed = [item for part in ("scores", "difficulty", "details") for item in flat(episode.scores()[part])]
    assert len(printed) > 40
    for keys, value in printed:
        assert number(value) in words, keys
    for keys, value in flat(episode.scenario()):
        assert (f"{value:g}" if isinstance(value, float) else str(value)) in words, keys
    assert "0.0012" in words, "parameters are not rounded"
    assert "60" in words
    assert any("Metres along the axis" in word for word in words), "thresholds say what they are"
    assert "aa" * 32 in words


def test_sections_are_there(page: Page) -> None:
    text = " ".join(page.words)
    for heading in (
        "Scores",
        "Temporal profile",
        "Where cars and background are expected",
        "Over time",
        "Frames",
        "Scoring thresholds",
        "Confusion of traces",
        "A closer look",
        "By distance",
        "Whether covariances are right",
    ):
        assert heading in text
    assert page.tags.count("svg") == 3 + 3 + 6 + 2
    assert "half of the car traces or more were never identified" in text


def test_film_has_every_frame_and_the_index_in_front(page: Page) -> None:
    data = page.film()
    frames = decode(data)
    assert len(frames) == episode.FRAMES
    assert frames[0].shape == (episode.HEIGHT + STRIP, episode.WIDTH, 3)
    assert data.index(b"moov") < data.index(b"mdat")


def test_same_run_gives_the_same_page(found: list[episode.Step], report: Path, tmp_path: Path) -> None:
    with recorder(tmp_path / "again") as running:
        episode.record(running, found)
        again = running.finish(episode.episode_log(found), episode.scores(), episode.scenario())
    # All but the video, where the encoder's own threads may differ by a few bits.
    first, second = (re.sub('data:video/mp4[^"]*', "", path.read_text("utf-8")) for path in (report, again))
    assert first == second


def test_recording_without_truth(found: list[episode.Step], tmp_path: Path) -> None:
    with recorder(tmp_path) as running:
        for image, tracks, diagnostics, _ in found:
            running.frame(image, tracks, diagnostics)
        document = {"video": "a.mp4", "method": "in-car", "tracks": 12345, "timing_ms": {"decode": 1.5}}
        page = Page(running.finish(None, document, None, focal=200.0).read_text("utf-8"))
    text = " ".join(page.words)
    assert "This is a recording" in text
    assert "Confusion" not in text
    assert "scored object" not in text
    assert "focal length of 200 px and 15.0 m/s (assumed)" in text
    assert {"a.mp4", "12345", "1.500"} <= {word.strip() for word in page.words}
    assert len(decode(page.film())) == episode.FRAMES


def test_tracker_that_shows_nothing_but_boxes(found: list[episode.Step], tmp_path: Path) -> None:
    with recorder(tmp_path) as running:
        for image, tracks, _, _ in found:
            running.frame(image, tracks)
        page = Page(running.finish(None, None, None).read_text("utf-8"))
    assert "Temporal profile" not in " ".join(page.words)


def test_nulls_say_why(found: list[episode.Step], tmp_path: Path) -> None:
    from dataclasses import replace

    log = replace(episode.episode_log(found), has_boxes=False, traces=None)
    document = episode.scores()
    document["scores"] = {"hota": None, "identification": {"car_recall": None, "confusion": None}}
    document["details"]["conventions"]["amodal"]["hota"] = None
    with recorder(tmp_path) as running:
        running.frame(found[0][0], found[0][1])
        page = Page(running.finish(log, document, episode.scenario()).read_text("utf-8"))
    text = " ".join(page.words)
    assert "This tracker gives no boxes." in text
    assert "This tracker shows no traces." in text
    assert "A closer look" not in text


def test_hostile_names_are_escaped(found: list[episode.Step], tmp_path: Path) -> None:
    evil = '"><script>alert(1)</script><film></style>{{ 7 * 7 }}'
    scenario = episode.scenario() | {"description": evil, evil: {evil: evil}}
    document = episode.scores()
    document["scores"]["identification"]["confusion"] = {evil: {evil: 3}}
    document["scores"][evil] = 0.25
    with recorder(tmp_path, title=evil) as running:
        episode.record(running, found[:3])
        picture = Picture(evil, b"not really")
        log = episode.episode_log(found[:3])
        page = Page(running.finish(log, document, scenario, figures=[picture]).read_text("utf-8"))
    assert page.tags.count("script") == 1
    assert page.tags.count("style") == 1 + sum(tag == "svg" for tag in page.tags)
    assert evil in page.words
    assert "49" not in {word.strip() for word in page.words}
    assert len(decode(page.film())) == 3


def test_interrupted_run_leaves_nothing(found: list[episode.Step], tmp_path: Path) -> None:
    def interrupted() -> None:
        with recorder(tmp_path / "out") as running:
            episode.record(running, found[:5])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert not list(tmp_path.iterdir())


def test_failure_while_writing_keeps_the_old_report(
    found: list[episode.Step], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = tmp_path / "report.html"
    old.write_text("old")

    def full_disk(*_: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr("scenarios.report.page._write_base64", full_disk)
    with recorder(tmp_path) as running:
        running.frame(found[0][0], found[0][1])
        with pytest.raises(OSError, match="no space"):
            running.finish(None, None, None)
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    assert old.read_text() == "old"


def test_run_without_frames(tmp_path: Path) -> None:
    with recorder(tmp_path) as running:
        page = Page(running.finish(None, None, None).read_text("utf-8"))
    assert "No frames were recorded." in " ".join(page.words)
    assert "video" not in page.tags


def test_long_run_is_filmed_in_part(
    found: list[episode.Step], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scenarios.report.recorder.FILM_SECONDS", 0.5)
    with recorder(tmp_path) as running:
        for image, tracks, _, _ in found:
            running.frame(image, tracks)
        page = Page(running.finish(None, None, None).read_text("utf-8"))
    assert len(decode(page.film())) == 15
    assert "shows the first 0.5 s of 1.5 s" in " ".join(" ".join(page.words).split())


def test_film_of_odd_sides(tmp_path: Path) -> None:
    path = tmp_path / "film.mp4"
    with Film(path, width=63, height=33, rate=29.97) as film:
        for _ in range(4):
            film.write(np.full((33, 63, 3), 200, np.uint8))
    frames = decode(path.read_bytes())
    assert len(frames) == 4
    assert frames[0].shape == (34, 64, 3)
    assert abs(int(frames[0][33, 63, 0]) - 200) < 8


def test_annotation_shows_tracks_by_status_and_traces_by_label() -> None:
    image = np.full((80, 100, 3), 60, np.uint8)
    box = np.array([[20.0, 30.0, 60.0, 70.0]])

    def drawn(status: Status) -> np.ndarray:
        tracks = Tracks(ids=np.array([4]), boxes=box, status=np.array([status], np.uint8))
        return annotate(image, tracks=tracks, traces=None, truth_boxes=None, caption="")

    colour = rgb(identity(4))
    inked = {status: int((drawn(status)[:80] == colour).all(-1).sum()) for status in Status}
    assert inked[Status.CONFIRMED] > inked[Status.TENTATIVE] > inked[Status.COASTING] > 0
    assert (image == 60).all(), "the tracker's frame is left alone"
    assert tuple(drawn(Status.TENTATIVE)[30, 20]) == colour
    assert tuple(drawn(Status.TENTATIVE)[69, 59]) == colour

    traces = Traces(
        ids=np.array([1, 2, 3]),
        x=np.array([10.0, 50.0, 500.0]),
        v=np.zeros(3),
        labels=np.array([Label.CAR, Label.BACKGROUND, Label.CAR], np.uint8),
        p_car=np.zeros(3),
        owners=np.zeros(3, np.int64),
        points=np.array([[50.0, 40.0], [-3.0, 2.0]]),
        point_traces=np.array([2, 1]),
    )
    canvas = annotate(image, tracks=Tracks.none(), traces=traces, truth_boxes=box, caption="")
    assert tuple(canvas[80 + STRIP // 2, 10]) == rgb(LABELS[Label.CAR])
    assert tuple(canvas[80 + STRIP // 2, 50]) == rgb(LABELS[Label.BACKGROUND])
    assert tuple(canvas[40, 50]) == rgb(LABELS[Label.BACKGROUND])
    assert tuple(canvas[30, 40]) == (255, 255, 255)


def test_boxes_beyond_the_frame_and_without_numbers_do_no_harm() -> None:
    boxes = np.array([[-1e9, -5.0, 1e9, 400.0], [90.0, 70.0, 130.0, 95.0]])
    tracks = Tracks(ids=np.array([1, 2]), boxes=boxes, status=np.full(2, Status.COASTING, np.uint8))
    image = np.zeros((80, 100, 3), np.uint8)
    assert annotate(image, tracks=tracks, traces=None, truth_boxes=boxes, caption="").shape[0] == 80 + STRIP


def test_thinned_keeps_a_bounded_regular_grid() -> None:
    thinned, kept = Thinned(10), []
    for index in range(1000):
        if thinned.wants(index):
            kept.append(index)
            if thinned.added():
                kept = kept[::2]
        assert len(kept) == thinned.kept <= 10
        assert kept == list(range(0, index + 1, thinned.stride))


def test_history_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scenarios.report.history.MAX_ROWS", 32)
    history = History()
    for index in range(1000):
        profiles = {"segments": np.full(8, index, np.float32)}
        if index >= 64:
            profiles["late"] = np.ones(8, np.float32)
        history.add(index, Tracks.none(), profiles, None)
    images = history.profiles()
    assert history.track_counts().shape == (len(images["late"]), 3)
    assert images["segments"].shape == images["late"].shape
    assert images["segments"].shape[0] <= 32
    assert images["segments"].shape[0] * history.stride >= 1000
    rows = images["segments"][:, 0].astype(int)
    assert (np.diff(rows) >= 0).all()
    assert images["late"][0].max() == 0
    assert images["late"][-1].max() == 255
    assert MAX_ROWS > 1000


def test_profile_rows_stay_in_proportion() -> None:
    rng = np.random.default_rng(3)
    true = np.cumsum(rng.random((50, 16)), axis=0).astype(np.float32)
    true[7, 3] = np.nan
    rows = ProfileRows(16, 0)
    for row in true:
        rows.add(row)
    image = rows.image().astype(float)
    true[7, 3] = 0
    scale = true[-1].max() / image[-1].max()
    # Each doubling of the scale rounds down by at most one step.
    assert np.abs(image * scale - true).max() < 2.1 * scale


def test_numbers_as_printed() -> None:
    assert [number(value) for value in (None, True, 3, 0.5, 12.34, float("inf"), [1, 2.0])] == [
        "–",
        "yes",
        "3",
        "0.500",
        "12.3",
        "–",
        "1, 2.000",
    ]
