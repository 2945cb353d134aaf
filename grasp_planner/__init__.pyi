"""The public names, each with the module it is in: the one list, read when the package is imported."""

from . import analysis as analysis
from . import model as model
from .exceptions import FileFormatError as FileFormatError
from .exceptions import GraspPlannerError as GraspPlannerError
from .exceptions import InvalidValueError as InvalidValueError
from .exceptions import NameNotFoundError as NameNotFoundError
from .grasp.grasp import Grasp as Grasp
from .hand.description import hand_library as hand_library
from .hand.hand import Hand as Hand
from .hand.loading import load_hand as load_hand
from .model.task_direction import TaskDirection as TaskDirection
from .model.task_direction import force_task as force_task
from .model.task_direction import parse_task as parse_task
from .model.task_direction import torque_task as torque_task
from .model.task_direction import twist_task as twist_task
from .objects import Box as Box
from .objects import Capsule as Capsule
from .objects import Cylinder as Cylinder
from .objects import EllipsoidObject as EllipsoidObject
from .objects import GraspObject as GraspObject
from .objects import MeshObject as MeshObject
from .objects import Sphere as Sphere
from .objects import parse_object as parse_object
from .planning.planner import plan_grasp as plan_grasp
from .planning.planner import plan_grasps as plan_grasps
from .planning.starts import GraspStart as GraspStart
from .planning.starts import random_start as random_start
from .planning.starts import standard_start as standard_start
from .problem.clearance_options import ClearanceOptions as ClearanceOptions
from .problem.load_cases import LoadCases as LoadCases
from .problem.parameters import GraspParameters as GraspParameters
from .problem.problem import GraspProblem as GraspProblem
from .problem.search_options import PlannerOptions as PlannerOptions
from .records.grasp_files import grasp_json as grasp_json
from .records.grasp_files import read_grasp_record as read_grasp_record
from .records.grasp_record import grasp_from_record as grasp_from_record
from .synergies.space import SynergySpace as SynergySpace
from .synergies.space import load_synergies as load_synergies
from .synergies.space import save_synergies as save_synergies
from .synergies.space import synergies_from_postures as synergies_from_postures

__version__: str
