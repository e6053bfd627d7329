"""Worlds: closed loops in which an estimator's outputs move what it measures next.

====== ============================================================================================
module what it holds
====== ============================================================================================
world  plant models, batched plants, playbacks and chunked sources
loop   a plant model drives a level record by record; where two loops differ first
====== ============================================================================================
"""
