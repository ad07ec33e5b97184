"""What stands beside the road: scattered by paper 1's eq. (12), lined up along its edge, or far on the horizon."""

from sim.scenery.place import place_scenery

__all__ = ["place_scenery"]
