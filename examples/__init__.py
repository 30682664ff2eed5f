"""Examples that are also run by the tests."""
