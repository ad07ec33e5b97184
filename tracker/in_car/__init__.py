"""Paper 1: vehicles ahead of an in-car camera, by the motion of vertical profiles."""
