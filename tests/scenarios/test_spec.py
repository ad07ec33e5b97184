import json

import pytest

from scenarios import spec
from scenarios.spec import SpecError

NAMES = ("in-car-curve", "in-car-day", "in-car-night", "in-car-rain", "in-car-stop-and-go", "in-car-urban")


AERIAL = ("aerial-bridge", "aerial-bridges", "aerial-convoy", "aerial-intersection", "aerial-winding")
LANES = ("lane-cloudy", "lane-day", "lane-dense", "lane-flash", "lane-parked", "lane-wrong-way")


def test_the_library_holds_the_scenarios_of_the_lane():
    for name in LANES:
        scenario = spec.load(name)
        camera = scenario.params.camera
        frames = 780 if name == "lane-parked" else 330
        assert (scenario.scene, scenario.frames, scenario.rate) == ("motorcycle-lane", frames, 30)
        assert (camera.width, camera.height) == (360, 240)
        assert scenario.description


def test_the_library_holds_the_five_scenarios_from_the_air():
    for name in AERIAL:
        scenario = spec.load(name)
        camera = scenario.params.camera
        assert (scenario.scene, scenario.frames, scenario.rate) == ("aerial", 600, 30)
        assert (camera.width, camera.height) == (640, 480)
        assert 120 <= scenario.params.platform.altitude <= 300
        assert scenario.description


def test_the_library_holds_the_six_in_car_scenarios_of_twenty_seconds():
    assert tuple(spec.library()) == AERIAL + NAMES + LANES
    for name in NAMES:
        scenario = spec.load(name)
        camera = scenario.params.camera
        assert (scenario.name, scenario.frames, scenario.rate) == (name, 600, 30)
        assert (camera.width, camera.height) == (640, 480)
        assert scenario.description


def test_a_file_is_read_and_named_by_its_stem(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('scene = "in-car"\nseconds = 2\n[traffic]\ndensity = 3\n')
    scenario = spec.load(path)
    assert (scenario.name, scenario.frames, scenario.params.traffic.density) == ("mine", 60, 3.0)


def test_overrides_are_toml_and_words_need_no_quotes():
    scenario = spec.load(
        "in-car-day", ["sensor.noise=3", "light.time=night", "road.curved=true", 'scenery.setting="urban"']
    )
    params = scenario.params
    assert (params.sensor.noise, params.light.time, params.road.curved) == (3.0, "night", True)
    assert params.scenery.setting == "urban"


def test_the_last_override_wins():
    assert spec.load("in-car-day", ["sensor.noise=3", "sensor.noise=4"]).params.sensor.noise == 4.0


def test_the_digest_follows_what_a_drive_depends_on_and_nothing_else(tmp_path):
    day = spec.load("in-car-day")
    assert spec.spec_id(day) == spec.spec_id(spec.load("in-car-day", ["seconds=20.0", 'description="x"']))
    assert spec.spec_id(day) != spec.spec_id(spec.load("in-car-day", ["sensor.noise=3"]))
    copy = tmp_path / "copy.toml"
    copy.write_text(spec.library()["in-car-day"])
    assert spec.spec_id(day) == spec.spec_id(spec.load(copy))


def test_the_schema_describes_the_file():
    schema = spec.json_schema()
    assert {option["$ref"].rpartition("/")[2] for option in schema["oneOf"]} == {
        "InCarFile",
        "MotorcycleLaneFile",
    }
    for name, table in (("InCarFile", "road"), ("MotorcycleLaneFile", "riders")):
        file = schema["$defs"][name]
        assert {"scene", "seconds", "rate", "sensor", table} <= set(file["properties"])
        assert file["additionalProperties"] is False
    json.dumps(schema)


@pytest.mark.parametrize(
    ("overrides", "parts"),
    [
        (["sensor.nois=3"], ["--set 'sensor.nois=3'", "did you mean 'noise'"]),
        (["sensr.noise=3"], ["did you mean 'sensor'"]),
        (["noise=3"], ["did you mean 'sensor.noise'"]),
        (["secnds=3"], ["did you mean 'seconds'"]),
        (["sensor.noise=nan"], ["sensor.noise is nan", "wanted a finite number"]),
        (["traffic.density=-1"], ["traffic.density is -1", "wanted greater than or equal to 0"]),
        (["camera.width=-640"], ["camera.width is -640"]),
        (["seconds=inf"], ["seconds is inf"]),
        (["seconds=0"], ["seconds is 0"]),
        (["sensor.noise=true"], ["wanted a number"]),
        (["camera.width=640.5"], ["wanted a whole number"]),
        (["light.time=dusk"], ["wanted 'day' or 'night'"]),
        (["sensor=3"], ["wanted a table of noise"]),
        (["seconds.x=3"], ["'seconds' is no table"]),
        (["sensor.noise"], ["wanted key=value"]),
        (["=3"], ["wanted key=value"]),
        (["sensor.noise=3 4"], ["no TOML value"]),
        (["sensor.noise=3\nseconds=1"], ["wanted key=value"]),
        (["ego.lane=3"], ["ego.lane is 3", "road.lanes, 3"]),
        (["road.min_radius=600"], ["road.max_radius, 500"]),
        (["traffic.vans=0.9"], ["wanted at most 1"]),
    ],
)
def test_wrong_overrides_are_refused_in_one_line(overrides, parts):
    with pytest.raises(SpecError) as caught:
        spec.load("in-car-day", overrides)
    message = str(caught.value)
    assert "\n" not in message
    assert all(part in message for part in parts), message


@pytest.mark.parametrize(
    ("overrides", "parts"),
    [
        (["riders.rider=3"], ["unknown key 'riders.rider'", "did you mean 'riders'"]),
        (["noise=3"], ["did you mean 'sensor.noise'"]),
        (["ego.speed=3"], ["unknown key 'ego'"]),
        (["light.flash=moon"], ["wanted 'none', 'sun' or 'lamp'"]),
        (["seconds.x=3"], ["'seconds' is no table"]),
    ],
)
def test_keys_are_those_of_the_own_scene(overrides, parts):
    with pytest.raises(SpecError) as caught:
        spec.load("lane-day", overrides)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ('scene = "in-car"\n[sensor]\nnois = 3\n', ["unknown key 'sensor.nois'", "did you mean 'noise'"]),
        ('scene = "in-car"\n[sensors]\nnoise = 3\n', ["unknown key 'sensors'", "did you mean 'sensor'"]),
        ('scene = "in-car"\n[camera]\nfocal = nan\n', ["camera.focal is nan"]),
        ('scene = "in-car"\n[camera]\nheight = -4\n', ["camera.height is -4"]),
        ("seconds = 3\n", ["'scene' is missing"]),
        ('scene = "moon"\n', ["scene is 'moon'", "wanted 'in-car' or 'motorcycle-lane'"]),
        ("scene = \n", ["not TOML", "line 1"]),
    ],
)
def test_wrong_files_are_refused_with_their_name(tmp_path, text, parts):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(SpecError) as caught:
        spec.load(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    assert all(part in message for part in parts), message


def test_unknown_scenarios_and_missing_files_are_refused(tmp_path):
    with pytest.raises(SpecError, match="did you mean 'in-car-day'"):
        spec.load("in-car-dya")
    with pytest.raises(SpecError, match="no scenario file"):
        spec.load(tmp_path / "none.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SpecError, match="cannot be read"):
        spec.load(binary)
    with pytest.raises(SpecError, match="cannot be read"):
        spec.load(f"{tmp_path}/")
