"""What can be set in a scene: frozen models, checked when they are built. A scenario file fills them in."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

NonNegative = Annotated[FiniteFloat, Field(ge=0)]
Positive = Annotated[FiniteFloat, Field(gt=0)]
Fraction = Annotated[FiniteFloat, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=0)]


class Params(BaseModel):
    """Base of all parameter models: frozen, and a key that it does not know is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class CameraParams(Params):
    """The pinhole camera and where it is mounted on the car."""

    width: Annotated[int, Field(ge=16, le=4096)] = 640
    height: Annotated[int, Field(ge=16, le=4096)] = 480
    focal: Positive = 800.0
    """Pixels."""
    mount_height: Positive = 1.2
    """Metres above the ground."""
    mount_forward: FiniteFloat = 0.6
    """Metres before the middle of the car."""
    pitch: FiniteFloat = 0.0
    """Radians, positive looks up."""


class RoadParams(Params):
    """A carriageway each way; keep right."""

    lanes: Annotated[int, Field(ge=1, le=5)] = 2
    """Lanes the ego's way."""
    oncoming_lanes: Annotated[int, Field(ge=0, le=5)] = 2
    lane_width: Positive = 3.6
    median: NonNegative = 1.0
    """Metres between the two directions' innermost lane edges."""
    shoulder: NonNegative = 2.0
    """Paved metres outside the outermost lane."""
    curved: bool = False
    """Straights joined by arcs instead of one straight."""
    min_radius: Positive = 150.0
    max_radius: Positive = 500.0


class TrafficParams(Params):
    """Who drives, how densely and how fast."""

    density: NonNegative = 14.0
    """Vehicles per kilometre and lane, the ego's way."""
    oncoming_density: NonNegative = 10.0
    speed: NonNegative = 22.0
    """Mean desired speed, m/s."""
    speed_spread: NonNegative = 3.0
    """Standard deviation of the desired speeds, m/s."""
    vans: Fraction = 0.12
    lorries: Fraction = 0.10
    buses: Fraction = 0.03
    parked: NonNegative = 0.0
    """Parked cars per kilometre of kerb."""
    stop_and_go: bool = False
    """The leaders brake to a stop and drive on, again and again."""


class EgoParams(Params):
    """The camera car."""

    driver: Literal["traffic", "profile", "actions"] = "traffic"
    speed: NonNegative = 20.0
    """Desired speed, m/s."""
    lane: Annotated[int, Field(ge=-1)] = -1
    """Lane from the left, -1 drawn from the seed."""
    pitch_vibration: NonNegative = 0.0012
    """Standard deviation, rad."""
    speed_noise: NonNegative = 0.1
    """Odometry, standard deviation, m/s."""
    yaw_noise: NonNegative = 0.002
    """Odometry, standard deviation, rad/s."""


class SceneryParams(Params):
    """What stands beside the road."""

    setting: Literal["motorway", "rural", "urban", "avenue"] = "motorway"
    corridor: Positive = 5.0
    """D of paper 1's eq. (12): scale of the empty corridor around the camera, metres."""
    density: NonNegative = 1.0
    """Multiplies every count."""
    bridges: NonNegative = 0.3
    """Overhead bridges per kilometre."""


class LightParams(Params):
    """Sun, sky, lamps and weather."""

    time: Literal["day", "night"] = "day"
    cloud: Fraction = 0.3
    haze: NonNegative = 0.0006
    """Extinction per metre."""
    rain: Fraction = 0.0
    street_lamps: bool = False


class SensorParams(Params):
    """What the camera does to the picture."""

    noise: NonNegative = 1.5
    """Standard deviation at mid grey, of 255."""
    blur: NonNegative = 0.6
    """Lens blur, standard deviation, px."""
    sharpening: NonNegative = 0.8
    """By the camera's own processing: share of the difference from a blurred picture that is added."""
    vignetting: Fraction = 0.25
    """Loss of light in the corners."""
    exposure_lag: NonNegative = 0.5
    """Seconds that the automatic exposure takes."""
    compression: Annotated[int, Field(ge=0, le=100)] = 30
    """0 for none; above, the loss of the recorder's JPEG coder (quality = 100 - compression)."""


