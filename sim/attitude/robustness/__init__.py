"""Every filter on the same trials, made harder one way at a time.

========= ======================================================================================
module    what it holds
========= ======================================================================================
variants  what is done to a trial: cut, biased, resampled, turned, blinded, noisier
plan      protocols: which variants, of which trials
runs      one trial in all its variants through every filter; dealt to processes, with a journal
summary   means, ratios to the rival, the worst trials
worse     single runs that are worse than the rival's, and what the field did meanwhile
cells     logs in the cases of a protocol, as parameters are tuned on them
page      the page, with its tables and plots
========= ======================================================================================
"""
