"""What each verb says of itself: what it is for, and examples of its use."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["VERBS", "Text"]


class Text(NamedTuple):
    """Of one verb: one line, and command lines without ``boresight``, each with what it does."""

    summary: str
    examples: tuple[tuple[str, str], ...]


#: By name; `boresight.verbs.NAME` holds its arguments and what it does.
VERBS = {
    "new": Text(
        "Write an estimator to begin with, its world, a log and their test.",
        (
            ("new my_filter", "my_filter.py, my_filter.csv, test_my_filter.py, here"),
            ("new work/my_filter.py", "in another folder"),
        ),
    ),
    "list": Text(
        "Estimators, their parameters, experiments, configurations.",
        (("list", "for people"), ("list --json", "for programs")),
    ),
    "compile": Text(
        "Write Verilog, ISE project, microcode, register map, C, report.json.",
        (
            ("compile my_filter.py -o build", "a filter of one's own"),
            ("compile complementary mekf -o build", "two in one core; a register says which runs"),
            ("compile mekf --config fast --board mimas --synth -o build", "ISE project, estimates"),
            ("compile mekf my_filter.py --config small-1024 -o build", "with twice the registers"),
            ("compile my_filter.py --target generic --axi -o build", "for any part; behind AXI"),
            ("compile \"vqf(rate_hz=200, mag='none')\" -o build", "one that takes arguments"),
            ("compile complementary --urgent 3 -o build", "the first three outputs soonest"),
        ),
    ),
    "fit": Text(
        "Choose the formats of an estimator's values from runs; the other verbs take them.",
        (
            ("fit my_filter.py log.csv", "my_filter.fit.json, which every verb finds beside it"),
            ("fit my_filter.py folder world.py:World", "from several logs and a closed loop"),
            ("fit mekf log.csv -o mekf.fit.json", "for: check mekf log.csv --profile FILE"),
        ),
    ),
    "run": Text(
        "Run an estimator on a log; one row out per row in.",
        (
            ("run my_filter.py log.csv --on fixed -o out.csv", "the integers of the core"),
            ("run mekf log.csv --on float", "float64, compiled; out: mekf-float.csv"),
            ("run mekf log.csv --params tuned.json --param r_acc=0.02", "with other parameters"),
        ),
    ),
    "check": Text(
        "Prove integer model, C and RTL equal on logs, bit by bit, and near float64.",
        (
            ("check my_filter.py log.csv", "all levels"),
            ("check mekf first.csv folder", "several logs, or folders of logs"),
            ("check mekf log.csv --levels fixed,c --word 24", "without RTL, in narrow words"),
            ("check complementary,mekf log.csv", "taking turns on one core"),
            ("check mekf,pi.py mekf=log.csv pi=motor.csv", "each with its own log"),
            ("check replay reproducer.json", "a difference that was found, again"),
        ),
    ),
    "report": Text(
        "Check, estimate and write report.html and report.json.",
        (
            ("report my_filter.py log.csv -o report", "one page about it"),
            ("report mekf log.csv --no-synth -o report", "sooner: no area, no clock"),
            ("report mekf folder --widths -o report", "several logs; words of 18 to 32 bits"),
            ("report mekf log.csv --against old/report.json", "what differs from another run"),
        ),
    ),
    "tune": Text(
        "Fit parameters to logs with truth, in the open, with cross-validation.",
        (
            ("tune my_filter.py folder -o tuned.json", "then: run ... --params tuned.json"),
            ("tune mekf folder --folds 3 --detune 3", "what is left from a detuned start"),
            ("tune mekf folder --protocol short --hold cases", "is one case paid for by another?"),
            ("tune mekf folder --protocol short --rounds 0 --vary 1.25", "sensitivities alone"),
            ("tune my_filter.py log.csv --only alpha --weight vel=0.5", "one, with weights"),
        ),
    ),
    "accuracy": Text(
        "Error of our estimators and of published ones on logs with truth.",
        (
            ("accuracy", "at a glance: our filters, VQF, carriers that never rest"),
            ("accuracy my_filter.py log.csv", "each output in its unit"),
            ("accuracy all folder -o build", "ours beside VQF, Madgwick, Mahony, an EKF"),
            ("accuracy mekf,vqf_online folder --protocol full", "cut, biased, blinded, ..."),
        ),
    ),
    "convert": Text(
        "A published data set's files (BROAD) to logs.",
        (("convert broad broad/data_mat -o logs", "needs scipy"),),
    ),
    "experiment": Text(
        "A published experiment in simulation: page and JSON.",
        (
            ("experiment ma2014 -o build", "the 2014 paper's tables and figures"),
            ("experiment satcom --runs 2 -o build", "an antenna on a vehicle, in closed loop"),
            ("experiment my_experiment.py:Mine", "one's own"),
        ),
    ),
    "demo": Text(
        "The main job: one core with all filters, both configurations, proven on the "
        "bundled recording.",
        (("demo -o build", "what `make` does"),),
    ),
    "bench": Text(
        "Interpreter against C on 10,000,000 updates, and their rates.",
        (
            ("bench", "the filters of the main job"),
            ("bench my_filter.py --updates 100000", "one's own, for less long"),
        ),
    ),
    "covariance": Text(
        "Millions of hostile updates: does a filter's covariance stay positive, and with float64?",
        (
            ("covariance mekf", "10,000,000 updates"),
            ("covariance kalman.py --updates 200000", "one's own: states p00, p01, p11"),
        ),
    ),
    "montecarlo": Text(
        "Many draws of a world: errors, NEES, NIS and spread against the bound.",
        (("montecarlo my_filter.py my_filter.py --runs 500 -o build", "a world and an estimator"),),
    ),
    "monitor": Text(
        "Attitudes and registers of a board, from its serial port or a capture.",
        (
            ("monitor /dev/ttyUSB0", "attitudes, until Ctrl-C"),
            ("monitor capture.bin --csv out.csv --plot out.png", "of a capture"),
            ("monitor /dev/ttyUSB0 --map registers.json --write filter=1", "another filter"),
        ),
    ),
    "simulate": Text(
        "The complete board, sensors at its pins; or a world and an estimator in a closed loop.",
        (
            ("simulate my_filter.py my_filter.py --on rtl", "a world and an estimator in a file"),
            ("simulate plant.py:Plant pi.py:Pi -o loop.csv", "what the loop saw, as a log"),
            ("simulate mekf --seconds 1", "the board"),
            ("simulate pointing.py --feed east=0.6", "one's own, behind the filter that it reads"),
            ("simulate --faults", "every fault of both sensors"),
        ),
    ),
    "doctor": Text(
        "Which tools are here, and what is missing.",
        (("doctor", "all of them"), ("doctor --clear-cache", "empty the build cache")),
    ),
}
