"""The interactive viewer: a page in the browser on which a person understands and steers a grasp.

Drawing (``draw_*``, ``picture3d``), state (``live``, ``session``), the work (``worker``, ``planning``) and the
widgets (``panel_*``) are apart; :mod:`~grasp_planner.viewer.app` puts them together.
"""

from .app import GraspViewer as GraspViewer
from .export import export_html as export_html
from .export import grasp_html as grasp_html
from .first_grasp import first_grasp as first_grasp
from .simulation_page import export_simulation_html as export_simulation_html
from .simulation_page import simulation_html as simulation_html
