"""Manifests of real episodes, run again."""

import json

import moderngl
import pytest

from scenarios import manifest as manifests
from scenarios import runs, spec
from scenarios.dataset import Dataset
from scenarios.errors import InputError
from scenarios.generate import generate
from scenarios.replay import Divergence, replay
from scenarios.runs import Run
from scenarios.workers import ThisProcess
from sim.render.context import context
from tests.scenarios.fakes import observations
from tests.scenarios.test_cli import MiddleTracker, call

SILENT = "tests.scenarios.fakes:SilentTracker"
MIDDLE = "tests.scenarios.test_cli:MiddleTracker"
SEEDS = range(500, 502)


class OtherTracker(MiddleTracker):
    """As good as the other, under another name."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory, gl):
    """What a run keeps of two short drives of two trackers."""
    place = tmp_path_factory.mktemp("run")
    scenario = spec.load("lane-flash", ["seconds=0.2", "light.flash_at=5.0"])
    runs.execute(Run(scenario=scenario, seeds=SEEDS, trackers=(SILENT, MIDDLE)), place)
    return place


def changed(folder, tmp_path, key, value):
    """The manifest with one parameter changed: a path of keys with dots."""
    document = json.loads((folder / "manifest.json").read_text())
    *tables, last = key.split(".")
    inner = document
    for table in tables:
        inner = inner[int(table)] if table.isdecimal() else inner[table]
    place = int(last) if last.isdecimal() else last
    assert inner[place] != value
    inner[place] = value
    (tmp_path / "manifest.json").write_text(json.dumps(document))
    return tmp_path / "manifest.json"


def test_a_run_that_is_repeated_agrees(folder, capsys):
    document = json.loads((folder / "manifest.json").read_text())
    assert document["seeds"] == list(SEEDS)
    assert document["trackers"] == [SILENT, MIDDLE]
    assert {"python", "testtrack", "numpy", "moderngl", "highway-env", "driver"} <= set(
        document["environment"]
    )
    assert [len(episode["frames"]) for episode in document["episodes"]] == [6, 6]
    assert list(document["episodes"][0]["frames"][0]) == [
        *("truth", "image", f"tracks of {SILENT}", f"tracks of {MIDDLE}"),
    ]
    code, out, err = call("replay", folder / "manifest.json", capsys=capsys)
    assert (code, out, err) == (0, "all agree: 2 episodes, 12 frames\n", "")


def test_one_episode_has_a_manifest_too(folder):
    made = manifests.read(folder / "seed-501" / "manifest.json")
    assert list(made.episodes) == [501]
    assert replay(made) is None


def test_light_that_comes_earlier_is_found_in_its_frame(folder, tmp_path, capsys):
    path = changed(folder, tmp_path, "scenario.params.light.flash_at", 0.1)
    code, out, _ = call("replay", path, capsys=capsys)
    assert (code, out) == (1, "seed 500, frame 3 diverges first: image\n")
    code, out, _ = call("replay", path, "--json", capsys=capsys)
    document = json.loads(out)
    assert (code, document["agree"]) == (1, False)
    assert document["diverges"] == {"seed": 500, "frame": 3, "stage": "image"}


@pytest.mark.parametrize(
    ("key", "value", "frame", "stage"),
    [
        ("scenario.params.riders.riders", 5, 0, "truth"),
        ("scenario.params.sensor.noise", 9.0, 0, "image"),
        ("trackers.1", "tests.scenarios.test_replay:OtherTracker", 0, "tracks"),
        ("scenario.seconds", 0.1, 3, "length"),
        ("scenario.seconds", 0.3, 6, "length"),
        ("episodes.0.frames.4.image", "0" * 32, 4, "image"),
    ],
)
def test_a_changed_parameter_is_found_where_it_shows(folder, tmp_path, key, value, frame, stage):
    found = replay(manifests.read(changed(folder, tmp_path, key, value)))
    assert found is not None
    assert (found.seed, found.frame, found.stage.partition(" ")[0]) == (500, frame, stage)


def test_a_later_episode_is_named(folder, tmp_path):
    path = changed(folder, tmp_path, "episodes.1.frames.2.truth", "0" * 32)
    assert replay(manifests.read(path)) == Divergence(501, 2, "truth")


@pytest.mark.usefixtures("gl")
def test_a_tracker_of_detections_agrees_too(tmp_path):
    scenario = spec.load("lane-day", ["seconds=0.1"])
    runs.execute(Run(scenario=scenario, seeds=range(500, 501), trackers=("association@noisy",)), tmp_path)
    assert replay(manifests.read(tmp_path / "manifest.json")) is None


@pytest.mark.usefixtures("gl")
def test_the_driver_is_named_whoever_holds_the_context():
    with context():
        pass
    named = manifests.environment()["driver"]
    other = moderngl.create_context(standalone=True, backend="egl")
    with other:
        assert manifests.environment()["driver"] == named
    assert len(named) > 20


@pytest.mark.usefixtures("gl")
def test_a_dataset_agrees_with_its_manifest(tmp_path):
    scenario = spec.load("lane-day", ["seconds=0.1"])
    generate(Dataset(scenario=scenario, seeds=SEEDS, format="mot"), tmp_path / "set", ThisProcess())
    made = manifests.read(tmp_path / "set" / "manifest.json")
    assert list(made.episodes) == list(SEEDS)
    assert replay(made) is None


def test_each_link_holds_all_before_it():
    def chain(**changes):
        links = manifests.Chain()
        for observation in observations(6, **changes):
            links.add(observation, {})
        return links.frames

    usual, noisier = chain(), chain(noise=4.0)
    assert chain() == usual
    assert [a["truth"] for a in usual] == [b["truth"] for b in noisier]
    assert all(a["image"] != b["image"] for a, b in zip(usual, noisier, strict=True))
    assert len({links["truth"] for links in usual}) == 6


def test_a_scenario_comes_back_from_json():
    for name in spec.library():
        scenario = spec.load(name)
        document = json.loads(json.dumps(scenario.model_dump(mode="json")))
        assert spec.from_document(document, "here") == scenario


def test_manifests_of_other_versions_are_not_joined():
    def made(seed, version):
        return manifests.Manifest(
            scenario=spec.load("lane-day"),
            trackers=(),
            odometry=False,
            environment={"numpy": version},
            episodes={seed: []},
        )

    assert list(manifests.join([made(1, "2"), made(0, "2")]).episodes) == [1, 0]
    with pytest.raises(InputError, match="numpy is 3, but other episodes were made with 2"):
        manifests.join([made(1, "2"), made(0, "3")])
