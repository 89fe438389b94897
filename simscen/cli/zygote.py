"""The program of the warm process: `python -I -m simscen.cli.zygote FD`. Not for people."""

import sys

import simscen.sim.simulation
import simscen.stack.build  # noqa: F401 - imported so that the forks need not
from simscen.report.picture import draw_run
from simscen.run.perform import Performed, perform
from simscen.run.worker import Progress
from simscen.run.workshop import Workshop
from simscen.run.zygote import Zygote
