"""Run a script in the yosys of the package ``pyosys``: ``-q`` prints nothing but errors.

``-ql LOG SCRIPT``, as SymbiYosys calls yosys, writes no log.

A program of its own, so that a script which yosys refuses ends this process only.
"""

import os
import sys

from pyosys import libyosys

if __name__ == "__main__":
    *options, form, script = sys.argv[1:]
    if "-q" in options:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    libyosys.run_pass(script if form == "-p" else f"script {script}", libyosys.Design())
