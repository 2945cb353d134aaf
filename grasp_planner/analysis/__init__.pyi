"""The analyses of a grasp, each with the file it is in."""

from ..judge.clearance_check import Clearance as Clearance
from ..judge.clearance_check import hand_clearances as hand_clearances
from ..judge.margins import GraspMargins as GraspMargins
from ..judge.margins import Margin as Margin
from ..judge.stability import Stability as Stability
from .improve import Improvement as Improvement
from .improve import improve_grasp as improve_grasp
from .problem_parameters import Parameter as Parameter
from .problem_parameters import parameters_of as parameters_of
from .retreat import RetreatReport as RetreatReport
from .retreat import retreat_distance as retreat_distance
from .sensitivity import PostOptimality as PostOptimality
from .sensitivity import Sensitivity as Sensitivity
from .sensitivity import optimum_near as optimum_near
from .sensitivity import post_optimality as post_optimality
from .tolerance import Tolerance as Tolerance
from .tolerance import pose_tolerances as pose_tolerances
from .why_not import Change as Change
from .why_not import Diagnosis as Diagnosis
from .why_not import explain_infeasibility as explain_infeasibility
from .why_not import least_violated_point as least_violated_point
