"""Saving and loading an episode's log."""

from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from scenarios.log import EpisodeLog, TraceLog, load, save
from scenarios.shown import ShownLog
from sim.truth.types import AerialTruth, FrameTruth
from tracker.types import Predictions, Tracks


def truth(rng: np.random.Generator, tick: int, n: int) -> FrameTruth:
    return FrameTruth(
        tick=tick,
        ids=np.arange(n, dtype=np.uint32) + (1 << 20),
        kinds=np.full(n, 2, np.uint8),
        roles=np.full(n, 1, np.uint8),
        visible_px=rng.integers(0, 9, n),
        amodal_px=rng.integers(9, 19, n),
        amodal_px_full=rng.integers(19, 29, n),
        box_visible=np.where(rng.random((n, 1)) < 0.5, np.nan, rng.random((n, 4))),
        box_amodal=rng.random((n, 4)),
        occluder_ids=np.zeros(n, np.uint32),
        distances=rng.random(n),
        positions=rng.random((n, 3)),
        velocities=rng.random((n, 3)),
    )


def tracks(rng: np.random.Generator, n: int, *, full: bool) -> Tracks:
    return Tracks(
        ids=np.arange(1, n + 1, dtype=np.int64),
        boxes=rng.random((n, 4)),
        status=rng.integers(0, 3, n).astype(np.uint8),
        score=rng.random(n) if full else None,
        state=rng.random((n, 4)) if full else None,
        covariance=rng.random((n, 4, 4)) if full else None,
    )


def shown_of(rng: np.random.Generator, frames: int) -> ShownLog:
    rows = [0, 3, 1, 0, 2][:frames]
    return ShownLog(
        detections=tuple(rng.random((n, 4)) for n in rows),
        flags=tuple(np.arange(n, dtype=np.int64) for n in rows),
        mask_px=rng.integers(-1, 9, frames),
        object_px=tuple(rng.integers(0, 9, n) for n in rows),
        innovations=tuple(rng.random(n) for n in rows),
        predictions=tuple(
            Predictions(
                ids=np.arange(n, dtype=np.int64),
                centres=rng.random((n, 2)),
                covariances=rng.random((n, 2, 2)),
            )
            for n in rows
        ),
        homographies=rng.random((frames, 3, 3)),
    )


def make_log(
    frames: int = 5, *, with_traces: bool = True, with_depths: bool = False, with_shown: bool = False
) -> EpisodeLog:
    rng = np.random.default_rng(3)
    nothing = ShownLog(detections=None, flags=None, mask_px=None, object_px=None)
    shown = shown_of(rng, frames) if with_shown else nothing
    traces = TraceLog(
        ticks=np.arange(4),
        ids=np.array([1, 1, 2, 2]),
        x=rng.random(4),
        v=rng.random(4),
        labels=np.zeros(4, np.uint8),
        p_car=rng.random(4),
        owners=np.zeros(4, np.int64),
        vote_ticks=np.arange(2),
        vote_ids=np.array([1, 2]),
        vote_objects=np.array([0, 1 << 20], np.uint32),
        vote_counts=np.array([3, 4]),
        vote_depths=np.array([np.inf, 20.0]) if with_depths else None,
    )
    return EpisodeLog(
        scenario="in-car-day",
        scene="in-car",
        shown=shown,
        light=rng.random(frames),
        spec_id="ab12",
        seed=0,
        tracker="in-car",
        rate=30,
        width=640,
        height=480,
        has_boxes=True,
        truth=tuple(truth(rng, k, n) for k, n in enumerate([0, 3, 1, 0, 2][:frames])),
        tracks=tuple(tracks(rng, n, full=n != 2) for n in [2, 0, 1, 3, 0][:frames]),
        traces=traces if with_traces else None,
        ego_speed=rng.random(frames),
        hashes={"truth": "00", "frames": "11"},
        timing_ms={"world": rng.random(frames), "track": rng.random(frames)},
    )


def same(a: object, b: object) -> bool:
    if is_dataclass(a):
        return type(a) is type(b) and all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, np.ndarray):
        return (
            isinstance(b, np.ndarray)
            and a.dtype == b.dtype
            and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
        )
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[key], b[key]) for key in a)
    return type(a) is type(b) and a == b


