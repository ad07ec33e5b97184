"""What stands beside the road: scattered by paper 1's eq. (12), in lines along its edge, or far away."""

from sim.scenery.place import place_scenery

__all__ = ["place_scenery"]
