"""Tests of the design package."""
