"""Tests of the reproduction report."""
