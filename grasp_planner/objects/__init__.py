"""What is grasped: objects with a smooth signed distance, a mass and a text form ``shape:key=value,…``."""

from .base import GraspObject as GraspObject
from .base import SurfaceSample as SurfaceSample
from .ellipsoid import EllipsoidObject as EllipsoidObject
from .mesh_file import MeshWarning as MeshWarning
from .mesh_object import MeshObject as MeshObject
from .mesh_solid import MeshSolid as MeshSolid
from .primitives import Box as Box
from .primitives import Capsule as Capsule
from .primitives import Cylinder as Cylinder
from .primitives import Sphere as Sphere
from .text import SHAPES as SHAPES
from .text import parse_object as parse_object
