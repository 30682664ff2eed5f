"""Sections of the report: what the package does, and how far controllers push the Hopf point."""

from agents.reproduction.overview import Overview
from agents.reproduction.section import HopfPush

__all__ = ["HopfPush", "Overview"]