class InCarParams(Params):
    """A drive, seen from a camera in a car."""

    camera: CameraParams = CameraParams()
    road: RoadParams = RoadParams()
    traffic: TrafficParams = TrafficParams()
    ego: EgoParams = EgoParams()
    scenery: SceneryParams = SceneryParams()
    light: LightParams = LightParams()
    sensor: SensorParams = SensorParams()


class LaneCameraParams(Params):
    """The camera on a mast beside the lane; it never moves."""

    width: Annotated[int, Field(ge=16, le=4096)] = 360
    height: Annotated[int, Field(ge=16, le=4096)] = 240
    focal: Positive = 380.0
    """Pixels."""
    mount_height: Positive = 7.5
    """Metres above the ground."""
    mount_offset: FiniteFloat = -3.5
    """Metres to the left of the lane's middle."""
    yaw: FiniteFloat = 0.10
    """Radians to the left of the lane's direction."""
    pitch: FiniteFloat = -0.43
    """Radians, positive looks up."""


class LaneParams(Params):
    """The lane of motorcycles."""

    width: Annotated[FiniteFloat, Field(ge=2)] = 5.0
    """Metres that riders use."""
    shoulder: NonNegative = 1.2
    """Paved metres beside it."""


class RiderParams(Params):
    """Who rides, how densely and how fast."""

    riders: Annotated[int, Field(ge=0, le=80)] = 13
    """The most that are between the entry and the far end of the view."""
    speed: Positive = 8.0
    """Mean desired speed, m/s."""
    speed_spread: NonNegative = 1.4
    """Standard deviation of the desired speeds, m/s."""
    weave: NonNegative = 0.35
    """Metres by which riders swing about the offset that they like."""
    wrong_way: Count = 0
    """Riders who come the wrong way."""
    wrong_way_at: Annotated[FiniteFloat, Field(ge=-3)] = -2.5
    """Seconds from which on the first of them comes, at first out of view."""
    parked: Count = 0
    """Riders who stop at the kerb and leave again."""
    parked_at: Annotated[FiniteFloat, Field(ge=-3)] = -2.5
    """Seconds from which on the first of them pulls over; before 0 it does so already when the run begins."""
    stand: NonNegative = 6.0
    """Seconds that they stand."""


class LaneSceneryParams(SceneryParams):
    """What stands beside the lane, and how the wind moves it."""

    setting: Literal["motorway", "rural", "urban", "avenue"] = "avenue"
    corridor: Positive = 4.0
    density: NonNegative = 3.5
    bridges: NonNegative = 0.0
    wind: NonNegative = 0.7
    """How far plants sway, in hundredths of their height."""


class LaneLightParams(LightParams):
    """Sun and sky, and how they change while the camera looks."""

    cloud: Fraction = 0.4
    passing: Fraction = 0.0
    """Share of the sun's light that passing clouds take, over seconds."""
    flash: Literal["none", "sun", "lamp"] = "none"
    """What comes on at once: the sun from behind a cloud, or a strong lamp."""
    flash_at: NonNegative = 5.0
    """Seconds after which it does."""


class MotorcycleLaneParams(Params):
    """A lane of motorcycles, seen from a camera that stands still."""

    camera: LaneCameraParams = LaneCameraParams()
    lane: LaneParams = LaneParams()
    riders: RiderParams = RiderParams()
    scenery: LaneSceneryParams = LaneSceneryParams()
    light: LaneLightParams = LaneLightParams()
    sensor: SensorParams = SensorParams()


class AerialCameraParams(Params):
    """The camera below the platform."""

    width: Annotated[int, Field(ge=16, le=4096)] = 640
    height: Annotated[int, Field(ge=16, le=4096)] = 480
    focal: Positive = 800.0
    """Pixels."""
    tilt: Annotated[FiniteFloat, Field(ge=0, le=0.7)] = 0.22
    """Radians from straight down, toward the picture's upper edge."""


