"""Tests of what docs/reliability.md promises, in a short form."""
