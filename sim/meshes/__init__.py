"""Meshes of everything that stands or drives in a scene, made from proportions alone."""

from sim.meshes.catalogue import catalogue

__all__ = ["catalogue"]