class PlatformParams(Params):
    """How the platform flies."""

    driver: Literal["script", "actions"] = "script"
    """Who moves it: actions in place of `speed`, `sway` and the convoy; wind still moves it a little."""
    altitude: Annotated[FiniteFloat, Field(ge=60, le=400)] = 185.0
    """Metres above the ground, in the mean."""
    climb: Annotated[FiniteFloat, Field(ge=0, le=0.4)] = 0.06
    """How far the altitude swings, as a part of it."""
    speed: FiniteFloat = 0.0
    """M/s along the road; a convoy is followed instead."""
    roam: NonNegative = 14.0
    """Metres that the aim swings about its place on the ground."""
    sway: NonNegative = 0.0
    """Metres that the aim swings along the road: vehicles leave the picture and come back."""
    turn: NonNegative = 0.12
    """Radians that the heading swings."""
    jitter: NonNegative = 1.2
    """Standard deviation of the shake, px."""


class AerialRoadParams(Params):
    """The road network, and the bridges over it."""

    network: Literal["motorway", "intersection", "u-turn", "winding"] = "motorway"
    lanes: Annotated[int, Field(ge=1, le=4)] = 3
    """Lanes each way; an intersection's approaches have one more, to turn left."""
    lane_width: Annotated[FiniteFloat, Field(ge=2.8, le=4.5)] = 3.6
    bridges: Annotated[int, Field(ge=0, le=4)] = 1
    bridge_width: Annotated[FiniteFloat, Field(ge=4, le=60)] = 24.0
    """Metres from parapet to parapet; single bridges stray from it by a tenth."""


class AerialTrafficParams(TrafficParams):
    """Who drives below, and how hard they are to tell apart."""

    density: NonNegative = 28.0
    oncoming_density: NonNegative = 24.0
    speed: NonNegative = 13.0
    speed_spread: NonNegative = 1.8
    vans: Fraction = 0.10
    lorries: Fraction = 0.07
    buses: Fraction = 0.02
    waves: Fraction = 0.92
    """How much slower than free traffic the troughs of the waves are that run through a dense stream."""
    lookalikes: Fraction = 0.85
    """Share of the vehicles that are of one of `looks` models and paints."""
    looks: Annotated[int, Field(ge=1, le=8)] = 2
    convoy: Annotated[int, Field(ge=0, le=20)] = 0
    """Vehicles that drive one behind another; the platform follows them."""
    bridge_density: NonNegative = 14.0
    """Vehicles per kilometre and lane on the roads over the bridges."""


class AerialSceneryParams(Params):
    """What stands beside the road."""

    setting: Literal["open", "suburb", "town"] = "open"
    trees: NonNegative = 1.0
    """Multiplies the trees."""
    overhang: NonNegative = 6.0
    """Trees per kilometre of each roadside whose crowns hang over the outer lane."""
    buildings: NonNegative = 1.0
    """Multiplies the buildings."""
    wind: NonNegative = 0.4
    """How far plants sway, in hundredths of their height."""


class RecordingParams(Params):
    """Recorded traffic in place of simulated."""

    path: str = ""
    """CommonRoad XML, or a table of vehicles as Geo-trax writes it; empty for none."""
    start: NonNegative = 0.0
    """Seconds into the recording at which the run begins."""


class AerialParams(Params):
    """Traffic seen from a platform in the air."""

    camera: AerialCameraParams = AerialCameraParams()
    platform: PlatformParams = PlatformParams()
    road: AerialRoadParams = AerialRoadParams()
    traffic: AerialTrafficParams = AerialTrafficParams()
    recording: RecordingParams = RecordingParams()
    scenery: AerialSceneryParams = AerialSceneryParams()
    light: LaneLightParams = LaneLightParams(cloud=0.25, passing=0.25, haze=0.0004)
    sensor: SensorParams = SensorParams(noise=2.0, vignetting=0.18)
