"""Batch planning: many cases from one specification, on all cores or a cluster, into Parquet files."""

from . import arrow as arrow
from .browse import RunFilter as RunFilter
from .browse import RunRows as RunRows
from .case import GraspCase as GraspCase
from .errors import BatchDependencyError as BatchDependencyError
from .errors import ResultsError as ResultsError
from .errors import SchedulerError as SchedulerError
from .errors import SpecError as SpecError
from .expand import CaseTable as CaseTable
from .progress import BatchProgress as BatchProgress
from .results import find_rows as find_rows
from .results import load_grasps as load_grasps
from .results import load_row as load_row
from .results import load_rows as load_rows
from .results import load_table as load_table
from .runner import BatchSummary as BatchSummary
from .runner import run_batch as run_batch
from .spec import BatchSpec as BatchSpec
from .spec import parse_spec as parse_spec
from .spec import read_spec as read_spec
