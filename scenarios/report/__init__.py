"""Plots, annotated video and one self-contained HTML page."""
