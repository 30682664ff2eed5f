"""Benchmarks: ``python -m benchmarks.run`` (or ``make bench``) measures and prints one table."""
