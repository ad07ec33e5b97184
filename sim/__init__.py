"""The simulated world and its cameras. It knows no tracker.

Importing it registers the environments (`sim.env`) with gymnasium, and does no more.
"""

from gymnasium.envs.registration import register

_ENVIRONMENTS = {
    "Aerial": ("AerialEnv", "aerial-convoy"),
    "InCar": ("InCarEnv", "in-car-day"),
    "MotorcycleLane": ("MotorcycleLaneEnv", "lane-day"),
}
for _name, (_class, _scenario) in _ENVIRONMENTS.items():
    register(f"testtrack/{_name}-v0", f"sim.env:{_class}", kwargs={"scenario": _scenario})
