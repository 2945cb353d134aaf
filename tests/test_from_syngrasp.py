"""The page and the notebook for users of SynGrasp name what exists, and leave out none of its functions."""

import json
import re
from operator import attrgetter

import grasp_planner as gp
from grasp_planner.hand.configuration import HandConfiguration

from .documents import ROOT

PAGE = (ROOT / "docs" / "from_syngrasp.md").read_text(encoding="utf-8")
ANALYSIS = re.findall(
    r"\w+",
    """
SGVcost SGcheckFriction SGforceManipulability SGgraspAnalysis SGgraspStiffness SGkinManipulability SGquasistatic
SGquasistaticHsolution SGquasistaticMaps SGrbMotions SGslide SG_PCR SG_PGRbruteforce SG_PGRh1 SG_PGRh4
SGdistSingularConfiguration SGgraspIsotropyIndex SGmanipEllipsoidVolume SGminSVG SGunifTransf SGcheckAngle SGCFtau
""",
)
MODELLING = re.findall(
    r"\w+",
    """
SGmakeFinger SGmakeHand SGmakeObject SGdefineSynergies SGactivateSynergies SGmoveHand SGfingertips SGblockJoints
SGunblockjoints SGcontactStiffness SGjointStiffness SGsynergyStiffness SGwristStiffness SGaddContact SGaddFtipContact
SGremoveContact SGcontact SGgraspMatrix SGjacobianMatrix SGselectionMatrix SGhMatrix SGgTildeMatrix SGcloseHand
SGcloseHandWithSynergies SGevaluateOffset SGgraspPlanner SGgenerateCloud SGDLRHandII SGparadigmatic SG3Fingered
SGhuman24DoF SGmodularHand SGunderActuated1 SGsantelloSynergies SGplotHand SGplotObject SGplotContactForces
""",
)


def test_every_function_of_syngrasp_has_a_row():
    rows = "\n".join(line for line in PAGE.splitlines() if line.startswith("|"))
    missing = [name for name in ANALYSIS + MODELLING if f"`{name}`" not in rows]
    assert not missing


def test_the_notebook_shows_what_replaces_the_functions_of_analysis():
    cells = json.loads((ROOT / "notebooks" / "07_from_syngrasp.ipynb").read_text(encoding="utf-8"))["cells"]
    code = "".join(line for cell in cells for line in cell["source"])
    slow_or_trivial = {"SGCFtau", "SG_PGRh1"}
    assert not [name for name in ANALYSIS if name.removeprefix("SG") not in code and name not in slow_or_trivial]


def test_what_the_page_names_exists():
    names = set(re.findall(r"`(?:…\.)?((?:model|analysis|Grasp|Hand\w*|SynergySpace)\.[\w.]+)", PAGE))
    assert len(names) > 40
    roots = {"HandConfiguration": HandConfiguration}
    for name in names:
        root, _, rest = name.rstrip(".").partition(".")
        target = roots.get(root) or getattr(gp, root)
        # What a value has as a field is no attribute of its class.
        known = rest in getattr(target, "__dataclass_fields__", {}) or attrgetter(rest)(target)
        assert known, name
