"""A machine that draws configurations, commands and cuts of datasets, and asks of each combination what must hold.

`draws` says what can be drawn, `rules` what is done with it, `oracles` what must hold.  tests/test_machine.py runs it.
"""
