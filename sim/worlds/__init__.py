"""Worlds: closed loops in which an estimator's outputs move what it measures next.

====== ============================================================================================
module what it holds
====== ============================================================================================
world  what a world is
loop   a world and a level, step by step; several levels, and where their loops part
fleet  many draws of one world at once, on the integer C
road   a vehicle on a road; dish: an antenna and its link
====== ============================================================================================
"""
