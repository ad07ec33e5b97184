"""The scenes: each populates a world and places its camera."""
