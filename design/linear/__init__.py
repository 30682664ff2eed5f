"""Linear models: equilibria, linearisation, reduction, regulators."""
