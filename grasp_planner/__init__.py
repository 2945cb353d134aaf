"""Task-specific grasp planning and analysis for synergy-driven (underactuated) robot hands.

The flow: URDF hand → synergies → contacts → forces and task metric → planning problem → solver → grasp → check
and view. Equation numbers throughout are those of [Mavrogiannis2014]: C. I. Mavrogiannis, C. P. Bechlioulis,
M. V. Liarokapis, K. J. Kyriakopoulos, "Task-Specific Grasp Selection for Underactuated Hands", ICRA 2014.

The public names are listed in ``__init__.pyi`` and imported when they are first used.
"""

from .files.public_names import public_names as _public_names

__version__ = "0.1.0"
__all__, __getattr__, __dir__ = _public_names(__name__, __file__)