@pytest.mark.parametrize("frames", [0, 1, 5])
@pytest.mark.parametrize("with_traces", [True, False])
def test_loading_gives_what_was_saved(tmp_path: Path, frames: int, with_traces: bool) -> None:
    log = make_log(frames, with_traces=with_traces)
    save(log, tmp_path / "log.npz")
    assert same(load(tmp_path / "log.npz"), log)
    assert not same(load(tmp_path / "log.npz"), replace(log, seed=1))
    assert [p.name for p in tmp_path.iterdir()] == ["log.npz"]


def test_the_truth_from_the_air_is_kept(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    log = make_log()
    aloft = tuple(
        AerialTruth(
            **{f.name: getattr(frame, f.name) for f in fields(frame)},
            world_positions=rng.random((len(frame), 3)),
            world_velocities=rng.random((len(frame), 3)),
            sizes=rng.random((len(frame), 3)),
            colours=rng.random((len(frame), 3)).astype(np.float32),
            ground_to_image=rng.random((3, 3)),
        )
        for frame in log.truth
    )
    log = replace(log, scene="aerial", truth=aloft)
    save(log, tmp_path / "log.npz")
    loaded = load(tmp_path / "log.npz")
    assert all(isinstance(frame, AerialTruth) for frame in loaded.truth)
    assert same(loaded, log)


def test_depths_are_kept(tmp_path: Path) -> None:
    log = make_log(with_depths=True)
    save(log, tmp_path / "log.npz")
    assert same(load(tmp_path / "log.npz"), log)


def test_what_was_shown_is_kept(tmp_path: Path) -> None:
    log = make_log(with_shown=True)
    save(log, tmp_path / "log.npz")
    assert same(load(tmp_path / "log.npz"), log)


def test_the_same_log_gives_the_same_bytes(tmp_path: Path) -> None:
    save(make_log(), tmp_path / "a.npz")
    save(make_log(), tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_a_failed_save_leaves_what_was_there(tmp_path: Path) -> None:
    save(make_log(), tmp_path / "log.npz")
    before = (tmp_path / "log.npz").read_bytes()
    with pytest.raises(TypeError):
        save(replace(make_log(), hashes={"truth": object()}), tmp_path / "log.npz")  # type: ignore[dict-item]
    with pytest.raises(ValueError, match="dimension"):
        save(
            replace(make_log(), tracks=(Tracks.none(), replace(Tracks.none(), boxes=np.zeros(0)))),
            tmp_path / "log.npz",
        )
    assert (tmp_path / "log.npz").read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["log.npz"]


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="there is no episode log"):
        load(tmp_path / "none.npz")


@pytest.mark.parametrize(
    "kind", ["empty", "text", "truncated", "flipped", "array", "other", "short", "traces", "format"]
)
def test_bad_files_give_one_clear_error(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "log.npz"
    save(make_log(), path)
    whole = path.read_bytes()
    with np.load(path) as archive:
        arrays = dict(archive)
    if kind == "empty":
        path.write_bytes(b"")
    elif kind == "text":
        path.write_text("not an archive\n")
    elif kind == "truncated":
        path.write_bytes(whole[: len(whole) // 2])
    elif kind == "flipped":
        middle = len(whole) // 3
        path.write_bytes(
            whole[:middle] + bytes(255 - b for b in whole[middle : middle + 40]) + whole[middle + 40 :]
        )
    elif kind == "array":
        with path.open("wb") as file:
            np.save(file, np.zeros(3))
    elif kind == "other":
        np.savez(path, a=np.zeros(3))
    elif kind == "short":
        np.savez(path, **(arrays | {"truth/ids": arrays["truth/ids"][:-1]}))
    elif kind == "traces":
        np.savez(path, **{name: array for name, array in arrays.items() if name != "traces/x"})
    elif kind == "format":
        np.savez(path, **(arrays | {"plain": np.frombuffer(b'{"format": "other"}', np.uint8)}))
    with pytest.raises(ValueError, match="episode log") as caught:
        load(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_no_pickles_are_read(tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    np.savez(path, plain=np.array([{}], dtype=object))
    with pytest.raises(ValueError, match="episode log"):
        load(path)
