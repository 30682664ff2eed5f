"""The section of the reproduction report on controllers: how far each pushes the Hopf point."""

from agents.reproduction.section import HopfPush

__all__ = ["HopfPush"]
