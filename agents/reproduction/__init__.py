"""Sections of the report: an overview of the package, and the Hopf point under control."""

from agents.reproduction.overview import Overview
from agents.reproduction.section import HopfPush

__all__ = ["HopfPush", "Overview"]
