"""Contact of wheel and rail: the patch, Kalker's coefficients, and creep forces to compare laws with."""
