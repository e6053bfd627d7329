"""Worlds: closed loops in which an estimator's outputs determine its next measurements.

====== ============================================================================================
module what it holds
====== ============================================================================================
world  plant models, batched plants, records in pieces without feedback
loop   a plant model or a log drives a level; where two loops differ first
====== ============================================================================================
"""
