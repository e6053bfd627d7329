"""Tolerances of outputs in place of the declared ones: how exact is enough for one build.

They decide what is judged and refused, not a bit of the program.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace

from boresight.model.declarations import ATTITUDE, ATTITUDE_DEG, QUATERNION, Output
from boresight.model.errors import listed, require
from boresight.model.settings import CURRENT
from boresight.model.units import conversion

_TEXT = re.compile(r"\s*(\w+)\s*=\s*((?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


def judged_outputs(estimator: str, outputs: tuple[Output, ...]) -> tuple[Output, ...]:
    """Return the outputs of an estimator, with the tolerances of `model.settings`.

    Their texts are ``NAME=NUMBER`` or ``NAME=NUMBERunit``. InputError: a text of another form, an
    output that the estimator does not have, a unit of another kind.
    """
    judged = {o.name: o for o in outputs}
    for text in CURRENT.get().tolerances:
        match, where = _TEXT.fullmatch(text), "--tolerance"
        name, number, unit = match.groups() if match else ("", "nan", "")
        limit = float(number)
        fix = f"write for example --tolerance {outputs[0].name}=0.05{outputs[0].unit}"
        wanted = "OUTPUT=NUMBER, 0 or more, with or without a unit"
        require(math.isfinite(limit), where, wanted, text, fix)
        rotates = judged.keys() >= {*QUATERNION}
        names, attitude = [*judged, *[ATTITUDE] * rotates], rotates and name == ATTITUDE
        fix = "choose one of its outputs; estimators with others are judged one by one"
        wanted = f"an output of {estimator}: {listed(name, names)}"
        require(name in names, where, wanted, name, fix)
        output_unit = "deg" if attitude else judged[name].unit
        factor, _ = conversion(f"{where} {text}", name, unit, output_unit) if unit else (1.0, 0.0)
        limit *= factor / (ATTITUDE_DEG if attitude else 1.0)
        for changed in QUATERNION if attitude else (name,):
            judged[changed] = replace(judged[changed], tolerance=limit)
    return tuple(judged.values())
