"""Recordings against what their files say."""

from __future__ import annotations

import csv
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from sim.params import AerialCameraParams, AerialParams, RecordingParams
from sim.recorded import RecordingError, headings, read, resample
from sim.scenes.aerial import AerialScene
from sim.world import Kind

REAL = Path(__file__).resolve().parents[3] / "shared" / "real" / "aerial"
absent = pytest.mark.skipif(
    not REAL.is_dir(),
    reason=f"the recordings are not here: {REAL} is no folder; what reads them is NOT tested",
)

STATE = """<position><point><x>{x}</x><y>{y}</y></point></position>
  <orientation><exact>{yaw}</exact></orientation><time><exact>{t}</exact></time>"""


def written(path: Path, *, older: bool) -> Path:
    """A car that drives a quarter circle of 20 m in 10 steps."""
    turn = np.linspace(0, np.pi / 2, 11)
    states = [
        STATE.format(x=20 * np.sin(a), y=20 * (1 - np.cos(a)), yaw=a, t=k)
        for k, a in enumerate(turn.tolist())
    ]
    tag = "obstacle" if older else "dynamicObstacle"
    role = "<role>dynamic</role>" if older else ""
    path.write_text(
        f'<commonRoad timeStepSize="0.1"><{tag} id="7">{role}<type>truck</type>'
        "<shape><rectangle><length>8.5</length><width>2.4</width></rectangle></shape>"
        f"<initialState>{states[0]}</initialState><trajectory>"
        + "".join(f"<state>{state}</state>" for state in states[1:])
        + f"</trajectory></{tag}></commonRoad>"
    )
    return path


@pytest.mark.parametrize("older", [True, False])
def test_common_road_is_resampled_along_the_curve(tmp_path, older):
    recording = read(written(tmp_path / "one.xml", older=older))
    (way,) = recording.ways
    assert (way.kind, way.size, way.name) == (Kind.LORRY, (8.5, 2.4), "7")
    assert recording.seconds == pytest.approx(1.0)
    sampled = resample(recording, 30, start=0.0, ticks=31)
    at = sampled.positions[:, 0] + recording.origin
    angle = np.pi / 2 * np.arange(31) / 30
    circle = 20 * np.column_stack([np.sin(angle), 1 - np.cos(angle)])
    assert np.abs(at - circle).max() < 0.01
    assert np.allclose(at[::3], circle[::3])
    assert np.allclose(sampled.yaws[:, 0], angle, atol=1e-6)
    assert np.hypot(*sampled.velocities[5:-5, 0].T) == pytest.approx(10 * np.pi, rel=0.01)


def test_nobody_is_there_before_or_after_the_recording(tmp_path):
    recording = read(written(tmp_path / "one.xml", older=False))
    sampled = resample(recording, 30, start=0.5, ticks=40)
    assert sampled.present[:, 0].tolist() == [True] * 16 + [False] * 24
    assert np.isnan(sampled.positions[16:]).all()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("none.xml", None),
        ("bad.xml", "<a"),
        ("odd.xml", "<commonRoad/>"),
        ("bad.csv", "a,b\n1,2\n"),
        ("x.txt", ""),
    ],
)
def test_what_is_no_recording_is_refused_in_one_line(tmp_path, name, text):
    path = tmp_path / name
    if text is not None:
        path.write_text(text)
    with pytest.raises(RecordingError) as refused:
        read(path)
    assert "\n" not in str(refused.value)
    assert name in str(refused.value)


def test_a_run_longer_than_the_recording_is_refused(tmp_path):
    path = written(tmp_path / "one.xml", older=False)
    params = AerialParams(
        recording=RecordingParams(path=str(path)), camera=AerialCameraParams(width=64, height=48, focal=80)
    )
    with pytest.raises(RecordingError, match="ends after"):
        AerialScene(params, seed=0, rate=30, seconds=5.0)
    scene = AerialScene(params, seed=0, rate=30, seconds=1.0)
    vehicles = scene.step().vehicles
    assert vehicles.kinds.tolist() == [Kind.LORRY]
    assert vehicles.sizes[0, :2].tolist() == [8.5, 2.4]


def test_headings_follow_the_way_and_hold_where_it_stands():
    way = np.array([[0, 0], [0, 0], [1, 0], [2, 0], [2, 1], [2, 2], [2, 2], [2, 2]], float)
    told = headings(way)
    assert told[0] == pytest.approx(0.0)
    assert told[-1] == pytest.approx(np.pi / 2)
    assert np.isnan(headings(np.zeros((4, 2)))).all()


@absent
@pytest.mark.parametrize("name", ["USA_US101-4_1_T-1", "USA_Lanker-1_1_T-1"])
def test_real_common_road_at_the_files_own_instants(name):
    path = REAL / "commonroad" / f"{name}.xml"
    recording = read(path)
    sampled = resample(recording, 30, start=0.0, ticks=1 + round(30 * recording.seconds))
    root = ElementTree.parse(path).getroot()
    states = {way.name: k for k, way in enumerate(recording.ways)}
    checked = 0
    for node in root:
        if node.attrib.get("id") not in states or "bstacle" not in node.tag:
            continue
        for state in node.iter("state"):
            tick = 3 * int(state.findtext("time/exact"))
            wanted = [float(state.findtext(f"position/point/{axis}")) for axis in "xy"]
            k = states[node.attrib["id"]]
            assert np.allclose(sampled.positions[tick, k] + recording.origin, wanted, atol=1e-9)
            checked += 1
    assert checked > 500


@absent
def test_real_geo_trax_at_the_files_own_frames():
    path = REAL / "geotrax" / "vehicles.csv"
    recording = read(path)
    assert len(recording.ways) == 144
    sampled = resample(recording, 30, start=0.0, ticks=1 + round(30 * recording.seconds))
    names = {way.name: k for k, way in enumerate(recording.ways)}
    speeds, ours = [], []
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            tick, k = int(row["Frame_Number"]), names[row["Vehicle_ID"]]
            wanted = [float(row["Local_X"]), float(row["Local_Y"])]
            assert np.allclose(sampled.positions[tick, k] + recording.origin, wanted, atol=1e-6)
            if row["Vehicle_Speed"] and float(row["Vehicle_Speed"]) > 20:
                speeds.append(float(row["Vehicle_Speed"]) / 3.6)
                ours.append(np.hypot(*sampled.velocities[tick, k]))
    assert np.median(np.abs(np.array(ours) - speeds)) < 1.0
    assert not np.isnan(sampled.yaws[sampled.present]).any()
