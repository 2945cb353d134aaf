"""Simulation in MuJoCo (optional extra ``simulate``): does a planned grasp hold, moved by its synergies alone?"""

from .engine import SimulationDependencyError as SimulationDependencyError
from .gate import GateReport as GateReport
from .off_plan import Survival as Survival
from .off_plan import simulated_loss as simulated_loss
from .off_plan import survival as survival
from .protocol import PROTOCOLS as PROTOCOLS
from .protocol import Protocol as Protocol
from .protocol import error_protocol as error_protocol
from .protocol import find_protocol as find_protocol
from .protocol import protocol_from as protocol_from
from .result import DirectionReport as DirectionReport
from .result import Frame as Frame
from .result import RestReport as RestReport
from .result import Simulation as Simulation
from .run import simulate_grasp as simulate_grasp
from .run import squeezed as squeezed
from .scene import Scene as Scene
from .scene import build_scene as build_scene
from .simulation_record import simulation_json as simulation_json
from .simulation_record import simulation_record as simulation_record
from .world import World as World
