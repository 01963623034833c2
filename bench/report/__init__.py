"""Plots, docs/benchmarks.md and the README, made from the results."""
