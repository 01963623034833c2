"""From the results to pictures, docs/benchmarks.md and the README."""
