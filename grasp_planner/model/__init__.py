"""The paper, one documented formula a function: contacts, friction, compliance, task, force closure."""

from ..files.public_names import public_names as _public_names

__all__, __getattr__, __dir__ = _public_names(__name__, __file__)
