"""Tests of railenv."""
