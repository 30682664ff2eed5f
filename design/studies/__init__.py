"""Studies over many cells in parallel, their stored results, stability maps."""
