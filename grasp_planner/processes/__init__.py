"""Worker processes: jobs out, answers back; time limits, crashes and cancelling are taken care of."""

from .errors import JobError as JobError
from .errors import WorkerStartError as WorkerStartError
from .jobs import Job as Job
from .jobs import JobFunction as JobFunction
from .jobs import JobOutcome as JobOutcome
from .jobs import find_function as find_function
from .pool import JobPool as JobPool
from .pool import LocalPool as LocalPool
from .queueing import answers_in_order as answers_in_order
from .queueing import work_off as work_off
from .serving import JobContext as JobContext
from .worker_process import WorkerProcess as WorkerProcess
