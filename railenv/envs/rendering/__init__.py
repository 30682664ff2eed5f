"""Frames that show a running bogie: plan view, wheel-rail contact, strip chart, read-outs.

The renderer does not depend on environments; it draws a `Scene`. It needs pygame, the package's
optional extra ``render``, and no display unless a window is asked for.
"""

from railenv.envs.rendering.renderer import Renderer
from railenv.envs.rendering.scene import History, Outline, Scene

__all__ = ["History", "Outline", "Renderer", "Scene"]
