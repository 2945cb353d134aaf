"""What follows from a grasp: why not, improving, tolerances, post-optimality."""

from ..files.public_names import public_names as _public_names

__all__, __getattr__, __dir__ = _public_names(__name__, __file__)
