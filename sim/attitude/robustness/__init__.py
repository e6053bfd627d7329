"""Attitude filters on logs that are made harder in one way each.

========= ==============================================================
module    what it holds
========= ==============================================================
variants  changes of a log: cut, biased, resampled, turned, blinded
plan      lists of cases
runs      one log in every case through every filter
summary   means by group of cases, ratios to a published filter
========= ==============================================================
"""
