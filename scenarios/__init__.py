"""Joins simulator and trackers: named scenarios, the loop, scores and reports."""
