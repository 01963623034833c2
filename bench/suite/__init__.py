"""What the rows of the benchmark share: volumes, rays, the oracle, clocks, goals."""
