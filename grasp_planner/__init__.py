"""Task-specific grasp planning and analysis for synergy-driven (underactuated) robot hands.

The flow: URDF hand → synergies → contacts → forces and task metric → planning problem → solver → grasp → check
and view. Equation numbers throughout are those of [Mavrogiannis2014]: C. I. Mavrogiannis, C. P. Bechlioulis,
M. V. Liarokapis, K. J. Kyriakopoulos, "Task-Specific Grasp Selection for Underactuated Hands", ICRA 2014.
"""

from .clearance_check import Clearance as Clearance
from .clearance_check import hand_clearances as hand_clearances
from .clearance_options import ClearanceOptions as ClearanceOptions
from .compliance import actual_posture as actual_posture
from .compliance import contact_forces as contact_forces
from .compliance import hand_stiffness as hand_stiffness
from .compliance import internal_forces as internal_forces
from .compliance import joint_torques as joint_torques
from .compliance import series_stiffness as series_stiffness
from .compliance import weighted_right_inverse as weighted_right_inverse
from .contacts import Contacts as Contacts
from .contacts import find_contacts as find_contacts
from .contacts import fingertip_positions as fingertip_positions
from .contacts import grasp_matrix as grasp_matrix
from .contacts import hand_jacobian as hand_jacobian
from .contacts import synergy_jacobian as synergy_jacobian
from .exceptions import FileFormatError as FileFormatError
from .exceptions import GraspPlannerError as GraspPlannerError
from .exceptions import InvalidValueError as InvalidValueError
from .exceptions import NameNotFoundError as NameNotFoundError
from .force_closure import force_closure_margin as force_closure_margin
from .force_closure import force_norm_floor as force_norm_floor
from .friction import force_norm as force_norm
from .friction import friction_margins as friction_margins
from .friction import normal_forces as normal_forces
from .grasp import Grasp as Grasp
from .grasp import IterationRecord as IterationRecord
from .grasp import SearchReport as SearchReport
from .hand import ContactFrame as ContactFrame
from .hand import Hand as Hand
from .hand import load_hand as load_hand
from .hand_description import hand_library as hand_library
from .kinematics import HandKinematics as HandKinematics
from .load_cases import LoadCases as LoadCases
from .margins import GraspMargins as GraspMargins
from .margins import Margin as Margin
from .objects import Box as Box
from .objects import Capsule as Capsule
from .objects import Cylinder as Cylinder
from .objects import EllipsoidObject as EllipsoidObject
from .objects import GraspObject as GraspObject
from .objects import MeshObject as MeshObject
from .objects import MeshWarning as MeshWarning
from .objects import Sphere as Sphere
from .objects import parse_object as parse_object
from .planner import PlannerOptions as PlannerOptions
from .planner import plan_grasp as plan_grasp
from .problem import GraspParameters as GraspParameters
from .problem import GraspProblem as GraspProblem
from .record import grasp_from_record as grasp_from_record
from .record import grasp_json as grasp_json
from .record import grasp_record as grasp_record
from .record import read_grasp_record as read_grasp_record
from .record import record_schema as record_schema
from .retreat import RetreatReport as RetreatReport
from .retreat import retreat_distance as retreat_distance
from .stability import Stability as Stability
from .starts import GraspStart as GraspStart
from .starts import random_start as random_start
from .starts import standard_start as standard_start
from .synergies import SynergySpace as SynergySpace
from .synergies import load_synergies as load_synergies
from .synergies import save_synergies as save_synergies
from .synergies import synergies_from_postures as synergies_from_postures
from .task import Ellipsoid as Ellipsoid
from .task import TaskDirection as TaskDirection
from .task import alignment_deg as alignment_deg
from .task import force_task as force_task
from .task import force_transmission_ratio as force_transmission_ratio
from .task import object_synergy_map as object_synergy_map
from .task import parse_task as parse_task
from .task import restricted_velocity_ratio as restricted_velocity_ratio
from .task import task_index as task_index
from .task import torque_task as torque_task
from .task import transmission_ellipsoid as transmission_ellipsoid
from .task import twist_task as twist_task
from .task import velocity_transmission_ratio as velocity_transmission_ratio
from .why_not import Change as Change
from .why_not import Diagnosis as Diagnosis
from .why_not import explain_infeasibility as explain_infeasibility
from .why_not import least_violated_point as least_violated_point

__version__ = "0.1.0"
