"""Tracks and truth in the formats that other tools read."""
