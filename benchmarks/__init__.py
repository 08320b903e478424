"""Benchmarks: each prints a ratio against a peer run side by side, and keeps its record."""
