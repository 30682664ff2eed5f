"""Studies over many cells in parallel, what they keep on disk, stability maps."""
